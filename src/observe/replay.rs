//! Executes parts of the past again: goes to a moment, finds the last change of a cell.
//!
//! Keeps the logs of the sections that were looked at, up to a number of changes, and the last
//! states that it went to.

use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;
use std::sync::Arc;

use super::answer::{Since, TapeEnd, When};
use super::leaves::content;
use super::past::{self, At, Moment, Past, Refusal, joins};
use super::section_log::{CellChange, SectionLog};
use super::steady::Steady;
use super::subject::Subject;
use super::walk::{Witness, walk};
use super::watch::Watch;
use crate::engine::{Cell, Deed, Engine, EngineCall, EngineState, Image};
use crate::runtime::{TapeEntry, TapeSection};

/// The most changes that are kept in logs.
const CHANGES_MAX: usize = 2_000_000;

/// The most scans of a section that are seen one by one.
const SUSPECTS_MAX: usize = 8;

/// The states that are kept beside those in logs.
const STATES_MAX: usize = 4;

/// Sections times operations that a search for a lesser fact may execute.
const SEARCHED_MAX: usize = 100_000;

/// The past of a subject.
pub(super) struct Replay<'a> {
    pub subject: &'a Subject,
    past: &'a mut dyn Past,
    engine: Engine,
    /// The same program, as the scan thread executes it.
    fast: Engine,
    sections: BTreeMap<usize, Arc<TapeSection>>,
    logs: BTreeMap<usize, Rc<SectionLog>>,
    /// The newest last.
    states: Vec<((usize, usize), EngineState)>,
    /// The last changes of cells before the ends of sections.
    known: HashMap<(Cell, usize), Changed>,
}

/// A change of a cell, or the end of the tape.
#[derive(Clone, Copy)]
pub(super) enum Changed {
    /// The change, and its moment.
    At(CellChange, Moment),
    /// None from this section on.
    Never(TapeEnd, usize),
}

impl<'a> Replay<'a> {
    pub fn new(subject: &'a Subject, past: &'a mut dyn Past) -> Replay<'a> {
        let engine = Engine::new(subject.seen.clone());
        let fast = Engine::new(subject.fast.clone());
        let (sections, logs) = (BTreeMap::new(), BTreeMap::new());
        Replay {
            subject,
            past,
            engine,
            fast,
            sections,
            logs,
            states: Vec::new(),
            known: HashMap::new(),
        }
    }

    /// A section that fits the program.
    pub fn section(&mut self, at: usize) -> Option<Arc<TapeSection>> {
        if let Some(section) = self.sections.get(&at) {
            return Some(Arc::clone(section));
        }
        let section = self.past.section(at)?;
        if !section.state.fits(&self.subject.seen) || !calls_fit(self.subject, &section) {
            return None;
        }
        self.sections.insert(at, Arc::clone(&section));
        Some(section)
    }

    /// The section before this one, if it goes on without a gap.
    pub fn older(&mut self, section: usize) -> Result<usize, TapeEnd> {
        let newer = self.section(section).ok_or(TapeEnd::Unreadable)?;
        let at = section.checked_sub(1).ok_or(TapeEnd::Oldest)?;
        let older = self.section(at).ok_or(TapeEnd::Unreadable)?;
        joins(&older, &newer).map(|()| at)
    }

    /// The moment of a question.
    pub fn moment(&mut self, at: At) -> Result<Moment, Refusal> {
        let newest = self.past.count().checked_sub(1).ok_or(Refusal::NoPast)?;
        let end = self.section(newest).ok_or(Refusal::NoPast)?;
        let At::Scan(scan) = at else {
            return Ok(Moment { section: newest, entry: end.entries.len(), step: 0 });
        };
        let mut at = newest;
        while let Some(section) = self.section(at) {
            let begins = past::begins(&section);
            if let Some(found) = begins.iter().find(|begin| begin.number == scan) {
                return Ok(Moment {
                    section: at,
                    entry: end_of_scan(&section, found.entry),
                    step: 0,
                });
            }
            if section.start.number < scan || at == 0 {
                break;
            }
            at -= 1;
        }
        let first = self.section(0).map_or(0, |section| section.start.number);
        let last = past::begins(&end).last().map(|begin| begin.number);
        let last = last.unwrap_or(end.start.number.saturating_sub(1));
        Err(Refusal::NoSuchScan { first, last })
    }

    /// The changes of a section.
    pub fn log(&mut self, at: usize) -> Option<Rc<SectionLog>> {
        if let Some(log) = self.logs.get(&at) {
            return Some(Rc::clone(log));
        }
        let section = self.section(at)?;
        let log = Rc::new(SectionLog::new(self.subject, &mut self.engine, &section));
        while self.logs.values().map(|log| log.changes.len()).sum::<usize>() > CHANGES_MAX {
            self.logs.pop_first();
        }
        self.logs.insert(at, Rc::clone(&log));
        Some(log)
    }

    /// The engine, right before an entry. `None` if the section is gone.
    pub fn seek(&mut self, section: usize, entry: usize) -> Option<&mut Engine> {
        let of = self.section(section)?;
        let mut from = 0;
        let mut start = &of.state;
        let log = self.logs.get(&section).cloned();
        let kept = log.iter().flat_map(|log| log.states.iter());
        let own = self.states.iter().filter(|((at, _), _)| *at == section);
        for (at, state) in kept.map(|(at, state)| (*at, state)).chain(own.map(|(at, s)| (at.1, s)))
        {
            if at <= entry && at >= from {
                (from, start) = (at, state);
            }
        }
        self.fast.resume(start);
        let entries = of.entries.get(from..entry.min(of.entries.len())).unwrap_or_default();
        for entry in entries {
            if let TapeEntry::Call(call) = entry {
                self.fast.apply(*call);
            }
        }
        let state = EngineState::of(&self.fast);
        self.engine.resume(&state);
        if entries.iter().any(|entry| matches!(entry, TapeEntry::Call(EngineCall::Execute))) {
            self.states.truncate(self.states.len().min(STATES_MAX));
            if self.states.len() == STATES_MAX {
                self.states.remove(0);
            }
            self.states.push(((section, entry), state));
        }
        Some(&mut self.engine)
    }

    /// Executes an entry again, seen.
    pub fn see(&mut self, section: usize, entry: usize, witness: &mut impl Witness) -> Option<()> {
        let of = self.section(section)?;
        let TapeEntry::Call(call) = of.entries.get(entry)? else { return None };
        self.seek(section, entry)?;
        walk(self.subject, &mut self.engine, *call, witness);
        Some(())
    }

    /// The last change of a cell before a moment. Of a steady cell the call of the moment itself is
    /// not looked at: who asks has seen it.
    /// `most`: the most sections that are executed step by step.
    pub fn last_change(&mut self, cell: Cell, before: Moment, most: usize) -> Changed {
        let mut section = before.section;
        let mut end = (before.entry, before.step);
        let quiet = !self.subject.is_written(cell);
        let steady = Steady::of(self.subject, cell);
        let is_seen = !quiet && steady.is_none();
        let mut passed = Vec::new();
        let changed = loop {
            if let Some(known) = self.known.get(&(cell, section)).filter(|_| !passed.is_empty()) {
                break *known;
            }
            if is_seen && passed.len() >= most {
                break Changed::Never(TapeEnd::Searched, section);
            }
            let found = if quiet {
                self.written_from_outside(cell, section, end.0)
            } else if let Some(steady) = &steady {
                self.last_of_steady(cell, section, (end, steady))
            } else {
                self.log(section).and_then(|log| log.last(cell, end, |_| true))
            };
            if let Some(change) = found {
                let (entry, step) = (change.entry as usize, change.step);
                break Changed::At(change, Moment { section, entry, step });
            }
            match self.older(section) {
                Ok(older) => section = older,
                Err(why) => break Changed::Never(why, section),
            }
            passed.push(section);
            end = (usize::MAX, 0);
        };
        self.known.extend(passed.into_iter().map(|section| ((cell, section), changed)));
        changed
    }

    /// The last change of a steady cell in a section.
    fn last_of_steady(
        &mut self,
        cell: Cell,
        section: usize,
        (end, steady): ((usize, u32), &Steady),
    ) -> Option<CellChange> {
        if let Some(log) = self.logs.get(&section) {
            return log.last(cell, end, |_| true);
        }
        let of = self.section(section)?;
        self.fast.resume(&of.state);
        let mut suspects = Vec::new();
        for (at, entry) in of.entries.iter().enumerate().take(end.0) {
            let TapeEntry::Call(call) = entry else { continue };
            let before = content(self.fast.image(), cell);
            let powers = steady.powers(self.fast.image());
            self.fast.apply(*call);
            let image = self.fast.image();
            let after = content(image, cell);
            let is_scan = *call == EngineCall::Execute;
            if before != after || is_scan && steady.may_turn(self.subject, cell, &powers, image) {
                suspects.push((at, before, after));
            }
        }
        if suspects.len() > SUSPECTS_MAX {
            return self.log(section).and_then(|log| log.last(cell, end, |_| true));
        }
        for (at, before, after) in suspects.into_iter().rev() {
            let call = of.entries.get(at);
            let change = (at, before, after);
            match call {
                Some(TapeEntry::Call(EngineCall::Execute | EngineCall::Terminate)) => {
                    let mut watch =
                        Watch::new(self.subject, cell, self.subject.writers(cell), u32::MAX);
                    self.see(section, at, &mut watch)?;
                    let changed = watch.decided.iter().rfind(|of| of.before != of.after);
                    if let Some(of) = changed {
                        let found = (at, of.before, of.after);
                        return Some(cell_change(cell, found, (of.step, Some(of.by))));
                    }
                }
                Some(_) | None => return Some(cell_change(cell, change, (0, None))),
            }
        }
        None
    }

    /// The last change of a cell that no step writes: nothing is executed.
    fn written_from_outside(
        &mut self,
        cell: Cell,
        section: usize,
        end: usize,
    ) -> Option<CellChange> {
        let of = self.section(section)?;
        let mut value = of.state.value(cell);
        let mut is_forced = of.state.is_forced(cell);
        let mut last = None;
        for (at, entry) in of.entries.iter().enumerate().take(end) {
            let TapeEntry::Call(call) = entry else { continue };
            let new = match call {
                EngineCall::Write(to, new) if *to == cell && !is_forced => *new,
                EngineCall::Force(to, new) if *to == cell => {
                    is_forced = true;
                    *new
                }
                EngineCall::Release(to) if *to == cell => {
                    is_forced = false;
                    continue;
                }
                EngineCall::Write(..)
                | EngineCall::Force(..)
                | EngineCall::Release(_)
                | EngineCall::Start { .. }
                | EngineCall::RequestStop
                | EngineCall::Begin { .. }
                | EngineCall::Execute
                | EngineCall::Terminate => continue,
            };
            if new != value {
                let (entry, before) = (at as u32, std::mem::replace(&mut value, new));
                last = Some(CellChange { entry, step: 0, cell, by: None, before, after: new });
            }
        }
        last
    }

    /// Whether a cell is forced at a moment, and since when.
    pub fn forced(&mut self, cell: Cell, at: Moment) -> Option<Result<Moment, TapeEnd>> {
        let mut section = at.section;
        let mut end = at.entries();
        loop {
            let of = self.section(section)?;
            for (entry, call) in of.entries.iter().enumerate().take(end).rev() {
                let TapeEntry::Call(call) = call else { continue };
                if *call == EngineCall::Release(cell) {
                    return None;
                }
                if matches!(call, EngineCall::Force(forced, _) if *forced == cell) {
                    return Some(Ok(Moment { section, entry, step: 0 }));
                }
            }
            if !of.state.is_forced(cell) {
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
    pub fn last_begin(&mut self, at: Moment) -> Option<(usize, usize)> {
        let (mut section, mut end) = (at.section, at.entries());
        loop {
            let of = self.section(section)?;
            let begins =
                |entry: &TapeEntry| matches!(entry, TapeEntry::Call(EngineCall::Begin { .. }));
            let found = of.entries[..end.min(of.entries.len())].iter().rposition(begins);
            if let Some(entry) = found {
                return Some((section, entry));
            }
            section = self.older(section).ok()?;
            end = usize::MAX;
        }
    }

    /// The scan and time of a moment.
    pub fn when(&mut self, at: Moment) -> When {
        let begins = |section: &TapeSection| past::begins(section);
        match self.section(at.section) {
            Some(section) => {
                let last = at.entries().saturating_sub(usize::from(at.step == 0 && at.entry > 0));
                let last = if at.step > 0 { at.entry } else { last };
                past::when(&section, &begins(&section), last)
            }
            None => When { scan: None, now_ns: 0, unix_ns: 0 },
        }
    }

    /// The scan and time of an entry.
    pub fn when_of(&mut self, section: usize, entry: usize) -> When {
        self.when(Moment { section, entry, step: 1 })
    }

    /// The scan and time at the start of a section.
    pub fn start_of(&mut self, section: usize) -> When {
        match self.section(section) {
            Some(of) => past::when(&of, &[], 0),
            None => When { scan: None, now_ns: 0, unix_ns: 0 },
        }
    }

    /// The most sections that a search for a lesser fact executes step by step.
    pub fn sections_max(&self) -> usize {
        (SEARCHED_MAX / self.subject.batches.len().max(1)).clamp(3, 120)
    }

    /// When a cell changed last, in a certain way. Of a large program only the last few sections
    /// are searched.
    pub fn since(&mut self, cell: Cell, at: Moment, is: &dyn Fn(&CellChange) -> bool) -> Since {
        let most = self.sections_max();
        let mut section = at.section;
        let mut end = (at.entry, at.step);
        for _ in 0..most {
            if let Some(change) = self.log(section).and_then(|log| log.last(cell, end, is)) {
                return Since::At(self.when_of(section, change.entry as usize));
            }
            let Ok(older) = self.older(section) else { break };
            section = older;
            end = (usize::MAX, 0);
        }
        Since::Before(self.start_of(section))
    }

    /// The value of a cell at a moment.
    pub fn value(&mut self, cell: Cell, at: Moment) -> i32 {
        if at.step > 0 {
            let mut peek = Peek { cell, step: at.step, value: None };
            self.see(at.section, at.entry, &mut peek);
            if let Some(value) = peek.value {
                return value;
            }
        }
        let entry = at.entries();
        self.seek(at.section, entry).map_or(0, |engine| content(engine.image(), cell))
    }
}

/// Sees the value of a cell right before a step.
struct Peek {
    cell: Cell,
    step: u32,
    value: Option<i32>,
}

impl Witness for Peek {
    const PARTS: bool = false;

    fn before(&mut self, _: Deed, number: u32, image: &Image) {
        if number >= self.step && self.value.is_none() {
            self.value = Some(content(image, self.cell));
        }
    }

    fn after(&mut self, deed: Deed, number: u32, image: &Image) {
        self.before(deed, number, image);
    }
}

fn cell_change(
    cell: Cell,
    (entry, before, after): (usize, i32, i32),
    (step, by): (u32, Option<Deed>),
) -> CellChange {
    CellChange { entry: entry as u32, step, cell, by, before, after }
}

/// The entry behind the execution of a scan that begins at an entry.
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

/// Whether all calls name cells of the program.
fn calls_fit(subject: &Subject, section: &TapeSection) -> bool {
    let (bits, words) = (subject.seen.bit_count, subject.seen.word_count);
    section.entries.iter().all(|entry| match entry {
        TapeEntry::Call(
            EngineCall::Write(cell, _) | EngineCall::Force(cell, _) | EngineCall::Release(cell),
        ) => match cell {
            Cell::Bit(bit) => bit.0 < bits,
            Cell::Word(word) => word.0 < words,
        },
        TapeEntry::Call(
            EngineCall::Start { .. }
            | EngineCall::RequestStop
            | EngineCall::Begin { .. }
            | EngineCall::Execute
            | EngineCall::Terminate,
        )
        | TapeEntry::Origin(_)
        | TapeEntry::Number(_)
        | TapeEntry::Mode(_)
        | TapeEntry::Swap { .. }
        | TapeEntry::State { .. }
        | TapeEntry::Lost { .. } => true,
    })
}
