//! The tags of a Logix project as tags of rungd: where a part of a tag lies.
//!
//! Used by the translation of every operand ([`super::locate`]). A tag of rungd is declared when it
//! is first named. A structure is one record of its members without parts, and a tag for every
//! other member; arrays within arrays are one array.

use std::collections::{BTreeSet, HashMap};

use super::data::Datum;
use super::document::{L5xFile, TagDefinition};
use super::initial;
use super::types::{Kind, Member, Types};
use crate::condition::TouchedPlace;
use crate::model::{ProjectTag, Record};
use crate::names::GivenNames;

/// Most elements of an array of rungd.
const COUNT_MAX: u32 = 4096;

/// A tag of the original.
#[derive(Clone, Debug)]
pub(crate) struct LogixVariable {
    /// Its name, with the program of a program's tag: `Main/Start`.
    pub(crate) original: String,
    pub(crate) kind: Kind,
    pub(crate) dimensions: Vec<u32>,
    pub(crate) doc: String,
    pub(crate) alias: Option<String>,
    pub(crate) data: Option<Datum>,
    /// Where its tags are declared.
    pub(crate) home: usize,
    /// Its name here, once it has one.
    pub(crate) base: Option<String>,
    /// The tags of its parts, by the members' names with dots.
    pub(crate) parts: HashMap<String, String>,
    /// Whether it is a tag of a module.
    pub(crate) module: Option<String>,
    pub(crate) is_read: bool,
    pub(crate) is_written: bool,
    /// Whether the file does not declare it.
    pub(crate) is_guessed: bool,
}

/// The variables that a routine can name.
#[derive(Clone, Debug, Default)]
pub(crate) struct LogixScope {
    /// The program, or the Add-On Instruction.
    pub(crate) name: String,
    pub(crate) variables: HashMap<String, usize>,
    /// Whether it can name the controller's tags.
    pub(crate) is_open: bool,
    /// Where its tags are declared.
    pub(crate) home: usize,
}

/// The memory of a project.
#[derive(Debug, Default)]
pub(crate) struct LogixMemory {
    pub(crate) types: Types,
    pub(crate) names: GivenNames,
    pub(crate) variables: Vec<LogixVariable>,
    /// The controller's scope first, then those of programs and Add-On Instructions.
    pub(crate) scopes: Vec<LogixScope>,
    /// The tags of each home, in order of their declaration.
    pub(crate) homes: Vec<Vec<ProjectTag>>,
    pub(crate) records: Vec<Record>,
    record_names: HashMap<String, String>,
    /// What the translation of a rung took as it is, because the file does not say it.
    pub(crate) guesses: BTreeSet<String>,
}

impl LogixMemory {
    /// The memory of a file: its controller's tags, and those of modules.
    pub(crate) fn of(file: &L5xFile) -> LogixMemory {
        let mut memory = LogixMemory { types: Types::with_data(file), ..LogixMemory::default() };
        memory.scope("", true, &file.tags);
        for module in &file.modules {
            for tag in &module.tags {
                let named = format!("{}:{}", module.name, tag.letter);
                let slot = format!("{}:{}:{}", module.parent, module.slot, tag.letter);
                let original = if module.slot.is_empty() { named.clone() } else { slot.clone() };
                let kind = memory.types.learn(&tag.data, &original);
                let id = memory.variables.len();
                memory.variables.push(LogixVariable {
                    data: Some(tag.data.clone()),
                    module: Some(format!("{} ({})", module.name, module.catalog)),
                    ..variable(&original, kind, 0)
                });
                for name in [named, slot] {
                    memory.scopes[0].variables.entry(name.to_lowercase()).or_insert(id);
                }
            }
        }
        memory
    }

    /// Adds a scope with its tags; its number.
    pub(crate) fn scope(&mut self, name: &str, is_open: bool, tags: &[TagDefinition]) -> usize {
        let home = self.homes.len();
        self.homes.push(Vec::new());
        let mut scope =
            LogixScope { name: name.to_owned(), is_open, home, ..LogixScope::default() };
        for tag in tags {
            let original =
                if name.is_empty() { tag.name.clone() } else { format!("{name}/{}", tag.name) };
            let declared = LogixVariable {
                dimensions: tag.dimensions.clone(),
                doc: tag.doc.clone(),
                alias: tag.alias.clone(),
                data: tag.data.clone(),
                ..variable(&original, Kind::named(&tag.kind), home)
            };
            scope.variables.insert(tag.name.to_lowercase(), self.variables.len());
            self.variables.push(declared);
        }
        self.scopes.push(scope);
        self.scopes.len() - 1
    }

    /// The variable that a name means in a scope; one that the file does not declare gets a place
    /// among the controller's tags.
    pub(crate) fn variable(&mut self, scope: usize, name: &str, guess: &Kind) -> usize {
        let key = name.to_lowercase();
        if let Some(id) = self.known(scope, name) {
            return id;
        }
        let id = self.variables.len();
        let home = self.scopes[0].home;
        let guessed = LogixVariable { is_guessed: true, ..variable(name, guess.clone(), home) };
        self.variables.push(guessed);
        self.scopes[0].variables.insert(key, id);
        id
    }

    /// The variable that a name means in a scope.
    pub(crate) fn known(&self, scope: usize, name: &str) -> Option<usize> {
        let key = name.to_lowercase();
        let own = self.scopes.get(scope)?;
        let found = own.variables.get(&key);
        let found = found.or_else(|| self.scopes[0].variables.get(&key).filter(|_| own.is_open));
        found.copied()
    }

    /// Whether the tags at the places are of a type with a sign.
    pub(crate) fn is_signed(&self, places: &[TouchedPlace]) -> bool {
        let is_unsigned = |variable: &LogixVariable| {
            matches!(variable.kind, Kind::Uint | Kind::Usint)
                && variable
                    .parts
                    .values()
                    .any(|name| places.iter().any(|place| place.overlaps(&TouchedPlace::of(name))))
        };
        !self.variables.iter().any(is_unsigned)
    }

    /// Marks the variables of the places as read.
    pub(crate) fn mark_read(&mut self, places: &[TouchedPlace]) {
        for variable in &mut self.variables {
            let own =
                |name: &String| places.iter().any(|place| place.overlaps(&TouchedPlace::of(name)));
            if !variable.is_read && variable.parts.values().any(own) {
                variable.is_read = true;
            }
        }
    }

    /// The scope of a program.
    pub(crate) fn program_scope(&self, name: &str) -> Option<usize> {
        let is_it = |scope: &LogixScope| scope.is_open && scope.name.eq_ignore_ascii_case(name);
        self.scopes.iter().position(is_it).filter(|at| *at > 0)
    }

    /// The tag of rungd for a part of a variable: the members' names with dots, the type there, and
    /// the number of elements of all arrays on the way.
    ///
    /// # Errors
    /// rungd has no place for it.
    pub(crate) fn part(
        &mut self,
        id: usize,
        path: &str,
        part: PartType<'_>,
    ) -> Result<String, String> {
        if let Some(name) = self.variables[id].parts.get(path) {
            return Ok(name.clone());
        }
        let count = part.dimensions.iter().try_fold(1_u32, |all, size| all.checked_mul(*size));
        let count = count.filter(|count| *count <= COUNT_MAX);
        let original = self.variables[id].original.clone();
        let Some(count) = count else {
            return Err(format!("`{original}` has more than {COUNT_MAX} elements"));
        };
        if self.types.is_text(part.kind) {
            return Err(format!("`{original}`: rungd has no texts"));
        }
        let kind = match part.kind {
            Kind::Struct(name) => self.record(name)?,
            Kind::Foreign(name) => return Err(format!("`{original}`: rungd has no type {name}")),
            Kind::Bool
            | Kind::Sint
            | Kind::Int
            | Kind::Dint
            | Kind::Usint
            | Kind::Uint
            | Kind::Real => part.kind.plain().unwrap_or("int").to_owned(),
        };
        let base = self.base(id);
        let name = match path.is_empty() {
            true => base,
            false => self.names.fresh(&format!("{base}_{}", path.replace('.', "_"))),
        };
        let variable = &mut self.variables[id];
        variable.parts.insert(path.to_owned(), name.clone());
        let is_array = !part.dimensions.is_empty();
        let of_struct = if let Kind::Struct(name) = part.kind { Some(name) } else { None };
        let structure = of_struct.and_then(|name| self.types.structure(name));
        let values = initial::values(variable.data.as_ref(), path);
        let mut doc = variable.doc.clone();
        let wished = variable.original.rsplit('/').next().unwrap_or_default();
        if !path.is_empty() || wished != name {
            let whole = if path.is_empty() { String::new() } else { format!(".{path}") };
            doc = format!("{wished}{whole}{}{doc}", if doc.is_empty() { "" } else { ": " });
        }
        // An array of one plain element is a plain tag in rungd.
        let has_count = is_array && (count > 1 || part.kind.plain().is_none());
        let tag = ProjectTag {
            name: name.clone(),
            initial: initial::text(&values, part.kind, structure, has_count.then_some(count)),
            kind,
            count: has_count.then_some(count),
            doc,
            ..ProjectTag::default()
        };
        self.homes[variable.home].push(tag);
        Ok(name)
    }

    /// The name of a variable, taken when it is first needed.
    pub(crate) fn base(&mut self, id: usize) -> String {
        if let Some(base) = &self.variables[id].base {
            return base.clone();
        }
        let original = self.variables[id].original.clone();
        let plain = original.rsplit('/').next().unwrap_or_default();
        let base = match self.names.is_taken(plain) {
            true => self.names.take(&original),
            false => self.names.take(plain),
        };
        self.variables[id].base = Some(base.clone());
        base
    }

    /// The record of a structure, declared when it is first needed.
    ///
    /// # Errors
    /// There is no such type, or nothing of it has a place in a record.
    fn record(&mut self, name: &str) -> Result<String, String> {
        if let Some(record) = self.record_names.get(name) {
            return Ok(record.clone());
        }
        let Some(structure) = self.types.structure(name) else {
            return Err(format!("the file does not declare the type {name}"));
        };
        if let Some(library) = structure.library {
            return Ok(library.to_owned());
        }
        let structure = structure.clone();
        let fields: Vec<ProjectTag> =
            structure.members.iter().filter(|one| one.is_field()).map(field).collect();
        if fields.is_empty() {
            return Err(format!("the type {} has no values of its own", structure.name));
        }
        let wish = match self.names.is_taken(&structure.name) {
            true => format!("{}_type", structure.name),
            false => structure.name.clone(),
        };
        let record = self.names.take(&wish);
        self.record_names.insert(name.to_owned(), record.clone());
        self.records.push(Record { name: record.clone(), doc: structure.doc, fields });
        Ok(record)
    }
}

impl LogixMemory {
    /// Adds a member to the record of its structure, if that has one already.
    pub(super) fn grow_record(&mut self, structure: &str, member: &Member) {
        let Some(name) = self.record_names.get(structure) else { return };
        let record = self.records.iter_mut().find(|record| record.name == *name);
        if let Some(record) = record.filter(|_| member.is_field()) {
            record.fields.push(field(member));
        }
    }
}

/// The type of a part of a variable.
#[derive(Clone, Copy)]
pub(crate) struct PartType<'t> {
    pub(crate) kind: &'t Kind,
    pub(crate) dimensions: &'t [u32],
}

/// A variable without any of the rest.
pub(crate) fn variable(original: &str, kind: Kind, home: usize) -> LogixVariable {
    LogixVariable {
        original: original.to_owned(),
        kind,
        dimensions: Vec::new(),
        doc: String::new(),
        alias: None,
        data: None,
        home,
        base: None,
        parts: HashMap::new(),
        module: None,
        is_read: false,
        is_written: false,
        is_guessed: false,
    }
}

fn field(member: &Member) -> ProjectTag {
    let changed = member.field != member.name;
    let doc = match (changed, member.doc.is_empty()) {
        (true, true) => member.name.clone(),
        (true, false) => format!("{}: {}", member.name, member.doc),
        (false, _) => member.doc.clone(),
    };
    ProjectTag {
        name: member.field.clone(),
        kind: member.kind.plain().unwrap_or("int").to_owned(),
        doc,
        ..ProjectTag::default()
    }
}
