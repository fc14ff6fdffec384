//! Retentive memory in virtual time: the images that would be durable, and their times.
//!
//! Images are kept at the same times as by the daemon's thread: the first image after the first
//! scan, then one at each multiple of `interval`, and one at the end of RUN. Each is the image of
//! the last scan that was complete at that time.

use std::collections::VecDeque;

use super::mode::MS_NS;
use super::program::RigProgram;
use crate::engine::{Cell, Image};
use crate::retain::{RetainPlan, content};

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
    at_ns: u64,
    /// Whether the passes of a stop had been executed.
    is_final: bool,
    content: Vec<u8>,
}

/// The memory that a new process finds.
pub(super) enum FoundMemory {
    /// Cells and their values; `is_final`: the passes of a stop have been executed on them.
    Image { puts: Vec<(Cell, i32)>, is_final: bool },
    /// Nothing: a cold start.
    Nothing,
    /// Nothing, and the controller waits in STOP.
    NothingInStop,
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
    pub fn settle(&mut self, image: &Image, (next_ns, is_final): (u64, bool)) {
        if self.due_ns >= next_ns {
            return;
        }
        let intervals = (next_ns - 1 - self.due_ns) / self.interval_ns;
        let last_due_ns = self.due_ns + intervals * self.interval_ns;
        self.keep(image, (last_due_ns, is_final));
        self.due_ns = last_due_ns + self.interval_ns;
    }

    /// Keeps an image at once.
    pub fn keep(&mut self, image: &Image, (at_ns, is_final): (u64, bool)) {
        if self.plan.is_empty() {
            return;
        }
        let mut content = Vec::new();
        self.plan.gather(image.bits(), image.words(), &mut content);
        self.images.push_back(KeptImage { at_ns, is_final, content });
    }

    /// Begins a new process of a program, with the settings of that program. The process finds the
    /// newest image, or the newest that is at least `lost_ns` older; later images are lost.
    pub fn begin(&mut self, program: &RigProgram, now_ns: u64, lost_ns: u64) -> FoundMemory {
        let images = std::mem::take(&mut self.images);
        *self = Retained { images, ..Retained::new(program, now_ns) };
        if self.plan.is_empty() {
            return FoundMemory::Nothing;
        }
        let newest_ns = self.images.back().map_or(0, |image| image.at_ns);
        if lost_ns > 0 {
            self.images.retain(|image| image.at_ns + lost_ns <= newest_ns);
        }
        let found = self.images.back().and_then(|image| {
            let content = content::read(&image.content)?;
            let restoration = self.plan.restore(&content, image.is_final);
            let puts = restoration.puts;
            (restoration.restored > 0)
                .then_some(FoundMemory::Image { puts, is_final: image.is_final })
        });
        let cold = if self.runs_cold { FoundMemory::Nothing } else { FoundMemory::NothingInStop };
        found.unwrap_or(cold)
    }
}
