//! The targets of the live view: the projects of the ladders that the editor shows, and the
//! operands that these ladders name.
//!
//! Called by `server` after each change while the view is on.

use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;

use super::file::NumberedFile;
use super::live_poller::LiveTarget;
use super::operands::{NamingValue, named, values, words};
use super::project::{Project, named_files};
use super::slots::FileKind;
use super::workspace::Workspace;

/// The maximum number of operands of a project that are read; the visible operands come first.
const OPERANDS_MAX: usize = 1000;

/// The targets; none while the view is off.
pub(super) fn targets(workspace: &Workspace) -> Vec<LiveTarget> {
    if !workspace.live.is_on() {
        return Vec::new();
    }
    let mut shown: Vec<&PathBuf> = workspace.library.shown().collect();
    shown.sort_unstable();
    let mut targets: Vec<LiveTarget> = Vec::new();
    for path in shown {
        let Some(project) = workspace.project(path) else { continue };
        let Some(number) = project.number(path) else { continue };
        if project.files[number].kind != FileKind::Ladder {
            continue;
        }
        let known = targets.iter().position(|target| target.root == project.root);
        let at = known.unwrap_or_else(|| {
            let (root, texts) = (project.root.clone(), texts(workspace, &project));
            targets.push(LiveTarget { root, texts, operands: Vec::new() });
            targets.len() - 1
        });
        operands(&project, number, workspace.live.visible(path), &mut targets[at].operands);
    }
    targets
}

/// The texts of a project's ladders, in the order of its controller file.
fn texts(workspace: &Workspace, project: &Project) -> Vec<Arc<str>> {
    let root = &project.files[0];
    let paths = match root.kind {
        FileKind::Controller => named_files(root),
        FileKind::Ladder | FileKind::Test => vec![root.path.clone()],
    };
    let files = paths.iter().filter_map(|path| workspace.library.file(path));
    files.map(|file| file.text.clone()).collect()
}

/// Adds the operands of the file with a number: first those from a byte on, then those before that
/// byte.
fn operands(project: &Project, number: usize, from: usize, all: &mut Vec<String>) {
    let file = &project.files[number];
    let mut known: HashSet<String> = all.iter().cloned().collect();
    let behind = values(file, from);
    let before = values(file, 0).take_while(|naming| naming.value.span.end < from);
    for NamingValue { value, .. } in behind.chain(before) {
        for word in words(file, value) {
            if all.len() == OPERANDS_MAX {
                return;
            }
            let Some(word) = named(project, NumberedFile { number, file }, word) else { continue };
            if known.insert(word.operand.clone()) {
                all.push(word.operand);
            }
        }
    }
}
