//! `rungd check`: checks files, prints the findings on standard error, and returns the exit code.

use std::collections::HashMap;
use std::io::IsTerminal;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};

use super::exit::{CommandLine, Exit};
use super::fmt_file;
use super::foreign;
use super::terminal::{one_line, print, say_findings, say_line};
use rungd_config::load::{self, InputFile, Loaded};
use rungd_language::resolve::places::TagPlace;
use rungd_language::resolve::program::Program;
use rungd_language::source::file_kind::LIBRARY;
use rungd_language::source::render::{Style, refuses, render};
use rungd_lsp::Corrected;

/// Checks ladder files and controller files, and prints all findings
#[derive(Args, Debug)]
pub struct CheckArgs {
    /// Ladder files, which form one program together, and controller files, each of which is
    /// checked with the ladder files that it names; also files that `rungd import` reads
    #[arg(required = true, value_name = "FILE.toml")]
    files: Vec<PathBuf>,
    /// First write the corrections that are certain into the files, and print each
    ///
    /// A correction is certain if it repairs its finding, brings no error and, for a warning,
    /// leaves the program the same. The other findings stay.
    #[arg(long)]
    fix: bool,
    /// Make warnings errors
    #[arg(long, value_name = "WHAT")]
    deny: Option<Deny>,
    /// List the tags with a `type`: their names, types and places in memory
    #[arg(long)]
    addresses: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Deny {
    Warnings,
}

/// Checks the files.
///
/// # Errors
/// A file cannot be read.
pub fn check(args: &CheckArgs) -> Result<Exit> {
    if args.fix {
        fix(&args.files)?;
    }
    let style = style(args.deny.is_some());
    let mut ladders = Vec::new();
    let mut all = Loaded::default();
    let mut addresses = String::new();
    for path in &args.files {
        if foreign::is_foreign(path) {
            append(&mut all, foreign::checked(path)?, &mut addresses);
            continue;
        }
        let input = InputFile::read(path)?;
        if input.is_controller() {
            append(&mut all, load::controller_input(&input), &mut addresses);
        } else {
            ladders.push(input);
        }
    }
    if !ladders.is_empty() {
        append(&mut all, load::ladder_inputs(&ladders)?, &mut addresses);
    }
    if args.addresses {
        print(&addresses)?;
    }
    say_findings(&render(&all.findings, &all.files, style));
    Ok(if refuses(&all.findings, style) { Exit::Config } else { Exit::Ok })
}

/// Corrects the files, and prints what was corrected.
///
/// # Errors
/// A file is no regular file, or cannot be read or written. What was written before stays.
fn fix(paths: &[PathBuf]) -> Result<()> {
    for path in paths.iter().filter(|path| !is_in_library(path)) {
        if foreign::is_foreign(path) {
            let message = format!("{}: --fix corrects files of rungd only", path.display());
            return Err(CommandLine(message).into());
        }
        if !std::fs::metadata(path).with_context(|| path.display().to_string())?.is_file() {
            let message = format!(
                "{}: --fix corrects regular files only: name the file itself",
                path.display()
            );
            return Err(CommandLine(message).into());
        }
    }
    let is_controller =
        |path: &PathBuf| load::is_controller_file(path).map(|is| (is, path.clone()));
    let kinds: Result<Vec<(bool, PathBuf)>> = paths.iter().map(is_controller).collect();
    let (controllers, ladders): (Vec<_>, Vec<_>) = kinds?.into_iter().partition(|(is, _)| *is);
    let paths = |kind: Vec<(bool, PathBuf)>| -> Vec<PathBuf> {
        kind.into_iter().map(|(_, path)| path).collect()
    };
    let (files, is_whole) = rungd_lsp::correct(&paths(controllers), &paths(ladders));
    let mut known: HashMap<(u64, u64), &str> = HashMap::new();
    for file in &files {
        let about = std::fs::metadata(&file.name).with_context(|| file.name.clone())?;
        if let Some(other) = known.insert((about.dev(), about.ino()), &file.name) {
            let message = format!("{other} and {} are one file: name one of them", file.name);
            return Err(CommandLine(message).into());
        }
    }
    for file in &files {
        fmt_file::replace(Path::new(&file.name), file.before.as_bytes(), &file.after)
            .with_context(|| format!("cannot write {}", file.name))?;
        for Corrected { line, title } in &file.corrections {
            print(&format!("{}:{line}: {}\n", one_line(&file.name), one_line(title)))?;
        }
    }
    if !is_whole {
        say_line("rungd: there may be more to correct: run the command again");
    }
    Ok(())
}

fn is_in_library(path: &Path) -> bool {
    path.to_str().is_some_and(|name| name.starts_with(LIBRARY))
}

/// Joins the files and findings of two loads; the files of the second load get new numbers. Adds
/// the places of its tags to `addresses`.
fn append(all: &mut Loaded, mut loaded: Loaded, addresses: &mut String) {
    addresses.push_str(&loaded.program.as_ref().map_or_else(String::new, listed));
    let shift = all.files.len() as u32;
    for finding in &mut loaded.findings {
        finding.span.file.0 += shift;
        finding.related.iter_mut().for_each(|(span, _)| span.file.0 += shift);
    }
    all.files.append(&mut loaded.files);
    all.findings.append(&mut loaded.findings);
}

/// The tags with a `type` in byte order, one line for each: name, type, place.
fn listed(program: &Program) -> String {
    let names = program.names.places.by_name().map(|place| place.name.len());
    let width = names.max().unwrap_or(0);
    let line = |place: &TagPlace| {
        let (name, kind) = (&place.name, place.type_name());
        let (first, last) = (place.address(0), place.address(place.count - 1));
        match place.is_array {
            true => format!(
                "{name:width$}  {:10}  {first}..{last}\n",
                format!("{kind}[{}]", place.count)
            ),
            false => format!("{name:width$}  {kind:10}  {first}\n"),
        }
    };
    program.names.places.by_name().map(line).collect()
}

/// The style of findings on standard error.
pub fn style(deny_warnings: bool) -> Style {
    let plain = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
        || std::env::var_os("TERM").is_some_and(|value| value == "dumb");
    Style { color: std::io::stderr().is_terminal() && !plain, deny_warnings }
}
