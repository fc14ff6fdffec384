//! `rungd how`: the shortest inputs after which a condition is true, or the proof that there are
//! none.
//!
//! This module finds the state that the question is about, and prints the answer; `rungd-prove`
//! decides, and tries what it has found.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Result;
use clap::Args;
use clap_complete::engine::ArgValueCompleter;

use super::asked_ladders::AskedLadders;
use super::early_end::{EarlyEnd, time};
use super::exit::Exit;
use super::operator::{OperatorArgs, complete};
use super::recording::{self, AskedRecording};
use super::terminal::{plain_json, print, say_line};
use super::when::{LocalClock, WrittenTime};
use rungd_history::playback;
use rungd_lab::testing::AskedCondition;
use rungd_prove::decide::DecideLimits;
use rungd_prove::how::{HowAnswer, HowBegin, HowQuestion, HowVerdict};

/// The memory for states, bytes.
const MEMORY: usize = 2 << 30;

/// Says how a condition can become true: the shortest inputs that are found, or a proof that there
/// are none
///
/// From the present state of the running controller, from a moment of --recording, or from a cold
/// start of the ladders of --cold. Every input may change before every scan; what is forced stays
/// so. What is found was executed. Exit code 1: it cannot become true, which is proved; 2: not
/// decided.
#[derive(Args, Debug)]
pub struct HowArgs {
    /// The condition, as in a test: a tag, or "pump1 & level > 3.5"
    #[arg(value_name = "CONDITION", add = ArgValueCompleter::new(complete))]
    condition: String,
    /// From a cold start of these ladder files, or of a controller file
    #[arg(long, num_args = 1.., value_name = "FILE", conflicts_with_all = ["recording", "at"])]
    cold: Vec<PathBuf>,
    /// From this time or scan on: `10:02:03`, `yesterday 23:50`, `-15s` (before the last scan),
    /// `scan 81234` (default: now)
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = WrittenTime::parse)]
    at: Option<WrittenTime>,
    /// A recording: a file, or a folder as `[record] dir` names it (default: the last minute of
    /// the running controller)
    #[arg(long, value_name = "RECORDING")]
    recording: Option<PathBuf>,
    /// What an operator may write too
    #[arg(long, value_name = "TAG,…", value_delimiter = ',')]
    writes: Vec<String>,
    /// The scan period of --cold, if the ladders have no controller file
    #[arg(long, value_name = "TIME", default_value = "10ms")]
    period: String,
    /// The time for the search: 5m, 90s
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = time)]
    time: Duration,
    #[command(flatten)]
    controller: OperatorArgs,
}

/// Answers the question.
///
/// # Errors
/// A file cannot be read.
pub fn how(args: &HowArgs) -> Result<Exit> {
    let end = EarlyEnd::of(None)?;
    let question = match args.cold.is_empty() {
        true => recorded(args)?,
        false => cold(args)?,
    };
    let question = match question {
        AskedHow::Asked(question) => question,
        AskedHow::Refused(exit) => return Ok(exit),
    };
    let given_up = Arc::clone(&end.is_over);
    let limits = DecideLimits { time: args.time, memory: MEMORY, given_up };
    let answer = question.answer(&limits);
    if args.controller.json {
        print(&format!("{}\n", plain_json(&answer.json().to_string())))?;
    } else {
        print(&format!("{}{}", state_line(args, &answer), answer.text()))?;
    }
    Ok(match answer.verdict {
        HowVerdict::Holds | HowVerdict::Found { .. } => Exit::Ok,
        HowVerdict::Never { .. } => Exit::Refused,
        HowVerdict::Open { .. } => Exit::UNDECIDED,
    })
}

/// What was asked.
enum AskedHow {
    Asked(Box<HowQuestion>),
    /// The findings or the refusal are printed.
    Refused(Exit),
}

impl AskedHow {
    fn asked(question: HowQuestion) -> AskedHow {
        AskedHow::Asked(Box::new(question))
    }
}

/// The question from a cold start.
fn cold(args: &HowArgs) -> Result<AskedHow> {
    let condition = serde_json::to_string(&args.condition)?;
    let mut rest = format!("[prove]\ncan = [{condition}]\n");
    if !args.writes.is_empty() {
        let writable = serde_json::to_string(&args.writes)?;
        rest += &format!("events = [\"writes\"]\nwritable = {writable}\n");
    }
    let ladders = AskedLadders { paths: &args.cold, period: &args.period, rest: &rest };
    let question = ladders.suite()?.map(HowQuestion::cold);
    Ok(question.map_or(AskedHow::Refused(Exit::Config), AskedHow::asked))
}

/// The question from a state.
fn recorded(args: &HowArgs) -> Result<AskedHow> {
    let recording = match recording::of(args.recording.as_ref(), &args.controller)? {
        AskedRecording::Opened(recording) => recording,
        AskedRecording::Refused(exit) => return Ok(AskedHow::Refused(exit)),
    };
    recording::tell_flaws(&recording);
    let asked = AskedCondition { condition: &args.condition, writes: &args.writes };
    let question = recording::moment(args.at.as_ref(), &recording)
        .and_then(|(section, at)| playback::moment(&Arc::new(recording), section, at))
        .and_then(|moment| HowQuestion::recorded(moment, asked));
    Ok(question.map_or_else(|why| AskedHow::Refused(refused(args, &why)), AskedHow::asked))
}

fn refused(args: &HowArgs, why: &str) -> Exit {
    if args.controller.json {
        let error = serde_json::json!({ "error": { "kind": "refused", "message": why } });
        let _ = print(&format!("{}\n", plain_json(&error.to_string())));
    } else {
        say_line(&format!("rungd: {why}"));
    }
    Exit::Config
}

/// The state that an answer to `--at` is about.
fn state_line(args: &HowArgs, answer: &HowAnswer) -> String {
    match &answer.begin {
        Some(HowBegin { scan: Some(scan), unix_ns: Some(unix_ns), .. }) if args.at.is_some() => {
            let time = LocalClock::here().text(*unix_ns);
            format!("from the end of scan {scan}, {time}:\n")
        }
        Some(_) | None => String::new(),
    }
}
