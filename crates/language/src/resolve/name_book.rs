//! The book of names: what every block, Stage, device, tag and address of a program is called.
//!
//! Made once by the resolver, after the last name is declared, and shared by everything that shows
//! names to people: the checks, the symbols of `lower`, drawings, the log, the operator's answers,
//! `why`. They add only words. It has no cells; an address gets its cell from the layout. The other
//! direction, from a text to an address, is [`super::scope::Scope`].

use std::fmt;
use std::sync::Arc;

use super::array::{Array, ArrayElement};
use super::block_kind::BlockKind;
use super::named_constants::NamedConstants;
use super::places::Places;
use super::tag::{OfArray, Tag, TagMeaning};
use super::value_texts::{ValueTexts, with_text};
use crate::source::indexed::{INDEX, IndexedName, with_index};
use rungd_engine::isa::{
    Address, Bit, BitSpace, BlockBit, BlockId, DeviceId, ElementId, NumberMap, NumberRange, Space,
    StageId, Word, WordBit, WordSpace, status,
};

/// All names of a program.
#[derive(Debug, Default)]
pub struct NameBook {
    /// By `BlockId`.
    pub blocks: Vec<BlockName>,
    /// By `StageId`.
    pub stages: Vec<StageName>,
    /// The field devices, by `DeviceId`.
    pub devices: Vec<String>,
    /// The places of the tags with a `type`: texts contain their names instead of addresses.
    pub places: Places,
    /// The places where the ladder names a constant.
    pub constants: NamedConstants,
    /// The names of all tags, in file order.
    tags: Vec<String>,
    /// The index of the first tag of every address that has one.
    first_tags: NumberMap<Address, usize>,
    /// The arrays with a tag, in file order.
    arrays: Vec<ArrayName>,
    /// The texts of the values of addresses.
    texts: NumberMap<Address, Arc<ValueTexts>>,
    /// The index in `arrays` of the first tag of every such array.
    first_arrays: NumberMap<NumberRange<Space>, usize>,
}

/// The kind and name of a Program or Task.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct BlockName {
    pub kind: BlockKind,
    pub name: String,
}

/// A Stage's name, in its Program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StageName {
    /// The Program.
    pub block: BlockId,
    /// The name in the Program: `Open`.
    pub name: String,
    /// The name with its Program's: `Drain.Open`.
    pub whole: String,
}

/// An array with its tag.
#[derive(Debug)]
struct ArrayName {
    array: Array,
    /// The name before an index: `recipe`.
    before: String,
    /// The name behind it: `.target` for a field of records.
    behind: String,
}

impl ArrayName {
    /// The name of an element, a slice, or with an empty index the whole array.
    fn with(&self, index: &str, member: Option<&str>) -> String {
        let ArrayName { before, behind, .. } = self;
        match member {
            Some(member) => format!("{before}{index}{behind}.{member}"),
            None => format!("{before}{index}{behind}"),
        }
    }
}

/// The first tag of a bit or word, or of its structure. Displayed as an operand: `parts.Acc`.
#[derive(Clone, Copy, Debug)]
pub struct OperandTag<'b> {
    /// The index of the tag in the program.
    pub index: usize,
    /// The tag's name.
    tag: &'b str,
    /// The member, if it is the tag of a structure.
    pub member: Option<&'static str>,
    /// The number of the bit, if it is the tag of the word of a bit.
    pub bit: Option<u8>,
}

impl fmt::Display for OperandTag<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.tag)?;
        if let Some(member) = self.member {
            write!(f, ".{member}")?;
        }
        self.bit.map_or(Ok(()), |bit| write!(f, ".{bit}"))
    }
}

impl NameBook {
    /// A book without tags.
    pub(super) fn new(
        blocks: Vec<BlockName>,
        stages: Vec<StageName>,
        devices: Vec<String>,
        places: Places,
    ) -> NameBook {
        NameBook { blocks, stages, devices, places, ..NameBook::default() }
    }

    /// Adds the next tag of the program.
    pub(super) fn add_tag(&mut self, tag: &Tag) {
        let index = self.tags.len();
        self.tags.push(tag.name.clone());
        if let TagMeaning::Address(address) = tag.meaning {
            self.first_tags.entry(address).or_insert(index);
            if let Some(texts) = &tag.texts {
                self.texts.entry(address).or_insert_with(|| Arc::clone(texts));
            }
        }
        if let Some(OfArray { array, at: 0 }) = tag.of_array {
            self.first_arrays.entry(array.numbers()).or_insert(self.arrays.len());
            let (before, behind) = match IndexedName::of(&tag.name) {
                Some(IndexedName { base, behind, .. }) => (base.to_owned(), behind.to_owned()),
                None => (tag.name.clone(), String::new()),
            };
            self.arrays.push(ArrayName { array, before, behind });
        }
    }

    /// A block's kind and name.
    pub fn block(&self, id: BlockId) -> &BlockName {
        &self.blocks[id.0 as usize]
    }

    /// A Stage's name with its Program's.
    pub fn stage(&self, id: StageId) -> &str {
        &self.stages[id.0 as usize].whole
    }

    /// The name of a tag, by its index in the program.
    pub(super) fn tag_name(&self, index: usize) -> &str {
        &self.tags[index]
    }

    /// The name of a block, or of a Stage with its Program's.
    pub fn element(&self, element: ElementId) -> &str {
        match element.stage {
            Some(stage) => self.stage(stage),
            None => &self.block(element.block).name,
        }
    }

    /// A field device's name.
    pub fn device(&self, id: DeviceId) -> &str {
        self.devices.get(id.0 as usize).map_or("device", String::as_str)
    }

    /// The index in the program of the first tag of an address.
    pub fn tag_index(&self, address: Address) -> Option<usize> {
        self.first_tags.get(&address).copied()
    }

    /// The first tag of an address.
    pub fn tag(&self, address: Address) -> Option<&str> {
        self.tag_index(address).map(|index| &*self.tags[index])
    }

    /// The first tag of an address or of its structure, whichever comes first in the file.
    pub fn operand_tag(&self, address: Address) -> Option<OperandTag<'_>> {
        if let Some(bit) = self.untagged_word_bit(address) {
            let word = self.operand_tag(Address::Word(bit.word))?;
            return Some(OperandTag { bit: Some(bit.number), ..word });
        }
        let own = self.tag_index(address).map(|index| (index, None));
        let structure = address.structure().filter(|_| address.member().is_some());
        let structure =
            structure.and_then(|structure| self.tag_index(Address::Structure(structure)));
        let (index, member) =
            own.into_iter().chain(structure.map(|index| (index, address.member()))).min()?;
        Some(OperandTag { index, tag: &self.tags[index], member, bit: None })
    }

    /// The name of an address without its tag: of a Stage, a block, a device, or the address
    /// itself. The elements of a tag with a `type` have only the tag's name.
    pub fn address(&self, address: Address) -> String {
        let mut text = String::new();
        self.write_address(address, &mut text);
        text
    }

    /// Adds the name of an address without its tag to a text.
    pub fn write_address(&self, address: Address, text: &mut String) {
        let (name, member) = match address {
            Address::Bit(Bit::Stage(id)) => return text.push_str(self.stage(id)),
            Address::Bit(Bit::Running(id)) => (&*self.block(id).name, BlockBit::Running.name()),
            Address::Bit(Bit::Done(id)) => (&*self.block(id).name, BlockBit::Done.name()),
            Address::Bit(Bit::Device(id, health)) => (self.device(id), health.name()),
            Address::Bit(Bit::Space(..) | Bit::Flag(..) | Bit::InWord(_))
            | Address::Word(_)
            | Address::Structure(_) => return self.places.write(address, text),
        };
        [name, ".", member].into_iter().for_each(|part| text.push_str(part));
    }

    /// As [`NameBook::address`], with the nickname of a status bit or word.
    pub fn nickname(&self, address: Address) -> String {
        if let Address::Bit(Bit::InWord(bit)) = address {
            return format!("{}.{}", self.nickname(Address::Word(bit.word)), bit.number);
        }
        let nickname = match address {
            Address::Bit(Bit::Space(BitSpace::St, n)) => {
                status::BIT_NICKNAMES.get(n as usize).copied()
            }
            Address::Word(Word::Space(WordSpace::Dst, n)) => status::word_nickname(n),
            Address::Bit(_) | Address::Word(_) | Address::Structure(_) => None,
        };
        nickname.map_or_else(|| self.address(address), str::to_owned)
    }

    /// The name to write in the ladder: the tag of the address or of its structure, else as
    /// [`NameBook::nickname`].
    pub fn name(&self, address: Address) -> String {
        if let Address::Bit(Bit::InWord(bit)) = address {
            let word = || format!("{}.{}", self.name(Address::Word(bit.word)), bit.number);
            return self.tag(address).map_or_else(word, str::to_owned);
        }
        if let Some(name) = self.places.name(address) {
            return name;
        }
        let of_structure = || {
            let (structure, member) = (address.structure()?, address.member()?);
            Some(format!("{}.{member}", self.tag(Address::Structure(structure))?))
        };
        let tag = self.tag(address).map(str::to_owned).or_else(of_structure);
        tag.unwrap_or_else(|| self.nickname(address))
    }

    /// The tag of an address that can also be written: `None` for an element of a tag with a
    /// `type`.
    pub fn second_name(&self, address: Address) -> Option<&str> {
        self.tag(address).filter(|_| self.places.at(address).is_none())
    }

    /// The bit of a word that an address is, if it has no tag of its own.
    fn untagged_word_bit(&self, address: Address) -> Option<WordBit> {
        match address {
            Address::Bit(Bit::InWord(bit)) if self.tag_index(address).is_none() => Some(bit),
            Address::Bit(_) | Address::Word(_) | Address::Structure(_) => None,
        }
    }

    /// An address with its tag, for people: `parts (CT0)`.
    pub fn say(&self, address: Address) -> String {
        if let Some(bit) = self.untagged_word_bit(address)
            && let Some(word) = self.second_name(Address::Word(bit.word))
        {
            return format!("{word}.{} ({address})", bit.number);
        }
        match self.second_name(address) {
            Some(tag) => format!("{tag} ({address})"),
            None => self.address(address),
        }
    }

    /// The texts of the values of an address.
    pub fn texts(&self, address: Address) -> Option<&Arc<ValueTexts>> {
        self.texts.get(&address)
    }

    /// The value of an address with its text, for people: `1 (dosing)`, `ON (open)`, `12`.
    /// `content`: the content of its cell.
    pub fn say_value(&self, address: Address, content: i32) -> String {
        let text = self.texts(address).and_then(|texts| texts.text(content));
        match address {
            Address::Bit(_) => with_text(if content != 0 { "ON" } else { "OFF" }, text),
            Address::Word(word) => with_text(word.text(content), text),
            Address::Structure(_) => with_text(content, text),
        }
    }

    /// An element that a word selects: `recipe[step]`.
    pub fn selected(&self, element: &ArrayElement) -> String {
        let index = self.name(Address::Word(element.index));
        let text = with_index(&self.column(element.array), &index);
        format!("{text}{}", element.array.bit_text())
    }

    /// The name of an array with the place of an index in it: `recipe[].target`, `lanes[].Acc`.
    pub fn column(&self, array: Array) -> String {
        match self.first_arrays.get(&array.numbers()) {
            Some(at) => self.arrays[*at].with(INDEX, array.member),
            None => self.array(array),
        }
    }

    /// The name of an array, or of a slice of an array; without a name, its addresses.
    pub fn array(&self, array: Array) -> String {
        let last = array.first + array.count;
        let found = self.arrays.iter().find(|ArrayName { array: named, .. }| {
            named.space == array.space
                && array.first >= named.first
                && last <= named.first + named.count
        });
        match found {
            Some(named) if named.array.numbers() == array.numbers() => named.with("", array.member),
            Some(named) => {
                let first = array.first - named.array.first;
                named.with(&format!("[{first}..{}]", first + array.count - 1), array.member)
            }
            None => array.of_words().to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resolve::{LoadOptions, load_ladders};
    use crate::source::span::SourceFile;

    const LADDER: &str = r#"
        [ladder]
        devices = ["belt"]
        [tags]
        late = { at = "T0" }
        ready = { at = "T0.Done" }
        again = { at = "T0.Done" }
        recipe = { at = "D10", count = 8 }
        part = { at = "D10" }
        step = { at = "D0" }
        hours = { type = "counter" }
        [[program]]
        name = "Main"
        [[program]]
        name = "Drain"
        [[program.stage]]
        name = "Open"
        [[task]]
        name = "Tell"
    "#;

    /// A text of the book for the operand that a name means.
    fn texts(text: impl Fn(&NameBook, Address) -> String, names: &[&str]) -> Vec<String> {
        let file = SourceFile { name: "ladder.toml".into(), text: LADDER.into() };
        let (program, findings) = load_ladders(&[file], &LoadOptions::default());
        let program = program.unwrap_or_else(|| panic!("{findings:?}"));
        let address = |name: &&str| program.scope().address(name).expect("an address");
        names.iter().map(|name| text(&program.names, address(name))).collect()
    }

    const OWN: [&str; 5] = ["Drain.Open", "Drain.Running", "Tell.Done", "belt.Stale", "hours.Zero"];

    #[test]
    fn elements_without_an_address_are_always_shown_by_name() {
        for text in [NameBook::address, NameBook::nickname, NameBook::name, NameBook::say] {
            assert_eq!(texts(text, &OWN), OWN);
        }
    }

    #[test]
    fn names_prefer_the_tag_then_the_tag_of_the_structure_then_the_nickname() {
        let asked = ["T0", "T0.Done", "T0.Acc", "D10", "D11", "$On", "ST9", "DST4", "X7", "N3.PRE"];
        let wanted = "late ready late.Acc recipe[0] recipe[1] $On $ForcesActive DST4 X7 N3.PRE";
        assert_eq!(texts(NameBook::name, &asked).join(" "), wanted);
    }

    #[test]
    fn an_operand_is_named_by_the_first_tag_of_the_file() {
        let tag = |book: &NameBook, address| {
            book.operand_tag(address).map_or_else(String::new, |tag| tag.to_string())
        };
        let wanted = ["late", "late.Done", "late.Acc", "recipe[0]", "", "hours.Zero", ""];
        let asked = ["T0", "T0.Done", "T0.Acc", "D10", "T1.Done", "hours.Zero", "Drain.Open"];
        assert_eq!(texts(tag, &asked), wanted);
    }

    #[test]
    fn an_address_is_shown_with_the_tag_of_exactly_that_address() {
        let asked = ["T0.Done", "T0.Acc", "D10", "hours.Acc", "$On"];
        let wanted = ["ready (T0.Done)", "T0.Acc", "recipe[0] (D10)", "hours.Acc", "ST1"];
        assert_eq!(texts(NameBook::say, &asked), wanted);
    }
}
