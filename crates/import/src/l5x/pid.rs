//! PID of Logix: a use of the template of `logix-pid.toml`, a part of each project that has one.
//!
//! Called by `walk`. The template executes the equations of Rockwell's manual on the structure of
//! the PID, whatever its gains and modes are. A loop with a master, and the values of an output
//! module that holds its output, are not translated.

use super::formula::{LogixFormula, ValueType};
use super::locate::{Index, LocatedOperand};
use super::rll::RllInstruction;
use super::translate::{Terms, Translation, operand};
use super::types::{Kind, PID_RECORD};
use crate::condition::TouchedPlace;
use crate::model::{Action, ActionForm, RungStep, UseArgument};

const BY_THE_MANUAL: &str = "a PID is computed by the equations of Rockwell's manual: what the \
    manual leaves open may differ";
const WITHOUT_SETTINGS: &str = "the file does not give the settings of a PID: they begin with 0";

impl Translation<'_> {
    /// PID.
    ///
    /// # Errors
    /// The reason why rungd cannot say it.
    pub(super) fn pid(&mut self, instruction: &RllInstruction, when: &Terms) -> Result<(), String> {
        if instruction.operands.len() != 7 {
            return Err(format!("PID with {} operands", instruction.operands.len()));
        }
        if operand(instruction, 4)? != "0" {
            return Err("PID of a cascade".to_owned());
        }
        if operand(instruction, 5)? != "0" || operand(instruction, 6)? != "0" {
            return Err("PID that takes over the output that a module holds".to_owned());
        }
        let text = operand(instruction, 0)?.to_owned();
        let pid = self.written(&text, &Kind::Struct("pid".to_owned()))?;
        if pid.kind != Kind::Struct("pid".to_owned()) || !pid.dimensions.is_empty() {
            return Err(format!("`{text}` is no PID"));
        }
        if matches!(pid.index, Index::Moving(_)) {
            return Err("PID of a structure with a moving index".to_owned());
        }
        let variable = &mut self.memory.variables[pid.variable];
        variable.is_read = true;
        if variable.data.is_none() && self.memory.scopes[self.scope].is_open {
            self.differences.insert(WITHOUT_SETTINGS.to_owned());
        }
        self.differences.insert(BY_THE_MANUAL.to_owned());
        let arguments = vec![
            UseArgument { name: "pid".to_owned(), value: pid.text.clone() },
            self.argument("data", &text, "DATA")?,
            UseArgument { name: "pv".to_owned(), value: self.real(instruction, 1, when)? },
            UseArgument { name: "tieback".to_owned(), value: self.real(instruction, 2, when)? },
        ];
        self.prescan.text(self.scope, format!("RST {}.en", pid.text));
        self.use_pid(&pid, arguments, operand(instruction, 3)?, when)
    }

    /// An operand as a REAL.
    fn real(
        &mut self,
        instruction: &RllInstruction,
        at: usize,
        when: &Terms,
    ) -> Result<String, String> {
        let value = LogixFormula::of(&self.value(operand(instruction, at)?)?)?;
        let is_number = value.text.parse::<f64>().is_ok();
        if is_number || value.value == ValueType::Real {
            return Ok(value.text);
        }
        let own = self.own_tag("real", "real");
        let place = TouchedPlace::of(&own);
        self.push(when.clone(), format!("MATH {own} = {}", value.text), vec![place]);
        Ok(own)
    }

    /// The use of the template, and the control variable, if it is no REAL.
    fn use_pid(
        &mut self,
        pid: &LocatedOperand,
        mut arguments: Vec<UseArgument>,
        target: &str,
        when: &Terms,
    ) -> Result<(), String> {
        let control = self.written(target, &Kind::Real)?;
        let is_direct = control.kind == Kind::Real && !matches!(control.index, Index::Moving(_));
        let cv = match is_direct {
            true => control.text.clone(),
            false => self.own_tag("cv", "real"),
        };
        let data = TouchedPlace::of(&arguments[1].value);
        let writes = vec![TouchedPlace::of(&pid.text), data, TouchedPlace::of(&cv)];
        arguments.push(UseArgument { name: "cv".to_owned(), value: cv.clone() });
        if control.kind != Kind::Real {
            arguments.push(UseArgument { name: "whole".to_owned(), value: "$On".to_owned() });
        }
        let wish = format!("{}_pid", pid.text).replace(['[', ']', '.'], "_");
        let name = self.memory.names.fresh(&wish);
        let power = if is_direct { None } else { Some(self.whole(when.clone())) };
        let form = ActionForm::Use {
            template: PID_RECORD.to_owned(),
            name,
            contact: Some("run"),
            arguments,
        };
        let power = power.map(|power| self.term(power));
        self.steps.push(RungStep { when: when.clone(), action: Action { form, writes } });
        if let Some(power) = power {
            let value = LogixFormula {
                value: ValueType::Real,
                reads: vec![TouchedPlace::of(&cv)],
                ..LogixFormula::plain(cv)
            };
            self.store(target, value, &vec![power])?;
        }
        Ok(())
    }
}
