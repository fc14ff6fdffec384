//! Follows the changes of chosen cells of a running controller: each once, in order, scan by scan.
//!
//! Each look requests the newest section of the scan log from the operator's socket, and executes
//! its new entries. If the log continues at a later position (after a restart, or after a pause of
//! the follower that is longer than the controller's memory), the follower reports a jump;
//! `change_history` has the changes between the two positions. Called by `edge`, ten times a
//! second.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use super::change_run::{ChangeRun, SectionName, begin_unix_ns};
use super::follower::LookFailure;
use super::log_event::{LogEvent, LogPosition};
use super::logged_program::{ChooseCells, LoggedProgram, ProgramShelf};
use crate::operator::client;
use crate::operator::protocol::{RecordingBytes, Request};
use rungd_history::record::{LastProgram, RecordedProgram, Recording, Replay, ReplayEngine};
use rungd_runtime::TapeSection;

/// The longest wait for an answer.
const ANSWER_MAX: Duration = Duration::from_secs(5);

/// Follows a controller's changes.
pub struct ChangeFollower {
    choose: ChooseCells,
    last: LastProgram,
    shelf: ProgramShelf,
    engine: Option<ReplayEngine>,
    run: Option<ChangeRun>,
    /// The last executed scan. It is kept if a run could not continue.
    at: Option<LogPosition>,
    /// The last executed section.
    newest: Option<SectionName>,
}

impl ChangeFollower {
    /// Follows the cells that `choose` returns for each program.
    pub fn new(choose: ChooseCells) -> ChangeFollower {
        let (last, shelf) = (LastProgram::default(), ProgramShelf::default());
        ChangeFollower { choose, last, shelf, engine: None, run: None, at: None, newest: None }
    }

    /// The last executed scan.
    pub fn position(&self) -> Option<LogPosition> {
        self.at
    }

    /// The number of the section to request next. All sections before it have been executed.
    pub fn next_section(&self) -> u64 {
        self.newest.map_or(u64::MAX, |(_, sequence)| sequence)
    }

    /// The events since the previous look. Sends the controller one request; blocks until it has
    /// answered.
    ///
    /// # Errors
    /// [`LookFailure`]; the next look continues at the same position.
    pub fn look(&mut self, socket: &Path) -> Result<Vec<LogEvent>, LookFailure> {
        let answer = asked(socket, self.next_section())?;
        let recording = Recording::newest(answer, &mut self.last);
        self.take(recording)
    }

    /// Executes the new entries of the newest part of a recording.
    ///
    /// # Errors
    /// Nothing is recorded, or this version of rungd cannot load the program.
    pub fn take(&mut self, recording: Recording) -> Result<Vec<LogEvent>, LookFailure> {
        let count = recording.count();
        if count == 0 {
            let why = "the controller has recorded nothing yet, or the scan log has no room: see \
                       `[record] memory` of the controller file";
            return Err(LookFailure::Unusable(why.to_owned()));
        }
        let heads: Vec<SectionHead> =
            (0..count).map(|at| SectionHead::of(&recording, at)).collect();
        for head in &heads {
            self.shelf.take(&head.program, &self.choose).map_err(LookFailure::Unusable)?;
        }
        let shelf = self.shelf.clone();
        let make = move |of: &RecordedProgram| shelf.engine(of);
        let mut replay = Replay::going_on(recording, make, self.engine.take());
        let mut events = Vec::new();
        for (at, head) in heads.into_iter().enumerate() {
            if self.newest.is_some_and(|newest| newest.0 == head.name.0 && head.name.1 < newest.1) {
                continue;
            }
            let Ok(section) = replay.section(at) else { continue };
            let program =
                self.shelf.take(&head.program, &self.choose).map_err(LookFailure::Unusable)?;
            self.section(&head, program, &section, &mut events);
        }
        self.engine = replay.into_engine();
        Ok(events)
    }

    fn section(
        &mut self,
        head: &SectionHead,
        program: Arc<LoggedProgram>,
        section: &TapeSection,
        events: &mut Vec<LogEvent>,
    ) {
        let joins = self.newest.is_some_and(|(process, sequence)| {
            let next = (process, sequence.wrapping_add(1));
            head.name == (process, sequence) || head.name == next && head.follows
        });
        let at = start(head.name, section);
        let before = self.position();
        let known = self.run.take().filter(|run| Arc::ptr_eq(&run.program, &program));
        let is_new = known.is_none();
        let mut run = known.unwrap_or_else(|| ChangeRun::new(program));
        if let Some(from) = before.filter(|_| !joins) {
            events.push(LogEvent::Jumped { from, to: at });
        }
        if is_new {
            let Some(values) = run.begin(section) else { return };
            run.told(&values);
            let program = Arc::clone(&run.program);
            events.push(LogEvent::Begins { program, values, at });
        }
        let mut tell = |change| events.push(LogEvent::Changed(change));
        if run.take(head.name, section, &mut tell) {
            self.newest = Some(head.name);
            self.at = Some(run.at);
            self.run = Some(run);
        }
    }
}

/// The facts about a section that are known before it is read.
struct SectionHead {
    name: SectionName,
    follows: bool,
    program: Arc<RecordedProgram>,
}

impl SectionHead {
    fn of(recording: &Recording, at: usize) -> SectionHead {
        let (program, head) = (Arc::clone(recording.program(at)), recording.head(at));
        let name = (program.process_start_ns, head.sequence);
        SectionHead { name, follows: head.follows, program }
    }
}

/// The position at the start of a section.
pub(super) fn start((process_start_ns, _): SectionName, section: &TapeSection) -> LogPosition {
    let unix_ns = begin_unix_ns(section);
    LogPosition { process_start_ns, scan: section.start.number.saturating_sub(1), unix_ns }
}

/// Requests the sections from a number on.
pub(super) fn asked(socket: &Path, from_section: u64) -> Result<Vec<u8>, LookFailure> {
    let request = Request::Recording { from_section: Some(from_section) };
    let answer: RecordingBytes =
        client::ask_within(socket, &request, ANSWER_MAX).map_err(LookFailure::Call)?;
    let unusable = || LookFailure::Unusable("the controller's answer is not a recording".into());
    answer.bytes().ok_or_else(unusable)
}
