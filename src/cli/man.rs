//! `rungd man`: writes the manual pages, one for each subcommand, from the definition of the
//! command line. The build of a package calls it; people read `man rungd`.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::{Args, Command};
use clap_mangen::Man;
use clap_mangen::roff::{Roff, bold, roman};

use super::exit::Exit;

/// Writes the manual pages into a directory
#[derive(Args, Debug)]
pub struct ManArgs {
    /// The directory; it is created if it does not exist
    #[arg(value_name = "DIR")]
    directory: PathBuf,
}

const MANUAL: &str = "rungd manual";

const ENVIRONMENT: [(&str, &str); 4] = [
    ("RUNGD_SOCKET", "The running controller's socket, if no --socket is given."),
    ("RUNGD_LOG", "The level of the log, if no --log-level is given."),
    ("RUNGD_LOG_CHAIN", "The file with the newest link of the audit trail, whose lines it chains."),
    ("NO_COLOR", "Findings are printed without colours if this is set to anything."),
];

const FILES: [(&str, &str); 5] = [
    ("/etc/rungd/controller.toml", "The controller file of the service."),
    ("/etc/rungd/programs/", "The ladder files that it names."),
    ("/run/rungd/rungd.sock", "The operator's socket of the service."),
    ("/run/rungd/rungd-view.sock", "The view socket of the service, which refuses every change."),
    ("/usr/share/doc/rungd/", "The language, the semantics, how to run a controller."),
];

/// Writes the pages.
///
/// # Errors
/// The directory cannot be written.
pub fn man(args: &ManArgs, command: Command) -> Result<Exit> {
    let mut command = command.disable_help_subcommand(true);
    command.build();
    let what = || format!("cannot write manual pages to {}", args.directory.display());
    fs::create_dir_all(&args.directory).with_context(what)?;
    write(&command, &args.directory).with_context(what)?;
    Ok(Exit::Ok)
}

fn write(command: &Command, directory: &Path) -> io::Result<()> {
    for below in command.get_subcommands().filter(|below| !below.is_hide_set()) {
        write(below, directory)?;
    }
    let man = Man::new(command.clone()).manual(MANUAL);
    fs::write(directory.join(man.get_filename()), page(&man, command)?)
}

fn page(man: &Man, command: &Command) -> io::Result<Vec<u8>> {
    let mut page = Vec::new();
    man.render_title(&mut page)?;
    man.render_name_section(&mut page)?;
    man.render_synopsis_section(&mut page)?;
    man.render_description_section(&mut page)?;
    man.render_options_section(&mut page)?;
    if command.get_subcommands().any(|below| !below.is_hide_set()) {
        man.render_subcommands_section(&mut page)?;
    }
    let mut roff = Roff::default();
    let top = command.get_name() == "rungd";
    let exits: Vec<(String, &str)> = exits();
    section(&mut roff, "EXIT STATUS", exits.iter().map(|(code, why)| (code.as_str(), *why)));
    if top {
        section(&mut roff, "ENVIRONMENT", ENVIRONMENT.into_iter());
        section(&mut roff, "FILES", FILES.into_iter());
    }
    roff.control("SH", ["SEE ALSO"]);
    let others = if top { "systemd(1), journalctl(1)" } else { "rungd(1)" };
    roff.text([roman(others)]);
    roff.to_writer(&mut page)?;
    Ok(page)
}

fn section<'a>(roff: &mut Roff, title: &str, rows: impl Iterator<Item = (&'a str, &'a str)>) {
    roff.control("SH", [title]);
    for (name, meaning) in rows {
        roff.control("TP", []);
        roff.text([bold(name)]);
        roff.text([roman(meaning)]);
    }
}

/// The exit codes, each with the first sentence of its row in `docs/exit-codes.md`.
fn exits() -> Vec<(String, &'static str)> {
    let page = include_str!("../../docs/exit-codes.md");
    let meaning = |exit: Exit, name: &str| {
        let row = page.split(&format!("| {} | `{name}` | ", exit as i32)).nth(1)?;
        let sentence = row.split(['.', '|']).next()?;
        Some((format!("{} {name}", exit as i32), sentence.trim()))
    };
    Exit::ALL.into_iter().filter_map(|(exit, name)| meaning(exit, name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_exit_code_has_a_sentence_in_the_man_page() {
        assert_eq!(exits().len(), Exit::ALL.len());
        assert!(exits().iter().all(|(_, sentence)| sentence.len() > 5), "{:?}", exits());
    }
}
