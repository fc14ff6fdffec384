//! The stretches of a recording, each of sections of one program without a gap; the gaps between
//! them; the scan of a time.
//!
//! `cli` lists them, `summary` measures them. Only a gap reads a section.

use std::fmt;
use std::ops::{Range, RangeInclusive};

use super::recording::Recording;
use rungd_runtime::{TapeStep, tape_steps};

/// Sections of one program without a gap.
#[derive(Clone, Debug)]
pub struct RecordedStretch {
    /// The sections.
    pub sections: Range<usize>,
    /// The time of its first scan, ns since 1970 (UTC).
    pub begin_ns: i64,
    /// The time of its last scan, ns since 1970 (UTC).
    pub end_ns: i64,
    /// The number of its first scan.
    pub first_scan: u64,
    /// The number of its last scan.
    pub last_scan: u64,
}

/// A gap in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordedGap {
    /// A different process begins.
    Restart,
    /// Steps are missing; 0: their number is not known.
    Lost(u64),
}

impl Recording {
    /// The times of the first and the last scan, ns since 1970 (UTC); `None` if the recording is
    /// empty.
    pub fn span(&self) -> Option<RangeInclusive<i64>> {
        let last = self.count().checked_sub(1)?;
        Some(self.head(0).begin_ns..=self.head(last).end_ns)
    }

    /// The number of the last scan that began before or at a time, ns since 1970 (UTC).
    pub fn scan_at(&self, unix_ns: i64) -> Option<u64> {
        let section = self.place_of_time(unix_ns)?;
        let (_, body) = self.read(section).ok()??;
        let start = self.start(section, &body);
        let begins = tape_steps(&body.entries, start.number, 0).filter(TapeStep::begins_scan);
        let last = begins.take_while(|begin| start.unix_ns(begin.now_ns) <= unix_ns).last();
        last.map_or(start.number.checked_sub(1), |begin| Some(begin.number))
    }

    /// The gap right before a section, if there is one.
    pub fn gap_before(&self, at: usize) -> Option<RecordedGap> {
        if at == 0 || self.follows(at) {
            return None;
        }
        let process = |at: usize| self.program(at).process_start_ns;
        if process(at) != process(at - 1) {
            return Some(RecordedGap::Restart);
        }
        let read = self.read(at).ok().flatten();
        Some(RecordedGap::Lost(read.map_or(0, |(_, body)| body.lost)))
    }

    /// The stretches, in order.
    pub fn stretches(&self) -> Vec<RecordedStretch> {
        let mut all: Vec<RecordedStretch> = Vec::new();
        for at in 0..self.count() {
            let head = self.head(at);
            let last_scan = head.number.saturating_add(head.scans.into()).saturating_sub(1);
            let continues = self.follows(at) && self.program(at - 1) == self.program(at);
            match all.last_mut() {
                Some(stretch) if continues => {
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
}

impl fmt::Display for RecordedGap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RecordedGap::Restart => f.write_str("rungd was restarted"),
            RecordedGap::Lost(0) => f.write_str("a gap: nothing was recorded here"),
            RecordedGap::Lost(1) => f.write_str("a gap: 1 scan is lost"),
            RecordedGap::Lost(lost) => write!(f, "a gap: {lost} scans are lost"),
        }
    }
}
