//! `rungd fleet`: the controllers behind a broker, from the messages of their edge nodes.
//!
//! `fleet` subscribes; `fleet_page` makes the texts. No value of a controller is written:
//! `--rebirth` requests births from nodes, `--host-id` publishes the state of this host, and
//! nothing else is published.

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context as _, Result};
use clap::{Args, Subcommand};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde::Serialize;

use super::exit::Exit;
use super::fleet_broker::BrokerArgs;
use super::fleet_page::{alarms_page, change_line, status_page};
use super::terminal::{plain_json, print, say_line};
use super::when::LocalClock;
use rungd_base::wall_clock::now_ms;
use rungd_engine::isa::duration;
use rungd_fleet::fleet::{ExpectedLadders, FleetEvent, FleetResult, WatchedMetrics, listen};

/// Shows the controllers behind an MQTT broker, from the Sparkplug B messages of their edge nodes
///
/// An edge node publishes its birth when it connects, and the broker does not keep births. So for a
/// node that connected before `rungd fleet`, only the name is known until its next birth:
/// `--rebirth` requests one. Nothing else is sent to a node, and no value of a controller is
/// written. `--host-id` publishes the state of this host. Without either option nothing is
/// published.
#[derive(Args, Debug)]
pub struct FleetArgs {
    #[command(subcommand)]
    command: FleetCommand,
}

#[derive(Subcommand, Debug)]
enum FleetCommand {
    Status(FleetStatusArgs),
    Watch(FleetWatchArgs),
    Alarms(FleetAlarmsArgs),
}

/// Lists the nodes: state, mode, ladder, forces, overruns, alarms, age of the last message
#[derive(Args, Debug)]
struct FleetStatusArgs {
    #[command(flatten)]
    at: BrokerArgs,
    #[command(flatten)]
    wait: WaitArgs,
    /// Compare the ladders with those of a folder, such as a Git checkout:
    /// `DIR/GROUP/NODE/controller.toml` or `DIR/NODE/controller.toml`. Exit with 1 if a node does
    /// not run the ladder in the folder
    #[arg(long, value_name = "DIR")]
    expect: Option<PathBuf>,
    /// Exit with 1 unless each node is online and its controller's mode is RUN
    #[arg(long)]
    require_run: bool,
}

/// Prints each change as a line: births, deaths, values
#[derive(Args, Debug)]
struct FleetWatchArgs {
    /// Names of metrics; `*` matches any characters (default: all but the heartbeat).
    /// With names, or with `--rebirth`, the values of each node's first birth are printed too
    #[arg(value_name = "METRIC")]
    metrics: Vec<String>,
    #[command(flatten)]
    at: BrokerArgs,
    /// How long it watches (default: until it is interrupted)
    #[arg(long, value_name = "TIME", value_parser = time)]
    wait: Option<Duration>,
}

/// Lists the alarms of all nodes: alarms that stand, or that wait for an acknowledgement
#[derive(Args, Debug)]
struct FleetAlarmsArgs {
    #[command(flatten)]
    at: BrokerArgs,
    #[command(flatten)]
    wait: WaitArgs,
}

#[derive(Args, Debug)]
struct WaitArgs {
    /// The time to listen before the answer. An edge node of rungd sends a message every 10 s
    #[arg(long, value_name = "TIME", default_value = "12s", value_parser = time)]
    wait: Duration,
}

fn time(text: &str) -> Result<Duration, String> {
    match duration::parse(text).map(|ms| Duration::from_millis(ms.unsigned_abs().into())) {
        Ok(time) if !time.is_zero() => Ok(time),
        Ok(_) => Err(format!("`{text}` is no time to wait: write it as 12s or 2m, at most 596h")),
        Err(_) => Err(duration::not_a_duration(text, "12s or 2m, at most 596h")),
    }
}

/// Subscribes, and prints the answer or the changes.
///
/// # Errors
/// Standard output cannot be written, or a file cannot be read.
pub fn fleet(args: &FleetArgs) -> Result<Exit> {
    match &args.command {
        FleetCommand::Status(args) => status(args),
        FleetCommand::Watch(args) => watch(args),
        FleetCommand::Alarms(args) => alarms(args),
    }
}

fn status(args: &FleetStatusArgs) -> Result<Exit> {
    let mut expected = match &args.expect {
        Some(folder) => Some(ExpectedLadders::of(folder).context("--expect")?),
        None => None,
    };
    let heard = match for_a_while(&args.at, args.wait.wait)? {
        Listened::Heard(heard) => heard,
        Listened::Failed(exit) => return Ok(exit),
    };
    let mut report = heard.view.report(now_ms());
    expected.iter_mut().for_each(|folder| report.compare(folder));
    let differs = expected.is_some() && !report.is_as_expected();
    let stands = args.require_run && !report.all_run();
    answer(args.at.json, &report, || status_page(&report, heard.lasted))?;
    Ok(match heard.failure {
        Some(_) => Exit::Unavailable,
        None if differs || stands => Exit::Refused,
        None => Exit::Ok,
    })
}

fn alarms(args: &FleetAlarmsArgs) -> Result<Exit> {
    let heard = match for_a_while(&args.at, args.wait.wait)? {
        Listened::Heard(heard) => heard,
        Listened::Failed(exit) => return Ok(exit),
    };
    let list = heard.view.alarms(now_ms());
    answer(args.at.json, &list, || alarms_page(&list, heard.lasted, &LocalClock::here()))?;
    Ok(if heard.failure.is_some() { Exit::Unavailable } else { Exit::Ok })
}

fn watch(args: &FleetWatchArgs) -> Result<Exit> {
    let options = match args.at.options(args.wait) {
        Ok(options) => options,
        Err(exit) => return Ok(exit),
    };
    let watched = WatchedMetrics::new(args.metrics.clone(), args.at.rebirth);
    let clock = LocalClock::here();
    let heard = listen(&options, &mut |word| match word {
        FleetEvent::Connected(address) => {
            say_line(&format!("rungd fleet: listens at {address}"));
            Ok(())
        }
        FleetEvent::Failed(failure) => {
            say_line(&format!("rungd fleet: {failure}"));
            Ok(())
        }
        FleetEvent::Changed(changes) => {
            let wanted = changes.iter().filter(|change| watched.wants(&change.news));
            for change in wanted {
                answer(args.at.json, change, || change_line(change, &clock))?;
            }
            io::stdout().flush().map_err(Into::into)
        }
        FleetEvent::LeftOut(what) => {
            say_line(&format!(
                "rungd fleet: leaves out messages {what}; their number is printed at the end"
            ));
            Ok(())
        }
        FleetEvent::Waiting => Ok(expect_reader()?),
    })?;
    for what in heard.view.left_out() {
        say_line(&format!("rungd fleet: left out: {what}"));
    }
    Ok(args.at.exit(&heard))
}

/// The result of listening for a while.
enum Listened {
    Heard(Box<FleetResult>),
    /// The exit code of a failure, which has been printed.
    Failed(Exit),
}

/// Listens for the time `wait`.
fn for_a_while(at: &BrokerArgs, wait: Duration) -> Result<Listened> {
    let options = match at.options(Some(wait)) {
        Ok(options) => options,
        Err(exit) => return Ok(Listened::Failed(exit)),
    };
    let heard = listen(&options, &mut |word| match word {
        FleetEvent::Failed(failure) => {
            say_line(&format!("rungd fleet: {failure}"));
            Ok(())
        }
        // The answer reports what was left out.
        FleetEvent::Connected(_) | FleetEvent::Changed(_) | FleetEvent::LeftOut(_) => Ok(()),
        FleetEvent::Waiting => Ok(expect_reader()?),
    })?;
    Ok(match heard.was_connected {
        true => Listened::Heard(Box::new(heard)),
        false => Listened::Failed(at.exit(&heard)),
    })
}

/// Prints an answer as a line of JSON or as text.
fn answer<T: Serialize>(json: bool, answer: &T, text: impl FnOnce() -> String) -> Result<()> {
    if json {
        let json = serde_json::to_string(answer)?;
        writeln!(io::stdout().lock(), "{}", plain_json(&json))?;
    } else {
        print(&text())?;
    }
    Ok(())
}

/// Checks that somebody can still read standard output: a command that may have nothing to print
/// for hours ends with its reader (`… | head -1`), and not only at its next line.
///
/// # Errors
/// A broken pipe: the reader has ended.
fn expect_reader() -> io::Result<()> {
    let output = io::stdout();
    let mut polled = [PollFd::new(&output, PollFlags::empty())];
    // A pipe without a reader is in error, a terminal or a connection that has ended hangs up.
    poll(&mut polled, Some(&Timespec::default()))?;
    match polled[0].revents().intersects(PollFlags::ERR | PollFlags::HUP) {
        true => Err(io::ErrorKind::BrokenPipe.into()),
        false => Ok(()),
    }
}
