//! The variables of a PLCopen project as tags of rungd: where each lies, and what a text names.
//!
//! A scope is the global one, an instance of a program, or a function block. Its variables become
//! tags when it is made; those of a function block are the tags of its template.

use std::collections::{HashMap, HashSet};

use super::addresses::address;
use super::document::{DeclaredVariable, NamedType, VariableUse, WrittenType};
use super::initial;
use super::literals::literal;
use super::types::{IecType, StepTag, StructField, VariableKind, resolved};
use crate::condition::TouchedPlace;
use crate::model::{ProjectTag, Record};
use crate::names::{GivenNames, legal_field};

/// Most elements of an array of rungd.
const COUNT_MAX: i64 = 4096;

/// A variable.
#[derive(Clone, Debug)]
pub(super) struct IecVariable {
    /// Its name in the file, with its program: `main/start`.
    pub(super) original: String,
    pub(super) kind: VariableKind,
    /// The tag, or the use of a template.
    pub(super) name: String,
    pub(super) address: Option<String>,
    pub(super) usage: VariableUse,
    pub(super) is_guessed: bool,
    /// What it has other than in the file.
    pub(super) difference: Option<String>,
    pub(super) is_read: bool,
    pub(super) is_written: bool,
}

/// The variables that a body can name.
#[derive(Clone, Debug, Default)]
pub(super) struct IecScope {
    pub(super) name: String,
    variables: HashMap<String, usize>,
    /// The tags that were declared for it.
    pub(super) tags: Vec<ProjectTag>,
    /// The steps of its chart, or why one is none.
    pub(super) steps: Vec<Result<StepTag, String>>,
}

impl IecScope {
    /// The variable that it itself calls so.
    pub(super) fn own(&self, name: &str) -> Option<usize> {
        self.variables.get(&name.to_lowercase()).copied()
    }
}

/// A place in memory.
#[derive(Clone, Debug)]
pub(super) struct LocatedPlace {
    pub(super) text: String,
    pub(super) kind: IecType,
    /// What a write of it changes.
    pub(super) place: TouchedPlace,
    pub(super) variable: Option<usize>,
    /// Whether only a driver writes it.
    pub(super) is_input: bool,
}

/// A function block whose members can be named.
#[derive(Clone, Debug, Default)]
pub(super) struct BlockMembers {
    /// The members by their names in small letters.
    pub(super) members: HashMap<String, BlockMember>,
}

/// A member of a block that other rungs can read.
#[derive(Clone, Debug)]
pub(super) struct BlockMember {
    /// The tag within the template.
    pub(super) tag: String,
    pub(super) kind: IecType,
}

/// The memory of a project.
#[derive(Clone, Debug, Default)]
pub(super) struct PlcopenMemory {
    pub(super) names: GivenNames,
    pub(super) variables: Vec<IecVariable>,
    /// The global scope first.
    pub(super) scopes: Vec<IecScope>,
    pub(super) records: Vec<Record>,
    /// The blocks by their types, in small letters.
    pub(super) blocks: HashMap<String, BlockMembers>,
    /// How often a body calls an instance; by its variable.
    pub(super) calls: HashMap<usize, usize>,
    /// The bits that an OUT drives.
    pub(super) driven: HashSet<String>,
    /// The names that ladders write, in small letters.
    pub(super) written: HashSet<String>,
    /// The unit of a TIME that becomes a number, in ms.
    pub(super) time_unit_ms: i64,
    /// The variables with an address.
    addressed: HashMap<String, usize>,
}

impl PlcopenMemory {
    /// Adds a scope with its variables; its number.
    pub(super) fn scope(
        &mut self,
        name: &str,
        declared: &[DeclaredVariable],
        types: &[NamedType],
    ) -> usize {
        let scope = self.scopes.len();
        self.scopes.push(IecScope { name: name.to_owned(), ..IecScope::default() });
        for variable in declared {
            self.declare(scope, variable, types);
        }
        scope
    }

    /// Declares the result of a function, which its body calls as the function; `None` if rungd has
    /// no place for it.
    pub(super) fn result(
        &mut self,
        scope: usize,
        function: &str,
        kind: &WrittenType,
        types: &[NamedType],
    ) -> Option<BlockMember> {
        let VariableKind::Plain(kind) = self.kind(&resolved(kind, types), types) else {
            return None;
        };
        let tag = self.names.fresh("result");
        self.scopes[scope].tags.push(ProjectTag {
            name: tag.clone(),
            kind: kind.plain().to_owned(),
            doc: format!("The result of {function}"),
            ..ProjectTag::default()
        });
        let variable = IecVariable {
            original: format!("{function}/{function}"),
            kind: VariableKind::Plain(kind),
            name: tag.clone(),
            address: None,
            usage: VariableUse::Output,
            is_guessed: false,
            difference: None,
            is_read: false,
            is_written: true,
        };
        self.add(scope, function, variable);
        Some(BlockMember { tag, kind })
    }

    /// Adds a variable that has its place already.
    pub(super) fn add(&mut self, scope: usize, name: &str, variable: IecVariable) {
        self.scopes[scope].variables.insert(name.to_lowercase(), self.variables.len());
        self.variables.push(variable);
    }

    /// Declares a variable in a scope; an external one that is global has its place already.
    fn declare(&mut self, scope: usize, declared: &DeclaredVariable, types: &[NamedType]) {
        let key = declared.name.to_lowercase();
        let is_known = self.scopes[scope].variables.contains_key(&key);
        let is_global = scope > 0 && self.scopes[0].variables.contains_key(&key);
        if is_known || (declared.usage == VariableUse::External && is_global) {
            return;
        }
        let home = if declared.usage == VariableUse::External { 0 } else { scope };
        let kind = self.kind(&resolved(&declared.kind, types), types);
        let prefix = &self.scopes[home].name;
        let original = match prefix.is_empty() {
            true => declared.name.clone(),
            false => format!("{prefix}/{}", declared.name),
        };
        let id = self.variables.len();
        let shared = declared.address.as_ref().and_then(|at| self.addressed.get(at)).copied();
        let mut variable = IecVariable {
            original,
            name: String::new(),
            address: declared.address.clone(),
            usage: declared.usage,
            is_guessed: false,
            difference: self.difference(declared, types),
            is_read: false,
            is_written: false,
            kind,
        };
        match shared.map(|other| self.variables[other].clone()) {
            Some(other) if other.kind == variable.kind => variable.name = other.name,
            Some(_) => {
                let why = "an address that two variables of different types have";
                variable.kind = VariableKind::Missing(why.to_owned());
            }
            None => {
                variable.name = self.names.take(&declared.name);
                self.place(home, &mut variable, declared);
            }
        }
        if let Some(address) = &declared.address {
            self.addressed.entry(address.clone()).or_insert(id);
        }
        self.variables.push(variable);
        self.scopes[home].variables.insert(key, id);
    }

    /// Declares the tag of a variable.
    fn place(&mut self, home: usize, variable: &mut IecVariable, declared: &DeclaredVariable) {
        let mut tag = ProjectTag {
            name: variable.name.clone(),
            doc: documented(declared, &variable.name),
            ..ProjectTag::default()
        };
        match &variable.kind {
            VariableKind::Plain(kind) => {
                kind.plain().clone_into(&mut tag.kind);
                tag.at = declared.address.as_ref().and_then(|text| address(text, *kind));
                tag.at.take_if(|at| at.starts_with('X') && self.is_written(declared));
            }
            VariableKind::Array { element, count, .. } => {
                element.plain().clone_into(&mut tag.kind);
                tag.count = Some(*count);
            }
            VariableKind::Struct(fields) => {
                let fields: Vec<ProjectTag> = fields
                    .iter()
                    .map(|field| ProjectTag {
                        name: field.field.clone(),
                        kind: field.kind.plain().to_owned(),
                        ..ProjectTag::default()
                    })
                    .collect();
                tag.kind = self.record(&declared.kind, fields);
            }
            VariableKind::Instance(_) | VariableKind::Missing(_) => return,
        }
        tag.initial =
            declared.initial.as_ref().and_then(|value| initial::text(value, &variable.kind));
        self.scopes[home].tags.push(tag);
    }

    /// Whether a ladder of the file writes a variable of this name.
    fn is_written(&self, declared: &DeclaredVariable) -> bool {
        self.written.contains(&declared.name.to_lowercase())
    }

    /// What a variable has here other than in the file.
    fn difference(&self, declared: &DeclaredVariable, types: &[NamedType]) -> Option<String> {
        let name = &declared.name;
        let address = declared.address.as_deref().unwrap_or_default();
        let is_input = address.to_uppercase().starts_with("%I");
        if is_input && self.is_written(declared) {
            let why = "is written by the program: it is no input here";
            return Some(format!("`{name}` at {address} {why}"));
        }
        let mut kind = resolved(&declared.kind, types);
        if let WrittenType::Array { element, .. } = kind {
            kind = resolved(&element, types);
        }
        let WrittenType::Elementary(kind) = kind else { return None };
        IecType::loss(&kind).map(|loss| format!("`{name}` is {loss}"))
    }

    /// The record with these fields.
    pub(super) fn record(&mut self, kind: &WrittenType, fields: Vec<ProjectTag>) -> String {
        let found = self.records.iter().find(|record| record.fields == fields);
        if let Some(record) = found {
            return record.name.clone();
        }
        let name = if let WrittenType::Derived(name) = kind { name } else { "Record" };
        let name = self.names.take(name);
        self.records.push(Record { name: name.clone(), doc: String::new(), fields });
        name
    }

    /// What a variable of a type is.
    fn kind(&self, kind: &WrittenType, types: &[NamedType]) -> VariableKind {
        let missing = |why: String| VariableKind::Missing(why);
        match kind {
            WrittenType::Elementary(name) => {
                IecType::named(name).map_or_else(missing, VariableKind::Plain)
            }
            WrittenType::Derived(name) => VariableKind::Instance(name.clone()),
            WrittenType::Array { element, limits } => match (resolved(element, types), &limits[..])
            {
                (WrittenType::Elementary(name), [[low, high]]) => match IecType::named(&name) {
                    Ok(element) if (1..COUNT_MAX).contains(&high.saturating_sub(*low)) => {
                        let count = (high - low + 1) as u32;
                        VariableKind::Array { element, low: *low, count }
                    }
                    Ok(_) => missing("an array of one element, or of more than 4096".to_owned()),
                    Err(why) => missing(why),
                },
                (WrittenType::Elementary(_), _) => {
                    missing("an array of several dimensions".to_owned())
                }
                _ => missing("an array of structures or blocks".to_owned()),
            },
            WrittenType::Struct(members) => {
                let field = |member: &DeclaredVariable| {
                    let WrittenType::Elementary(name) = resolved(&member.kind, types) else {
                        let why = "a structure with arrays, structures or blocks in it";
                        return Err(why.to_owned());
                    };
                    Ok(StructField {
                        name: member.name.to_lowercase(),
                        field: legal_field(&member.name),
                        kind: IecType::named(&name)?,
                    })
                };
                let fields: Result<Vec<StructField>, String> = members.iter().map(field).collect();
                fields.map_or_else(missing, VariableKind::Struct)
            }
            WrittenType::Other(what) => missing(format!("a variable of type {what}")),
        }
    }

    /// The variable that a scope calls so.
    pub(super) fn variable(&self, scope: usize, name: &str) -> Option<usize> {
        let key = name.to_lowercase();
        let own = self.scopes[scope].variables.get(&key);
        own.or_else(|| self.scopes[0].variables.get(&key)).copied()
    }

    /// The place that a text names.
    ///
    /// # Errors
    /// There is no such place, or rungd has none.
    pub(super) fn locate(&mut self, scope: usize, text: &str) -> Result<LocatedPlace, String> {
        let text = text.trim();
        if text.starts_with('%') {
            return self.direct(text);
        }
        let end = text.find(['.', '[']).unwrap_or(text.len());
        let (mut head, mut rest) = text.split_at(end);
        let mut found = self.variable(scope, head);
        if found.is_none() && rest.starts_with('.') {
            // `GVL.motor`: a list of global variables.
            let inner = &rest[1..];
            let end = inner.find(['.', '[']).unwrap_or(inner.len());
            (head, rest) = inner.split_at(end);
            found = self.scopes[0].variables.get(&head.to_lowercase()).copied();
        }
        let id = found.ok_or_else(|| unknown(text))?;
        self.part(id, text, rest)
    }

    /// The place of a part of a variable: what stands behind its name.
    fn part(&self, id: usize, text: &str, rest: &str) -> Result<LocatedPlace, String> {
        let variable = &self.variables[id];
        let located = |text: String, kind: IecType| LocatedPlace {
            place: TouchedPlace::of(&variable.name),
            text,
            kind,
            variable: Some(id),
            is_input: is_input(variable) && variable.difference.is_none(),
        };
        match (&variable.kind, rest) {
            (VariableKind::Plain(kind), "") => Ok(located(variable.name.clone(), *kind)),
            (VariableKind::Plain(kind), rest) => {
                let number = rest.strip_prefix('.').and_then(|text| text.parse::<u32>().ok());
                match (number, kind) {
                    (Some(number), IecType::Whole { bits, is_signed })
                        if number < *bits && !(*is_signed && number + 1 == *bits && *bits < 32) =>
                    {
                        Ok(located(format!("{}.{number}", variable.name), IecType::Bool))
                    }
                    _ => Err(unknown(text)),
                }
            }
            (VariableKind::Array { element, low, count }, rest) => {
                let index = rest.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
                let index = index.ok_or_else(|| format!("`{text}`, a whole array"))?;
                let Some(super::literals::IecLiteral::Whole(index)) = literal(index) else {
                    return Err(format!("`{text}`, an element with a moving index"));
                };
                let at = index.saturating_sub(*low);
                match (0..i64::from(*count)).contains(&at) {
                    true => Ok(located(format!("{}[{at}]", variable.name), *element)),
                    false => Err(format!("`{text}`, an element beyond its array")),
                }
            }
            (VariableKind::Struct(fields), rest) => {
                let name = rest.strip_prefix('.').unwrap_or_default().to_lowercase();
                let field = fields.iter().find(|field| field.name == name);
                let field = field.ok_or_else(|| unknown(text))?;
                Ok(located(format!("{}.{}", variable.name, field.field), field.kind))
            }
            (VariableKind::Instance(kind), rest) => {
                let name = rest.strip_prefix('.').unwrap_or_default().to_lowercase();
                let block = self.blocks.get(&kind.to_lowercase());
                let block = block.ok_or_else(|| format!("`{text}`: {kind} is not translated"))?;
                let member = block
                    .members
                    .get(&name)
                    .ok_or_else(|| format!("`{text}`, an input or a part of {kind}"))?;
                if self.calls.get(&id).copied().unwrap_or(0) == 0 {
                    return Err(format!("`{text}`, whose block no ladder calls"));
                }
                let text = format!("{}.{}", variable.name, member.tag);
                Ok(LocatedPlace { is_input: false, ..located(text, member.kind) })
            }
            (VariableKind::Missing(why), _) => Err(format!("`{text}`: {why}")),
        }
    }

    /// `%IX0.0` and `%MW3`, without a variable.
    fn direct(&mut self, text: &str) -> Result<LocatedPlace, String> {
        let upper = text.to_uppercase();
        let kind = match upper.get(2..3) {
            Some("W") => super::types::INT,
            Some("D") => IecType::Whole { bits: 32, is_signed: true },
            _ => IecType::Bool,
        };
        let at = address(&upper, kind).ok_or_else(|| format!("the address `{text}`"))?;
        Ok(LocatedPlace {
            place: TouchedPlace::of(&at),
            is_input: at.starts_with('X'),
            text: at,
            kind,
            variable: None,
        })
    }

    /// Declares a bit that the file names, but does not declare.
    pub(super) fn guess(&mut self, scope: usize, name: &str) {
        let declared = DeclaredVariable {
            name: name.to_owned(),
            kind: WrittenType::Elementary("BOOL".to_owned()),
            address: None,
            initial: None,
            doc: "Not declared in the file".to_owned(),
            usage: VariableUse::External,
            is_retained: false,
        };
        self.declare(scope, &declared, &[]);
        if let Some(id) = self.variable(scope, name) {
            self.variables[id].is_guessed = true;
        }
    }
}

/// What is said of a text that names nothing.
fn unknown(text: &str) -> String {
    format!("`{text}`, which the file does not declare")
}

fn is_input(variable: &IecVariable) -> bool {
    let at = variable.address.as_ref().map(|text| text.to_uppercase());
    at.is_some_and(|text| text.starts_with("%IX") || (text.starts_with("%I") && text.contains('.')))
        && variable.kind == VariableKind::Plain(IecType::Bool)
}

fn documented(declared: &DeclaredVariable, name: &str) -> String {
    let mut doc = declared.doc.clone();
    let mut add = |text: String| {
        if !doc.is_empty() {
            doc += "; ";
        }
        doc += &text;
    };
    if name != declared.name {
        add(format!("`{}` in the original", declared.name));
    }
    let plain = declared.address.as_ref().filter(|at| !at.contains('*'));
    plain.into_iter().for_each(|at| add(at.clone()));
    if declared.is_retained {
        add("RETAIN".to_owned());
    }
    doc
}
