//! Instructions that make texts: rungd has none, so they are left out, which is a named difference.
//!
//! Asked by `walk` for each instruction. Nothing that is translated can tell: what reads a text (a
//! compare, a conversion, its length, a copy of its bytes) is no part of the project either.

use super::memory::LogixMemory;
use super::path::{self, PathPart};
use super::rll::RllInstruction;
use super::translate::Translation;
use super::types::Kind;

/// Longest chain of aliases.
const DEPTH_MAX: usize = 8;

const LEFT_OUT: &str =
    "a text is not made: rungd has no texts, and nothing in the project reads it";

impl Translation<'_> {
    /// Whether an instruction does nothing but make a text.
    pub(super) fn leaves_out_text(&mut self, instruction: &RllInstruction) -> bool {
        let operand = |at: usize| instruction.operands.get(at).map_or("", String::as_str);
        let is_text = |text: &str| self.memory.is_text_at(self.scope, text);
        let is_left_out = match instruction.name.as_str() {
            "RTOS" | "DTOS" | "CONCAT" | "MID" | "DELETE" | "INSERT" | "UPPER" | "LOWER" => true,
            "MOV" | "MOVE" => operand(0).starts_with('\'') || is_text(operand(1)),
            "COP" | "CPS" => is_text(operand(0)) && is_text(operand(1)),
            _ => false,
        };
        if is_left_out {
            self.differences.insert(LEFT_OUT.to_owned());
        }
        is_left_out
    }
}

/// What an operand is.
struct OperandShape {
    kind: Kind,
    /// The numbers of elements of the last array on the way.
    dimensions: Vec<u32>,
}

impl LogixMemory {
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
