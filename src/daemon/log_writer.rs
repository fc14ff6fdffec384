//! The log of a running controller: records from the scan thread, told to `tracing`.
//!
//! It listens on the monitor thread and knows the time from its arguments. It repeats the reason
//! of a STOP or FAULT every minute for as long as it lasts, and it thins out what changes too
//! often: a bit that toggles every scan may not bury the line that matters. Nothing here blocks;
//! standard error is `log_queue`'s business.

use tracing::{debug, error, info, warn};

use super::narration::{Narration, reason, remedy, span, us};
use crate::runtime::exchange::{FaultReason, Mode, Snapshot, StopReason};
use crate::runtime::{Observer, Record, Statistics, What};

const SECOND_NS: u64 = 1_000_000_000;
/// So many lines of one kind at once, and so many a second in the long run.
const BURST: u32 = 200;
const LINES_PER_SECOND: u64 = 20;

/// Tells what it hears to the log.
pub(super) struct LogWriter {
    narration: Narration,
    period_ns: u64,
    watchdog_ns: u64,
    /// From repetition to repetition of why the controller does not run.
    repeat_ns: u64,
    standing: Option<Standing>,
    changes: Allowance,
    alarms: Allowance,
}

/// A STOP or FAULT that lasts.
struct Standing {
    mode: Mode,
    since_ns: u64,
    told_ns: u64,
}

/// What keeps a chatter of lines within bounds.
struct Allowance {
    what: &'static str,
    left: u32,
    filled_ns: u64,
    withheld: u64,
    withheld_since_ns: u64,
}

impl LogWriter {
    pub fn new(narration: Narration, period_ns: u64, watchdog_ns: u64, repeat_ns: u64) -> Self {
        let allowance =
            |what| Allowance { what, left: BURST, filled_ns: 0, withheld: 0, withheld_since_ns: 0 };
        LogWriter {
            narration,
            period_ns,
            watchdog_ns,
            repeat_ns,
            standing: None,
            changes: allowance("changes of blocks and tags"),
            alarms: allowance("alarms"),
        }
    }

    fn mode(&mut self, mode: Mode, scan: u64) {
        let why = reason(mode);
        match mode {
            Mode::Run => info!(scan, "RUN: scanning every {}", span(self.period_ns)),
            Mode::Stop(StopReason::Instruction) => warn!(
                scan,
                "STOP: {why}; outputs are at their safe values; restart rungd to run again"
            ),
            Mode::Stop(_) => info!(scan, "STOP: {why}; outputs are at their safe values"),
            Mode::Fault(fault) => self.fault(fault, Some(scan)),
        }
    }

    fn fault(&self, fault: FaultReason, scan: Option<u64>) {
        let watchdog = span(self.watchdog_ns);
        error!(
            scan,
            %watchdog,
            "FAULT: {fault}; outputs are at their safe values; {}",
            remedy(fault)
        );
    }

    fn bit(&mut self, watch: u32, on: bool, after_ns: u64, record: &Record) {
        let Some(news) = self.narration.bit(watch) else { return };
        let (tag, scan, was) = (&news.tag, record.scan, span(after_ns));
        match (&news.alarm, on) {
            (Some(_), _) if !self.alarms.take(record.at_ns) => {}
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
        let (period, scan_us_max, late_us_max) = (span(self.period_ns), us(scan_ns), us(late_ns));
        // A long scan may be the ladder, or a machine that was busy elsewhere: the mean tells.
        let cause = if scan_ns >= self.period_ns {
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
            Mode::Stop(StopReason::Instruction) | Mode::Fault(_) => Some(mode),
            _ => None,
        };
        let Some(mode) = lasting else {
            self.standing = None;
            return;
        };
        let name = mode.name();
        let standing = match &mut self.standing {
            Some(standing) if standing.mode.name() == name => standing,
            other => {
                *other = Some(Standing { mode, since_ns: now_ns, told_ns: now_ns });
                return;
            }
        };
        if now_ns < standing.told_ns + self.repeat_ns {
            return;
        }
        standing.told_ns = now_ns;
        let (lasts, why) = (span(now_ns - standing.since_ns), reason(standing.mode));
        match mode {
            Mode::Fault(_) => error!("still in FAULT after {lasts}: {why}; restart rungd"),
            _ => warn!("still in STOP after {lasts}: {why}; restart rungd to run again"),
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
        self.fault(fault, None);
    }

    fn turn(&mut self, latest: &Snapshot, now_ns: u64) {
        self.stand(latest.mode, now_ns);
        self.changes.tell_withheld(now_ns);
        self.alarms.tell_withheld(now_ns);
    }
}

/// The line of scan statistics; the one about the whole run has more percentiles.
pub(super) fn tell_statistics(statistics: &Statistics) {
    let Statistics { scans, execution: scan, lateness: late, overruns, skipped, .. } = *statistics;
    let over = span(statistics.over_ns);
    if statistics.whole {
        info!(
            scans,
            overruns,
            skipped,
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
            "scan statistics of the whole run, {over}"
        );
    } else {
        info!(
            scans,
            overruns,
            skipped,
            scan_us_last = us(scan.last_ns),
            scan_us_min = us(scan.min_ns),
            scan_us_mean = us(scan.mean_ns),
            scan_us_p999 = us(scan.p999_ns),
            scan_us_max = us(scan.max_ns),
            late_us_last = us(late.last_ns),
            late_us_min = us(late.min_ns),
            late_us_mean = us(late.mean_ns),
            late_us_p999 = us(late.p999_ns),
            late_us_max = us(late.max_ns),
            "scan statistics of the last {over}"
        );
    }
}

impl Allowance {
    /// Whether one more line may go out.
    fn take(&mut self, now_ns: u64) -> bool {
        let earned = now_ns.saturating_sub(self.filled_ns) * LINES_PER_SECOND / SECOND_NS;
        if earned > 0 {
            self.left = BURST.min(self.left.saturating_add(u32::try_from(earned).unwrap_or(BURST)));
            self.filled_ns = now_ns;
        }
        if self.left > 0 {
            self.left -= 1;
            return true;
        }
        if self.withheld == 0 {
            self.withheld_since_ns = now_ns;
        }
        self.withheld += 1;
        false
    }

    fn tell_withheld(&mut self, now_ns: u64) {
        let waited_ns = now_ns.saturating_sub(self.withheld_since_ns);
        if self.withheld > 0 && waited_ns >= 10 * SECOND_NS {
            let (lines, what) = (self.withheld, self.what);
            warn!(
                lines,
                "{what} come too often: so many lines of the last {} were left out",
                span(waited_ns)
            );
            self.withheld = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS_NS: u64 = 1_000_000;

    fn writer() -> LogWriter {
        let program = crate::resolve::program::Program::default();
        let (_, symbols) = crate::lower::lower(&program);
        let (narration, _) = Narration::new(&program, &symbols);
        LogWriter::new(narration, 10 * MS_NS, 200 * MS_NS, 60 * SECOND_NS)
    }

    #[test]
    fn a_chatter_is_thinned_out_and_what_was_left_out_is_counted() {
        let mut allowance = writer().changes;
        let start = 1000 * SECOND_NS;
        let taken = (0..6000).filter(|n| allowance.take(start + n * 10 * MS_NS)).count();
        assert!((1350..1450).contains(&taken), "200 at once, 20 a second for a minute: {taken}");
        assert_eq!(allowance.withheld, 6000 - taken as u64);
        allowance.tell_withheld(start + 60 * SECOND_NS);
        assert_eq!(allowance.withheld, 0);
        let later = start + 600 * SECOND_NS;
        assert_eq!((0..300).filter(|_| allowance.take(later)).count(), 200);
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
