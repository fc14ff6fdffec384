//! The condition of a device, for the log and `status`. Shared by its task or keeper and its
//! readers.
//!
//! The log has two lines per outage: one at its start, with the first reason, and one at its end,
//! with the number of failures for each reason. In between, `status` shows the latest reason; the
//! log has a further line only for a reason that names a new key, as a remedy in backquotes: a
//! device may need several keys.
//! Each device has its own limit of lines, so frequent outages of one device do not suppress the
//! lines of others.

use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use rungd_base::locked::locked;
use rungd_runtime::events::LineLimit;
use rungd_runtime::events::limit::Budget;
use rungd_runtime::local::ExchangeCounts;
pub use rungd_runtime::say::say;

/// A handle to a device's condition. Cheap to clone.
#[derive(Clone, Debug)]
pub struct DeviceHealth {
    inner: Arc<Mutex<DeviceCondition>>,
    lines: Arc<Mutex<OutageLines>>,
}

/// The present outage, and the budget of log lines.
#[derive(Debug)]
struct OutageLines {
    started: Instant,
    budget: Budget,
    withheld: u64,
    outage: Option<Outage>,
}

/// The most reasons of an outage that are counted separately.
const REASONS_MAX: usize = 4;

/// The most lines of an outage that name keys.
const ADVICES_MAX: u32 = 4;

/// An outage: from the first exchange that failed to the next good one.
#[derive(Debug)]
struct Outage {
    since: Instant,
    /// Whether the log has the line about its start.
    is_told: bool,
    /// The number of its lines in the log with a remedy.
    advices: u32,
    /// The remedies in these lines.
    advised: Vec<String>,
    failures: u64,
    /// The number of failures for each of the first reasons.
    reasons: Vec<(u64, String)>,
}

/// A device's condition, as `status` and the log show it.
#[derive(Clone, Debug, Default)]
pub struct DeviceCondition {
    /// Its name.
    pub name: String,
    /// Its driver's name.
    pub driver: &'static str,
    /// The peer that it reaches: an address, a port, a chip.
    pub peer: String,
    /// Exchanges that succeeded since the start.
    pub exchanges: u64,
    /// Exchanges and connections that failed.
    pub failures: u64,
    /// The duration of the last good exchange.
    pub took: Duration,
    /// The duration of the slowest good exchange.
    pub took_max: Duration,
    /// Whether a local device is open, so that the scan can exchange; false for all others.
    pub is_open: bool,
    /// The reason why the last exchange failed; `None` after an exchange has succeeded again.
    pub trouble: Option<String>,
    /// Whether the last exchange failed, but read inputs.
    pub is_in_part: bool,
    /// The outputs that the device has accepted last; empty before the first time, and for a local
    /// device, whose outputs the scan thread writes.
    pub accepted: Vec<i32>,
}

/// The outputs of a device that is lost.
pub struct LostOutputs {
    /// The name of the device.
    pub device: String,
    /// The values that it has accepted last; empty if they are not known.
    pub accepted: Vec<i32>,
}

/// The result of an exchange that failed in part.
pub(super) struct InputsRead {
    /// The number of inputs that were read.
    pub read: usize,
    /// The number of all inputs.
    pub all: usize,
}

impl DeviceHealth {
    /// The condition of a device that has not exchanged yet.
    pub fn new(name: &str, driver: &'static str, peer: String) -> DeviceHealth {
        let condition =
            DeviceCondition { name: name.to_owned(), driver, peer, ..DeviceCondition::default() };
        let (started, budget) = (Instant::now(), Budget::new(LineLimit::DEVICE));
        let lines = OutageLines { started, budget, withheld: 0, outage: None };
        DeviceHealth { inner: Arc::new(Mutex::new(condition)), lines: Arc::new(Mutex::new(lines)) }
    }

    /// The present condition.
    pub fn condition(&self) -> DeviceCondition {
        locked(&self.inner).clone()
    }

    /// The outputs, if their state is not known: the last exchange failed, the device has accepted
    /// no outputs yet, or it is stale.
    pub fn lost_outputs(&self, is_stale: bool) -> Option<LostOutputs> {
        let condition = locked(&self.inner);
        let has_taken = condition.is_open || !condition.accepted.is_empty();
        let is_known = has_taken && condition.trouble.is_none() && !is_stale;
        let lost =
            || LostOutputs { device: condition.name.clone(), accepted: condition.accepted.clone() };
        (!is_known).then(lost)
    }

    /// Notes the outputs that the device has accepted.
    pub(super) fn accepted(&self, outputs: &[i32]) {
        let mut condition = locked(&self.inner);
        if condition.accepted != outputs {
            condition.accepted.clear();
            condition.accepted.extend_from_slice(outputs);
        }
    }

    /// Whether an exchange has succeeded since the start, or the device is open, so that the first
    /// scan exchanges.
    pub fn has_exchanged(&self) -> bool {
        let condition = locked(&self.inner);
        condition.exchanges > 0 || condition.is_open
    }

    /// Takes a line about trouble from the budget; `None` if none is left. The returned text, to be
    /// added to the line, names the number of lines that were left out.
    pub fn may_tell(&self) -> Option<String> {
        let mut lines = self.lines();
        let now_ns = lines.now_ns();
        if !lines.budget.draw(now_ns, 1) {
            lines.withheld += 1;
            return None;
        }
        Some(match std::mem::take(&mut lines.withheld) {
            0 => String::new(),
            withheld => format!(" ({withheld} lines about it were left out)"),
        })
    }

    /// Notes that an exchange succeeded.
    pub(super) fn good(&self, took: Duration) {
        {
            let mut condition = locked(&self.inner);
            condition.exchanges += 1;
            condition.took = took;
            condition.took_max = condition.took_max.max(took);
            condition.trouble = None;
        }
        self.tell_well("exchanges again");
    }

    /// Notes that the device is open; `exchanged`: the scan's exchanges so far.
    pub(super) fn open(&self, exchanged: ExchangeCounts) {
        {
            let mut condition = locked(&self.inner);
            (condition.is_open, condition.exchanges) = (true, exchanged.count);
            condition.took = Duration::from_nanos(exchanged.last_ns);
            condition.took_max = Duration::from_nanos(exchanged.slowest_ns);
            condition.trouble = None;
        }
        self.tell_well("is open again");
    }

    /// Notes that the device's task has ended for this reason, so there are no exchanges any more.
    pub fn end(&self, reason: &str) {
        self.bad(reason);
        let condition = self.condition();
        let (device, peer) = (&condition.name, &condition.peer);
        say!(DEVICE_ENDED, %device, %peer, "{device}: {reason}");
    }

    /// Notes that an exchange failed, or that the device could not be reached or opened.
    pub(super) fn trouble(&self, reason: &str) {
        self.bad(reason);
        self.tell_trouble(reason);
    }

    /// Notes that an exchange failed, but read some inputs.
    pub(super) fn trouble_in_part(&self, reason: &str, inputs: InputsRead) {
        let reason = inputs.behind(reason);
        self.bad(&reason);
        locked(&self.inner).is_in_part = true;
        self.tell_trouble(&reason);
    }

    /// Notes that the trouble lasts: an exchange asked nothing of the part that is in trouble.
    pub(super) fn trouble_repeated(&self, reason: &str, inputs: InputsRead) {
        let mut condition = locked(&self.inner);
        let is_in_part = inputs.read > 0;
        let reason = if is_in_part { inputs.behind(reason) } else { reason.to_owned() };
        (condition.is_in_part, condition.trouble) = (is_in_part, Some(reason));
    }

    fn tell_trouble(&self, reason: &str) {
        // If the budget had no line left when the outage began, the line follows as soon as the
        // budget has one.
        let is_to_tell = {
            let mut lines = self.lines();
            let now_ns = lines.now_ns();
            let has_any = lines.budget.has(now_ns, 1);
            let outage = lines.outage.get_or_insert_with(Outage::new);
            outage.note(reason);
            let is_new = !outage.is_told || outage.has_new_advice(reason);
            is_new && (outage.failures == 1 || has_any)
        };
        let Some(withheld) = is_to_tell.then(|| self.may_tell()).flatten() else { return };
        if let Some(outage) = &mut self.lines().outage {
            outage.is_told = true;
            outage.advise(reason);
        }
        let condition = self.condition();
        let (device, peer) = (&condition.name, &condition.peer);
        say!(DEVICE_TROUBLE, %device, %peer, "{device}: {reason} ({peer}){withheld}");
    }

    /// Logs the end of an outage, if there was one.
    fn tell_well(&self, again: &str) {
        let outage = self.lines().outage.take();
        let Some(outage) = outage.filter(|outage| outage.is_told) else { return };
        let (condition, failures) = (self.condition(), outage.failures);
        let (device, peer, lasted) = (&condition.name, &condition.peer, outage.since.elapsed());
        let (lasted_ms, seconds) = (lasted.as_millis() as u64, lasted.as_secs_f64());
        say!(
            DEVICE_WELL,
            %device, %peer, lasted_ms, failures,
            "{device} {again} after {seconds:.1} s of trouble: {}", outage.counts()
        );
    }

    /// Logs at the end of the process that the safe values could not be written within this time.
    pub(super) fn tell_unsafe(&self, tried: Duration) {
        let condition = self.condition();
        let (device, peer, seconds) = (&condition.name, &condition.peer, tried.as_secs());
        let reason = condition.trouble.as_deref().unwrap_or("an exchange did not end");
        say!(
            DEVICE_UNSAFE,
            %device, %peer,
            "{device} did not accept its safe values within {seconds} s: its outputs may be \
             unchanged: {reason} ({peer})"
        );
    }

    fn lines(&self) -> MutexGuard<'_, OutageLines> {
        locked(&self.lines)
    }

    /// Counts a failure.
    fn bad(&self, reason: &str) {
        let mut condition = locked(&self.inner);
        condition.failures += 1;
        (condition.is_open, condition.is_in_part) = (false, false);
        condition.trouble = Some(reason.to_owned());
    }
}

impl InputsRead {
    /// A reason, with the number of inputs that were read behind it.
    fn behind(&self, reason: &str) -> String {
        let InputsRead { read, all } = self;
        match read == all {
            true => reason.to_owned(),
            false => format!("{reason}; {read} of {all} inputs are read"),
        }
    }
}

impl OutageLines {
    /// The time since this value was made; it is the clock of the budget.
    fn now_ns(&self) -> u64 {
        self.started.elapsed().as_nanos() as u64
    }
}

/// The keys to change that a reason names.
fn remedies(reason: &str) -> impl Iterator<Item = &str> {
    reason.split('`').skip(1).step_by(2)
}

impl Outage {
    fn new() -> Outage {
        let since = Instant::now();
        let (advised, reasons) = (Vec::new(), Vec::new());
        Outage { since, is_told: false, advices: 0, advised, failures: 0, reasons }
    }

    /// Whether a reason names a key that no line of this outage has named.
    fn has_new_advice(&self, reason: &str) -> bool {
        let is_new = |remedy: &str| self.advised.iter().all(|known| known != remedy);
        self.advices < ADVICES_MAX && remedies(reason).any(is_new)
    }

    /// Notes that the log has a line with this reason.
    fn advise(&mut self, reason: &str) {
        if self.has_new_advice(reason) {
            self.advices += 1;
            self.advised.extend(remedies(reason).map(str::to_owned));
        }
    }

    fn note(&mut self, reason: &str) {
        self.failures += 1;
        let has_room = self.reasons.len() < REASONS_MAX;
        match self.reasons.iter_mut().find(|(_, known)| known == reason) {
            Some((count, _)) => *count += 1,
            None if has_room => self.reasons.push((1, reason.to_owned())),
            None => {}
        }
    }

    /// `3 failures`; if there were several reasons, followed by the number of failures for each.
    fn counts(&self) -> String {
        let failures = match self.failures {
            1 => "1 failure".to_owned(),
            failures => format!("{failures} failures"),
        };
        if self.reasons.len() < 2 {
            return failures;
        }
        let mut parts: Vec<String> =
            self.reasons.iter().map(|(count, reason)| format!("{reason} ({count})")).collect();
        let counted: u64 = self.reasons.iter().map(|(count, _)| count).sum();
        if self.failures > counted {
            parts.push(format!("others ({})", self.failures - counted));
        }
        format!("{failures}: {}", parts.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINES_MAX: u32 = LineLimit::DEVICE.burst;

    /// Makes `count` outages of one failure each.
    fn outages(health: &DeviceHealth, count: u32) {
        for _ in 0..count {
            health.trouble("no answer in 200 ms");
            health.good(Duration::ZERO);
        }
    }

    fn panel() -> DeviceHealth {
        DeviceHealth::new("panel", "gpio", "/dev/gpiochip0".to_owned())
    }

    #[test]
    fn the_log_lines_of_a_flapping_device_are_limited() {
        let health = panel();
        outages(&health, 50);
        assert_eq!(health.lines().withheld, 30);
        assert_eq!(health.condition().failures, 50);
        assert!(health.lines().outage.is_none() && health.condition().trouble.is_none());
    }

    #[test]
    fn each_remedy_is_logged_once_in_an_outage() {
        let health = panel();
        health.trouble("refused");
        let left = |health: &DeviceHealth| {
            let mut lines = health.lines();
            let now_ns = lines.now_ns();
            (1..=LINES_MAX).rev().find(|count| lines.budget.has(now_ns, *count))
        };
        assert_eq!(left(&health), Some(LINES_MAX - 1));
        for _ in 0..5 {
            health.trouble("no answer: try `pause`");
            health.trouble("refused");
        }
        assert_eq!(left(&health), Some(LINES_MAX - 2));
        // A device may need several keys; the next shows only once the first trouble is over.
        for _ in 0..5 {
            health.trouble("exception 2: set `max-registers`, or try `pause`");
            health.trouble("no answer: try `pause`");
        }
        assert_eq!(left(&health), Some(LINES_MAX - 3));
        for unit in 0..50 {
            health.trouble(&format!("try `unit = {unit}`"));
        }
        assert_eq!(left(&health), Some(LINES_MAX - 1 - ADVICES_MAX), "there is a limit");
    }

    #[test]
    fn repeated_trouble_is_shown_but_not_counted_as_a_failure() {
        let health = panel();
        health.trouble("no answer");
        for _ in 0..5 {
            health.trouble_repeated("no answer", InputsRead { read: 1, all: 3 });
        }
        let condition = health.condition();
        assert_eq!((condition.failures, condition.is_in_part), (1, true));
        assert_eq!(condition.trouble.as_deref(), Some("no answer; 1 of 3 inputs are read"));
        assert_eq!(health.lines().outage.as_ref().unwrap().counts(), "1 failure");
    }

    #[test]
    fn an_outage_writes_one_line_and_its_end_counts_the_failures() {
        let health = panel();
        for reason in ["no answer", "refused", "refused", "no route", "busy", "late", "late"] {
            health.trouble(reason);
        }
        assert_eq!(health.lines().budget.left(), LINES_MAX - 1, "one line");
        assert_eq!(health.condition().trouble.as_deref(), Some("late"), "status has the latest");
        let counts = health.lines().outage.as_ref().unwrap().counts();
        let words = "7 failures: no answer (1); refused (2); no route (1); busy (1); others (2)";
        assert_eq!(counts, words);
        health.good(Duration::ZERO);
        health.trouble("refused");
        assert_eq!(health.lines().budget.left(), LINES_MAX - 2, "the next outage has its own");
        assert_eq!(health.lines().outage.as_ref().unwrap().counts(), "1 failure");
    }

    #[test]
    fn a_suppressed_outage_line_is_written_once_the_limit_permits() {
        let health = panel();
        outages(&health, LINES_MAX);
        let is_told = || health.lines().outage.as_ref().unwrap().is_told;
        health.trouble("refused");
        health.trouble("refused");
        assert!(!is_told() && health.lines().withheld == 1, "counted once");
        let limit = LineLimit { burst: 1, ..LineLimit::DEVICE };
        health.lines().budget = Budget::new(limit);
        health.trouble("refused");
        assert!(is_told() && health.lines().budget.left() == 0);
    }
}
