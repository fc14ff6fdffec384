//! `rungd record info`: the text and the JSON of a recording's summary.
//!
//! `record` makes the summary; the command is in `record`.

use serde_json::Value;

use super::recorded_trace::seconds;
use super::terminal::one_line;
use super::when::LocalClock;
use rungd_history::record::{RecordingSummary, SummaryChange, SummaryGap};
use rungd_language::source::wording::{counted, thousands};

/// The maximum number of changes, and of gaps, that the text lists.
const LISTED_MAX: usize = 12;

/// The summary as text.
pub(super) fn text(summary: &RecordingSummary, clock: &LocalClock) -> String {
    let Some((begin_ns, end_ns)) = summary.begin_unix_ns.zip(summary.end_unix_ns) else {
        return "nothing is recorded\n".into();
    };
    let mut text = String::new();
    let mut line = |name: &str, value: String| text += &format!("{name:<11} {value}\n");
    let mut controllers: Vec<_> =
        summary.programs.iter().map(|program| one_line(&program.controller)).collect();
    controllers.dedup();
    line("controller", controllers.join(", "));
    for program in &summary.programs {
        let names: Vec<_> = program.files.iter().map(|file| one_line(file)).collect();
        let hash = one_line(program.sha256.get(..12).unwrap_or_default());
        let (from, version) = (one_line(&program.source), one_line(&program.version));
        line("program", format!("{hash} ({from}, rungd {version}): {}", names.join(" ")));
    }
    let (begin, end) = (clock.text(begin_ns), clock.text(end_ns));
    line("recorded", format!("{begin} to {end}"));
    let (scans, first, last) = (thousands(summary.scans), summary.first_scan, summary.last_scan);
    line("scans", format!("{scans}, from {first} to {last}; {}", period(summary)));
    let (sections, images) = (summary.sections as u64, summary.base_images as u64);
    let (sections, images) = (counted(sections, "section"), counted(images, "base image"));
    let damaged = match summary.damaged_sections {
        0 => String::new(),
        damaged => format!("; damaged: {}", counted(damaged, "section")),
    };
    line("stored as", format!("{sections} with {images}{damaged}"));
    let a_day = summary.bytes_per_day.map_or(String::new(), |bytes| {
        format!("; {:.1} MB a day at this rate", bytes as f64 / 1e6)
    });
    line("size", format!("{} bytes{a_day}", thousands(summary.bytes)));
    line("begins", proof(summary).to_owned());
    let change = |summary_change: &SummaryChange| {
        format!("{} {}", clock.text(summary_change.unix_ns), summary_change.what)
    };
    list(&mut line, "changes", summary.changes.iter().map(change).collect());
    let gap = |summary_gap: &SummaryGap| {
        format!(
            "{} after {}: {}",
            clock.text(summary_gap.unix_ns),
            seconds(summary_gap.after_ns),
            summary_gap.what
        )
    };
    list(&mut line, "gaps", summary.gaps.iter().map(gap).collect());
    text
}

fn period(summary: &RecordingSummary) -> String {
    summary.period_ns.map_or_else(
        || "no two scans".to_owned(),
        |ns| format!("one every {:.3} ms (median)", ns as f64 / 1e6),
    )
}

fn proof(summary: &RecordingSummary) -> &'static str {
    if summary.begins_run {
        "with the start of RUN: every hash can be computed from there"
    } else {
        "within RUN or STOP: with a recorded image of memory"
    }
}

/// The summary as JSON.
///
/// # Errors
/// None is expected: a summary is made of numbers and texts.
pub(super) fn json(summary: &RecordingSummary) -> serde_json::Result<Value> {
    let mut json = serde_json::to_value(summary)?;
    for (at, program) in summary.programs.iter().enumerate() {
        json["programs"][at]["controller"] = Value::from(one_line(&program.controller));
    }
    Ok(json)
}

/// Writes a list with its name. A long list is shortened.
fn list(line: &mut impl FnMut(&str, String), name: &str, all: Vec<String>) {
    let more = all.len().saturating_sub(LISTED_MAX);
    if all.is_empty() {
        line(name, "none".to_owned());
    }
    for (at, one) in all.into_iter().take(LISTED_MAX).enumerate() {
        line(if at == 0 { name } else { "" }, one);
    }
    if more > 0 {
        line("", format!("… and {more} more: `rungd record info --json` has all"));
    }
}
