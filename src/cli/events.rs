//! `rungd events`: prints the catalogue of the log's events, for people and for the journal.

use std::fmt::Write as _;

use anyhow::Result;
use clap::Args;

use super::exit::Exit;
use super::terminal;
use rungd_runtime::events::{self, GROUPS};

/// Lists the events of the log, with their codes; `rungd explain NAME` explains one
#[derive(Args, Debug)]
pub struct EventsArgs {
    /// Print the message catalogue for `journalctl -x` instead
    #[arg(long)]
    catalog: bool,
}

/// Prints the events.
///
/// # Errors
/// Standard output cannot be written.
pub fn events(args: &EventsArgs) -> Result<Exit> {
    let text = if args.catalog { events::catalog() } else { list() };
    terminal::print(&text)?;
    Ok(Exit::Ok)
}

fn list() -> String {
    let mut text = String::new();
    for (at, (hundred, title)) in GROUPS.iter().enumerate() {
        let _ = writeln!(text, "{}{title}:", if at == 0 { "" } else { "\n" });
        for event in events::all().filter(|event| event.number / 100 == *hundred) {
            let (code, level) = (event.code(), event.level.name());
            let _ = writeln!(text, "  {code}  {level:<5}  {}", event.name);
        }
    }
    text
}
