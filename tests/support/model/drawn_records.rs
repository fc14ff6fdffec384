//! Random records, their tags, arrays of structures, and COPY of a record.

use super::case::Tag;
use super::generate::word_details;
use super::pool::{DrawnArray, Owned, Pool, STRUCTURES};

/// A tag of a record with fields that COPY copies.
#[derive(Clone, Copy)]
pub struct DrawnRecord {
    tag: &'static str,
    kind: &'static str,
    /// The number of records; `None` without a `count`.
    count: Option<usize>,
}

/// A field that a record may have: its name, its type, the area of the same kind.
type Field = (&'static str, &'static str, &'static str);

const FIELDS: [Field; 9] = [
    ("kind", "int", "D"),
    ("next", "int", "D"),
    ("target", "real", "R"),
    ("on", "bit", "C"),
    ("mask", "word", "V"),
    ("ready", "bit", "C"),
    ("over", "timer", "T"),
    ("made", "counter", "CT"),
    ("sent", "sensaphone", "N"),
];

/// The tags that may be of a record.
const TAGS: [DrawnRecord; 5] = [
    DrawnRecord { tag: "recipe", kind: "Step", count: Some(3) },
    DrawnRecord { tag: "shown", kind: "Step", count: Some(2) },
    DrawnRecord { tag: "step", kind: "Step", count: None },
    DrawnRecord { tag: "lanes", kind: "Lane", count: Some(2) },
    DrawnRecord { tag: "lane", kind: "Lane", count: None },
];

/// The tags that may be arrays of structures.
const ARRAYS: [(&str, Field); 3] = [
    ("t_waits", ("", "timer", "T")),
    ("t_parts", ("", "counter", "CT")),
    ("t_sent", ("", "sensaphone", "N")),
];

/// What is drawn for a field of a record.
struct Drawn {
    field: Field,
    body: String,
    limits: Option<(i64, i64)>,
}

fn is_structure(area: &str) -> bool {
    STRUCTURES.iter().any(|(name, _, _)| *name == area)
}

fn members(area: &str) -> &'static [&'static str] {
    STRUCTURES.iter().find(|(name, _, _)| *name == area).map_or(&[], |(_, _, members)| members)
}

/// Adds the tags of records and the arrays of structures. The declarations of the records, as TOML.
pub fn add(pool: &mut Pool, tags: &mut Vec<Tag>) -> Vec<String> {
    for (name, (field, kind, area)) in ARRAYS {
        if pool.rng.chance(15) {
            let array = DrawnArray { name, field, area, count: 2, placed: true };
            let watched = watched_of(pool, &array);
            tags.push(Tag {
                name: name.to_string(),
                body: format!("type = \"{kind}\", count = 2"),
                watched,
            });
        }
    }
    let mut texts = Vec::new();
    for kind in ["Step", "Lane"] {
        if !pool.rng.chance(50) {
            continue;
        }
        let drawn = fields(pool);
        let bodies = drawn.iter().map(|drawn| format!("{} = {{ {} }}", drawn.field.0, drawn.body));
        let bodies: Vec<String> = bodies.collect();
        let text = match pool.rng.chance(50) {
            true => format!("fields = {{ {} }}", bodies.join(", ")),
            false => format!("[record.fields]\n{}", bodies.join("\n")),
        };
        texts.push(format!("\n[[record]]\nname = \"{kind}\"\n{text}\n"));
        for record in TAGS.into_iter().filter(|record| record.kind == kind) {
            if pool.rng.chance(70) {
                tags.push(tag(pool, record, &drawn));
            }
        }
    }
    texts
}

fn fields(pool: &mut Pool) -> Vec<Drawn> {
    let mut fields = FIELDS.to_vec();
    pool.rng.shuffle(&mut fields);
    fields.truncate(1 + pool.rng.below(6));
    let drawn = fields.into_iter().map(|field| {
        let (name, kind, area) = field;
        let key = format!("{area}.{name}");
        let details = match area {
            "C" if pool.rng.chance(30) => ", initial = true".to_string(),
            "D" | "V" | "R" => word_details(pool, &key),
            _ => String::new(),
        };
        let limits = pool.limits.remove(&key);
        Drawn { field, body: format!("type = \"{kind}\"{details}"), limits }
    });
    drawn.collect()
}

/// Draws a tag of a record, and enters its fields.
fn tag(pool: &mut Pool, record: DrawnRecord, drawn: &[Drawn]) -> Tag {
    let mut watched = Vec::new();
    for Drawn { field: (field, _, area), limits, .. } in drawn {
        let (name, placed) = (record.tag, true);
        let count = record.count.unwrap_or(0);
        let array = DrawnArray { name, field, area, count, placed };
        watched.extend(watched_of(pool, &array));
        for place in places(&array) {
            if let Some(limits) = limits {
                pool.limits.insert(place, *limits);
            }
        }
    }
    if drawn.iter().any(|drawn| !is_structure(drawn.field.2)) {
        pool.records.push(record);
    }
    let count = record.count.map(|count| format!(", count = {count}")).unwrap_or_default();
    let initial = initial(pool, record, drawn);
    let body = format!("type = \"{}\"{count}{initial}", record.kind);
    Tag { name: record.tag.to_string(), body, watched }
}

/// The elements of an array; with no elements, the field of a record's only tag.
fn places(array: &DrawnArray) -> Vec<String> {
    match array.count {
        0 => vec![array.whole()],
        count => (0..count).map(|at| array.at(&at.to_string())).collect(),
    }
}

/// Enters a field of a tag, or an array of structures. The operands to watch.
fn watched_of(pool: &mut Pool, array: &DrawnArray) -> Vec<String> {
    let places = places(array);
    if is_structure(array.area) {
        let member = |place: &String| {
            let place = place.clone();
            members(array.area).iter().map(move |member| format!("{place}.{member}"))
        };
        let watched = places.iter().flat_map(member).collect();
        pool.structures.push(*array);
        return watched;
    }
    pool.typed.extend(places.iter().map(|place| (place.clone(), array.area)));
    if array.count > 0 {
        pool.arrays.push(*array);
    }
    places
}

/// Sometimes the initial values of a tag of a record.
fn initial(pool: &mut Pool, record: DrawnRecord, drawn: &[Drawn]) -> String {
    if !pool.rng.chance(50) {
        return String::new();
    }
    let mut one = || {
        let mut values = Vec::new();
        for Drawn { field: (field, _, area), limits, .. } in drawn {
            if is_structure(area) || pool.rng.chance(40) {
                continue;
            }
            let (low, high) = limits.unwrap_or((0, 3));
            let value = match *area {
                "C" => pool.rng.chance(60).to_string(),
                _ => {
                    let high = high.min(low.saturating_add(9).max(9));
                    let low = low.max(high - 9).max(high.min(0));
                    pool.rng.range(low, high).to_string()
                }
            };
            values.push(format!("{field} = {value}"));
        }
        format!("{{ {} }}", values.join(", "))
    };
    match record.count {
        None => format!(", initial = {}", one()),
        Some(count) => {
            let list: Vec<String> = (0..count).map(|_| one()).collect();
            format!(", initial = [{}]", list.join(", "))
        }
    }
}

impl Owned {
    pub fn accumulator(&self) -> String {
        format!("{}.{}", self.name, members(self.area)[0])
    }
}

impl Pool {
    /// The structures of the area in records and in arrays.
    pub fn structure_names(&self, area: &str) -> Vec<String> {
        self.structures.iter().filter(|array| array.area == area).flat_map(places).collect()
    }

    fn moving_structure(&mut self) -> Option<DrawnArray> {
        let arrays = self.structures.iter().filter(|array| array.count > 0).copied();
        let arrays: Vec<DrawnArray> = arrays.collect();
        (!arrays.is_empty()).then(|| *self.rng.pick(&arrays))
    }

    fn member(&mut self, area: &str, flags: bool) -> &'static str {
        let words = if area == "N" { 2 } else { 1 };
        let (words, bits) = members(area).split_at(words);
        let fit: &[&'static str] = if flags { bits } else { words };
        fit[self.rng.below(fit.len())]
    }

    /// A flag or a word of the structure that a word selects, to read.
    pub fn moving_member(&mut self, flags: bool) -> Option<String> {
        let array = self.moving_structure()?;
        let index = self.moving_index();
        Some(format!("{}.{}", array.at(&index), self.member(array.area, flags)))
    }

    /// A member in MATH of the structure that an expression selects.
    pub fn math_member(&mut self, index: impl Fn(&mut Pool) -> String) -> Option<String> {
        let array = self.moving_structure()?;
        let index = self.math_index(array.count, index);
        let flags = self.rng.chance(50);
        Some(format!("{}.{}", array.at(&index), self.member(array.area, flags)))
    }

    /// A COPY of one record to another of the same type, or to itself.
    pub fn record_copy(&mut self) -> Option<String> {
        let records = self.records.clone();
        let from = if records.is_empty() { return None } else { *self.rng.pick(&records) };
        let same = records.into_iter().filter(|to| to.kind == from.kind);
        let to = *self.rng.pick(&same.collect::<Vec<_>>());
        Some(format!("COPY {} to={}", self.one_record(from), self.one_record(to)))
    }

    fn one_record(&mut self, record: DrawnRecord) -> String {
        match record.count {
            None => record.tag.to_string(),
            Some(count) if self.rng.chance(35) => {
                format!("{}[{}]", record.tag, self.rng.below(count))
            }
            Some(_) => format!("{}[{}]", record.tag, self.moving_index()),
        }
    }
}
