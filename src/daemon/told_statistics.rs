//! The log lines with scan statistics: the heartbeat in RUN, and the whole run at its end.
//!
//! Called by `log_writer` and by the shell. A terminal gets one short line, all other readers get
//! every figure.

use super::log_queue::lines_dropped;
use super::narration::us;
use rungd_base::duration_text::{duration_text, period_text};
use rungd_runtime::Statistics;
use rungd_runtime::say::say;

/// Logs scan statistics: either those since the last heartbeat, or those of the whole run.
macro_rules! tell {
    ($event:ident, $statistics:expr, $text:literal, $short:expr
     $(, $field:ident = $value:expr)*) => {{
        let Statistics { scans, execution: scan, lateness: late, overruns, skipped, .. } =
            *$statistics;
        say!(
            $event,
            $($field = $value,)*
            scans,
            overruns,
            skipped,
            over_us = us($statistics.over_ns),
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
            on_screen = short($statistics, &$short),
            $text,
            duration_text($statistics.over_ns),
        );
    }};
}

/// The state that a heartbeat states beside the statistics.
pub(super) struct BeatState {
    /// The name of the mode.
    pub mode: &'static str,
    /// The number of forces.
    pub forces: usize,
    pub period_ns: u64,
}

/// Logs the heartbeat: the statistics since the one before it.
pub(super) fn tell_heartbeat(statistics: &Statistics, state: &BeatState) {
    let BeatState { mode, forces, period_ns } = *state;
    tell!(
        HEARTBEAT,
        statistics,
        "scan statistics of the last {}",
        format!("{mode} every {}", period_text(period_ns)),
        mode = mode,
        forces = forces,
        log_lost = lines_dropped()
    );
}

/// Logs the statistics of the whole run, at its end.
pub(super) fn tell_statistics(statistics: &Statistics) {
    tell!(STATISTICS, statistics, "scan statistics of the whole run, {}", "the whole run");
}

/// The statistics for a terminal: one line of at most 70 columns.
fn short(statistics: &Statistics, what: &str) -> String {
    let time = |ns: u64| match ns / 1000 {
        us @ 0..10_000 => format!("{us}us"),
        us => duration_text(us * 1000),
    };
    let (p99, late) = (time(statistics.execution.p99_ns), time(statistics.lateness.p99_ns));
    let (overruns, over) = (statistics.overruns, duration_text(statistics.over_ns));
    format!("{what}: p99 {p99}, lateness {late}, overruns {overruns} in {over}")
}
