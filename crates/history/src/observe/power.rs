//! The power of one scan: the state of every contact and the values of every compare when its rung
//! was executed, and memory at the end of the scan. Two scans are never mixed.
//!
//! Executes the sections of a tape, as `why` does, but with the whole program, and of it only what
//! can change something. A [`PowerRun`] continues from the last scan that it executed. Called by
//! `live`, for pictures of a running ladder.

use std::sync::Arc;

use super::compares::FormulaNumber;
use super::seen_parts::{ComparedValues, IDLE, SeenParts};
use super::slice_run::{SliceRun, StepWitness};
use super::sparing::WholeProgram;
use super::subject::Subject;
use rungd_engine::{Cell, EngineCall, Image};
use rungd_runtime::exchange::{Mode, StopReason};
use rungd_runtime::{TapeEntry, TapeSection, TapeStep};

/// Every contact of a ladder in one scan, and memory at its end.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanPower {
    /// The number of the scan; 0 before the first one.
    pub scan: u64,
    /// Its time, ns since 1970 (UTC).
    pub unix_ns: i64,
    /// The mode after it.
    pub mode: Mode,
    /// By contact, in the order of the program: OFF, ON, or not executed.
    contacts: Vec<u8>,
    /// The values of the sides of each compare.
    compared: ComparedValues,
    /// By part of a rung: whether it was executed.
    executed: Arc<[bool]>,
    bits: Vec<u8>,
    words: Vec<i32>,
}

/// The contacts of a rung, or of one of its branches.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartContacts {
    /// The name of its block, or the name of its Stage with that of its Program.
    pub element: String,
    /// The number of the rung in it, from 1.
    pub rung: u32,
    /// The number of the branch, from 1; `None`: the rung's own legs.
    pub branch: Option<u32>,
    /// The number of its first contact among those of the program.
    pub first: u32,
}

impl ScanPower {
    /// The power before the first scan.
    pub fn nothing() -> ScanPower {
        let mode = Mode::Stop(StopReason::NotStarted);
        let (contacts, executed) = (Vec::new(), Arc::default());
        let (bits, words) = (Vec::new(), Vec::new());
        let compared = ComparedValues::default();
        ScanPower { scan: 0, unix_ns: 0, mode, contacts, compared, executed, bits, words }
    }

    /// The values of the sides of a compare, by its number among the contacts; `None`: it is no
    /// compare, or was not evaluated in this scan.
    pub fn compared(&self, number: u32) -> Option<[FormulaNumber; 2]> {
        self.contact(number)?;
        let at = self.compared.contacts.binary_search(&number).ok()?;
        self.compared.values.get(at).copied()
    }

    /// Whether a contact was ON, by its number among those of the program; `None`: its rung was
    /// not executed in this scan.
    pub fn contact(&self, number: u32) -> Option<bool> {
        match self.contacts.get(number as usize) {
            None | Some(&IDLE) => None,
            Some(on) => Some(*on != 0),
        }
    }

    /// Whether a rung or branch was executed in this scan, by its number in [`Subject::contacts`].
    pub fn is_executed(&self, part: u32) -> bool {
        self.executed.get(part as usize).copied().unwrap_or(false)
    }

    /// The content of a cell at the end of the scan; for a bit, 0 or 1.
    pub fn value(&self, cell: Cell) -> i32 {
        match cell {
            Cell::Bit(bit) => self.bits.get(bit.0 as usize).map_or(0, |bit| i32::from(*bit)),
            Cell::Word(word) => self.words.get(word.0 as usize).copied().unwrap_or(0),
            Cell::WordBit(bit) => i32::from(bit.is_on(self.value(Cell::Word(bit.word)))),
        }
    }
}

impl Subject {
    /// The contacts of all rungs and branches, in the order of the program.
    pub fn contacts(&self) -> impl Iterator<Item = PartContacts> + use<'_> {
        self.sites.parts.iter().map(|part| PartContacts {
            element: self.symbols.names.element(part.element).to_owned(),
            rung: part.rung + 1,
            branch: part.branch.map(|branch| branch + 1),
            first: part.leaves.start,
        })
    }
}

/// Executes sections of a tape, and collects the power of their scans.
pub struct PowerRun {
    program: WholeProgram,
    run: SliceRun<WholeProgram>,
    seen: SeenParts,
    /// The current section, as the number of its first scan and its program, and the number of its
    /// entries that have been executed.
    done: Option<((u64, u32), usize)>,
    last: Option<ScanPower>,
}

impl PowerRun {
    /// A run that has executed nothing yet.
    pub fn new(subject: Arc<Subject>) -> PowerRun {
        PowerRun::of(WholeProgram::new(subject))
    }

    /// A run of a program, which others may execute too.
    pub fn of(program: WholeProgram) -> PowerRun {
        let run = SliceRun::new(&program.subject, program.clone());
        let seen = SeenParts::new(&program);
        PowerRun { program, run, seen, done: None, last: None }
    }

    /// The power of the last scan in a section; `None`: the section has no scan, or belongs to a
    /// different program. If the section has grown since the last call, only its new entries are
    /// executed.
    pub fn last_of(&mut self, section: &TapeSection) -> Option<ScanPower> {
        self.until(section, u64::MAX)
    }

    /// The power of a scan in a section, by its number.
    pub fn of_scan(&mut self, section: &TapeSection, scan: u64) -> Option<ScanPower> {
        self.done = None;
        let found = self.until(section, scan).filter(|power| power.scan == scan);
        // The entries after the scan are not executed, so the next call starts at the beginning.
        self.done = None;
        found
    }

    fn until(&mut self, section: &TapeSection, scan: u64) -> Option<ScanPower> {
        let name = (section.start.number, section.start.generation);
        let begun = self
            .done
            .filter(|(section_name, done)| *section_name == name && *done <= section.entries.len());
        let from = match begun {
            Some((_, done)) => done,
            None => {
                self.last = None;
                if !section.state.fits(&self.program.subject.seen) {
                    return None;
                }
                self.run.resume(&section.state);
                self.tell();
                0
            }
        };
        let is_wanted = |step: &TapeStep| {
            step.entry == TapeEntry::Call(EngineCall::Execute) && step.number <= scan
        };
        let seen = section.steps().filter(is_wanted).last().filter(|step| step.at >= from);
        let mode = mode_at(section, section.entries.len());
        for (at, entry) in section.entries.iter().enumerate().skip(from) {
            let Some(call) = entry.call() else { continue };
            match seen.filter(|step| step.at == at) {
                Some(step) => {
                    self.last = Some(ScanPower {
                        scan: step.number,
                        unix_ns: section.start.unix_ns(step.now_ns),
                        mode: mode_at(section, at),
                        ..self.see(call)
                    });
                    if scan != u64::MAX {
                        return self.last.clone();
                    }
                }
                None => {
                    self.run.call(0, call, None);
                    self.tell();
                }
            }
        }
        self.done = Some((name, section.entries.len()));
        if mode != Mode::Run {
            self.outside_of_run(section, mode);
        }
        self.last.clone()
    }

    /// Tells what the last call has changed.
    fn tell(&mut self) {
        self.run.changed().iter().for_each(|number| self.seen.changed(*number));
    }

    /// Executes a scan, and returns its power.
    fn see(&mut self, call: EngineCall) -> ScanPower {
        self.seen.begin();
        self.run.call_seen(call, &mut self.seen);
        let (executed, contacts, compared) = self.seen.scan();
        let (bits, words) = public(&self.program.subject, self.run.seen_engine().image());
        ScanPower { contacts, compared, executed, bits, words, ..ScanPower::nothing() }
    }

    /// Outside of RUN no rung is executed: takes memory as it is.
    fn outside_of_run(&mut self, section: &TapeSection, mode: Mode) {
        let (bits, words) = public(&self.program.subject, self.run.seen_engine().image());
        let before = self.last.as_ref();
        let scan = before.map_or(section.start.number.saturating_sub(1), |last| last.scan);
        let begin = section.start.unix_ns(section.state.now_ns());
        let unix_ns = before.map_or(begin, |last| last.unix_ns);
        self.last = Some(ScanPower { scan, unix_ns, mode, bits, words, ..ScanPower::nothing() });
    }
}

/// The mode right before an entry.
fn mode_at(section: &TapeSection, entry: usize) -> Mode {
    let mode = section.entries.iter().take(entry).rev().find_map(|tape_entry| tape_entry.mode());
    mode.unwrap_or(section.start.mode)
}

/// The public cells.
fn public(subject: &Subject, image: &Image) -> (Vec<u8>, Vec<i32>) {
    let layout = &subject.symbols.layout;
    let (bits, words) = (layout.bit_count() as usize, layout.word_count() as usize);
    let program_bits = |all: &[u8]| all.get(..bits).unwrap_or(all).to_vec();
    (program_bits(image.bits()), image.words().get(..words).unwrap_or(image.words()).to_vec())
}
