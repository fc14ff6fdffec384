//! `rungd status`: prints the state of a running controller, as text or as JSON.

use anyhow::Result;
use clap::Args;

use super::exit::Exit;
use super::operator::OperatorArgs;
use super::read::table;
use super::terminal::one_line;
use rungd_base::duration_text::{duration_text, period_text};
use rungd_client::operator::protocol::{
    AlarmState, AlarmStatus, BlockStatus, ControllerStatus, LogStatus, PostureStatus, RecordStatus,
    Request, RetainStatus, ScanStatus, SpreadStatus, is_run,
};

/// The width of the longest bar, in characters.
const BAR_CHARS: u64 = 40;

/// Prints the state of a running controller
#[derive(Args, Debug)]
pub struct StatusArgs {
    /// Exit with 1 unless the mode is RUN
    #[arg(long)]
    require_run: bool,
    /// Show histograms of the execution time and the lateness of scans
    #[arg(long)]
    histogram: bool,
    #[command(flatten)]
    at: OperatorArgs,
}

/// Prints the state.
///
/// # Errors
/// Standard output cannot be written.
pub fn status(args: &StatusArgs) -> Result<Exit> {
    let status: ControllerStatus = match args.at.ask(&Request::Status {}) {
        Ok(status) => status,
        Err(exit) => return Ok(exit),
    };
    args.at.print(&status, || page(&status, args.histogram))?;
    Ok(if args.require_run && !is_run(&status.mode) { Exit::Refused } else { Exit::Ok })
}

/// The text. The most important lines come first: the mode, the program, alarms, forces.
fn page(status: &ControllerStatus, histogram: bool) -> String {
    let ControllerStatus { version, pid, ladder, mode, scans, .. } = status;
    let ms = |ms: u64| duration_text(ms * 1_000_000);
    let why = status.reason.as_ref().map_or(String::new(), |why| format!(" ({why})"));
    let ladder = format!(
        "{}: {}, {}, sha256 {}",
        ladder.name,
        count(ladder.blocks as u64, "block"),
        count(ladder.rungs as u64, "rung"),
        ladder.sha256.get(..12).unwrap_or_default()
    );
    let mut lines = vec![
        format!("rungd {version}, pid {pid}, up {}", ms(status.uptime_ms)),
        row(
            "mode",
            &format!("{mode}{why} for {}, {} in all", ms(status.mode_ms), count(*scans, "scan")),
        ),
        row("controller", &status.controller),
        row("ladder", &ladder),
    ];
    lines.extend(rows("alarms", status.alarms.iter().map(alarm_line).collect()));
    lines.extend(rows("forces", table(&status.forces).lines().map(str::to_owned).collect()));
    if !is_run(&status.mode) || !status.outputs.is_empty() {
        lines.extend(rows("outputs", outputs(status)));
    }
    lines.extend(rows("devices", devices(status)));
    lines.extend(rows("blocks", status.blocks.iter().map(block_line).collect()));
    if let Some(retain) = &status.retain {
        lines.extend(rows("retain", retain_lines(retain)));
    }
    lines.extend(rows("record", record_lines(&status.record)));
    lines.push(row("scan", &scan_line(status)));
    lines.extend(spread("execution", &status.scan.execution, histogram));
    lines.extend(spread("lateness", &status.scan.lateness, histogram));
    lines.extend(rows("posture", status.posture.iter().map(posture_line).collect()));
    lines.push(row("log", &log_line(&status.log)));
    lines.iter().map(|line| format!("{}\n", one_line(line.trim_end()))).collect()
}

/// The lines about outputs: outside RUN, and those whose state differs from memory or is not known.
fn outputs(status: &ControllerStatus) -> Vec<String> {
    match status.outputs.is_empty() {
        true => vec!["at their safe values, as in memory".to_owned()],
        false => {
            let rows = table(&status.outputs);
            let is_lost = status.outputs.iter().any(|output| output.unknown.is_some());
            let head = match (is_run(&status.mode), is_lost) {
                (true, _) => "as in memory; not known, because their device is lost:",
                (false, true) => "at their safe values; these differ from memory or are not known:",
                (false, false) => "at their safe values; these differ from memory:",
            };
            let head = head.to_owned();
            [head].into_iter().chain(rows.lines().map(str::to_owned)).collect()
        }
    }
}

fn alarm_line(alarm: &AlarmStatus) -> String {
    let AlarmStatus { tag, text, priority, state, .. } = alarm;
    let acknowledged = match (&alarm.shelved, state) {
        (Some(shelf), _) => shelf.words(),
        (None, AlarmState::Acknowledged) => "acknowledged",
        (None, AlarmState::Normal | AlarmState::Unacknowledged | AlarmState::Returned) => {
            "not acknowledged"
        }
    };
    format!("{tag}: {text} ({}, {acknowledged})", priority.name())
}

fn log_line(log: &LogStatus) -> String {
    let LogStatus { level, lines_dropped, records_dropped } = log;
    let level = format!("{level:?}").to_lowercase();
    format!("from {level} on; {lines_dropped} lines and {records_dropped} records dropped")
}

fn posture_line(posture: &PostureStatus) -> String {
    match &posture.why {
        Some(why) => format!("{}: refused: {why}", posture.asked),
        None => format!("{}: granted", posture.asked),
    }
}

fn count(number: u64, what: &str) -> String {
    if number == 1 { format!("1 {what}") } else { format!("{number} {what}s") }
}

fn row(head: &str, text: &str) -> String {
    format!("  {head:10}  {text}")
}

/// Lines under one heading; the line `none` if `texts` is empty.
fn rows(head: &str, mut texts: Vec<String>) -> Vec<String> {
    if texts.is_empty() {
        texts.push("none".to_owned());
    }
    let head = |at: usize| if at == 0 { head } else { "" };
    texts.iter().enumerate().map(|(at, text)| row(head(at), text)).collect()
}

fn scan_line(status: &ControllerStatus) -> String {
    let ScanStatus { over_ms, scans, overruns, skipped, .. } = &status.scan;
    let us = |us: u64| duration_text(us * 1000);
    format!(
        "every {}, watchdog {}; in {}: {}, {}, {skipped} skipped",
        period_text(status.period_us * 1000),
        us(status.watchdog_us),
        duration_text(over_ms * 1_000_000),
        count(*scans, "scan"),
        count(*overruns, "overrun")
    )
}

fn block_line(block: &BlockStatus) -> String {
    let state = match (block.running, block.done) {
        (true, _) => "running",
        (false, Some(true)) => "done",
        (false, _) => "not running",
    };
    let stages = match &block.stages[..] {
        [] => String::new(),
        stages => format!("; Stages ON: {}", stages.join(", ")),
    };
    let kind = if block.kind == "task" { "Task" } else { "Program" };
    format!("{kind} {}: {state}{stages}", block.name)
}

/// A line of figures. With the histogram, one bar for each power of two is below it.
fn spread(name: &str, spread: &SpreadStatus, histogram: bool) -> Vec<String> {
    let figures = [
        ("last", spread.last_us),
        ("min", spread.min_us),
        ("mean", spread.mean_us),
        ("p50", spread.p50_us),
        ("p99", spread.p99_us),
        ("p99.9", spread.p999_us),
        ("max", spread.max_us),
    ];
    let figures = figures.map(|(what, us)| format!("{what} {us:.1}")).join("  ");
    let mut lines = vec![row(name, &format!("{figures} us"))];
    let most = spread.histogram.iter().map(|bar| bar.count).max().unwrap_or(0).max(1);
    for bar in spread.histogram.iter().filter(|_| histogram) {
        // A bar with a count above 0 has at least one character.
        let chars = (bar.count * BAR_CHARS).div_ceil(most) as usize;
        let line = format!("<= {:>9.1} us  {:40}  {}", bar.up_to_us, "#".repeat(chars), bar.count);
        lines.push(row("", &line));
    }
    lines
}

fn retain_lines(retain: &RetainStatus) -> Vec<String> {
    let ms = |ms: u64| duration_text(ms * 1_000_000);
    let us = |us: u64| duration_text(us * 1000);
    let mut lines =
        vec![format!("{}, every {}", retain.file, ms(retain.interval_ms)), retain.restored.clone()];
    if let (Some(image), Some(scan), Some(age)) = (retain.image, retain.scan, retain.age_ms) {
        lines.push(format!("image {image} of scan {scan} durable, {} old", ms(age)));
    }
    let (flush, longest) = (us(retain.flush_us), us(retain.flush_max_us));
    let writes = retain.writes;
    lines.push(format!("{writes} written, the last in {flush}, the longest {longest}"));
    let budget = retain.budget_per_day / 1_000_000;
    lines.push(match retain.bytes_per_day {
        Some(bytes) => format!("{} MB a day at this rate, budget {budget}", bytes / 1_000_000),
        None => format!("wear not measured yet, budget {budget} MB a day"),
    });
    lines.extend(retain.failing.iter().map(|why| format!("NOT WRITTEN at present: {why}")));
    lines
}

/// A copy of the scan log that is further behind is shown: a quiet disk is a second behind.
const BEHIND_TOLD_MS: u64 = 2_000;

fn record_lines(record: &RecordStatus) -> Vec<String> {
    let mb = |bytes: u64| format!("{:.1} MB", bytes as f64 / 1e6);
    let reach = duration_text(record.memory_ms * 1_000_000);
    let mut lines = vec![format!("the last {reach} in {} of memory", mb(record.memory_bytes))];
    lines.push(match &record.disk {
        Some(disk) => {
            let mut line = format!("{}: {} of {}", disk.dir, mb(disk.bytes), mb(disk.size));
            if disk.behind_ms > BEHIND_TOLD_MS {
                let behind = duration_text(disk.behind_ms * 1_000_000);
                line.push_str(&format!("; the disk is slow: {behind} behind"));
            }
            line
        }
        None => "not on disk: `[record] dir` names a folder".to_owned(),
    });
    if record.lost > 0 {
        lines
            .push(format!("{} are missing: the log's thread was late", count(record.lost, "scan")));
    }
    let failing = record.disk.iter().filter_map(|disk| disk.failing.as_ref());
    lines.extend(failing.map(|why| format!("NOT WRITTEN at present: {why}")));
    lines
}

fn devices(status: &ControllerStatus) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(modbus) = &status.devices.modbus {
        let (clients, most) = (modbus.clients, modbus.connections_max);
        lines.push(format!("Modbus server at {}: {clients} of {most} clients", modbus.address));
    }
    if let Some(rules) = status.devices.simulated_rules {
        lines.push(format!("simulated device: {rules} rules"));
    }
    for device in &status.devices.field {
        let state = match (&device.trouble, device.ok, device.stale) {
            (_, _, true) => "STALE",
            (Some(_), _, false) => "in trouble",
            (None, true, false) => "ok",
            (None, false, false) => "not seen by a scan yet",
        };
        let (name, driver, peer) = (&device.name, &device.driver, &device.peer);
        let (exchanges, failures) = (device.exchanges, device.failures);
        let took = format!("{} us, at most {}", device.took_us, device.took_max_us);
        lines.push(format!("{name} ({driver}, {peer}): {state}"));
        lines.push(format!("  {exchanges} exchanges ({took}), {failures} failures"));
        lines.extend(device.trouble.iter().map(|why| format!("  {why}")));
    }
    lines
}
