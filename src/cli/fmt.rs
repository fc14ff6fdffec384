//! `rungd fmt`: writes ladder files, controller files and test files in one layout, or lists the
//! files that are not in it.
//!
//! [`rungd_language::format`] has the layout. This module finds the files; [`super::fmt_file`]
//! writes a file.

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use super::check::style;
use super::exit::{CommandLine, Exit, is_broken_pipe};
use super::fmt_file;
use super::folders::search_on;
use super::terminal::{one_line, print, say_findings, say_line};
use rungd_config::load::files::{identity, read_bytes};
use rungd_config::load::{OpenTexts, controller_among, decode};
use rungd_language::format::{Upgraded, formatted, upgraded};
use rungd_language::source::file_kind;
use rungd_language::source::finding::{Finding, Severity};
use rungd_language::source::render::render;
use rungd_language::source::span::{FileId, SourceFile};

/// Writes ladder files, controller files and test files in one layout
///
/// It changes spaces, blank lines, line breaks in arrays, and the order of keys in the tables of a
/// ladder; never a value or a comment. Only `--upgrade` changes tables and keys. A file that is not
/// TOML is left as it is: its findings are printed.
#[derive(Args, Debug)]
pub struct FmtArgs {
    /// Files, and folders that are searched for *.toml of rungd; `-` is standard input, which goes
    /// to standard output
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// Write nothing: print the names of the files that would change, with their first difference
    #[arg(long)]
    check: bool,
    /// Rewrite an older form of a file as well, and say what has changed: each
    /// `[[simulated-device]]` of a controller file becomes a part of a simulated plant
    #[arg(long)]
    upgrade: bool,
}

/// The present text of a file, and the text that it gets.
struct FileChange {
    before: String,
    after: String,
    /// The changes of an upgrade.
    notes: Vec<String>,
}

/// The result for all files.
#[derive(Default)]
struct FormatOutcome {
    /// Whether a file is not in the layout.
    differs: bool,
    findings: Vec<Finding>,
    files: Vec<SourceFile>,
    /// Whether a file could not be read or written; its reason is printed already.
    failed: bool,
}

/// Formats the files.
///
/// # Errors
/// A folder has no files of rungd, or standard output cannot be written.
pub fn fmt(args: &FmtArgs) -> Result<Exit> {
    let mut outcome = FormatOutcome::default();
    for path in &args.paths {
        if path == Path::new("-") {
            standard_input(args, &mut outcome)?;
        } else if path.is_dir() {
            let done = folder(path, args, &mut outcome);
            outcome.go_on(done)?;
        } else {
            let done = read(path).and_then(|bytes| file(path, &bytes, args, &mut outcome));
            outcome.go_on(done)?;
        }
    }
    if !outcome.findings.is_empty() {
        say_findings(&render(&outcome.findings, &outcome.files, style(false)));
        return Ok(Exit::Config);
    }
    if outcome.failed {
        return Ok(Exit::Io);
    }
    Ok(if args.check && outcome.differs { Exit::Refused } else { Exit::Ok })
}

impl FormatOutcome {
    /// Says why a file could not be read or written, so that the files behind it have their turn.
    ///
    /// # Errors
    /// The failure is one of standard output.
    fn go_on(&mut self, done: Result<()>) -> Result<()> {
        match done {
            Err(why) if is_broken_pipe(&why) || why.is::<CommandLine>() => Err(why),
            Err(why) => {
                say_line(&format!("rungd: {why:#}"));
                self.failed = true;
                Ok(())
            }
            Ok(()) => Ok(()),
        }
    }

    /// The change of a file; `None` if the file is broken: then its findings are kept.
    fn change(&mut self, name: String, bytes: &[u8], args: &FmtArgs) -> Option<FileChange> {
        let file = FileId(self.files.len() as u32);
        let (text, finding) = decode(bytes, file);
        let present = || match args.upgrade {
            true => upgraded(&text).map(|Upgraded { text, notes }| (text, notes)),
            false => formatted(&text).map(|text| (text, Vec::new())),
        };
        let mut findings = match finding.map_or_else(present, |found| Err(vec![found])) {
            Ok((after, notes)) => {
                self.differs |= after != text;
                return Some(FileChange { before: text, after, notes });
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

fn standard_input(args: &FmtArgs, outcome: &mut FormatOutcome) -> Result<()> {
    let mut bytes = Vec::new();
    io::stdin().lock().read_to_end(&mut bytes).context("standard input")?;
    let name = "<standard input>";
    let Some(change) = outcome.change(name.to_owned(), &bytes, args) else { return Ok(()) };
    let FileChange { before, after, notes } = change;
    notes.iter().for_each(|note| say_line(&format!("{name}: {note}")));
    if !args.check {
        // The text is not escaped, because control characters are part of the file.
        io::stdout().lock().write_all(after.as_bytes())?;
    } else if before != after {
        print(&fmt_file::difference(name, &before, &after))?;
    }
    Ok(())
}

/// Formats the files of rungd in a folder and the folders in it.
fn folder(folder: &Path, args: &FmtArgs, outcome: &mut FormatOutcome) -> Result<()> {
    let (found, failed) = search_on(folder, ".toml");
    let mut is_empty = failed.is_empty();
    for why in failed {
        outcome.go_on(Err(why))?;
    }
    // A link is ignored: its target may be outside the folder.
    for path in found.into_iter().filter(|path| !path.is_symlink()) {
        let done = read(&path).and_then(|bytes| {
            let is_own = file_kind::may_be_of_rungd(&String::from_utf8_lossy(&bytes));
            is_empty &= !is_own;
            if is_own { file(&path, &bytes, args, outcome) } else { Ok(()) }
        });
        is_empty &= done.is_ok();
        outcome.go_on(done)?;
    }
    if is_empty {
        let message = format!("{}: no file of rungd in this folder", folder.display());
        return Err(CommandLine(message).into());
    }
    Ok(())
}

/// The change, without an upgrade whose file would not load with its ladders. What is wrong before
/// stays, too: its newer form could be right and mean something else.
fn loadable(path: &Path, change: FileChange) -> FileChange {
    if change.notes.is_empty() {
        return change;
    }
    let error = |text: &str| {
        let texts = OpenTexts::new([(identity(path), text.into())]);
        let loaded = controller_among(path, &texts).map_err(|why| format!("{why:#}"));
        let findings = loaded.map(|loaded| loaded.findings).map_err(Some);
        let is_error = |finding: &&Finding| finding.severity() == Severity::Error;
        match findings {
            Ok(findings) => findings.iter().find(is_error).map(|found| found.message.clone()),
            Err(why) => why,
        }
    };
    let reason = match (error(&change.before), error(&change.after)) {
        (None, None) => return change,
        (Some(why), _) => format!("stays in the older form, correct the file first: {why}"),
        (None, Some(why)) => {
            format!("stays in the older form, the newer one would not load: {why}")
        }
    };
    let after = formatted(&change.before).unwrap_or_else(|_| change.before.clone());
    FileChange { after, notes: vec![reason], ..change }
}

fn read(path: &Path) -> Result<Vec<u8>> {
    read_bytes(path).with_context(|| path.display().to_string())
}

fn file(path: &Path, bytes: &[u8], args: &FmtArgs, outcome: &mut FormatOutcome) -> Result<()> {
    let name = path.display().to_string();
    let Some(change) = outcome.change(name.clone(), bytes, args) else { return Ok(()) };
    let FileChange { before, after, notes } = loadable(path, change);
    for note in notes {
        print(&format!("{}: {note}\n", one_line(&name)))?;
    }
    if before == after {
        return Ok(());
    }
    if args.check {
        print(&fmt_file::difference(&name, &before, &after))?;
        return Ok(());
    }
    fmt_file::replace(path, bytes, &after).with_context(|| format!("cannot write {name}"))?;
    Ok(print(&format!("{}\n", one_line(&name)))?)
}
