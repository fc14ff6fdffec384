//! `rungd completions`: prints the script that a shell uses to complete rungd's command lines.
//!
//! The script calls `rungd` at each completion, so that tags and addresses of the running ladder
//! are completed too.

use std::io::Write;

use anyhow::{Context, Result};
use clap::Args;
use clap_complete::Shell;
use clap_complete::env::Shells;

use super::exit::Exit;

/// The environment variable that a script sets when it calls `rungd`; the same as in `CompleteEnv`.
const VARIABLE: &str = "COMPLETE";

/// zsh loads the file only at the first completion. This call also completes that first line.
const ZSH_FIRST_TIME: &str = "
if [[ $funcstack[1] == _rungd ]]; then
    _clap_dynamic_completer_rungd \"$@\"
fi
";

/// Prints the completions for a shell; docs/install.md has the place of the file for each shell
#[derive(Args, Debug)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

/// Prints the completions.
///
/// # Errors
/// Standard output cannot be written.
pub fn completions(args: &CompletionsArgs) -> Result<Exit> {
    let name = args.shell.to_string();
    let shells = Shells::builtins();
    let shell = shells.completer(&name).context("this shell completes nothing")?;
    let mut text = Vec::new();
    shell.write_registration(VARIABLE, "rungd", "rungd", "rungd", &mut text)?;
    if args.shell == Shell::Zsh {
        text.extend(ZSH_FIRST_TIME.bytes());
    }
    std::io::stdout().lock().write_all(&text)?;
    Ok(Exit::Ok)
}
