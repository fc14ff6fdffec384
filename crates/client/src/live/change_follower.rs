//! Follows the changes of chosen cells of a running controller: each once, in order, scan by scan.
//!
//! Each look requests the newest section of the scan log from the operator's socket, and executes
//! its new entries. If the log continues at a later position (after a restart, or after a pause of
//! the follower that is longer than the controller's memory), the follower reports a jump;
//! `change_history` has the changes between the two positions. Called by `edge`, ten times a
//! second.

use std::path::Path;
use std::sync::Arc;

use super::change_run::{ChangeRun, SectionName, begin_unix_ns};
use super::follower::{LookFailure, nothing_recorded, recorded};
use super::log_event::{LogEvent, LogPosition};
use super::logged_program::{ChooseCells, LoggedProgram, LoggedPrograms};
use rungd_history::playback::Playback;
use rungd_history::record::{LastProgram, Recording};
use rungd_runtime::TapeSection;

/// Follows a controller's changes.
pub struct ChangeFollower {
    last: LastProgram,
    playback: Playback<LoggedPrograms>,
    run: Option<ChangeRun>,
    /// The last executed scan. It is kept if a run could not continue.
    at: Option<LogPosition>,
    /// The last executed section.
    newest: Option<SectionName>,
}

impl ChangeFollower {
    /// Follows the cells that `choose` returns for each program.
    pub fn new(choose: ChooseCells) -> ChangeFollower {
        let last = LastProgram::default();
        let playback = Playback::new(Recording::default(), LoggedPrograms::new(choose));
        ChangeFollower { last, playback, run: None, at: None, newest: None }
    }

    /// The last executed scan.
    pub fn position(&self) -> Option<LogPosition> {
        self.at
    }

    /// The number of the section to request next. All sections before it have been executed.
    pub fn next_section(&self) -> u64 {
        self.newest.map_or(u64::MAX, |newest| newest.sequence)
    }

    /// The events since the previous look. Sends the controller one request; blocks until it has
    /// answered.
    ///
    /// # Errors
    /// [`LookFailure`]; the next look continues at the same position.
    pub fn look(&mut self, socket: &Path) -> Result<Vec<LogEvent>, LookFailure> {
        let (bytes, _) = recorded(socket, self.next_section())?;
        let recording = Recording::newest(bytes, &mut self.last);
        self.take(recording)
    }

    /// Executes the new entries of the newest part of a recording.
    ///
    /// # Errors
    /// Nothing is recorded, or this version of rungd cannot load the program.
    pub fn take(&mut self, recording: Recording) -> Result<Vec<LogEvent>, LookFailure> {
        let count = recording.count();
        if count == 0 {
            return Err(nothing_recorded());
        }
        self.playback.set_recording(recording);
        let recording = Arc::clone(self.playback.recording());
        for at in 0..count {
            self.program(&recording, at)?;
        }
        let mut events = Vec::new();
        for at in 0..count {
            let head = recording.head(at);
            let process_start_ns = recording.program(at).process_start_ns;
            let name = SectionName { process_start_ns, sequence: head.sequence };
            if self.newest.is_some_and(|newest| {
                newest.process_start_ns == name.process_start_ns && name.sequence < newest.sequence
            }) {
                continue;
            }
            let Ok(section) = self.playback.section(at) else { continue };
            let head = SectionHead { name, follows: head.follows };
            let program = self.program(&recording, at)?;
            self.section(&head, program, &section, &mut events);
        }
        Ok(events)
    }

    fn program(
        &mut self,
        recording: &Recording,
        at: usize,
    ) -> Result<Arc<LoggedProgram>, LookFailure> {
        self.playback.programs.program(recording.program(at)).map_err(LookFailure::Unusable)
    }

    fn section(
        &mut self,
        head: &SectionHead,
        program: Arc<LoggedProgram>,
        section: &TapeSection,
        events: &mut Vec<LogEvent>,
    ) {
        let joins = self.newest.is_some_and(|newest| {
            let next = SectionName { sequence: newest.sequence.wrapping_add(1), ..newest };
            head.name == newest || head.name == next && head.follows
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
            run.mark_reported(&values);
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
}

/// The position at the start of a section.
pub(super) fn start(name: SectionName, section: &TapeSection) -> LogPosition {
    let (process_start_ns, unix_ns) = (name.process_start_ns, begin_unix_ns(section));
    LogPosition { process_start_ns, scan: section.start.number.saturating_sub(1), unix_ns }
}
