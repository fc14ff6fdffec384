//! `rungd mutate`: reports how many mistakes in ladders their test files detect.
//!
//! This module reads the files and prints the result; `testing` makes and tests the mutants.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde_json::{Value, json};

use super::exit::{CommandLine, Exit};
use super::terminal::{one_line, plain_json, print, say};
use super::test::{OpenSuite, ProgressLine, find, jobs, open, refused};
use rungd_lab::testing::{self, JudgedMutant, MutantKind, MutateOptions, Suite};

/// Makes small changes to a ladder, and reports which of them its tests detect
#[derive(Args, Debug)]
pub struct MutateArgs {
    /// Test files, and folders that are searched for *.test.toml
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// Only changes of these kinds
    #[arg(long, value_name = "KIND,…", value_delimiter = ',', value_parser = kind)]
    only: Vec<MutantKind>,
    /// Fail (exit code 1) if a file's tests detect less than this share, in percent
    #[arg(long, value_name = "PERCENT", value_parser = clap::value_parser!(u8).range(0..=100))]
    at_least: Option<u8>,
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

/// Tests the mutants.
///
/// # Errors
/// A path cannot be read.
pub fn mutate(args: &MutateArgs) -> Result<Exit> {
    let suites = open(&find(&args.paths)?)?;
    if refused(&suites) {
        return Ok(Exit::Config);
    }
    let mut exit = Exit::Ok;
    let mut files = Vec::new();
    for OpenSuite { name, read } in &suites {
        let Some(suite) = &read.suite else { continue };
        if let Some(test) = testing::first_failure(suite) {
            say(&format!(
                "{}: the test `{}` fails with the ladder as it is: `rungd test` says why\n",
                one_line(name),
                one_line(&test)
            ));
            exit = Exit::Refused;
            continue;
        }
        let judged = judge(args, name, suite)?;
        let killed = judged.iter().filter(|mutant| mutant.killed_by.is_some()).count();
        if args.at_least.is_some_and(|least| killed * 100 < usize::from(least) * judged.len()) {
            exit = Exit::Refused;
        }
        match args.json {
            true => files.push(file_json(name, suite, &judged)),
            false => print(&file_text(name, suite, &judged))?,
        }
    }
    if args.json {
        print(&format!("{}\n", plain_json(&json!({ "files": files }).to_string())))?;
    }
    Ok(exit)
}

fn judge(args: &MutateArgs, name: &str, suite: &Suite) -> Result<Vec<JudgedMutant>> {
    let progress = ProgressLine::new(name);
    let show = |done, all| progress.show(done, all);
    let options = MutateOptions { jobs: jobs(args.jobs), kinds: &args.only, progress: &show };
    let judged = testing::mutate(suite, &options);
    progress.clear();
    if judged.is_empty() {
        let message = format!("{name}: its ladder has nothing to change of these kinds");
        return Err(CommandLine(message).into());
    }
    Ok(judged)
}

fn file_text(name: &str, suite: &Suite, judged: &[JudgedMutant]) -> String {
    let killed = judged.iter().filter(|mutant| mutant.killed_by.is_some()).count();
    let all = judged.len();
    let percent = killed * 100 / all.max(1);
    let mut text =
        format!("{}: {killed} of {all} changes are noticed ({percent} %)\n", one_line(name));
    let survivors: Vec<&JudgedMutant> =
        judged.iter().filter(|mutant| mutant.killed_by.is_none()).collect();
    if !survivors.is_empty() {
        text += "not noticed, each a rung to look at:\n";
    }
    let mut last = String::new();
    for JudgedMutant { mutant, .. } in survivors {
        let place = suite.programs[0].place(mutant.span);
        let rung = format!("  {place}: {}\n", mutant.rung);
        if rung != last {
            text += &rung;
            last = rung;
        }
        text += &format!("      {}\n", one_line(&mutant.what));
    }
    text
}

fn file_json(name: &str, suite: &Suite, judged: &[JudgedMutant]) -> Value {
    let one = |JudgedMutant { mutant, killed_by }: &JudgedMutant| {
        json!({
            "kind": mutant.kind.name(),
            "place": suite.programs[0].place(mutant.span),
            "rung": mutant.rung,
            "what": mutant.what,
            "killed_by": killed_by,
        })
    };
    let killed = judged.iter().filter(|mutant| mutant.killed_by.is_some()).count();
    json!({
        "file": name,
        "mutants": judged.len(),
        "killed": killed,
        "all": judged.iter().map(one).collect::<Vec<_>>(),
    })
}
