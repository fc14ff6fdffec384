//! A recorded program that can be executed, with the cells that the caller has chosen.

use std::collections::HashMap;
use std::sync::Arc;

use rungd_engine::{Cell, Engine, Image};
use rungd_history::playback::{MakeEngine, PlayableProgram};
use rungd_history::record::RecordedProgram;
use rungd_language::lower::Symbols;
use rungd_language::resolve::program::Program;
use rungd_runtime::exchange::Mode;

/// A chosen cell, with its name. The name is the same in every program.
pub type NamedCell = (String, Cell);

/// Chooses the cells of a program.
pub type ChooseCells = Arc<dyn Fn(&Program, &Symbols) -> Vec<NamedCell> + Send + Sync>;

/// A recorded program with its chosen cells.
#[derive(Debug)]
pub struct LoggedProgram {
    /// The program.
    pub playable: PlayableProgram,
    /// The chosen cells.
    pub chosen: Vec<NamedCell>,
    /// The numbers of each cell among the chosen ones.
    numbers: HashMap<Cell, Vec<u32>>,
}

impl LoggedProgram {
    /// Makes a program from its recorded files.
    ///
    /// # Errors
    /// This version of rungd cannot load them.
    pub fn of(recorded: &RecordedProgram, choose: &ChooseCells) -> Result<LoggedProgram, String> {
        let playable = PlayableProgram::of(recorded)?;
        let chosen = choose(&playable.program, &playable.symbols);
        let mut numbers: HashMap<Cell, Vec<u32>> = HashMap::new();
        for (number, (_, cell)) in (0..).zip(&chosen) {
            numbers.entry(*cell).or_default().push(number);
        }
        Ok(LoggedProgram { playable, chosen, numbers })
    }

    /// The content of a cell as it is published: of a Y, what the output is driven to.
    pub(super) fn shown(&self, image: &Image, cell: Cell, mode: Mode) -> i32 {
        self.playable.outputs.shown(cell, image.value(cell), mode, |ok| image.bit(ok))
    }

    /// The numbers of a cell among the chosen ones.
    pub(super) fn numbers(&self, cell: Cell) -> &[u32] {
        self.numbers.get(&cell).map_or(&[], Vec::as_slice)
    }
}

/// A recorded program, and the program made from it or why it cannot be made.
type PreparedProgram = (Arc<RecordedProgram>, Result<Arc<LoggedProgram>, String>);

/// The programs made last, at most [`PROGRAMS_MAX`], so that these are not made again.
pub(super) struct LoggedPrograms {
    choose: ChooseCells,
    known: Vec<PreparedProgram>,
}

/// The most programs that are kept.
const PROGRAMS_MAX: usize = 4;

impl LoggedPrograms {
    pub fn new(choose: ChooseCells) -> LoggedPrograms {
        LoggedPrograms { choose, known: Vec::new() }
    }

    /// The program of a recording. Makes it if it is not known.
    ///
    /// # Errors
    /// This version of rungd cannot load it.
    pub fn program(
        &mut self,
        recorded: &Arc<RecordedProgram>,
    ) -> Result<Arc<LoggedProgram>, String> {
        let is_it = |known_program: &Arc<RecordedProgram>| {
            Arc::ptr_eq(known_program, recorded) || known_program == recorded
        };
        if let Some((_, known)) = self.known.iter().find(|(known_program, _)| is_it(known_program))
        {
            return known.clone();
        }
        let made = LoggedProgram::of(recorded, &self.choose).map(Arc::new);
        if self.known.len() == PROGRAMS_MAX {
            drop(self.known.remove(0));
        }
        self.known.push((Arc::clone(recorded), made.clone()));
        made
    }
}

impl MakeEngine for LoggedPrograms {
    type Engine = Engine;

    fn engine(&mut self, program: &Arc<RecordedProgram>) -> Result<Engine, String> {
        Ok(self.program(program)?.playable.engine())
    }
}
