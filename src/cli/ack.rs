//! `rungd ack`: acknowledges alarms of a running controller.

use anyhow::Result;
use clap::Args;
use clap_complete::engine::ArgValueCompleter;

use super::exit::Exit;
use super::operator::{OperatorArgs, complete_alarms};
use super::terminal::{one_line, say};
use rungd_client::operator::protocol::{AckList, AckedAlarm, AlarmState, Request};

/// Acknowledges alarms of a running controller: records that somebody has noticed them
///
/// An acknowledgement changes nothing in the ladder, except for the bit that the alarm names with
/// `ack`: that bit is turned ON. An alarm that stands stays in the list of
/// `rungd alarms` as acknowledged, until it goes away. An alarm that went away before is removed
/// from the list. The log contains the user and the alarm.
#[derive(Args, Debug)]
pub struct AckArgs {
    /// Tags with an `alarm`, or the addresses of their bits; or `--all`
    #[arg(
        value_name = "TAG",
        conflicts_with = "all",
        add = ArgValueCompleter::new(complete_alarms)
    )]
    tags: Vec<String>,
    /// Acknowledge all alarms
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    at: OperatorArgs,
}

/// Acknowledges the alarms.
///
/// # Errors
/// Standard output cannot be written.
pub fn ack(args: &AckArgs) -> Result<Exit> {
    let request = match (args.all, args.tags.is_empty()) {
        (true, _) => Request::AckAll {},
        (false, false) => Request::Ack { alarms: args.tags.clone(), for_user: None },
        (false, true) => {
            say("rungd: name the alarms to acknowledge, or give `--all` for all of them\n");
            return Ok(Exit::Usage);
        }
    };
    let list: AckList = match args.at.ask(&request) {
        Ok(list) => list,
        Err(exit) => return Ok(exit),
    };
    args.at.print(&list, || match list.alarms.is_empty() {
        true => "no alarm waits for an acknowledgement\n".to_owned(),
        false => list.alarms.iter().map(line).collect(),
    })?;
    let is_untold = list.alarms.iter().any(|acked| acked.bit_refused.is_some());
    Ok(if is_untold { Exit::Refused } else { Exit::Ok })
}

/// The line about the result for one alarm.
fn line(acked: &AckedAlarm) -> String {
    let (tag, text) = (one_line(&acked.tag), one_line(&acked.text));
    let what = match acked.before {
        _ if acked.shelved => "it is shelved: there is nothing to acknowledge",
        AlarmState::Unacknowledged => "acknowledged; it stands",
        AlarmState::Returned => "acknowledged; it went away before",
        AlarmState::Acknowledged => "acknowledged already; it stands",
        AlarmState::Normal => "it does not stand: there is nothing to acknowledge",
    };
    format!("{tag} ({text}): {what}{}\n", one_line(&acked.bit_words()))
}
