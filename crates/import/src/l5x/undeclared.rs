//! Tags that the file does not declare: which types instructions demand of them.
//!
//! [`demand`] is called by `project` before any rung is translated, so that `T1.DN` in a first rung
//! is a part of the timer that a later rung names. The other tags, and members of types without a
//! declaration, have the type of their first use: what a contact or coil names is a bit, what has
//! members a structure, any other number a DINT, which is a named difference.

use super::call_book::CallBook;
use super::document::{L5xFile, ProgramDefinition};
use super::memory::LogixMemory;
use super::path::{self, PathPart, TagPath, whole};
use super::rll::{self, RllInstruction};
use super::types::{Kind, Member};
use crate::names::legal_field;

/// The type that a use gives to what the file does not declare.
#[derive(Clone, Debug)]
pub(crate) struct GuessedType {
    pub(crate) kind: Kind,
    /// Whether the file says it: the type of an alias.
    pub(crate) is_sure: bool,
}

impl GuessedType {
    /// A type that the file names.
    pub(crate) fn sure(kind: Kind) -> GuessedType {
        GuessedType { kind, is_sure: true }
    }
}

/// Gives undeclared tags of the programs the structures that timers, counters, arrays'
/// instructions and Add-On Instructions demand. `scopes`: those of the programs.
pub(super) fn demand(
    file: &L5xFile,
    memory: &mut LogixMemory,
    calls: &CallBook,
    programs: &[ScopedProgram<'_>],
) {
    let mut demands = Vec::new();
    for ScopedProgram { program, scope } in programs {
        let rungs = program.routines.iter().flat_map(|routine| &routine.rungs);
        for series in rungs.filter_map(|rung| rll::parse(&rung.text).ok()) {
            for instruction in rll::instructions(&series) {
                for (text, kind) in demanded(file, calls, instruction) {
                    demands.push((*scope, text, kind));
                }
            }
        }
    }
    for (scope, text, kind) in demands {
        let Some(path) = path::parse(&text).filter(|path| path.parts.is_empty()) else { continue };
        if path.program.is_none() && memory.known(scope, &path.base).is_none() {
            memory.variable(scope, &path.base, &kind);
        }
    }
}

impl LogixMemory {
    /// The variable for a tag that the file does not declare, with its indexes.
    pub(super) fn undeclared(
        &mut self,
        scope: usize,
        path: &mut TagPath,
        guess: &GuessedType,
    ) -> Result<usize, String> {
        let mut name = path.base.clone();
        let indexes = path.parts.iter().take_while(|part| matches!(part, PathPart::Index(_)));
        let count = indexes.count();
        for part in path.parts.drain(..count) {
            let PathPart::Index(texts) = part else { continue };
            if texts.iter().any(|text| path::whole(text).is_none()) {
                return Err(format!("the file does not declare the array `{}`", path.base));
            }
            name += &format!("[{}]", texts.join(","));
        }
        let kind = match path.parts.first() {
            None => guess.kind.clone(),
            Some(PathPart::Bit(_) | PathPart::MovingBit(_)) => Kind::Dint,
            Some(PathPart::Member(_) | PathPart::Index(_)) => {
                Kind::Struct(format!("?{}", name.to_lowercase()))
            }
        };
        let id = self.variable(scope, &name, &kind);
        if path.parts.is_empty() && guess.is_sure {
            self.variables[id].is_guessed = false;
        }
        Ok(id)
    }

    /// The member of a structure that the file does not declare: its type is that of its use.
    ///
    /// # Errors
    /// The use does not tell it.
    pub(super) fn learn_member(&mut self, unknown: &UnknownMember<'_>) -> Result<Member, String> {
        let UnknownMember { structure, name, next, guess } = unknown;
        let inner = || Kind::Struct(format!("{structure}.{}", name.to_lowercase()));
        let (kind, is_sure) = match next {
            None => (guess.kind.clone(), guess.is_sure),
            Some(PathPart::Bit(_) | PathPart::MovingBit(_)) => (Kind::Dint, false),
            Some(PathPart::Member(_)) => (inner(), true),
            Some(PathPart::Index(_)) => {
                return Err(format!("the file does not tell how many elements `{name}` has"));
            }
        };
        let taken = self.types.structure(structure).map_or(Vec::new(), |one| {
            one.members.iter().map(|member| member.field.clone()).collect()
        });
        let mut field = legal_field(name);
        while taken.contains(&field) {
            field.push_str("_2");
        }
        let is_guessed = !is_sure && !matches!(kind, Kind::Bool | Kind::Struct(_));
        let member = Member {
            name: (*name).to_owned(),
            field,
            kind,
            dimensions: Vec::new(),
            doc: String::new(),
            is_guessed,
        };
        self.types.grow(structure, member.clone());
        self.grow_record(structure, &member);
        Ok(member)
    }
}

/// A member that nothing declares.
pub(crate) struct UnknownMember<'u> {
    /// The structure, in small letters.
    pub(crate) structure: &'u str,
    pub(crate) name: &'u str,
    /// What follows it in the path.
    pub(crate) next: Option<&'u PathPart>,
    pub(crate) guess: &'u GuessedType,
}

/// A program, and the scope of its tags.
pub(super) struct ScopedProgram<'p> {
    pub(super) program: &'p ProgramDefinition,
    pub(super) scope: usize,
}

/// The operands of an instruction that are structures, each with its type.
fn demanded(file: &L5xFile, calls: &CallBook, instruction: &RllInstruction) -> Vec<(String, Kind)> {
    let operand = |at: usize, kind: &str| {
        let text = instruction.operands.get(at).cloned();
        text.map(|text| (text, Kind::Struct(kind.to_owned()))).into_iter().collect::<Vec<_>>()
    };
    match instruction.name.as_str() {
        "TON" | "TOF" | "RTO" => operand(0, "timer"),
        "CTU" | "CTD" => operand(0, "counter"),
        "PID" => operand(0, "pid"),
        "BSL" | "BSR" => operand(1, "control"),
        "FFL" | "FFU" => operand(2, "control"),
        name if calls.is_own_instruction(name) => {
            let is_it =
                |one: &&super::document::InstructionDefinition| one.name.eq_ignore_ascii_case(name);
            let Some(own) = file.instructions.iter().find(is_it) else { return Vec::new() };
            let mut all = operand(0, &own.name.to_lowercase());
            let required = own.parameters.iter().filter(|parameter| parameter.is_required);
            for (at, parameter) in required.enumerate() {
                let kind = Kind::named(&parameter.kind);
                if parameter.usage == "InOut"
                    && parameter.dimensions.is_empty()
                    && let Kind::Struct(kind) = kind
                {
                    all.extend(operand(at + 1, &kind));
                }
            }
            all
        }
        _ => Vec::new(),
    }
}

/// The name of a member with the constant indexes behind it, which is a member of its own: nothing
/// tells how many elements there are.
///
/// # Errors
/// An index moves.
pub(super) fn learned_element(name: &str, rest: &[PathPart]) -> Result<Option<String>, String> {
    let Some(PathPart::Index(texts)) = rest.first() else { return Ok(None) };
    if texts.iter().any(|text| whole(text).is_none()) {
        return Err(format!("the file does not tell how many elements `{name}` has"));
    }
    Ok(Some(format!("{name}[{}]", texts.join(","))))
}
