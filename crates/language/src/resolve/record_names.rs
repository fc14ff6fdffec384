//! Looks up the names of records: `step`, `recipe[2]`, and fields that a record does not have.
//!
//! Part of the scope. A field is a tag of its own; `index` looks up `recipe[2].target`.

use std::sync::OnceLock;

use super::mistake::{Mistake, mistake};
use super::record::{RecordField, RecordIndex, RecordPlace, RecordTag};
use super::scope::{LookUp, Scope};
use crate::source::finding::Code;
use crate::source::fix::{Help, advise, possible};
use crate::source::indexed::{INDEX, with_index};
use crate::source::nearest::did_you_mean;

impl Scope {
    /// Adds a tag of records; its fields follow as tags.
    pub(super) fn add_record(&mut self, record: RecordTag) {
        self.note_name(&record.name);
        self.known = OnceLock::new();
        self.record_names.entry(record.name.clone()).or_insert(self.records.len());
        self.records.push(record);
    }

    /// Adds a field to the last tag of records; `tag`: the index of its tag in the program.
    pub(super) fn add_field(&mut self, name: &str, tag: Option<usize>) {
        if let Some(record) = self.records.last_mut() {
            record.fields.push(RecordField { name: name.to_owned(), tag });
        }
    }

    /// The tags of records, in file order.
    pub fn records(&self) -> &[RecordTag] {
        &self.records
    }

    /// The tag of records with a name, and its index.
    pub(super) fn record(&self, name: &str) -> Option<(usize, &RecordTag)> {
        let index = *self.record_names.get(name)?;
        Some((index, &self.records[index]))
    }

    /// The tag of records to which a name of a field belongs, with or without an index.
    pub fn record_around(&self, name: &str) -> Option<&RecordTag> {
        let ends = name.match_indices(['.', '[']).map(|(end, _)| end);
        ends.filter_map(|end| Some(self.record(&name[..end])?.1)).next()
    }

    /// Looks up a name without an index that is that of a tag of records, or begins with it. `None`
    /// if no such tag is named.
    pub(super) fn named(&self, name: &str) -> Option<Result<LookUp, Mistake>> {
        if let Some((tag, record)) = self.record(name) {
            let at = if record.count.is_some() { RecordIndex::All } else { RecordIndex::Only };
            return Some(Ok(LookUp::of_record(RecordPlace { tag, at })));
        }
        let ends = name.match_indices('.').map(|(end, _)| end);
        let found = ends.filter_map(|end| Some((end, self.record(&name[..end])?.1))).next();
        let (end, record) = found?;
        let (base, behind) = (&name[..end], &name[end + 1..]);
        Some(Err(no_field(base, &record.record, &record.field_names(), behind)))
    }

    /// The mistake in a field of a record with an index: `recipe[2].traget`. `None` if the name
    /// before the index is not that of a tag of records.
    pub(super) fn no_field_of(&self, base: &str, index: &str, behind: &str) -> Option<Mistake> {
        let (_, record) = self.record(base)?;
        let base = with_index(base, index);
        let behind = behind.trim_start_matches('.');
        Some(no_field(&base, &record.record, &record.field_names(), behind))
    }

    /// The mistake in a field that no record of the tag `base` has, behind any index.
    pub(super) fn unknown_field(&self, base: &str, index: &str, behind: &str) -> Option<Mistake> {
        let (_, record) = self.record(base)?;
        let field = behind.trim_start_matches('.').split('.').next().unwrap_or_default();
        let has_field = record.fields.iter().any(|known| known.name == field);
        if has_field { None } else { self.no_field_of(base, index, behind) }
    }

    /// The mistake in the name of a field behind a moving index: `traget` of `recipe[].traget`. The
    /// help has the name of a field alone.
    pub(super) fn no_such_field(&self, column: &str) -> Option<Mistake> {
        let (base, behind) = column.split_once(INDEX)?;
        let (_, record) = self.record(base)?;
        record.count?;
        let field = behind.trim_start_matches('.');
        let fields = record.field_names();
        if field.is_empty() || fields.contains(&field.split('.').next().unwrap_or_default()) {
            return None;
        }
        let message = format!("record `{}` has no field `{field}`", record.record);
        let help = did_you_mean(field, fields.iter().copied());
        let help = help.unwrap_or_else(|| fields_of(&fields).into());
        Some(mistake(Code::UnknownMember, message, help))
    }

    /// Whether the name before an index is that of one record: `current` of `current[].on`.
    pub(super) fn is_one_record(&self, column: &str) -> bool {
        let base = column.split(INDEX).next().unwrap_or_default();
        self.record(base).is_some_and(|(_, record)| record.count.is_none())
    }

    /// Whether a name is that of a field of an array of records: `recipe.target`.
    pub fn is_column(&self, name: &str) -> bool {
        if self.records().is_empty() {
            return false;
        }
        let tag = name.rsplit_once('.').and_then(|(tag, _)| self.record(tag));
        tag.is_some_and(|(_, record)| record.count.is_some())
    }

    /// The names of the fields of a record, or of all of an array, record by record.
    pub fn fields(&self, place: RecordPlace) -> impl Iterator<Item = String> + '_ {
        self.records()[place.tag].names(place.number())
    }

    /// The name of a field of a record, for a help.
    pub(super) fn field(&self, name: &str, place: RecordPlace) -> String {
        let record = &self.records()[place.tag];
        let field = record.fields.first().map_or("", |field| &field.name);
        match place.at {
            RecordIndex::All => format!("{name}[0].{field}"),
            RecordIndex::Only | RecordIndex::Constant(_) | RecordIndex::Word(_) => {
                format!("{name}.{field}")
            }
        }
    }

    /// The help for an array of records in the place of bits or words.
    pub(super) fn name_a_column(&self, name: &str, place: RecordPlace) -> Help {
        let fields = self.records()[place.tag].field_names();
        let columns = fields.iter().map(|field| possible(format!("{name}.{field}")));
        let first = fields.first().copied().unwrap_or_default();
        let words = format!(
            "name a field of all records: `{name}.{first}`, or of one: `{name}[0].{first}`; {}",
            fields_of(&fields)
        );
        Help::from(words).with_all(columns.chain([possible(format!("{name}[0].{first}"))]))
    }

    /// The help for a whole record in the place of a bit, word or structure.
    pub(super) fn name_a_field(&self, name: &str, place: RecordPlace) -> Help {
        let record = &self.records()[place.tag];
        let all = record.fields.iter().map(|field| match place.at {
            RecordIndex::All => format!("{name}[0].{}", field.name),
            RecordIndex::Only | RecordIndex::Constant(_) | RecordIndex::Word(_) => {
                format!("{name}.{}", field.name)
            }
        });
        let help = Help::from(format!("name a field: `{}`", self.field(name, place)));
        let help = help.with_all(all.map(possible));
        match record.fields.len() {
            0 | 1 => help,
            _ => help.and(&format!("; {}", fields_of(&record.field_names()))),
        }
    }
}

/// The mistake in a field of a record; `fields`: those that the record has; `field`: the name
/// behind that of the record, `base`.
pub(super) fn no_field(base: &str, record: &str, fields: &[&str], field: &str) -> Mistake {
    let (own, rest) = field.split_once('.').map_or((field, ""), |(own, rest)| (own, rest));
    if fields.contains(&own) {
        // A mistake in the field has a finding of its own; a member is one of a structure's.
        let message = format!("`{base}.{own}` has no members");
        return match rest {
            "" => Mistake::Reported,
            _ => mistake(Code::UnknownMember, message, possible_name(base, own)),
        };
    }
    let message = format!("record `{record}` has no field `{own}`");
    let all: Vec<String> = fields.iter().map(|name| format!("{base}.{name}")).collect();
    let help = did_you_mean(&format!("{base}.{own}"), all.iter().map(String::as_str));
    mistake(Code::UnknownMember, message, help.unwrap_or_else(|| fields_of(fields).into()))
}

fn possible_name(base: &str, own: &str) -> Help {
    advise("write `{}`", [possible(format!("{base}.{own}"))])
}

/// The fields of a record, in words.
fn fields_of(names: &[&str]) -> String {
    format!("its fields are `{}`", names.join("`, `"))
}
