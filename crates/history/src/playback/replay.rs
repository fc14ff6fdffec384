//! Executes a recording again: goes to a section, executes its calls step by step, and lets a
//! caller see the engine after each. Computes every hash again.
//!
//! Everything that plays a recording does it here: `cli` replays, verifies and exports, `observe`
//! and `live` get their sections with the states at their starts, `twin_run` runs a second program
//! beside it. An engine executes the whole program, or a slice of it, as [`MakeEngine`] makes it. A
//! recording from outside may not fit its engine: such sections are refused.

use std::fmt;
use std::io;
use std::ops::{ControlFlow, Range};
use std::sync::Arc;

use crate::observe::{SparingEngine, WholeProgram};
use crate::record::{ReadSection, RecordedProgram, Recording, SectionBody, state_hash};
use rungd_engine::{self as engine, Engine, EngineCall, EngineState};
use rungd_runtime::{Origin, TapeSection, tape_steps};

/// Why a section cannot be executed.
#[derive(Debug)]
pub enum Unplayable {
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
    /// The sections that cannot be executed.
    pub unreplayable: u64,
    /// The first section whose end differs from the recorded end.
    pub first_difference: Option<usize>,
}

/// A scan that was executed again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlayedScan {
    /// Its number; the first of a process is 1.
    pub number: u64,
    /// Its time, ns since 1970 (UTC).
    pub unix_ns: i64,
    /// Its section.
    pub section: usize,
}

/// A call that was executed again.
#[derive(Clone, Copy, Debug)]
pub struct PlayedStep {
    /// The call.
    pub call: EngineCall,
    /// Its scan: the one that began last.
    pub scan: PlayedScan,
}

/// Makes the engines of recorded programs.
pub trait MakeEngine {
    /// The engines.
    type Engine: PlayedEngine;

    /// A new engine of a program.
    ///
    /// # Errors
    /// The reason why the program cannot be executed.
    fn engine(&mut self, program: &Arc<RecordedProgram>) -> Result<Self::Engine, String>;
}

/// An engine that executes recorded calls.
pub trait PlayedEngine {
    /// Its memory and program.
    fn engine(&self) -> &Engine;

    /// Continues from a state; returns false, and changes nothing, if the state does not fit.
    fn resume(&mut self, state: &EngineState) -> bool;

    /// Makes a call.
    fn apply(&mut self, call: EngineCall);
}

impl PlayedEngine for Engine {
    fn engine(&self) -> &Engine {
        self
    }

    fn resume(&mut self, state: &EngineState) -> bool {
        Engine::resume(self, state)
    }

    fn apply(&mut self, call: EngineCall) {
        Engine::apply(self, call);
    }
}

impl PlayedEngine for SparingEngine {
    fn engine(&self) -> &Engine {
        SparingEngine::engine(self)
    }

    fn resume(&mut self, state: &EngineState) -> bool {
        SparingEngine::resume(self, state)
    }

    fn apply(&mut self, call: EngineCall) {
        SparingEngine::apply(self, call);
    }
}

impl<F: FnMut(&RecordedProgram) -> Result<Engine, String>> MakeEngine for F {
    type Engine = Engine;

    fn engine(&mut self, program: &Arc<RecordedProgram>) -> Result<Engine, String> {
        self(program)
    }
}

/// The same code for every program, such as the slice for a question about one program.
impl MakeEngine for engine::EngineProgram {
    type Engine = Engine;

    fn engine(&mut self, _: &Arc<RecordedProgram>) -> Result<Engine, String> {
        Ok(Engine::new(self.clone()))
    }
}

/// The same program always, without what would change nothing.
impl MakeEngine for WholeProgram {
    type Engine = SparingEngine;

    fn engine(&mut self, _: &Arc<RecordedProgram>) -> Result<SparingEngine, String> {
        Ok(self.sparing_engine())
    }
}

/// A recording with an engine that executes it.
pub struct Playback<M: MakeEngine> {
    recording: Arc<Recording>,
    /// Makes the engines.
    pub programs: M,
    /// The engine, and the program that it executes.
    engine: Option<(Arc<RecordedProgram>, Box<M::Engine>)>,
    /// The section at whose start the engine is; `None`: at no start of a section.
    at: Option<usize>,
    /// The last section that could not be executed. Later sections that need it are refused without
    /// a new attempt.
    impassable: Option<usize>,
}

impl<M: MakeEngine> Playback<M> {
    /// A recording before its first section.
    pub fn new(recording: impl Into<Arc<Recording>>, programs: M) -> Playback<M> {
        let recording = recording.into();
        Playback { recording, programs, engine: None, at: None, impassable: None }
    }

    /// Continues with a different recording. Uses the same engine again, if its program has the
    /// same files.
    pub fn set_recording(&mut self, recording: impl Into<Arc<Recording>>) {
        (self.recording, self.at, self.impassable) = (recording.into(), None, None);
    }

    /// The recording.
    pub fn recording(&self) -> &Arc<Recording> {
        &self.recording
    }

    /// A section with the state at its start.
    ///
    /// # Errors
    /// The reason why it cannot be executed.
    pub fn section(&mut self, at: usize) -> Result<TapeSection, Unplayable> {
        let body = self.seek(at)?;
        let state = EngineState::of(self.engine()?);
        let start = self.recording.start(at, &body);
        let mut who = body.who;
        who.extend(self.late_who(at));
        Ok(TapeSection { start, state, entries: body.entries, who })
    }

    /// Brings the engine to the start of a section, and returns the content of the section.
    ///
    /// # Errors
    /// The reason why it cannot be reached.
    pub fn seek(&mut self, at: usize) -> Result<SectionBody, Unplayable> {
        let base = self.recording.base_of(at).ok_or(Unplayable::NoBase)?;
        if self.impassable.is_some_and(|section| (base..at).contains(&section)) {
            return Err(Unplayable::NoBase);
        }
        let begin = self.at.filter(|now| (base..=at).contains(now)).unwrap_or(base);
        for section in begin..at {
            let opened = self.prepare(section);
            if opened.is_err() {
                self.impassable = Some(section);
            }
            let _ = self.play(section, &opened?, &mut |_, _| ControlFlow::Continue(()))?;
        }
        self.prepare(at)
    }

    /// Whether the engine is at the start of a section that continues the section before it.
    pub fn continues_at(&self, at: usize) -> bool {
        self.at == Some(at) && self.recording.follows(at)
    }

    /// The engine.
    ///
    /// # Errors
    /// No section was reached.
    pub fn engine(&self) -> Result<&Engine, Unplayable> {
        self.engine.as_ref().map(|(_, engine)| engine.engine()).ok_or(Unplayable::NoBase)
    }

    /// Executes sections, and calls `visit` at the end of each scan. A `Break` ends the execution.
    ///
    /// # Errors
    /// The reason why the next section cannot be executed.
    pub fn scans(
        &mut self,
        sections: Range<usize>,
        mut visit: impl FnMut(PlayedScan, &Engine) -> ControlFlow<()>,
    ) -> Result<(), Unplayable> {
        for at in sections {
            let body = self.seek(at)?;
            if self.play(at, &body, &mut at_ends(&mut visit))?.is_break() {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Executes sections, and compares the state at the end of each with the recorded state.
    pub fn verify(&mut self, sections: Range<usize>) -> Verified {
        self.verify_seen(sections, |_, _| {}).0
    }

    /// As [`Playback::verify`]; also calls `visit` at the end of each scan, and returns all
    /// sections whose end differs from the recorded end.
    pub fn verify_seen(
        &mut self,
        sections: Range<usize>,
        mut visit: impl FnMut(PlayedScan, &Engine),
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
        visit: &mut impl FnMut(PlayedScan, &Engine) -> ControlFlow<()>,
    ) -> Result<Option<bool>, Unplayable> {
        // The state at the end of the section before it.
        let reached = self.engine.as_ref().filter(|_| self.continues_at(at));
        let reached =
            reached.map(|(program, engine)| (program.clone(), EngineState::of(engine.engine())));
        let body = self.seek(at)?;
        let start = EngineState::of(self.engine()?);
        let continues = match &reached {
            Some((program, state)) if program == self.recording.program(at) => *state == start,
            Some(_) | None => true,
        };
        let _ = self.play(at, &body, &mut at_ends(visit))?;
        let same = self.is_as_recorded(at)?;
        Ok(if continues { same } else { Some(false) })
    }

    /// Whether the engine, at the end of a section, has the recorded state; `None`: that state is
    /// unknown.
    ///
    /// # Errors
    /// No section was reached.
    pub fn is_as_recorded(&self, at: usize) -> Result<Option<bool>, Unplayable> {
        let (hash, engine) = (self.recording.head(at).end_hash, self.engine()?);
        Ok(hash.map(|hash| hash == state_hash(&EngineState::of(engine))))
    }

    fn read(&self, at: usize) -> Result<ReadSection, Unplayable> {
        let read = self.recording.read(at).map_err(Unplayable::Io)?;
        read.ok_or(Unplayable::Damaged)
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
    fn prepare(&mut self, at: usize) -> Result<SectionBody, Unplayable> {
        let (base, body) = self.read(at)?;
        let program = self.recording.program(at).clone();
        if let Some(state) = base {
            self.at = None;
            let (_, engine) = match &mut self.engine {
                Some(engine) if has_files_of(&engine.0, &program) => engine,
                engine => {
                    let made = self.programs.engine(&program).map_err(Unplayable::NoEngine)?;
                    engine.insert((program.clone(), Box::new(made)))
                }
            };
            if !engine.resume(&state) {
                return Err(Unplayable::DoesNotFit);
            }
            self.at = Some(at);
        }
        if let Some((running_program, _)) = &mut self.engine {
            *running_program = program;
        }
        if self.at != Some(at) {
            return Err(Unplayable::NoBase);
        }
        let program = self.engine()?.program();
        let mut calls = body.entries.iter().filter_map(|entry| entry.call());
        if calls.all(|call| program.has(call)) { Ok(body) } else { Err(Unplayable::DoesNotFit) }
    }

    /// Executes a section, and calls `visit` after each call. The engine is at the start of the
    /// section. A `Break` ends the execution within the section.
    ///
    /// # Errors
    /// No section was reached.
    pub fn play(
        &mut self,
        at: usize,
        body: &SectionBody,
        visit: &mut impl FnMut(PlayedStep, &Engine) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, Unplayable> {
        self.at = None;
        let start = self.recording.start(at, body);
        let Some((_, engine)) = &mut self.engine else { return Err(Unplayable::NoBase) };
        for step in tape_steps(&body.entries, start.number, 0) {
            let Some(call) = step.entry.call() else { continue };
            engine.apply(call);
            let unix_ns = start.unix_ns(step.now_ns);
            let scan = PlayedScan { number: step.number, unix_ns, section: at };
            if visit(PlayedStep { call, scan }, engine.engine()).is_break() {
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

/// Calls `visit` only at the ends of scans.
fn at_ends(
    visit: &mut impl FnMut(PlayedScan, &Engine) -> ControlFlow<()>,
) -> impl FnMut(PlayedStep, &Engine) -> ControlFlow<()> {
    move |step, engine| match step.call == EngineCall::Execute {
        true => visit(step.scan, engine),
        false => ControlFlow::Continue(()),
    }
}

impl fmt::Display for Unplayable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Unplayable::Io(error) => write!(f, "it cannot be read: {error}"),
            Unplayable::Damaged => f.write_str("its bytes are damaged"),
            Unplayable::NoBase => f.write_str("no base image leads to it"),
            Unplayable::NoEngine(why) => write!(f, "its program cannot be loaded: {why}"),
            Unplayable::DoesNotFit => f.write_str("it does not fit its program"),
        }
    }
}

impl std::error::Error for Unplayable {}
