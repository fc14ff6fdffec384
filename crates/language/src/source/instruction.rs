//! Instructions as written: a mnemonic, and operands separated by spaces.
//!
//! Called by the reader of ladder files. `key=value` is split here; the resolver checks mnemonics,
//! keys and values. The text behind `MATH` has a grammar of its own, in `expression_parser`.

use std::ops::Range;

use super::atom::{Atom, foreign_place};
use super::expression::WrittenFormula;
use super::expression_parser::parse_formula;
use super::finding::{Code, Finding};
use super::fix::{FixEdit, advise, possible, text as written};
use super::indexed::{IndexedName, help_about_index, not_an_index};
use super::instruction_commas::{called, comma_help, is_element, listed, pointed};
use super::instruction_habits::{other_form, several};
pub use super::math_target::assignment;
use super::span::{Located, Span};
use rungd_engine::isa::{OperandSpec, Spec, notation};

/// One instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WrittenInstruction {
    /// The place of its whole text.
    pub(crate) span: Span,
    /// The first word.
    pub(crate) mnemonic: Located<String>,
    /// The other words.
    pub(crate) operands: Vec<OperandText>,
    /// The text behind `MATH`, which is not split into words.
    pub formula: Option<WrittenFormula>,
}

/// One operand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct OperandText {
    /// The place of the whole word.
    pub span: Span,
    /// The key of `key=value`.
    pub key: Option<Located<String>>,
    /// The value.
    pub value: Atom,
}

/// Parses the text of an instruction; `span` is the place of the whole text. Adds every mistake to
/// `findings`; returns `None` if there is a mistake.
pub fn parse(text: &str, span: Span, findings: &mut Vec<Finding>) -> Option<WrittenInstruction> {
    let all = words(text);
    let Some((&(at, mnemonic), behind)) = all.split_first() else {
        let finding = Finding::new(Code::InstructionSyntax, span, "an empty instruction");
        let help = "take it away, or name an instruction: `OUT Y0`";
        findings.push(finding.help(help).fix(FixEdit::Delete));
        return None;
    };
    let mnemonic = Located { value: mnemonic.to_owned(), span: span.part(at, at + mnemonic.len()) };
    if let Some(finding) = several(text, &all, span) {
        findings.push(finding);
        return None;
    }
    if let Some(finding) = called(text, span) {
        findings.push(finding);
        return None;
    }
    if mnemonic.value.eq_ignore_ascii_case("MATH") {
        let formula = formula(text, mnemonic.span, span, findings)?;
        return Some(WrittenInstruction {
            span,
            mnemonic,
            operands: Vec::new(),
            formula: Some(formula),
        });
    }
    if let Some(finding) = other_form(text, &all, span) {
        findings.push(finding);
        return None;
    }
    if let Some(finding) = listed(&all, span) {
        findings.push(finding);
        return None;
    }
    let mut operands = Vec::new();
    let mut whole = true;
    for (number, &(at, word)) in behind.iter().enumerate() {
        match operand(word, &mnemonic.value, span.part(at, at + word.len())) {
            Ok(operand) => operands.push(operand),
            Err(finding) => {
                findings.push(match joined(behind, number) {
                    Some((right, place)) => {
                        let right = written(right).at(span.part(place.start, place.end));
                        finding.help(advise("write it without spaces: `{}`", [right]))
                    }
                    None => match behind.get(number.wrapping_sub(1)) {
                        Some((name_at, name)) if word.starts_with('[') => {
                            let place = span.part(*name_at, at + word.len());
                            finding.fix(written(format!("{name}{word}")).at(place))
                        }
                        Some(_) | None => *finding,
                    },
                });
                whole = false;
            }
        }
    }
    whole.then_some(WrittenInstruction { span, mnemonic, operands, formula: None })
}

/// Parses the text behind `MATH`; `mnemonic` is the place of the word `MATH`.
fn formula(
    text: &str,
    mnemonic: Span,
    span: Span,
    findings: &mut Vec<Finding>,
) -> Option<WrittenFormula> {
    let behind = (mnemonic.end - span.start) as usize;
    let rest = &text[behind..];
    let place = if rest.trim().is_empty() { mnemonic } else { span.part(behind, text.len()) };
    parse_formula(rest, place, findings)
}

/// The operand of several words without its spaces: `to=D0` for `to = D0`, `to= D0` and `to =D0`.
/// `number` is the index of the word with the `=`. Also returns the place of the words.
fn joined(words: &[(usize, &str)], number: usize) -> Option<(String, Range<usize>)> {
    let word = words[number].1;
    let first = number.checked_sub(usize::from(word.starts_with('=')))?;
    let last = number + usize::from(word.ends_with('='));
    let (end, value) = words.get(last)?;
    let all: String = words[first..=last].iter().map(|(_, word)| *word).collect();
    let plain = all.matches('=').count() == 1 && all.len() <= 80;
    (plain && first < last).then_some((all, words[first].0..end + value.len()))
}

/// The words of a text that spaces separate, each with its place.
pub fn words(text: &str) -> Vec<(usize, &str)> {
    let mut words = Vec::new();
    let mut at = 0;
    for word in text.split([' ', '\t']) {
        if !word.is_empty() {
            words.push((at, word));
        }
        at += word.len() + 1;
    }
    words
}

/// An operand in a text that may be incomplete.
#[derive(Clone, Debug)]
pub struct OperandWord<'t> {
    /// Its key.
    pub key: Option<&'t str>,
    /// The place of its value, behind the key.
    pub value: Range<usize>,
    /// Its row in the instruction table; `None`: the instruction has no such operand.
    pub row: Option<&'static OperandSpec>,
}

/// The operands behind the mnemonic of an instruction other than MATH, also if the text has
/// mistakes.
pub fn operand_words<'t>(text: &'t str, spec: &'static Spec) -> Vec<OperandWord<'t>> {
    let mut number = 0;
    let mut operand = |(at, word): (usize, &'t str)| {
        let key = word.split_once('=').map(|(key, _)| key);
        let row = spec.row(key, number);
        number += usize::from(key.is_none());
        let start = at + key.map_or(0, |key| key.len() + 1);
        OperandWord { key, value: start..at + word.len(), row }
    };
    words(text).into_iter().map(&mut operand).collect()
}

fn operand(word: &str, mnemonic: &str, span: Span) -> Result<OperandText, Box<Finding>> {
    let error = |message: String| Finding::new(Code::InstructionSyntax, span, message);
    if let Some(stray) = word.chars().find(|c| !allowed(*c)) {
        let message = format!("`{}` belongs to no operand", stray.escape_debug());
        let signed = word.strip_prefix('+').filter(|digits| digits.parse::<u32>().is_ok());
        if let Some(digits) = signed {
            let finding = error("a number has no `+`".to_owned());
            return Err(Box::new(finding.write(digits)));
        }
        let value = word.split_once('=').map_or(word, |(_, value)| value);
        let place = span.part(word.len() - value.len(), word.len());
        if let Some(right) = notation::corrected(value) {
            let (key, message) = (&word[..word.len() - value.len()], "of other systems");
            let finding = error(format!("`{value}` is in the notation {message}"));
            return Err(Box::new(finding.write(format!("{key}{right}"))));
        }
        if let Some(finding) =
            foreign_place(value.trim_start_matches('#'), place, Code::InstructionSyntax)
        {
            return Err(Box::new(finding));
        }
        let help = match stray {
            c if c.is_alphabetic() => {
                "names are of the letters A to Z and a to z, digits and `_`: `groesse`"
            }
            '+' | '*' | '/' => "operands are names and constants: compute with MATH",
            '"' | '\'' => "operands have no quotes",
            '(' | ')' | '!' | '&' | '|' | '<' | '>' => "conditions stand in `when`",
            _ => "an operand is a name, a number or a duration: `D0`, `12`, `1m30s`",
        };
        return Err(Box::new(error(message).help(help)));
    }
    let has_brackets = word.bytes().any(|byte| matches!(byte, b'[' | b']'));
    if has_brackets && word.rfind('[').is_some_and(|open| word[..open].contains(']')) {
        let finding = error("an element has one index".to_owned());
        let help = advise("count from element 0 of the whole array: `{}`", [possible("recipe[3]")]);
        return Err(Box::new(finding.help(help)));
    }
    let is_whole = || word.matches('[').count() == word.matches(']').count();
    if has_brackets && (!is_whole() || word.starts_with('[')) {
        let finding = error("an index is one word with its name".to_owned());
        return Err(Box::new(finding.help("write it without spaces: `recipe[3]`, `recipe[step]`")));
    }
    if word.contains(',') && !is_element(word) {
        if let Some(right) = pointed(word) {
            let finding = error("a decimal comma in a number".to_owned());
            return Err(Box::new(finding.write(right)));
        }
        let finding = error("operands are separated by spaces".to_owned());
        return Err(Box::new(finding.help(comma_help(word, mnemonic))));
    }
    let Some((key, value)) = word.split_once('=') else {
        return Ok(OperandText { span, key: None, value: value_of(word, span)? });
    };
    if key.is_empty() || value.is_empty() || value.contains('=') {
        let finding = error("an operand with a key is one word: `key=value`".to_owned());
        return Err(Box::new(finding.help("write it without spaces: `preset=12`")));
    }
    let place = span.part(key.len() + 1, word.len());
    let key = Located { value: key.to_owned(), span: span.part(0, key.len()) };
    Ok(OperandText { span, key: Some(key), value: value_of(value, place)? })
}

/// An operand behind its key: a name with at most one index, or a constant.
fn value_of(word: &str, span: Span) -> Result<Atom, Box<Finding>> {
    match IndexedName::of(word) {
        Some(IndexedName { index, .. }) if index.contains('[') => {
            let finding = Finding::new(Code::OperandType, span, not_an_index(index));
            Err(Box::new(finding.help(help_about_index())))
        }
        Some(_) | None => Atom::parse(word, span).map_err(Box::new),
    }
}

fn allowed(c: char) -> bool {
    c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.' | ',' | '$' | ':' | '=' | '[' | ']')
}
