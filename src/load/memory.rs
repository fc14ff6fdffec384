//! Checks that the file of retentive memory is none of the controller's other files.
//!
//! Called by `load` with the controller file's settings. Without this check, a start would move a
//! ladder file aside and put memory in its place. Whether the file can be made is not checked.

use std::path::{Path, PathBuf};

use crate::controller::written::WrittenController;
use crate::source::finding::{Code, Finding};

/// A finding if memory would take the place of a controller's other file.
pub(super) fn finding(controller: &Path, written: &WrittenController) -> Option<Finding> {
    let file = written.retain.file.as_ref()?;
    let beside = |name: &str| controller.parent().unwrap_or(Path::new("")).join(name);
    let memory = place(&beside(&file.text));
    let finding = |what: &str| {
        let message = format!("`{}` is {what}: memory has a file of its own", file.text);
        let finding = Finding::new(Code::Controller, file.span, message);
        finding.help("write `file = \"/var/lib/rungd/memory\"`")
    };
    if memory == place(controller) {
        return Some(finding("this controller file"));
    }
    if let Some(ladder) = written.ladder.iter().find(|name| place(&beside(&name.text)) == memory) {
        return Some(finding("a ladder file").related(ladder.span, "named here"));
    }
    let socket = written.operator.as_ref()?.socket.as_ref()?;
    (place(&beside(&socket.text)) == memory)
        .then(|| finding("the operator's socket").related(socket.span, "named here"))
}

/// The identity of a file, also of a file that does not exist yet.
fn place(path: &Path) -> PathBuf {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let folder = parent.unwrap_or(Path::new(".")).canonicalize();
    let made = || Some(folder.ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(made).unwrap_or_else(|| path.to_owned())
}
