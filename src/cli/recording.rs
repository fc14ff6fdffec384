//! The parts shared by the commands that read recordings: the source of a recording (a file, a
//! folder or a running controller), its stretches, and the sections of a time.
//!
//! Used by `why`, `record` and `replay`. These commands change nothing in a controller.

use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::exit::Exit;
use super::operator::OperatorArgs;
use super::terminal::say_line;
use super::when::Moment;
use rungd_client::operator::protocol::{Present, RecordingBytes, Request};
use rungd_history::record::Recording;
use rungd_runtime::{TapeStep, tape_steps};

/// The recording of the last minute of a running controller, and what it does at present. `Err` is
/// the exit code of a refusal, which has been printed.
pub(super) fn live(at: &OperatorArgs) -> Result<(Recording, Option<Present>), Exit> {
    let answer: RecordingBytes = at.ask(&Request::Recording { from_section: None })?;
    let Some(bytes) = answer.bytes() else {
        say_line("rungd: the controller's answer is not a recording");
        return Err(Exit::Unavailable);
    };
    Ok((Recording::of_bytes(bytes), answer.present))
}

/// The recording in a file of segments, or in a folder of such files.
///
/// # Errors
/// The recording cannot be read.
pub(super) fn opened(path: &Path) -> Result<Recording> {
    Recording::open(path).with_context(|| path.display().to_string())
}

/// As [`opened`], without the texts of the programs: for lists.
///
/// # Errors
/// The recording cannot be read.
pub(super) fn opened_heads(path: &Path) -> Result<Recording> {
    Recording::open_heads(path).with_context(|| path.display().to_string())
}

/// Prints the flaws of the files of a recording.
pub(super) fn tell_flaws(recording: &Recording) {
    for (path, flaw) in &recording.flaws {
        say_line(&format!("warning: {}: {flaw}", path.display()));
    }
}

/// The recording in a file or folder; without a path, the recording of a running controller.
///
/// # Errors
/// The recording cannot be read.
pub(super) fn of(
    path: Option<&PathBuf>,
    at: &OperatorArgs,
) -> Result<std::result::Result<Recording, Exit>> {
    match path {
        Some(path) => opened(path).map(Ok),
        None => Ok(live(at).map(|(recording, _)| recording)),
    }
}

/// The times of the first and the last scan, ns since 1970 (UTC); `None` if the recording is empty.
pub(super) fn span(recording: &Recording) -> Option<RangeInclusive<i64>> {
    let last = recording.count().checked_sub(1)?;
    Some(recording.head(0).begin_ns..=recording.head(last).end_ns)
}

/// The number of the last scan that began before or at a time, ns since 1970 (UTC).
pub(super) fn scan_at(recording: &Recording, unix_ns: i64) -> Option<u64> {
    let section = recording.place_of_time(unix_ns)?;
    let (_, body) = recording.read(section).ok()??;
    let start = recording.start(section, &body);
    let begins = tape_steps(&body.entries, (start.number, 0)).filter(TapeStep::begins_scan);
    let last = begins.take_while(|begin| start.unix_ns(begin.now_ns) <= unix_ns).last();
    last.map_or(start.number.checked_sub(1), |begin| Some(begin.number))
}

/// The section that contains a moment, or the last section before it.
pub(super) fn section_at(recording: &Recording, moment: Moment) -> Option<usize> {
    match moment {
        Moment::Scan(scan) => recording.place_of_scan(scan),
        Moment::Time(unix_ns) => recording.place_of_time(unix_ns),
    }
}

/// Sections of one program without a gap.
#[derive(Clone, Debug)]
pub(super) struct RecordedStretch {
    /// The sections.
    pub sections: Range<usize>,
    /// The times of the first and the last scan, ns since 1970 (UTC).
    pub begin_ns: i64,
    pub end_ns: i64,
    /// The numbers of the first and the last scan.
    pub first_scan: u64,
    pub last_scan: u64,
}

impl RecordedStretch {
    /// The text about a gap before the stretch, if there is a gap.
    pub fn gap(&self, recording: &Recording) -> Option<String> {
        let first = self.sections.start;
        if first == 0 || recording.follows(first) {
            return None;
        }
        let process = |at: usize| recording.program(at).process_start_ns;
        if process(first) != process(first - 1) {
            return Some("rungd was restarted".to_owned());
        }
        let read = recording.read(first).ok().flatten();
        Some(match read.map_or(0, |(_, body)| body.lost) {
            0 => "a gap: nothing was recorded here".to_owned(),
            1 => "a gap: 1 scan is lost".to_owned(),
            lost => format!("a gap: {lost} scans are lost"),
        })
    }
}

/// The stretches of a recording, in order.
pub(super) fn stretches(recording: &Recording) -> Vec<RecordedStretch> {
    let mut all: Vec<RecordedStretch> = Vec::new();
    for at in 0..recording.count() {
        let head = recording.head(at);
        let last_scan = head.number.saturating_add(head.scans.into()).saturating_sub(1);
        let goes_on = recording.follows(at) && recording.program(at - 1) == recording.program(at);
        match all.last_mut() {
            Some(stretch) if goes_on => {
                stretch.sections.end = at + 1;
                (stretch.end_ns, stretch.last_scan) = (head.end_ns, last_scan);
            }
            Some(_) | None => all.push(RecordedStretch {
                sections: at..at + 1,
                begin_ns: head.begin_ns,
                end_ns: head.end_ns,
                first_scan: head.number,
                last_scan,
            }),
        }
    }
    all
}
