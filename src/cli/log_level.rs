//! `rungd log-level`: sets the level of a running controller's log, until it ends or is set again.

use anyhow::Result;
use clap::Args;

use super::exit::Exit;
use super::operator::OperatorArgs;
use rungd_client::operator::protocol::{LevelChange, Request};
use rungd_runtime::events::Level;

/// Sets the level of a running controller's log
#[derive(Args, Debug)]
pub struct LogLevelArgs {
    /// The least urgent level to log
    #[arg(value_name = "LEVEL")]
    level: Level,
    #[command(flatten)]
    at: OperatorArgs,
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
