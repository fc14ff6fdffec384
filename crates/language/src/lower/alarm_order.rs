//! The order of alarms: the one in which a scan executes what turns them ON.
//!
//! Of two alarms that rise in one scan, the cause is executed before its consequence, wherever
//! their tags are declared. A bit that nothing in the ladder writes (an input, a device's bit)
//! comes first: it changes before anything is executed. Bits with the same place keep the order of
//! their tags. Called while symbols are made; log, `rungd alarms` and `status` use the order.

use std::collections::BTreeSet;

use crate::resolve::program::{Instruction, Program, Rung, TagMeaning};
use rungd_engine::isa::{Address, Bit, BlockId, NumberMap};

/// The place of each bit with an alarm that the program writes: the number of the first instruction
/// that writes it, in the order of a scan. `order`: the blocks in this order.
pub(super) fn places(program: &Program, order: &[BlockId]) -> NumberMap<Bit, usize> {
    let mut places = alarm_bits(program);
    if places.is_empty() {
        return places;
    }
    let mut number = 0;
    let mut called = BTreeSet::new();
    let rungs = order.iter().flat_map(|id| {
        let block = program.block(*id);
        block.rungs.iter().chain(block.stages.iter().flat_map(|stage| &stage.rungs))
    });
    // The instructions that remain, the next one last: those of a subroutine come right behind
    // their first CALL.
    let mut open: Vec<&Instruction> = Vec::new();
    for rung in rungs {
        open.extend(rung.instructions().map(|(_, one)| one));
        open.reverse();
        while let Some(instruction) = open.pop() {
            number += 1;
            for bit in written(instruction) {
                if let Some(place) = places.get_mut(&bit).filter(|place| **place == 0) {
                    *place = number;
                }
            }
            let subroutine = instruction.called().filter(|subroutine| called.insert(*subroutine));
            let rungs = subroutine.map_or(&[][..], |id| &program.block(id).rungs);
            let first = open.len();
            open.extend(rungs.iter().flat_map(Rung::instructions).map(|(_, one)| one));
            open[first..].reverse();
        }
    }
    places
}

/// Each bit with an alarm, at the place of one that nothing writes.
fn alarm_bits(program: &Program) -> NumberMap<Bit, usize> {
    let alarms = program.tags.iter().filter(|tag| tag.alarm.is_some());
    let bits = alarms.filter_map(|tag| match tag.meaning {
        TagMeaning::Address(Address::Bit(bit)) => Some((bit, 0)),
        TagMeaning::Address(Address::Word(_) | Address::Structure(_))
        | TagMeaning::Constant(..)
        | TagMeaning::Real(_)
        | TagMeaning::Array(_) => None,
    });
    bits.collect()
}

/// The bits that an instruction can turn ON.
fn written(instruction: &Instruction) -> Vec<Bit> {
    let mut bits: Vec<Bit> = instruction.written_bits().collect();
    let flags = instruction.owned().map(|owned| owned.member_addresses()).into_iter().flatten();
    bits.extend(flags.filter_map(|address| match address {
        Address::Bit(bit) => Some(bit),
        Address::Word(_) | Address::Structure(_) => None,
    }));
    bits.extend(instruction.target_block().map(|block| Bit::Running(block.value)));
    bits.extend(instruction.operands.of().map(|(_, stage)| Bit::Stage(stage.value)));
    bits
}
