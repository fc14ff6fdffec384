//! The number of parameters of functions, and their types: none is a tuple.
//!
//! Callers confuse the order of many parameters. A function with more than four of them gets a
//! struct. `self` is not counted; nor are the parameters of closures and of function types.
//!
//! A tuple has no names for its parts, so it gets a struct, or its parts become parameters.

/// The maximum number of parameters.
const PARAMETERS_MAX: usize = 4;

/// A function of a text.
struct Function {
    name: String,
    /// Its parameters without `self`, as written: pattern and type.
    parameters: Vec<String>,
}

/// A text's functions. A function without a name, in a macro, is left out.
fn functions(text: &str) -> Vec<Function> {
    let code: String =
        text.lines().map(|line| line.split("//").next().unwrap_or("").to_owned() + "\n").collect();
    let begins = code.match_indices("fn ").filter(|(at, _)| {
        !code[..*at].ends_with(|before: char| before.is_alphanumeric() || before == '_')
    });
    let function = |(at, word): (usize, &str)| {
        let name = super::first_word(&code[at + word.len()..]);
        let rest = &code[at + word.len() + name.len()..];
        let rest = if rest.starts_with('<') { &rest[group(rest)?.len()..] } else { rest };
        let is_function = !name.is_empty() && rest.starts_with('(');
        let parameters = if is_function { parameters(group(rest)?) } else { return None };
        Some(Function { name, parameters })
    };
    begins.filter_map(function).collect()
}

/// The brackets at the beginning of a text, with all between them.
fn group(text: &str) -> Option<&str> {
    let mut depth = 0;
    let mut before = ' ';
    for (at, c) in text.char_indices() {
        depth += step(before, c);
        if depth == 0 {
            return Some(&text[..at + c.len_utf8()]);
        }
        before = c;
    }
    None
}

/// The change of the depth of brackets by a character. The `>` of `->` and `=>` is no bracket.
fn step(before: char, c: char) -> i32 {
    match c {
        '(' | '[' | '{' | '<' => 1,
        '>' if matches!(before, '-' | '=') => 0,
        ')' | ']' | '}' | '>' => -1,
        _ => 0,
    }
}

/// The parts of a list with its brackets.
fn parts(list: &str) -> Vec<&str> {
    let inner = &list[1..list.len() - 1];
    let (mut parts, mut start, mut depth, mut before) = (Vec::new(), 0, 0, ' ');
    for (at, c) in inner.char_indices() {
        depth += step(before, c);
        if c == ',' && depth == 0 {
            parts.push(inner[start..at].trim());
            start = at + 1;
        }
        before = c;
    }
    parts.push(inner[start..].trim());
    parts
}

/// The parameters in a list with its parentheses, without `self`.
fn parameters(list: &str) -> Vec<String> {
    let is_self = |parameter: &str| {
        let name = parameter.split(':').next().unwrap_or("");
        name.split(|c: char| !(c.is_alphanumeric() || c == '_')).any(|word| word == "self")
    };
    let all = parts(list).into_iter().enumerate();
    let is_left_out = |at: usize, text: &str| text.is_empty() || (at == 0 && is_self(text));
    let others = all.filter(|(at, text)| !is_left_out(*at, text));
    others.map(|(_, text)| text.to_owned()).collect()
}

/// Whether the type of a parameter is a tuple, behind references and `Option`.
fn is_tuple(parameter: &str) -> bool {
    let (mut depth, mut before) = (0, ' ');
    let colon = parameter.char_indices().find(|(at, c)| {
        depth += step(before, *c);
        before = *c;
        depth == 0 && *c == ':' && !parameter[at + 1..].starts_with(':')
    });
    let mut kind = colon.map_or("", |(at, _)| parameter[at + 1..].trim());
    loop {
        let inner = kind.strip_prefix('&').or_else(|| kind.strip_prefix("mut "));
        let option = || {
            let rest = kind.strip_prefix("Option").filter(|rest| rest.starts_with('<'));
            rest.and_then(group).map(|g| &g[1..g.len() - 1])
        };
        let lifetime = || kind.strip_prefix('\'').and_then(|rest| Some(rest.split_once(' ')?.1));
        let Some(inner) = inner.or_else(option).or_else(lifetime) else { break };
        kind = inner.trim();
    }
    kind.starts_with('(') && group(kind).is_some_and(|tuple| parts(tuple).len() > 1)
}

#[test]
fn no_function_has_more_than_four_parameters() {
    let mut wrong = Vec::new();
    let mut known = 0;
    for source in super::sources() {
        for Function { name, parameters } in functions(&source.text) {
            known += 1;
            let count = parameters.len();
            if count > PARAMETERS_MAX {
                wrong.push(format!("{}: `{name}` has {count}", source.path.display()));
            }
        }
    }
    assert!(known > 3000, "the search found {known} functions");
    assert!(wrong.is_empty(), "make a struct of some parameters:\n{}", wrong.join("\n"));
}

#[test]
fn no_function_takes_a_tuple() {
    let mut wrong = Vec::new();
    for (_, folder) in super::source_folders() {
        let mut files = Vec::new();
        super::collect(&folder, &mut files);
        let tests = folder.with_file_name("tests");
        if tests.exists() {
            super::collect(&tests, &mut files);
        }
        // This file has examples of tuples.
        for path in files.into_iter().filter(|path| !path.ends_with("house/parameters.rs")) {
            let text = std::fs::read_to_string(&path).expect("a source is readable");
            for Function { name, parameters } in functions(&text) {
                let tuples = parameters.into_iter().filter(|parameter| is_tuple(parameter));
                wrong.extend(tuples.map(|tuple| format!("{}: `{name}`: {tuple}", path.display())));
            }
        }
    }
    assert!(wrong.is_empty(), "name the parts:\n{}", wrong.join("\n"));
}

#[test]
fn a_tuple_is_found_behind_references_and_options() {
    let text = "\
fn plain((a, b): (u8, u8), c: &(u8, u8), d: Option<(u8, u8)>, e: &'a mut (u8, Vec<u8>)) {
fn bound(a: &mut (impl Read + Seek), b: (), c: [(u8, u8); 2], Pair(d, e): Pair, f: b::C<(u8, u8)>) {
fn call(a: impl Fn(u8, u8) -> (u8, u8), b: &[(u8, u8)], [c, d]: [u8; 2], e: &'static str) {
";
    let functions = functions(text).into_iter();
    let tuples = functions.map(|function| {
        (function.name, function.parameters.iter().filter(|text| is_tuple(text)).count())
    });
    let tuples: Vec<_> = tuples.collect();
    let expected = [("plain", 4), ("bound", 0), ("call", 0)];
    assert_eq!(tuples, expected.map(|(name, count)| (name.to_owned(), count)));
}

#[test]
fn parameters_are_counted_without_self() {
    let text = "\
fn none() -> (u8, u8) {
pub(super) fn own<'a, T: Fn(u8, u8) -> u8>(&'a mut self, a: (u8, u8), b: Map<u8, T>) -> u8 {
    fn wide(
        mut self: Box<Self>,
        a: impl Fn(u8, u8) -> [u8; 2], // one, two
        b: &[u8],
    ) where
async fn pattern(it_self: u8, Point { x, y }: Point) {
let call = |of: fn (u8, u8)| of(1, 2);
// fn remark(a: u8)
    fn $made(a: u8) {
";
    let found = functions(text);
    let found: Vec<_> =
        found.iter().map(|found| (found.name.as_str(), found.parameters.len())).collect();
    assert_eq!(found, [("none", 0), ("own", 2), ("wide", 2), ("pattern", 2)]);
}
