//! `[log]` of a controller file: the events that are logged, their levels, and the time in the
//! lines.
//!
//! Called by [`super::written`]. Checks the keys, and passes the settings to `daemon`, which
//! applies them at the start and at each reload. The least urgent level that is written is not set
//! here, but on the command line and by `rungd log-level`.

use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, advise, meant, one_of, pair};
use rungd_language::source::key::key;
use rungd_language::source::nearest::KnownNames;
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::shape::ValueForm;
use rungd_language::source::span::{Located, Span};
use rungd_language::source::value_kind::{KeyWords, Millis, ValueKind, WrongWord};
pub use rungd_runtime::events::{self, Event, EventLevels, Level, Silence};

/// The settings of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogSettings {
    /// `statistics`: the time between two log lines of scan statistics, ms; 0: never.
    pub statistics_ms: u32,
    /// `blocks`.
    pub blocks: BlockLines,
    /// `time`.
    pub time: LogTime,
    /// `[log.events]`.
    pub levels: EventLevels,
}

/// The Programs, Tasks and Stages whose changes of state are logged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockLines {
    /// All of them.
    All,
    /// Only Programs and Tasks.
    Programs,
    /// None.
    None,
}

/// The time in the lines of a text log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogTime {
    /// UTC.
    Utc,
    /// Local time with its offset from UTC.
    Local,
}

impl BlockLines {
    /// Whether the lines of events with this `silence` are left out.
    fn leaves_out(self, silence: Silence) -> bool {
        match (self, silence) {
            (BlockLines::All, _) | (_, Silence::Never | Silence::ByName) => false,
            (BlockLines::Programs, Silence::ByBlocks) => false,
            (BlockLines::Programs, Silence::ByStages) => true,
            (BlockLines::None, Silence::ByBlocks | Silence::ByStages) => true,
        }
    }
}

const BLOCKS: KeyWords<BlockLines> = KeyWords::new(&[
    ("all", BlockLines::All),
    ("programs", BlockLines::Programs),
    ("none", BlockLines::None),
])
.refused_as(WrongWord::NoValue);
const TIMES: KeyWords<LogTime> = KeyWords::new(&[("utc", LogTime::Utc), ("local", LogTime::Local)])
    .refused_as(WrongWord::NoValue);
/// The least urgent level of an event that is never silenced.
const KEPT_LEAST: Level = Level::Info;
const STATISTICS_MS: u32 = 60_000;

impl Default for LogSettings {
    fn default() -> Self {
        LogSettings {
            statistics_ms: STATISTICS_MS,
            blocks: BlockLines::All,
            time: LogTime::Utc,
            levels: EventLevels::default(),
        }
    }
}

impl LogSettings {
    /// The changes from these settings to `new` that a reload applies, one per line.
    pub fn changes(&self, new: &LogSettings) -> Vec<String> {
        let level =
            |settings: &LogSettings, event| settings.levels.level(event).map_or("off", Level::name);
        let mut said = vec![
            ("log of blocks".to_owned(), BLOCKS.word(self.blocks), BLOCKS.word(new.blocks)),
            ("time of the log".to_owned(), TIMES.word(self.time), TIMES.word(new.time)),
        ];
        said.extend(events::all().map(|event| {
            (format!("log level of {}", event.name), level(self, event), level(new, event))
        }));
        said.retain(|(_, was, is)| was != is);
        said.into_iter().map(|(what, was, is)| format!("{what} {was} → {is}")).collect()
    }
}

/// Reads `[log]`; without it, the settings have their defaults.
pub(super) fn read_in(root: &mut Table<'_>) -> LogSettings {
    let table = root.table(key("log", "Settings of the log."), "`[log]`");
    table.map_or_else(LogSettings::default, read)
}

fn read(mut table: Table<'_>) -> LogSettings {
    let default = LogSettings::default();
    let statistics =
        key("statistics", "The time between two log lines of scan statistics; 0ms: never.");
    let blocks = key(
        "blocks",
        "Whose starts, stops and changes are logged: all, Programs and Tasks alone (programs), or \
         none; all if not given.",
    );
    let time = key(
        "time",
        "The time in the lines of a text log: utc, or local with its offset; utc if not given. \
         JSON keeps UTC.",
    );
    let statistics_ms = table.value_of(statistics, &Millis::ANY).unwrap_or(STATISTICS_MS);
    let blocks = table.value(blocks, &BLOCKS);
    let settings = LogSettings {
        statistics_ms,
        blocks: blocks.as_ref().map_or(default.blocks, |blocks| blocks.value),
        time: table.value_of(time, &TIMES).unwrap_or(default.time),
        levels: read_events(&mut table, blocks),
    };
    table.finish();
    settings
}

fn read_events(table: &mut Table<'_>, blocks: Option<Located<BlockLines>>) -> EventLevels {
    let mut levels = EventLevels::default();
    let explained = key("events", "The levels of single events, by name.");
    let Some(mut table) = table.table(explained, "`[log.events]`") else { return levels };
    for event in events::all() {
        let level = table.value(key(event.name, event.meaning), &LevelOf(event));
        let Some(Located { value, span }) = level else { continue };
        levels.give(event, value);
        if let (Some(_), Some(blocks)) = (value, &blocks) {
            left_out(event, span, blocks).into_iter().for_each(|found| table.find(found));
        }
    }
    unknown_events(&table);
    levels
}

/// The levels that an event can be given; `None`: off.
struct LevelOf(&'static Event);

impl LevelOf {
    fn is_kept(&self) -> bool {
        self.0.silence == Silence::Never
    }

    fn words(&self) -> Vec<&'static str> {
        let seen = |level: &Level| !self.is_kept() || *level <= KEPT_LEAST;
        let off = ["off"].into_iter().filter(|_| !self.is_kept());
        off.chain(Level::ALL.into_iter().filter(seen).map(Level::name)).collect()
    }
}

impl ValueKind for LevelOf {
    type Value = Option<Level>;

    fn form(&self) -> ValueForm {
        ValueForm::Words(self.words())
    }

    fn read(
        &self,
        _key: &str,
        text: &Text,
        find: &mut dyn FnMut(Finding),
    ) -> Option<Option<Level>> {
        let named = Level::ALL.into_iter().find(|level| level.name() == text.text);
        if named.is_none() && text.text != "off" {
            let message = format!("`{}` is no level", text.text);
            let help = one_of("write one of", self.words());
            let finding = Finding::new(Code::Controller, text.span, message).help(help);
            find(finding.near(&text.text, &KnownNames::new(self.words())));
            return None;
        }
        if self.is_kept() && named.is_none_or(|level| level > KEPT_LEAST) {
            find(kept(self.0, text));
            return None;
        }
        Some(named)
    }
}

/// The finding for an event whose lines must be seen.
fn kept(event: &Event, text: &Text) -> Finding {
    let message = format!("`{}` must stay in the log", event.name);
    let level = pair(format!("{} = \"{}\"", event.name, event.level.name())).possible();
    let help = advise("take the line out, or give it a level that is seen: `{}`", [level]);
    Finding::new(Code::KeptEvent, text.span, message)
        .label("a fault, mode, alarm, loss or change is logged at info, warn or error")
        .help(help.with(FixEdit::Delete))
}

/// The warning for a level of an event whose lines are left out.
fn left_out(event: &Event, span: Span, blocks: &Located<BlockLines>) -> Option<Finding> {
    if !blocks.value.leaves_out(event.silence) {
        return None;
    }
    let word = BLOCKS.word(blocks.value);
    let message = format!("`{}` has a level, but none of its lines is logged", event.name);
    let finding = Finding::new(Code::LevelLeftOut, span, message)
        .related(blocks.span, format!("`{word}` leaves them out"));
    Some(finding.help(
        "take the level out; or write `blocks = \"all\"`, and \"off\" or \"debug\" for the events \
         that are not wanted",
    ))
}

/// Reports the keys that are not names of events.
fn unknown_events(table: &Table<'_>) {
    let known = KnownNames::new(events::all().map(|event| event.name));
    for name in table.unasked() {
        let message = format!("no event of the log is called `{}`", name.text);
        let finding = Finding::new(Code::UnknownEvent, name.span, message);
        let finding = match events::coded(&name.text) {
            Some(event) => finding.help(meant(event.name)),
            None => finding.help("`rungd events` lists all events").near(&name.text, &known),
        };
        table.find(finding);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_language::source::reader;
    use rungd_language::source::span::FileId;

    fn read_text(text: &str) -> (LogSettings, Vec<String>) {
        let (settings, findings) = reader::document(text, FileId(0), |mut root| {
            let settings = read_in(&mut root);
            root.finish();
            settings
        });
        let said = findings.iter().map(|finding| finding.message.clone()).collect();
        (settings.expect("it is TOML"), said)
    }

    #[test]
    fn a_file_without_a_log_section_logs_everything_in_utc() {
        assert_eq!(read_text(""), (LogSettings::default(), Vec::new()));
        assert_eq!(read_text("[log]\n[log.events]\n"), (LogSettings::default(), Vec::new()));
    }

    #[test]
    fn each_key_of_the_log_section_is_applied() {
        let (settings, found) = read_text(
            "[log]\nstatistics = \"7s\"\nblocks = \"programs\"\ntime = \"local\"\n\
             [log.events]\ntag-value = \"debug\"\nstage-on = \"off\"\nmode-stop = \"error\"\n",
        );
        assert!(found.is_empty(), "{found:?}");
        let LogSettings { statistics_ms, blocks, time, levels } = settings;
        assert_eq!((statistics_ms, blocks, time), (7_000, BlockLines::Programs, LogTime::Local));
        assert_eq!(levels.level(&events::TAG_VALUE), Some(Level::Debug));
        assert_eq!(levels.level(&events::STAGE_ON), None);
        assert_eq!(levels.level(&events::MODE_STOP), Some(Level::Error));
        assert_eq!(levels.level(&events::ALARM_ON), Some(Level::Warn));
    }

    #[test]
    fn every_event_has_a_level_but_essential_events_cannot_be_hidden() {
        for event in events::all() {
            for word in ["off"].into_iter().chain(Level::ALL.map(Level::name)) {
                let (_, found) = read_text(&format!("log.events.{} = \"{word}\"\n", event.name));
                let is_hidden = !["error", "warn", "info"].contains(&word);
                let is_refused = event.silence == Silence::Never && is_hidden;
                assert_eq!(found.len(), usize::from(is_refused), "{} {word}", event.name);
            }
        }
    }

    #[test]
    fn a_level_for_disabled_lines_is_reported() {
        for (blocks, told) in [("all", 0), ("programs", 1), ("none", 2)] {
            let text = format!(
                "log.blocks = \"{blocks}\"\n[log.events]\nstage-on = \"debug\"\n\
                 block-started = \"warn\"\nstage-off = \"off\"\ntag-on = \"warn\"\n"
            );
            assert_eq!(read_text(&text).1.len(), told, "{blocks}");
        }
    }

    #[test]
    fn a_reload_report_names_each_changed_log_setting() {
        let was = LogSettings::default();
        let text = "[log]\nblocks = \"none\"\ntime = \"local\"\n[log.events]\n\
                    tag-value = \"off\"\nstage-on = \"info\"\n";
        let (is, _) = read_text(text);
        let said = [
            "log of blocks all → none",
            "time of the log utc → local",
            "log level of tag-value info → off",
        ];
        assert_eq!(was.changes(&is), said);
        assert!(is.changes(&is).is_empty());
    }
}
