//! The instructions of a CLICK rung, as steps.
//!
//! CLICK evaluates the contacts of a rung before its instructions, so every condition is that of
//! the rung's beginning; `rungs` keeps it where an instruction changes it.

use std::collections::HashSet;

use super::operand::{ClickMemory, ClickOperand, ClickType};
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
    fn has(&self, name: &str) -> bool {
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
    /// Adds what an instruction does.
    ///
    /// # Errors
    /// The reason why rungd cannot say it.
    pub(super) fn act(&mut self, powered: &PoweredCall) -> Result<(), String> {
        let call = &powered.call;
        if call.has("oneshot") {
            return Err(format!("{} as a one-shot", call.name));
        }
        let has_pins = powered.reset.is_some() || powered.down.is_some();
        let takes_pins = matches!(call.name.as_str(), "on_delay" | "count_up" | "count_down");
        if has_pins && !takes_pins {
            return Err(format!("{} with a second input", call.name));
        }
        match call.name.as_str() {
            "out" | "latch" | "reset" => self.coil(call, &powered.power),
            "on_delay" => self.on_delay(powered),
            "off_delay" => self.off_delay(powered),
            "count_up" | "count_down" => self.count(powered),
            "copy" => self.copy(call, &powered.power),
            "math" => self.math(call, &powered.power),
            name => Err(format!("the instruction {name}")),
        }
    }

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

    /// `out(Y001)`, `latch(C1..C4)`, `reset(C1)`.
    fn coil(&mut self, call: &ClickCall, power: &RungCondition) -> Result<(), String> {
        let text = call.at(0)?;
        if text.contains("immediate") {
            return Err("an immediate coil".to_owned());
        }
        for bit in self.range(text)? {
            let when = vec![RungWork::early(power)];
            match call.name.as_str() {
                "out" => self.drive(&bit, when),
                "latch" => self.push(when, format!("SET {bit}"), &bit),
                _ => self.push(when, format!("RST {bit}"), &bit),
            }
        }
        Ok(())
    }

    /// The bits of `C1` or `C1..C4`.
    fn range(&mut self, text: &str) -> Result<Vec<String>, String> {
        let (first, last) = text.split_once("..").unwrap_or((text, text));
        let split = |text: &str| {
            let at = text.find(|c: char| c.is_ascii_digit())?;
            Some((text[..at].to_owned(), text[at..].parse::<u32>().ok()?))
        };
        let ends = split(first.trim()).zip(split(last.trim()));
        let Some(((bank, from), (other, to))) = ends else {
            return Err(format!("the operand `{text}`"));
        };
        if bank != other || to < from || to - from > 255 {
            return Err(format!("the range `{text}`"));
        }
        let mut bits = Vec::new();
        for number in from..=to {
            let found = self.memory.address(&format!("{bank}{number}"))?;
            if found.kind != ClickType::Bit {
                return Err(format!("the number `{text}` where a bit is wanted"));
            }
            bits.push(found.text);
        }
        Ok(bits)
    }

    /// The address of a number.
    pub(super) fn target(&mut self, text: &str) -> Result<ClickOperand, String> {
        let found = self.memory.number(text)?;
        match found.place {
            Some(_) => Ok(found),
            None => Err(format!("the constant `{text}` as a target")),
        }
    }

    /// `copy(DD1,DS1)`: what is too large for its target becomes the target's limit.
    fn copy(&mut self, call: &ClickCall, power: &RungCondition) -> Result<(), String> {
        if call.option("convert").is_some() {
            return Err("a copy that converts".to_owned());
        }
        let (source, target) = (self.memory.number(call.at(0)?)?, self.target(call.at(1)?)?);
        let (from, to) = (&source.text, &target.text);
        let text = match (source.kind, target.kind) {
            (ClickType::Long, ClickType::Short) => {
                format!("MATH {to} = max(-32768, min(32767, {from}))")
            }
            _ => format!("MOVE {from} to={to}"),
        };
        self.push(vec![RungWork::early(power)], text, to);
        Ok(())
    }

    /// `math(DS1 + 2,DS2,mode=decimal)`: the result is cut to the bits of its target.
    fn math(&mut self, call: &ClickCall, power: &RungCondition) -> Result<(), String> {
        if call.option("mode").is_some_and(|mode| mode != "decimal") {
            return Err("math in hexadecimal numbers".to_owned());
        }
        let formula = self.formula(call.at(0)?)?;
        let target = self.target(call.at(1)?)?;
        let to = &target.text;
        let text = match target.kind {
            ClickType::Short => format!("MATH {to} = ((({formula}) + 32768) & 65535) - 32768"),
            ClickType::Long | ClickType::Bit => format!("MATH {to} = ({formula}) & -1"),
        };
        self.push(vec![RungWork::early(power)], text, to);
        Ok(())
    }

    /// A formula of sums, differences and one product, whose results are exact in rungd.
    fn formula(&mut self, text: &str) -> Result<String, String> {
        let (mut formula, mut rest, mut depth, mut parts) = (String::new(), text.trim(), 0, 0);
        if text.matches('*').count() > 1 {
            return Err("math with several products".to_owned());
        }
        while let Some(letter) = rest.chars().next() {
            let length = rest.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(rest.len());
            let length = match letter {
                ' ' => 1,
                '-' if formula.is_empty() || formula.ends_with([' ', '(']) => {
                    formula.push('-');
                    1
                }
                '+' | '-' | '*' => {
                    formula += &format!(" {letter} ");
                    1
                }
                '(' | ')' => {
                    depth += if letter == '(' { 1 } else { -1 };
                    formula.push(letter);
                    1
                }
                _ if length > 0 => {
                    parts += 1;
                    formula += &self.memory.number(&rest[..length])?.text;
                    length
                }
                _ => return Err(format!("`{letter}` in math")),
            };
            if !(0..=8).contains(&depth) || parts > 16 {
                return Err("a long formula".to_owned());
            }
            rest = &rest[length..];
        }
        match depth == 0 && parts > 0 {
            true => Ok(formula),
            false => Err(format!("the formula `{text}`")),
        }
    }
}
