//! Retentive memory in virtual time: the images that would be durable, and their times.
//!
//! Images are kept at the same times as by the daemon's thread: the first image after the first
//! scan, then one at each multiple of `interval`, and one at the end of RUN. Each is the image of
//! the last scan that was complete at that time.

use std::collections::VecDeque;
use std::time::Duration;

use super::mode::MS_NS;
use super::program::RigProgram;
use rungd_engine::{Cell, Image};
use rungd_state::retain::format::down_seconds;
use rungd_state::retain::{RetainPlan, content};

/// The images of one controller, over all its processes.
pub(super) struct Retained {
    plan: RetainPlan,
    runs_cold: bool,
    interval_ns: u64,
    /// The time of the next image.
    due_ns: u64,
    images: VecDeque<KeptImage>,
}

/// An image that is durable.
struct KeptImage {
    /// The time at which it was due.
    at: ImageTime,
    /// The time of day of the scan whose image would be in the file.
    scanned_at: Duration,
    content: Vec<u8>,
}

/// The time of an image.
#[derive(Clone, Copy)]
pub(super) struct ImageTime {
    pub ns: u64,
    /// Whether the passes of a stop had been executed.
    pub is_final: bool,
    /// The time of day of its scan, since 1970.
    pub scanned_at: Duration,
}

/// The start of a process.
#[derive(Clone, Copy)]
pub(super) struct ProcessStart {
    pub ns: u64,
    /// The time of day, since 1970.
    pub clock: Duration,
}

/// The memory that a new process finds.
pub(super) enum FoundMemory {
    /// Cells and their values; `is_final`: the passes of a stop have been executed on them.
    Image { puts: Vec<(Cell, i32)>, is_final: bool, down_seconds: i32 },
    /// Nothing: a cold start.
    Nothing,
    /// Nothing, and the controller waits in STOP.
    NothingInStop,
}

fn milliseconds(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

impl Retained {
    pub fn new(program: &RigProgram, now_ns: u64) -> Retained {
        let retention = &program.controller.retention;
        Retained {
            plan: program.plan.clone(),
            runs_cold: retention.runs_cold,
            interval_ns: u64::from(retention.interval_ms.max(1)) * MS_NS,
            due_ns: now_ns,
            images: VecDeque::new(),
        }
    }

    /// A reload takes the ranges of the new program; a change of the interval needs a restart.
    pub fn adopt(&mut self, program: &RigProgram) {
        self.plan = program.plan.clone();
    }

    /// Keeps the image that was due before the next scan, if an image was due.
    pub fn settle(&mut self, image: &Image, next: ImageTime) {
        if self.due_ns >= next.ns {
            return;
        }
        let intervals = (next.ns - 1 - self.due_ns) / self.interval_ns;
        let last_due_ns = self.due_ns + intervals * self.interval_ns;
        self.keep(image, ImageTime { ns: last_due_ns, ..next });
        self.due_ns = last_due_ns + self.interval_ns;
    }

    /// Keeps an image at once.
    pub fn keep(&mut self, image: &Image, at: ImageTime) {
        if self.plan.is_empty() {
            return;
        }
        let mut content = Vec::new();
        self.plan.gather(image.bits(), image.words(), &mut content);
        let mut scanned_at = at.scanned_at;
        if let Some(last) = self.images.back()
            && (last.at.is_final, &last.content) == (at.is_final, &content)
            && !self
                .plan
                .outdates(milliseconds(scanned_at.saturating_sub(last.scanned_at)), at.is_final)
        {
            // The daemon does not write the same content again.
            scanned_at = last.scanned_at;
        }
        self.images.push_back(KeptImage { at, scanned_at, content });
    }

    /// Begins a new process of a program, with the settings of that program. The process finds the
    /// newest image, or the newest that is at least `lost_ns` older; later images are lost.
    pub fn begin(&mut self, program: &RigProgram, now: ProcessStart, lost_ns: u64) -> FoundMemory {
        let images = std::mem::take(&mut self.images);
        *self = Retained { images, ..Retained::new(program, now.ns) };
        if self.plan.is_empty() {
            return FoundMemory::Nothing;
        }
        let newest_ns = self.images.back().map_or(0, |image| image.at.ns);
        if lost_ns > 0 {
            self.images.retain(|image| image.at.ns + lost_ns <= newest_ns);
        }
        let found = self.images.back().and_then(|image| {
            let content = content::read(&image.content)?;
            let restoration = self.plan.restore(&content, image.at.is_final);
            let down_seconds =
                down_seconds(milliseconds(image.scanned_at), milliseconds(now.clock));
            let (puts, is_final) = (restoration.puts, image.at.is_final);
            (restoration.restored > 0).then_some(FoundMemory::Image {
                puts,
                is_final,
                down_seconds,
            })
        });
        let cold = if self.runs_cold { FoundMemory::Nothing } else { FoundMemory::NothingInStop };
        found.unwrap_or(cold)
    }
}
