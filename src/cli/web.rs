//! `rungd web`: the pages of a running controller for a browser, and their users.

use std::io::{self, BufRead as _, IsTerminal as _};
use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::{Args, Subcommand};
use rustix::termios::{LocalModes, OptionalActions, tcgetattr, tcsetattr};

use super::exit::Exit;
use super::operator::{exit_of, say_failure};
use super::terminal::{print, say, say_line};
use rungd_client::operator::SOCKET_VARIABLE;
use rungd_client::operator::client::CallFailure;
use rungd_client::operator::search;
use rungd_client::operator::search_failure::SearchFailure;
use rungd_web::{ListenAt, Secret, UserFailure, WebOptions, serve, set_password};

/// Shows a running controller in a browser: its ladder with power, why, trends, alarms
#[derive(Args, Debug)]
pub struct WebArgs {
    #[command(subcommand)]
    users: Option<WebCommand>,
    /// Where to listen: an address with a port, or the path of a Unix socket
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:8080")]
    #[arg(value_parser = ListenAt::parse)]
    listen: ListenAt,
    /// A host name under which browsers reach this host. Repeat the option for several names
    #[arg(long = "host", value_name = "NAME")]
    hosts: Vec<String>,
    /// The certificate and its chain, as PEM
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// The certificate's key, as PEM
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// Browsers reach it through a proxy that provides TLS
    #[arg(long, conflicts_with = "tls_cert")]
    behind_proxy: bool,
    /// The file of users, made by `rungd web passwd`; without it, a one-time link gives access
    #[arg(long, value_name = "FILE")]
    users_file: Option<PathBuf>,
    /// The folder with the drawings of panels: SVG files, whose names a `mimic` gives
    #[arg(long, value_name = "FOLDER")]
    mimics: Option<PathBuf>,
    /// The running controller's socket (default: that of the controller that runs in this folder,
    /// else of your only running one, else the service's, /run/rungd/rungd.sock)
    #[arg(long, value_name = "PATH", env = SOCKET_VARIABLE)]
    socket: Option<PathBuf>,
}

#[derive(Subcommand, Debug)]
enum WebCommand {
    /// Sets the password of a user, who may then sign in; prompts for it, or reads a line of
    /// standard input
    Passwd {
        /// The user
        #[arg(value_name = "USER")]
        user: String,
        /// The file of users
        #[arg(long, value_name = "FILE", default_value = "/etc/rungd/web-users")]
        users_file: PathBuf,
        /// Remove the user
        #[arg(long)]
        remove: bool,
        /// A PIN of 6 to 12 digits instead of a password, for the keys of a panel
        #[arg(long, conflicts_with = "remove")]
        pin: bool,
    },
}

/// Serves the pages, or sets a password.
///
/// # Errors
/// The arguments are refused, or a file, socket or address cannot be opened.
pub fn web(args: &WebArgs) -> Result<Exit> {
    if let Some(WebCommand::Passwd { user, users_file, remove, pin }) = &args.users {
        let kind = if *pin { Secret::Pin } else { Secret::Password };
        let given = if *remove { None } else { Some(asked()?) };
        return passwd(user, users_file, given.as_deref().map(kind));
    }
    let options = WebOptions {
        listen: args.listen.clone(),
        socket: args.socket.clone(),
        hosts: args.hosts.clone(),
        tls: args.tls_cert.clone().zip(args.tls_key.clone()),
        behind_proxy: args.behind_proxy,
        users: args.users_file.clone(),
        mimics: args.mimics.clone(),
    };
    if let Err(refused) = options.judge() {
        say_line(&format!("rungd web: {refused}"));
        return Ok(Exit::Usage);
    }
    // The pages may be opened before the controller starts, but not choose between several.
    if let Err(failure @ CallFailure::NotFound(SearchFailure::Several { .. })) =
        search::socket(options.socket.clone())
    {
        say_failure(&failure);
        return Ok(exit_of(&failure));
    }
    serve(&options)?;
    Ok(Exit::Ok)
}

/// Sets what a user signs in with; `None` removes the user.
fn passwd(user: &str, file: &std::path::Path, secret: Option<Secret<'_>>) -> Result<Exit> {
    match set_password(file, user, secret) {
        Ok(()) if secret.is_none() => {
            print(&format!("{user} is removed; open sessions have ended\n"))?
        }
        Ok(()) => print(&format!("{user} may sign in: `rungd web --users-file` names the file\n"))?,
        Err(failure @ UserFailure::Refused(_)) => {
            say_line(&format!("rungd web: {failure}"));
            return Ok(Exit::Usage);
        }
        Err(failure) => bail!(failure),
    }
    Ok(Exit::Ok)
}

/// Reads a password: typed twice without being shown, or a line of standard input.
fn asked() -> Result<String> {
    let stdin = io::stdin();
    if !stdin.is_terminal() {
        return line();
    }
    let shown = tcgetattr(&stdin)?;
    let mut hidden = shown.clone();
    hidden.local_modes -= LocalModes::ECHO;
    tcsetattr(&stdin, OptionalActions::Flush, &hidden)?;
    say("password: ");
    let first = line();
    say("\nthe same again: ");
    let second = line();
    tcsetattr(&stdin, OptionalActions::Flush, &shown)?;
    say("\n");
    let first = first?;
    if first != second? {
        bail!("the two passwords differ: nothing is changed");
    }
    Ok(first)
}

fn line() -> Result<String> {
    let mut line = String::new();
    io::stdin().lock().read_line(&mut line)?;
    Ok(line.trim_end_matches(['\r', '\n']).to_owned())
}
