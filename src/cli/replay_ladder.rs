//! `rungd replay --ladder`: executes a different program on the recorded inputs, and compares it
//! with the recorded program.
//!
//! Reads the new ladder files and prints their findings and the report; `playback` executes both
//! programs and finds the differences. The reaction of the plant to different outputs is unknown.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, bail};

use super::check::style;
use super::compared;
use super::exit::{CommandLine, Exit};
use super::recorded_trace::RecordedTrace;
use super::replay_args::{ReplayArgs, ReplayScene, pace};
use super::replay_why::{self, NewProgramRun};
use super::terminal::{say_findings, say_line};
use super::when::LocalClock;
use rungd_config::load::{self, library};
use rungd_history::playback::{PlayableProgram, ProgramComparison, TwinRun};
use rungd_history::record::{RecordedFile, RecordedProgram, Recording};
use rungd_language::source::render::{refuses, render};
use rungd_language::source::span::SourceFile;
use rungd_language::source::wording::{counted, thousands};

/// The last sentence of every report.
const OPEN_LOOP: &str = "open loop: the inputs are the recorded ones; the reaction of the plant to \
                         different outputs is not simulated\n";

/// Replays with different ladder files.
///
/// # Errors
/// A file cannot be read, the trace cannot be written, or the command line is wrong.
pub(super) fn replay(
    args: &ReplayArgs,
    recording: &Arc<Recording>,
    scene: ReplayScene,
) -> Result<Exit> {
    let ReplayScene { programs, window, clock } = scene;
    let Some(new) = loaded(args, recording.program(window.sections.start))? else {
        return Ok(Exit::Config);
    };
    let mut comparison =
        ProgramComparison::of(programs, &new, args.watch.as_deref()).map_err(CommandLine)?;
    let (places, watched) = compared::watched(&comparison, args.watch.is_some());
    let mut trace = match &args.trace {
        Some(path) => Some(RecordedTrace::create(path, &watched)?),
        None => None,
    };
    let begun = Instant::now();
    let mut twin = TwinRun::new(recording, programs, &new);
    let mut failures = Vec::new();
    let (first, mut values, mut end_ns) = (window.sections.start, Vec::new(), 0);
    for at in recording.base_of(first).unwrap_or(first)..window.sections.end {
        if !recording.follows(at) {
            comparison.end(end_ns);
        }
        let done = twin.section(at, &mut |seen| {
            end_ns = seen.scan.unix_ns;
            if at < first || !window.has(&seen.scan) {
                return;
            }
            comparison.look(seen);
            if let Some(trace) = &mut trace {
                values.clear();
                values.extend(places.iter().map(|place| comparison.values[*place]));
                trace.put(&seen.scan, &values);
            }
        });
        match done {
            Ok(ended) if ended.is_break() => break,
            Ok(_) => {}
            Err(why) => failures.push((at, why)),
        }
    }
    comparison.end(end_ns);
    if let Some(trace) = trace {
        trace.finish()?;
    }
    let seconds = begun.elapsed().as_secs_f64();
    let mut text = compared::text(&comparison, clock);
    let again = TwinRun::new(recording, programs, &new);
    let run = NewProgramRun { first, new: &new, again };
    text.push_str(&replay_why::reasons(recording, run, &comparison));
    text.push_str(&format!(
        "{} {}; {} of {} of the old program equal\n",
        counted(twin.scans, "scan"),
        pace(recording, window, seconds),
        thousands(twin.compared - twin.different),
        counted(twin.compared, "hash").replace("hashs", "hashes"),
    ));
    text.push_str(&remarks(recording, &twin, clock, &failures));
    text.push_str(OPEN_LOOP);
    args.report(&text)?;
    let is_whole = twin.different == 0 && failures.is_empty();
    Ok(if is_whole { Exit::Ok } else { Exit::Refused })
}

/// Remarks in addition to the differences.
fn remarks(
    recording: &Recording,
    twin: &TwinRun,
    clock: &LocalClock,
    failures: &[(usize, String)],
) -> String {
    let mut text = String::new();
    if twin.carried > 1 {
        text.push_str(&format!(
            "the recording has gaps ({}): after each, the new program started again from the old \
             program's memory\n",
            thousands(twin.carried - 1)
        ));
    }
    if let Some(scan) = twin.stopped {
        text.push_str(&format!(
            "the new program stops itself at {} (scan {}): nothing is compared after it\n",
            clock.text(scan.unix_ns),
            scan.number
        ));
    }
    if let Some((at, why)) = failures.first() {
        text.push_str(&format!(
            "{} cannot be replayed; the first, at {}: {why}\n",
            counted(failures.len() as u64, "section"),
            clock.text(recording.head(*at).begin_ns)
        ));
    }
    text
}

/// Loads the recorded controller file with the new ladder files, and prints their findings. `None`
/// if the files are refused.
fn loaded(args: &ReplayArgs, recorded: &RecordedProgram) -> Result<Option<PlayableProgram>> {
    let (files, ladders) = files(&args.ladder, recorded)?;
    let mut loaded = load::recorded_ladders(&files, ladders);
    let style = style(false);
    if !loaded.findings.is_empty() {
        say_findings(&render(&loaded.findings, &loaded.files, style));
    }
    if refuses(&loaded.findings, style) {
        return Ok(None);
    }
    let Some(program) = loaded.program.take() else {
        say_line("rungd: the recorded controller file and these ladder files give no program");
        return Ok(None);
    };
    Ok(Some(PlayableProgram::new(program, loaded)))
}

/// The recorded controller file, its library files, the new ladder files, and the recorded files of
/// the ladders beside the controller's; and the number of ladder files.
fn files(ladders: &[PathBuf], recorded: &RecordedProgram) -> Result<(Vec<SourceFile>, usize)> {
    let Some((controller, old)) = recorded.files.split_first() else {
        bail!("the recording has no controller file");
    };
    let (old, beside) = old.split_at(load::ladders_named(&controller.text).min(old.len()));
    let is_given = |name: &str| ladders.iter().any(|path| path == Path::new(name));
    let stays = |file: &&RecordedFile| {
        library::named(&file.name).is_some_and(|found| found.is_ok()) && !is_given(&file.name)
    };
    let source =
        |file: &RecordedFile| SourceFile { name: file.name.clone(), text: file.text.to_string() };
    let mut files = vec![source(controller)];
    files.extend(old.iter().filter(stays).map(source));
    for path in ladders {
        let name = path.display().to_string();
        let text = match library::named(&name) {
            Some(Ok(file)) => file.text.to_owned(),
            Some(Err((message, help))) => bail!("{message}: {help}"),
            None => {
                let bytes = load::read_bytes(path).with_context(|| name.clone())?;
                let Ok(text) = String::from_utf8(bytes) else {
                    bail!("{name}: the file is not UTF-8 text")
                };
                text
            }
        };
        files.push(SourceFile { name, text });
    }
    let count = files.len() - 1;
    files.extend(beside.iter().map(source));
    Ok((files, count))
}
