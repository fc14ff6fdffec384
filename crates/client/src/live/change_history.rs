//! The changes of chosen cells in the past of a controller, between two positions of its scan log:
//! each once, in order. Gaps are reported.
//!
//! The log consists of the controller's memory, and of the files of its recorded folder if this
//! process may read them. Called by `edge` after a link was down.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::change_follower::start;
use super::change_run::{ChangeRun, SectionName};
use super::follower::{LookFailure, recorded};
use super::log_event::{LogEvent, LogGap, LogPosition, LoggedChange};
use super::logged_program::{ChooseCells, LoggedProgram, LoggedPrograms};
use crate::operator::client::CallFailure;
use crate::operator::protocol::ControllerStatus;
use rungd_history::playback::{Playback, Unplayable};
use rungd_history::record::{RecordedFolder, Recording};
use rungd_runtime::TapeSection;
use rungd_runtime::exchange::Mode;

/// The requested part of the past.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HistorySpan {
    /// The span begins after this position.
    pub from: LogPosition,
    /// The changes of this time before `from` are included too, ns, as far as the log has them.
    pub margin_ns: i64,
    /// The span ends with this position, which is included.
    pub until: LogPosition,
}

/// Reports the changes of a part of the past.
pub struct ChangeHistory {
    span: HistorySpan,
    playback: Playback<LoggedPrograms>,
    /// The sections not yet executed, the next one last.
    left: Vec<usize>,
    run: Option<ChangeRun>,
    /// The last executed section.
    newest: Option<SectionName>,
    /// Everything up to this position has been reported, as changes or as a gap.
    told: LogPosition,
    /// The mode at that position, if it is known.
    mode: Option<Mode>,
    /// Why a section could not be executed: the reason for the gap before the next section.
    trouble: Option<String>,
}

impl ChangeHistory {
    /// The past between two positions: from the controller's memory, and from its folder if the
    /// memory does not reach back far enough. Also returns a note if the folder cannot be read.
    /// Sends the controller a few requests; blocks.
    ///
    /// # Errors
    /// [`LookFailure`].
    pub fn open(
        socket: &Path,
        folder: Option<&RecordedFolder>,
        span: HistorySpan,
        choose: ChooseCells,
    ) -> Result<(ChangeHistory, Option<String>), LookFailure> {
        let memory = memory(socket, &span)?;
        let known = Recording::of_bytes(memory.clone());
        let folder = folder.filter(|_| !reaches(&known, span.from));
        let Some(folder) = folder else {
            return Ok((ChangeHistory::new(known, span, choose), None));
        };
        let from_ns = span.from.unix_ns.saturating_sub(span.margin_ns);
        match Recording::of_controller(Some(folder), from_ns, memory) {
            Ok(recording) => Ok((ChangeHistory::new(recording, span, choose), None)),
            Err(error) => {
                let dir = folder.dir.display();
                let note = format!("the recorded folder {dir} cannot be read: {error}");
                Ok((ChangeHistory::new(known, span, choose), Some(note)))
            }
        }
    }

    /// The past between two positions, from a recording.
    pub fn new(recording: Recording, span: HistorySpan, choose: ChooseCells) -> ChangeHistory {
        let mut left = sections(&recording, &span);
        left.reverse();
        ChangeHistory {
            span,
            playback: Playback::new(recording, LoggedPrograms::new(choose)),
            left,
            run: None,
            newest: None,
            told: span.from,
            mode: None,
            trouble: None,
        }
    }

    /// Everything up to this position has been reported.
    pub fn position(&self) -> LogPosition {
        self.told
    }

    /// The changes of the next section; `None`: no section is left.
    pub fn next_section(&mut self) -> Option<Vec<LogEvent>> {
        let Some(at) = self.left.pop() else { return self.end() };
        let mut events = Vec::new();
        match self.section(at) {
            Ok((program, section)) => self.execute(at, program, &section, &mut events),
            Err(why) => self.trouble = Some(why),
        }
        Some(events)
    }

    /// Reports the last gap, once.
    fn end(&mut self) -> Option<Vec<LogEvent>> {
        let (told, until) = (self.told, self.span.until);
        let is_there = told.process_start_ns == until.process_start_ns && told.scan >= until.scan;
        if is_there {
            return None;
        }
        let events = self.gap(until).into_iter().map(LogEvent::Missing).collect();
        self.told = until;
        Some(events)
    }

    fn section(&mut self, at: usize) -> Result<(Arc<LoggedProgram>, TapeSection), String> {
        let recorded = Arc::clone(self.playback.recording().program(at));
        let program = self.playback.programs.program(&recorded)?;
        let section = self.playback.section(at).map_err(|why: Unplayable| why.to_string())?;
        Ok((program, section))
    }

    fn execute(
        &mut self,
        at: usize,
        program: Arc<LoggedProgram>,
        section: &TapeSection,
        events: &mut Vec<LogEvent>,
    ) {
        let recording = self.playback.recording();
        let (process, head) = (recording.program(at).process_start_ns, recording.head(at));
        let name = SectionName { process_start_ns: process, sequence: head.sequence };
        let before = SectionName { sequence: name.sequence.wrapping_sub(1), ..name };
        let joins = head.follows && self.newest == Some(before);
        let begin = start(name, section);
        if !joins && let Some(gap) = self.gap(begin) {
            events.push(LogEvent::Missing(gap));
        }
        let known = self.run.take();
        let is_new = known.as_ref().is_none_or(|run| !Arc::ptr_eq(&run.program, &program));
        let mut run = match known {
            Some(run) if is_new => run.followed_by(Arc::clone(&program)),
            Some(run) => run,
            None => ChangeRun::new(Arc::clone(&program)),
        };
        if is_new && let Some(values) = run.begin(section) {
            events.push(LogEvent::Begins { program, values, at: begin });
        }
        let span = self.span;
        let mut tell = |change: LoggedChange| {
            if span.has(process, &change) {
                events.push(LogEvent::Changed(change));
            }
        };
        if run.take(name, section, &mut tell) {
            (self.newest, self.mode) = (Some(name), Some(run.mode));
            self.tell_up_to(run.at);
        } else {
            self.trouble = Some("it does not fit its program".to_owned());
        }
        self.run = Some(run);
    }

    /// Notes that everything up to a position has been reported, but not beyond the end.
    fn tell_up_to(&mut self, at: LogPosition) {
        let (told, until) = (self.told, self.span.until);
        let is_before = at.process_start_ns == told.process_start_ns && at.scan <= told.scan;
        let is_older = at.process_start_ns < told.process_start_ns
            && at.process_start_ns != until.process_start_ns;
        if is_before || is_older {
            return;
        }
        let is_beyond = at.process_start_ns == until.process_start_ns && at.scan > until.scan;
        self.told = if is_beyond { until } else { at };
    }

    /// The gap between the reported part and the scan after which the log continues.
    fn gap(&mut self, begin: LogPosition) -> Option<LogGap> {
        let (told, trouble) = (self.told, self.trouble.take());
        let is_same = begin.process_start_ns == told.process_start_ns;
        if is_same && begin.scan <= told.scan || self.is_before(begin) {
            return None;
        }
        let has_ended = self.mode.is_some_and(|mode| mode != Mode::Run);
        if !is_same && begin.scan == 0 && has_ended {
            return None;
        }
        let scans = is_same.then(|| begin.scan - told.scan);
        let why = trouble.unwrap_or_else(|| match is_same {
            true => "the scan log no longer has them".to_owned(),
            false => "the controller was restarted, and the end of the previous log is missing or \
                      may be incomplete"
                .to_owned(),
        });
        Some(LogGap { scans, from_ns: told.unix_ns, to_ns: begin.unix_ns, why })
    }

    /// Whether a position lies in the margin, in a process before the reported one.
    fn is_before(&self, begin: LogPosition) -> bool {
        begin.process_start_ns != self.span.until.process_start_ns
            && begin.process_start_ns < self.told.process_start_ns
    }
}

impl HistorySpan {
    /// Whether a change lies in the span.
    fn has(&self, process: i64, change: &LoggedChange) -> bool {
        let HistorySpan { from, margin_ns, until } = self;
        if process == until.process_start_ns && change.scan > until.scan {
            return false;
        }
        let is_behind = match process == from.process_start_ns {
            true => change.scan > from.scan,
            false => process > from.process_start_ns || process == until.process_start_ns,
        };
        let is_in_margin = change.unix_ns >= from.unix_ns.saturating_sub(*margin_ns);
        is_behind || is_in_margin && *margin_ns > 0
    }
}

/// The folder in which a controller records; `None`: it has none. A relative path is resolved in
/// the controller's working directory.
pub fn recorded_folder(status: &ControllerStatus) -> Option<RecordedFolder> {
    let disk = status.record.disk.as_ref()?;
    let controller = Path::new(&status.controller).file_stem()?.to_string_lossy().into_owned();
    let named = PathBuf::from(&disk.dir);
    let dir = if named.is_relative() {
        let base = std::fs::read_link(format!("/proc/{}/cwd", status.pid)).unwrap_or_default();
        base.join(named)
    } else {
        named
    };
    Some(RecordedFolder { dir, controller })
}

/// The part of a span in the controller's memory, and perhaps a little more. A section lasts about
/// a second, so the number of the first section can be estimated. If the estimate is wrong, the
/// whole memory is fetched, unless it is too large for an answer.
fn memory(socket: &Path, span: &HistorySpan) -> Result<Vec<u8>, LookFailure> {
    let asked = |from| recorded(socket, from).map(|(bytes, _)| bytes);
    let newest = asked(u64::MAX)?;
    let known = Recording::of_bytes(newest.clone());
    let mut had = newest;
    if let Some(from) = guessed_section(&known, span) {
        had = asked(from)?;
        if reaches(&Recording::of_bytes(had.clone()), span.from) {
            return Ok(had);
        }
    }
    match asked(0) {
        Err(LookFailure::Call(CallFailure::Broken(..))) => Ok(had),
        all => all,
    }
}

/// The controller's memory from a time on, and perhaps a little more; a part of it if the whole is
/// too large for an answer.
pub(super) fn memory_since(socket: &Path, from_ns: i64) -> Result<Vec<u8>, LookFailure> {
    let asked = |from| recorded(socket, from).map(|(bytes, _)| bytes);
    let newest = asked(u64::MAX)?;
    let known = Recording::of_bytes(newest.clone());
    let Some(last) = known.count().checked_sub(1) else { return Ok(newest) };
    let from = section_before(&known, last, from_ns);
    match asked(from) {
        Err(LookFailure::Call(CallFailure::Broken(..))) => Ok(newest),
        had => had,
    }
}

/// The estimated number of the section of a time, or of an earlier section.
fn section_before(newest: &Recording, last: usize, begin_ns: i64) -> u64 {
    let head = newest.head(last);
    let age_s = u64::try_from(head.end_ns.saturating_sub(begin_ns) / 1_000_000_000).unwrap_or(0);
    head.sequence.saturating_sub(age_s + age_s / 4 + 4)
}

/// The estimated number of the section in which a span begins, or of an earlier section; `None`:
/// the span begins in an earlier process.
fn guessed_section(newest: &Recording, span: &HistorySpan) -> Option<u64> {
    let last = newest.count().checked_sub(1)?;
    let begin_ns = span.from.unix_ns.saturating_sub(span.margin_ns);
    let is_same = newest.program(last).process_start_ns == span.from.process_start_ns;
    is_same.then(|| section_before(newest, last, begin_ns))
}

/// Whether a recording has the scan after a position.
fn reaches(recording: &Recording, from: LogPosition) -> bool {
    (0..recording.count()).any(|at| {
        recording.program(at).process_start_ns == from.process_start_ns
            && recording.head(at).number <= from.scan.saturating_add(1)
    })
}

/// The sections of a span, in order.
fn sections(recording: &Recording, span: &HistorySpan) -> Vec<usize> {
    let HistorySpan { from, margin_ns, until } = span;
    let process = |at: usize| recording.program(at).process_start_ns;
    let begin_ns = from.unix_ns.saturating_sub(*margin_ns);
    let is_wanted = |at: &usize| {
        let (process, head) = (process(*at), recording.head(*at));
        let end = head.number.saturating_add(head.scans.into()).saturating_sub(1);
        let is_behind = match process == from.process_start_ns {
            // Outside of RUN a section has no scans, but may have forces.
            true => end > from.scan || end == from.scan && head.scans == 0,
            false => process > from.process_start_ns || process == until.process_start_ns,
        };
        let is_in_margin = head.end_ns >= begin_ns && *margin_ns > 0;
        let is_beyond = match process == until.process_start_ns {
            true => head.number > until.scan.saturating_add(1),
            false => process > until.process_start_ns,
        };
        (is_behind || is_in_margin) && !is_beyond
    };
    (0..recording.count()).filter(is_wanted).collect()
}
