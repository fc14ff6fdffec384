//! Commas and parentheses in instructions: between operands, in numbers, and in the vendor's
//! counters (`N,0,6`).
//!
//! Called by `instruction`. Operands are separated by spaces; each help shows the text to write.

use super::finding::{Code, Finding};
use super::fix::{Fix, Help, advise, dialect, moved_to_when, possible, propose, write};
use super::span::Span;
pub use rungd_engine::isa::{Function, Mnemonic, OperandKind, decimal_comma, dialects};

/// The finding for commas between operands: `TMR t, 5s`. Its help is the whole instruction without
/// them. `None` for any other text, and if a word has a comma that is none between operands.
pub(super) fn listed(all: &[(usize, &str)], span: Span) -> Option<Finding> {
    let (&(_, mnemonic), behind) = all.split_first()?;
    let is_outer = |word: &str| word.starts_with(',') || word.ends_with(',');
    let &(at, first) = behind.iter().find(|(_, word)| is_outer(word))?;
    let plain = behind.iter().map(|(_, word)| word.trim_matches(','));
    let plain: Option<Vec<String>> = plain.filter(|word| !word.is_empty()).map(uncommaed).collect();
    let help = without_commas(mnemonic, &plain?);
    let place = span.part(at, at + first.len());
    let message = "operands are separated by spaces";
    Some(Finding::new(Code::InstructionSyntax, place, message).help(help.at(span)))
}

/// The finding for operands in parentheses: `OTE(b)`, `MOVE(5,D0)`. `None` for any other text.
pub(super) fn called(text: &str, span: Span) -> Option<Finding> {
    let (name, behind) = text.trim().split_once('(')?;
    let name = name.trim_end();
    let inner = behind.strip_suffix(')').filter(|inner| !inner.contains(['(', ')']))?;
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let is_function = Function::from_name(&name.to_ascii_lowercase()).is_some();
    if name.is_empty() || !name.chars().all(is_name) || name == "MATH" || is_function {
        return None;
    }
    let operands =
        inner.split(',').map(str::trim).filter(|operand| !operand.is_empty() && *operand != "?");
    let operands: Vec<&str> = operands.collect();
    let spec = Mnemonic::from_name(&name.to_ascii_uppercase()).map(Mnemonic::spec);
    let help = if let Some(right) = dialects::instruction(name, &operands) {
        write(right)
    } else if let Some(right) = dialects::contact(name, &operands) {
        moved_to_when(&right)
    } else if let Some(spec) = spec {
        let plain = operands.iter().take(spec.operands.len()).map(|operand| (*operand).to_owned());
        without_commas(spec.name, &plain.collect::<Vec<String>>())
    } else {
        dialect(dialects::instead_of(name)?)
    };
    let message = "operands stand behind the mnemonic, without parentheses";
    Some(Finding::new(Code::InstructionSyntax, span, message).help(help))
}

/// The help for an instruction: its operands without commas, with the keys that they need.
fn without_commas(mnemonic: &str, plain: &[String]) -> Help {
    let joined = plain.join(" ");
    let Some(spec) = Mnemonic::from_name(&mnemonic.to_ascii_uppercase()).map(Mnemonic::spec) else {
        let operands: Vec<&str> = plain.iter().map(String::as_str).collect();
        let right = dialects::instruction(mnemonic, &operands);
        return write(right.unwrap_or_else(|| format!("{mnemonic} {joined}")));
    };
    let places = spec.operands.iter().take_while(|operand| operand.key.is_none()).count();
    let has_stages = spec.operands.iter().any(|operand| operand.kind == OperandKind::Stages);
    if places == 1 && spec.operands.len() == 1 && plain.len() > 1 && !has_stages {
        return one_each(plain.iter().map(|name| format!("{mnemonic} {name}")));
    }
    let mut keys = spec.operands.iter().filter_map(|operand| operand.key);
    let mut keyed = |at: usize, word: &String| {
        let needs_key = at >= places && !word.contains('=');
        let key = if needs_key { keys.next() } else { None };
        key.map_or(word.clone(), |key| format!("{key}={word}"))
    };
    let words: Vec<String> = plain.iter().enumerate().map(|(at, word)| keyed(at, word)).collect();
    let right = words.join(" ");
    let is_vendors = || plain.first().is_none_or(|word| word.starts_with(['N', 'n']));
    let is_counter = [Mnemonic::Ctu, Mnemonic::Ctd].contains(&spec.mnemonic);
    match is_counter && !is_vendors() {
        true => propose(format!("{mnemonic} {right}")).and(&format!(
            " for Sensaphone's counter; the counter of IEC is `CNT {right}`, with its legs \
             `leg.up` and `leg.rst` instead of `when`"
        )),
        false => write(format!("{mnemonic} {right}")),
    }
}

/// The instruction of the first form in a help, with the operands of an instruction of another
/// controller, if it takes as many.
pub(crate) fn in_form(help: &str, operands: &[String]) -> Option<Fix> {
    let form = help.split('`').nth(1)?;
    let spec = Mnemonic::from_name(form.split(' ').next()?)?.spec();
    let required = spec.operands.iter().filter(|operand| !operand.optional).count();
    let fits = required == operands.len() && required > 0;
    let fixes = fits.then(|| without_commas(spec.name, operands).fixes)?;
    fixes.into_iter().next().map(Fix::possible)
}

/// The help to write each instruction as a string of its own.
pub(super) fn one_each(instructions: impl Iterator<Item = String>) -> Help {
    let each = instructions.map(|one| format!("\"{one}\"")).collect::<Vec<_>>().join(", ");
    advise("one instruction for each: {}", [each])
}

/// A word with a point for the decimal comma; `None` if its comma is neither that nor the comma of
/// a Sensaphone counter.
fn uncommaed(word: &str) -> Option<String> {
    match word.contains(',') && !is_element(word) {
        true => pointed(word),
        false => Some(word.to_owned()),
    }
}

/// Whether a word is a Sensaphone counter or element (`N,0`, `N,0,6`), with or without a key before
/// it.
pub(super) fn is_element(word: &str) -> bool {
    let word = word.split_once('=').map_or(word, |(_, value)| value);
    let mut parts = word.split(',');
    parts.next().is_some_and(|name| name.eq_ignore_ascii_case("N")) && {
        let numbers: Vec<&str> = parts.collect();
        matches!(numbers.len(), 1 | 2) && numbers.iter().all(|n| n.parse::<u64>().is_ok())
    }
}

/// The help for `N3,0`: the number of a Sensaphone counter is also written behind a comma.
fn sensaphone_help(word: &str) -> Option<Help> {
    let word = word.split_once('=').map_or(word, |(_, value)| value);
    let (number, element) = word.strip_prefix(['N', 'n'])?.split_once(',')?;
    let (n, _) = (number.parse::<u32>().ok()?, element.parse::<u32>().ok()?);
    let words = format!(
        "a Sensaphone counter is `{{}}` or `{{}}`, and its elements are `N,{n},0` to `N,{n},6`"
    );
    Some(advise(&words, [format!("N,{n}"), format!("N{n}")].map(possible)))
}

/// A word without the decimal comma of its number or duration, with or without a key before it.
pub(super) fn pointed(word: &str) -> Option<String> {
    let value = word.split_once('=').map_or(word, |(_, value)| value);
    let right = decimal_comma::corrected(value)?;
    Some(format!("{}{right}", &word[..word.len() - value.len()]))
}

/// The help for a word with a comma in it: the operands of the word, apart.
pub(super) fn comma_help(word: &str, mnemonic: &str) -> Help {
    if let Some(help) = sensaphone_help(word) {
        return help;
    }
    let names: Vec<&str> = word.split(',').filter(|name| !name.is_empty()).collect();
    let spec = Mnemonic::from_name(&mnemonic.to_ascii_uppercase()).map(Mnemonic::spec);
    let positional = || spec.iter().flat_map(|s| s.operands.iter()).filter(|o| o.key.is_none());
    match names.as_slice() {
        [_, _, ..]
            if !word.contains('=')
                && positional().count() == 1
                && positional().all(|operand| operand.kind != OperandKind::Stages) =>
        {
            one_each(names.iter().map(|name| format!("{mnemonic} {name}")))
        }
        [_, _, ..] => write(names.join(" ")),
        [name] => write(*name),
        [] => Help::from("remove the comma").with(""),
    }
}

#[cfg(test)]
mod tests {
    use super::without_commas;

    #[test]
    fn the_suggestion_for_missing_commas_has_the_operand_keys() {
        for (mnemonic, words, right) in [
            ("TMR", "t 5s", "write `TMR t preset=5s`"),
            ("TMR", "t preset=5s", "write `TMR t preset=5s`"),
            ("MOVE", "5 D0", "write `MOVE 5 to=D0`"),
            ("MOVE", "5 to=D0", "write `MOVE 5 to=D0`"),
            ("CTU", "N0 5", "write `CTU N0 preset=5`"),
            (
                "CTU",
                "c 5",
                "write `CTU c preset=5` for Sensaphone's counter; the counter of IEC is \
                 `CNT c preset=5`, with its legs `leg.up` and `leg.rst` instead of `when`",
            ),
            ("OUT", "Y0", "write `OUT Y0`"),
            ("OUT", "Y0 Y1", "one instruction for each: \"OUT Y0\", \"OUT Y1\""),
            ("NOSUCH", "a b", "write `NOSUCH a b`"),
        ] {
            let words: Vec<String> = words.split(' ').map(str::to_owned).collect();
            assert_eq!(without_commas(mnemonic, &words).text, right);
        }
    }
}
