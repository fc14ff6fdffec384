//! Memory as the conditions of a test see it, if they see more than the memory of the controller:
//! with the tags of the observer, the values of `was(x)`, and the memory of field devices.
//!
//! `names` makes a [`View`], one for each program of a test file that needs one; `judge` keeps a
//! [`ViewMemory`] while a test is played. Its memory is that of a second engine: at the end of each
//! scan it takes from the controller what conditions and the observer read, and nothing else; then
//! it executes the rungs of the observer. The engine of the controller is only read, so it does the
//! same without a view. The observer is no part of the controller: over a new process it goes on.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::rig::{Rig, RigTape};
use rungd_base::calendar::LocalTime;
use rungd_engine::isa::{Address, DeviceId};
use rungd_engine::{BitCell, Cell, Engine, EngineProgram, Image, Layout, ScanTimes, WordCell};
use rungd_history::observe::Subject;
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::observed::{ObservedProgram, Remembered};
use rungd_language::resolve::program::Contact;
use rungd_language::resolve::reads::ReadOperand;
use rungd_language::source::span::{SourceFile, Span};
use rungd_runtime::exchange::Mode;
use rungd_runtime::{ScanStart, ScannedMachine, TapeSection, Taped};
use rungd_state::reload::{LoweredProgram, ReloadPlan};

/// A program as its conditions see it, lowered.
#[derive(Debug)]
pub struct View {
    code: EngineProgram,
    /// The names and cells of the view.
    pub symbols: Symbols,
    /// The cells of the controller.
    ladder: Layout,
    observed: ObservedProgram,
    /// The bits and words that are taken from the controller: its cell, and that of the view.
    bits: Vec<(BitCell, BitCell)>,
    words: Vec<(WordCell, WordCell)>,
    /// The cells of the places that are remembered.
    was: Vec<RememberedCells>,
    /// The memory of field devices that is shown.
    shown: Vec<ShownCells>,
}

/// A bit or word of a field device, and its cell in the view.
#[derive(Clone, Copy, Debug)]
struct ShownCells {
    device: DeviceId,
    from: Cell,
    to: Cell,
}

/// The cells of a `was(x)`, in the view.
#[derive(Clone, Debug)]
pub(super) struct RememberedCells {
    /// `was(level)`.
    pub name: String,
    pub place: Cell,
    kept: Cell,
}

/// A view that is being made: the cells that conditions read are not all known yet.
#[derive(Debug)]
pub(super) struct ViewDraft {
    view: View,
    seen: HashSet<Cell>,
}

impl ViewDraft {
    /// The view of a program; `ladder`: the cells of the program itself.
    pub fn new(observed: ObservedProgram, ladder: &Layout) -> ViewDraft {
        let (mut code, symbols) = lower(&observed.program);
        // The controller executes the ladder.
        code.order = observed.observer.into_iter().collect();
        code.kept.clear();
        let cells = |address| symbols.layout.cell(address);
        let was = observed.was.iter().filter_map(|remembered| {
            let (place, kept) = (cells(remembered.place)?, cells(remembered.kept)?);
            Some(RememberedCells { name: remembered.name.clone(), place, kept })
        });
        let (was, ladder) = (was.collect(), ladder.clone());
        let shown = observed.shown.iter().filter_map(|shown| {
            let to = cells(shown.address)?;
            Some(ShownCells { device: shown.device, from: shown.cell, to })
        });
        let shown = shown.collect();
        let mut places: Vec<Address> =
            observed.was.iter().map(|remembered| remembered.place).collect();
        places.extend(observed.operands.iter().map(|operand| operand.address));
        places.extend(observed.arrays.iter().flat_map(|named| named.array.addresses()));
        let (bits, words) = (Vec::new(), Vec::new());
        let view = View { code, symbols, ladder, observed, bits, words, was, shown };
        let mut draft = ViewDraft { view, seen: HashSet::new() };
        places.into_iter().for_each(|place| draft.take(place));
        draft
    }

    /// The names and cells of the view.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// Adds what a condition reads.
    pub fn reads(&mut self, contact: &Contact) {
        for read in contact.reads_of_all() {
            match read {
                ReadOperand::Address(address) => self.take(address),
                ReadOperand::Array(array) => {
                    array.addresses().for_each(|address| self.take(address));
                }
            }
        }
    }

    fn take(&mut self, address: Address) {
        let View { symbols, ladder, observed, bits, words, .. } = &mut self.view;
        if !observed.is_of_program(address) {
            return;
        }
        let pair = (ladder.cell(address), symbols.layout.cell(address));
        match pair {
            (Some(Cell::Bit(from)), Some(to @ Cell::Bit(at))) if self.seen.insert(to) => {
                bits.push((from, at));
            }
            (Some(from), Some(to)) => {
                let word = |cell| match cell {
                    Cell::Word(word) => Some(word),
                    Cell::WordBit(bit) => Some(bit.word),
                    Cell::Bit(_) => None,
                };
                if let (Some(from), Some(at)) = (word(from), word(to))
                    && self.seen.insert(Cell::Word(at))
                {
                    words.push((from, at));
                }
            }
            _ => {}
        }
    }

    /// The view, with what was added.
    pub fn finish(self) -> Arc<View> {
        Arc::new(self.view)
    }
}

/// A rung of the observer, with what it names of the ladder.
pub(super) struct ObservedRung {
    /// For people: `observer: rung count-bottles`.
    pub text: String,
    /// Its place in the test file.
    pub place: Span,
    pub names: Vec<String>,
}

impl View {
    /// The program that its conditions see: the ladder, the observer, and what is remembered.
    pub fn observed(&self) -> &ObservedProgram {
        &self.observed
    }

    /// The bits and words of the observer's tags, in the order of its rungs, each with its cell in
    /// the view.
    pub fn own_operands(&self) -> impl Iterator<Item = (Cow<'_, str>, Cell)> {
        let own = self.observed.operands.iter();
        let own = own.filter(|operand| !self.observed.is_of_program(operand.address));
        own.filter_map(|operand| Some((operand.name(), self.symbols.layout.cell(operand.address)?)))
    }

    /// The rungs of the observer.
    pub(super) fn rungs(&self) -> impl Iterator<Item = ObservedRung> {
        let program = &self.observed.program;
        let block = self.observed.observer.map(|id| program.block(id));
        let rungs = block.into_iter().flat_map(|block| block.rungs.iter().enumerate());
        rungs.map(|(at, rung)| {
            let branches = rung.branches.iter().flat_map(|branch| &branch.contacts);
            let contacts = rung.legs.iter().flat_map(|leg| &leg.contacts).chain(branches);
            let read = contacts.flat_map(Contact::reads_of_all);
            let read = read.chain(rung.instructions().flat_map(|(_, one)| one.reads()));
            let addresses = read.map(|operand| match operand {
                ReadOperand::Address(address) => address,
                ReadOperand::Array(array) => array.element(0),
            });
            let own = addresses.filter(|address| self.observed.is_of_program(*address));
            let mut names: Vec<String> = own.map(|address| program.names.name(address)).collect();
            names.sort_unstable();
            names.dedup();
            let text = format!("observer: {}", rung.label("", at));
            ObservedRung { text, place: program.layers.in_file(rung.extent), names }
        })
    }

    /// The observer as a program of its own, for `why`; `None`: there is none. `files`: those of
    /// the controller's program, then the test file.
    pub(super) fn subject(&self, files: Vec<SourceFile>) -> Option<Subject> {
        let observer = self.observed.observer?;
        Some(Subject::new(Arc::new(self.observed.program.clone()), files).of_block(observer))
    }

    /// The cell of the controller that a cell of the view shows; `None` for what the view adds.
    pub(super) fn of_ladder(&self, cell: Cell) -> Option<Cell> {
        let address = self.symbols.layout.address(cell)?;
        self.ladder.cell(address).filter(|_| self.observed.is_of_program(address))
    }

    /// The cells of the controller that the view takes.
    pub(super) fn taken(&self) -> impl Iterator<Item = Cell> {
        let bits = self.bits.iter().map(|(from, _)| Cell::Bit(*from));
        bits.chain(self.words.iter().map(|(from, _)| Cell::Word(*from)))
    }

    /// Takes an image of the controller.
    pub(super) fn look(&self, image: &Image, machine: &mut Taped) {
        for (from, to) in &self.bits {
            machine.write_bit(*to, image.bit(*from));
        }
        for (from, to) in &self.words {
            machine.write_word(*to, image.word(*from));
        }
    }

    /// By `was(x)`: the value of x on an image of the view.
    pub(super) fn remember(&self, image: &Image, last: &mut Vec<i32>) {
        last.clear();
        last.extend(self.was.iter().map(|remembered| image.value(remembered.place)));
    }

    /// Shows the values at the end of the scan before.
    pub(super) fn show_remembered(&self, last: &[i32], machine: &mut Taped) {
        for (remembered, value) in self.was.iter().zip(last) {
            machine.write(remembered.kept, *value);
        }
    }

    /// A machine with the memory of the view, before its first scan.
    pub(super) fn machine(&self) -> Taped {
        Taped::new(Engine::new(self.code.clone()))
    }

    /// What a cell of a condition is; `None`: a cell that no condition can name, or memory of a
    /// field device.
    pub(super) fn seen(&self, cell: Cell) -> Option<SeenCell<'_>> {
        if self.shown.iter().any(|shown| shown.to == cell) {
            return None;
        }
        let kept = self.was.iter().find(|remembered| remembered.kept == cell);
        let of_ladder = || self.of_ladder(cell).map(SeenCell::Ladder);
        kept.map(SeenCell::Was)
            .or_else(of_ladder)
            .or_else(|| self.observed.observer.map(|_| SeenCell::Observer(cell)))
    }

    /// The cell whose values a cell has: for `was(x)` that of x, else the cell itself.
    pub(super) fn of_values(&self, cell: Cell) -> Cell {
        let kept = self.was.iter().find(|remembered| remembered.kept == cell);
        kept.map_or(cell, |remembered| remembered.place)
    }
}

/// What a cell of a condition is.
#[derive(Clone, Copy, Debug)]
pub(super) enum SeenCell<'v> {
    /// A cell of the controller, by its cell there.
    Ladder(Cell),
    /// A tag of the observer, by its cell in the view.
    Observer(Cell),
    /// `was(x)`.
    Was(&'v RememberedCells),
}

/// The memory of a view while a test is played.
pub(super) struct ViewMemory {
    view: Arc<View>,
    machine: Taped,
    /// What the view takes from the controller, scan by scan, if the rig keeps its inputs.
    tape: Option<RigTape>,
    /// By `was(x)`: the value of x at the end of the last scan.
    last: Vec<i32>,
}

impl ViewMemory {
    /// The memory before the first scan.
    pub fn new(view: &Arc<View>, rig: &Rig) -> ViewMemory {
        let mut machine = view.machine();
        machine.start(rig.next_ns());
        let (view, last) = (Arc::clone(view), Vec::new());
        ViewMemory { view, machine, tape: None, last }.begins_run(rig)
    }

    /// The view.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// Memory as conditions see it.
    pub fn image(&self) -> &Image {
        self.machine.engine().image()
    }

    /// What `why` needs to explain the tags of the observer: all that the view took in this
    /// process.
    pub fn sections(&self) -> Vec<Arc<TapeSection>> {
        self.tape.as_ref().map_or_else(Vec::new, RigTape::sections)
    }

    /// RUN begins: what is remembered is memory as started.
    pub fn begins_run(self, rig: &Rig) -> ViewMemory {
        let mut memory = match rig.scans() {
            0 => self.with_tape(rig),
            _ => self,
        };
        memory.look(rig);
        memory.remember();
        memory.show_remembered();
        memory.settle(rig);
        memory
    }

    /// The same memory with a tape that begins here: its scans have the numbers of the process.
    fn with_tape(self, rig: &Rig) -> ViewMemory {
        let engine = self.machine.into_engine();
        let (mut machine, tape) = match rig.is_taped() {
            true => {
                let (machine, tape) = RigTape::of(engine);
                (machine, Some(tape))
            }
            false => (Taped::new(engine), None),
        };
        machine.enters(Mode::Run);
        ViewMemory { machine, tape, ..self }
    }

    /// A scan has ended, but for its passes.
    pub fn scanned(&mut self, rig: &Rig) {
        let observes = self.view.observed.observer.is_some();
        if observes {
            // Its status bits and words are those of the controller, where a rung reads them.
            let (number, now_ns) = (rig.scans() + 1, rig.next_ns());
            let (times, local_s) = (ScanTimes::default(), LocalTime::SIMULATED_S);
            self.machine.begin_scan(&ScanStart { number, now_ns, times, local_s });
        }
        self.show_remembered();
        self.look(rig);
        if observes {
            self.machine.execute();
        }
        self.remember();
        self.settle(rig);
    }

    fn settle(&mut self, rig: &Rig) {
        if let Some(tape) = &mut self.tape {
            self.machine.settle();
            tape.drain(rig.program());
        }
    }

    /// Takes the memory of the controller as it now is.
    pub fn look(&mut self, rig: &Rig) {
        self.view.look(rig.image(), &mut self.machine);
        for ShownCells { device, from, to } in &self.view.shown {
            self.machine.write(*to, rig.device_value(*device, *from));
        }
    }

    fn remember(&mut self) {
        self.view.remember(self.machine.engine().image(), &mut self.last);
    }

    fn show_remembered(&mut self) {
        self.view.show_remembered(&self.last, &mut self.machine);
    }

    /// A reload has brought the program of another view: what the view has beside the memory of
    /// the controller stays, by its names.
    pub fn reload(mut self, view: &Arc<View>, rig: &Rig) -> ViewMemory {
        let lowered = |view: &'_ View| (view.code.clone(), view.symbols.clone());
        let ((old_code, old_symbols), (code, symbols)) = (lowered(&self.view), lowered(view));
        let plan = ReloadPlan::new(
            LoweredProgram { program: &old_code, symbols: &old_symbols },
            LoweredProgram { program: &code, symbols: &symbols },
        );
        let mut machine = Taped::new(Engine::new(code));
        machine.adopt(&mut self.machine, &plan.transfer, true, &[]);
        let names = self.view.observed.was.iter().map(|remembered| &remembered.name);
        let last: HashMap<&String, i32> = names.zip(self.last.iter().copied()).collect();
        let of_new = |remembered: &Remembered| last.get(&remembered.name).copied().unwrap_or(0);
        let last = view.observed.was.iter().map(of_new).collect();
        let view = Arc::clone(view);
        let mut memory = ViewMemory { view, machine, tape: None, last }.with_tape(rig);
        memory.look(rig);
        memory.settle(rig);
        memory
    }
}
