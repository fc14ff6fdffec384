//! Projects: files that belong together. A project is a controller file, its ladders and their
//! tests; or a ladder that no controller file names; or a test and the files that it names.
//!
//! `workspace` requests the project of a file. One `rungd check` of the controller file or of the
//! ladder judges one project.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use super::disk::{DiskView, FileStamp};
use super::file::EditorFile;
use super::lines::ColumnUnit;
use super::names::ProjectNames;
use super::slots::FileKind;
use super::words::FileWordRole;
use rungd_base::locked::locked;
use rungd_config::load::{OpenTexts, identity, library};
use rungd_language::source::file_kind::LIBRARY;

/// The maximum number of folders, from the ladder's folder upwards, that are searched for its
/// controller file.
const FOLDERS_MAX: usize = 4;

/// The texts of files: those that the editor has open, else those on disk.
#[derive(Debug, Default)]
pub(super) struct Library {
    open: HashMap<PathBuf, Arc<EditorFile>>,
    /// Files that are not open, with the time of their last change and their size.
    read: Mutex<HashMap<PathBuf, ReadFile>>,
    columns: ColumnUnit,
    disk: DiskView,
    found: Mutex<FoundFiles>,
}

/// The results of searches since the last change.
#[derive(Debug, Default)]
struct FoundFiles {
    /// The files of a kind, by their folder.
    of_kind: HashMap<(PathBuf, FileKind), Arc<[PathBuf]>>,
    /// The identities of the files that a file names.
    named: HashMap<PathBuf, Arc<HashSet<PathBuf>>>,
}

/// A file on disk, as it was when it was read.
#[derive(Clone, Debug)]
struct ReadFile {
    stamp: FileStamp,
    file: Arc<EditorFile>,
}

/// The files of a project, and their names.
#[derive(Debug)]
pub(super) struct Project {
    /// The argument of `rungd check`: the controller file, or the ladder.
    pub root: PathBuf,
    /// The root, the ladders in the order of the controller file, the tests.
    pub files: Vec<Arc<EditorFile>>,
    /// The number of the first `files` that are the root and the files that it names.
    own: usize,
    /// The names in the files, with their meanings.
    pub names: ProjectNames,
    /// The own ladders of field devices, which are none of `files`.
    pub sides: Vec<DeviceSide>,
}

/// The own ladder of a field device.
#[derive(Debug)]
pub(super) struct DeviceSide {
    /// The number of the file that names it.
    file: usize,
    /// The name of the device.
    device: String,
    /// Its files and names.
    pub project: Project,
}

/// Whether the text of a file is the one on disk.
fn is_on_disk(known: &ReadFile) -> bool {
    let bytes = OpenTexts::default().read(&known.file.path).ok();
    bytes.is_some_and(|bytes| *String::from_utf8_lossy(&bytes) == *known.file.text)
}

impl Library {
    /// A library without open files.
    pub fn new(columns: ColumnUnit) -> Library {
        Library { columns, ..Library::default() }
    }

    /// How positions count columns.
    pub fn columns(&self) -> ColumnUnit {
        self.columns
    }

    /// Opens a file, or changes its text: the editor now shows this text.
    pub fn open(&mut self, path: &Path, text: Arc<str>) {
        let file = Arc::new(EditorFile::new(path, text, self.columns));
        self.open.insert(path.to_owned(), file);
        self.changed();
    }

    /// Closes a file: the editor no longer shows it.
    pub fn close(&mut self, path: &Path) {
        self.open.remove(path);
        self.changed();
    }

    /// Clears the caches after a change, perhaps on disk.
    pub fn changed(&mut self) {
        self.disk = DiskView::default();
        self.found = Mutex::default();
    }

    /// Whether the files that are not open are on disk as they were read. `deep`: also compares
    /// their contents, since two changes within one tick of the clock have the same stamp. Files
    /// that differ are read again when they are next needed.
    pub fn is_present(&self, deep: bool) -> bool {
        let mut read = locked(&self.read);
        let before = read.len();
        read.retain(|path, known| {
            let is_own = is_library(path) || self.open.contains_key(path);
            is_own || FileStamp::of(path) == Some(known.stamp) && (!deep || is_on_disk(known))
        });
        read.len() == before && self.disk.is_present()
    }

    /// Forgets the text of a file on disk that the editor reports as changed.
    pub fn forget(&mut self, path: &Path) {
        locked(&self.read).remove(path);
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

    /// The texts that the editor shows, with a different text of one file.
    pub fn texts_with(&self, path: &Path, text: &Arc<str>) -> OpenTexts {
        OpenTexts::new(self.open_texts().chain([(path.to_owned(), text.clone())]))
    }

    /// The texts that the editor shows, each with its path.
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
            Some(_) => FileStamp::default(),
            None => self.disk.stamp(path)?,
        };
        let mut read = locked(&self.read);
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

    /// The root of the project of a file.
    pub fn root(&self, path: &Path) -> Option<PathBuf> {
        let file = self.file(path)?;
        Some(match file.kind {
            FileKind::Controller => path.to_owned(),
            FileKind::Ladder => self.controller_of(path).unwrap_or_else(|| path.to_owned()),
            FileKind::Test => {
                // A new test file may not name any file yet.
                let tested = self.tested(&file).filter(|root| self.file(root).is_some());
                tested.unwrap_or_else(|| path.to_owned())
            }
        })
    }

    /// The project of a file.
    pub fn project(&self, path: &Path) -> Option<Project> {
        let (file, root) = (self.file(path)?, self.root(path)?);
        let root_file = self.file(&root)?;
        let mut files = vec![root_file.clone()];
        self.add(&mut files, named_files(&root_file));
        let own = files.len();
        // All projects share the library: to name it does not make a file part of the project.
        let of_root = files.iter().map(|file| file.path.clone());
        let of_root: Vec<PathBuf> = of_root.filter(|path| !is_library(path)).collect();
        if file.kind == FileKind::Test {
            self.add(&mut files, named_files(&file));
        }
        // Other controller files with the same ladders name the same tags, and have tests.
        let others = self.naming(&of_root);
        self.add(&mut files, others.clone());
        let tests = self.tests(&[of_root, others].concat());
        self.add(&mut files, tests);
        self.add(&mut files, vec![path.to_owned()]);
        let names = ProjectNames::of(&files);
        let sides = DeviceSide::of_all(self, &files);
        Some(Project { root, files, own, names, sides })
    }

    /// Whether a file belongs to a project. The file must be one of the project's files; a test
    /// must also name only the root and files that the root names.
    pub fn is_of(&self, path: &Path, project: &Project) -> bool {
        let Some(number) = project.number(path) else { return false };
        let own: HashSet<&PathBuf> =
            project.files[..project.own].iter().map(|file| &file.path).collect();
        let file = &project.files[number];
        file.kind != FileKind::Test || self.named(file).iter().all(|named| own.contains(named))
    }

    fn add(&self, files: &mut Vec<Arc<EditorFile>>, paths: Vec<PathBuf>) {
        let mut known: HashSet<PathBuf> = files.iter().map(|file| file.path.clone()).collect();
        for path in paths {
            if !known.contains(&path)
                && let Some(file) = self.file(&path)
            {
                known.insert(path);
                files.push(file);
            }
        }
    }

    /// The root of the project that a test tests.
    fn tested(&self, test: &EditorFile) -> Option<PathBuf> {
        let named = named_files(test);
        let first = named.iter().find(|path| !is_library(path)).or(named.first())?;
        let file = self.file(first);
        match file.is_some_and(|file| file.kind == FileKind::Controller) {
            true => Some(first.clone()),
            false => Some(self.controller_of(first).unwrap_or_else(|| first.clone())),
        }
    }

    /// The controller file that names a ladder, in the ladder's folder or in a folder above it. Of
    /// several controller files, the one that the editor shows, else the first.
    fn controller_of(&self, ladder: &Path) -> Option<PathBuf> {
        let folders = ladder.ancestors().skip(1).take(FOLDERS_MAX);
        let all = folders.flat_map(|folder| self.of_kind(folder, FileKind::Controller).to_vec());
        let mut naming = all.filter(|path| self.names(path, |named| named.contains(ladder)));
        let first = naming.next()?;
        let open = [first.clone()].into_iter().chain(naming).find(|path| self.is_open(path));
        Some(open.unwrap_or(first))
    }

    /// The controller file of which a ladder is a plant or a device's own side, in the ladder's
    /// folder or in a folder above it.
    pub fn controller_beside(&self, ladder: &Path) -> Option<PathBuf> {
        let folders = ladder.ancestors().skip(1).take(FOLDERS_MAX);
        let mut all =
            folders.flat_map(|folder| self.of_kind(folder, FileKind::Controller).to_vec());
        all.find(|path| {
            let file = self.file(path);
            file.is_some_and(|file| {
                let mut beside = paths_in(&file, FileWordRole::DeviceLadder);
                beside.any(|path| self.disk.identity(&path) == ladder)
            })
        })
    }

    /// All controller files that name one of these files. The folders of the files, the folders
    /// above them and the folders of their tests are searched.
    fn naming(&self, files: &[PathBuf]) -> Vec<PathBuf> {
        let above = files.iter().flat_map(|path| path.ancestors().skip(1).take(FOLDERS_MAX));
        let mut folders: Vec<PathBuf> = above.map(Path::to_path_buf).collect();
        folders.extend(files.iter().flat_map(|path| beside(path)));
        self.naming_in(folders, FileKind::Controller, files)
    }

    /// The tests of some files, searched in the folders that `beside` returns.
    fn tests(&self, files: &[PathBuf]) -> Vec<PathBuf> {
        let folders = files.iter().flat_map(|path| beside(path)).collect();
        self.naming_in(folders, FileKind::Test, files)
    }

    /// The files of a kind in some folders that name one of `files`.
    fn naming_in(
        &self,
        mut folders: Vec<PathBuf>,
        kind: FileKind,
        files: &[PathBuf],
    ) -> Vec<PathBuf> {
        folders.sort_unstable();
        folders.dedup();
        let files: HashSet<&PathBuf> = files.iter().collect();
        let all = folders.iter().flat_map(|folder| self.of_kind(folder, kind).to_vec());
        let is_one = |named: &HashSet<PathBuf>| named.iter().any(|path| files.contains(path));
        all.filter(|path| self.names(path, is_one)).collect()
    }

    /// Whether the files that a file names meet a condition.
    fn names(&self, path: &Path, are_such: impl Fn(&HashSet<PathBuf>) -> bool) -> bool {
        self.file(path).is_some_and(|file| are_such(&self.named(&file)))
    }

    /// The identities of the files that a file names.
    fn named(&self, file: &EditorFile) -> Arc<HashSet<PathBuf>> {
        if let Some(known) = self.found().named.get(&file.path) {
            return known.clone();
        }
        let names = named_paths(file).map(|path| match is_library(&path) {
            true => path,
            false => self.disk.identity(&path),
        });
        let named: Arc<HashSet<PathBuf>> = Arc::new(names.collect());
        self.found().named.insert(file.path.clone(), named.clone());
        named
    }

    /// The controller files or tests of a folder, in order: those on disk and those that are open.
    fn of_kind(&self, folder: &Path, kind: FileKind) -> Arc<[PathBuf]> {
        let key = (folder.to_owned(), kind);
        if let Some(known) = self.found().of_kind.get(&key) {
            return known.clone();
        }
        let mut paths = self.disk.toml_files(folder).to_vec();
        paths.extend(self.open.keys().filter(|path| path.parent() == Some(folder)).cloned());
        paths.retain(|path| {
            let name = path.to_string_lossy();
            let is_test = name.ends_with(".test.toml");
            name.ends_with(".toml") && is_test == (kind == FileKind::Test)
        });
        paths.sort_unstable();
        paths.dedup();
        paths.retain(|path| self.file(path).is_some_and(|file| file.kind == kind));
        let paths: Arc<[PathBuf]> = paths.into();
        self.found().of_kind.insert(key, paths.clone());
        paths
    }

    fn found(&self) -> std::sync::MutexGuard<'_, FoundFiles> {
        locked(&self.found)
    }
}

impl Project {
    /// The own ladder of the device that a name begins with, and the rest of the name: of `tank`
    /// or `tank.level`, the empty text or `level`. `file`: the number of the file with the name,
    /// whose own tables come first.
    pub fn side<'t>(&self, file: usize, name: &'t str) -> Option<(&DeviceSide, &'t str)> {
        let (device, rest) = name.split_once('.').unwrap_or((name, ""));
        let mut found: Vec<&DeviceSide> =
            self.sides.iter().filter(|side| side.device == device).collect();
        found.sort_by_key(|side| side.file != file);
        Some((*found.first()?, rest))
    }

    /// The ladder of a field device alone, as the project of its names.
    pub fn of_side(files: Vec<Arc<EditorFile>>) -> Project {
        let root = files.first().map(|file| file.path.clone()).unwrap_or_default();
        let (names, own) = (ProjectNames::of(&files), files.len());
        Project { root, files, own, names, sides: Vec::new() }
    }

    /// The number of a file.
    pub fn number(&self, path: &Path) -> Option<usize> {
        self.files.iter().position(|file| file.path == path)
    }
}

impl DeviceSide {
    /// Those that the files of a project name.
    pub fn of_all(library: &Library, files: &[Arc<EditorFile>]) -> Vec<DeviceSide> {
        let mut sides: Vec<DeviceSide> = Vec::new();
        for (number, file) in files.iter().enumerate() {
            let words = file.words.all.iter();
            let mut named: Vec<(usize, Vec<Arc<EditorFile>>)> = Vec::new();
            for word in words.filter(|word| word.role == FileWordRole::DeviceLadder) {
                let path = named_file(file, file.slice(word.span.clone()));
                let Some(ladder) = library.file(&path) else { continue };
                match named.last_mut().filter(|(object, _)| *object == word.object) {
                    Some((_, ladders)) => ladders.push(ladder),
                    None => named.push((word.object, vec![ladder])),
                }
            }
            sides.extend(named.into_iter().filter_map(|(object, ladders)| {
                let name = |key| file.value(object, &[key]);
                let device = name("name").or_else(|| name("device"))?.to_owned();
                Some(DeviceSide { file: number, device, project: Project::of_side(ladders) })
            }));
        }
        sides
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

/// The identities of the files that a controller file or a test names, also in `reload` steps.
pub(super) fn named_files(file: &EditorFile) -> Vec<PathBuf> {
    named_paths(file).map(|path| if is_library(&path) { path } else { identity(&path) }).collect()
}

/// The identity of a file that another file names.
pub(super) fn named_file(naming: &EditorFile, name: &str) -> PathBuf {
    let path = named_path(naming, name);
    if is_library(&path) { path } else { identity(&path) }
}

/// The paths of the files that a file names; for files of the library, their names.
fn named_paths(file: &EditorFile) -> impl Iterator<Item = PathBuf> {
    paths_in(file, FileWordRole::File)
}

/// The paths of the files that a file names in words with a role.
fn paths_in(file: &EditorFile, role: FileWordRole) -> impl Iterator<Item = PathBuf> {
    let words = file.words.all.iter().filter(move |word| word.role == role);
    words.map(|word| named_path(file, file.slice(word.span.clone())))
}

fn named_path(naming: &EditorFile, name: &str) -> PathBuf {
    match name.starts_with(LIBRARY) {
        true => PathBuf::from(name),
        false => naming.path.parent().unwrap_or(Path::new("")).join(name),
    }
}
