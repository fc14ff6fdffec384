//! The target of a MATH: the text before its `=`.
//!
//! Called by `expression_parser`, which reads the expressions around it.

use super::atom::foreign_place;
use super::contact_lexer::bit_length;
use super::finding::{Code, Finding};
use super::fix::{possible, text as fix};
use super::indexed::{INDEX, rest_length};
use super::span::{Located, Span};

/// The parts of the text of a MATH.
pub(super) struct SplitFormula {
    pub target: Located<String>,
    /// The range of the target's index.
    pub index: Option<(usize, usize)>,
    /// The number of the bit behind the index.
    pub bit: Option<Located<String>>,
    /// The byte at which the expression begins.
    pub begin: usize,
}

/// Splits the text of a MATH at the `=` behind its target.
///
/// # Errors
/// The first mistake in the target.
pub(super) fn split(text: &str, span: Span) -> Result<SplitFormula, Finding> {
    let error = |place, message: &str| Finding::new(Code::ExpressionSyntax, place, message);
    let form = "its form is `MATH target = expression`: `MATH level = (raw - 6400) / 51`";
    let Some(at) = assignment(text) else {
        return Err(error(span, "MATH lacks the `=` behind its target").help(form));
    };
    let written = &text[..at];
    let start = written.len() - written.trim_start().len();
    let name = written.trim();
    let place = span.part(start, start + name.len().max(1));
    if name.is_empty() {
        return Err(error(place, "MATH lacks its target").help(form));
    }
    let (whole, bit) = match name.rfind(']').map(|end| end + 1) {
        Some(end) => {
            let end = end + rest_length(&name[end..]);
            let behind = &name[end..];
            match !behind.is_empty() && bit_length(behind) == behind.len() {
                true => {
                    let from = start + end;
                    let span = span.part(from, from + behind.len());
                    (&name[..end], Some(Located { value: behind[1..].to_owned(), span }))
                }
                false => (name, None),
            }
        }
        None => (name, None),
    };
    let (name, index, behind) = match whole.split_once('[') {
        None => (whole, None, ""),
        Some((base, rest)) if !is_slice(rest) && index_end(rest).is_some() => {
            let (from, length) = (start + base.len() + 1, index_end(rest).unwrap_or_default());
            (base.trim_end(), Some((from, from + length)), &rest[length + 1..])
        }
        Some(_) => {
            let help = "the target is one element: `MATH recipe[step] = …`";
            return Err(error(place, &format!("`{name}` is no target")).help(help));
        }
    };
    let place = span.part(start, start + name.len().max(1));
    if let Some(word) = name.strip_suffix([':', '+', '-', '*', '/']) {
        let sign = &name[word.len()..];
        let message = format!("`{sign}=` is no sign here");
        let word = word.trim_end();
        let signs = span.part(start + name.len() - 1, at + 1);
        let (help, right) = match sign {
            ":" => (format!("write `{word} = …`"), "=".to_owned()),
            _ => (format!("write `{word} = {word} {sign} …`"), format!("= {word} {sign}")),
        };
        return Err(error(place, &message).help(help).fix(fix(right).at(signs)));
    }
    if let Some(finding) = foreign_place(name, place, Code::ExpressionSyntax) {
        return Err(finding);
    }
    let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '$');
    if !name.chars().all(is_name) || name.starts_with(|c: char| c.is_ascii_digit()) {
        let message = format!("`{name}` is no target");
        let help = "the target is the name of a word or bit: `MATH D0 = D1 + 1`";
        return Err(error(place, &message).help(help).fix(possible("D0")));
    }
    let value = match behind.is_empty() {
        true => name.to_owned(),
        false => format!("{name}{INDEX}{behind}"),
    };
    let target = Located { value, span: place };
    Ok(SplitFormula { target, index, bit, begin: at + 1 })
}

/// The length of an index, if only the rest of its name is behind its `]`.
fn index_end(rest: &str) -> Option<usize> {
    let end = rest.rfind(']')?;
    let behind = &rest[end + 1..];
    (rest_length(behind) == behind.len()).then_some(end)
}

/// Whether the text behind a `[` is a slice (`0..6`). An index may also contain slices, in brackets
/// of their own.
fn is_slice(rest: &str) -> bool {
    rest.split(['[', '(', ']']).next().is_some_and(|ends| ends.contains(".."))
}

/// The first `=` outside brackets that is not part of `==`: it stands behind the target.
pub fn assignment(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let mut depth = 0usize;
    let mut at = 0;
    while at < bytes.len() {
        match bytes[at] {
            b'[' | b'(' => depth += 1,
            b']' | b')' => depth = depth.saturating_sub(1),
            b'=' if bytes.get(at + 1) == Some(&b'=') => at += 1,
            b'=' if depth == 0 => return Some(at),
            _ => {}
        }
        at += 1;
    }
    None
}
