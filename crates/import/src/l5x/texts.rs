//! Instructions that make texts: rungd has none, so they are left out, which is a named difference.
//!
//! Asked by `walk` for each instruction, and by `routine` for each search. Nothing that is
//! translated can tell: what reads a text (a compare, a conversion, its length, a copy of its
//! bytes) is no part of the project either.

use super::memory::LogixMemory;
use super::path::{self, PathPart};
use super::rll::{self, RllInstruction, RllNode};
use super::translate::Translation;
use super::types::Kind;

/// Longest chain of aliases.
const DEPTH_MAX: usize = 8;

pub(super) const LEFT_OUT: &str =
    "a text is not made: rungd has no texts, and nothing in the project reads it";

impl Translation<'_> {
    /// Whether an instruction does nothing but make a text.
    pub(super) fn leaves_out_text(&mut self, instruction: &RllInstruction) -> bool {
        let is_left_out = self.memory.makes_text(self.scope, instruction);
        if is_left_out {
            self.differences.insert(LEFT_OUT.to_owned());
        }
        is_left_out
    }
}

pub(super) const SEARCH: &str = "a search for a text is left out: rungd has no texts, and nothing \
    else uses the CONTROL of the search";

/// Whether a rung of an Add-On Instruction does nothing but look for a text and copy it: its search
/// has a local CONTROL that no other rung names. `rungs`: all rungs of the instruction's logic.
pub(super) fn is_text_search(
    memory: &LogixMemory,
    scope: usize,
    rung: &[RllNode],
    rungs: &[&[RllNode]],
) -> bool {
    let own = rll::instructions(rung);
    let Some(search) = own.iter().find(|one| one.name == "FSC") else { return false };
    let Some(control) = search.operands.first() else { return false };
    let id = memory.known(scope, control);
    let is_local = id.is_some_and(|id| {
        let variable = &memory.variables[id];
        variable.alias.is_some() && variable.kind == Kind::Struct("control".to_owned())
    });
    let is_part = |one: &&RllInstruction| {
        let names = |at: usize| one.operands.get(at).is_some_and(|text| names_tag(text, control));
        match one.name.as_str() {
            "RES" | "FSC" | "XIC" | "XIO" => names(0),
            "SIZE" => names(2),
            _ => memory.makes_text(scope, one),
        }
    };
    let all = rungs.iter().flat_map(|rung| rll::instructions(rung));
    let users = all.filter(|one| one.operands.iter().any(|text| names_tag(text, control))).count();
    let here = |one: &&&RllInstruction| one.operands.iter().any(|text| names_tag(text, control));
    is_local && own.iter().all(is_part) && users == own.iter().filter(here).count()
}

/// Whether a text names a tag anywhere.
fn names_tag(text: &str, tag: &str) -> bool {
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.split(|c| !is_name(c)).any(|word| word.eq_ignore_ascii_case(tag))
}

/// What an operand is.
struct OperandShape {
    kind: Kind,
    /// The numbers of elements of the last array on the way.
    dimensions: Vec<u32>,
}

impl LogixMemory {
    /// Whether an instruction does nothing but make a text.
    fn makes_text(&self, scope: usize, instruction: &RllInstruction) -> bool {
        let operand = |at: usize| instruction.operands.get(at).map_or("", String::as_str);
        let is_text = |text: &str| self.is_text_at(scope, text);
        match instruction.name.as_str() {
            "RTOS" | "DTOS" | "CONCAT" | "MID" | "DELETE" | "INSERT" | "UPPER" | "LOWER" => true,
            "MOV" | "MOVE" => operand(0).starts_with('\'') || is_text(operand(1)),
            "COP" | "CPS" => is_text(operand(0)) && is_text(operand(1)),
            "FLL" => is_text(operand(1)),
            _ => false,
        }
    }

    /// Whether an operand names a text. Declares nothing.
    fn is_text_at(&self, scope: usize, text: &str) -> bool {
        let Some(path) = path::parse(text) else { return false };
        let shape = self.shape_at(scope, path, 0);
        shape.is_some_and(|shape| self.types.is_text(&shape.kind))
    }

    /// The numbers of elements of the array that an operand names, or whose element it names.
    /// Declares nothing.
    pub(super) fn sizes_at(&self, scope: usize, text: &str) -> Option<Vec<u32>> {
        Some(self.shape_at(scope, path::parse(text)?, 0)?.dimensions)
    }

    /// What a path names, whatever its indexes are.
    fn shape_at(&self, scope: usize, path: path::TagPath, depth: usize) -> Option<OperandShape> {
        let scope = match &path.program {
            Some(program) => self.program_scope(program)?,
            None => scope,
        };
        let variable = &self.variables[self.known(scope, &path.base)?];
        if let Some(alias) = variable.alias.as_ref().filter(|_| depth < DEPTH_MAX) {
            let target = path::parse(alias)?;
            let parts = [target.parts, path.parts].concat();
            return self.shape_at(scope, path::TagPath { parts, ..target }, depth + 1);
        }
        let mut kind = variable.kind.clone();
        let mut dimensions = variable.dimensions.clone();
        for part in &path.parts {
            match part {
                PathPart::Index(_) => {}
                PathPart::Bit(_) | PathPart::MovingBit(_) => {
                    return Some(OperandShape { kind: Kind::Bool, dimensions: Vec::new() });
                }
                PathPart::Member(name) => {
                    let Kind::Struct(structure) = &kind else { return None };
                    let members = &self.types.structure(structure)?.members;
                    let member = members.iter().find(|one| one.name.eq_ignore_ascii_case(name))?;
                    dimensions = member.dimensions.clone();
                    kind = member.kind.clone();
                }
            }
        }
        Some(OperandShape { kind, dimensions })
    }
}
