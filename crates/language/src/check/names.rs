//! The texts of addresses in findings: with their names in the ladder.
//!
//! Called by the rules. Prefers a tag to its address and a status nickname to its number, because
//! help texts are pasted into the ladder. `conditions` prints contacts.

use rungd_engine::isa::{Address, Bit, BitSpace, Structure, Word, WordSpace, status};

use super::context::Context;
use crate::resolve::array::Element;

impl Context<'_> {
    /// The name to write in this ladder: the tag if the address has one, else the address.
    pub fn name(&self, address: Address) -> String {
        if let Some(name) = self.program.places.name(address) {
            return name;
        }
        if let Some(tag) = self.tag_at(address) {
            return tag.name.clone();
        }
        match address {
            Address::Bit(bit) => self.bit_name(bit),
            Address::Word(word) => self.word_name(word),
            Address::Structure(structure) => structure.to_string(),
        }
    }

    /// An element that a word selects: `recipe[step]`.
    pub fn element(&self, element: &Element) -> String {
        let index = self.name(Address::Word(element.index));
        match self.array_tag(element.array) {
            Some(tag) => format!("{}[{index}]", tag.array_name()),
            None => format!("{}[{index}]", element.array),
        }
    }

    /// For a sentence: `` `bin_full` (Y0) ``, or `` `Y0` `` without a tag.
    pub fn say(&self, address: Address) -> String {
        match self.tag_at(address) {
            Some(tag) if self.program.places.at(address).is_none() => {
                format!("`{}` ({address})", tag.name)
            }
            Some(_) | None => format!("`{}`", self.name(address)),
        }
    }

    /// As [`Context::say`], for a bit.
    pub fn say_bit(&self, bit: Bit) -> String {
        self.say(Address::Bit(bit))
    }

    /// As [`Context::say`], for a structure.
    pub fn say_structure(&self, structure: Structure) -> String {
        self.say(Address::Structure(structure))
    }

    /// The first structure of the same kind without an owner and without a tag.
    pub fn free_like(&self, structure: Structure) -> Option<Structure> {
        let is_placed = |at: Address| self.program.places.at(at).is_some();
        let free = |s: &Structure| {
            let at = Address::Structure(*s);
            !self.is_owned(*s) && self.tag_at(at).is_none() && !is_placed(at)
        };
        *self.free_cell(structure).get_or_init(|| {
            let count = structure.space().count(&self.program.sizes);
            (0..count).map(|n| structure.numbered(n)).find(free)
        })
    }

    fn bit_name(&self, bit: Bit) -> String {
        let program = self.program;
        match bit {
            Bit::Stage(id) => {
                let (block, _) = program.stages[id.0 as usize];
                format!("{}.{}", program.block(block).name, program.stage(id).name)
            }
            Bit::Running(id) => format!("{}.Running", program.block(id).name),
            Bit::Done(id) => format!("{}.Done", program.block(id).name),
            Bit::Device(id, health) => {
                format!("{}.{}", program.devices[id.0 as usize], health.name())
            }
            Bit::Flag(structure, flag) => {
                format!("{}.{}", self.name(Address::Structure(structure)), flag.name())
            }
            Bit::Space(BitSpace::St, n) => status::BIT_NICKNAMES[n as usize].to_owned(),
            Bit::Space(..) => bit.to_string(),
        }
    }

    fn word_name(&self, word: Word) -> String {
        let of = |structure| self.name(Address::Structure(structure));
        match word {
            Word::Acc(structure @ Structure::Sensaphone(_)) => format!("{}.ACC", of(structure)),
            Word::Acc(structure) => format!("{}.Acc", of(structure)),
            Word::Pre(n) => format!("{}.PRE", of(Structure::Sensaphone(n))),
            Word::Space(WordSpace::Dst, n) => match status::word_nickname(n) {
                Some(nickname) => nickname.to_owned(),
                None => word.to_string(),
            },
            Word::Space(..) => word.to_string(),
        }
    }
}

/// Maximum number of names in one sentence.
const LISTED_MAX: usize = 8;

/// An instruction that would own a structure, ready to paste.
pub fn owner_of(context: &Context, structure: Structure) -> String {
    let name = context.name(Address::Structure(structure));
    match structure {
        Structure::Counter(_) => format!("`UDCG {name}`"),
        Structure::Timer(_) => format!("`TMR {name} preset=1s`"),
        Structure::Sensaphone(_) => format!("`CTU {name} preset=1`"),
    }
}

/// `` `A`, `B` and `C` ``. Of more than `LISTED_MAX` names, only the first are listed.
pub fn list(names: &[String]) -> String {
    match names {
        many if many.len() > LISTED_MAX => {
            format!("{} and {} more", many[..LISTED_MAX].join(", "), many.len() - LISTED_MAX)
        }
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
