//! Resolves the steps of a scenario: names become cells of the program that is running at that
//! step.
//!
//! Called by `reading`. After a `reload` step, the new program is running for the rest of the
//! scenario. The mode of the controller, RUN or STOP, is not known here; `player` checks it.

use super::given;
use super::names::TestTarget;
use super::programs::{ProgramLoad, Programs};
use super::step_text::{PulseRepeat, WrittenStep, behind_every};
use super::step_words::StepWord;
use super::suite::{ProgramId, Reload, TestOperand, TestStep, TestTime};
use super::written::WrittenSet;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::{DeviceId, duration};
use rungd_engine::{Cell, TIME_END_NS};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, possible, text};
use rungd_language::source::span::{Located, Span};
use std::collections::HashMap;

/// Resolves one scenario after the other.
pub(super) struct StepResolver<'p, 'a> {
    pub programs: &'p mut Programs<'a>,
    pub findings: Vec<Finding>,
    /// The program that is running at the next step.
    current: ProgramId,
    /// The duration of the scenario up to the next step, ns.
    lasts_ns: u128,
}

/// Whether a scenario continues after a step.
enum AfterStep {
    GoesOn,
    Ends,
}

const MS_NS: u128 = 1_000_000;

impl<'p, 'a> StepResolver<'p, 'a> {
    pub fn new(programs: &'p mut Programs<'a>) -> StepResolver<'p, 'a> {
        StepResolver { programs, findings: Vec::new(), current: ProgramId(0), lasts_ns: 0 }
    }

    /// The memory before the first scan.
    pub fn set(&mut self, set: &WrittenSet) -> Vec<(TestOperand, i32)> {
        self.current = ProgramId(0);
        let mut all: Vec<(TestOperand, i32)> = Vec::new();
        let mut seen: HashMap<(Option<DeviceId>, Cell), Span> = HashMap::new();
        for (name, value) in set {
            let found = self.programs.before_start(self.current, &name.text, name.span);
            let found = found.and_then(|target| {
                if let Some(first) =
                    seen.insert((target.operand.device, target.operand.cell), name.span)
                {
                    return Err(twice(&name.text, name.span, first));
                }
                let content = given::constant(&target, value)?;
                Ok((target.operand, content))
            });
            match found {
                Ok(one) => all.push(one),
                Err(finding) => self.findings.push(finding),
            }
        }
        all
    }

    /// The steps of a scenario.
    pub fn steps(&mut self, written: Vec<Located<WrittenStep>>) -> Vec<Located<TestStep>> {
        (self.current, self.lasts_ns) = (ProgramId(0), 0);
        let mut steps = Vec::new();
        for step in written {
            let span = step.span;
            let (value, behind) = match self.step(step.value, span) {
                Ok(found) => found,
                Err(findings) => {
                    self.findings.extend(findings);
                    continue;
                }
            };
            steps.push(Located { value, span });
            if let AfterStep::Ends = behind {
                break;
            }
        }
        steps
    }

    fn names(&mut self) -> &mut super::names::TestNames<'a> {
        &mut self.programs.names[self.current.0]
    }

    fn step(
        &mut self,
        step: WrittenStep,
        span: Span,
    ) -> Result<(TestStep, AfterStep), Vec<Finding>> {
        let resolved = match step {
            WrittenStep::Set(operand, value) => {
                let (operand, content) = self.assigned(&operand, &value, Self::written)?;
                TestStep::Set(operand, content)
            }
            WrittenStep::Force(operand, value) => {
                let (operand, content) = self.assigned(&operand, &value, Self::forced)?;
                TestStep::Force(operand, content)
            }
            WrittenStep::Unforce(operand) => {
                TestStep::Unforce(self.forced(&operand).map_err(one)?.operand)
            }
            WrittenStep::Pulse { operand, on_ms, repeat } => {
                self.pulse(&operand, on_ms, repeat, span)?
            }
            WrittenStep::Beat { operand, on_ms, every } => {
                let operand = self.bit(&operand, "beat").map_err(one)?;
                self.goes_off(on_ms, every).map_err(one)?;
                let (on, every) = (TestTime::Ms(on_ms), TestTime::Ms(every.value));
                TestStep::Beat { operand, on, every }
            }
            WrittenStep::Run(time) => {
                self.passes(time, 1, span).map_err(one)?;
                TestStep::Run(time)
            }
            WrittenStep::Late(periods) => {
                self.passes(TestTime::Scans(periods.into()), 1, span).map_err(one)?;
                TestStep::Late(periods)
            }
            WrittenStep::Expect(condition) => TestStep::Expect(self.names().condition(&condition)?),
            WrittenStep::Within(ms, condition) => {
                self.passes(TestTime::Ms(ms), 1, span).map_err(one)?;
                TestStep::Within(TestTime::Ms(ms), self.names().condition(&condition)?)
            }
            WrittenStep::Hold(ms, condition) => {
                self.passes(TestTime::Ms(ms), 1, span).map_err(one)?;
                TestStep::Hold(TestTime::Ms(ms), self.names().condition(&condition)?)
            }
            WrittenStep::Stop => {
                self.passes(TestTime::Scans(1), 1, span).map_err(one)?;
                TestStep::Stop
            }
            WrittenStep::Start => TestStep::Start,
            WrittenStep::Restart(down_ms) => {
                self.passes(TestTime::Scans(1), 1, span).map_err(one)?;
                self.lasts(down_ms, span).map_err(one)?;
                TestStep::Restart { down_ms }
            }
            WrittenStep::PowerCut(off) => {
                self.lasts(off.down_ms, span).map_err(one)?;
                TestStep::PowerCut(off)
            }
            WrittenStep::Reload(files) => return self.reload(&files).map_err(one),
            WrittenStep::Lose(device) => TestStep::Lose(self.names().device(&device).map_err(one)?),
            WrittenStep::Restore(device) => {
                TestStep::Restore(self.names().device(&device).map_err(one)?)
            }
            WrittenStep::Clock(seconds) => TestStep::Clock(seconds),
        };
        Ok((resolved, AfterStep::GoesOn))
    }

    fn written(&mut self, word: &StepWord) -> Result<TestTarget, Finding> {
        self.programs.written(self.current, &word.value, word.span)
    }

    fn forced(&mut self, word: &StepWord) -> Result<TestTarget, Finding> {
        self.programs.forced(self.current, &word.value, word.span)
    }

    fn assigned(
        &mut self,
        operand: &StepWord,
        value: &StepWord,
        target: impl Fn(&mut Self, &StepWord) -> Result<TestTarget, Finding>,
    ) -> Result<(TestOperand, i32), Vec<Finding>> {
        let target = target(self, operand).map_err(one)?;
        let content = given::word(&target, value).map_err(one)?;
        Ok((target.operand, content))
    }

    /// A bit that a step switches ON and OFF.
    fn bit(&mut self, word: &StepWord, step: &str) -> Result<TestOperand, Finding> {
        let target = self.written(word)?;
        match target.operand.cell {
            Cell::Bit(_) | Cell::WordBit(_) => Ok(target.operand),
            Cell::Word(_) => {
                let name = &word.value;
                let message = format!("`{name}` is a word: `{step}` switches a bit");
                let finding = Finding::new(Code::OperandType, word.span, message);
                Err(finding.propose(format!("set {name} 1")))
            }
        }
    }

    fn pulse(
        &mut self,
        operand: &StepWord,
        on_ms: u32,
        repeat: Option<PulseRepeat>,
        span: Span,
    ) -> Result<TestStep, Vec<Finding>> {
        let operand = self.bit(operand, "pulse").map_err(one)?;
        let on = TestTime::Ms(on_ms);
        let (every, times) = match repeat {
            None => (on, 1),
            Some(PulseRepeat { every, times }) => {
                self.goes_off(on_ms, every).map_err(one)?;
                (TestTime::Ms(every.value), times)
            }
        };
        self.passes(every, times, span).map_err(one)?;
        Ok(TestStep::Pulse { operand, on, every, times })
    }

    /// Refuses pulses without an OFF scan between them.
    fn goes_off(&self, on_ms: u32, every: Located<u32>) -> Result<(), Finding> {
        let [on, from_one] = [on_ms, every.value].map(|ms| self.scans(TestTime::Ms(ms)));
        if from_one > on {
            return Ok(());
        }
        let period = self.period();
        let words = period.words();
        let message = format!("at a period of {words} no scan is OFF between two pulses");
        let least = u128::from(period.us()) * (on + 1);
        let least = i32::try_from(least.div_ceil(1000)).unwrap_or(i32::MAX);
        let every_least = format!("every {}", duration::print(least));
        let finding = Finding::new(Code::TestStep, every.span, message);
        Err(finding.propose(text(every_least).at(behind_every(every.span))))
    }

    fn period(&self) -> ScanPeriod {
        self.programs.programs[self.current.0].controller.period
    }

    /// The number of scans of a time.
    fn scans(&self, time: TestTime) -> u128 {
        match time {
            TestTime::Ms(ms) => u128::from(self.period().scans_in_ms(ms.into()).max(1)),
            TestTime::Scans(scans) => scans.into(),
        }
    }

    /// Adds the time of a step; refuses a total time that cannot be counted.
    fn passes(&mut self, time: TestTime, times: u32, span: Span) -> Result<(), Finding> {
        let period_ns = u128::from(self.period().ns());
        self.lasts_ns += self.scans(time) * u128::from(times) * period_ns;
        self.lasts(0, span)
    }

    /// Adds a time without scans; refuses a total time that cannot be counted.
    fn lasts(&mut self, down_ms: u32, span: Span) -> Result<(), Finding> {
        self.lasts_ns += u128::from(down_ms) * MS_NS;
        if self.lasts_ns < u128::from(TIME_END_NS) {
            return Ok(());
        }
        self.lasts_ns = 0;
        let message = "the scenario lasts longer than 146 years, the maximum";
        Err(Finding::new(Code::TestStep, span, message).help("let less time pass").or_omit())
    }

    fn reload(&mut self, files: &[StepWord]) -> Result<(TestStep, AfterStep), Finding> {
        match self.programs.reload(files)? {
            ProgramLoad::Ready(id) => {
                self.current = id;
                Ok((TestStep::Reload(Reload::To(id)), AfterStep::GoesOn))
            }
            ProgramLoad::Refused(text) => {
                Ok((TestStep::Reload(Reload::Refused(text)), AfterStep::Ends))
            }
        }
    }
}

/// The finding for an operand that is named twice.
pub(super) fn twice(name: &str, span: Span, first: Span) -> Finding {
    let message = format!("`{name}` already has a value");
    let finding = Finding::new(Code::TestFile, span, message).related(first, "given here");
    finding.help("take one of the two away").fix(possible(FixEdit::Delete))
}

fn one(finding: Finding) -> Vec<Finding> {
    vec![finding]
}
