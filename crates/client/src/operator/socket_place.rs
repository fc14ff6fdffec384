//! The places of the operator's socket and of the view socket: what the controller file, the
//! environment and systemd say of them.
//!
//! Called by `daemon::operator_server`, which makes the sockets there, and by clients that know the
//! controller file of their controller. It makes no file.

use std::fs;
use std::path::{Path, PathBuf};

use rustix::fs::{Access, access};
use rustix::io::Errno;
use rustix::process::{Gid, getegid, geteuid, getgroups};

use super::running::users_folder;
use super::{VIEW_GROUP_VARIABLE, socket_of_environment, view_socket_beside};
use rungd_base::directories;
use rungd_config::controller;
use rungd_config::controller::operator::{Operator, ViewSocket};
use rungd_config::load;
use rungd_language::source::finding::Severity;
use rungd_language::source::span::FileId;

/// What a socket is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SocketPurpose {
    /// Looks and changes: the operator's socket.
    Operator,
    /// Looks alone: the view socket.
    View,
}

impl SocketPurpose {
    /// Its name, for the log.
    pub fn name(self) -> &'static str {
        match self {
            SocketPurpose::Operator => "the operator's socket",
            SocketPurpose::View => "the view socket",
        }
    }

    /// The keys of the controller file for its path and its group.
    pub fn keys(self) -> [&'static str; 2] {
        match self {
            SocketPurpose::Operator => ["[operator] socket", "[operator] group"],
            SocketPurpose::View => ["[operator] view-socket", "[operator] view-group"],
        }
    }
}

/// The place of a socket, its group and permissions.
#[derive(Clone, Debug)]
pub struct SocketSpec {
    /// What it is for.
    pub door: SocketPurpose,
    /// Its path.
    pub path: PathBuf,
    /// Its permissions.
    pub mode: u32,
    /// The group it belongs to: a name or a number. `None`: that of the process.
    pub group: Option<String>,
    /// The controller file requires the socket: without it the start fails.
    pub insists: bool,
    /// The controller file's relative path, if the socket has a different place.
    pub instead_of: Option<InsteadOf>,
    /// The controller file.
    pub controller: PathBuf,
}

/// The reason why the socket is not at the controller file's relative path.
#[derive(Clone, Debug)]
pub enum InsteadOf {
    /// A service uses its own place.
    Service(String),
    /// The user may not write beside the controller file.
    ReadOnly(String),
}

/// The operator's socket that a controller file or systemd's environment names.
#[derive(Clone, Debug)]
pub struct SocketPlace {
    /// Its path; `None` if the file wants no socket, or nothing names one.
    pub path: Option<PathBuf>,
    /// False if the file cannot be read or has an error: an error may hide the key that names the
    /// path.
    pub is_certain: bool,
}

/// The operator's socket of a controller file. If the file cannot be read as a controller file,
/// this is the environment's socket: the file's controller may still be running.
pub fn operator_socket(controller: &Path) -> SocketPlace {
    let bytes = load::read_bytes(controller).ok();
    let text = bytes.and_then(|bytes| String::from_utf8(bytes).ok());
    let (written, findings) = controller::read(&text.unwrap_or_default(), FileId(0));
    let written = written.filter(|written| written.lost.is_none());
    let is_whole = written.is_some();
    let asked = written
        .and_then(|written| written.operator)
        .map(|operator| operator.settings)
        .unwrap_or_default();
    // An empty text has an error: it names no ladder.
    let is_certain = is_whole && findings.iter().all(|f| f.severity() != Severity::Error);
    let spec = SocketSpec::of(&asked, &controller.display().to_string());
    SocketPlace { path: spec.map(|spec| spec.path), is_certain }
}

impl SocketSpec {
    /// The place is that of the controller file, else that of the environment or of systemd's
    /// runtime folder. `None` if there is no place, or if the controller file wants no socket. A
    /// relative path applies only to a start by hand: a service, which has a runtime folder, may
    /// not write beside its file. A user who may not write there, as beside an example of a
    /// package, has the socket in the user's own folder.
    pub fn of(asked: &Operator, controller: &str) -> Option<SocketSpec> {
        let systemd = || Some(directories::runtime()?.join("rungd.sock"));
        let is_service = directories::runtime().is_some();
        let gives_way = |path: &&String| is_service && Path::new(path).is_relative();
        let mut instead_of =
            asked.socket.as_ref().filter(gives_way).cloned().map(InsteadOf::Service);
        let path = match &asked.socket {
            Some(path) if instead_of.is_none() => {
                let beside = Path::new(controller).parent().unwrap_or(Path::new("")).join(path);
                let elsewhere = users_place(path, &beside);
                instead_of = elsewhere.is_some().then(|| InsteadOf::ReadOnly(path.clone()));
                Some(elsewhere.unwrap_or(beside))
            }
            Some(_) | None => socket_of_environment().or_else(systemd),
        };
        let (mode, group, insists) = (asked.mode, asked.group.clone(), asked.socket.is_some());
        let path = path.filter(|_| asked.enabled)?;
        let door = SocketPurpose::Operator;
        let controller = PathBuf::from(controller);
        Some(SocketSpec { door, path, mode, group, insists, instead_of, controller })
    }

    /// The view socket: at the place that the controller file names, by the rules of
    /// [`SocketSpec::of`], else beside the operator's socket, which is `self`.
    pub fn view(&self, asked: &Operator, controller: &str) -> SocketSpec {
        let is_service = directories::runtime().is_some();
        let ViewSocket { socket, mode, group } = &asked.view;
        let gives_way = |path: &&String| is_service && Path::new(path).is_relative();
        let instead_of = socket.as_ref().filter(gives_way).cloned().map(InsteadOf::Service);
        let path = match socket {
            Some(path) if instead_of.is_none() => {
                Path::new(controller).parent().unwrap_or(Path::new("")).join(path)
            }
            Some(_) | None => view_socket_beside(&self.path),
        };
        let group = group.clone().or_else(group_of_environment).or_else(|| asked.group.clone());
        let (mode, insists) = (mode.unwrap_or(asked.mode), socket.is_some());
        SocketSpec {
            door: SocketPurpose::View,
            path,
            mode,
            group,
            insists,
            instead_of,
            controller: self.controller.clone(),
        }
    }

    /// Whether the place needs a lock of its own. A view socket that nothing names is beside the
    /// operator's socket, whose lock holds for both.
    pub fn needs_lock(&self) -> bool {
        match self.door {
            SocketPurpose::Operator => true,
            SocketPurpose::View => self.insists,
        }
    }
}

/// The place in the user's own folder of a socket whose relative path is in a folder that the user
/// may not write to; `None` if the user may.
fn users_place(path: &str, beside: &Path) -> Option<PathBuf> {
    let folder = beside.parent().filter(|folder| !folder.as_os_str().is_empty());
    match access(folder.unwrap_or(Path::new(".")), Access::WRITE_OK) {
        Err(Errno::ACCESS | Errno::ROFS) if Path::new(path).is_relative() => {
            let name = Path::new(path).file_stem()?.to_str()?;
            Some(users_folder().ok()?.join(format!("{name}.sock")))
        }
        Ok(()) | Err(_) => None,
    }
}

/// The number of a group that this machine has, or that is a number already.
pub fn known_group(group: &str) -> Option<u32> {
    let known = fs::read_to_string("/etc/group").unwrap_or_default();
    gid_of(&known, group).or_else(|| group.parse().ok()).filter(|gid| *gid != u32::MAX)
}

/// The group of the view socket that the environment names, if this machine has it and this process
/// may give a file to it: the shipped unit and the container image name a group that an
/// administrator may have left out.
fn group_of_environment() -> Option<String> {
    let group = std::env::var(VIEW_GROUP_VARIABLE).ok()?;
    known_group(&group).filter(|gid| may_give_to(*gid)).map(|_| group)
}

fn may_give_to(gid: u32) -> bool {
    let is_it = |group: Gid| group.as_raw() == gid;
    geteuid().is_root()
        || is_it(getegid())
        || getgroups().is_ok_and(|groups| groups.into_iter().any(is_it))
}

/// The number of a group in the text of `/etc/group`.
fn gid_of(group: &str, name: &str) -> Option<u32> {
    let row = group.lines().find(|line| line.split(':').next() == Some(name))?;
    row.split(':').nth(2)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::gid_of;

    #[test]
    fn a_group_name_is_resolved_to_its_number() {
        let group = "root:x:0:\nplant:x:990:anna,ben\nbroken:x\n";
        assert_eq!((gid_of(group, "plant"), gid_of(group, "anna")), (Some(990), None));
        assert_eq!(gid_of(group, "broken"), None);
    }
}
