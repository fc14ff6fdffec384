//! The programs of a recording: each is loaded and lowered once, and is found by section.
//!
//! `replay` makes its engines from them, and looks up operands and alarms by name in each.

use std::ops::Range;
use std::sync::Arc;

use super::recording;
use rungd_config::load::Loaded;
use rungd_engine::{self as engine, Cell, Engine, Layout};
use rungd_history::record::{RecordedProgram, Recording};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::program::Program;
use rungd_language::resolve::scope::Scope;

/// A program that can be executed, with its names.
pub(super) struct RecordedPlant {
    pub program: Arc<Program>,
    /// Its files and its controller's settings.
    pub loaded: Loaded,
    pub engine: engine::Program,
    pub symbols: Symbols,
}

/// The programs of some sections.
pub(super) struct RecordedPlants {
    /// Each program, or the reason why it cannot be loaded.
    pub all: Vec<Result<RecordedPlant, String>>,
    programs: Vec<Arc<RecordedProgram>>,
    /// For each section of the recording from `first` on, the index of its program in `all`.
    of_section: Vec<usize>,
    first: usize,
}

impl RecordedPlant {
    /// Lowers a loaded program.
    pub fn new(program: Program, loaded: Loaded) -> RecordedPlant {
        let (engine, symbols) = lower(&program);
        RecordedPlant { program: Arc::new(program), loaded, engine, symbols }
    }

    /// The cell of an operand, if the ladder has the operand.
    pub fn cell(&self, name: &str) -> Option<Cell> {
        let address = Scope::of(&self.program).address(name).ok()?;
        self.symbols.layout.cell(address)
    }

    /// The layout of its cells.
    pub fn layout(&self) -> &Layout {
        &self.symbols.layout
    }
}

impl RecordedPlants {
    /// Loads the programs of sections.
    pub fn of(recording: &Recording, sections: Range<usize>) -> RecordedPlants {
        let (all, programs, of_section) = (Vec::new(), Vec::new(), Vec::new());
        let mut plants = RecordedPlants { all, programs, of_section, first: sections.start };
        for at in sections {
            let program = recording.program(at);
            let found = plants.find(program);
            plants.of_section.push(found.unwrap_or(plants.all.len()));
            if found.is_none() {
                plants.programs.push(program.clone());
                let loaded = recording::loaded(program);
                plants.all.push(loaded.map(|(program, rest)| RecordedPlant::new(program, rest)));
            }
        }
        plants
    }

    /// The index of a section's program in `all`.
    pub fn place(&self, section: usize) -> usize {
        section.checked_sub(self.first).and_then(|at| self.of_section.get(at)).map_or(0, |at| *at)
    }

    /// The program of a section.
    pub fn plant(&self, section: usize) -> Result<&RecordedPlant, &String> {
        self.all[self.place(section)].as_ref()
    }

    /// The first program that could be loaded.
    pub fn first(&self) -> Option<&RecordedPlant> {
        self.all.iter().find_map(|plant| plant.as_ref().ok())
    }

    /// A new engine of a program.
    ///
    /// # Errors
    /// The reason why the program cannot be loaded.
    pub fn engine_of(&self, program: &RecordedProgram) -> Result<Engine, String> {
        let plant = self.find(program).map(|at| &self.all[at]);
        match plant {
            Some(Ok(plant)) => Ok(Engine::new(plant.engine.clone())),
            Some(Err(why)) => Err(why.clone()),
            None => Err("it is outside of the requested part".to_owned()),
        }
    }

    /// The index of a program. Only the files are compared.
    fn find(&self, program: &RecordedProgram) -> Option<usize> {
        self.programs.iter().rposition(|known| known.files == program.files)
    }
}
