//! A controller as it was at one moment: the last scan, and the scans of the minute before it. An
//! answer is about one scan, or (trend, events) about the whole minute.

use std::ops::RangeInclusive;
use std::sync::Arc;

use super::events::{LiveEvent, events};
use super::live_past::{EarlierProgram, LivePast};
use super::program::LiveProgram;
use super::trend::{Trend, TrendMinute, trend, whole_trend};
use crate::operator::protocol::PresentOutputs;
use rungd_config::controller::OutputState;
use rungd_engine::Cell;
use rungd_engine::isa::Real;
use rungd_history::observe::{Explanation, Limits, PowerRun, QuestionTime, ScanPower, Subject};
use rungd_history::playback::{PlayableProgram, RecordedMoment};
use rungd_lab::draw::circuit::ContactSymbol;
use rungd_runtime::TapeSection;
use rungd_runtime::exchange::Mode;

/// The last scan of a controller, and the minute before it.
#[derive(Clone, Debug)]
pub struct LiveView {
    /// The running program.
    pub program: Arc<LiveProgram>,
    /// The last scan.
    pub power: Arc<ScanPower>,
    /// Whether `sections` contains the minute before the first look.
    pub has_minute: bool,
    /// The mode and the outputs at the look; `None` from an earlier version of rungd.
    pub present: Option<Arc<PresentOutputs>>,
    /// The sections of the minute, in order.
    pub(super) sections: Vec<Arc<TapeSection>>,
    /// The program that ran right before the first section.
    pub(super) earlier: Option<Arc<EarlierProgram>>,
}

/// The value of a tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TagValue {
    /// The value of a bit.
    Bit(bool),
    /// The value of an integer, or a time in ms.
    Integer(i32),
    /// The value of a real.
    Real(f64),
}

impl LiveView {
    /// The numbers of the first and the last scan in the view; `None`: no scan yet.
    pub fn scans(&self) -> Option<RangeInclusive<u64>> {
        let first = self.sections.iter().find_map(|section| section.begins().next())?.number;
        Some(first..=self.power.scan.max(first))
    }

    /// The power of a scan of the minute.
    ///
    /// # Errors
    /// The scan is not in the minute.
    pub fn at(&self, scan: u64) -> Result<ScanPower, String> {
        if scan == self.power.scan {
            return Ok((*self.power).clone());
        }
        let has = |section: &&Arc<TapeSection>| section.begins().any(|begin| begin.number == scan);
        let mut run = PowerRun::new(Arc::clone(&self.program.subject));
        let found = self.sections.iter().find(has);
        found.and_then(|section| run.of_scan(section, scan)).ok_or_else(|| match self.scans() {
            Some(known) => {
                let (first, last) = (known.start(), known.end());
                format!("scan {scan} is no longer recorded: there are scans {first} to {last}")
            }
            None => "no scan is recorded yet".to_owned(),
        })
    }

    /// Whether a rung was executed in a scan.
    pub fn is_executed(&self, power: &ScanPower, element: &str, rung: u32) -> bool {
        let part = self.program.part(element, rung, None);
        part.is_some_and(|part| power.is_executed(part))
    }

    /// Whether a contact, in the form that is drawn, conducts; `None`: its rung was not executed.
    pub fn conducts(
        &self,
        power: &ScanPower,
        element: &str,
        rung: u32,
        contact: &ContactSymbol,
    ) -> Option<bool> {
        let first = self.program.first_contact(element, rung, contact.branch)?;
        let on = power.contact(first + contact.leaf as u32)?;
        Some(contact.form.conducts(on))
    }

    /// The values of the sides of a compare when its rung was executed: `40 >= 50`; `None`: the
    /// contact is no compare, or its rung was not executed.
    pub fn compared(
        &self,
        power: &ScanPower,
        element: &str,
        rung: u32,
        contact: &ContactSymbol,
    ) -> Option<String> {
        let first = self.program.first_contact(element, rung, contact.branch)?;
        let number = first + contact.leaf as u32;
        let sides = power.compared(number)?;
        Some(self.program.compare(number)?.with(sides))
    }

    /// The state of the output of a cell in a scan; `None`: the cell is no Y. For the last scan it
    /// is the present state, as the controller has it; for an earlier scan it follows from the log.
    pub fn output(&self, power: &ScanPower, cell: Cell) -> Option<OutputState> {
        let rules = self.program.subject.output_rules();
        let number = rules.number(cell)?;
        if let Some(present) = self.present.as_ref().filter(|_| power.scan == self.power.scan) {
            return Some(present.output(number));
        }
        if rules.is_lost(cell, |ok| power.value(Cell::Bit(ok)) != 0) {
            let points = self.trend_of(cell).points;
            let before = points.iter().rev().skip_while(|point| point.scan > power.scan);
            let last = before.into_iter().find_map(|point| point.value);
            return Some(OutputState::Unknown(last.map(|value| value != 0)));
        }
        let driven = rules.driven(cell, power.mode, power.value(cell)) != 0;
        Some(match power.mode {
            Mode::Run => OutputState::AsMemory,
            Mode::Stop(_) | Mode::Fault(_) => OutputState::Safe(driven),
        })
    }

    /// Whether the blocks are executed, as the log and the controller say.
    pub fn executes(&self, power: &ScanPower) -> bool {
        let is_last = power.scan == self.power.scan;
        let stands = self.present.as_ref().is_some_and(|outputs| is_last && outputs.on.is_some());
        power.mode == Mode::Run && !stands
    }

    /// Explains the value of an operand: the present one, or the one at the end of a scan.
    ///
    /// # Errors
    /// There is no such operand, or the scan is not in the minute.
    pub fn why(&self, operand: &str, scan: Option<u64>) -> Result<Explanation, String> {
        let subject = &self.program.subject;
        let cell = subject.cell(operand)?;
        let at = scan.map_or(QuestionTime::Now, QuestionTime::Scan);
        let mut past = LivePast { sections: self.sections.clone(), earlier: self.earlier.clone() };
        let limits = Limits::default();
        let answer = subject.why(&mut past, cell, at, limits);
        let mut answer = answer.map_err(|refusal| refusal.to_string())?;
        let is_last = scan.is_none_or(|scan| scan == self.power.scan);
        if let Some(present) = self.present.as_ref().filter(|_| is_last) {
            present.complete(&mut answer, subject);
        } else if let OutputState::Unknown(_) = answer.output {
            let power = scan.and_then(|scan| self.at(scan).ok());
            answer.output =
                power.and_then(|power| self.output(&power, cell)).unwrap_or(answer.output);
        }
        Ok(answer)
    }

    /// The state of the controller at the end of a scan; without one, now.
    ///
    /// # Errors
    /// The scan is not in the minute, or the program cannot be loaded.
    pub fn moment(&self, scan: Option<u64>) -> Result<RecordedMoment, String> {
        let has = |section: &&Arc<TapeSection>| {
            scan.is_none_or(|scan| section.begins().any(|begin| begin.number == scan))
        };
        let section = self.sections.iter().rev().find(has);
        let section = section.ok_or("that scan is no longer recorded")?;
        let at = scan.map_or(QuestionTime::Now, QuestionTime::Scan);
        let program = PlayableProgram::of(&self.program.recorded)?;
        RecordedMoment::in_section(program, section, at)
    }

    /// The values of an operand over the minute.
    ///
    /// # Errors
    /// There is no such operand.
    pub fn trend(&self, operand: &str) -> Result<Trend, String> {
        let cell = self.program.subject.cell(operand)?;
        Ok(self.trend_of(cell))
    }

    fn trend_of(&self, cell: Cell) -> Trend {
        trend(self.minute(cell), cell)
    }

    /// The values of a cell over the minute, all of them.
    pub(super) fn whole_trend_of(&self, cell: Cell) -> Trend {
        whole_trend(self.minute(cell), cell)
    }

    fn minute(&self, cell: Cell) -> TrendMinute<'_> {
        let (subject, sections) = (&*self.program.subject, &*self.sections);
        let (present, content) = (self.present.as_deref(), self.power.value(cell));
        TrendMinute { subject, sections, present, content }
    }

    /// The events of the minute, the newest last.
    pub fn events(&self) -> Vec<LiveEvent> {
        events(&self.program, &self.sections)
    }

    /// The value of an operand in a scan.
    ///
    /// # Errors
    /// There is no such operand.
    pub fn value(&self, power: &ScanPower, operand: &str) -> Result<TagValue, String> {
        let cell = self.program.subject.cell(operand)?;
        Ok(self.tag_value(cell, power.value(cell)))
    }

    /// The value of a cell with its text, for people: `1 (dosing)`.
    pub fn say_value(&self, cell: Cell, content: i32) -> String {
        self.program.subject.symbols().say_value(cell, content)
    }

    /// Converts the content of a cell to the value of its operand.
    pub fn tag_value(&self, cell: Cell, content: i32) -> TagValue {
        tag_value(&self.program.subject, cell, content)
    }
}

/// Converts the content of a cell of a program to the value of its operand.
pub(super) fn tag_value(subject: &Subject, cell: Cell, content: i32) -> TagValue {
    let operand = subject.operand(cell);
    if operand.is_bit {
        TagValue::Bit(content != 0)
    } else if operand.is_real {
        TagValue::Real(f64::from(Real::of_cell(content)))
    } else {
        TagValue::Integer(content)
    }
}
