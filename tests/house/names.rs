//! Names that read at once: a name identifies one type, and says what it is.
//!
//! No two types share a name, whatever crates and files define them, so that a reader knows from the
//! name alone which of them is meant. Words that once had several meanings are not used as names of
//! functions; a parameter has the name of the thing, never `of`. Test modules are not checked, nor
//! are types in inline modules and the associated types of traits.

use std::collections::BTreeMap;

/// Names of several types, each with the reason.
const ACCEPTED_TWICE: &[(&str, &str)] = &[];

/// Names that no function has, each with what to write instead.
const UNCLEAR_FUNCTIONS: &[(&str, &str)] = &[
    ("goes_on", "what continues: `continues`, `is_kept`, `is_session_open`"),
    ("say_of", "what is said, and of what: `add_line_with_state`"),
    ("stands", "the state: `is_active`, `is_open`"),
    ("there", "what is done: `translate`"),
    ("told", "what is returned or done: `message`, `due_reports`, `mark_published`"),
    ("wholes", "what is found: `rung_mutations`"),
];

/// The name of a type at its definition.
#[derive(Debug, PartialEq, Eq)]
struct Made {
    name: String,
    line: usize,
}

/// The types that a file's text defines.
fn made(text: &str) -> Vec<Made> {
    (1..).zip(text.lines()).filter_map(|(line, text)| made_in(line, text)).collect()
}

/// The type whose definition begins with this line. Only lines without indent count, because
/// rustfmt indents the definitions in inline modules.
fn made_in(line: usize, text: &str) -> Option<Made> {
    let rest = match text.strip_prefix("pub") {
        Some(rest) if rest.starts_with('(') => rest.split_once(") ")?.1,
        Some(rest) => rest.trim_start(),
        None => text,
    };
    let (what, rest) = rest.split_once(' ')?;
    let name = super::first_word(rest);
    let is_type = ["struct", "enum", "union", "trait", "type"].contains(&what);
    (is_type && !name.is_empty()).then_some(Made { name, line })
}

/// The names of several types, each with the places of the types.
fn shared_names<'a>(files: impl IntoIterator<Item = (String, &'a str)>) -> Vec<String> {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (path, text) in files {
        for Made { name, line } in made(text) {
            places.entry(name).or_default().push(format!("{path}:{line}"));
        }
    }
    let shared = places.into_iter().filter(|(_, places)| places.len() > 1);
    shared.map(|(name, places)| format!("{name}: {}", places.join(", "))).collect()
}

/// Whether a file is a test module.
fn is_test_module(path: &str) -> bool {
    path.ends_with("tests.rs") || path.split('/').any(|part| part.ends_with("tests"))
}

/// The part of a file's text before its inline test module.
fn before_tests(text: &str) -> &str {
    let end = text.find("\n#[cfg(test)]\nmod ").unwrap_or(text.len());
    &text[..end]
}

/// The functions and parameters of a text whose names say nothing, with their lines.
fn unclear(text: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    for (number, line) in (1..).zip(before_tests(text).lines()) {
        let code = line.split("//").next().unwrap_or("");
        for (name, instead) in UNCLEAR_FUNCTIONS {
            let begins = ["(", "<"].map(|after| format!("fn {name}{after}"));
            if begins.iter().any(|begin| code.contains(begin)) {
                found.push((number, format!("name what `{name}` does: {instead}")));
            }
        }
        if ["fn of(&self", "fn of(&mut self", "fn of(self"].iter().any(|of| code.contains(of)) {
            found.push((number, "name what the method `of` returns".to_owned()));
        }
        if ["|of|", "|of,", "|&of|", "|of:", "(of:", " of: &"].iter().any(|of| code.contains(of)) {
            found.push((number, "give the parameter `of` the name of the thing".to_owned()));
        }
    }
    found
}

#[test]
fn each_type_name_is_used_once() {
    let sources = super::sources();
    let files = sources.iter().map(|s| (s.path.display().to_string(), s.text.as_str()));
    let mut shared = shared_names(files.filter(|(path, _)| !is_test_module(path)));
    for (name, reason) in ACCEPTED_TWICE {
        let found = shared.len();
        shared.retain(|line| !line.starts_with(&format!("{name}: ")));
        assert_ne!(shared.len(), found, "`{name}` needs no exception any more ({reason})");
    }
    assert!(shared.is_empty(), "give each a name of its own:\n{}", shared.join("\n"));
}

#[test]
fn no_function_or_parameter_has_an_unclear_name() {
    let mut wrong = Vec::new();
    for source in super::sources() {
        let path = source.path.display().to_string();
        if !is_test_module(&path) {
            let found = unclear(&source.text).into_iter();
            wrong.extend(found.map(|(line, why)| format!("{path}:{line}: {why}")));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn type_definitions_are_recognized() {
    let text = "\
pub struct Point<T> {
struct Own;
pub(crate) enum Mode {
pub(super) type Lists = u64;
    type Item = u8;
pub trait Driver: Send {
pub fn structure() {}
typed(x);
// struct Remark;
";
    let names = made(text);
    let names = names.iter().map(|made| (made.name.as_str(), made.line)).collect::<Vec<_>>();
    assert_eq!(names, [("Point", 1), ("Own", 2), ("Mode", 3), ("Lists", 4), ("Driver", 6)]);
}

#[test]
fn two_types_with_the_same_name_are_found() {
    let own = ("a.rs".to_owned(), "struct Row;\n");
    let visible = ("b.rs".to_owned(), "\npub(super) struct Row;\n");
    assert!(shared_names([own.clone()]).is_empty());
    assert_eq!(shared_names([own, visible]), ["Row: a.rs:1, b.rs:2"]);
}

#[test]
fn unclear_names_are_found_outside_of_tests() {
    let text = "fn told(x: u8) {}\nlet a = b.map(|of| of.c); // |of|\nfn retold() {}\n\
                pub fn goes_on<T>() {}\n#[cfg(test)]\nmod tests {\n    fn told() {}\n}\n";
    let lines = unclear(text).into_iter().map(|(line, _)| line).collect::<Vec<_>>();
    assert_eq!(lines, [1, 2, 4]);
}
