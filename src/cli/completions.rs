//! `rungd completions`: what a shell reads to complete rungd's command lines.

use std::io::Write;

use anyhow::Result;
use clap::Args;
use clap_complete::Shell;

use super::exit::Exit;

/// Prints the completions for a shell; the page docs/install.md says where each wants them
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
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut super::command(), "rungd", &mut text);
    std::io::stdout().lock().write_all(&text)?;
    Ok(Exit::Ok)
}
