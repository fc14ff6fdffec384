//! The parts shared by the commands that read recordings: the source of a recording (a file, a
//! folder or a running controller), and the section of a time.
//!
//! Used by `why`, `how`, `record` and `replay`. These commands change nothing in a controller.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::exit::Exit;
use super::operator::OperatorArgs;
use super::terminal::say_line;
use super::when::{LocalClock, RecordingPlace, WrittenTime};
use rungd_client::operator::protocol::{PresentOutputs, RecordingBytes, Request};
use rungd_history::observe::QuestionTime;
use rungd_history::record::Recording;

/// The recording of the last minute of a running controller, and what it does at present. `Err` is
/// the exit code of a refusal, which has been printed.
pub(super) fn live(at: &OperatorArgs) -> Result<(Recording, Option<PresentOutputs>), Exit> {
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

/// A recording that was asked for.
pub(super) enum AskedRecording {
    Opened(Recording),
    /// The controller refused, which is printed.
    Refused(Exit),
}

/// The recording in a file or folder; without a path, the recording of a running controller.
///
/// # Errors
/// The recording cannot be read.
pub(super) fn of(path: Option<&PathBuf>, at: &OperatorArgs) -> Result<AskedRecording> {
    match path {
        Some(path) => opened(path).map(AskedRecording::Opened),
        None => Ok(match live(at) {
            Ok((recording, _)) => AskedRecording::Opened(recording),
            Err(exit) => AskedRecording::Refused(exit),
        }),
    }
}

/// The section that contains a moment, or the last section before it.
pub(super) fn section_at(recording: &Recording, moment: RecordingPlace) -> Option<usize> {
    match moment {
        RecordingPlace::Scan(scan) => recording.place_of_scan(scan),
        RecordingPlace::Time(unix_ns) => recording.place_of_time(unix_ns),
    }
}

/// A time that is at most this much later than the last scan means that scan, because people write
/// whole seconds.
const LATE_NS: i64 = 1_000_000_000;

/// The section of a question about a moment, and the moment in it; without a time, the end.
///
/// # Errors
/// The recording does not have the moment.
pub(super) fn moment(
    at: Option<&WrittenTime>,
    recording: &Recording,
) -> Result<(usize, QuestionTime), String> {
    let span = recording.span().ok_or("the recording is empty")?;
    let last = recording.count() - 1;
    let Some(when) = at else { return Ok((last, QuestionTime::Now)) };
    let clock = LocalClock::here();
    let scan = match when.find(&clock, span.clone()) {
        RecordingPlace::Scan(scan) => Some(scan),
        RecordingPlace::Time(unix_ns) if unix_ns > span.end().saturating_add(LATE_NS) => None,
        RecordingPlace::Time(unix_ns) => recording.scan_at(unix_ns),
    };
    let found =
        scan.and_then(|scan| Some((recording.place_of_scan(scan)?, QuestionTime::Scan(scan))));
    found.ok_or_else(|| {
        let (begin, end) = (clock.text(*span.start()), clock.text(*span.end()));
        format!("the recording has no such scan: it is of {begin} to {end}")
    })
}
