//! The families about a controller as a whole: its program, mode, scans. Called by `scrape`. Pure.
//!
//! Statistics cover the time since the start of RUN. Their counters start again at 0 with each
//! start of RUN, like the counters of a restarted process.

use super::family::{MetricFamily, MetricKind, MetricSample, flag};
use super::scraped::Scraped;
use super::text::number;
pub use rungd_client::operator::protocol::{ControllerStatus, ScanStatus, SpreadStatus};
use rungd_runtime::exchange::Mode;

/// The modes.
const MODES: [&str; 3] = [Mode::RUN, Mode::STOP, Mode::FAULT];

/// The first and the last edge of the buckets: 2^10 ns and 2^30 ns, about 1 us and 1 s. Each scrape
/// has all buckets, since a new bucket would look like a jump.
const FIRST_LOG2: u32 = 10;
const LAST_LOG2: u32 = 30;

/// Divisors: a division makes exactly 0.2 s of 200 ms, a multiplication may not.
const US: f64 = 1e6;
const MS: f64 = 1e3;

/// Whether a controller answers.
pub(super) fn up(answers: bool) -> MetricFamily {
    MetricFamily::gauge("rungd_up", "Whether the controller answers (0, 1).", flag(answers))
}

/// The families.
pub(super) fn families(seen: &Scraped) -> Vec<MetricFamily> {
    let status = &seen.status;
    let mut families = about(status, seen.start_s);
    families.extend(scans(status));
    families.extend(requests(status));
    families
}

fn about(status: &ControllerStatus, start_s: f64) -> Vec<MetricFamily> {
    let labels = [
        ("version", status.version.as_str()),
        ("ladder", &status.ladder.name),
        ("sha256", &status.ladder.sha256),
    ];
    let info = "The version of rungd, the ladder's name, and the hash of its files.";
    let mode = "The controller's mode: 1 for the present one, else 0.";
    let mode = MetricFamily::new(MetricKind::Gauge, "rungd_mode", mode);
    vec![
        MetricFamily::new(MetricKind::Info, "rungd", info).with(&labels, 1.0),
        MetricFamily::gauge("rungd_start_time_seconds", "When it started, since 1970.", start_s),
        mode.each(&MODES, |mode| (vec![("mode", *mode)], flag(*mode == status.mode))),
        MetricFamily::gauge(
            "rungd_mode_duration_seconds",
            "How long it has been in this mode.",
            status.mode_ms as f64 / MS,
        ),
        MetricFamily::gauge(
            "rungd_forces",
            "The forced bits and words.",
            status.forces.len() as f64,
        ),
    ]
}

fn scans(status: &ControllerStatus) -> Vec<MetricFamily> {
    let ScanStatus { overruns, skipped, execution, lateness, .. } = &status.scan;
    let seconds = |us: u64| us as f64 / US;
    vec![
        MetricFamily::gauge(
            "rungd_period_seconds",
            "From scan to scan.",
            seconds(status.period_us),
        ),
        MetricFamily::gauge(
            "rungd_watchdog_seconds",
            "A longer scan is a fault.",
            seconds(status.watchdog_us),
        ),
        MetricFamily::counter("rungd_scans", "Complete scans.", status.scans),
        MetricFamily::counter(
            "rungd_scan_overruns",
            "Scans in RUN that ended after the next one was due.",
            *overruns,
        ),
        MetricFamily::counter(
            "rungd_scans_skipped",
            "Scans in RUN that were left out behind overruns.",
            *skipped,
        ),
        histogram(
            "rungd_scan_execution_seconds",
            "From the beginning of a scan to its end, since the start of RUN.",
            execution,
        ),
        histogram(
            "rungd_scan_lateness_seconds",
            "From a scan's due time to its beginning, since the start of RUN.",
            lateness,
        ),
    ]
}

/// The settings that the controller requested from the machine.
fn requests(status: &ControllerStatus) -> Vec<MetricFamily> {
    let help = "Whether the machine granted what the controller file asks of it (0, 1).";
    let family = MetricFamily::new(MetricKind::Gauge, "rungd_posture_granted", help);
    vec![
        family.each(&status.posture, |posture| {
            (vec![("asked", &*posture.asked)], flag(posture.granted))
        }),
    ]
}

fn histogram(name: &'static str, help: &'static str, spread: &SpreadStatus) -> MetricFamily {
    let mut family = MetricFamily::new(MetricKind::Histogram, name, help);
    let mut push = |suffix, labels, value| {
        family.samples.push(MetricSample { suffix, labels, value });
    };
    let up_to = |log2: u32| {
        let within = spread.histogram.iter().filter(|bar| edge_log2(bar.up_to_us) <= log2);
        within.map(|bar| bar.count).sum::<u64>() as f64
    };
    for log2 in FIRST_LOG2..=LAST_LOG2 {
        // The edge of a bar is the last ns that is counted in the bar.
        let edge = ((1_u64 << log2) - 1) as f64 / 1e9;
        push("_bucket", vec![("le", number(edge))], up_to(log2));
    }
    let all = up_to(u32::MAX);
    push("_bucket", vec![("le", "+Inf".to_owned())], all);
    push("_sum", Vec::new(), spread.sum_us / US);
    push("_count", Vec::new(), all);
    family
}

/// The binary logarithm of a bar's upper edge in ns. The status rounds the edge to tenths of us.
fn edge_log2(up_to_us: f64) -> u32 {
    let log2 = (up_to_us * 1000.0).log2().round();
    if log2.is_finite() && log2 > 0.0 { log2 as u32 } else { 0 }
}
