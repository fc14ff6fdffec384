//! `rungd mutate`: reports how many mistakes in ladders their test files detect.
//!
//! This module reads the files and prints the result; `testing` makes and tests the mutants.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::Result;
use clap::Args;
use serde_json::{Value, json};

use super::early_end::{EarlyEnd, time};
use super::exit::{CommandLine, Exit};
use super::terminal::{one_line, plain_json, print, say};
use super::test::{OpenSuite, ProgressLine, find, jobs, open, refused};
use rungd_lab::testing::{
    self, JudgedLadder, JudgedMutant, MutantKind, MutateOptions, MutationProgress, Suite,
    UnnoticedMutant,
};

/// Makes small changes to a ladder, and reports which of them its tests detect
///
/// Test files of the same ladder are judged together: a change that one of them detects is
/// detected. Ctrl+C and --time end the command, which reports what was judged so far.
#[derive(Args, Debug)]
pub struct MutateArgs {
    /// Test files, and folders that are searched for *.test.toml
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// Only changes of these kinds
    #[arg(long, value_name = "KIND,…", value_delimiter = ',', value_parser = kind)]
    only: Vec<MutantKind>,
    /// Fail (exit code 1) if a ladder's tests detect less than this share, in percent; a change
    /// that was not judged counts as not detected
    #[arg(long, value_name = "PERCENT", value_parser = clap::value_parser!(u8).range(0..=100))]
    at_least: Option<u8>,
    /// Ends after this time, with what was judged so far: 5m, 90s
    #[arg(long, value_name = "TIME", value_parser = time)]
    time: Option<Duration>,
    /// Number of threads (default: one for each processor)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

fn kind(text: &str) -> Result<MutantKind, String> {
    let names = || MutantKind::ALL.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(", ");
    MutantKind::from_name(text).ok_or_else(|| format!("the kinds are: {}", names()))
}

/// The test files of one ladder.
struct LadderSuites<'a> {
    names: Vec<&'a str>,
    suites: Vec<&'a Suite>,
}

/// Tests the mutants.
///
/// # Errors
/// A path cannot be read.
pub fn mutate(args: &MutateArgs) -> Result<Exit> {
    let end = EarlyEnd::of(args.time)?;
    let opened = open(&find(&args.paths)?)?;
    if refused(&opened) {
        return Ok(Exit::Config);
    }
    let mut exit = Exit::Ok;
    let mut ladders = Vec::new();
    for ladder in by_ladder(&opened) {
        if fails_unchanged(&ladder, &end) {
            exit = Exit::Refused;
            continue;
        }
        let judged = judge(args, &ladder, &end)?;
        if args.at_least.is_some_and(|least| share(&judged) < usize::from(least)) {
            exit = Exit::Refused;
        }
        match args.json {
            true => ladders.push(ladder_json(&ladder, &judged)),
            false => print(&ladder_text(&ladder, &judged))?,
        }
    }
    if args.json {
        print(&format!("{}\n", plain_json(&json!({ "files": ladders }).to_string())))?;
    }
    Ok(exit)
}

fn by_ladder(opened: &[OpenSuite]) -> Vec<LadderSuites<'_>> {
    let with_suite = |open: &'_ OpenSuite| open.read.suite.is_some();
    let opened: Vec<&OpenSuite> = opened.iter().filter(|open| with_suite(open)).collect();
    let suites: Vec<&Suite> = opened.iter().filter_map(|open| open.read.suite.as_ref()).collect();
    let ladder = |group: Vec<usize>| LadderSuites {
        names: group.iter().map(|at| opened[*at].name.as_str()).collect(),
        suites: group.iter().map(|at| suites[*at]).collect(),
    };
    testing::of_one_ladder(&suites).into_iter().map(ladder).collect()
}

/// Whether a test fails with the unchanged ladder; then it cannot judge changes.
fn fails_unchanged(ladder: &LadderSuites<'_>, end: &EarlyEnd) -> bool {
    let mut fails = false;
    for (name, suite) in ladder.names.iter().zip(&ladder.suites) {
        if let Some(test) = testing::first_failure(suite, &end.is_over) {
            let (name, test) = (one_line(name), one_line(&test));
            say(&format!(
                "{name}: the test `{test}` fails with the ladder as it is: `rungd test` says why\n"
            ));
            fails = true;
        }
    }
    fails
}

fn judge(args: &MutateArgs, ladder: &LadderSuites<'_>, end: &EarlyEnd) -> Result<JudgedLadder> {
    let progress = ProgressLine::new(ladder.names[0]);
    let show = |MutationProgress { done, all, unnoticed }| {
        progress.show_text(|| format!("judged {done} of {all}, {unnoticed} not noticed"));
    };
    let proof = proof(end);
    let options = MutateOptions {
        jobs: jobs(args.jobs),
        kinds: &args.only,
        progress: &show,
        proves: proof.as_deref(),
        given_up: &end.is_over,
    };
    let judged = testing::mutate(&ladder.suites, &options);
    progress.clear();
    if all(&judged) + judged.unchanged + judged.proved.len() == 0 {
        let name = ladder.names[0];
        let message = format!("{name}: its ladder has nothing to change of these kinds");
        return Err(CommandLine(message).into());
    }
    Ok(judged)
}

/// Proves that a mistake changes nothing.
type Proof = Box<dyn Fn(&UnnoticedMutant<'_>) -> bool + Sync>;

#[cfg(feature = "prove")]
fn proof(end: &EarlyEnd) -> Option<Proof> {
    let given_up = std::sync::Arc::clone(&end.is_over);
    Some(Box::new(move |mutant| rungd_prove::mistake::changes_nothing(mutant, &given_up)))
}

/// Without proofs, such mistakes are not known.
#[cfg(not(feature = "prove"))]
fn proof(_end: &EarlyEnd) -> Option<Proof> {
    None
}

/// The number of changes that a test could notice, judged or not.
fn all(ladder: &JudgedLadder) -> usize {
    ladder.judged.len() + ladder.left
}

fn noticed(ladder: &JudgedLadder) -> usize {
    ladder.judged.iter().filter(|mutant| mutant.killed_by.is_some()).count()
}

/// The percentage of all changes that tests notice.
fn share(ladder: &JudgedLadder) -> usize {
    match all(ladder) {
        0 => 100,
        all => noticed(ladder) * 100 / all,
    }
}

fn ladder_text(ladder: &LadderSuites<'_>, result: &JudgedLadder) -> String {
    let mut text = head(ladder, result);
    let survivors: Vec<&JudgedMutant> =
        result.judged.iter().filter(|mutant| mutant.killed_by.is_none()).collect();
    if !survivors.is_empty() {
        text += "not noticed, each a rung to look at:\n";
    }
    let mut last = (String::new(), String::new());
    for JudgedMutant { file, line, column, rung, what, .. } in survivors {
        if (file, rung) != (&last.0, &last.1) {
            text += &format!("  {}:{line}: {rung}\n", one_line(file));
            last = (file.clone(), rung.clone());
        }
        text += &format!("      {line}:{column} {}\n", one_line(what));
    }
    text
}

/// The line with the counts: `a.test.toml: 14 of 33 changes are noticed (42 %)`.
fn head(ladder: &LadderSuites<'_>, result: &JudgedLadder) -> String {
    let names: Vec<_> = ladder.names.iter().map(|name| one_line(name)).collect();
    let (noticed, judged) = (noticed(result), result.judged.len());
    let percent = noticed * 100 / judged.max(1);
    let together = if names.len() > 1 { " by these tests together" } else { "" };
    let mut text = format!("{}: ", names.join(", "));
    if result.left > 0 {
        text += &format!("ended early, judged {judged} of {}: ", all(result));
    }
    text += &format!("{noticed} of {judged} changes are noticed{together} ({percent} %)");
    match result.unchanged {
        0 => {}
        1 => text += "; 1 more changes nothing",
        count => text += &format!("; {count} more change nothing"),
    }
    match result.proved.len() {
        0 => {}
        1 => text += "; 1 more changes nothing (proved)",
        count => text += &format!("; {count} more change nothing (proved)"),
    }
    text + "\n"
}

fn ladder_json(ladder: &LadderSuites<'_>, result: &JudgedLadder) -> Value {
    let one = |mutant: &JudgedMutant| {
        let killed_by = mutant.killed_by.as_ref();
        json!({
            "kind": mutant.kind.name(),
            "place": format!("{}:{}", mutant.file, mutant.line),
            "line": mutant.line,
            "column": mutant.column,
            "rung": mutant.rung,
            "what": mutant.what,
            "killed_by": killed_by.map(|test| &test.name),
            "killed_in": killed_by.map(|test| ladder.names[test.suite]),
        })
    };
    let all = |mutants: &[JudgedMutant]| mutants.iter().map(one).collect::<Vec<_>>();
    json!({
        "file": ladder.names[0],
        "files": ladder.names,
        "mutants": result.judged.len(),
        "killed": noticed(result),
        "unchanged": result.unchanged,
        "proved_unchanged": all(&result.proved),
        "left": result.left,
        "all": all(&result.judged),
    })
}
