//! The Programs whose Stages are retained: what a start restores of them.
//!
//! Bits behind all addresses hold, for each of these Programs, whether it runs and which of its
//! Stages are ON, as at the end of the last scan. `scan` brings them up to date behind every scan,
//! and restores from them at the change to RUN. The passes of a stop do not touch them, so every
//! image of retentive memory has them, whatever the mode; `retain` and `reload` put them in place.
//!
//! Behaviour: `docs/semantics.md`, section 4, *Retained Stages*.

use super::events::BlockEvent;
use super::image::BitCell;
use super::machine::Machine;
use super::program::EngineProgram;
use super::resume_bits::ResumeBits;
use crate::isa::{Bit, BlockId, StageId};

impl EngineProgram {
    fn kept(&self, id: BlockId) -> Option<ResumeBits> {
        self.kept.iter().find(|kept| kept.program == id).copied()
    }
}

impl Machine {
    /// Notes what a start would restore. Called at the end of every scan, before any passes.
    pub fn keep_stages(&mut self) {
        for at in 0..self.program.kept.len() {
            let kept = self.program.kept[at];
            let runs = self.is_running(kept.program);
            let begins = self.state(kept.program).first_turn;
            let stages = self.program.block(kept.program).stages.clone();
            let BitCell(first) = self.program.layout.bit(Bit::Stage(StageId(stages.start)));
            let bits = &mut self.memory.image.bits;
            let mut put = |BitCell(cell): BitCell, on: bool| bits[cell as usize] = u8::from(on);
            put(kept.holds(), true);
            put(kept.running(), runs);
            put(kept.begins(), runs && begins);
            let on = first as usize..(first + kept.stages) as usize;
            bits.copy_within(on, kept.stage(0).0 as usize);
        }
    }

    /// After a swap in STOP: a Program begins at its initial Stage if it would go on without one,
    /// because the old program's Stages that it loses were ON.
    pub fn restage_kept(&mut self, id: BlockId, old: &Machine, lost: &[StageId]) {
        let Some(kept) = self.program.kept(id) else { return };
        let image = &mut self.memory.image;
        let none_on = !(0..kept.stages).any(|n| image.bit(kept.stage(n)));
        if image.bit(kept.running()) && none_on && lost.iter().any(|stage| old.keeps(*stage)) {
            let BitCell(begins) = kept.begins();
            image.bits[begins as usize] = 1;
        }
    }

    /// Whether a start would turn a Stage ON.
    fn keeps(&self, StageId(stage): StageId) -> bool {
        self.program.kept.iter().any(|kept| {
            let stages = &self.program.block(kept.program).stages;
            let n = stage.wrapping_sub(stages.start);
            n < kept.stages && self.memory.image.bit(kept.stage(n))
        })
    }

    /// Restores a Program whose Stages are retained; returns false if there is nothing to restore.
    /// The Program goes on in its Stages as if they had been entered just before.
    pub fn restore_program(&mut self, id: BlockId) -> bool {
        let Some(kept) = self.program.kept(id) else { return false };
        let is_on = |machine: &Machine, cell: BitCell| machine.memory.image.bit(cell);
        if !is_on(self, kept.holds()) {
            return false;
        }
        if !is_on(self, kept.running()) {
            return true;
        }
        if is_on(self, kept.begins()) {
            self.mark_started(id);
            return true;
        }
        self.put_bit(Bit::Running(id), true);
        self.put_bit(Bit::Done(id), false);
        self.events.push(BlockEvent::Started(id));
        for (n, stage) in (0..).zip(self.program.stages_of(id)) {
            self.switch_stage(stage, is_on(self, kept.stage(n)));
        }
        true
    }
}
