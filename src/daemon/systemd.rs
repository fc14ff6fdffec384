//! What systemd is told, and when: ready, alive, status, stopping.
//!
//! [`Notices`] decides from numbers; `shell` sends. Alive means evidence: complete scans, or ticks
//! in STOP and FAULT, that were seen since the last time. A scan that never ends gives none, and
//! systemd ends the process.

use std::time::Duration;

use crate::runtime::exchange::{Mode, Snapshot};

/// What is to be sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Notice {
    Ready,
    Watchdog,
    Status(String),
}

/// What was sent so far.
pub(super) struct Notices {
    /// systemd's own limit (`WatchdogSec=`), if it has one.
    watchdog: Option<Duration>,
    ready: bool,
    pulses: u64,
    fed: Duration,
    told: Option<Duration>,
    status: String,
}

const STATUS_EVERY: Duration = Duration::from_secs(1);

impl Notices {
    pub fn new(watchdog: Option<Duration>) -> Notices {
        let (fed, status) = (Duration::ZERO, String::new());
        Notices { watchdog, ready: false, pulses: 0, fed, told: None, status }
    }

    /// What is due. `now` counts from any moment; `pulses` are complete scans and ticks so far.
    pub fn due(&mut self, now: Duration, pulses: u64, latest: &Snapshot) -> Vec<Notice> {
        let mut due = Vec::new();
        if !self.ready && latest.scans > 0 {
            self.ready = true;
            due.push(Notice::Ready);
        }
        let often = self.watchdog.is_some_and(|limit| now >= self.fed + limit / 4);
        if often && pulses > self.pulses {
            (self.pulses, self.fed) = (pulses, now);
            due.push(Notice::Watchdog);
        }
        if self.told.is_none_or(|told| now >= told + STATUS_EVERY) {
            let status = status(latest);
            if status != self.status {
                (self.told, self.status) = (Some(now), status.clone());
                due.push(Notice::Status(status));
            }
        }
        due
    }
}

fn status(latest: &Snapshot) -> String {
    let scans = latest.scans;
    match latest.mode {
        Mode::Run => format!("RUN, {scans} scans"),
        Mode::Stop(reason) => format!("STOP after {scans} scans: {reason}"),
        Mode::Fault(reason) => format!("FAULT after {scans} scans: {reason}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::exchange::{FaultReason, StopReason};

    fn snapshot(scans: u64, mode: Mode) -> Snapshot {
        let (bits, words, outputs) = (Box::default(), Box::default(), Box::default());
        Snapshot { scans, now_ns: 0, mode, bits, words, outputs, tickets_done: 0 }
    }

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn ready_comes_once_behind_the_first_complete_scan() {
        let mut notices = Notices::new(None);
        let starting = snapshot(0, Mode::Stop(StopReason::NotStarted));
        assert!(!notices.due(ms(0), 0, &starting).contains(&Notice::Ready));
        let first = notices.due(ms(1), 1, &snapshot(1, Mode::Run));
        assert_eq!(first, [Notice::Ready]);
        assert_eq!(notices.due(ms(2), 2, &snapshot(2, Mode::Run)), []);
    }

    #[test]
    fn a_fault_in_the_first_scan_is_never_ready() {
        let mut notices = Notices::new(None);
        let fault = snapshot(0, Mode::Fault(FaultReason::EnginePanic));
        assert!(!notices.due(ms(5), 9, &fault).contains(&Notice::Ready));
    }

    #[test]
    fn the_watchdog_is_fed_with_evidence_only() {
        let mut notices = Notices::new(Some(ms(400)));
        let run = snapshot(1, Mode::Run);
        let mut fed = |at, pulses| notices.due(ms(at), pulses, &run).contains(&Notice::Watchdog);
        assert!(!fed(50, 5), "too early");
        assert!(fed(100, 10));
        assert!(!fed(150, 15));
        assert!(fed(200, 20));
        assert!(!fed(300, 20) && !fed(900, 20), "nothing was seen since");
        assert!(fed(1000, 21));
    }

    #[test]
    fn the_status_changes_once_a_second_at_most() {
        let mut notices = Notices::new(None);
        let mut told = |at, scans| {
            let due = notices.due(ms(at), 0, &snapshot(scans, Mode::Run));
            due.into_iter().find_map(|n| if let Notice::Status(s) = n { Some(s) } else { None })
        };
        assert_eq!(told(10, 1).as_deref(), Some("RUN, 1 scans"));
        assert_eq!(told(500, 50), None);
        assert_eq!(told(1010, 101).as_deref(), Some("RUN, 101 scans"));
        assert_eq!(told(3000, 101), None, "nothing new");
    }
}
