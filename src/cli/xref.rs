//! `rungd xref`: the cross-references of an operand: its writers and readers, and its uses in the
//! controller file and in tests.
//!
//! Loads the files and finds their tests; `draw::xref` makes the answer.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Result;
use clap::Args;

use super::check::style;
use super::default_files::given_or_default;
use super::exit::Exit;
use super::foreign;
use super::terminal::{plain_json, print, say, say_findings, say_line};
use rungd_base::scan_period::ScanPeriod;
use rungd_config::load::{self, Loaded, identity};
use rungd_history::observe::Subject;
use rungd_lab::draw::xref::{CrossReferenceIndex, text};
use rungd_lab::testing::{self, TestTouch};
use rungd_language::source::render::render;
use rungd_language::source::wording::counted;

/// Lists where operands are written and read, and their other uses
///
/// An operand is a tag, an address, a member, a structure, an array, a constant, a block, a Stage
/// or a field device. The answer names instructions, contacts, devices, Modbus places, retention
/// and tests.
#[derive(Args, Debug)]
pub struct XrefArgs {
    /// Tags, addresses, members, blocks, devices
    #[arg(value_name = "OPERAND", required_unless_present = "all", conflicts_with = "all")]
    operands: Vec<String>,
    /// All tags, all other operands that the ladder names, all blocks
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    program: ProgramArgs,
    /// Print the answer as JSON
    #[arg(long)]
    json: bool,
}

/// The program of a question.
#[derive(Args, Debug)]
pub struct ProgramArgs {
    /// The controller file, the ladder files, or a file for `rungd import` (default: the controller
    /// file of this folder, else the service's)
    #[arg(long = "in", value_name = "FILE")]
    files: Vec<PathBuf>,
}

/// A loaded program.
pub(super) struct AskedProgram {
    loaded: Loaded,
    pub(super) subject: Subject,
}

/// Prints the cross-references.
///
/// # Errors
/// A file cannot be read, or standard output cannot be written.
pub fn xref(args: &XrefArgs) -> Result<Exit> {
    let Some(program) = args.program.load()? else { return Ok(Exit::Config) };
    let tests = program.tests();
    let index = program.index(&tests);
    let mut found = Vec::new();
    if args.all {
        found = index.all();
    }
    for operand in &args.operands {
        match index.reference(operand) {
            Ok(reference) => found.push(reference),
            Err(why) => {
                say_line(&format!("rungd: {why}"));
                return Ok(Exit::Usage);
            }
        }
    }
    if args.json {
        print(&format!("{}\n", plain_json(&serde_json::to_string(&found)?)))?;
    } else {
        let texts: Vec<String> = found.iter().map(text::whole).collect();
        print(&texts.join("\n"))?;
    }
    Ok(Exit::Ok)
}

impl AskedProgram {
    fn of(mut loaded: Loaded) -> Option<AskedProgram> {
        let program = loaded.program.take()?;
        let subject = Subject::new(Arc::new(program), loaded.files.clone());
        Some(AskedProgram { loaded, subject })
    }

    /// Reads the tests of the program, and returns the operands that they use.
    pub fn tests(&self) -> Vec<TestTouch> {
        tests(&self.loaded)
    }

    /// The period of the controller file; of a ladder alone the default one.
    pub fn period(&self) -> ScanPeriod {
        self.loaded.controller.as_ref().map_or(ScanPeriod::DEFAULT, |controller| controller.period)
    }

    /// The index of the program, for look-ups.
    pub fn index<'a>(&'a self, tests: &'a [TestTouch]) -> CrossReferenceIndex<'a> {
        CrossReferenceIndex::new(&self.subject, self.loaded.controller.as_ref(), tests)
    }
}

impl ProgramArgs {
    /// The arguments for files that a command names in its own option.
    pub fn of(files: Vec<PathBuf>) -> ProgramArgs {
        ProgramArgs { files }
    }

    /// Loads the program; `None` if it has errors, which are printed.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn load(&self) -> Result<Option<AskedProgram>> {
        let loaded = self.read()?;
        if loaded.program.is_none() {
            say_findings(&render(&loaded.findings, &loaded.files, style(false)));
        }
        Ok(AskedProgram::of(loaded))
    }

    /// As [`ProgramArgs::load`], without printing errors.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn load_quietly(&self) -> Result<Option<AskedProgram>> {
        Ok(AskedProgram::of(self.read()?))
    }

    fn read(&self) -> Result<Loaded> {
        let files = given_or_default(&self.files)?;
        if let Some(loaded) = foreign::shown(&files)? {
            return Ok(loaded);
        }
        match files.as_slice() {
            [one] if load::is_controller_file(one)? => load::controller_file(one),
            _ => load::ladder_files(&files),
        }
    }
}

/// The operands that the tests of these files use. The tests are beside a file, in a folder `tests`
/// there, or in a folder `tests` beside its folder. Test files that cannot be read are counted.
fn tests(loaded: &Loaded) -> Vec<TestTouch> {
    let names = loaded.files.iter().map(|file| Path::new(&file.name));
    let own: Vec<PathBuf> = names.clone().map(identity).collect();
    let mut folders: Vec<PathBuf> = names.flat_map(beside).collect();
    folders.sort_unstable();
    folders.dedup();
    let mut seen = HashSet::new();
    let paths = folders.iter().flat_map(|folder| in_folder(folder));
    let paths = paths.filter(|path| seen.insert(identity(path)));
    let (mut touches, mut broken) = (Vec::new(), 0);
    for path in paths {
        let Ok(read) = testing::read_suite(&path) else {
            broken += 1;
            continue;
        };
        let is_own = |name: &String| own.contains(&identity(Path::new(name)));
        match &read.suite {
            Some(suite) if read.paths().iter().any(is_own) => {
                touches.extend(testing::touches(suite));
            }
            Some(_) => {}
            None => broken += 1,
        }
    }
    if broken > 0 {
        let files = counted(broken, "test file");
        say(&format!("rungd: {files} cannot be read: `rungd test` says why\n"));
    }
    touches
}

/// The folders in which the tests of a file may be.
fn beside(path: &Path) -> Vec<PathBuf> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let (folder, up) = match folder.file_name() {
        Some(_) => (folder, folder.with_file_name("tests")),
        None => (Path::new("."), PathBuf::from("../tests")),
    };
    let all = [folder.to_owned(), folder.join("tests"), up];
    all.into_iter().filter(|folder| folder.is_dir()).collect()
}

/// The test files of a folder, in order of their names, without the files of folders in it.
fn in_folder(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.path());
    let is_test = |path: &PathBuf| path.to_string_lossy().ends_with(".test.toml");
    let own = |path: PathBuf| path.strip_prefix(".").map(Path::to_owned).unwrap_or(path);
    let mut found: Vec<PathBuf> = names.filter(is_test).map(own).collect();
    found.sort_unstable();
    found
}
