//! The reasons why the search for a controller chose none, and what to do then.
//!
//! Made by `search`, and passed on by `client` as one of its failures.

use std::fmt;
use std::path::{Path, PathBuf};

use super::{SOCKET_DEFAULT, SOCKET_NAME};
use rungd_language::source::wording::escaped;

/// The most controllers that a message lists.
const LISTED_MAX: usize = 6;

/// The reason why no controller was chosen.
#[derive(Clone, Debug)]
pub enum SearchFailure {
    /// None runs, as far as it can be seen.
    None {
        /// In this folder is a socket of a different user.
        is_foreign_here: bool,
    },
    /// Several would fit: those of this folder, or of this user.
    Several {
        /// Whether they run in this folder.
        in_this_folder: bool,
        /// For each of them, the socket and the controller file.
        running: Vec<(PathBuf, PathBuf)>,
    },
}

/// The lines about controllers among which a user can choose.
pub(crate) fn choice(running: &[(PathBuf, PathBuf)]) -> String {
    let line = |(socket, file): &(PathBuf, PathBuf)| {
        let socket = socket.as_path();
        let file =
            if file.as_os_str().is_empty() { Path::new("not in the list") } else { file.as_path() };
        let [socket, file] = [socket, file].map(|path| path.display().to_string());
        format!("\n  --socket {}  ({})", escaped(&socket), escaped(&file))
    };
    let mut text: String = running.iter().take(LISTED_MAX).map(line).collect();
    if let Some(more @ 1..) = running.len().checked_sub(LISTED_MAX) {
        text += &format!("\n  and {more} more");
    }
    text
}

impl fmt::Display for SearchFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SearchFailure::None { is_foreign_here } => {
                write!(
                    f,
                    "no controller of yours runs, and no rungd answers at {SOCKET_DEFAULT}\n  \
                     start one: `rungd init press`, then `rungd run press/controller.toml`\n"
                )?;
                match is_foreign_here {
                    true => write!(
                        f,
                        "  or say `--socket {SOCKET_NAME}`: this folder's is a different user's"
                    ),
                    false => f.write_str(
                        "  or name one that runs: `--socket PATH`, as its log says \
                         (operator-listens)",
                    ),
                }
            }
            SearchFailure::Several { in_this_folder, running } => {
                let place = if *in_this_folder { "in this folder" } else { "as your user" };
                let count = running.len();
                write!(f, "{count} controllers run {place}; choose one:{}", choice(running))
            }
        }
    }
}
