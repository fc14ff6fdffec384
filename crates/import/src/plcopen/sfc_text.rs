//! Conditions in ST: `start AND NOT (stop OR n > 5)`.
//!
//! Called by `sfc_condition`. It reads BOOLs, compares, NOT, AND, OR and XOR; what else ST has is
//! refused.

/// A condition in ST.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum TextCondition {
    /// A variable or a literal.
    Value(String),
    Not(Box<TextCondition>),
    Both {
        operator: TextOperator,
        sides: Box<[TextCondition; 2]>,
    },
}

/// An operator between two sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TextOperator {
    And,
    Or,
    Xor,
    /// By the name of its function: `GT`.
    Compare(&'static str),
}

/// Longest text that is read.
const LENGTH_MAX: usize = 4096;
/// Deepest nesting.
const DEPTH_MAX: usize = 64;

/// Binary operators by how tightly they bind, the loosest first.
const OPERATORS: [&[(&str, TextOperator)]; 5] = [
    &[("OR", TextOperator::Or)],
    &[("XOR", TextOperator::Xor)],
    &[("AND", TextOperator::And), ("&", TextOperator::And)],
    &[("=", TextOperator::Compare("EQ")), ("<>", TextOperator::Compare("NE"))],
    &[
        ("<=", TextOperator::Compare("LE")),
        (">=", TextOperator::Compare("GE")),
        ("<", TextOperator::Compare("LT")),
        (">", TextOperator::Compare("GT")),
    ],
];

/// The condition that a text says; `None` if it is more than that.
pub(super) fn read(text: &str) -> Option<TextCondition> {
    let text = text.trim();
    let text = text.strip_prefix(":=").unwrap_or(text).trim_end_matches([';', ' ', '\n', '\r']);
    if text.len() > LENGTH_MAX {
        return None;
    }
    let mut reader = TextReader { words: words(text)?, at: 0, depth: 0 };
    let condition = reader.operation(0)?;
    (reader.at == reader.words.len()).then_some(condition)
}

/// The words of a text: names, literals and signs.
fn words(text: &str) -> Option<Vec<String>> {
    let mut words = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() {
        if let Some(comment) = rest.strip_prefix("(*") {
            rest = comment.split_once("*)")?.1.trim_start();
            continue;
        }
        let two = ["<>", "<=", ">="].into_iter().find(|sign| rest.starts_with(sign));
        let one = |c: char| "()&<>=".contains(c);
        let is_word = |c: char| c.is_alphanumeric() || "_.#%[]".contains(c);
        let length = match (two, rest.chars().next()?) {
            (Some(sign), _) => sign.len(),
            (None, first) if one(first) => 1,
            (None, '-') if rest[1..].starts_with(|c: char| c.is_ascii_digit()) => {
                1 + rest[1..].find(|c| !is_word(c)).unwrap_or(rest.len() - 1)
            }
            (None, first) if is_word(first) => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            _ => return None,
        };
        words.push(rest[..length].to_owned());
        rest = rest[length..].trim_start();
    }
    Some(words)
}

struct TextReader {
    words: Vec<String>,
    at: usize,
    depth: usize,
}

impl TextReader {
    fn next_is(&mut self, word: &str) -> bool {
        let is_it = self.words.get(self.at).is_some_and(|next| next.eq_ignore_ascii_case(word));
        self.at += usize::from(is_it);
        is_it
    }

    /// Operators of one level and those that bind more tightly.
    fn operation(&mut self, level: usize) -> Option<TextCondition> {
        let Some(operators) = OPERATORS.get(level) else { return self.single() };
        let mut left = self.operation(level + 1)?;
        while let Some((_, operator)) = operators.iter().find(|(word, _)| self.next_is(word)) {
            let right = self.operation(level + 1)?;
            left = TextCondition::Both { operator: *operator, sides: Box::new([left, right]) };
        }
        Some(left)
    }

    /// A value, its opposite, or what stands in parentheses.
    fn single(&mut self) -> Option<TextCondition> {
        self.depth += 1;
        if self.depth > DEPTH_MAX {
            return None;
        }
        let found = if self.next_is("NOT") {
            TextCondition::Not(Box::new(self.single()?))
        } else if self.next_is("(") {
            let inner = self.operation(0)?;
            self.next_is(")").then_some(inner)?
        } else {
            let word = self.words.get(self.at)?.clone();
            self.at += 1;
            let mut operators = OPERATORS.iter().copied().flatten();
            let is_operator = operators.any(|(name, _)| word.eq_ignore_ascii_case(name));
            let is_value = word.starts_with(|c: char| c.is_alphanumeric() || "_%-".contains(c))
                && !is_operator;
            is_value.then_some(TextCondition::Value(word))?
        };
        self.depth -= 1;
        Some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A condition with all parentheses.
    fn shown(condition: &TextCondition) -> String {
        match condition {
            TextCondition::Value(text) => text.clone(),
            TextCondition::Not(inner) => format!("!{}", shown(inner)),
            TextCondition::Both { operator, sides } => {
                let [left, right] = &**sides;
                format!("({} {operator:?} {})", shown(left), shown(right))
            }
        }
    }

    #[test]
    fn conditions_in_st_bind_as_the_standard_says() {
        for (text, wanted) in [
            ("start", Some("start")),
            (":= NOT reset ;", Some("!reset")),
            ("(not A or B) and not C", Some("((!A Or B) And !C)")),
            ("a OR b XOR c & d", Some("(a Or (b Xor (c And d)))")),
            (
                "n > 5 AND s.T >= T#1s",
                Some("((n Compare(\"GT\") 5) And (s.T Compare(\"GE\") T#1s))"),
            ),
            ("IX1 = FALSE (* no *)", Some("(IX1 Compare(\"EQ\") FALSE)")),
            ("a[3].b <> -5", Some("(a[3].b Compare(\"NE\") -5)")),
            ("n + 1 > 5", None),
            ("f(a)", None),
            ("a b", None),
            ("(a", None),
            ("", None),
            ("AND", None),
        ] {
            let found = read(text);
            assert_eq!(found.as_ref().map(shown).as_deref(), wanted, "{text}");
        }
        let deep = format!("{}a{}", "(".repeat(10_000), ")".repeat(10_000));
        assert_eq!(read(&deep), None);
        assert_eq!(read(&format!("{}a", "NOT ".repeat(500))), None);
    }
}
