//! The files that belong together: a controller file, its ladders and their tests; a ladder that
//! no controller file names; a test and what it names.
//!
//! `workspace` asks for the project of a file. A project is what one command judges: `rungd check`
//! of its controller file or its ladder.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use super::file::EditorFile;
use super::lines::Columns;
use super::names::Names;
use super::slots::FileKind;
use crate::load::{OpenTexts, identity, library};
use crate::source::file_kind::LIBRARY;

/// The most folders above a ladder in which its controller file is searched.
const FOLDERS_MAX: usize = 4;
/// The most TOML files of a folder that are looked at.
const FILES_MAX: usize = 500;

/// The texts of files: those that the editor has open, else those on disk.
#[derive(Debug, Default)]
pub(super) struct Library {
    open: HashMap<PathBuf, Arc<EditorFile>>,
    /// Files that are not open, with the time of their last change and their size.
    read: Mutex<HashMap<PathBuf, ReadFile>>,
    columns: Columns,
}

/// A file on disk, as it was when it was read.
#[derive(Clone, Debug)]
struct ReadFile {
    stamp: (Option<std::time::SystemTime>, u64),
    file: Arc<EditorFile>,
}

/// The files of a project, and their names.
#[derive(Debug)]
pub(super) struct Project {
    /// What `rungd check` is given: the controller file, or the ladder.
    pub root: PathBuf,
    /// The root, the ladders in the order of the controller file, the tests.
    pub files: Vec<Arc<EditorFile>>,
    /// What their names stand for.
    pub names: Names,
}

impl Library {
    /// Without open files.
    pub fn new(columns: Columns) -> Library {
        Library { columns, ..Library::default() }
    }

    /// How positions count.
    pub fn columns(&self) -> Columns {
        self.columns
    }

    /// The editor shows this text of a file from now on.
    pub fn open(&mut self, path: &Path, text: Arc<str>) {
        let file = Arc::new(EditorFile::new(path, text, self.columns));
        self.open.insert(path.to_owned(), file);
    }

    /// The editor shows a file no more.
    pub fn close(&mut self, path: &Path) {
        self.open.remove(path);
    }

    /// The paths of the files that the editor shows.
    pub fn shown(&self) -> impl Iterator<Item = &PathBuf> {
        self.open.keys()
    }

    /// Whether the editor shows a file.
    pub fn is_open(&self, path: &Path) -> bool {
        self.open.contains_key(path)
    }

    /// The texts that the editor shows.
    pub fn texts(&self) -> OpenTexts {
        OpenTexts::new(self.open_texts())
    }

    /// The same, with another text of one file.
    pub fn texts_with(&self, path: &Path, text: &Arc<str>) -> OpenTexts {
        OpenTexts::new(self.open_texts().chain([(path.to_owned(), text.clone())]))
    }

    /// The same, each with its path.
    pub fn open_texts(&self) -> impl Iterator<Item = (PathBuf, Arc<str>)> {
        self.open.iter().map(|(path, file)| (path.clone(), file.text.clone()))
    }

    /// A file, by its identity, or by its name in the library; `None` if it cannot be read.
    pub fn file(&self, path: &Path) -> Option<Arc<EditorFile>> {
        if let Some(file) = self.open.get(path) {
            return Some(file.clone());
        }
        let named = path.to_str().and_then(library::named);
        let stamp = match named {
            Some(_) => (None, 0),
            None => {
                let about = std::fs::metadata(path).ok()?;
                (about.modified().ok(), about.len())
            }
        };
        let mut read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = read.get(path).filter(|known| known.stamp == stamp) {
            return Some(known.file.clone());
        }
        let text: Arc<str> = match named {
            Some(file) => Arc::from(file.ok()?.text),
            None => {
                let bytes = OpenTexts::default().read(path).ok()?;
                Arc::from(String::from_utf8_lossy(&bytes))
            }
        };
        let file = Arc::new(EditorFile::new(path, text, self.columns));
        read.insert(path.to_owned(), ReadFile { stamp, file: file.clone() });
        Some(file)
    }

    /// The project of a file.
    pub fn project(&self, path: &Path) -> Option<Project> {
        let file = self.file(path)?;
        let root = match file.kind {
            FileKind::Controller => path.to_owned(),
            FileKind::Ladder => self.controller_of(path).unwrap_or_else(|| path.to_owned()),
            FileKind::Test => {
                // A test that is being begun names nothing yet.
                let tested = self.tested(&file).filter(|root| self.file(root).is_some());
                tested.unwrap_or_else(|| path.to_owned())
            }
        };
        let root_file = self.file(&root)?;
        let mut files = vec![root_file.clone()];
        self.add(&mut files, named_files(&root_file));
        // The library is everybody's: to name it makes no project.
        let own = files.iter().map(|file| file.path.clone());
        let of_root: Vec<PathBuf> = own.filter(|path| !is_library(path)).collect();
        if file.kind == FileKind::Test {
            self.add(&mut files, named_files(&file));
        }
        // Other controller files with the same ladders name the same tags, and have tests.
        let others = self.naming(&of_root);
        self.add(&mut files, others.clone());
        let tests = self.tests(&[of_root, others].concat());
        self.add(&mut files, tests);
        self.add(&mut files, vec![path.to_owned()]);
        let names = Names::of(&files);
        Some(Project { root, files, names })
    }

    fn add(&self, files: &mut Vec<Arc<EditorFile>>, paths: Vec<PathBuf>) {
        for path in paths {
            if !files.iter().any(|file| file.path == path) {
                files.extend(self.file(&path));
            }
        }
    }

    /// What a test tests: the root of that project.
    fn tested(&self, test: &EditorFile) -> Option<PathBuf> {
        let named = named_files(test);
        let first = named.iter().find(|path| !is_library(path)).or(named.first())?;
        let file = self.file(first);
        match file.is_some_and(|file| file.kind == FileKind::Controller) {
            true => Some(first.clone()),
            false => Some(self.controller_of(first).unwrap_or_else(|| first.clone())),
        }
    }

    /// The controller file that names a ladder: in its folder, or in one above it; of several the
    /// one that the editor shows, else the first.
    fn controller_of(&self, ladder: &Path) -> Option<PathBuf> {
        let ladders = [ladder.to_owned()];
        let names = |path: &PathBuf| self.names(path, FileKind::Controller, &ladders);
        let folders = ladder.ancestors().skip(1).take(FOLDERS_MAX);
        let mut naming = folders.flat_map(|folder| self.toml_files(folder, false)).filter(names);
        let first = naming.next()?;
        let open = [first.clone()].into_iter().chain(naming).find(|path| self.is_open(path));
        Some(open.unwrap_or(first))
    }

    /// All controller files that name one of these files: in their folders, in those above, and
    /// beside their tests.
    fn naming(&self, files: &[PathBuf]) -> Vec<PathBuf> {
        let above = files.iter().flat_map(|path| path.ancestors().skip(1).take(FOLDERS_MAX));
        let mut folders: Vec<PathBuf> = above.map(Path::to_path_buf).collect();
        folders.extend(files.iter().flat_map(|path| beside(path)));
        folders.sort_unstable();
        folders.dedup();
        let all = folders.iter().flat_map(|folder| self.toml_files(folder, false));
        all.filter(|path| self.names(path, FileKind::Controller, files)).collect()
    }

    /// Whether a file is of a kind, and names one of these.
    fn names(&self, path: &Path, kind: FileKind, files: &[PathBuf]) -> bool {
        let file = self.file(path).filter(|file| file.kind == kind);
        file.is_some_and(|file| named_files(&file).iter().any(|named| files.contains(named)))
    }

    /// The tests of some files: in their folders, and in folders `tests` there.
    fn tests(&self, files: &[PathBuf]) -> Vec<PathBuf> {
        let mut folders: Vec<PathBuf> = files.iter().flat_map(|path| beside(path)).collect();
        folders.sort_unstable();
        folders.dedup();
        let tests = folders.iter().flat_map(|folder| self.toml_files(folder, true));
        tests.filter(|path| self.names(path, FileKind::Test, files)).collect()
    }

    /// The TOML files of a folder, in order; of tests only those, else none of them.
    fn toml_files(&self, folder: &Path, tests: bool) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(folder).into_iter().flatten();
        let paths = entries.filter_map(|of| Some(of.ok()?.path()));
        let is_toml = |path: &PathBuf| path.extension().is_some_and(|end| end == "toml");
        let mut paths: Vec<PathBuf> = paths.filter(is_toml).take(FILES_MAX).collect();
        paths.extend(self.open.keys().filter(|path| path.parent() == Some(folder)).cloned());
        paths.retain(|path| {
            let name = path.to_string_lossy();
            name.ends_with(".toml") && name.ends_with(".test.toml") == tests
        });
        paths.sort_unstable();
        paths.dedup();
        paths
    }
}

impl Project {
    /// The number of a file.
    pub fn number(&self, path: &Path) -> Option<usize> {
        self.files.iter().position(|file| file.path == path)
    }
}

/// The folders in which the tests of a file may be.
fn beside(path: &Path) -> Vec<PathBuf> {
    let Some(folder) = path.parent().filter(|folder| folder.is_absolute()) else {
        return Vec::new();
    };
    let up = folder.parent().map(|up| up.join("tests"));
    [Some(folder.to_path_buf()), Some(folder.join("tests")), up].into_iter().flatten().collect()
}

/// Whether a path is the name of a file of the library.
pub(super) fn is_library(path: &Path) -> bool {
    path.to_str().is_some_and(|name| name.starts_with(LIBRARY))
}

/// The identities of the files that a controller file or a test names, reloads included.
pub(super) fn named_files(file: &EditorFile) -> Vec<PathBuf> {
    use super::words::Role;
    let words = file.words.all.iter().filter(|word| word.role == Role::File);
    words.map(|word| named_file(file, file.slice(word.span.clone()))).collect()
}

/// The identity of a file that another file names.
pub(super) fn named_file(naming: &EditorFile, name: &str) -> PathBuf {
    if name.starts_with(LIBRARY) {
        return PathBuf::from(name);
    }
    identity(&naming.path.parent().unwrap_or(Path::new("")).join(name))
}
