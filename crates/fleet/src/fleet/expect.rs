//! The ladders that should run according to a folder: a git checkout with a folder for each node.
//!
//! The file of a node is `DIR/GROUP/NODE/controller.toml` or `DIR/NODE/controller.toml`. The hash
//! is the one that the log and `rungd status` have for a ladder: the SHA-256 of the concatenated
//! texts of the ladder files. The names of nodes come from a broker: no name can lead out of the
//! folder.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use serde::Serialize;

use super::heard::NodeName;
use rungd_config::load::{self, sha256_of};
use rungd_language::source::finding::Severity;

/// The file of a node.
const CONTROLLER_FILE: &str = "controller.toml";

/// A folder of controller files.
#[derive(Debug)]
pub struct ExpectedLadders {
    folder: PathBuf,
    hashes: BTreeMap<PathBuf, Result<String, String>>,
}

/// How the ladder of a node compares with the folder's.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "verdict", rename_all = "kebab-case")]
pub enum LadderVerdict {
    /// The node runs the ladder of the folder.
    Same {
        /// The folder's file.
        file: String,
    },
    /// The node runs a different ladder.
    Differs {
        /// The folder's file.
        file: String,
        /// Its hash.
        expected: String,
    },
    /// The folder has no file for the node.
    Unlisted,
    /// The folder's file cannot be read, or has errors.
    Unreadable {
        /// The folder's file.
        file: String,
        /// The reason.
        why: String,
    },
    /// The ladder of the node is not known.
    Untold {
        /// The folder's file.
        file: String,
    },
    /// The folder has a file, but no message came from the node.
    Missing {
        /// The folder's file.
        file: String,
    },
}

impl LadderVerdict {
    /// Whether the node runs the ladder of the folder.
    pub fn is_same(&self) -> bool {
        match self {
            LadderVerdict::Same { .. } => true,
            LadderVerdict::Differs { .. }
            | LadderVerdict::Unlisted
            | LadderVerdict::Unreadable { .. }
            | LadderVerdict::Untold { .. }
            | LadderVerdict::Missing { .. } => false,
        }
    }
}

impl ExpectedLadders {
    /// The ladders of a folder.
    ///
    /// # Errors
    /// The folder cannot be listed, or has no file of a node and so nothing to compare with.
    pub fn of(folder: &Path) -> Result<ExpectedLadders> {
        let place = folder.display();
        fs::read_dir(folder).with_context(|| {
            format!(
                "{place} cannot be listed: name a folder, a checkout of git, with \
                 {place}/GROUP/NODE/{CONTROLLER_FILE} or {place}/NODE/{CONTROLLER_FILE}"
            )
        })?;
        let expected = ExpectedLadders { folder: folder.to_owned(), hashes: BTreeMap::new() };
        if expected.missing(&[]).is_empty() {
            bail!(
                "{place} has no file of a node: it should have {place}/GROUP/NODE/\
                 {CONTROLLER_FILE} or {place}/NODE/{CONTROLLER_FILE}"
            );
        }
        Ok(expected)
    }

    /// Compares the ladder of a node.
    pub fn judge(&mut self, node: &NodeName, runs: Option<&str>) -> LadderVerdict {
        let Some(path) = self.file(node) else { return LadderVerdict::Unlisted };
        let file = path.display().to_string();
        let expected = self.hashes.entry(path.clone()).or_insert_with(|| hash(&path)).clone();
        match (expected, runs) {
            (Err(why), _) => LadderVerdict::Unreadable { file, why },
            (Ok(_), None) => LadderVerdict::Untold { file },
            (Ok(expected), Some(runs)) if expected == runs => LadderVerdict::Same { file },
            (Ok(expected), Some(_)) => LadderVerdict::Differs { file, expected },
        }
    }

    /// The files whose nodes are not in `heard`: the group, if the path has one, the node, and the
    /// verdict.
    pub fn missing(&self, heard: &[NodeName]) -> Vec<(Option<String>, String, LadderVerdict)> {
        let judged: BTreeSet<PathBuf> = heard.iter().filter_map(|node| self.file(node)).collect();
        let is_file = |path: &PathBuf| path.is_file();
        let mut missing = Vec::new();
        for (name, folder) in folders(&self.folder) {
            let own = Some(folder.join(CONTROLLER_FILE)).filter(is_file);
            let own = own.map(|file| (None, name.clone(), file));
            let inner = folders(&folder)
                .into_iter()
                .map(|(node, folder)| (Some(name.clone()), node, folder.join(CONTROLLER_FILE)));
            let all = own.into_iter().chain(inner.filter(|(.., file)| is_file(file)));
            missing.extend(all.filter(|(.., file)| !judged.contains(file)));
        }
        let told = |(group, node, file): (Option<String>, String, PathBuf)| {
            (group, node, LadderVerdict::Missing { file: file.display().to_string() })
        };
        missing.into_iter().map(told).collect()
    }

    /// The file of a node, if it exists; the folder of its group comes first.
    fn file(&self, node: &NodeName) -> Option<PathBuf> {
        if !is_folder_name(&node.node) {
            return None;
        }
        let in_group = is_folder_name(&node.group)
            .then(|| self.folder.join(&node.group).join(&node.node).join(CONTROLLER_FILE));
        let alone = self.folder.join(&node.node).join(CONTROLLER_FILE);
        in_group.into_iter().chain([alone]).find(|path| path.is_file())
    }
}

/// Whether the name of a node can be the name of a single folder.
fn is_folder_name(name: &str) -> bool {
    !matches!(name, "" | "." | "..") && !name.contains(['/', '\\', '\0'])
}

/// The folders in a folder. Folders whose names begin with a dot are not for nodes.
fn folders(folder: &Path) -> Vec<(String, PathBuf)> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let named = entries.filter_map(|entry| Some((entry.file_name().into_string().ok()?, entry)));
    let paths = named.map(|(name, entry)| (name, entry.path()));
    let mut found: Vec<(String, PathBuf)> =
        paths.filter(|(name, path)| !name.starts_with('.') && path.is_dir()).collect();
    found.sort();
    found
}

/// The hash of the ladder of a controller file.
fn hash(path: &Path) -> Result<String, String> {
    let loaded = load::controller_file(path).map_err(|failure| format!("{failure:#}"))?;
    let errors = loaded.findings.iter().filter(|found| found.severity() == Severity::Error);
    match errors.count() {
        0 => Ok(sha256_of(loaded.files.iter().skip(1).map(|file| file.text.as_str()))),
        1 => Err("it has an error: `rungd check` shows it".to_owned()),
        count => Err(format!("it has {count} errors: `rungd check` shows them")),
    }
}
