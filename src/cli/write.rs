//! `rungd write`: writes values into a running controller before its next scan, several as one
//! change.
//!
//! The controller checks a change whole. This module only reads the command line or the file, and
//! prints the answer; for a file, a refusal shows the place of each mistake.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use clap_complete::engine::ArgValueCompleter;

use super::check::style;
use super::exit::{CommandLine, Exit};
use super::operator::{OperatorArgs, change_line, complete, complete_assigned};
use super::terminal::{say_findings, say_line};
use rungd_base::regular_file::read_small_text;
use rungd_client::operator::client::CallFailure;
use rungd_client::operator::protocol::{
    CHANGE_BYTES_MAX, ChangedOperands, GivenValue, GivenWrite, Request, RequestRefusal,
};
use rungd_client::operator::value_set::{FileWrite, read_file};
use rungd_language::source::render::render;
use rungd_language::source::span::SourceFile;

/// The most notes that are printed one by one.
const NOTES_MAX: usize = 8;

/// Writes bits and words of a running controller, several of them as one change
///
/// Several values are one change: if the controller refuses one of them, nothing is written, and
/// the answer names every mistake; else one scan takes all of them. One change has at most 4096
/// values. `rungd read --file` writes a file that `--file` reads.
#[derive(Args, Debug)]
#[command(override_usage = "rungd write [OPTIONS] OPERAND VALUE\n       \
                            rungd write [OPTIONS] OPERAND=VALUE...\n       \
                            rungd write [OPTIONS] --file SET.toml")]
pub struct WriteArgs {
    /// Tag, address or member; or OPERAND=VALUE
    #[arg(value_name = "OPERAND", add = ArgValueCompleter::new(complete))]
    operand: Option<String>,
    /// ON or OFF; or a number, as 12, 0x1F or 1m30s; or a further OPERAND=VALUE
    #[arg(
        value_name = "VALUE",
        allow_hyphen_values = true,
        add = ArgValueCompleter::new(complete_assigned)
    )]
    value: Option<String>,
    /// Further values of the same change
    #[arg(value_name = "OPERAND=VALUE", add = ArgValueCompleter::new(complete_assigned))]
    more: Vec<String>,
    /// Write the values of this TOML file, a table of operands: `size = 12`, `list = [1, 2]`, of
    /// records `recipe = [{ kind = 1 }, { kind = 2 }]`; - is standard input
    #[arg(long, value_name = "SET.toml", conflicts_with = "operand")]
    file: Option<PathBuf>,
    /// The reason, for the log: a line of at most 200 characters
    #[arg(long, value_name = "TEXT")]
    why: Option<String>,
    #[command(flatten)]
    at: OperatorArgs,
}

impl WriteArgs {
    /// The request for several writes.
    fn change(&self, writes: Vec<GivenWrite>) -> Request {
        let reason = self.why.clone();
        Request::WriteSet { writes, for_user: None, from_page: false, reason }
    }
}

/// Writes the values.
///
/// # Errors
/// The command line or the file is wrong, or standard output cannot be written.
pub fn write(args: &WriteArgs) -> Result<Exit> {
    if let Some(path) = &args.file {
        return write_file(args, path);
    }
    let words = args.operand.iter().chain(&args.value).chain(&args.more).collect::<Vec<_>>();
    match words.as_slice() {
        [operand, value] if !words.iter().any(|word| word.contains('=')) => {
            let (operand, value) = (operand.to_string(), GivenValue::Text(value.to_string()));
            let reason = args.why.clone();
            let write = Request::Write { operand, value, for_user: None, from_page: false, reason };
            args.at.change(&write, "")
        }
        words => {
            let writes = words.iter().map(|word| assigned(word)).collect::<Result<Vec<_>>>()?;
            if writes.is_empty() {
                let message = "name what to write: `rungd write OPERAND VALUE`, `rungd write \
                               OPERAND=VALUE …` or `rungd write --file SET.toml`";
                return Err(CommandLine(message.to_owned()).into());
            }
            match args.at.asked(&args.change(writes)) {
                Ok(changed) => print_changes(&args.at, &changed),
                Err(failure) => Ok(args.at.print_failure(&failure)),
            }
        }
    }
}

/// An operand with its value: `size=12`.
fn assigned(word: &str) -> Result<GivenWrite> {
    match word.split_once('=') {
        Some((operand, value)) if !operand.trim().is_empty() => {
            let value = GivenValue::Text(value.to_owned());
            Ok(GivenWrite { operand: operand.to_owned(), value })
        }
        Some(_) | None => {
            let message = format!(
                "`{word}` is no OPERAND=VALUE: write one value as `rungd write size 12`, several \
                 as `rungd write size=12 lamp=ON`"
            );
            Err(CommandLine(message).into())
        }
    }
}

fn write_file(args: &WriteArgs, path: &Path) -> Result<Exit> {
    let name = path.display().to_string();
    let path = if path == Path::new("-") { Path::new("/dev/stdin") } else { path };
    let text = read_small_text(path).with_context(|| name.clone())?;
    let (found, findings) = read_file(&text);
    if !findings.is_empty() {
        let file = SourceFile { name, text };
        say_findings(&render(&findings, &[file], style(false)));
        say_line("rungd: nothing is written");
        return Ok(Exit::Config);
    }
    let writes: Vec<GivenWrite> = found.iter().map(|found| found.write.clone()).collect();
    if writes.is_empty() {
        say_line(&format!("rungd: {name} has no values: write `size = 12`, an operand a line"));
        return Ok(Exit::Config);
    }
    let request = args.change(writes);
    if request_bytes(&request) > CHANGE_BYTES_MAX {
        let message = format!(
            "rungd: {name} is too long for one change, whose names and values have room in \
             {CHANGE_BYTES_MAX} bytes: nothing is written"
        );
        say_line(&message);
        return Ok(Exit::Config);
    }
    match args.at.asked(&request) {
        Ok(changed) => print_changes(&args.at, &changed),
        Err(CallFailure::Refused(refusal)) => {
            let refusal = placed(refusal, &found, &SourceFile { name, text });
            Ok(args.at.print_failure(&CallFailure::Refused(refusal)))
        }
        Err(failure) => Ok(args.at.print_failure(&failure)),
    }
}

/// The bytes of a request as a line, with room for its deadline.
pub(super) fn request_bytes(request: &Request) -> usize {
    const DEADLINE_BYTES_MAX: usize = 200;
    serde_json::to_vec(request).map_or(0, |line| line.len()) + DEADLINE_BYTES_MAX
}

/// A refusal that names the place of each mistake in the file.
fn placed(refusal: RequestRefusal, found: &[FileWrite], file: &SourceFile) -> RequestRefusal {
    let place = |operand: &str| {
        let at = found.iter().rfind(|found| found.write.operand == operand)?;
        let before = file.text.get(..at.span.start as usize)?;
        Some(before.matches('\n').count() + 1)
    };
    let mut lines = refusal.message.lines();
    let mut message = lines.next().unwrap_or_default().to_owned();
    let mut mistakes = refusal.mistakes.iter();
    for line in lines {
        let line_number = mistakes.next().and_then(|mistake| place(&mistake.operand));
        match line_number {
            Some(number) => {
                message.push_str(&format!("\n  {}:{number}: {}", file.name, line.trim_start()));
            }
            None => message.push_str(&format!("\n{line}")),
        }
    }
    RequestRefusal { message, ..refusal }
}

fn print_changes(at: &OperatorArgs, changed: &ChangedOperands) -> Result<Exit> {
    at.print(changed, || changed.changes.iter().map(|change| change_line(change, "")).collect())?;
    let notes = changed.changes.iter().filter_map(|change| change.note.as_ref());
    let count = notes.clone().count();
    if !at.json {
        notes.take(NOTES_MAX).for_each(|note| say_line(&format!("note: {note}")));
        if count > NOTES_MAX {
            say_line(&format!("note: {} more, which `--json` shows", count - NOTES_MAX));
        }
    }
    Ok(Exit::Ok)
}
