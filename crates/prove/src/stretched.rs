//! A path with more scans, so that a test brings what it needs: an image of retained memory, and
//! `.Stale` of a lost device.
//!
//! `decide` and `equal_difference` try it if the path itself does something else in a test. In a
//! model with images that are older than the last scan, any scan may leave the newest image; a test
//! keeps the image of its first scan, and then one at each multiple of `interval`. In a model with
//! the settings of devices, `.Stale` may be ON as soon as a device is lost; a test turns it ON when
//! `loss-after` has passed. So the scan that needs one of them waits: scans are added before it.
//! Whether the longer path still does the same, only a test says.

use crate::device_wait::DeviceWait;
use crate::events::ScanEvent;
use crate::model::{Path, ProofModel};
use crate::question::Questions;

/// What the added scans are like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AddedScan {
    /// Like the scan that waits.
    Same,
    /// Like the scan before it, or one before which nothing changes, with the devices of the scan
    /// that waits.
    Before,
}

impl AddedScan {
    /// Both kinds, in the order in which they are tried.
    pub const BOTH: [AddedScan; 2] = [AddedScan::Same, AddedScan::Before];
}

/// A model, and what a test of it brings later.
pub(crate) struct TestBrings<'m> {
    pub model: &'m ProofModel,
    /// The time between two images, ms.
    pub interval_ms: u32,
    /// The devices whose `.Stale` is free.
    pub devices: Vec<DeviceWait>,
}

impl TestBrings<'_> {
    /// What a test of the model of questions brings later.
    pub fn of(questions: &Questions) -> TestBrings<'_> {
        TestBrings {
            model: &questions.model,
            interval_ms: questions.suite.programs[0].controller.retention.interval_ms,
            devices: DeviceWait::all(questions),
        }
    }
}

/// The path that waits for what a test brings later.
pub(crate) fn stretched(brings: &TestBrings, path: &Path, added: AddedScan) -> Path {
    let model = brings.model;
    let mut waits = TestWaits::of(brings);
    let resting: Vec<i32> = model.choices().iter().map(|choice| choice.resting).collect();
    let mut scans: Vec<Vec<i32>> = Vec::new();
    for (at, choices) in path.scans.iter().enumerate() {
        let event = model.event(choices);
        let needs_image = match event {
            Some(ScanEvent::PowerCut) => model.events.image_is_final.is_some(),
            Some(ScanEvent::KeepImage) => is_found(model, &path.scans[at + 1..]),
            Some(ScanEvent::Stop | ScanEvent::Restart | ScanEvent::PowerCutBeforeImage) | None => {
                false
            }
        };
        let like = match added {
            AddedScan::Same => choices,
            AddedScan::Before if at == 0 => &resting,
            AddedScan::Before => &path.scans[at - 1],
        };
        let mut row = choices.clone();
        while waits.has_to_wait(&row, needs_image) {
            let mut quiet = waits.quiet(like, choices);
            waits.keep_late(&mut quiet, &mut row);
            waits.scan(&quiet);
            scans.push(quiet);
        }
        waits.scan(&row);
        scans.push(row);
        if event.is_some_and(ScanEvent::begins_process) {
            waits.begin_process();
        }
        // At a start of RUN no scan comes late.
        waits.has_begun = !event.is_some_and(ScanEvent::continues);
    }
    Path { scans }
}

/// Whether a power cut finds the image that was kept before these scans.
fn is_found(model: &ProofModel, scans: &[Vec<i32>]) -> bool {
    let next = scans.iter().find_map(|choices| model.event(choices));
    next == Some(ScanEvent::PowerCutBeforeImage)
}

/// What a test brings later than a path needs it.
struct TestWaits<'m> {
    model: &'m ProofModel,
    images: ImageSchedule,
    devices: Vec<DeviceWait>,
    /// The time of the next scan if it comes in time, ms since the start.
    due_ms: u64,
    /// Whether a scan of this RUN was executed.
    has_begun: bool,
}

impl<'m> TestWaits<'m> {
    fn of(brings: &TestBrings<'m>) -> TestWaits<'m> {
        let interval_ms = brings.interval_ms.into();
        TestWaits {
            model: brings.model,
            images: ImageSchedule { due_ms: 0, next_ms: 0, interval_ms },
            devices: brings.devices.clone(),
            due_ms: 0,
            has_begun: false,
        }
    }

    fn period_ms(&self) -> u64 {
        self.model.period_ms().into()
    }

    /// The time by which a scan comes late, ms.
    fn late_ms(&self, choices: &[i32]) -> u64 {
        let late = if self.has_begun { self.model.periods(choices) - 1 } else { 0 };
        u64::from(late) * self.period_ms()
    }

    /// Whether a scan needs what a test brings later.
    fn has_to_wait(&self, choices: &[i32], needs_image: bool) -> bool {
        let late_ms = self.late_ms(choices);
        let ends_ms = self.images.next_ms + late_ms + self.period_ms();
        let needs_stale = |device: &DeviceWait| device.has_to_wait(choices, self.due_ms + late_ms);
        needs_image && !self.images.is_due(ends_ms) || self.devices.iter().any(needs_stale)
    }

    /// A scan in which nothing happens but time, for one with these choices.
    fn quiet(&self, like: &[i32], choices: &[i32]) -> Vec<i32> {
        let mut quiet = like.to_vec();
        if let Some(place) = self.model.event_place() {
            quiet[place] = 0;
        }
        for device in &self.devices {
            device.put(&mut quiet, choices, self.due_ms + self.late_ms(choices));
        }
        quiet
    }

    /// The first of the scans comes as late as the one that waits, which then comes in time.
    fn keep_late(&self, quiet: &mut [i32], row: &mut [i32]) {
        if let Some(place) = self.model.late_place() {
            quiet[place] = std::mem::replace(&mut row[place], 1);
        }
    }

    /// A scan is executed.
    fn scan(&mut self, choices: &[i32]) {
        let late_ms = self.late_ms(choices);
        let now_ms = self.due_ms + late_ms;
        self.devices.iter_mut().for_each(|device| device.scan(choices, now_ms));
        self.images.next_ms += late_ms + self.period_ms();
        self.images.keep();
        (self.due_ms, self.has_begun) = (now_ms + self.period_ms(), true);
    }

    fn begin_process(&mut self) {
        (self.images.due_ms, self.images.next_ms) = (0, 0);
        let now_ms = self.due_ms;
        self.devices.iter_mut().for_each(|device| device.begin_process(now_ms));
    }
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
    /// Whether an image of the last scan is kept before the next one, at a time.
    fn is_due(&self, next_ms: u64) -> bool {
        self.due_ms < next_ms
    }

    fn keep(&mut self) {
        while self.is_due(self.next_ms) {
            self.due_ms += self.interval_ms.max(1);
        }
    }
}
