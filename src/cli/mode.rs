//! `rungd mode`: run or stop a running controller's scan.

use anyhow::Result;
use clap::Args;

use super::exit::Exit;
use super::operator::At;
use super::say;
use crate::operator::protocol::{ModeChange, ModeWanted, Request};

/// Runs a controller that is in STOP or FAULT, or stops its scan in an orderly way
#[derive(Args, Debug)]
pub struct ModeArgs {
    /// run: STOP or FAULT to RUN, memory as it is; stop: RUN to STOP, outputs safe
    #[arg(value_name = "MODE")]
    to: ModeWanted,
    #[command(flatten)]
    at: At,
}

/// Changes the mode.
///
/// # Errors
/// Standard output cannot be written.
pub fn mode(args: &ModeArgs) -> Result<Exit> {
    let change: ModeChange = match args.at.ask(&Request::Mode { to: args.to }) {
        Ok(change) => change,
        Err(exit) => return Ok(exit),
    };
    let ModeChange { before, after, reason } = &change;
    args.at.print(&change, || match reason {
        Some(why) => format!("{after} ({why}), was {before}\n"),
        None => format!("{after}, was {before}\n"),
    })?;
    let wanted = if args.to == ModeWanted::Run { "RUN" } else { "STOP" };
    if after != wanted {
        say(&format!("rungd: {wanted} was asked for, and it is in {after}: the log says why\n"));
        return Ok(Exit::Refused);
    }
    Ok(Exit::Ok)
}
