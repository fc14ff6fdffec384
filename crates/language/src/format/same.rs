//! Checks that a formatted text has the same content as the text before it.
//!
//! Called by `format` for each text that it has changed; of an upgraded text only the comments are
//! compared. The values are compared after parsing, the headers in their order, and the comments as
//! a list without an order, because keys may have moved.

use toml::de::{DeTable, DeValue};
use toml_parser::Source;
use toml_parser::lexer::TokenKind;

/// Whether two texts have the same values, headers and comments.
pub(super) fn is_same(before: &str, after: &str) -> bool {
    has_same_values(before, after) && TextOutline::of(before) == TextOutline::of(after)
}

/// Whether two texts have the same comments.
pub(super) fn has_same_comments(before: &str, after: &str) -> bool {
    TextOutline::of(before).remarks == TextOutline::of(after).remarks
}

fn has_same_values(before: &str, after: &str) -> bool {
    match (DeTable::parse(before), DeTable::parse(after)) {
        (Ok(before), Ok(after)) => is_same_table(before.get_ref(), after.get_ref()),
        (Ok(_) | Err(_), _) => false,
    }
}

fn is_same_table(before: &DeTable<'_>, after: &DeTable<'_>) -> bool {
    before.len() == after.len()
        && before.iter().zip(after.iter()).all(|((key, value), (key2, value2))| {
            key.get_ref() == key2.get_ref() && is_same_value(value.get_ref(), value2.get_ref())
        })
}

fn is_same_value(before: &DeValue<'_>, after: &DeValue<'_>) -> bool {
    match (before, after) {
        (DeValue::Table(before), DeValue::Table(after)) => is_same_table(before, after),
        (DeValue::Array(before), DeValue::Array(after)) => {
            let mut both = before.iter().zip(after.iter());
            before.len() == after.len()
                && both.all(|(before, after)| is_same_value(before.get_ref(), after.get_ref()))
        }
        (DeValue::String(before), DeValue::String(after)) => before == after,
        (DeValue::Boolean(before), DeValue::Boolean(after)) => before == after,
        (DeValue::Datetime(before), DeValue::Datetime(after)) => before == after,
        (DeValue::Integer(before), DeValue::Integer(after)) => {
            before.as_str() == after.as_str() && before.radix() == after.radix()
        }
        (DeValue::Float(before), DeValue::Float(after)) => before.as_str() == after.as_str(),
        (_, _) => false,
    }
}

/// Tokens without a meaning.
const BLANK: [TokenKind; 3] = [TokenKind::Whitespace, TokenKind::Newline, TokenKind::Eof];

/// The headers of a text, and its comments in byte order. It is made from the tokens, not from the
/// pieces, so that it detects a mistake in the reading of pieces.
#[derive(Debug, Default, PartialEq, Eq)]
struct TextOutline<'a> {
    heads: Vec<&'a str>,
    remarks: Vec<&'a str>,
}

impl<'a> TextOutline<'a> {
    fn of(text: &'a str) -> TextOutline<'a> {
        let mut outline = TextOutline::default();
        let (mut depth, mut part) = (0_usize, LineKind::Start);
        for token in Source::new(text).lex() {
            let kind = token.kind();
            let own = text.get(token.span().start()..token.span().end()).unwrap_or_default();
            if kind == TokenKind::Comment {
                outline.remarks.push(own.trim_end_matches([' ', '\t', '\r']));
            } else if kind == TokenKind::Newline && (depth == 0 || part == LineKind::Head) {
                (depth, part) = (0, LineKind::Start);
            } else if !BLANK.contains(&kind) {
                let opens =
                    matches!(kind, TokenKind::LeftSquareBracket | TokenKind::LeftCurlyBracket);
                let closes =
                    matches!(kind, TokenKind::RightSquareBracket | TokenKind::RightCurlyBracket);
                part = match part {
                    LineKind::Start if kind == TokenKind::LeftSquareBracket => LineKind::Head,
                    LineKind::Start => LineKind::Pair,
                    LineKind::Head | LineKind::Pair => part,
                };
                depth = (depth + usize::from(opens)).saturating_sub(usize::from(closes));
                if part == LineKind::Head {
                    outline.heads.push(own);
                }
            }
        }
        outline.remarks.sort_unstable();
        outline
    }
}

/// The kind of the current line.
#[derive(Clone, Copy, PartialEq, Eq)]
enum LineKind {
    Start,
    Head,
    Pair,
}

#[cfg(test)]
mod tests {
    use super::is_same;

    #[test]
    fn layout_changes_compare_as_equal_and_content_changes_do_not() {
        let text = "# a\n[x]\nb = [1, 2] # c\nd = \"e\"\n[y]\nf = 1.0\n";
        let other = "# a\n\n[ x ]\nd = 'e'\nb = [\n  1,\n  2,\n] # c \n\n[y]\nf = 1.0";
        assert!(is_same(text, other));
        for (gone, come) in [
            ("# a\n", ""),
            ("# c", "# d"),
            ("1, 2", "2, 1"),
            ("1, 2", "1, 2, 3"),
            ("\"e\"", "\"e \""),
            ("1.0", "1"),
            ("1.0", "1.00"),
            ("[y]", "[[y]]"),
            ("[y]", "[z]"),
            ("[y]\n", ""),
            ("[x]", "[x"),
        ] {
            assert!(!is_same(text, &text.replace(gone, come)), "{gone} to {come}");
        }
        // The order of headers counts, although both texts have the same tables.
        assert!(!is_same("[a]\n[b]\n", "[b]\n[a]\n"));
    }
}
