//! The names of a program, and the meaning of each.
//!
//! Filled by `declare`, or from a resolved program ([`Scope::of`]). The resolver looks up every
//! name of a contact or operand here; the controller file's reader, the simulator and the
//! operator's commands look up the names that they watch or write.

mod unknown;

use std::collections::HashMap;
use std::sync::OnceLock;

use super::array::{Array, ArrayElement};
use super::block_kind::BlockKind;
use super::mistake::{
    Mistake, address_mistake, member_mistake, members_of, mistake, sentence, unknown_member,
};
use super::places::Places;
use super::record::{RecordPlace, RecordTag};
use super::tag::TagMeaning;
use super::uses::NameUses;
use crate::source::atom::ConstantForm;
use crate::source::finding::Code;
use crate::source::fix::{advise, possible, propose, write};
use crate::source::nearest::{KnownNames, UnknownName};
use crate::source::span::Span;
use crate::source::was;
use rungd_engine::isa::address_text::{self, AddressError, reads_as_address};
use rungd_engine::isa::{
    Address, Bit, BlockBit, BlockId, DeviceBit, DeviceId, MemorySizes, Real, StageId, Structure,
};

/// All names of one program.
#[derive(Debug)]
pub struct Scope {
    sizes: MemorySizes,
    places: Places,
    tags: HashMap<String, (usize, Option<TagMeaning>)>,
    /// The tags of records, in file order, and the index of each by its name.
    pub(super) records: Vec<RecordTag>,
    pub(super) record_names: HashMap<String, usize>,
    uses: NameUses,
    blocks: HashMap<String, BlockNames>,
    devices: HashMap<String, DeviceId>,
    /// Whether a declared name has the form of an address, which is forbidden.
    has_address_name: bool,
    /// Whether a tag is a Sensaphone counter.
    has_sensaphone: bool,
    /// The names of all named blocks.
    block_names: HashMap<BlockId, String>,
    /// Every stage's name, with the first block that has a stage of this name.
    stages: HashMap<String, BlockId>,
    /// All names, for the help about an unknown name; collected once.
    pub(super) known: OnceLock<KnownNames>,
    known_blocks: OnceLock<KnownNames>,
    /// Maximum number of names that are searched for the name nearest to an unknown one.
    searched_max: usize,
}

/// A block, and the names of its stages.
#[derive(Debug)]
pub(super) struct BlockNames {
    pub(super) id: BlockId,
    pub(super) kind: BlockKind,
    pub(super) stages: HashMap<String, StageId>,
    known_stages: OnceLock<KnownNames>,
    known_members: OnceLock<KnownNames>,
}

impl BlockNames {
    pub(super) fn new(id: BlockId, kind: BlockKind, stages: HashMap<String, StageId>) -> Self {
        let (known_stages, known_members) = (OnceLock::new(), OnceLock::new());
        BlockNames { id, kind, stages, known_stages, known_members }
    }

    fn stage_names(&self) -> impl Iterator<Item = &str> {
        self.stages.keys().map(String::as_str)
    }

    /// The names of all stages, for the help about an unknown stage.
    pub(super) fn known_stages(&self) -> &KnownNames {
        self.known_stages.get_or_init(|| KnownNames::new(self.stage_names()))
    }

    /// The names that may follow the block's name and a dot.
    fn known_members(&self) -> &KnownNames {
        let own = self.kind.bits().iter().map(|bit| bit.name());
        self.known_members.get_or_init(|| KnownNames::new(self.stage_names().chain(own)))
    }
}

/// A name at a place where the thing that it names does not belong.
pub(crate) struct MisplacedName<'a> {
    pub name: &'a str,
    pub span: Span,
    pub thing: NamedThing,
}

/// The meaning of a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NamedThing {
    /// A bit, word or structure.
    Address(Address),
    /// A tag with a `value`.
    Constant(i32, ConstantForm),
    /// A tag with a `value` that is a real.
    Real(Real),
    /// A Program or Task.
    Block(BlockId),
    /// A field device.
    Device(DeviceId),
    /// A whole array, or a slice of one.
    Array(Array),
    /// An element of an array, selected by a word.
    Element(ArrayElement),
    /// A whole record, or an array of records.
    Record(RecordPlace),
}

/// The result of a look-up.
#[derive(Debug)]
pub struct LookUp {
    /// The meaning of the name.
    pub thing: NamedThing,
    /// The index of the tag in the program, if the name is a tag.
    pub tag: Option<usize>,
    /// The name of the word or constant that is its index.
    pub index: Option<String>,
}

impl Scope {
    pub(super) fn new(sizes: MemorySizes) -> Scope {
        Scope {
            sizes,
            places: Places::default(),
            tags: HashMap::new(),
            records: Vec::new(),
            record_names: HashMap::new(),
            uses: NameUses::default(),
            blocks: HashMap::new(),
            devices: HashMap::new(),
            has_address_name: false,
            has_sensaphone: false,
            block_names: HashMap::new(),
            stages: HashMap::new(),
            known: OnceLock::new(),
            known_blocks: OnceLock::new(),
            searched_max: usize::MAX,
        }
    }

    /// The same scope, which searches at most this number of names for the name nearest to an
    /// unknown one. Sorts the names now, instead of at the first look-up of an unknown name.
    pub fn searching_at_most(self, names: usize) -> Scope {
        self.known();
        for block in self.blocks.values() {
            block.known_members();
        }
        Scope { searched_max: names, ..self }
    }

    pub(super) fn set_places(&mut self, places: Places) {
        self.places = places;
    }

    /// The places of the tags with a `type`.
    pub fn places(&self) -> &Places {
        &self.places
    }

    pub(super) fn add_tag(&mut self, name: &str, index: usize, meaning: Option<TagMeaning>) {
        self.note_name(name);
        self.known = OnceLock::new();
        let sensaphone = |structure: Structure| matches!(structure, Structure::Sensaphone(_));
        self.has_sensaphone |= matches!(
            meaning, Some(TagMeaning::Address(Address::Structure(of))) if sensaphone(of)
        );
        self.tags.entry(name.to_owned()).or_insert((index, meaning));
    }

    /// Whether a tag is a Sensaphone counter.
    pub(super) fn has_sensaphone(&self) -> bool {
        self.has_sensaphone
    }

    pub(super) fn note_name(&mut self, name: &str) {
        let (base, _) = parts(name);
        self.has_address_name |= reads_as_address(base);
    }

    /// Adds a use whose template is unknown: names of its tags cause no findings.
    pub(super) fn add_unknown_use(&mut self, name: String) {
        self.note_name(&name);
        self.uses.add_unknown(name);
    }

    /// Adds a use, by its whole name.
    pub(super) fn add_use(&mut self, name: String) {
        self.note_name(&name);
        self.uses.add(name);
    }

    pub(super) fn add_block(&mut self, name: &str, block: BlockNames) {
        self.note_name(name);
        (self.known, self.known_blocks) = (OnceLock::new(), OnceLock::new());
        for stage in block.stages.keys() {
            self.stages.entry(stage.clone()).or_insert(block.id);
        }
        self.block_names.insert(block.id, name.to_owned());
        self.blocks.entry(name.to_owned()).or_insert(block);
    }

    pub(super) fn add_device(&mut self, name: &str, id: DeviceId) {
        self.note_name(name);
        self.known = OnceLock::new();
        self.devices.entry(name.to_owned()).or_insert(id);
    }

    pub(super) fn has_device(&self, name: &str) -> bool {
        self.devices.contains_key(name)
    }

    /// The tag's name in a text, and the member behind it. A tag's name may itself contain dots.
    fn tag_of<'n>(&self, name: &'n str) -> Option<(&'n str, Option<&'n str>)> {
        if self.tags.contains_key(name) {
            return Some((name, None));
        }
        let (base, member) = name.rsplit_once('.')?;
        self.tags.contains_key(base).then_some((base, Some(member)))
    }

    /// The tag's index in the program; `None` for a tag with a mistake.
    pub(super) fn tag_index(&self, name: &str) -> Option<usize> {
        let (base, _) = self.tag_of(name)?;
        self.tags.get(base).filter(|(_, meaning)| meaning.is_some()).map(|(index, _)| *index)
    }

    /// A tag's index in the program, and its meaning. The meaning of a tag with a mistake is
    /// `None`.
    pub(super) fn tag(&self, name: &str) -> Option<(usize, Option<TagMeaning>)> {
        self.tags.get(name).copied()
    }

    pub(super) fn block(&self, name: &str) -> Option<&BlockNames> {
        self.blocks.get(name)
    }

    /// The names of all blocks, for the help about an unknown block.
    pub(super) fn known_blocks(&self) -> &KnownNames {
        self.known_blocks.get_or_init(|| KnownNames::new(self.blocks.keys().map(String::as_str)))
    }

    pub(super) fn block_of(&self, id: BlockId) -> Option<(&str, &BlockNames)> {
        let name = self.block_names.get(&id)?;
        let block = self.blocks.get(name).filter(|block| block.id == id)?;
        Some((name, block))
    }

    /// The address that a name means.
    ///
    /// # Errors
    /// A sentence for people: the reason why the name has no address.
    pub fn address(&self, name: &str) -> Result<Address, String> {
        match self.look_up(name) {
            Ok(LookUp { thing: NamedThing::Address(address), .. }) => Ok(address),
            Ok(LookUp { thing: NamedThing::Constant(value, _), .. }) => {
                Err(format!("`{name}` is a constant, {value}: it has no address"))
            }
            Ok(LookUp { thing: NamedThing::Real(real), .. }) => {
                Err(format!("`{name}` is a constant, {real}: it has no address"))
            }
            Ok(LookUp { thing: NamedThing::Block(_), .. }) => {
                Err(format!("`{name}` is a block: `{name}.Running` is its bit"))
            }
            Ok(LookUp { thing: NamedThing::Array(array), .. }) => {
                let last = array.count - 1;
                Err(format!(
                    "`{name}` is an array: name an element, `{name}[0]` to `{name}[{last}]`"
                ))
            }
            Ok(LookUp { thing: NamedThing::Element(element), .. }) => {
                let last = element.array.count - 1;
                Err(format!("the index of `{name}` is a word: name an element, from 0 to {last}"))
            }
            Ok(LookUp { thing: NamedThing::Record(place), .. }) => Err(format!(
                "`{name}` is {}: name a field, `{}`",
                place.words(),
                self.field(name, place)
            )),
            Ok(LookUp { thing: NamedThing::Device(_), .. }) => {
                Err(format!("`{name}` is a device: `{name}.Ok` and `{name}.Stale` are its bits"))
            }
            Err(mistake) => Err(match mistake.finding(Span::default()) {
                Some(finding) => sentence(&finding),
                None => format!("the declaration of `{name}` has a mistake"),
            }),
        }
    }

    /// Looks up a name.
    ///
    /// # Errors
    /// The mistake in the name.
    pub fn look_up(&self, name: &str) -> Result<LookUp, Mistake> {
        if was::place_in(name).is_some()
            && let Some((index, Some(meaning))) = self.tags.get(name)
        {
            let thing = self.of_tag(name, *meaning, None)?;
            return Ok(LookUp { thing, tag: Some(*index), index: None });
        }
        if let Some(found) = self.bit_in(name) {
            return found;
        }
        if name.contains('[') {
            return self.indexed(name);
        }
        match address_text::parse(name, &self.sizes) {
            // A declared name with the form of an address is reported at its declaration.
            Ok(_) | Err(_) if self.has_address_name && self.is_declared(name) => {}
            Ok(address) => {
                let Some(name) = self.places.name(address) else {
                    return Ok(LookUp::new(NamedThing::Address(address)));
                };
                let message = format!(
                    "`{address}` is the place of `{name}`, which can be used only by its name"
                );
                return Err(mistake(Code::UnknownName, message, write(name)));
            }
            Err(AddressError::NotAnAddress) => {}
            Err(error) => return Err(address_mistake(name, error)),
        }
        if let Some((base, member)) = self.tag_of(name) {
            let (index, meaning) = self.tags[base];
            let thing = self.of_tag(base, meaning.ok_or(Mistake::Reported)?, member)?;
            return Ok(LookUp { thing, tag: Some(index), index: None });
        }
        if let Some(found) = self.named(name) {
            return found;
        }
        if self.uses.is_of_inner(name) {
            return Err(self.unknown(name));
        }
        let (base, member) = parts(name);
        if let Some(block) = self.blocks.get(base) {
            let thing = of_block(base, block, member, self.searched_max)?;
            return Ok(LookUp::new(thing));
        }
        if let Some(id) = self.devices.get(base) {
            return Ok(LookUp::new(of_device(base, *id, member)?));
        }
        Err(self.unknown(name))
    }

    fn of_tag(
        &self,
        base: &str,
        meaning: TagMeaning,
        member: Option<&str>,
    ) -> Result<NamedThing, Mistake> {
        let Some(member) = member else {
            return Ok(match meaning {
                TagMeaning::Address(address) => NamedThing::Address(address),
                TagMeaning::Constant(value, written) => NamedThing::Constant(value, written),
                TagMeaning::Real(real) => NamedThing::Real(real),
                TagMeaning::Array(array) => NamedThing::Array(array),
            });
        };
        let what = match meaning {
            TagMeaning::Address(Address::Structure(structure)) => {
                let address = structure.member(member).map(NamedThing::Address);
                return address.ok_or_else(|| member_mistake(base, structure, member));
            }
            TagMeaning::Address(address) => match self.places.at(address) {
                Some((place, _)) => format!("its type is `{}`", place.type_name()),
                None => format!("it is {address}"),
            },
            TagMeaning::Constant(..) | TagMeaning::Real(_) => "it is a constant".to_owned(),
            TagMeaning::Array(array) if array.of_member(member).is_some() => {
                let element = match base.rsplit_once('.') {
                    Some((tag, field)) if self.record(tag).is_some() => format!("{tag}[0].{field}"),
                    Some(_) | None => format!("{base}[0]"),
                };
                let name = format!("{base}.{member}");
                return Err(no_column(&name, format!("{element}.{member}"), array));
            }
            TagMeaning::Array(array) => format!("it is the array {array}"),
        };
        let message = format!("`{base}` has no members: {what}");
        Err(mistake(Code::UnknownMember, message, propose(base)))
    }

    /// Whether a text is a declared name or an address.
    fn is_known(&self, name: &str) -> bool {
        address_text::parse(name, &self.sizes).is_ok()
            || self.tags.contains_key(name)
            || self.record_names.contains_key(name)
            || self.blocks.contains_key(name)
            || self.devices.contains_key(name)
    }

    /// Whether a name, or the part before its first dot, is declared.
    fn is_declared(&self, name: &str) -> bool {
        let (base, _) = parts(name);
        self.tag_of(name).is_some()
            || self.record_names.contains_key(base)
            || self.blocks.contains_key(base)
            || self.devices.contains_key(base)
            || self.uses.has(base)
    }

    /// The known names, with which an unknown name is compared.
    fn known(&self) -> &KnownNames {
        self.known.get_or_init(|| {
            let names = self.tags.keys().chain(self.blocks.keys()).chain(self.devices.keys());
            let names = names.chain(self.record_names.keys());
            KnownNames::new(names.map(String::as_str))
        })
    }
}

/// The first part of a name, and the rest behind its dot.
fn parts(name: &str) -> (&str, Option<&str>) {
    match name.split_once('.') {
        Some((base, member)) => (base, Some(member)),
        None => (name, None),
    }
}

impl LookUp {
    fn new(thing: NamedThing) -> LookUp {
        LookUp { thing, tag: None, index: None }
    }

    /// The look-up of a whole record.
    pub(super) fn of_record(place: RecordPlace) -> LookUp {
        LookUp::new(NamedThing::Record(place))
    }
}

/// The mistake in a member of all structures of an array: there are only members of one.
fn no_column(name: &str, first: String, array: Array) -> Mistake {
    let message = format!("`{name}`: members of an array of structures need an index");
    let last = array.count - 1;
    let words = format!("name one of its structures, from 0 to {last}: `{{}}`");
    mistake(Code::OperandType, message, advise(&words, [possible(first)]))
}

fn of_device(base: &str, id: DeviceId, member: Option<&str>) -> Result<NamedThing, Mistake> {
    let Some(member) = member else { return Ok(NamedThing::Device(id)) };
    let names = DeviceBit::ALL.map(DeviceBit::name);
    match DeviceBit::from_name(member) {
        Some(health) => Ok(NamedThing::Address(Address::Bit(Bit::Device(id, health)))),
        None => Err(unknown_member(&format!("{base}.{member}"), &names)),
    }
}

fn of_block(
    base: &str,
    block: &BlockNames,
    member: Option<&str>,
    searched_max: usize,
) -> Result<NamedThing, Mistake> {
    let Some(member) = member else { return Ok(NamedThing::Block(block.id)) };
    let program = block.kind == BlockKind::Program;
    if block.kind == BlockKind::Subroutine {
        let message = format!("subroutine `{base}` has no `.{member}`: it only executes");
        let help = "let its rungs set a bit of a tag";
        return Err(mistake(Code::UnknownMember, message, help));
    }
    let own = block.kind.bits().iter().find(|bit| bit.name() == member);
    let stage = || block.stages.get(member).map(|id| Bit::Stage(*id));
    if let Some(bit) = own.map(|bit| bit.bit_of(block.id)).or_else(stage) {
        return Ok(NamedThing::Address(Address::Bit(bit)));
    }
    if program && BlockBit::from_name(member).is_some() {
        let message = format!("`{base}` is a program, and only tasks have `.Done`");
        let help = propose(format!("!{base}.Running")).and(", or have its last stage SET a bit");
        return Err(mistake(Code::UnknownMember, message, help));
    }
    let (code, message) = if program {
        (Code::UnknownStage, format!("program `{base}` has no stage `{member}`"))
    } else {
        (Code::UnknownMember, format!("task `{base}` has no `.{member}`"))
    };
    let known = block.known_members();
    let near = UnknownName::new(member, known).searching_at_most(searched_max);
    let near = Some(Box::new(near.behind(&format!("{base}."))));
    Err(Mistake::New { code, message, help: Some(members_of(base, known)), near })
}
