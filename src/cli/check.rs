//! `rungd check`: checks files, prints the findings on standard error, and gives the exit code.

use std::io::IsTerminal;
use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};

use super::exit::Exit;
use super::terminal::say_drawn;
use crate::load::{self, Input, Loaded};
use crate::source::render::{Style, refuses, render};

/// Checks ladder files and controller files, and prints all findings
#[derive(Args, Debug)]
pub struct CheckArgs {
    /// Ladder files, which form one program together, and controller files, each of which is
    /// checked with the ladder files that it names
    #[arg(required = true, value_name = "FILE.toml")]
    files: Vec<PathBuf>,
    /// Make warnings errors
    #[arg(long, value_name = "WHAT")]
    deny: Option<Deny>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Deny {
    Warnings,
}

/// Checks the files.
///
/// # Errors
/// A file that cannot be read.
pub fn check(args: &CheckArgs) -> Result<Exit> {
    let style = style(args.deny.is_some());
    let mut ladders = Vec::new();
    let mut all = Loaded::default();
    for path in &args.files {
        let input = Input::read(path)?;
        if input.is_controller() {
            append(&mut all, load::controller_input(&input));
        } else {
            ladders.push(input);
        }
    }
    if !ladders.is_empty() {
        append(&mut all, load::ladder_inputs(&ladders)?);
    }
    say_drawn(&render(&all.findings, &all.files, style));
    Ok(if refuses(&all.findings, style) { Exit::Config } else { Exit::Ok })
}

/// Joins the files and findings of two loads; the files of the second get new numbers.
fn append(all: &mut Loaded, mut loaded: Loaded) {
    let shift = all.files.len() as u32;
    for finding in &mut loaded.findings {
        finding.span.file.0 += shift;
        finding.related.iter_mut().for_each(|(span, _)| span.file.0 += shift);
    }
    all.files.append(&mut loaded.files);
    all.findings.append(&mut loaded.findings);
}

/// The style of findings on standard error.
pub fn style(deny_warnings: bool) -> Style {
    let plain = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
        || std::env::var_os("TERM").is_some_and(|value| value == "dumb");
    Style { color: std::io::stderr().is_terminal() && !plain, deny_warnings }
}
