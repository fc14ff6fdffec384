//! `rungd completions`: what a shell reads to complete rungd's command lines.
//!
//! The scripts ask rungd itself, by the environment variable `COMPLETE`, while a line is typed: so
//! that a running controller's tags can be completed too. `cli::run` answers.

use std::io::Write;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use clap_complete::env::Shells;

use super::exit::Exit;

/// Prints what a shell reads to complete rungd's command lines
#[derive(Args, Debug)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Shell {
    Bash,
    Elvish,
    Fish,
    Powershell,
    Zsh,
}

/// What the scripts set when they ask.
const VARIABLE: &str = "COMPLETE";

/// zsh loads the file when it first completes a line, and that line is to be completed as well.
const ZSH_FIRST_TIME: &str = "
if [[ $funcstack[1] == _rungd ]]; then
    _clap_dynamic_completer_rungd \"$@\"
fi
";

/// Prints the completions.
///
/// # Errors
/// Standard output cannot be written.
pub fn completions(args: &CompletionsArgs) -> Result<Exit> {
    let value = args.shell.to_possible_value().context("a shell has a name")?;
    let shells = Shells::builtins();
    let shell = shells.completer(value.get_name()).context("a shell that is known")?;
    let mut text = Vec::new();
    shell.write_registration(VARIABLE, "rungd", "rungd", "rungd", &mut text)?;
    if matches!(args.shell, Shell::Zsh) {
        text.extend(ZSH_FIRST_TIME.bytes());
    }
    std::io::stdout().lock().write_all(&text)?;
    Ok(Exit::Ok)
}
