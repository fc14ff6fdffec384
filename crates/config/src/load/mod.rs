//! Loads files: makes a checked program and a controller's settings. Used by `rungd check`,
//! `rungd sim` and the daemon's start and reload.
//!
//! This module reads the files, and calls the reader, the resolver and the rules in this order.
//! A mistake *in* a file is a finding. A ladder file that cannot be read is a finding too, at its
//! name in the controller file. If a file that the caller names cannot be read, the load fails.

#[cfg(test)]
mod broken;
#[cfg(test)]
mod ended;
pub mod files;
#[cfg(test)]
mod growth;
#[cfg(test)]
mod large;
pub mod library;
mod own_files;
pub mod test_ladders;

use std::collections::{HashMap, HashSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};

pub use files::OpenTexts;
pub use files::{identity, may_all_read, read_bytes};

use crate::controller::written::WrittenController;
use crate::controller::{self, Controller, resolve_controller_within};
use rungd_base::progress::{LoadStep, Progress};
use rungd_engine::isa::{Address, BlockId};
use rungd_io::plant::settings::InputRule;
use rungd_language::check::{CheckInputs, check_partial, check_whole, silence};
use rungd_language::resolve::program::{Program, TagMeaning};
use rungd_language::resolve::{LoadOptions, resolve_ladders};
use rungd_language::source::file_kind;
use rungd_language::source::finding::{Code, Finding, Severity};
use rungd_language::source::fix::{FixEdit, Help, possible};
use rungd_language::source::lost::LostTexts;
use rungd_language::source::reader::Text;
use rungd_language::source::span::{FileId, Located, SourceFile, Span};

/// The result of a load. It has a program and a controller exactly if no finding is an error.
#[derive(Debug, Default)]
pub struct Loaded {
    /// All files that were read, by their numbers.
    pub files: Vec<SourceFile>,
    /// All findings, in order of place.
    pub findings: Vec<Finding>,
    /// The program, resolved and checked by the rules.
    pub program: Option<Program>,
    /// The controller file's settings, if one was loaded.
    pub controller: Option<Controller>,
    /// The texts that could not be read in files that are not TOML as a whole.
    lost: LostTexts,
    progress: Progress,
    /// The texts that replace files on disk.
    texts: OpenTexts,
}

/// A file's path and bytes. The file is read only once, because it may be a pipe.
#[derive(Debug)]
pub struct InputFile {
    path: PathBuf,
    bytes: Vec<u8>,
}

impl InputFile {
    /// Reads a file that the caller of a command names.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn read(path: &Path) -> Result<InputFile> {
        if let Some(file) = path.to_str().and_then(library::named) {
            let file = file.map_err(|(message, help)| anyhow!("{message}: {help}"))?;
            return InputFile::of(path, Ok(file.text.as_bytes().to_vec()));
        }
        InputFile::of(path, read_bytes(path))
    }

    /// As [`InputFile::read`], for an open text or a regular file.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn open(path: &Path, texts: &OpenTexts) -> Result<InputFile> {
        match path.to_str().and_then(library::named) {
            Some(_) => InputFile::read(path),
            None => InputFile::of(path, texts.read(path)),
        }
    }

    fn of(path: &Path, bytes: std::io::Result<Vec<u8>>) -> Result<InputFile> {
        let bytes = bytes.with_context(|| path.display().to_string())?;
        Ok(InputFile { path: path.to_owned(), bytes })
    }

    /// Whether this is a controller file. If not, it is a ladder file.
    pub fn is_controller(&self) -> bool {
        file_kind::is_controller(&String::from_utf8_lossy(&self.bytes))
    }
}

/// Loads ladder files as one program.
///
/// # Errors
/// A file cannot be read, or is named twice.
pub fn ladder_files(paths: &[PathBuf]) -> Result<Loaded> {
    let inputs: Result<Vec<InputFile>> = paths.iter().map(|path| InputFile::read(path)).collect();
    ladder_inputs(&inputs?)
}

/// As [`ladder_files`], for files that were already read.
///
/// # Errors
/// A file is named twice.
pub fn ladder_inputs(inputs: &[InputFile]) -> Result<Loaded> {
    let mut loaded = Loaded::default();
    let mut seen: HashSet<PathBuf> = HashSet::new();
    for input in inputs {
        if !seen.insert(files::identity(&input.path)) {
            bail!("{}: this file is named twice", input.path.display());
        }
        loaded.add(input.path.display().to_string(), &input.bytes);
    }
    loaded.ladders(0, LoadOptions::default());
    loaded.judge();
    Ok(loaded)
}

/// Loads a controller file and the ladder files that it names. All of them must be regular files,
/// because a reload reads them again.
///
/// # Errors
/// The controller file cannot be read.
pub fn controller_file(path: &Path) -> Result<Loaded> {
    controller_file_within(path, &Progress::default())
}

/// As [`controller_file`], with a time limit. If `progress` is over, the result has no program and
/// no controller.
///
/// # Errors
/// The controller file cannot be read.
pub fn controller_file_within(path: &Path, progress: &Progress) -> Result<Loaded> {
    progress.begin(LoadStep::Reading(path.display().to_string()));
    let input = InputFile::of(path, files::read_regular(path))?;
    Ok(controller(&input, progress, &OpenTexts::default()))
}

/// As [`ladder_files`] or [`controller_file`], depending on the kind of the file. `texts` replace
/// files on disk.
///
/// # Errors
/// The file cannot be read.
pub fn open_file(path: &Path, texts: &OpenTexts) -> Result<Loaded> {
    let input = InputFile::open(path, texts)?;
    match input.is_controller() {
        true => Ok(controller(&input, &Progress::default(), texts)),
        false => ladder_inputs(&[input]),
    }
}

/// As [`ladder_files`]. `texts` replace files on disk.
///
/// # Errors
/// A file cannot be read, or is named twice.
pub fn ladders_among(paths: &[PathBuf], texts: &OpenTexts) -> Result<Loaded> {
    let inputs: Result<Vec<InputFile>> =
        paths.iter().map(|path| InputFile::open(path, texts)).collect();
    ladder_inputs(&inputs?)
}

/// As [`controller_file`]. `texts` replace files on disk.
///
/// # Errors
/// The controller file cannot be read.
pub fn controller_among(path: &Path, texts: &OpenTexts) -> Result<Loaded> {
    let input = InputFile::of(path, texts.read(path))?;
    Ok(controller(&input, &Progress::default(), texts))
}

/// As [`controller_file`], for a file that was already read.
pub fn controller_input(input: &InputFile) -> Loaded {
    controller(input, &Progress::default(), &OpenTexts::default())
}

fn controller(input: &InputFile, progress: &Progress, texts: &OpenTexts) -> Loaded {
    let (progress, texts) = (progress.clone(), texts.clone());
    let mut loaded = Loaded { progress, texts, ..Loaded::default() };
    let path = &input.path;
    let id = loaded.add(path.display().to_string(), &input.bytes);
    // A file with invalid bytes gets no further findings, because its decoded text differs from
    // the author's text.
    if loaded.has_error() || loaded.progress.is_over() {
        return loaded;
    }
    loaded.progress.begin(LoadStep::Parsing(loaded.files[0].name.clone()));
    if let Some(finding) = file_kind::of_test(&loaded.files[0].text, id, "a controller file") {
        loaded.findings.push(finding);
        return loaded;
    }
    if let Some(place) = file_kind::ladder_place(&loaded.files[0].text, id) {
        let finding =
            Finding::new(Code::Controller, place, "this is a ladder file, not a controller file");
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let help = format!("a controller file names it: `ladder = [\"{name}\"]`");
        loaded.findings.push(finding.help(help));
        return loaded;
    }
    let (written, found) = controller::read_within(&loaded.files[0].text, id, &loaded.progress);
    loaded.findings.extend(found);
    let Some(written) = written.filter(|_| !loaded.progress.is_over()) else { return loaded };
    loaded.lost.add_settings(id, written.lost.clone());
    loaded.findings.extend(own_files::findings(path, &written, &loaded.progress));
    let first = loaded.files.len();
    if loaded.named_files(path, "controller file", &written.ladder) {
        loaded.controlled(&written, first);
    }
    loaded.settings(&written);
    loaded.judge();
    loaded
}

/// Loads the files of a recording: the texts of a controller file and of its ladder files, in
/// order. No file is read.
pub fn recorded_files(files: &[SourceFile]) -> Loaded {
    let mut loaded = Loaded { files: files.to_vec(), ..Loaded::default() };
    let Some(controller) = files.first() else { return loaded };
    let (written, found) = controller::read(&controller.text, FileId(0));
    loaded.findings.extend(found);
    let Some(written) = written else { return loaded };
    loaded.lost.add_settings(FileId(0), written.lost.clone());
    loaded.controlled(&written, 1);
    loaded.settings(&written);
    loaded.judge();
    loaded
}

/// SHA-256 of the concatenated texts. For the texts of a program's ladders it is the sum that
/// `status` shows.
pub fn sha256_of<'t>(texts: impl Iterator<Item = &'t str>) -> String {
    let mut hash = hmac_sha256::Hash::new();
    texts.for_each(|text| hash.update(text.as_bytes()));
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Marks the tags of all inputs and outputs of devices, and of all bits that a simulated input
/// follows, as used, even if the ladder does not name them.
fn mark_mapped(program: &mut Program, controller: &Controller) {
    let devices = &controller.devices;
    let inputs = devices.iter().flat_map(|device| &device.inputs).map(|input| input.address);
    let outputs = devices.iter().flat_map(|device| &device.outputs).map(|output| output.address);
    let followed =
        controller.rules.iter().flat_map(InputRule::reads).map(|read| Address::Bit(read.bit));
    let mapped: HashSet<Address> = inputs.chain(outputs).chain(followed).collect();
    for tag in &mut program.tags {
        if let TagMeaning::Address(address) = tag.meaning {
            tag.used |= mapped.contains(&address);
        }
    }
}

/// Whether a file is a controller file. If not, it is a ladder file.
///
/// # Errors
/// The file cannot be read.
pub fn is_controller_file(path: &Path) -> Result<bool> {
    Ok(InputFile::read(path)?.is_controller())
}

impl Loaded {
    /// Adds a file and returns its number.
    fn add(&mut self, name: String, bytes: &[u8]) -> FileId {
        let id = FileId(self.files.len() as u32);
        let (text, finding) = decode(bytes, id);
        self.findings.extend(finding);
        self.files.push(SourceFile { name, text });
        id
    }

    /// Reads the ladder files that the file `naming` of this kind names. Returns true if all could
    /// be read.
    fn named_files(&mut self, naming: &Path, kind: &str, names: &[Text]) -> bool {
        let mut seen: HashMap<PathBuf, Span> = HashMap::new();
        let (mut whole, own) = (true, files::identity(naming));
        for name in names {
            if self.progress.is_over() {
                return false;
            }
            if let Some(file) = library::named(&name.text) {
                let text = file.map(|file| file.text);
                whole &= self.add_library(name, text, &mut seen);
                continue;
            }
            let path = naming.parent().unwrap_or(Path::new("")).join(&name.text);
            self.progress.begin(LoadStep::Reading(path.display().to_string()));
            let real = files::identity(&path);
            if real == own {
                let message = format!("the {kind} names itself as its ladder");
                let finding = Finding::new(Code::Controller, name.span, message);
                self.findings.push(finding.help("name a file with `[[program]]`").or_omit());
                whole = false;
                continue;
            }
            if let Some(first) = seen.get(&real) {
                let message = format!("`{}` is named twice", name.text);
                let finding = Finding::new(Code::Controller, name.span, message);
                let finding = finding.related(*first, "the same file");
                let finding = finding.help("remove one of the two").fix(possible(FixEdit::Delete));
                self.findings.push(finding);
                whole = false;
                continue;
            }
            seen.insert(real, name.span);
            match self.texts.read(&path) {
                Ok(bytes) => {
                    self.add(path.display().to_string(), &bytes);
                }
                Err(error) => {
                    let message = format!("cannot read `{}`: {error}", path.display());
                    let finding = Finding::new(Code::Controller, name.span, message);
                    let help = if error.kind() == ErrorKind::InvalidInput {
                        "name a ladder file".to_owned()
                    } else if error.kind() == ErrorKind::PermissionDenied {
                        "give the user that runs rungd the right to read it and its folders"
                            .to_owned()
                    } else {
                        format!("paths are relative to the {kind}")
                    };
                    self.findings.push(finding.help(help));
                    whole = false;
                }
            }
        }
        whole && !names.is_empty()
    }

    /// Adds a file of the library that a controller file names. Returns true if the library has it
    /// and it is not named twice.
    fn add_library(
        &mut self,
        name: &Text,
        text: Result<&str, (String, Help)>,
        seen: &mut HashMap<PathBuf, Span>,
    ) -> bool {
        let finding = |message| Finding::new(Code::Controller, name.span, message);
        let finding = match (text, seen.insert(PathBuf::from(&name.text), name.span)) {
            (Err((message, help)), _) => finding(message).help(help),
            (Ok(_), Some(first)) => finding(format!("`{}` is named twice", name.text))
                .related(first, "the same file")
                .help("remove one of the two")
                .fix(possible(FixEdit::Delete)),
            (Ok(text), None) => {
                self.add(name.text.clone(), text.as_bytes());
                return true;
            }
        };
        self.findings.push(finding);
        false
    }

    /// Resolves the ladder files of a controller file: all files from `first` on.
    fn controlled(&mut self, written: &WrittenController, first: usize) {
        self.with_settings(written, first, true);
    }

    /// Resolves the ladder files of these settings: all files from `first` on. Without a controller
    /// file, every device that the ladders name is accepted.
    fn with_settings(&mut self, written: &WrittenController, first: usize, has_controller: bool) {
        let first_file = FileId(first as u32);
        let (sizes, order) = (written.memory.clone(), written.order.clone());
        let devices = written.devices.iter().filter_map(|device| device.name.clone()).collect();
        let (progress, addresses) = (self.progress.clone(), written.strings.clone());
        let options =
            LoadOptions { sizes, order, devices, addresses, has_controller, first_file, progress };
        self.ladders(first, options);
    }

    /// Resolves the files from `first` on.
    fn ladders(&mut self, first: usize, options: LoadOptions) {
        if self.progress.is_over() {
            return;
        }
        // A file that is not UTF-8 would only cause further findings with the same reason.
        if self.findings.iter().any(|f| f.span.file.0 as usize >= first) {
            return;
        }
        let (program, found) = resolve_ladders(&self.files[first..], &options);
        self.findings.extend(library::offered(found, &self.files, options.has_controller));
        if let Some(program) = &program {
            self.lost.add_all(&program.lost);
        }
        self.program = program;
    }

    /// Resolves the settings of the controller file.
    fn settings(&mut self, written: &WrittenController) {
        let of_ladders = |finding: &Finding| finding.span.file != FileId(0);
        if self.progress.is_over() {
            return;
        }
        self.progress.begin(LoadStep::Settings);
        let whole = self.program.is_some()
            && !self.findings.iter().any(|f| of_ladders(f) && f.severity() == Severity::Error);
        let bare = Program::empty(written.memory.clone());
        let program = self.program.as_ref().unwrap_or(&bare);
        let (controller, mut found) = resolve_controller_within(written, program, &self.progress);
        // A tag that is itself wrong, or in a file that could not be read, already has a finding.
        found.retain(|finding| whole || finding.code != Code::UnknownName);
        self.findings.extend(found);
        self.controller = Some(controller);
    }

    fn has_error(&self) -> bool {
        self.findings.iter().any(|finding| finding.severity() == Severity::Error)
    }

    /// Applies the rules to the program, removes the allowed findings, and keeps the program only
    /// if no finding is an error.
    fn judge(&mut self) {
        if self.progress.is_over() {
            (self.program, self.controller) = (None, None);
            return;
        }
        if let (Some(program), Some(controller)) = (&mut self.program, &self.controller) {
            mark_mapped(program, controller);
            for Located { value: BlockId(at), .. } in &controller.retained_stages {
                program.blocks[*at as usize].retains_stages = true;
            }
        }
        if let Some(program) = &self.program {
            let retained = self.controller.as_ref().map_or(&[][..], |c| &c.retain);
            let outside = self.controller.as_ref().map(Controller::outside);
            let around =
                CheckInputs { retained, outside: outside.as_ref(), progress: &self.progress };
            if self.has_error() {
                let misplaced = self.findings.iter().any(|f| f.code == Code::OutOfPlace);
                self.findings.extend(check_partial(program, around, misplaced));
            } else {
                self.findings.extend(check_whole(program, around));
            }
            if let Some(trial) = &program.trial {
                let found = check_partial(trial, CheckInputs { retained: &[], ..around }, false);
                let of_trials = found.into_iter().filter(|f| program.layers.is_trial(f.span));
                self.findings.extend(of_trials);
            }
            // The controller file is read first.
            let controller = self.controller.as_ref().map(|_| FileId(0));
            self.findings = silence(program, std::mem::take(&mut self.findings), controller);
            self.findings = program.layers.placed_findings(std::mem::take(&mut self.findings));
        }
        self.lost.keep_sure(&mut self.findings);
        self.findings.sort_by_key(|f| (f.span.file, f.span.start, f.span.end, f.code));
        if self.has_error() || !self.lost.is_empty() || self.progress.is_over() {
            self.program = None;
            self.controller = None;
        }
    }
}

/// The text of a file. If it is not UTF-8, replacement characters stand for the invalid bytes, and
/// a finding names the first of them.
pub fn decode(bytes: &[u8], file: FileId) -> (String, Option<Finding>) {
    match std::str::from_utf8(bytes) {
        Ok(text) => (text.to_owned(), None),
        Err(error) => {
            let at = error.valid_up_to() as u32;
            let span = Span { file, start: at, end: at };
            let byte = bytes.get(at as usize).copied().unwrap_or(0);
            let message = format!("the file is not UTF-8 text: byte {at} is 0x{byte:02X}");
            let finding =
                Finding::new(Code::TomlSyntax, span, message).label("here").help(match bytes {
                    [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] => {
                        "save the file as UTF-8; now it is UTF-16"
                    }
                    _ => "save the file as UTF-8; now it may be Latin-1, or not a text",
                });
            (String::from_utf8_lossy(bytes).into_owned(), Some(finding))
        }
    }
}
