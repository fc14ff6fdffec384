//! At each look, requests the newest part of a controller's scan log; between the looks, keeps its
//! last minute.
//!
//! The first look at a program fetches only its newest scans, so that the picture appears soon; the
//! second look fetches the minute before them. Called by `web` and by `monitor`.

use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use super::live_past::{EarlierProgram, LivePast};
use super::program::LiveProgram;
use super::view::LiveView;
use crate::operator::client::{self, CallFailure};
use crate::operator::protocol::{PresentOutputs, RecordingBytes, Request};
use rungd_history::observe::{PowerRun, ScanPower, WholeProgram};
use rungd_history::playback::Playback;
use rungd_history::record::{LastProgram, RecordedProgram, Recording};
use rungd_runtime::TapeSection;

/// The longest wait for an answer.
const ANSWER_MAX: Duration = Duration::from_secs(5);

/// The most sections that are kept: a section is about a second.
const SECTIONS_MAX: u64 = 70;

/// The most entries that are kept.
const ENTRIES_MAX: usize = 1 << 20;

/// Why a look failed.
#[derive(Debug)]
pub enum LookFailure {
    /// The controller does not answer, or refuses.
    Call(CallFailure),
    /// The answer cannot be used: it comes from a different version of rungd, or the program has
    /// just been exchanged.
    Unusable(String),
}

impl fmt::Display for LookFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LookFailure::Call(failure) => failure.fmt(f),
            LookFailure::Unusable(why) => f.write_str(why),
        }
    }
}

impl From<CallFailure> for LookFailure {
    fn from(failure: CallFailure) -> LookFailure {
        LookFailure::Call(failure)
    }
}

/// A kept section, with its number among those of its process.
type KeptSection = (u64, Arc<TapeSection>);

/// Follows a controller.
#[derive(Default)]
pub struct ControllerFollower {
    /// The running program and its scans.
    known: Option<FollowedProgram>,
    last: LastProgram,
}

struct FollowedProgram {
    program: Arc<LiveProgram>,
    run: PowerRun,
    playback: Playback<WholeProgram>,
    /// Whether the minute before the first look has been fetched.
    has_minute: bool,
    sections: Vec<KeptSection>,
    power: Arc<ScanPower>,
    /// The program that ran right before the first section.
    earlier: Option<Arc<EarlierProgram>>,
}

impl ControllerFollower {
    /// Looks at the last scan. Sends the controller one request; blocks until it has answered.
    ///
    /// # Errors
    /// [`LookFailure`]; the next look starts from nothing.
    pub fn look(&mut self, socket: &Path) -> Result<LiveView, LookFailure> {
        let looked = self.look_on(socket);
        if looked.is_err() {
            self.known = None;
        }
        looked
    }

    /// Forgets the minute, but keeps the program for a later look.
    pub fn rest(&mut self) {
        if let Some(known) = &mut self.known {
            known.sections = Vec::new();
            known.earlier = None;
            known.has_minute = false;
        }
    }

    fn look_on(&mut self, socket: &Path) -> Result<LiveView, LookFailure> {
        let (bytes, present) = recorded(socket, self.next_section())?;
        let recording = Arc::new(Recording::newest(bytes, &mut self.last));
        let running = running(&recording)?;
        if self.known.as_ref().is_none_or(|known| known.program.recorded != running) {
            let earlier = self.known.take().and_then(|known| known.ended(&recording, &running));
            let program = LiveProgram::of(running).map_err(LookFailure::Unusable)?;
            let known = FollowedProgram { earlier, ..FollowedProgram::new(Arc::new(program)) };
            self.known = Some(known);
        }
        let known = self.known.as_mut().ok_or_else(exchanged)?;
        known.take(&recording)?;
        Ok(known.view(present.map(Arc::new)))
    }

    /// The first section to request.
    fn next_section(&self) -> u64 {
        let Some(known) = &self.known else { return u64::MAX };
        match known.sections.last() {
            None => u64::MAX,
            Some((newest, _)) if known.has_minute => *newest,
            Some((newest, _)) => (newest + 1).saturating_sub(SECTIONS_MAX),
        }
    }
}

/// The newest part of the scan log, from a section on, and what the controller does at present.
pub(super) fn recorded(
    socket: &Path,
    from_section: u64,
) -> Result<(Vec<u8>, Option<PresentOutputs>), LookFailure> {
    let request = Request::Recording { from_section: Some(from_section) };
    let answer: RecordingBytes = client::ask_within(socket, &request, ANSWER_MAX)?;
    let unusable = || LookFailure::Unusable("the controller's answer is not a recording".into());
    Ok((answer.bytes().ok_or_else(unusable)?, answer.present))
}

/// The failure if the controller has recorded nothing.
pub(super) fn nothing_recorded() -> LookFailure {
    let why = "the controller has recorded nothing yet, or the scan log has no room: see `[record] \
               memory` of the controller file";
    LookFailure::Unusable(why.to_owned())
}

/// The program of the newest section.
fn running(recording: &Recording) -> Result<Arc<RecordedProgram>, LookFailure> {
    let last = recording.count().checked_sub(1);
    Ok(Arc::clone(recording.program(last.ok_or_else(nothing_recorded)?)))
}

fn exchanged() -> LookFailure {
    LookFailure::Unusable("the program has just been exchanged".to_owned())
}

impl FollowedProgram {
    fn new(program: Arc<LiveProgram>) -> FollowedProgram {
        let whole = WholeProgram::new(Arc::clone(&program.subject));
        let run = PowerRun::of(whole.clone());
        let power = Arc::new(ScanPower::nothing());
        let playback = Playback::new(Recording::default(), whole);
        let (has_minute, sections) = (false, Vec::new());
        FollowedProgram { program, run, playback, has_minute, sections, power, earlier: None }
    }

    /// Takes the sections of the program, and executes them up to the last scan.
    fn take(&mut self, recording: &Arc<Recording>) -> Result<(), LookFailure> {
        let own = &self.program.recorded;
        let places: Vec<(usize, u64, bool)> = (0..recording.count())
            .filter(|at| recording.program(*at) == own)
            .map(|at| (at, recording.head(at).sequence, recording.head(at).follows))
            .collect();
        let first = places.first().ok_or_else(exchanged)?.1;
        self.playback.set_recording(Arc::clone(recording));
        self.has_minute = !self.sections.is_empty();
        self.sections.retain(|(sequence, _)| *sequence < first);
        for (at, sequence, follows) in places {
            let Ok(mut section) = self.playback.section(at) else { continue };
            // The first section of an answer follows the kept ones only if its number is the next
            // one.
            let before = self.sections.last().map(|(sequence, _)| sequence + 1);
            section.start.follows = follows && before == Some(sequence);
            self.sections.push((sequence, Arc::new(section)));
        }
        self.forget();
        let (_, newest) = self.sections.last().ok_or_else(exchanged)?;
        if let Some(power) = self.run.last_of(newest) {
            self.power = Arc::new(power);
        }
        Ok(())
    }

    /// Drops the oldest sections.
    fn forget(&mut self) {
        let mut entries: usize =
            self.sections.iter().map(|(_, section)| section.entries.len()).sum();
        let mut first = self.sections.len().saturating_sub(SECTIONS_MAX as usize);
        for (_, section) in &self.sections {
            if entries <= ENTRIES_MAX || first + 1 >= self.sections.len() {
                break;
            }
            entries -= section.entries.len();
            first += 1;
        }
        if self.sections.drain(..first).len() > 0 {
            self.earlier = None;
        }
    }

    /// The program after its last scan, if the recording has the rest of its sections, and the next
    /// program goes on from there.
    fn ended(
        mut self,
        recording: &Arc<Recording>,
        running: &Arc<RecordedProgram>,
    ) -> Option<Arc<EarlierProgram>> {
        self.take(recording).ok()?;
        let next = self.sections.last()?.0 + 1;
        let next = (0..recording.count()).find(|at| recording.head(*at).sequence == next)?;
        let is_next = recording.head(next).follows && recording.program(next) == running;
        let sections = self.sections.into_iter().map(|(_, section)| section).collect();
        let past = LivePast { sections, earlier: self.earlier };
        let earlier = EarlierProgram::new(Arc::clone(&self.program.subject), past);
        is_next.then(|| Arc::new(earlier))
    }

    fn view(&self, present: Option<Arc<PresentOutputs>>) -> LiveView {
        LiveView {
            present,
            program: Arc::clone(&self.program),
            power: Arc::clone(&self.power),
            has_minute: self.has_minute,
            sections: self.sections.iter().map(|(_, section)| Arc::clone(section)).collect(),
            earlier: self.earlier.clone(),
        }
    }
}
