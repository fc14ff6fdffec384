//! Patterns of metrics' names: `*` stands for any characters, also for none.
//!
//! `edge` uses them to choose the published tags, `fleet` to choose the shown metrics.

/// Whether a name matches a pattern. Each `*` takes as few characters as possible, which is enough:
/// the text between two `*` is matched at its first occurrence.
pub fn fits(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = name.strip_prefix(first) else { return false };
    let Some(last) = parts.next_back() else { return rest.is_empty() };
    for part in parts {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_matches_any_characters() {
        let cases = [
            ("*", "", true),
            ("*", "jam", true),
            ("jam", "jam", true),
            ("jam", "jams", false),
            ("belt.*", "belt.Acc", true),
            ("belt.*", "belt", false),
            ("*.Acc", "belt.Acc", true),
            ("a*b*c", "abc", true),
            ("a*b*c", "a1b2b3c", true),
            ("a*b*c", "acb", false),
            ("ab*ba", "aba", false),
            ("", "", true),
            ("a*a", "a", false),
            ("", "a", false),
        ];
        for (pattern, name, does) in cases {
            assert_eq!(fits(pattern, name), does, "{pattern} {name}");
        }
    }
}
