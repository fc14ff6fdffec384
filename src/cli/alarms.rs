//! `rungd alarms`: lists the alarms of a running controller, each with an explanation.
//!
//! The controller returns the list. The explanations are shortened answers of `rungd why`; this
//! command makes them from the recording of the last minute.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Result;
use clap::Args;

use super::alarm_history::{self, HistoryRequest};
use super::exit::Exit;
use super::operator::OperatorArgs;
use super::terminal::{one_line, say_line};
use super::when::{LocalClock, WrittenTime};
use rungd_base::duration_text::duration_text;
use rungd_client::operator::protocol::{
    AlarmList, AlarmShelf, AlarmState, AlarmStatus, AlarmTime, RecordingBytes, Request, alarm_count,
};
use rungd_history::observe::{Limits, QuestionTime, Subject};
use rungd_history::playback::{self, RecordedQuestion};
use rungd_history::record::Recording;

/// The maximum number of alarms that are explained: the first of an episode explain the others.
const EXPLAINED_MAX: usize = 8;
/// The number of levels of reasons that are followed.
const DEPTH: u32 = 1;
/// The maximum number of lines of an explanation.
const LINES_MAX: usize = 4;

/// Lists the alarms of a running controller, each with an explanation
///
/// First the active alarms, in the order in which they rose; then the alarms that returned before
/// anybody acknowledged them; then those that are shelved. `rungd ack` acknowledges alarms. With
/// `--since` it is the history of alarms in the scan log: the most frequent, the longest, those
/// that chatter.
#[derive(Args, Debug)]
pub struct AlarmsArgs {
    /// Only the alarms of this group
    #[arg(long, value_name = "GROUP")]
    group: Option<String>,
    /// The history from this time on: `-24h` (before the end of the recording), `10:02`,
    /// `yesterday 23:50`
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = WrittenTime::parse)]
    since: Option<WrittenTime>,
    /// The end of the history (default: the end of the recording)
    #[arg(
        long, value_name = "TIME", requires = "since", allow_hyphen_values = true,
        value_parser = WrittenTime::parse
    )]
    until: Option<WrittenTime>,
    /// A recording: a file, or a folder as `[record] dir` names it (default: the scan log of the
    /// running controller)
    #[arg(long, value_name = "RECORDING", requires = "since")]
    recording: Option<PathBuf>,
    /// Each time of each alarm as a line of CSV
    #[arg(long, requires = "since", conflicts_with = "json")]
    csv: bool,
    #[command(flatten)]
    at: OperatorArgs,
}

/// Lists the alarms.
///
/// # Errors
/// Standard output cannot be written.
pub fn alarms(args: &AlarmsArgs) -> Result<Exit> {
    if let Some(since) = &args.since {
        let (until, recording) = (args.until.as_ref(), args.recording.as_ref());
        let (group, csv) = (args.group.as_deref(), args.csv);
        let request = HistoryRequest { since, until, recording, group, csv };
        return alarm_history::history(request, &args.at);
    }
    let mut list: AlarmList = match args.at.ask(&Request::Alarms {}) {
        Ok(list) => list,
        Err(exit) => return Ok(exit),
    };
    if args.group.is_some() {
        list.alarms.retain(|alarm| alarm.group == args.group);
    }
    let mut untold = None;
    args.at.print(&list, || {
        let reasons = reasons(args, &list).unwrap_or_else(|why| {
            untold = Some(why);
            Vec::new()
        });
        page(&list, &reasons, &LocalClock::here())
    })?;
    if let Some(why) = untold {
        say_line(&format!("note: the alarms are not explained: {why}"));
    }
    Ok(Exit::Ok)
}

/// The text of the whole list. `reasons`: the explanations of the first alarms.
fn page(list: &AlarmList, reasons: &[Vec<String>], clock: &LocalClock) -> String {
    let mut lines = vec![alarm_count(list.alarms.iter())];
    if list.alarms.is_empty() {
        lines[0] += ", and none waits for an acknowledgement";
    }
    for (at, alarm) in list.alarms.iter().enumerate() {
        let number = if alarm.is_standing() { alarm.order.to_string() } else { "-".to_owned() };
        lines.push(format!("{number:>3}  {}: {}", alarm.tag, alarm.text));
        lines.push(format!("     {}", facts(alarm, clock)));
        let of_watch = alarm.watch_lines();
        let reasons = reasons.get(at).into_iter().flatten().chain(&of_watch);
        lines.extend(reasons.map(|line| format!("     {line}")));
    }
    lines.iter().map(|line| format!("{}\n", one_line(line.trim_end()))).collect()
}

/// The priority, acknowledgement, times and number of rises of an alarm.
pub(super) fn facts(alarm: &AlarmStatus, clock: &LocalClock) -> String {
    let acknowledged = match (&alarm.shelved, alarm.state, &alarm.acknowledged) {
        (Some(shelf), ..) => shelf_words(shelf, alarm, clock),
        (None, AlarmState::Acknowledged, Some(ack)) => {
            format!("acknowledged by {} at {}", ack.who, clock.text(ack.unix_ns))
        }
        (None, AlarmState::Acknowledged, None) => "acknowledged".to_owned(),
        (None, AlarmState::Normal | AlarmState::Unacknowledged | AlarmState::Returned, _) => {
            "NOT ACKNOWLEDGED".to_owned()
        }
    };
    let time = |time: &AlarmTime| format!("{} (scan {})", clock.text(time.unix_ns), time.scan);
    let lasted = duration_text(alarm.lasted_ms.saturating_mul(1_000_000));
    let when = match (&alarm.since, &alarm.ended) {
        (Some(since), Some(ended)) => {
            format!("from {} to {}, for {lasted}", time(since), time(ended))
        }
        (Some(since), None) => format!("since {}, for {lasted}", time(since)),
        (None, _) if alarm.shelved.is_some() => "never ON since rungd started".to_owned(),
        (None, _) => "since just now".to_owned(),
    };
    let often = if alarm.day == 1 { "time" } else { "times" };
    let priority = alarm.priority.name();
    let group = alarm.group.iter().map(|group| format!("{group}, ")).collect::<String>();
    format!("{priority}, {group}{acknowledged}, {when}; {} {often} in the last day", alarm.day)
}

/// Who shelved an alarm, until when and why, and whether its bit is ON.
fn shelf_words(shelf: &AlarmShelf, alarm: &AlarmStatus, clock: &LocalClock) -> String {
    let AlarmShelf { who, why, since_ns, until_ns } = shelf;
    let bit = if alarm.state.is_active() { "ON" } else { "OFF" };
    let end = match until_ns {
        Some(until_ns) => format!("SHELVED by {who} until {}", clock.text(*until_ns)),
        None => format!("OUT OF SERVICE by {who} since {}", clock.text(*since_ns)),
    };
    format!("{end}: {why}; now {bit}")
}

/// The explanations of the first active alarms, a few lines each; none for a watch, which has its
/// own.
///
/// # Errors
/// The user may not read the recording, or it cannot be used.
fn reasons(args: &AlarmsArgs, list: &AlarmList) -> Result<Vec<Vec<String>>, String> {
    let active = list.alarms.iter().take_while(|alarm| alarm.is_standing());
    let stand: Vec<&AlarmStatus> = active.take(EXPLAINED_MAX).collect();
    if stand.iter().all(|alarm| alarm.watch.is_some()) {
        return Ok(Vec::new());
    }
    let answer: RecordingBytes = args
        .at
        .try_ask(&Request::Recording { from_section: None })
        .map_err(|failure| failure.to_string())?;
    let bytes = answer.bytes().ok_or("the controller's answer is not a recording")?;
    let recording = Arc::new(Recording::of_bytes(bytes));
    let last = recording.count().checked_sub(1).ok_or("the recording is empty")?;
    let subject = playback::subject(recording.program(last))?;
    let explained = stand.into_iter().map(|alarm| match &alarm.watch {
        Some(_) => Vec::new(),
        None => reason(&subject, &recording, last, alarm),
    });
    Ok(explained.collect())
}

/// The first lines of the answer to `rungd why`, without its head, for the scan in which the alarm
/// rose. If the recording does not contain that scan, or has a different program there, the answer
/// is for the latest scan.
fn reason(
    subject: &Subject,
    recording: &Arc<Recording>,
    last: usize,
    alarm: &AlarmStatus,
) -> Vec<String> {
    let rise = alarm.since.as_ref().and_then(|since| {
        let section = recording.place_of_scan(since.scan)?;
        let is_same = recording.program(section) == recording.program(last);
        is_same.then_some((section, QuestionTime::Scan(since.scan)))
    });
    let (section, at) = rise.unwrap_or((last, QuestionTime::Now));
    let limits = Limits { depth: DEPTH, change: false, ..Limits::default() };
    let question = RecordedQuestion { section, at, limits };
    match playback::why(subject, recording, &alarm.tag, question) {
        Ok(answer) => short(&answer.text()),
        Err(why) => vec![format!("not explained: {why}")],
    }
}

/// The shortened answer: its first lines, without the head and the description.
fn short(text: &str) -> Vec<String> {
    let told = text.lines().skip(1).filter(|line| !line.starts_with("  ("));
    let lines: Vec<&str> = told.map(|line| line.strip_prefix("  ").unwrap_or(line)).collect();
    let mut short: Vec<String> = lines.iter().take(LINES_MAX).map(|line| (*line).into()).collect();
    if lines.len() > LINES_MAX {
        short.push("…".to_owned());
    }
    short
}
