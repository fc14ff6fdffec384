//! How a condition can become true: the shortest inputs after which it is, or the proof that there
//! are none.
//!
//! `rungd how` asks from a cold start, and from the state of a recorded or running controller. The
//! question is that of a line of `can`, decided as any line (`race`). What is found loses the
//! changes that it does not need (`minimal`), is tried (`trial`, `begin`), and becomes a sentence
//! (`sentence`). No file is read here.

mod answer;
mod begin;
mod minimal;
mod sentence;
mod still;

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

pub use answer::{HowAnswer, HowBegin, HowVerdict};
use begin::RecordedBegin;
use minimal::minimal;
pub use sentence::InputChange;

use crate::cone::cone;
use crate::decide::DecideLimits;
use crate::encode::written_bits;
use crate::model::{Path, ProofModel};
use crate::question::Questions;
use crate::race::{Decision, Race};
use crate::trial::Trial;
use rungd_config::controller::Controller;
use rungd_engine::BitCell;
use rungd_engine::isa::{Address, Bit, BitSpace};
use rungd_history::playback::{PlayableProgram, RecordedMoment};
use rungd_lab::testing::{AskedCondition, Suite, run_text, try_run};
use rungd_language::source::wording::counted;
use sentence::Sentence;
use still::still_models;

/// A question.
pub struct HowQuestion {
    /// Its condition is the first line of `can`.
    questions: Questions,
    /// The state that it is about; `None`: a cold start.
    begin: Option<RecordedBegin>,
}

/// The time of a question that a page or an editor asks.
const BY_HAND_TIME: Duration = Duration::from_secs(10);
/// Its memory for states, bytes.
const BY_HAND_MEMORY: usize = 256 << 20;

/// How a bit or word of a recorded controller could change, by inputs and by the bits that people
/// alone write: for a page or an editor. `given_up`: the answer is no longer wanted.
///
/// # Errors
/// There is no such operand, or the state cannot be used.
pub fn how_to_change(
    moment: RecordedMoment,
    operand: &str,
    given_up: Arc<AtomicBool>,
) -> Result<HowAnswer, String> {
    let program = &moment.program;
    let cell = program.cell(operand).ok_or_else(|| format!("nothing is called `{operand}`"))?;
    let value = moment.state.value(cell);
    let condition = match (cell.is_bit(), value) {
        (true, 0) => operand.to_owned(),
        (true, _) => format!("!{operand}"),
        (false, _) => format!("{operand} != {}", program.layout().text(cell, value)),
    };
    let writes = switches(program);
    let asked = AskedCondition { condition: &condition, writes: &writes };
    let limits = DecideLimits { time: BY_HAND_TIME, memory: BY_HAND_MEMORY, given_up };
    HowQuestion::recorded(moment, asked).map(|question| question.answer(&limits))
}

/// The bits that the ladder reads and nothing writes, inputs left out: people write them.
fn switches(program: &PlayableProgram) -> Vec<String> {
    let written = written_bits(&program.code);
    let controller = program.loaded.controller.as_ref();
    let moved = controller.map(Controller::simulated).unwrap_or_default();
    let named = program.program.operands.iter().filter_map(|operand| match operand.address {
        Address::Bit(Bit::Space(BitSpace::X | BitSpace::St, _)) => None,
        Address::Bit(_) if moved.contains_key(&operand.address) => None,
        Address::Bit(bit @ Bit::Space(..)) if bit.writable_from_outside() => {
            let BitCell(cell) = program.layout().bit(bit);
            (!written[cell as usize]).then(|| program.symbols.names.name(operand.address))
        }
        Address::Bit(_) | Address::Word(_) | Address::Structure(_) => None,
    });
    let named: BTreeSet<String> = named.collect();
    named.into_iter().collect()
}

impl HowQuestion {
    /// From a cold start: the first line of `can` of a test file.
    pub fn cold(suite: Suite) -> HowQuestion {
        HowQuestion { questions: Questions::new(suite), begin: None }
    }

    /// From the state of a recorded controller.
    ///
    /// # Errors
    /// What is wrong with the condition, or why the state cannot be used, as a sentence.
    pub fn recorded(moment: RecordedMoment, asked: AskedCondition) -> Result<HowQuestion, String> {
        let (questions, begin) = RecordedBegin::new(moment, asked)?;
        Ok(HowQuestion { questions, begin: Some(begin) })
    }

    /// The condition.
    pub fn condition(&self) -> &str {
        &self.questions.can[0].text
    }

    /// Decides it.
    pub fn answer(&self, limits: &DecideLimits) -> HowAnswer {
        let begun = Instant::now();
        let verdict = match &self.begin {
            Some(begin) if begin.holds => HowVerdict::Holds,
            Some(begin) if !begin.runs => HowVerdict::Open {
                covered: Vec::new(),
                cause: "the controller is not in RUN: nothing is scanned".to_owned(),
            },
            Some(_) | None => self.decided(limits, begun),
        };
        HowAnswer {
            condition: self.condition().to_owned(),
            begin: self.begin.as_ref().map(|begin| begin.told.clone()),
            period: self.questions.model.period,
            writes: self.writes(),
            verdict,
            ms: begun.elapsed().as_millis(),
        }
    }

    /// The names of what an operator may write.
    fn writes(&self) -> Vec<String> {
        let written = self.questions.inputs.iter().filter(|named| named.is_written);
        written.map(|named| named.name.clone()).collect()
    }

    fn decided(&self, limits: &DecideLimits, begun: Instant) -> HowVerdict {
        let race = limits.race(begun);
        let mut end = begun + limits.time / 2;
        for still in still_models(&self.questions.model, self.begin.is_none()) {
            let part = Race { end, ..race.clone() };
            if let found @ HowVerdict::Found { .. } = self.verdict(&still, &part) {
                return found;
            }
            end += limits.time / 4;
        }
        self.verdict(&self.questions.model, &race)
    }

    fn verdict(&self, model: &ProofModel, race: &Race) -> HowVerdict {
        let target = self.questions.can[0].target;
        let cone = cone(model, &[target.bit]);
        match race.decide(&cone, target) {
            Decision::Never(way, cuts) => {
                HowVerdict::Never { way, any: self.questions.cut_names(&cuts) }
            }
            Decision::Found(way, path) => {
                let path = cone.widened(&minimal(&cone.model, target, path, race.end));
                self.tried(way, &path)
            }
            Decision::Open(open) => {
                let cause = open.cause(&self.questions.cut_names(&open.cuts));
                HowVerdict::Open { covered: open.covered, cause }
            }
        }
    }

    /// Tries a path; the answer tells it only if the condition is true behind it.
    fn tried(&self, way: &'static str, path: &Path) -> HowVerdict {
        let Questions { suite, programs, .. } = &self.questions;
        let condition = &suite.proof.can[0];
        let run = Trial { questions: &self.questions, path }
            .run(format!("how: {}", condition.text), condition);
        let (is_confirmed, scenario) = match &self.begin {
            None => {
                let tried = try_run(suite, programs, run);
                (tried.is_confirmed, tried.text)
            }
            Some(begin) => {
                let scenario = format!("{}{}", begin.comment(), run_text(programs, run));
                (begin.is_confirmed(&self.questions, path), scenario)
            }
        };
        if !is_confirmed {
            let scans = counted(path.scans.len() as u64, "scan");
            return HowVerdict::Open {
                covered: vec![format!("a run of {scans} was found")],
                cause: "the run does something else when it is tried".to_owned(),
            };
        }
        let sentence = Sentence::new(&self.questions, path);
        HowVerdict::Found {
            way,
            scan: path.scans.len() as u64,
            sentence: sentence.text(),
            changes: sentence.changes,
            scenario,
        }
    }
}
