//! `rungd lsp`: the language server. An editor starts it and communicates with it over standard
//! input and output.

use anyhow::Result;
use clap::Args;

use super::exit::Exit;
use rungd_lsp::{self as editor, EditorConnection, EditorEnd};

/// Serves an editor: findings as one types, completion, hover, go to definition, rename
///
/// An editor starts it and uses the Language Server Protocol over standard input and output. It
/// reads the files of the project, and writes none of them. If the editor requests live values, it
/// reads them from the running controller; it never writes to the controller.
#[derive(Args, Debug)]
pub struct LspArgs {
    /// Accepted, because many editors add it; has no effect
    #[arg(long, hide = true)]
    stdio: bool,
}

/// Serves until the editor ends.
///
/// # Errors
/// The editor does not follow the protocol.
pub fn lsp(_args: &LspArgs) -> Result<Exit> {
    let (connection, wire) = EditorConnection::open()?;
    let end = editor::serve(&connection)?;
    // The threads end when the connection is dropped.
    drop(connection);
    wire.close()?;
    Ok(match end {
        EditorEnd::Shutdown => Exit::Ok,
        EditorEnd::Gone => Exit::Refused,
    })
}
