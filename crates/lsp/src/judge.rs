//! Judges projects as `rungd check` and `rungd test` do, on a thread of its own.
//!
//! `server` sends the texts after each change. Only the newest texts are judged, so a fast typist
//! never waits for an old judgement. The findings come unchanged from `load` and `testing`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;

use crossbeam_channel::{Receiver, Sender, unbounded};

use super::file::EditorFile;
use super::project::Project;
use super::slots::FileKind;
use rungd_config::load::{self, Loaded, OpenTexts, decode};
use rungd_lab::testing;
use rungd_language::resolve::program::Program;
use rungd_language::source::finding::Finding;
use rungd_language::source::span::{FileId, SourceFile};

/// The root of a judgement.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum JudgedRoot {
    /// A controller file with its ladders.
    Controller(PathBuf),
    /// Ladders that form one program; in the editor one alone.
    Ladders(Vec<PathBuf>),
    /// A test file.
    Test(PathBuf),
}

/// Texts to judge.
#[derive(Debug)]
pub(super) struct JudgeOrder {
    /// The number of the change that made these texts.
    pub change: u64,
    /// The texts that the editor shows.
    pub texts: OpenTexts,
    /// The roots to judge; the last root is judged first.
    pub roots: Vec<JudgedRoot>,
}

/// A judgement.
#[derive(Debug)]
pub(super) struct Judgement {
    /// The number of the change.
    pub change: u64,
    /// The root that was judged.
    pub root: JudgedRoot,
    /// The files, with the texts that were judged.
    pub files: Vec<SourceFile>,
    /// The findings.
    pub findings: Vec<Finding>,
    /// The program, if it has no errors.
    pub program: Option<Arc<Program>>,
    /// How many elements retentive memory keeps.
    pub retained: usize,
    /// Why the root could not be read.
    pub failure: Option<String>,
}

impl JudgedRoot {
    /// The root of a project.
    pub fn of(project: &Project) -> JudgedRoot {
        JudgedRoot::of_root(&project.files[0])
    }

    /// The root of the project of this controller file or ladder.
    pub fn of_root(root: &EditorFile) -> JudgedRoot {
        let path = root.path.clone();
        match root.kind {
            FileKind::Controller => JudgedRoot::Controller(path),
            FileKind::Ladder | FileKind::Test => JudgedRoot::Ladders(vec![path]),
        }
    }

    /// Its path, or the path of its first ladder.
    pub fn path(&self) -> &Path {
        match self {
            JudgedRoot::Controller(path) | JudgedRoot::Test(path) => path,
            JudgedRoot::Ladders(paths) => paths.first().map_or(Path::new(""), PathBuf::as_path),
        }
    }
}

/// Starts the thread that judges. Returns the sender of its orders and the receiver of its
/// judgements. The thread ends when the sender is dropped.
pub(super) fn start() -> (Sender<JudgeOrder>, Receiver<Judgement>) {
    let (orders, received) = unbounded::<JudgeOrder>();
    let (send, judgements) = unbounded();
    let builder = thread::Builder::new().name("judge".to_owned());
    // Without the thread the channel is closed; `server` reports that.
    let _ = builder.spawn(move || work(&received, &send));
    (orders, judgements)
}

fn work(orders: &Receiver<JudgeOrder>, judgements: &Sender<Judgement>) {
    while let Ok(mut order) = orders.recv() {
        loop {
            order = newest(orders, order);
            let Some(root) = order.roots.pop() else { break };
            if judgements.send(judge(order.change, &root, &order.texts)).is_err() {
                return;
            }
        }
    }
}

/// The newest order, with the remaining roots of older orders.
fn newest(orders: &Receiver<JudgeOrder>, first: JudgeOrder) -> JudgeOrder {
    let mut order = first;
    while let Ok(next) = orders.try_recv() {
        let mut left = std::mem::replace(&mut order, next).roots;
        left.retain(|root| !order.roots.contains(root));
        order.roots.splice(0..0, left);
    }
    order
}

/// The judgement of a root, with these texts in place of the files on disk.
pub(super) fn judge(change: u64, root: &JudgedRoot, texts: &OpenTexts) -> Judgement {
    let loaded = match root {
        JudgedRoot::Controller(path) => load::controller_among(path, texts),
        JudgedRoot::Ladders(paths) => load::ladders_among(paths, texts),
        JudgedRoot::Test(path) => test(path, texts),
    };
    let (loaded, failure) = match loaded {
        Ok(loaded) => (loaded, None),
        Err(failure) => (Loaded::default(), Some(format!("{failure:#}"))),
    };
    let retained = loaded
        .controller
        .as_ref()
        .map_or(0, |controller| controller.retain.len() + controller.retained_stages.len());
    let Loaded { files, findings, program, .. } = loaded;
    let (root, program) = (root.clone(), program.map(Arc::new));
    Judgement { change, root, files, findings, program, retained, failure }
}

/// Judges a test file, without the findings of the ladders and controller files that it names: they
/// have their own roots. Findings in other test files are kept: if a test file is named in the
/// place of a ladder, no other root has that finding.
fn test(path: &Path, texts: &OpenTexts) -> anyhow::Result<Loaded> {
    let bytes = texts.read(path)?;
    let (text, undecoded) = decode(&bytes, FileId(0));
    let file = SourceFile { name: path.display().to_string(), text };
    let read = testing::read_among(path, file, undecoded, texts);
    let is_test = |finding: &Finding| {
        let file = read.files.get(finding.span.file.0 as usize);
        file.is_some_and(|file| file.name.ends_with(".test.toml"))
    };
    let own = read
        .findings
        .iter()
        .filter(|finding| finding.span.file == FileId(0) || is_test(finding))
        .cloned();
    let mut loaded = Loaded::default();
    loaded.findings = own.collect();
    loaded.files = read.files;
    Ok(loaded)
}
