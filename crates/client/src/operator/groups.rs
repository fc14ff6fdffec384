//! Names that stand for several bits or words: the name of a block, of a field device, of a use of
//! a template.
//!
//! Part of [`super::names::OperandNames`], which fills it once and looks up each member.
//! Structures, arrays and ranges are not included: they are addresses.

use std::collections::{BTreeMap, HashMap};

use rungd_engine::isa::{Address, Bit, BlockId, DeviceBit, DeviceId};
use rungd_language::resolve::program::{Block, Program, TagMeaning};

/// The members of a name, each with its full name, in the order of the file.
type Members = Vec<(String, Address)>;

/// All names of a program that stand for several bits or words.
#[derive(Debug, Default)]
pub(super) struct Groups {
    /// The bits and Stages of each block; the bits of each device.
    own: HashMap<String, Members>,
    /// The tags with a dot in their name, with their numbers in the file. The tags of a use begin
    /// with the use's name and a dot.
    of_uses: BTreeMap<String, (usize, Address)>,
}

impl Groups {
    /// The groups of a program.
    pub fn of(program: &Program) -> Groups {
        let mut groups = Groups::default();
        for block in program.blocks.iter().filter(|block| !block.is_subroutine()) {
            groups.own.entry(block.name.clone()).or_insert_with(|| of_block(block.id, block));
        }
        for (at, device) in program.devices.iter().enumerate() {
            let bit = |health: DeviceBit| {
                let name = format!("{device}.{}", health.name());
                (name, Address::Bit(Bit::Device(DeviceId(at as u32), health)))
            };
            let bits = || DeviceBit::ALL.into_iter().map(bit).collect();
            groups.own.entry(device.clone()).or_insert_with(bits);
        }
        for (at, tag) in program.tags.iter().enumerate() {
            if let (TagMeaning::Address(address), true) = (tag.meaning, tag.name.contains('.')) {
                groups.of_uses.entry(tag.name.clone()).or_insert((at, address));
            }
        }
        groups
    }

    /// The members of a name; if the name is a use, at most `most + 1` members. Empty if the name
    /// is no group.
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

    /// The names of the groups, each with a short explanation.
    pub fn names(&self) -> impl Iterator<Item = (&str, &'static str)> {
        let own = self.own.keys().map(|name| (name.as_str(), "all of its bits"));
        let uses = self.of_uses.keys().filter_map(|tag| tag.split_once('.'));
        own.chain(uses.map(|(name, _)| (name, "a use of a template: its tags")))
    }
}

/// The members of a block: `.Running`, for a Task `.Done`, and the Stages.
fn of_block(id: BlockId, block: &Block) -> Members {
    let name = |member: &str| format!("{}.{member}", block.name);
    let own = block.kind.bits().iter();
    let mut members: Members =
        own.map(|bit| (name(bit.name()), Address::Bit(bit.bit_of(id)))).collect();
    let stages = block.stages.iter();
    members.extend(stages.map(|stage| (name(&stage.name), Address::Bit(Bit::Stage(stage.id)))));
    members
}
