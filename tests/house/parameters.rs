//! The number of parameters of functions.
//!
//! Callers confuse the order of many parameters. A function with more than four of them gets a
//! struct. `self` is not counted; nor are the parameters of closures and of function types.

/// The maximum number of parameters.
const PARAMETERS_MAX: usize = 4;

/// The names of a text's functions, with the number of their parameters. A function without a name,
/// in a macro, is left out.
fn functions(text: &str) -> Vec<(String, usize)> {
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
        let count = if is_function { count(group(rest)?) } else { return None };
        Some((name, count))
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

/// The number of parameters in a list with its parentheses, without `self`.
fn count(list: &str) -> usize {
    let inner = &list[1..list.len() - 1];
    let (mut parameters, mut start, mut depth, mut before) = (Vec::new(), 0, 0, ' ');
    for (at, c) in inner.char_indices() {
        depth += step(before, c);
        if c == ',' && depth == 0 {
            parameters.push(&inner[start..at]);
            start = at + 1;
        }
        before = c;
    }
    parameters.push(&inner[start..]);
    parameters.retain(|parameter| !parameter.trim().is_empty());
    let is_self = |parameter: &&str| {
        let name = parameter.split(':').next().unwrap_or("");
        name.split(|c: char| !(c.is_alphanumeric() || c == '_')).any(|word| word == "self")
    };
    parameters.len() - usize::from(parameters.first().is_some_and(is_self))
}

#[test]
fn no_function_has_more_than_four_parameters() {
    let mut wrong = Vec::new();
    let mut known = 0;
    for source in super::sources() {
        for (name, count) in functions(&source.text) {
            known += 1;
            if count > PARAMETERS_MAX {
                wrong.push(format!("{}: `{name}` has {count}", source.path.display()));
            }
        }
    }
    assert!(known > 3000, "the search found {known} functions");
    assert!(wrong.is_empty(), "make a struct of some parameters:\n{}", wrong.join("\n"));
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
    let found: Vec<_> = found.iter().map(|(name, count)| (name.as_str(), *count)).collect();
    assert_eq!(found, [("none", 0), ("own", 2), ("wide", 2), ("pattern", 2)]);
}
