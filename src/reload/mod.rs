//! Compares two programs: finds what of the old one goes on in the new one.
//!
//! Called by ordinary threads before a swap. The engine gets numbers ([`Transfer`]), by which it
//! copies between two scans; people get words ([`ReloadPlan::report`]). Nothing here reads a file,
//! knows a thread, or changes anything.
//!
//! Behaviour: `docs/semantics.md`, section 4, *Reload*.
#![deny(clippy::wildcard_enum_match_arm)]

mod elements;
mod histories;
mod memory;
mod report;
mod rungs;
mod tags;

pub use report::{Seen, WARNING};

use std::collections::{BTreeMap, HashMap};

use crate::engine::{self, Cell, Element, Transfer};
use crate::isa::{BlockId, ElementId, StageId};
use crate::lower::Symbols;
use crate::lower::identity::Identity;
use crate::resolve::program::Value;

/// A lowered program.
#[derive(Clone, Copy, Debug)]
pub struct Side<'a> {
    /// For the engine.
    pub program: &'a engine::Program,
    /// Its names.
    pub symbols: &'a Symbols,
}

/// What goes on, in numbers and in facts.
#[derive(Clone, Debug, Default)]
pub struct ReloadPlan {
    /// For the engine.
    pub transfer: Transfer,
    /// For people, in order of what they are about.
    pub differences: Vec<Difference>,
    /// Programs that may begin at their initial Stage, by their new number: that Stage, and when.
    starts: BTreeMap<BlockId, (StageId, Start)>,
}

/// One thing that is worth a line of the report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// What it says for certain.
    pub text: String,
    /// What of the old memory it says too.
    pub state: Option<State>,
}

/// A state in the old program, by its cells.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum State {
    /// A timer or counter that goes on: the text is left out while it has nothing to keep.
    Keeps {
        timer: bool,
        acc: u32,
        preset: Option<Value>,
        preset_word: Option<u32>,
        /// Its instruction stands in another Stage now.
        into: Option<Elsewhere>,
    },
    /// A block or Stage that is gone: whether it was on, and what it is called if not.
    Gone { cell: u32, off: &'static str },
    /// A block or Stage that stays, told while it is on.
    Stays { cell: u32 },
    /// A Task that loses the recurrent ENTASK that enabled it, told while it runs.
    Disabled { running: u32 },
    /// A bit that a block drives no more, and what is on where that may have executed.
    Undriven { bit: u32, active: Vec<u32> },
    /// A Program that may begin at its initial Stage, told if it does.
    Starts(Start),
    /// An address that begins anew.
    Initial { cell: Cell, value: i32 },
    /// A tag that has another address now; `begins`: what is put there.
    Moved {
        from: Cell,
        to: Cell,
        old: String,
        new: String,
        begins: Option<i32>,
        /// The new one is an input: it is as it is driven.
        input: bool,
        /// What it says of a force that stays on the old one.
        force: String,
    },
    /// A tag whose address has another name now, or none; `force`: what it says of a force there.
    Named { cells: Vec<Cell>, force: String },
    /// A word with other limits, told where what it holds, or begins with, is beyond them.
    Limits { cell: Cell, begins: Option<i32>, limits: (i32, i32) },
    /// A bit that no instruction writes any more, told where it is ON.
    Unwritten { bit: u32 },
}

/// When a Program begins at its initial Stage.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Start {
    /// It is running,
    pub running: u32,
    /// none of these Stages is ON,
    pub kept: Vec<u32>,
    /// and it loses one of these that was ON,
    pub lost: Vec<u32>,
    /// or had none.
    pub had_none: bool,
}

/// Another Stage that an instruction stands in now.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Elsewhere {
    pub said: String,
    /// Its bit, if it was there before.
    pub stage: Option<u32>,
    /// It is the initial one of a Program that may begin there.
    pub start: Option<Start>,
}

/// The blocks and Stages of both programs by each other.
struct Names<'a> {
    pub old: &'a Identity,
    pub new: &'a Identity,
    blocks: HashMap<BlockId, BlockId>,
    stages: HashMap<StageId, StageId>,
}

impl<'a> Names<'a> {
    fn new(old: &'a Identity, new: &'a Identity) -> Names<'a> {
        let ids = |identity: &'a Identity| {
            let named = identity.blocks.iter().enumerate();
            named.map(|(at, block)| ((block.name.as_str(), block.kind), BlockId(at as u32)))
        };
        let by_name: HashMap<_, _> =
            ids(new).map(|((name, kind), id)| (name, (kind, id))).collect();
        let blocks: HashMap<_, _> = ids(old)
            .filter_map(|((name, kind), id)| {
                by_name.get(name).filter(|(other, _)| *other == kind).map(|(_, new)| (id, *new))
            })
            .collect();
        let stage_ids: HashMap<_, _> = new
            .stages
            .iter()
            .enumerate()
            .map(|(at, stage)| ((stage.block, stage.name.as_str()), StageId(at as u32)))
            .collect();
        let stages = old.stages.iter().enumerate().filter_map(|(at, stage)| {
            let block = blocks.get(&stage.block)?;
            let new = stage_ids.get(&(*block, stage.name.as_str()))?;
            Some((StageId(at as u32), *new))
        });
        let stages = stages.collect();
        Names { old, new, blocks, stages }
    }

    /// A block's new number.
    fn block(&self, old: BlockId) -> Option<BlockId> {
        self.blocks.get(&old).copied()
    }

    /// A Stage's new number.
    fn stage(&self, old: StageId) -> Option<StageId> {
        self.stages.get(&old).copied()
    }

    /// A Stage's old number.
    fn stage_before(&self, new: StageId) -> Option<StageId> {
        self.stages.iter().find(|(_, to)| **to == new).map(|(from, _)| *from)
    }

    /// Where the same place is in the new program, if it is.
    fn element(&self, old: ElementId) -> Option<ElementId> {
        let block = self.block(old.block)?;
        match old.stage {
            None => Some(ElementId { block, stage: None }),
            Some(stage) => self.stage(stage).map(|id| ElementId { block, stage: Some(id) }),
        }
    }
}

fn element_of(element: ElementId) -> Element {
    element.stage.map_or(Element::Block(element.block), Element::Stage)
}

impl ReloadPlan {
    /// What goes on from `old` to `new`.
    pub fn new(old: Side<'_>, new: Side<'_>) -> ReloadPlan {
        let names = Names::new(&old.symbols.identity, &new.symbols.identity);
        let transfer = Transfer::memory(&old.symbols.layout, &new.symbols.layout);
        let mut plan = ReloadPlan { transfer, ..ReloadPlan::default() };
        rungs::rungs(&mut plan, &names, old, new);
        let disabled = elements::disabled(&names, old, new);
        elements::blocks(&mut plan, &names, (old, new), &disabled);
        let kept = memory::structures(&mut plan, &names, old, new);
        memory::initial(&mut plan, &names, old, new);
        tags::moved(&mut plan, &names, old);
        tags::renamed(&mut plan, &names, old);
        tags::unnamed(&mut plan, &names, old);
        tags::limits(&mut plan, &names, old, new);
        elements::unwritten(&mut plan, &names, old);
        histories::histories(&mut plan, &names);
        elements::terminations(&mut plan, &names, (old, new), &kept);
        plan
    }

    fn say(&mut self, text: impl Into<String>) {
        self.differences.push(Difference { text: text.into(), state: None });
    }

    fn say_of(&mut self, text: impl Into<String>, state: State) {
        self.differences.push(Difference { text: text.into(), state: Some(state) });
    }

    /// Notes that something with a state stands elsewhere in its block.
    fn moves(&mut self, names: &Names<'_>, old: ElementId, new: ElementId) {
        if names.element(old) != Some(new) {
            let pair = (element_of(old), element_of(new));
            if !self.transfer.moved.contains(&pair) {
                self.transfer.moved.push(pair);
            }
        }
    }
}
