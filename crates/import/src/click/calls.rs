//! Coils, copies and sums of CLICK.

use super::address::addresses;
use super::operand::ClickType;
use super::work::{ClickCall, RungWork};
use crate::condition::RungCondition;

impl RungWork<'_> {
    /// `out(Y001)`, `latch(C1..C4)`, `reset(C1)`.
    pub(super) fn coil(&mut self, call: &ClickCall, power: &RungCondition) -> Result<(), String> {
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
        let mut bits = Vec::new();
        for address in addresses(text)? {
            let found = self.memory.address(&address)?;
            if found.kind != ClickType::Bit {
                return Err(format!("the number `{text}` where a bit is wanted"));
            }
            bits.push(found.text);
        }
        Ok(bits)
    }

    /// `copy(DD1,DS1)`: what is too large for its target becomes the target's limit.
    pub(super) fn copy(&mut self, call: &ClickCall, power: &RungCondition) -> Result<(), String> {
        self.copied(call.at(0)?, call.at(1)?, power)
    }

    /// `fill(0,DS1..DS4)`: a copy into each address.
    pub(super) fn fill(&mut self, call: &ClickCall, power: &RungCondition) -> Result<(), String> {
        let source = call.at(0)?;
        for target in addresses(call.at(1)?)? {
            self.copied(source, &target, power)?;
        }
        Ok(())
    }

    /// `blockcopy(DS1..DS4,DS11..DS14)`: all are read before the first one is written.
    pub(super) fn block_copy(
        &mut self,
        call: &ClickCall,
        power: &RungCondition,
    ) -> Result<(), String> {
        let (mut from, mut to) = (addresses(call.at(0)?)?, addresses(call.at(1)?)?);
        if from.len() != to.len() {
            return Err("ranges of different lengths".to_owned());
        }
        // Where the ranges overlap, the end that is read later is written first.
        if from.contains(&to[0]) {
            from.reverse();
            to.reverse();
        }
        for (source, target) in from.iter().zip(&to) {
            self.copied(source, target, power)?;
        }
        Ok(())
    }

    fn copied(&mut self, source: &str, target: &str, power: &RungCondition) -> Result<(), String> {
        let (source, target) = (self.memory.number(source)?, self.target(target)?);
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
    pub(super) fn math(&mut self, call: &ClickCall, power: &RungCondition) -> Result<(), String> {
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
