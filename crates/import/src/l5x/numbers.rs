//! Moves and arithmetic of Logix.
//!
//! Whole numbers wrap in Logix where rungd limits them, so a result is stored by MATH, cut to the
//! bits of its target. A REAL in a whole number is rounded to the nearest, half to even.

use super::expression;
use super::formula::{DIVISION_IN_REALS, LogixFormula, ValueType};
use super::locate::{Index, LocatedOperand};
use super::operators::{binary, in_reals};
use super::rll::RllInstruction;
use super::translate::{Terms, Translation, operand};
use super::types::Kind;
use crate::condition::TouchedPlace;

impl Translation<'_> {
    /// An instruction that computes; `false` if the name is none of these.
    ///
    /// # Errors
    /// The reason why rungd cannot say it.
    pub(super) fn number(
        &mut self,
        name: &str,
        instruction: &RllInstruction,
        when: &Terms,
    ) -> Result<bool, String> {
        let operator = match name {
            "ADD" => "+",
            "SUB" => "-",
            "MUL" => "*",
            "DIV" => "/",
            "MOD" => "%",
            "AND" => "&",
            "OR" => "|",
            "XOR" => "^",
            "MOV" | "MOVE" => return self.single(instruction, when, Ok),
            "NOT" => return self.single(instruction, when, expression::complement),
            "NEG" => return self.single(instruction, when, expression::negative),
            "ABS" | "SQR" | "SQRT" | "SIN" | "COS" | "TAN" | "ASN" | "ASIN" | "ACS" | "ACOS"
            | "ATN" | "ATAN" | "LN" | "LOG" | "DEG" | "RAD" | "TRN" | "TRUNC" => {
                let function = |argument| expression::function(name, argument);
                return self.single(instruction, when, function);
            }
            "CLR" => {
                self.store(operand(instruction, 0)?, LogixFormula::whole(0), when)?;
                return Ok(true);
            }
            "CPT" => {
                let mut formula = self.formula(operand(instruction, 1)?)?;
                let target = self.target(operand(instruction, 0)?)?;
                if target.kind == Kind::Real
                    && formula.value == ValueType::Whole
                    && formula.text.contains('/')
                {
                    let text = operand(instruction, 1)?;
                    formula = expression::formula_in_reals(self.memory, self.scope, text)?;
                    formula.differences.push(DIVISION_IN_REALS);
                }
                self.store_in(&target, formula, when)?;
                return Ok(true);
            }
            "MVM" => return self.masked_move(instruction, when),
            "BTD" => return self.distribute(instruction, when),
            "SCL" | "SCP" => return self.scale(instruction, when),
            _ => return Ok(false),
        };
        let left = LogixFormula::of(&self.value(operand(instruction, 0)?)?)?;
        let right = LogixFormula::of(&self.value(operand(instruction, 1)?)?)?;
        let target = self.target(operand(instruction, 2)?)?;
        let is_arithmetic = matches!(operator, "+" | "-" | "*" | "/" | "%");
        // With a REAL as its target Logix computes in REALs.
        let left = match is_arithmetic && target.kind == Kind::Real {
            true if left.value == ValueType::Whole => in_reals(left),
            _ => left,
        };
        let formula = binary(operator, left, right)?;
        self.store_in(&target, formula, when)?;
        Ok(true)
    }

    /// An instruction of one source.
    fn single(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
        compute: impl Fn(LogixFormula) -> Result<LogixFormula, String>,
    ) -> Result<bool, String> {
        let source = operand(instruction, 0)?;
        let formula = match expression::is_expression(source) {
            true => self.formula(source)?,
            false => LogixFormula::of(&self.value(source)?)?,
        };
        self.store(operand(instruction, 1)?, compute(formula)?, when)?;
        Ok(true)
    }

    /// A word or bit that is written.
    fn target(&mut self, text: &str) -> Result<LocatedOperand, String> {
        self.target_as(text, &Kind::Dint)
    }

    /// As [`Translation::target`], with the type of a tag that the file does not declare.
    fn target_as(&mut self, text: &str, guess: &Kind) -> Result<LocatedOperand, String> {
        let target = self.written(text, guess)?;
        match target.dimensions.is_empty() && target.kind.plain().is_some() {
            true => Ok(target),
            false => Err(format!("`{text}` is no value that can be written")),
        }
    }

    /// Stores a formula where a text of Logix names it.
    pub(super) fn store(
        &mut self,
        text: &str,
        formula: LogixFormula,
        when: &Terms,
    ) -> Result<(), String> {
        let is_bit = formula.value == ValueType::Bool && formula.is_plain;
        let target = self.target_as(text, if is_bit { &Kind::Bool } else { &Kind::Dint })?;
        self.store_in(&target, formula, when)
    }

    /// Stores a formula.
    pub(super) fn store_in(
        &mut self,
        target: &LocatedOperand,
        formula: LogixFormula,
        when: &Terms,
    ) -> Result<(), String> {
        self.note(&formula);
        self.prescan.other(&target.place());
        if target.word.as_ref().is_some_and(|word| !word.is_fixed) {
            return Err("a number stored in a bit with a moving number".to_owned());
        }
        let bits_match = target.kind == Kind::Bool && formula.value == ValueType::Bool;
        if (target.kind == Kind::Bool || formula.value == ValueType::Bool)
            && !bits_match
            && !formula.is_plain
        {
            return Err(format!("a number and a bit: `{}`", target.text));
        }
        let formula = match formula.value == ValueType::Real && target.kind.bits().is_some() {
            true => self.rounded(formula, when),
            false => formula,
        };
        let is_simple = formula.is_plain
            && !matches!(target.index, Index::Moving(_))
            && formula.reads.len() <= 1
            && target.word.is_none()
            && target.kind != Kind::Bool
            && formula.value != ValueType::Bool;
        let fits = match target.kind.bits() {
            Some(32) => formula.bits <= 32,
            Some(_) => formula.is_plain && self.fits(target, &formula),
            None => true,
        };
        let place = vec![target.word.as_ref().map_or_else(|| target.place(), |w| w.word.place())];
        let text = match is_simple && fits {
            true => format!("MOVE {} to={}", formula.text, target.text),
            false => {
                let value = if fits { formula.text } else { cut(&target.kind, &formula) };
                format!("MATH {} = {value}", target.text)
            }
        };
        self.push(when.clone(), text, place.clone());
        if let Some(word) = &target.word {
            let bits = word.word.kind.bits().unwrap_or(32);
            if bits < 32 && word.bit == (bits - 1).to_string() {
                return Err("a number stored in the sign of a word".to_owned());
            }
        }
        Ok(())
    }

    /// Whether every value of a constant or tag fits into a word.
    fn fits(&self, target: &LocatedOperand, formula: &LogixFormula) -> bool {
        let bits = target.kind.bits().unwrap_or(32);
        if let Ok(value) = formula.text.parse::<i64>() {
            let range = match matches!(target.kind, Kind::Usint | Kind::Uint) {
                true => 0..1 << bits,
                false => -(1 << (bits - 1))..1 << (bits - 1),
            };
            return range.contains(&value);
        }
        formula.bits < bits
            || (formula.bits == bits
                && matches!(target.kind, Kind::Int | Kind::Sint)
                && self.memory.is_signed(&formula.reads))
    }

    /// A REAL as a whole number: to the nearest, half to even.
    fn rounded(&mut self, formula: LogixFormula, when: &Terms) -> LogixFormula {
        if formula.text.starts_with("trunc(") {
            return formula;
        }
        let word = self.own_tag("real", "real");
        let text = format!("MATH {word} = {}", formula.text);
        self.push(when.clone(), text, vec![TouchedPlace::of(&word)]);
        let text = format!(
            "round({word}) - if(abs({word} - trunc({word})) == 0.5 && round({word}) % 2 != 0, \
             if({word} > 0, 1, -1), 0)"
        );
        LogixFormula {
            text,
            value: ValueType::Whole,
            bits: 64,
            reads: vec![TouchedPlace::of(&word)],
            is_atom: false,
            is_plain: false,
            ..formula
        }
    }

    /// MVM: the bits of the mask.
    fn masked_move(&mut self, instruction: &RllInstruction, when: &Terms) -> Result<bool, String> {
        let source = self.whole_source(operand(instruction, 0)?)?;
        let mask = self.whole_source(operand(instruction, 1)?)?;
        let target = self.target(operand(instruction, 2)?)?;
        let (to, mask_text) = (&target.text, mask.operand());
        let text = format!("({} & {mask_text}) | ({to} & ~{mask_text})", source.operand());
        let reads = [source.reads, mask.reads].concat();
        self.store_in(&target, computed(text, reads), when)?;
        Ok(true)
    }

    /// BTD: some bits of a word, at another place of a word.
    fn distribute(&mut self, instruction: &RllInstruction, when: &Terms) -> Result<bool, String> {
        let source = self.whole_source(operand(instruction, 0)?)?;
        let from = self.whole_source(operand(instruction, 1)?)?;
        let target = self.target(operand(instruction, 2)?)?;
        let to = self.whole_source(operand(instruction, 3)?)?;
        let length = self.whole_source(operand(instruction, 4)?)?;
        let number = |formula: &LogixFormula| formula.text.parse::<u32>().ok();
        let (Some(from), Some(to), Some(length)) = (number(&from), number(&to), number(&length))
        else {
            return Err("BTD with moving bit numbers".to_owned());
        };
        if from > 31 || to > 31 || length == 0 || length > 32 {
            return Err("BTD with bit numbers beyond a word".to_owned());
        }
        let bits = if length == 32 { u32::MAX } else { (1 << length) - 1 };
        let mask = (bits << to) as i32;
        let text = format!(
            "(({} >>> {from} << {to}) & ({mask})) | ({} & ~({mask}))",
            source.operand(),
            target.text
        );
        self.store_in(&target, computed(text, source.reads), when)?;
        Ok(true)
    }

    /// SCP and SCL: a straight line.
    fn scale(&mut self, instruction: &RllInstruction, when: &Terms) -> Result<bool, String> {
        if instruction.operands.len() != 6 {
            return Err(format!(
                "{} with {} operands",
                instruction.name,
                instruction.operands.len()
            ));
        }
        let mut values = Vec::new();
        for at in 0..5 {
            values.push(LogixFormula::of(&self.value(operand(instruction, at)?)?)?);
        }
        let target = self.target(operand(instruction, 5)?)?;
        let texts: Vec<&str> = values.iter().map(|value| value.text.as_str()).collect();
        let text = format!("scale({})", texts.join(", "));
        let reads = values.iter().flat_map(|value| value.reads.clone()).collect();
        let formula = LogixFormula {
            value: ValueType::Real,
            real_operations: 2,
            is_atom: true,
            ..computed(text, reads)
        };
        self.store_in(&target, formula, when)?;
        Ok(true)
    }

    /// A constant or tag that is a whole number.
    pub(super) fn whole_source(&mut self, text: &str) -> Result<LogixFormula, String> {
        let formula = LogixFormula::of(&self.value(text)?)?;
        match formula.value {
            ValueType::Whole => Ok(formula),
            ValueType::Real | ValueType::Bool => Err(format!("`{text}` is no whole number")),
        }
    }
}

/// A formula of a text.
pub(super) fn computed(text: String, reads: Vec<TouchedPlace>) -> LogixFormula {
    let formula = LogixFormula::whole(0);
    LogixFormula { text, reads, is_atom: false, is_plain: false, ..formula }
}

/// The text of a formula whose result is cut to the bits of a word.
fn cut(kind: &Kind, formula: &LogixFormula) -> String {
    let text = formula.operand();
    match kind {
        Kind::Dint => format!("{text} & -1"),
        Kind::Int => format!("{text} << 16 >> 16"),
        Kind::Sint => format!("{text} << 24 >> 24"),
        Kind::Uint => format!("{text} & 65535"),
        Kind::Usint => format!("{text} & 255"),
        Kind::Bool | Kind::Real | Kind::Struct(_) | Kind::Foreign(_) => formula.text.clone(),
    }
}
