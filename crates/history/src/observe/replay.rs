//! Executes parts of the past again, to reach a moment or to find the last change of a cell.
//!
//! Executes the slice of the program for the cell of the question. Keeps a log of all changes for
//! each section that it has executed, up to a maximum number of changes.

use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;
use std::sync::Arc;

use super::answer::{Since, TapeEnd, When};
use super::leaves::is_status;
use super::noted_cells::CellChange;
use super::past::{self, Past, QuestionTime, TapeMoment, WhyRefusal, joins};
use super::section_log::SectionLog;
use super::slice_run::SliceRun;
use super::subject::Subject;
use super::walk::{WalkedProgram, Witness, walk};
use rungd_engine::{Cell, Engine, EngineCall, EngineState, Image, ScanStep, Slice};
use rungd_runtime::{TapeEntry, TapeSection};

/// The maximum number of changes in the logs.
const CHANGES_MAX: usize = 2_000_000;

/// The maximum number of sections that are executed at once.
const AT_ONCE_MAX: usize = 16;

/// The maximum number of sections that are kept. A search goes back in time, so the oldest sections
/// are dropped first.
const SECTIONS_MAX: usize = 256;

/// The maximum number of states that are kept.
const STATES_MAX: usize = 8;

/// The maximum number of sections in the search for a lesser fact: two minutes.
pub(super) const SEARCHED_MAX: usize = 120;

/// The past of a subject.
pub(super) struct Replay<'a> {
    pub subject: &'a Subject,
    past: &'a mut dyn Past,
    slice: &'a Slice,
    run: SliceRun<&'a Slice>,
    sections: BTreeMap<usize, Arc<TapeSection>>,
    logs: BTreeMap<usize, Rc<SectionLog>>,
    /// The states right before entries, the last used first.
    states: Vec<((usize, usize), EngineState)>,
    /// The last changes of cells before the ends of sections.
    known: HashMap<(Cell, usize), Changed>,
}

/// A change of a cell, or the end of the tape.
#[derive(Clone, Copy)]
pub(super) enum Changed {
    /// The change, and its moment.
    At(CellChange, TapeMoment),
    /// No change from this section on.
    Never(TapeEnd, usize),
}

impl<'a> Replay<'a> {
    /// `slice`: the slice for the cell of the question. It also contains every cell that can affect
    /// that cell.
    pub fn new(subject: &'a Subject, slice: &'a Slice, past: &'a mut dyn Past) -> Replay<'a> {
        let run = SliceRun::new(subject, slice);
        let (sections, logs) = (BTreeMap::new(), BTreeMap::new());
        let (states, known) = (Vec::new(), HashMap::new());
        Replay { subject, past, slice, run, sections, logs, states, known }
    }

    /// The slice.
    pub fn slice(&self) -> &'a Slice {
        self.slice
    }

    /// A section that fits the program.
    pub fn section(&mut self, at: usize) -> Option<Arc<TapeSection>> {
        if let Some(section) = self.sections.get(&at) {
            return Some(Arc::clone(section));
        }
        let section = self.past.section(at)?;
        let program = &self.subject.seen;
        let mut calls = section.entries.iter().filter_map(|entry| entry.call());
        if !section.state.fits(program) || !calls.all(|call| program.has(call)) {
            return None;
        }
        while self.sections.len() >= SECTIONS_MAX {
            self.sections.pop_first();
        }
        self.sections.insert(at, Arc::clone(&section));
        Some(section)
    }

    /// The section before this one, if there is no gap between them.
    pub fn older(&mut self, section: usize) -> Result<usize, TapeEnd> {
        let newer = self.section(section).ok_or(TapeEnd::Unreadable)?;
        let at = section.checked_sub(1).ok_or_else(|| self.past.begins())?;
        let older = self.section(at).ok_or(TapeEnd::Unreadable)?;
        joins(&older, &newer).map(|()| at)
    }

    /// The moment of a question.
    pub fn moment(&mut self, at: QuestionTime) -> Result<TapeMoment, WhyRefusal> {
        let newest = self.past.count().checked_sub(1).ok_or(WhyRefusal::NoPast)?;
        let end = self.section(newest).ok_or(WhyRefusal::NoPast)?;
        let QuestionTime::Scan(scan) = at else {
            return Ok(TapeMoment { section: newest, entry: end.entries.len(), step: 0 });
        };
        let mut at = newest;
        while let Some(section) = self.section(at) {
            if let Some(found) = section.begins().find(|begin| begin.number == scan) {
                let entry = end_of_scan(&section, found.at);
                return Ok(TapeMoment { section: at, entry, step: 0 });
            }
            if section.start.number < scan || at == 0 {
                break;
            }
            at -= 1;
        }
        let first = self.section(0).map_or(0, |section| section.start.number);
        let last = end.begins().last().map(|begin| begin.number);
        let last = last.unwrap_or(end.start.number.saturating_sub(1));
        Err(WhyRefusal::NoSuchScan { first, last })
    }

    /// The changes of a section.
    pub fn log(&mut self, at: usize) -> Option<Rc<SectionLog>> {
        if let Some(log) = self.logs.get(&at) {
            return Some(Rc::clone(log));
        }
        self.section(at)?;
        // A search goes back in time. All operations execute once after each state that is resumed,
        // so a longer search executes more sections at once.
        let most = self.logs.len().clamp(1, AT_ONCE_MAX);
        let mut first = at;
        while at - first + 1 < most {
            match self.older(first) {
                Ok(older) if !self.logs.contains_key(&older) => first = older,
                Ok(_) | Err(_) => break,
            }
        }
        for place in first..=at {
            let section = self.section(place)?;
            let log = Rc::new(SectionLog::new(&mut self.run, &section, place > first));
            self.logs.insert(place, log);
        }
        let log = self.logs.get(&at).cloned();
        while self.logs.values().map(|log| log.changes.len()).sum::<usize>() > CHANGES_MAX {
            self.logs.pop_first();
        }
        log
    }

    /// The engine, right before an entry. `None` if the section is gone.
    pub fn seek(&mut self, section: usize, entry: usize) -> Option<&mut Engine> {
        let section_tape = self.section(section)?;
        if let Some((_, state)) = self.states.iter().find(|(at, _)| *at == (section, entry)) {
            self.run.engine().resume(state);
            return Some(self.run.engine());
        }
        self.run.resume(&section_tape.state);
        for (at, entry) in (0..).zip(section_tape.entries.iter().take(entry)) {
            if let Some(call) = entry.call() {
                self.run.call(at, call, None);
            }
        }
        let state = EngineState::of(self.run.engine());
        self.states.truncate(STATES_MAX - 1);
        self.states.insert(0, ((section, entry), state));
        Some(self.run.engine())
    }

    /// Executes an entry again, observed by a witness.
    pub fn see(&mut self, section: usize, entry: usize, witness: &mut impl Witness) -> Option<()> {
        let section_tape = self.section(section)?;
        let call = section_tape.entries.get(entry)?.call()?;
        let (subject, slice) = (self.subject, self.slice);
        walk(WalkedProgram { subject, slice }, self.seek(section, entry)?, call, witness);
        Some(())
    }

    /// The last change of a cell before a moment. `most`: the maximum number of sections that are
    /// executed for a cell that the program writes.
    pub fn last_change(&mut self, cell: Cell, before: TapeMoment, most: usize) -> Changed {
        let mut section = before.section;
        let mut end = before;
        let most = if self.subject.is_written(cell) { most } else { usize::MAX };
        let mut passed = Vec::new();
        let changed = loop {
            if let Some(known) = self.known.get(&(cell, section)).filter(|_| !passed.is_empty()) {
                break *known;
            }
            if passed.len() >= most {
                // A longer search may find a change, so this result is not kept.
                return Changed::Never(TapeEnd::Searched, section + 1);
            }
            if let Some(change) = self.log(section).and_then(|log| log.last(cell, end, |_| true)) {
                let (entry, step) = (change.entry as usize, change.step);
                break Changed::At(change, TapeMoment { section, entry, step });
            }
            match self.older(section) {
                Ok(older) => section = older,
                Err(why) => break Changed::Never(why, section),
            }
            passed.push(section);
            end = TapeMoment { section, entry: usize::MAX, step: 0 };
        };
        self.known.extend(passed.into_iter().map(|section| ((cell, section), changed)));
        changed
    }

    /// The moment since which a cell is forced, a bit of a word with its word; `None` if it is not
    /// forced.
    pub fn forced(&mut self, cell: Cell, at: TapeMoment) -> Option<Result<TapeMoment, TapeEnd>> {
        let cell = cell.whole();
        let mut section = at.section;
        let mut end = at.entries();
        loop {
            let section_tape = self.section(section)?;
            for (entry, call) in section_tape.entries.iter().enumerate().take(end).rev() {
                let call = call.call();
                if call == Some(EngineCall::Release(cell)) {
                    return None;
                }
                if matches!(call, Some(EngineCall::Force(forced, _)) if forced == cell) {
                    return Some(Ok(TapeMoment { section, entry, step: 0 }));
                }
            }
            if !section_tape.state.is_forced(cell) {
                return None;
            }
            match self.older(section) {
                Ok(older) => section = older,
                Err(why) => return Some(Err(why)),
            }
            end = usize::MAX;
        }
    }

    /// The last scan that began before a moment: its section and entry.
    pub fn last_begin(&mut self, at: TapeMoment) -> Option<(usize, usize)> {
        let (mut section, mut end) = (at.section, at.entries());
        loop {
            let section_tape = self.section(section)?;
            let begins =
                |entry: &TapeEntry| matches!(entry, TapeEntry::Call(EngineCall::Begin { .. }));
            let found = section_tape.entries[..end.min(section_tape.entries.len())]
                .iter()
                .rposition(begins);
            if let Some(entry) = found {
                return Some((section, entry));
            }
            section = self.older(section).ok()?;
            end = usize::MAX;
        }
    }

    /// The scan and time of a moment.
    pub fn when(&mut self, at: TapeMoment) -> When {
        match self.section(at.section) {
            Some(section) => {
                let last = at.entries().saturating_sub(usize::from(at.step == 0 && at.entry > 0));
                let last = if at.step > 0 { at.entry } else { last };
                past::when(&section, last)
            }
            None => When { scan: None, now_ns: 0, unix_ns: 0 },
        }
    }

    /// The scan and time of an entry.
    pub fn when_of(&mut self, section: usize, entry: usize) -> When {
        self.when(TapeMoment { section, entry, step: 1 })
    }

    /// The scan and time at the start of a section.
    pub fn start_of(&mut self, section: usize) -> When {
        match self.section(section) {
            Some(section_tape) => past::start(&section_tape),
            None => When { scan: None, now_ns: 0, unix_ns: 0 },
        }
    }

    /// When a cell had its last change for which `is` returns true. Only the last two minutes are
    /// searched.
    pub fn since(&mut self, cell: Cell, at: TapeMoment, is: &dyn Fn(&CellChange) -> bool) -> Since {
        let mut section = at.section;
        let mut end = at;
        for _ in 0..SEARCHED_MAX {
            if let Some(change) = self.log(section).and_then(|log| log.last(cell, end, is)) {
                return Since::At(self.when_of(section, change.entry as usize));
            }
            let Ok(older) = self.older(section) else { break };
            section = older;
            end = TapeMoment { section, entry: usize::MAX, step: 0 };
        }
        Since::Before(self.start_of(section))
    }

    /// The value of a cell at a moment.
    pub fn value(&mut self, cell: Cell, at: TapeMoment) -> i32 {
        // No log contains the writes at the start of a scan.
        let layout = &self.subject.symbols.layout;
        if !is_status(layout.address(cell))
            && let Some(log) = self.log(at.section)
            && let Some(section) = self.section(at.section)
        {
            let last = log.last(cell, at, |_| true);
            return last.map_or_else(|| section.state.value(cell), |change| change.after);
        }
        if at.step > 0 {
            let mut peek = Peek { cell, step: at.step, value: None };
            self.see(at.section, at.entry, &mut peek);
            if let Some(value) = peek.value {
                return value;
            }
        }
        let entry = at.entries();
        self.seek(at.section, entry).map_or(0, |engine| engine.image().value(cell))
    }
}

/// Takes the value of a cell right before a step.
struct Peek {
    cell: Cell,
    step: u32,
    value: Option<i32>,
}

impl Witness for Peek {
    const PARTS: bool = false;

    fn before(&mut self, _: ScanStep, number: u32, image: &Image) {
        if number >= self.step && self.value.is_none() {
            self.value = Some(image.value(self.cell));
        }
    }

    fn after(&mut self, deed: ScanStep, number: u32, image: &Image) {
        self.before(deed, number, image);
    }
}

/// The entry after the execution of a scan. `begin`: the entry at which the scan begins.
fn end_of_scan(section: &TapeSection, begin: usize) -> usize {
    let rest = section.entries.iter().enumerate().skip(begin + 1);
    for (at, entry) in rest {
        if *entry == TapeEntry::Call(EngineCall::Execute) {
            return at + 1;
        }
        if matches!(entry, TapeEntry::Call(EngineCall::Begin { .. })) {
            return at;
        }
    }
    section.entries.len()
}
