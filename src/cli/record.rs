//! `rungd record`: lists, verifies and cuts recordings, and writes out the program of a recording.
//!
//! `replay` executes a recording and traces it, for `export` too; `record_info` describes one.

use std::fs;
use std::io::{BufWriter, Write};
use std::ops::{Range, RangeInclusive};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};

use super::exit::Exit;
use super::new_file::new_file;
use super::operator::OperatorArgs;
use super::record_info;
use super::recording::{self, AskedRecording};
use super::replay;
use super::replay_args::ReplayArgs;
use super::terminal::{one_line, plain_json, print, say_line};
use super::when::{LocalClock, RecordingPlace, WrittenTime};
use rungd_base::scan_period::ScanPeriod;
use rungd_config::load;
use rungd_history::playback::{Playback, Verified, subject_and_settings, whole_program};
use rungd_history::record::{RecordedStretch, Recording, RecordingSummary};
use rungd_lab::testing::{ScenarioOf, scenario};
use rungd_runtime::TapeSection;

/// Lists, verifies and cuts recordings of the scan log
#[derive(Args, Debug)]
pub struct RecordArgs {
    #[command(subcommand)]
    what: RecordCommand,
}

#[derive(Subcommand, Debug)]
enum RecordCommand {
    /// Lists the stretches of a recording: times, scans, programs, and the gaps
    List {
        #[command(flatten)]
        source: RecordingSource,
    },
    /// Describes a recording: its program, time, scans, size, changes of mode and gaps
    Info {
        #[command(flatten)]
        source: RecordingSource,
    },
    /// Executes a recording again, and compares every hash in it
    Verify {
        #[command(flatten)]
        source: RecordingSource,
    },
    /// Writes a part of a recording as a file of its own
    Cut {
        #[command(flatten)]
        source: RecordingSource,
        #[command(flatten)]
        part: RecordedPart,
        /// The file to write
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Writes the values of operands, scan by scan: as `rungd replay --trace`
    Export {
        #[command(flatten)]
        source: RecordingSource,
        #[command(flatten)]
        part: RecordedPart,
        /// Operands, in this order
        #[arg(long, value_name = "A,B,…", value_delimiter = ',', required = true)]
        watch: Vec<String>,
        /// The file to write: CSV, a timing diagram if the name ends in .svg, waves if in .vcd; -
        /// is CSV on standard output
        #[arg(short, long, value_name = "X.csv|X.svg|X.vcd|-")]
        output: PathBuf,
    },
    /// Makes a test from a part of a recording: inputs and writes become steps, outputs and alarms
    /// become expectations
    Test {
        #[command(flatten)]
        source: RecordingSource,
        #[command(flatten)]
        part: RecordedPart,
        /// The test file to write; - is standard output
        #[arg(short, long, value_name = "FILE.test.toml", default_value = "-")]
        output: PathBuf,
    },
    /// Writes out the files of the recorded program
    Files {
        #[command(flatten)]
        source: RecordingSource,
        /// The program of this time (default: the newest)
        #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
        #[arg(value_parser = WrittenTime::parse)]
        at: Option<WrittenTime>,
        /// The folder to write them into; it is created if it does not exist
        #[arg(short, long, value_name = "DIR")]
        output: PathBuf,
    },
}

/// The source of a recording.
#[derive(Args, Clone, Debug)]
pub struct RecordingSource {
    /// A recording: a file, or a folder as `[record] dir` names it (default: the last minute of the
    /// running controller)
    #[arg(value_name = "RECORDING")]
    pub path: Option<PathBuf>,
    #[command(flatten)]
    pub at: OperatorArgs,
}

/// A part of a recording.
#[derive(Args, Clone, Debug)]
pub struct RecordedPart {
    /// From this time or scan on: `10:02`, `yesterday 23:50`, `-15m`, `scan 81234`
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = WrittenTime::parse)]
    pub from: Option<WrittenTime>,
    /// Until this time or scan
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = WrittenTime::parse)]
    pub to: Option<WrittenTime>,
}

/// Executes the subcommand.
///
/// # Errors
/// The recording cannot be read, or the output cannot be written.
pub fn record(args: &RecordArgs) -> Result<Exit> {
    let (RecordCommand::List { source }
    | RecordCommand::Info { source }
    | RecordCommand::Export { source, .. }
    | RecordCommand::Verify { source }
    | RecordCommand::Cut { source, .. }
    | RecordCommand::Test { source, .. }
    | RecordCommand::Files { source, .. }) = &args.what;
    if let RecordCommand::Export { output, .. } = &args.what
        && let Some(exit) = replay::refused_trace("-o", output, source.path.iter())?
    {
        return Ok(exit);
    }
    let opened = match (&args.what, &source.path) {
        // A list needs no more than heads.
        (RecordCommand::List { .. }, Some(path)) => {
            AskedRecording::Opened(recording::opened_heads(path)?)
        }
        _ => recording::of(source.path.as_ref(), &source.at)?,
    };
    let recording = match opened {
        AskedRecording::Opened(recording) => recording,
        AskedRecording::Refused(exit) => return Ok(exit),
    };
    recording::tell_flaws(&recording);
    if recording.count() == 0 && !recording.flaws.is_empty() {
        say_line("rungd: there is no recording in it");
        return Ok(Exit::Refused);
    }
    match &args.what {
        RecordCommand::List { source } => list(&recording, source.at.json),
        RecordCommand::Info { source } => info(&recording, source.at.json),
        RecordCommand::Export { source, part, watch, output } => {
            let RecordedPart { from, to } = part.clone();
            let (recorded, trace) = (source.path.clone().unwrap_or_default(), Some(output.clone()));
            let (ladder, watch) = (Vec::new(), Some(watch.clone()));
            let args = ReplayArgs { recording: recorded, from, to, ladder, watch, trace };
            replay::replay_of(&args, recording)
        }
        RecordCommand::Verify { source } => verify(recording, source.at.json),
        RecordCommand::Cut { part, output, .. } => cut(&recording, part, output),
        RecordCommand::Test { part, output, .. } => test(recording, part, output),
        RecordCommand::Files { at, output, .. } => files(&recording, at.as_ref(), output),
    }
}

fn list(recording: &Recording, json: bool) -> Result<Exit> {
    let all = recording.stretches();
    if json {
        let all: Vec<_> = all.iter().map(|stretch| stretch_json(recording, stretch)).collect();
        print(&format!("{}\n", plain_json(&serde_json::json!({ "stretches": all }).to_string())))?;
        return Ok(Exit::Ok);
    }
    let clock = LocalClock::here();
    if all.is_empty() {
        print("nothing is recorded\n")?;
    }
    for stretch in &all {
        print(&stretch_text(recording, stretch, &clock))?;
    }
    Ok(Exit::Ok)
}

fn info(recording: &Recording, json: bool) -> Result<Exit> {
    let summary = RecordingSummary::of(recording);
    if json {
        print(&format!("{}\n", plain_json(&record_info::json(&summary)?.to_string())))?;
    } else {
        print(&record_info::text(&summary, &LocalClock::here()))?;
    }
    Ok(Exit::Ok)
}

fn stretch_text(recording: &Recording, stretch: &RecordedStretch, clock: &LocalClock) -> String {
    let program = recording.program(stretch.sections.start);
    let begin = clock.text(stretch.begin_ns);
    let end = clock.end_text(stretch.begin_ns, stretch.end_ns);
    let name = program.files.first().map_or("", |file| file.name.as_str());
    let hash = program.hash.get(..12).unwrap_or_default();
    let mut text = String::new();
    if let Some(gap) = recording.gap_before(stretch.sections.start) {
        text += &format!("  -- {gap}\n");
    }
    text += &format!(
        "{begin} to {end}  scans {} to {}  {} {hash} ({})\n",
        stretch.first_scan,
        stretch.last_scan,
        one_line(name),
        one_line(&program.source)
    );
    text
}

fn stretch_json(recording: &Recording, stretch: &RecordedStretch) -> serde_json::Value {
    let program = recording.program(stretch.sections.start);
    serde_json::json!({
        "begin_unix_ns": stretch.begin_ns,
        "end_unix_ns": stretch.end_ns,
        "first_scan": stretch.first_scan,
        "last_scan": stretch.last_scan,
        "sections": stretch.sections.len(),
        "gap_before": recording.gap_before(stretch.sections.start).map(|gap| gap.to_string()),
        "version": program.version,
        "generation": program.generation,
        "source": program.source,
        "sha256": program.hash,
        "files": program.files.iter().map(|file| &file.name).collect::<Vec<_>>(),
    })
}

fn verify(recording: Recording, json: bool) -> Result<Exit> {
    let count = recording.count();
    let mut playback = Playback::new(recording, whole_program);
    let verified = playback.verify(0..count);
    if json {
        let json = serde_json::json!({
            "scans": verified.scans,
            "sections": verified.sections,
            "compared": verified.compared,
            "gaps": verified.gaps,
            "unreplayable": verified.unreplayable,
            "first_difference": verified.first_difference,
        });
        print(&format!("{json}\n"))?;
    } else {
        print(&verdict(playback.recording(), &verified))?;
    }
    let is_proven = count > 0 && verified.first_difference.is_none() && verified.unreplayable == 0;
    Ok(if is_proven { Exit::Ok } else { Exit::Refused })
}

/// The result of a verification as text.
fn verdict(recording: &Recording, verified: &Verified) -> String {
    let Verified { scans, sections, compared, gaps, unreplayable, first_difference } = *verified;
    if recording.count() == 0 {
        return "nothing is recorded\n".to_owned();
    }
    let mut text = format!("{scans} scans in {sections} sections were executed again: ");
    text += &match first_difference {
        None => format!("all {compared} hashes are equal\n"),
        Some(at) => {
            let begin = LocalClock::here().text(recording.head(at).begin_ns);
            format!("from {begin} on memory is not as it was recorded\n")
        }
    };
    if gaps > 0 {
        let gaps = if gaps == 1 { "1 gap".into() } else { format!("{gaps} gaps") };
        text += &format!("{gaps}: see `rungd record list`\n");
    }
    if unreplayable > 0 {
        text += &format!("sections that cannot be executed: {unreplayable}\n");
    }
    text
}

fn cut(recording: &Recording, part: &RecordedPart, output: &Path) -> Result<Exit> {
    let sections = sections(recording, part)?;
    let mut file = BufWriter::new(new_file(output)?);
    recording.cut(sections, &mut file).with_context(|| output.display().to_string())?;
    file.flush().with_context(|| output.display().to_string())?;
    Ok(Exit::Ok)
}

/// Whether a moment is after the last scan of a recording.
fn is_after(when: &WrittenTime, clock: &LocalClock, span: &RangeInclusive<i64>) -> bool {
    matches!(when.find(clock, span.clone()), RecordingPlace::Time(unix_ns) if unix_ns > *span.end())
}

/// The sections of a part of a recording, at least one.
///
/// # Errors
/// The part is empty.
pub(super) fn sections(recording: &Recording, part: &RecordedPart) -> Result<Range<usize>> {
    let Some(span) = recording.span() else { bail!("the recording is empty") };
    let clock = LocalClock::here();
    let place =
        |when: &WrittenTime| recording::section_at(recording, when.find(&clock, span.clone()));
    let first = part.from.as_ref().map_or(0, |when| place(when).unwrap_or(0));
    let last = recording.count() - 1;
    let end = part.to.as_ref().map_or(Some(last), place);
    let is_after = part.from.as_ref().is_some_and(|when| is_after(when, &clock, &span));
    match end {
        Some(end) if first <= end && !is_after => Ok(first..end + 1),
        Some(_) | None => {
            let (begin, end) = (clock.text(*span.start()), clock.text(*span.end()));
            bail!("nothing is recorded then: the recording is of {begin} to {end}")
        }
    }
}

fn test(recording: Recording, part: &RecordedPart, output: &Path) -> Result<Exit> {
    let range = sections(&recording, part)?;
    let program = Arc::clone(recording.program(range.end - 1));
    // The range is the last sections that have the newest program and no gap.
    let is_one = |at: &usize| recording.program(*at) == &program;
    let mut first = range.end - 1;
    while first > range.start && is_one(&(first - 1)) && recording.follows(first) {
        first -= 1;
    }
    let clock = LocalClock::here();
    let name = format!("as recorded on {}", clock.text(recording.head(first).begin_ns));
    let (subject, controller) = subject_and_settings(&program).map_err(anyhow::Error::msg)?;
    let period = controller.map_or(ScanPeriod::DEFAULT, |controller| controller.period);
    let mut playback = Playback::new(recording, whole_program);
    let made = (first..range.end).map(|at| playback.section(at));
    let made: Vec<TapeSection> = made.collect::<Result<_, _>>()?;
    let controller_text = program.files.first().map_or("", |file| &file.text);
    let ladders = program.files.iter().skip(1).take(load::ladders_named(controller_text));
    let ladders = ladders.map(|file| file.name.clone()).collect();
    let source = ScenarioOf { subject: &subject, ladders, period, sections: &made, name };
    let text = scenario(&source);
    if output == Path::new("-") {
        print(&text)?;
    } else {
        let mut file = new_file(output)?;
        file.write_all(text.as_bytes()).with_context(|| output.display().to_string())?;
    }
    Ok(Exit::Ok)
}

fn files(recording: &Recording, at: Option<&WrittenTime>, output: &Path) -> Result<Exit> {
    let part = RecordedPart { from: None, to: at.cloned() };
    let sections = sections(recording, &part)?;
    let program = recording.program(sections.end - 1);
    fs::create_dir_all(output).with_context(|| output.display().to_string())?;
    for file in &program.files {
        let path = output.join(inside(&file.name));
        if path.exists() {
            bail!("{} is there already: name another folder", path.display());
        }
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        }
        fs::write(&path, &*file.text).with_context(|| path.display().to_string())?;
        print(&format!("{}\n", one_line(&path.display().to_string())))?;
    }
    Ok(Exit::Ok)
}

/// The path of a recorded file within a folder. The name comes from outside, so parts that lead out
/// of the folder are removed.
fn inside(name: &str) -> PathBuf {
    let parts = Path::new(name).components().filter_map(|part| match part {
        Component::Normal(part) => Some(part),
        Component::Prefix(_) | Component::RootDir | Component::CurDir | Component::ParentDir => {
            None
        }
    });
    parts.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_file_name_leads_out_of_the_folder() {
        assert_eq!(inside("programs/a.toml"), Path::new("programs/a.toml"));
        assert_eq!(inside("/etc/rungd/a.toml"), Path::new("etc/rungd/a.toml"));
        assert_eq!(inside("../../a.toml"), Path::new("a.toml"));
        assert_eq!(inside("lib:pid"), Path::new("lib:pid"));
    }
}
