//! The log of a running controller: records from the scan thread, told to `tracing`.
//!
//! It listens on the monitor thread and knows the time from its arguments. It repeats the reason
//! of a STOP or FAULT every minute for as long as it lasts, and it thins out what changes too
//! often (`allowance`): a bit that toggles every scan may not bury the line that matters. Nothing
//! here blocks; standard error is `log_queue`'s business.

use tracing::{debug, error, info, warn};

use super::allowance::{Alarms, Allowance};
use super::narration::{Narration, reason, remedy, span, us};
use crate::runtime::exchange::{FaultReason, Mode, Snapshot};
use crate::runtime::{Observer, Record, Statistics, What};

/// What the log's lines say of the controller, and how often.
#[derive(Clone, Debug)]
pub(super) struct Facts {
    pub period_ns: u64,
    pub watchdog_ns: u64,
    /// From repetition to repetition of why the controller does not run.
    pub repeat_ns: u64,
    /// How long the ladder is.
    pub rungs: usize,
}

/// Tells what it hears to the log.
pub(super) struct LogWriter {
    narration: Narration,
    facts: Facts,
    standing: Option<Standing>,
    /// The monitor has called the scan under way a fault, and that was told.
    tripped: bool,
    changes: Allowance,
    alarms: Alarms,
}

/// What to do about a STOP.
const AGAIN: &str = "`rungd mode run`, or a restart of rungd, runs it again";

/// A STOP or FAULT that lasts.
struct Standing {
    /// The mode's.
    name: &'static str,
    since_ns: u64,
    told_ns: u64,
}

impl LogWriter {
    pub fn new(narration: Narration, facts: Facts) -> Self {
        let changes = Allowance::new("changes of blocks and tags");
        let (standing, alarms) = (None, Alarms::new());
        LogWriter { narration, facts, standing, tripped: false, changes, alarms }
    }

    fn mode(&mut self, mode: Mode, scan: u64) {
        let why = reason(mode);
        match mode {
            Mode::Run => info!(scan, "RUN: scanning every {}", span(self.facts.period_ns)),
            Mode::Stop(reason) if reason.waits_for_operator() => {
                warn!(scan, "STOP: {why}; outputs are at their safe values; {AGAIN}");
            }
            Mode::Stop(_) => info!(scan, "STOP: {why}; outputs are at their safe values"),
            // The scan that did not end did in the end: nothing new is wrong.
            Mode::Fault(FaultReason::ScanTooLong { scan_us }) if self.tripped => {
                info!(scan, scan_us, "the scan of this fault has ended; it is not complete");
            }
            // Likewise the scan that did not come.
            Mode::Fault(FaultReason::ScanNeverBegins) if self.tripped => {
                info!(scan, "the scan thread of this fault has come back; it does not scan");
            }
            Mode::Fault(fault) => self.fault(fault, Some(scan)),
        }
    }

    fn fault(&self, fault: FaultReason, scan: Option<u64>) {
        let watchdog = span(self.facts.watchdog_ns);
        error!(
            scan,
            %watchdog,
            "FAULT: {fault}; outputs are at their safe values; {}",
            remedy(fault, self.facts.rungs, self.facts.period_ns, self.facts.watchdog_ns)
        );
    }

    fn bit(&mut self, watch: u32, on: bool, after_ns: u64, record: &Record) {
        let Some(news) = self.narration.bit(watch) else { return };
        let (tag, scan, was) = (&news.tag, record.scan, span(after_ns));
        match (&news.alarm, on) {
            (Some(_), _) if !self.alarms.change(watch, on, scan, record.at_ns) => {}
            (Some(text), true) => warn!(%tag, scan, "alarm ON: {text}"),
            (Some(text), false) => {
                let lasted_ms = after_ns / 1_000_000;
                info!(%tag, scan, lasted_ms, "alarm OFF after {was}: {text}");
            }
            (None, _) if !self.changes.take(record.at_ns) => {}
            (None, true) => info!(%tag, scan, "{tag} is ON"),
            (None, false) => info!(%tag, scan, "{tag} is OFF"),
        }
    }

    fn overruns(&self, count: u32, skipped: u64, (scan_ns, late_ns): (u64, u64), scan: u64) {
        let (period, scan_us_max, late_us_max) =
            (span(self.facts.period_ns), us(scan_ns), us(late_ns));
        // A long scan may be the ladder, or a machine that was busy elsewhere: the mean tells.
        let cause = if scan_ns >= self.facts.period_ns {
            "a scan took longer than the period"
        } else {
            "the machine woke the scan thread too late"
        };
        let what = match count {
            1 => "overrun: a scan was".to_owned(),
            _ => format!("overruns: {count} more scans were"),
        };
        warn!(
            scan,
            skipped,
            scan_us_max,
            late_us_max,
            %period,
            "{what} not over at the next grid point: {cause}"
        );
    }

    /// Repeats, every minute, why the controller does not run.
    fn stand(&mut self, mode: Mode, now_ns: u64) {
        let lasting = match mode {
            Mode::Fault(_) => Some(mode),
            Mode::Stop(reason) if reason.waits_for_operator() => Some(mode),
            _ => None,
        };
        let Some(mode) = lasting else {
            self.standing = None;
            return;
        };
        let standing = match &mut self.standing {
            Some(standing) if standing.name == mode.name() => standing,
            other => {
                let name = mode.name();
                *other = Some(Standing { name, since_ns: now_ns, told_ns: now_ns });
                return;
            }
        };
        if now_ns < standing.told_ns + self.facts.repeat_ns {
            return;
        }
        standing.told_ns = now_ns;
        let (lasts, why) = (span(now_ns - standing.since_ns), reason(mode));
        match mode {
            Mode::Fault(_) => error!("still in FAULT after {lasts}: {why}; restart rungd"),
            _ => warn!("still in STOP after {lasts}: {why}; {AGAIN}"),
        }
    }
}

impl Observer for LogWriter {
    fn record(&mut self, record: &Record) {
        let scan = record.scan;
        match record.what {
            What::Mode(mode) => self.mode(mode, scan),
            What::Block(event) => {
                let (text, news) = self.narration.block_event(event);
                // What there is too much of to be news is there for who asks for details.
                if news && self.changes.take(record.at_ns) {
                    info!(scan, "{text}");
                } else {
                    debug!(scan, "{text}");
                }
            }
            What::EventsLost(events) => {
                warn!(scan, events, "more happened to blocks in this scan than can be told");
            }
            What::Bit { watch, on, after_ns } => self.bit(watch, on, after_ns, record),
            What::Word { watch, from, to } => {
                let tag = self.narration.word(watch);
                if self.changes.take(record.at_ns) {
                    info!(%tag, scan, from, to, "{tag} is {to}, was {from}");
                }
            }
            What::Overruns { count, skipped, scan_ns_max, late_ns_max } => {
                self.overruns(count, skipped, (scan_ns_max, late_ns_max), scan);
            }
        }
    }

    fn statistics(&mut self, statistics: &Statistics) {
        tell_statistics(statistics);
    }

    fn dropped(&mut self, records: u64) {
        warn!(records, "records of the scan thread were dropped: more happened than can be told");
    }

    fn tripped(&mut self, fault: FaultReason, _now_ns: u64) {
        self.tripped = true;
        self.fault(fault, None);
    }

    fn turn(&mut self, latest: &Snapshot, now_ns: u64) {
        self.stand(latest.mode, now_ns);
        for (watch, scan) in self.alarms.belated(now_ns) {
            let Some(news) = self.narration.bit(watch) else { continue };
            let (tag, text) = (&news.tag, news.alarm.as_deref().unwrap_or_default());
            warn!(%tag, scan, "alarm ON: {text}");
        }
        tell_withheld([self.changes.due(now_ns), self.alarms.due(now_ns)]);
    }

    fn ended(&mut self, now_ns: u64) {
        tell_withheld([self.changes.rest(now_ns), self.alarms.rest(now_ns)]);
    }
}

fn tell_withheld(withheld: [Option<(u64, String)>; 2]) {
    for (lines, text) in withheld.into_iter().flatten() {
        warn!(lines, "{text}");
    }
}

/// The line of scan statistics, of the whole run or of what passed since the last one.
pub(super) fn tell_statistics(statistics: &Statistics) {
    let Statistics { scans, execution: scan, lateness: late, overruns, skipped, .. } = *statistics;
    let over = span(statistics.over_ns);
    let of = if statistics.whole { "of the whole run," } else { "of the last" };
    info!(
        scans,
        overruns,
        skipped,
        over_us = us(statistics.over_ns),
        scan_us_last = us(scan.last_ns),
        scan_us_min = us(scan.min_ns),
        scan_us_mean = us(scan.mean_ns),
        scan_us_p50 = us(scan.p50_ns),
        scan_us_p99 = us(scan.p99_ns),
        scan_us_p999 = us(scan.p999_ns),
        scan_us_max = us(scan.max_ns),
        late_us_last = us(late.last_ns),
        late_us_min = us(late.min_ns),
        late_us_mean = us(late.mean_ns),
        late_us_p50 = us(late.p50_ns),
        late_us_p99 = us(late.p99_ns),
        late_us_p999 = us(late.p999_ns),
        late_us_max = us(late.max_ns),
        "scan statistics {of} {over}"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::daemon::allowance::SECOND_NS;
    use crate::runtime::exchange::StopReason;

    const MS_NS: u64 = 1_000_000;

    fn writer() -> LogWriter {
        let program = crate::resolve::program::Program::default();
        let (_, symbols) = crate::lower::lower(&program);
        let (narration, _) = Narration::new(&program, &symbols);
        let (period_ns, watchdog_ns) = (10 * MS_NS, 200 * MS_NS);
        let facts = Facts { period_ns, watchdog_ns, repeat_ns: 60 * SECOND_NS, rungs: 3 };
        LogWriter::new(narration, facts)
    }

    #[test]
    fn the_reason_is_repeated_every_minute_for_as_long_as_it_lasts() {
        let mut writer = writer();
        let fault = Mode::Fault(FaultReason::EnginePanic);
        let told: Vec<u64> = (0..200)
            .filter(|second| {
                let before = writer.standing.as_ref().map(|standing| standing.told_ns);
                writer.stand(fault, second * SECOND_NS);
                before.is_some() && before != writer.standing.as_ref().map(|s| s.told_ns)
            })
            .collect();
        assert_eq!(told, [60, 120, 180]);
        writer.stand(Mode::Run, 200 * SECOND_NS);
        assert!(writer.standing.is_none());
        writer.stand(Mode::Stop(StopReason::Signal), 300 * SECOND_NS);
        assert!(writer.standing.is_none(), "the process is about to end");
    }
}
