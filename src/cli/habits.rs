//! Commands of other programs that people type from habit: the tip says what rungd calls them.
//!
//! The parser of the command line offers similar names; it cannot know that `version` is
//! `--version` here, or that `start` is `run`.

use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue};

/// The word, and what it is here.
const HABITS: [(&str, &str); 23] = [
    ("version", "`rungd --version` prints the version"),
    ("-v", "`rungd --version` prints the version"),
    ("-version", "`rungd --version` prints the version"),
    ("start", "`rungd run CONTROLLER.toml` runs a controller"),
    ("serve", "`rungd run CONTROLLER.toml` runs a controller, `rungd web` shows it in a browser"),
    ("stop", "`rungd mode stop` stops the scans of a running controller"),
    ("restart", "`rungd mode run` starts the scans again, `rungd reload` takes changed files"),
    ("log", "`rungd run` prints its log; a service's: `journalctl -u rungd`"),
    ("logs", "`rungd run` prints its log; a service's: `journalctl -u rungd`"),
    ("lint", "`rungd check FILE.toml` checks files"),
    ("validate", "`rungd check FILE.toml` checks files"),
    ("verify", "`rungd check FILE.toml` checks files, `rungd replay` verifies a recording"),
    ("simulate", "`rungd sim FILE.toml` simulates a ladder"),
    ("format", "`rungd fmt FILE.toml` lays files out"),
    ("new", "`rungd init FOLDER` makes a first project"),
    ("create", "`rungd init FOLDER` makes a first project"),
    ("get", "`rungd read OPERAND` reads a value"),
    ("set", "`rungd write OPERAND VALUE` writes a value"),
    ("info", "`rungd status` prints the state of a running controller"),
    ("ps", "`rungd status` prints the state of a running controller"),
    ("update", "`rungd reload` takes changed files"),
    ("diff", "`rungd reload --dry-run` says what changed files would change"),
    ("tags", "`rungd xref FILE.toml` lists where each tag is used"),
];

/// Adds a tip to an error of the command line, if the word is a habit, or a name that is nearly
/// one of the commands.
pub(super) fn add_tip(error: &mut clap::Error, commands: &[&str]) {
    let word = [ContextKind::InvalidSubcommand, ContextKind::InvalidArg];
    let word = word.iter().find_map(|kind| {
        let Some(ContextValue::String(word)) = error.get(*kind) else { return None };
        Some(word.clone())
    });
    let Some(word) = word else { return };
    let is_option = error.get(ContextKind::InvalidArg).is_some();
    let tip = match HABITS.iter().find(|(habit, _)| *habit == word) {
        Some((_, tip)) => (*tip).to_owned(),
        None if is_option || error.get(ContextKind::SuggestedSubcommand).is_some() => return,
        None => match nearest(&word, commands) {
            Some(name) => format!("`{name}` is a command: `rungd help {name}`"),
            None => "`rungd help` lists the commands".to_owned(),
        },
    };
    error.remove(ContextKind::SuggestedSubcommand);
    error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![StyledStr::from(tip)]));
}

/// The command whose name has the fewest other letters, two at most.
fn nearest<'a>(word: &str, commands: &[&'a str]) -> Option<&'a str> {
    let near = commands.iter().map(|name| (strsim::osa_distance(word, name), *name));
    near.filter(|(distance, _)| *distance <= 2).min().map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;
    use crate::cli::Cli;

    #[test]
    fn every_tip_names_existing_commands_and_no_habit_is_a_command() {
        let cli = Cli::command();
        let is_command =
            |name: &str| cli.get_subcommands().any(|subcommand| subcommand.get_name() == name);
        for (habit, tip) in HABITS {
            assert!(!is_command(habit), "{habit}");
            for named in tip.split("`rungd ").skip(1) {
                let name = named.split([' ', '`']).next().unwrap_or_default();
                assert!(name == "--version" || is_command(name), "{tip}");
            }
        }
    }
}
