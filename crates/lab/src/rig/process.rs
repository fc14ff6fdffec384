//! The end of a process and the start of the next one, with the content of retentive memory.
//!
//! Field devices and the levels of inputs stay as they are: the plant does not restart with its
//! controller. Forces and queued writes end.

use super::Rig;
use super::mode::{MS_NS, PowerOff, RigMode};
use super::retained::{FoundMemory, ImageTime, ProcessStart};
use rungd_engine::Engine;
use rungd_runtime::Taped;

impl Rig {
    /// A new process after an orderly end, and after `down_ms` without a process. In RUN, call
    /// [`Rig::request_stop`] and scan once first.
    pub fn restart(&mut self, down_ms: u32) {
        if self.scans > 0
            && let Some(retained) = &mut self.retained
        {
            let end = ImageTime { ns: self.next_ns, is_final: true, scanned_at: self.scanned_at };
            retained.keep(self.machine.engine().image(), end);
        }
        self.begin_process(PowerOff { down_ms, lose_ms: 0 });
    }

    /// A new process after a crash.
    pub fn power_cut(&mut self, off: PowerOff) {
        self.settle_images();
        self.begin_process(off);
    }

    fn begin_process(&mut self, PowerOff { down_ms, lose_ms }: PowerOff) {
        self.next_ns += u64::from(down_ms) * MS_NS;
        let now = ProcessStart { ns: self.next_ns, clock: self.time_of_day() };
        let found = match &mut self.retained {
            Some(retained) => retained.begin(&self.program, now, u64::from(lose_ms) * MS_NS),
            None => FoundMemory::Nothing,
        };
        let mut engine = Engine::new(self.program.code.clone());
        if let FoundMemory::Image { puts, is_final, down_seconds } = &found {
            puts.iter().for_each(|(cell, value)| engine.restore(*cell, *value));
            if !is_final {
                engine.terminate_all();
            }
            engine.put_down_seconds(*down_seconds);
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
