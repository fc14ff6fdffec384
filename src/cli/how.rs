//! `rungd how`: the shortest inputs after which a condition is true, or the proof that there are
//! none.
//!
//! This module asks the question as a test file would, and prints the answer; `rungd-prove`
//! decides, and tries what it has found.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Result;
use clap::Args;
use serde_json::{Value, json};

use super::asked_ladders::AskedLadders;
use super::early_end::{EarlyEnd, time};
use super::exit::Exit;
use super::terminal::{plain_json, print};
use rungd_prove::answer::{Answer, AnswerVerdict};
use rungd_prove::decide::{DecideLimits, decide};
use rungd_prove::kept::KeptAnswers;
use rungd_prove::question::Questions;

/// The memory for states, bytes.
const MEMORY: usize = 2 << 30;

/// Says how a condition can become true, by the shortest inputs that are found
///
/// From a cold start of the ladders of --cold. Every input may change before every scan. What is
/// found was executed. Exit code 1: it cannot become true, which is proved; 2: not decided.
#[derive(Args, Debug)]
pub struct HowArgs {
    /// The condition, as in a test: a tag, or "pump1 & level > 3.5"
    condition: String,
    /// The ladder files, or a controller file
    #[arg(long, required = true, num_args = 1.., value_name = "FILE")]
    cold: Vec<PathBuf>,
    /// What an operator may write too
    #[arg(long, value_name = "TAG,…", value_delimiter = ',')]
    writes: Vec<String>,
    /// The scan period, if the ladders have no controller file
    #[arg(long, value_name = "TIME", default_value = "10ms")]
    period: String,
    /// The time for the search: 5m, 90s
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = time)]
    time: Duration,
    /// Print the answer as JSON
    #[arg(long)]
    json: bool,
}

/// Answers the question.
///
/// # Errors
/// A file cannot be read.
pub fn how(args: &HowArgs) -> Result<Exit> {
    let end = EarlyEnd::of(None)?;
    let quoted = |text: &str| serde_json::to_string(text);
    let mut rest = format!("always = [{}]\n", quoted(&format!("!({})", args.condition))?);
    if !args.writes.is_empty() {
        let writable = serde_json::to_string(&args.writes)?;
        rest += &format!("[prove]\nevents = [\"writes\"]\nwritable = {writable}\n");
    }
    let ladders = AskedLadders { paths: &args.cold, period: &args.period, rest: &rest };
    let Some(suite) = ladders.suite()? else { return Ok(Exit::Config) };
    let mut questions = Questions::new(suite);
    // Whether each side can be is not asked.
    questions.lines[0].sides.clear();
    let given_up = Arc::clone(&end.is_over);
    let limits = DecideLimits { time: args.time, memory: MEMORY, given_up };
    let answer = decide(&questions, &questions.lines[0], &limits, &KeptAnswers::default());
    match args.json {
        true => print(&format!("{}\n", plain_json(&json_of(args, &answer).to_string())))?,
        false => print(&text_of(args, &answer))?,
    }
    Ok(match answer.verdict {
        AnswerVerdict::Violated { .. } => Exit::Ok,
        AnswerVerdict::Proved { .. } => Exit::Refused,
        AnswerVerdict::NotDecided { .. } => Exit::UNDECIDED,
    })
}

fn text_of(args: &HowArgs, answer: &Answer) -> String {
    let condition = &args.condition;
    match &answer.verdict {
        AnswerVerdict::Violated { scan, scenario, .. } => {
            let when = answer.when(*scan);
            let mut text = format!("{condition} is true at {when} by these inputs:\n\n");
            let scenario = of_condition(scenario, condition);
            scenario.lines().for_each(|line| text += &format!("    {line}\n"));
            text
        }
        AnswerVerdict::Proved { way, .. } => {
            format!("{condition} cannot be: proved\n  {}\n", way.text())
        }
        AnswerVerdict::NotDecided { covered, cause } => {
            let mut text = format!("{condition}: not decided\n  stood in the way: {cause}\n");
            covered.iter().for_each(|covered| text += &format!("  {covered}\n"));
            text
        }
    }
}

/// The scenario, with the condition as its end.
fn of_condition(scenario: &str, condition: &str) -> String {
    let quoted = |text: &str| Value::from(text).to_string();
    let lines = scenario.lines().map(|line| match line {
        _ if line.starts_with("name") => {
            format!("name  = {}\n", quoted(&format!("how: {condition}")))
        }
        "]" => format!("    {},\n]\n", quoted(&format!("expect: {condition}"))),
        line => format!("{line}\n"),
    });
    lines.collect()
}

fn json_of(args: &HowArgs, answer: &Answer) -> Value {
    let mut all = answer.json(&args.condition);
    let word = match &answer.verdict {
        AnswerVerdict::Violated { scenario, .. } => {
            all["scenario"] = json!(of_condition(scenario, &args.condition));
            "found"
        }
        AnswerVerdict::Proved { .. } => "cannot be",
        AnswerVerdict::NotDecided { .. } => "not decided",
    };
    all["answer"] = json!(word);
    all["condition"] = json!(args.condition);
    for key in ["file", "line", "can", "kept", "why"] {
        all.as_object_mut().map(|object| object.remove(key));
    }
    all
}
