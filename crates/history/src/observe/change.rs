//! Finds the edits that would change a bit in the next scan, by a trial on a copy of the engine.
//!
//! The smallest set wins: one edit, then two, then three. A single edit is searched among the
//! reasons first, then among all inputs and operands that the ladder names and does not write. Sets
//! of two and three edits are searched among the reasons only. In a large program not every edit is
//! tried; the answer then reports this.

use super::answer::{BlockPlace, Edit, Remedy, SearchEnd};
use super::inquiry::Inquiry;
use super::past::TapeMoment;
use super::subject::Subject;
use rungd_engine::isa::{Address, Bit, BitSpace, BlockId, ElementId, Word, WordSpace};
use rungd_engine::{Cell, Engine, EngineCall, EngineState, ScanTimes};
use rungd_language::resolve::program::BlockKind;
use rungd_runtime::{TapeEntry, runs_behind};

/// The limit of a search: the number of scans times the number of operations.
const WORK_MAX: usize = 2_000_000;

/// The maximum number of reasons whose pairs and triples are tried.
const TOGETHER_MAX: usize = 10;

/// The period if the tape does not have two scans.
const PERIOD_NS: u64 = 10_000_000;

/// The maximum number of elements of an array that are tried as inputs.
const ELEMENTS_MAX: usize = 256;

/// An edit that can be tried.
#[derive(Clone, Copy, Debug, PartialEq)]
enum TriedEdit {
    Write(Cell, i32),
    Run(BlockId),
}

/// The start of a scan, as the tape has it.
#[derive(Clone, Copy)]
struct SeenBegin {
    at: TapeMoment,
    now_ns: u64,
    times: ScanTimes,
    /// Local time.
    local_s: i64,
}

/// A copy of the engine, and the next scan to execute on it.
struct TrialScan<'a> {
    subject: &'a Subject,
    engine: Engine,
    state: EngineState,
    begin: EngineCall,
    cell: Cell,
    tried: usize,
    tried_max: usize,
}

impl TrialScan<'_> {
    /// Whether these edits change the bit; `None`: the search has reached its limit.
    fn turns_over(&mut self, edits: &[TriedEdit]) -> Option<bool> {
        if self.tried >= self.tried_max {
            return None;
        }
        self.tried += 1;
        self.engine.resume(&self.state);
        self.engine.apply(self.begin);
        for edit in edits {
            match edit {
                TriedEdit::Write(cell, value) => {
                    self.engine.apply(EngineCall::Write(*cell, *value))
                }
                TriedEdit::Run(block) => self.engine.try_run(*block),
            }
        }
        self.engine.apply(EngineCall::Execute);
        let after = self.engine.image().value(self.cell);
        Some(after != self.state.value(self.cell))
    }

    /// The first set of `size` edits that changes the bit.
    fn search(&mut self, all: &[TriedEdit], size: usize) -> Option<Option<Vec<TriedEdit>>> {
        let mut places: Vec<usize> = (0..size).collect();
        if all.len() < size {
            return Some(None);
        }
        loop {
            let edits: Vec<TriedEdit> = places.iter().map(|at| all[*at]).collect();
            if self.turns_over(&edits)? {
                return Some(Some(edits));
            }
            let movable = (0..size).rev().find(|at| places[*at] < all.len() - size + at);
            let Some(at) = movable else { return Some(None) };
            places[at] += 1;
            for next in at + 1..size {
                places[next] = places[next - 1] + 1;
            }
        }
    }

    /// The edits that give an operand one of these values.
    fn values(&self, cell: Cell, values: &[i32]) -> Vec<TriedEdit> {
        let now = self.state.value(cell);
        let address = self.subject.address(cell);
        let (low, high) = match address {
            Some(Address::Word(word)) => self.subject.symbols.limits(word),
            Some(Address::Bit(_) | Address::Structure(_)) | None => (0, 1),
        };
        let mut tries: Vec<TriedEdit> = Vec::new();
        for value in values.iter().copied().filter(|value| (low..=high).contains(value)) {
            let edit = TriedEdit::Write(cell, value);
            if value != now && !tries.contains(&edit) {
                tries.push(edit);
            }
        }
        tries
    }

    /// Whether a person or the plant can change a cell, and nothing in the program writes it.
    fn is_free(&self, cell: Cell) -> bool {
        let address = self.subject.address(cell);
        let may = match address {
            Some(Address::Bit(Bit::Space(BitSpace::X, _))) => true,
            Some(Address::Bit(Bit::Space(space, _))) => space != BitSpace::St,
            Some(Address::Word(Word::Space(space, _))) => space != WordSpace::Dst,
            Some(Address::Bit(Bit::InWord(bit))) => bit.word.writable(),
            Some(Address::Bit(_) | Address::Word(_) | Address::Structure(_)) | None => false,
        };
        may && !self.subject.is_written(cell) && !self.state.is_forced(cell)
    }
}

impl Inquiry<'_> {
    /// The remedy that would change a bit in the scan after a moment.
    pub fn change(&mut self, cell: Cell, at: TapeMoment) -> Remedy {
        if self.replay.forced(cell, at).is_some() {
            return Remedy::Release;
        }
        self.propose(cell, vec![0, 1]);
        let Some(begin) = self.next_begin(at) else { return Remedy::NoScan };
        let Some(engine) = self.replay.seek(at.section, at.entry) else { return Remedy::NoScan };
        let state = EngineState::of(engine);
        let operations = self.replay.slice().places.len().max(1);
        let mut trial = TrialScan {
            subject: self.subject,
            engine: Engine::new(self.replay.slice().program.clone()),
            state,
            begin,
            cell,
            tried: 0,
            tried_max: (WORK_MAX / operations).clamp(64, 4096),
        };
        let change = self.try_all(&mut trial);
        let tried = trial.tried as u32;
        match change {
            Some(Some(edits)) if edits.is_empty() => Remedy::Itself,
            Some(Some(edits)) => Remedy::Edits(edits.iter().map(|edit| self.edit(*edit)).collect()),
            Some(None) => Remedy::None(SearchEnd { every_single: true, tried }),
            None => Remedy::None(SearchEnd { every_single: self.subject_is_tried(tried), tried }),
        }
    }

    /// Whether every single edit was tried.
    fn subject_is_tried(&self, tried: u32) -> bool {
        self.singles_end.is_some_and(|end| tried > end)
    }

    fn try_all(&mut self, trial: &mut TrialScan) -> Option<Option<Vec<TriedEdit>>> {
        if trial.turns_over(&[])? {
            return Some(Some(Vec::new()));
        }
        let reasons = self.reasons(trial);
        let others = self.others(trial, &reasons);
        for all in [&reasons, &others] {
            if let Some(found) = trial.search(all, 1)? {
                return Some(Some(found));
            }
        }
        self.singles_end = Some(trial.tried.saturating_sub(1) as u32);
        let mut together = reasons;
        together.truncate(TOGETHER_MAX);
        for size in [2, 3] {
            if let Some(found) = trial.search(&together, size)? {
                return Some(Some(found));
            }
        }
        Some(None)
    }

    /// Edits of the operands among the reasons, and of the Programs that do not run.
    fn reasons(&self, trial: &TrialScan) -> Vec<TriedEdit> {
        let free = self.free.iter().filter(|(cell, _)| trial.is_free(*cell));
        let mut tries: Vec<TriedEdit> =
            free.flat_map(|(cell, values)| trial.values(*cell, values)).collect();
        for block in &self.stopped {
            let block_place = self.subject.program.block(*block);
            let is_started = block_place.kind == BlockKind::Program && !block_place.is_main();
            if is_started && !tries.contains(&TriedEdit::Run(*block)) {
                tries.push(TriedEdit::Run(*block));
            }
        }
        tries
    }

    /// Edits of all other bits that the ladder names and that can affect the bit of the question.
    fn others(&self, trial: &TrialScan, reasons: &[TriedEdit]) -> Vec<TriedEdit> {
        let layout = &self.subject.symbols.layout;
        let named = self.subject.program.named(ELEMENTS_MAX);
        let cells = named.iter().filter_map(|operand| layout.cell(operand.address));
        let slice = self.replay.slice();
        let bits = cells
            .filter(|cell| cell.is_bit() && slice.knows(*cell))
            .filter(|cell| trial.is_free(*cell));
        let tries = bits.map(|cell| TriedEdit::Write(cell, 1 - trial.state.value(cell)));
        tries.filter(|edit| !reasons.contains(edit)).collect()
    }

    fn edit(&self, edit: TriedEdit) -> Edit {
        match edit {
            TriedEdit::Write(cell, value) => {
                let operand = self.subject.operand(cell);
                Edit::Write { operand, value }
            }
            TriedEdit::Run(block) => Edit::Run { block: self.block(block) },
        }
    }

    fn block(&self, block: BlockId) -> BlockPlace {
        self.subject.element(ElementId { block, stage: None })
    }

    /// The start of the scan after a moment, one period after the last start; `None` if no scan
    /// follows.
    fn next_begin(&mut self, at: TapeMoment) -> Option<EngineCall> {
        if !self.runs(at)? {
            return None;
        }
        let last = self.begin_before(at);
        let before = last.and_then(|last| self.begin_before(last.at));
        let section = self.replay.section(at.section)?;
        let now_ns = section.state.now_ns();
        let cold = SeenBegin { at, now_ns, times: ScanTimes::default(), local_s: 0 };
        let SeenBegin { now_ns: last_ns, times, local_s, .. } = last.unwrap_or(cold);
        let period_ns = before.map_or(PERIOD_NS, |before| last_ns.saturating_sub(before.now_ns));
        Some(EngineCall::Begin { now_ns: last_ns.saturating_add(period_ns), times, local_s })
    }

    /// The last scan that began before a moment.
    fn begin_before(&mut self, at: TapeMoment) -> Option<SeenBegin> {
        let (section, entry) = self.replay.last_begin(at)?;
        let section_tape = self.replay.section(section)?;
        let Some(TapeEntry::Call(EngineCall::Begin { now_ns, times, local_s })) =
            section_tape.entries.get(entry)
        else {
            return None;
        };
        let at = TapeMoment { section, entry, step: 0 };
        Some(SeenBegin { at, now_ns: *now_ns, times: *times, local_s: *local_s })
    }

    /// Whether the controller scans at a moment.
    pub fn runs(&mut self, at: TapeMoment) -> Option<bool> {
        let section = self.replay.section(at.section)?;
        let entries = section.entries.get(..at.entries())?;
        Some(runs_behind(section.start.mode, entries))
    }
}
