//! Files → a checked program, and what a controller file asks for: the same for `rungd check`,
//! `rungd sim`, the daemon's start and its reload.
//!
//! The only thing done here beside calling the reader, the resolver and the rules in their order
//! is reading the files. What is wrong *in* a file is a finding; a ladder file that a controller
//! file names and that cannot be read is one too, at the name. A file named by the caller that
//! cannot be read is a failure.

use std::io::Read;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::check::{check, silence};
use crate::resolve::controller::{Controller, resolve_controller};
use crate::resolve::program::Program;
use crate::resolve::{LoadOptions, load_ladders};
use crate::source::controller as written;
use crate::source::finding::{Code, Finding, Severity};
use crate::source::reader::Text;
use crate::source::span::{FileId, SourceFile, Span};

/// Largest file that is read.
const FILE_BYTES_MAX: u64 = 256 << 20;

/// What came of a load. Program and controller are there exactly when no finding is an error.
#[derive(Debug, Default)]
pub struct Loaded {
    /// All files that were read, by their numbers.
    pub files: Vec<SourceFile>,
    /// All findings, in order of place.
    pub findings: Vec<Finding>,
    /// The program, resolved and judged.
    pub program: Option<Program>,
    /// The controller file's settings, where one was loaded.
    pub controller: Option<Controller>,
}

/// A file as it was read, once: it may be a pipe.
#[derive(Debug)]
pub struct Input {
    path: PathBuf,
    bytes: Vec<u8>,
}

impl Input {
    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn read(path: &Path) -> Result<Input> {
        let bytes = read_bytes(path).with_context(|| path.display().to_string())?;
        Ok(Input { path: path.to_owned(), bytes })
    }

    /// Whether it is a controller file rather than a ladder file.
    pub fn is_controller(&self) -> bool {
        written::is_controller(&String::from_utf8_lossy(&self.bytes))
    }
}

/// Loads ladder files, given together as one program.
///
/// # Errors
/// A file that cannot be read.
pub fn ladder_files(paths: &[PathBuf]) -> Result<Loaded> {
    let inputs: Result<Vec<Input>> = paths.iter().map(|path| Input::read(path)).collect();
    Ok(ladder_inputs(&inputs?))
}

/// As [`ladder_files`].
pub fn ladder_inputs(inputs: &[Input]) -> Loaded {
    let mut loaded = Loaded::default();
    for input in inputs {
        loaded.add(input.path.display().to_string(), &input.bytes);
    }
    loaded.ladders(0, LoadOptions::default());
    loaded.judge();
    loaded
}

/// Loads a controller file and the ladder files that it names.
///
/// # Errors
/// The controller file cannot be read.
pub fn controller_file(path: &Path) -> Result<Loaded> {
    Ok(controller_input(&Input::read(path)?))
}

/// As [`controller_file`].
pub fn controller_input(input: &Input) -> Loaded {
    let mut loaded = Loaded::default();
    let path = &input.path;
    let id = loaded.add(path.display().to_string(), &input.bytes);
    let (written, found) = written::read(&loaded.files[0].text, id);
    loaded.findings.extend(found);
    let Some(written) = written else { return loaded };
    let first = loaded.files.len();
    if !loaded.named_files(path, &written.ladder) {
        loaded.judge();
        return loaded;
    }
    let first_file = FileId(first as u32);
    let (sizes, order) = (written.memory.clone(), written.order.clone());
    loaded.ladders(first, LoadOptions { sizes, order, first_file });
    if let Some(program) = &loaded.program {
        let (controller, found) = resolve_controller(&written, program);
        loaded.findings.extend(found);
        loaded.controller = Some(controller);
    }
    loaded.judge();
    loaded
}

/// Whether a file is a controller file rather than a ladder file.
///
/// # Errors
/// It cannot be read.
pub fn is_controller_file(path: &Path) -> Result<bool> {
    Ok(Input::read(path)?.is_controller())
}

impl Loaded {
    /// Gives a file the next number.
    fn add(&mut self, name: String, bytes: &[u8]) -> FileId {
        let id = FileId(self.files.len() as u32);
        let (text, finding) = decode(bytes, id);
        self.findings.extend(finding);
        self.files.push(SourceFile { name, text });
        id
    }

    /// Reads the ladder files that a controller file names; says whether all could be read.
    fn named_files(&mut self, controller: &Path, names: &[Text]) -> bool {
        let mut seen: Vec<&str> = Vec::new();
        let mut whole = true;
        for name in names {
            if seen.contains(&name.text.as_str()) {
                let message = format!("`{}` is named twice", name.text);
                self.findings.push(Finding::new(Code::Controller, name.span, message));
                whole = false;
                continue;
            }
            seen.push(&name.text);
            let path = controller.parent().unwrap_or(Path::new("")).join(&name.text);
            match read_bytes(&path) {
                Ok(bytes) => {
                    self.add(path.display().to_string(), &bytes);
                }
                Err(error) => {
                    let message = format!("cannot read `{}`: {error}", path.display());
                    let finding = Finding::new(Code::Controller, name.span, message);
                    self.findings.push(finding.help("paths are relative to the controller file"));
                    whole = false;
                }
            }
        }
        whole && !names.is_empty()
    }

    /// Resolves the files from `first` on.
    fn ladders(&mut self, first: usize, options: LoadOptions) {
        // A file that is not text would only bring follow-up findings.
        if self.findings.iter().any(|f| f.span.file.0 as usize >= first) {
            return;
        }
        let (program, found) = load_ladders(&self.files[first..], &options);
        self.findings.extend(found);
        self.program = program;
    }

    /// Applies the rules to the program, silences what is allowed, and keeps the program only if
    /// nothing refuses it.
    fn judge(&mut self) {
        if let Some(program) = &self.program {
            let retained = self.controller.as_ref().map_or(&[][..], |c| &c.retain);
            self.findings.extend(check(program, retained));
            self.findings = silence(program, std::mem::take(&mut self.findings));
        }
        self.findings.sort_by_key(|f| (f.span.file, f.span.start, f.span.end, f.code));
        if self.findings.iter().any(|finding| finding.severity() == Severity::Error) {
            self.program = None;
            self.controller = None;
        }
    }
}

/// Reads a file of 256 MiB at most.
///
/// # Errors
/// It cannot be read, or is larger.
pub fn read_bytes(path: &Path) -> std::io::Result<Vec<u8>> {
    // What somebody named waits for a writer who may never come; what a shell made has one.
    if std::fs::metadata(path)?.file_type().is_fifo() && !path.starts_with("/dev") {
        let message = "it is a named pipe, and no file";
        return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, message));
    }
    let mut bytes = Vec::new();
    std::fs::File::open(path)?.take(FILE_BYTES_MAX).read_to_end(&mut bytes)?;
    if bytes.len() as u64 == FILE_BYTES_MAX {
        let message = "the file is larger than 256 MiB";
        return Err(std::io::Error::new(std::io::ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// The text of a file; where it is not UTF-8, a text in which marks stand for the rest, and the
/// finding that says so.
pub fn decode(bytes: &[u8], file: FileId) -> (String, Option<Finding>) {
    match std::str::from_utf8(bytes) {
        Ok(text) => (text.to_owned(), None),
        Err(error) => {
            let at = error.valid_up_to() as u32;
            let span = Span { file, start: at, end: at };
            let byte = bytes.get(at as usize).copied().unwrap_or(0);
            let message = format!("the file is not UTF-8 text: byte {at} is 0x{byte:02X}");
            let finding = Finding::new(Code::TomlSyntax, span, message)
                .label("here")
                .help("save the file as UTF-8; it may be Latin-1, or no text at all");
            (String::from_utf8_lossy(bytes).into_owned(), Some(finding))
        }
    }
}
