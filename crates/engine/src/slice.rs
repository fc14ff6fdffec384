//! The slice of a program for some cells: only the operations that can affect these cells.
//!
//! `observe` executes a slice instead of the whole program, because an answer depends on few of ten
//! thousand rungs. A slice has the cells of its program, so a state of one engine is also a state
//! of the other. A slice *knows* every cell that a kept operation touches: the cell has the same
//! value as in the whole program. The values of all other cells are meaningless.
//!
//! A slice keeps every operation that writes a known cell. The bits of the operation's block and
//! Stage decide whether it executes, so these bits are then known too. Turns and passes execute in
//! every slice; if one of them writes a known cell, the bits of its block are known too. The CALLs
//! and RETURNs of a subroutine decide whether its operations execute, and what keeps the time of
//! its timers decides how long they time: they are kept with them. STOP is always kept. The status
//! bits of mishaps that a kept MATH can turn ON do not become known by that, so they are no reason
//! to keep other MATHs.
//!
//! A slice also has its [`SliceCells`]: if the last execution of an operation changed nothing, and
//! none of the operation's cells has changed since, then its next execution would change nothing
//! either.

use std::ops::Range;

use super::control::{Control, ControlKind};
use super::events::Element;
use super::eye::ScanStep;
use super::image::{BitCell, WordCell};
use super::layout::{Cell, WordBitCell};
use super::ops::{CellRange, FormulaReads, Formulas, Math, OpKind, TouchedCells, reads};
use super::program::{ElementCode, EngineProgram, PassStep};
use super::record::RECORD;
use super::role::FieldRole;
use super::wiring::{SliceCells, SliceCellsBuilder};
use super::written::Stretches;
use crate::isa::{Bit, BlockId, ElementId, NumberMap, StageId, Structure, Word};

/// The longest stretch of written cells whose writers are listed cell by cell.
const LISTED_MAX: u32 = 16;

/// A slice of a program.
#[derive(Clone, Debug)]
pub struct Slice {
    /// The program with only the kept batches.
    pub program: EngineProgram,
    /// For each batch of the slice, a range of places in the whole program. The last place is that
    /// of the batch itself. The places before it are those of the batches of its element that were
    /// left out since the last kept batch.
    pub places: Vec<Range<u32>>,
    /// The cells of its steps.
    pub wiring: SliceCells,
    /// Whether each cell is known; bits first.
    known: Vec<bool>,
    /// Whether each step of a pass is kept. The slice executes the others too.
    passes: Vec<bool>,
}

impl Slice {
    /// Whether a step of a pass, by its index in the program, can affect a known cell.
    pub fn keeps_pass(&self, step: u32) -> bool {
        self.passes[step as usize]
    }

    /// Whether a cell has the value that it has in the whole program.
    pub fn knows(&self, cell: Cell) -> bool {
        self.known[number(&self.program, cell)]
    }

    /// The step of the whole program for a step of the slice.
    pub fn whole(&self, deed: ScanStep) -> ScanStep {
        match deed {
            ScanStep::Batch(at) => ScanStep::Batch(self.places[at as usize].end - 1),
            ScanStep::Turn(_) | ScanStep::Element(_) | ScanStep::Pass(_) => deed,
        }
    }

    /// The code of a block's own rungs or of a Stage.
    pub fn code(&self, element: Element) -> &ElementCode {
        match element {
            Element::Block(BlockId(at)) => &self.program.blocks[at as usize].own,
            Element::Stage(StageId(at)) => &self.program.stages[at as usize],
        }
    }
}

impl EngineProgram {
    /// The slice for some cells.
    pub fn slice(&self, cells: &[Cell]) -> Slice {
        let reads = self.formulas();
        let formulas = Formulas { reads: &reads, status: self.status() };
        let mut cone = SliceSearch::new(self, formulas);
        cells.iter().for_each(|cell| cone.add(*cell));
        cone.close();
        self.cut(cone)
    }

    /// The slice that contains the whole program.
    pub fn whole(&self) -> Slice {
        let reads = self.formulas();
        let formulas = Formulas { reads: &reads, status: self.status() };
        let mut cone = SliceSearch::new(self, formulas);
        cone.kept.fill(true);
        cone.known.fill(true);
        self.cut(cone)
    }

    /// The cells that each batch reads, private cells included.
    pub fn read_by_batches(&self) -> Vec<Stretches> {
        let reads = self.formulas();
        let formulas = Formulas { reads: &reads, status: self.status() };
        let cone = SliceSearch::new(self, formulas);
        let batches = 0..self.tables.batches.len() as u32;
        batches.map(|at| cone.touched(SliceStep::Batch(at)).0).collect()
    }

    /// The slice with the batches that a cone keeps.
    fn cut(&self, cone: SliceSearch) -> Slice {
        let mut program = self.clone();
        let (mut batches, mut places) = (Vec::new(), Vec::new());
        let own = program.blocks.iter_mut().map(|block| &mut block.own);
        for code in own.chain(&mut program.stages) {
            let (first, mut begin) = (places.len() as u32, code.batches.start);
            for at in code.batches.clone().filter(|at| cone.kept[*at as usize]) {
                batches.push(self.tables.batches[at as usize]);
                places.push(begin..at + 1);
                begin = at + 1;
            }
            code.batches = first..places.len() as u32;
        }
        program.tables.batches = batches;
        let wiring = cone.wiring(&places);
        let passes = self.tables.batches.len()..cone.kept.len() - self.blocks.len();
        let passes = cone.kept[passes].to_vec();
        Slice { program, places, wiring, known: cone.known, passes }
    }

    /// Adds the cells of a control instruction, except the bits of blocks and Stages.
    pub fn touched_by_control(&self, control: &Control, touches: &mut TouchedCells) {
        touches.bits_read.push(control.leg.cell());
        match control.kind {
            ControlKind::Restart(of) => touches.bits_written.push(of.history),
            ControlKind::EnableOnce { history, task: _ } => touches.bits_written.push(history),
            ControlKind::EnableEvery { every, pick, task: _ } => {
                touches.words_read.push(every);
                pick.into_iter().for_each(|pick| self.tables.picks[pick as usize].touches(touches));
            }
            ControlKind::Run(_)
            | ControlKind::Halt(_)
            | ControlKind::Exit
            | ControlKind::Jump(_)
            | ControlKind::StageOn(_)
            | ControlKind::StageOff(_)
            | ControlKind::Converge { .. }
            | ControlKind::Stop
            | ControlKind::Call(_)
            | ControlKind::Return => {}
            ControlKind::KeepTime { missed_ms } | ControlKind::GiveTime { missed_ms } => {
                touches.words_written.push(missed_ms);
            }
        }
    }

    /// The cells that each formula reads, by the number of its MATH. Not for MATHs in columns.
    pub fn formulas(&self) -> Vec<FormulaReads> {
        let mut all = Vec::new();
        for math in self.tables.ops.math.iter().chain(&self.tables.picks) {
            let at = math.number as usize;
            all.resize(all.len().max(at + 1), FormulaReads::default());
            all[at] = reads(&self.tables.steps[math.first as usize..][..math.count as usize]);
        }
        all
    }

    /// The elements with their code.
    fn elements(&self) -> impl Iterator<Item = (ElementId, &ElementCode)> {
        (0..).map(BlockId).zip(&self.blocks).flat_map(move |(block, code)| {
            let own = (ElementId { block, stage: None }, &code.own);
            let stages = code.stages.clone().map(move |at| {
                let stage = Some(StageId(at));
                (ElementId { block, stage }, &self.stages[at as usize])
            });
            [own].into_iter().chain(stages)
        })
    }
}

/// The number of a cell: bits first.
fn number(program: &EngineProgram, cell: Cell) -> usize {
    match cell {
        Cell::Bit(BitCell(at)) => at as usize,
        Cell::Word(WordCell(at)) | Cell::WordBit(WordBitCell { word: WordCell(at), .. }) => {
            (program.bit_count + at) as usize
        }
    }
}

/// A step that may write cells.
#[derive(Clone, Copy, Debug)]
enum SliceStep {
    Batch(u32),
    Pass(u32),
    Turn(u32),
}

/// The numbers of cells, sorted.
struct CellNumbers {
    numbers: Vec<u32>,
    /// Whether a timer is among the cells.
    has_timer: bool,
}

/// The known cells and the kept steps, while they are being searched.
struct SliceSearch<'p> {
    program: &'p EngineProgram,
    formulas: Formulas<'p>,
    /// The steps that write a cell, by the cell's number. Memory has far more cells than a small
    /// program writes.
    writers: NumberMap<u32, Vec<SliceStep>>,
    /// The steps that write long stretches of cells.
    wide: Vec<(SliceStep, Stretches)>,
    /// The element of each step: batches, then passes, then turns.
    elements: Vec<ElementId>,
    kept: Vec<bool>,
    /// By subroutine: the batches that are kept with it, until it has a kept step.
    calls: NumberMap<u32, Vec<u32>>,
    /// Whether each cell is known.
    known: Vec<bool>,
    /// Known cells whose writers are not kept yet.
    todo: Vec<Cell>,
}

impl<'p> SliceSearch<'p> {
    fn new(program: &'p EngineProgram, formulas: Formulas<'p>) -> SliceSearch<'p> {
        let tables = &program.tables;
        let steps = tables.batches.len() + tables.terminations.len() + program.blocks.len();
        let cells = (program.bit_count + program.word_count) as usize;
        let nobody = ElementId { block: BlockId(0), stage: None };
        let mut cone = SliceSearch {
            program,
            formulas,
            writers: NumberMap::default(),
            wide: Vec::new(),
            elements: vec![nobody; steps],
            kept: vec![false; steps],
            calls: NumberMap::default(),
            known: vec![false; cells],
            todo: Vec::new(),
        };
        for (element, code) in program.elements() {
            let batches = code.batches.clone().map(SliceStep::Batch);
            let passes = code.terminations.clone().map(SliceStep::Pass);
            batches.chain(passes).for_each(|step| cone.enter(step, element));
        }
        for at in 0..program.blocks.len() as u32 {
            cone.enter(SliceStep::Turn(at), ElementId { block: BlockId(at), stage: None });
        }
        cone
    }

    /// The number of a step.
    fn index(&self, step: SliceStep) -> usize {
        let (batches, passes) = {
            let tables = &self.program.tables;
            (tables.batches.len(), tables.terminations.len())
        };
        match step {
            SliceStep::Batch(at) => at as usize,
            SliceStep::Pass(at) => batches + at as usize,
            SliceStep::Turn(at) => batches + passes + at as usize,
        }
    }

    /// Adds a step to the writers of the cells that it writes; keeps the step if it is a STOP.
    fn enter(&mut self, step: SliceStep, element: ElementId) {
        let index = self.index(step);
        self.elements[index] = element;
        let written = self.touched(step).1;
        let mut all = written.bits.iter().chain(&written.words);
        if all.any(|(_, count)| *count > LISTED_MAX) {
            self.wide.push((step, written));
        } else {
            for cell in cells(&written) {
                let number = self.number(cell);
                self.writers.entry(number).or_default().push(step);
            }
        }
        if let SliceStep::Batch(at) = step {
            self.enter_call(at, element);
        }
        if self.stops(step) {
            self.keep(step);
        }
    }

    /// Notes a CALL for its subroutine, and a RETURN and the times of timers for their own.
    fn enter_call(&mut self, batch: u32, element: ElementId) {
        for kind in self.control_kinds(batch) {
            let subroutine = match kind {
                ControlKind::Call(at) => self.program.subroutines[at as usize],
                ControlKind::Return
                | ControlKind::KeepTime { .. }
                | ControlKind::GiveTime { .. } => element.block,
                ControlKind::Run(_)
                | ControlKind::Restart(_)
                | ControlKind::Halt(_)
                | ControlKind::Exit
                | ControlKind::EnableOnce { .. }
                | ControlKind::EnableEvery { .. }
                | ControlKind::Jump(_)
                | ControlKind::StageOn(_)
                | ControlKind::StageOff(_)
                | ControlKind::Converge { .. }
                | ControlKind::Stop => continue,
            };
            self.calls.entry(subroutine.0).or_default().push(batch);
        }
    }

    /// The control instructions of a batch.
    fn control_kinds(&self, batch: u32) -> impl Iterator<Item = ControlKind> + use<'p> {
        let tables = &self.program.tables;
        let batch = tables.batches[batch as usize];
        let count = if batch.kind == OpKind::Control { batch.count } else { 0 };
        let all = tables.ops.control.iter().skip(batch.first as usize).take(count as usize);
        all.map(|control| control.kind)
    }

    fn stops(&self, step: SliceStep) -> bool {
        let SliceStep::Batch(at) = step else { return false };
        self.control_kinds(at).any(|kind| matches!(kind, ControlKind::Stop))
    }

    /// Makes a cell known; for a member of a structure, the whole structure.
    fn add(&mut self, cell: Cell) {
        let cell = cell.whole();
        match self.structure(cell) {
            Some(structure) => self.members(structure).for_each(|member| self.add_one(member)),
            None => self.add_one(cell),
        }
    }

    /// The structure of which a cell is a member.
    fn structure(&self, cell: Cell) -> Option<Structure> {
        self.program.layout.structure(match cell {
            Cell::Bit(BitCell(at)) => at / RECORD as u32,
            Cell::Word(WordCell(at)) | Cell::WordBit(WordBitCell { word: WordCell(at), .. }) => at,
        })
    }

    /// The cells of a structure, including its private state.
    fn members(&self, structure: Structure) -> impl Iterator<Item = Cell> + use<> {
        let acc = Cell::Word(self.program.layout.word(Word::Acc(structure)));
        let bits = self.program.layout.record_bits(structure).map(|at| Cell::Bit(BitCell(at)));
        bits.chain([acc])
    }

    /// The numbers of cells, with all cells of each structure.
    fn numbers(&self, stretches: &Stretches) -> CellNumbers {
        let (mut numbers, mut has_timer) = (Vec::new(), false);
        for cell in cells(stretches) {
            let structure = self.structure(cell);
            has_timer |= matches!(structure, Some(Structure::Timer(_)));
            match structure {
                Some(structure) => {
                    numbers.extend(self.members(structure).map(|cell| self.number(cell)))
                }
                None => numbers.push(self.number(cell)),
            }
        }
        numbers.sort_unstable();
        numbers.dedup();
        CellNumbers { numbers, has_timer }
    }

    fn number(&self, cell: Cell) -> u32 {
        number(self.program, cell) as u32
    }

    /// The wiring of the kept batches, and of all passes and turns.
    fn wiring(&self, places: &[Range<u32>]) -> SliceCells {
        let tables = &self.program.tables;
        let mut wiring = SliceCellsBuilder::new(self.known.len());
        for place in places {
            let at = place.end - 1;
            let (read, written) = self.touched(SliceStep::Batch(at));
            let is_control = tables.batches[at as usize].kind == OpKind::Control;
            let (written, read) = (self.numbers(&written), self.numbers(&read));
            wiring.batch(&read.numbers, &written.numbers, is_control || written.has_timer);
        }
        let passes = (0..tables.terminations.len() as u32).map(SliceStep::Pass);
        let turns = (0..self.program.blocks.len() as u32).map(SliceStep::Turn);
        let written = |step| self.numbers(&self.touched(step).1).numbers;
        passes.chain(turns).for_each(|step| wiring.step(&written(step)));
        wiring.wired()
    }

    fn add_one(&mut self, cell: Cell) {
        let known = &mut self.known[number(self.program, cell)];
        if !std::mem::replace(known, true) {
            self.todo.push(cell);
        }
    }

    /// Keeps every step that writes a known cell.
    fn close(&mut self) {
        while let Some(cell) = self.todo.pop() {
            let listed = self.writers.remove(&self.number(cell));
            listed.into_iter().flatten().for_each(|step| self.keep(step));
            for at in 0..self.wide.len() {
                if self.wide[at].1.has(cell) {
                    self.keep(self.wide[at].0);
                }
            }
        }
    }

    fn keep(&mut self, step: SliceStep) {
        let index = self.index(step);
        if std::mem::replace(&mut self.kept[index], true) {
            return;
        }
        let ElementId { block, stage } = self.elements[index];
        let (read, mut written) = self.touched(step);
        if let SliceStep::Turn(_) = step {
            written = Stretches::default();
        }
        let mishaps = self.formulas.mishaps();
        written.bits.retain(|(first, _)| !mishaps.contains(first));
        for bit in [Bit::Running(block)].into_iter().chain(stage.map(Bit::Stage)) {
            self.add(Cell::Bit(self.program.layout.bit(bit)));
        }
        cells(&read).chain(cells(&written)).for_each(|cell| self.add(cell));
        let calls = self.calls.remove(&block.0);
        calls.into_iter().flatten().for_each(|at| self.keep(SliceStep::Batch(at)));
    }

    /// The cells that a step reads, and the cells that it writes.
    fn touched(&self, step: SliceStep) -> (Stretches, Stretches) {
        let mut touches = TouchedCells { formulas: self.formulas, ..TouchedCells::default() };
        let mut written = Stretches::default();
        match step {
            SliceStep::Batch(at) => self.batch(at, &mut touches, &mut written),
            SliceStep::Pass(at) => self.pass(at, &mut touches),
            SliceStep::Turn(at) => written = self.program.written_by_turn(BlockId(at)),
        }
        written.add(&touches);
        (read(&touches), written)
    }

    fn batch(&self, at: u32, touches: &mut TouchedCells, written: &mut Stretches) {
        let tables = &self.program.tables;
        let batch = tables.batches[at as usize];
        let element = self.elements[at as usize];
        for at in batch.first as usize..(batch.first + batch.count) as usize {
            if matches!(batch.kind, OpKind::Math | OpKind::Columns) {
                tables.ops.math[at].touches(touches);
            } else if batch.kind == OpKind::Control {
                let control = &tables.ops.control[at];
                self.program.control(control.kind, element, written);
                self.program.touched_by_control(control, touches);
            } else {
                tables.ops.touches(batch.kind, at, touches);
            }
        }
    }

    fn pass(&self, at: u32, touches: &mut TouchedCells) {
        match &self.program.tables.terminations[at as usize] {
            PassStep::BitOff(bit) | PassStep::HistoryOff(bit) => touches.bits_written.push(*bit),
            PassStep::WordBitOff(bit) => bit.touches(touches),
            PassStep::Counter(counter, rule) => {
                counter.touches(touches);
                rule.touches(touches);
            }
            PassStep::Timer(timer, _) | PassStep::HoldTimer(timer) => timer.touches(touches),
            PassStep::CountUp(counter) | PassStep::CountDown(counter) => counter.touches(touches),
            PassStep::DisableTask(task) => {
                touches.bits_written.push(self.program.layout.bit(Bit::Running(*task)).0);
            }
            PassStep::Pick(pick) => self.pick(*pick).touches(touches),
        }
    }

    fn pick(&self, pick: u32) -> &'p Math {
        &self.program.tables.picks[pick as usize]
    }
}

/// The cells in `touches` that are read.
fn read(touches: &TouchedCells) -> Stretches {
    let one = |cell: &u32| (*cell, 1);
    let many = |cells: &CellRange| (cells.first, cells.count);
    let bits = touches.bits_read.iter().map(one).chain(touches.bit_arrays_read.iter().map(many));
    let words = touches.words_read.iter().map(one).chain(touches.word_arrays_read.iter().map(many));
    Stretches { bits: bits.collect(), words: words.collect(), word_bits: Vec::new() }
}

fn cells(stretches: &Stretches) -> impl Iterator<Item = Cell> + use<'_> {
    let bits = stretches.bits.iter().flat_map(|(first, count)| *first..first + count);
    let words = stretches.words.iter().flat_map(|(first, count)| *first..first + count);
    let words = words.chain(stretches.word_bits.iter().map(|bit| bit.word.0));
    bits.map(|at| Cell::Bit(BitCell(at))).chain(words.map(|at| Cell::Word(WordCell(at))))
}
