//! `rungd record info`: a summary of a recording.
//!
//! Reads every section once, and executes none. Called by `record`.

use std::sync::Arc;

use serde_json::{Value, json};

use super::recorded_trace::seconds;
use super::recording::{self, stretches};
use super::terminal::one_line;
use super::when::LocalClock;
use rungd_engine::EngineCall;
use rungd_history::record::{RecordedProgram, Recording};
use rungd_language::source::wording::{counted, thousands};
use rungd_runtime::TapeEntry;
use rungd_runtime::exchange::Mode;

/// The maximum number of changes, and of gaps, that the text lists.
const LISTED_MAX: usize = 12;

/// The minimum recorded time for an estimate of the size of a day.
const MEASURED_NS: u128 = 10_000_000_000;

const DAY_NS: u128 = 86_400_000_000_000;

/// The summary of a recording.
pub(super) struct RecordInfo {
    programs: Vec<Arc<RecordedProgram>>,
    span: Option<(i64, i64)>,
    /// The numbers of the first and the last scan.
    numbers: (u64, u64),
    scans: u64,
    sections: usize,
    base_images: usize,
    damaged: u64,
    bytes: u64,
    bytes_per_day: Option<u64>,
    period_ns: Option<u64>,
    /// Changes of mode and of program, each with its time.
    changes: Vec<(i64, String)>,
    gaps: Vec<InfoGap>,
    /// Whether it begins with the start of RUN: then every image of memory in it can be computed
    /// again.
    begins_run: bool,
}

/// A gap in the recording.
struct InfoGap {
    /// The time at which the recording continues, ns since 1970 (UTC).
    at_ns: i64,
    lasts_ns: i64,
    what: String,
}

impl RecordInfo {
    pub fn of(recording: &Recording) -> RecordInfo {
        let count = recording.count();
        let stretches = stretches(recording);
        let recorded_ns: u128 = stretches
            .iter()
            .map(|of| u128::from(of.end_ns.saturating_sub(of.begin_ns).max(0).unsigned_abs()))
            .sum();
        let bytes = recording.bytes();
        let a_day = |bytes: u64| (u128::from(bytes) * DAY_NS).checked_div(recorded_ns);
        let gap = |of: &recording::RecordedStretch| {
            let what = of.gap(recording)?;
            let before = recording.head(of.sections.start - 1).end_ns;
            Some(InfoGap { at_ns: of.begin_ns, lasts_ns: of.begin_ns.saturating_sub(before), what })
        };
        let mut info = RecordInfo {
            programs: Vec::new(),
            span: recording::span(recording).map(|span| (*span.start(), *span.end())),
            numbers: stretches
                .first()
                .zip(stretches.last())
                .map_or((0, 0), |(first, last)| (first.first_scan, last.last_scan)),
            scans: (0..count).map(|at| u64::from(recording.head(at).scans)).sum(),
            sections: count,
            base_images: (0..count).filter(|at| recording.has_base(*at)).count(),
            damaged: 0,
            bytes,
            bytes_per_day: a_day(bytes)
                .filter(|_| recorded_ns >= MEASURED_NS)
                .and_then(|bytes| bytes.try_into().ok()),
            period_ns: None,
            changes: Vec::new(),
            gaps: stretches.iter().filter_map(gap).collect(),
            begins_run: false,
        };
        info.look_into(recording);
        info
    }

    /// Adds the facts that are only in the sections themselves.
    fn look_into(&mut self, recording: &Recording) {
        let (mut periods, mut own_periods, mut mode) = (Vec::new(), Vec::new(), None);
        for at in 0..recording.count() {
            let (program, head) = (recording.program(at), recording.head(at));
            let known = self.programs.last();
            if known.is_none_or(|known| known != program) {
                if known.is_some_and(|of| of.process_start_ns == program.process_start_ns) {
                    self.changes.push((head.begin_ns, format!("{} of the ladder", program.source)));
                }
                self.programs.push(Arc::clone(program));
            }
            let Ok(Some((_, body))) = recording.read(at) else {
                self.damaged += 1;
                continue;
            };
            if mode.replace(body.mode).is_some_and(|mode| mode != body.mode) {
                self.changes.push((head.begin_ns, words(body.mode)));
            }
            let (mut now_ns, mut last_ns) = (None, None);
            own_periods.clear();
            for entry in &body.entries {
                match entry {
                    TapeEntry::Call(EngineCall::Begin { now_ns: begin_ns, .. }) => {
                        own_periods.extend(last_ns.map(|last_ns| begin_ns.saturating_sub(last_ns)));
                        (now_ns, last_ns) = (Some(*begin_ns), Some(*begin_ns));
                    }
                    TapeEntry::Call(EngineCall::Start { now_ns: start_ns }) => {
                        self.begins_run |= at == 0 && now_ns.is_none();
                        (now_ns, last_ns) = (Some(*start_ns), None);
                    }
                    TapeEntry::Mode(new) if mode != Some(*new) => {
                        let unix_ns = |now_ns| body.unix_offset_ns.saturating_add_unsigned(now_ns);
                        self.changes.push((now_ns.map_or(head.begin_ns, unix_ns), words(*new)));
                        mode = Some(*new);
                    }
                    TapeEntry::Call(_)
                    | TapeEntry::Origin(_)
                    | TapeEntry::Number(_)
                    | TapeEntry::Mode(_)
                    | TapeEntry::Swap { .. }
                    | TapeEntry::State { .. }
                    | TapeEntry::Lost { .. } => {}
                }
            }
            periods.extend(median(&mut own_periods));
        }
        self.period_ns = median(&mut periods);
    }

    /// The summary as text.
    pub fn text(&self, clock: &LocalClock) -> String {
        let Some((begin_ns, end_ns)) = self.span else { return "nothing is recorded\n".into() };
        let mut text = String::new();
        let mut line = |name: &str, value: String| text += &format!("{name:<11} {value}\n");
        let mut controllers: Vec<String> = self.programs.iter().map(|of| controller(of)).collect();
        controllers.dedup();
        line("controller", controllers.join(", "));
        for of in &self.programs {
            let names: Vec<String> =
                of.files.iter().map(|file| one_line(&file.name).into_owned()).collect();
            let (hash, from) =
                (one_line(of.hash.get(..12).unwrap_or_default()), one_line(&of.source));
            let version = one_line(&of.version);
            line("program", format!("{hash} ({from}, rungd {version}): {}", names.join(" ")));
        }
        let (begin, end) = (clock.text(begin_ns), clock.text(end_ns));
        line("recorded", format!("{begin} to {end}"));
        let (first, last) = self.numbers;
        let scans = thousands(self.scans);
        line("scans", format!("{scans}, from {first} to {last}; {}", self.period_text()));
        let (sections, images) = (self.sections as u64, self.base_images as u64);
        let (sections, images) = (counted(sections, "section"), counted(images, "base image"));
        let damaged = match self.damaged {
            0 => String::new(),
            damaged => format!("; damaged: {}", counted(damaged, "section")),
        };
        line("stored as", format!("{sections} with {images}{damaged}"));
        let a_day = self.bytes_per_day.map_or(String::new(), |bytes| {
            format!("; {:.1} MB a day at this rate", bytes as f64 / 1e6)
        });
        line("size", format!("{} bytes{a_day}", thousands(self.bytes)));
        line("begins", self.proof().to_owned());
        let changes = |(at_ns, what): &(i64, String)| format!("{} {what}", clock.text(*at_ns));
        list(&mut line, "changes", self.changes.iter().map(changes).collect());
        let gaps = |gap: &InfoGap| {
            format!("{} after {}: {}", clock.text(gap.at_ns), seconds(gap.lasts_ns), gap.what)
        };
        list(&mut line, "gaps", self.gaps.iter().map(gaps).collect());
        text
    }

    fn period_text(&self) -> String {
        self.period_ns.map_or_else(
            || "no two scans".to_owned(),
            |ns| format!("one every {:.3} ms (median)", ns as f64 / 1e6),
        )
    }

    fn proof(&self) -> &'static str {
        if self.begins_run {
            "with the start of RUN: every hash can be computed from there"
        } else {
            "within RUN or STOP: with a recorded image of memory"
        }
    }

    /// The summary as JSON.
    pub fn json(&self) -> Value {
        let program = |of: &Arc<RecordedProgram>| {
            json!({
                "controller": controller(of),
                "files": of.files.iter().map(|file| &file.name).collect::<Vec<_>>(),
                "sha256": of.hash,
                "source": of.source,
                "version": of.version,
                "generation": of.generation,
                "process_start_unix_ns": of.process_start_ns,
            })
        };
        let change = |(at, what): &(i64, String)| json!({ "unix_ns": at, "what": what });
        let gap = |gap: &InfoGap| {
            let InfoGap { at_ns, lasts_ns, what } = gap;
            json!({ "unix_ns": at_ns, "after_ns": lasts_ns, "what": what })
        };
        json!({
            "programs": self.programs.iter().map(program).collect::<Vec<_>>(),
            "begin_unix_ns": self.span.map(|(begin, _)| begin),
            "end_unix_ns": self.span.map(|(_, end)| end),
            "first_scan": self.numbers.0,
            "last_scan": self.numbers.1,
            "scans": self.scans,
            "period_ns": self.period_ns,
            "sections": self.sections,
            "base_images": self.base_images,
            "damaged_sections": self.damaged,
            "bytes": self.bytes,
            "bytes_per_day": self.bytes_per_day,
            "begins_run": self.begins_run,
            "changes": self.changes.iter().map(change).collect::<Vec<_>>(),
            "gaps": self.gaps.iter().map(gap).collect::<Vec<_>>(),
        })
    }
}

fn median(numbers: &mut [u64]) -> Option<u64> {
    let middle = numbers.len() / 2;
    (!numbers.is_empty()).then(|| *numbers.select_nth_unstable(middle).1)
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

/// The name of a program's controller file.
fn controller(program: &RecordedProgram) -> String {
    program.files.first().map_or_else(String::new, |file| one_line(&file.name).into_owned())
}

fn words(mode: Mode) -> String {
    match mode {
        Mode::Run => mode.name().to_owned(),
        Mode::Stop(reason) => format!("{}: {reason}", mode.name()),
        Mode::Fault(reason) => format!("{}: {reason}", mode.name()),
    }
}
