//! `rungd import`: writes a project of the program of another controller.
//!
//! `rungd_import` reads the file and makes the texts; this module reads and writes the disk. What
//! could not be translated stands in the project as a stub, which `rungd check` refuses, and in the
//! report.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use super::exit::{CommandLine, Exit};
use super::folders::has_text_path;
use super::init::{MadePaths, refuse_what_is_there};
use super::terminal::{one_line, print, say_line};
use rungd_config::load::read_bytes;
use rungd_import::l5x;
use rungd_import::model::ForeignProject;
use rungd_import::write::{REPORT, files};

/// Writes a project of another controller's program: Rockwell L5X
///
/// The directory gets a controller file, ladder files and a report, which says what became of every
/// rung. The exit code is 0 only if nothing is left open; else it is 1, and `rungd check` names
/// each stub.
#[derive(Args, Debug)]
pub struct ImportArgs {
    /// An export of Studio 5000 (.L5X)
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// A directory that is empty or does not exist yet
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// Largest file that is read, in bytes.
const BYTES_MAX: u64 = 256 * 1024 * 1024;

/// Imports the file.
///
/// # Errors
/// The file cannot be read or is of no known form; the directory is not empty, or cannot be
/// written.
pub fn import(args: &ImportArgs) -> Result<Exit> {
    has_text_path(&args.output)?;
    let project = read(&args.file)?;
    refuse_what_is_there(&args.output)?;
    let mut made = MadePaths::default();
    for file in files(&project) {
        let path = args.output.join(&file.path);
        if let Err(error) = made.write_new(&path, &file.text) {
            let rest = made.removed();
            return Err(error).with_context(|| format!("cannot write {}{rest}", path.display()));
        }
        print(&format!("{}\n", one_line(&path.display().to_string())))?;
    }
    let counts = project.outcome.counts();
    let all = project.outcome.rungs.len();
    print(&format!(
        "\n{all} rungs: {} kept exactly, {} with a named difference, {} not translated\n",
        counts.exact, counts.different, counts.todo
    ))?;
    if !project.outcome.is_open() {
        return Ok(Exit::Ok);
    }
    let report = args.output.join(REPORT);
    let report = report.display().to_string();
    say_line(&format!("rungd: something is left to do: see {}", one_line(&report)));
    Ok(Exit::Refused)
}

/// The project of a foreign file.
///
/// # Errors
/// The file cannot be read, or is of no known form.
pub fn read(path: &Path) -> Result<ForeignProject> {
    let name = || one_line(&path.display().to_string()).into_owned();
    let about = fs::metadata(path).with_context(name)?;
    if about.len() > BYTES_MAX {
        let mb = about.len() / (1024 * 1024);
        return Err(CommandLine(format!("{}: {mb} MB; at most 256 MB are read", name())).into());
    }
    let bytes = read_bytes(path).with_context(name)?;
    let text = String::from_utf8_lossy(&bytes);
    if !l5x::is_l5x(&text) {
        let message = format!("{}: neither an L5X nor another form that is known", name());
        return Err(CommandLine(message).into());
    }
    l5x::read(&text).map_err(|why| anyhow::anyhow!("{}: {why}", name()))
}
