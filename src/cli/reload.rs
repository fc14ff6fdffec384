//! `rungd reload` and `rungd rollback`: change the running program without a stop, and return to
//! the previous one.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use rustix::io::Errno;
use rustix::process::{Pid, Signal, kill_process};

use super::exit::Exit;
use super::operator::OperatorArgs;
use super::terminal::{one_line, say, say_line};
use crate::daemon::config;
use rungd_base::progress::Progress;
use rungd_client::operator::client::{self, CallFailure};
use rungd_client::operator::protocol::{
    RefusalKind, ReloadResult, Request, RequestRefusal, is_run,
};
use rungd_client::operator::socket_place::{SocketPlace, operator_socket};
use rungd_language::source::render::Style;

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
    /// The controller's process: if no controller answers there, it receives SIGHUP, and the log
    /// has the outcome; a different process that answers there is refused
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
    let place = operator_socket(controller);
    if let Some(pid) = args.pid {
        return reload_process(args, controller, place, pid);
    }
    if !place.is_certain
        && let Some(exit) = refused_files(&args.at, controller)
    {
        return Ok(exit);
    }
    let Some(socket) = place.path else {
        let file = controller.display();
        say_line(&format!("rungd: {file}: there is no operator's socket; SIGHUP makes it reload"));
        return Ok(Exit::Unavailable);
    };
    ask(&OperatorArgs { socket: socket.into(), ..args.at.clone() }, &request)
}

/// Reloads the controller of this process: at the socket if the process answers there, else by
/// SIGHUP. Before SIGHUP the files are checked here, because a signal has no answer.
fn reload_process(
    args: &ReloadArgs,
    controller: &Path,
    place: SocketPlace,
    pid: i32,
) -> Result<Exit> {
    let SocketPlace { path, is_certain } = place;
    let listener = match path.as_deref().map(client::listener) {
        None | Some(Err(CallFailure::NotRunning(..) | CallFailure::NotAllowed(..))) => None,
        Some(Ok(process)) => Some(process),
        Some(Err(failure)) => return Ok(args.at.print_failure(&failure)),
    };
    let is_own = listener == Some(Some(pid));
    if !is_own
        && (listener.is_none() || !is_certain)
        && let Some(exit) = refused_files(&args.at, controller)
    {
        return Ok(exit);
    }
    match (path, listener) {
        (Some(socket), Some(_)) if is_own => {
            let at = OperatorArgs { socket: socket.into(), ..args.at.clone() };
            ask(&at, &Request::Reload { dry_run: false })
        }
        (Some(socket), Some(process)) => Ok(different_process(&socket, process, pid)),
        (Some(_), None) | (None, _) => hang_up(pid),
    }
}

/// Prints the findings if the files cannot be run as they are; returns the exit code.
fn refused_files(at: &OperatorArgs, controller: &Path) -> Option<Exit> {
    let style = Style { color: false, deny_warnings: false };
    let findings = config::load(controller, style, &Progress::default()).err()?.text();
    Some(
        at.print_failure(&CallFailure::Refused(RequestRefusal::new(
            RefusalKind::BadFiles,
            findings,
        ))),
    )
}

/// Refuses to reload the controller of a different process than the named one.
fn different_process(socket: &Path, process: Option<i32>, pid: i32) -> Exit {
    let process = process.map_or("a different process".to_owned(), |pid| format!("process {pid}"));
    say_line(&format!(
        "rungd: {process} answers at {}, not process {pid}: nothing is reloaded; does `[operator] \
         socket` name the socket of a different controller?",
        socket.display()
    ));
    Exit::Unavailable
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
    let done: ReloadResult = match at.ask(request) {
        Ok(done) => done,
        Err(exit) => return Ok(exit),
    };
    at.print(&done, || text(&done))?;
    Ok(Exit::Ok)
}

fn text(done: &ReloadResult) -> String {
    let mut text = String::new();
    for line in &done.report {
        text += &format!("{}\n", one_line(line));
    }
    for line in &done.restart {
        text += &format!("needs a restart: {}\n", one_line(line));
    }
    text + &end(done)
}

fn end(done: &ReloadResult) -> String {
    let (ladder, mode) = (one_line(&done.ladder), &done.mode);
    match done.swap_us {
        _ if done.same => {
            "nothing changed: the files are those of the running program\n".to_owned()
        }
        Some(us) if is_run(mode) => {
            format!("`{ladder}` runs now: the swap between two scans took {us} us\n")
        }
        Some(us) => format!(
            "`{ladder}` is loaded: the swap took {us} us; the mode is {mode}, and nothing is \
             scanned until `rungd mode run`\n"
        ),
        None => "dry run: nothing was done\n".to_owned(),
    }
}
