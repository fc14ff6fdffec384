//! `rungd monitor`: a page in the terminal that shows a running controller.

use std::io::{self, IsTerminal};
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use clap_complete::engine::ArgValueCompleter;

use super::exit::Exit;
use super::operator::{complete, exit_of, say_failure};
use super::terminal::say;
use rungd_client::operator::{SOCKET_VARIABLE, search};
use rungd_monitor::{MonitorSetup, run};

/// Shows a running controller on a page in the terminal: its state, a watch list, the ladder
///
/// The page shows the mode, the scan, alarms, forces, devices, blocks with their Stages, a watch
/// list with trends, and the ladder of a block. Keys explain an operand, force and write it; each
/// change is confirmed first. `?` lists the keys, `q` ends. It uses no colours if NO_COLOR is set.
#[derive(Args, Debug)]
pub struct MonitorArgs {
    /// The first operands of the watch list: tags, addresses, members, ranges (`X0..X7`)
    #[arg(value_name = "OPERAND", add = ArgValueCompleter::new(complete))]
    operands: Vec<String>,
    /// The running controller's socket (default: that of the controller that runs in this folder,
    /// else of your only running one, else the service's, /run/rungd/rungd.sock)
    #[arg(long, value_name = "PATH", env = SOCKET_VARIABLE)]
    socket: Option<PathBuf>,
}

/// Shows the page until its user ends it.
///
/// # Errors
/// The terminal cannot be taken over or written.
pub fn monitor(args: &MonitorArgs) -> Result<Exit> {
    if !io::stdin().is_terminal() || !io::stdout().is_terminal() {
        say("rungd: the monitor needs a terminal for its input and output; `rungd status` and \
             `rungd watch` print to a file or pipe\n");
        return Ok(Exit::Usage);
    }
    let socket = match search::socket(args.socket.clone()) {
        Ok(socket) => socket,
        Err(failure) => {
            say_failure(&failure);
            return Ok(exit_of(&failure));
        }
    };
    let wants_none = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    run(MonitorSetup { socket, operands: args.operands.clone(), has_colours: !wants_none })?;
    Ok(Exit::Ok)
}
