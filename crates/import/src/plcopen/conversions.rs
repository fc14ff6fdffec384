//! Functions that convert a value to another type: `INT_TO_DINT`; called by `functions`.

use super::body::LadderBody;
use super::calculations::{FunctionCalculation, FunctionResult, is_plain};
use super::elements::BlockPin;
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
            (IecType::Whole { .. }, IecType::Real) => value.text,
            _ => return refused(),
        };
        let (texts, reads) = (vec![text], value.reads);
        let calculation =
            FunctionCalculation { kind: to, texts, reads, is_bit: false, guard: None };
        Ok(FunctionResult::Number(calculation))
    }
}
