//! `rungd alarms --since`: the history of alarms, from the scan log: the most frequent, the
//! longest, those that chatter.
//!
//! Called by `alarms`; `alarm_spans` has the forms for other programs, JSON and CSV.
//! The scan log is that of a path, or of the running controller: on its disk, else in its memory.

use std::cmp::Reverse;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Result;

use super::alarm_spans;
use super::exit::Exit;
use super::operator::OperatorArgs;
use super::recording;
use super::replay_window::ReplayWindow;
use super::terminal::{one_line, say_line};
use super::when::{LocalClock, WrittenTime};
use rungd_base::duration_text::duration_text;
use rungd_client::operator::client::CallFailure;
use rungd_client::operator::protocol::{ControllerStatus, RefusalKind, Request, RequestRefusal};
use rungd_history::playback::{AlarmFigures, AlarmHistory, AlarmSpan, SpanBegin, SpanEnd};
use rungd_history::record::Recording;
use rungd_lab::testing::line_judge;
use rungd_language::source::wording::counted;

/// The most alarms in a list of the page.
const LISTED_MAX: usize = 20;

/// What to show of the history.
#[derive(Clone, Copy, Debug)]
pub(super) struct HistoryRequest<'a> {
    pub since: &'a WrittenTime,
    pub until: Option<&'a WrittenTime>,
    pub recording: Option<&'a PathBuf>,
    /// Only the alarms of this group.
    pub group: Option<&'a str>,
    pub csv: bool,
}

/// Prints the history.
///
/// # Errors
/// The recording cannot be read, or standard output cannot be written.
pub(super) fn history(request: HistoryRequest<'_>, at: &OperatorArgs) -> Result<Exit> {
    let recording = match request.recording {
        Some(path) => recording::opened(path)?,
        None => match of_controller(at) {
            Ok(recording) => recording,
            Err(exit) => return Ok(exit),
        },
    };
    recording::tell_flaws(&recording);
    let (recording, clock) = (Arc::new(recording), LocalClock::here());
    let window = ReplayWindow::of(Some(request.since), request.until, &clock, &recording);
    let window = match window {
        Ok(window) => window,
        Err(why) => {
            return Ok(refused(at, &why));
        }
    };
    let is_shown = |scan: &_| window.has(scan);
    let mut history = AlarmHistory::of(&recording, window.sections.clone(), is_shown, line_judge);
    if let Some(group) = request.group {
        history.retain_group(group);
    }
    if history.more > 0 {
        say_line(&format!("note: {} more times are counted, but not listed", history.more));
    }
    if request.csv {
        alarm_spans::write_csv(&history)?;
    } else {
        at.print(&alarm_spans::json(&history), || page(&history, &clock))?;
    }
    Ok(Exit::Ok)
}

/// Prints a refusal.
fn refused(at: &OperatorArgs, why: &str) -> Exit {
    let (kind, message) = (RefusalKind::Refused, why.to_owned());
    at.print_failure(&CallFailure::Refused(RequestRefusal { kind, message, mistakes: Vec::new() }))
}

/// The scan log of the running controller: on its disk, else in its memory. `Err` is the exit code
/// of a refusal, which has been printed.
fn of_controller(at: &OperatorArgs) -> Result<Recording, Exit> {
    let status: ControllerStatus = at.ask(&Request::Status {})?;
    let Some(disk) = status.record.disk else {
        let reach = duration_text(status.record.memory_ms.saturating_mul(1_000_000));
        say_line(&format!(
            "note: the scan log is in memory alone, and reaches back {reach}: `[record] dir` keeps \
             more"
        ));
        return recording::live(at).map(|(recording, _)| recording);
    };
    recording::opened(&PathBuf::from(&disk.dir)).map_err(|error| {
        say_line(&format!(
            "rungd: the scan log cannot be read: {error:#}; who may read the folder can name it: \
             `--recording {}`",
            disk.dir
        ));
        Exit::Io
    })
}

/// The page: the whole, then the lists.
fn page(history: &AlarmHistory, clock: &LocalClock) -> String {
    let mut lines = vec![headline(history, clock)];
    let mut alarms: Vec<&AlarmFigures> = history.shown_alarms().collect();
    alarms.sort_by(|a, b| b.rises.cmp(&a.rises).then(b.stood_ns.cmp(&a.stood_ns)));
    let mut spans: Vec<&AlarmSpan> = history.spans.iter().collect();
    spans.sort_by_key(|span| (Reverse(span.lasted_ns()), span.order));
    let chattering = alarms.iter().filter(|alarm| alarm.chatters > 0);
    let chattering = chattering.map(|alarm| chatter(alarm)).collect::<Vec<_>>();
    if alarms.is_empty() {
        lines.push("no alarm rose, and none stood".to_owned());
    }
    add_list(&mut lines, "most frequent", alarms.iter().map(|alarm| frequent(alarm)));
    let longest = spans.iter().map(|span| longest(history, span, clock));
    add_list(&mut lines, "longest", longest);
    add_list(&mut lines, "chattering: three times or more within a minute", chattering.into_iter());
    lines.iter().map(|line| format!("{}\n", one_line(line.trim_end()))).collect()
}

/// Adds a list with its title, unless it is empty: its first entries, and the number of the others.
fn add_list(lines: &mut Vec<String>, title: &str, entries: impl ExactSizeIterator<Item = String>) {
    let count = entries.len();
    lines.extend((count > 0).then(|| title.to_owned()));
    lines.extend(entries.take(LISTED_MAX));
    let more = count.saturating_sub(LISTED_MAX);
    lines.extend((more > 0).then(|| format!("         … and {more} more")));
}

fn headline(history: &AlarmHistory, clock: &LocalClock) -> String {
    let mut line = match history.span() {
        Some(span) => format!(
            "{} to {}: {}",
            clock.text(*span.start()),
            clock.end_text(*span.start(), *span.end()),
            counted(history.scans, "scan")
        ),
        None => "no scan".to_owned(),
    };
    if history.gaps > 0 {
        line += &format!(", {}", counted(history.gaps, "gap"));
    }
    if history.unplayable > 0 {
        line += &format!(", {} cannot be executed", counted(history.unplayable, "section"));
    }
    line
}

/// `   412 times  p1.failed: no answer (high, Pumps), 2m10s in all`.
fn frequent(alarm: &AlarmFigures) -> String {
    let times = if alarm.rises == 1 { "time " } else { "times" };
    let stands = if alarm.stands { ", stands" } else { "" };
    let stood = duration_text(alarm.stood_ns);
    format!("{:>8} {times}  {}, {stood} in all{stands}", alarm.rises, named(alarm))
}

fn longest(history: &AlarmHistory, span: &AlarmSpan, clock: &LocalClock) -> String {
    let alarm = &history.alarms[span.alarm];
    let begin = if span.begin == SpanBegin::Before { "before " } else { "" };
    let end = match span.end {
        SpanEnd::Gone => "",
        SpanEnd::Removed => ", until a reload removed it",
        SpanEnd::Gap => ", then a gap",
        SpanEnd::Stands => ", stands",
    };
    let (lasted, from) = (duration_text(span.lasted_ns()), clock.text(span.from_ns));
    format!("{lasted:>14}  {}, from {begin}{from} (scan {}){end}", named(alarm), span.scan)
}

fn chatter(alarm: &AlarmFigures) -> String {
    let times = if alarm.chatters == 1 { "time " } else { "times" };
    format!("{:>8} {times}  {}", alarm.chatters, named(alarm))
}

fn named(alarm: &AlarmFigures) -> String {
    let group = alarm.group.iter().map(|group| format!(", {group}")).collect::<String>();
    format!("{}: {} ({}{group})", alarm.tag, alarm.text, alarm.priority.name())
}
