//! The end of a process and the start of the next one, with the content of retentive memory.
//!
//! Field devices and the levels of inputs stay as they are: the plant does not restart with its
//! controller. Forces and queued writes end.

use super::Rig;
use super::mode::{MS_NS, RigMode};
use super::retained::{FoundMemory, ImageTime};
use rungd_engine::Engine;
use rungd_runtime::Taped;

impl Rig {
    /// A new process after an orderly end. In RUN, call [`Rig::request_stop`] and scan once first.
    pub fn restart(&mut self) {
        if self.scans > 0
            && let Some(retained) = &mut self.retained
        {
            let end = ImageTime { ns: self.next_ns, is_final: true };
            retained.keep(self.machine.engine().image(), end);
        }
        self.begin_process(0);
    }

    /// A new process after a crash. It finds an image of retentive memory that is at least
    /// `lose_ms` older than the newest one.
    pub fn power_cut(&mut self, lose_ms: u32) {
        self.settle_images();
        self.begin_process(u64::from(lose_ms) * MS_NS);
    }

    fn begin_process(&mut self, lost_ns: u64) {
        let found = match &mut self.retained {
            Some(retained) => retained.begin(&self.program, self.next_ns, lost_ns),
            None => FoundMemory::Nothing,
        };
        let mut engine = Engine::new(self.program.code.clone());
        if let FoundMemory::Image { puts, is_final } = &found {
            puts.iter().for_each(|(cell, value)| engine.restore(*cell, *value));
            if !is_final {
                engine.terminate_all();
            }
        }
        self.machine = match &mut self.tape {
            Some(tape) => tape.begin_process(engine),
            None => Taped::new(engine),
        };
        (self.scans, self.generation) = (0, 0);
        self.forces.clear();
        self.writes.clear();
        self.field.begin_process(&self.program, self.next_ns);
        match found {
            FoundMemory::Image { .. } | FoundMemory::Nothing => self.start(),
            FoundMemory::NothingInStop => self.enter(RigMode::Stop),
        }
        self.settle();
    }
}
