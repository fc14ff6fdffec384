//! The pages of `rungd fleet` for people: the table of nodes, the list of alarms, a line a change.
//!
//! Every name and text comes from a broker: control characters are shown, and never obeyed.

use std::time::Duration;

use super::alarms::facts;
use super::terminal::one_line;
use super::when::LocalClock;
use crate::daemon::span;
use crate::fleet::{
    FleetAlarmList, FleetChange, FleetNews, FleetReport, LadderVerdict, NodeReport, shown,
};

/// A clock that is this far from ours is told.
const CLOCK_TOLD_MS: u64 = 5_000;
/// The characters of a hash that are shown.
const HASH_CHARS: usize = 12;
/// The longest name of a ladder in the table.
const LADDER_CHARS: usize = 24;
/// The longest text in a line.
const VALUE_CHARS: usize = 200;

/// The states in the order in which they are counted.
const STATES: [&str; 5] = ["online", "silent", "stale", "offline", "unborn"];

const HEAD: [&str; 8] =
    ["node", "state", "mode", "ladder", "forces", "overruns", "alarms", "last word"];

/// The table of nodes, what is to be said of some, and what was left out.
pub(super) fn status_page(report: &FleetReport, listened: Duration) -> String {
    let mut lines = vec![headline(report, listened)];
    if !report.nodes.is_empty() {
        lines.push(String::new());
        let rows = report.nodes.iter().map(row);
        lines.extend(columns([HEAD.map(str::to_owned)].into_iter().chain(rows).collect()));
    }
    let remarks: Vec<String> = report.nodes.iter().flat_map(remarks).collect();
    let missing = report.missing.iter().map(|node| {
        let group = node.group.as_ref().map_or(String::new(), |group| format!("{group}/"));
        format!("{group}{}: {}", node.node, verdict(&node.ladder_verdict).unwrap_or_default())
    });
    let remarks: Vec<String> = remarks.into_iter().chain(missing).collect();
    if !remarks.is_empty() {
        lines.push(String::new());
        lines.extend(remarks);
    }
    lines.extend(foot(report));
    lines.iter().map(|line| format!("{}\n", one_line(line.trim_end()))).collect()
}

fn headline(report: &FleetReport, listened: Duration) -> String {
    let listened = span(u64::try_from(listened.as_nanos()).unwrap_or(u64::MAX));
    if report.nodes.is_empty() {
        return format!("no edge node was heard in {listened}");
    }
    let count = |state: &&str| {
        let count = report.nodes.iter().filter(|node| node.state == *state).count();
        (count > 0).then(|| format!("{count} {state}"))
    };
    let counts: Vec<String> = STATES.iter().filter_map(count).collect();
    let nodes = report.nodes.len();
    let word = if nodes == 1 { "node" } else { "nodes" };
    format!("{nodes} {word}, heard for {listened}: {}", counts.join(", "))
}

fn row(node: &NodeReport) -> [String; 8] {
    let told = &node.told;
    let number = |number: Option<i64>| number.map_or("-".to_owned(), |number| number.to_string());
    let name = told.ladder.as_deref().unwrap_or("-");
    let name: String = name.chars().take(LADDER_CHARS).collect();
    let hash = told.ladder_sha256.as_deref().unwrap_or_default();
    let hash: String = hash.chars().take(HASH_CHARS).collect();
    let alarms = match (told.alarms, told.alarms_unacknowledged) {
        (Some(stand), Some(open)) if open > 0 => format!("{stand} ({open} not acknowledged)"),
        (Some(stand), _) => stand.to_string(),
        (None, _) => "-".to_owned(),
    };
    [
        node.name.to_string(),
        node.state.to_owned(),
        told.mode.clone().unwrap_or("-".to_owned()),
        format!("{name} {hash}").trim_end().to_owned(),
        number(told.forces),
        number(told.overruns),
        alarms,
        format!("{} ago", age(node.age_ms)),
    ]
    .map(|cell| one_line(&cell).into_owned())
}

/// What is to be said of a node beside its row.
fn remarks(node: &NodeReport) -> Vec<String> {
    let told = &node.told;
    let mut said = Vec::new();
    let mut say = |text: String| said.push(format!("{}: {text}", node.name));
    if node.state == "unborn" {
        say("not born yet seen: its values are known after its next birth".to_owned());
    }
    if let Some(why) = &node.why {
        say(format!("values may be old: {why}"));
    }
    if node.state == "silent" {
        say(format!("no word for {}, where one is due every 10s", age(node.age_ms)));
    }
    if told.controller == Some(false) {
        say("its controller does not answer its edge node".to_owned());
    }
    if let Some(why) = told.mode_reason.as_ref().filter(|why| !why.is_empty()) {
        say(format!("{}: {why}", told.mode.as_deref().unwrap_or("-")));
    }
    if let Some(ahead) = node.clock_ahead_ms.filter(|ms| ms.unsigned_abs() >= CLOCK_TOLD_MS) {
        let side = if ahead > 0 { "ahead of" } else { "behind" };
        say(format!("its clock is {} {side} this one", age(ahead.unsigned_abs())));
    }
    if told.history_replaying == Some(true) {
        say("it sends values of the past now".to_owned());
    }
    if let Some(lost) = told.history_lost.filter(|lost| *lost > 0) {
        say(format!("the changes of {lost} scans are lost: its scan log had them no more"));
    }
    let refused = node.metrics_refused + node.values_refused;
    if refused > 0 {
        say(format!("{refused} metrics or values of it are left out"));
    }
    if let Some(text) = node.ladder_verdict.as_ref().and_then(verdict) {
        say(text);
    }
    said
}

/// What is to be said of a ladder; nothing, if it is the one that is expected.
fn verdict(verdict: &LadderVerdict) -> Option<String> {
    Some(match verdict {
        LadderVerdict::Same { .. } => return None,
        LadderVerdict::Differs { file, expected } => {
            let expected: String = expected.chars().take(HASH_CHARS).collect();
            format!("runs ANOTHER ladder than {file} ({expected})")
        }
        LadderVerdict::Unlisted => "no file says what it should run".to_owned(),
        LadderVerdict::Unreadable { file, why } => format!("{file}: {why}"),
        LadderVerdict::Untold { file } => format!("does not tell what it runs; {file} says it"),
        LadderVerdict::Missing { file } => format!("was not heard; {file} says what it should run"),
    })
}

fn foot(report: &FleetReport) -> Vec<String> {
    let mut lines = Vec::new();
    let unborn = report.nodes.iter().filter(|node| matches!(node.state, "unborn" | "stale"));
    match unborn.count() {
        0 => {}
        1 => lines.push("1 node needs a birth to be known: `--rebirth` asks for it".to_owned()),
        count => lines.push(format!("{count} nodes need a birth to be known: `--rebirth` asks")),
    }
    for host in &report.hosts {
        let state = if host.state.online { "online" } else { "offline" };
        lines.push(format!("host {}: {state}", host.host));
    }
    let left_out = report.counts.left_out();
    lines.extend(left_out.iter().map(|what| format!("left out: {what}")));
    if !lines.is_empty() {
        lines.insert(0, String::new());
    }
    lines
}

/// The alarms of all nodes.
pub(super) fn alarms_page(list: &FleetAlarmList, clock: &LocalClock) -> String {
    let stand = list.alarms.iter().filter(|row| row.alarm.state.stands()).count();
    let gone = list.alarms.len() - stand;
    let standing = match stand {
        0 => "no alarm stands".to_owned(),
        1 => "1 alarm stands".to_owned(),
        _ => format!("{stand} alarms stand"),
    };
    let mut lines = vec![match gone {
        0 => standing,
        _ => format!("{standing}, {gone} went away unacknowledged"),
    }];
    let mut node = None;
    for row in &list.alarms {
        if node != Some(&row.node) {
            let state = if row.state == "online" { "" } else { ": its last word" };
            lines.push(format!("{} ({}{state})", row.node, row.state));
            node = Some(&row.node);
        }
        lines.push(format!("  {}: {}", row.alarm.tag, row.alarm.text));
        lines.push(format!("     {}", facts(&row.alarm, clock)));
    }
    let unknown = list.unknown.iter();
    lines.extend(unknown.map(|node| format!("{node}: its alarms are not known")));
    lines.iter().map(|line| format!("{}\n", one_line(line.trim_end()))).collect()
}

/// A change as a line.
pub(super) fn change_line(change: &FleetChange, clock: &LocalClock) -> String {
    let ns = i64::try_from(change.at_ms).unwrap_or(i64::MAX).saturating_mul(1_000_000);
    let text = match &change.news {
        FleetNews::Heard => "heard; its birth is not known".to_owned(),
        FleetNews::Born { metrics } => format!("born with {metrics} metrics"),
        FleetNews::Died => "died".to_owned(),
        FleetNews::Stale { why } => format!("values may be old: {why}"),
        FleetNews::Value { name, value, unit, historical } => {
            let unit = unit.as_ref().map_or(String::new(), |unit| format!(" {unit}"));
            let past = if *historical { " (of the past)" } else { "" };
            let value: String = shown(value.as_ref()).chars().take(VALUE_CHARS).collect();
            format!("{name} = {value}{unit}{past}")
        }
    };
    format!("{}\n", one_line(&format!("{}  {}  {text}", clock.text(ns), change.node)))
}

fn age(ms: u64) -> String {
    span(ms.saturating_mul(1_000_000))
}

/// Rows in columns, two spaces between them.
fn columns(rows: Vec<[String; 8]>) -> Vec<String> {
    let width = |at: usize| rows.iter().map(|row| row[at].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..HEAD.len()).map(width).collect();
    let line = |row: &[String; 8]| {
        let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:width$}"));
        cells.collect::<Vec<String>>().join("  ")
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fleet::report::ControllerReport;
    use crate::fleet::{FleetView, NodeName};

    fn node(name: &str, state: &'static str, age_ms: u64) -> NodeReport {
        let name = NodeName { group: "plant".to_owned(), node: name.to_owned() };
        NodeReport { name, state, age_ms, is_rungd: true, ..NodeReport::default() }
    }

    fn told(mode: &str, ladder: &str, sha256: &str) -> ControllerReport {
        ControllerReport {
            mode: Some(mode.to_owned()),
            ladder: Some(ladder.to_owned()),
            ladder_sha256: Some(sha256.repeat(16)),
            forces: Some(0),
            overruns: Some(0),
            alarms: Some(0),
            ..ControllerReport::default()
        }
    }

    /// The report that `docs/fleet.md` shows.
    fn report() -> FleetReport {
        let mut oven = node("oven", "online", 1_200);
        oven.told = told("RUN", "oven", "3f9a");
        let mut press = node("press", "online", 300);
        press.told = ControllerReport {
            mode_reason: Some("watchdog: a scan took 31 ms".to_owned()),
            forces: Some(2),
            overruns: Some(1),
            alarms: Some(3),
            alarms_unacknowledged: Some(1),
            ..told("FAULT", "press", "b012")
        };
        press.ladder_verdict = Some(LadderVerdict::Differs {
            file: "ladders/plant/press/controller.toml".to_owned(),
            expected: "77c1".repeat(16),
        });
        let mut pump = node("pump", "silent", 65_000);
        pump.told = told("RUN", "pump", "e3d0");
        let mut report = FleetView::default().report(0);
        report.nodes = vec![oven, press, pump, node("saw", "unborn", 4_000)];
        report
    }

    #[test]
    fn the_page_is_the_one_that_the_docs_show() {
        let page = status_page(&report(), Duration::from_secs(12));
        let docs = include_str!("../../docs/fleet.md");
        assert!(docs.contains(&page), "docs/fleet.md does not show this:\n{page}");
    }

    #[test]
    fn a_name_adds_no_line() {
        let mut report = report();
        report.nodes[0].name.node = "a\nb\u{1b}[2J".to_owned();
        report.nodes[0].told.mode = Some("RUN\nFAULT".to_owned());
        let lines = status_page(&report, Duration::from_secs(12)).lines().count();
        let before = status_page(&self::report(), Duration::from_secs(12)).lines().count();
        assert_eq!(lines, before);
    }

    #[test]
    fn nothing_heard_is_said() {
        let page = status_page(&FleetView::default().report(0), Duration::from_secs(12));
        assert_eq!(page, "no edge node was heard in 12s\n");
    }
}
