//! Data types: what a tag of Logix consists of, and which record of rungd holds it.
//!
//! rungd's records have no nested records and no arrays. So the members of a structure that have no
//! parts become one record, and every other member a tag of its own (`memory`).

use std::collections::{HashMap, HashSet};

use super::document::{L5xFile, MemberDefinition};
use crate::names::legal_field;

/// A type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Bool,
    Sint,
    Int,
    Dint,
    Usint,
    Uint,
    Real,
    /// A structure, by its name in small letters.
    Struct(String),
    /// A type that rungd has no place for.
    Foreign(String),
}

impl Kind {
    /// The type with a name.
    pub(crate) fn named(name: &str) -> Kind {
        match name.to_uppercase().as_str() {
            "BOOL" | "BIT" => Kind::Bool,
            "SINT" => Kind::Sint,
            "INT" => Kind::Int,
            "DINT" | "TIME32" => Kind::Dint,
            "USINT" => Kind::Usint,
            "UINT" => Kind::Uint,
            "REAL" => Kind::Real,
            "LINT" | "LREAL" | "UDINT" | "ULINT" | "STRING" => Kind::Foreign(name.to_owned()),
            "TIME" | "LTIME" | "DT" | "LDT" => Kind::Foreign(name.to_owned()),
            _ => Kind::Struct(name.to_lowercase()),
        }
    }

    /// The type of rungd for a value without parts.
    pub(crate) fn plain(&self) -> Option<&'static str> {
        match self {
            Kind::Bool => Some("bit"),
            Kind::Sint | Kind::Int | Kind::Dint | Kind::Usint | Kind::Uint => Some("int"),
            Kind::Real => Some("real"),
            Kind::Struct(_) | Kind::Foreign(_) => None,
        }
    }

    /// The number of bits of an integer.
    pub(crate) fn bits(&self) -> Option<u32> {
        match self {
            Kind::Sint | Kind::Usint => Some(8),
            Kind::Int | Kind::Uint => Some(16),
            Kind::Dint => Some(32),
            Kind::Bool | Kind::Real | Kind::Struct(_) | Kind::Foreign(_) => None,
        }
    }
}

/// A structure.
#[derive(Clone, Debug)]
pub(crate) struct LogixStructure {
    pub(crate) name: String,
    pub(crate) doc: String,
    pub(crate) members: Vec<Member>,
    /// The record of `logix.toml` or `logix-pid.toml` that holds it.
    pub(crate) library: Option<&'static str>,
    pub(crate) origin: TypeOrigin,
}

/// Where the members of a structure are from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TypeOrigin {
    /// The file declares it.
    File,
    /// The data of a tag.
    Data,
    /// The uses of its tags: it can get more members.
    Use,
}

/// A member of a structure.
#[derive(Clone, Debug)]
pub(crate) struct Member {
    pub(crate) name: String,
    pub(crate) field: String,
    pub(crate) kind: Kind,
    pub(crate) dimensions: Vec<u32>,
    pub(crate) doc: String,
    /// Whether its type is only taken from its use, and another one is possible.
    pub(crate) is_guessed: bool,
}

impl Member {
    /// Whether it is a field of the structure's record.
    pub(crate) fn is_field(&self) -> bool {
        self.dimensions.is_empty() && self.kind.plain().is_some()
    }
}

/// The structures of a file, by their names in small letters.
#[derive(Clone, Debug, Default)]
pub(crate) struct Types {
    structures: HashMap<String, LogixStructure>,
    /// The names of types of texts, in small letters.
    texts: HashSet<String>,
    /// The names of types as the file spells them, by their names in small letters.
    spelled: HashMap<String, String>,
}

const TIMER: &[(&str, Kind)] = &[
    ("EN", Kind::Bool),
    ("TT", Kind::Bool),
    ("DN", Kind::Bool),
    ("PRE", Kind::Dint),
    ("ACC", Kind::Dint),
];
const COUNTER: &[(&str, Kind)] = &[
    ("CU", Kind::Bool),
    ("CD", Kind::Bool),
    ("DN", Kind::Bool),
    ("OV", Kind::Bool),
    ("UN", Kind::Bool),
    ("PRE", Kind::Dint),
    ("ACC", Kind::Dint),
];
const CONTROL: &[(&str, Kind)] = &[
    ("EN", Kind::Bool),
    ("EU", Kind::Bool),
    ("DN", Kind::Bool),
    ("EM", Kind::Bool),
    ("ER", Kind::Bool),
    ("UL", Kind::Bool),
    ("IN", Kind::Bool),
    ("FD", Kind::Bool),
    ("LEN", Kind::Dint),
    ("POS", Kind::Dint),
];

/// The record of `logix-pid.toml` that holds a PID.
pub(super) const PID_RECORD: &str = "LogixPid";

const PID: &[(&str, Kind)] = &[
    ("CTL", Kind::Dint),
    ("EN", Kind::Bool),
    ("CT", Kind::Bool),
    ("CL", Kind::Bool),
    ("PVT", Kind::Bool),
    ("DOE", Kind::Bool),
    ("SWM", Kind::Bool),
    ("CA", Kind::Bool),
    ("MO", Kind::Bool),
    ("PE", Kind::Bool),
    ("NDF", Kind::Bool),
    ("NOBC", Kind::Bool),
    ("NOZC", Kind::Bool),
    ("INI", Kind::Bool),
    ("SPOR", Kind::Bool),
    ("OLL", Kind::Bool),
    ("OLH", Kind::Bool),
    ("EWD", Kind::Bool),
    ("DVNA", Kind::Bool),
    ("DVPA", Kind::Bool),
    ("PVLA", Kind::Bool),
    ("PVHA", Kind::Bool),
    ("SP", Kind::Real),
    ("KP", Kind::Real),
    ("KI", Kind::Real),
    ("KD", Kind::Real),
    ("BIAS", Kind::Real),
    ("MAXS", Kind::Real),
    ("MINS", Kind::Real),
    ("DB", Kind::Real),
    ("SO", Kind::Real),
    ("MAXO", Kind::Real),
    ("MINO", Kind::Real),
    ("UPD", Kind::Real),
    ("PV", Kind::Real),
    ("ERR", Kind::Real),
    ("OUT", Kind::Real),
    ("PVH", Kind::Real),
    ("PVL", Kind::Real),
    ("DVP", Kind::Real),
    ("DVN", Kind::Real),
    ("PVDB", Kind::Real),
    ("DVDB", Kind::Real),
    ("MAXI", Kind::Real),
    ("MINI", Kind::Real),
    ("TIE", Kind::Real),
    ("MAXCV", Kind::Real),
    ("MINCV", Kind::Real),
    ("MINTIE", Kind::Real),
    ("MAXTIE", Kind::Real),
    ("DATA", Kind::Real),
];

impl Types {
    /// The types of a file, with those that every controller has.
    pub(crate) fn of(file: &L5xFile) -> Types {
        let mut types = Types::default();
        let library = [
            ("TIMER", "Timer", TIMER),
            ("COUNTER", "Counter", COUNTER),
            ("CONTROL", "Control", CONTROL),
            ("PID", PID_RECORD, PID),
        ];
        for (name, record, members) in library {
            let member = |(name, kind): &(&str, Kind)| Member {
                name: (*name).to_owned(),
                field: name.to_lowercase(),
                kind: kind.clone(),
                dimensions: if *name == "DATA" { vec![17] } else { Vec::new() },
                doc: String::new(),
                is_guessed: false,
            };
            types.add(LogixStructure {
                name: name.to_owned(),
                doc: String::new(),
                members: members.iter().map(member).collect(),
                library: Some(record),
                origin: TypeOrigin::File,
            });
        }
        for definition in &file.types {
            if definition.is_string {
                types.texts.insert(definition.name.to_lowercase());
                continue;
            }
            types.add(LogixStructure {
                name: definition.name.clone(),
                doc: definition.doc.clone(),
                members: definition.members.iter().map(member).collect(),
                library: None,
                origin: TypeOrigin::File,
            });
        }
        for definition in &file.instructions {
            let own = definition.parameters.iter().filter(|one| one.usage != "InOut");
            let own = own.filter(|one| one.alias.is_none());
            types.add(LogixStructure {
                name: definition.name.clone(),
                doc: definition.doc.clone(),
                members: own.chain(&definition.locals).map(member).collect(),
                library: None,
                origin: TypeOrigin::File,
            });
        }
        types.spell(file);
        types
    }

    /// Keeps how the file spells the types that it names.
    fn spell(&mut self, file: &L5xFile) {
        let programs = file.programs.iter().flat_map(|program| &program.tags);
        let tags = file.tags.iter().chain(programs).map(|tag| &tag.kind);
        let own = file.instructions.iter().flat_map(|one| one.parameters.iter().chain(&one.locals));
        let members = file.types.iter().flat_map(|one| &one.members).chain(own);
        for name in tags.chain(members.map(|member| &member.kind)) {
            self.spelled.entry(name.to_lowercase()).or_insert_with(|| name.clone());
        }
    }

    /// A name in small letters as the file spells it.
    pub(crate) fn spelling<'n>(&'n self, name: &'n str) -> &'n str {
        self.spelled.get(name).map_or(name, String::as_str)
    }

    /// Whether a type is one of texts, for which rungd has no place.
    pub(crate) fn is_text(&self, kind: &Kind) -> bool {
        match kind {
            Kind::Struct(name) => self.texts.contains(name),
            Kind::Foreign(name) => name.eq_ignore_ascii_case("STRING"),
            Kind::Bool | Kind::Sint | Kind::Int | Kind::Dint => false,
            Kind::Usint | Kind::Uint | Kind::Real => false,
        }
    }

    /// Adds a member to a structure of which only uses are known.
    pub(super) fn grow(&mut self, name: &str, member: Member) {
        let spelled = self.spelled.get(name).map_or_else(
            || format!("{}_type", name.trim_start_matches('?').replace('.', "_")),
            String::clone,
        );
        let structure = self.structures.entry(name.to_owned()).or_insert_with(|| LogixStructure {
            doc: String::new(),
            name: spelled,
            members: Vec::new(),
            library: None,
            origin: TypeOrigin::Use,
        });
        structure.members.push(member);
    }

    pub(crate) fn add(&mut self, structure: LogixStructure) {
        self.structures.entry(structure.name.to_lowercase()).or_insert(structure);
    }

    /// The structure with a name in small letters.
    pub(crate) fn structure(&self, name: &str) -> Option<&LogixStructure> {
        self.structures.get(name)
    }
}

/// A member, as a user wrote it.
pub(crate) fn member(definition: &MemberDefinition) -> Member {
    Member {
        field: legal_field(&definition.name),
        name: definition.name.clone(),
        kind: Kind::named(&definition.kind),
        dimensions: definition.dimensions.clone(),
        doc: definition.doc.clone(),
        is_guessed: false,
    }
}
