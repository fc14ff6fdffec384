//! The programs of a test file: the program with which scenarios begin, and the programs of
//! `reload` steps.
//!
//! Called by `reading`. Each list of files is loaded once. Files that a reload of the daemon
//! refuses are refused here too (`daemon::reload::ready`).

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::names::{Observation, TestNames, TestTarget};
use super::step_words::StepWord;
use super::suite::{ProgramId, TestProgram};
use rungd_config::controller::device::{Device, DriverSettings};
use rungd_config::controller::side_ladder::operand_of;
use rungd_config::controller::simulated_side::SimulatedSide;
use rungd_config::controller::written::WrittenController;
use rungd_config::controller::{self, Controller};
pub use rungd_config::load::test_ladders::{
    InputKind, SettingsFile, bench, identity_of, input_kind, path_of,
};
use rungd_config::load::{self, Loaded, OpenTexts};
use rungd_language::lower::lower;
use rungd_language::resolve::LoadOptions;
use rungd_language::resolve::program::Program;
use rungd_language::source::finding::{Code, Finding, Severity};
use rungd_language::source::fix::{FixEdit, advise, possible, proposed};
use rungd_language::source::render::{Style, render};
use rungd_language::source::span::{FileId, Span};
use rungd_state::reload;

/// The maximum number of programs of a test file.
const PROGRAMS_MAX: usize = 100;

/// The files of a program.
#[derive(PartialEq)]
struct FileList {
    /// A controller file, or ladders.
    kind: InputKind,
    identities: Vec<PathBuf>,
}

/// A test file.
pub(super) struct TestFile<'a> {
    pub path: &'a Path,
    /// The texts that replace files on disk.
    pub texts: &'a OpenTexts,
    /// What its conditions see beside the memory of the controller.
    pub observation: Observation,
}

/// A program, with the names of its files as the test file has them.
pub(super) struct NamedProgram<'n> {
    pub program: TestProgram,
    pub files: &'n [String],
}

/// The result of a load, one for each list of files.
#[derive(Clone, Debug)]
pub(super) enum ProgramLoad {
    /// The program can run.
    Ready(ProgramId),
    /// The files are refused, with this text.
    Refused(String),
}

/// The settings for the ladders of scenarios.
pub(super) enum BenchSettings {
    /// The settings of the test file.
    Test(Box<WrittenController>),
    /// The settings of a controller file.
    Controller,
}

/// All programs that have been loaded so far.
pub(super) struct Programs<'a> {
    /// The test file.
    pub path: &'a Path,
    texts: &'a OpenTexts,
    observation: Observation,
    settings: BenchSettings,
    options: &'a LoadOptions,
    pub programs: Vec<TestProgram>,
    pub names: Vec<TestNames<'a>>,
    /// The names in the ladders of field devices, by the names of the devices.
    devices: Vec<(String, TestNames<'a>)>,
    loads: Vec<(FileList, ProgramLoad)>,
    /// The kinds of the files that have been named so far, by their identities.
    kinds: HashMap<PathBuf, InputKind>,
}

impl<'a> Programs<'a> {
    /// The list with only the program with which scenarios begin.
    pub fn new(
        TestFile { path, texts, observation }: TestFile<'a>,
        settings: BenchSettings,
        first: NamedProgram,
        options: &'a LoadOptions,
    ) -> Programs<'a> {
        let kind = match settings {
            BenchSettings::Test(_) => InputKind::Ladder,
            BenchSettings::Controller => InputKind::Controller,
        };
        let identities = first.files.iter().map(|name| identity_of(path, name)).collect();
        let mut programs = Programs {
            path,
            texts,
            observation,
            settings,
            options,
            programs: Vec::new(),
            names: Vec::new(),
            devices: Vec::new(),
            loads: Vec::new(),
            kinds: HashMap::new(),
        };
        let id = programs.add(first.program);
        let controller = Arc::clone(&programs.programs[0].controller);
        controller.sides.iter().for_each(|side| programs.add_side(side));
        controller.devices.iter().for_each(|device| programs.add_plant(device));
        programs.loads.push((FileList { kind, identities }, ProgramLoad::Ready(id)));
        programs
    }

    fn add(&mut self, program: TestProgram) -> ProgramId {
        let mut names = TestNames::of(&program, &self.observation, self.options);
        let has_ladder =
            |device: &&Device| self.devices.iter().any(|(name, _)| *name == device.name);
        let devices = program.controller.devices.iter().filter(has_ladder);
        devices.for_each(|device| names.moved_by(device));
        self.names.push(names);
        self.programs.push(program);
        ProgramId(self.programs.len() - 1)
    }

    /// The programs, with their views: all conditions are resolved.
    pub fn finish(self) -> Vec<TestProgram> {
        let views = self.names.into_iter().map(TestNames::into_view);
        let viewed = |(program, view)| TestProgram { view, ..program };
        self.programs.into_iter().zip(views).map(viewed).collect()
    }

    /// Adds the own side of a Modbus device of the first program, in place of that of the
    /// controller file.
    pub fn add_side(&mut self, side: &SimulatedSide) {
        let controller = Arc::clone(&self.programs[0].controller);
        if let Some(device) = controller.devices.iter().find(|device| device.id == side.device) {
            self.add_ladder(device, &side.program, |_| {});
            self.names[0].moved_by(device);
        }
    }

    /// Adds a device of the first program, if it is a ladder.
    fn add_plant(&mut self, device: &Device) {
        if let DriverSettings::Ladder(plant) = &device.driver {
            self.add_ladder(device, &plant.program, |names| {
                names.moved_by_map(&device.name, plant);
            });
        }
    }

    fn add_ladder(
        &mut self,
        device: &Device,
        program: &Arc<Program>,
        moved: impl FnOnce(&mut TestNames<'_>),
    ) {
        let controller = Arc::new(Controller::usual(program));
        let program = Arc::clone(program);
        let ladder = TestProgram { program, controller, files: Vec::new(), view: None };
        let mut names = TestNames::of(&ladder, &Observation::default(), self.options);
        moved(&mut names);
        self.devices.retain(|(known, _)| *known != device.name);
        self.devices.push((device.name.clone(), names.of_device(device)));
    }

    /// An operand that a test may set: of a program, or of the ladder of a field device
    /// (`drive1.fault`).
    ///
    /// # Errors
    /// The finding about the name.
    pub fn written(&self, id: ProgramId, name: &str, span: Span) -> Result<TestTarget, Finding> {
        match self.of_device(name) {
            Some((names, rest)) => named(names.written(rest, span), name),
            None => self.names[id.0].written(name, span),
        }
    }

    /// As [`Programs::written`], for what a scenario sets before its first scan: retained Stages,
    /// too.
    ///
    /// # Errors
    /// The finding about the name.
    pub fn before_start(
        &self,
        id: ProgramId,
        name: &str,
        span: Span,
    ) -> Result<TestTarget, Finding> {
        let stored = self.names[id.0].stored(name, span);
        stored.unwrap_or_else(|| self.written(id, name, span))
    }

    /// As [`Programs::written`], for an operand that a test may force.
    ///
    /// # Errors
    /// The finding about the name.
    pub fn forced(&self, id: ProgramId, name: &str, span: Span) -> Result<TestTarget, Finding> {
        match self.of_device(name) {
            Some((names, rest)) => named(names.forced(rest, span), name),
            None => self.names[id.0].forced(name, span),
        }
    }

    /// The names of the ladder of a field device, and the name in it.
    fn of_device<'n>(&self, name: &'n str) -> Option<(&TestNames<'a>, &'n str)> {
        self.devices.iter().find_map(|(device, names)| Some((names, operand_of(name, device)?)))
    }

    /// The result of a reload of these files.
    ///
    /// # Errors
    /// The files cannot be read, or cannot be reloaded together.
    pub fn reload(&mut self, files: &[StepWord]) -> Result<ProgramLoad, Finding> {
        let list = self.list(files)?;
        if let Some((_, known)) = self.loads.iter().find(|(known, _)| *known == list) {
            return Ok(known.clone());
        }
        if self.loads.len() == PROGRAMS_MAX {
            let place = files.first().map_or_else(Default::default, |file| file.span);
            let message = format!("more than {PROGRAMS_MAX} lists of files");
            let finding = Finding::new(Code::TestStep, place, message);
            return Err(finding.help("divide the test file into several files"));
        }
        let loaded = self.load(files, list.kind)?;
        let load = match self.refusal(&loaded) {
            Some(text) => ProgramLoad::Refused(text),
            None => match test_program(loaded) {
                Ok(program) => {
                    let id = self.add(program);
                    let mut mistakes = std::mem::take(&mut self.names[id.0].mistakes).into_iter();
                    if let Some(mistake) =
                        mistakes.find(|mistake| mistake.severity() == Severity::Error)
                    {
                        return Err(of_observer(files, mistake));
                    }
                    ProgramLoad::Ready(id)
                }
                Err(loaded) => ProgramLoad::Refused(findings_text(&loaded)),
            },
        };
        self.loads.push((list, load.clone()));
        Ok(load)
    }

    /// The identity of a list of files.
    fn list(&mut self, files: &[StepWord]) -> Result<FileList, Finding> {
        let mut identities: Vec<PathBuf> = Vec::new();
        let mut seen: HashSet<PathBuf> = HashSet::new();
        let mut controller = None;
        for file in files {
            let finding = |message: String| Finding::new(Code::TestStep, file.span, message);
            let identity = identity_of(self.path, &file.value);
            let kind =
                match self.kinds.get(&identity) {
                    Some(kind) => *kind,
                    None => input_kind(&path_of(self.path, &file.value), self.texts).map_err(
                        |reason| finding(reason).help("paths are relative to the test file"),
                    )?,
                };
            self.kinds.insert(identity.clone(), kind);
            if kind == InputKind::Controller {
                controller = Some(file);
            }
            if !seen.insert(identity.clone()) {
                let finding = finding(format!("`{}` is named twice", file.value));
                return Err(finding.help("remove one of the two").fix(possible(FixEdit::Delete)));
            }
            identities.push(identity);
        }
        match controller {
            None => Ok(FileList { kind: InputKind::Ladder, identities }),
            Some(_) if files.len() == 1 => Ok(FileList { kind: InputKind::Controller, identities }),
            Some(file) => {
                let message =
                    format!("`{}` is a controller file, given with other files", file.value);
                let finding = Finding::new(Code::TestStep, file.span, message);
                let alone = [proposed(format!("reload {}", file.value))];
                Err(finding.help(advise("name it alone, `{}`, or name ladders alone", alone)))
            }
        }
    }

    fn load(&self, files: &[StepWord], kind: InputKind) -> Result<Loaded, Finding> {
        let names: Vec<String> = files.iter().map(|file| file.value.clone()).collect();
        let place = files.first().map_or_else(Default::default, |file| file.span);
        if kind == InputKind::Controller {
            return load::controller_among(&path_of(self.path, &names[0]), self.texts)
                .map_err(|failure| Finding::new(Code::TestStep, place, format!("{failure:#}")));
        }
        let first = &self.programs[0].files[0];
        match &self.settings {
            BenchSettings::Test(settings) => {
                let settings = settings.of_test_with_ladder(&names);
                {
                    let file = SettingsFile { file: first.clone(), kind: InputKind::Ladder };
                    Ok(bench(self.path, file, &settings, self.texts))
                }
            }
            BenchSettings::Controller => {
                let (written, _) = controller::read(&first.text, FileId(0));
                match written {
                    Some(written) => {
                        let (file, kind) = (first.clone(), InputKind::Controller);
                        let file = SettingsFile { file, kind };
                        Ok(bench(self.path, file, &written.with_ladder(&names), self.texts))
                    }
                    None => Ok(Loaded::default()),
                }
            }
        }
    }

    /// The reason why a reload refuses files; `None`: it accepts them.
    fn refusal(&self, loaded: &Loaded) -> Option<String> {
        let (Some(program), Some(_)) = (&loaded.program, &loaded.controller) else {
            return Some(findings_text(loaded));
        };
        let running = &self.programs[0].program;
        let file = loaded.files.first().map_or("", |file| file.name.as_str());
        if program.devices != running.devices {
            return Some(format!("{file}: {}", reload::OTHER_DEVICES));
        }
        if program.sizes != running.sizes {
            return Some(format!("{file}: {}", reload::OTHER_SIZES));
        }
        let devices = &self.programs[0].controller.devices;
        if devices.is_empty() {
            return None;
        }
        let ((_, first), (_, next)) = (lower(running), lower(program));
        let misfit = reload::misfit(devices.iter().flat_map(Device::wired), &first, &next);
        misfit.map(|why| format!("{file}: {why}"))
    }
}

/// A target with its name as the test file has it.
fn named(target: Result<TestTarget, Finding>, name: &str) -> Result<TestTarget, Finding> {
    target.map(|mut target| {
        target.operand.name = name.to_owned();
        target
    })
}

/// The finding about an observer that does not fit the program of a `reload` step.
fn of_observer(files: &[StepWord], mistake: Finding) -> Finding {
    let place = files.first().map_or_else(Default::default, |file| file.span);
    let message = format!("the observer does not fit this program: {}", mistake.message);
    Finding::new(Code::TestStep, place, message).with_help_of(mistake)
}

/// The findings of a load, as a command prints them.
fn findings_text(loaded: &Loaded) -> String {
    render(&loaded.findings, &loaded.files, Style::default())
}

/// The program of a load.
pub(super) fn test_program(loaded: Loaded) -> Result<TestProgram, Box<Loaded>> {
    match loaded {
        Loaded {
            mut files, program: Some(program), controller: Some(controller), ladders, ..
        } => {
            let (program, controller) = (Arc::new(program), Arc::new(controller));
            files.truncate(1 + ladders);
            Ok(TestProgram { program, controller, files, view: None })
        }
        refused => Err(Box::new(refused)),
    }
}
