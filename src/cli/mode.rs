//! `rungd mode`: runs or stops the scan of a running controller.

use anyhow::Result;
use clap::Args;

use super::exit::Exit;
use super::operator::OperatorArgs;
use super::terminal::{one_line, say_line};
use rungd_client::operator::protocol::{ModeChange, Request, WantedMode};

/// Sets a controller from STOP or FAULT to RUN, or stops its scan in an orderly way
#[derive(Args, Debug)]
pub struct ModeArgs {
    /// run: from STOP or FAULT to RUN, memory as it is; stop: from RUN to STOP, outputs safe
    #[arg(value_name = "MODE")]
    to: WantedMode,
    /// For stop: do not wait until the last image of retentive memory is durable
    #[arg(long)]
    no_wait: bool,
    #[command(flatten)]
    at: OperatorArgs,
}

/// Changes the mode.
///
/// # Errors
/// Standard output cannot be written.
pub fn mode(args: &ModeArgs) -> Result<Exit> {
    if args.no_wait && args.to == WantedMode::Run {
        say_line(
            "rungd: `--no-wait` is for `mode stop`: it does not wait until the last image of \
             retentive memory is durable; `mode run` writes no image",
        );
        return Ok(Exit::Usage);
    }
    let request = Request::Mode { to: args.to, no_wait: args.no_wait };
    let change: ModeChange = match args.at.ask(&request) {
        Ok(change) => change,
        Err(exit) => return Ok(exit),
    };
    args.at.print(&change, || text(&change))?;
    let after = &change.after;
    let wanted = args.to.name();
    if after != wanted {
        say_line(&format!(
            "rungd: {wanted} was requested, but the controller is in {after}: the log has the \
             reason"
        ));
        return Ok(Exit::Refused);
    }
    if let Some(why) = &change.not_kept {
        say_line(&format!("rungd: {why}"));
        return Ok(Exit::Io);
    }
    Ok(Exit::Ok)
}

fn text(change: &ModeChange) -> String {
    let ModeChange { before, after, reason, kept, .. } = change;
    let reason = reason.as_ref().map_or(String::new(), |why| format!(" ({why})"));
    let kept = kept.as_ref().map_or(String::new(), super::retain::text);
    format!("{}\n{kept}", one_line(&format!("{after}{reason}, was {before}")))
}
