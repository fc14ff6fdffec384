//! The result of a comparison of two programs, and the pairs of names of both programs.
//!
//! The other files of this folder do the comparison and fill it in; `report` makes the words.

use std::collections::{BTreeMap, HashMap};
use std::ops::RangeInclusive;

use super::moves::MovedElements;
use super::rung_texts::RungDifference;
use rungd_engine::isa::{Address, BlockId, ElementId, StageId, Structure};
use rungd_engine::{self as engine, Cell, Element, Transfer};
use rungd_language::lower::Symbols;
use rungd_language::lower::identity::Identity;
use rungd_language::resolve::program::BlockKind;
pub use rungd_language::resolve::program::Value;

/// A lowered program.
#[derive(Clone, Copy, Debug)]
pub struct LoweredProgram<'a> {
    /// For the engine.
    pub program: &'a engine::EngineProgram,
    /// Its names.
    pub symbols: &'a Symbols,
}

/// The plan of a reload: the transfer for the engine, and the differences for people.
#[derive(Clone, Debug, Default)]
pub struct ReloadPlan {
    /// For the engine.
    pub transfer: Transfer,
    /// For people, grouped by subject.
    pub(crate) differences: Vec<Difference>,
    /// Programs that may begin at their initial Stage, by their new number, each with that Stage
    /// and the condition.
    pub(super) starts: BTreeMap<BlockId, (StageId, InitialStageStart)>,
}

/// One difference: at most one line of the report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The text that holds in every case.
    pub text: String,
    /// The old memory that the line also depends on.
    pub state: Option<OldState>,
}

/// The state in the old memory on which a line depends, by cells.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum OldState {
    /// A kept timer or counter: the line appears unless its value is 0.
    Keeps {
        timer: bool,
        acc: u32,
        preset: Option<Value>,
        preset_word: Option<u32>,
        /// Its bit Done, if that is ON as soon as the value has reached the preset.
        done: Option<u32>,
        /// The new Stage of its instruction, if it moved.
        into: Option<MovedStage>,
    },
    /// A removed block or Stage: its bit, and the word in the report if the bit is OFF.
    Gone { cell: u32, off: &'static str },
    /// A kept block or Stage: the line appears while it is ON.
    Stays { cell: u32 },
    /// A Task that loses its recurrent ENTASK: the line appears while it runs.
    Disabled { running: u32 },
    /// A bit that a block no longer drives, and the bits that are ON while the removed drivers
    /// execute.
    Undriven { bit: u32, active: Vec<u32> },
    /// A Program that may begin at its initial Stage: the line appears if it begins there.
    Starts(InitialStageStart),
    /// An address that takes its `initial`; `forced`: the cell whose force it keeps, if any.
    Initial { cell: Cell, value: i32, forced: Option<Cell> },
    /// A tag with a changed address; `begins`: the value that the new address begins with.
    Moved {
        from: Cell,
        to: Cell,
        old: String,
        new: String,
        begins: Option<i32>,
        /// Whether the new address is an input: inputs keep the state of their terminals.
        input: bool,
        /// The words about a force that stays on the old address.
        force: String,
    },
    /// An array with changed addresses; the elements in order.
    MovedArray {
        elements: Vec<MovedElement>,
        /// Whether the new addresses are inputs.
        input: bool,
        /// The words about forces that stay on the old addresses.
        force: String,
    },
    /// A tag that was renamed or removed; `force`: the words about a force on its address.
    Named { cells: Vec<Cell>, force: String },
    /// A word with changed limits: the line appears if its value (or the value that it begins with)
    /// is beyond them.
    Limits { cell: Cell, begins: Option<i32>, limits: RangeInclusive<i32> },
    /// A bit that no instruction writes any more: the line appears while it is ON.
    Unwritten { bit: u32 },
    /// A rung that was edited, added or removed.
    Rung(Box<RungDifference>),
    /// Further such rungs, which are only counted.
    MoreRungs(usize),
}

/// An element of an array that moved; `begins`: the value that the new address begins with.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct MovedElement {
    pub tag: String,
    pub from: Cell,
    pub to: Cell,
    pub begins: Option<i32>,
}

/// The condition for a Program to begin at its initial Stage: it runs, no `kept` Stage is ON, and a
/// `lost` Stage is ON or it had no Stages.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct InitialStageStart {
    /// The bit that is ON while the Program runs.
    pub running: u32,
    /// The bits of its Stages that the new program has too.
    pub kept: Vec<u32>,
    /// The bits of its Stages that the new program does not have.
    pub lost: Vec<u32>,
    /// Whether it had no Stages in the old program.
    pub had_none: bool,
}

/// The new Stage of an instruction that moved.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct MovedStage {
    pub said: String,
    /// The Stage's bit in the old program, if the Stage existed there.
    pub stage: Option<u32>,
    /// The condition, if this is the initial Stage of a Program that may begin there.
    pub start: Option<InitialStageStart>,
}

/// The pairs of blocks, Stages and elements of both programs.
pub(super) struct ElementPairs<'a> {
    pub old: &'a Identity,
    pub new: &'a Identity,
    pub(super) blocks: HashMap<BlockId, BlockId>,
    pub(super) stages: HashMap<StageId, StageId>,
    stages_before: HashMap<StageId, StageId>,
    pub(super) moves: MovedElements,
}

impl<'a> ElementPairs<'a> {
    pub(super) fn new(
        old: &'a Identity,
        new: &'a Identity,
        moves: MovedElements,
    ) -> ElementPairs<'a> {
        let ids = |identity: &'a Identity| {
            let named = identity.names.blocks.iter().enumerate();
            named.map(|(at, block)| ((block.name.as_str(), block.kind), BlockId(at as u32)))
        };
        let by_name: HashMap<_, _> =
            ids(new).map(|((name, kind), id)| (name, (kind, id))).collect();
        // A subroutine that no block can reach is treated as gone.
        let is_reached = |kind: BlockKind, id: &BlockId| {
            kind != BlockKind::Subroutine || new.called_subroutines.contains(id)
        };
        let blocks: HashMap<_, _> = ids(old)
            .filter_map(|((name, kind), id)| {
                let (other, to) = by_name.get(name)?;
                (*other == kind && is_reached(kind, to)).then_some((id, *to))
            })
            .collect();
        let stage_ids: HashMap<_, _> = new
            .names
            .stages
            .iter()
            .enumerate()
            .map(|(at, stage)| ((stage.block, stage.name.as_str()), StageId(at as u32)))
            .collect();
        let stages = old.names.stages.iter().enumerate().filter_map(|(at, stage)| {
            let block = blocks.get(&stage.block)?;
            let new = stage_ids.get(&(*block, stage.name.as_str()))?;
            Some((StageId(at as u32), *new))
        });
        let stages: HashMap<_, _> = stages.collect();
        let stages_before = stages.iter().map(|(old, new)| (*new, *old)).collect();
        ElementPairs { old, new, blocks, stages, stages_before, moves }
    }

    /// A structure's new number.
    pub(super) fn structure(&self, old: Structure) -> Option<Structure> {
        structure(self.moves.after(Address::Structure(old)))
    }

    /// A structure's old number.
    pub(super) fn structure_before(&self, new: Structure) -> Option<Structure> {
        structure(self.moves.before(Address::Structure(new)))
    }

    /// Whether a preset is unchanged.
    pub(super) fn same(&self, old: Value, new: Value) -> bool {
        match (old, new) {
            (Value::Word(old), Value::Word(new)) => {
                self.moves.after(Address::Word(old)) == Some(Address::Word(new))
            }
            (old, new) => same(old, new),
        }
    }

    /// Whether the new program has a block of the same name and kind, even if nothing reaches it.
    pub(super) fn is_in_new(&self, old: BlockId) -> bool {
        self.new.names.blocks.contains(self.old.names.block(old))
    }

    /// A block's new number.
    pub(super) fn block(&self, old: BlockId) -> Option<BlockId> {
        self.blocks.get(&old).copied()
    }

    /// A Stage's new number.
    pub(super) fn stage(&self, old: StageId) -> Option<StageId> {
        self.stages.get(&old).copied()
    }

    /// A Stage's old number.
    pub(super) fn stage_before(&self, new: StageId) -> Option<StageId> {
        self.stages_before.get(&new).copied()
    }

    /// The same element in the new program, if it exists.
    pub(super) fn element(&self, old: ElementId) -> Option<ElementId> {
        let block = self.block(old.block)?;
        match old.stage {
            None => Some(ElementId { block, stage: None }),
            Some(stage) => self.stage(stage).map(|id| ElementId { block, stage: Some(id) }),
        }
    }
}

/// Whether two constant presets are equal, in any written form.
fn same(a: Value, b: Value) -> bool {
    match (a, b) {
        (Value::Const(a, _), Value::Const(b, _)) => a == b,
        (a, b) => a == b,
    }
}

fn structure(address: Option<Address>) -> Option<Structure> {
    match address {
        Some(Address::Structure(structure)) => Some(structure),
        Some(Address::Bit(_) | Address::Word(_)) | None => None,
    }
}

pub(super) fn element_of(element: ElementId) -> Element {
    element.stage.map_or(Element::Block(element.block), Element::Stage)
}

impl ReloadPlan {
    pub(super) fn add_line(&mut self, text: impl Into<String>) {
        self.differences.push(Difference { text: text.into(), state: None });
    }

    pub(super) fn add_line_with_state(&mut self, text: impl Into<String>, state: OldState) {
        self.differences.push(Difference { text: text.into(), state: Some(state) });
    }

    /// Records that a part with state moved to a different element of its block.
    pub(super) fn record_move(&mut self, names: &ElementPairs<'_>, old: ElementId, new: ElementId) {
        if names.element(old) != Some(new) {
            let pair = (element_of(old), element_of(new));
            if !self.transfer.moved.contains(&pair) {
                self.transfer.moved.push(pair);
            }
        }
    }
}
