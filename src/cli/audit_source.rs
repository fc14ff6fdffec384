//! The lines of a log for `rungd audit`: of files, of standard input, or of the journal.
//!
//! Each line is read once, from the first to the last; only lines of the audit trail are handed on.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read as _};
use std::path::PathBuf;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::daemon::log_reading::LoggedLine;
use rungd_runtime::events::{audited, is_audited};

/// The longest line that is read; the rest of a longer one is skipped.
const LINE_BYTES_MAX: u64 = 1 << 20;

/// Where the log is.
pub(super) enum AuditSource<'a> {
    /// Files, in this order; `-` is standard input.
    Files(&'a [PathBuf]),
    /// The journal of a unit.
    Journal(&'a str),
}

/// A line of the audit trail, and where it is: `plant.log:17`.
pub(super) struct AuditedLine {
    pub place: String,
    pub line: LoggedLine,
}

impl AuditSource<'_> {
    /// Hands on each line of the audit trail, until `take` wants no more.
    ///
    /// # Errors
    /// A file or the journal cannot be read; or `take` fails.
    pub fn each(&self, mut take: impl FnMut(AuditedLine) -> Result<bool>) -> Result<()> {
        match self {
            AuditSource::Files(files) => {
                for file in *files {
                    let name = file.display().to_string();
                    let continues = if name == "-" {
                        lines("standard input", io::stdin().lock(), &mut take)?
                    } else {
                        let opened = File::open(file).with_context(|| name.clone())?;
                        lines(&name, BufReader::new(opened), &mut take)?
                    };
                    if !continues {
                        break;
                    }
                }
                Ok(())
            }
            AuditSource::Journal(unit) => of_journal(unit, &mut take),
        }
    }
}

/// Reads the lines of a source; false if no more are wanted.
fn lines(
    name: &str,
    mut source: impl BufRead,
    take: &mut impl FnMut(AuditedLine) -> Result<bool>,
) -> Result<bool> {
    let (mut bytes, mut number, mut is_rest) = (Vec::new(), 0_u64, false);
    loop {
        bytes.clear();
        let read = source.by_ref().take(LINE_BYTES_MAX).read_until(b'\n', &mut bytes);
        if read.with_context(|| name.to_owned())? == 0 {
            return Ok(true);
        }
        let is_begin = !std::mem::replace(&mut is_rest, !bytes.ends_with(b"\n"));
        if !is_begin {
            continue;
        }
        number += 1;
        // The last line is still being written, or its rest was lost.
        if is_rest && (bytes.len() as u64) < LINE_BYTES_MAX {
            continue;
        }
        let line = LoggedLine::read(&String::from_utf8_lossy(&bytes));
        let Some(line) = line.filter(|line| is_audited(line.event)) else { continue };
        if !take(AuditedLine { place: format!("{name}:{number}"), line })? {
            return Ok(false);
        }
    }
}

fn of_journal(unit: &str, take: &mut impl FnMut(AuditedLine) -> Result<bool>) -> Result<()> {
    let mut command = Command::new("journalctl");
    command.args(["--output=json", "--all", "--no-pager", "--quiet", "--unit", unit]);
    for (at, event) in audited().enumerate() {
        command.args((at > 0).then_some("+"));
        command.arg(format!("RUNGD_EVENT={}", event.name));
    }
    let remedy = "name the file of the log: `rungd audit FILE`";
    let spawned = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn();
    let mut child = spawned.with_context(|| format!("journalctl cannot be started; {remedy}"))?;
    let Some(out) = child.stdout.take() else { bail!("journalctl has no output") };
    let continues = lines("journal", BufReader::new(out), take);
    if !matches!(continues, Ok(true)) {
        let _ = child.kill();
    }
    let status = child.wait().context("journalctl")?;
    if continues? && !status.success() {
        bail!("journalctl failed ({status}); {remedy}");
    }
    Ok(())
}
