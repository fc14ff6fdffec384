//! A recorded program that can be executed, with the cells that the caller has chosen.

use std::collections::HashMap;
use std::sync::Arc;

use rungd_config::controller::OutputRules;
use rungd_engine::{self as engine, Cell, Engine, Image};
use rungd_history::playback::loaded;
use rungd_history::record::RecordedProgram;
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::program::Program;
use rungd_runtime::exchange::Mode;

/// A chosen cell, with its name. The name is the same in every program.
pub type NamedCell = (String, Cell);

/// Chooses the cells of a program.
pub type ChooseCells = Arc<dyn Fn(&Program, &Symbols) -> Vec<NamedCell> + Send + Sync>;

/// A recorded program with its chosen cells.
#[derive(Debug)]
pub struct LoggedProgram {
    /// The recording of the program.
    pub recorded: Arc<RecordedProgram>,
    /// The resolved program.
    pub program: Program,
    /// Its names and cells.
    pub symbols: Symbols,
    /// The chosen cells.
    pub chosen: Vec<NamedCell>,
    /// The numbers of each cell among the chosen ones.
    numbers: HashMap<Cell, Vec<u32>>,
    code: engine::Program,
    /// What its outputs are driven to.
    pub(super) rules: OutputRules,
}

impl LoggedProgram {
    /// Makes a program from its recorded files.
    ///
    /// # Errors
    /// This version of rungd cannot load them.
    pub fn of(
        recorded: &Arc<RecordedProgram>,
        choose: &ChooseCells,
    ) -> Result<LoggedProgram, String> {
        let (program, loaded) = loaded(recorded)?;
        let (code, symbols) = lower(&program);
        let chosen = choose(&program, &symbols);
        let mut numbers: HashMap<Cell, Vec<u32>> = HashMap::new();
        for (number, (_, cell)) in (0..).zip(&chosen) {
            numbers.entry(*cell).or_default().push(number);
        }
        let rules = OutputRules::of(loaded.controller.as_ref(), &symbols);
        let recorded = recorded.clone();
        Ok(LoggedProgram { recorded, program, symbols, chosen, numbers, code, rules })
    }

    /// An engine that executes the program.
    pub(super) fn engine(&self) -> Engine {
        Engine::new(self.code.clone())
    }

    /// The content of a cell as it is published: of a Y, what the output is driven to.
    pub(super) fn shown(&self, image: &Image, (cell, mode): (Cell, Mode)) -> i32 {
        self.rules.shown((cell, content(image, cell)), mode, |ok| image.bit(ok))
    }

    /// The numbers of a cell among the chosen ones.
    pub(super) fn numbers(&self, cell: Cell) -> &[u32] {
        self.numbers.get(&cell).map_or(&[], Vec::as_slice)
    }
}

/// The content of a cell; the content of a bit is 0 or 1.
pub(super) fn content(image: &Image, cell: Cell) -> i32 {
    match cell {
        Cell::Bit(bit) => i32::from(image.bit(bit)),
        Cell::Word(word) => image.word(word),
    }
}

/// A program, or why it cannot be made.
type KnownResult = Result<Arc<LoggedProgram>, (Arc<RecordedProgram>, String)>;

/// The programs made so far, so that none is made twice.
#[derive(Clone, Default)]
pub(super) struct ProgramShelf {
    known: Vec<KnownResult>,
}

/// The most programs that are kept.
const PROGRAMS_MAX: usize = 4;

impl ProgramShelf {
    /// The program of a recording. Makes it if it is not on the shelf.
    ///
    /// # Errors
    /// This version of rungd cannot load it.
    pub fn take(
        &mut self,
        recorded: &Arc<RecordedProgram>,
        choose: &ChooseCells,
    ) -> Result<Arc<LoggedProgram>, String> {
        let known = self.known.iter().find(|known| same(recorded_of(known), recorded));
        if let Some(known) = known {
            return known.clone().map_err(|(_, why)| why);
        }
        let made = LoggedProgram::of(recorded, choose).map(Arc::new);
        if self.known.len() == PROGRAMS_MAX {
            drop(self.known.remove(0));
        }
        self.known.push(made.clone().map_err(|why| (recorded.clone(), why)));
        made
    }

    /// An engine for a program on the shelf.
    ///
    /// # Errors
    /// The program is not on the shelf.
    pub fn engine(&self, recorded: &RecordedProgram) -> Result<Engine, String> {
        let known = self.known.iter().flatten().find(|of| *of.recorded == *recorded);
        known.map(|of| of.engine()).ok_or_else(|| "its program cannot be loaded".to_owned())
    }
}

fn recorded_of(known: &KnownResult) -> &Arc<RecordedProgram> {
    match known {
        Ok(of) => &of.recorded,
        Err((recorded, _)) => recorded,
    }
}

fn same(one: &Arc<RecordedProgram>, other: &Arc<RecordedProgram>) -> bool {
    Arc::ptr_eq(one, other) || one == other
}
