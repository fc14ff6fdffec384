//! The state of the server: the open files, their projects, the last judgement of each root.
//!
//! `server` changes it; every answer (`hover`, `complete`, …) reads it. Its only I/O is reading
//! files; it uses no channel.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lsp_types::{ClientCapabilities, Location, Position, TextDocumentPositionParams, Uri};
use serde_json::Value;

use super::complete::proposal::ItemAbilities;
use super::file::{EditorFile, NumberedFile};
use super::jobs::Jobs;
use super::judge::{JudgedRoot, Judgement};
use super::lines::ColumnUnit;
use super::live_view::EditorLiveView;
use super::outbox::Outbox;
use super::project::{Library, Project, is_library};
use super::slots::FileKind;
#[cfg(feature = "prove")]
use super::survey_hints::Surveys;
use super::test_results::TestResults;
use super::uri::{path_of, uri_of};
use super::words::FileWord;

use rungd_base::locked::locked;

/// The state of the server.
#[derive(Debug)]
pub(super) struct Workspace {
    /// The capabilities of the editor.
    pub client: ClientCapabilities,
    /// The files.
    pub library: Library,
    /// The number of the last change.
    pub change: u64,
    /// The versions that the editor gave its open files.
    pub versions: HashMap<PathBuf, i32>,
    /// The last judgement of each root.
    pub judged: BTreeMap<JudgedRoot, Judgement>,
    /// The capabilities of the editor for completion items.
    pub can: ItemAbilities,
    /// The live view.
    pub live: EditorLiveView,
    /// The results of tests.
    pub tests: TestResults,
    /// The hints of surveys.
    #[cfg(feature = "prove")]
    pub surveys: Surveys,
    /// The jobs that commands have started.
    pub jobs: Jobs,
    /// The messages to the editor.
    pub outbox: Outbox,
    /// The projects since the last change, by file.
    projects: Mutex<HashMap<PathBuf, Arc<Project>>>,
}

/// A place in a file of a project.
#[derive(Debug)]
pub(super) struct Cursor {
    /// The project.
    pub project: Arc<Project>,
    /// The number of the file.
    pub number: usize,
    /// The byte.
    pub offset: usize,
}

impl Cursor {
    /// Its file.
    pub fn file(&self) -> &EditorFile {
        &self.project.files[self.number]
    }

    /// The file with its number.
    pub fn numbered(&self) -> NumberedFile<'_> {
        NumberedFile { number: self.number, file: self.file() }
    }

    /// The word around the cursor, or directly before it.
    pub fn word(&self) -> Option<&FileWord> {
        self.file().words.at(self.offset)
    }
}

impl Workspace {
    /// A workspace without files.
    pub fn new(columns: ColumnUnit, jobs: Jobs, outbox: Outbox) -> Workspace {
        Workspace {
            client: ClientCapabilities::default(),
            library: Library::new(columns),
            change: 0,
            versions: HashMap::new(),
            judged: BTreeMap::new(),
            can: ItemAbilities::default(),
            live: EditorLiveView::default(),
            tests: TestResults::default(),
            #[cfg(feature = "prove")]
            surveys: Surveys::default(),
            jobs,
            outbox,
            projects: Mutex::default(),
        }
    }

    /// Counts a change, and drops all data that was derived from files.
    pub fn changed(&mut self) {
        self.change += 1;
        self.projects.get_mut().unwrap_or_else(PoisonError::into_inner).clear();
        self.live.changed();
        self.library.changed();
        let library = &self.library;
        self.tests.keep(|path| Some(library.file(path)?.text.clone()));
        #[cfg(feature = "prove")]
        self.surveys.keep(|path| Some(library.file(path)?.text.clone()));
        self.jobs.keep(|path| Some(library.file(path)?.text.clone()));
    }

    /// Applies the user's settings.
    pub fn configure(&mut self, settings: &Value) {
        self.live.configure(settings, &mut self.outbox);
    }

    /// The project of a file. The files of one project share it, because it is as large as all of
    /// them together.
    pub fn project(&self, path: &Path) -> Option<Arc<Project>> {
        if let Some(known) = self.known().get(path) {
            return Some(known.clone());
        }
        let root = self.library.root(path)?;
        // Tests may name each other in a circle.
        let is_test = self.library.file(&root).is_none_or(|file| file.kind == FileKind::Test);
        let of_root = if is_test || root == path { None } else { self.project(&root) };
        let shared =
            of_root.filter(|project| project.root == root && self.library.is_of(path, project));
        let project = match shared {
            Some(shared) => shared,
            None => Arc::new(self.library.project(path)?),
        };
        self.known().insert(path.to_owned(), project.clone());
        Some(project)
    }

    fn known(&self) -> MutexGuard<'_, HashMap<PathBuf, Arc<Project>>> {
        locked(&self.projects)
    }

    /// The cursor of a request.
    pub fn cursor(&self, position: &TextDocumentPositionParams) -> Option<Cursor> {
        self.cursor_at(&position.text_document.uri, position.position)
    }

    /// The cursor at a position in a file.
    pub fn cursor_at(&self, uri: &Uri, position: Position) -> Option<Cursor> {
        let path = path_of(uri)?;
        let project = self.project(&path)?;
        let number = project.number(&path)?;
        let offset = project.files[number].offset(position);
        Some(Cursor { project, number, offset })
    }

    /// The file of a request.
    pub fn file(&self, uri: &Uri) -> Option<Arc<EditorFile>> {
        self.library.file(&path_of(uri)?)
    }

    /// The roots to judge for an open file; none for a file of a different program. No `Names` are
    /// computed here, because that work would slow down a judgement that runs at the same time.
    pub fn roots_of(&self, path: &Path) -> Vec<JudgedRoot> {
        let root = self.library.root(path).and_then(|root| self.library.file(&root));
        let Some((file, root)) = self.library.file(path).zip(root) else { return Vec::new() };
        let is_judged = match root.kind {
            FileKind::Controller => true,
            FileKind::Ladder => !is_library(&root.path) && !FileKind::is_of_others(&root.outline),
            // The test names no file that can be read.
            FileKind::Test => false,
        };
        let is_test = file.kind == FileKind::Test;
        let of_test = is_test.then(|| JudgedRoot::Test(path.to_owned()));
        // A plant's ladder is judged with its controller file, which knows what its map moves.
        let beside = || match root.kind {
            FileKind::Ladder => self.library.controller_beside(&root.path),
            FileKind::Controller | FileKind::Test => None,
        };
        let of_project = is_judged.then(|| match beside() {
            Some(controller) => JudgedRoot::Controller(controller),
            None => JudgedRoot::of_root(&root),
        });
        of_test.into_iter().chain(of_project).collect()
    }

    /// All roots to judge now.
    pub fn roots(&self) -> Vec<JudgedRoot> {
        let shown: Vec<PathBuf> = self.library.shown().cloned().collect();
        let mut roots: Vec<JudgedRoot> = shown.iter().flat_map(|at| self.roots_of(at)).collect();
        roots.sort_unstable();
        roots.dedup();
        roots
    }
}

/// A place in the form of the protocol; `None` for a file of the library.
pub(super) fn location(file: &EditorFile, range: Range<usize>) -> Option<Location> {
    Some(Location::new(uri_of(&file.path)?, file.place(range)))
}
