//! The helps of findings that show text to write, and repairs made by hand that write it.
//!
//! [`texts_to_write`] decides by rule whether a help shows text to write, or only names something
//! (a key, a file, a command). A file of repairs has, for each such help without a code action,
//! what a person changes who follows it:
//!
//! ```text
//! @ arrays.toml write `SR C0..C7`, or name an array of bits
//! - SR D0
//! + SR C0..C7
//! ```
//!
//! A `@` line has the file and the first line of the help. Findings of a file with the same help
//! have their repairs in order. The lines of `-` are found at the finding or behind it, else
//! anywhere in the file; a `+` without `-` is added at the end; `in FILE` names another file for
//! the changes below it.

use std::cell::Cell;
use std::path::Path;

/// The words before a text that is to be written.
const LEADS: [&str; 36] = [
    "write",
    "write it as",
    "write one of",
    "written",
    "write the exponent as",
    "add",
    "add the instruction, such as",
    "use",
    "give",
    "give it",
    "name",
    "list",
    "say so by",
    "did you mean",
    "there is",
    "there are",
    "its value is",
    "its bit is",
    "its word is",
    "nearest is",
    "last one is",
    "that fit are",
    "longest is",
    "it is read as",
    "opposite of a bit is",
    "never changes is",
    "outputs are",
    "internal bits",
    "addresses read",
    "reads",
    "force it,",
    "has no `-`:",
    ", as",
    "such as",
    "for example",
    ":",
];

/// The words before a list of names, one of which can be written but none of which must be.
const NAMES: [&str; 7] = [
    "keys here are",
    "steps are",
    "priorities are",
    "it has",
    "elements are",
    "are those",
    "works on",
];

/// The texts that a help tells to write: those in backticks behind certain words, those that are
/// parts of a file by their form, and lines of their own.
pub fn texts_to_write(help: &str) -> Vec<String> {
    let pieces: Vec<&str> = help.split('`').collect();
    let mut all = Vec::new();
    let mut was_led = false;
    for (at, text) in pieces.iter().enumerate().skip(1).step_by(2) {
        let before = pieces[..at].join("`").to_lowercase();
        let before = before.trim_end();
        let is_next = at > 1 && ends_with_list(pieces[at - 1].trim());
        let names = NAMES.iter().any(|words| pieces[at - 1].contains(words));
        if pieces[at - 1].ends_with("as it is read now: ") {
            continue;
        }
        let is_led = LEADS.iter().any(|words| ends_with(before, words));
        was_led = !names && (if is_next { was_led } else { is_led });
        let is_command = text.starts_with("rungd ") || text.starts_with('/');
        if !is_command && (was_led || is_part_of_a_file(text)) {
            all.push((*text).to_owned());
        }
    }
    let lines: Vec<&str> = help.lines().map(str::trim).collect();
    let blocks = lines.split(|line| !is_line_of_a_file(line)).filter(|block| !block.is_empty());
    all.extend(blocks.map(|block| block.join("\n")));
    all
}

/// Whether a line of a help is a line of a file: a header, a pair, a row, the end of a list.
fn is_line_of_a_file(line: &str) -> bool {
    let is_pair = line.split_once('=').is_some_and(|(key, _)| {
        let key = key.trim();
        !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || "._-".contains(c))
    });
    !line.contains('`') && (is_pair || line.starts_with(['[', '{', ']', '}']))
}

/// Whether the words between two texts go on with a list of them.
fn ends_with_list(between: &str) -> bool {
    between.ends_with(',') || between == "or" || between.ends_with(" or")
}

/// Whether a text ends with whole words.
fn ends_with(text: &str, words: &str) -> bool {
    let Some(before) = text.strip_suffix(words) else { return false };
    !words.starts_with(char::is_alphanumeric) || !before.ends_with(char::is_alphanumeric)
}

/// Whether a text in backticks is part of a file by its form: a string, a list, a row, a pair, an
/// instruction with operands, contacts, a call, an element.
fn is_part_of_a_file(text: &str) -> bool {
    let text = text.strip_prefix("lib:").unwrap_or(text);
    let is_header = text.starts_with('[') && text.ends_with(']') && !text.contains('"');
    let is_key = |c: char| c.is_ascii_alphanumeric() || "_-.$*".contains(c);
    // `{name}` is a word in a text.
    let is_word = text.starts_with('{') && !text.contains('=');
    !is_word && !is_header && !text.chars().all(is_key) && text.chars().any(char::is_alphanumeric)
}

/// Whether `written` contains a text of a help, in which `…` and the small letters of a form (`OUT
/// b`) mean any text. Spaces and ends of lines are not compared.
pub fn contains(written: &str, text: &str) -> bool {
    let squeezed = |text: &str| -> String { text.split_whitespace().collect() };
    let written = squeezed(written);
    let mut rest = written.as_str();
    for (at, part) in literals(text).iter().map(|part| squeezed(part)).enumerate() {
        // A placeholder stands before each part but the first: for one character at least.
        let skipped = if at == 0 { Some(0) } else { rest.chars().next().map(char::len_utf8) };
        let found = skipped.and_then(|of| Some(of + rest[of..].find(&part)?));
        let Some(found) = found else { return false };
        rest = &rest[found + part.len()..];
    }
    true
}

/// The parts of a text between its placeholders: `…`, and words of one or two small letters that
/// are no key, no member and no function.
fn literals(text: &str) -> Vec<String> {
    let mut parts = vec![String::new()];
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let word =
            rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        let end = word.max(first.len_utf8());
        let (piece, behind) = rest.split_at(end);
        let is_member = parts.last().is_some_and(|part| part.ends_with(['.', '$']));
        let is_small = word.wrapping_sub(1) < 2 && piece.chars().all(|c| c.is_ascii_lowercase());
        match piece == "…" || is_small && !is_member && !behind.starts_with(['=', '(', ':', '-'])
        {
            true => parts.push(String::new()),
            false => parts.last_mut().unwrap().push_str(piece),
        }
        rest = behind;
    }
    parts
}

/// A repair of one finding.
pub struct Repair {
    file: String,
    help: String,
    edits: Vec<Edit>,
    is_used: Cell<bool>,
}

/// The lines that are replaced in a file, and those that replace them.
#[derive(Default)]
struct Edit {
    /// Another file than that of the finding.
    other: Option<String>,
    old: Vec<String>,
    new: Vec<String>,
}

impl Edit {
    /// A text with this edit; `from`: the first line of the finding.
    fn applied(&self, text: &str, from: usize) -> Result<String, String> {
        let (old, new) = (self.old.join("\n"), self.new.join("\n"));
        if old.is_empty() {
            return Ok(format!("{text}{new}\n"));
        }
        let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1));
        let start = starts.into_iter().nth(from).unwrap_or(0);
        let behind = text[start..].find(&old).map(|at| start + at);
        let at = behind.or_else(|| text.find(&old)).ok_or(format!("`{old}` is not in the file"))?;
        Ok(format!("{}{new}{}", &text[..at], &text[at + old.len()..]))
    }
}

impl Repair {
    /// The changed texts, by file; `read` reads another file than the finding's.
    pub fn applied(
        &self,
        text: &str,
        line: usize,
        read: impl Fn(&str) -> String,
    ) -> Result<Vec<(String, String)>, String> {
        let mut texts: Vec<(String, String)> = vec![(self.file.clone(), text.to_owned())];
        for edit in &self.edits {
            let name = edit.other.as_ref().unwrap_or(&self.file);
            if texts.iter().all(|(of, _)| of != name) {
                texts.push((name.clone(), read(name)));
            }
            let place = texts.iter_mut().find(|(of, _)| of == name).unwrap();
            let from = if edit.other.is_none() { line } else { 0 };
            place.1 = edit.applied(&place.1, from)?;
        }
        Ok(texts)
    }

    /// Checks that it writes a text that the help shows.
    pub fn writes_what_is_shown(&self, help: &str) -> Result<(), String> {
        let new: Vec<String> = self.edits.iter().map(|edit| edit.new.join("\n")).collect();
        let new = new.join("\n");
        let is_written = |text: &String| text.lines().all(|line| contains(&new, line));
        match texts_to_write(help).iter().any(is_written) {
            true => Ok(()),
            false => Err("writes no text that the help shows".to_owned()),
        }
    }
}

/// The repairs of some files of findings.
#[derive(Default)]
pub struct Repairs(Vec<Repair>);

impl Repairs {
    /// The repairs in all files `*.repairs` of a folder.
    pub fn of(folder: &Path) -> Repairs {
        let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let is_meant =
            |path: &std::path::PathBuf| path.extension().is_some_and(|of| of == "repairs");
        let mut paths: Vec<_> = entries.filter(is_meant).collect();
        paths.sort();
        let texts: Vec<String> =
            paths.iter().map(|path| std::fs::read_to_string(path).unwrap()).collect();
        Repairs::read(&texts.join("\n"))
    }

    /// The repairs in a text.
    pub fn read(text: &str) -> Repairs {
        let mut all: Vec<Repair> = Vec::new();
        let mut other = None;
        for line in text.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
            let (sign, rest) = line.split_at(1);
            let rest = rest.strip_prefix(' ').unwrap_or(rest);
            if let Some((file, help)) = rest.split_once(' ').filter(|_| sign == "@") {
                let (file, help) = (file.to_owned(), help.to_owned());
                all.push(Repair { file, help, edits: Vec::new(), is_used: Cell::new(false) });
                other = None;
                continue;
            }
            let edits = &mut all.last_mut().expect("a repair begins with `@`").edits;
            let begins = edits.last().is_none_or(|edit: &Edit| {
                edit.other != other || (sign == "-" && !edit.new.is_empty())
            });
            match (sign, line.strip_prefix("in ")) {
                (_, Some(file)) => other = Some(file.to_owned()),
                ("-" | "+", None) => {
                    if begins {
                        edits.push(Edit { other: other.clone(), ..Edit::default() });
                    }
                    let edit = edits.last_mut().unwrap();
                    let of = if sign == "-" { &mut edit.old } else { &mut edit.new };
                    of.push(rest.to_owned());
                }
                _ => panic!("`{line}` is no line of a repair"),
            }
        }
        Repairs(all)
    }

    /// The next repair of a finding in this file with this help.
    pub fn next(&self, file: &str, help: &str) -> Option<&Repair> {
        let help = help.lines().next().unwrap_or_default();
        let is_it = |of: &&Repair| !of.is_used.get() && of.file == file && of.help == help;
        let found = self.0.iter().find(is_it)?;
        found.is_used.set(true);
        Some(found)
    }

    /// The repairs that no finding has asked for.
    pub fn unused(&self) -> Vec<String> {
        let unused = self.0.iter().filter(|of| !of.is_used.get());
        unused.map(|of| format!("@ {} {}", of.file, of.help)).collect()
    }
}

#[test]
fn texts_to_write_are_distinguished_from_names_in_a_help() {
    let shown = |help: &str| texts_to_write(help).join(" / ");
    assert_eq!(shown("write `SR C0..C7`, or name an array of bits"), "SR C0..C7");
    assert_eq!(shown("give it one: `name = \"…\"`"), "name = \"…\"");
    assert_eq!(shown("its form is `TMR t preset=d`"), "TMR t preset=d");
    assert_eq!(shown("a latch is `SET b`"), "SET b");
    assert_eq!(shown("write one of `utc`, `local`"), "utc / local");
    assert_eq!(shown("write its legs:\n  leg.up = [\"X0\"]"), "leg.up = [\"X0\"]");
    for names in [
        "sizes are set under `[memory]` of the controller file",
        "the keys here are `name`, `doc`",
        "`rungd explain` lists all instructions",
        "`T0` can be read anywhere, but only one instruction may execute it",
        "take `Y0` out of the stages of `Day`",
    ] {
        assert_eq!(shown(names), "", "{names}");
    }
}

#[test]
fn a_fix_is_compared_with_the_text_shown_in_the_help() {
    assert!(contains("do = [\"OUT Y7\"]", "OUT b"));
    assert!(contains("name =  \"A\"", "name = \"…\""));
    assert!(!contains("SET Y7", "OUT b"));
    assert!(!contains("OUT", "OUT b"));
    assert!(contains("MATH D1 = clamp(D2, 0, 5)", "clamp(x, lo, hi)"));
    assert!(contains("MOVE 1 to=D0", "MOVE v to=w") && !contains("MOVE 1 D0", "MOVE v to=w"));
    let all = Repairs::read("@ a.toml write `Y0`\n- X0\n+ Y0\nin b.toml\n+ last");
    let repair = all.next("a.toml", "write `Y0`\nmore").unwrap();
    let texts = repair.applied("X0\nX0\n", 1, |_| "first\n".to_owned()).unwrap();
    assert_eq!(texts[0].1, "X0\nY0\n");
    assert_eq!(texts[1], ("b.toml".to_owned(), "first\nlast\n".to_owned()));
    assert!(all.next("a.toml", "write `Y0`").is_none() && all.unused().is_empty());
}
