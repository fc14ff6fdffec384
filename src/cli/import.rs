//! `rungd import`: writes a project of the program of another controller.
//!
//! `rungd_import` reads the file and makes the texts; this module writes the disk. What
//! could not be translated stands in the project as a stub, which `rungd check` refuses, and in the
//! report.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use super::check::style;
use super::exit::{CommandLine, Exit};
use super::folders::has_text_path;
use super::foreign;
use super::init::{MadePaths, refuse_what_is_there};
use super::terminal::{one_line, print, say_findings, say_line};
use rungd_import::model::ForeignProject;
use rungd_import::write::{CONTROLLER, REPORT, files, pinned_names};
use rungd_lab::testing::{Pin, pinned};
use rungd_language::source::render::render;

/// Writes a project of another controller's program: Rockwell L5X, PLCopen XML, CLICK, Do-more
///
/// The directory gets a controller file, ladder files and a report, which says what became of every
/// rung. The exit code is 0 only if nothing is left open; else it is 1, and `rungd check` names
/// each stub. Several files become projects beside each other, each in a directory with its name.
#[derive(Args, Debug)]
pub struct ImportArgs {
    /// Exports of Studio 5000 (.L5X), projects of OpenPLC, Beremiz or CODESYS (.xml), ladders of a
    /// CLICK (.csv), element documentation of a Do-more (.csv)
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// A directory that is empty or does not exist yet
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Name the tags of a CLICK ladder as this nickname file (.csv) of its software does
    #[arg(long, value_name = "FILE")]
    nicknames: Option<PathBuf>,
    /// Also write a test file, with what the program does in this many scans of random inputs
    #[arg(long, value_name = "SCANS", value_parser = clap::value_parser!(u64).range(1..=SCANS_MAX))]
    pin: Option<u64>,
    /// The seed of the random inputs of `--pin`
    #[arg(long, value_name = "N", default_value_t = 1, requires = "pin")]
    seed: u64,
}

/// Most scans of `--pin`.
const SCANS_MAX: u64 = 100_000;
/// The name of the test file of `--pin`.
const PINNED: &str = "pinned.test.toml";

/// Imports the files.
///
/// # Errors
/// A file cannot be read or is of no known form, two files have one name, or a directory is not
/// empty or cannot be written. What was imported before stays.
pub fn import(args: &ImportArgs) -> Result<Exit> {
    has_text_path(&args.output)?;
    if let [file] = &args.files[..] {
        return one(args, file, &args.output);
    }
    let mut folders = Vec::new();
    for file in &args.files {
        let folder = args.output.join(file.file_stem().unwrap_or(file.as_os_str()));
        if folders.contains(&folder) {
            let name = one_line(&folder.display().to_string()).into_owned();
            return Err(CommandLine(format!("two files would be imported into {name}")).into());
        }
        folders.push(folder);
    }
    let mut exit = Exit::Ok;
    for (file, folder) in args.files.iter().zip(&folders) {
        if matches!(one(args, file, folder)?, Exit::Refused) {
            exit = Exit::Refused;
        }
    }
    Ok(exit)
}

/// Imports a file into a directory.
fn one(args: &ImportArgs, file: &Path, output: &Path) -> Result<Exit> {
    let project = foreign::read_named(file, args.nicknames.as_deref())?;
    refuse_what_is_there(output)?;
    let mut made = MadePaths::default();
    for file in files(&project) {
        let path = output.join(&file.path);
        if let Err(error) = made.write_new(&path, &file.text) {
            let rest = made.removed();
            return Err(error).with_context(|| format!("cannot write {}{rest}", path.display()));
        }
        print(&format!("{}\n", one_line(&path.display().to_string())))?;
    }
    let counts = project.outcome.counts();
    let all = project.outcome.rungs.len();
    let tags = project.files.iter().map(|file| file.tags.len()).sum::<usize>();
    print(&match all {
        0 => format!("\n{tags} tags\n"),
        _ => format!(
            "\n{all} rungs: {} kept exactly, {} with a named difference, {} not translated\n",
            counts.exact, counts.different, counts.todo
        ),
    })?;
    if let Some(scans) = args.pin
        && counts.todo == 0
    {
        let place = PinnedPlace { path: output.join(PINNED), scans, seed: args.seed };
        pin(&place, &project, &mut made)?;
    }
    if !project.outcome.is_open() {
        return Ok(Exit::Ok);
    }
    if args.pin.is_some() && counts.todo > 0 {
        say_line(
            "rungd: nothing is pinned: the program is not whole; replace its stubs, then import \
             again into another directory, or write tests by hand",
        );
    }
    let report = output.join(REPORT);
    let report = report.display().to_string();
    say_line(&format!("rungd: something is left to do: see {}", one_line(&report)));
    Ok(Exit::Refused)
}

/// The test file of `--pin`.
struct PinnedPlace {
    path: PathBuf,
    scans: u64,
    seed: u64,
}

/// Writes the test file of `--pin`.
fn pin(place: &PinnedPlace, project: &ForeignProject, made: &mut MadePaths) -> Result<()> {
    let PinnedPlace { path, scans, seed } = place;
    let own: HashSet<String> = pinned_names(project);
    let is_pinned = |name: &str| own.contains(name.split(['.', '[']).next().unwrap_or_default());
    let what = "It does not say what is right: a test that fails shows that the program does\n# \
                something else now.";
    let head = format!(
        "# What the program did in {scans} scans of random inputs (seed {seed}) when it was\n# \
         imported. {what}\ncontroller = \"{CONTROLLER}\"\n"
    );
    let pin = Pin { path, head, scans: *scans, seed: *seed, is_pinned: &is_pinned };
    let text = match pinned(&pin) {
        Ok(text) => text,
        Err(read) => {
            say_findings(&render(&read.findings, &read.files, style(false)));
            return Err(anyhow::anyhow!("nothing is pinned: the project has errors"));
        }
    };
    made.write_new(path, &text).with_context(|| format!("cannot write {}", path.display()))?;
    print(&format!("{}\n", one_line(&path.display().to_string())))?;
    Ok(())
}
