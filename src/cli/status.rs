//! `rungd status`: how a running controller is, for people or as JSON.

use anyhow::Result;
use clap::Args;

use super::exit::Exit;
use super::operator::At;
use super::read::table;
use crate::daemon::span;
use crate::operator::protocol::{Block, Request, Retain, Scan, Spread, Status};

/// The width of the longest bar.
const BAR_CHARS: u64 = 40;

/// Tells how a running controller is
#[derive(Args, Debug)]
pub struct StatusArgs {
    /// Exit with 1 unless the mode is RUN
    #[arg(long)]
    require_run: bool,
    #[command(flatten)]
    at: At,
}

/// Tells.
///
/// # Errors
/// Standard output cannot be written.
pub fn status(args: &StatusArgs) -> Result<Exit> {
    let status: Status = match args.at.ask(&Request::Status {}) {
        Ok(status) => status,
        Err(exit) => return Ok(exit),
    };
    args.at.print(&status, || page(&status))?;
    let runs = status.mode == "RUN";
    Ok(if args.require_run && !runs { Exit::Refused } else { Exit::Ok })
}

fn page(status: &Status) -> String {
    let Status { version, pid, ladder, mode, scans, log, .. } = status;
    let ms = |ms: u64| span(ms * 1_000_000);
    let why = status.reason.as_ref().map_or(String::new(), |why| format!(" ({why})"));
    let mut lines = vec![
        format!("rungd {version}, pid {pid}, up {}", ms(status.uptime_ms)),
        row("controller", &status.controller),
        row(
            "ladder",
            &format!(
                "{}: {}, {}, sha256 {}",
                ladder.name,
                count(ladder.blocks, "block"),
                count(ladder.rungs, "rung"),
                ladder.sha256.get(..12).unwrap_or_default()
            ),
        ),
        row("mode", &format!("{mode}{why} for {}, {scans} scans in all", ms(status.mode_ms))),
        row("scan", &scan_line(status)),
    ];
    for (at, posture) in status.posture.iter().enumerate() {
        let granted = match &posture.why {
            Some(why) => format!("refused: {why}"),
            None => "granted".to_owned(),
        };
        let head = if at == 0 { "posture" } else { "" };
        lines.push(row(head, &format!("{}: {granted}", posture.asked)));
    }
    lines.extend(spread("execution", &status.scan.execution));
    lines.extend(spread("lateness", &status.scan.lateness));
    for (at, block) in status.blocks.iter().enumerate() {
        lines.push(row(if at == 0 { "blocks" } else { "" }, &block_line(block)));
    }
    let forces = table(&status.forces);
    if forces.is_empty() {
        lines.push(row("forces", "none"));
    }
    for (at, force) in forces.lines().enumerate() {
        lines.push(row(if at == 0 { "forces" } else { "" }, force));
    }
    lines.extend(devices(status));
    if let Some(retain) = &status.retain {
        lines.extend(retain_lines(retain));
    }
    let (dropped, records) = (log.lines_dropped, log.records_dropped);
    let level = format!("{:?}", log.level).to_lowercase();
    let lost = format!("from {level} on; {dropped} lines and {records} records dropped");
    lines.push(row("log", &lost));
    lines.iter().map(|line| format!("{}\n", line.trim_end())).collect()
}

fn count(number: usize, what: &str) -> String {
    if number == 1 { format!("1 {what}") } else { format!("{number} {what}s") }
}

fn row(head: &str, text: &str) -> String {
    format!("  {head:10}  {text}")
}

fn scan_line(status: &Status) -> String {
    let Scan { over_ms, scans, overruns, skipped, .. } = &status.scan;
    let us = |us: u64| span(us * 1000);
    format!(
        "every {}, watchdog {}; in {}: {scans} scans, {overruns} overruns, {skipped} skipped",
        us(status.period_us),
        us(status.watchdog_us),
        span(over_ms * 1_000_000)
    )
}

fn block_line(block: &Block) -> String {
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

/// A line of figures, and a bar a doubling.
fn spread(name: &str, spread: &Spread) -> Vec<String> {
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
    for bar in &spread.histogram {
        // What there is at all is seen.
        let chars = (bar.count * BAR_CHARS).div_ceil(most) as usize;
        let line = format!("<= {:>9.1} us  {:40}  {}", bar.up_to_us, "#".repeat(chars), bar.count);
        lines.push(row("", &line));
    }
    lines
}

fn retain_lines(retain: &Retain) -> Vec<String> {
    let ms = |ms: u64| span(ms * 1_000_000);
    let us = |us: u64| span(us * 1000);
    let mut lines = vec![
        row("retain", &format!("{}, every {}", retain.file, ms(retain.interval_ms))),
        row("", &retain.restored),
    ];
    if let (Some(image), Some(scan), Some(age)) = (retain.image, retain.scan, retain.age_ms) {
        lines.push(row("", &format!("image {image} of scan {scan} durable, {} old", ms(age))));
    }
    let (flush, longest) = (us(retain.flush_us), us(retain.flush_max_us));
    lines.push(row(
        "",
        &format!("{} written, the last in {flush}, the longest {longest}", retain.writes),
    ));
    let budget = retain.budget_per_day / 1_000_000;
    let wear = match retain.bytes_per_day {
        Some(bytes) => format!("{} MB a day as it goes, budget {budget}", bytes / 1_000_000),
        None => format!("wear not measured yet, budget {budget} MB a day"),
    };
    lines.push(row("", &wear));
    if let Some(why) = &retain.failing {
        lines.push(row("", &format!("NOT WRITTEN at present: {why}")));
    }
    lines
}

fn devices(status: &Status) -> Vec<String> {
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
    if lines.is_empty() {
        lines.push("none".to_owned());
    }
    let head = |at: usize| if at == 0 { "devices" } else { "" };
    lines.iter().enumerate().map(|(at, line)| row(head(at), line)).collect()
}
