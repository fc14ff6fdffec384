//! The texts of `rungd fleet`: the table of nodes, the list of alarms, one line for each change.
//!
//! Every name and text comes from a broker: control characters are printed as escapes.

use std::time::Duration;

use super::alarms::facts;
use super::terminal::one_line;
use super::when::LocalClock;
use rungd_base::duration_text::duration_text;
use rungd_client::operator::protocol::alarm_count;
use rungd_fleet::fleet::{
    CutAlarms, FleetAlarmList, FleetChange, FleetNews, FleetReport, LadderVerdict, NodeReport,
    shown,
};
use rungd_language::resolve::value_texts::with_text;

/// A clock that differs from the local clock by this time is reported.
const CLOCK_TOLD_MS: u64 = 5_000;
/// The number of characters of a hash that are shown.
const HASH_CHARS: usize = 12;
/// The maximum length of the name of a ladder, or of a mode, in the table.
const LADDER_CHARS: usize = 24;
/// The maximum width of a column. A longer cell is printed in full, and widens no other row.
const COLUMN_CHARS: usize = 48;
/// The maximum number of hosts that are listed. A plant has one or two.
const HOSTS_SHOWN: usize = 10;
/// The maximum length of a text in a line.
const VALUE_CHARS: usize = 200;

/// The states in the order in which they are counted.
const STATES: [&str; 5] = ["online", "silent", "stale", "offline", "unborn"];

const HEAD: [&str; 8] =
    ["node", "state", "mode", "ladder", "forces", "overruns", "alarms", "last message"];

/// The table of nodes, remarks on some of them, and a list of the parts that were left out.
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
    let listened = span_of(listened);
    if report.nodes.is_empty() {
        return nothing(listened);
    }
    let count = |state: &&str| {
        let count = report.nodes.iter().filter(|node| node.state == *state).count();
        (count > 0).then(|| format!("{count} {state}"))
    };
    let counts: Vec<String> = STATES.iter().filter_map(count).collect();
    format!("{}, heard for {listened}: {}", nodes(report.nodes.len()), counts.join(", "))
}

/// The text if no message was received. Usually there is a node, so the text names likely causes.
fn nothing(listened: String) -> String {
    format!(
        "no edge node was heard in {listened}; an edge node of rungd sends a message every 10s: \
         does it publish at this broker, may this user read `spBv1.0/#`, is `--group` right?"
    )
}

fn span_of(time: Duration) -> String {
    duration_text(u64::try_from(time.as_nanos()).unwrap_or(u64::MAX))
}

fn nodes(count: usize) -> String {
    let word = if count == 1 { "node" } else { "nodes" };
    format!("{count} {word}")
}

fn row(node: &NodeReport) -> [String; 8] {
    let told = &node.told;
    let number = |number: Option<i64>| number.map_or("-".to_owned(), |number| number.to_string());
    let short = |text: &Option<String>| -> String {
        text.as_deref().unwrap_or("-").chars().take(LADDER_CHARS).collect()
    };
    let name = short(&told.ladder);
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
        short(&told.mode),
        format!("{name} {hash}").trim_end().to_owned(),
        number(told.forces),
        number(told.overruns),
        alarms,
        format!("{} ago", age(node.age_ms)),
    ]
    .map(|cell| one_line(&cell).into_owned())
}

/// The remarks on a node in addition to its row.
fn remarks(node: &NodeReport) -> Vec<String> {
    let told = &node.told;
    let mut said = Vec::new();
    let mut say = |text: String| said.push(format!("{}: {text}", node.name));
    if node.state == "unborn" {
        say("no birth was received: its values are known after its next birth".to_owned());
    }
    if let Some(why) = &node.why {
        say(format!("values may be old: {why}"));
    }
    if node.state == "silent" {
        say(format!("no message for {}; one is due every 10s", age(node.age_ms)));
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
        say("it is sending past values".to_owned());
    }
    if let Some(lost) = told.history_lost.filter(|lost| *lost > 0) {
        say(format!("the changes of {lost} scans are lost: its scan log no longer had them"));
    }
    if node.metrics_refused > 0 {
        let count = node.metrics_refused;
        say(format!("left out: {count} of its metrics, beyond the limits of `rungd fleet`"));
    }
    if node.values_refused > 0 {
        let count = node.values_refused;
        say(format!("left out: {count} of its values, without a name or not of their type"));
    }
    if let Some(text) = node.ladder_verdict.as_ref().and_then(verdict) {
        say(text);
    }
    said
}

/// The remark on a ladder; `None` if it is the expected one.
fn verdict(verdict: &LadderVerdict) -> Option<String> {
    Some(match verdict {
        LadderVerdict::Same { .. } => return None,
        LadderVerdict::Differs { file, expected } => {
            let expected: String = expected.chars().take(HASH_CHARS).collect();
            format!("runs ANOTHER ladder than {file} ({expected})")
        }
        LadderVerdict::Unlisted => "no file gives its expected ladder".to_owned(),
        LadderVerdict::Unreadable { file, why } => format!("{file}: {why}"),
        LadderVerdict::Untold { file } => {
            format!("does not report its ladder; {file} gives the expected one")
        }
        LadderVerdict::Missing { file } => {
            format!("was not heard; {file} gives its expected ladder")
        }
    })
}

fn foot(report: &FleetReport) -> Vec<String> {
    let mut lines = Vec::new();
    let unborn = report.nodes.iter().filter(|node| matches!(node.state, "unborn" | "stale"));
    let (asked, unasked): (Vec<&NodeReport>, _) = unborn.partition(|it| it.asked_ms.is_some());
    match unasked.len() {
        0 => {}
        1 => lines.push("1 node needs a birth: `--rebirth` requests it".to_owned()),
        count => lines.push(format!("{count} nodes need a birth: `--rebirth` requests it")),
    }
    if !asked.is_empty() {
        lines.push(format!(
            "{} got a request for a birth, and sent none: allow more time with `--wait`, or check \
             that this user may publish to `spBv1.0/+/NCMD/+`",
            nodes(asked.len())
        ));
    }
    for host in report.hosts.iter().take(HOSTS_SHOWN) {
        let state = if host.state.online { "online" } else { "offline" };
        lines.push(format!("host {}: {state}", host.host));
    }
    if let Some(more) = report.hosts.len().checked_sub(HOSTS_SHOWN).filter(|more| *more > 0) {
        lines.push(format!("{more} more hosts: `--json` names them"));
    }
    let left_out = report.counts.left_out();
    lines.extend(left_out.iter().map(|what| format!("left out: {what}")));
    if !lines.is_empty() {
        lines.insert(0, String::new());
    }
    lines
}

/// The list of the alarms of all nodes.
pub(super) fn alarms_page(list: &FleetAlarmList, listened: Duration, clock: &LocalClock) -> String {
    let mut lines = vec![alarms_headline(list, listened)];
    let mut node = None;
    for row in &list.alarms {
        if node != Some(&row.node) {
            let state = if row.state == "online" { "" } else { ": as of its last message" };
            lines.push(format!("{} ({}{state})", row.node, row.state));
            node = Some(&row.node);
        }
        lines.push(format!("  {}: {}", row.alarm.tag, row.alarm.text));
        lines.push(format!("     {}", facts(&row.alarm, clock)));
    }
    let unknown = list.unknown.iter();
    lines.extend(
        unknown.map(|node| format!("{}: its alarms are not known: {}", node.node, node.why)),
    );
    let cut = list.cut.iter();
    lines.extend(cut.map(|CutAlarms { node, left_out }| {
        format!("{node}: left out: {left_out} of its alarms, not readable or beyond the limits")
    }));
    lines.extend(list.counts.left_out().iter().map(|what| format!("left out: {what}")));
    lines.iter().map(|line| format!("{}\n", one_line(line.trim_end()))).collect()
}

fn alarms_headline(list: &FleetAlarmList, listened: Duration) -> String {
    if list.nodes == 0 {
        return nothing(span_of(listened));
    }
    let mut line = alarm_count(list.alarms.iter().map(|row| &row.alarm));
    if !list.unknown.is_empty() {
        line += &format!("; the alarms of {} are not known", nodes(list.unknown.len()));
    }
    line
}

/// A change as a line.
pub(super) fn change_line(change: &FleetChange, clock: &LocalClock) -> String {
    let ns = i64::try_from(change.at_ms).unwrap_or(i64::MAX).saturating_mul(1_000_000);
    let text = match &change.news {
        FleetNews::Heard => "heard; its birth is not known".to_owned(),
        FleetNews::Born { metrics: 1 } => "born with 1 metric".to_owned(),
        FleetNews::Born { metrics } => format!("born with {metrics} metrics"),
        FleetNews::Died => "died".to_owned(),
        FleetNews::Stale { why } => format!("values may be old: {why}"),
        FleetNews::Value { name, value, text, unit, historical, first, .. } => {
            let unit = unit.as_ref().map_or(String::new(), |unit| format!(" {unit}"));
            let past = match (historical, first) {
                (true, _) => " (of the past)",
                (false, true) => " (at its birth)",
                (false, false) => "",
            };
            let value: String = shown(value.as_ref()).chars().take(VALUE_CHARS).collect();
            let value = with_text(value, text.as_deref());
            format!("{name} = {value}{unit}{past}")
        }
    };
    format!("{}\n", one_line(&format!("{}  {}  {text}", clock.text(ns), change.node)))
}

fn age(ms: u64) -> String {
    duration_text(ms.saturating_mul(1_000_000))
}

/// Rows in columns, two spaces between them.
fn columns(rows: Vec<[String; 8]>) -> Vec<String> {
    let chars = |row: &[String; 8], at: usize| row[at].chars().count().min(COLUMN_CHARS);
    let width = |at: usize| rows.iter().map(|row| chars(row, at)).max().unwrap_or(0);
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
    use rungd_fleet::fleet::report::ControllerReport;
    use rungd_fleet::fleet::{FleetView, NodeName, ReceivedMessage};

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
    fn the_status_page_equals_the_page_in_the_docs() {
        let page = status_page(&report(), Duration::from_secs(12));
        let docs = include_str!("../../docs/fleet.md");
        assert!(docs.contains(&page), "docs/fleet.md does not show this:\n{page}");
    }

    #[test]
    fn line_breaks_in_names_add_no_line_to_the_page() {
        let mut report = report();
        report.nodes[0].name.node = "a\nb\u{1b}[2J".to_owned();
        report.nodes[0].told.mode = Some("RUN\nFAULT".to_owned());
        let lines = status_page(&report, Duration::from_secs(12)).lines().count();
        let before = status_page(&self::report(), Duration::from_secs(12)).lines().count();
        assert_eq!(lines, before);
    }

    #[test]
    fn an_oversized_text_of_one_node_does_not_move_other_rows() {
        let mut report = report();
        report.nodes[0].name.node = "n".repeat(300);
        report.nodes[0].told.mode = Some("X\u{1b}".repeat(100_000));
        let page = status_page(&report, Duration::from_secs(12));
        assert!(page.len() < 3_000, "{}", page.len());
        assert!(page.contains(&"n".repeat(300)), "the name stays whole");
    }

    #[test]
    fn many_hosts_are_counted_and_not_listed() {
        let mut view = FleetView::default();
        for number in 0..50 {
            let topic = format!("spBv1.0/STATE/host{number}");
            let payload = br#"{"online":true,"timestamp":7}"#;
            view.hear(ReceivedMessage { topic: &topic, payload, is_retained: false }, 5);
        }
        let page = status_page(&view.report(5), Duration::from_secs(12));
        assert_eq!(page.matches("online").count(), 10, "{page}");
        assert!(page.contains("40 more hosts: `--json` names them"), "{page}");
    }

    #[test]
    fn missing_requested_births_are_reported() {
        let mut report = report();
        report.nodes[3].asked_ms = Some(3_000);
        let page = status_page(&report, Duration::from_secs(12));
        assert!(page.contains("1 node got a request for a birth, and sent none"), "{page}");
        assert!(!page.contains("`--rebirth` requests"), "{page}");
    }

    #[test]
    fn a_fleet_without_nodes_is_reported() {
        let page = status_page(&FleetView::default().report(0), Duration::from_secs(12));
        assert!(page.starts_with("no edge node was heard in 12s; an edge node of rungd"), "{page}");
        let alarms = FleetView::default().alarms(0);
        let page = alarms_page(&alarms, Duration::from_secs(12), &LocalClock::here());
        assert!(page.starts_with("no edge node was heard in 12s; an edge node of rungd"), "{page}");
    }
}
