//! Records: the tags of a record's fields, and COPY of a record. Called by the reader of ladders
//! and of instructions. Names alone tell a field from an address: `step.kind` is a place,
//! `recipe.kind` an array.

use super::exec::Sim;
use super::names::Names;
use super::parse;
use super::place::{Loc, Member};
use super::program::{Array, Program, Value};
use super::tree::{Table, Tree};

/// The bits and words of one record.
#[derive(Clone, Debug)]
pub struct RecordAt {
    /// One array for each field: with one element for a tag without a `count`.
    columns: Vec<Array>,
    /// The word that selects the record; `None`: the first.
    index: Option<Loc>,
}

impl RecordAt {
    /// The places of the fields; `None` for an index outside.
    fn places(&self, sim: &Sim) -> Option<Vec<Loc>> {
        let index = self.index.map_or(0, |word| sim.memory.get(word));
        self.columns.iter().map(|column| column.element(index)).collect()
    }
}

impl Sim<'_> {
    /// Copies a record. An index outside of either array: nothing is read or written.
    pub fn copy_record(&mut self, from: &RecordAt, to: &RecordAt) {
        let (Some(from), Some(to)) = (from.places(self), to.places(self)) else {
            return self.wrong_index();
        };
        let values: Vec<_> = from.into_iter().map(|loc| self.at(loc)).collect();
        to.into_iter().zip(values).for_each(|(loc, value)| self.store_at(loc, value));
    }
}

impl Names {
    /// One record, such as `step`, `recipe[2]` or `recipe[i]`; `None` for all else.
    pub fn record(&self, word: &str) -> Option<RecordAt> {
        let (name, index) = match word.split_once('[') {
            None => (word, None),
            Some((name, index)) => (name, Some(index.strip_suffix(']')?)),
        };
        let columns = self.records.get(name)?.clone();
        Some(match index.map(|index| self.value(index)) {
            None => RecordAt { columns, index: None },
            Some(Ok(Value::At(word))) => RecordAt { columns, index: Some(word) },
            Some(Ok(Value::Const(at))) => {
                let only = |column: &Array| Some(Array { first: column.element(at)?, count: 1 });
                RecordAt { columns: columns.iter().map(only).collect::<Option<_>>()?, index: None }
            }
            Some(_) => return None,
        })
    }
}

/// The fields of the record of this name in the file.
pub fn fields<'a>(file: &'a Table, record: &str) -> Result<Option<&'a Table>, String> {
    for table in parse::tables(file, "record")? {
        if parse::string(table, "name")? == record {
            return Ok(table.get("fields").and_then(Tree::as_table));
        }
    }
    Ok(None)
}

/// Enters a tag of a record: one tag a field.
pub fn enter(
    name: &str,
    tag: &Table,
    fields: &Table,
    names: &mut Names,
    program: &mut Program,
) -> Result<(), String> {
    let mut columns = Vec::new();
    for (field, source) in fields {
        let whole = format!("{name}.{field}");
        let source = source.as_table().ok_or_else(|| format!("`{field}` is no table"))?;
        parse::tag(&whole, &field_tag(field, source, tag)?, names, program)?;
        let column = match names.arrays.get(&whole) {
            Some(array) => *array,
            None => Array { first: names.place(&whole)?, count: 1 },
        };
        if column.first.member == Member::Whole && !column.first.area.is_structure() {
            columns.push(column);
        }
    }
    names.records.insert(name.to_string(), columns);
    Ok(())
}

/// The tag that a field of a record's tag is: the tag's `count`, and `initial` over the field's.
fn field_tag(field: &str, source: &Table, tag: &Table) -> Result<Table, String> {
    let mut own = source.clone();
    let of_record = |record: Option<&Tree>| record.and_then(Tree::as_table)?.get(field).cloned();
    let Some(count) = tag.get("count") else {
        own.extend(of_record(tag.get("initial")).map(|value| ("initial".to_string(), value)));
        return Ok(own);
    };
    own.insert("count".to_string(), count.clone());
    if let Some(list) = tag.get("initial").and_then(Tree::as_list) {
        let Tree::Number(count) = count else { return Err("`count` is no number".to_string()) };
        let default = source.get("initial").cloned().unwrap_or(Tree::Number(0));
        let value = |at| of_record(list.get(at)).unwrap_or_else(|| default.clone());
        let values = (0..*count as usize).map(value).collect();
        own.insert("initial".to_string(), Tree::List(values));
    }
    Ok(own)
}
