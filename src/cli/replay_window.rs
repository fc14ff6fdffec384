//! The part of a recording that `replay` shows: from one moment to a second one.
//!
//! Whole sections are executed and compared; the window decides which of their scans are shown.

use std::ops::Range;

use super::when::{LocalClock, RecordingPlace, WrittenTime};
use rungd_history::playback::PlayedScan;
use rungd_history::record::Recording;

/// A part of a recording.
pub(super) struct ReplayWindow {
    pub sections: Range<usize>,
    from: Option<RecordingPlace>,
    to: Option<RecordingPlace>,
}

impl ReplayWindow {
    /// The window between two times. A missing time is the beginning or the end of the recording.
    ///
    /// # Errors
    /// The recording is empty, or has nothing there. The text is a message.
    pub fn of(
        from: Option<&WrittenTime>,
        to: Option<&WrittenTime>,
        clock: &LocalClock,
        recording: &Recording,
    ) -> Result<ReplayWindow, String> {
        let span = recording.span().ok_or("the recording is empty")?;
        let beyond = || {
            let (begin, end) = (clock.text(*span.start()), clock.text(*span.end()));
            format!("the recording has nothing there: it is of {begin} to {end}")
        };
        let find = |when: Option<&WrittenTime>| when.map(|when| when.find(clock, span.clone()));
        let (from, to) = (find(from), find(to));
        let first = match from {
            None => 0,
            Some(RecordingPlace::Time(time)) if time > *span.end() => return Err(beyond()),
            Some(RecordingPlace::Time(time)) => recording.place_of_time(time).unwrap_or(0),
            Some(RecordingPlace::Scan(number)) => {
                recording.place_of_scan(number).ok_or_else(beyond)?
            }
        };
        let last = match to {
            None => recording.count() - 1,
            Some(RecordingPlace::Time(time)) => recording.place_of_time(time).ok_or_else(beyond)?,
            Some(RecordingPlace::Scan(number)) => {
                recording.place_of_scan(number).ok_or_else(beyond)?
            }
        };
        let is_backwards = match (from, to) {
            (Some(RecordingPlace::Time(from)), Some(RecordingPlace::Time(to))) => from > to,
            (Some(RecordingPlace::Scan(from)), Some(RecordingPlace::Scan(to))) => {
                first == last && from > to
            }
            (None | Some(_), None | Some(_)) => false,
        };
        if is_backwards || last < first {
            return Err("the end of this part lies before its beginning".to_owned());
        }
        Ok(ReplayWindow { sections: first..last + 1, from, to })
    }

    /// Whether a scan of these sections is shown.
    pub fn has(&self, scan: &PlayedScan) -> bool {
        let (first, last) = (self.sections.start, self.sections.end - 1);
        let begun = match self.from {
            None => true,
            Some(RecordingPlace::Time(time)) => scan.unix_ns >= time,
            Some(RecordingPlace::Scan(number)) => scan.section > first || scan.number >= number,
        };
        begun
            && match self.to {
                None => true,
                Some(RecordingPlace::Time(time)) => scan.unix_ns <= time,
                Some(RecordingPlace::Scan(number)) => scan.section < last || scan.number <= number,
            }
    }
}
