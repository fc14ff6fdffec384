//! `rungd replay`: executes a recording again, verifies every hash, and traces operands; or
//! executes a different program on the recorded inputs, by `replay_ladder`.
//!
//! It writes only its trace, and uses no running controller.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;

use super::exit::Exit;
use super::recorded_trace::{RecordedTrace, alarms_text};
use super::replay_args::{ReplayArgs, ReplayScene, pace};
use super::replay_ladder;
use super::replay_window::ReplayWindow;
use super::terminal::say_line;
use super::trace_file;
use super::when::LocalClock;
use super::{recording, watched_operands};
use rungd_history::playback::{AlarmLog, PlacedProgram, Playback, RecordedPrograms, Verified};
use rungd_history::record::{RecordedGap, Recording};
use rungd_language::source::wording::{counted, thousands};

/// Replays a recording.
///
/// # Errors
/// The recording cannot be read, or the trace cannot be written.
pub fn replay(args: &ReplayArgs) -> Result<Exit> {
    if let Some(trace) = &args.trace {
        let reads = args.ladder.iter().chain([&args.recording]);
        if let Some(exit) = refused_trace("--trace", trace, reads)? {
            return Ok(exit);
        }
    }
    let recording = recording::opened(&args.recording)?;
    recording::tell_flaws(&recording);
    replay_of(args, recording)
}

/// Refuses a trace file whose form is unknown or that would overwrite a file that is read. `option`
/// is the option that names it.
///
/// # Errors
/// The command line is wrong.
pub(super) fn refused_trace<'p>(
    option: &str,
    trace: &Path,
    reads: impl Iterator<Item = &'p PathBuf>,
) -> Result<Option<Exit>> {
    trace_file::refuse_other_forms(option, trace)?;
    let read = trace_file::overwritten(trace, reads);
    Ok(read.map(|read| {
        let (trace, read) = (trace.display(), read.display());
        say_line(&format!("error: {option} {trace} would overwrite {read}, which it reads"));
        Exit::Usage
    }))
}

/// Replays an open recording.
///
/// # Errors
/// As [`replay`].
pub(super) fn replay_of(args: &ReplayArgs, recording: Recording) -> Result<Exit> {
    let (recording, clock) = (Arc::new(recording), LocalClock::here());
    let window = match ReplayWindow::of(args.from.as_ref(), args.to.as_ref(), &clock, &recording) {
        Ok(window) => window,
        Err(why) => return Ok(refused(&why)),
    };
    let programs = RecordedPrograms::of(&recording, window.sections.clone());
    if programs.first().is_none() {
        let why = programs.all.iter().find_map(|program| program.as_ref().err());
        say_line(&format!("rungd: {}", why.map_or("there is no program", String::as_str)));
        return Ok(Exit::Config);
    }
    let scene = ReplayScene { programs: &programs, window: &window, clock: &clock };
    if args.ladder.is_empty() {
        same_program(args, &recording, scene)
    } else {
        replay_ladder::replay(args, &recording, scene)
    }
}

fn refused(why: &str) -> Exit {
    say_line(&format!("rungd: {why}"));
    Exit::Refused
}

fn same_program(args: &ReplayArgs, recording: &Arc<Recording>, scene: ReplayScene) -> Result<Exit> {
    let ReplayScene { programs, window, clock } = scene;
    let Some(first) = programs.first() else { return Ok(Exit::Config) };
    let trace_path = args.trace();
    let watched = match &trace_path {
        Some(_) => {
            watched_operands::watched(args.watch.as_deref(), &first.program, &first.symbols)?
        }
        None => Vec::new(),
    };
    let mut trace = match &trace_path {
        Some(path) => Some(RecordedTrace::create(path, &watched)?),
        None => None,
    };
    let mut alarms = AlarmLog::default();
    let begun = Instant::now();
    let mut playback = Playback::new(Arc::clone(recording), programs);
    let (verified, different) = playback.verify_seen(window.sections.clone(), |scan, engine| {
        if let Ok(program) = programs.program(scan.section)
            && window.has(&scan)
        {
            let program = PlacedProgram { place: programs.place(scan.section), program };
            alarms.look(program, &scan, engine.image());
            if let Some(trace) = &mut trace {
                trace.look(program, &scan, engine.image());
            }
        }
    });
    if let Some(trace) = trace {
        trace.finish()?;
    }
    let seconds = begun.elapsed().as_secs_f64();
    let mut text = alarms_text(&alarms, clock);
    let done = VerifiedReplay { verified: &verified, different: &different, seconds };
    text.push_str(&verdict(done, recording, window, clock));
    args.report(&text)?;
    io::stdout().flush()?;
    for why in programs.all.iter().filter_map(|program| program.as_ref().err()) {
        say_line(&format!("warning: {why}"));
    }
    let is_whole = different.is_empty() && verified.unreplayable == 0;
    Ok(if is_whole { Exit::Ok } else { Exit::Refused })
}

/// The result of a replay of the recorded programs.
struct VerifiedReplay<'a> {
    verified: &'a Verified,
    /// The sections that differ.
    different: &'a [usize],
    /// The duration.
    seconds: f64,
}

/// The last lines of the report.
fn verdict(
    VerifiedReplay { verified, different, seconds }: VerifiedReplay,
    recording: &Recording,
    window: &ReplayWindow,
    clock: &LocalClock,
) -> String {
    let sections = window.sections.clone();
    let (compared, different) = (verified.compared, different.len() as u64);
    let mut text = format!(
        "{} {}; {} of {} equal",
        counted(verified.scans, "scan"),
        pace(recording, window, seconds),
        thousands(compared - different),
        counted(compared, "hash").replace("hashs", "hashes"),
    );
    let gaps: Vec<usize> = sections.clone().skip(1).filter(|at| !recording.follows(*at)).collect();
    if !gaps.is_empty() {
        text.push_str(&format!("; {}", counted(gaps.len() as u64, "gap")));
        let told: Vec<String> =
            gaps.iter().take(GAPS_TOLD).map(|at| gap(recording, *at, clock)).collect();
        text.push_str(&format!(" {}", told.join(", ")));
        if gaps.len() > GAPS_TOLD {
            text.push_str(" …");
        }
    }
    text.push('\n');
    if let Some(at) = verified.first_difference {
        let head = recording.head(at);
        let version = &recording.program(at).version;
        text.push_str(&format!(
            "the first difference is in {} to {} (scan {} and the {} after it): this rungd {} does \
             not compute what rungd {version} recorded, or the recording was changed\n",
            clock.text(head.begin_ns),
            clock.end_text(head.begin_ns, head.end_ns),
            head.number,
            head.scans.saturating_sub(1),
            env!("CARGO_PKG_VERSION"),
        ));
    }
    if verified.unreplayable > 0 {
        text.push_str(&format!(
            "{} of the recording cannot be replayed: damaged, without a base image before it, or \
             not of its program\n",
            counted(verified.unreplayable, "section")
        ));
    }
    text
}

/// The maximum number of gaps that are listed with their times.
const GAPS_TOLD: usize = 3;

/// `of 3 steps at 2026-11-22 10:02:03.500`.
fn gap(recording: &Recording, at: usize, clock: &LocalClock) -> String {
    let when = clock.text(recording.head(at).begin_ns);
    match recording.gap_before(at) {
        Some(RecordedGap::Restart) => format!("by a start at {when}"),
        Some(RecordedGap::Lost(0)) | None => format!("at {when}"),
        Some(RecordedGap::Lost(steps)) => format!("of {} at {when}", counted(steps, "step")),
    }
}
