//! Helps of findings, and the changes of a file that they advise.
//!
//! A help is made where its finding is made: its words and the texts in it that can be written are
//! one [`Help`], so nobody reads the words to know what to write. Editors and `rungd check --fix`
//! turn the edits into changes of the text; they know the layout around a place (commas, lines of
//! their own), which no finding knows.

use std::fmt;
use std::ops::Range;

use super::span::Span;
use super::wording::bounded;

/// How sure it is that a fix is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Applicability {
    /// It is what the author meant: `rungd check --fix` writes it.
    Certain,
    /// It means the same as the present text. The author decides whether that is meant.
    Same,
    /// It is a good text, such as a limit. The author decides whether it is meant.
    Proposed,
    /// It is the nearest name. The text after that name can be wrong, too.
    Spelling,
    /// It is one of several, or shows a form.
    Possible,
}

/// A part of a fix. A text without a place is for the place of the finding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FixEdit {
    /// Replaces the bytes at a place of the finding's file.
    Write(Option<Range<u32>>, String),
    /// Writes `key = value` into the table of the finding.
    Pair(String),
    /// Adds `key = value` to the declaration of a tag.
    InTag {
        /// The tag.
        tag: String,
        /// The pair.
        pair: String,
    },
    /// Adds `key = value` to the declaration of a field of a record.
    InField {
        /// The record.
        record: String,
        /// The field.
        field: String,
        /// The pair.
        pair: String,
    },
    /// Replaces a word in the string at the place of the finding.
    Word {
        /// The word.
        old: String,
        /// The new word.
        new: String,
    },
    /// Adds a declaration under `[tags]`.
    Declare(String),
    /// Writes a table, or keys of the table of the finding.
    Lines {
        /// The lines.
        lines: String,
        /// A key that they replace.
        instead: Option<&'static str>,
    },
    /// Deletes the element, the pair or the table at the place of the finding.
    Delete,
    /// Deletes the part of a string, the element or the pair at the place of the finding, but no
    /// table.
    Omit,
    /// Deletes the row at the place of the finding: an inline table of an array.
    DeleteRow,
    /// Adds a row to the map of a device.
    Row(String),
    /// Writes `key = value` under the header of a table.
    Under {
        /// The path of the table.
        table: &'static str,
        /// The pair.
        pair: String,
    },
    /// Adds a table to the table of the finding, or to the file.
    Table {
        /// Its header.
        header: String,
        /// Its first line.
        line: String,
    },
    /// Adds an element to the list of a key in the table of the finding.
    Element {
        /// The key.
        key: &'static str,
        /// The element.
        element: String,
    },
    /// Removes a key from the table of the finding, or a table with this header.
    Remove(&'static str),
    /// Adds an instruction, in a rung before the rung of the finding.
    Before(String),
}

impl FixEdit {
    /// The text that it writes.
    pub fn text(&self) -> &str {
        match self {
            FixEdit::Write(_, text)
            | FixEdit::Pair(text)
            | FixEdit::InTag { pair: text, .. }
            | FixEdit::InField { pair: text, .. }
            | FixEdit::Word { new: text, .. }
            | FixEdit::Declare(text)
            | FixEdit::Lines { lines: text, .. }
            | FixEdit::Row(text)
            | FixEdit::Under { pair: text, .. }
            | FixEdit::Table { line: text, .. }
            | FixEdit::Element { element: text, .. }
            | FixEdit::Before(text) => text,
            FixEdit::Remove(key) => key,
            FixEdit::Delete | FixEdit::Omit | FixEdit::DeleteRow => "",
        }
    }
}

/// A change of a file that repairs a finding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fix {
    /// Its parts; they do not overlap.
    pub edits: Vec<FixEdit>,
    /// How sure it is.
    pub applicability: Applicability,
}

impl Fix {
    /// The same fix at a place of the finding's file.
    pub fn at(mut self, span: Span) -> Fix {
        if let Some(FixEdit::Write(place, _)) = self.edits.last_mut() {
            *place = Some(span.start..span.end);
        }
        self
    }

    /// The same fix, which is what the author meant, whatever else the file says: at its place
    /// there is no other reading.
    pub fn certain(self) -> Fix {
        Fix { applicability: Applicability::Certain, ..self }
    }

    /// The same fix, for the author to decide.
    pub fn proposed(self) -> Fix {
        Fix { applicability: Applicability::Proposed, ..self }
    }

    /// The same fix, as one of several.
    pub fn possible(self) -> Fix {
        Fix { applicability: Applicability::Possible, ..self }
    }

    /// The same fix, which does not change the meaning.
    pub fn same(self) -> Fix {
        Fix { applicability: Applicability::Same, ..self }
    }

    /// The same fix with one more part behind the others.
    pub fn and(mut self, edit: FixEdit) -> Fix {
        self.edits.push(edit);
        self
    }

    /// The same fix with one more part before the others.
    pub fn after(mut self, edit: FixEdit) -> Fix {
        self.edits.insert(0, edit);
        self
    }
}

impl From<FixEdit> for Fix {
    fn from(edit: FixEdit) -> Fix {
        Fix { edits: vec![edit], applicability: Applicability::Proposed }
    }
}

impl From<String> for Fix {
    fn from(text: String) -> Fix {
        FixEdit::Write(None, text).into()
    }
}

impl From<&str> for Fix {
    fn from(text: &str) -> Fix {
        text.to_owned().into()
    }
}

/// A text as a fix.
pub fn text(text: impl Into<Fix>) -> Fix {
    text.into()
}

/// A text that is certain.
pub fn certain(text: impl Into<Fix>) -> Fix {
    text.into().certain()
}

/// A text for the author to decide.
pub fn proposed(text: impl Into<Fix>) -> Fix {
    text.into().proposed()
}

/// A text as one of several.
pub fn possible(text: impl Into<Fix>) -> Fix {
    text.into().possible()
}

/// `key = value` as a fix.
pub fn pair(pair: impl Into<String>) -> Fix {
    FixEdit::Pair(pair.into()).into()
}

/// The help of a finding.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Help {
    /// Its words; empty if the message says all.
    pub text: String,
    /// What it advises, in the order of the words.
    pub fixes: Vec<Fix>,
}

impl Help {
    /// The same help with a fix that its words describe.
    pub fn with(self, fix: impl Into<Fix>) -> Help {
        self.with_all([fix])
    }

    /// The same help with several fixes.
    pub fn with_all<F: Into<Fix>>(mut self, fixes: impl IntoIterator<Item = F>) -> Help {
        self.fixes.extend(fixes.into_iter().map(Into::into));
        self
    }

    /// The same help, whose fixes are some of several.
    pub fn possible(mut self) -> Help {
        self.fixes = self.fixes.into_iter().map(Fix::possible).collect();
        self
    }

    /// The same help with more words.
    pub fn and(mut self, words: &str) -> Help {
        self.text.push_str(words);
        self
    }

    /// The same help, whose texts are for this place.
    pub fn at(mut self, span: Span) -> Help {
        self.fixes = self.fixes.into_iter().map(|fix| fix.at(span)).collect();
        self
    }

    /// Changes its words, and the texts to write.
    pub(super) fn reword(&mut self, change: impl Fn(&str) -> String) {
        self.text = change(&self.text);
        for edit in self.fixes.iter_mut().flat_map(|fix| &mut fix.edits) {
            if let FixEdit::Write(_, text) | FixEdit::Pair(text) | FixEdit::Declare(text) = edit {
                *text = change(text);
            }
        }
    }

    /// The same help, with bounded texts. A fix is left out if its text would be cut, or is a form
    /// with a `…`.
    pub(super) fn bounded(mut self) -> Help {
        self.text = bounded(self.text);
        let is_whole = |edit: &FixEdit| {
            !edit.text().contains('…') && bounded(edit.text().to_owned()) == edit.text()
        };
        self.fixes.retain(|fix| fix.edits.iter().all(is_whole));
        self
    }
}

impl fmt::Display for Help {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl From<String> for Help {
    fn from(text: String) -> Help {
        Help { text, fixes: Vec::new() }
    }
}

impl From<&str> for Help {
    fn from(text: &str) -> Help {
        text.to_owned().into()
    }
}

/// A help with texts to write, which replace the `{}` of its words.
pub fn advise<F: Into<Fix>, const N: usize>(words: &str, fixes: [F; N]) -> Help {
    let fixes: Vec<Fix> = fixes.map(Into::into).into();
    let mut pieces = words.split("{}");
    let mut text = pieces.next().unwrap_or_default().to_owned();
    for (fix, piece) in fixes.iter().zip(pieces) {
        text.push_str(fix.edits.last().map_or("", FixEdit::text));
        text.push_str(piece);
    }
    Help { text, fixes }
}

/// A help with a list of names, each of which can be written.
pub fn one_of<T: Into<String>>(words: &str, names: impl IntoIterator<Item = T>) -> Help {
    let names: Vec<String> = names.into_iter().map(Into::into).collect();
    let help = Help::from(format!("{words} `{}`", names.join("`, `")));
    let spelling = |name: String| Fix { applicability: Applicability::Spelling, ..name.into() };
    help.with_all(names.into_iter().map(spelling))
}

/// ``give it one: `key = …` ``
pub fn give_one(key: &str, example: &str) -> Help {
    advise("give it one: `{}`", [pair(format!("{key} = {example}")).possible()])
}

/// The help for a contact in the place of an instruction.
pub(crate) fn moved_to_when(contact: &str) -> Help {
    let element = FixEdit::Element { key: "when", element: format!("\"{contact}\"") };
    Help::from(format!("a contact stands in `when`, not here: `when = [\"{contact}\"]`"))
        .with(Fix::from(FixEdit::Delete).possible().and(element))
}

/// The help for an instruction in the place of a contact.
pub(crate) fn moved_to_do(instruction: &str) -> Help {
    let element = FixEdit::Element { key: "do", element: format!("\"{instruction}\"") };
    Help::from(format!("an instruction stands in `do`, not here: `do = [\"{instruction}\"]`"))
        .with(Fix::from(FixEdit::Delete).possible().and(element))
}

/// ``write `…` ``
pub fn write(fix: impl Into<Fix>) -> Help {
    advise("write `{}`", [fix])
}

/// ``write `…` ``, for the author to decide.
pub fn propose(fix: impl Into<Fix>) -> Help {
    write(proposed(fix))
}

/// ``did you mean `…`?``
pub fn meant(name: impl Into<String>) -> Help {
    let name: String = name.into();
    let fix = Fix { applicability: Applicability::Spelling, ..name.into() };
    advise("did you mean `{}`?", [fix])
}

/// The help for a mnemonic of another controller, as the table of dialects has it.
pub(crate) fn dialect(words: &'static str) -> Help {
    match words.strip_prefix("write `").and_then(|rest| rest.split_once('`')) {
        Some((right, rest)) => propose(right).and(rest),
        None => words.into(),
    }
}
