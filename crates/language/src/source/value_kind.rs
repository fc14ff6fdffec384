//! Kinds of values: how a value is written, its limits, and the finding about a wrong one.
//!
//! A reader hands a kind to [`super::table::Table::value`] together with a key. So the parse, the
//! limits, the words and the help of a value stand in one place, and `rungd schema` and editors
//! have the same limits. A kind sees one value: rules about several keys belong to their reader.

use super::atom::bad_duration;
use super::doc::Text;
use super::finding::{Code, Finding};
use super::fix::{Help, one_of, pair, possible, propose, proposed};
use super::key::KeyLimit;
use super::nearest::{KnownNames, did_you_mean};
use super::shape::ValueForm;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::duration;

/// A kind of values that are written as strings.
pub trait ValueKind {
    /// The value that a reader gets.
    type Value;

    /// The form of the string, for the schema.
    fn form(&self) -> ValueForm {
        ValueForm::Text
    }

    /// The limits beyond the form, for the schema.
    fn limit(&self) -> KeyLimit {
        KeyLimit::None
    }

    /// The words for the string in the finding about a value of a different type.
    fn noun(&self) -> &'static str {
        "a string"
    }

    /// The value of a text; `key` is the name of its key. A wrong text becomes a finding.
    fn read(&self, key: &str, text: &Text, find: &mut dyn FnMut(Finding)) -> Option<Self::Value>;
}

/// Some words, each with its meaning.
#[derive(Clone, Copy, Debug)]
pub struct KeyWords<T: 'static> {
    named: &'static [(&'static str, T)],
    wrong: WrongWord,
}

/// The sentence about a word that is none of the known ones.
#[derive(Clone, Copy, Debug)]
pub enum WrongWord {
    /// `` `parity` is "even" or "odd", not "e" ``.
    Expected,
    /// `` `e` is no value of `parity` ``, with all words.
    NoValue,
    /// `` no NOUN is called `e` ``, with the nearest word or all words.
    NoneCalled(&'static str),
    /// `` `e` is no NOUN `` and `write HELP`.
    No(&'static str, &'static str),
}

impl<T: Copy> KeyWords<T> {
    /// Words, with the finding [`WrongWord::Expected`].
    pub const fn new(named: &'static [(&'static str, T)]) -> KeyWords<T> {
        KeyWords { named, wrong: WrongWord::Expected }
    }

    /// The same words with another finding.
    pub const fn refused_as(self, wrong: WrongWord) -> KeyWords<T> {
        KeyWords { wrong, ..self }
    }

    /// The word for a meaning.
    pub fn word(&self, meaning: T) -> &'static str
    where
        T: PartialEq,
    {
        self.named.iter().find(|(_, known)| *known == meaning).map_or("", |(word, _)| word)
    }

    fn words(&self) -> Vec<&'static str> {
        self.named.iter().map(|(word, _)| *word).collect()
    }
}

impl WrongWord {
    /// The finding; `words` are the known words.
    pub fn finding(self, key: &str, text: &Text, words: &[&str]) -> Finding {
        let listed = |quote: char, between: &str| {
            let quoted: Vec<_> = words.iter().map(|word| format!("{quote}{word}{quote}")).collect();
            quoted.join(between)
        };
        let written = &text.text;
        let finding = |message: String| Finding::new(Code::Controller, text.span, message);
        match self {
            WrongWord::Expected => {
                finding(format!("`{key}` is {}, not \"{written}\"", listed('"', " or ")))
                    .fixes(words.iter().map(|word| possible(*word)))
            }
            WrongWord::NoValue => finding(format!("`{written}` is no value of `{key}`"))
                .help(one_of("write one of", words.iter().copied()))
                .near(written, &KnownNames::new(words.iter().copied())),
            WrongWord::NoneCalled(noun) => {
                let help = did_you_mean(written, words.iter().copied());
                finding(format!("no {noun} is called `{written}`"))
                    .help(help.unwrap_or_else(|| one_of("there are", words.iter().copied())))
            }
            WrongWord::No(noun, help) => {
                let help = Help::from(format!("write {help}"));
                let help = help.with_all(words.iter().map(|word| proposed(*word)));
                finding(format!("`{written}` is no {noun}")).help(help)
            }
        }
    }
}

impl<T: Copy> ValueKind for KeyWords<T> {
    type Value = T;

    fn form(&self) -> ValueForm {
        ValueForm::Words(self.words())
    }

    fn read(&self, key: &str, text: &Text, find: &mut dyn FnMut(Finding)) -> Option<T> {
        let found = self.named.iter().find(|(word, _)| *word == text.text);
        if found.is_none() {
            find(self.wrong.finding(key, text, &self.words()));
        }
        found.map(|(_, meaning)| *meaning)
    }
}

/// Durations within limits, in ms.
#[derive(Clone, Copy, Debug)]
pub struct Millis {
    /// A value for the help, if the least duration is 1 ms; otherwise it is 0 ms.
    some: Option<&'static str>,
    most_s: Option<u32>,
}

/// A JSON Schema: a duration of at least 1 ms.
const LEAST_1MS: &str = r#"{"not":{"const":"0ms"}}"#;

impl Millis {
    /// Any duration.
    pub const ANY: Millis = Millis { some: None, most_s: None };

    /// A duration of at least 1 ms; the help has this one.
    pub const fn some(example: &'static str) -> Millis {
        Millis { some: Some(example), most_s: None }
    }

    /// A duration of at most this time. A longer one is read as this one.
    pub const fn at_most_s(most_s: u32) -> Millis {
        Millis { some: None, most_s: Some(most_s) }
    }
}

/// The milliseconds of a text, or a finding.
pub fn read_duration(text: &Text, find: &mut dyn FnMut(Finding)) -> Option<u32> {
    match duration::parse(&text.text) {
        Ok(ms) => Some(ms.max(0).unsigned_abs()),
        Err(error) => {
            find(bad_duration(&text.text, text.span, error));
            None
        }
    }
}

impl ValueKind for Millis {
    type Value = u32;

    fn form(&self) -> ValueForm {
        ValueForm::Duration
    }

    fn limit(&self) -> KeyLimit {
        self.some.map_or(KeyLimit::None, |_| KeyLimit::Schema(LEAST_1MS))
    }

    fn noun(&self) -> &'static str {
        "a duration (`\"10ms\"`)"
    }

    fn read(&self, key: &str, text: &Text, find: &mut dyn FnMut(Finding)) -> Option<u32> {
        let ms = read_duration(text, find)?;
        let mut refuse = |message: String, help: Help| {
            find(Finding::new(Code::OutOfRange, text.span, message).help(help));
        };
        if let Some(example) = self.some.filter(|_| ms == 0) {
            let help = propose(pair(format!("{key} = \"{example}\"")));
            refuse(format!("`{key}` is at least 1ms"), help);
            return None;
        }
        match self.most_s {
            Some(most_s) if ms > most_s * 1000 => {
                let help = propose(pair(format!("{key} = \"{most_s}s\""))).and(", or less");
                refuse(format!("`{key}` is at most {most_s}s"), help);
                Some(most_s * 1000)
            }
            Some(_) | None => Some(ms),
        }
    }
}

/// Scan periods: a duration, or a number of microseconds, `250us`.
#[derive(Clone, Copy, Debug)]
pub struct Periods;

impl ValueKind for Periods {
    type Value = ScanPeriod;

    fn form(&self) -> ValueForm {
        ValueForm::Period
    }

    fn limit(&self) -> KeyLimit {
        KeyLimit::Schema(LEAST_1MS)
    }

    fn noun(&self) -> &'static str {
        "a duration (`\"10ms\"`)"
    }

    fn read(&self, key: &str, text: &Text, find: &mut dyn FnMut(Finding)) -> Option<ScanPeriod> {
        let us = match ScanPeriod::written_us(&text.text) {
            Some(us) => us,
            None => u64::from(read_duration(text, find)?) * 1000,
        };
        let mut refuse = |limit: &str, value: &str| {
            let message = format!("`{key}` is at {limit}");
            let help = propose(pair(format!("{key} = \"{value}\"")));
            find(Finding::new(Code::OutOfRange, text.span, message).help(help));
        };
        if us > ScanPeriod::MOST_US {
            refuse("most 596h", "10ms");
            return None;
        }
        let period = ScanPeriod::of_us(us);
        if period.is_none() {
            refuse(&format!("least {}us", ScanPeriod::LEAST_US), "10ms");
        }
        period
    }
}

/// Values that a function reads from a text: paths, addresses, permissions.
#[derive(Clone, Copy, Debug)]
pub struct ParsedText<T: 'static> {
    parse: fn(&str, &Text) -> Result<T, Finding>,
    limit: KeyLimit,
}

impl<T> ParsedText<T> {
    /// Values that a function reads; it gets the name of the key and the text.
    pub const fn new(parse: fn(&str, &Text) -> Result<T, Finding>) -> ParsedText<T> {
        ParsedText { parse, limit: KeyLimit::None }
    }

    /// The same, limited by a JSON Schema.
    pub const fn limited(self, schema: &'static str) -> ParsedText<T> {
        ParsedText { limit: KeyLimit::Schema(schema), ..self }
    }
}

impl<T> ValueKind for ParsedText<T> {
    type Value = T;

    fn limit(&self) -> KeyLimit {
        self.limit
    }

    fn read(&self, key: &str, text: &Text, find: &mut dyn FnMut(Finding)) -> Option<T> {
        (self.parse)(key, text).map_err(find).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::key::key;
    use crate::source::reader;
    use crate::source::span::FileId;

    fn read<K: ValueKind>(value: &str, kind: &K) -> (Option<K::Value>, Vec<String>) {
        let text = format!("k = \"{value}\"\n");
        let (value, findings) = reader::document(&text, FileId(0), |mut root| {
            let value = root.value_of(key("k", "A key."), kind);
            root.finish();
            value
        });
        (value.flatten(), findings.into_iter().map(|finding| finding.message).collect())
    }

    #[test]
    fn a_known_word_has_a_value_and_an_unknown_word_gives_a_finding() {
        let words = KeyWords::new(&[("even", 2), ("odd", 1)]);
        assert_eq!(read("odd", &words), (Some(1), vec![]));
        let wrong = "`k` is \"even\" or \"odd\", not \"none\"".to_owned();
        assert_eq!(read("none", &words), (None, vec![wrong]));
        assert_eq!(words.word(2), "even");
    }

    #[test]
    fn a_duration_outside_its_limits_is_refused() {
        assert_eq!(read("0ms", &Millis::ANY), (Some(0), vec![]));
        let short = "`k` is at least 1ms".to_owned();
        assert_eq!(read("0ms", &Millis::some("20ms")), (None, vec![short]));
        let long = "`k` is at most 10s".to_owned();
        assert_eq!(read("11s", &Millis::at_most_s(10)), (Some(10_000), vec![long]));
        assert_eq!(read("10s", &Millis::at_most_s(10)), (Some(10_000), vec![]));
    }
}
