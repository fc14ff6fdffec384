//! Two engines on one recording: the recorded program, and a new program with the same inputs.
//!
//! `rungd replay --ladder` calls it, section by section. At the first section and after each gap,
//! the new program takes over the memory of the recorded one, as in a reload. The recorded inputs
//! and writes go to the same operands, which may have different cells in the new program.

use std::collections::VecDeque;
use std::ops::{ControlFlow, Range};
use std::sync::Arc;

use super::programs::{PlayableProgram, RecordedPrograms};
use super::replay::{Playback, PlayedScan, PlayedStep, Unplayable};
use crate::record::{Recording, SectionBody};
use rungd_engine::{Cell, Engine, EngineCall, EngineState, Transfer};
use rungd_runtime::exchange::Mode;
use rungd_runtime::{TapeEntry, TapeSection};
use rungd_state::reload::{LoweredProgram, ReloadPlan};

/// Both programs at the end of a scan.
pub struct TwinScan<'a> {
    /// The scan.
    pub scan: PlayedScan,
    /// The index of the old program among the recorded ones.
    pub place: usize,
    /// The engine of the old program.
    pub old: &'a Engine,
    /// The engine of the new program.
    pub new: &'a Engine,
}

/// Both programs.
pub struct TwinRun<'a> {
    programs: &'a RecordedPrograms,
    new_program: &'a PlayableProgram,
    /// The recorded program.
    old: Playback<&'a RecordedPrograms>,
    new: Option<NewRun>,
    /// The number of sections whose end was compared with the recorded hash.
    pub compared: u64,
    /// The number of those that differ.
    pub different: u64,
    /// The scans that were executed.
    pub scans: u64,
    /// How often the new program took over the memory of the old one.
    pub carried: u64,
    /// The last scan of the new program, if it stopped by itself.
    pub stopped: Option<PlayedScan>,
}

/// The new program.
struct NewRun {
    engine: Engine,
    /// The index of the old program among the recorded ones, and the transfer from its cells.
    place: usize,
    transfer: Transfer,
    /// Its last scan, if it has stopped by itself.
    last: Option<PlayedScan>,
}

impl<'a> TwinRun<'a> {
    /// Both programs, before the first section.
    pub fn new(
        recording: &Arc<Recording>,
        programs: &'a RecordedPrograms,
        new_program: &'a PlayableProgram,
    ) -> TwinRun<'a> {
        let old = Playback::new(Arc::clone(recording), programs);
        let (compared, different, scans, carried) = (0, 0, 0, 0);
        TwinRun {
            programs,
            new_program,
            old,
            new: None,
            compared,
            different,
            scans,
            carried,
            stopped: None,
        }
    }

    /// Executes a section, and calls `visit` at the end of each scan.
    ///
    /// # Errors
    /// The reason why the section cannot be executed.
    pub fn section(
        &mut self,
        at: usize,
        visit: &mut impl FnMut(&TwinScan),
    ) -> Result<ControlFlow<()>, String> {
        let body = self.seek(at)?;
        let ended = self.play(at, &body, visit)?;
        if ended.is_continue()
            && let Some(same) = self.old.is_as_recorded(at).map_err(reason)?
        {
            self.compared += 1;
            self.different += u64::from(!same);
        }
        Ok(ended)
    }

    /// The past of the new program in these sections, for questions: at most the newest `most`
    /// sections, and only those after the last section that cannot be executed.
    pub fn past(&mut self, sections: Range<usize>, most: usize) -> Vec<Arc<TapeSection>> {
        let mut past = VecDeque::new();
        for at in sections {
            match self.new_section(at) {
                Ok(section) => past.push_back(Arc::new(section)),
                Err(_) => past.clear(),
            }
            if past.len() > most {
                past.pop_front();
            }
        }
        past.into()
    }

    /// Executes a section, and returns it as a section of the new program.
    fn new_section(&mut self, at: usize) -> Result<TapeSection, String> {
        let body = self.seek(at)?;
        let new = self.new.as_ref().ok_or("it has no engine")?;
        let state = EngineState::of(&new.engine);
        let there = |entry: &TapeEntry| match entry.call() {
            Some(call) => new.translate(call).map(TapeEntry::Call),
            None => Some(*entry),
        };
        let entries = body.entries.iter().filter_map(there).collect();
        let start = self.old.recording().start(at, &body);
        let _ = self.play(at, &body, &mut |_| {})?;
        Ok(TapeSection { start, state, entries, who: body.who })
    }

    /// Reads a section, and brings both programs to its start.
    fn seek(&mut self, at: usize) -> Result<SectionBody, String> {
        let continues = self.old.continues_at(at);
        let body = self.old.seek(at).map_err(reason)?;
        let place = self.programs.place(at);
        let known = self.new.take().filter(|_| continues);
        if known.as_ref().is_some_and(|new| new.place == place) {
            self.new = known;
            return Ok(body);
        }
        let old_program = self.programs.program(at).map_err(Clone::clone)?;
        let transfer = ReloadPlan::new(side(old_program), side(self.new_program)).transfer;
        let new = match known {
            // The recorded program was reloaded: the new program continues.
            Some(new) => NewRun { place, transfer, ..new },
            None => {
                self.carried += 1;
                let state = EngineState::of(self.old.engine().map_err(reason)?);
                let mut old = old_program.engine();
                old.resume(&state);
                let mut engine = self.new_program.engine();
                let forces: Vec<Cell> = state.forced(old_program.layout()).collect();
                engine.adopt(&mut old, &transfer, body.mode == Mode::Run, &forces);
                NewRun { engine, place, transfer, last: None }
            }
        };
        self.new = Some(new);
        Ok(body)
    }

    /// Executes a section with both programs.
    fn play(
        &mut self,
        at: usize,
        body: &SectionBody,
        visit: &mut impl FnMut(&TwinScan),
    ) -> Result<ControlFlow<()>, String> {
        let TwinRun { old, new, scans, stopped, .. } = self;
        let new = new.as_mut().ok_or("it has no engine")?;
        let played = old.play(at, body, &mut |step, old| {
            if let (EngineCall::Begin { .. }, Some(last)) = (step.call, new.last) {
                *stopped = Some(last);
                return ControlFlow::Break(());
            }
            new.apply(&step);
            if step.call == EngineCall::Execute {
                *scans += 1;
                let (scan, place, new) = (step.scan, new.place, &new.engine);
                visit(&TwinScan { scan, place, old, new });
            }
            ControlFlow::Continue(())
        });
        played.map_err(reason)
    }
}

impl NewRun {
    /// Makes the call that the old program has made.
    fn apply(&mut self, step: &PlayedStep) {
        match step.call {
            EngineCall::Execute => {
                self.last = self.engine.execute().last.then_some(step.scan);
                return;
            }
            EngineCall::Start { .. } | EngineCall::Terminate => self.last = None,
            EngineCall::Write(..)
            | EngineCall::Force(..)
            | EngineCall::Release(_)
            | EngineCall::RequestStop
            | EngineCall::Begin { .. } => {}
        }
        if let Some(call) = self.translate(step.call) {
            self.engine.apply(call);
        }
    }

    /// A call of the old program as a call of the new program; `None` if the new program has no
    /// such cell.
    fn translate(&self, call: EngineCall) -> Option<EngineCall> {
        let there = |cell: Cell| self.transfer.cell(cell);
        match call {
            EngineCall::Write(cell, value) => Some(EngineCall::Write(there(cell)?, value)),
            EngineCall::Force(cell, value) => Some(EngineCall::Force(there(cell)?, value)),
            EngineCall::Release(cell) => Some(EngineCall::Release(there(cell)?)),
            EngineCall::Start { .. }
            | EngineCall::RequestStop
            | EngineCall::Begin { .. }
            | EngineCall::Execute
            | EngineCall::Terminate => Some(call),
        }
    }
}

/// Why a section cannot be executed, without the words of a list of sections.
fn reason(why: Unplayable) -> String {
    match why {
        Unplayable::Io(error) => error.to_string(),
        Unplayable::NoEngine(why) => why,
        Unplayable::Damaged | Unplayable::NoBase | Unplayable::DoesNotFit => why.to_string(),
    }
}

fn side(program: &PlayableProgram) -> LoweredProgram<'_> {
    LoweredProgram { program: &program.code, symbols: &program.symbols }
}
