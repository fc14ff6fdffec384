//! Functions that convert a value to another type: `INT_TO_DINT`; called by `functions`.

use super::body::LadderBody;
use super::calculations::{FunctionCalculation, FunctionResult, is_plain};
use super::elements::BlockPin;
use super::formula::IecFormula;
use super::types::IecType;
use crate::condition::RungCondition;

impl LadderBody<'_, '_> {
    /// A conversion of types.
    pub(super) fn conversion(
        &mut self,
        types: [&str; 2],
        pins: &[&BlockPin],
    ) -> Result<FunctionResult, String> {
        let [pin] = pins else { return Err("a conversion of several values".to_owned()) };
        let (from, to) = (IecType::named(types[0])?, IecType::named(types[1])?);
        let refused = || Err(format!("the conversion {}_TO_{}", types[0], types[1]));
        for loss in types.iter().filter_map(|kind| IecType::loss(kind)) {
            self.differences.insert(format!("{}_TO_{} has {loss}", types[0], types[1]));
        }
        if from == IecType::Bool {
            if !matches!(to, IecType::Whole { .. }) {
                return refused();
            }
            let power = self.pin_power(Some(pin))?;
            let id = self.graph.elements[self.statement].id;
            let power = if is_plain(&power) { power } else { self.kept(power, &format!("in{id}")) };
            let mut reads = Vec::new();
            super::power::places(&power, &mut reads);
            let texts = vec![power.text()];
            let calculation =
                FunctionCalculation { kind: to, texts, reads, is_bit: true, guard: None };
            return Ok(FunctionResult::Number(calculation));
        }
        let value = self.pin_number(pin)?.fitted(from)?;
        let text = match (from, to) {
            (IecType::Whole { .. }, IecType::Bool) => {
                let power = RungCondition::compare(&value.text, "!=", "0", value.reads);
                return Ok(FunctionResult::Power(power));
            }
            (IecType::Whole { .. }, IecType::Whole { .. }) if to.holds(from) => value.text,
            (IecType::Whole { .. }, IecType::Whole { .. }) => to.cut(&value.text),
            (IecType::Whole { .. }, IecType::Real) | (IecType::Real, IecType::Real) => value.text,
            (IecType::Real, IecType::Whole { .. }) => to.cut(&rounded(&value.text, to)),
            (IecType::Time, _) | (_, IecType::Time) => self.time_conversion([from, to], &value)?,
            _ => return refused(),
        };
        let (texts, reads) = (vec![text], value.reads);
        let calculation =
            FunctionCalculation { kind: to, texts, reads, is_bit: false, guard: None };
        Ok(FunctionResult::Number(calculation))
    }

    /// TRUNC: a real without its fraction, as a DINT.
    pub(super) fn truncated(&mut self, pin: &BlockPin) -> Result<FunctionResult, String> {
        let value = self.pin_number(pin)?.fitted(IecType::Real)?;
        let kind = IecType::named("DINT")?;
        let texts = vec![kind.cut(&format!("trunc({})", value.text))];
        let reads = value.reads;
        let calculation = FunctionCalculation { kind, texts, reads, is_bit: false, guard: None };
        Ok(FunctionResult::Number(calculation))
    }

    /// A conversion of a TIME from or to a number, which is one of seconds in MatIEC's library, and
    /// of ms in CODESYS.
    fn time_conversion(
        &mut self,
        [from, to]: [IecType; 2],
        value: &IecFormula,
    ) -> Result<String, String> {
        let (text, ms) = (&value.text, self.memory.time_unit_ms);
        let unit = if ms == 1 { "ms, as in CODESYS" } else { "seconds, as in MatIEC" };
        self.differences.insert(format!("a TIME as a number is one of {unit}"));
        match (from, to, ms) {
            (IecType::Time, IecType::Whole { .. }, 1) => Ok(to.cut(text)),
            (IecType::Time, IecType::Whole { .. }, _) => Ok(to.cut(&format!("{text} / {ms}"))),
            (IecType::Time, IecType::Real, 1) => Ok(text.clone()),
            (IecType::Time, IecType::Real, _) => {
                Ok(format!("{text} / {ms} + ({text} % {ms}) / {ms}.0"))
            }
            (IecType::Whole { .. }, IecType::Time, _) => Ok(format!("{text} * {ms}")),
            _ => Err("a conversion of a TIME from or to no whole number".to_owned()),
        }
    }
}

/// A real rounded to the nearest whole number, of two the even one; for an unsigned type at
/// least 0.
fn rounded(text: &str, to: IecType) -> String {
    let half = format!("abs({text} - trunc({text})) == 0.5");
    let nearest = format!("if({half}, round({text} / 2) * 2, round({text}))");
    match to {
        IecType::Whole { is_signed: false, .. } => format!("max(0, {nearest})"),
        IecType::Whole { .. } | IecType::Bool | IecType::Time | IecType::Real => nearest,
    }
}
