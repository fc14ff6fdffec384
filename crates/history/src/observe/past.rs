//! The past: the sections of a tape, each loaded when it is needed; and moments in the past.

use std::fmt;
use std::sync::Arc;

use super::answer::{TapeEnd, When};
use super::subject::Subject;
use rungd_engine::EngineCall;
use rungd_runtime::{Origin, TapeEntry, TapeSection};

/// The sections of a tape, the newest last.
pub trait Past {
    /// The number of sections.
    fn count(&self) -> usize;

    /// A section; `None` if it cannot be read.
    fn section(&mut self, at: usize) -> Option<Arc<TapeSection>>;

    /// Why the past begins with the first section.
    fn begins(&self) -> TapeEnd {
        TapeEnd::Oldest
    }

    /// The program that ran right before the first section, without a gap, with its past; `None` if
    /// there is none, or it is not known. `operands`: the names of the operands that the questions
    /// to it are about.
    fn earlier(&mut self, operands: &[&str]) -> Option<EarlierPast> {
        let _ = operands;
        None
    }
}

/// An earlier program and its past.
pub struct EarlierPast {
    /// The program.
    pub subject: Arc<Subject>,
    /// Its sections; they end where the later program begins.
    pub past: Box<dyn Past>,
}

impl Past for Vec<Arc<TapeSection>> {
    fn count(&self) -> usize {
        self.len()
    }

    fn section(&mut self, at: usize) -> Option<Arc<TapeSection>> {
        self.get(at).cloned()
    }
}

/// The time that a question is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuestionTime {
    /// The end of the tape.
    Now,
    /// The end of a scan, by its number; the first of a process is 1.
    Scan(u64),
}

/// Why a question has no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WhyRefusal {
    /// The tape has no section that fits the program.
    NoPast,
    /// The scan is not on the tape.
    NoSuchScan {
        /// The number of the first scan on the tape.
        first: u64,
        /// The number of the last scan on the tape.
        last: u64,
    },
    /// The cell is not one of the program.
    NoSuchCell,
}

impl fmt::Display for WhyRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            WhyRefusal::NoPast => f.write_str("the recording does not fit its program"),
            WhyRefusal::NoSuchScan { first, last } => {
                write!(f, "that scan is not in the recording: it has scans {first} to {last}")
            }
            WhyRefusal::NoSuchCell => f.write_str("the program has no such operand"),
        }
    }
}

/// A moment: right before a step of a call, or right before the whole call.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct TapeMoment {
    /// The section.
    pub section: usize,
    /// The entry of the section.
    pub entry: usize,
    /// The number of the step in the call; 0: before the call.
    pub step: u32,
}

impl TapeMoment {
    /// The number of entries that have begun.
    pub fn entries(self) -> usize {
        self.entry + usize::from(self.step > 0)
    }
}

/// The scan and time of an entry: those of the scan that began last.
pub(super) fn when(section: &TapeSection, entry: usize) -> When {
    let last = section.begins().take_while(|begin| begin.at <= entry).last();
    last.map_or_else(|| start(section), |begin| at(section, Some(begin.number), begin.now_ns))
}

/// The scan and time at the start of a section.
pub(super) fn start(section: &TapeSection) -> When {
    let scan = section.start.number.checked_sub(1).filter(|scan| *scan > 0);
    at(section, scan, section.state.now_ns())
}

fn at(section: &TapeSection, scan: Option<u64>, now_ns: u64) -> When {
    When { scan, now_ns, unix_ns: section.start.unix_ns(now_ns) }
}

/// The origin of a write, force or release, and the name of its sender.
pub(super) fn origin(section: &TapeSection, entry: usize) -> (Origin, Option<String>) {
    let begins =
        |tape_entry: &&TapeEntry| matches!(tape_entry, TapeEntry::Call(EngineCall::Begin { .. }));
    let before =
        section.entries.iter().take(entry).rev().take_while(|tape_entry| !begins(tape_entry));
    let origin =
        before.filter_map(|tape_entry| tape_entry.origin()).next().unwrap_or(Origin::Inputs);
    let who = section
        .who
        .iter()
        .find(|(noted_origin, _)| *noted_origin == origin)
        .map(|(_, who)| who.clone());
    (origin, who)
}

/// Whether a section continues the section before it, with the same program.
pub(super) fn joins(older: &TapeSection, newer: &TapeSection) -> Result<(), TapeEnd> {
    if newer.start.generation != older.start.generation {
        return Err(TapeEnd::Swapped);
    }
    if !newer.start.follows {
        return Err(if newer.start.lost > 0 { TapeEnd::Lost } else { TapeEnd::Restarted });
    }
    Ok(())
}
