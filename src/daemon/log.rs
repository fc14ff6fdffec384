//! The log: text for people, JSON for machines, entries with fields for the journal.
//!
//! Its form is decided once at start from the arguments, the environment and the kind of standard
//! error. `log_rules` decides which lines are written. `events::limit` counts a line against its
//! event's limit, `log_form` forms it, and `log_queue` writes it: so logging never waits.

use std::fs::File;
use std::io::{self, IsTerminal};
use std::os::fd::AsFd;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, RwLock};
use std::time::SystemTime;

use clap::ValueEnum;
use tracing::Subscriber;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::layer::{Context, SubscriberExt};
use tracing_subscriber::{Layer, Registry, reload};

use super::chain_start::chain_of;
use super::journal::{self, Socket};
use super::local_time;
use super::log_chain::ChainedForm;
use super::log_form::{LogLine, event_of, stamp};
pub use super::log_queue::lines_dropped;
use super::log_queue::{FormedLine, LogQueue};
use super::log_rules::LogRules;
use super::log_screen::LogScreen;
use rungd_base::locked::locked;
use rungd_config::controller::log::LogSettings;
use rungd_runtime::events::{Level, is_audited};
use rungd_runtime::say;
use rungd_runtime::wall::UtcOffset;

/// The form of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// Time, level, code, event, a sentence and key=value fields: the form of a file or a pipe. A
    /// terminal gets shorter lines if no form is asked for.
    Text,
    /// One JSON object a line; its time is UTC.
    Json,
    /// Entries with fields for the systemd journal; if it does not listen, lines with a priority
    /// (`<6>`). The default under systemd.
    Journal,
}

/// The environment variable that can replace `--log-level`.
pub const LEVEL_VARIABLE: &str = "RUNGD_LOG";

/// The log. Flush it at the end of the process.
pub struct Log(LogQueue);

impl Log {
    /// Waits until all logged lines are written; a few seconds at most.
    pub fn flush(&self) {
        self.0.flush();
    }
}

type FilteredRegistry = reload::Layer<LevelFilter, Registry>;

/// The rules of a log, and a filter that rejects lines which the rules never write.
#[derive(Clone)]
struct RuledLog {
    rules: Arc<RwLock<LogRules>>,
    filter: reload::Handle<LevelFilter, Registry>,
}

/// The rules of the process's log; they can change while the process runs.
static RULED: OnceLock<RuledLog> = OnceLock::new();

impl RuledLog {
    fn new(level: Level) -> (RuledLog, FilteredRegistry) {
        let (filtered, filter) = reload::Layer::new(filter(level));
        (RuledLog { rules: Arc::new(RwLock::new(LogRules::new(level))), filter }, filtered)
    }

    fn read<T>(&self, read_rules: impl FnOnce(&LogRules) -> T) -> T {
        read_rules(&self.rules.read().unwrap_or_else(PoisonError::into_inner))
    }

    fn change(&self, change: impl FnOnce(&mut LogRules)) {
        let said_from = {
            let mut rules = self.rules.write().unwrap_or_else(PoisonError::into_inner);
            change(&mut rules);
            rules.said_from()
        };
        let _ = self.filter.modify(|filter| *filter = self::filter(said_from));
    }
}

fn change(change: impl FnOnce(&mut LogRules)) {
    if let Some(ruled) = RULED.get() {
        ruled.change(change);
    }
}

/// Sets the least urgent level that is logged.
pub fn set_level(level: Level) {
    change(|rules| rules.level = level);
}

/// The least urgent level that is logged.
pub fn level() -> Level {
    RULED.get().map_or(Level::Info, |ruled| ruled.read(|rules| rules.level))
}

/// Takes over the settings of a controller file: at the start, and after each swap of programs.
pub(super) fn take_over(settings: &LogSettings) {
    change(|rules| rules.take_over(settings));
}

/// Gives the log the offset of local time.
pub(super) fn set_zone(zone: Arc<UtcOffset>) {
    change(|rules| rules.zone = Some(zone));
}

/// Starts the log of the process. `socket` is the journal's socket, if it is not the usual one.
///
/// # Errors
/// [`LEVEL_VARIABLE`] is not a level, or the system cannot start a thread.
pub fn init(
    format: Option<LogFormat>,
    level: Option<Level>,
    socket: Option<&Path>,
) -> anyhow::Result<Log> {
    let level = match level {
        Some(level) => level,
        None => level_of_environment(std::env::var(LEVEL_VARIABLE).ok().as_deref())?,
    };
    let is_terminal = io::stderr().is_terminal();
    let is_screen = is_terminal && format.is_none();
    let wants_none = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    let color = is_terminal && !wants_none;
    let format = format.unwrap_or_else(choose);
    let socket = socket.unwrap_or(Path::new(journal::SOCKET));
    let socket = if format == LogFormat::Journal { Socket::new(socket) } else { None };
    let form = match format {
        LogFormat::Text if is_screen => LineForm::Screen(Arc::new(LogScreen::new(color))),
        LogFormat::Text => LineForm::Text { color },
        LogFormat::Json => LineForm::Json,
        LogFormat::Journal => LineForm::Journal { entries: socket.is_some() },
    };
    let (chain, chain_news) = chain_of(form.chained());
    let is_chained = chain.is_some();
    let queue = LogQueue::new(io::stderr(), socket, chain)?;
    let (ruled, filter) = RuledLog::new(level);
    if is_screen {
        // Until the controller is loaded; then `set_zone` gives the offset that is kept up to date.
        ruled.change(|rules| rules.zone = Some(local_time::at_start()));
    }
    let _ = RULED.set(ruled.clone());
    let voice = LineLayer { is_chained, ..LineLayer::new(form, ruled, queue.clone()) };
    // This fails only at a second call in one process, and then a log exists already.
    let _ = tracing::subscriber::set_global_default(subscriber(voice, filter));
    if let Some(news) = chain_news {
        news.tell();
    }
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
/// device and inode. A variable that was merely inherited does not match.
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

/// The level of a line in the code.
fn level_of(said: tracing::Level) -> Level {
    match said {
        tracing::Level::TRACE => Level::Trace,
        tracing::Level::DEBUG => Level::Debug,
        tracing::Level::INFO => Level::Info,
        tracing::Level::WARN => Level::Warn,
        tracing::Level::ERROR => Level::Error,
    }
}

/// The form of the lines.
#[derive(Clone)]
enum LineForm {
    /// For the eyes of a person at a terminal.
    Screen(Arc<LogScreen>),
    Text {
        color: bool,
    },
    Json,
    /// If the journal's socket exists, each line also has an entry for it.
    Journal {
        entries: bool,
    },
}

impl LineForm {
    /// How a line has its link; lines for a terminal have none.
    fn chained(&self) -> Option<ChainedForm> {
        match self {
            LineForm::Screen(_) | LineForm::Text { color: true } => None,
            LineForm::Text { color: false } => Some(ChainedForm::Text),
            LineForm::Json => Some(ChainedForm::Json),
            LineForm::Journal { .. } => Some(ChainedForm::Journal),
        }
    }
}

fn subscriber(voice: LineLayer, filter: FilteredRegistry) -> impl Subscriber + Send + Sync {
    tracing_subscriber::registry().with(filter).with(voice)
}

/// The layer that turns events into lines.
struct LineLayer {
    form: LineForm,
    ruled: RuledLog,
    queue: LogQueue,
    /// Held from the reading of the clock until the line is in the queue: lines of several threads
    /// are in the order of their times.
    turn: Mutex<()>,
    /// Whether the audit trail is chained.
    is_chained: bool,
}

impl LineLayer {
    fn new(form: LineForm, ruled: RuledLog, queue: LogQueue) -> LineLayer {
        LineLayer { form, ruled, queue, turn: Mutex::default(), is_chained: false }
    }
}

impl<S: Subscriber> Layer<S> for LineLayer {
    fn on_event(&self, event: &tracing::Event<'_>, _: Context<'_, S>) {
        let (row, said) = (event_of(event), level_of(*event.metadata().level()));
        let _turn = locked(&self.turn);
        let now = SystemTime::now();
        let is_screen = matches!(self.form, LineForm::Screen(_));
        let (level, is_limited, offset_s) = self.ruled.read(|rules| {
            let offset_s = if is_screen { rules.local_offset_s(now) } else { rules.offset_s(now) };
            (rules.level_of(row, said), rules.is_limited(), offset_s)
        });
        let Some(level) = level else { return };
        if let Some(row) = row.filter(|_| is_limited)
            && !self.queue.may_write(row)
        {
            return;
        }
        let is_link = self.is_chained && row.is_some_and(is_audited);
        let chained = self.form.chained().filter(|_| is_link);
        let mut line = LogLine::of(event, row, say::level(level));
        if chained == Some(ChainedForm::Journal) {
            line.add_time(now);
        }
        let detail = level > Level::Info;
        let (line, entry) = match &self.form {
            LineForm::Screen(screen) => (screen.line(&line, now, offset_s), Vec::new()),
            LineForm::Text { color } => (line.text(&stamp(now, offset_s), *color), Vec::new()),
            LineForm::Json => (line.json(now), Vec::new()),
            LineForm::Journal { entries: false } => (line.with_priority(), Vec::new()),
            LineForm::Journal { entries: true } => (line.with_priority(), line.entry()),
        };
        self.queue.push(FormedLine { line, entry, detail, chained });
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::sync::{Arc, Mutex};

    use super::*;
    use rungd_config::controller::log::LogTime;
    use rungd_runtime::events::{ALARM_ON, Event, STAGE_ON};
    use rungd_runtime::say::say;

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
        logged_by(form, level, |_| {})
    }

    /// The log's text after a change of the rules.
    fn logged_by(form: LineForm, level: Level, change: impl FnOnce(&mut LogRules)) -> String {
        let sink = Sink::default();
        let queue = LogQueue::new(sink.clone(), None, None).unwrap();
        let (ruled, filter) = RuledLog::new(level);
        let voice = LineLayer::new(form, ruled.clone(), queue.clone());
        tracing::subscriber::with_default(subscriber(voice, filter), || {
            ruled.change(change);
            say!(ALARM_ON, tag = %"jam", scan = 7, "alarm ON: Bottles jammed");
            say!(STAGE_ON at Debug, ms = 1.0, on = true, "a\ndetail");
        });
        queue.flush();
        let bytes = sink.0.lock().unwrap().clone();
        String::from_utf8(bytes).unwrap()
    }

    const SENTENCE: &str = "RUNGD-0301 alarm-on: alarm ON: Bottles jammed tag=jam scan=7\n";

    #[test]
    fn a_journal_that_reads_lines_gets_priorities_and_fields_in_the_message() {
        let form = LineForm::Journal { entries: false };
        assert_eq!(logged(form.clone(), Level::Info), format!("<4>{SENTENCE}"));
        let both = format!("<4>{SENTENCE}<7>RUNGD-0404 stage-on: a detail ms=1.0 on=true\n");
        assert_eq!(logged(form, Level::Debug), both);
    }

    #[test]
    fn text_lines_have_time_and_level_and_no_escape_codes() {
        let text = logged(LineForm::Text { color: false }, Level::Info);
        let (time, rest) = text.split_at(27);
        assert!(time.ends_with('Z'), "{time}");
        assert_eq!(rest, format!("  WARN {SENTENCE}"));
        let colored = logged(LineForm::Text { color: true }, Level::Info);
        assert!(colored.contains(&format!(" \x1b[33m WARN\x1b[0m {SENTENCE}")), "{colored:?}");
    }

    #[test]
    fn json_lines_have_one_object_each() {
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
    fn lines_of_several_threads_are_ordered_by_time() {
        let sink = Sink::default();
        let queue = LogQueue::new(sink.clone(), None, None).unwrap();
        let (ruled, filter) = RuledLog::new(Level::Info);
        let voice = LineLayer::new(LineForm::Json, ruled, queue.clone());
        let log = tracing::Dispatch::new(subscriber(voice, filter));
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    tracing::dispatcher::with_default(&log, || {
                        (0..500).for_each(|_| say!(PROCESS_START, "a line"));
                    });
                });
            }
        });
        queue.flush();
        let text = String::from_utf8(sink.0.lock().unwrap().clone()).unwrap();
        let time = |line: &str| line.split('"').nth(3).map(str::to_owned);
        let times: Vec<Option<String>> = text.lines().map(time).collect();
        assert!(times.len() > 1000 && times.is_sorted(), "{} lines", times.len());
    }

    #[test]
    fn a_line_has_the_configured_level_of_its_event() {
        let form = LineForm::Journal { entries: false };
        let give = |event: &'static Event, level: Option<Level>| {
            move |rules: &mut LogRules| {
                let mut settings = LogSettings::default();
                settings.levels.give(event, level);
                rules.take_over(&settings);
            }
        };
        let jam = logged_by(form.clone(), Level::Info, give(&ALARM_ON, Some(Level::Error)));
        assert_eq!(jam, jam_at(3));
        let off = logged_by(form.clone(), Level::Trace, give(&STAGE_ON, None));
        assert_eq!(off, jam_at(4));
        assert_eq!(logged_by(form.clone(), Level::Warn, give(&ALARM_ON, Some(Level::Info))), "");
        // The line is at debug, its event's row at info: the line stays a detail.
        assert_eq!(logged_by(form, Level::Info, give(&STAGE_ON, Some(Level::Warn))), jam_at(4));
    }

    fn jam_at(priority: u8) -> String {
        format!("<{priority}>{SENTENCE}")
    }

    #[test]
    fn local_times_show_their_offset_and_json_stays_in_utc() {
        let local = |rules: &mut LogRules| {
            rules.take_over(&LogSettings { time: LogTime::Local, ..LogSettings::default() });
            let zone = UtcOffset::default();
            zone.set(20_700, None);
            rules.zone = Some(Arc::new(zone));
        };
        let text = logged_by(LineForm::Text { color: false }, Level::Info, local);
        let (time, rest) = text.split_at(32);
        assert!(time.ends_with("+05:45"), "{time}");
        assert_eq!(rest, format!("  WARN {SENTENCE}"));
        let json = logged_by(LineForm::Json, Level::Info, local);
        let value: serde_json::Value = serde_json::from_str(&json).expect("an object");
        assert!(value["timestamp"].as_str().expect("a time").ends_with('Z'), "{json}");
    }

    #[test]
    fn the_stream_of_the_journal_is_recognized_by_device_and_inode() {
        assert!(is_stream("8:1234", 8, 1234));
        assert!(!is_stream("8:1234", 8, 1235) && !is_stream("", 0, 0) && !is_stream("x:y", 1, 2));
    }

    #[test]
    fn the_environment_can_set_the_log_level() {
        assert_eq!(level_of_environment(None).unwrap(), Level::Info);
        assert_eq!(level_of_environment(Some("WARN")).unwrap(), Level::Warn);
        assert!(level_of_environment(Some("loud")).is_err());
    }
}
