//! Injected faults: named points at which a test makes rungd panic or stall.
//!
//! A test of rungd's behaviour after a bug needs a bug. In a build with debug assertions, the
//! environment variable `RUNGD_FAULTS` can name a file. A point whose name a test writes into that
//! file then has a fault, once. A release build has none of this: its points are empty, and
//! `.ci/run` checks that the binary contains no word of it.

/// The point of an injected fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum FaultPoint {
    /// A panic within the scan, like a bug of the engine.
    Scan = 1,
    /// The scan takes one second longer.
    Stall,
    /// A panic in the scan thread, between two scans.
    Thread,
    /// A panic in the monitor thread.
    Monitor,
    /// A panic in a field device's driver.
    Device,
    /// A panic in the shell, on the main thread.
    Shell,
    /// The disk of retentive memory takes one second longer.
    Disk,
    /// The disk of the scan log takes one second longer.
    RecordDisk,
    /// The thread of the scan log stalls, as long as `.hold` stands beside the file.
    Record,
    /// The section of the scan log that is under way ends.
    RecordSection,
    /// A panic in the page in a terminal, of the thread that draws it.
    Page,
}

#[cfg(debug_assertions)]
pub use armed::{is_due, listen, point};

/// Nothing, in a build without debug assertions.
#[cfg(not(debug_assertions))]
pub fn listen() {}

/// Nothing, in a build without debug assertions.
#[cfg(not(debug_assertions))]
#[inline(always)]
pub fn point(_: FaultPoint) {}

/// Never, in a build without debug assertions.
#[cfg(not(debug_assertions))]
#[inline(always)]
pub fn is_due(_: FaultPoint) -> bool {
    false
}

#[cfg(debug_assertions)]
mod armed {
    use std::path::Path;
    use std::sync::atomic::{AtomicU8, Ordering};
    use std::thread;
    use std::time::Duration;

    use super::FaultPoint;

    const POINTS: [(&str, FaultPoint); 11] = [
        ("scan", FaultPoint::Scan),
        ("stall", FaultPoint::Stall),
        ("thread", FaultPoint::Thread),
        ("monitor", FaultPoint::Monitor),
        ("device", FaultPoint::Device),
        ("shell", FaultPoint::Shell),
        ("disk", FaultPoint::Disk),
        ("record-disk", FaultPoint::RecordDisk),
        ("record", FaultPoint::Record),
        ("record-section", FaultPoint::RecordSection),
        ("page", FaultPoint::Page),
    ];
    /// The interval at which the file is read.
    const LOOK_EVERY: Duration = Duration::from_millis(1);
    /// The time for which a scan, or the disk, stalls.
    const STALL: Duration = Duration::from_secs(1);

    /// The point that has a fault when it is reached next; 0: none.
    static ARMED: AtomicU8 = AtomicU8::new(0);

    /// Starts a thread that waits for requested faults.
    pub fn listen() {
        let Some(file) = std::env::var_os("RUNGD_FAULTS") else { return };
        let named = thread::Builder::new().name("rungd-faults".into());
        let _ = named.spawn(move || {
            loop {
                look(Path::new(&file));
                thread::sleep(LOOK_EVERY);
            }
        });
    }

    fn look(file: &Path) {
        let Ok(text) = std::fs::read_to_string(file) else { return };
        if let Some((_, point)) = POINTS.iter().find(|(name, _)| *name == text.trim()) {
            let _ = std::fs::remove_file(file);
            ARMED.store(*point as u8, Ordering::Release);
        }
    }

    /// Whether a fault was requested for this point; it then is over.
    pub fn is_due(point: FaultPoint) -> bool {
        let (own, order) = (point as u8, Ordering::AcqRel);
        ARMED.load(Ordering::Relaxed) == own
            && ARMED.compare_exchange(own, 0, order, Ordering::Acquire).is_ok()
    }

    /// A stall whose end a test chooses: no time is long enough for a buffer to overflow on every
    /// machine.
    fn stall_while_held() {
        let mut hold = std::env::var_os("RUNGD_FAULTS").unwrap_or_default();
        hold.push(".hold");
        while Path::new(&hold).exists() {
            thread::sleep(LOOK_EVERY);
        }
    }

    /// A fault, if one was requested for this point.
    pub fn point(point: FaultPoint) {
        if !is_due(point) {
            return;
        }
        match point {
            // What it does stands where it is asked for.
            FaultPoint::RecordSection => {}
            FaultPoint::Stall | FaultPoint::Disk | FaultPoint::RecordDisk => {
                thread::sleep(STALL);
            }
            FaultPoint::Record => stall_while_held(),
            FaultPoint::Scan
            | FaultPoint::Thread
            | FaultPoint::Monitor
            | FaultPoint::Device
            | FaultPoint::Shell
            | FaultPoint::Page => {
                panic!("a fault on purpose: {point:?}")
            }
        }
    }
}
