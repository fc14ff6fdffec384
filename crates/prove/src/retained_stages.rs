//! `from = "retained"`: what an image says of the Programs whose Stages are retained.
//!
//! `question` calls it. Each of them may not run, begin at its initial Stage, or go on in any of
//! its Stages, in several, or in none. A ladder that leaves its Stages by JMP alone has fewer of
//! these starts, but an image may also come from another edition of the ladder. Main runs in any
//! case. `trial` sets what a start needs.

use crate::asked_events::EventQuestion;
use crate::model::FreeInput;
use crate::named_input::{InputSetting, NamedInput};
use crate::stage_start::StageStart;
use rungd_engine::isa::{Address, Bit};
use rungd_engine::{BitCell, Cell, EngineProgram, ResumeBits};
use rungd_lab::rig::RigProgram;
use rungd_lab::testing::{Suite, TestOperand};

/// The Programs whose Stages are free before the first scan.
#[derive(Default)]
pub(crate) struct StageStarts {
    /// The Programs, with the bits of their choices.
    pub starts: Vec<StageStart>,
    /// Their free inputs.
    pub free: Vec<(FreeInput, NamedInput)>,
    /// What no proof can vary yet.
    pub unknown: Option<String>,
}

impl StageStarts {
    /// Those of a test file; `code`, the program of the model, gets the bits of the choices.
    pub fn of(
        asked: &EventQuestion,
        suite: &Suite,
        rig: &RigProgram,
        code: &mut EngineProgram,
    ) -> StageStarts {
        let mut all = StageStarts::default();
        if !suite.proof.from_retained {
            return all;
        }
        for own in &rig.symbols.identity.kept {
            let runs = asked.program.blocks[own.program.0 as usize].is_main();
            let start = StageStart::new(code, own.program, runs);
            let named = NamedStages { rig, own: *own, start };
            let inputs = FreeInput::of_stages(&start, code).into_iter();
            all.free.extend(inputs.map(|input| (input, named.input(code, input.cell))));
            all.starts.push(start);
            let remembered =
                |address: Address| asked.remembered.iter().any(|(place, _)| *place == address);
            if let Some(address) = named.addresses(code).find(|address| remembered(*address)) {
                let name = rig.symbols.names.name(address);
                all.unknown = Some(format!("`from`: `was({name})` of a retained Stage"));
            }
        }
        all
    }
}

/// A Program whose Stages are retained, with its names.
struct NamedStages<'r> {
    rig: &'r RigProgram,
    /// What the rig keeps of it.
    own: ResumeBits,
    start: StageStart,
}

impl NamedStages<'_> {
    /// Whether it runs, and its Stages.
    fn addresses(&self, code: &EngineProgram) -> impl Iterator<Item = Address> {
        let stages = (0..self.own.stages).map(|n| Bit::Stage(self.start.stage(code, n)));
        let all: Vec<Bit> = std::iter::once(Bit::Running(self.own.program)).chain(stages).collect();
        all.into_iter().map(Address::Bit)
    }

    /// The name of a bit of its choice.
    fn input(&self, code: &EngineProgram, cell: Cell) -> NamedInput {
        let Cell::Bit(BitCell(bit)) = cell else { unreachable!("a choice is a bit") };
        let place = BitCell(self.own.first + bit - self.start.chosen.first);
        let address = match place {
            place if place == self.own.begins() => None,
            place if place == self.own.running() => self.addresses(code).next(),
            BitCell(place) => {
                let stage = place - self.own.stage(0).0;
                self.addresses(code).nth(1 + stage as usize)
            }
        };
        let names = &self.rig.symbols.names;
        let program = || &names.block(self.own.program).name;
        let name =
            address.map_or_else(|| format!("{}: first turn", program()), |at| names.name(at));
        let operand =
            TestOperand { name: name.clone(), cell: Cell::Bit(place), input: None, device: None };
        NamedInput { name, setting: InputSetting::Stored(operand), is_written: false }
    }
}
