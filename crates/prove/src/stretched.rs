//! A path with more scans, so that a test keeps the images of retained memory which it needs.
//!
//! `decide` tries it if the path itself does something else in a test. In a model with images that
//! are older than the last scan, any scan may leave the newest image; a test keeps the image of its
//! first scan, and then one at each multiple of `interval`. So the scan whose image is found is
//! repeated until that image is due. Whether the longer path still does the same, only a test says.

use crate::events::ScanEvent;
use crate::model::{Path, ProofModel};

/// The path whose images are due where they are needed. `interval_ms`: the time between images.
pub(crate) fn stretched(model: &ProofModel, path: &Path, interval_ms: u32) -> Path {
    let Some(place) = model.event_place() else { return path.clone() };
    let mut images = ImageSchedule { due_ms: 0, next_ms: 0, interval_ms: interval_ms.into() };
    let mut scans = Vec::new();
    for (at, choices) in path.scans.iter().enumerate() {
        let event = model.event(choices);
        let is_needed = match event {
            Some(ScanEvent::PowerCut) => true,
            Some(ScanEvent::KeepImage) => is_found(model, &path.scans[at + 1..]),
            Some(ScanEvent::Stop | ScanEvent::Restart | ScanEvent::PowerCutBeforeImage) | None => {
                false
            }
        };
        let period_ms = u64::from(model.period_ms);
        let late = if images.next_ms == 0 { 1 } else { model.periods(choices) };
        images.next_ms += u64::from(late) * period_ms;
        while is_needed && !images.is_due() {
            let mut quiet = choices.clone();
            quiet[place] = 0;
            scans.push(quiet);
            images.next_ms += period_ms;
        }
        images.keep();
        scans.push(choices.clone());
        if event.is_some_and(ScanEvent::begins_process) {
            (images.due_ms, images.next_ms) = (0, 0);
        }
    }
    Path { scans }
}

/// Whether a power cut finds the image that was kept before these scans.
fn is_found(model: &ProofModel, scans: &[Vec<i32>]) -> bool {
    let next = scans.iter().find_map(|choices| model.event(choices));
    next == Some(ScanEvent::PowerCutBeforeImage)
}

/// The images that a test keeps in a process, by the time since its start.
struct ImageSchedule {
    /// When the next one is due.
    due_ms: u64,
    /// The time of the next scan.
    next_ms: u64,
    interval_ms: u64,
}

impl ImageSchedule {
    /// Whether an image of the last scan is kept before the next one.
    fn is_due(&self) -> bool {
        self.due_ms < self.next_ms
    }

    fn keep(&mut self) {
        while self.is_due() {
            self.due_ms += self.interval_ms.max(1);
        }
    }
}
