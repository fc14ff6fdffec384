//! Instructions that could change a value that nothing wrote in the last scan, and the hindrance of
//! each: its block or Stage does not run, or its rung is OFF.

use super::answer::{Hindrance, Idle};
use super::decide::{Decides, decides};
use super::inquiry::Inquiry;
use super::past::TapeMoment;
use super::watch::Watch;
use rungd_engine::isa::{Address, Bit, OperandRole};
use rungd_engine::{Cell, EngineCall, ScanStep};
use rungd_language::resolve::program::Instruction;
use rungd_runtime::TapeEntry;

/// The maximum number of instructions in the answer.
const IDLE_MAX: usize = 3;

impl Inquiry<'_> {
    /// The instructions that could change a cell that has a value.
    pub fn idle(&mut self, cell: Cell, value: i32, at: TapeMoment, depth: u32) -> Vec<Idle> {
        if depth == 0 {
            return Vec::new();
        }
        let subject = self.subject;
        let address = subject.symbols.layout.address(cell);
        let mut writers = Vec::new();
        for deed in subject.writers(cell) {
            let Some(site) = subject.site(deed).filter(|_| matches!(deed, ScanStep::Batch(_)))
            else {
                continue;
            };
            let Some(number) = site.instruction else { continue };
            let Some(instruction) = subject.instruction(site.part, number) else { continue };
            if could_change(instruction, address, value) {
                writers.push((deed, site.part, instruction));
            }
        }
        writers.truncate(IDLE_MAX);
        let subroutines = writers.iter().map(|(_, part, _)| subject.part(*part).element.block);
        writers.extend(subject.calls_to(subroutines.collect()).into_iter().take(IDLE_MAX));
        let deeds = writers.iter().map(|(deed, ..)| *deed).collect();
        let mut watch =
            Watch::new(subject, cell, deeds, if at.step > 0 { at.step } else { u32::MAX });
        let seen = self.last_execution(at);
        if let Some(entry) = seen.filter(|_| !writers.is_empty()) {
            self.replay.see(entry.section, entry.entry, &mut watch);
        }
        let mut idle = Vec::new();
        for (_, part, instruction) in writers {
            let because = match (self.stopped(part, at), seen) {
                (Some((bit, running)), _) => {
                    if let Bit::Running(block) = bit {
                        self.stopped.push(block);
                    }
                    let operand = subject.operand(running);
                    Hindrance::Stopped(operand, self.follow(running, 0, at, depth))
                }
                (None, Some(entry)) if watch.seen.contains_key(&part) => {
                    let legs = self.legs(part, &watch.leaves(part), entry, depth);
                    // A rung that is ON is no hindrance: the instruction executes later, or has
                    // executed.
                    if legs.iter().all(|leg| leg.on) {
                        continue;
                    }
                    Hindrance::Legs(legs)
                }
                (None, _) => continue,
            };
            let (rung, place) = (subject.place_of_rung(part), subject.place(instruction.span));
            idle.push(Idle { rung, place, because });
        }
        idle
    }

    /// The bit of a part's block or Stage, if it is OFF.
    fn stopped(&mut self, part: u32, at: TapeMoment) -> Option<(Bit, Cell)> {
        let element = self.subject.part(part).element;
        if self.subject.program.block(element.block).is_subroutine() {
            return None;
        }
        let stage = element.stage.map(Bit::Stage);
        [Bit::Running(element.block)].into_iter().chain(stage).find_map(|bit| {
            let cell = Cell::Bit(self.subject.symbols.layout.bit(bit));
            (self.replay.value(cell, at) == 0).then_some((bit, cell))
        })
    }

    /// The execution of the last scan that began before a moment.
    pub fn last_execution(&mut self, at: TapeMoment) -> Option<TapeMoment> {
        let (section, begin) = self.replay.last_begin(at)?;
        let section_tape = self.replay.section(section)?;
        let is_it = |entry: &TapeEntry| *entry == TapeEntry::Call(EngineCall::Execute);
        let entry = begin + section_tape.entries.get(begin..)?.iter().position(is_it)?;
        let entry = TapeMoment { section, entry, step: 0 };
        (entry < at).then_some(entry)
    }
}

/// Whether an instruction could change the value of a bit or word that it writes.
fn could_change(instruction: &Instruction, address: Option<Address>, value: i32) -> bool {
    if decides(instruction, address) == Decides::LeavesAlone {
        return false;
    }
    let is_off = value == 0;
    match instruction.acting_role() {
        Some(OperandRole::TurnsOn | OperandRole::Starts) => is_off,
        // EXIT has no operand, and stops its own Program.
        Some(OperandRole::TurnsOff | OperandRole::Stops) | None => !is_off,
        Some(OperandRole::Enters | OperandRole::Awaits) => {
            let is = |stage| address == Some(Address::Bit(Bit::Stage(stage)));
            instruction.stages_entered().any(is) == is_off
        }
        Some(OperandRole::Reads | OperandRole::Calls) => false,
        Some(
            OperandRole::Drives
            | OperandRole::Stores
            | OperandRole::Changes
            | OperandRole::Owns
            | OperandRole::Resets
            | OperandRole::Enables,
        ) => true,
    }
}
