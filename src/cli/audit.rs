//! `rungd audit`: who has changed what: the audit trail of a log, as text, JSON or CSV.
//!
//! The trail is the log itself; nothing else keeps it. `audit_source` reads it, and `audit_verify`
//! judges its chain.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde_json::{Value, json};

use super::audit_source::{AuditSource, AuditedLine};
use super::audit_verify::ChainCheck;
use super::exit::Exit;
use super::terminal::{csv_field, one_line, plain_json, print, say_line};
use super::when::{LocalClock, RecordingPlace, WrittenTime, universal};
use crate::daemon::log_chain::ChainLink;
use crate::daemon::log_reading::LoggedLine;

/// Shows who has changed what: writes, forces, modes, acknowledgements, shelves, reloads
///
/// Reads the log of a controller: of the service's journal, or of files. It has a line for each
/// change by a person, with the old value, the new one and the reason, for refused ones, for
/// starts and ends, and for lines that the log has lost.
#[derive(Args, Debug)]
pub struct AuditArgs {
    /// Files of the log, the oldest first: text, JSON, or the output of `journalctl -o json`; `-`
    /// is standard input (default: the journal)
    #[arg(value_name = "FILE")]
    files: Vec<PathBuf>,
    /// From this time on: `-24h` (before now), `10:02`, `yesterday 23:50`
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = WrittenTime::parse)]
    since: Option<WrittenTime>,
    /// Up to this time
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = WrittenTime::parse)]
    until: Option<WrittenTime>,
    /// Only the changes by this user, or on behalf of it
    #[arg(long, value_name = "USER")]
    who: Option<String>,
    /// The unit of the journal
    #[arg(long, value_name = "UNIT", default_value = "rungd", conflicts_with = "files")]
    unit: String,
    /// Judge the chain of the trail instead: whether a line was changed, removed or inserted
    #[arg(long, conflicts_with_all = ["since", "until", "who", "json", "csv"])]
    verify: bool,
    /// A link that the chain must have: one that was copied elsewhere, as NUMBER:HASH
    #[arg(long, value_name = "LINK", requires = "verify", value_parser = parse_link)]
    expect: Option<ChainLink>,
    /// Print one line of JSON
    #[arg(long)]
    json: bool,
    /// Print a line of CSV for each change
    #[arg(long, conflicts_with = "json")]
    csv: bool,
}

fn parse_link(text: &str) -> Result<ChainLink, String> {
    ChainLink::parse(text).ok_or_else(|| {
        "a link is a number, `:` and 64 hexadecimal digits, as `rungd audit --verify` prints it"
            .to_owned()
    })
}

/// Prints the trail, or judges its chain.
///
/// # Errors
/// The log cannot be read, or standard output cannot be written.
pub fn audit(args: &AuditArgs) -> Result<Exit> {
    let source = match args.files.is_empty() {
        true => AuditSource::Journal(&args.unit),
        false => AuditSource::Files(&args.files),
    };
    if args.verify {
        return verify(&source, args.expect);
    }
    let clock = LocalClock::here();
    let span = match AuditSpan::of(args, &clock) {
        Ok(span) => span,
        Err(why) => {
            say_line(&format!("rungd: {why}"));
            return Ok(Exit::Usage);
        }
    };
    let mut out = BufWriter::new(std::io::stdout().lock());
    let mut form = TrailForm::of(args, &clock);
    form.begin(&mut out)?;
    let mut has_lines = false;
    source.each(|AuditedLine { line, .. }| {
        if span.has(&line) && is_by(&line, args.who.as_deref()) {
            has_lines = true;
            form.write(&mut out, &line)?;
        }
        Ok(true)
    })?;
    form.end(&mut out)?;
    out.flush()?;
    if !has_lines {
        say_line(&nothing_found(&source));
    }
    Ok(Exit::Ok)
}

/// What is said of a log without such a line: an empty answer would look like a fault.
fn nothing_found(source: &AuditSource<'_>) -> String {
    match source {
        AuditSource::Files(_) => "no such change in this log".to_owned(),
        AuditSource::Journal(unit) => format!(
            "no such change in the journal of the unit {unit}; of a controller that runs in a \
             terminal, name the file of its log: `rungd audit FILE`"
        ),
    }
}

fn verify(source: &AuditSource<'_>, expect: Option<ChainLink>) -> Result<Exit> {
    let (mut check, mut broken) = (ChainCheck::wanting(expect), None);
    source.each(|audited| {
        broken = check.take(&audited).err();
        Ok(broken.is_none())
    })?;
    let verdict = broken.map_or_else(|| check.verdict(), |broken| Err(broken.to_string()));
    match verdict {
        Ok(text) => print(&format!("{text}\n"))?,
        Err(why) => {
            print(&format!("NOT INTACT: {}\n", one_line(&why)))?;
            return Ok(Exit::Refused);
        }
    }
    Ok(Exit::Ok)
}

/// Whether a change is by a user, or on behalf of it: `anna`, `anna by rungd-web`.
fn is_by(line: &LoggedLine, who: Option<&str>) -> bool {
    let Some(who) = who else { return true };
    line.field("who").is_some_and(|said| said.split(' ').next() == Some(who) || said == who)
}

/// The times of the lines that are shown, ns since 1970 (UTC).
struct AuditSpan {
    from_ns: Option<i64>,
    to_ns: Option<i64>,
}

impl AuditSpan {
    fn of(args: &AuditArgs, clock: &LocalClock) -> Result<AuditSpan, String> {
        let find = |when: Option<&WrittenTime>| match when
            .map(|when| when.find(clock, 0..=clock.now_ns()))
        {
            None => Ok(None),
            Some(RecordingPlace::Time(ns)) => Ok(Some(ns)),
            Some(RecordingPlace::Scan(_)) => Err("a log has no numbers of scans: name a time"),
        };
        Ok(AuditSpan { from_ns: find(args.since.as_ref())?, to_ns: find(args.until.as_ref())? })
    }

    /// A line without a time is shown only if no time is asked for.
    fn has(&self, line: &LoggedLine) -> bool {
        match line.unix_us.map(|us| us.saturating_mul(1000)) {
            Some(ns) => {
                self.from_ns.is_none_or(|from| ns >= from) && self.to_ns.is_none_or(|to| ns <= to)
            }
            None => self.from_ns.is_none() && self.to_ns.is_none(),
        }
    }
}

/// The form of the printed trail.
enum TrailForm<'a> {
    Text(&'a LocalClock),
    Csv,
    /// The number of changes so far.
    Json(u64),
}

/// The columns of the CSV file.
const COLUMNS: &str = "time,event,who,what,old,new,reason,text,chain";

impl TrailForm<'_> {
    fn of<'a>(args: &AuditArgs, clock: &'a LocalClock) -> TrailForm<'a> {
        match (args.json, args.csv) {
            (true, _) => TrailForm::Json(0),
            (false, true) => TrailForm::Csv,
            (false, false) => TrailForm::Text(clock),
        }
    }

    fn begin(&self, out: &mut impl Write) -> Result<()> {
        match self {
            TrailForm::Text(_) => {}
            TrailForm::Csv => writeln!(out, "{COLUMNS}")?,
            TrailForm::Json(_) => write!(out, "{{\"changes\":[")?,
        }
        Ok(())
    }

    fn write(&mut self, out: &mut impl Write, line: &LoggedLine) -> Result<()> {
        match self {
            TrailForm::Text(clock) => {
                let time = line.unix_us.map(|us| clock.text(us.saturating_mul(1000)));
                let (time, text) = (time.unwrap_or_default(), one_line(&line.message));
                writeln!(out, "{time:<23}  {text}")?;
            }
            TrailForm::Csv => writeln!(out, "{}", csv_row(line))?,
            TrailForm::Json(count) => {
                let comma = if *count > 0 { "," } else { "" };
                *count += 1;
                write!(out, "{comma}{}", plain_json(&json_of(line).to_string()))?;
            }
        }
        Ok(())
    }

    fn end(&self, out: &mut impl Write) -> Result<()> {
        if let TrailForm::Json(_) = self {
            writeln!(out, "]}}")?;
        }
        Ok(())
    }
}

/// What a line says, by the names of the columns.
fn parts(line: &LoggedLine) -> [(&'static str, Option<String>); 9] {
    let field = |names: &[&str]| names.iter().find_map(|name| line.field(name)).map(str::to_owned);
    [
        ("time", line.unix_us.map(|us| universal(us.saturating_mul(1000)))),
        ("event", Some(line.event.name.to_owned())),
        ("who", field(&["who"])),
        ("what", field(&["what", "tag", "ladder"])),
        ("old", field(&["before"])),
        ("new", field(&["after"])),
        ("reason", field(&["reason", "why"])),
        ("text", Some(line.message.clone())),
        ("chain", line.link.map(|link| link.to_string())),
    ]
}

fn csv_row(line: &LoggedLine) -> String {
    let fields = parts(line).map(|(_, value)| csv_field(&value.unwrap_or_default()));
    fields.join(",")
}

fn json_of(line: &LoggedLine) -> Value {
    let mut all = json!({});
    for (name, value) in parts(line) {
        if let Some(value) = value {
            all[name] = value.into();
        }
    }
    all
}
