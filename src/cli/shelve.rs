//! `rungd shelve` and `rungd unshelve`: take alarms of a running controller out of the list for a
//! time or out of service, and bring them back.

use anyhow::Result;
use clap::{ArgGroup, Args};
use clap_complete::engine::ArgValueCompleter;

use super::exit::Exit;
use super::operator::{OperatorArgs, complete_shelved, complete_unshelved};
use super::terminal::{one_line, say_line};
use super::when::LocalClock;
use rungd_client::operator::protocol::{Request, ShelfList, ShelvedAlarm};
use rungd_engine::isa::duration::{self, not_a_duration};

/// Shelves alarms of a running controller: nobody has to care for them for a time
///
/// A shelved alarm stays in the list of `rungd alarms`, with the user and the reason, and comes
/// back by itself: if it stands then, it has to be acknowledged. Out of service it stays away until
/// `rungd unshelve`. Critical alarms are not shelved, unless the controller file says
/// `[alarms] shelve-critical = true`. Nothing changes in the ladder.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("end").required(true).args(["for_ms", "out_of_service"])))]
pub struct ShelveArgs {
    /// Tags with an `alarm`, or the addresses of their bits
    #[arg(value_name = "TAG", required = true, add = ArgValueCompleter::new(complete_unshelved))]
    tags: Vec<String>,
    /// The time until the alarms come back, at most 168h: 8h, 30m
    #[arg(long = "for", value_name = "TIME", value_parser = shelf_time)]
    for_ms: Option<u64>,
    /// Until somebody brings the alarms back: equipment that is repaired or not built yet
    #[arg(long)]
    out_of_service: bool,
    /// The reason, which the list and the log show
    #[arg(long, value_name = "REASON")]
    why: String,
    #[command(flatten)]
    at: OperatorArgs,
}

/// Brings shelved alarms back, and returns alarms to service
///
/// An alarm that stands then has to be acknowledged.
#[derive(Args, Debug)]
pub struct UnshelveArgs {
    /// Tags with an `alarm`, or the addresses of their bits
    #[arg(value_name = "TAG", required = true, add = ArgValueCompleter::new(complete_shelved))]
    tags: Vec<String>,
    #[command(flatten)]
    at: OperatorArgs,
}

fn shelf_time(text: &str) -> Result<u64, String> {
    match duration::parse(text) {
        Ok(ms @ 1..) => Ok(u64::from(ms.unsigned_abs())),
        Ok(_) | Err(_) => Err(not_a_duration(text, "30m, 8h, 168h")),
    }
}

/// Shelves the alarms.
///
/// # Errors
/// Standard output cannot be written.
pub fn shelve(args: &ShelveArgs) -> Result<Exit> {
    let (alarms, why) = (args.tags.clone(), args.why.clone());
    print_changes(&args.at, &Request::Shelve { alarms, for_ms: args.for_ms, why, for_user: None })
}

/// Brings the alarms back.
///
/// # Errors
/// Standard output cannot be written.
pub fn unshelve(args: &UnshelveArgs) -> Result<Exit> {
    print_changes(&args.at, &Request::Unshelve { alarms: args.tags.clone(), for_user: None })
}

/// Sends a request, and prints what it did. If a restart would forget it, this is no success.
fn print_changes(at: &OperatorArgs, request: &Request) -> Result<Exit> {
    let list: ShelfList = match at.ask(request) {
        Ok(list) => list,
        Err(exit) => return Ok(exit),
    };
    let clock = LocalClock::here();
    at.print(&list, || list.alarms.iter().map(|alarm| line(alarm, &clock)).collect())?;
    let Some(why) = &list.not_kept else { return Ok(Exit::Ok) };
    say_line(&format!("warning: done, but a restart of rungd would forget it: {why}"));
    Ok(Exit::Io)
}

/// The line about the result for one alarm.
fn line(alarm: &ShelvedAlarm, clock: &LocalClock) -> String {
    let ShelvedAlarm { tag, text, before, after, is_active } = alarm;
    let what = match (before, after) {
        (_, Some(shelf)) => match shelf.until_ns {
            Some(until_ns) => format!("{} until {}", shelf.words(), clock.text(until_ns)),
            None => shelf.words().to_owned(),
        },
        (Some(shelf), None) => {
            let back = match shelf.until_ns {
                Some(_) => "back from its shelf",
                None => "back in service",
            };
            format!("{back}; {}", if *is_active { "it stands" } else { "it does not stand" })
        }
        (None, None) => "it was not shelved".to_owned(),
    };
    format!("{} ({}): {what}\n", one_line(tag), one_line(text))
}
