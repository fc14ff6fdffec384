//! Two engines on one recording: the recorded program, and a new program with the same inputs.
//!
//! `replay_ladder` calls it, section by section. At the first section and after each gap, the new
//! program takes over the memory of the recorded one, as in a reload. The recorded inputs and
//! writes go to the same operands, which may have different cells in the new program.

use std::collections::VecDeque;
use std::ops::{ControlFlow, Range};
use std::sync::Arc;

use super::recorded_plant::{RecordedPlant, RecordedPlants};
use rungd_engine::{BitCell, Cell, Engine, EngineCall, EngineState, Transfer, WordCell};
use rungd_history::record::{Recording, ReplayedScan, SectionBody, fits, state_hash};
use rungd_runtime::exchange::Mode;
use rungd_runtime::{NumberedCall, TapeEntry, TapeSection, numbered_calls};
use rungd_state::reload::{ReloadPlan, Side};

/// Both programs at the end of a scan.
pub(super) struct TwinScan<'a> {
    pub scan: ReplayedScan,
    /// The index of the old program among the recorded ones.
    pub place: usize,
    pub old: &'a Engine,
    pub new: &'a Engine,
}

/// Both engines.
pub(super) struct TwinRun<'a> {
    recording: &'a Recording,
    plants: &'a RecordedPlants,
    new_plant: &'a RecordedPlant,
    /// The engines, and the transfer from cells of the old one to cells of the new one.
    engines: Option<Engines>,
    /// The section at whose start the engines are.
    at: Option<usize>,
    /// The number of sections whose end was compared with the recorded hash, and the number of
    /// those that differ.
    pub compared: u64,
    pub different: u64,
    pub scans: u64,
    /// How often the new program took over the memory of the old one.
    pub carried: u64,
    /// The last scan of the new program, if it stopped by itself.
    pub stopped: Option<ReplayedScan>,
}

struct Engines {
    place: usize,
    old: Engine,
    new: Engine,
    transfer: Transfer,
    /// The last scan of the new program, if it has stopped by itself.
    last: Option<ReplayedScan>,
}

impl<'a> TwinRun<'a> {
    /// Both programs, before the first section.
    pub fn new(
        recording: &'a Recording,
        plants: &'a RecordedPlants,
        new_plant: &'a RecordedPlant,
    ) -> TwinRun<'a> {
        let (engines, at, stopped) = (None, None, None);
        let (compared, different, scans, carried) = (0, 0, 0, 0);
        TwinRun {
            recording,
            plants,
            new_plant,
            engines,
            at,
            compared,
            different,
            scans,
            carried,
            stopped,
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
        let body = self.open(at)?;
        let ended = self.execute(at, &body, visit)?;
        if ended.is_continue() {
            let Some(engines) = &self.engines else { return Err("it has no engine".into()) };
            if let Some(hash) = self.recording.head(at).end_hash {
                self.compared += 1;
                self.different += u64::from(hash != state_hash(&EngineState::of(&engines.old)));
            }
            self.at = Some(at + 1);
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
        let body = self.open(at)?;
        let Some(engines) = &self.engines else { return Err("it has no engine".into()) };
        let state = EngineState::of(&engines.new);
        let there = |entry: &TapeEntry| match *entry {
            TapeEntry::Call(call) => engines.there(call).map(TapeEntry::Call),
            TapeEntry::Origin(_)
            | TapeEntry::Number(_)
            | TapeEntry::Mode(_)
            | TapeEntry::Swap { .. }
            | TapeEntry::State { .. }
            | TapeEntry::Lost { .. } => Some(*entry),
        };
        let entries = body.entries.iter().filter_map(there).collect();
        let start = self.recording.start(at, &body);
        if self.execute(at, &body, &mut |_| {})?.is_continue() {
            self.at = Some(at + 1);
        }
        Ok(TapeSection { start, state, entries, who: body.who })
    }

    /// Reads a section, and sets the engines to its start.
    fn open(&mut self, at: usize) -> Result<SectionBody, String> {
        let goes_on = self.at.take() == Some(at) && self.recording.follows(at);
        let read = self.recording.read(at).map_err(|error| error.to_string())?;
        let (base, body) = read.ok_or("its bytes are damaged")?;
        self.prepare(at, goes_on, base.as_ref(), &body)?;
        Ok(body)
    }

    fn prepare(
        &mut self,
        at: usize,
        goes_on: bool,
        base: Option<&EngineState>,
        body: &SectionBody,
    ) -> Result<(), String> {
        let place = self.plants.place(at);
        if goes_on && self.engines.as_ref().is_some_and(|engines| engines.place == place) {
            return Ok(());
        }
        let plant = self.plants.plant(at).map_err(Clone::clone)?;
        let state = base.ok_or("no base image leads to it")?;
        let resumed = || {
            let mut engine = Engine::new(plant.engine.clone());
            engine.resume(state).then_some(engine).ok_or("it does not fit its program")
        };
        let old = resumed()?;
        let transfer = ReloadPlan::new(side(plant), side(self.new_plant)).transfer;
        let kept = self.engines.take().filter(|_| goes_on);
        let (new, last) = match kept {
            // The recorded program was reloaded: the new program continues.
            Some(engines) => (engines.new, engines.last),
            None => {
                self.carried += 1;
                let forces = forced(plant, state);
                let mut new = Engine::new(self.new_plant.engine.clone());
                let is_running = body.mode == Mode::Run;
                new.adopt(&mut resumed()?, &transfer, is_running, &forces);
                (new, None)
            }
        };
        self.engines = Some(Engines { place, old, new, transfer, last });
        Ok(())
    }

    fn execute(
        &mut self,
        at: usize,
        body: &SectionBody,
        visit: &mut impl FnMut(&TwinScan),
    ) -> Result<ControlFlow<()>, String> {
        let Some(engines) = &mut self.engines else { return Err("it has no engine".into()) };
        let first = self.recording.head(at).number;
        for NumberedCall { call, number, now_ns, .. } in numbered_calls(&body.entries, first) {
            if !fits(call, &engines.old) {
                return Err("it does not fit its program".into());
            }
            if let (EngineCall::Begin { .. }, Some(last)) = (call, engines.last) {
                self.stopped = Some(last);
                return Ok(ControlFlow::Break(()));
            }
            let unix_ns = body.unix_offset_ns.saturating_add_unsigned(now_ns);
            let scan = ReplayedScan { number, unix_ns, section: at };
            engines.apply(call, &scan);
            if call == EngineCall::Execute {
                self.scans += 1;
                let Engines { place, old, new, .. } = engines;
                visit(&TwinScan { scan, place: *place, old, new });
            }
        }
        Ok(ControlFlow::Continue(()))
    }
}

impl Engines {
    /// Applies a call to both engines.
    fn apply(&mut self, call: EngineCall, scan: &ReplayedScan) {
        self.old.apply(call);
        match call {
            EngineCall::Execute => {
                self.last = self.new.execute().last.then_some(*scan);
                return;
            }
            EngineCall::Start { .. } | EngineCall::Terminate => self.last = None,
            EngineCall::Write(..)
            | EngineCall::Force(..)
            | EngineCall::Release(_)
            | EngineCall::RequestStop
            | EngineCall::Begin { .. } => {}
        }
        if let Some(call) = self.there(call) {
            self.new.apply(call);
        }
    }

    /// A call of the old program as a call of the new program; `None` if the new program has no
    /// such cell.
    fn there(&self, call: EngineCall) -> Option<EngineCall> {
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

fn side(plant: &RecordedPlant) -> Side<'_> {
    Side { program: &plant.engine, symbols: &plant.symbols }
}

/// The forced cells of a state.
fn forced(plant: &RecordedPlant, state: &EngineState) -> Vec<Cell> {
    let bits = (0..plant.layout().bit_count()).map(|at| Cell::Bit(BitCell(at)));
    let words = (0..plant.layout().word_count()).map(|at| Cell::Word(WordCell(at)));
    bits.chain(words).filter(|cell| state.is_forced(*cell)).collect()
}
