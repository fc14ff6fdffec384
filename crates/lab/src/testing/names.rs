//! The names of a program under test: the operands and devices that a step may set, force, wait for
//! or lose.
//!
//! Made by `programs`, one for each program of a test file; used by `steps` and `random`. A test
//! may write the same operands as the simulator ([`StimulusTarget::at`]), and force the same bits
//! as an operator ([`rungd_engine::isa::Bit::forcible`]).

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::condition::Condition;
use super::device_names::DeviceNames;
use super::step_words::StepWord;
use super::suite::{TestOperand, TestProgram};
use super::view::{View, ViewDraft};
use crate::traces::stimulus::StimulusTarget;
use rungd_config::controller::device::Device;
use rungd_engine::Cell;
use rungd_engine::isa::{Address, Bit, BitSpace, DeviceId, StageId};
use rungd_io::ladder::settings::LadderSettings;
use rungd_language::check::{CheckInputs, check_partial, silence};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::LoadOptions;
use rungd_language::resolve::condition::{ConditionNames, not_in_ladder};
use rungd_language::resolve::observed::{ObservedProgram, ShownOperand, lies_within};
use rungd_language::resolve::observer::{ObserverText, observed};
use rungd_language::resolve::program::Program;
use rungd_language::resolve::scope::{LookUp, NamedThing};
use rungd_language::source::condition::WrittenCondition;
use rungd_language::source::finding::{Code, Finding, Severity};
use rungd_language::source::fix::{advise, one_of, pair, possible, proposed};
use rungd_language::source::nearest::KnownNames;
use rungd_language::source::observer;
use rungd_language::source::span::{FileId, Located, SourceFile, Span};
use rungd_language::source::was;

/// What the conditions of a test file see beside the memory of the controller.
#[derive(Clone, Debug, Default)]
pub(super) struct Observation {
    /// The test file, if it has an observer.
    pub observer: Option<SourceFile>,
    /// The names `was(x)`, each once.
    pub was: Vec<String>,
    /// The operands of the own ladders of field devices, each once.
    pub shown: Vec<ShownOperand>,
    /// The findings about names in conditions that no ladder of their device has.
    pub unknown: Vec<Finding>,
}

/// The number of the test file in the findings about its observer.
pub(super) const OBSERVER: FileId = FileId(u32::MAX >> 2);

impl Observation {
    /// Adds the operands of the own ladders of field devices in a condition.
    pub fn show(&mut self, written: &WrittenCondition, ladders: &[DeviceNames]) {
        for Located { value, span } in was::all_names(&written.contact) {
            let Some(ladder) = ladders.iter().find(|ladder| ladder.has(&value)) else { continue };
            match ladder.shown(&value, was::place_of_name(written.text_of(span), span)) {
                Ok(shown) => self.shown.push(shown),
                Err(unknown) => self.unknown.push(unknown),
            }
        }
        let mut seen = HashSet::new();
        self.shown.retain(|shown| seen.insert(shown.name.clone()));
    }

    /// Adds the names `was(x)` of a condition.
    pub fn remember(&mut self, written: &WrittenCondition) {
        was::add_names(&written.contact, &mut self.was);
    }

    /// A program as the conditions see it, and the findings about the observer.
    fn observed(&self, test_program: &TestProgram) -> Option<(ObservedProgram, Vec<Finding>)> {
        if self.was.is_empty() && self.shown.is_empty() && self.observer.is_none() {
            return None;
        }
        let mut files = test_program.files.clone();
        let file = FileId(files.len() as u32);
        files.extend(self.observer.clone());
        let text = self.observer.as_ref().map(|file| file.text.as_str());
        let ladder = text.and_then(|text| observer::again(text, file));
        let text = ladder.map(|ladder| ObserverText { files: &files, ladder });
        let program = &test_program.program;
        let (mut observed, mut findings) = match text {
            Some(text) => observed(program, text),
            None => {
                let bare = ObservedProgram::bare(Program::clone(program), program.sizes.clone());
                (bare, Vec::new())
            }
        };
        observed.show(&self.shown);
        observed.remember(&self.was);
        if !findings.iter().any(|finding| finding.severity() == Severity::Error) {
            findings.extend(doubts(&observed.program, file));
        }
        for finding in &mut findings {
            let places = finding.related.iter_mut().map(|(place, _)| place);
            let own = places.chain([&mut finding.span]).filter(|place| place.file == file);
            own.for_each(|place| place.file = OBSERVER);
        }
        Some((observed, findings))
    }
}

/// The findings about an observer by the rules for single instructions and contacts, and for their
/// places. What nothing writes or resets, a test sets and a cold start resets.
fn doubts(program: &Program, file: FileId) -> Vec<Finding> {
    let found = silence(program, check_partial(program, CheckInputs::of(&[]), false), None);
    let mut found = program.layers.placed_findings(found);
    found.retain(|finding| finding.span.file == file);
    found
}

/// The names of a program, and their cells.
pub(super) struct TestNames<'a> {
    conditions: ConditionNames<'a>,
    symbols: Symbols,
    view: Option<ViewDraft>,
    /// The findings about the observer. Places in the test file have the number [`OBSERVER`].
    pub mistakes: Vec<Finding>,
    /// The addresses that are written in every scan, each with its writer: `device `plant``.
    moved: HashMap<Address, String>,
    devices: KnownNames,
    /// The device in whose ladder the names are; `None`: they are the controller's.
    device: Option<DeviceId>,
    /// What stands before its names in a test: `tank.`, or nothing.
    prefix: String,
    /// The findings about names in conditions that no ladder of their device has.
    unknown: Vec<Finding>,
}

/// An operand that a test writes or forces, and the values that it takes.
#[derive(Clone, Debug)]
pub(super) struct TestTarget {
    pub operand: TestOperand,
    pub takes: StimulusTarget,
}

impl<'a> TestNames<'a> {
    pub fn of(
        test_program: &TestProgram,
        observation: &Observation,
        options: &'a LoadOptions,
    ) -> TestNames<'a> {
        let TestProgram { program, controller, .. } = test_program;
        let (observed, mistakes) = observation.observed(test_program).unzip();
        let mistakes: Vec<Finding> = mistakes.unwrap_or_default();
        // A program with an error is never lowered.
        let is_whole = !mistakes.iter().any(|finding| finding.severity() == Severity::Error);
        let symbols = lower(program).1;
        let conditions = match &observed {
            Some(observed) => ConditionNames::observing(observed, options),
            None => ConditionNames::of(program, options),
        };
        TestNames {
            conditions,
            view: observed
                .filter(|_| is_whole)
                .map(|observed| ViewDraft::new(observed, &symbols.layout)),
            symbols,
            mistakes,
            moved: controller.simulated(),
            devices: KnownNames::new(program.devices.iter().map(String::as_str)),
            device: None,
            prefix: String::new(),
            unknown: observation.unknown.clone(),
        }
    }

    /// The same names, in the ladder of a device.
    pub fn of_device(self, device: &Device) -> TestNames<'a> {
        TestNames { device: Some(device.id), prefix: format!("{}.", device.name), ..self }
    }

    /// Adds addresses that a device writes in every scan.
    pub fn moved_by(&mut self, device: &Device) {
        let mover = format!("device `{}`", device.name);
        self.moved.extend(device.inputs.iter().map(|input| (input.address, mover.clone())));
    }

    /// Adds addresses of a plant's ladder that the map of the plant writes in every scan.
    pub fn moved_by_map(&mut self, device: &str, plant: &LadderSettings) {
        let mover = format!("the map of `{device}`");
        self.moved.extend(plant.outputs.iter().map(|point| (point.address, mover.clone())));
    }

    /// A condition over the program's cells.
    ///
    /// # Errors
    /// The findings about it.
    pub fn condition(&mut self, written: &WrittenCondition) -> Result<Condition, Vec<Finding>> {
        let place = written.span;
        let is_here = |found: &&Finding| {
            found.span.file == place.file && (place.start..=place.end).contains(&found.span.start)
        };
        let unknown: Vec<Finding> = self.unknown.iter().filter(is_here).cloned().collect();
        if !unknown.is_empty() {
            return Err(unknown);
        }
        let resolved = self.conditions.resolve(written)?;
        let layout = match &mut self.view {
            Some(view) => {
                view.reads(&resolved.contact);
                &view.view().symbols.layout
            }
            None => &self.symbols.layout,
        };
        Ok(Condition::new(&written.text, resolved, layout))
    }

    /// The view of the conditions that were resolved, if they need one.
    pub fn into_view(self) -> Option<Arc<View>> {
        self.view.map(ViewDraft::finish)
    }

    /// A device.
    pub fn device(&self, word: &StepWord) -> Result<DeviceId, Finding> {
        let name = &word.value;
        if let Ok(LookUp { thing: NamedThing::Device(id), .. }) =
            self.conditions.scope().look_up(name)
        {
            return Ok(id);
        }
        let finding = |message: String| Finding::new(Code::TestStep, word.span, message);
        if self.devices.iter().len() == 0 {
            let finding = finding(format!("there is no device `{name}`"));
            let controller = pair("controller = \"rungd.toml\"").possible();
            let words = "field devices are those of a controller file: `{}`";
            return Err(finding.help(advise(words, [controller])));
        }
        let help = one_of("there is", self.devices.iter().take(12));
        Err(finding(format!("no device is called `{name}`")).help(help).near(name, &self.devices))
    }

    /// The field devices, with their names.
    pub fn devices(&self) -> impl Iterator<Item = (DeviceId, &str)> {
        let scope = self.conditions.scope();
        self.devices.iter().filter_map(|name| match scope.look_up(name) {
            Ok(LookUp { thing: NamedThing::Device(id), .. }) => Some((id, name)),
            Ok(_) | Err(_) => None,
        })
    }

    /// The address of a name in a test.
    fn address(&self, name: &str, span: Span) -> Result<Address, Finding> {
        let scope = self.conditions.scope();
        match scope.look_up(name) {
            Ok(LookUp { thing: NamedThing::Address(address), .. }) => {
                match lies_within(address, self.symbols.layout.sizes()) {
                    true => Ok(address),
                    false => Err(of_observer(name, span)),
                }
            }
            Ok(_) => {
                let message = scope.address(name).err().unwrap_or_default();
                let finding = Finding::new(Code::OperandType, span, message);
                let words = "name one bit or one word: `{}`, `X0`, `{}`, `recipe[3]`";
                Err(finding.help(advise(words, ["bottle", "late.Acc"].map(possible))))
            }
            Err(mistake) => {
                let finding = mistake.finding(span);
                let finding = finding.map(|finding| finding.declared_as(not_in_ladder));
                Err(finding.unwrap_or_else(|| {
                    Finding::new(Code::UnknownName, span, format!("nothing is called `{name}`"))
                }))
            }
        }
    }

    /// An operand that a queued write or an input may change.
    pub fn written(&self, name: &str, span: Span) -> Result<TestTarget, Finding> {
        let address = self.address(name, span)?;
        let finding = |message: String| Finding::new(Code::TestStep, span, message);
        if let Some(mover) = self.moved.get(&address) {
            let whole = format!("{}{name}", self.prefix);
            let finding = finding(format!("`{whole}` is moved by {mover} at every scan"));
            let force = [proposed(format!("force {whole} 1"))];
            return Err(finding.help(advise("force it, `{}`, or use a fault of the plant", force)));
        }
        if let Address::Bit(Bit::Device(id, _)) = address {
            let device = self.symbols.names.device(id);
            let finding =
                finding(format!("`{name}` shows the state of the device: nothing else writes it"));
            let steps = [format!("lose {device}"), format!("restore {device}")].map(possible);
            return Err(finding.help(advise("write `{}`, `{}`", steps)));
        }
        let takes = StimulusTarget::at(address, name, &self.symbols).map_err(|message| {
            let finding = finding(message);
            match address {
                Address::Bit(bit) if bit.forcible() => {
                    finding.help(advise("force it: `{}`", [proposed(format!("force {name} 1"))]))
                }
                Address::Bit(_) | Address::Word(_) => {
                    finding.help("the ladder changes it: set what the ladder reads").or_omit()
                }
                Address::Structure(structure) => {
                    let members = structure.members().iter();
                    let members = members.map(|member| possible(format!("{name}.{member}")));
                    finding
                        .help("one bit or one word is set: a structure has several")
                        .fixes(members)
                }
            }
        })?;
        Ok(self.target(name, address, takes))
    }

    /// A retained Stage, or `.Running` of its Program, as a scenario sets it before its first scan:
    /// what retentive memory holds of it. `None`: the name is something else.
    pub fn stored(&self, name: &str, span: Span) -> Option<Result<TestTarget, Finding>> {
        let names = &self.symbols.names;
        let (program, stage) = match self.address(name, span).ok()? {
            Address::Bit(Bit::Running(program)) => (program, None),
            Address::Bit(Bit::Stage(StageId(stage))) => {
                let (before, rest) = names.stages.split_at(stage as usize);
                let program = rest.first()?.block;
                let before = before.iter().filter(|stage| stage.block == program);
                (program, Some(before.count() as u32))
            }
            Address::Bit(_) | Address::Word(_) | Address::Structure(_) => return None,
        };
        let program_name = &names.block(program).name;
        let kept = self.symbols.identity.kept.iter().find(|kept| kept.program == program);
        let bit = match (kept, stage) {
            (Some(kept), Some(stage)) => kept.stage(stage),
            (Some(kept), None) if program_name != "Main" => kept.running(),
            (None, Some(_)) => {
                let message =
                    format!("`{name}` is set, and no Stages of {program_name} are retained");
                let finding = Finding::new(Code::TestStep, span, message);
                let retained = possible(format!("stages = [\"{program_name}\"]"));
                let words = "retain them, by `{}` in `[retain]`, or let steps lead into the Stage";
                return Some(Err(finding.help(advise(words, [retained]))));
            }
            (Some(_) | None, None) => return None,
        };
        let operand =
            TestOperand { name: name.to_owned(), cell: Cell::Bit(bit), input: None, device: None };
        Some(Ok(TestTarget { operand, takes: StimulusTarget::Bit(Cell::Bit(bit)) }))
    }

    /// An operand that may be forced.
    pub fn forced(&self, name: &str, span: Span) -> Result<TestTarget, Finding> {
        let address = self.address(name, span)?;
        let takes = match address {
            Address::Bit(Bit::Space(BitSpace::X, n)) => Ok(StimulusTarget::Input(n)),
            Address::Bit(bit) if bit.forcible() => {
                Ok(StimulusTarget::Bit(self.symbols.layout.bit_in(bit)))
            }
            Address::Bit(Bit::Space(..)) => {
                Err(format!("`{name}` cannot be forced: it shows the state of the controller"))
            }
            Address::Bit(Bit::InWord(_)) => {
                Err(format!("`{name}` cannot be forced: its whole word can"))
            }
            Address::Bit(_) => Err(format!("`{name}` cannot be forced: the ladder switches it")),
            Address::Word(_) | Address::Structure(_) => {
                StimulusTarget::at(address, name, &self.symbols)
            }
        };
        let takes = takes.map_err(|message| {
            let finding = Finding::new(Code::TestStep, span, message);
            finding.help("force what the ladder reads there: an input, a bit, a word").or_omit()
        })?;
        Ok(self.target(name, address, takes))
    }

    fn target(&self, name: &str, address: Address, takes: StimulusTarget) -> TestTarget {
        let cell = match takes {
            StimulusTarget::Bit(cell) => cell,
            StimulusTarget::Word(cell, _) | StimulusTarget::Real(cell, _) => Cell::Word(cell),
            StimulusTarget::Input(n) => {
                Cell::Bit(self.symbols.layout.bit(Bit::Space(BitSpace::X, n)))
            }
        };
        let input = match address {
            Address::Bit(Bit::Space(BitSpace::X, n)) => Some(n),
            Address::Bit(_) | Address::Word(_) | Address::Structure(_) => None,
        };
        TestTarget {
            operand: TestOperand { name: name.to_owned(), cell, input, device: self.device },
            takes,
        }
    }
}

/// The finding for a tag of the observer that a test would change.
fn of_observer(name: &str, span: Span) -> Finding {
    let message = format!("`{name}` belongs to the observer: its rungs alone write it");
    let finding = Finding::new(Code::TestStep, span, message);
    finding.help("set what its rungs read").or_omit()
}
