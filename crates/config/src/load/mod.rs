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
mod loaded;
mod named;
mod own_files;
pub mod side_ladders;
mod sides;
pub mod test_ladders;

use std::collections::HashSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};

pub use files::OpenTexts;
pub use files::{decode, identity, may_all_read, read_bytes};

use crate::controller::written::WrittenController;
use crate::controller::{self, Controller, LoadedPrograms, resolve_controller_within};
pub use loaded::Loaded;
use sides::SideFiles;

use rungd_base::progress::{LoadStep, Progress};
use rungd_engine::isa::{Address, BlockId};
use rungd_io::plant::settings::InputRule;
use rungd_language::check::{CheckInputs, check_partial, check_whole, silence};
use rungd_language::resolve::program::{Program, TagMeaning};
use rungd_language::resolve::{LoadOptions, resolve_ladders};
use rungd_language::source::file_kind;
use rungd_language::source::finding::{Code, Finding, Severity};
use rungd_language::source::span::{FileId, Located, SourceFile};

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
    loaded.ladders(0..loaded.files.len(), LoadOptions::default());
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
        loaded.controlled(&written, first..loaded.files.len());
    }
    loaded.settings(&written, SideFiles::Named(path, "controller file"));
    loaded.judge();
    loaded
}

/// The number of ladder files that the text of a controller file names: in a recording they follow
/// it, and the files of the ladders beside the controller's follow them.
pub fn ladders_named(controller: &str) -> usize {
    controller::read(controller, FileId(0)).0.map_or(0, |written| written.ladder.len())
}

/// Loads the files of a recording: the texts of a controller file, of its ladder files, and of the
/// ladders beside them, in order. No file is read.
pub fn recorded_files(files: &[SourceFile]) -> Loaded {
    let ladders = files.first().map_or(0, |controller| ladders_named(&controller.text));
    recorded_ladders(files, ladders)
}

/// As [`recorded_files`], with this number of ladder files instead of those that the controller
/// file names.
pub fn recorded_ladders(files: &[SourceFile], ladders: usize) -> Loaded {
    let mut loaded = Loaded { files: files.to_vec(), ..Loaded::default() };
    let Some(controller) = files.first() else { return loaded };
    let (written, found) = controller::read(&controller.text, FileId(0));
    loaded.findings.extend(found);
    let Some(written) = written else { return loaded };
    loaded.lost.add_settings(FileId(0), written.lost.clone());
    let ladders = 1..(1 + ladders).min(files.len());
    loaded.controlled(&written, ladders.clone());
    loaded.settings(&written, SideFiles::Given(ladders.end));
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

/// Marks the tags of all inputs and outputs of devices, of all bits that a simulated input follows,
/// and of all that is watched, as used, even if the ladder does not name them.
fn mark_mapped(program: &mut Program, controller: &Controller) {
    let devices = &controller.devices;
    let inputs = devices.iter().flat_map(|device| &device.inputs).map(|input| input.address);
    let outputs = devices.iter().flat_map(|device| &device.outputs).map(|output| output.address);
    let followed =
        controller.rules.iter().flat_map(InputRule::reads).map(|read| Address::Bit(read.bit));
    let watched = controller.watches.reads();
    let mapped: HashSet<Address> = inputs.chain(outputs).chain(followed).chain(watched).collect();
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
    /// Resolves the ladder files of a controller file.
    fn controlled(&mut self, written: &WrittenController, files: Range<usize>) {
        self.with_settings(written, files, true);
    }

    /// Resolves the ladder files of these settings. Without a controller file, every device that
    /// the ladders name is accepted.
    fn with_settings(
        &mut self,
        written: &WrittenController,
        files: Range<usize>,
        has_controller: bool,
    ) {
        let first_file = FileId(files.start as u32);
        let (sizes, order) = (written.memory.clone(), written.order.clone());
        let devices = written.devices.iter().filter_map(|device| device.name.clone()).collect();
        let (progress, addresses) = (self.progress.clone(), written.strings.clone());
        let options =
            LoadOptions { sizes, order, devices, addresses, has_controller, first_file, progress };
        self.ladders(files, options);
    }

    /// Resolves these files.
    fn ladders(&mut self, files: Range<usize>, options: LoadOptions) {
        self.ladders = files.len();
        if self.progress.is_over() || self.has_finding_in(&files) {
            return;
        }
        let (program, found) = resolve_ladders(&self.files[files], &options);
        self.findings.extend(library::offered(found, &self.files, options.has_controller));
        if let Some(program) = &program {
            self.lost.add_all(&program.lost);
        }
        self.program = program;
    }

    /// Loads the ladders beside the program, and resolves the settings of the controller file.
    fn settings(&mut self, written: &WrittenController, files: SideFiles<'_>) {
        let of_ladders = |finding: &Finding| finding.span.file != FileId(0);
        let whole = self.program.is_some()
            && !self.findings.iter().any(|f| of_ladders(f) && f.severity() == Severity::Error);
        let sides = self.side_ladders(written, files);
        if self.progress.is_over() {
            return;
        }
        self.progress.begin(LoadStep::Settings);
        let bare = Program::empty(written.memory.clone());
        let program = self.program.as_ref().unwrap_or(&bare);
        let programs = LoadedPrograms { program, sides: &sides };
        let (controller, mut found) = resolve_controller_within(written, programs, &self.progress);
        // A tag that is itself wrong, or in a file that could not be read, already has a finding.
        found.retain(|finding| whole || finding.code != Code::UnknownName);
        self.findings.extend(found);
        self.controller = Some(controller);
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
        let controller = self.controller.take();
        self.judge_sides(controller.as_ref());
        self.controller = controller;
        self.put_in_order();
        if self.is_refused() {
            self.program = None;
            self.controller = None;
        }
    }
}
