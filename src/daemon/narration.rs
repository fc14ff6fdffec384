//! Turns the numbers in a record of the scan thread into names and sentences.
//!
//! Built once from the program's symbols. Pure: `log_writer` decides what is logged, and when.

use std::sync::{Arc, OnceLock};

use super::alarm_book::KnownAlarm;
use super::retain::{COLD_BY_HAND, NothingKept};
use rungd_base::duration_text::{duration_text, period_text};
use rungd_config::controller::alarms::AlarmSettings;
use rungd_config::controller::log::BlockLines;
use rungd_config::controller::watch::WatchSettings;
use rungd_engine::isa::{BlockId, StageId};
use rungd_engine::{BlockEvent, Cell, Element};
use rungd_language::lower::Symbols;
use rungd_language::resolve::name_book::{BlockName, NameBook};
use rungd_language::resolve::program::{Block, Program};
use rungd_language::resolve::value_texts::ValueTexts;
use rungd_language::source::wording::is_obeyed;
use rungd_runtime::WatchedCells;
use rungd_runtime::events::{self, Event};
use rungd_runtime::exchange::{FaultReason, Mode, StopReason, Tempo};

/// The names for all log lines.
#[derive(Clone, Debug)]
pub(super) struct Narration {
    names: Arc<NameBook>,
    bits: Vec<BitNews>,
    words: Vec<WordNews>,
    /// The alarms: those of bits, in the order of a scan, then the watches.
    pub alarms: Vec<KnownAlarm>,
    /// The rung of each MATH, by number.
    maths: Vec<String>,
    /// The number of rungs of the program.
    rungs: usize,
    /// The scan period and the watchdog.
    pub tempo: Tempo,
    /// The blocks whose changes of state are logged.
    told: BlockLines,
}

/// An event of a block or Stage.
pub(super) struct BlockNews<'a> {
    /// The event in the catalogue.
    pub event: &'static Event,
    /// Program, Task or Stage.
    pub kind: &'static str,
    pub name: &'a str,
    /// The event in words: `started`.
    pub what: &'static str,
    /// False for a detail, which is logged at debug level.
    pub news: bool,
}

/// Kind and name of a block or Stage.
struct ElementTitle<'a> {
    kind: &'static str,
    name: &'a str,
    /// False if its events are details.
    is_news: bool,
}

/// A bit whose changes are logged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct BitNews {
    pub tag: String,
    /// The alarm's number; `None` for `log = "change"`.
    pub alarm: Option<usize>,
    /// The texts of its values.
    pub texts: Option<Arc<ValueTexts>>,
}

/// As [`COLD_BY_HAND`], for a controller that was started with `--stopped`.
const COLD_AND_NOT_STOPPED: &str = "stop this process, then start it without `--stopped`, once \
    with `rungd run --cold-start run FILE`, or with `[retain] cold-start = \"run\"`: there is \
    nothing to restore, and no operator's socket for `rungd mode run`";

/// The time before a fault that its log line shows.
const BLACK_BOX_NS: u64 = 10_000_000_000;

/// Facts of the controller that log lines state, and the intervals of repeated lines.
#[derive(Clone, Debug)]
pub(super) struct LogFacts {
    /// The interval at which the reason of a STOP or FAULT is repeated.
    pub repeat_ns: u64,
    /// The interval of heartbeats; `None`: no heartbeats.
    pub heartbeat_ns: Option<u64>,
    /// Whether an operator can set the mode back to RUN.
    pub has_operator: bool,
    /// The folder of the scan log; `None`: the scan log is only in memory.
    pub record: Option<String>,
    /// Whether a restart would wait in STOP, because nothing can be restored.
    pub nothing_kept: NothingKept,
    /// How the scan thread gets a real-time priority; empty if it has one. Known once the thread
    /// has asked for it.
    pub priority: Arc<OnceLock<String>>,
    /// Told when the monitor's last turn comes.
    pub over: Arc<tokio::sync::Notify>,
}

impl LogFacts {
    /// The remedies for scans that are too long or too late, after "raise the watchdog".
    fn other_remedies(&self) -> String {
        let priority = self.priority.get().filter(|how| !how.is_empty());
        let priority = priority.map_or(String::new(), |how| format!(", {how}"));
        format!("{priority}, or see what else the machine was doing")
    }

    /// The command that shows the last ten seconds before a fault, up to the last complete scan.
    pub fn black_box(&self, last: u64, period_ns: u64) -> String {
        if last == 0 {
            return "no complete scan came before it".to_owned();
        }
        let first = last.saturating_sub(BLACK_BOX_NS / period_ns.max(1)).max(1);
        let span = format!("--from \"scan {first}\" --to \"scan {last}\"");
        match &self.record {
            Some(dir) => format!("`rungd replay {dir} {span} --trace -` shows what came before it"),
            None if self.has_operator => format!(
                "while this process runs, `rungd record cut {span} -o fault.rungd-log` saves what \
                 came before it"
            ),
            None => {
                "the scan log is only in memory: with `[record] dir` the next fault is kept".into()
            }
        }
    }

    /// The remedy if a command can return the controller to RUN, or a restart, unless the restart
    /// finds nothing to restore. `scans` is the number of complete scans.
    pub fn again(&self, scans: u64) -> &'static str {
        match (self.has_operator, self.nothing_kept.after(scans)) {
            (true, false) => "`rungd mode run`, or a restart of rungd, runs it again",
            (true, true) => {
                "`rungd mode run` runs it again; a restart finds nothing to restore, and waits in \
                 STOP"
            }
            (false, false) => "restart rungd to run it again",
            (false, true) => COLD_BY_HAND,
        }
    }

    /// The remedy for a STOP. After `NothingRestored` a restart does not help: it finds nothing to
    /// restore either.
    pub fn leaves_stop(&self, reason: StopReason, scans: u64) -> &'static str {
        match (reason, self.has_operator) {
            (StopReason::NothingRestored, true) => {
                "`rungd mode run` runs it; a restart finds nothing to restore either"
            }
            (StopReason::NothingRestored, false) => COLD_BY_HAND,
            (StopReason::CommandLine, true) => "`rungd mode run` runs it",
            (StopReason::CommandLine, false) if self.nothing_kept.after(scans) => {
                COLD_AND_NOT_STOPPED
            }
            (StopReason::CommandLine, false) => "restart rungd without `--stopped`",
            // Only an orderly end deletes the count of restarts.
            (StopReason::RestartGuard, true) if !self.nothing_kept.after(scans) => {
                "`rungd mode run`, or an orderly restart of rungd, runs it again"
            }
            (
                StopReason::NotStarted
                | StopReason::Instruction
                | StopReason::Signal
                | StopReason::ScanLimit
                | StopReason::Operator
                | StopReason::RestartGuard,
                _,
            ) => self.again(scans),
        }
    }

    /// The remedy for a FAULT. After a bug in rungd only a new process can run the controller.
    pub fn remedy(&self, fault: FaultReason, scans: u64) -> &'static str {
        match fault {
            FaultReason::EnginePanic | FaultReason::ScanThreadGone => {
                match (self.nothing_kept.after(scans), self.has_operator) {
                    (false, _) => "restart rungd",
                    (true, true) => {
                        "restart rungd, then `rungd mode run` (the restart finds nothing to \
                         restore, and waits in STOP)"
                    }
                    (true, false) => COLD_BY_HAND,
                }
            }
            FaultReason::ScanTooLong { .. }
            | FaultReason::ScanNeverEnds
            | FaultReason::ScanNeverBegins => self.again(scans),
        }
    }
}

/// A watched word.
#[derive(Clone, Debug)]
pub struct WordNews {
    /// The word's tag; for a structure's member, `tag.Member`.
    pub tag: String,
    /// Whether the word contains a real.
    pub real: bool,
    /// The texts of its values.
    pub texts: Option<Arc<ValueTexts>>,
}

impl Narration {
    /// The names of a program, and the bits and words that the scan thread watches.
    pub fn new(program: &Program, symbols: &Symbols) -> (Narration, WatchedCells) {
        let mut watched = WatchedCells::default();
        let (mut bits, mut words) = (Vec::new(), Vec::new());
        let mut behind = Vec::new();
        let mut watch = |watched: &mut WatchedCells, cell: Cell, news: BitNews| match cell {
            Cell::Bit(cell) => {
                watched.bits.push(cell);
                bits.push(news);
            }
            Cell::WordBit(bit) => {
                watched.word_bits.push(bit);
                behind.push(news);
            }
            Cell::Word(_) => unreachable!("a bit is no word"),
        };
        for (number, alarm) in symbols.alarms.iter().enumerate() {
            let (tag, number) = (alarm.tag.clone(), Some(number));
            let news = BitNews { tag, alarm: number, texts: None };
            watch(&mut watched, alarm.bit, news);
        }
        for logged in &symbols.logged {
            let tag = logged.tag.clone();
            let address = symbols.layout.address(logged.cell);
            let texts = address.and_then(|address| symbols.names.texts(address)).cloned();
            match logged.cell {
                Cell::Bit(_) | Cell::WordBit(_) => {
                    watch(&mut watched, logged.cell, BitNews { tag, alarm: None, texts });
                }
                Cell::Word(cell) => {
                    watched.words.push(cell);
                    words.push(WordNews { tag, real: symbols.layout.is_real(cell), texts });
                }
            }
        }
        bits.append(&mut behind);
        let names = Arc::clone(&symbols.names);
        let (rungs, tempo) = (rungs(program), Tempo::default());
        let maths = symbols.maths.clone();
        let told = BlockLines::All;
        let alarms = KnownAlarm::all(&symbols.alarms, &WatchSettings::default());
        (Narration { names, bits, words, alarms, maths, rungs, tempo, told }, watched)
    }

    /// The same names, with the alarms of these watches, and by the settings of alarms.
    pub fn watching(self, watches: &WatchSettings, settings: &AlarmSettings) -> Narration {
        Narration { alarms: KnownAlarm::joined(self.alarms, watches, settings), ..self }
    }

    /// The same names for a program with this tempo.
    pub fn at(self, tempo: Tempo) -> Narration {
        Narration { tempo, ..self }
    }

    /// The same names, with log lines for the changes of state of these blocks.
    pub fn telling(self, told: BlockLines) -> Narration {
        Narration { told, ..self }
    }

    /// The event of a block in words, and whether it is news; `None` if it is not logged. Built-in
    /// Tasks have events at every start and stop; these are details.
    pub fn block_event(&self, event: BlockEvent) -> Option<BlockNews<'_>> {
        let (event, element, what) = match event {
            BlockEvent::Started(id) => (&events::BLOCK_STARTED, Element::Block(id), "started"),
            BlockEvent::Stopped(id) => (&events::BLOCK_STOPPED, Element::Block(id), "stopped"),
            BlockEvent::Completed(id) => {
                (&events::BLOCK_COMPLETED, Element::Block(id), "completed")
            }
            BlockEvent::StageOn(id) => (&events::STAGE_ON, Element::Stage(id), "is ON"),
            BlockEvent::StageOff(id) => (&events::STAGE_OFF, Element::Stage(id), "is OFF"),
            BlockEvent::Terminated(of) => {
                (&events::TERMINATION_PASS, of, "had its termination pass")
            }
        };
        let is_told = match (self.told, element) {
            (BlockLines::All, _) | (BlockLines::Programs, Element::Block(_)) => true,
            (BlockLines::Programs, Element::Stage(_)) | (BlockLines::None, _) => false,
        };
        if !is_told {
            return None;
        }
        let ElementTitle { kind, name, is_news: news } = match element {
            Element::Block(id) => self.block(id),
            Element::Stage(id) => {
                ElementTitle { kind: "Stage", name: self.stage(id), is_news: true }
            }
        };
        Some(BlockNews { event, kind, name, what, news })
    }

    /// The remedy for a fault after this number of complete scans, with the settings and sizes that
    /// explain it.
    pub fn remedy(&self, reason: FaultReason, facts: &LogFacts, scans: u64) -> String {
        let (period, watchdog) =
            (period_text(self.tempo.period_ns), duration_text(self.tempo.watchdog_ns));
        match reason {
            FaultReason::ScanTooLong { .. }
            | FaultReason::ScanNeverEnds
            | FaultReason::ScanNeverBegins => format!(
                "{}; if it comes again, raise `[scan] watchdog` (it is {watchdog}, for {} rungs \
                 every {period}){}",
                facts.again(scans),
                self.rungs,
                facts.other_remedies()
            ),
            FaultReason::EnginePanic | FaultReason::ScanThreadGone => format!(
                "{}, and report this with the lines above: it is a bug in rungd",
                facts.remedy(reason, scans)
            ),
        }
    }

    pub fn bit(&self, watch: u32) -> Option<&BitNews> {
        self.bits.get(watch as usize)
    }

    /// The rung of a MATH.
    pub fn math(&self, number: u32) -> &str {
        self.maths.get(number as usize).map_or("?", String::as_str)
    }

    pub fn word(&self, watch: u32) -> Option<&WordNews> {
        self.words.get(watch as usize)
    }

    fn block(&self, id: BlockId) -> ElementTitle<'_> {
        let Some(BlockName { kind, name }) = self.names.blocks.get(id.0 as usize) else {
            return ElementTitle { kind: "?", name: "?", is_news: true };
        };
        ElementTitle { kind: kind.title(), name, is_news: !kind.is_built_in() }
    }

    /// The tags of watched bits and words. A bit's entry also contains `alarm` or `change`, since
    /// one tag can be watched for both.
    pub fn watched_names(&self) -> (Vec<String>, Vec<String>) {
        let kind = |bit: &BitNews| if bit.alarm.is_some() { "alarm" } else { "change" };
        let bits = self.bits.iter().map(|bit| format!("{} {}", kind(bit), bit.tag));
        (bits.collect(), self.words.iter().map(|word| word.tag.clone()).collect())
    }

    fn stage(&self, id: StageId) -> &str {
        self.names.stages.get(id.0 as usize).map_or("?", |stage| &stage.whole)
    }
}

/// Puts a text written by the ladder's author on one line.
pub(super) fn one_line(text: &str) -> String {
    let words = text.split(|c: char| is_obeyed(c) || c.is_whitespace());
    words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" ")
}

/// The reason of a mode; empty for RUN.
pub(super) fn reason(mode: Mode) -> String {
    match mode {
        Mode::Run => String::new(),
        Mode::Stop(reason) => reason.to_string(),
        Mode::Fault(reason) => reason.to_string(),
    }
}

/// The number of rungs of a program.
pub(super) fn rungs(program: &Program) -> usize {
    let rung_count = |block: &Block| {
        block.rungs.len() + block.stages.iter().map(|stage| stage.rungs.len()).sum::<usize>()
    };
    program.blocks.iter().map(rung_count).sum()
}

/// Microseconds with one decimal, for the fields of a log line.
pub(super) fn us(ns: u64) -> f64 {
    (ns as f64 / 100.0).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_language::resolve::{LoadOptions, load_ladders};
    use rungd_language::source::span::SourceFile;
    use rungd_runtime::events::Silence;

    #[test]
    fn a_text_of_a_ladder_cannot_break_a_log_line() {
        assert_eq!(
            one_line("Bottles jammed\n<0>at the \u{1b}[31m\u{202e}eye"),
            "Bottles jammed <0>at the [31m eye"
        );
    }

    #[test]
    fn microseconds_keep_one_decimal() {
        assert_eq!((us(12_345), us(0), us(999_960)), (12.3, 0.0, 1000.0));
    }

    /// The setting and the rows of the catalogue agree about every event.
    #[test]
    fn block_events_are_logged_by_the_setting_and_their_event_levels() {
        let text = "[[program]]\nname = \"Main\"\n[[program.stage]]\nname = \"A\"\nrung = []\n";
        let file = SourceFile { name: "a.toml".into(), text: text.into() };
        let program = load_ladders(&[file], &LoadOptions::default()).0.expect("it loads");
        let (_, symbols) = rungd_language::lower::lower(&program);
        let narration = Narration::new(&program, &symbols).0;
        let (block, stage) = (BlockId(0), StageId(0));
        let all = [
            BlockEvent::Started(block),
            BlockEvent::Stopped(block),
            BlockEvent::Completed(block),
            BlockEvent::Terminated(Element::Block(block)),
            BlockEvent::Terminated(Element::Stage(stage)),
            BlockEvent::StageOn(stage),
            BlockEvent::StageOff(stage),
        ];
        let told = |told: BlockLines| -> Vec<&'static str> {
            let narration = narration.clone().telling(told);
            all.iter().filter_map(|event| Some(narration.block_event(*event)?.event.name)).collect()
        };
        let names = |kept: &[Silence]| -> Vec<&'static str> {
            events::all().filter(|e| kept.contains(&e.silence)).map(|e| e.name).collect()
        };
        let sorted = |mut names: Vec<&'static str>| {
            names.sort_unstable();
            names.dedup();
            names
        };
        let of_blocks = [Silence::ByBlocks, Silence::ByStages];
        assert_eq!(sorted(told(BlockLines::All)), sorted(names(&of_blocks)));
        assert_eq!(sorted(told(BlockLines::Programs)), sorted(names(&[Silence::ByBlocks])));
        assert_eq!((told(BlockLines::Programs).len(), told(BlockLines::None).len()), (4, 0));
    }

    #[test]
    fn a_remedy_refers_to_the_running_program() {
        let narration_of = |rungs: usize| {
            let rung = "[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"SET C0\"]\n".repeat(rungs);
            let text = format!("[[program]]\nname = \"Main\"\n{rung}");
            let file = SourceFile { name: "a.toml".into(), text };
            let program = load_ladders(&[file], &LoadOptions::default()).0.expect("it loads");
            let (_, symbols) = rungd_language::lower::lower(&program);
            let tempo = Tempo { period_ns: 5_000_000, watchdog_ns: 9_000_000 };
            Narration::new(&program, &symbols).0.at(tempo)
        };
        for rungs in [2, 5] {
            let facts = facts(false, NothingKept::default());
            let remedy = narration_of(rungs).remedy(FaultReason::ScanNeverEnds, &facts, 0);
            let words = format!("it is 9ms, for {rungs} rungs every 5ms");
            assert!(remedy.contains(&words), "{remedy}");
        }
    }

    fn facts(has_operator: bool, nothing_kept: NothingKept) -> LogFacts {
        let (repeat_ns, heartbeat_ns, record) = (0, None, None);
        let (priority, over) = (Arc::default(), Arc::default());
        LogFacts { repeat_ns, heartbeat_ns, has_operator, record, nothing_kept, priority, over }
    }

    #[test]
    fn a_fault_names_the_recorded_scans_before_it_if_there_are_any() {
        let facts = facts(true, NothingKept::default());
        assert_eq!(facts.black_box(0, 10_000_000), "no complete scan came before it");
        let told = |last| facts.black_box(last, 10_000_000);
        assert!(told(37).contains("`rungd record cut --from \"scan 1\" --to \"scan 37\" -o "));
        assert!(told(1500).contains(" --from \"scan 500\" --to \"scan 1500\" "));
    }

    #[test]
    fn a_fault_names_the_priority_that_would_help() {
        let facts = facts(true, NothingKept::default());
        assert_eq!(facts.other_remedies(), ", or see what else the machine was doing");
        facts.priority.set("give it a priority".into()).expect("once");
        let wanted = ", give it a priority, or see what else the machine was doing";
        assert_eq!(facts.other_remedies(), wanted);
    }

    /// All remedies of a controller that executed this number of complete scans.
    fn remedies(facts: &LogFacts, scans: u64) -> Vec<&'static str> {
        let stops = [StopReason::Instruction, StopReason::Operator, StopReason::RestartGuard];
        let faults = [FaultReason::ScanNeverEnds, FaultReason::EnginePanic];
        let stops = stops.map(|reason| facts.leaves_stop(reason, scans));
        [stops.to_vec(), faults.map(|reason| facts.remedy(reason, scans)).to_vec()].concat()
    }

    #[test]
    fn no_remedy_suggests_a_restart_that_restores_nothing() {
        for nothing_kept in [NothingKept::default(), NothingKept::new(true)] {
            let is_nothing = nothing_kept.after(0);
            for remedy in remedies(&facts(true, nothing_kept.clone()), 0) {
                assert_eq!(remedy.contains("finds nothing to restore"), is_nothing, "{remedy}");
                assert!(remedy.contains("`rungd mode run`") || !is_nothing, "{remedy}");
            }
            let alone = facts(false, nothing_kept);
            let stopped = alone.leaves_stop(StopReason::CommandLine, 0);
            assert!(stopped.contains("without `--stopped`"), "{stopped}");
            for remedy in [remedies(&alone, 0), vec![stopped]].concat() {
                assert_eq!(remedy.contains("--cold-start run"), is_nothing, "{remedy}");
                assert_eq!(remedy.starts_with("restart rungd"), !is_nothing, "{remedy}");
            }
        }
    }
}
