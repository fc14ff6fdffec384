//! Tags as written.
//!
//! Called by the readers of ladders and templates. The resolver determines the meaning of a tag.

use std::ops::RangeInclusive;

use super::fix::{Help, pair, write};
use super::key::{Key, key};
use super::reader::{Constant, NamedTable, Table, Text};
use super::span::{FileId, Located};

/// A text of a value, as written.
#[derive(Clone, Debug)]
pub struct WrittenText {
    /// The key: the value.
    pub value: Text,
    /// The text.
    pub text: Text,
}

impl WrittenText {
    /// Moves its places to the same places of a different file.
    pub(crate) fn move_to(&mut self, file: FileId) {
        (self.value.span.file, self.text.span.file) = (file, file);
    }
}

/// A tag.
#[derive(Clone, Debug, Default)]
pub struct WrittenTag {
    /// Its name.
    pub name: Text,
    /// `at`.
    pub at: Option<Text>,
    /// `count`, of an array.
    pub count: Option<Located<i64>>,
    /// `type`.
    pub kind: Option<Text>,
    /// `value`.
    pub value: Option<Located<Constant>>,
    /// `doc`.
    pub doc: Option<String>,
    /// `initial`, one value.
    pub initial: Option<Located<Constant>>,
    /// `initial`, a list.
    pub initials: Option<Located<Vec<Located<Constant>>>>,
    /// `min`.
    pub min: Option<Located<Constant>>,
    /// `max`.
    pub max: Option<Located<Constant>>,
    /// `alarm`.
    pub alarm: Option<Text>,
    /// `priority`, of an alarm.
    pub priority: Option<Text>,
    /// `log`.
    pub log: Option<Text>,
    /// `unit`.
    pub unit: Option<Text>,
    /// `texts`, in file order.
    pub texts: Option<Located<Vec<WrittenText>>>,
    /// `metric`.
    pub metric: Option<Located<bool>>,
    /// `spare`.
    pub spare: Option<Located<bool>>,
    /// Whether the tag has `at`, `type` or `value`, even an unreadable one.
    pub has_meaning: bool,
}

impl WrittenTag {
    /// A tag whose mistake is reported at its declaration.
    fn unreadable(name: Text) -> WrittenTag {
        WrittenTag { name, has_meaning: true, ..WrittenTag::default() }
    }

    /// A tag with a `type` and nothing else.
    pub(crate) fn of_type(name: Text, kind: &str) -> WrittenTag {
        let kind = Some(Text { text: kind.to_owned(), ..name.clone() });
        WrittenTag { kind, ..WrittenTag::unreadable(name) }
    }
}

/// The name of a tag; its grammar is in `docs/language.md`.
const TAG_NAME: &str = r#"{"propertyNames":{"pattern":"^[A-Za-z][A-Za-z0-9_]*$"}}"#;
const TAG_TYPES: &str = r#"{"enum":["bit","int","word","real","timer","counter","sensaphone"]}"#;

const PRIORITIES: &str = r#"{"enum":["critical","high","medium","low"]}"#;

const UNIT: &str = r#"{"minLength":1,"maxLength":16,"pattern":"^[^\\x00-\\x1f\\x7f-\\x9f]*$"}"#;

const TEXTS: &str = r#"{"minProperties":1,"propertyNames":{"pattern":"^(0|-?[1-9][0-9]*)$"}}"#;
const TEXT: &str = r#"{"minLength":1,"maxLength":40,"pattern":"^[^\\x00-\\x1f\\x7f-\\x9f]*$"}"#;

/// The number of elements of an array.
const COUNT: RangeInclusive<i64> = 2..=4096;

/// Reads the tags of a table.
pub(super) fn read_all(root: &mut Table<'_>, tags: Key) -> Vec<WrittenTag> {
    let Some(mut tags) = root.table(tags.limited(TAG_NAME), "`[tags]`") else {
        return Vec::new();
    };
    let any =
        key("*", "A tag: a name for an address (`at`), memory (`type`) or a constant (`value`).");
    let help = |name: &str, value: &str| {
        if value.starts_with('[') {
            return above(name);
        }
        let key = if value.starts_with('"') { "at" } else { "value" };
        write(pair(format!("{name} = {{ {key} = {value} }}")))
    };
    let entries = tags.entries(any, "a tag", help);
    entries.into_iter().map(read_tag).collect()
}

fn read_tag(NamedTable { name, table }: NamedTable<'_>) -> WrittenTag {
    let Some(mut table) = table else { return WrittenTag::unreadable(name) };
    table.together(
        r#"{"oneOf":[{"required":["at"]},{"required":["type"]},{"required":["value"]}]}"#,
    );
    let at = table.string(key("at", "The address: `X0`, `D1`, `CT0`, `CT0.Acc`."));
    let count = table
        .integer(key("count", "The number of elements of an array that begins at `at`."), COUNT);
    let initial = key(
        "initial",
        "Its value after a cold start; 0 or OFF if not given. An array takes a list too, a value \
         for each element.",
    );
    let (initial, initials) = table.constants(initial);
    let mut tag = WrittenTag {
        name,
        at,
        count,
        kind: table.string(
            key(
                "type",
                "Its type; rungd gives the tag a place in memory, and the tag has no address.",
            )
            .limited(TAG_TYPES),
        ),
        value: table
            .constant(key("value", "A constant: a number, or a duration as `\"2s500ms\"`.")),
        doc: table.string(key("doc", "What it is.")).map(|doc| doc.text),
        unit: table.string(
            key("unit", "The unit of the word's value, shown behind it: `bar`, `°C`.")
                .limited(UNIT),
        ),
        texts: read_texts(&mut table),
        initial,
        initials,
        min: table.constant(key(
            "min",
            "A write from outside below this is refused; a write by the ladder is limited to it.",
        )),
        max: table.constant(key(
            "max",
            "A write from outside above this is refused; a write by the ladder is limited to it.",
        )),
        alarm: table.string(key("alarm", "A text: a warning in the log when the bit goes ON.")),
        priority: table.string(
            key("priority", "How soon a person has to act on the alarm; `medium` if not given.")
                .limited(PRIORITIES),
        ),
        log: table.string(key("log", "Each change is logged.").limited(r#"{"const":"change"}"#)),
        metric: table.boolean(key(
            "metric",
            "Its value is a metric of `rungd metrics`; for a structure, all its members.",
        )),
        spare: table.boolean(key("spare", "Unused on purpose: no warning.")),
        has_meaning: ["at", "type", "value"].iter().any(|key| table.has(key)),
    };
    // A key that is written wrong is probably the one that is missing.
    tag.has_meaning |= table.has_unknown();
    table.finish();
    tag
}

/// Reads the texts of a tag's values.
fn read_texts(tag: &mut Table<'_>) -> Option<Located<Vec<WrittenText>>> {
    let texts = key("texts", "What its values mean, shown beside them: `{ 0 = \"idle\" }`.");
    let mut table = tag.table(texts.limited(TEXTS), "`texts`")?;
    let any = key("*", "The text of this value.").limited(TEXT);
    let entries = table.strings_by_name(any);
    if entries.is_empty() && !table.is_empty() {
        return None;
    }
    let texts = entries.into_iter().map(|(value, text)| WrittenText { value, text });
    Some(Located { value: texts.collect(), span: table.extent() })
}

/// The help for an array in a table of names: it belongs to the table above.
pub(super) fn above(name: &str) -> Help {
    format!("write `{name} = [ … ]` above the header of this table: here it would be a name").into()
}
