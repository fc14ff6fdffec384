//! The contacts of Logix: bits and compares.

use super::expression;
use super::formula::{INTERMEDIATE, LogixFormula, ValueType, WIDE_WHOLE};
use super::rll::RllInstruction;
use super::translate::{Terms, Translation, contact_on, operand};
use super::types::Kind;
use crate::condition::{RungCondition, TouchedPlace};

/// The instructions that are contacts.
const CONTACTS: [&str; 19] = [
    "XIC", "XIO", "AFI", "LIM", "LIMIT", "MEQ", "CMP", "EQU", "EQ", "NEQ", "NE", "LES", "LT",
    "LEQ", "LE", "GRT", "GT", "GEQ", "GE",
];

/// Whether an instruction is a contact: it changes nothing but the power behind it.
pub(super) fn is_contact(name: &str) -> bool {
    CONTACTS.contains(&name)
}

impl Translation<'_> {
    /// The condition of a contact; `None` if the instruction is none.
    ///
    /// # Errors
    /// The reason why rungd cannot say it.
    pub(super) fn contact(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
    ) -> Result<Option<RungCondition>, String> {
        let operator = match instruction.name.as_str() {
            "XIC" => return self.bit(operand(instruction, 0)?, when).map(Some),
            "XIO" => {
                return Ok(Some(self.bit(operand(instruction, 0)?, when)?.opposite()));
            }
            "AFI" => return Ok(Some(RungCondition::Constant(false))),
            "LIM" | "LIMIT" => return self.limits(instruction, when).map(Some),
            "MEQ" => return self.masked(instruction, when).map(Some),
            "CMP" => return self.compared(operand(instruction, 0)?, when).map(Some),
            "EQU" | "EQ" => "==",
            "NEQ" | "NE" => "!=",
            "LES" | "LT" => "<",
            "LEQ" | "LE" => "<=",
            "GRT" | "GT" => ">",
            "GEQ" | "GE" => ">=",
            _ => return Ok(None),
        };
        let left = self.side(operand(instruction, 0)?, when)?;
        let right = self.side(operand(instruction, 1)?, when)?;
        self.wide_beside_real(&left, &right);
        Ok(Some(compared(&left, operator, &right)))
    }

    /// A contact on a bit.
    fn bit(&mut self, text: &str, when: &Terms) -> Result<RungCondition, String> {
        if let Some(is_on) = constant_bit(text) {
            return Ok(RungCondition::Constant(is_on));
        }
        if text.eq_ignore_ascii_case("S:FS") {
            return Ok(RungCondition::bit("$FirstScan"));
        }
        if text.get(..2).is_some_and(|head| head.eq_ignore_ascii_case("S:")) {
            return Err(format!("the arithmetic status flag {text}"));
        }
        if self.calls.is_enable(self.scope, text) {
            return Ok(RungCondition::Constant(true));
        }
        let bit = self.read(text, &Kind::Bool)?;
        if bit.kind != Kind::Bool || !bit.dimensions.is_empty() {
            return Err(format!("`{text}` is no bit"));
        }
        match bit.word.as_ref().filter(|word| !word.is_fixed) {
            None => Ok(contact_on(&bit)),
            Some(word) => {
                let copy = self.own_tag("bit", "bit");
                let text = format!("MATH {copy} = ({} >> ({})) & 1", word.word.text, word.bit);
                self.push(when.clone(), text, vec![TouchedPlace::of(&copy)]);
                Ok(RungCondition::bit(copy))
            }
        }
    }

    /// A side of a compare: a constant, a tag, or an expression in a word of its own.
    fn side(&mut self, text: &str, when: &Terms) -> Result<LogixFormula, String> {
        let formula = match expression::is_expression(text) {
            true => self.formula(text)?,
            false => LogixFormula::of(&self.value(text)?)?,
        };
        self.in_a_word(formula, when)
    }

    /// A number that a contact can name.
    fn in_a_word(&mut self, formula: LogixFormula, when: &Terms) -> Result<LogixFormula, String> {
        if formula.value == ValueType::Bool {
            return Err(format!("`{}` is no number", formula.text));
        }
        if formula.is_plain {
            return Ok(formula);
        }
        let kind = if formula.value == ValueType::Real { "real" } else { "int" };
        let word = self.own_tag("value", kind);
        self.note(&formula);
        let formula = formula.wrapped();
        let text = format!("MATH {word} = {}", formula.text);
        self.push(when.clone(), text, vec![TouchedPlace::of(&word)]);
        let reads = vec![TouchedPlace::of(&word)];
        Ok(LogixFormula { text: word, reads, is_atom: true, is_plain: true, ..formula })
    }

    /// Names the difference of a DINT that is compared with a REAL.
    fn wide_beside_real(&mut self, left: &LogixFormula, right: &LogixFormula) {
        let is_wide = |one: &LogixFormula, other: &LogixFormula| {
            let is_tag = one.value == ValueType::Whole && one.bits > 24 && !one.reads.is_empty();
            is_tag && other.value == ValueType::Real
        };
        if is_wide(left, right) || is_wide(right, left) {
            self.differences.insert(WIDE_WHOLE.to_owned());
        }
    }

    /// LIM: within the limits, or outside of them where the low one is the greater.
    fn limits(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
    ) -> Result<RungCondition, String> {
        let low = self.side(operand(instruction, 0)?, when)?;
        let test = self.side(operand(instruction, 1)?, when)?;
        let high = self.side(operand(instruction, 2)?, when)?;
        self.wide_beside_real(&low, &test);
        self.wide_beside_real(&high, &test);
        let above = compared(&test, ">=", &low);
        let below = compared(&test, "<=", &high);
        let within = || RungCondition::all([above.clone(), below.clone()]);
        let outside = || RungCondition::any([above.clone(), below.clone()]);
        let constants = (low.text.parse::<f64>(), high.text.parse::<f64>());
        if let (Ok(low), Ok(high)) = constants {
            return Ok(if low <= high { within() } else { outside() });
        }
        let is_ordered = compared(&low, "<=", &high);
        Ok(RungCondition::any([
            RungCondition::all([is_ordered.clone(), within()]),
            RungCondition::all([is_ordered.opposite(), outside()]),
        ]))
    }

    /// MEQ: two words that are equal where the mask has bits.
    fn masked(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
    ) -> Result<RungCondition, String> {
        let mut sides = Vec::new();
        for at in 0..3 {
            let side = self.side(operand(instruction, at)?, when)?;
            if side.value != ValueType::Whole {
                return Err("MEQ of REALs".to_owned());
            }
            sides.push(side);
        }
        let word = self.own_tag("masked", "int");
        let [source, mask, compare] = [0, 1, 2].map(|at: usize| sides[at].operand());
        let text = format!("MATH {word} = ({source} ^ {compare}) & {mask}");
        self.push(when.clone(), text, vec![TouchedPlace::of(&word)]);
        Ok(RungCondition::compare(&word, "==", "0", vec![TouchedPlace::of(&word)]))
    }

    /// CMP: an expression.
    fn compared(&mut self, text: &str, when: &Terms) -> Result<RungCondition, String> {
        if let Some(simple) = simple_compare(text) {
            let left = self.side(simple.left, when)?;
            let right = self.side(simple.right, when)?;
            self.wide_beside_real(&left, &right);
            return Ok(compared(&left, simple.operator, &right));
        }
        let formula = self.formula(text)?;
        if formula.value == ValueType::Real {
            return Err("CMP of a REAL without a compare".to_owned());
        }
        self.note(&formula);
        let bit = self.own_tag("compare", "bit");
        let text = format!("MATH {bit} = {}", formula.wrapped().text);
        self.push(when.clone(), text, vec![TouchedPlace::of(&bit)]);
        Ok(RungCondition::bit(bit))
    }

    /// An expression; its tags are read.
    pub(super) fn formula(&mut self, text: &str) -> Result<LogixFormula, String> {
        let formula = expression::formula(self.memory, self.scope, text)?;
        self.memory.mark_read(&formula.reads);
        Ok(formula)
    }

    /// Keeps what an expression does other than Logix.
    pub(super) fn note(&mut self, formula: &LogixFormula) {
        self.differences.extend(formula.differences.iter().map(|text| (*text).to_owned()));
        if formula.real_operations > 1 {
            self.differences.insert(INTERMEDIATE.to_owned());
        }
    }
}

fn compared(left: &LogixFormula, operator: &str, right: &LogixFormula) -> RungCondition {
    let reads = [left.reads.clone(), right.reads.clone()].concat();
    RungCondition::compare(&left.text, operator, &right.text, reads)
}

/// `0` or `1` in place of a bit.
fn constant_bit(text: &str) -> Option<bool> {
    match text {
        "0" => Some(false),
        "1" => Some(true),
        _ => None,
    }
}

/// An expression that is one compare of two sides.
struct SimpleCompare<'t> {
    left: &'t str,
    operator: &'static str,
    right: &'t str,
}

fn simple_compare(text: &str) -> Option<SimpleCompare<'_>> {
    let is_logic =
        |word: &str| ["AND", "OR", "XOR", "NOT"].iter().any(|one| word.eq_ignore_ascii_case(one));
    let mut words = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    if words.any(is_logic) || text.contains(['&', '|']) {
        return None;
    }
    let (mut depth, mut found) = (0_i32, None);
    let bytes = text.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        match bytes[at] {
            b'(' | b'[' => depth += 1,
            b')' | b']' => depth -= 1,
            b'<' | b'>' | b'=' => {
                let two = text.get(at..at + 2).unwrap_or_default();
                let (length, operator) = match (bytes[at], two) {
                    (_, "<>") => (2, "!="),
                    (_, "<=") => (2, "<="),
                    (_, ">=") => (2, ">="),
                    (b'<', _) => (1, "<"),
                    (b'>', _) => (1, ">"),
                    _ => (1, "=="),
                };
                if depth != 0 || found.is_some() {
                    return None;
                }
                found = Some(SimpleCompare {
                    left: text[..at].trim(),
                    operator,
                    right: text[at + length..].trim(),
                });
                at += length - 1;
            }
            _ => {}
        }
        at += 1;
    }
    found
}
