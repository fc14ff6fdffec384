//! `rungd fmt`: writes ladder files, controller files and test files in one layout, or lists the
//! files that are not in it.
//!
//! [`crate::format`] has the layout. This module finds the files; [`super::fmt_file`] writes a
//! file.

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use super::check::style;
use super::exit::{CommandLine, Exit};
use super::fmt_file;
use super::folders::search;
use super::terminal::{one_line, print, say_drawn};
use crate::format::formatted;
use crate::load::decode;
use crate::load::files::read_bytes;
use crate::source::file_kind;
use crate::source::finding::Finding;
use crate::source::render::render;
use crate::source::span::{FileId, SourceFile};

/// Writes ladder files, controller files and test files in one layout
///
/// It changes spaces, blank lines, line breaks in arrays, and the order of keys in the tables of a
/// ladder; never a value or a comment. A file that is not TOML is left as it is: its findings are
/// printed.
#[derive(Args, Debug)]
pub struct FmtArgs {
    /// Files, and folders that are searched for *.toml of rungd; `-` is standard input, which goes
    /// to standard output
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// Write nothing: print the names of the files that would change, with their first difference
    #[arg(long)]
    check: bool,
}

/// The result for all files.
#[derive(Default)]
struct Outcome {
    /// Whether a file is not in the layout.
    differs: bool,
    findings: Vec<Finding>,
    files: Vec<SourceFile>,
}

/// Formats the files.
///
/// # Errors
/// A file cannot be read or written, or a folder has no files of rungd.
pub fn fmt(args: &FmtArgs) -> Result<Exit> {
    let mut outcome = Outcome::default();
    for path in &args.paths {
        if path == Path::new("-") {
            standard_input(args.check, &mut outcome)?;
        } else if path.is_dir() {
            folder(path, args.check, &mut outcome)?;
        } else {
            let bytes = read_bytes(path).with_context(|| path.display().to_string())?;
            file(path, &bytes, args.check, &mut outcome)?;
        }
    }
    if !outcome.findings.is_empty() {
        say_drawn(&render(&outcome.findings, &outcome.files, style(false)));
        return Ok(Exit::Config);
    }
    Ok(if args.check && outcome.differs { Exit::Refused } else { Exit::Ok })
}

impl Outcome {
    /// The present text of a file, and its text in the layout. `None` if the file is broken: then
    /// its findings are kept.
    fn formatted(&mut self, name: String, bytes: &[u8]) -> Option<(String, String)> {
        let file = FileId(self.files.len() as u32);
        let (text, finding) = decode(bytes, file);
        let mut findings = match finding.map_or_else(|| formatted(&text), |found| Err(vec![found]))
        {
            Ok(after) => {
                self.differs |= after != text;
                return Some((text, after));
            }
            Err(findings) => findings,
        };
        for finding in &mut findings {
            finding.span.file = file;
            finding.related.iter_mut().for_each(|(span, _)| span.file = file);
        }
        self.findings.append(&mut findings);
        self.files.push(SourceFile { name, text });
        None
    }
}

fn standard_input(check: bool, outcome: &mut Outcome) -> Result<()> {
    let mut bytes = Vec::new();
    io::stdin().lock().read_to_end(&mut bytes).context("standard input")?;
    let name = "<standard input>";
    let Some((before, after)) = outcome.formatted(name.to_owned(), &bytes) else { return Ok(()) };
    if !check {
        // The text is not escaped, because control characters are part of the file.
        io::stdout().lock().write_all(after.as_bytes())?;
    } else if before != after {
        print(&fmt_file::difference(name, &before, &after))?;
    }
    Ok(())
}

/// Formats the files of rungd in a folder and the folders in it.
fn folder(folder: &Path, check: bool, outcome: &mut Outcome) -> Result<()> {
    let mut is_empty = true;
    // A link is ignored: its target may be outside the folder.
    for path in search(folder, ".toml")?.into_iter().filter(|path| !path.is_symlink()) {
        let bytes = read_bytes(&path).with_context(|| path.display().to_string())?;
        if file_kind::may_be_of_rungd(&String::from_utf8_lossy(&bytes)) {
            is_empty = false;
            file(&path, &bytes, check, outcome)?;
        }
    }
    if is_empty {
        let message = format!("{}: no file of rungd in this folder", folder.display());
        return Err(CommandLine(message).into());
    }
    Ok(())
}

fn file(path: &Path, bytes: &[u8], check: bool, outcome: &mut Outcome) -> Result<()> {
    let name = path.display().to_string();
    let Some((before, after)) = outcome.formatted(name.clone(), bytes) else { return Ok(()) };
    if before == after {
        return Ok(());
    }
    if check {
        print(&fmt_file::difference(&name, &before, &after))?;
        return Ok(());
    }
    fmt_file::replace(path, &after).with_context(|| format!("cannot write {name}"))?;
    Ok(print(&format!("{}\n", one_line(&name)))?)
}
