//! An answer as a person would say it: `hold start for one scan; 2 s later pump1 is ON`.
//!
//! Called by `how` with a path that was tried. A level that is given back is *held*, if nothing
//! else changes in between; every other change is told where it happens.

use crate::model::{Path, ProofModel, Run};
use crate::question::Questions;
use rungd_lab::testing::time_text;
use rungd_language::source::wording::listed;
use serde_json::{Value, json};

/// A change of an input, or an operator's write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputChange {
    /// The scan before which it happens, from 1.
    pub scan: u64,
    /// The name of the bit or word.
    pub name: String,
    /// Its content then; a bit: 0 or 1.
    pub value: i32,
    /// Its content for people.
    pub text: String,
    /// Whether it is a bit.
    pub is_bit: bool,
    /// Whether an operator writes it.
    pub is_written: bool,
    /// Its content before.
    pub before: i32,
}

impl InputChange {
    /// It as JSON.
    pub(super) fn json(&self) -> Value {
        let value = if self.is_bit { json!(self.value != 0) } else { json!(self.text) };
        json!({
            "scan": self.scan,
            "operand": self.name,
            "value": value,
            "written": self.is_written,
        })
    }
}

/// A path in words.
pub(super) struct Sentence<'q> {
    questions: &'q Questions,
    /// What changes, in order.
    pub changes: Vec<InputChange>,
    /// The number of scans.
    scans: u64,
}

/// What is said at one time.
struct Clause {
    text: String,
    /// The scan before which it happens, from 1.
    scan: u64,
    /// The scan before which it is over, from 1.
    end: u64,
}

impl<'q> Sentence<'q> {
    pub fn new(questions: &'q Questions, path: &Path) -> Sentence<'q> {
        let changes = changes(questions, path);
        Sentence { questions, changes, scans: path.scans.len() as u64 }
    }

    /// The sentence.
    pub fn text(&self) -> String {
        let clauses = self.clauses();
        let said = said(&self.questions.can[0].text);
        let (mut text, mut now) = (String::new(), 1);
        for (at, clause) in clauses.iter().enumerate() {
            let begins = if at == 0 { "" } else { "; " };
            let when = match (clause.scan - now, at) {
                (0, 0) => String::new(),
                (0, _) => "then ".to_owned(),
                (scans, 0) => format!("wait {}, then ", self.time(scans)),
                (scans, _) => format!("{} later ", self.time(scans)),
            };
            text += &format!("{begins}{when}{}", clause.text);
            // A pulse of one scan is a moment.
            now = if clause.end == clause.scan + 1 { clause.scan } else { clause.end };
        }
        match (self.scans.saturating_sub(now), clauses.last()) {
            (0, None) => format!("change nothing: {said} in the next scan"),
            (scans, None) => format!("change nothing: {said} {} later", self.time(scans + 1)),
            (0, Some(last)) if last.end > last.scan => format!("{text}; then {said}"),
            (0, Some(_)) => format!("{text}; {said} in the same scan"),
            (scans, Some(_)) => format!("{text}; {} later {said}", self.time(scans)),
        }
    }

    fn time(&self, scans: u64) -> String {
        time_text(scans * self.questions.model.period_ns())
    }

    fn clauses(&self) -> Vec<Clause> {
        let mut told = vec![false; self.changes.len()];
        let mut clauses = Vec::new();
        while let Some(first) = told.iter().position(|told| !told) {
            let scan = self.changes[first].scan;
            let group: Vec<usize> = (first..self.changes.len())
                .filter(|at| !told[*at] && self.changes[*at].scan == scan)
                .collect();
            group.iter().for_each(|at| told[*at] = true);
            match self.release(&group, &told) {
                Some(release) => {
                    let end = self.changes[release[0]].scan;
                    release.iter().for_each(|at| told[*at] = true);
                    let how_long = match end - scan {
                        1 => "one scan".to_owned(),
                        scans => self.time(scans),
                    };
                    let text = format!("hold {} for {how_long}", self.held(&group));
                    clauses.push(Clause { text, scan, end });
                }
                None => clauses.push(Clause { text: self.turned(&group), scan, end: scan }),
            }
        }
        clauses
    }

    /// The changes that give back all levels of a group, if they are the next ones of all.
    fn release(&self, group: &[usize], told: &[bool]) -> Option<Vec<usize>> {
        let next = (0..self.changes.len()).find(|at| !told[*at])?;
        let scan = self.changes[next].scan;
        let release = group.iter().map(|at| {
            let InputChange { name, before, is_written, .. } = &self.changes[*at];
            let gives_back = |other: &InputChange| {
                other.scan == scan && other.name == *name && other.value == *before
            };
            let found = self.changes.iter().position(gives_back);
            found.filter(|_| !is_written && self.changes[*at].is_bit)
        });
        release.collect()
    }

    fn held(&self, group: &[usize]) -> String {
        let all = group.iter().map(|at| {
            let InputChange { name, value, .. } = &self.changes[*at];
            if *value == 0 { format!("{name} OFF") } else { name.clone() }
        });
        listed(&all.collect::<Vec<_>>())
    }

    fn turned(&self, group: &[usize]) -> String {
        let all = |chosen: &dyn Fn(&InputChange) -> bool| -> Vec<&InputChange> {
            group.iter().map(|at| &self.changes[*at]).filter(|one| chosen(one)).collect()
        };
        let names = |all: &[&InputChange]| {
            listed(&all.iter().map(|one| one.name.clone()).collect::<Vec<_>>())
        };
        let mut parts = Vec::new();
        for (value, word) in [(1, "ON"), (0, "OFF")] {
            let turned = all(&|one| one.is_bit && !one.is_written && one.value == value);
            if !turned.is_empty() {
                parts.push(format!("turn {} {word}", names(&turned)));
            }
        }
        for one in all(&|one| !one.is_bit && !one.is_written) {
            parts.push(format!("set {} to {}", one.name, one.text));
        }
        for one in all(&|one| one.is_written) {
            parts.push(format!("write {} into {}", one.text, one.name));
        }
        listed(&parts)
    }
}

/// What changes before each scan.
fn changes(questions: &Questions, path: &Path) -> Vec<InputChange> {
    let model: &ProofModel = &questions.model;
    let (mut run, mut changes) = (Run::new(model), Vec::new());
    for (scan, values) in (1..).zip(&path.scans) {
        for (at, value) in values.iter().enumerate() {
            let (input, named) = (&model.inputs[at], &questions.inputs[at]);
            let before = run.engine.image().value(input.cell);
            if before != *value {
                changes.push(InputChange {
                    scan,
                    name: named.name.clone(),
                    value: *value,
                    text: model.code.layout.text(input.cell, *value),
                    is_bit: input.cell.is_bit(),
                    is_written: named.is_written,
                    before,
                });
            }
        }
        run.scan(values);
    }
    changes
}

/// A condition as a fact: `pump1 is ON`.
pub(super) fn said(condition: &str) -> String {
    let is_name = |text: &str| {
        let is_part = |c: char| c.is_alphanumeric() || "_.$[]-".contains(c);
        !text.is_empty() && text.chars().all(is_part)
    };
    let condition = condition.trim();
    match condition.strip_prefix('!') {
        Some(name) if is_name(name) => format!("{name} is OFF"),
        None if is_name(condition) => format!("{condition} is ON"),
        Some(_) | None => format!("`{condition}` is true"),
    }
}
