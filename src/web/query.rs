//! The part of a request after `?`: keys with values.

/// The most keys.
const KEYS_MAX: usize = 32;

/// Keys with values, in order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Query(Vec<(String, String)>);

impl Query {
    /// Reads `a=b&c=d`. Replaces bytes that are not UTF-8.
    pub fn of(text: &str) -> Query {
        let pairs = text.split('&').filter(|pair| !pair.is_empty()).take(KEYS_MAX);
        let pair = |pair: &str| {
            let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
            (decoded(key), decoded(value))
        };
        Query(pairs.map(pair).collect())
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
        assert_eq!(Query::of(&"a&".repeat(100)).0.len(), KEYS_MAX);
    }
}
