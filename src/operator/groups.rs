//! Names that stand for several bits or words: a block, a field device, a use of a template.
//!
//! Part of [`super::names::Names`], which fills it once and looks up each member. Structures,
//! arrays and ranges are not here: they are addresses.

use std::collections::{BTreeMap, HashMap};

use crate::isa::{Address, Bit, BlockId, DeviceId, Health};
use crate::resolve::program::{Block, BlockKind, Program, TagMeaning};

/// The members of a name, each with its whole name, in the order of the file.
type Members = Vec<(String, Address)>;

/// All names of a program that stand for several others.
#[derive(Debug, Default)]
pub(super) struct Groups {
    /// A block's bits and Stages; a device's bits.
    own: HashMap<String, Members>,
    /// The tags with a dot in their name, with their numbers in the file: a use's begin with its
    /// name and a dot.
    of_uses: BTreeMap<String, (usize, Address)>,
}

impl Groups {
    /// The groups of a program.
    pub fn of(program: &Program) -> Groups {
        let mut groups = Groups::default();
        for (at, block) in program.blocks.iter().enumerate() {
            let id = BlockId(at as u32);
            groups.own.entry(block.name.clone()).or_insert_with(|| of_block(id, block));
        }
        for (at, device) in program.devices.iter().enumerate() {
            let bit = |health: Health| {
                let name = format!("{device}.{}", health.name());
                (name, Address::Bit(Bit::Device(DeviceId(at as u32), health)))
            };
            let bits = || Health::ALL.into_iter().map(bit).collect();
            groups.own.entry(device.clone()).or_insert_with(bits);
        }
        for (at, tag) in program.tags.iter().enumerate() {
            if let (TagMeaning::Address(address), true) = (tag.meaning, tag.name.contains('.')) {
                groups.of_uses.entry(tag.name.clone()).or_insert((at, address));
            }
        }
        groups
    }

    /// The members of a name; of a use at most one more than `most`. Empty if it is no group.
    pub fn members(&self, name: &str, most: usize) -> Members {
        let begin = format!("{name}.");
        let tags = self.of_uses.range(begin.clone()..);
        let tags = tags.take_while(|(tag, _)| tag.starts_with(&begin)).take(most + 1);
        let mut tags: Vec<_> = tags.collect();
        tags.sort_by_key(|(_, (at, _))| *at);
        let mut members = self.own.get(name).cloned().unwrap_or_default();
        members.extend(tags.into_iter().map(|(tag, (_, address))| (tag.clone(), *address)));
        members
    }

    /// The names of the groups, each with what it is.
    pub fn names(&self) -> impl Iterator<Item = (&str, &'static str)> {
        let own = self.own.keys().map(|name| (name.as_str(), "all of its bits"));
        let uses = self.of_uses.keys().filter_map(|tag| tag.split_once('.'));
        own.chain(uses.map(|(name, _)| (name, "a use of a template: its tags")))
    }
}

/// `.Running`, of a Task `.Done`, and the Stages.
fn of_block(id: BlockId, block: &Block) -> Members {
    let name = |member: &str| format!("{}.{member}", block.name);
    let mut members = vec![(name("Running"), Address::Bit(Bit::Running(id)))];
    if block.kind != BlockKind::Program {
        members.push((name("Done"), Address::Bit(Bit::Done(id))));
    }
    let stages = block.stages.iter();
    members.extend(stages.map(|stage| (name(&stage.name), Address::Bit(Bit::Stage(stage.id)))));
    members
}
