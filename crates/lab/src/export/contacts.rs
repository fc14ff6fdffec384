//! Contacts of a ladder as contacts of IEC 61131-3.
//!
//! A compare and an edge become a bit of their own, which is computed in a network right before the
//! one that reads it: at the moment at which rungd evaluates the contact. An edge has a second bit,
//! with what it saw last; it begins OFF, as in rungd, so that no F_TRIG stands for it (which is ON
//! in the first scan).

use super::functions;
use super::memory::real;
use super::project::{BlockCall, CallResult, CallSource, CoilAction, NetworkPower, off, on};
use super::refusal::{self, ExportRefusal};
use super::rungs::{RungAct, RungExport};
use rungd_engine::isa::Word;
use rungd_engine::isa::{Address, Bit, BitSpace, Real, WordSpace, status};
use rungd_language::resolve::program::{Comparison, Contact, Edge, Value};
use rungd_language::source::span::Span;

/// A number of a ladder.
#[derive(Clone, Debug)]
pub(super) struct ExportedNumber {
    pub(super) source: CallSource,
    pub(super) is_real: bool,
    /// The constant, if it is one.
    constant: Option<i32>,
}

impl ExportedNumber {
    /// The number as a REAL, if its value is one exactly.
    pub(super) fn real_source(self) -> Option<CallSource> {
        match self.constant {
            _ if self.is_real => Some(self.source),
            Some(constant) if f64::from(constant as f32) == f64::from(constant) => {
                Some(CallSource::Text(real(Real::nearest(constant))))
            }
            Some(_) | None => None,
        }
    }
}

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
                let name = function_name(*comparison);
                let (left, right) = (self.number(*left, *span)?, self.number(*right, *span)?);
                self.compare(name, [left, right], *span)
            }
            Contact::Element(_, span) => {
                Err(ExportRefusal::new(*span, "a moving index", refusal::NOT_YET))
            }
            Contact::Computed(_, span) => {
                Err(ExportRefusal::new(*span, "arithmetic in a contact", refusal::NOT_YET))
            }
        }
    }

    /// The acts that turn a bit ON at an edge of a power, for one execution.
    pub(super) fn edge(&mut self, edge: Edge, power: &NetworkPower, bit: &str) {
        let was = self.fresh("was", "BOOL");
        let now = match edge {
            Edge::Rise => NetworkPower::all([power.clone(), off(&was)]),
            Edge::Fall => NetworkPower::all([power.clone().opposite(), on(&was)]),
        };
        self.coil(CoilAction::Assign, now, bit);
        self.coil(CoilAction::Assign, power.clone(), &was);
    }

    /// A bit that a contact reads.
    fn bit(&mut self, bit: Bit, span: Span) -> Result<NetworkPower, ExportRefusal> {
        use status::st;
        let refused = |remedy| {
            let what = format!("`{}`", self.program.names.name(Address::Bit(bit)));
            Err(ExportRefusal::new(span, what, remedy))
        };
        match bit {
            Bit::Space(BitSpace::St, number) => match number {
                st::ON => Ok(NetworkPower::Constant(true)),
                st::OFF => Ok(NetworkPower::Constant(false)),
                st::FIRST_SCAN => Ok(on(&self.memory.shared("FirstScan", "BOOL"))),
                _ => refused(refusal::STATUS),
            },
            Bit::Space(..) | Bit::Flag(..) | Bit::Device(..) => {
                Ok(on(&self.memory.variable(Address::Bit(bit))))
            }
            Bit::Stage(_) => refused(refusal::STAGES),
            Bit::Running(_) | Bit::Done(_) => refused(refusal::BLOCKS),
            Bit::InWord(_) => refused(refusal::NOT_YET),
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
                source: CallSource::Text(real(number)),
                is_real: true,
                constant: None,
            }),
            Value::Word(word) => self.word(word, span),
            Value::Element(_) => Err(ExportRefusal::new(span, "a moving index", refusal::NOT_YET)),
        }
    }

    fn word(&mut self, word: Word, span: Span) -> Result<ExportedNumber, ExportRefusal> {
        if let Word::Space(WordSpace::Dst, number) = word
            && !status::dst::is_of_clock(number)
        {
            let what = format!("`{}`", self.program.names.name(Address::Word(word)));
            return Err(ExportRefusal::new(span, what, refusal::STATUS));
        }
        let source = CallSource::Text(self.memory.variable(Address::Word(word)));
        Ok(ExportedNumber { source, is_real: word.is_real(), constant: None })
    }

    /// A compare, in a bit of its own.
    fn compare(
        &mut self,
        name: &'static str,
        sides: [ExportedNumber; 2],
        span: Span,
    ) -> Result<NetworkPower, ExportRefusal> {
        let is_real = sides.iter().any(|side| side.is_real);
        let sides = sides.map(|side| match is_real {
            true => side.real_source(),
            false => Some(side.source),
        });
        let [Some(left), Some(right)] = sides else {
            let what = "a compare of a whole number and a real";
            return Err(ExportRefusal::new(span, what, refusal::TYPES));
        };
        Ok(self.compared(name, left, right))
    }

    /// Adds a compare of two values; the bit with its result. Two constants need none.
    pub(super) fn compared(
        &mut self,
        name: &'static str,
        left: CallSource,
        right: CallSource,
    ) -> NetworkPower {
        if let Some(is_on) = functions::compared(name, &left, &right) {
            return NetworkPower::Constant(is_on);
        }
        let bit = self.fresh(&name.to_lowercase(), "BOOL");
        let call = functions::call_of_two(name, left, right);
        self.call(call, vec![CallResult { pin: "OUT", variable: bit.clone(), is_coil: true }]);
        on(&bit)
    }

    /// Adds a coil.
    pub(super) fn coil(&mut self, action: CoilAction, power: NetworkPower, variable: &str) {
        let variable = variable.to_owned();
        self.acts.push(RungAct::Coil(super::project::NetworkCoil { power, variable, action }));
    }

    /// Adds a call.
    pub(super) fn call(&mut self, call: BlockCall, results: Vec<CallResult>) {
        self.acts.push(RungAct::Call { call, results });
    }

    /// A variable of the export, named after the rung.
    pub(super) fn fresh(&mut self, purpose: &str, type_name: &str) -> String {
        self.memory.fresh(&format!("{}_{purpose}", self.label), type_name)
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
