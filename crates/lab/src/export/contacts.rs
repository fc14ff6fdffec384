//! Contacts of a ladder as contacts of IEC 61131-3.
//!
//! A compare and an edge become a bit of their own, which is computed in a network right before the
//! one that reads it: at the moment at which rungd evaluates the contact. An edge has a second bit,
//! with what it saw last; it begins OFF, as in rungd, so that no F_TRIG stands for it (which is ON
//! in the first scan).

use super::functions;
use super::literals::CallLiteral;
use super::project::{CallSource, NetworkPower, on};
use super::refusal::ExportRefusal;
use super::rung_acts::{ExportedNumber, RungExport};
use rungd_language::resolve::program::{Comparison, ComputedContact, Contact, Value};
use rungd_language::source::span::Span;

impl RungExport<'_, '_> {
    /// Contacts in series.
    pub(super) fn series(&mut self, contacts: &[Contact]) -> Result<NetworkPower, ExportRefusal> {
        let powers: Result<Vec<NetworkPower>, ExportRefusal> =
            contacts.iter().map(|contact| self.power(contact)).collect();
        powers.map(NetworkPower::all)
    }

    /// A contact.
    fn power(&mut self, contact: &Contact) -> Result<NetworkPower, ExportRefusal> {
        let mut all = |parts: &[Contact]| -> Result<Vec<NetworkPower>, ExportRefusal> {
            parts.iter().map(|part| self.power(part)).collect()
        };
        match contact {
            Contact::All(parts, _) => all(parts).map(NetworkPower::all),
            Contact::Any(parts, _) => all(parts).map(NetworkPower::any),
            Contact::Not(inner, _) => self.power(inner).map(NetworkPower::opposite),
            Contact::Bit(bit, span) => self.bit(*bit, *span),
            Contact::Edge(edge, inner, _) => {
                let power = self.power(inner)?;
                let now = self.fresh(edge.name(), "BOOL");
                self.edge(*edge, &power, &now);
                Ok(on(&now))
            }
            Contact::Compare(left, comparison, right, span) => {
                self.compare([*left, *right], *comparison, *span)
            }
            Contact::Element(element, span) => {
                let index = self.index(*element, *span)?;
                let value = self.element(element.array, index, *span)?;
                Ok(self.as_power(value))
            }
            Contact::Computed(computed, span) => {
                let value = self.formula(&computed.condition(), *span)?;
                Ok(self.as_power(value))
            }
        }
    }

    /// A number that is read.
    pub(super) fn number(
        &mut self,
        value: Value,
        span: Span,
    ) -> Result<ExportedNumber, ExportRefusal> {
        match value {
            Value::Const(constant, _) => Ok(ExportedNumber {
                source: functions::number(constant.into()),
                is_real: false,
                constant: Some(constant),
            }),
            Value::Real(number) => Ok(ExportedNumber {
                source: CallSource::Literal(CallLiteral::Real(number)),
                is_real: true,
                constant: None,
            }),
            Value::Word(word) => self.word(word, span),
            Value::Element(element) => {
                let index = self.index(element, span)?;
                let is_real = element.array.is_real();
                let value = self.element(element.array, index, span)?;
                let source = match is_real {
                    true => self.real_value(value),
                    false => self.as_whole(value).source,
                };
                Ok(ExportedNumber { source, is_real, constant: None })
            }
        }
    }

    /// A compare, in a bit of its own.
    fn compare(
        &mut self,
        values: [Value; 2],
        comparison: Comparison,
        span: Span,
    ) -> Result<NetworkPower, ExportRefusal> {
        let name = function_name(comparison);
        let [left, right] = values;
        let sides = [self.number(left, span)?, self.number(right, span)?];
        let is_real = sides.iter().any(|side| side.is_real);
        let sides = sides.map(|side| match is_real {
            true => side.real_source(),
            false => Some(side.source),
        });
        if let [Some(left), Some(right)] = sides {
            return Ok(self.compared(name, left, right));
        }
        let computed = ComputedContact::of_values(left, comparison, right);
        let value = self.formula(&computed.condition(), span)?;
        Ok(self.as_power(value))
    }
}

fn function_name(comparison: Comparison) -> &'static str {
    match comparison {
        Comparison::Eq => "EQ",
        Comparison::Ne => "NE",
        Comparison::Lt => "LT",
        Comparison::Le => "LE",
        Comparison::Gt => "GT",
        Comparison::Ge => "GE",
    }
}
