//! The CALLs of a program: what each block and subroutine calls, and what a block can reach.
//!
//! Used by the rules of `check`, by `lower` for the identity of a reload, and by everything that
//! shows callers. Behaviour: `docs/semantics.md`, *Subroutines*.

use std::collections::BTreeSet;

use super::instruction::Instruction;
use super::program::{Block, BlockKind, Program, ProgramPart};
use crate::source::span::Span;
use rungd_engine::isa::{BlockId, Mnemonic, OperandRole};

/// A CALL.
#[derive(Clone, Copy, Debug)]
pub struct SubroutineCall<'p> {
    /// The block or Stage that contains it.
    pub part: ProgramPart<'p>,
    /// The subroutine.
    pub subroutine: BlockId,
    /// The place of the instruction.
    pub span: Span,
}

impl Instruction {
    /// The subroutine that it executes.
    pub fn called(&self) -> Option<BlockId> {
        self.operand_with(OperandRole::Calls).map(|block| block.value)
    }
}

impl Block {
    /// Whether it is a subroutine.
    pub fn is_subroutine(&self) -> bool {
        self.kind == BlockKind::Subroutine
    }
}

impl Program {
    /// The subroutines, in file order.
    pub fn subroutines(&self) -> impl Iterator<Item = &Block> {
        self.blocks.iter().filter(|block| block.is_subroutine())
    }

    /// Whether a HALT or RESTART stands in a subroutine, which may end the execution of the block
    /// in whose turn it is.
    pub fn subroutines_end_blocks(&self) -> bool {
        let ends = |mnemonic| matches!(mnemonic, Mnemonic::Halt | Mnemonic::Restart);
        self.subroutines().next().is_some()
            && self.instructions().any(|(block, one)| block.is_subroutine() && ends(one.mnemonic))
    }

    /// All CALLs of subroutines, in file order.
    pub fn calls(&self) -> impl Iterator<Item = SubroutineCall<'_>> {
        // Most programs have none, and so no CALL.
        let parts = self.subroutines().next().into_iter().flat_map(|_| self.parts());
        parts.flat_map(move |part| {
            let instructions = part.rungs.iter().flat_map(|rung| rung.instructions());
            let called = instructions
                .filter_map(|(_, instruction)| Some((instruction.called()?, instruction.span)));
            called
                .filter(|(block, _)| self.block(*block).is_subroutine())
                .map(move |(subroutine, span)| SubroutineCall { part, subroutine, span })
        })
    }

    /// The subroutines that a CALL can reach from a Program or Task, through others too.
    pub fn called_subroutines(&self) -> BTreeSet<BlockId> {
        let calls: Vec<(BlockId, BlockId)> =
            self.calls().map(|call| (call.part.block.id, call.subroutine)).collect();
        let mut reached = BTreeSet::new();
        let mut open: Vec<BlockId> = Vec::new();
        let roots = calls.iter().filter(|(from, _)| !self.block(*from).is_subroutine());
        open.extend(roots.map(|(_, to)| *to));
        let mut leads: Vec<Vec<BlockId>> = vec![Vec::new(); self.blocks.len()];
        calls.iter().for_each(|(from, to)| leads[from.0 as usize].push(*to));
        while let Some(next) = open.pop() {
            if reached.insert(next) {
                open.extend(&leads[next.0 as usize]);
            }
        }
        reached
    }
}
