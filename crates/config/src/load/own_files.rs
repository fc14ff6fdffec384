//! Checks that neither the file of retentive memory nor a socket for operators is one of the
//! controller's other files.
//!
//! Called by `load` with the controller file's settings. Without this check, a start would rename a
//! ladder file and make a memory file in its place. This module does not check whether the files
//! can be made.

use std::path::Path;

use super::files::identity;
use crate::controller::written::WrittenController;
use rungd_base::progress::{LoadStep, Progress};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::pair;
use rungd_language::source::span::{Located, Span};

/// A file that the controller already uses.
struct OtherFile {
    what: &'static str,
    /// The place in the controller file that names it.
    named: Option<Span>,
}

/// The findings about a memory file or a socket that would replace a different file of the
/// controller.
pub(super) fn findings(
    controller: &Path,
    written: &WrittenController,
    progress: &Progress,
) -> Vec<Finding> {
    let memory = written.retain.file.as_ref();
    let operator = written.operator.as_ref();
    let socket = operator.and_then(|operator| operator.socket.as_ref());
    let view = operator.and_then(|operator| operator.view_socket.as_ref());
    let beside = |name: &str| {
        let path = controller.parent().unwrap_or(Path::new("")).join(name);
        progress.begin(LoadStep::Reading(path.display().to_string()));
        identity(&path)
    };
    let input = |own: &Located<String>| {
        let own = beside(&own.value);
        if own == identity(controller) {
            return Some(OtherFile { what: "this controller file", named: None });
        }
        let mut ladders = progress.during(written.all_ladders());
        let ladder = ladders.find(|name| beside(&name.text) == own)?;
        Some(OtherFile { what: "a ladder file", named: Some(ladder.span) })
    };
    let mut findings = Vec::new();
    if let Some(memory) = memory {
        let sockets = [(socket, "the operator's socket"), (view, "the view socket")];
        let socket = sockets.iter().find_map(|(socket, what)| {
            let socket = socket.filter(|socket| beside(&socket.value) == beside(&memory.value))?;
            Some(OtherFile { what, named: Some(socket.span) })
        });
        let other = input(memory).or(socket);
        let file = || pair("file = \"/var/lib/rungd/memory\"");
        findings.extend(other.map(|other| finding(memory, &other, "memory").propose(file())));
    }
    if let Some(socket) = socket {
        let path = || pair("socket = \"rungd.sock\"");
        let other = input(socket);
        findings.extend(other.map(|other| finding(socket, &other, "a socket").propose(path())));
    }
    if let Some(view) = view {
        let same = socket.filter(|socket| beside(&socket.value) == beside(&view.value));
        let same = same
            .map(|socket| OtherFile { what: "the operator's socket", named: Some(socket.span) });
        let path = || pair("view-socket = \"rungd-view.sock\"");
        let other = input(view).or(same);
        findings.extend(other.map(|other| finding(view, &other, "a socket").propose(path())));
    }
    findings
}

fn finding(own: &Located<String>, other: &OtherFile, what: &str) -> Finding {
    let message = format!("`{}` is {}: {what} needs a file of its own", own.value, other.what);
    let finding = Finding::new(Code::Controller, own.span, message);
    match other.named {
        Some(named) => finding.related(named, "named here"),
        None => finding,
    }
}
