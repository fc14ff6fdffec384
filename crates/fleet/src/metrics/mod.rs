//! `rungd metrics`: the metrics of a running controller for a time-series database.
//!
//! A separate process, and a read-only client of the operator's socket. `scrape` sends the
//! requests, and makes families from the answers (`controller`, `parts`, as data of `family`).
//! `text` writes the families as OpenMetrics or in the text format of Prometheus. The text is
//! served by a listener (`serve`), written to a file (`textfile`) or returned to the caller,
//! `cli::metrics`. `docs/metrics.md` lists the names, which never change.

mod controller;
mod family;
mod journal;
mod parts;
mod scrape;
mod scraped;
mod serve;
#[cfg(test)]
mod tests;
mod text;
mod textfile;

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::Result;

use rungd_client::operator::client::CallFailure;

/// Serves the metrics of the controller at `socket` until a signal ends the process. `hosts`: the
/// names by which clients may ask for this machine, besides its own.
///
/// # Errors
/// The address cannot be used.
pub fn listen(at: SocketAddr, hosts: &[String], socket: Option<PathBuf>) -> Result<()> {
    serve::serve(at, hosts, socket)
}

/// The metrics of one look, in the form of a text file; if the look failed, also the reason.
pub fn once(socket: Option<PathBuf>) -> (String, Option<CallFailure>) {
    let (families, failure) = scrape::Scraper::new(socket).families();
    (text::text(&families, text::Exposition::Prometheus), failure)
}

/// Writes the metrics of one look to a file. Returns the reason if the look failed.
///
/// # Errors
/// The file cannot be written.
pub fn write(file: &Path, socket: Option<PathBuf>) -> Result<Option<CallFailure>> {
    let (text, failure) = once(socket);
    textfile::write(file, &text)?;
    Ok(failure)
}

/// Writes the metrics to a file periodically. A failure is reported once, and the write is tried
/// again.
pub fn write_every(file: &Path, every: Duration, socket: Option<PathBuf>) -> Result<()> {
    let mut scraper = scrape::Scraper::new(socket);
    let mut told = None;
    let mut next = Instant::now();
    loop {
        let (families, failure) = scraper.families();
        let text = text::text(&families, text::Exposition::Prometheus);
        let written = textfile::write(file, &text).err().map(|error| format!("{error:#}"));
        let wrong = written.or_else(|| failure.map(|why| why.in_one_line()));
        if wrong != told {
            journal::say(wrong.as_deref().unwrap_or("the file is written again"));
            told = wrong;
        }
        next = (next + every).max(Instant::now());
        sleep(next.saturating_duration_since(Instant::now()));
    }
}
