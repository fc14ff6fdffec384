//! `rungd reload` and `rungd rollback`: change the running program without a stop, and return to
//! the previous one.

use std::os::unix::net::UnixStream;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use rustix::io::Errno;
use rustix::process::{Pid, Signal, kill_process};

use super::exit::Exit;
use super::operator::OperatorArgs;
use super::terminal::{one_line, say, say_line};
use crate::daemon;
use crate::operator::protocol::{Reloaded, Request};

/// Makes the running controller read its files again and continue with the program in them
///
/// The programs are swapped between two scans. Wrong files change nothing, and give exit code 78.
#[derive(Args, Debug)]
pub struct ReloadArgs {
    #[command(flatten)]
    at: OperatorArgs,
    /// Print which values would be kept, new and lost, and change nothing
    #[arg(long)]
    dry_run: bool,
    /// Use the socket that this controller file names, or that systemd's environment names
    #[arg(long, value_name = "CONTROLLER.toml")]
    controller: Option<PathBuf>,
    /// If no controller answers there, send SIGHUP to this process; the log has the outcome
    #[arg(long, value_name = "PID", requires = "controller", conflicts_with = "dry_run")]
    pid: Option<i32>,
}

/// Goes back to the last program before the running one that passed its probation
///
/// The program of the start counts as passed, and with `[reload] probation = "0ms"` every program.
/// Programs that another reload replaced within their probation are skipped. It can be done once
/// after a reload. No file is read.
#[derive(Args, Debug)]
pub struct RollbackArgs {
    #[command(flatten)]
    at: OperatorArgs,
}

/// Reloads the program.
///
/// # Errors
/// Standard output cannot be written.
pub fn reload(args: &ReloadArgs) -> Result<Exit> {
    let request = Request::Reload { dry_run: args.dry_run };
    let Some(controller) = &args.controller else { return ask(&args.at, &request) };
    let socket = daemon::operator_socket(controller);
    if let Some(pid) = args.pid
        && socket.as_ref().is_none_or(|socket| UnixStream::connect(socket).is_err())
    {
        return hang_up(pid);
    }
    let Some(socket) = socket else {
        let file = controller.display();
        say_line(&format!("rungd: {file}: there is no operator's socket; SIGHUP makes it reload"));
        return Ok(Exit::Unavailable);
    };
    ask(&OperatorArgs { socket: socket.into(), ..args.at.clone() }, &request)
}

/// Makes a process without a socket reload, by SIGHUP. The result is only in the log.
fn hang_up(pid: i32) -> Result<Exit> {
    let process = Pid::from_raw(pid).filter(|_| pid > 0);
    let sent = process.ok_or(Errno::SRCH).and_then(|process| kill_process(process, Signal::HUP));
    Ok(match sent {
        Ok(()) => {
            say("rungd: no operator's socket answers: \
                 SIGHUP is sent, and the log has the outcome\n");
            Exit::Ok
        }
        Err(error) => {
            say(&format!("rungd: SIGHUP cannot be sent to process {pid}: {error}\n"));
            Exit::Unavailable
        }
    })
}

/// Rolls back to the previous program.
///
/// # Errors
/// Standard output cannot be written.
pub fn rollback(args: &RollbackArgs) -> Result<Exit> {
    let done = ask(&args.at, &Request::Rollback {})?;
    if matches!(done, Exit::Ok) && !args.at.json {
        say_line(
            "note: a rollback changes no file: a reload or a restart runs what the files hold",
        );
    }
    Ok(done)
}

fn ask(at: &OperatorArgs, request: &Request) -> Result<Exit> {
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
        text += &format!("{}\n", one_line(line));
    }
    for line in &done.restart {
        text += &format!("needs a restart: {}\n", one_line(line));
    }
    text + &end(done)
}

fn end(done: &Reloaded) -> String {
    let (ladder, mode) = (one_line(&done.ladder), &done.mode);
    match done.swap_us {
        _ if done.same => "nothing changed: the files are those that run already\n".to_owned(),
        Some(us) if mode == "RUN" => {
            format!("`{ladder}` runs now: the swap between two scans took {us} us\n")
        }
        Some(us) => format!(
            "`{ladder}` is loaded: the swap took {us} us; the mode is {mode}, and nothing is \
             scanned until `rungd mode run`\n"
        ),
        None => "dry run: nothing was done\n".to_owned(),
    }
}
