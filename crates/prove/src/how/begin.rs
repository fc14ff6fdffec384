//! The state of a recorded controller as the start of a question, and the trial of an answer.
//!
//! The state goes into the program that judges itself as a reload would bring it there
//! ([`Engine::adopt`]), with everything kept. What the state holds still stays so: forces, the
//! inputs of field devices that are lost. A trial executes the program of the recording itself from
//! the very state, beside the one that was searched, and compares their memory behind every scan.

use crate::model::{Path, ProofStart, Run};
use crate::named_input::{InputSetting, NamedInput};
use crate::question::Questions;
use rungd_base::calendar::LocalTime;
use rungd_engine::isa::{Bit, DeviceBit};
use rungd_engine::{Cell, Engine, EngineProgram, EngineState, KeptCells, ScanTimes, Transfer};
use rungd_history::playback::{PlayableProgram, RecordedMoment};
use rungd_lab::testing::{AskedCondition, TestProgram, asked_suite};
use rungd_language::lower::judged::JudgeBlocks;
use std::sync::Arc;

use super::answer::HowBegin;

/// A state, ready for a question.
pub(super) struct RecordedBegin {
    /// For people.
    pub told: HowBegin,
    /// Whether the condition is true there.
    pub holds: bool,
    /// Whether a scan follows.
    pub runs: bool,
    /// The program of the recording.
    plain: EngineProgram,
    state: EngineState,
    transfer: Transfer,
}

impl RecordedBegin {
    /// The questions about a moment, and the state.
    ///
    /// # Errors
    /// What is wrong with the condition, or why the state cannot be used, as a sentence.
    pub fn new(
        moment: RecordedMoment,
        asked: AskedCondition,
    ) -> Result<(Questions, RecordedBegin), String> {
        let RecordedMoment { program, state, scan, runs } = moment;
        let PlayableProgram { program, loaded, code, .. } = program;
        let controller = loaded.controller.ok_or("the recording has no controller file")?;
        let test = TestProgram {
            program,
            controller: Arc::new(controller),
            files: loaded.files,
            view: None,
        };
        let mut questions = Questions::new(asked_suite(test, asked)?);
        let transfer = questions.judges.transfer(&code, &questions.model.code);
        let mut adopted = adopt(&code, &questions.model.code, &transfer, &state)
            .ok_or("the recorded state does not fit its program")?;
        settle(&mut adopted, questions.judges);
        let holds = questions.can[0].target.is_met(adopted.image());
        let state_of_model = EngineState::of(&adopted).at_whole_ms();
        let held = HeldStill::of(&questions, &state, &code);
        questions.keep_inputs(|cell| !held.cells.contains(&cell));
        questions.model.start = ProofStart::Given(Box::new(state_of_model));
        let told = HowBegin {
            scan: scan.map(|scan| scan.number),
            unix_ns: scan.map(|scan| scan.unix_ns),
            forced: held.forced,
            lost: held.lost,
        };
        Ok((questions, RecordedBegin { told, holds, runs, plain: code, state, transfer }))
    }

    /// The comment of a scenario that begins with the state.
    pub fn comment(&self) -> String {
        let behind = match self.told.scan {
            Some(scan) => format!("the state behind scan {scan}"),
            None => "the state of the recording".to_owned(),
        };
        format!("# It begins with {behind}, not with a cold start.\n")
    }

    /// Whether a path leads to the condition on the program of the recording too.
    pub fn is_confirmed(&self, questions: &Questions, path: &Path) -> bool {
        let (model, target) = (&questions.model, questions.can[0].target);
        let mut plain = Engine::new(self.plain.clone());
        if !plain.resume(&self.state) {
            return false;
        }
        let mut run = Run::new(model);
        let rest = model.resting();
        for (at, values) in (1..).zip(&path.scans) {
            // What nobody can set stays as it is.
            let moves = |((named, now), rest): ((&NamedInput, &i32), &i32)| {
                matches!(named.setting, InputSetting::Any(_)) && now != rest
            };
            if questions.inputs.iter().zip(values).zip(&rest).any(moves) {
                return false;
            }
            let now_ns = plain.now_ns() + model.period_ns();
            plain.begin_scan(now_ns, &ScanTimes::default(), &LocalTime::default());
            for (input, value) in model.inputs.iter().zip(values) {
                self.write(&mut plain, input.cell, *value);
            }
            let is_last = plain.execute().last;
            let outcome = run.scan(values);
            let ends = is_last || outcome.is_last;
            if !outcome.is_allowed || ends && at != path.scans.len() {
                return false;
            }
            if !self.is_same(&plain, &run.engine) && !ends {
                return false;
            }
        }
        target.is_met(run.engine.image())
    }

    /// Writes a cell of the model.
    fn write(&self, plain: &mut Engine, cell: Cell, value: i32) {
        // Inputs and what an operator writes have the same numbers in both programs.
        debug_assert_eq!(self.transfer.cell(cell), Some(cell), "no bit of a block is an input");
        match cell {
            Cell::Bit(bit) => plain.write_bit(bit, value != 0),
            Cell::Word(word) => plain.write_word(word, value),
            Cell::WordBit(_) => unreachable!("an input is a whole cell"),
        }
    }

    /// Whether the public memory of the plain program is that of the one that judges itself.
    fn is_same(&self, plain: &Engine, judged: &Engine) -> bool {
        let layout = &self.plain.layout;
        let (plain, judged) = (plain.image(), judged.image());
        let place = |first: u32, count: u32| first as usize..(first + count) as usize;
        let bits = |KeptCells { from, to, count }: &KeptCells| {
            let count = (*count).min(layout.bit_count().saturating_sub(*from));
            plain.bits()[place(*from, count)] == judged.bits()[place(*to, count)]
        };
        let words = |KeptCells { from, to, count }: &KeptCells| {
            let count = (*count).min(layout.word_count().saturating_sub(*from));
            plain.words()[place(*from, count)] == judged.words()[place(*to, count)]
        };
        self.transfer.bits.iter().all(bits) && self.transfer.words.iter().all(words)
    }
}

/// An engine of the judged program with the state of the plain one; `None`: it is no such state.
fn adopt(
    plain: &EngineProgram,
    judged: &EngineProgram,
    transfer: &Transfer,
    state: &EngineState,
) -> Option<Engine> {
    let mut old = Engine::new(plain.clone());
    if !old.resume(state) {
        return None;
    }
    let forces: Vec<Cell> = state.forced(&plain.layout).collect();
    let mut new = Engine::new(judged.clone());
    new.adopt(&mut old, transfer, true, &forces);
    Some(new)
}

/// Evaluates the conditions about the state: twice, so that no edge is seen that did not happen.
fn settle(adopted: &mut Engine, judges: JudgeBlocks) {
    let code = EngineProgram { order: vec![judges.last], ..adopted.program().clone() };
    let mut judge = Engine::new(code);
    if !judge.resume(&EngineState::of(adopted)) {
        return;
    }
    judge.execute();
    judge.execute();
    let cells = adopted.cells_mut();
    let image = judge.image();
    cells.bits[..image.bits().len()].copy_from_slice(image.bits());
    cells.words[..image.words().len()].copy_from_slice(image.words());
}

/// What a state holds still.
struct HeldStill {
    /// The cells that no input changes.
    cells: Vec<Cell>,
    /// The names of what is forced.
    forced: Vec<String>,
    /// The names of the field devices that are lost.
    lost: Vec<String>,
}

impl HeldStill {
    fn of(questions: &Questions, state: &EngineState, plain: &EngineProgram) -> HeldStill {
        let test = &questions.suite.programs[0];
        let names = &test.program.names;
        let mut cells: Vec<Cell> = state.forced(&plain.layout).collect();
        let name = |cell: &Cell| plain.layout.address(*cell).map(|address| names.name(address));
        let forced = cells.iter().filter_map(name).collect();
        let mut lost = Vec::new();
        for device in &test.controller.devices {
            let ok = plain.layout.bit(Bit::Device(device.id, DeviceBit::Ok));
            if state.value(Cell::Bit(ok)) == 0 && !device.inputs.is_empty() {
                lost.push(device.name.clone());
                let brought = device.inputs.iter();
                cells.extend(brought.filter_map(|input| plain.layout.cell(input.address)));
            }
        }
        HeldStill { cells, forced, lost }
    }
}
