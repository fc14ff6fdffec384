//! `rungd export`: writes a ladder as PLCopen XML, or its tags as the element documentation of a
//! Do-more.
//!
//! `rungd_lab::export` and `rungd_import::domore` make the text, or name what has no form there;
//! this module reads the files and writes the disk.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use super::exit::{CommandLine, Exit};
use super::foreign::is_foreign;
use super::terminal::{one_line, print, say_line};
use super::xref::ProgramArgs;
use rungd_lab::export::{ExportRefusal, exported};
use rungd_language::resolve::program::Program;
use rungd_language::source::wording::counted;

/// Writes a ladder as PLCopen XML, for OpenPLC, Beremiz and CODESYS
///
/// With an output that ends with `.csv` the tags are written, as element documentation (nicknames,
/// descriptions) of a Do-more.
///
/// What the ladder does and what the file does is the same in every scan. A part of a ladder for
/// which this cannot be said is named, with its place and what to do; then nothing is written, and
/// the exit code is 1. `docs/export.md` lists what is exported.
#[derive(Args, Debug)]
pub struct ExportArgs {
    /// A controller file, or ladder files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The file to write, `.xml` or `.csv`; one that exists is written anew
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

/// Exports the ladder.
///
/// # Errors
/// A file cannot be read, or the output cannot be written.
pub fn export(args: &ExportArgs) -> Result<Exit> {
    if let Some(path) = args.files.iter().find(|path| is_foreign(path)) {
        let path = path.display();
        let message = format!("{path}: `rungd import` it first, and export what that writes");
        return Err(CommandLine(message).into());
    }
    let Some(asked) = ProgramArgs::of(args.files.clone()).load()? else { return Ok(Exit::Config) };
    if args.output.extension().is_some_and(|end| end.eq_ignore_ascii_case("csv")) {
        return documentation(args, asked.subject.program());
    }
    let ladder = match exported(asked.subject.program(), asked.period()) {
        Ok(ladder) => ladder,
        Err(refusals) => {
            refusals.iter().for_each(|refusal| {
                let place = asked.subject.place(refusal.span);
                let ExportRefusal { what, remedy, .. } = refusal;
                say_line(&format!(
                    "{}:{}: {what} is not exported: {remedy}",
                    place.file, place.line
                ));
            });
            let parts = counted(refusals.len() as u64, "part");
            say_line(&format!(
                "rungd: nothing is written: {parts} of the ladder would not do the same there"
            ));
            return Ok(Exit::Refused);
        }
    };
    write(&args.output, &ladder.text)?;
    let path = args.output.display().to_string();
    let rungs = counted(ladder.rungs as u64, "rung");
    print(&format!("{}: {rungs}\n", one_line(&path)))?;
    for value in &ladder.outside {
        print(&format!(
            "{}: the other controller has to write it: `{}` here\n",
            value.variable, value.source
        ))?;
    }
    Ok(Exit::Ok)
}

/// Writes the tags as element documentation of a Do-more.
#[cfg(feature = "import")]
fn documentation(args: &ExportArgs, program: &Program) -> Result<Exit> {
    let made = rungd_import::domore::documentation(program);
    write(&args.output, &made.text)?;
    let elements = counted(made.elements as u64, "element");
    print(&format!("{}: {elements}\n", one_line(&args.output.display().to_string())))?;
    made.left_out.iter().for_each(|text| say_line(text));
    Ok(Exit::Ok)
}

#[cfg(not(feature = "import"))]
fn documentation(args: &ExportArgs, _: &Program) -> Result<Exit> {
    let path = args.output.display();
    let message = format!("{path}: this rungd was built without the feature `import`");
    Err(CommandLine(message).into())
}

fn write(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text).with_context(|| path.display().to_string())
}
