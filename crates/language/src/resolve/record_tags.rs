//! Makes the tags of records: a tag whose type is a record becomes one tag for each field.
//!
//! The records are read before templates, whose parameters may have their types. Tags become fields
//! before any name is declared, once the uses of templates are expanded. So places, limits,
//! retention, reloads, forces and recordings need no code for records: they know the fields by name
//! (`step.target`, `recipe[3].target`). A mistake of a record is found here, once.

use super::Resolver;
use super::names::{NAME_MAX, NameRole, forbidden, kept};
use super::places::{TYPES, space_of};
use super::template::is_type_name;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, Help, pair, possible, write};
use crate::source::ladder::{FieldOfTag, Ladder, WrittenRecord, WrittenTag};
use crate::source::nearest::did_you_mean;
use crate::source::reader::{Constant, Text};
use crate::source::record::Records;
use crate::source::span::{FileId, Located, Span};

/// The values of one record, by the names of its fields.
type RecordValues = Vec<(Text, Located<Constant>)>;

/// Maximum number of tags that all records together become: as many as all arrays have elements.
const FIELDS_MAX: usize = 1_000_000;

impl Resolver<'_> {
    /// Collects the records of all ladders, and reports their mistakes.
    pub(super) fn read_records<E>(&mut self, ladders: &[(FileId, Ladder<E>)]) {
        for record in ladders.iter().flat_map(|(_, ladder)| &ladder.records) {
            let Some(name) = &record.name else { continue };
            self.check_record(record, name);
            if !self.records.contains_key(&name.text) {
                let mut record = record.clone();
                // Its mistake is reported there: nothing that names the field causes another one.
                let unreadable =
                    record.fields.iter_mut().filter(|field| !is_type(field.kind.as_ref()));
                unreadable.for_each(|field| field.kind = None);
                self.records.insert(name.text.clone(), record);
            }
        }
    }

    fn check_record(&mut self, record: &WrittenRecord, name: &Text) {
        if is_type_name(&name.text) {
            let message = format!("`{}` is a type already", kept(&name.text));
            let finding = Finding::new(Code::ForbiddenName, name.span, message);
            let finding = finding.help("tags and parameters have this type: take another name");
            self.find(finding.fix(possible(format!("{}_record", name.text))));
        }
        if record.fields.is_empty() {
            let message = format!("record `{}` has no fields", kept(&name.text));
            let finding = Finding::new(Code::TagKey, record.span, message);
            self.find(finding.help("declare them in its table `fields`"));
        }
        for field in &record.fields {
            self.findings.extend(forbidden(&field.name, NameRole::Field));
            let Some(kind) = field.kind.as_ref().filter(|kind| !is_type(Some(kind))) else {
                continue;
            };
            let names = TYPES.map(|(name, _)| name);
            let message = format!("a field has no type `{}`", kept(&kind.text));
            let all = || Help::from(format!("the types are {}", names.join(", ")));
            let help = did_you_mean(&kind.text, names).unwrap_or_else(all);
            self.find(Finding::new(Code::TagKey, kind.span, message).help(help));
        }
    }

    /// Replaces each tag whose type is a record by a tag for each field.
    pub(super) fn expand_records(&mut self, ladders: &mut [(FileId, Ladder)]) {
        if self.records.is_empty() {
            return;
        }
        let records = std::mem::take(&mut self.records);
        for (_, ladder) in ladders.iter_mut() {
            let is_record = |tag: &WrittenTag| record_of(tag, &records).is_some();
            if !ladder.tags.iter().any(is_record) {
                continue;
            }
            let mut tags = Vec::with_capacity(ladder.tags.len());
            for tag in std::mem::take(&mut ladder.tags) {
                match record_of(&tag, &records) {
                    Some(record) => self.fields_of(tag, record, &mut tags),
                    None => tags.push(tag),
                }
            }
            ladder.tags = tags;
        }
        self.records = records;
    }

    /// Adds the tags of the fields of a tag of records.
    fn fields_of(&mut self, tag: WrittenTag, record: &WrittenRecord, into: &mut Vec<WrittenTag>) {
        self.misfits_of_record(&tag, record);
        let Some(values) = self.initial_values(&tag, record) else {
            return into.push(WrittenTag { kind: None, count: None, ..tag });
        };
        let count = tag.count.as_ref().map_or(1, |count| count.value.max(1) as usize);
        self.field_tags = self.field_tags.saturating_add(record.fields.len().saturating_mul(count));
        if record.fields.is_empty() || self.field_tags > FIELDS_MAX {
            self.no_room_for_fields(&tag);
            return into.push(WrittenTag { kind: None, count: None, ..tag });
        }
        for field in &record.fields {
            let name = format!("{}.{}", tag.name.text, field.name.text);
            if name.len() > NAME_MAX && tag.name.text.len() <= NAME_MAX {
                let message = format!("the name `{}` has {} characters", kept(&name), name.len());
                let finding = Finding::new(Code::ForbiddenName, tag.name.span, message);
                self.find(finding.help(format!("a name has at most {NAME_MAX}")));
            }
            let is_field = |(name, _): &&(Text, Located<Constant>)| name.text == field.name.text;
            let value =
                |values: &RecordValues| values.iter().find(is_field).map(|(_, value)| *value);
            let given: Vec<Option<Located<Constant>>> = values.iter().map(value).collect();
            let (initial, initials) = match &tag.count {
                Some(_) => (field.initial, given),
                None => {
                    let own = given.into_iter().next().flatten();
                    (own.or(field.initial), Vec::new())
                }
            };
            let ack = field.ack.as_ref().map(|ack| ack_of_field(ack, &tag.name.text, record));
            let span = tag.kind.as_ref().map_or(tag.name.span, |kind| kind.span);
            let kind = field.kind.as_ref().map(|kind| Text { span, ..kind.clone() });
            into.push(WrittenTag {
                name: Text { text: name, ..tag.name.clone() },
                kind,
                count: tag.count,
                doc: field.doc.clone().or_else(|| tag.doc.clone()),
                initial,
                spare: tag.spare,
                ack,
                field: Some(Box::new(FieldOfTag {
                    tag: tag.name.clone(),
                    doc: tag.doc.clone(),
                    record: record.name.as_ref().map_or(String::new(), |name| name.text.clone()),
                    field: field.name.text.clone(),
                    initials,
                })),
                ..field.clone()
            });
        }
    }

    fn no_room_for_fields(&mut self, tag: &WrittenTag) {
        if self.field_tags <= FIELDS_MAX {
            return;
        }
        let message = format!("the fields of all records are more than {FIELDS_MAX} tags");
        let finding = Finding::new(Code::TagKey, tag.name.span, message);
        self.find(finding.help("take records away: all memory has fewer"));
    }

    /// Reports keys that a tag of records does not have.
    fn misfits_of_record(&mut self, tag: &WrittenTag, record: &WrittenRecord) {
        let constant = |value: &Option<Located<Constant>>| value.as_ref().map(|value| value.span);
        let text = |value: &Option<Text>| value.as_ref().map(|text| text.span);
        let list = tag.initials.as_ref().map(|list| list.span);
        let keys = [
            ("initial", constant(&tag.initial).or(list)),
            ("min", constant(&tag.min)),
            ("max", constant(&tag.max)),
            ("unit", text(&tag.unit)),
            ("texts", tag.texts.as_ref().map(|texts| texts.span)),
            ("alarm", text(&tag.alarm)),
            ("priority", text(&tag.priority)),
            ("delay", tag.delay.as_ref().map(|delay| delay.span)),
            ("off-delay", tag.off_delay.as_ref().map(|delay| delay.span)),
            ("group", text(&tag.group)),
            ("ack", text(&tag.ack)),
            ("log", text(&tag.log)),
            ("metric", tag.metric.as_ref().map(|metric| metric.span)),
        ];
        for (key, span) in keys {
            let Some(span) = span else { continue };
            let message = match key {
                "initial" => {
                    "the `initial` of a record is a table of its fields' values".to_owned()
                }
                _ => format!("`{key}` does not fit a record"),
            };
            let finding = Finding::new(Code::TagKey, span, message);
            let is_plain = |field: &&WrittenTag| !is_structure(field);
            let field = record.fields.iter().find(is_plain).filter(|_| key == "initial");
            self.find(match (field, &tag.count) {
                (Some(field), count) => {
                    let value = self.text(span).trim_matches(['[', ']']);
                    let value = format!("{{ {} = {value} }}", field.name.text);
                    let value = if count.is_some() { format!("[{value}]") } else { value };
                    finding.propose(pair(format!("initial = {value}")))
                }
                (None, _) => finding.help("write it in the field: `[record.fields]`").or_omit(),
            });
        }
    }

    /// The values that a tag gives for its fields, for each of its records; `None` after a
    /// finding about their form.
    fn initial_values(
        &mut self,
        tag: &WrittenTag,
        record: &WrittenRecord,
    ) -> Option<Vec<RecordValues>> {
        let Some(given) = &tag.records else { return Some(Vec::new()) };
        let count = tag.count.as_ref().map(|count| count.value);
        let (given, span) = (&given.value, given.span);
        let mistake = match count {
            None if given.is_list => Some((
                "a list of records does not fit a tag without `count`".to_owned(),
                Help::from("write one table, without brackets"),
            )),
            Some(_) if !given.is_list => Some((
                "`initial` of an array of records is a list of tables".to_owned(),
                write(pair(format!("initial = [{}]", self.text(span)))),
            )),
            Some(count) if given.values.len() as i64 > count => Some((
                format!("`initial` has {} records for {count}", given.values.len()),
                Help::from("a list with one table for each record, from the first on"),
            )),
            Some(_) | None => None,
        };
        if let Some((message, help)) = mistake {
            self.find(Finding::new(Code::TagKey, span, message).help(help));
            return Some(Vec::new());
        }
        for (name, value) in given.values.iter().flatten() {
            self.check_initial(record, name, value.span);
        }
        Some(given.values.clone())
    }

    /// Reports a value for a field that the record does not have, or that is a structure.
    fn check_initial(&mut self, record: &WrittenRecord, name: &Text, value: Span) {
        let own = record.name.as_ref().map_or("", |name| &name.text);
        let field = record.fields.iter().find(|field| field.name.text == name.text);
        let Some(field) = field else {
            let message = format!("record `{}` has no field `{}`", kept(own), kept(&name.text));
            let names = || record.fields.iter().map(|field| &*field.name.text);
            let all = || {
                let names = names().collect::<Vec<_>>().join("`, `");
                Help::from(format!("its fields are `{names}`"))
            };
            let help = did_you_mean(&name.text, names()).unwrap_or_else(all);
            return self.find(Finding::new(Code::UnknownMember, name.span, message).help(help));
        };
        if is_structure(field) {
            let kind = field.kind.as_ref().map_or("", |kind| &kind.text);
            let message = format!("`{}` is a {kind}: it has no `initial`", kept(&name.text));
            let finding = Finding::new(Code::TagKey, value, message);
            let finding = finding.help("bits and words have an initial value");
            self.find(finding.fix(possible(FixEdit::Omit)));
        }
    }
}

/// The record that is the type of a tag.
fn record_of<'r>(tag: &WrittenTag, records: &'r Records) -> Option<&'r WrittenRecord> {
    let has_place = tag.at.is_some() || tag.value.is_some();
    records.get(&tag.kind.as_ref()?.text).filter(|_| !has_place)
}

/// The bit that the `ack` of a field names: a field of the same record, else a name of the ladder.
fn ack_of_field(ack: &Text, tag: &str, record: &WrittenRecord) -> Text {
    match record.fields.iter().any(|field| field.name.text == ack.text) {
        true => Text { text: format!("{tag}.{}", ack.text), exact: false, ..ack.clone() },
        false => ack.clone(),
    }
}

fn is_structure(field: &WrittenTag) -> bool {
    let kind = field.kind.as_ref().map_or("", |kind| &kind.text);
    matches!(kind, "timer" | "counter" | "sensaphone")
}

fn is_type(kind: Option<&Text>) -> bool {
    kind.is_some_and(|kind| space_of(&kind.text).is_some())
}
