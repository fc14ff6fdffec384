//! Findings about instructions in the form of other languages: `D0 = 5`, `MOVE 3 to D0`.
//!
//! Called by `instruction`, before it splits the operands. Each help shows text that can be pasted
//! as it is, with the author's own operands.

use super::finding::{Code, Finding};
use super::fix::{Help, advise, possible, write};
use super::instruction_commas::one_each;
use super::span::Span;
pub use rungd_engine::isa::{Address, MemorySizes, Mnemonic, OperandKind, address_text};

/// The finding for an instruction in the form of a different language; `None` for any other text.
pub(super) fn other_form(text: &str, words: &[(usize, &str)], span: Span) -> Option<Finding> {
    assignment(text, span).or_else(|| keys_alone(words, span))
}

/// The finding for several instructions in one text: `OUT a, OUT b`, `SET a; RST b`, `SET a RST b`.
pub(super) fn several(text: &str, words: &[(usize, &str)], span: Span) -> Option<Finding> {
    let parted = || text.split([',', ';']).map(str::trim).filter(|part| !part.is_empty());
    let parted: Vec<&str> = match text.contains([',', ';']) {
        true => parted().collect(),
        false => Vec::new(),
    };
    let each = match parted.len() > 1 && parted.iter().all(|part| is_instruction(part)) {
        true => parted,
        false => side_by_side(text, words)?,
    };
    let finding = Finding::new(
        Code::InstructionSyntax,
        span,
        format!("{} instructions in one text", each.len()),
    );
    Some(finding.help(one_each(each.iter().map(|part| (*part).to_owned()))))
}

/// Whether a text begins with a mnemonic, in capitals, and has the operands that it needs.
fn is_instruction(text: &str) -> bool {
    let mut words = text.split_whitespace();
    let spec = words.next().and_then(Mnemonic::from_name).map(Mnemonic::spec);
    let has_operands = words.next().is_some();
    spec.is_some_and(|spec| has_operands != spec.operands.is_empty())
}

/// The instructions of a text that follow each other without a sign between them.
fn side_by_side<'t>(text: &'t str, words: &[(usize, &str)]) -> Option<Vec<&'t str>> {
    let is_mnemonic = |word: &str| Mnemonic::from_name(word).is_some();
    // After MATH and after a list of Stages, a word can be a name that looks like a mnemonic.
    let (_, first) = words.first()?;
    let spec = Mnemonic::from_name(first)?.spec();
    if *first == "MATH" || spec.operands.iter().any(|row| row.kind == OperandKind::Stages) {
        return None;
    }
    let starts = || words.iter().filter(|(_, word)| is_mnemonic(word)).map(|(at, _)| *at);
    starts().nth(1)?;
    let starts: Vec<usize> = starts().collect();
    let ends = starts.iter().skip(1).copied().chain([text.len()]);
    let parts: Vec<&str> =
        starts.iter().zip(ends).map(|(start, end)| text[*start..end].trim()).collect();
    parts.iter().all(|part| is_instruction(part)).then_some(parts)
}

/// The finding for an assignment: `D0 = 5`, `LET D0=5`, `OUT Y0 = 1`.
fn assignment(text: &str, span: Span) -> Option<Finding> {
    let (left, right) = text.split_once('=')?;
    let (left, right) = (left.trim_end_matches(':'), right.trim());
    let words: Vec<&str> = left.split_whitespace().collect();
    let (verb, target) = match words.as_slice() {
        [target] => (String::new(), *target),
        [verb, target] => (verb.to_ascii_uppercase(), *target),
        _ => return None,
    };
    let is_verb = ["", "LET", "OUT", "SET", "RST", "MOVE", "MOV"].contains(&verb.as_str());
    let is_key = Mnemonic::from_name(&verb).is_some_and(|mnemonic| has_key(mnemonic, target));
    let is_mnemonic = Mnemonic::from_name(&target.to_ascii_uppercase()).is_some();
    let is_name = target.starts_with(|c: char| c.is_ascii_alphabetic());
    let has_more = right.is_empty() || right.contains('=') || right.len() + target.len() > 80;
    if !is_verb || is_key || is_mnemonic || !is_name || has_more {
        return None;
    }
    let finding = Finding::new(Code::InstructionSyntax, span, "`=` assigns in MATH alone");
    Some(finding.help(assigned(&verb, target, right)))
}

/// The help for an assignment: the instruction to write instead.
fn assigned(verb: &str, target: &str, right: &str) -> Help {
    let address = address_text::parse(target, &MemorySizes::default()).ok();
    let is_word = matches!(address, Some(Address::Word(_)));
    let is_bit = matches!(address, Some(Address::Bit(_)))
        || (!is_word && ["OUT", "SET", "RST"].contains(&verb));
    match right.to_ascii_lowercase().as_str() {
        "1" | "true" | "on" if is_bit && verb == "OUT" => {
            let coils = [format!("OUT {target}"), format!("SET {target}")].map(possible);
            advise("`{}` is ON while the rung is; `{}` keeps it ON", coils)
        }
        "1" | "true" | "on" if is_bit => write(format!("SET {target}")),
        "0" | "false" | "off" if is_bit => write(format!("RST {target}")),
        _ if is_word && right.bytes().all(|b| b.is_ascii_alphanumeric()) => advise(
            "write `{}`, or `{}`",
            [format!("MOVE {right} to={target}"), format!("MATH {target} = {right}")],
        ),
        _ => write(format!("MATH {target} = {right}")),
    }
}

fn has_key(mnemonic: Mnemonic, word: &str) -> bool {
    mnemonic.spec().row(Some(word), 0).is_some()
}

/// The finding for keys that are words of their own: `MOVE 3 to D0`.
fn keys_alone(words: &[(usize, &str)], span: Span) -> Option<Finding> {
    let (_, name) = words.first()?;
    let capitals = || Mnemonic::from_name(&name.to_ascii_uppercase());
    let mnemonic = Mnemonic::from_name(name).or_else(capitals)?;
    let is_key = |word: &str| has_key(mnemonic, word.trim_end_matches(':'));
    if !words.iter().any(|(_, word)| is_key(word)) {
        return None;
    }
    let is_given = |key: &str| {
        words.iter().any(|(_, word)| word.strip_prefix(key).is_some_and(|v| v.starts_with('=')))
    };
    let (mut right, mut place, mut at) = (Vec::new(), None, 0);
    while let Some((start, word)) = words.get(at) {
        let key = word.trim_end_matches(':');
        let value = words.get(at + 1).filter(|(_, value)| !value.contains('='));
        match value.filter(|_| has_key(mnemonic, key) && !is_given(key)) {
            Some((value_at, value)) => {
                right.push(format!("{key}={value}"));
                place.get_or_insert(span.part(*start, value_at + value.len()));
                at += 2;
            }
            None => {
                right.push((*word).to_owned());
                at += 1;
            }
        }
    }
    let right = right.join(" ");
    let finding = Finding::new(
        Code::InstructionSyntax,
        place.filter(|_| right.len() <= 160)?,
        "an operand with a key is one word: `key=value`",
    );
    Some(finding.help(write(right).at(span)))
}
