//! Tags as written.
//!
//! Called by the readers of ladders and templates. The resolver determines the meaning of a tag.

use std::ops::RangeInclusive;

use super::fix::{Help, pair, write};
use super::key::{Key, key};
use super::reader::{Constant, InitialRecords, NamedTable, Table, Text, WrittenInitial};
use super::slot::{DeclaredKind, KeySlot, Slot};
use super::span::{FileId, Located};
use super::value_kind::Millis;

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
    /// `initial` of a record: a table, or a list of tables.
    pub records: Option<Located<InitialRecords>>,
    /// `min`.
    pub min: Option<Located<Constant>>,
    /// `max`.
    pub max: Option<Located<Constant>>,
    /// `alarm`.
    pub alarm: Option<Text>,
    /// `priority`, of an alarm.
    pub priority: Option<Text>,
    /// `delay` of an alarm, in ms.
    pub delay: Option<Located<u32>>,
    /// `off-delay` of an alarm, in ms.
    pub off_delay: Option<Located<u32>>,
    /// `group` of an alarm.
    pub group: Option<Text>,
    /// `ack` of an alarm: the name of a bit.
    pub ack: Option<Text>,
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
    /// Its record, if it stands for a field of a tag whose type is a record.
    pub field: Option<Box<FieldOfTag>>,
}

/// The tag of records that a field belongs to.
#[derive(Clone, Debug)]
pub struct FieldOfTag {
    /// The name of the tag.
    pub tag: Text,
    /// `doc` of the tag.
    pub doc: Option<String>,
    /// The name of the record.
    pub record: String,
    /// The name of the field.
    pub field: String,
    /// For each element of an array, the value that the tag gives, from element 0 on.
    pub initials: Vec<Option<Located<Constant>>>,
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

    /// A tag with its whole name and its places in a layer.
    pub(crate) fn moved(mut self, name: String, layer: FileId) -> WrittenTag {
        let tag = &mut self;
        tag.name.text = name;
        tag.name.span.file = layer;
        let texts = [&mut tag.at, &mut tag.kind, &mut tag.alarm, &mut tag.priority, &mut tag.log];
        let others = [&mut tag.unit, &mut tag.group, &mut tag.ack];
        for text in texts.into_iter().chain(others).flatten() {
            text.span.file = layer;
        }
        let constants = [&mut tag.value, &mut tag.initial, &mut tag.min, &mut tag.max];
        for constant in constants.into_iter().flatten() {
            constant.span.file = layer;
        }
        for Located { span, .. } in [&mut tag.metric, &mut tag.spare].into_iter().flatten() {
            span.file = layer;
        }
        for Located { span, .. } in [&mut tag.delay, &mut tag.off_delay].into_iter().flatten() {
            span.file = layer;
        }
        if let Some(texts) = &mut tag.texts {
            texts.span.file = layer;
            texts.value.iter_mut().for_each(|text| text.move_to(layer));
        }
        if let Some(records) = &mut tag.records {
            records.span.file = layer;
            let all = records.value.values.iter_mut().flatten();
            all.for_each(|(name, value)| (name.span.file, value.span.file) = (layer, layer));
        }
        self
    }
}

/// The types of tags, but for records.
pub(crate) const TYPE_NAMES: [&str; 7] =
    ["bit", "int", "word", "real", "timer", "counter", "sensaphone"];

/// The name of a tag; its grammar is in `docs/language.md`.
const TAG_NAME: &str = r#"{"propertyNames":{"pattern":"^[A-Za-z][A-Za-z0-9_]*$"}}"#;
/// The types of tags; a record's name is a type too.
const TAG_TYPES: &str = r#"{"anyOf":[{"enum":["bit","int","word","real","timer","counter",
    "sensaphone"]},{"pattern":"^[A-Za-z][A-Za-z0-9_]*$"}]}"#;

/// The types of an observer's tags.
const OBSERVER_TYPES: &str = r#"{"anyOf":[{"enum":["bit","int","word","real","timer","counter"]},
    {"pattern":"^[A-Za-z][A-Za-z0-9_]*$","not":{"const":"sensaphone"}}]}"#;

/// The tags of a table, by what has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TagTypes {
    /// Those of a ladder.
    Ladder,
    /// Those of a template: each use has its own.
    Template,
    /// Those of an observer, which has no Sensaphone counters.
    Observer,
}

impl TagTypes {
    fn schema(self) -> &'static str {
        match self {
            TagTypes::Ladder | TagTypes::Template => TAG_TYPES,
            TagTypes::Observer => OBSERVER_TYPES,
        }
    }

    /// The kind of declaration that each of them is.
    fn declared(self) -> DeclaredKind {
        match self {
            TagTypes::Ladder | TagTypes::Observer => DeclaredKind::Tag,
            TagTypes::Template => DeclaredKind::OwnTag,
        }
    }

    /// What their texts stand for.
    fn text(self) -> Slot {
        match self {
            TagTypes::Ladder | TagTypes::Observer => Slot::Other,
            TagTypes::Template => Slot::Placeholders,
        }
    }
}

const FIELD_TYPES: &str = r#"{"enum":["bit","int","word","real","timer","counter","sensaphone"]}"#;

const PRIORITIES: &str = r#"{"enum":["critical","high","medium","low"]}"#;

const UNIT: &str = r#"{"minLength":1,"maxLength":16,"pattern":"^[^\\x00-\\x1f\\x7f-\\x9f]*$"}"#;

const TEXTS: &str = r#"{"minProperties":1,"propertyNames":{"pattern":"^(0|-?[1-9][0-9]*)$"}}"#;
const TEXT: &str = r#"{"minLength":1,"maxLength":40,"pattern":"^[^\\x00-\\x1f\\x7f-\\x9f]*$"}"#;

/// The number of elements of an array; of bits and words at least [`COUNT_MIN`].
const COUNT: RangeInclusive<i64> = 1..=4096;

/// The least number of elements of an array of bits or words.
pub(crate) const COUNT_MIN: i64 = 2;

const DOC: Key = key("doc", "What it is.");
const UNIT_KEY: Key =
    key("unit", "The unit of the word's value, shown behind it: `bar`, `°C`.").limited(UNIT);
const MIN: Key = key(
    "min",
    "A write from outside below this is refused; a write by the ladder is limited to it.",
);
const MAX: Key = key(
    "max",
    "A write from outside above this is refused; a write by the ladder is limited to it.",
);
const ALARM: Key = key("alarm", "A text: a warning in the log when the bit goes ON.");
const PRIORITY: Key =
    key("priority", "How soon a person has to act on the alarm; `medium` if not given.")
        .limited(PRIORITIES);
const DELAY: Key =
    key("delay", "The alarm rises once its bit has been ON for this time; at once if not given.");
const OFF_DELAY: Key =
    key("off-delay", "The alarm goes away once its bit has been OFF for this time.");
const GROUP: Key = key("group", "The part of the machine that the alarm is of.").limited(TEXT);
const ACK: Key = key("ack", "The bit that an acknowledgement turns ON; the ladder turns it OFF.");
const LOG: Key = key("log", "Each change is logged.").limited(r#"{"const":"change"}"#);
const METRIC: Key =
    key("metric", "Its value is a metric of `rungd metrics`; for a structure, all its members.");

/// Reads the tags of a table.
pub(super) fn read_all(root: &mut Table<'_>, tags: Key, types: TagTypes) -> Vec<WrittenTag> {
    let Some(mut tags) = root.table(tags.limited(TAG_NAME), "`[tags]`") else {
        return Vec::new();
    };
    let any =
        key("*", "A tag: a name for an address (`at`), memory (`type`) or a constant (`value`).")
            .named(KeySlot::Declares(types.declared()));
    let help = |name: &str, value: &str| {
        if value.starts_with('[') {
            return above(name);
        }
        let key = if value.starts_with('"') { "at" } else { "value" };
        write(pair(format!("{name} = {{ {key} = {value} }}")))
    };
    let entries = tags.entries(any, "a tag", help);
    entries.into_iter().map(|entry| read_tag(entry, types)).collect()
}

fn read_tag(NamedTable { name, table }: NamedTable<'_>, types: TagTypes) -> WrittenTag {
    let Some(mut table) = table else { return WrittenTag::unreadable(name) };
    table.together(
        r#"{"oneOf":[{"required":["at"]},{"required":["type"]},{"required":["value"]}]}"#,
    );
    let at =
        table.string(key("at", "The address: `X0`, `D1`, `CT0`, `CT0.Acc`.").holds(Slot::Address));
    let count = table
        .integer(key("count", "The number of elements of an array that begins at `at`."), COUNT);
    let initial = key(
        "initial",
        "Its value after a cold start; 0 or OFF if not given. An array takes a list too, a value \
         for each element; a record a table of its fields' values.",
    )
    .holds(Slot::Initial);
    let WrittenInitial { one: initial, list: initials, records } = table.initial(initial);
    let mut tag = WrittenTag {
        name,
        at,
        count,
        kind: table.string(
            key(
                "type",
                "Its type; rungd gives the tag a place in memory, and the tag has no address.",
            )
            .limited(types.schema())
            .holds(Slot::Type),
        ),
        value: table
            .constant(key("value", "A constant: a number, or a duration as `\"2s500ms\"`.")),
        doc: table.string(DOC.holds(types.text())).map(|doc| doc.text),
        unit: table.string(UNIT_KEY),
        texts: read_texts(&mut table),
        initial,
        initials,
        records,
        min: table.constant(MIN),
        max: table.constant(MAX),
        alarm: table.string(ALARM.holds(types.text())),
        priority: table.string(PRIORITY),
        delay: table.value(DELAY, &Millis::ANY),
        off_delay: table.value(OFF_DELAY, &Millis::ANY),
        group: table.string(GROUP.holds(types.text())),
        ack: table.string(ACK.holds(Slot::Operand)),
        log: table.string(LOG),
        metric: table.boolean(METRIC),
        spare: table.boolean(key("spare", "Unused on purpose: no warning.")),
        has_meaning: ["at", "type", "value"].iter().any(|key| table.has(key)),
        field: None,
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

/// Reads the fields of a record.
pub(super) fn read_fields(record: &mut Table<'_>) -> Vec<WrittenTag> {
    let fields = key("fields", "Its fields: a name and a `type` each.").limited(TAG_NAME);
    let Some(mut fields) = record.table(fields, "`[record.fields]`") else { return Vec::new() };
    let any = key("*", "A field: each tag of the record has a bit, word or structure for it.")
        .named(KeySlot::Declares(DeclaredKind::Field));
    let help = |name: &str, value: &str| match value.as_bytes() {
        [b'[', ..] => above(name),
        _ => write(pair(format!("{name} = {{ type = \"int\" }}"))),
    };
    let entries = fields.entries(any, "a field", help);
    entries.into_iter().map(read_field).collect()
}

fn read_field(NamedTable { name, table }: NamedTable<'_>) -> WrittenTag {
    let Some(mut table) = table else { return WrittenTag::unreadable(name) };
    let kind = key("type", "Its type.").limited(FIELD_TYPES).holds(Slot::Type);
    let field = WrittenTag {
        name,
        kind: table.required_string(kind),
        doc: table.string(DOC).map(|doc| doc.text),
        unit: table.string(UNIT_KEY),
        texts: read_texts(&mut table),
        initial: table.constant(key(
            "initial",
            "Its value after a cold start; 0 or OFF if not given. A tag may give another.",
        )),
        min: table.constant(MIN),
        max: table.constant(MAX),
        alarm: table.string(ALARM),
        priority: table.string(PRIORITY),
        delay: table.value(DELAY, &Millis::ANY),
        off_delay: table.value(OFF_DELAY, &Millis::ANY),
        group: table.string(GROUP),
        ack: table.string(ACK),
        log: table.string(LOG),
        metric: table.boolean(METRIC),
        has_meaning: true,
        ..WrittenTag::default()
    };
    table.finish();
    field
}

/// The help for an array in a table of names: it belongs to the table above.
pub(super) fn above(name: &str) -> Help {
    format!("write `{name} = [ … ]` above the header of this table: here it would be a name").into()
}
