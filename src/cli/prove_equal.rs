//! `rungd prove --equal`: whether two ladders drive the same outputs for every sequence of inputs.
//!
//! This module reads both ladders, as a test file would name them, and prints the answer;
//! `rungd-prove` decides.

use std::path::Path;

use anyhow::Result;
use clap::Args;
use serde_json::{Value, json};

use super::asked_ladders::AskedLadders;
use super::exit::{CommandLine, Exit};
use super::terminal::{one_line, plain_json, print};
use rungd_lab::testing::{ProofEvent, Suite};
use rungd_prove::decide::DecideLimits;
use rungd_prove::equal::{DifferentOutput, EqualAnswer, EqualQuestion, LadderDifference, equal};

/// How two ladders are compared.
#[derive(Args, Debug)]
pub struct ComparedArgs {
    /// With --equal and --survey: the scan period, if the ladders have no controller file
    #[arg(long, value_name = "TIME", default_value = "10ms")]
    period: String,
    /// With --equal: a tag of OLD and its name in NEW
    #[arg(long, value_name = "OLD=NEW", value_delimiter = ',', value_parser = pair)]
    map: Vec<(String, String)>,
    /// With --equal: more bits and words that must be the same, by their names in OLD
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    also: Vec<String>,
    /// With --equal: outputs that are not compared
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    except: Vec<String>,
    /// With --equal: what may happen to both controllers behind any scan: power-cut, restart, stop
    #[arg(long, value_name = "EVENT,…", value_delimiter = ',', value_parser = event)]
    events: Vec<ProofEvent>,
}

impl ComparedArgs {
    /// The scan period of ladder files.
    pub(super) fn period(&self) -> &str {
        &self.period
    }
}

fn pair(text: &str) -> Result<(String, String), String> {
    let pair = text.split_once('=').filter(|(old, new)| !old.is_empty() && !new.is_empty());
    let pair = pair.map(|(old, new)| (old.trim().to_owned(), new.trim().to_owned()));
    pair.ok_or_else(|| "write the name in OLD, `=`, and the name in NEW: `pump1=pump`".to_owned())
}

fn event(text: &str) -> Result<ProofEvent, String> {
    let known = [ProofEvent::PowerCut, ProofEvent::Restart, ProofEvent::Stop];
    known.into_iter().find(|event| event.word() == text).ok_or_else(|| {
        let words = known.map(ProofEvent::word).join(", ");
        format!("write {words}: of two ladders nobody writes, and field devices stay connected")
    })
}

/// The files of two ladders.
#[derive(Clone, Copy)]
pub(super) struct LadderPaths<'p> {
    pub old: &'p Path,
    pub new: &'p Path,
}

/// Compares two ladders.
///
/// # Errors
/// A file cannot be read, or the ladders cannot be compared.
pub(super) fn prove_equal(
    args: &ComparedArgs,
    LadderPaths { old, new }: LadderPaths,
    limits: DecideLimits,
    as_json: bool,
) -> Result<Exit> {
    let (Some(old_suite), Some(new_suite)) = (asked(old, &args.period)?, asked(new, &args.period)?)
    else {
        return Ok(Exit::Config);
    };
    let question = EqualQuestion {
        old: &old_suite,
        new: &new_suite,
        map: &args.map,
        also: &args.also,
        except: &args.except,
        events: &args.events,
        limits,
    };
    let answer = equal(&question).map_err(CommandLine)?;
    let [old, new] = [old, new].map(|path| one_line(&path.to_string_lossy()).into_owned());
    match as_json {
        true => {
            let mut all = json_of(&answer, &old, &new);
            all["events"] = args.events.iter().map(|event| event.word()).collect();
            print(&format!("{}\n", plain_json(&all.to_string())))?;
        }
        false => print(&(text_of(&answer, &old, &new) + &events_text(&args.events)))?,
    }
    Ok(match answer {
        EqualAnswer::Equal(..) => Exit::Ok,
        EqualAnswer::Different(_) => Exit::Refused,
        EqualAnswer::NotDecided(..) => Exit::UNDECIDED,
    })
}

/// A ladder or the ladders of a controller file, without a question.
fn asked(path: &Path, period: &str) -> Result<Option<Suite>> {
    AskedLadders { paths: &[path.to_owned()], period, rest: "always = []\n" }.suite()
}

fn text_of(answer: &EqualAnswer, old: &str, new: &str) -> String {
    match answer {
        EqualAnswer::Equal(way, outputs) => {
            let outputs = outputs.join(", ");
            format!("equal: {old} and {new}\n  {}\n  compared: {outputs}\n", way.text())
        }
        EqualAnswer::NotDecided(causes, covered) => {
            let mut text = format!("not decided: {old} and {new}\n");
            causes.iter().for_each(|cause| text += &format!("  stood in the way: {cause}\n"));
            covered.iter().for_each(|covered| text += &format!("  {covered}\n"));
            text
        }
        EqualAnswer::Different(difference) => {
            let LadderDifference { scan, outputs, scenario, failure } = &**difference;
            let mut text = format!("different: {old} and {new}\n  at scan {scan}\n");
            for DifferentOutput { name, old: before, new: after } in outputs {
                text += &format!("  {name}: {before} in {old}, {after} in {new}\n");
            }
            text += &format!("\n  passes on {old}, fails on {new}:\n\n");
            scenario.lines().for_each(|line| text += &format!("    {line}\n"));
            let reasons = failure.as_ref().map(|failure| failure.reasons_text());
            if let Some(reasons) = reasons.filter(|reasons| !reasons.is_empty()) {
                text += &format!("\n  in {new}:\n{reasons}");
            }
            text
        }
    }
}

/// What may happen to both controllers.
fn events_text(events: &[ProofEvent]) -> String {
    match events {
        [] => String::new(),
        events => {
            let words: Vec<&str> = events.iter().map(|event| event.word()).collect();
            format!("  may happen to both: {}\n", words.join(", "))
        }
    }
}

fn json_of(answer: &EqualAnswer, old: &str, new: &str) -> Value {
    match answer {
        EqualAnswer::Equal(way, outputs) => {
            let mut all = json!({ "old": old, "new": new, "answer": "equal", "outputs": outputs });
            way.add_json(&mut all);
            all
        }
        EqualAnswer::NotDecided(causes, covered) => json!({
            "old": old,
            "new": new,
            "answer": "not decided",
            "cause": causes.join("; "),
            "covered": covered,
        }),
        EqualAnswer::Different(difference) => {
            let output =
                |one: &DifferentOutput| json!({ "name": one.name, "old": one.old, "new": one.new });
            json!({
                "old": old,
                "new": new,
                "answer": "different",
                "scan": difference.scan,
                "outputs": difference.outputs.iter().map(output).collect::<Vec<_>>(),
                "scenario": difference.scenario,
                "why": difference.failure.as_ref().map(|failure| &failure.why),
            })
        }
    }
}
