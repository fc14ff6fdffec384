//! The texts of addresses in findings: with their names in the ladder, because help texts are
//! pasted into it.
//!
//! Called by the rules. The names are those of the program's book of names; this module adds the
//! words around them.

use rungd_engine::isa::{Address, Bit, Structure};

use super::context::Context;
use crate::resolve::record::NamedField;

impl Context<'_> {
    /// The name to write in this ladder: the tag if the address has one, else the address.
    pub fn name(&self, address: Address) -> String {
        self.program.names.name(address)
    }

    /// The field of a record that a tag with this name stands for.
    pub fn field_named(&self, name: &str) -> Option<NamedField<'_>> {
        self.program.records.iter().find_map(|record| record.field_named(name))
    }

    /// Where a tag gets its keys, in words: ``tag `jam` ``, ``field `kind` of record `Step` ``.
    pub fn say_declaration(&self, name: &str) -> String {
        match self.field_named(name) {
            Some(NamedField { record, field }) => format!("field `{field}` of record `{record}`"),
            None => format!("tag `{name}`"),
        }
    }

    /// As [`Context::say_declaration`], but `the tag` for a tag that the sentence names.
    pub fn say_limited(&self, name: &str) -> String {
        self.field_named(name).map_or("the tag".to_owned(), |_| self.say_declaration(name))
    }

    /// For a sentence: `` `bin_full` (Y0) ``, or `` `Y0` `` without a tag.
    pub fn say(&self, address: Address) -> String {
        match self.program.names.second_name(address) {
            Some(tag) => format!("`{tag}` ({address})"),
            None => format!("`{}`", self.name(address)),
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
        let is_placed = |at: Address| self.program.names.places.at(at).is_some();
        let free = |s: &Structure| {
            let at = Address::Structure(*s);
            !self.is_owned(*s) && self.tag_at(at).is_none() && !is_placed(at)
        };
        *self.free_cell(structure).get_or_init(|| {
            let count = structure.space().count(&self.program.sizes);
            (0..count).map(|n| structure.numbered(n)).find(free)
        })
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
