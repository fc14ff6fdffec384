//! Bounds a finding's text: a quoted name may be megabytes long, or contain control characters that
//! a terminal would execute.
//!
//! [`super::finding::Finding`] passes all its texts through [`bounded`]; the code that makes
//! findings need not. This module also quotes a path for a shell ([`shell_word`]) and formats
//! numbers ([`counted`], [`thousands`]).

use std::borrow::Cow;

/// Maximum length of a word that is not shortened: more than any legal name, and than most paths.
const WORD_CHARS_MAX: usize = 200;
/// Number of characters kept at each end of a longer word.
const WORD_HEAD: usize = 60;
const WORD_TAIL: usize = 20;
/// Maximum length of a text, in characters.
const TEXT_CHARS_MAX: usize = 4_000;

/// The text, cut to `TEXT_CHARS_MAX` characters, with control characters escaped (except line ends)
/// and overlong words shortened in the middle.
pub fn bounded(text: String) -> String {
    if text.len() <= WORD_CHARS_MAX && !text.chars().any(|c| c != '\n' && is_obeyed(c)) {
        return text;
    }
    let mut told = String::new();
    let mut room = TEXT_CHARS_MAX;
    for word in text.split_inclusive(char::is_whitespace) {
        if room == 0 {
            told.push('…');
            break;
        }
        room = room.saturating_sub(push_word(&mut told, word));
    }
    told
}

/// As [`bounded`], with line ends escaped too: for a text that stays on one line.
pub fn bounded_line(text: String) -> String {
    if !text.contains(['\n', '\r']) {
        return bounded(text);
    }
    bounded(text.replace('\n', "\\n").replace('\r', "\\r"))
}

/// A file's name, not shortened, with all characters escaped that a terminal does not simply show.
pub fn shown_name(name: &str) -> String {
    let mut shown = String::with_capacity(name.len());
    for c in name.chars() {
        match c {
            '\n' => shown.push_str("\\n"),
            '\r' => shown.push_str("\\r"),
            c => {
                push(&mut shown, c);
            }
        }
    }
    shown
}

/// A path, quoted as one word of a shell command. A program never takes it for an option.
pub fn shell_word(path: &str) -> String {
    let path = if path.starts_with('-') { format!("./{path}") } else { path.to_owned() };
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,:@%".contains(c);
    let quoted = |text: &str| format!("'{}'", text.replace('\'', "'\\''"));
    if path.chars().all(is_plain) {
        path
    } else if path.contains(is_obeyed) {
        format!("\"$(printf '%b' {})\"", quoted(&printf_text(&path)))
    } else {
        quoted(&path)
    }
}

/// A text as `printf '%b'` of a shell reads it: what a terminal would execute is in octal.
fn printf_text(text: &str) -> String {
    let mut printed = String::new();
    for c in text.chars() {
        match c {
            '\\' => printed.push_str("\\\\"),
            c if is_obeyed(c) => {
                let mut bytes = [0; 4];
                let octal = c.encode_utf8(&mut bytes).bytes().map(|byte| format!("\\0{byte:03o}"));
                printed.extend(octal);
            }
            c => printed.push(c),
        }
    }
    printed
}

/// Adds a word and the space after it; returns the number of characters added.
fn push_word(told: &mut String, word: &str) -> usize {
    let length = word.chars().count();
    if length <= WORD_CHARS_MAX {
        return word.chars().map(|c| push(told, c)).sum();
    }
    let head: usize = word.chars().take(WORD_HEAD).map(|c| push(told, c)).sum();
    told.push('…');
    let tail: usize = word.chars().skip(length - WORD_TAIL).map(|c| push(told, c)).sum();
    head + 1 + tail
}

/// Adds a character, escaped if a terminal would execute it; returns the number of characters
/// added.
fn push(told: &mut String, c: char) -> usize {
    match c {
        // From a file with Windows line ends.
        '\r' => 0,
        c if c != '\n' && is_obeyed(c) => {
            let escaped = c.escape_unicode();
            told.extend(escaped.clone());
            escaped.count()
        }
        c => {
            told.push(c);
            1
        }
    }
}

/// Whether a terminal executes a character instead of showing it: control characters (line ends
/// too), and characters that change the direction of a text.
pub fn is_obeyed(c: char) -> bool {
    let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}')
        || matches!(c, '\u{2066}'..='\u{2069}' | '\u{61c}');
    c.is_control() || turns
}

/// Whether a character cannot be seen, so that two different names would look alike: those that a
/// terminal obeys, and those of format, of no width, and that fill a place with nothing.
pub fn is_unseen(c: char) -> bool {
    is_obeyed(c)
        || matches!(
            c,
            '\u{ad}'
                | '\u{34f}'
                | '\u{115f}'..='\u{1160}'
                | '\u{17b4}'..='\u{17b5}'
                | '\u{180b}'..='\u{180f}'
                | '\u{200b}'..='\u{200f}'
                | '\u{2028}'..='\u{202e}'
                | '\u{2060}'..='\u{206f}'
                | '\u{2800}'
                | '\u{3164}'
                | '\u{fe00}'..='\u{fe0f}'
                | '\u{feff}'
                | '\u{ffa0}'
                | '\u{fff0}'..='\u{fffb}'
                | '\u{1bca0}'..='\u{1bca3}'
                | '\u{1d173}'..='\u{1d17a}'
                | '\u{e0000}'..='\u{e0fff}'
        )
}

/// A text for one line: characters that a terminal executes, line ends too, become escapes
/// (`\u{a}`), so that a name from outside adds no line to an answer.
pub fn escaped(text: &str) -> Cow<'_, str> {
    if !text.contains(is_obeyed) {
        return Cow::Borrowed(text);
    }
    let one = |c: char| match is_obeyed(c) {
        true => c.escape_unicode().to_string(),
        false => c.to_string(),
    };
    text.chars().map(one).collect()
}

/// `1 scan`, `12,345 scans`.
pub fn counted(count: u64, what: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{} {what}{plural}", thousands(count))
}

/// `a`, `a and b`, `a, b and c`.
pub fn listed(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [all @ .., last] => format!("{} and {last}", all.join(", ")),
    }
}

/// `12,345`.
pub fn thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped() {
        let told = |text: &str| bounded(text.to_owned());
        assert_eq!(told("`a\u{1b}[31mb`\nnext"), "`a\\u{1b}[31mb`\nnext");
        assert_eq!(told("leg.rst = [\r\n  \"X0\"\r\n]"), "leg.rst = [\n  \"X0\"\n]");
        assert_eq!(told("a\u{202e}b\u{9b}c"), "a\\u{202e}b\\u{9b}c");
        assert_eq!(told("größe, 12 °C"), "größe, 12 °C");
        assert_eq!(bounded_line("`b\r\n c\u{1b}`".to_owned()), "`b\\r\\n c\\u{1b}`");
        assert_eq!(shown_name("a\u{1b}[31m\nb\r.toml"), "a\\u{1b}[31m\\nb\\r.toml");
    }

    #[test]
    fn long_words_and_texts_are_cut() {
        let name = "n".repeat(10_000_000);
        let told = bounded(format!("`{name}.Acc` cannot be read"));
        assert_eq!(told.chars().count(), WORD_HEAD + 1 + WORD_TAIL + "cannot be read".len());
        assert!(told.starts_with("`nnn") && told.contains("n…n"), "{told}");
        assert!(told.ends_with("n.Acc` cannot be read"), "{told}");
        let told = bounded("word ".repeat(1_000_000));
        assert!(told.chars().count() <= TEXT_CHARS_MAX + WORD_CHARS_MAX + 2, "{}", told.len());
        assert!(told.ends_with('…'), "{}", &told[told.len() - 20..]);
        let told = bounded("\u{1}".repeat(1_000_000));
        assert!(told.len() < 1_000, "{}", told.len());
        let whole = "n".repeat(WORD_CHARS_MAX);
        assert_eq!(bounded(whole.clone()), whole);
    }

    #[test]
    fn numbers_have_thousands_separators() {
        let texts = [0, 7, 999, 1_000, 12_345, 1_234_567].map(thousands);
        assert_eq!(texts, ["0", "7", "999", "1,000", "12,345", "1,234,567"]);
        assert_eq!((counted(1, "scan"), counted(2, "scan")), ("1 scan".into(), "2 scans".into()));
    }
}
