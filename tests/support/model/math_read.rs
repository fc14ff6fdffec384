//! A second, recursive reader for MATH.

use super::math::Expr;
use super::names::Names;
use super::program::{Target, Value};

/// The binary operators, from the lowest precedence to the highest.
const LEVELS: [&[&str]; 11] = [
    &["||"],
    &["&&"],
    &["|"],
    &["^"],
    &["&"],
    &["==", "!="],
    &["<", "<=", ">", ">="],
    &["<<", ">>", ">>>"],
    &["+", "-"],
    &["*", "/", "%"],
    &["**"],
];

/// Reads `target = expression`.
pub fn read(text: &str, names: &Names) -> Result<(Target, Expr), String> {
    let mut depth = 0;
    let end = text.find(|c: char| {
        depth += i32::from(c == '[') - i32::from(c == ']');
        c == '=' && depth == 0
    });
    let (target, behind) = text.split_at(end.ok_or("MATH without `=`")?);
    let target = match expression(target, names)? {
        Expr::At(loc) => Target::At(loc),
        Expr::Element(array, index) => Target::Element(array, *index),
        other => return Err(format!("{other:?} is no target")),
    };
    Ok((target, expression(&behind[1..], names)?))
}

/// Reads an expression of a contact, whose hexadecimal numbers are no patterns of 32 bits.
pub fn of_contact(text: &str, names: &Names) -> Result<Expr, String> {
    whole(text, Reader { words: words(text), at: 0, names, is_contact: true })
}

fn expression(text: &str, names: &Names) -> Result<Expr, String> {
    whole(text, Reader { words: words(text), at: 0, names, is_contact: false })
}

fn whole(text: &str, mut reader: Reader) -> Result<Expr, String> {
    let expr = reader.level(0)?;
    match reader.words.get(reader.at) {
        None => Ok(expr),
        Some(word) => Err(format!("`{word}` is left over in `{text}`")),
    }
}

fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let is_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | '$' | ':');
        let mut length = if is_word(first) {
            rest.find(|c| !is_word(c)).unwrap_or(rest.len())
        } else {
            let signs = LEVELS.iter().flat_map(|level| level.iter());
            let fits = signs.filter(|sign| rest.starts_with(**sign));
            fits.map(|sign| sign.len()).max().unwrap_or(1)
        };
        let is_real = first.is_ascii_digit() && rest[..length].ends_with('e');
        if is_real && !rest.starts_with("0x") && rest[length..].starts_with('-') {
            let digits = &rest[length + 1..];
            length += 1 + digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
        }
        words.push(rest[..length].to_string());
        rest = rest[length..].trim_start();
    }
    words
}

struct Reader<'a> {
    words: Vec<String>,
    at: usize,
    names: &'a Names,
    is_contact: bool,
}

impl Reader<'_> {
    fn peek(&self) -> &str {
        self.words.get(self.at).map_or("", String::as_str)
    }

    fn take(&mut self, word: &str) -> bool {
        let found = self.peek() == word;
        self.at += usize::from(found);
        found
    }

    fn level(&mut self, level: usize) -> Result<Expr, String> {
        let Some(signs) = LEVELS.get(level) else { return self.unary() };
        let mut left = self.level(level + 1)?;
        while signs.contains(&self.peek()) {
            let sign = self.peek().to_string();
            self.at += 1;
            // Powers are right-associative.
            let right = self.level(if sign == "**" { level } else { level + 1 })?;
            left = Expr::Binary(sign, Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    fn unary(&mut self) -> Result<Expr, String> {
        for sign in ['-', '~', '!'] {
            if self.take(&sign.to_string()) {
                return Ok(Expr::Unary(sign, Box::new(self.unary()?)));
            }
        }
        if self.take("(") {
            let inner = self.level(0)?;
            return if self.take(")") { Ok(inner) } else { Err("`)` is missing".to_string()) };
        }
        let word = self.peek().to_string();
        self.at += 1;
        if self.take("(") {
            let mut arguments = Vec::new();
            loop {
                match self.level(0)? {
                    Expr::Whole(array) => arguments.extend(array.each().map(Expr::At)),
                    one => arguments.push(one),
                }
                if !self.take(",") {
                    break;
                }
            }
            return if self.take(")") {
                Ok(Expr::Call(word, arguments))
            } else {
                Err("`)` is missing".to_string())
            };
        }
        if self.take("[") {
            return self.indexed(&word);
        }
        match self.names.arrays.get(&word) {
            Some(array) => Ok(Expr::Whole(*array)),
            None => self.operand(&word),
        }
    }

    /// Reads the rest after the name of an array: an index or the ends of a slice, and a part.
    fn indexed(&mut self, name: &str) -> Result<Expr, String> {
        let ends = self.peek().split_once("..");
        let ends = ends.and_then(|(low, high)| Some((low.parse().ok()?, high.parse().ok()?)));
        let index = match ends {
            Some(_) => {
                self.at += 1;
                None
            }
            None => Some(Box::new(self.level(0)?)),
        };
        if !self.take("]") {
            return Err("`]` is missing".to_string());
        }
        let part = if self.peek().starts_with('.') { self.peek() } else { "" };
        let whole = format!("{name}{part}");
        self.at += usize::from(!part.is_empty());
        let missing = || format!("`{whole}` is no array");
        let array = self.names.column(&whole).ok_or_else(missing)?;
        Ok(match (ends, index) {
            (Some((low, high)), _) => Expr::Whole(array.slice(low, high).ok_or_else(missing)?),
            (None, Some(index)) => Expr::Element(array, index),
            (None, None) => return Err(missing()),
        })
    }

    fn operand(&self, word: &str) -> Result<Expr, String> {
        if let Some(digits) = word.strip_prefix("0x") {
            let bits = u32::from_str_radix(digits, 16).map_err(|error| error.to_string())?;
            return Ok(Expr::Integer(match self.is_contact {
                true => i128::from(bits),
                false => i128::from(bits as i32),
            }));
        }
        if let Ok(number) = word.parse::<i128>() {
            return Ok(Expr::Integer(number));
        }
        let is_number = word.starts_with(|c: char| c.is_ascii_digit());
        if is_number && word.contains(['.', 'e']) {
            let real: f32 = word.parse().map_err(|_| format!("`{word}` is no real"))?;
            return Ok(Expr::Real(f64::from(real)));
        }
        Ok(match self.names.value(word)? {
            Value::Const(number) => Expr::Integer(i128::from(number)),
            Value::Real(real) => Expr::Real(real),
            Value::At(loc) => Expr::At(loc),
            Value::Element(..) => return Err(format!("`{word}` is no word of MATH")),
        })
    }
}
