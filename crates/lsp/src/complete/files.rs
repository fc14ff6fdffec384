//! Proposals of files: in the folder of the present file and the folders below it, in some cases in
//! the folder above it, and in the library.

use std::path::Path;

use lsp_types::CompletionItemKind;

use super::proposal::{CompletionProposal, Proposals};
use super::scene::CompletionScene;
use crate::slots::FileKind;
use rungd_config::load::library;
use rungd_language::source::file_kind::LIBRARY;

/// The maximum number of entries of a folder that are read.
const ENTRIES_MAX: usize = 500;
/// The maximum number of folders in a folder that are read.
const FOLDERS_MAX: usize = 20;
/// The maximum number of files whose content is read.
const FILES_MAX: usize = 60;

/// The files of the kind that the key requires.
pub(super) fn offer(scene: &CompletionScene, typed: &str) -> Proposals {
    let mut found = Proposals::of(typed);
    found.signs = "-_./:";
    let wanted = match scene.site.keys.last().map(String::as_str) {
        Some("controller") => FileKind::Controller,
        Some(_) | None => FileKind::Ladder,
    };
    let others = scene.other_values(&scene.keys());
    let folder = scene.file.path.parent().unwrap_or(Path::new(""));
    let mut names = Vec::new();
    below(folder, "", &mut names, true);
    // Tests in a folder `tests` name files beside that folder.
    if typed.starts_with("..") || folder.file_name().is_some_and(|name| name == "tests") {
        below(&folder.join(".."), "../", &mut names, true);
    }
    names.truncate(FILES_MAX);
    for (order, name) in names.iter().filter(|name| !others.contains(&name.as_str())).enumerate() {
        let path = rungd_config::load::identity(&folder.join(name));
        let is_wanted = path != scene.file.path
            && scene.library.file(&path).is_some_and(|file| file.kind == wanted);
        if found.fits(name) && is_wanted {
            let mut proposal = CompletionProposal::new(name, CompletionItemKind::FILE, 0);
            proposal.order = order;
            found.add(proposal);
        }
    }
    if wanted == FileKind::Ladder {
        for file in library::FILES {
            let name = format!("{LIBRARY}{}", file.name);
            if !others.contains(&name.as_str()) {
                let proposal = CompletionProposal::new(name, CompletionItemKind::FILE, 1);
                found.add(proposal.detail("library").doc(file.head().0));
            }
        }
    }
    found
}

/// Collects the ladders and controller files of a folder and, if `deeper`, of the folders in it.
fn below(folder: &Path, before: &str, names: &mut Vec<String>, deeper: bool) {
    let entries = std::fs::read_dir(folder).into_iter().flatten().take(ENTRIES_MAX).flatten();
    let mut entries: Vec<_> = entries.collect();
    entries.sort_by_key(std::fs::DirEntry::file_name);
    let mut folders = Vec::new();
    for entry in entries {
        let Ok(name) = entry.file_name().into_string() else { continue };
        match entry.file_type() {
            Ok(kind) if kind.is_dir() && !name.starts_with('.') => folders.push((entry, name)),
            Ok(kind) if kind.is_file() => {
                let is_test = name.ends_with(".test.toml");
                names.extend(
                    (name.ends_with(".toml") && !is_test).then(|| before.to_owned() + &name),
                );
            }
            Ok(_) | Err(_) => {}
        }
    }
    for (entry, name) in folders.into_iter().take(if deeper { FOLDERS_MAX } else { 0 }) {
        below(&entry.path(), &format!("{before}{name}/"), names, false);
    }
}
