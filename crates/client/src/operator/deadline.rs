//! The deadline of a request: the moment at which its client stops waiting. After it the controller
//! does not begin the request, so that nothing moves for a person who has gone away.
//!
//! The client's time limit is a time of the client, and the request may lie in the socket while the
//! controller stands still. So the deadline is a moment of CLOCK_BOOTTIME, which all processes of a
//! machine share, and which goes on while the machine is suspended. A client behind a forwarded
//! socket has a different clock: its deadline names the clock, and the controller does not read a
//! deadline of a clock that is not its own.
//!
//! Used by `client`, which makes deadlines, by the daemon, and by `web`, whose pages make theirs
//! from a [`Deadline::now`] that they have received. A client that has closed its connection has
//! given up too: [`has_left`].

use std::fs;
use std::os::fd::AsFd;
use std::sync::OnceLock;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde::{Deserialize, Serialize};

use rungd_runtime::boottime_ns;

/// The moment of a request that may be carried out at any time, ns of this clock.
pub const NEVER_NS: u64 = u64::MAX;

/// The part of its time limit that a client waits longer than its deadline, and the most of it: the
/// answer to what was done in time must arrive in time.
const SLACK_PART: u32 = 5;
pub(super) const SLACK_MAX: Duration = Duration::from_secs(2);

/// A moment of a machine's clock.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deadline {
    /// The name of the clock.
    pub clock: String,
    /// The moment, in ms of this clock.
    pub ms: u64,
}

impl Deadline {
    /// The deadline of a client that waits for this time from now; `None` if the clock has no name.
    pub fn of_wait(wait: Duration) -> Option<Deadline> {
        let clock = clock()?.to_owned();
        let slack = (wait / SLACK_PART).min(SLACK_MAX);
        let until = Duration::from_nanos(now_ns()) + wait.saturating_sub(slack);
        Some(Deadline { clock, ms: until.as_millis() as u64 })
    }

    /// The present moment; `None` if the clock has no name.
    pub fn now() -> Option<Deadline> {
        Some(Deadline { clock: clock()?.to_owned(), ms: now_ns() / 1_000_000 })
    }

    /// The time until the deadline; `None` if it is over, or is a moment of a different clock.
    pub fn left(&self) -> Option<Duration> {
        self.until_ns()?.checked_sub(now_ns()).map(Duration::from_nanos)
    }

    /// The moment in ns; `None` if it is a moment of a different clock.
    pub fn until_ns(&self) -> Option<u64> {
        (clock() == Some(self.clock.as_str())).then(|| self.ms.saturating_mul(1_000_000))
    }
}

/// The clock of deadlines, in ns.
pub fn now_ns() -> u64 {
    boottime_ns()
}

/// Whether the other end of a connection is closed, wholly or for sending. What it has sent may
/// still be in the socket.
pub fn has_left(connection: impl AsFd) -> bool {
    let mut asked = [PollFd::new(&connection, PollFlags::RDHUP)];
    let gone = PollFlags::RDHUP | PollFlags::HUP | PollFlags::ERR;
    let looked = poll(&mut asked, Some(&Timespec { tv_sec: 0, tv_nsec: 0 }));
    looked.is_ok() && asked[0].revents().intersects(gone)
}

/// The name of this process's clock: a hash of the clock's name, the machine's number and the time
/// namespace, since a container may have a clock of its own. (Earlier versions used a clock that
/// has a different name.)
fn clock() -> Option<&'static str> {
    static CLOCK: OnceLock<Option<String>> = OnceLock::new();
    let named = || {
        // A service may not see the second file.
        let places = ["/etc/machine-id", "/proc/sys/kernel/random/boot_id"];
        let text = places.iter().find_map(|place| fs::read_to_string(place).ok());
        let machine = text.map(|text| text.trim().to_owned()).filter(|text| !text.is_empty())?;
        let namespace = fs::read_link("/proc/self/ns/time").unwrap_or_default();
        let text = format!("rungd boottime {machine} {}", namespace.display());
        let hash = hmac_sha256::Hash::hash(text.as_bytes());
        Some(hash[..8].iter().map(|byte| format!("{byte:02x}")).collect())
    };
    CLOCK.get_or_init(named).as_deref()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deadline_clock_counts_suspended_time() {
        use rustix::time::{ClockId, clock_gettime};
        let boottime = || Duration::try_from(clock_gettime(ClockId::Boottime)).expect("a time");
        let (before, now, after) = (boottime(), now_ns(), boottime());
        assert!((before.as_nanos()..=after.as_nanos()).contains(&u128::from(now)));
    }

    #[test]
    fn a_client_that_closed_its_end_has_left_even_with_unread_bytes() {
        use std::io::Write as _;
        let (near, mut far) = std::os::unix::net::UnixStream::pair().expect("a pair");
        far.write_all(b"unread").expect("it is sent");
        assert!(!has_left(&near));
        far.shutdown(std::net::Shutdown::Write).expect("it is closed");
        assert!(has_left(&near));
        drop(far);
        assert!(has_left(&near));
    }

    #[test]
    fn a_deadline_precedes_the_end_of_the_wait_and_is_valid_for_one_clock() {
        let before = now_ns();
        let Some(deadline) = Deadline::of_wait(Duration::from_secs(10)) else { return };
        let until = deadline.until_ns().expect("our own clock");
        assert!(until >= before + 7_999_000_000 && until <= now_ns() + 8_000_000_000);
        let other = Deadline { clock: "0011223344556677".into(), ..deadline };
        assert_eq!(other.until_ns(), None);
    }
}
