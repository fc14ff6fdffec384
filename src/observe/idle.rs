//! Instructions that could change a value that nothing wrote in the last scan, and the hindrance of
//! each: its block or Stage does not run, or its rung is OFF.

use super::answer::{Hindrance, Idle};
use super::decide::{Decides, decides};
use super::inquiry::Inquiry;
use super::past::Moment;
use super::watch::Watch;
use crate::engine::{Cell, Deed, EngineCall};
use crate::isa::{Address, Bit, ElementId, StageId};
use crate::resolve::instruction::Coil;
use crate::resolve::program::Action;
use crate::runtime::TapeEntry;
use crate::source::span::Located;

/// The maximum number of instructions in the answer.
const IDLE_MAX: usize = 3;

impl Inquiry<'_> {
    /// The instructions that could change a cell that has a value.
    pub fn idle(
        &mut self,
        (cell, address): (Cell, Option<Address>),
        value: i32,
        at: Moment,
        depth: u32,
    ) -> Vec<Idle> {
        if depth == 0 {
            return Vec::new();
        }
        let subject = self.subject;
        let mut writers = Vec::new();
        for deed in subject.writers(cell) {
            let Some(site) = subject.site(deed).filter(|_| matches!(deed, Deed::Batch(_))) else {
                continue;
            };
            let Some(number) = site.instruction else { continue };
            let Some(instruction) = subject.instruction(site.part, number) else { continue };
            let element = subject.part(site.part).element;
            if could_change(&instruction.action, (address, value), element) {
                writers.push((deed, site.part, instruction));
            }
        }
        writers.truncate(IDLE_MAX);
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
                    let operand = subject.names.operand(&subject.symbols, running);
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
    fn stopped(&mut self, part: u32, at: Moment) -> Option<(Bit, Cell)> {
        let element = self.subject.part(part).element;
        let stage = element.stage.map(Bit::Stage);
        [Bit::Running(element.block)].into_iter().chain(stage).find_map(|bit| {
            let cell = Cell::Bit(self.subject.symbols.layout.bit(bit));
            (self.replay.value(cell, at) == 0).then_some((bit, cell))
        })
    }

    /// The execution of the last scan that began before a moment.
    pub fn last_execution(&mut self, at: Moment) -> Option<Moment> {
        let (section, begin) = self.replay.last_begin(at)?;
        let of = self.replay.section(section)?;
        let is_it = |entry: &TapeEntry| *entry == TapeEntry::Call(EngineCall::Execute);
        let entry = begin + of.entries.get(begin..)?.iter().position(is_it)?;
        let entry = Moment { section, entry, step: 0 };
        (entry < at).then_some(entry)
    }
}

/// Whether an instruction could change the value of a bit or word.
fn could_change(
    action: &Action,
    (address, value): (Option<Address>, i32),
    element: ElementId,
) -> bool {
    if decides(action, address) == Decides::LeavesAlone {
        return false;
    }
    let is_off = value == 0;
    let stage = match address {
        Some(Address::Bit(Bit::Stage(stage))) => Some(stage),
        Some(Address::Bit(_) | Address::Word(_) | Address::Structure(_)) | None => None,
    };
    let is = |of: &Located<StageId>| Some(of.value) == stage;
    match action {
        Action::Coil { coil, bit: _ } => match coil {
            Coil::Out | Coil::Pd | Coil::Nd | Coil::Ponoff => true,
            Coil::Set => is_off,
            Coil::Rst => !is_off,
        },
        Action::SetElement { on, bit: _ } => *on == is_off,
        Action::Counter { .. }
        | Action::UpDownCounter { .. }
        | Action::DelayTimer { .. }
        | Action::Timer { .. }
        | Action::Sensaphone { .. }
        | Action::Store { .. }
        | Action::Copy { .. }
        | Action::Fill { .. }
        | Action::Shift { .. }
        | Action::Reset { .. }
        | Action::Math { .. } => true,
        Action::Run { .. } | Action::Restart { .. } => is_off,
        Action::Entask { .. } => true,
        Action::Halt { .. } | Action::Exit => !is_off,
        Action::Jump { stages } if is_off => stages.iter().any(is),
        Action::Jump { stages } => element.stage == stage && !stages.iter().any(is),
        Action::StageOn { .. } => is_off,
        Action::StageOff { .. } => !is_off,
        Action::Converge { stages: _, to } => is(to) == is_off,
        Action::Stop => false,
    }
}
