//! The history of alarms for other programs: its figures as JSON, and every time of every alarm as
//! CSV.
//!
//! Called by `alarm_history`, which has the page for people.

use std::io::{BufWriter, Write};

use anyhow::Result;
use serde_json::{Value, json};

use super::terminal::csv_field;
use super::when::universal;
use rungd_history::playback::{AlarmFigures, AlarmHistory, AlarmSpan, SpanBegin, SpanEnd};

/// The columns of the CSV file.
const COLUMNS: &str = "alarm,text,priority,group,scan,from,to,seconds,begin,end";

/// Writes every time of every alarm, in the order in which they began; those of one scan in the
/// order of execution.
///
/// # Errors
/// Standard output cannot be written.
pub(super) fn write_csv(history: &AlarmHistory) -> Result<()> {
    let mut out = BufWriter::new(std::io::stdout().lock());
    writeln!(out, "{COLUMNS}")?;
    let mut spans: Vec<&AlarmSpan> = history.spans.iter().collect();
    spans.sort_by_key(|span| (span.from_ns, span.order));
    for span in spans {
        let alarm = &history.alarms[span.alarm];
        let (begin, end) = (begin_word(span.begin), end_word(span.end));
        let ms = span.lasted_ns() / 1_000_000;
        writeln!(
            out,
            "{},{},{},{},{},{},{},{}.{:03},{begin},{end}",
            csv_field(&alarm.tag),
            csv_field(&alarm.text),
            alarm.priority.name(),
            csv_field(alarm.group.as_deref().unwrap_or_default()),
            span.scan,
            universal(span.from_ns),
            universal(span.to_ns),
            ms / 1000,
            ms % 1000,
        )?;
    }
    out.flush()?;
    Ok(())
}

/// The figures of all alarms that rose or stood.
pub(super) fn json(history: &AlarmHistory) -> Value {
    let alarms: Vec<Value> = history.shown_alarms().map(alarm_json).collect();
    let mut all = json!({
        "scans": history.scans,
        "gaps": history.gaps,
        "unplayable_sections": history.unplayable,
        "alarms": alarms,
    });
    if let Some(span) = history.span() {
        all["from"] = universal(*span.start()).into();
        all["to"] = universal(*span.end()).into();
    }
    all
}

fn alarm_json(alarm: &AlarmFigures) -> Value {
    let seconds = |ns: u64| (ns / 1_000_000) as f64 / 1000.0;
    let mut all = json!({
        "tag": alarm.tag,
        "text": alarm.text,
        "priority": alarm.priority.name(),
        "rises": alarm.rises,
        "seconds": seconds(alarm.stood_ns),
        "longest_seconds": seconds(alarm.longest_ns),
        "chatters": alarm.chatters,
        "stands": alarm.stands,
    });
    if let Some(group) = &alarm.group {
        all["group"] = group.as_str().into();
    }
    all
}

fn begin_word(begin: SpanBegin) -> &'static str {
    match begin {
        SpanBegin::Rose => "rose",
        SpanBegin::Before => "before",
    }
}

fn end_word(end: SpanEnd) -> &'static str {
    match end {
        SpanEnd::Gone => "gone",
        SpanEnd::Removed => "removed",
        SpanEnd::Gap => "gap",
        SpanEnd::Stands => "stands",
    }
}
