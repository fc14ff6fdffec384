//! The deadline of a request: the moment at which its client stops waiting. After it the controller
//! does not begin the request, so that nothing moves for a person who has gone away.
//!
//! The client's time limit is a time of the client, and the request may lie in the socket while the
//! controller stands still. So the deadline is a moment of the monotonic clock, which all processes
//! of a machine share. A client behind a forwarded socket has a different clock: its deadline names
//! the clock, and the controller does not read a deadline of a clock that is not its own.

use std::fs;
use std::sync::OnceLock;
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

/// The moment of a request that may be carried out at any time, ns of the monotonic clock.
pub(crate) const NEVER_NS: u64 = u64::MAX;

/// The part of its time limit that a client waits longer than its deadline, and the most of it: the
/// answer to what was done in time must arrive in time.
const SLACK_PART: u32 = 5;
const SLACK_MAX: Duration = Duration::from_secs(2);

/// A moment of a machine's monotonic clock.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Deadline {
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

    /// The moment in ns; `None` if it is a moment of a different clock.
    pub fn until_ns(&self) -> Option<u64> {
        (clock() == Some(self.clock.as_str())).then(|| self.ms.saturating_mul(1_000_000))
    }
}

/// The monotonic clock, in ns.
pub(crate) fn now_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    Duration::new(now.tv_sec.unsigned_abs(), u32::try_from(now.tv_nsec).unwrap_or(0)).as_nanos()
        as u64
}

/// The name of this process's monotonic clock: a hash of the machine's number and of the time
/// namespace, since a container may have a clock of its own.
fn clock() -> Option<&'static str> {
    static CLOCK: OnceLock<Option<String>> = OnceLock::new();
    let named = || {
        // A service may not see the second file.
        let places = ["/etc/machine-id", "/proc/sys/kernel/random/boot_id"];
        let text = places.iter().find_map(|place| fs::read_to_string(place).ok());
        let machine = text.map(|text| text.trim().to_owned()).filter(|text| !text.is_empty())?;
        let namespace = fs::read_link("/proc/self/ns/time").unwrap_or_default();
        let text = format!("rungd {machine} {}", namespace.display());
        let hash = hmac_sha256::Hash::hash(text.as_bytes());
        Some(hash[..8].iter().map(|byte| format!("{byte:02x}")).collect())
    };
    CLOCK.get_or_init(named).as_deref()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deadline_is_before_the_end_of_the_wait_and_belongs_to_one_clock() {
        let before = now_ns();
        let Some(deadline) = Deadline::of_wait(Duration::from_secs(10)) else { return };
        let until = deadline.until_ns().expect("our own clock");
        assert!(until >= before + 7_999_000_000 && until <= now_ns() + 8_000_000_000);
        let other = Deadline { clock: "0011223344556677".into(), ..deadline };
        assert_eq!(other.until_ns(), None);
    }
}
