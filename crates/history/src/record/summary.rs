//! A summary of a recording: its programs, time, scans, size, changes of mode and gaps.
//!
//! Reads every section once, and executes none. Its fields are those of `rungd record info --json`.

use serde::Serialize;

use super::program::RecordedProgram;
use super::recording::Recording;
use rungd_engine::EngineCall;
use rungd_runtime::TapeEntry;

/// The minimum recorded time for an estimate of the size of a day.
const MEASURED_NS: u128 = 10_000_000_000;

const DAY_NS: u128 = 86_400_000_000_000;

/// The summary of a recording.
#[derive(Debug, Default, Serialize)]
pub struct RecordingSummary {
    /// The programs, in order.
    pub programs: Vec<SummaryProgram>,
    /// The time of the first scan, ns since 1970 (UTC).
    pub begin_unix_ns: Option<i64>,
    /// The time of the last scan, ns since 1970 (UTC).
    pub end_unix_ns: Option<i64>,
    /// The number of the first scan.
    pub first_scan: u64,
    /// The number of the last scan.
    pub last_scan: u64,
    /// The number of scans.
    pub scans: u64,
    /// The median of the times between two scans.
    pub period_ns: Option<u64>,
    /// The number of sections.
    pub sections: usize,
    /// The sections that have a base image.
    pub base_images: usize,
    /// The sections that are damaged.
    pub damaged_sections: u64,
    /// The size in bytes.
    pub bytes: u64,
    /// The bytes of a day at this rate, if enough time is recorded.
    pub bytes_per_day: Option<u64>,
    /// Whether it begins with the start of RUN: then every image of memory in it can be computed
    /// again.
    pub begins_run: bool,
    /// The changes of mode and of program.
    pub changes: Vec<SummaryChange>,
    /// The gaps.
    pub gaps: Vec<SummaryGap>,
}

/// A program in a summary.
#[derive(Debug, Serialize)]
pub struct SummaryProgram {
    /// The name of its controller file.
    pub controller: String,
    /// The names of its files.
    pub files: Vec<String>,
    /// The hash of its files.
    pub sha256: String,
    /// How it was loaded.
    pub source: String,
    /// The version of rungd that recorded.
    pub version: String,
    /// Its number in its process.
    pub generation: u32,
    /// When its process started, ns since 1970 (UTC).
    pub process_start_unix_ns: i64,
}

/// A change of mode or of program.
#[derive(Debug, Serialize)]
pub struct SummaryChange {
    /// Its time, ns since 1970 (UTC).
    pub unix_ns: i64,
    /// The change, as text.
    pub what: String,
}

/// A gap in a recording.
#[derive(Debug, Serialize)]
pub struct SummaryGap {
    /// The time at which the recording continues, ns since 1970 (UTC).
    pub unix_ns: i64,
    /// How long the gap lasts, ns.
    pub after_ns: i64,
    /// The gap, as text.
    pub what: String,
}

impl SummaryProgram {
    fn of(program: &RecordedProgram) -> SummaryProgram {
        let files: Vec<String> = program.files.iter().map(|file| file.name.clone()).collect();
        SummaryProgram {
            controller: files.first().cloned().unwrap_or_default(),
            files,
            sha256: program.hash.clone(),
            source: program.source.clone(),
            version: program.version.clone(),
            generation: program.generation,
            process_start_unix_ns: program.process_start_ns,
        }
    }
}

impl RecordingSummary {
    /// Describes a recording.
    pub fn of(recording: &Recording) -> RecordingSummary {
        let (sections, stretches) = (0..recording.count(), recording.stretches());
        let lasts_ns = |begin_ns: i64, end_ns: i64| end_ns.saturating_sub(begin_ns);
        let recorded_ns: u128 = stretches
            .iter()
            .map(|stretch| {
                u128::from(lasts_ns(stretch.begin_ns, stretch.end_ns).max(0).unsigned_abs())
            })
            .sum();
        let bytes = recording.bytes();
        let a_day = (u128::from(bytes) * DAY_NS).checked_div(recorded_ns);
        let gaps = stretches.iter().filter_map(|stretch| {
            let what = recording.gap_before(stretch.sections.start)?.to_string();
            let before_ns = recording.head(stretch.sections.start - 1).end_ns;
            let after_ns = lasts_ns(before_ns, stretch.begin_ns);
            Some(SummaryGap { unix_ns: stretch.begin_ns, after_ns, what })
        });
        let span = recording.span();
        let mut summary = RecordingSummary {
            begin_unix_ns: span.as_ref().map(|span| *span.start()),
            end_unix_ns: span.as_ref().map(|span| *span.end()),
            first_scan: stretches.first().map_or(0, |first| first.first_scan),
            last_scan: stretches.last().map_or(0, |last| last.last_scan),
            scans: sections.clone().map(|at| u64::from(recording.head(at).scans)).sum(),
            sections: sections.len(),
            base_images: sections.filter(|at| recording.has_base(*at)).count(),
            bytes,
            bytes_per_day: a_day
                .filter(|_| recorded_ns >= MEASURED_NS)
                .and_then(|bytes| bytes.try_into().ok()),
            gaps: gaps.collect(),
            ..RecordingSummary::default()
        };
        summary.look_into(recording);
        summary
    }

    /// Adds the facts that are only in the sections themselves.
    fn look_into(&mut self, recording: &Recording) {
        let (mut periods, mut own_periods, mut mode) = (Vec::new(), Vec::new(), None);
        for at in 0..recording.count() {
            self.note_program(recording, at);
            let Ok(Some((_, body))) = recording.read(at) else {
                self.damaged_sections += 1;
                continue;
            };
            let (start, begin_ns) = (recording.start(at, &body), recording.head(at).begin_ns);
            if mode.replace(body.mode).is_some_and(|mode| mode != body.mode) {
                self.changed(begin_ns, body.mode.to_string());
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
                        let unix_ns = now_ns.map_or(begin_ns, |now_ns| start.unix_ns(now_ns));
                        self.changed(unix_ns, new.to_string());
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

    /// Notes the program of a section, if it is not that of the section before it.
    fn note_program(&mut self, recording: &Recording, at: usize) {
        let program = recording.program(at);
        let before = at.checked_sub(1).map(|before| recording.program(before));
        if before == Some(program) {
            return;
        }
        if before.is_some_and(|before| before.process_start_ns == program.process_start_ns) {
            self.changed(recording.head(at).begin_ns, format!("{} of the ladder", program.source));
        }
        self.programs.push(SummaryProgram::of(program));
    }

    fn changed(&mut self, unix_ns: i64, what: String) {
        self.changes.push(SummaryChange { unix_ns, what });
    }
}

fn median(numbers: &mut [u64]) -> Option<u64> {
    let middle = numbers.len() / 2;
    (!numbers.is_empty()).then(|| *numbers.select_nth_unstable(middle).1)
}
