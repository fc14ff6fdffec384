//! The log: text for people, JSON for machines, entries with fields for the journal.
//!
//! Its form is decided once at start from the arguments, the environment and what standard error
//! is. A line is formed by `log_form`, counted against its event's limit by `events::limit`, and
//! goes through `log_queue`, so that logging never waits.

use std::fs::File;
use std::io::{self, IsTerminal};
use std::os::fd::AsFd;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::OnceLock;
use std::time::SystemTime;

use clap::ValueEnum;
use tracing::Subscriber;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::layer::{Context, SubscriberExt};
use tracing_subscriber::{Layer, Registry, reload};

use super::journal::{self, Socket};
use super::log_form::LogLine;
pub use super::log_queue::lines_dropped;
use super::log_queue::{Formed, LogQueue};
use crate::events::Level;
use crate::say;

/// The form of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// Time, level, code, event, a sentence and key=value fields.
    Text,
    /// One JSON object a line.
    Json,
    /// Entries with fields for the systemd journal, or where it does not listen lines with a
    /// priority (`<6>`); chosen by itself under systemd.
    Journal,
}

/// The environment variable that stands for `--log-level`.
pub const LEVEL_VARIABLE: &str = "RUNGD_LOG";

/// The log; to be flushed at the end of the process.
pub struct Log(LogQueue);

impl Log {
    /// Waits until what was logged is written; a second at most.
    pub fn flush(&self) {
        self.0.flush();
    }
}

type Filtered = reload::Layer<LevelFilter, Registry>;

/// The level of the process's log, to be changed while it runs.
static LEVEL: OnceLock<reload::Handle<LevelFilter, Registry>> = OnceLock::new();

/// Sets the least urgent level that is logged.
pub fn set_level(level: Level) {
    if let Some(handle) = LEVEL.get() {
        let _ = handle.modify(|filter| *filter = self::filter(level));
    }
}

/// The least urgent level that is logged.
pub fn level() -> Level {
    let filter = LEVEL.get().and_then(|handle| handle.clone_current());
    level_of(filter.unwrap_or(LevelFilter::INFO))
}

/// Starts the log of the process. `socket` is where the journal listens, if elsewhere than usual.
///
/// # Errors
/// [`LEVEL_VARIABLE`] is no level, or the machine gives no thread.
pub fn init(
    format: Option<LogFormat>,
    level: Option<Level>,
    socket: Option<&Path>,
) -> anyhow::Result<Log> {
    let level = match level {
        Some(level) => level,
        None => level_of_environment(std::env::var(LEVEL_VARIABLE).ok().as_deref())?,
    };
    let format = format.unwrap_or_else(choose);
    let socket = socket.unwrap_or(Path::new(journal::SOCKET));
    let socket = if format == LogFormat::Journal { Socket::new(socket) } else { None };
    let form = match format {
        LogFormat::Text => LineForm::Text { color: io::stderr().is_terminal() },
        LogFormat::Json => LineForm::Json,
        LogFormat::Journal => LineForm::Journal { entries: socket.is_some() },
    };
    let queue = LogQueue::new(io::stderr(), socket)?;
    let (filter, handle) = reload::Layer::new(filter(level));
    let _ = LEVEL.set(handle);
    // Only a second call in one process fails, and then a log is there already.
    let _ = tracing::subscriber::set_global_default(subscriber(form, filter, queue.clone()));
    Ok(Log(queue))
}

/// Whether the log of this process is read by people rather than machines.
pub fn is_for_people(format: Option<LogFormat>) -> bool {
    format.unwrap_or_else(choose) == LogFormat::Text
}

fn level_of_environment(value: Option<&str>) -> anyhow::Result<Level> {
    let Some(value) = value.filter(|v| !v.is_empty()) else { return Ok(Level::Info) };
    Level::from_str(value, true).map_err(|_| {
        anyhow::anyhow!(
            "{LEVEL_VARIABLE}={value}: not a level; write error, warn, info, debug or trace"
        )
    })
}

/// The journal's form if standard error is the journal's stream, which `JOURNAL_STREAM` names by
/// device and inode; a variable that was merely inherited does not match.
fn choose() -> LogFormat {
    let stream = std::env::var("JOURNAL_STREAM").unwrap_or_default();
    let here = io::stderr().as_fd().try_clone_to_owned().and_then(|fd| File::from(fd).metadata());
    match here {
        Ok(here) if is_stream(&stream, here.dev(), here.ino()) => LogFormat::Journal,
        _ => LogFormat::Text,
    }
}

fn is_stream(variable: &str, device: u64, inode: u64) -> bool {
    variable.split_once(':').is_some_and(|(d, i)| d.parse() == Ok(device) && i.parse() == Ok(inode))
}

fn filter(level: Level) -> LevelFilter {
    LevelFilter::from_level(say::level(level))
}

fn level_of(filter: LevelFilter) -> Level {
    match filter {
        LevelFilter::TRACE => Level::Trace,
        LevelFilter::DEBUG => Level::Debug,
        LevelFilter::INFO => Level::Info,
        LevelFilter::WARN => Level::Warn,
        _ => Level::Error,
    }
}

/// How a line is formed.
#[derive(Clone, Copy)]
enum LineForm {
    Text {
        color: bool,
    },
    Json,
    /// With an entry for the journal's socket beside the line, where there is one.
    Journal {
        entries: bool,
    },
}

fn subscriber(form: LineForm, filter: Filtered, queue: LogQueue) -> impl Subscriber + Send + Sync {
    tracing_subscriber::registry().with(filter).with(Voice { form, queue })
}

/// The layer that turns events into lines.
struct Voice {
    form: LineForm,
    queue: LogQueue,
}

impl<S: Subscriber> Layer<S> for Voice {
    fn on_event(&self, event: &tracing::Event<'_>, _: Context<'_, S>) {
        let line = LogLine::of(event);
        // At level debug, the lines have no limit.
        let limited = LevelFilter::current() < LevelFilter::DEBUG;
        if let Some(event) = line.event.filter(|_| limited)
            && !self.queue.may_write(event)
        {
            return;
        }
        let (now, detail) = (SystemTime::now(), line.level > tracing::Level::INFO);
        let (line, entry) = match self.form {
            LineForm::Text { color } => (line.text(now, color), Vec::new()),
            LineForm::Json => (line.json(now), Vec::new()),
            LineForm::Journal { entries: false } => (line.with_priority(), Vec::new()),
            LineForm::Journal { entries: true } => (line.with_priority(), line.entry()),
        };
        self.queue.push(Formed { line, entry, detail });
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::say::say;

    #[derive(Clone, Default)]
    struct Sink(Arc<Mutex<Vec<u8>>>);

    impl Write for Sink {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn logged(form: LineForm, level: Level) -> String {
        let sink = Sink::default();
        let queue = LogQueue::new(sink.clone(), None).unwrap();
        let (filter, _handle) = reload::Layer::new(filter(level));
        tracing::subscriber::with_default(subscriber(form, filter, queue.clone()), || {
            say!(ALARM_ON, tag = %"jam", scan = 7, "alarm ON: Bottles jammed");
            say!(STAGE_ON at Debug, ms = 1.0, on = true, "a\ndetail");
        });
        queue.flush();
        let bytes = sink.0.lock().unwrap().clone();
        String::from_utf8(bytes).unwrap()
    }

    const SENTENCE: &str = "RUNGD-0301 alarm-on: alarm ON: Bottles jammed tag=jam scan=7\n";

    #[test]
    fn a_journal_that_reads_lines_gets_priorities_and_the_fields_in_the_message() {
        let form = LineForm::Journal { entries: false };
        assert_eq!(logged(form, Level::Info), format!("<4>{SENTENCE}"));
        let both = format!("<4>{SENTENCE}<7>RUNGD-0404 stage-on: a detail ms=1.0 on=true\n");
        assert_eq!(logged(form, Level::Debug), both);
    }

    #[test]
    fn people_get_time_and_level_and_no_escape_codes() {
        let text = logged(LineForm::Text { color: false }, Level::Info);
        let (time, rest) = text.split_at(27);
        assert!(time.ends_with('Z'), "{time}");
        assert_eq!(rest, format!("  WARN {SENTENCE}"));
        let colored = logged(LineForm::Text { color: true }, Level::Info);
        assert!(colored.contains(&format!(" \x1b[33m WARN\x1b[0m {SENTENCE}")), "{colored:?}");
    }

    #[test]
    fn machines_get_an_object_a_line() {
        let text = logged(LineForm::Json, Level::Debug);
        let mut values = text.lines().map(|line| serde_json::from_str(line).expect(line));
        let value: serde_json::Value = values.next().unwrap();
        assert_eq!((&value["level"], &value["code"]), (&"WARN".into(), &"RUNGD-0301".into()));
        assert_eq!(value["event"], "alarm-on");
        assert_eq!(value["message"], "alarm ON: Bottles jammed");
        assert_eq!((&value["tag"], &value["scan"]), (&"jam".into(), &7.into()));
        let value: serde_json::Value = values.next().unwrap();
        assert_eq!((&value["ms"], &value["on"]), (&1.0.into(), &true.into()));
    }

    #[test]
    fn the_journals_stream_is_known_by_device_and_inode() {
        assert!(is_stream("8:1234", 8, 1234));
        assert!(!is_stream("8:1234", 8, 1235) && !is_stream("", 0, 0) && !is_stream("x:y", 1, 2));
    }

    #[test]
    fn a_level_in_the_environment() {
        assert_eq!(level_of_environment(None).unwrap(), Level::Info);
        assert_eq!(level_of_environment(Some("WARN")).unwrap(), Level::Warn);
        assert!(level_of_environment(Some("loud")).is_err());
    }
}
