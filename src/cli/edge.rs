//! `rungd edge`: the Sparkplug B edge node of a running controller.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::Args;

use super::check::style;
use super::exit::Exit;
use super::terminal::say_findings;
use rungd_config::load::read_bytes;
use rungd_fleet::edge::{read_edge, run};
use rungd_language::source::render::render;

/// Publishes the tags of a running controller to an MQTT broker, as a Sparkplug B edge node
///
/// The file names the controller and the broker. Changes are read from the scan log, so changes
/// during a break of the link are sent later, with the time of their scan. Commands are refused
/// unless the file lists their tags.
#[derive(Args, Debug)]
pub struct EdgeArgs {
    /// The file of the edge node
    #[arg(value_name = "EDGE.toml")]
    file: PathBuf,
    /// Only check the file, and print all findings
    #[arg(long)]
    check: bool,
}

/// Publishes the tags, or only checks the file.
///
/// # Errors
/// The file cannot be read, or the node cannot start.
pub fn edge(args: &EdgeArgs) -> Result<Exit> {
    let bytes = read_bytes(&args.file).with_context(|| args.file.display().to_string())?;
    let read = read_edge(&args.file, &bytes);
    if args.check || !read.findings.is_empty() {
        say_findings(&render(&read.findings, std::slice::from_ref(&read.file), style(false)));
    }
    let Some(settings) = read.settings else { return Ok(Exit::Config) };
    if !args.check {
        run(&settings)?;
    }
    Ok(Exit::Ok)
}
