//! The arguments of `rungd replay`, and the texts that both of its reports use.
//!
//! `replay` and `replay_ladder` execute the command.

use std::io;
use std::path::{Path, PathBuf};

use clap::Args;

use super::replay_window::ReplayWindow;
use super::terminal::{print, say_line};
use super::when::{LocalClock, WrittenTime};
use rungd_history::playback::RecordedPrograms;
use rungd_history::record::Recording;
use rungd_language::source::wording::thousands;

/// Executes a recording again: verifies it, traces it, or tries a different program on it
#[derive(Args, Debug)]
pub struct ReplayArgs {
    /// A recording: a file, or a folder as `[record] dir` names it
    #[arg(value_name = "RECORDING")]
    pub recording: PathBuf,
    /// From this time or scan on: `10:02`, `yesterday 23:50`, `-15m`, `scan 81234`
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = WrittenTime::parse)]
    pub from: Option<WrittenTime>,
    /// Until this time or scan
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = WrittenTime::parse)]
    pub to: Option<WrittenTime>,
    /// Execute these ladder files instead of the recorded ones (library files stay) on the recorded
    /// inputs, and compare both programs
    #[arg(long, value_name = "NEW.toml", num_args = 1..)]
    pub ladder: Vec<PathBuf>,
    /// Operands to trace and compare, in this order
    #[arg(long, value_name = "A,B,…", value_delimiter = ',')]
    pub watch: Option<Vec<String>>,
    /// The trace's file: CSV, a timing diagram if the name ends in .svg, waves if in .vcd; - is CSV
    /// on standard output (default with --watch, but without --ladder)
    #[arg(long, value_name = "OUT.csv|OUT.svg|OUT.vcd|-")]
    pub trace: Option<PathBuf>,
}

impl ReplayArgs {
    /// The path of the trace, if there is a trace.
    pub fn trace(&self) -> Option<PathBuf> {
        let by_watch = self.watch.is_some() && self.ladder.is_empty();
        self.trace.clone().or_else(|| by_watch.then(|| PathBuf::from("-")))
    }

    /// Prints the report on standard output; if the trace is there, on standard error.
    pub fn report(&self, text: &str) -> io::Result<()> {
        match self.trace() {
            Some(trace) if trace == Path::new("-") => {
                text.lines().for_each(say_line);
                Ok(())
            }
            Some(_) | None => print(text),
        }
    }
}

/// The part of a recording that is replayed.
#[derive(Clone, Copy)]
pub(super) struct ReplayScene<'a> {
    /// The programs of the recording.
    pub programs: &'a RecordedPrograms,
    pub window: &'a ReplayWindow,
    /// The reader's clock.
    pub clock: &'a LocalClock,
}

/// `replayed in 0.2 s, 617 × real time`.
pub(super) fn pace(recording: &Recording, window: &ReplayWindow, seconds: f64) -> String {
    let spans = window.sections.clone().map(|at| {
        let head = recording.head(at);
        head.end_ns.saturating_sub(head.begin_ns).max(0)
    });
    let real: f64 = spans.map(|ns| ns as f64 / 1e9).sum();
    let times = if seconds > 0.0 { (real / seconds).round() } else { 0.0 };
    // The number is far below 2^53, so the conversion is exact.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let times = thousands(times as u64);
    format!("replayed in {seconds:.1} s, {times} × real time")
}
