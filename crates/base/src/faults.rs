//! Injected faults: named points at which a test makes rungd panic or stall.
//!
//! A test of rungd's behaviour after a bug needs a bug. In a build with debug assertions, the
//! environment variable `RUNGD_FAULTS` can name a file. If a test writes the name of a point into
//! that file, this point has a fault, once. A release build contains none of this: its points are
//! empty, and `.ci/run` checks that the binary contains no word of it.

/// The point of an injected fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum FaultPoint {
    /// A panic within the scan, like a bug of the engine.
    Scan = 1,
    /// The scan takes one second longer.
    Stall,
    /// The scan stalls as long as the file `$RUNGD_FAULTS.hold` exists.
    Hang,
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
    /// The disk of retentive memory does not answer at the start as long as the file
    /// `$RUNGD_FAULTS.hold` exists.
    RetainOpen,
    /// The disk of the scan log takes one second longer.
    RecordDisk,
    /// The disk of the scan log does not answer a sync as long as the file `$RUNGD_FAULTS.hold`
    /// exists.
    RecordSync,
    /// The thread of the scan log stalls as long as the file `$RUNGD_FAULTS.hold` exists.
    Record,
    /// The current section of the scan log ends.
    RecordSection,
    /// A panic in the thread that draws the page in a terminal.
    Page,
}

#[cfg(debug_assertions)]
pub use armed::{is_due, listen, point};

/// Does nothing in a build without debug assertions.
#[cfg(not(debug_assertions))]
pub fn listen() {}

/// Does nothing in a build without debug assertions.
#[cfg(not(debug_assertions))]
#[inline(always)]
pub fn point(_: FaultPoint) {}

/// Always false in a build without debug assertions.
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

    const POINTS: [(&str, FaultPoint); 14] = [
        ("scan", FaultPoint::Scan),
        ("stall", FaultPoint::Stall),
        ("hang", FaultPoint::Hang),
        ("thread", FaultPoint::Thread),
        ("monitor", FaultPoint::Monitor),
        ("device", FaultPoint::Device),
        ("shell", FaultPoint::Shell),
        ("disk", FaultPoint::Disk),
        ("retain-open", FaultPoint::RetainOpen),
        ("record-disk", FaultPoint::RecordDisk),
        ("record-sync", FaultPoint::RecordSync),
        ("record", FaultPoint::Record),
        ("record-section", FaultPoint::RecordSection),
        ("page", FaultPoint::Page),
    ];
    /// The interval at which the file is read.
    const LOOK_EVERY: Duration = Duration::from_millis(1);
    /// The duration of a stall of a scan or the disk.
    const STALL: Duration = Duration::from_secs(1);

    /// The point that has a fault when it is next reached; 0: none.
    static ARMED: AtomicU8 = AtomicU8::new(0);

    /// Starts a thread that waits for requested faults. A fault that was requested before is armed
    /// when this returns.
    pub fn listen() {
        let Some(file) = std::env::var_os("RUNGD_FAULTS") else { return };
        look(Path::new(&file));
        let named = thread::Builder::new().name("rungd-faults".into());
        let _ = named.spawn(move || {
            loop {
                look(Path::new(&file));
                thread::sleep(LOOK_EVERY);
            }
        });
    }

    fn look(file: &Path) {
        // A request waits until the one before it has had its fault.
        if ARMED.load(Ordering::Acquire) != 0 {
            return;
        }
        let Ok(text) = std::fs::read_to_string(file) else { return };
        if let Some((_, point)) = POINTS.iter().find(|(name, _)| *name == text.trim()) {
            let _ = std::fs::remove_file(file);
            ARMED.store(*point as u8, Ordering::Release);
        }
    }

    /// Whether a fault was requested for this point. The call ends the request.
    pub fn is_due(point: FaultPoint) -> bool {
        let (own, order) = (point as u8, Ordering::AcqRel);
        ARMED.load(Ordering::Relaxed) == own
            && ARMED.compare_exchange(own, 0, order, Ordering::Acquire).is_ok()
    }

    /// Stalls until the test ends the stall: no fixed time is long enough for a buffer to overflow
    /// on every machine.
    fn stall_while_held() {
        let mut hold = std::env::var_os("RUNGD_FAULTS").unwrap_or_default();
        hold.push(".hold");
        while Path::new(&hold).exists() {
            thread::sleep(LOOK_EVERY);
        }
    }

    /// Causes the fault, if one was requested for this point.
    pub fn point(point: FaultPoint) {
        if !is_due(point) {
            return;
        }
        match point {
            // The caller of `is_due` ends the section.
            FaultPoint::RecordSection => {}
            FaultPoint::Stall | FaultPoint::Disk | FaultPoint::RecordDisk => {
                thread::sleep(STALL);
            }
            FaultPoint::RetainOpen
            | FaultPoint::RecordSync
            | FaultPoint::Record
            | FaultPoint::Hang => {
                stall_while_held();
            }
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
