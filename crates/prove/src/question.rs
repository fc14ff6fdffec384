//! The questions of a test file: its lines, and the model about which they are asked.
//!
//! Called by `rungd prove`. `model` has no names; here each line, side and input keeps its own, so
//! that answers can be told and tried.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::any::{AnyProgram, AnyValue, any_in};
use crate::asked_events::{DOWN_SECONDS, EventQuestion, has_older_images};
use crate::cone::Cone;
use crate::encode::written_limits;
use crate::gates::GateCut;
use crate::given_inputs::{LostDevice, lost_devices, scan_times};
use crate::inputs::{brought, is_input, named, range, x_number};
use crate::model::{FreeInput, ProofModel, ProofStart, Target};
use crate::named_input::{InputSetting, NamedInput};
use crate::retained::{RetainedStart, retained};
use crate::retained_stages::StageStarts;
use rungd_engine::isa::{Address, Bit, DeviceBit, DeviceId};
use rungd_engine::{Cell, Engine, EngineProgram, Layout};
use rungd_lab::rig::RigProgram;
use rungd_lab::testing::{self, Condition, FreeOperand, ProofEvent, Suite, TestOperand};
use rungd_language::lower::judged::{JudgeBlocks, Judges, lower_judged};
use rungd_language::resolve::observed::Remembered;
use rungd_language::resolve::program::{Contact, Program};

/// The questions of a test file.
pub struct Questions {
    /// The test file.
    pub suite: Suite,
    /// Its programs, lowered for the rig.
    pub programs: Vec<Arc<RigProgram>>,
    /// The model of all lines.
    pub model: ProofModel,
    /// The blocks of the model that judge it.
    pub(crate) judges: JudgeBlocks,
    /// What [`ProofModel::inputs`] are for people, in the same order.
    pub inputs: Vec<NamedInput>,
    /// The lines of `always`, in file order.
    pub lines: Vec<AlwaysLine>,
    /// The lines of `can`, in file order.
    pub can: Vec<CanLine>,
    /// What `[prove]` asks for, and no way can do yet.
    pub(crate) unknown: Option<String>,
}

/// A line of `can`.
pub struct CanLine {
    /// Its text.
    pub text: String,
    /// What some inputs lead to.
    pub target: Target,
}

/// A line of `always`.
pub struct AlwaysLine {
    /// Its number in the file.
    pub number: usize,
    /// Its text.
    pub text: String,
    /// Where it is broken.
    pub target: Target,
    /// Why no proof is about it.
    pub outside: Option<String>,
    /// What may not be all at once, each with where it is so.
    pub sides: Vec<(Condition, Target)>,
}

impl Questions {
    /// The questions of a test file.
    pub fn new(suite: Suite) -> Questions {
        let programs = testing::programs(&suite);
        let first = &suite.programs[0];
        let seen = first.view.as_ref().map(|view| view.observed());
        let program: &Program = seen.map_or(&first.program, |observed| &observed.program);
        let layout =
            first.view.as_ref().map_or(&programs[0].symbols.layout, |view| &view.symbols.layout);
        let mut lines = Vec::new();
        let mut behind: Vec<Contact> = Vec::new();
        for (number, condition) in suite.always[0].iter().enumerate() {
            behind.push(condition.contact.clone());
            let sides = condition.sides(&suite.file, layout);
            behind.extend(sides.iter().map(|side| side.contact.clone()));
            lines.push((number, condition.text.clone(), sides));
        }
        behind.extend(suite.proof.can.iter().map(|condition| condition.contact.clone()));
        let asked =
            ModelledProgram { program, judges: Judges { behind: &behind, ..Judges::default() } };
        let ModelWithNames { model, inputs, unknown, judges } = asked.model(&suite, &programs[0]);
        let mut bits = model.judged.iter().copied();
        let mut target = |value| Target { bit: bits.next().expect("a bit a condition"), value };
        let lines = lines.into_iter().map(|(number, text, sides)| AlwaysLine {
            number,
            text,
            target: target(false),
            outside: suite.proof.outside.get(number).cloned().flatten(),
            sides: sides.into_iter().map(|side| (side, target(true))).collect(),
        });
        let lines = lines.collect();
        let can = suite.proof.can.iter();
        let can = can.map(|line| CanLine { text: line.text.clone(), target: target(true) });
        let can = can.collect();
        Questions { model, judges, inputs, lines, can, unknown, programs, suite }
    }

    /// Keeps the inputs whose cells fulfil a condition; the others keep their levels.
    pub(crate) fn keep_inputs(&mut self, keeps: impl Fn(Cell) -> bool) {
        let inputs = std::mem::take(&mut self.model.inputs).into_iter();
        let named = std::mem::take(&mut self.inputs).into_iter();
        let kept = inputs.zip(named).filter(|(input, _)| keeps(input.cell));
        (self.model.inputs, self.inputs) = kept.unzip();
    }

    /// What has any value in a cone and cannot be set in a test.
    pub(crate) fn named_cuts(&self, cone: &Cone) -> Vec<String> {
        let of_cone = (0..).zip(&self.inputs).filter(|(at, _)| cone.has_input(*at));
        let mut all: Vec<String> = of_cone
            .filter_map(|(_, named)| match named.setting {
                InputSetting::Any(cause) => Some(format!("{}: {cause}", named.name)),
                InputSetting::Set(_)
                | InputSetting::Force(_)
                | InputSetting::Start(_)
                | InputSetting::Stored(_)
                | InputSetting::Device(_)
                | InputSetting::Follows => None,
            })
            .collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// What has any value in gates, because they do not compute it: `level: math on reals`.
    pub(crate) fn cut_names(&self, cuts: &[GateCut]) -> Vec<String> {
        let names = &self.suite.programs[0].program.names;
        let name = |cut: &GateCut| {
            let address = self.model.code.layout.address(cut.cell);
            address.map_or(cut.what.to_owned(), |at| format!("{}: {}", names.name(at), cut.what))
        };
        let mut all: Vec<String> = cuts.iter().map(name).collect();
        all.sort_unstable();
        all.dedup();
        all
    }
}

/// A program of a test file, and what judges it.
pub(crate) struct ModelledProgram<'a> {
    /// The program as the conditions of the file see it, or one with more rungs.
    pub program: &'a Program,
    /// What is judged behind its scans: `before` and `remembered` are those of the file.
    pub judges: Judges<'a>,
}

/// A model, and what its inputs are for people.
pub(crate) struct ModelWithNames {
    pub model: ProofModel,
    pub inputs: Vec<NamedInput>,
    /// What the environment asks for and no way can do.
    pub unknown: Option<String>,
    /// The blocks that judge it.
    pub judges: JudgeBlocks,
}

impl ModelledProgram<'_> {
    /// The model, and its inputs for people. `lowered`: the ladder itself.
    pub fn model(&self, suite: &Suite, lowered: &RigProgram) -> ModelWithNames {
        let ModelledProgram { program, judges } = self;
        let first = &suite.programs[0];
        let seen = first.view.as_ref().map(|view| view.observed());
        let was = seen.map_or(&[][..], |observed| &observed.was);
        let mut remembered: Vec<(Address, Address)> =
            was.iter().map(|Remembered { place, kept, .. }| (*place, *kept)).collect();
        remembered.extend(judges.remembered);
        let own = &lowered.symbols.layout;
        let layout = first.view.as_ref().map_or(own, |view| &view.symbols.layout);
        let places = remembered.iter().map(|(place, _)| *place);
        let read: HashSet<Address> = named(suite, program, layout).chain(places).collect();
        let lost = lost_devices(suite, program, &read);
        let assumed = suite.proof.assume.iter().map(|condition| condition.contact.clone());
        let before: Vec<Contact> =
            assumed.chain(lost.iter().filter_map(LostDevice::constraint)).collect();
        let judges = Judges { before: &before, remembered: &remembered, ..*judges };
        let judged = lower_judged(program, judges);
        let cells = judged.code.layout.clone();
        let free = FreeOperands { suite, program, own, layout, cells: &cells };
        let mut all = free.all();
        all.extend(scan_times(program, &read, &cells));
        all.extend(lost.iter().flat_map(|device| device.inputs(&cells)));
        let asked = EventQuestion {
            asked: &suite.proof.events,
            retain: &first.controller.retain,
            has_older_images: has_older_images(suite),
            reads_down_seconds: read.contains(&DOWN_SECONDS),
            observer: seen.and_then(|observed| observed.observer),
            program,
            judges: judged.judges,
            remembered: &remembered,
        };
        let RetainedStart { free: at_start, unknown } =
            retained(&asked, suite, lowered, &judged.code);
        let is_free = |cell: Cell, all: &[(FreeInput, NamedInput)]| {
            all.iter().any(|(known, _)| known.cell == cell)
        };
        let at_start = at_start.into_iter().filter(|(start, _)| !is_free(start.cell, &all));
        let at_start: Vec<_> = at_start.collect();
        all.extend(at_start);
        let mut code = free.with_any(&judged.code, &mut all);
        let stages = StageStarts::of(&asked, suite, lowered, &mut code);
        all.extend(stages.free);
        let events = asked.events(&mut code);
        all.extend(events.down.map(|down| {
            let (name, setting) = ("$DownSeconds".to_owned(), InputSetting::Follows);
            (down.input(), NamedInput { name, setting, is_written: false })
        }));
        let (free, inputs) = all.into_iter().unzip();
        let model = ProofModel {
            period: first.controller.period,
            late_max: suite.proof.late_max,
            start: ProofStart::Cold(restored(&judged.code, program, &remembered)),
            inputs: free,
            assumed: judged.before,
            judged: judged.behind,
            code,
            events,
            stage_starts: stages.starts,
        };
        let unknown = unknown.or(stages.unknown);
        ModelWithNames { model, inputs, unknown, judges: judged.judges }
    }
}

/// Memory before the first scan that differs from a cold start: field devices are connected, and
/// what is remembered is memory as started.
fn restored(
    code: &EngineProgram,
    program: &Program,
    remembered: &[(Address, Address)],
) -> Vec<(Cell, i32)> {
    let engine = Engine::new(code.clone());
    let cell = |address| code.layout.cell(address);
    let devices = (0..program.devices.len() as u32).map(|id| {
        let ok = Bit::Device(DeviceId(id), DeviceBit::Ok);
        (Cell::Bit(code.layout.bit(ok)), 1)
    });
    let mut all: Vec<(Cell, i32)> = devices.collect();
    for (place, kept) in remembered {
        if let (Some(place), Some(kept)) = (cell(*place), cell(*kept)) {
            // As in a test: the devices connect behind it.
            all.push((kept, engine.image().value(place)));
        }
    }
    all
}

/// What may change before each scan.
struct FreeOperands<'a> {
    suite: &'a Suite,
    program: &'a Program,
    /// The cells of operands: those of the ladder alone, without an observer.
    own: &'a Layout,
    /// The cells of conditions.
    layout: &'a Layout,
    /// The cells of the model.
    cells: &'a Layout,
}

impl FreeOperands<'_> {
    fn all(&self) -> Vec<(FreeInput, NamedInput)> {
        let proof = &self.suite.proof;
        let given = match &proof.inputs {
            Some(inputs) => inputs.clone(),
            None => self.inputs(),
        };
        let mut seen = HashSet::new();
        let written = proof.writable.iter().filter(|_| proof.events.contains(&ProofEvent::Writes));
        let given = given.into_iter().map(|free| (free, false));
        let all = given.chain(written.map(|free| (free.clone(), true)));
        let moved = self.suite.programs[0].controller.simulated();
        let all = all.filter_map(|(free, is_written)| {
            let (input, named) = self.named(free, &moved)?;
            Some((input, NamedInput { is_written, ..named }))
        });
        all.filter(|(free, _)| seen.insert(free.cell)).collect()
    }

    fn named(
        &self,
        FreeOperand { operand, low, high }: FreeOperand,
        moved: &HashMap<Address, String>,
    ) -> Option<(FreeInput, NamedInput)> {
        let address = self.own.address(operand.cell)?;
        let cell = self.cells.cell(address)?;
        let name = operand.name.clone();
        let setting = match moved.contains_key(&address) {
            true => InputSetting::Force(operand),
            false => InputSetting::Set(operand),
        };
        let named = NamedInput { name, setting, is_written: false };
        Some((FreeInput { cell, low, high, cold: None }, named))
    }

    /// The program in which what `any` names has any value; adds these values to the inputs.
    fn with_any(
        &self,
        code: &EngineProgram,
        all: &mut Vec<(FreeInput, NamedInput)>,
    ) -> EngineProgram {
        let engine = Engine::new(code.clone());
        let (mut cells, mut names) = (Vec::new(), Vec::new());
        for FreeOperand { operand, low, high } in &self.suite.proof.any {
            let address = self.own.address(operand.cell);
            let Some(cell) = address.and_then(|address| self.cells.cell(address)) else { continue };
            let written = match cell {
                Cell::Word(word) => written_limits(code, engine.image(), word),
                Cell::Bit(_) | Cell::WordBit(_) => None,
            };
            let [low, high] =
                written.map_or([*low, *high], |[least, most]| [least.min(*low), most.max(*high)]);
            cells.push(FreeInput { cell, low, high, cold: None });
            names.push(operand.name.clone());
        }
        let AnyProgram { code, inputs } = any_in(code, &cells);
        for AnyValue { input, at } in inputs {
            if !all.iter().any(|(known, _)| known.cell == input.cell) {
                let name = names[at].clone();
                all.push((
                    input,
                    NamedInput { name, setting: InputSetting::Any("by `any`"), is_written: false },
                ));
            }
        }
        code
    }

    /// Every input that the program names: its X, what devices bring, and the time of day.
    fn inputs(&self) -> Vec<FreeOperand> {
        let named = named(self.suite, self.program, self.layout).filter(is_input);
        named.chain(brought(self.suite)).filter_map(|address| self.free(address)).collect()
    }

    fn free(&self, address: Address) -> Option<FreeOperand> {
        let cell = self.own.cell(address)?;
        let symbols = &self.suite.programs[0].program.names;
        let input = x_number(address);
        let (low, high) = range(address)?;
        let name = symbols.name(address);
        Some(FreeOperand { operand: TestOperand { name, cell, input, device: None }, low, high })
    }
}
