//! `rungd metrics`: the metrics of a running controller, for Prometheus and similar systems.

use std::io::{self, Write as _};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Result;
use clap::Args;

use super::exit::Exit;
use super::operator::{exit_of, say_failure};
use rungd_client::operator::SOCKET_VARIABLE;
use rungd_client::operator::client::CallFailure;
use rungd_engine::isa::duration::{self, not_a_duration};
use rungd_fleet::metrics;

const EVERY_LEAST: Duration = Duration::from_secs(1);

/// Prints the metrics of a running controller, serves them, or writes them to a file
///
/// Without `--listen` and `--textfile` it reads the metrics once, and prints them in the text
/// format of Prometheus.
#[derive(Args, Debug)]
pub struct MetricsArgs {
    /// Serve them at http://ADDRESS/metrics, as OpenMetrics or as Prometheus text
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1)]
    #[arg(default_missing_value = "127.0.0.1:9464", value_parser = address)]
    #[arg(conflicts_with = "textfile")]
    listen: Option<SocketAddr>,
    /// A host name under which clients reach this host, besides its own. Repeat the option for
    /// several names
    #[arg(long = "host", value_name = "NAME", requires = "listen")]
    hosts: Vec<String>,
    /// Write them to a file, for a collector of text files (`*.prom`)
    #[arg(long, value_name = "PATH")]
    textfile: Option<PathBuf>,
    /// Write the file again at this interval, such as 15s
    #[arg(long, value_name = "TIME", requires = "textfile", value_parser = interval)]
    #[arg(conflicts_with = "listen")]
    every: Option<Duration>,
    /// The running controller's socket (default: that of the controller that runs in this folder,
    /// else of your only running one, else the service's, /run/rungd/rungd.sock)
    #[arg(long, value_name = "PATH", env = SOCKET_VARIABLE)]
    socket: Option<PathBuf>,
}

fn address(text: &str) -> Result<SocketAddr, String> {
    let local = text.strip_prefix("localhost:").map(|port| format!("127.0.0.1:{port}"));
    let address = local.as_deref().unwrap_or(text).parse();
    address.map_err(|_| "write an address with a port, as 127.0.0.1:9464".to_owned())
}

fn interval(text: &str) -> Result<Duration, String> {
    let time = duration::parse(text).map(|ms| Duration::from_millis(ms.unsigned_abs().into()));
    match time {
        Ok(time) if time >= EVERY_LEAST => Ok(time),
        Ok(_) => Err("a file is written once a second at most".to_owned()),
        Err(_) => Err(not_a_duration(text, "15s or 1m")),
    }
}

/// Prints, serves or writes the metrics.
///
/// # Errors
/// The address cannot be used, or the file or standard output cannot be written.
pub fn metrics(args: &MetricsArgs) -> Result<Exit> {
    let socket = args.socket.clone();
    if let Some(at) = args.listen {
        metrics::listen(at, &args.hosts, socket)?;
        return Ok(Exit::Ok);
    }
    let failure = match (&args.textfile, args.every) {
        (Some(file), Some(every)) => {
            metrics::write_every(file, every, socket)?;
            None
        }
        (Some(file), None) => metrics::write(file, socket)?,
        (None, _) => {
            let (text, failure) = metrics::once(socket);
            // The output is for a program, and already has its own escapes.
            io::stdout().lock().write_all(text.as_bytes())?;
            failure
        }
    };
    Ok(failure.as_ref().map_or(Exit::Ok, exit_after))
}

fn exit_after(failure: &CallFailure) -> Exit {
    say_failure(failure);
    exit_of(failure)
}
