//! The search for the controller that a client speaks to, if the user has not named its socket.
//!
//! First the controller that runs in this folder, then the user's only one, then the service's. A
//! socket of a different user is never used unless it is named, or is root's. If several would fit,
//! nothing is chosen. Used by every client of `cli`, `web`, `edge`, `metrics` and `editor`.

use std::env;
use std::fs;
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

use rustix::process::geteuid;

use super::client::{self, CallFailure};
use super::running::{RunningController, running_controllers};
use super::search_failure::{SearchFailure, choice};
use super::{SOCKET_DEFAULT, SOCKET_NAME};

/// The controller that a client speaks to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundController {
    /// Its operator's socket.
    pub socket: PathBuf,
    /// A sentence's part about it; `None` if the user has named the socket.
    about: Option<String>,
}

impl FoundController {
    /// The sentence with which a command that changes something says where: `None` if its user has
    /// named the socket.
    pub fn notice(&self) -> Option<String> {
        let socket = self.socket.display();
        self.about.as_ref().map(|about| format!("to {about} (--socket {socket})"))
    }
}

/// The controller at the named socket; if none is named, the one of the search.
///
/// # Errors
/// None was found, or several.
pub fn found(named: Option<PathBuf>) -> Result<FoundController, CallFailure> {
    if let Some(socket) = named {
        return Ok(FoundController { socket, about: None });
    }
    let folder = env::current_dir().ok();
    let running = running_controllers().into_iter().filter(|one| is_trusted(&one.socket));
    chosen(folder.as_deref(), running.collect()).map_err(CallFailure::NotFound)
}

/// The socket of [`found`].
///
/// # Errors
/// None was found, or several.
pub fn socket(named: Option<PathBuf>) -> Result<PathBuf, CallFailure> {
    found(named).map(|found| found.socket)
}

fn chosen(
    folder: Option<&Path>,
    running: Vec<RunningController>,
) -> Result<FoundController, SearchFailure> {
    let is_here = |one: &RunningController| folder.is_some_and(|folder| one.is_in(folder));
    let (here, elsewhere): (Vec<_>, Vec<_>) = running.into_iter().partition(is_here);
    let mut here: Vec<_> = here.iter().map(|one| listed(one, folder)).collect();
    let beside = Path::new(SOCKET_NAME);
    if is_trusted(beside) && !here.iter().any(|(socket, _)| socket == beside) {
        // Of a controller that is not in the list; or left over from one that was killed. Then it
        // is not passed over in favour of a controller elsewhere.
        if here.is_empty() {
            let about = Some("the controller in this folder".to_owned());
            return Ok(FoundController { socket: beside.into(), about });
        }
        if client::listener(beside).is_ok() {
            here.push((beside.into(), PathBuf::new()));
        }
    }
    match &here[..] {
        [] => {}
        [(socket, file)] => {
            let about = Some(format!("{}, which runs in this folder", file.display()));
            return Ok(FoundController { socket: socket.clone(), about });
        }
        _ => return Err(SearchFailure::Several { in_this_folder: true, running: here }),
    }
    let others: Vec<_> = elsewhere.iter().map(|one| listed(one, folder)).collect();
    match &others[..] {
        [] => service(),
        [(socket, file)] => {
            let about = Some(format!("{}, your only running controller", file.display()));
            Ok(FoundController { socket: socket.clone(), about })
        }
        _ => Err(SearchFailure::Several { in_this_folder: false, running: others }),
    }
}

/// The socket and the controller file of a controller, relative to this folder if they are below
/// it: a socket's path must be short.
fn listed(one: &RunningController, folder: Option<&Path>) -> (PathBuf, PathBuf) {
    let short = |path: &Path| {
        let folder = folder.filter(|folder| folder.parent().is_some());
        let below = folder.and_then(|folder| path.strip_prefix(folder).ok());
        below.unwrap_or(path).to_path_buf()
    };
    (short(&one.socket), short(&one.controller))
}

fn service() -> Result<FoundController, SearchFailure> {
    match fs::symlink_metadata(SOCKET_DEFAULT) {
        Ok(_) => {
            let about = Some("the service's controller".to_owned());
            Ok(FoundController { socket: SOCKET_DEFAULT.into(), about })
        }
        Err(_) => {
            let here = fs::symlink_metadata(SOCKET_NAME);
            let is_foreign_here = here.is_ok_and(|here| here.file_type().is_socket());
            Err(SearchFailure::None { is_foreign_here })
        }
    }
}

/// Whether a socket belongs to the user or to root. In a folder that everybody may write to, a
/// different user could make a socket and receive the commands.
fn is_trusted(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|socket| {
        let owner = socket.uid();
        socket.file_type().is_socket() && (owner == 0 || owner == geteuid().as_raw())
    })
}

/// The controllers of this user that run, for a message about a socket where none answers.
pub fn running_instead() -> Option<String> {
    let folder = env::current_dir().ok();
    let running = running_controllers();
    let listed: Vec<_> = running.iter().map(|one| listed(one, folder.as_deref())).collect();
    (!listed.is_empty()).then(|| format!("rungd: these of yours run:{}", choice(&listed)))
}
