//! The lines of `[[watch]]`, judged as those of `always` in a test: on memory at the end of each
//! scan, before the passes.
//!
//! The daemon's recording, and the history of alarms, call it with the images of an engine that
//! executes the recorded calls again. What judges a condition of a test judges these lines,
//! `was(x)` included. An observer's rungs are absent: a watch sees the ladder's memory.

use std::sync::Arc;

use super::condition::Condition;
use super::view::{View, ViewDraft};
use rungd_config::controller::watch::WatchSettings;
use rungd_engine::{Cell, EngineCall, Image, Layout};
use rungd_history::playback::LineJudge;
use rungd_language::lower::Symbols;
use rungd_language::resolve::observed::ObservedProgram;
use rungd_language::resolve::program::Contact;
use rungd_language::resolve::reads::ReadOperand;
use rungd_language::source::was;
use rungd_runtime::Taped;

/// The lines that are watched in one program.
#[derive(Debug)]
pub struct WatchedLines {
    lines: Vec<WatchedLine>,
    /// Memory with a place for each `was(x)`, if a line has one.
    memory: Option<WatchedMemory>,
    /// The cells of the program that the lines read.
    cells: Vec<Cell>,
    symbols: Symbols,
}

/// An operand that decides whether a line holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DecidingOperand {
    /// Its name, as in the line.
    pub name: String,
    /// Its name in the ladder: for `was(x)` that of x.
    pub place: String,
    /// Its value as text.
    pub value: String,
}

/// A line with the values inside its edges at the end of the scan before.
#[derive(Debug)]
struct WatchedLine {
    condition: Condition,
    edges: Vec<bool>,
    holds: bool,
}

/// Memory with a place for each `was(x)`.
struct WatchedMemory {
    view: Arc<View>,
    machine: Taped,
    last: Vec<i32>,
}

impl std::fmt::Debug for WatchedMemory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("WatchedMemory").field("last", &self.last).finish_non_exhaustive()
    }
}

impl WatchedLines {
    /// The lines of a controller file; `symbols`: those of its program.
    pub fn new(watches: &WatchSettings, symbols: &Symbols) -> WatchedLines {
        let layout = &symbols.layout;
        let mut draft = watches
            .observed
            .as_ref()
            .map(|seen| ViewDraft::new(ObservedProgram::clone(seen), layout));
        let mut cells = Vec::new();
        let lines = watches.all.iter().map(|watch| {
            let resolved = watch.condition.clone();
            let layout = match &mut draft {
                Some(draft) => {
                    draft.reads(&resolved.contact);
                    &draft.view().symbols.layout
                }
                None => {
                    cells.extend(read_cells(&resolved.contact, layout));
                    layout
                }
            };
            let condition = Condition::new(&watch.always, resolved, layout);
            WatchedLine { edges: vec![false; condition.edges], condition, holds: true }
        });
        let lines = lines.collect();
        let memory = draft.map(|draft| {
            let view = draft.finish();
            cells.extend(view.taken());
            WatchedMemory { machine: view.machine(), last: Vec::new(), view }
        });
        WatchedLines { lines, memory, cells, symbols: symbols.clone() }
    }

    /// The cells of the program whose values the lines need.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// RUN begins with this memory: edges are OFF, and what is remembered is memory as started.
    pub fn begins_run(&mut self, image: &Image) {
        if let Some(memory) = &mut self.memory {
            memory.begins(image);
        }
        self.lines.iter_mut().for_each(|line| line.edges.fill(false));
    }

    /// The scans up to this memory were not seen: it is the end of the scan before the next one.
    pub fn joins(&mut self, image: &Image) {
        if let Some(memory) = &mut self.memory {
            memory.begins(image);
        }
        let seen = self.memory.as_ref().map_or(image, WatchedMemory::image);
        for WatchedLine { condition, edges, .. } in &mut self.lines {
            condition.is_true(seen, edges);
        }
    }

    /// A scan has ended with this memory, but for its passes.
    pub fn scanned(&mut self, image: &Image) {
        if let Some(memory) = &mut self.memory {
            memory.scanned(image);
        }
        let seen = self.memory.as_ref().map_or(image, WatchedMemory::image);
        for WatchedLine { condition, edges, holds } in &mut self.lines {
            *holds = condition.is_true(seen, edges);
        }
        if let Some(memory) = &mut self.memory {
            memory.view.remember(memory.machine.engine().image(), &mut memory.last);
        }
    }
}

impl WatchedLines {
    /// The operands that decide the value of a line on the memory of its last scan.
    pub fn deciding(&self, line: usize, image: &Image) -> Vec<DecidingOperand> {
        let Some(WatchedLine { condition, .. }) = self.lines.get(line) else { return Vec::new() };
        let seen = self.memory.as_ref().map_or(image, WatchedMemory::image);
        let view = self.memory.as_ref().map(|memory| &memory.view);
        let text = |cell: Cell| match view {
            Some(view) => view.symbols.say_value(view.of_values(cell), seen.value(cell)),
            None => self.symbols.say_value(cell, seen.value(cell)),
        };
        let cells = condition.deciding(seen);
        let named = condition.operands.iter().filter(|(_, cell)| cells.contains(cell)).cloned();
        let operand = |(name, cell): (String, Cell)| {
            let place = was::place_in(&name).unwrap_or(&name).to_owned();
            DecidingOperand { value: text(cell), name, place }
        };
        named.chain(condition.elements(seen)).map(operand).collect()
    }

    /// By line: whether it held at the end of the last scan.
    pub fn holding(&self) -> impl Iterator<Item = bool> {
        self.lines.iter().map(|line| line.holds)
    }

    /// Continues with what lines of another program held, by line.
    pub fn continues(&mut self, held: impl Iterator<Item = bool>) {
        self.lines.iter_mut().zip(held).for_each(|(line, held)| line.holds = held);
    }
}

impl LineJudge for WatchedLines {
    fn cells(&self) -> &[Cell] {
        &self.cells
    }

    fn called(&mut self, call: EngineCall, image: &Image) {
        match call {
            EngineCall::Start { .. } => self.begins_run(image),
            EngineCall::Execute => self.scanned(image),
            EngineCall::Begin { .. }
            | EngineCall::RequestStop
            | EngineCall::Write(..)
            | EngineCall::Terminate
            | EngineCall::Force(..)
            | EngineCall::Release(_) => {}
        }
    }

    fn joins(&mut self, image: &Image) {
        WatchedLines::joins(self, image);
    }

    fn holds(&self, line: usize) -> bool {
        self.lines.get(line).is_none_or(|line| line.holds)
    }
}

/// Makes the judge of a program's lines, for the history of alarms.
pub fn line_judge(watches: &WatchSettings, symbols: &Symbols) -> Box<dyn LineJudge> {
    Box::new(WatchedLines::new(watches, symbols))
}

impl WatchedMemory {
    fn image(&self) -> &Image {
        self.machine.engine().image()
    }

    fn begins(&mut self, image: &Image) {
        self.view.look(image, &mut self.machine);
        self.view.remember(self.machine.engine().image(), &mut self.last);
        self.view.show_remembered(&self.last, &mut self.machine);
    }

    fn scanned(&mut self, image: &Image) {
        self.view.show_remembered(&self.last, &mut self.machine);
        self.view.look(image, &mut self.machine);
    }
}

/// The cells that a condition reads.
fn read_cells(contact: &Contact, layout: &Layout) -> Vec<Cell> {
    let mut cells = Vec::new();
    for read in contact.reads_of_all() {
        match read {
            ReadOperand::Address(address) => cells.extend(layout.cell(address)),
            ReadOperand::Array(array) => {
                cells.extend(array.addresses().filter_map(|address| layout.cell(address)));
            }
        }
    }
    cells
}
