//! The origin of each operation of an engine program: the rung, its contacts, its instruction.
//!
//! `observe` uses the sites to name the operations that it observes. Made by [`super::lower_seen`],
//! which puts each operation into a batch of its own, in file order. The cells are those of
//! `lower`, so a state of one engine is a state of the other. No other lowering has sites.

use std::ops::Range;

use rungd_engine::isa::ElementId;
use rungd_engine::ops::Power;

/// The origins of operations, contacts and steps of passes.
#[derive(Debug, Default)]
pub struct Sites {
    /// For each batch, its origin.
    pub batches: Vec<OperationSite>,
    /// For each step of the passes, its origin.
    pub passes: Vec<OperationSite>,
    /// The parts of rungs, in file order.
    pub parts: Vec<LoweredRungPart>,
    /// The powers of contacts, part by part: bits, elements, compares and edges, in their order
    /// from left to right; the contacts inside an edge come before the edge.
    pub leaves: Vec<Power>,
    /// The instruction that is being lowered.
    instruction: Option<u32>,
    /// The number of instructions so far.
    instructions: u32,
}

/// The origin of an operation or of a step of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OperationSite {
    /// The part of a rung, by its index.
    pub part: u32,
    /// The instruction, by its number in the program; `None`: a contact.
    pub instruction: Option<u32>,
}

/// The legs of a rung with the instructions of its `do`; or one of its branches.
#[derive(Clone, Debug)]
pub struct LoweredRungPart {
    /// The rung's block or Stage.
    pub element: ElementId,
    /// The index of the rung among those of its block or Stage.
    pub rung: u32,
    /// The branch; `None`: the rung's legs and its `do`.
    pub branch: Option<u32>,
    /// The batch before which all contacts of the part have been evaluated.
    pub ready: u32,
    /// The powers of its contacts.
    pub leaves: Range<u32>,
    /// Its instructions, by their numbers in the program.
    pub instructions: Range<u32>,
}

impl Sites {
    /// Begins the contacts of a part of a rung.
    pub(super) fn begin(&mut self, element: ElementId, rung: u32, branch: Option<u32>) {
        let (ready, leaf) = (self.batches.len() as u32, self.leaves.len() as u32);
        let (leaves, instructions) = (leaf..leaf, self.instructions..self.instructions);
        self.parts.push(LoweredRungPart { element, rung, branch, ready, leaves, instructions });
    }

    /// Ends the contacts of the part.
    pub(super) fn ready(&mut self) {
        let (batch, leaf) = (self.batches.len() as u32, self.leaves.len() as u32);
        if let Some(part) = self.parts.last_mut() {
            part.ready = batch;
            part.leaves.end = leaf;
        }
    }

    /// Begins the next instruction of the part.
    pub(super) fn begin_instruction(&mut self) {
        self.instruction = Some(self.instructions);
        self.instructions += 1;
        if let Some(part) = self.parts.last_mut() {
            part.instructions.end = self.instructions;
        }
    }

    /// Ends the instruction.
    pub(super) fn end_instruction(&mut self) {
        self.instruction = None;
    }

    /// Adds an operation.
    pub(super) fn operation(&mut self) {
        let site = self.site();
        self.batches.push(site);
    }

    /// Adds a step of a pass.
    pub(super) fn pass_step(&mut self) {
        let site = self.site();
        self.passes.push(site);
    }

    /// Adds the power of a contact.
    pub(super) fn leaf(&mut self, power: Power) {
        self.leaves.push(power);
    }

    fn site(&self) -> OperationSite {
        let part = self.parts.len().saturating_sub(1) as u32;
        OperationSite { part, instruction: self.instruction }
    }
}
