//! What happens behind a scan, as in the model's `events`: a stop, a new process, a power cut.
//!
//! Called behind the last turn. Each step changes memory under the condition that its event
//! happens, in the order of `ModelEvents::happen`: the passes of a last scan, the image, the
//! memory of a new process with its passes, the start. The image that was kept last has latches of
//! its own.

use super::encoder::Encoder;
use super::held::Next;
use super::number::Number;
use crate::aig::Literal;
use crate::events::{KeptLimits, RememberedCell, RetainedCell, ScanEvent};
use crate::gates::Held;
use rungd_engine::isa::status::{dst, st};
use rungd_engine::isa::{Bit, BlockId, StageId, Word, WordSpace};
use rungd_engine::{BitCell, BlockRole, Cell, ResumeBits, WordCell};
use rustc_hash::FxHashMap;

/// A cell with its value at the end of a scan.
struct CellNumber {
    cell: Cell,
    value: Number,
}

/// An image that a new process finds.
struct FoundNumbers {
    /// What is retained and may change, with its value.
    cells: Vec<FoundNumber>,
    /// Whether the passes of a stop have been executed on it.
    is_final: Literal,
    /// What is kept of the Stages, with the values of the image.
    stages: FxHashMap<u32, Literal>,
}

struct FoundNumber {
    retained: RetainedCell,
    value: Number,
}

impl Encoder<'_> {
    /// Lets happen what happens behind the scan.
    pub(super) fn end_events(&mut self) {
        if self.happens.is_empty() {
            return;
        }
        let continues = self.any_event(ScanEvent::continues);
        let begins_process = self.any_event(ScanEvent::begins_process);
        let (last, stages) = (self.last_scan(), self.stages_at_end());
        let untouched = self.untouched();
        let ends = self.graph.and(continues, last);
        self.under(ends, |scan| scan.terminate());
        let found = self.image(last, stages);
        self.under(begins_process, |scan| scan.begin_process(&found));
        self.under(continues, |scan| scan.start(&found.stages));
        self.under(continues, |scan| scan.put_all(&untouched));
        self.under(continues, |scan| scan.remember(begins_process));
        self.begin_ages(continues, begins_process);
        self.begin_status(continues);
    }

    /// Whether a cell is not always the same.
    fn changes(&self, cell: Cell) -> bool {
        let is_written = match cell {
            Cell::Bit(bit) => self.written.has_bit(bit),
            Cell::Word(word) => self.written.word(word).is_some(),
            Cell::WordBit(_) => false,
        };
        is_written || self.model.inputs.iter().any(|input| input.cell == cell)
    }

    /// Whether a cell passes a value within the scan: it has none between two scans.
    fn is_passing(&self, cell: Cell) -> bool {
        let layout = &self.code.layout;
        let is_untouched = match cell {
            Cell::Bit(BitCell(bit)) => {
                bit >= layout.bit_count() && self.bits[bit as usize].is_none()
            }
            Cell::Word(WordCell(word)) => {
                word >= layout.word_count() && !self.words.contains_key(&word)
            }
            Cell::WordBit(_) => false,
        };
        is_untouched || self.passing.contains_key(&cell)
    }

    fn value(&mut self, cell: Cell) -> Number {
        match cell {
            Cell::Bit(BitCell(bit)) => Number::of_bit(self.bit(bit)),
            Cell::Word(WordCell(word)) => self.word(word),
            Cell::WordBit(_) => unreachable!("what is retained is whole"),
        }
    }

    fn put(&mut self, cell: Cell, value: &Number) {
        match cell {
            Cell::Bit(BitCell(bit)) => self.put_bit(bit, value.bit(0)),
            Cell::Word(WordCell(word)) => self.put_word(word, value.clone()),
            Cell::WordBit(_) => unreachable!("what is retained is whole"),
        }
    }

    fn put_all(&mut self, cells: &[CellNumber]) {
        cells.iter().for_each(|one| self.put(one.cell, &one.value));
    }

    /// What no event touches.
    fn untouched(&mut self) -> Vec<CellNumber> {
        let cells = self.model.events.observed.iter().copied();
        let cells: Vec<Cell> =
            cells.filter(|cell| self.changes(*cell) && !self.is_passing(*cell)).collect();
        cells.into_iter().map(|cell| CellNumber { cell, value: self.value(cell) }).collect()
    }

    /// What is kept of the Stages of Programs at the end of a scan, by bit.
    fn stages_at_end(&mut self) -> FxHashMap<u32, Literal> {
        let mut all = FxHashMap::default();
        for kept in &self.code.kept {
            let (runs, first) =
                (self.running(kept.program), self.own(Held::FirstTurn(kept.program)));
            all.insert(kept.holds().0, Literal::TRUE);
            all.insert(kept.running().0, runs);
            all.insert(kept.begins().0, self.graph.and(runs, first));
            for (n, stage) in (0..).zip(self.stages_of(kept.program)) {
                all.insert(kept.stage(n).0, self.stage_on(stage));
            }
        }
        all
    }

    /// The passes behind a last scan; then no block runs.
    fn terminate(&mut self) {
        for id in self.code.order.clone() {
            if self.model.events.observer != Some(id) {
                self.pass_block(id);
            }
        }
        self.halt_all();
    }

    /// The passes of everything, executed or not.
    fn terminate_all(&mut self) {
        let code = self.code;
        for id in code.order.iter().filter(|id| self.model.events.observer != Some(**id)) {
            let block = &code.blocks[id.0 as usize];
            if block.own.has_rungs {
                self.pass(&block.own);
            }
            for stage in block.stages.clone() {
                if code.stages[stage as usize].has_rungs {
                    self.pass(&code.stages[stage as usize]);
                }
            }
            for stage in block.stages.clone() {
                self.switch_stage(StageId(stage), Literal::FALSE);
            }
        }
        for id in &code.subroutines {
            if code.blocks[id.0 as usize].own.has_rungs {
                self.pass(&code.blocks[id.0 as usize].own);
            }
        }
        self.halt_all();
    }

    fn halt_all(&mut self) {
        for id in (0..self.code.blocks.len() as u32).map(BlockId) {
            self.put_running(id, Literal::FALSE);
            for held in [Held::PassDue(id), Held::FirstTurn(id)] {
                self.put_known_own(held);
            }
        }
    }

    /// Turns a state OFF, if it was read or written in the scan; else it is OFF between two scans.
    fn put_known_own(&mut self, held: Held) {
        if self.own.contains_key(&held) {
            self.put_own_if(Literal::TRUE, held, Literal::FALSE);
        }
    }

    /// Keeps the image of the scan, and returns what a new process finds.
    fn image(&mut self, last: Literal, present_stages: FxHashMap<u32, Literal>) -> FoundNumbers {
        let older = self.older_image(last);
        let stays = self.image_stays(last);
        let mut stages = present_stages.clone();
        let mut cells = Vec::new();
        for retained in self.model.events.retained.clone() {
            let of_stages = match retained.cell {
                Cell::Bit(BitCell(bit)) => present_stages.get(&bit).copied(),
                Cell::Word(_) | Cell::WordBit(_) => None,
            };
            let present = match of_stages {
                Some(bit) => Number::of_bit(bit),
                None if self.changes(retained.cell) => self.value(retained.cell),
                None => continue,
            };
            let value = match retained.image {
                Some(_) => self.kept_value(retained.cell, &present, ImageChoice { older, stays }),
                None => present,
            };
            match (of_stages, retained.cell) {
                (Some(_), Cell::Bit(BitCell(bit))) => {
                    stages.insert(bit, value.bit(0));
                }
                _ => cells.push(FoundNumber { retained, value }),
            }
        }
        let is_final = match self.model.events.image_is_final {
            None => last,
            Some(_) => {
                let latch = self.fixed_latch(false, Held::ImageIsFinal);
                let next = self.graph.mux(stays, latch, last);
                self.set_next(latch, next);
                self.graph.mux(older, latch, last)
            }
        };
        FoundNumbers { cells, is_final, stages }
    }

    /// Whether a new process finds an image that is older than the scan.
    fn older_image(&mut self, last: Literal) -> Literal {
        let before = self.any_event(|event| event == ScanEvent::PowerCutBeforeImage);
        let (first, is_older) = (self.beginning(), !last);
        let older = self.graph.and(before, is_older);
        self.graph.and(older, !first)
    }

    /// Whether the image that was kept last stays the newest one.
    fn image_stays(&mut self, last: Literal) -> Literal {
        let older = self.older_image(last);
        let nothing = self.any_event(|_| true);
        let stays = self.graph.or(older, !nothing);
        let first = self.beginning();
        self.graph.and(stays, !first)
    }

    /// The value of a cell in the image that a new process finds; the cell has an older one.
    fn kept_value(&mut self, cell: Cell, present: &Number, choice: ImageChoice) -> Number {
        // The first scan keeps an image before anything finds this one.
        let low = present.low;
        let latches = Number::made(low, present.high, |at| {
            let held = match cell {
                Cell::Bit(bit) => Held::ImageBit(bit),
                Cell::Word(word) => Held::ImageWordBit(word, at as u8),
                Cell::WordBit(_) => unreachable!("what is retained is whole"),
            };
            self.fixed_latch(low >> at & 1 == 1, held)
        });
        let next = Number::mux(&mut self.graph, choice.stays, &latches, present);
        for (at, latch) in latches.bits().to_vec().into_iter().enumerate() {
            if latch.as_constant().is_none() {
                self.set_next(latch, next.bit(at));
            }
        }
        Number::mux(&mut self.graph, choice.older, &latches, present)
    }

    /// The memory of a new process, before its start.
    fn begin_process(&mut self, found: &FoundNumbers) {
        let seconds = self.model.events.down.map(|down| self.word(down.next.0));
        self.forget();
        for FoundNumber { retained, value } in &found.cells {
            let value = match retained.limits {
                None => value.clone(),
                Some(KeptLimits { low, high }) => {
                    let cold = self.cold(retained.cell);
                    let outside = value.is_outside(&mut self.graph, low, high);
                    self.choose(outside, &cold, value)
                }
            };
            self.put(retained.cell, &value);
        }
        if self.model.events.has_image {
            self.under(!found.is_final, |scan| scan.terminate_all());
        }
        if let (Some(down), Some(seconds)) = (self.model.events.down, seconds) {
            self.put_word(down.word.0, seconds);
        }
    }

    /// The value of a cell after a cold start.
    fn cold(&self, cell: Cell) -> Number {
        Number::constant(self.start.fresh_value(cell).into())
    }

    /// Everything has the value of a cold start; the status, until step 1 of the next scan.
    fn forget(&mut self) {
        let bits = (0..self.code.bit_count).map(|bit| Cell::Bit(BitCell(bit)));
        let words = (0..self.code.word_count).map(|word| Cell::Word(WordCell(word)));
        let cells: Vec<Cell> = bits
            .chain(words)
            .filter(|cell| self.changes(*cell) || self.is_status(*cell))
            .filter(|cell| !self.is_passing(*cell))
            .collect();
        for cell in cells {
            let cold = self.cold(cell);
            self.put(cell, &cold);
        }
        self.halt_all();
        let known: Vec<Held> = self.own.keys().copied().collect();
        for held in known {
            let is_of_stage = matches!(held, Held::StageExecuted(_) | Held::StagePassDue(_));
            let observer = self.model.events.observer;
            if is_of_stage || matches!(held, Held::Executed(id) if observer != Some(id)) {
                self.put_known_own(held);
            }
        }
    }

    /// Whether step 1 of every scan writes a cell.
    fn is_status(&self, cell: Cell) -> bool {
        match cell {
            Cell::Bit(BitCell(bit)) => {
                bit.checked_sub(self.status()).is_some_and(|n| (n as usize) < st::COUNT)
            }
            Cell::Word(WordCell(word)) => {
                let WordCell(first) = self.code.layout.word(Word::Space(WordSpace::Dst, 0));
                word.checked_sub(first).is_some_and(|n| (n as usize) < dst::COUNT)
            }
            Cell::WordBit(_) => false,
        }
    }

    /// The start of RUN. `stages`: what is kept of them.
    fn start(&mut self, stages: &FxHashMap<u32, Literal>) {
        let code = self.code;
        for id in &code.order {
            let kept = code.kept.iter().find(|kept| kept.program == *id);
            match (code.blocks[id.0 as usize].role, kept) {
                (BlockRole::Program { .. }, Some(kept)) => self.restore_program(*kept, stages),
                (BlockRole::Program { autostart: true }, None)
                | (BlockRole::FirstScan | BlockRole::TopOfScan | BlockRole::BottomOfScan, _) => {
                    self.mark_started(*id);
                }
                (BlockRole::Program { autostart: false }, None)
                | (BlockRole::Task | BlockRole::LastScan | BlockRole::Subroutine, _) => {}
            }
        }
    }

    /// A Program whose Stages are retained goes on where it was.
    fn restore_program(&mut self, kept: ResumeBits, stages: &FxHashMap<u32, Literal>) {
        let id = kept.program;
        let [runs, begins] = [kept.running(), kept.begins()].map(|bit| stages[&bit.0]);
        let (anew, continues) = (self.graph.and(runs, begins), self.graph.and(runs, !begins));
        self.under(anew, |scan| scan.mark_started(id));
        self.under(continues, |scan| {
            scan.put_running(id, Literal::TRUE);
            scan.put_bit(scan.code.layout.bit(Bit::Done(id)).0, Literal::FALSE);
            for (n, stage) in (0..).zip(scan.stages_of(id)) {
                scan.switch_stage(stage, stages[&kept.stage(n).0]);
            }
        });
    }

    /// What is remembered is memory as started.
    fn remember(&mut self, begins_process: Literal) {
        for RememberedCell { place, kept, is_of_device } in self.model.events.remembered.clone() {
            let mut value = self.value(place);
            if is_of_device {
                value = self.choose(begins_process, &Number::constant(0), &value);
            }
            self.put(kept, &value);
        }
    }

    /// The times since the last executions: a new process begins them anew. The time up to a start
    /// is counted here if scans may come late: it is a period.
    fn begin_ages(&mut self, continues: Literal, begins_process: Literal) {
        let observer = self.model.events.observer;
        for (age, max) in self.ages.clone() {
            let is_observer = observer.is_some_and(|id| age.is_of(id));
            if self.late.is_some() {
                let later = self.own_number(age, max).add(&mut self.graph, &Number::constant(1));
                let later = later.clamp(&mut self.graph, 0, max);
                self.under(continues, |scan| scan.put_own_number(age, &later, max));
            }
            if !is_observer {
                let none = Number::constant(0);
                self.under(begins_process, |scan| scan.put_own_number(age, &none, max));
            }
        }
    }

    /// Clock bits, and the numbers of scans and of the first one, begin with RUN.
    fn begin_status(&mut self, continues: Literal) {
        let first = self.first_scan();
        self.set_next(first, continues);
        let toggle = BitCell(self.status() + st::SCAN_TOGGLE);
        let counter = self.code.layout.word(Word::Space(WordSpace::Dst, dst::SCAN_COUNTER));
        for at in 0..self.latches.len() {
            let (holds, next) = (self.latches[at].holds, self.latches[at].next);
            let counts = matches!(holds, Held::Clock(..))
                || holds == Held::Bit(toggle)
                || matches!(holds, Held::WordBit(word, _) if word == counter);
            if let (true, Next::Fixed(next)) = (counts, next) {
                self.latches[at].next = Next::Fixed(self.graph.and(next, !continues));
            }
        }
    }
}

/// Which image is found, and which one stays.
#[derive(Clone, Copy)]
struct ImageChoice {
    /// A new process finds the image that was kept last.
    older: Literal,
    /// That image stays the newest one.
    stays: Literal,
}
