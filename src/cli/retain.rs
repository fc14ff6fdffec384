//! `rungd retain`: shows the content of a file of retentive memory, or saves memory now.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::{Args, Subcommand};

use super::exit::Exit;
use super::operator::OperatorArgs;
use super::terminal::{one_line, print, say_line};
use super::xref::ProgramArgs;
use rungd_base::duration_text::duration_text;
use rungd_client::operator::protocol::{MemorySave, Request};
use rungd_state::retain::file::{Access, FileDevice};
use rungd_state::retain::show::show;

/// Shows a file of retentive memory, or makes a running controller save its memory now
#[derive(Args, Debug)]
pub struct RetainArgs {
    #[command(subcommand)]
    what: RetainCommand,
}

#[derive(Subcommand, Debug)]
enum RetainCommand {
    /// Shows a file's slots, and the values of its newest image
    Show {
        /// The file, as `[retain] file` names it
        #[arg(value_name = "FILE")]
        file: PathBuf,
        /// The controller file, or the ladder files, for the texts of values (`texts` of tags)
        #[arg(long = "in", value_name = "FILE")]
        files: Vec<PathBuf>,
    },
    /// Makes a running controller save its memory; returns when the image is durable
    Save {
        #[command(flatten)]
        at: OperatorArgs,
    },
}

/// Shows a file, or saves memory.
///
/// # Errors
/// Standard output cannot be written.
pub fn retain(args: &RetainArgs) -> Result<Exit> {
    match &args.what {
        RetainCommand::Show { file, files } => show_file(file, files),
        RetainCommand::Save { at } => save(at),
    }
}

/// Shows a file, with the texts of the values of a program, if files are given.
fn show_file(file: &Path, files: &[PathBuf]) -> Result<Exit> {
    let program = match files {
        [] => None,
        files => match ProgramArgs::of(files.to_vec()).load()? {
            Some(program) => Some(program),
            None => return Ok(Exit::Config),
        },
    };
    let text = |tag: &str, content: i32| {
        let subject = &program.as_ref()?.subject;
        let address = subject.symbols().layout.address(subject.cell(tag).ok()?)?;
        let texts = subject.symbols().names.texts(address)?;
        texts.text(content).map(str::to_owned)
    };
    let opened = FileDevice::open(file, Access::Read).map_err(|error| error.to_string());
    match opened.and_then(|mut device| show(&mut device, &text)) {
        Ok(text) => print(&text)?,
        Err(why) => {
            say_line(&format!("rungd: {}: {why}", file.display()));
            return Ok(Exit::Io);
        }
    }
    Ok(Exit::Ok)
}

fn save(at: &OperatorArgs) -> Result<Exit> {
    let saved: MemorySave = match at.ask(&Request::RetainSave {}) {
        Ok(saved) => saved,
        Err(exit) => return Ok(exit),
    };
    at.print(&saved, || text(&saved))?;
    Ok(Exit::Ok)
}

/// A line about the durable image.
pub(super) fn text(saved: &MemorySave) -> String {
    let MemorySave { file, image, scan, flush_us } = saved;
    let took = match flush_us {
        0 => "durable already".to_owned(),
        1..1000 => "durable in under 1 ms".to_owned(),
        us => format!("durable in {}", duration_text(us * 1000)),
    };
    format!("{}: image {image} of scan {scan}, {took}\n", one_line(file))
}
