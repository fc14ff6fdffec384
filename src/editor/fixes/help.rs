//! What a help advises: the texts in it that are to be written, and whether something is to go.
//!
//! A help is a sentence for people; texts in backticks are advice behind certain words only
//! (`write`, `did you mean`), because others are examples and forms.

use std::ops::Range;

use super::super::file::EditorFile;

/// An advice of a help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Advice {
    /// To write this in the place of what is there, or into its table; perhaps of another tag.
    Write { text: String, tag: Option<String> },
    /// To declare this under `[tags]`.
    Declare(String),
    /// To write these lines; `instead`: a key that goes.
    Lines { lines: Vec<String>, instead: Option<String> },
    /// To delete what the finding is about.
    Delete,
    /// To take this sign out of it.
    Drop(String),
}

/// The words behind which a text is to be written.
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
    "most plants want milliseconds:",
    "digits and `_`:",
    "begin the rung first:",
    "name it alone:",
    "in octal digits:",
    "megabytes:",
    "give it an instruction:",
    "a moving index would leave bits behind: give",
];

/// The words of a help that says to delete.
const DELETIONS: [&str; 6] = [
    "delete it",
    "delete this",
    "take it away",
    "take it out",
    "take this use away",
    "take this away",
];

/// The advice in a help, in its order.
pub(super) fn read(help: &str) -> Vec<Advice> {
    let (head, lines) = help.split_once('\n').unwrap_or((help, ""));
    let mut all = texts(head);
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

/// The sign that a help says to take away: `take the comma away`.
fn dropped(help: &str) -> Option<String> {
    let (sign, _) = help.strip_prefix("take the ")?.split_once(" away")?;
    match sign {
        "comma" => Some(",".to_owned()),
        sign => Some(sign.strip_prefix('`')?.strip_suffix('`')?.to_owned()),
    }
}

/// The texts that are to be written.
fn texts(head: &str) -> Vec<Advice> {
    let pieces: Vec<&str> = head.split('`').collect();
    let tag = pieces.windows(2).find(|pair| pair[0].trim_end().ends_with("in tag"));
    let tag = tag.map(|pair| pair[1].to_owned());
    let mut advised = Vec::new();
    let mut follows = false;
    for (at, text) in pieces.iter().enumerate().filter(|(at, _)| at % 2 == 1) {
        let before = pieces[..at].join("`").to_lowercase();
        let before = before.trim_end();
        let near = pieces[at - 1].trim();
        let behind = pieces.get(at + 1).copied().unwrap_or_default();
        let is_led = LEADS.iter().any(|lead| before.ends_with(lead))
            || behind.starts_with(", as it is read now")
            || behind.starts_with(" as it is read now");
        // `X`, as it is read now, or `Y`
        let is_next = follows
            && (near == "," || near == "or" || near.ends_with(", or") || near.ends_with("; or"));
        let is_example = is_led
            && text.starts_with(|first: char| first.is_ascii_digit() || first == '-')
            && matches!(behind, ", " | " or " | ", or ");
        follows = (is_led || is_next) && !is_example;
        let text = text.trim();
        if text.is_empty() || text.contains('…') || near.contains("for example") {
            continue;
        }
        if before.ends_with("declare it under [tags]:") {
            advised.push(Advice::Declare(text.to_owned()));
        } else if follows {
            advised.push(Advice::Write { text: text.to_owned(), tag: tag.clone() });
        }
    }
    advised
}

impl Advice {
    /// Whether its text is an example, of which another value may be meant.
    pub fn is_example(&self, help: &str) -> bool {
        match self {
            Advice::Write { .. } => help.starts_with("give it ") || help.starts_with("most "),
            Advice::Declare(_) | Advice::Lines { .. } | Advice::Delete | Advice::Drop(_) => false,
        }
    }

    /// The title of the action; `changed`: the place that it changes.
    pub fn title(&self, file: &EditorFile, changed: Range<usize>) -> String {
        match self {
            Advice::Write { text, tag: None } => format!("Write `{text}`"),
            Advice::Write { text, tag: Some(tag) } => format!("Write `{text}` in tag `{tag}`"),
            Advice::Declare(text) => format!("Declare `{text}` under [tags]"),
            Advice::Lines { lines, .. } => format!("Write `{}`", lines.join("`, `")),
            Advice::Delete => {
                let text = file.slice(changed).trim().lines().next().unwrap_or_default();
                format!("Delete `{}`", text.chars().take(40).collect::<String>())
            }
            Advice::Drop(sign) => format!("Take `{sign}` away"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(help: &str) -> Vec<String> {
        let one = |advice: &Advice| match advice {
            Advice::Write { text, tag: None } => text.clone(),
            Advice::Write { text, tag: Some(tag) } => format!("{text} in {tag}"),
            Advice::Declare(text) => format!("declare {text}"),
            Advice::Lines { lines, instead } => format!("{lines:?} {instead:?}"),
            Advice::Delete => "delete".to_owned(),
            Advice::Drop(sign) => format!("drop {sign}"),
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
            "what may stand here has `type = \"output\"`",
        ] {
            let texts = told(help);
            assert!(texts.iter().all(|text| text == "OUT"), "{help}: {texts:?}");
        }
    }
}
