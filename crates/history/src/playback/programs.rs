//! The programs of a recording: each is loaded and lowered once, and is found by section.
//!
//! A [`Playback`](super::Playback) makes its engines from them; `rungd replay` looks up operands
//! and alarms by name in each, and `live` the cells that it follows.

use std::ops::Range;
use std::sync::Arc;

use super::recorded::loaded;
use super::replay::MakeEngine;
use crate::record::{RecordedProgram, Recording};
use rungd_config::controller::OutputRules;
use rungd_config::load::Loaded;
use rungd_engine::{self as engine, Cell, Engine, Layout};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::program::Program;

/// A program that can be executed, with its names.
#[derive(Debug)]
pub struct PlayableProgram {
    /// The resolved program.
    pub program: Arc<Program>,
    /// Its files and its controller's settings.
    pub loaded: Loaded,
    /// Its operations.
    pub code: engine::EngineProgram,
    /// Its names and cells.
    pub symbols: Symbols,
    /// What its outputs are driven to.
    pub outputs: OutputRules,
}

/// A program of the recording.
#[derive(Clone, Copy)]
pub struct PlacedProgram<'a> {
    /// Its index among all programs.
    pub place: usize,
    /// The program.
    pub program: &'a PlayableProgram,
}

/// The programs of some sections.
pub struct RecordedPrograms {
    /// Each program, or the reason why it cannot be loaded.
    pub all: Vec<Result<PlayableProgram, String>>,
    programs: Vec<Arc<RecordedProgram>>,
    /// For each section of the recording from `first` on, the index of its program in `all`.
    of_section: Vec<usize>,
    first: usize,
}

impl PlayableProgram {
    /// Lowers a loaded program.
    pub fn new(program: Program, loaded: Loaded) -> PlayableProgram {
        let (code, symbols) = lower(&program);
        let outputs = OutputRules::of(loaded.controller.as_ref(), &symbols);
        PlayableProgram { program: Arc::new(program), loaded, code, symbols, outputs }
    }

    /// Loads a recorded program.
    ///
    /// # Errors
    /// This version of rungd cannot load it.
    pub fn of(recorded: &RecordedProgram) -> Result<PlayableProgram, String> {
        loaded(recorded).map(|(program, loaded)| PlayableProgram::new(program, loaded))
    }

    /// An engine that executes it.
    pub fn engine(&self) -> Engine {
        Engine::new(self.code.clone())
    }

    /// The cell of an operand, if the ladder has the operand.
    pub fn cell(&self, name: &str) -> Option<Cell> {
        let address = self.program.scope().address(name).ok()?;
        self.symbols.layout.cell(address)
    }

    /// The layout of its cells.
    pub fn layout(&self) -> &Layout {
        &self.symbols.layout
    }
}

impl RecordedPrograms {
    /// Loads the programs of sections.
    pub fn of(recording: &Recording, sections: Range<usize>) -> RecordedPrograms {
        let (all, programs, of_section) = (Vec::new(), Vec::new(), Vec::new());
        let mut known = RecordedPrograms { all, programs, of_section, first: sections.start };
        for at in sections {
            let program = recording.program(at);
            let found = known.find(program);
            known.of_section.push(found.unwrap_or(known.all.len()));
            if found.is_none() {
                known.programs.push(program.clone());
                known.all.push(PlayableProgram::of(program));
            }
        }
        known
    }

    /// The index of a section's program in `all`.
    pub fn place(&self, section: usize) -> usize {
        section.checked_sub(self.first).and_then(|at| self.of_section.get(at)).map_or(0, |at| *at)
    }

    /// The program of a section.
    ///
    /// # Errors
    /// The reason why it cannot be loaded.
    pub fn program(&self, section: usize) -> Result<&PlayableProgram, &String> {
        self.all[self.place(section)].as_ref()
    }

    /// The first program that could be loaded.
    pub fn first(&self) -> Option<&PlayableProgram> {
        self.all.iter().find_map(|program| program.as_ref().ok())
    }

    /// A program of the recording, by its files.
    ///
    /// # Errors
    /// The reason why it cannot be loaded.
    pub(super) fn playable(&self, program: &RecordedProgram) -> Result<&PlayableProgram, String> {
        match self.find(program).map(|at| &self.all[at]) {
            Some(Ok(program)) => Ok(program),
            Some(Err(why)) => Err(why.clone()),
            None => Err("it is outside of the requested part".to_owned()),
        }
    }

    /// The index of a program. Only the files are compared.
    fn find(&self, program: &RecordedProgram) -> Option<usize> {
        self.programs.iter().rposition(|known| known.files == program.files)
    }
}

impl MakeEngine for &RecordedPrograms {
    type Engine = Engine;

    fn engine(&mut self, program: &Arc<RecordedProgram>) -> Result<Engine, String> {
        Ok(self.playable(program)?.engine())
    }
}
