//! `rungd reload` and `rungd rollback`: another program without a stop, and back.

use anyhow::Result;
use clap::Args;

use super::exit::Exit;
use super::operator::At;
use crate::operator::protocol::{Reloaded, Request};

/// Has the running controller read its files anew, and go on with what they say
///
/// The swap comes between two scans. Files that are wrong change nothing, and are exit code 78.
#[derive(Args, Debug)]
pub struct ReloadArgs {
    #[command(flatten)]
    at: At,
    /// Print what would be kept, new and gone, and change nothing
    #[arg(long)]
    dry_run: bool,
}

/// Goes back to the last program that had stood its probation, or to the one of the start
///
/// Without a reload in probation this is the program before the last reload. Within a probation,
/// programs that were reloaded since the last proven one are all passed over. No file is read.
#[derive(Args, Debug)]
pub struct RollbackArgs {
    #[command(flatten)]
    at: At,
}

/// Reloads.
///
/// # Errors
/// Standard output cannot be written.
pub fn reload(args: &ReloadArgs) -> Result<Exit> {
    ask(&args.at, &Request::Reload { dry_run: args.dry_run })
}

/// Rolls back.
///
/// # Errors
/// Standard output cannot be written.
pub fn rollback(args: &RollbackArgs) -> Result<Exit> {
    ask(&args.at, &Request::Rollback {})
}

fn ask(at: &At, request: &Request) -> Result<Exit> {
    let done: Reloaded = match at.ask(request) {
        Ok(done) => done,
        Err(exit) => return Ok(exit),
    };
    at.print(&done, || text(&done))?;
    Ok(Exit::Ok)
}

fn text(done: &Reloaded) -> String {
    let mut text = String::new();
    for line in &done.report {
        text += &format!("{line}\n");
    }
    for line in &done.restart {
        text += &format!("needs a restart: {line}\n");
    }
    text + &end(done)
}

fn end(done: &Reloaded) -> String {
    let (ladder, mode) = (&done.ladder, &done.mode);
    match done.swap_us {
        _ if done.same => "nothing changed: the files are those that run already\n".to_owned(),
        Some(us) if mode == "RUN" => {
            format!("{ladder} runs since a swap of {us} us between two scans\n")
        }
        Some(us) => format!(
            "{ladder} is in since a swap of {us} us; the mode is {mode}, and nothing is scanned \
             until `rungd mode run`\n"
        ),
        None => "dry run: nothing was done\n".to_owned(),
    }
}
