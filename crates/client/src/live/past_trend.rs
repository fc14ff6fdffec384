//! The values of an operand over hours, from the scan log: the controller's memory, and the files
//! of its recorded folder if this process may read them.
//!
//! Called by `web` for trends. The recorded calls are executed again a minute at a time, and what a
//! minute shows is what the trend of the last minute shows (`trend`): of an output what it is
//! driven to. What is not recorded is a gap.

use std::path::Path;
use std::sync::Arc;

use super::change_history::{memory_since, recorded_folder};
use super::follower::LookFailure;
use super::trend::{Trend, TrendGap, TrendMinute, TrendPoint, whole_trend};
use super::view::{LiveView, TagValue, tag_value};
use crate::operator::client;
use crate::operator::protocol::{ControllerStatus, Request};
use rungd_engine::{Cell, EngineProgram};
use rungd_history::observe::Subject;
use rungd_history::playback::{Playback, subject_and_settings};
use rungd_history::record::{RecordedProgram, Recording};
use rungd_runtime::TapeSection;

/// The most sections that are executed at once; one is about a second.
const SECTIONS_MAX: usize = 60;

/// A stop goes on over less than this: its sections end before the next one begins.
const JOIN_NS: i64 = 3_000_000_000;

/// The values of an operand in a part of the past.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PastPiece {
    /// The values, each from a time on, in order.
    pub values: Vec<TimedValue>,
    /// The times without a value, in order.
    pub gaps: Vec<PastGap>,
}

/// A value from a time on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedValue {
    /// ns since 1970 (UTC).
    pub unix_ns: i64,
    /// The value; `None`: it is not known, because the device of the output is lost.
    pub value: Option<TagValue>,
}

/// A time without a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PastGap {
    /// Its beginning and its end, ns since 1970 (UTC).
    pub from_ns: i64,
    /// The same.
    pub to_ns: i64,
    /// The name of the mode, in which no scan gives a value; `None`: nothing is recorded.
    pub mode: Option<&'static str>,
}

/// A recording of the past, for trends of several operands.
pub struct TrendPast {
    recording: Arc<Recording>,
    /// The programs of the recording; `None`: this version of rungd cannot load it.
    subjects: Vec<(Arc<RecordedProgram>, Option<Arc<Subject>>)>,
}

/// The past of a controller, and a note if its recorded folder cannot be read.
pub struct OpenedPast {
    /// The past.
    pub past: TrendPast,
    /// The note.
    pub note: Option<String>,
}

impl TrendPast {
    /// The past of a controller from a time on. Sends it a few requests; blocks.
    ///
    /// # Errors
    /// [`LookFailure`].
    pub fn open(socket: &Path, from_ns: i64) -> Result<OpenedPast, LookFailure> {
        let status: ControllerStatus = client::ask(socket, &Request::Status {})?;
        let memory = memory_since(socket, from_ns)?;
        let folder = recorded_folder(&status);
        let read = Recording::of_controller(folder.as_ref(), from_ns, memory.clone());
        let (recording, note) = match read {
            Ok(recording) => (recording, None),
            Err(error) => {
                let dir = folder.map(|folder| folder.dir.display().to_string());
                let note = format!("{} cannot be read: {error}", dir.unwrap_or_default());
                (Recording::of_bytes(memory), Some(note))
            }
        };
        Ok(OpenedPast { past: TrendPast::new(recording), note })
    }

    /// The past in a recording.
    pub fn new(recording: Recording) -> TrendPast {
        TrendPast { recording: Arc::new(recording), subjects: Vec::new() }
    }

    /// The time of the last recorded scan, or of the last section of a stop; ns since 1970 (UTC).
    pub fn end_ns(&self) -> Option<i64> {
        let last = self.recording.count().checked_sub(1)?;
        let head = self.recording.head(last);
        Some(head.end_ns.max(head.begin_ns))
    }

    /// The values of an operand between two times, as far as they are recorded.
    pub fn piece(&mut self, operand: &str, from_ns: i64, to_ns: i64) -> PastPiece {
        let recording = Arc::clone(&self.recording);
        let is_in = |at: &usize| {
            recording.head(*at).end_ns >= from_ns && recording.head(*at).begin_ns <= to_ns
        };
        let sections: Vec<usize> = (0..recording.count()).filter(is_in).collect();
        let mut piece = PastPiece::default();
        // Up to here everything is in the piece, as values or as a gap.
        let mut told_ns = from_ns;
        for run in runs(&recording, &sections) {
            let (first, last) = (run[0], run[run.len() - 1]);
            let begin_ns = recording.head(first).begin_ns;
            let is_next = sections.contains(&first.wrapping_sub(1)) && recording.follows(first);
            let found = self.run(operand, run);
            if (!is_next || found.is_none()) && begin_ns > told_ns {
                piece.gaps.push(PastGap { from_ns: told_ns, to_ns: begin_ns, mode: None });
            }
            let end_ns = recording.head(last).end_ns;
            match found {
                Some(found) => piece.add(found, if is_next { begin_ns } else { i64::MIN }),
                None => piece.gaps.push(PastGap { from_ns: begin_ns, to_ns: end_ns, mode: None }),
            }
            told_ns = told_ns.max(end_ns);
        }
        if told_ns < to_ns {
            piece.gaps.push(PastGap { from_ns: told_ns, to_ns, mode: None });
        }
        piece
    }

    /// The values of an operand in sections of one program that follow each other.
    fn run(&mut self, operand: &str, run: &[usize]) -> Option<PastPiece> {
        let recorded = Arc::clone(self.recording.program(run[0]));
        let subject = self.subject(&recorded)?;
        let cell = subject.cell(operand).ok()?;
        let rules = subject.output_rules();
        let mut cells = vec![cell];
        if rules.number(cell).is_some() {
            cells.extend(rules.devices(cell).iter().map(|ok| Cell::Bit(*ok)));
        }
        let slice: EngineProgram = subject.code_for_all(&cells);
        let mut playback = Playback::new(Arc::clone(&self.recording), slice);
        let sections: Result<Vec<Arc<TapeSection>>, _> =
            run.iter().map(|at| playback.section(*at).map(Arc::new)).collect();
        let sections = sections.ok()?;
        let (present, content) = (None, 0);
        let minute = TrendMinute { subject: &subject, sections: &sections, present, content };
        let end_ns = self.recording.head(run[run.len() - 1]).end_ns;
        let known = ValueMeaning { subject: &subject, cell };
        Some(PastPiece::of(&known, whole_trend(minute, cell), end_ns))
    }

    fn subject(&mut self, recorded: &Arc<RecordedProgram>) -> Option<Arc<Subject>> {
        let known = self.subjects.iter().find(|(known, _)| known.files == recorded.files);
        if let Some((_, subject)) = known {
            return subject.clone();
        }
        let subject = subject_and_settings(recorded).ok().map(|(subject, _)| Arc::new(subject));
        self.subjects.push((Arc::clone(recorded), subject.clone()));
        subject
    }
}

/// Runs of sections of one program that follow each other.
fn runs<'s>(recording: &Recording, sections: &'s [usize]) -> Vec<&'s [usize]> {
    let (mut all, mut begin) = (Vec::new(), 0);
    for at in 1..=sections.len() {
        let continues = sections.get(at).is_some_and(|section| {
            let before = sections[at - 1];
            before + 1 == *section
                && recording.follows(*section)
                && recording.program(before) == recording.program(*section)
        });
        if !continues || at - begin == SECTIONS_MAX {
            all.push(&sections[begin..at]);
            begin = at;
        }
    }
    all
}

impl PastPiece {
    /// The values of a trend. `end_ns`: what has not ended goes on up to here.
    fn of(known: &ValueMeaning<'_>, trend: Trend, end_ns: i64) -> PastPiece {
        let ValueMeaning { subject, cell } = *known;
        let value = |point: TrendPoint| TimedValue {
            unix_ns: point.unix_ns,
            value: point.value.map(|content| tag_value(subject, cell, content)),
        };
        let gap = |gap: TrendGap| PastGap {
            from_ns: gap.from_ns,
            to_ns: gap.to_ns.unwrap_or(end_ns).max(gap.from_ns),
            mode: Some(gap.mode.name()),
        };
        let values = trend.points.into_iter().map(value).collect();
        PastPiece { values, gaps: trend.gaps.into_iter().map(gap).collect() }
    }

    /// Adds what follows. A stop that stands at its beginning, and did so at the end before it, is
    /// one gap. `begin_ns`: its beginning, if nothing lies between.
    fn add(&mut self, next: PastPiece, begin_ns: i64) {
        self.values.extend(next.values);
        let mut gaps = next.gaps.into_iter().peekable();
        let end = self.gaps.last_mut();
        if let (Some(last), Some(first)) = (end, gaps.peek())
            && last.mode == first.mode
            && first.from_ns <= begin_ns
            && first.from_ns - last.to_ns < JOIN_NS
        {
            last.to_ns = last.to_ns.max(first.to_ns);
            gaps.next();
        }
        self.gaps.extend(gaps);
    }
}

/// The cell of an operand, which says what its contents mean.
struct ValueMeaning<'a> {
    subject: &'a Subject,
    cell: Cell,
}

impl LiveView {
    /// The values of an operand over the minute, all of them, and the time up to which they are
    /// known, ns since 1970 (UTC).
    ///
    /// # Errors
    /// There is no such operand.
    pub fn newest_piece(&self, operand: &str) -> Result<NewestPiece, String> {
        let cell = self.program.subject.cell(operand)?;
        let trend = self.whole_trend_of(cell);
        let (begin_ns, end_ns) = trend.span_ns.unwrap_or_default();
        let present_ns = self.present.as_ref().map_or(end_ns, |present| present.unix_ns);
        let stands = trend.gaps.last().is_some_and(|gap| gap.to_ns.is_none());
        let end_ns = if stands { end_ns.max(present_ns) } else { end_ns };
        let known = ValueMeaning { subject: &self.program.subject, cell };
        let piece = PastPiece::of(&known, trend, end_ns);
        Ok(NewestPiece { piece, begin_ns, end_ns })
    }
}

/// What a live view knows of an operand.
#[derive(Clone, Debug)]
pub struct NewestPiece {
    /// The values.
    pub piece: PastPiece,
    /// From when to when they are known, ns since 1970 (UTC).
    pub begin_ns: i64,
    /// The same.
    pub end_ns: i64,
}
