//! `rungd-opcua`: a running controller as an OPC UA server. The command line; `rungd_opcua` serves.
//!
//! OPCUA.toml is read by `rungd_fleet::opcua`.

use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, Result};
use clap::{Parser, Subcommand};
use rungd_config::load::read_bytes;
use rungd_fleet::opcua::{OpcUaSettings, read_opcua};
use rungd_language::source::render::{Style, render};
use rungd_opcua::{certificates, journal, server};

/// The exit code for a file with an error, as of `rungd`.
const CONFIG: u8 = 78;

/// Shows a running controller to OPC UA clients
///
/// The file names the controller, the address, the users and the tags that clients may write.
#[derive(Parser, Debug)]
#[command(version, args_conflicts_with_subcommands = true, arg_required_else_help = true)]
struct ServerArguments {
    /// The file of the server
    #[arg(value_name = "OPCUA.toml")]
    file: Option<PathBuf>,
    /// Only check the file, and print all findings
    #[arg(long)]
    check: bool,
    #[command(subcommand)]
    command: Option<ServerCommand>,
}

/// What is done instead of serving.
#[derive(Subcommand, Debug)]
enum ServerCommand {
    /// Shows the certificates of clients, and trusts them or not
    Trust {
        /// The file of the server
        #[arg(value_name = "OPCUA.toml")]
        file: PathBuf,
        #[command(subcommand)]
        action: Option<TrustAction>,
    },
}

/// What is done with a certificate.
#[derive(Subcommand, Debug)]
enum TrustAction {
    /// Shows the certificates of all clients that have tried to connect
    List,
    /// Trusts a client's certificate: the client may connect
    Add {
        /// The beginning of its thumbprint
        thumbprint: String,
    },
    /// Takes the trust back: the client cannot connect any more
    Remove {
        /// The beginning of its thumbprint
        thumbprint: String,
    },
}

fn main() -> ExitCode {
    // The key of the server's certificate is for this user alone.
    rustix::process::umask(rustix::fs::Mode::from_raw_mode(0o077));
    match carried_out(&ServerArguments::parse()) {
        Ok(code) => code,
        Err(error) => {
            journal::say(&format!("{error:#}"));
            ExitCode::FAILURE
        }
    }
}

fn carried_out(arguments: &ServerArguments) -> Result<ExitCode> {
    if let Some(ServerCommand::Trust { file, action }) = &arguments.command {
        let Some(settings) = read(file, false)? else { return Ok(ExitCode::from(CONFIG)) };
        trust(&settings, action.as_ref().unwrap_or(&TrustAction::List))?;
        return Ok(ExitCode::SUCCESS);
    }
    let Some(file) = &arguments.file else { return Ok(ExitCode::FAILURE) };
    let Some(settings) = read(file, arguments.check)? else { return Ok(ExitCode::from(CONFIG)) };
    if !arguments.check {
        server::run(&settings)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The settings of a file; `None`: it has an error. Prints its findings.
fn read(file: &Path, always: bool) -> Result<Option<OpcUaSettings>> {
    let bytes = read_bytes(file).with_context(|| file.display().to_string())?;
    let read = read_opcua(file, &bytes);
    if always || !read.findings.is_empty() {
        let style = Style { color: std::io::stderr().is_terminal(), ..Style::default() };
        let text = render(&read.findings, std::slice::from_ref(&read.file), style);
        let _ = std::io::stderr().lock().write_all(text.as_bytes());
    }
    Ok(read.settings)
}

fn trust(settings: &OpcUaSettings, action: &TrustAction) -> Result<()> {
    let folder = &settings.certificates;
    let mut out = std::io::stdout().lock();
    let set = |start: &str, trusts: bool| certificates::set_trust(folder, start, trusts);
    match action {
        TrustAction::List => {
            let all = certificates::clients(folder)?;
            if all.is_empty() {
                writeln!(out, "no client has tried to connect with encryption yet")?;
            }
            for client in all {
                let state = if client.is_trusted { "trusted " } else { "rejected" };
                writeln!(out, "{state}  {}  {}", client.thumbprint, client.name)?;
            }
        }
        TrustAction::Add { thumbprint } => {
            let client = set(thumbprint, true)?;
            writeln!(out, "{} ({}) is trusted: it may connect", client.name, client.thumbprint)?;
        }
        TrustAction::Remove { thumbprint } => {
            let client = set(thumbprint, false)?;
            writeln!(
                out,
                "{} ({}) is not trusted any more; a connection that it has lasts on",
                client.name, client.thumbprint
            )?;
        }
    }
    Ok(())
}
