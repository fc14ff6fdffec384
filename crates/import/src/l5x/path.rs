//! The text of an operand that names a tag: `Program:Main.Recipe[step, 2].Target.3`.

/// A path to a tag, or to a part of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct TagPath {
    /// The program, if the text names one.
    pub(crate) program: Option<String>,
    /// The tag: `Recipe`, `Local:1:I`.
    pub(crate) base: String,
    /// What follows.
    pub(crate) parts: Vec<PathPart>,
}

/// A part of a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum PathPart {
    /// `.Target`.
    Member(String),
    /// `[step, 2]`.
    Index(Vec<String>),
    /// `.3`.
    Bit(u32),
    /// `.[number]`.
    MovingBit(String),
}

/// Reads a path; `None` if the text is none.
pub(crate) fn parse(text: &str) -> Option<TagPath> {
    let text = text.trim();
    let (program, text) = match text.strip_prefix('\\') {
        Some(rest) => rest.split_once('.').map(|(program, rest)| (Some(program), rest))?,
        None => match text.get(..8).filter(|head| head.eq_ignore_ascii_case("program:")) {
            Some(_) => text[8..].split_once('.').map(|(program, rest)| (Some(program), rest))?,
            None => (None, text),
        },
    };
    let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | ':');
    let end = text.find(|c: char| !is_name(c)).unwrap_or(text.len());
    let (base, mut rest) = text.split_at(end);
    if !base.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        return None;
    }
    let mut parts = Vec::new();
    while !rest.is_empty() {
        rest = match rest.as_bytes()[0] {
            b'[' => {
                let (inside, behind) = bracket(rest)?;
                parts.push(PathPart::Index(listed(inside)));
                behind
            }
            b'.' if rest[1..].starts_with('[') => {
                let (inside, behind) = bracket(&rest[1..])?;
                parts.push(PathPart::MovingBit(inside.trim().to_owned()));
                behind
            }
            b'.' => {
                let behind = &rest[1..];
                let end = behind.find(|c: char| !is_name(c)).unwrap_or(behind.len());
                let (name, behind) = behind.split_at(end);
                parts.push(match name.bytes().all(|byte| byte.is_ascii_digit()) {
                    true => PathPart::Bit(name.parse().ok()?),
                    false => PathPart::Member(name.to_owned()),
                });
                behind
            }
            _ => return None,
        };
    }
    Some(TagPath { program: program.map(str::to_owned), base: base.to_owned(), parts })
}

/// The text within the bracket at the beginning, and the text behind it.
fn bracket(text: &str) -> Option<(&str, &str)> {
    let mut depth = 0_usize;
    for (at, letter) in text.char_indices() {
        match letter {
            '[' => depth += 1,
            ']' if depth == 1 => return Some((&text[1..at], &text[at + 1..])),
            ']' => depth -= 1,
            _ => {}
        }
    }
    None
}

/// The parts between commas outside of brackets and parentheses.
fn listed(text: &str) -> Vec<String> {
    let mut parts = vec![String::new()];
    let mut depth = 0_i32;
    for letter in text.chars() {
        match letter {
            '[' | '(' => depth += 1,
            ']' | ')' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(last) = parts.last_mut() {
            last.push(letter);
        }
    }
    parts.into_iter().map(|part| part.trim().to_owned()).collect()
}

/// A number as Logix writes it: `10`, `-3`, `16#ff`, `2#1010_1010`.
pub(crate) fn whole(text: &str) -> Option<i64> {
    let text = text.trim().replace('_', "");
    let (is_negative, digits) = match text.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, text.as_str()),
    };
    let (radix, digits) = match digits.split_once('#') {
        Some((radix, digits)) => (radix.parse::<u32>().ok()?, digits),
        None => (10, digits),
    };
    if ![2, 8, 10, 16].contains(&radix) || digits.is_empty() || digits.starts_with(['+', '-']) {
        return None;
    }
    let value = i64::from_str_radix(digits, radix).ok()?;
    // A number with a radix is a pattern of 32 bits.
    let value = if radix == 10 || value > i64::from(u32::MAX) {
        value
    } else {
        i64::from(value as u32 as i32)
    };
    Some(if is_negative { -value } else { value })
}

/// A number with a point or an exponent: `1.5`, `2.5e-3`.
pub(crate) fn real(text: &str) -> Option<f32> {
    let text = text.trim();
    let is_real = text.contains(['.', 'e', 'E'])
        && text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '.' | '+'));
    text.parse::<f32>().ok().filter(|value| is_real && value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_has_members_indexes_and_bits() {
        let path = parse("Program:Main.Recipe[step + a[1], 2].Target.3").unwrap();
        assert_eq!(path.program.as_deref(), Some("Main"));
        assert_eq!(path.base, "Recipe");
        let index = PathPart::Index(vec!["step + a[1]".to_owned(), "2".to_owned()]);
        assert_eq!(path.parts, [index, PathPart::Member("Target".to_owned()), PathPart::Bit(3)]);
        assert_eq!(parse("Local:1:I.Data.[n]").unwrap().parts.len(), 2);
        assert_eq!(parse("3"), None);
        assert_eq!(parse("a b"), None);
        assert_eq!(parse("a[1"), None);
    }

    #[test]
    fn numbers_have_a_radix() {
        for (text, value) in [
            ("10", Some(10)),
            ("-3", Some(-3)),
            ("16#ffff_ffff", Some(-1)),
            ("2#1010", Some(10)),
            ("1.5", None),
            ("a", None),
        ] {
            assert_eq!(whole(text), value, "{text}");
        }
        assert_eq!(real("1.5"), Some(1.5));
        assert_eq!(real("10"), None);
        assert_eq!(real("nan"), None);
    }
}
