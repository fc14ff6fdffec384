//! Executes a recording again: every section with its state, every scan with its image. Computes
//! every hash again.
//!
//! `cli` replays, verifies and exports; `observe` gets its sections here. The caller makes the
//! engine of a program, because `record` lies below `load`. A recording from outside may not fit
//! its engine: such sections are refused.

use std::fmt;
use std::io;
use std::ops::{ControlFlow, Range};
use std::sync::Arc;

use super::block::state_hash;
use super::program::RecordedProgram;
use super::recording::{ReadSection, Recording};
use super::section::SectionBody;
use rungd_engine::{Engine, EngineCall, EngineState};
use rungd_runtime::{NumberedCall, Origin, TapeEntry, TapeSection, numbered_calls};

/// Why a section cannot be replayed.
#[derive(Debug)]
pub enum Unreplayable {
    /// Its file cannot be read.
    Io(io::Error),
    /// Its bytes have changed since they were written.
    Damaged,
    /// No base image leads to it.
    NoBase,
    /// The engine of its program cannot be made, with the reason.
    NoEngine(String),
    /// It does not fit its program.
    DoesNotFit,
}

/// The outcome of a verification.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Verified {
    /// The scans that were executed again.
    pub scans: u64,
    /// The sections that were executed again.
    pub sections: u64,
    /// The number of these sections whose end was compared.
    pub compared: u64,
    /// The sections that do not continue the section before them.
    pub gaps: u64,
    /// The sections that cannot be replayed.
    pub unreplayable: u64,
    /// The first section whose end differs from the recorded end.
    pub first_difference: Option<usize>,
}

/// A scan that was executed again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReplayedScan {
    /// Its number; the first of a process is 1.
    pub number: u64,
    /// Its time, ns since 1970 (UTC).
    pub unix_ns: i64,
    /// Its section.
    pub section: usize,
}

/// An engine, and the program that it executes.
pub type ReplayEngine = (Arc<RecordedProgram>, Box<Engine>);

/// A recording with an engine that executes it.
pub struct Replay<M> {
    recording: Arc<Recording>,
    make: M,
    engine: Option<ReplayEngine>,
    /// The section at whose start the engine is; `None`: at no start of a section.
    at: Option<usize>,
    /// The last section that could not be executed. Later sections that need it are refused without
    /// a new attempt.
    impassable: Option<usize>,
}

impl<M: FnMut(&RecordedProgram) -> Result<Engine, String>> Replay<M> {
    /// A replay; `make` makes the engine of a program, or returns the reason why it cannot.
    pub fn new(recording: impl Into<Arc<Recording>>, make: M) -> Replay<M> {
        Replay { recording: recording.into(), make, engine: None, at: None, impassable: None }
    }

    /// A replay that reuses the engine of a previous replay, if it is for the same program.
    pub fn going_on(
        recording: impl Into<Arc<Recording>>,
        make: M,
        engine: Option<ReplayEngine>,
    ) -> Replay<M> {
        Replay { engine, ..Replay::new(recording, make) }
    }

    /// The engine, for [`Replay::going_on`].
    pub fn into_engine(self) -> Option<ReplayEngine> {
        self.engine
    }

    /// The recording.
    pub fn recording(&self) -> &Arc<Recording> {
        &self.recording
    }

    /// A section with the state at its start.
    ///
    /// # Errors
    /// The reason why it cannot be replayed.
    pub fn section(&mut self, at: usize) -> Result<TapeSection, Unreplayable> {
        let body = self.open(at)?;
        let state = EngineState::of(self.engine()?);
        let start = self.recording.start(at, &body);
        let mut who = body.who;
        who.extend(self.late_who(at));
        Ok(TapeSection { start, state, entries: body.entries, who })
    }

    /// The engine at the start of a section.
    ///
    /// # Errors
    /// The reason why it cannot be reached.
    pub fn engine_at(&mut self, at: usize) -> Result<&Engine, Unreplayable> {
        self.open(at)?;
        self.engine()
    }

    /// Brings the engine to the start of a section, and returns the content of the section.
    fn open(&mut self, at: usize) -> Result<SectionBody, Unreplayable> {
        let base = self.recording.base_of(at).ok_or(Unreplayable::NoBase)?;
        if self.impassable.is_some_and(|section| (base..at).contains(&section)) {
            return Err(Unreplayable::NoBase);
        }
        let begin = self.at.filter(|now| (base..=at).contains(now)).unwrap_or(base);
        for section in begin..at {
            let opened = self.prepare(section);
            if opened.is_err() {
                self.impassable = Some(section);
            }
            let _ = self.execute(section, &opened?, &mut |_, _| ControlFlow::Continue(()))?;
        }
        self.prepare(at)
    }

    fn engine(&self) -> Result<&Engine, Unreplayable> {
        self.engine.as_ref().map(|(_, engine)| &**engine).ok_or(Unreplayable::NoBase)
    }

    /// Executes sections, and calls `visit` at the end of each scan. A `Break` ends the execution.
    ///
    /// # Errors
    /// The reason why the next section cannot be executed.
    pub fn scans(
        &mut self,
        sections: Range<usize>,
        mut visit: impl FnMut(ReplayedScan, &Engine) -> ControlFlow<()>,
    ) -> Result<(), Unreplayable> {
        for at in sections {
            let body = self.open(at)?;
            if self.execute(at, &body, &mut visit)?.is_break() {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Executes sections, and compares the state at the end of each with the recorded state.
    pub fn verify(&mut self, sections: Range<usize>) -> Verified {
        self.verify_seen(sections, |_, _| {}).0
    }

    /// As [`Replay::verify`]; also calls `visit` at the end of each scan, and returns all sections
    /// whose end differs from the recorded end.
    pub fn verify_seen(
        &mut self,
        sections: Range<usize>,
        mut visit: impl FnMut(ReplayedScan, &Engine),
    ) -> (Verified, Vec<usize>) {
        let (mut verified, mut different) = (Verified::default(), Vec::new());
        let first = sections.start;
        for at in sections {
            verified.gaps += u64::from(at > first && !self.recording.follows(at));
            let result = self.verify_one(at, &mut |scan, engine| {
                verified.scans += 1;
                visit(scan, engine);
                ControlFlow::Continue(())
            });
            match result {
                Ok(same) => {
                    verified.sections += 1;
                    verified.compared += u64::from(same.is_some());
                    if same == Some(false) {
                        different.push(at);
                    }
                }
                Err(_) => verified.unreplayable += 1,
            }
        }
        verified.first_difference = different.first().copied();
        (verified, different)
    }

    /// Whether the end of a section is equal to the recorded end; `None`: the recorded end is
    /// unknown.
    fn verify_one(
        &mut self,
        at: usize,
        visit: &mut impl FnMut(ReplayedScan, &Engine) -> ControlFlow<()>,
    ) -> Result<Option<bool>, Unreplayable> {
        // The state at the end of the section before it.
        let reached = if self.at == Some(at) && self.recording.follows(at) {
            self.engine.as_ref().map(|(program, engine)| (program.clone(), EngineState::of(engine)))
        } else {
            None
        };
        let body = self.open(at)?;
        let start = EngineState::of(self.engine()?);
        let goes_on = match &reached {
            Some((program, state)) if program == self.recording.program(at) => *state == start,
            Some(_) | None => true,
        };
        let _ = self.execute(at, &body, visit)?;
        let hash = self.recording.head(at).end_hash;
        let engine = self.engine()?;
        let same = hash.map(|hash| hash == state_hash(&EngineState::of(engine)));
        Ok(if goes_on { same } else { Some(false) })
    }

    fn read(&self, at: usize) -> Result<ReadSection, Unreplayable> {
        let read = self.recording.read(at).map_err(Unreplayable::Io)?;
        read.ok_or(Unreplayable::Damaged)
    }

    /// The names of senders for origins of a section that are written in the next section.
    fn late_who(&self, at: usize) -> Vec<(Origin, String)> {
        let next = at + 1;
        if next >= self.recording.count() || !self.recording.follows(next) {
            return Vec::new();
        }
        self.read(next).map_or_else(|_| Vec::new(), |(_, body)| body.who)
    }

    /// Brings the engine to the start of a section. The section has a base image, or the engine is
    /// already at its start. Checks that the section fits its program.
    fn prepare(&mut self, at: usize) -> Result<SectionBody, Unreplayable> {
        let (base, body) = self.read(at)?;
        let program = self.recording.program(at).clone();
        if let Some(state) = base {
            self.at = None;
            let (_, engine) = match &mut self.engine {
                Some(engine) if has_files_of(&engine.0, &program) => engine,
                engine => {
                    let made = (self.make)(&program).map_err(Unreplayable::NoEngine)?;
                    engine.insert((program.clone(), Box::new(made)))
                }
            };
            if !engine.resume(&state) {
                return Err(Unreplayable::DoesNotFit);
            }
            self.at = Some(at);
        }
        if let Some((of, _)) = &mut self.engine {
            *of = program;
        }
        if self.at != Some(at) {
            return Err(Unreplayable::NoBase);
        }
        let engine = self.engine()?;
        let fits = |entry: &TapeEntry| match entry {
            TapeEntry::Call(call) => fits(*call, engine),
            TapeEntry::Origin(_)
            | TapeEntry::Number(_)
            | TapeEntry::Mode(_)
            | TapeEntry::Swap { .. }
            | TapeEntry::State { .. }
            | TapeEntry::Lost { .. } => true,
        };
        if body.entries.iter().all(fits) { Ok(body) } else { Err(Unreplayable::DoesNotFit) }
    }

    /// Executes a section, and calls `visit` at the end of each scan. The engine is at the start of
    /// the section.
    fn execute(
        &mut self,
        at: usize,
        body: &SectionBody,
        visit: &mut impl FnMut(ReplayedScan, &Engine) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, Unreplayable> {
        self.at = None;
        let first = self.recording.head(at).number;
        let Some((_, engine)) = &mut self.engine else { return Err(Unreplayable::NoBase) };
        for NumberedCall { call, number, now_ns, .. } in numbered_calls(&body.entries, first) {
            engine.apply(call);
            let unix_ns = body.unix_offset_ns.saturating_add_unsigned(now_ns);
            let scan = ReplayedScan { number, unix_ns, section: at };
            if call == EngineCall::Execute && visit(scan, engine).is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        self.at = Some(at + 1);
        Ok(ControlFlow::Continue(()))
    }
}

/// Whether both programs have the same files.
fn has_files_of(one: &Arc<RecordedProgram>, other: &Arc<RecordedProgram>) -> bool {
    Arc::ptr_eq(one, other) || one.files == other.files
}

/// Whether a call fits the program of an engine.
pub fn fits(call: EngineCall, engine: &Engine) -> bool {
    engine.program().has(call)
}

impl fmt::Display for Unreplayable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Unreplayable::Io(error) => write!(f, "it cannot be read: {error}"),
            Unreplayable::Damaged => f.write_str("its bytes are damaged"),
            Unreplayable::NoBase => f.write_str("no base image leads to it"),
            Unreplayable::NoEngine(why) => write!(f, "its program cannot be loaded: {why}"),
            Unreplayable::DoesNotFit => f.write_str("it does not fit its program"),
        }
    }
}

impl std::error::Error for Unreplayable {}
