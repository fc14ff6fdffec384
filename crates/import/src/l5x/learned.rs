//! Types that a file names and does not declare: those of modules, drives, messages, axes.
//!
//! Their members come from the data of any tag of the type in the file (`data`), which is complete.
//! Without data they come from the use (`undeclared`).

use super::data::Datum;
use super::document::L5xFile;
use super::types::{Kind, LogixStructure, Member, PID_RECORD, TypeOrigin, Types};
use crate::names::legal_field;

impl Types {
    /// The types of a file, with those that only the data of its tags shows.
    pub(super) fn with_data(file: &L5xFile) -> Types {
        let mut types = Types::of(file);
        types.learn_all(file);
        types
    }

    /// Adds the types of the data of all tags of a file that it does not declare.
    fn learn_all(&mut self, file: &L5xFile) {
        let programs = file.programs.iter().flat_map(|program| &program.tags);
        let tags = file.tags.iter().chain(programs).filter_map(|tag| tag.data.as_ref());
        let locals = file.instructions.iter().flat_map(|one| &one.locals);
        let locals = locals.filter_map(|local| local.data.as_ref());
        for datum in tags.chain(locals) {
            self.learn(datum, "");
        }
    }

    /// The type of data, whose structure may have no declaration. `name`: what a structure without
    /// a name is the data of.
    pub(super) fn learn(&mut self, datum: &Datum, name: &str) -> Kind {
        let (kind, members) = match datum {
            Datum::Value { kind, .. } => return Kind::named(kind),
            Datum::Array { kind, elements, .. } => {
                elements.first().map(|first| self.learn(first, kind));
                return Kind::named(kind);
            }
            Datum::Structure { kind, members } => (kind, members),
        };
        let kind = if kind.is_empty() { name } else { kind };
        let found = Kind::named(kind);
        let is_new = matches!(&found, Kind::Struct(key) if self.structure(key).is_none());
        if kind.is_empty() || !is_new || self.is_text(&found) {
            return found;
        }
        let mut own = Vec::new();
        for member in members {
            let dimensions = match &member.datum {
                Datum::Array { dimensions, .. } => dimensions.clone(),
                Datum::Value { .. } | Datum::Structure { .. } => Vec::new(),
            };
            own.push(Member {
                field: legal_field(&member.name),
                kind: self.learn(&member.datum, &format!("{kind}_{}", member.name)),
                name: member.name.clone(),
                dimensions,
                doc: String::new(),
                is_guessed: false,
            });
        }
        self.add(LogixStructure {
            name: kind.to_owned(),
            doc: format!("The type {kind}, as the data of its tags shows it"),
            members: own,
            library: None,
            origin: TypeOrigin::Data,
        });
        found
    }
}

impl LogixStructure {
    /// Whether a member is a word whose bits the structure also has as members.
    pub(super) fn has_bits_of(&self, member: &Member) -> bool {
        let start = format!("{}_", member.name.to_lowercase());
        let is_bit = |other: &&Member| other.kind == Kind::Bool && other.dimensions.is_empty();
        let mut bits = self.members.iter().filter(is_bit);
        let is_learned = self.origin == TypeOrigin::Data && member.kind.bits().is_some();
        self.library == Some(PID_RECORD) && member.name == "CTL"
            || is_learned && bits.any(|bit| bit.name.to_lowercase().starts_with(&start))
    }
}
