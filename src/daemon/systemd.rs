//! Sends notices to systemd: ready, alive, status, stopping.
//!
//! [`DueNotices`] decides which notices are due. [`Systemd`] sends them and never waits: a notice
//! that cannot be sent is due again at the next look. A watchdog notice needs evidence: the number
//! of complete scans (or of ticks in STOP and FAULT) must have grown since the last watchdog
//! notice. During a scan that never ends this number does not grow, and systemd ends the process.

use std::ffi::OsStr;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::Duration;

use rungd_base::duration_text::duration_text;
use rungd_runtime::exchange::{Mode, Snapshot, StopReason};

/// A notice to systemd.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum SystemdNotice {
    Stopping,
    Ready,
    /// The start continues, and needs at most this much more time.
    Starting {
        extend_us: u64,
    },
    /// A reload began at this moment (CLOCK_MONOTONIC).
    Reloading {
        since_us: u64,
    },
    Watchdog,
    Status(String),
}

/// The socket of systemd; `None` if the process runs without systemd.
pub(super) struct Systemd(Option<(UnixDatagram, SocketAddr)>);

impl Systemd {
    /// The socket that `NOTIFY_SOCKET` names.
    pub fn of_environment() -> Systemd {
        let Some(name) = std::env::var_os("NOTIFY_SOCKET") else { return Systemd(None) };
        Systemd(address(&name).and_then(|address| {
            let socket = UnixDatagram::unbound().ok()?;
            socket.set_nonblocking(true).ok()?;
            Some((socket, address))
        }))
    }

    /// Sends a notice; false if the socket did not accept it. Never waits.
    pub fn send(&self, notice: &SystemdNotice) -> bool {
        let Some((socket, address)) = &self.0 else { return true };
        let text = match notice {
            SystemdNotice::Stopping => "STOPPING=1\n".to_owned(),
            SystemdNotice::Ready => "READY=1\n".to_owned(),
            SystemdNotice::Starting { extend_us } => {
                format!("EXTEND_TIMEOUT_USEC={extend_us}\nWATCHDOG=1\n")
            }
            // systemd demands both lines in one datagram.
            SystemdNotice::Reloading { since_us } => {
                format!("RELOADING=1\nMONOTONIC_USEC={since_us}\n")
            }
            SystemdNotice::Watchdog => "WATCHDOG=1\n".to_owned(),
            SystemdNotice::Status(status) => format!("STATUS={status}\n"),
        };
        socket.send_to_addr(text.as_bytes(), address).is_ok()
    }
}

impl Systemd {
    /// While this future is polled, tells systemd repeatedly that the start continues. So neither
    /// systemd's limit for a start nor its watchdog ends the process during a wait that has its own
    /// limit.
    pub async fn starting(&self) {
        loop {
            let extend_us = START_STEP.as_micros() as u64 * 10;
            let _ = self.send(&SystemdNotice::Starting { extend_us });
            tokio::time::sleep(START_STEP).await;
        }
    }
}

/// The time between two notices of a start; each requests ten times this time.
const START_STEP: Duration = Duration::from_millis(500);

/// The address of a path, or of an abstract name after `@`.
fn address(name: &OsStr) -> Option<SocketAddr> {
    match name.as_bytes() {
        [b'@', rest @ ..] => SocketAddr::from_abstract_name(rest).ok(),
        _ => SocketAddr::from_pathname(name).ok(),
    }
}

/// A sentence if systemd would end the process before an overlong scan becomes a fault.
///
/// systemd counts from the last notice. When a scan begins, that notice can be as old as a quarter
/// of systemd's limit.
pub(super) fn fault_too_late(watchdog_ns: u64, limit: Option<Duration>) -> Option<String> {
    let limit = limit?;
    let most = limit / 4 * 3;
    (Duration::from_nanos(watchdog_ns) > most).then(|| {
        format!(
            "`[scan] watchdog` is {}, and systemd ends rungd after {} without a scan \
             (`WatchdogSec=`): a scan of that length ends rungd before it is a fault, and no \
             output is made safe; lower `[scan] watchdog` to at most {}, or raise `WatchdogSec=`",
            duration_text(watchdog_ns),
            duration_text(limit.as_nanos() as u64),
            duration_text(most.as_nanos() as u64),
        )
    })
}

/// Decides which notices are due, based on the notices sent so far.
pub(super) struct DueNotices {
    /// systemd's own limit (`WatchdogSec=`), if it has one.
    watchdog: Option<Duration>,
    /// A stop was requested, and systemd has not been notified yet.
    stopping: bool,
    ready: bool,
    pulses: u64,
    fed: Duration,
    told: Option<Duration>,
    status: String,
}

const STATUS_EVERY: Duration = Duration::from_secs(1);

impl DueNotices {
    pub fn new(watchdog: Option<Duration>) -> DueNotices {
        let (fed, status) = (Duration::ZERO, String::new());
        DueNotices { watchdog, stopping: false, ready: false, pulses: 0, fed, told: None, status }
    }

    /// Whether systemd knows that the start is over.
    pub fn has_told_ready(&self) -> bool {
        self.ready
    }

    /// Notes that the controller begins to stop.
    pub fn stop(&mut self) {
        self.stopping = true;
    }

    /// Sends the notices that are due. `now` counts from any fixed moment; `pulses` is the number
    /// of complete scans and ticks so far; `send` returns whether the notice was sent.
    pub fn send_due(
        &mut self,
        now: Duration,
        pulses: u64,
        latest: &Snapshot,
        mut send: impl FnMut(&SystemdNotice) -> bool,
    ) {
        if self.stopping && send(&SystemdNotice::Stopping) {
            self.stopping = false;
        }
        if !self.ready && is_ready(latest) {
            self.ready = send(&SystemdNotice::Ready);
        }
        let often = self.watchdog.is_some_and(|limit| now >= self.fed + limit / 4);
        if often && pulses > self.pulses && send(&SystemdNotice::Watchdog) {
            (self.pulses, self.fed) = (pulses, now);
        }
        // In the first second of a start no status is sent: otherwise the status of the first scan
        // would be a second late.
        let starts = latest.mode == Mode::Stop(StopReason::NotStarted) && now < STATUS_EVERY;
        if !starts && self.told.is_none_or(|told| now >= told + STATUS_EVERY) {
            let status = status(latest);
            if status != self.status && send(&SystemdNotice::Status(status.clone())) {
                (self.told, self.status) = (Some(now), status);
            }
        }
    }
}

/// Whether a scan is complete, or the start was meant to end in STOP.
fn is_ready(latest: &Snapshot) -> bool {
    latest.scans > 0 || matches!(latest.mode, Mode::Stop(reason) if reason.is_meant())
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
    use rungd_runtime::exchange::FaultReason;

    fn snapshot(scans: u64, mode: Mode) -> Snapshot {
        let (bits, words, outputs) = (Box::default(), Box::default(), Box::default());
        let forces = Default::default();
        let (now_ns, since_ns, tickets_done) = (0, 0, 0);
        Snapshot {
            generation: 0,
            safe: [].into(),
            scans,
            now_ns,
            mode,
            since_ns,
            ending: false,
            bits,
            words,
            outputs,
            tickets_done,
            forces,
        }
    }

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    impl DueNotices {
        fn due(&mut self, now: Duration, pulses: u64, latest: &Snapshot) -> Vec<SystemdNotice> {
            let mut due = Vec::new();
            self.send_due(now, pulses, latest, |notice| {
                due.push(notice.clone());
                true
            });
            due
        }
    }

    #[test]
    fn unsent_notifications_are_sent_again() {
        let mut notices = DueNotices::new(Some(ms(400)));
        let run = snapshot(1, Mode::Run);
        notices.send_due(ms(100), 10, &run, |_| false);
        notices.stop();
        notices.send_due(ms(110), 10, &run, |_| false);
        let status = SystemdNotice::Status("RUN, 1 scans".to_owned());
        let all = [SystemdNotice::Stopping, SystemdNotice::Ready, SystemdNotice::Watchdog, status];
        assert_eq!(notices.due(ms(120), 10, &run), all);
        assert_eq!(notices.due(ms(140), 11, &run), []);
    }

    #[test]
    fn an_unread_socket_never_blocks_the_sender() {
        let address = address(OsStr::new(&format!("@rungd-test-{}", std::process::id()))).unwrap();
        let _reader = UnixDatagram::bind_addr(&address).unwrap();
        let socket = UnixDatagram::unbound().unwrap();
        socket.set_nonblocking(true).unwrap();
        let systemd = Systemd(Some((socket, address)));
        let sent = (0..100_000).take_while(|_| systemd.send(&SystemdNotice::Watchdog)).count();
        assert!((1..100_000).contains(&sent), "{sent}");
    }

    #[test]
    fn ready_is_sent_once_after_the_first_complete_scan() {
        let mut notices = DueNotices::new(None);
        let starting = snapshot(0, Mode::Stop(StopReason::NotStarted));
        assert!(!notices.due(ms(0), 0, &starting).contains(&SystemdNotice::Ready));
        let first = notices.due(ms(1), 1, &snapshot(1, Mode::Run));
        assert_eq!(first, [SystemdNotice::Ready, SystemdNotice::Status("RUN, 1 scans".to_owned())]);
        assert_eq!(notices.due(ms(2), 2, &snapshot(2, Mode::Run)), []);
    }

    #[test]
    fn an_intended_start_in_stop_is_reported_as_ready() {
        for reason in [StopReason::CommandLine, StopReason::RestartGuard] {
            let mut notices = DueNotices::new(None);
            assert_eq!(
                notices.due(ms(0), 0, &snapshot(0, Mode::Stop(reason)))[0],
                SystemdNotice::Ready
            );
        }
    }

    #[test]
    fn a_long_start_is_reported_in_the_status() {
        let mut notices = DueNotices::new(None);
        let starting = snapshot(0, Mode::Stop(StopReason::NotStarted));
        assert_eq!(notices.due(ms(20), 0, &starting), []);
        let told = notices.due(ms(1000), 0, &starting);
        let status = "STOP after 0 scans: the first scan is still to come".to_owned();
        assert_eq!(told, [SystemdNotice::Status(status)]);
    }

    #[test]
    fn a_fault_in_the_first_scan_is_not_reported_as_ready() {
        let mut notices = DueNotices::new(None);
        let fault = snapshot(0, Mode::Fault(FaultReason::EnginePanic));
        assert!(!notices.due(ms(5), 9, &fault).contains(&SystemdNotice::Ready));
    }

    #[test]
    fn the_watchdog_is_fed_only_after_progress_of_the_scan_thread() {
        let mut notices = DueNotices::new(Some(ms(400)));
        let run = snapshot(1, Mode::Run);
        let mut fed =
            |at, pulses| notices.due(ms(at), pulses, &run).contains(&SystemdNotice::Watchdog);
        assert!(!fed(50, 5), "too early");
        assert!(fed(100, 10));
        assert!(!fed(150, 15));
        assert!(fed(200, 20));
        assert!(!fed(300, 20) && !fed(900, 20), "nothing was seen since");
        assert!(fed(1000, 21));
    }

    #[test]
    fn a_scan_watchdog_longer_than_that_of_systemd_is_reported() {
        let late = |watchdog_ms: u64, limit| fault_too_late(watchdog_ms * 1_000_000, limit);
        assert_eq!(late(60_000, None), None);
        assert_eq!(late(7_500, Some(ms(10_000))), None);
        let said = late(7_510, Some(ms(10_000))).expect("too late");
        assert!(said.contains("is 7.5s, and systemd ends rungd after 10s"), "{said}");
        assert!(said.contains("at most 7.5s, or raise"), "{said}");
    }

    #[test]
    fn the_status_changes_at_most_once_a_second() {
        let mut notices = DueNotices::new(None);
        let mut told = |at, scans| {
            let due = notices.due(ms(at), 0, &snapshot(scans, Mode::Run));
            due.into_iter()
                .find_map(|n| if let SystemdNotice::Status(s) = n { Some(s) } else { None })
        };
        assert_eq!(told(10, 1).as_deref(), Some("RUN, 1 scans"));
        assert_eq!(told(500, 50), None);
        assert_eq!(told(1010, 101).as_deref(), Some("RUN, 101 scans"));
        assert_eq!(told(3000, 101), None, "nothing new");
    }
}
