//! The part of a request after `?`: keys with values.
//!
//! A question with a key that is not known, or with a value that cannot be one, is refused: an
//! answer to a different question would be taken for the answer to this one.

/// The most keys.
const KEYS_MAX: usize = 32;

/// The keys of all questions, and whether the value is a number.
const KEYS: [(&str, bool); 10] = [
    ("element", false),
    ("find", false),
    ("from", true),
    ("hold", true),
    ("minutes", true),
    ("operand", false),
    ("scan", true),
    ("tags", false),
    ("to", true),
    ("within", false),
];
/// The most characters of a key or value in a message.
const SHOWN_CHARS_MAX: usize = 40;

/// Keys with values, in order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Query(Vec<(String, String)>);

impl Query {
    /// Reads `a=b&c=d`. Replaces bytes that are not UTF-8.
    pub fn of(text: &str) -> Query {
        let pairs = text.split('&').filter(|pair| !pair.is_empty()).take(KEYS_MAX + 1);
        let pair = |pair: &str| {
            let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
            (decoded(key), decoded(value))
        };
        Query(pairs.map(pair).collect())
    }

    /// Refuses what is no question of a page.
    ///
    /// # Errors
    /// An unknown key, a key that stands twice, or a value that is not a number.
    pub fn judge(&self) -> Result<(), String> {
        let short = |text: &str| text.chars().take(SHOWN_CHARS_MAX).collect::<String>();
        if self.0.len() > KEYS_MAX {
            return Err(format!("a question has at most {KEYS_MAX} keys"));
        }
        for (at, (key, value)) in self.0.iter().enumerate() {
            let Some((_, is_number)) = KEYS.iter().find(|(known, _)| known == key) else {
                let known = KEYS.map(|(known, _)| known).join(", ");
                return Err(format!("there is no key `{}`: the keys are {known}", short(key)));
            };
            if self.0[..at].iter().any(|(earlier, _)| earlier == key) {
                return Err(format!("`{key}` stands twice"));
            }
            if *is_number && value.parse::<u64>().is_err() {
                return Err(format!("`{key}` is a whole number from 0 on, not `{}`", short(value)));
            }
        }
        Ok(())
    }

    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.0.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
    }

    /// The value of a key as a number.
    pub fn number(&self, key: &str) -> Option<u64> {
        self.get(key)?.parse().ok()
    }
}

/// Decodes `%C3%A4` and `+`.
fn decoded(text: &str) -> String {
    let (mut bytes, mut rest) = (Vec::new(), text.as_bytes());
    while let [first, behind @ ..] = rest {
        let digit = |at: usize| behind.get(at).and_then(|byte| char::from(*byte).to_digit(16));
        match (first, digit(0).zip(digit(1))) {
            (b'%', Some((high, low))) => {
                bytes.push((high * 16 + low) as u8);
                rest = &behind[2..];
            }
            (b'+', _) => {
                bytes.push(b' ');
                rest = behind;
            }
            _ => {
                bytes.push(*first);
                rest = behind;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_values_are_decoded() {
        let query = Query::of("tag=Tank.L%C3%A4nge&n=12&empty&x=a+b%2B%zz%4");
        assert_eq!(query.get("tag"), Some("Tank.Länge"));
        assert_eq!((query.number("n"), query.number("tag")), (Some(12), None));
        assert_eq!((query.get("empty"), query.get("x")), (Some(""), Some("a b+%zz%4")));
        assert_eq!(Query::of("%ff=%00").0, [("\u{fffd}".to_owned(), "\0".to_owned())]);
        assert_eq!(Query::of(&"a&".repeat(100)).0.len(), KEYS_MAX + 1);
    }

    #[test]
    fn invalid_queries_are_refused_with_a_reason() {
        let judged = |text: &str| Query::of(text).judge();
        for right in ["", "operand=a%20b&scan=12&hold=1", "element=Main&from=1&to=0&tags=", "find="]
        {
            assert_eq!(judged(right), Ok(()), "{right}");
        }
        for (wrong, words) in [
            ("scan=-1", "`scan` is a whole number from 0 on, not `-1`"),
            ("scan=", "`scan` is a whole number"),
            ("hold=1.5", "`hold` is a whole number"),
            ("from=18446744073709551616", "`from` is a whole number"),
            ("to=x", "`to` is a whole number"),
            ("operand=a&scn=5", "there is no key `scn`"),
            ("scan=1&scan=2", "`scan` stands twice"),
        ] {
            let why = judged(wrong).expect_err(wrong);
            assert!(why.contains(words), "{why}");
        }
        assert!(judged(&"scan=1&".repeat(100)).is_err());
    }
}
