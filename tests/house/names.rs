//! Each type has its own name, so that the name alone identifies the type.
//!
//! Two types may share a name: a written form and its resolved form, or the settings of a thing and
//! the thing itself. With three types of one name, a reader cannot know which of them is meant.
//! Types in inline modules, tests among them, are not counted; nor are the associated types of
//! traits.

use std::collections::BTreeMap;

/// The maximum number of types with one name, if one of them is visible in other files.
const SAME_NAME_MAX: usize = 2;

/// Names of more types than that, each with the reason.
const EXCEPTIONS: [(&str, &str); 1] =
    [("Keys", "each driver of the controller file has a folder, with its keys in `keys.rs`")];

/// The name of a type at its definition.
#[derive(Debug, PartialEq, Eq)]
struct Made {
    name: String,
    /// Whether the type is visible in other files.
    is_visible: bool,
}

/// The types that a file's text defines.
fn made(text: &str) -> Vec<Made> {
    text.lines().filter_map(made_in).collect()
}

/// The type whose definition begins with this line. Only lines without indent count, because
/// rustfmt indents the definitions in inline modules.
fn made_in(line: &str) -> Option<Made> {
    let (is_visible, rest) = match line.strip_prefix("pub") {
        Some(rest) if rest.starts_with('(') => (true, rest.split_once(") ")?.1),
        Some(rest) => (true, rest.trim_start()),
        None => (false, line),
    };
    let (what, rest) = rest.split_once(' ')?;
    let name = super::first_word(rest);
    let is_type = ["struct", "enum", "union", "trait", "type"].contains(&what);
    (is_type && !name.is_empty()).then_some(Made { name, is_visible })
}

/// The names that too many types have, with the files that define these types.
fn worn_out<'a>(files: impl IntoIterator<Item = (String, &'a str)>) -> Vec<String> {
    let mut places: BTreeMap<String, (bool, Vec<String>)> = BTreeMap::new();
    for (path, text) in files {
        for Made { name, is_visible } in made(text) {
            let (any_visible, paths) = places.entry(name).or_default();
            *any_visible |= is_visible;
            paths.push(path.clone());
        }
    }
    let too_many = |(_, (any_visible, paths)): &(String, (bool, Vec<String>))| {
        *any_visible && paths.len() > SAME_NAME_MAX
    };
    let places = places.into_iter().filter(too_many);
    places.map(|(name, (_, paths))| format!("{name}: {}", paths.join(", "))).collect()
}

#[test]
fn no_name_stands_for_three_types() {
    let sources = super::sources();
    let files = sources.iter().map(|s| (s.path.display().to_string(), s.text.as_str()));
    let mut worn_out = worn_out(files);
    for (name, reason) in EXCEPTIONS {
        let found = worn_out.len();
        worn_out.retain(|line| !line.starts_with(&format!("{name}: ")));
        assert_ne!(worn_out.len(), found, "`{name}` needs no exception any more ({reason})");
    }
    assert!(worn_out.is_empty(), "give each a name of its own:\n{}", worn_out.join("\n"));
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
    let names = names.iter().map(|made| (made.name.as_str(), made.is_visible)).collect::<Vec<_>>();
    let expected =
        [("Point", true), ("Own", false), ("Mode", true), ("Lists", true), ("Driver", true)];
    assert_eq!(names, expected);
}

#[test]
fn three_are_too_many_where_one_is_visible() {
    let file = |text: &'static str| ("a.rs".to_owned(), text);
    let (own, visible) = (file("struct Row;\n"), file("pub(super) struct Row;\n"));
    assert!(worn_out([own.clone(), own.clone(), own.clone()]).is_empty());
    assert!(worn_out([own.clone(), visible.clone()]).is_empty());
    assert_eq!(worn_out([own.clone(), visible, own]), ["Row: a.rs, a.rs, a.rs"]);
}
