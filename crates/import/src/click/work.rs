//! A CLICK rung, while it is translated: its steps, and the instructions that its rows have.
//!
//! `calls` and `timers` say what the instructions do, `dispatch` chooses. CLICK evaluates the
//! contacts of a rung before its instructions, so every condition is that of the rung's beginning;
//! `rungs` keeps it where an instruction changes it.

use std::collections::HashSet;

use super::operand::{ClickMemory, ClickOperand};
use crate::condition::{RungCondition, TouchedPlace};
use crate::model::{Action, ActionForm, RungStep, Term};

/// An instruction with its arguments.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ClickCall {
    pub(super) name: String,
    pub(super) arguments: Vec<String>,
}

impl ClickCall {
    /// The instruction that a text says.
    ///
    /// # Errors
    /// It says none.
    pub(super) fn of(text: &str) -> Result<ClickCall, String> {
        let parts = text
            .split_once('(')
            .and_then(|(name, rest)| rest.strip_suffix(')').map(|arguments| [name, arguments]));
        let [name, arguments] = parts.ok_or_else(|| format!("the instruction `{text}`"))?;
        let (mut all, mut depth) = (vec![String::new()], 0);
        for letter in arguments.chars() {
            depth += i32::from(letter == '(') - i32::from(letter == ')');
            match (letter, all.last_mut()) {
                (',', _) if depth == 0 => all.push(String::new()),
                (_, Some(last)) => last.push(letter),
                (_, None) => {}
            }
        }
        let arguments = all.iter().map(|argument| argument.trim().to_owned());
        let arguments = arguments.filter(|argument| !argument.is_empty()).collect();
        Ok(ClickCall { name: name.to_owned(), arguments })
    }

    /// The argument at a place.
    ///
    /// # Errors
    /// There is none.
    pub(super) fn at(&self, at: usize) -> Result<&str, String> {
        let found = self.arguments.get(at).map(String::as_str);
        found.ok_or_else(|| format!("{} without its argument {}", self.name, at + 1))
    }

    /// The value of `NAME=VALUE`.
    pub(super) fn option(&self, name: &str) -> Option<&str> {
        let mut values = self.arguments.iter().filter_map(|argument| argument.split_once('='));
        values.find(|(key, _)| key.trim() == name).map(|(_, value)| value.trim())
    }

    /// Whether it has `NAME=1`.
    pub(super) fn has(&self, name: &str) -> bool {
        self.option(name).is_some_and(|value| !matches!(value, "0" | "none"))
    }
}

/// An instruction with the power of its row and of its pins.
pub(super) struct PoweredCall {
    pub(super) call: ClickCall,
    pub(super) power: RungCondition,
    pub(super) reset: Option<RungCondition>,
    pub(super) down: Option<RungCondition>,
}

/// A rung, while it is translated.
pub(super) struct RungWork<'m> {
    pub(super) memory: &'m mut ClickMemory,
    /// The bits that an OUT drives already.
    pub(super) driven: &'m mut HashSet<String>,
    pub(super) steps: Vec<RungStep>,
}

impl RungWork<'_> {
    /// A term for the value that a condition had at the beginning of the rung.
    pub(super) fn early(condition: &RungCondition) -> Term {
        Term { condition: condition.clone(), at: 0 }
    }

    /// A term for the value that a condition has now.
    pub(super) fn now(&self, condition: RungCondition) -> Term {
        Term { condition, at: self.steps.len() }
    }

    /// Adds an instruction that writes a place.
    pub(super) fn push(&mut self, when: Vec<Term>, text: String, writes: &str) {
        let is_always = |term: &Term| term.condition == RungCondition::Constant(true);
        let when = when.into_iter().filter(|term| !is_always(term)).collect();
        let writes = vec![TouchedPlace::of(writes)];
        self.steps.push(RungStep { when, action: Action { form: ActionForm::Do(text), writes } });
    }

    /// Drives a bit: by OUT, or by SET and RST if another OUT does.
    pub(super) fn drive(&mut self, bit: &str, when: Vec<Term>) {
        if self.driven.insert(bit.to_owned()) {
            return self.push(when, format!("OUT {bit}"), bit);
        }
        let all = RungCondition::all(when.iter().map(|term| term.condition.clone()));
        let at = when.iter().map(|term| term.at).max().unwrap_or(0);
        self.push(vec![Term { condition: all.clone().opposite(), at }], format!("RST {bit}"), bit);
        self.push(vec![Term { condition: all, at }], format!("SET {bit}"), bit);
    }

    /// The address of a number.
    pub(super) fn target(&mut self, text: &str) -> Result<ClickOperand, String> {
        let found = self.memory.number(text)?;
        match found.place {
            Some(_) => Ok(found),
            None => Err(format!("the constant `{text}` as a target")),
        }
    }
}
