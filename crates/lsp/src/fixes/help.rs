//! Extracts the advice from a help: the texts to write, and whether to delete something.
//!
//! Called by `fixes`; `sentences` reads the helps that advise several changes. A help is a sentence
//! for people. A text in backticks is the meant text after certain words (`write`, `did you mean`),
//! and an example after a colon. A form (`OUT b`) is neither.

use super::advice::{Advice, AdviceLead};
use super::edit::as_pairs;
use super::sentences;

/// The words after which a help gives a text to write.
const LEADS: [&str; 31] = [
    "write",
    "write it as",
    "did you mean",
    "there is",
    "its value is",
    "its bit is",
    "its word is",
    "the nearest is",
    "the last one is",
    "the last that fit are",
    "the longest is",
    "give it one:",
    "say that it is meant:",
    "say so by",
    "compare it:",
    "force it:",
    "force it,",
    "as it is read now:",
    "it is read as",
    "without spaces:",
    "in series are strings of their own:",
    "a contact stands on each side of it:",
    "the opposite of a bit is",
    "most plants need milliseconds:",
    "digits and `_`:",
    "begin the rung first:",
    "name it alone:",
    "in octal digits:",
    "megabytes:",
    "give it an instruction:",
    "a moving index would leave bits behind: give",
];

/// Of these, the words after which a help gives a text that means the same as the present text.
const AS_READ: [&str; 5] = [
    "as it is read now:",
    "it is read as",
    "say so by",
    "say that it is meant:",
    "if it is meant, write",
];
/// Of these, the words after which a help gives the nearest name.
const NEAREST: [&str; 3] = ["did you mean", "there is", "the nearest is"];
/// The ends of the words after which a help gives examples.
const EXAMPLES: [&str; 8] = [":", " as", "element,", "keeps,", " give", " is", " add", " then"];
/// The words after which a help gives forms, or names that cannot be meant.
const FORMS: [&str; 7] =
    ["for example", "form is", "forms are", "keys here are", "it has", " are:", "are a"];

/// The words of a help that advises to delete.
const DELETIONS: [&str; 6] = [
    "delete it",
    "delete this",
    "take it away",
    "take it out",
    "take this use away",
    "take this away",
];

/// The advice in a help, in the order of the help.
pub(super) fn read(help: &str) -> Vec<Advice> {
    let (head, lines) = help.split_once('\n').unwrap_or((help, ""));
    let mut all = sentences::read(head);
    if all.is_empty() {
        all = texts(head);
    }
    let lines: Vec<String> = lines.lines().map(|line| line.trim().to_owned()).collect();
    let are_toml = lines.iter().all(|line| !line.contains('`') && !line.contains('…'));
    if !lines.is_empty() && are_toml {
        let instead = head.split_once("instead of `").map(|(_, key)| key);
        let instead = instead.and_then(|key| Some(key.split_once('`')?.0.to_owned()));
        all.push(Advice::Lines { lines, instead });
    }
    let plain = head.trim_start();
    if let Some(sign) = dropped(plain) {
        all.push(Advice::Drop(sign));
    } else if DELETIONS.iter().any(|words| plain.contains(words)) {
        all.push(Advice::Delete);
    }
    all
}

/// The sign that a help advises to remove: `take the comma away`.
fn dropped(help: &str) -> Option<String> {
    let (sign, _) = help.strip_prefix("take the ")?.split_once(" away")?;
    match sign {
        "comma" => Some(",".to_owned()),
        sign => Some(sign.strip_prefix('`')?.strip_suffix('`')?.to_owned()),
    }
}

/// The texts to write.
fn texts(head: &str) -> Vec<Advice> {
    let pieces: Vec<&str> = head.split('`').collect();
    let tag = pieces.windows(2).find(|pair| pair[0].trim_end().ends_with("in tag"));
    let tag = tag.map(|pair| pair[1].to_owned());
    let mut advised = Vec::new();
    let mut last = None;
    for (at, text) in pieces.iter().enumerate().filter(|(at, _)| at % 2 == 1) {
        let before = pieces[..at].join("`").to_lowercase();
        let before = before.trim_end();
        let behind = pieces.get(at + 1).copied().unwrap_or_default();
        let text = text.trim();
        last = lead(&pieces, at, last);
        if text.is_empty() || text.contains('…') {
            continue;
        }
        if before.ends_with("declare it under [tags]:") {
            advised.extend(declarations(text, behind));
        } else if let Some(lead) = last {
            advised.push(match as_pairs(text) {
                Some(lines) => Advice::Lines { lines, instead: None },
                None => Advice::Write { text: text.to_owned(), tag: tag.clone(), lead },
            });
        }
    }
    advised
}

/// How a help introduces the text at a place; `last`: how it introduces the text before.
fn lead(pieces: &[&str], at: usize, last: Option<AdviceLead>) -> Option<AdviceLead> {
    let (near, text) = (pieces[at - 1].trim(), pieces[at]);
    let before = pieces[..at].join("`").to_lowercase();
    let before = before.trim_end();
    let behind = pieces.get(at + 1).copied().unwrap_or_default();
    let ends = |words: &[&str]| words.iter().any(|words| before.ends_with(words));
    let is_next = near == "," || near == "or" || near.ends_with(", or") || near.ends_with("; or");
    let numbers = Numbers::of(pieces, at);
    if FORMS.iter().any(|words| near.contains(words)) {
        return None;
    }
    if ends(&AS_READ) || behind.trim_start_matches([',', ' ']).starts_with("as it is read now") {
        return Some(AdviceLead::AsRead);
    }
    if ends(&LEADS) {
        return match numbers {
            Numbers::Forms => None,
            Numbers::Choice => Some(AdviceLead::Example),
            Numbers::None if ends(&NEAREST) => Some(AdviceLead::Spelling),
            Numbers::None => Some(AdviceLead::Told),
        };
    }
    // An example: `X`, as it is read now, or `Y`.
    if at > 1 && is_next {
        return match last? {
            AdviceLead::AsRead | AdviceLead::Told => Some(AdviceLead::Told),
            AdviceLead::Spelling => Some(AdviceLead::Spelling),
            AdviceLead::Example => Some(AdviceLead::Example),
        };
    }
    if numbers == Numbers::Forms {
        return None;
    }
    let is_instruction = at == 1 && near.is_empty() && text.contains(' ');
    (is_instruction || ends(&EXAMPLES)).then_some(AdviceLead::Example)
}

/// The meaning of a list of numbers in backticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Numbers {
    /// The text is no number, or is not in a list.
    None,
    /// Two numbers that can both be meant: `2ms` or `2s`.
    Choice,
    /// Three or more numbers, which show how numbers are written.
    Forms,
}

impl Numbers {
    fn of(pieces: &[&str], at: usize) -> Numbers {
        let is_digit = |first: char| first.is_ascii_digit() || first == '-';
        let behind = pieces.get(at + 1).copied().unwrap_or_default();
        let is_list = matches!(behind, ", " | " or " | ", or ");
        let next = pieces.get(at + 3).copied().unwrap_or_default();
        match is_list && pieces[at].starts_with(is_digit) {
            false => Numbers::None,
            true if matches!(next, ", " | " or " | ", or ") => Numbers::Forms,
            true if next.starts_with(", or a ") => Numbers::Forms,
            true => Numbers::Choice,
        }
    }
}

/// A declaration, and the same declaration with each other type that the help names: `…`, or "int",
/// "real".
fn declarations(text: &str, behind: &str) -> Vec<Advice> {
    let mut all = vec![Advice::Declare(text.to_owned())];
    let others = behind.split(';').next().unwrap_or_default().split('"');
    let Some((before, rest)) = text.split_once("type = \"") else { return all };
    let Some((_, rest)) = rest.split_once('"') else { return all };
    for other in others.skip(1).step_by(2) {
        all.push(Advice::Declare(format!("{before}type = \"{other}\"{rest}")));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(help: &str) -> Vec<String> {
        let one = |advice: &Advice| match advice {
            Advice::Write { text, lead: AdviceLead::Example, .. } => format!("as {text}"),
            Advice::Write { text, tag: None, .. } => text.clone(),
            Advice::Write { text, tag: Some(tag), .. } => format!("{text} in {tag}"),
            Advice::Declare(text) => format!("declare {text}"),
            Advice::Lines { lines, instead } => format!("{lines:?} {instead:?}"),
            Advice::Delete => "delete".to_owned(),
            Advice::Drop(sign) => format!("drop {sign}"),
            Advice::Row(row) => format!("row {row}"),
            Advice::Under { table, text } => format!("{text} under {table}"),
            Advice::Table { header, line } => format!("{header} {line}"),
            Advice::Remove(key) => format!("without {key}"),
            Advice::Here { declare, before, text } => format!("{declare}, {before:?}, {text}"),
        };
        read(help).iter().map(one).collect()
    }

    #[test]
    fn what_can_be_pasted_is_advice() {
        assert_eq!(told("did you mean `preset`?"), ["preset"]);
        assert_eq!(
            told("`late > 5ms`, as it is read now, or `late > 5s`"),
            ["late > 5ms", "late > 5s"]
        );
        assert_eq!(
            told("declare it under [tags]: `a = { type = \"bit\" }`, or: `at = \"…\"`"),
            ["declare a = { type = \"bit\" }"]
        );
        assert_eq!(told("say so by `initial = 0` in tag `speed`"), ["initial = 0 in speed"]);
        assert_eq!(
            told("write its legs instead of `when`:\nleg.up = [\"X0\"]"),
            ["[\"leg.up = [\\\"X0\\\"]\"] Some(\"when\")"]
        );
        assert_eq!(
            told("delete it, or say that it is meant: `a = { spare = true }`"),
            ["a = { spare = true }", "delete"]
        );
    }

    #[test]
    fn sentences_say_several_things_to_do() {
        assert_eq!(
            told("exchange them: `min = 5, max = 10`"),
            ["[\"min = 5\", \"max = 10\"] None"]
        );
        assert_eq!(
            told("add a row to the map: `{ from = \"Y0\", to = \"belt.run\" }`; or take it out"),
            ["row { from = \"Y0\", to = \"belt.run\" }", "delete"]
        );
        assert_eq!(
            told("write it in `[outputs]`: `on = [\"Y0\"]`"),
            ["on = [\"Y0\"] under outputs"]
        );
        assert_eq!(
            told("declare it: a `[[program.stage]]` with `name = \"A\"`"),
            ["[[program.stage]] name = \"A\""]
        );
        assert_eq!(told("take `[prove]` away"), ["without [prove]"]);
        assert_eq!(
            told(
                "contacts compute nothing: declare `r = { type = \"int\" }` under [tags], write \
                 `MATH r = a / 2` in a rung before, and `r == 1` here"
            ),
            ["r = { type = \"int\" }, Some(\"MATH r = a / 2\"), r == 1"]
        );
    }

    #[test]
    fn a_sign_is_taken_away() {
        assert_eq!(told("take the comma away"), ["drop ,"]);
        assert_eq!(told("take the `+` away"), ["drop +"]);
    }

    #[test]
    fn examples_and_forms_are_no_advice() {
        for help in [
            "`OUT` writes a bit: `Y0`, `C0`, or a tag of one",
            "for example `\"3s\"`",
            "its form is `OUT b`",
            "write `rise(…)`",
            "write `250ms`, `2s`, `1m30s`, or `HH:MM:SS:mmm`",
            "a parameter here needs `type = \"output\"`",
        ] {
            let texts = told(help);
            assert!(texts.iter().all(|text| text.starts_with("as ")), "{help}: {texts:?}");
        }
    }
}
