//! Names of blocks, Stages and tags, alarm texts and limits: everything that the engine does not
//! need.
//!
//! Made by `lower`; read by the log writer, the drivers and the simulator.

use std::collections::HashMap;

use super::identity::Identity;
use super::word_limits::WordLimits;
use crate::resolve::priority::Priority;
use crate::resolve::program::{Program, TagMeaning};
use rungd_engine::isa::{Address, Bit, BlockId, DeviceId, StageId, Structure, Word};
use rungd_engine::{BitCell, Cell, Element, Layout};

/// A tag with an `alarm`.
#[derive(Clone, Debug)]
pub struct Alarm {
    /// The bit.
    pub bit: BitCell,
    /// The tag's name.
    pub tag: String,
    /// The text.
    pub text: String,
    /// How soon a person has to act.
    pub priority: Priority,
}

/// A tag with `log = "change"`.
#[derive(Clone, Debug)]
pub struct LoggedTag {
    /// The bit or word.
    pub cell: Cell,
    /// The tag's name; for a structure's member, `tag.Member`.
    pub tag: String,
}

/// Names and texts, by number and cell.
#[derive(Clone, Debug)]
pub struct Symbols {
    /// The cells of all addresses.
    pub layout: Layout,
    /// Block names, by `BlockId`.
    pub blocks: Vec<String>,
    /// Stage names with their Programs', by `StageId`: `Drain.Open`.
    pub stages: Vec<String>,
    /// Field devices' names, by `DeviceId`.
    pub devices: Vec<String>,
    /// Tags with an alarm, in the order of a scan: causes before consequences.
    pub alarms: Vec<Alarm>,
    /// Tags whose changes are logged, in file order.
    pub logged: Vec<LoggedTag>,
    /// The rung of each MATH, by its number: `Main, rung 3`.
    pub maths: Vec<String>,
    /// The names of parts with a state.
    pub identity: Identity,
    limits: WordLimits,
}

impl Symbols {
    /// `places`: the places of written bits in the order of a scan.
    pub(super) fn new(
        program: &Program,
        layout: Layout,
        (identity, places): (Identity, &HashMap<Bit, usize>),
    ) -> Symbols {
        let mut symbols = Symbols {
            layout,
            blocks: program.blocks.iter().map(|b| b.name.clone()).collect(),
            stages: stage_names(program),
            devices: program.devices.clone(),
            alarms: Vec::new(),
            logged: Vec::new(),
            maths: Vec::new(),
            identity,
            limits: WordLimits::of(program),
        };
        let mut alarms = Vec::new();
        for tag in &program.tags {
            let TagMeaning::Address(address) = tag.meaning else { continue };
            if let (Address::Bit(bit), Some(text)) = (address, &tag.alarm) {
                let alarm = Alarm {
                    bit: symbols.layout.bit(bit),
                    tag: tag.name.clone(),
                    text: text.clone(),
                    priority: tag.priority,
                };
                alarms.push((places.get(&bit).copied().unwrap_or(0), alarm));
            }
            if tag.log_changes {
                symbols.log(address, &tag.name);
            }
        }
        alarms.sort_by_key(|(place, _)| *place);
        symbols.alarms = alarms.into_iter().map(|(_, alarm)| alarm).collect();
        symbols
    }

    /// Adds a logged tag: its bit or word. A structure adds its `.Done` or `DN`, but not `.Acc`,
    /// which would log every count and every millisecond.
    fn log(&mut self, address: Address, tag: &str) {
        let (address, name) = match address {
            Address::Structure(structure) => {
                let member = match structure {
                    Structure::Sensaphone(_) => "DN",
                    Structure::Counter(_) | Structure::Timer(_) => "Done",
                };
                (structure.member(member).unwrap_or(address), format!("{tag}.{member}"))
            }
            Address::Bit(_) | Address::Word(_) => (address, tag.to_owned()),
        };
        if let Some(cell) = self.layout.cell(address) {
            self.logged.push(LoggedTag { cell, tag: name });
        }
    }

    /// A block's name.
    pub fn block(&self, id: BlockId) -> &str {
        &self.blocks[id.0 as usize]
    }

    /// A Stage's name with its Program's.
    pub fn stage(&self, id: StageId) -> &str {
        &self.stages[id.0 as usize]
    }

    /// A field device's name.
    pub fn device(&self, id: DeviceId) -> &str {
        &self.devices[id.0 as usize]
    }

    /// The name of a bit that has no address: of a Stage, a block or a field device.
    pub fn name(&self, bit: Bit) -> Option<String> {
        match bit {
            Bit::Stage(id) => Some(self.stage(id).to_owned()),
            Bit::Running(id) => Some(format!("{}.Running", self.block(id))),
            Bit::Done(id) => Some(format!("{}.Done", self.block(id))),
            Bit::Device(id, health) => Some(format!("{}.{}", self.device(id), health.name())),
            Bit::Space(..) | Bit::Flag(..) => None,
        }
    }

    /// An element's name: its block's or its Stage's.
    pub fn element(&self, element: Element) -> &str {
        match element {
            Element::Block(id) => self.block(id),
            Element::Stage(id) => self.stage(id),
        }
    }

    /// The limits of a write from outside to a word: its range, narrowed by `min` and `max` of its
    /// tags. A write beyond them is refused.
    pub fn limits(&self, word: Word) -> (i32, i32) {
        self.limits.get(word)
    }
}

fn stage_names(program: &Program) -> Vec<String> {
    let name = |(block, at): &(BlockId, usize)| {
        let block = program.block(*block);
        format!("{}.{}", block.name, block.stages[*at].name)
    };
    program.stages.iter().map(name).collect()
}
