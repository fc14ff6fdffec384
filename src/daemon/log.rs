//! The log's form: text for people, JSON for machines, priorities for the journal.
//!
//! Decided once at start from the arguments, the environment and what standard error is. All of it
//! goes through `log_queue`, so that logging never waits.

use std::fmt;
use std::fs::File;
use std::io::{self, IsTerminal};
use std::os::fd::AsFd;
use std::os::unix::fs::MetadataExt;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, OnceLock};

use clap::ValueEnum;
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::fmt::format::{Format, Full, Writer};
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::reload;

use super::log_queue::LogQueue;

/// The form of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// Sentences with time, level and key=value fields.
    Text,
    /// One JSON object a line.
    Json,
    /// A priority (`<6>`) before each line, no time of its own; chosen by itself under systemd.
    Journal,
}

/// What is logged, from the level named on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[allow(missing_docs)]
pub enum LogLevel {
    Error,
    Warn,
    Info,
    Debug,
    Trace,
}

type SetLevel = Box<dyn Fn(LevelFilter) + Send + Sync>;

static LEVEL: AtomicU8 = AtomicU8::new(LogLevel::Info as u8);
static SET_LEVEL: OnceLock<SetLevel> = OnceLock::new();

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

/// Starts the log of the process.
///
/// # Errors
/// [`LEVEL_VARIABLE`] is no level, or the machine gives no thread.
pub fn init(format: Option<LogFormat>, level: Option<LogLevel>) -> anyhow::Result<Log> {
    let level = match level {
        Some(level) => level,
        None => level_of_environment(std::env::var(LEVEL_VARIABLE).ok().as_deref())?,
    };
    let queue = LogQueue::new(io::stderr())?;
    let (subscriber, set) = subscriber(format.unwrap_or_else(choose), level, queue.clone());
    LEVEL.store(level as u8, Ordering::Relaxed);
    let _ = SET_LEVEL.set(set);
    // Only a second call in one process fails, and then a log is there already.
    let _ = tracing::subscriber::set_global_default(subscriber);
    Ok(Log(queue))
}

/// The level as it is now.
pub fn level() -> LogLevel {
    match LEVEL.load(Ordering::Relaxed) {
        0 => LogLevel::Error,
        1 => LogLevel::Warn,
        2 => LogLevel::Info,
        3 => LogLevel::Debug,
        _ => LogLevel::Trace,
    }
}

/// Logs from another level on.
pub fn set_level(level: LogLevel) {
    if let Some(set) = SET_LEVEL.get() {
        set(filter(level));
        LEVEL.store(level as u8, Ordering::Relaxed);
    }
}

/// Lines that were dropped since the process started.
pub fn lines_dropped() -> u64 {
    super::log_queue::LINES_DROPPED.load(Ordering::Relaxed)
}

/// Whether the log of this process is read by people rather than machines.
pub fn is_for_people(format: Option<LogFormat>) -> bool {
    format.unwrap_or_else(choose) == LogFormat::Text
}

fn level_of_environment(value: Option<&str>) -> anyhow::Result<LogLevel> {
    let Some(value) = value.filter(|v| !v.is_empty()) else { return Ok(LogLevel::Info) };
    LogLevel::from_str(value, true).map_err(|_| {
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

fn subscriber(
    format: LogFormat,
    level: LogLevel,
    queue: LogQueue,
) -> (Box<dyn Subscriber + Send + Sync>, SetLevel) {
    let builder = tracing_subscriber::fmt()
        .with_max_level(LevelFilter::TRACE)
        .with_writer(queue)
        .with_ansi(format == LogFormat::Text && io::stderr().is_terminal())
        .with_target(false);
    match format {
        LogFormat::Text => adjustable(builder.finish(), level),
        LogFormat::Json => adjustable(builder.json().flatten_event(true).finish(), level),
        LogFormat::Journal => adjustable(builder.event_format(Journal::default()).finish(), level),
    }
}

/// A subscriber from a level on, and the way to change that.
fn adjustable<S>(subscriber: S, level: LogLevel) -> (Box<dyn Subscriber + Send + Sync>, SetLevel)
where
    S: Subscriber + Send + Sync + for<'a> LookupSpan<'a>,
{
    let (layer, handle) = reload::Layer::new(filter(level));
    let set = move |level| {
        let _ = handle.reload(level);
    };
    (Box::new(subscriber.with(layer)), Box::new(set))
}

fn filter(level: LogLevel) -> LevelFilter {
    match level {
        LogLevel::Error => LevelFilter::ERROR,
        LogLevel::Warn => LevelFilter::WARN,
        LogLevel::Info => LevelFilter::INFO,
        LogLevel::Debug => LevelFilter::DEBUG,
        LogLevel::Trace => LevelFilter::TRACE,
    }
}

/// `<6>message key=value`: the journal has the time, the unit and the level from elsewhere.
struct Journal(Arc<Format<Full, ()>>);

impl Default for Journal {
    fn default() -> Self {
        let plain = Format::default().without_time().with_level(false).with_target(false);
        Journal(Arc::new(plain.with_ansi(false)))
    }
}

impl<S, N> FormatEvent<S, N> for Journal
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        write!(writer, "<{}>", priority(*event.metadata().level()))?;
        self.0.format_event(context, writer, event)
    }
}

/// syslog's priorities.
fn priority(level: Level) -> u8 {
    match level {
        Level::ERROR => 3,
        Level::WARN => 4,
        Level::INFO => 6,
        _ => 7,
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::sync::Mutex;

    use super::*;

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

    fn logged(format: LogFormat, level: LogLevel) -> String {
        let sink = Sink::default();
        let queue = LogQueue::new(sink.clone()).unwrap();
        tracing::subscriber::with_default(subscriber(format, level, queue.clone()).0, || {
            tracing::warn!(tag = %"jam", scan = 7, "alarm ON: Bottles jammed");
            tracing::debug!("a detail");
        });
        LogQueue::flush(&queue);
        let bytes = sink.0.lock().unwrap().clone();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn the_journal_gets_priorities_and_the_fields_in_the_message() {
        let line = "<4>alarm ON: Bottles jammed tag=jam scan=7\n";
        assert_eq!(logged(LogFormat::Journal, LogLevel::Info), line);
        let both = format!("{line}<7>a detail\n");
        assert_eq!(logged(LogFormat::Journal, LogLevel::Debug), both);
    }

    #[test]
    fn people_get_time_and_level_and_no_escape_codes() {
        let text = logged(LogFormat::Text, LogLevel::Info);
        let (time, rest) = text.split_at(27);
        assert!(time.ends_with('Z'), "{time}");
        assert_eq!(rest, "  WARN alarm ON: Bottles jammed tag=jam scan=7\n");
    }

    #[test]
    fn machines_get_an_object_a_line() {
        let text = logged(LogFormat::Json, LogLevel::Info);
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["level"], "WARN");
        assert_eq!(value["message"], "alarm ON: Bottles jammed");
        assert_eq!((&value["tag"], &value["scan"]), (&"jam".into(), &7.into()));
    }

    #[test]
    fn the_journals_stream_is_known_by_device_and_inode() {
        assert!(is_stream("8:1234", 8, 1234));
        assert!(!is_stream("8:1234", 8, 1235) && !is_stream("", 0, 0) && !is_stream("x:y", 1, 2));
    }

    #[test]
    fn a_level_in_the_environment() {
        assert_eq!(level_of_environment(None).unwrap(), LogLevel::Info);
        assert_eq!(level_of_environment(Some("WARN")).unwrap(), LogLevel::Warn);
        assert!(level_of_environment(Some("loud")).is_err());
    }
}
