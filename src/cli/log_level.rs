//! `rungd log-level`: what a running controller logs, until it ends or is told otherwise.

use anyhow::Result;
use clap::Args;

use super::exit::Exit;
use super::operator::At;
use crate::events::Level;
use crate::operator::protocol::{LevelChange, Request};

/// Sets from which level on a running controller logs
#[derive(Args, Debug)]
pub struct LogLevelArgs {
    /// From this level on
    #[arg(value_name = "LEVEL")]
    level: Level,
    #[command(flatten)]
    at: At,
}

/// Sets the level.
///
/// # Errors
/// Standard output cannot be written.
pub fn log_level(args: &LogLevelArgs) -> Result<Exit> {
    let change: LevelChange = match args.at.ask(&Request::LogLevel { level: args.level }) {
        Ok(change) => change,
        Err(exit) => return Ok(exit),
    };
    let (before, after) = (change.before.name(), change.after.name());
    args.at.print(&change, || format!("{after}, was {before}\n"))?;
    Ok(Exit::Ok)
}
