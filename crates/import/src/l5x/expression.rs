//! Expressions of CPT and CMP, and of indexes: read, and written as expressions of rungd.
//!
//! Called by `locate`, `contacts` and `numbers`. It knows no tags: [`OperandReader`] does.

use super::formula::{LAST_BIT, LogixFormula, ValueType};
use super::operators::{binary, in_reals, join, logical, real};
use super::path;

/// Deepest nesting of an expression.
const DEPTH_MAX: usize = 20;

/// What knows the operands of a scope.
pub(crate) trait OperandReader {
    /// The formula of a constant or a tag.
    ///
    /// # Errors
    /// rungd cannot name it.
    fn formula_of(&mut self, scope: usize, text: &str) -> Result<LogixFormula, String>;
}

/// An expression in the index of an array.
///
/// # Errors
/// It is none, or rungd cannot say it.
pub(crate) fn index(
    memory: &mut dyn OperandReader,
    scope: usize,
    text: &str,
) -> Result<LogixFormula, String> {
    let formula = formula(memory, scope, text)?;
    match formula.value {
        ValueType::Whole => Ok(formula),
        ValueType::Real | ValueType::Bool => Err(format!("`{text}` is no index")),
    }
}

/// An expression.
///
/// # Errors
/// It is none, or rungd cannot say it.
pub(crate) fn formula(
    memory: &mut dyn OperandReader,
    scope: usize,
    text: &str,
) -> Result<LogixFormula, String> {
    Reader { rest: text, memory, scope, depth: 0, is_in_reals: false }.whole(text)
}

/// An expression that is computed in REALs, whatever its operands are.
///
/// # Errors
/// It is none, or rungd cannot say it.
pub(crate) fn formula_in_reals(
    memory: &mut dyn OperandReader,
    scope: usize,
    text: &str,
) -> Result<LogixFormula, String> {
    Reader { rest: text, memory, scope, depth: 0, is_in_reals: true }.whole(text)
}

struct Reader<'t, 'm> {
    rest: &'t str,
    memory: &'m mut dyn OperandReader,
    scope: usize,
    depth: usize,
    is_in_reals: bool,
}

impl<'t> Reader<'t, '_> {
    /// The formula of the whole text.
    fn whole(mut self, text: &str) -> Result<LogixFormula, String> {
        let formula = self.either()?;
        match self.rest.trim().is_empty() {
            true => Ok(formula),
            false => Err(format!("the expression `{text}`")),
        }
    }

    /// Takes one of the signs; a sign must not be the beginning of a longer one.
    fn sign(&mut self, signs: &[&'static str]) -> Option<&'static str> {
        let rest = self.rest.trim_start();
        let longer = ["**", "<>", "<=", ">=", "&&"];
        let found = signs.iter().find(|sign| {
            rest.starts_with(**sign)
                && !longer.iter().any(|long| rest.starts_with(long) && long.len() > sign.len())
        })?;
        self.rest = &rest[found.len()..];
        Some(found)
    }

    /// Takes one of the words, in any case.
    fn word(&mut self, words: &[&'static str]) -> Option<&'static str> {
        let rest = self.rest.trim_start();
        let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        let found = words.iter().find(|word| rest[..end].eq_ignore_ascii_case(word))?;
        self.rest = &rest[end..];
        Some(found)
    }

    fn either(&mut self) -> Result<LogixFormula, String> {
        let mut left = self.exclusive()?;
        loop {
            if self.word(&["OR"]).is_some() {
                left = binary("|", left, self.exclusive()?)?;
            } else if self.sign(&["||"]).is_some() {
                left = logical("|", left, self.exclusive()?)?;
            } else {
                break;
            }
        }
        Ok(left)
    }

    fn exclusive(&mut self) -> Result<LogixFormula, String> {
        let mut left = self.both()?;
        while self.word(&["XOR"]).is_some() {
            left = binary("^", left, self.both()?)?;
        }
        Ok(left)
    }

    fn both(&mut self) -> Result<LogixFormula, String> {
        let mut left = self.compared()?;
        loop {
            if self.sign(&["&&"]).is_some() {
                left = logical("&", left, self.compared()?)?;
            } else if self.word(&["AND"]).is_some() || self.sign(&["&"]).is_some() {
                left = binary("&", left, self.compared()?)?;
            } else {
                break;
            }
        }
        Ok(left)
    }

    fn compared(&mut self) -> Result<LogixFormula, String> {
        let left = self.sum()?;
        let Some(sign) = self.sign(&["<>", "<=", ">=", "=", "<", ">"]) else { return Ok(left) };
        let right = self.sum()?;
        let operator = match sign {
            "=" => "==",
            "<>" => "!=",
            sign => sign,
        };
        let is_real = left.value == ValueType::Real || right.value == ValueType::Real;
        let (left, right) = match is_real {
            true => (left.into_real(), right.into_real()),
            false => (left.wrapped(), right.wrapped()),
        };
        let compared = join(operator, left, right);
        Ok(LogixFormula { value: ValueType::Bool, ..compared })
    }

    fn sum(&mut self) -> Result<LogixFormula, String> {
        let mut left = self.product()?;
        while let Some(sign) = self.sign(&["+", "-"]) {
            left = binary(sign, left, self.product()?)?;
        }
        Ok(left)
    }

    fn product(&mut self) -> Result<LogixFormula, String> {
        let mut left = self.signed()?;
        loop {
            let operator = match self.sign(&["*", "/"]) {
                Some(sign) => sign,
                None if self.word(&["MOD"]).is_some() => "%",
                None => return Ok(left),
            };
            left = binary(operator, left, self.signed()?)?;
        }
    }

    fn signed(&mut self) -> Result<LogixFormula, String> {
        self.depth += 1;
        if self.depth > DEPTH_MAX {
            return Err("an expression that nests too deeply".to_owned());
        }
        let formula = if self.sign(&["-"]).is_some() {
            negative(self.signed()?)?
        } else if self.word(&["NOT"]).is_some() {
            complement(self.signed()?)?
        } else {
            self.power()?
        };
        self.depth -= 1;
        Ok(formula)
    }

    fn power(&mut self) -> Result<LogixFormula, String> {
        let left = self.atom()?;
        if self.sign(&["**"]).is_none() {
            return Ok(left);
        }
        let right = self.signed()?;
        if left.value != ValueType::Real && right.value != ValueType::Real {
            return Err("a power of whole numbers".to_owned());
        }
        binary("**", left, right)
    }

    fn atom(&mut self) -> Result<LogixFormula, String> {
        if self.sign(&["("]).is_some() {
            let inner = self.either()?;
            return match self.sign(&[")"]) {
                Some(_) => Ok(inner),
                None => Err("an expression without its `)`".to_owned()),
            };
        }
        let rest = self.rest.trim_start();
        let end = atom_end(rest);
        let (text, behind) = rest.split_at(end);
        if text.is_empty() {
            return Err(format!(
                "the expression at `{}`",
                rest.chars().take(12).collect::<String>()
            ));
        }
        self.rest = behind;
        let is_call =
            behind.trim_start().starts_with('(') && text.chars().all(|c| c.is_ascii_alphabetic());
        if is_call {
            self.sign(&["("]);
            let argument = self.either()?;
            if self.sign(&[")"]).is_none() {
                return Err("a function without its `)`".to_owned());
            }
            return function(&text.to_uppercase(), argument);
        }
        let formula = self.memory.formula_of(self.scope, text)?;
        let is_whole = formula.value == ValueType::Whole;
        Ok(if self.is_in_reals && is_whole { in_reals(formula) } else { formula })
    }
}

/// Where a tag or a number ends.
fn atom_end(text: &str) -> usize {
    let is_number = text.starts_with(|c: char| c.is_ascii_digit());
    let mut depth = 0_usize;
    let mut before = ' ';
    for (at, letter) in text.char_indices() {
        let is_exponent = is_number && matches!(before, 'e' | 'E') && matches!(letter, '+' | '-');
        let is_part = letter.is_ascii_alphanumeric()
            || matches!(letter, '_' | '.' | ':' | '#' | '\\')
            || is_exponent && !text.contains('#');
        match letter {
            '[' => depth += 1,
            ']' if depth > 0 => depth -= 1,
            _ if depth > 0 || is_part => {}
            _ => return at,
        }
        before = letter;
    }
    text.len()
}

/// The opposite of a number.
pub(crate) fn negative(formula: LogixFormula) -> Result<LogixFormula, String> {
    if formula.value == ValueType::Bool {
        return Err("`-` of a bit".to_owned());
    }
    if let Some(value) = formula.text.parse::<i64>().ok().and_then(i64::checked_neg) {
        return Ok(LogixFormula::whole(value));
    }
    let bits = formula.bits.max(32) + 1;
    let text = format!("-{}", formula.operand());
    let is_real = formula.value == ValueType::Real;
    let is_plain = formula.is_constant();
    Ok(LogixFormula {
        text,
        bits: if is_real || is_plain { 32 } else { bits },
        is_atom: false,
        is_plain,
        ..formula
    })
}

/// All bits turned round; of a condition its opposite.
pub(crate) fn complement(formula: LogixFormula) -> Result<LogixFormula, String> {
    match formula.value {
        ValueType::Real => Err("NOT of a REAL".to_owned()),
        ValueType::Bool => {
            let text = format!("!{}", formula.operand());
            Ok(LogixFormula { text, is_atom: false, is_plain: false, ..formula })
        }
        ValueType::Whole => {
            let formula = formula.wrapped();
            let text = format!("~{}", formula.operand());
            Ok(LogixFormula { text, is_atom: false, is_plain: false, ..formula })
        }
    }
}

/// A function of Logix.
///
/// # Errors
/// rungd has none like it.
pub(crate) fn function(name: &str, argument: LogixFormula) -> Result<LogixFormula, String> {
    let argument = argument.wrapped();
    if argument.value == ValueType::Bool {
        return Err(format!("{name} of a bit"));
    }
    let is_real = argument.value == ValueType::Real;
    let last_bit = |mut formula: LogixFormula| {
        formula.value = ValueType::Real;
        formula.real_operations += 1;
        formula.differences.push(LAST_BIT);
        formula
    };
    Ok(match name {
        "ABS" => {
            let bits = if is_real { 32 } else { 33 };
            LogixFormula { bits, ..argument.call("abs") }
        }
        // Logix takes the root of the absolute value, and cuts what a whole number leaves.
        "SQR" | "SQRT" => {
            let root = argument.into_real().call("abs").call("sqrt");
            let root = LogixFormula {
                value: ValueType::Real,
                real_operations: root.real_operations + 1,
                ..root
            };
            match is_real {
                true => root,
                false => LogixFormula { value: ValueType::Whole, bits: 32, ..root.call("trunc") },
            }
        }
        "TRN" | "TRUNC" if is_real => {
            LogixFormula { value: ValueType::Whole, bits: 64, ..argument.call("trunc") }
        }
        "TRN" | "TRUNC" => argument,
        "SIN" | "COS" | "TAN" | "LN" => last_bit(argument.into_real().call(&name.to_lowercase())),
        "LOG" => last_bit(argument.into_real().call("log10")),
        "ASN" | "ASIN" => last_bit(argument.into_real().call("asin")),
        "ACS" | "ACOS" => last_bit(argument.into_real().call("acos")),
        "ATN" | "ATAN" => last_bit(argument.into_real().call("atan")),
        "DEG" => last_bit(real("*", argument.into_real(), constant("57.29578"))),
        "RAD" => last_bit(real("*", argument.into_real(), constant("0.017453292"))),
        _ => return Err(format!("the function {name}")),
    })
}

fn constant(text: &str) -> LogixFormula {
    LogixFormula { value: ValueType::Real, ..LogixFormula::plain(text.to_owned()) }
}

/// Whether a text may be a number or an expression, and not only a tag.
pub(crate) fn is_expression(text: &str) -> bool {
    path::parse(text).is_none() && path::whole(text).is_none() && path::real(text).is_none()
}
