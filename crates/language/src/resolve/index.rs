//! Looks up names with an index or a slice: `recipe[3]`, `recipe[step]`, `recipe[0..6]`.
//!
//! Part of the scope. A constant index gives a plain address. A word as index gives an element
//! whose number is read at run time.

use super::array::{Array, ArrayElement};
use super::mistake::{Mistake, bit_of_block, bits_of_device, member_mistake, mistake};
use super::program::TagMeaning;
use super::record::{RecordIndex, RecordPlace};
use super::scope::{LookUp, NamedThing, Scope};
use crate::source::finding::Code;
use crate::source::fix::{Help, advise, possible, propose, proposed, write};
use crate::source::indexed::{INDEX, IndexedName, help_about_index, not_an_index, with_index};
use rungd_engine::isa::{Address, Space, address_text};

/// An index: a constant, or the name of a word.
enum ArrayIndex<'n> {
    Constant(u32, Option<&'n str>),
    Word(&'n str),
}

/// An array with the place of its index in names.
pub(super) struct ArrayColumn {
    /// Its name: `recipe`, `recipe[].target`.
    name: String,
    /// The index of the tag of its element 0.
    pub tag: usize,
    pub array: Array,
}

impl ArrayColumn {
    /// The name of an element or slice.
    fn with(&self, index: &str) -> String {
        with_index(&self.name, index)
    }

    /// The name as people write it.
    fn plain(&self) -> String {
        self.name.replacen(INDEX, "", 1)
    }
}

impl Scope {
    /// Looks up a name that has a `[`.
    pub(super) fn indexed(&self, name: &str) -> Result<LookUp, Mistake> {
        let Some(IndexedName { base, index, behind }) = IndexedName::of(name)
            .filter(|name| name.behind.is_empty() || name.behind.starts_with('.'))
        else {
            let base = name.split('[').next().unwrap_or_default().trim_end();
            self.array(base)?;
            let message = format!("`{name}` does not end with its index");
            let help = format!("one element is `{base}[0]`; elements have no members");
            return Err(mistake(Code::UnknownName, message, help));
        };
        if let (true, Some((tag, _))) = (behind.is_empty(), self.record(base)) {
            return self.indexed_record(base, tag, index);
        }
        if let Some(mistake) = self.unknown_field(base, index, behind) {
            return Err(mistake);
        }
        let column = self.column(&format!("{base}{INDEX}{behind}"))?;
        if let Some((low, high)) = index.split_once("..") {
            return self.slice(&column, low.trim(), high.trim());
        }
        let (array, tag) = (column.array, column.tag);
        let found = match self.index(&column, index)? {
            ArrayIndex::Constant(at, named) => LookUp {
                thing: NamedThing::Address(array.element(at)),
                tag: Some(tag + at as usize),
                index: named.map(str::to_owned),
            },
            ArrayIndex::Word(word) => LookUp {
                thing: NamedThing::Element(self.selected(array, word)?),
                tag: Some(tag),
                index: Some(word.to_owned()),
            },
        };
        if let NamedThing::Element(element) = found.thing
            && element.array.is_structures()
        {
            return Err(moving_structure(&column, index));
        }
        Ok(found)
    }

    /// A record of an array of records.
    fn indexed_record(&self, base: &str, tag: usize, index: &str) -> Result<LookUp, Mistake> {
        let record = &self.records()[tag];
        let Some(count) = record.count else {
            return Err(no_index_of_one(base, ""));
        };
        if index.contains("..") {
            let slice = format!("{base}[{index}]");
            let message = format!("`{slice}` is a slice of whole records");
            let all = record.fields.iter().map(|field| format!("{slice}.{}", field.name));
            let help = Help::from("a slice is of one field").with_all(all.map(possible));
            return Err(mistake(Code::OperandType, message, help));
        }
        let array = Array { space: Space::Timer, first: 0, count, member: None, bit: None };
        let column = ArrayColumn { name: base.to_owned(), tag: 0, array };
        let (at, index) = match self.index(&column, index)? {
            ArrayIndex::Constant(at, named) => (RecordIndex::Constant(at), named),
            ArrayIndex::Word(word) => {
                (RecordIndex::Word(self.selected(array, word)?.index), Some(word))
            }
        };
        let index = index.map(str::to_owned);
        Ok(LookUp { index, ..LookUp::of_record(RecordPlace { tag, at }) })
    }

    /// The array with the name of a column: `recipe`, `recipe[].target`, `lanes[].Acc`.
    pub(super) fn column(&self, name: &str) -> Result<ArrayColumn, Mistake> {
        let (base, behind) = name.split_once(INDEX).unwrap_or((name, ""));
        let found = |tag, array| ArrayColumn { name: name.to_owned(), tag, array };
        if behind.is_empty() {
            return self.array(base).map(|(tag, array)| found(tag, array));
        }
        let whole = format!("{base}{behind}");
        if let Some((tag, meaning)) = self.tag(&whole) {
            let is_field = self.record(base).is_some();
            match meaning.ok_or(Mistake::Reported)? {
                TagMeaning::Array(array) if is_field => return Ok(found(tag, array)),
                TagMeaning::Array(_)
                | TagMeaning::Address(_)
                | TagMeaning::Constant(..)
                | TagMeaning::Real(_) => {}
            }
        }
        if let Some((structures, member)) = whole.rsplit_once('.')
            && structures.len() >= base.len()
            && let Some((tag, Some(TagMeaning::Array(array)))) = self.tag(structures)
            && array.is_structures()
        {
            let first = array.element(0);
            return match (array.of_member(member), first) {
                (Some(members), _) => Ok(found(tag, members)),
                (None, Address::Structure(structure)) => {
                    Err(member_mistake(&with_index(structures, "0"), structure, member))
                }
                (None, Address::Bit(_) | Address::Word(_)) => Err(Mistake::Reported),
            };
        }
        if self.is_one_record(base) {
            return Err(no_index_of_one(base, behind));
        }
        if let Some(mistake) = self.no_field_of(base, "0", behind) {
            return Err(mistake);
        }
        let (_, _) = self.array(base)?;
        let message = format!("`{base}[0]` has no members");
        let help = advise("write `{}`", [possible(format!("{base}[0]"))]);
        Err(mistake(Code::UnknownName, message, help))
    }

    /// The array with this name, and the index of the tag of its element 0.
    fn array(&self, base: &str) -> Result<(usize, Array), Mistake> {
        if let Some((index, meaning)) = self.tag(base) {
            let meaning = meaning.ok_or(Mistake::Reported)?;
            if let TagMeaning::Array(array) = meaning {
                return Ok((index, array));
            }
        }
        // An unknown name has a finding of its own.
        let found = self.look_up(base)?;
        if let LookUp { thing: NamedThing::Array(array), tag: Some(tag), .. } = found {
            return Ok((tag, array));
        }
        let message = format!("`{base}` is no array: it has no elements");
        let help = match found.thing {
            NamedThing::Address(Address::Structure(structure)) => {
                let each = structure.members().iter();
                let members = structure.members().join("`, `.");
                Help::from(format!(
                    "name a member of it, `.{members}`, or declare a tag with `count`"
                ))
                .with_all(each.map(|member| possible(format!("{base}.{member}"))))
            }
            NamedThing::Block(_) => bit_of_block(base).and("; an array is a tag with `count`"),
            NamedThing::Device(_) => advise("its bits are `{}` and `{}`", bits_of_device(base))
                .and("; an array is a tag with `count`"),
            NamedThing::Address(Address::Bit(_) | Address::Word(_))
            | NamedThing::Constant(..)
            | NamedThing::Real(_)
            | NamedThing::Array(_)
            | NamedThing::Record(_)
            | NamedThing::Element(_) => propose(base).and(", or declare a tag with `count`"),
        };
        Err(mistake(Code::OperandType, message, help))
    }

    /// The name of an element without its slice: `recipe[2]` for `recipe[2..4][0]`, and with its
    /// index behind its record: `recipe[2].target` for `recipe.target[2]`. `None` if the name is
    /// right.
    pub(super) fn element_name(&self, name: &str, element: Address) -> Option<String> {
        let IndexedName { base, .. } = IndexedName::of(name)?;
        let (whole, behind) = match base.split_once('[') {
            Some((whole, slice)) => (whole, slice.split_once(']')?.1),
            None => (base.rsplit_once('.').filter(|(tag, _)| self.record(tag).is_some())?.0, ""),
        };
        let behind = if behind.is_empty() { base.get(whole.len()..)? } else { behind };
        let behind = if behind.starts_with('[') { "" } else { behind };
        let column = self.column(&format!("{whole}{INDEX}{behind}")).ok()?;
        let (_, number) =
            Space::of(element.without_bit()).filter(|(space, _)| *space == column.array.space)?;
        let at = number.checked_sub(column.array.first).filter(|at| *at < column.array.count)?;
        let bit = address_text::split_bit(name).map_or(String::new(), |(_, bit)| format!(".{bit}"));
        Some(format!("{}{bit}", column.with(&at.to_string())))
    }

    fn slice(&self, column: &ArrayColumn, low: &str, high: &str) -> Result<LookUp, Mistake> {
        let ArrayColumn { array, tag: first, .. } = *column;
        if array.member.is_some() {
            let message = format!(
                "`{}` is a member of several structures",
                column.with(&format!("{low}..{high}"))
            );
            let help = advise("name one: `{}`", [possible(column.with("0"))]);
            return Err(mistake(Code::OperandType, message, help));
        }
        let mut ends = [0; 2];
        for (end, text) in ends.iter_mut().zip([low, high]) {
            let whole = column.with(&format!("0..{}", array.count - 1));
            let beyond = |beyond| match beyond {
                Mistake::New { code: Code::OutOfRange, message, .. } => {
                    let help = advise("the longest is `{}`", [proposed(whole.clone())]);
                    mistake(Code::OutOfRange, message, help)
                }
                other @ (Mistake::New { .. } | Mistake::Reported) => other,
            };
            let ArrayIndex::Constant(at, _) = self.index(column, text).map_err(beyond)? else {
                let message = format!("the ends of a slice are constants, not `{text}`");
                return Err(mistake(Code::OperandType, message, propose(whole)));
            };
            *end = at;
        }
        let [from, to] = ends;
        if from > to {
            let message = "a slice goes from low to high".to_owned();
            let help = write(column.with(&format!("{high}..{low}")));
            return Err(mistake(Code::OutOfRange, message, help));
        }
        let thing = NamedThing::Array(array.slice(from, to));
        Ok(LookUp { thing, tag: Some(first + from as usize), index: None })
    }

    fn index<'n>(&self, column: &ArrayColumn, text: &'n str) -> Result<ArrayIndex<'n>, Mistake> {
        let (base, last) = (column.plain(), column.array.count - 1);
        if text.is_empty() {
            let message = format!("the index of `{base}` is missing");
            let help = Help::from(format!("it has the elements 0 to {last}"));
            let first = possible(column.with("0"));
            return Err(mistake(Code::OperandType, message, help.with(first)));
        }
        let first = || Some(column.with("0"));
        let digits = text.strip_prefix('-').unwrap_or(text);
        let (number, named) = if digits.starts_with(|c: char| c.is_ascii_digit()) {
            (whole(text).ok_or_else(|| no_index(text, first()))?, None)
        } else if text.contains(|c: char| !is_of_name(c)) && IndexedName::of(text).is_none() {
            return Err(no_index(text, first()));
        } else {
            match self.look_up(text)?.thing {
                NamedThing::Constant(value, _) => (i64::from(value), Some(text)),
                NamedThing::Address(Address::Word(word)) if !word.is_real() => {
                    return Ok(ArrayIndex::Word(text));
                }
                NamedThing::Address(Address::Bit(_)) => return Err(bit_index(column, text)),
                NamedThing::Address(_)
                | NamedThing::Element(_)
                | NamedThing::Array(_)
                | NamedThing::Record(_)
                | NamedThing::Real(_)
                | NamedThing::Block(_)
                | NamedThing::Device(_) => return Err(no_index(text, first())),
            }
        };
        match u32::try_from(number).ok().filter(|at| *at <= last) {
            Some(at) => Ok(ArrayIndex::Constant(at, named)),
            None => {
                let message = format!("`{base}` has the elements 0 to {last}, not {number}");
                let help = match base.contains('[') {
                    true => format!("the last one is number {last} of the slice").into(),
                    false => {
                        let last = proposed(column.with(&last.to_string()));
                        advise("the last one is `{}`", [last])
                    }
                };
                Err(mistake(Code::OutOfRange, message, help))
            }
        }
    }

    fn selected(&self, array: Array, word: &str) -> Result<ArrayElement, Mistake> {
        match self.look_up(word)?.thing {
            NamedThing::Address(Address::Word(index)) => Ok(ArrayElement { array, index }),
            NamedThing::Address(_)
            | NamedThing::Element(_)
            | NamedThing::Array(_)
            | NamedThing::Record(_)
            | NamedThing::Constant(..)
            | NamedThing::Real(_)
            | NamedThing::Block(_)
            | NamedThing::Device(_) => Err(no_index(word, None)),
        }
    }
}

/// The mistake in an index of a record without a `count`; `behind`: the rest of the name.
fn no_index_of_one(base: &str, behind: &str) -> Mistake {
    let message = format!("`{base}` is one record: it has no index");
    mistake(Code::OperandType, message, propose(format!("{base}{behind}")))
}

/// Whether a name without an index may have the character. (An index that has an index itself,
/// `list[recipe[2].kind]`, comes from a template's argument.) The names of the trial of a template
/// have a `?`.
fn is_of_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || "_.$?".contains(c)
}

fn whole(text: &str) -> Option<i64> {
    match text.strip_prefix("0x") {
        Some(digits) => i64::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

/// The mistake in a structure that a word selects.
pub(super) fn moving_structure(column: &ArrayColumn, index: &str) -> Mistake {
    let message = format!("`{}` is a structure with a moving index", column.with(index));
    let Address::Structure(structure) = column.array.element(0) else { return Mistake::Reported };
    let members = structure
        .members()
        .iter()
        .map(|member| possible(format!("{}.{member}", column.with(index))));
    let help = "instructions take a structure with a constant index; with a moving one its members \
                can be read";
    let help = Help::from(help).with(possible(column.with("0"))).with_all(members);
    mistake(Code::OperandType, message, help)
}

/// The mistake in an index that is a bit: in parentheses, an expression has it as 0 or 1.
fn bit_index(column: &ArrayColumn, bit: &str) -> Mistake {
    let message = format!("`{bit}` is a bit, no index");
    let words = "in contacts and MATH, `{}` takes it as 0 or 1; elsewhere an index is a word, and \
                 MATH computes it:";
    let help = advise(words, [possible(column.with(&format!("({bit})")))]);
    mistake(Code::OperandType, message, help.and(&format!(" `MATH step = {bit}`")))
}

fn no_index(text: &str, first: Option<String>) -> Mistake {
    let help = help_about_index().with_all(first.map(possible));
    mistake(Code::OperandType, not_an_index(text), help)
}
