//! The controller of a random run, and what happens to it: lost devices, stops, new processes,
//! changed inputs.
//!
//! `random_run` decides what happens in which scan; this module does it. A stop takes the scan in
//! which it happens; what follows it, RUN or a new process, comes before the next scan. A
//! controller that waits in STOP after a power cut is started at once, as an operator would.

use super::operand_access::start;
use super::suite::{Incident, RandomSource, RandomTest};
use crate::rig::{PowerOff, Rig, RigMode, RigProgram, RigSetup, TapeListener};
use rungd_engine::isa::DeviceId;
use rungd_runtime::exchange::Ticket;
use std::sync::Arc;

/// A choice of the generator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RandomDraw {
    /// A bit goes ON, or OFF.
    Toggle(bool),
    /// A step up, or down.
    Walk(bool),
    /// The content to jump to.
    Jump(i32),
    /// The device is lost, or comes back.
    Lose(bool),
    /// The incident happens.
    Happens,
}

/// The value of an event that began a new process which waited in STOP, and was started.
pub(super) const STARTED: i32 = 1;

/// The controller of a random run.
pub(super) struct RandomWorld<'t> {
    pub rig: Rig,
    test: &'t RandomTest,
    /// The devices that are lost.
    lost: Vec<DeviceId>,
    /// What follows the stop of this scan.
    next: AfterStop,
    /// Whether the scan is the first one of a RUN.
    begins_run: bool,
}

/// What follows a stop.
#[derive(Clone, Copy, PartialEq, Eq)]
enum AfterStop {
    /// Nothing: the ladder has stopped the controller.
    Nothing,
    Run,
    NewProcess,
}

impl<'t> RandomWorld<'t> {
    /// A controller after a cold start. `listener` receives the tape.
    pub fn new(
        program: &Arc<RigProgram>,
        test: &'t RandomTest,
        listener: Option<Box<dyn TapeListener>>,
    ) -> RandomWorld<'t> {
        let (keeps_images, is_taped) = (test.begins_processes(), listener.is_some());
        let setup = RigSetup { keeps_images, is_taped, ..RigSetup::default() };
        let setup = start(&test.set, setup);
        let mut rig = Rig::new(program, &setup);
        if let Some(listener) = listener {
            rig.listen(listener);
        }
        let (lost, next) = (Vec::new(), AfterStop::Nothing);
        RandomWorld { rig, test, lost, next, begins_run: false }
    }

    /// Before the incidents and changes of a scan: does what follows the last stop. Returns false
    /// if the ladder has stopped the controller.
    pub fn continues(&mut self) -> bool {
        if self.rig.mode() == RigMode::Run {
            return true;
        }
        match std::mem::replace(&mut self.next, AfterStop::Nothing) {
            AfterStop::Nothing => return false,
            AfterStop::Run => self.rig.start(),
            AfterStop::NewProcess => self.rig.restart(0),
        }
        self.begins_run = true;
        true
    }

    /// Whether a RUN begins with this scan; asked once, right before it.
    pub fn begins_run(&mut self) -> bool {
        std::mem::take(&mut self.begins_run)
    }

    /// Does what a choice says; returns the new content of the cell, and for an incident
    /// [`STARTED`] or 0. `None`: it changes nothing.
    pub fn happens(&mut self, source: usize, draw: RandomDraw, value: i32) -> Option<i32> {
        match self.test.source(source) {
            RandomSource::Change(change) => {
                let is_now = change.operand.value(&self.rig);
                change.operand.give(&mut self.rig, value, Ticket(0));
                (value != is_now || change.is_certain()).then_some(value)
            }
            RandomSource::Incident(incident) => self.incident(incident, draw),
        }
    }

    fn incident(&mut self, incident: &Incident, draw: RandomDraw) -> Option<i32> {
        match incident {
            Incident::Device { id, .. } => {
                let is_lost = draw == RandomDraw::Lose(true);
                if self.is_lost(*id) == is_lost {
                    return None;
                }
                match is_lost {
                    true => {
                        self.lost.push(*id);
                        self.rig.lose_device(*id);
                    }
                    false => {
                        self.lost.retain(|lost| lost != id);
                        self.rig.restore_device(*id);
                    }
                }
            }
            Incident::PowerCut => {
                self.rig.power_cut(PowerOff { down_ms: 0, lose_ms: 0 });
                self.next = AfterStop::Nothing;
                self.begins_run = true;
                if self.rig.mode() == RigMode::Stop {
                    self.rig.start();
                    return Some(STARTED);
                }
            }
            Incident::Restart => self.stops(AfterStop::NewProcess),
            Incident::Stop if self.next == AfterStop::Nothing => self.stops(AfterStop::Run),
            Incident::Stop => return None,
        }
        Some(0)
    }

    /// Whether a device is lost.
    pub fn is_lost(&self, device: DeviceId) -> bool {
        self.lost.contains(&device)
    }

    fn stops(&mut self, next: AfterStop) {
        self.rig.request_stop();
        self.next = next;
    }
}
