//! The chart of a program: steps as bits that transitions SET and RST, one step a scan.
//!
//! Called by `project`. A scan of a chart goes as in the code that MatIEC makes of the text which
//! Beremiz and OpenPLC generate: times, transitions, steps that are left, steps that are entered,
//! actions (`sfc_actions`), and then the bodies of those that are active. rungd's own Stages would
//! not do the same: a JMP acts at its place, and a Stage that is left turns OFF what it drives.

use std::collections::{HashMap, HashSet};

use super::body::{BodyPlace, TranslatedBody, UnitBlocks};
use super::memory::PlcopenMemory;
use super::networks::network_rows;
use super::rung_names::RungNames;
use super::sfc_actions::{AT_NO_STEP, KnownActions, NEVER};
use super::sfc_elements::{ActionBody, NamedBody, SfcBody, SfcChart};
use super::sfc_links::links;
use super::sfc_work::{ChartRungs, ChartWork, ScanPart, StepBatch, act};
use super::types::StepTag;
use crate::model::{Fate, PartCount, ProjectRung, RungBody};

/// Translates a chart.
pub(super) fn translated_chart(
    memory: &mut PlcopenMemory,
    units: &UnitBlocks,
    chart: &SfcChart,
    place: BodyPlace<'_>,
) -> TranslatedBody {
    let steps = memory.scopes[place.scope].steps.clone();
    let mut work = ChartWork {
        memory,
        units,
        chart,
        place,
        links: links(chart),
        steps,
        done: TranslatedBody::default(),
        rungs: ChartRungs::default(),
        was: HashMap::new(),
        batch: StepBatch::default(),
        elapsed: None,
        names: RungNames::default(),
        rows: 0,
        known: HashMap::new(),
        named: HashSet::new(),
        refused: HashMap::new(),
        needed: Vec::new(),
    };
    work.time_steps();
    work.transitions();
    work.step_rows();
    work.link_rows();
    let needed = std::mem::take(&mut work.needed);
    let known = work.actions(needed);
    work.unused_bodies(&known);
    work.finished()
}

impl ChartWork<'_> {
    fn finished(self) -> TranslatedBody {
        let ChartRungs { times, heads, judged, entered, acting, called } = self.rungs;
        let about = ProjectRung {
            name: None,
            doc: "A sequential function chart: its transitions, the steps that they enter, and \
                  the actions of the steps"
                .to_owned(),
            body: RungBody::Comment,
        };
        let rungs = [vec![about], times, heads, judged, entered, acting, called].concat();
        TranslatedBody { rungs, ..self.done }
    }

    /// Counts the time of the steps that something asks for.
    fn time_steps(&mut self) {
        for at in 0..self.steps.len() {
            let Ok(StepTag { name, is_timed: true }) = self.steps[at].clone() else { continue };
            let elapsed = self.elapsed();
            let text = format!("MATH {name}.T = {name}.T + {elapsed}");
            let steps = vec![act(self.is_active(at), text)];
            self.rung(ScanPart::Times, &format!("time {name}"), steps);
        }
    }

    /// Bodies with names that nothing executes: their fate is that of what names them.
    fn unused_bodies(&mut self, known: &KnownActions) {
        let chart = self.chart;
        let mut fates = self.fates_of_blocks();
        for (name, found) in known {
            if let Err(why) = found {
                fates.insert(name.clone(), Fate::Todo(why.clone()));
            }
        }
        for named in &chart.actions {
            let key = named.name.to_lowercase();
            // The row of a step's action says already why another body than a ladder has a stub.
            let is_told = match known.get(&key) {
                Some(found) => found.is_ok() || !matches!(named.body, SfcBody::Ladder(_)),
                None => false,
            };
            if !is_told {
                self.unused_body(named, "action", fates.get(&key).cloned());
            }
        }
        for named in &chart.conditions {
            let key = named.name.to_lowercase();
            if !self.named.contains(&key) {
                let fate = self.refused.get(&key).cloned().map(Fate::Todo);
                self.unused_body(named, "transition", fate);
            }
        }
    }

    /// The fates of the actions that action blocks name, if none of their steps acts.
    fn fates_of_blocks(&self) -> HashMap<String, Fate> {
        let mut fates: HashMap<String, Fate> = HashMap::new();
        for (block, steps) in self.chart.blocks.iter().zip(&self.links.blocks) {
            let fate = match steps {
                Ok(steps) if steps.is_empty() => Fate::Todo(AT_NO_STEP.to_owned()),
                Ok(_) => Fate::Different(vec![NEVER.to_owned()]),
                Err(why) => Fate::Todo(why.clone()),
            };
            for action in &block.actions {
                let ActionBody::Named(name) = &action.body else { continue };
                let place = fates.entry(name.to_lowercase()).or_insert_with(|| fate.clone());
                if matches!(fate, Fate::Todo(_)) {
                    place.clone_from(&fate);
                }
            }
        }
        fates
    }

    fn unused_body(&mut self, named: &NamedBody, what: &str, fate: Option<Fate>) {
        let NamedBody { name, body } = named;
        let fate = fate.unwrap_or_else(|| {
            let why = "nothing in the chart names it: it is never executed";
            Fate::Different(vec![why.to_owned()])
        });
        let title = format!("{}, {what} {name}", self.place.title);
        match body {
            SfcBody::Ladder(elements) => {
                self.done.outcomes.extend(network_rows(&title, elements, &fate));
            }
            SfcBody::Text(_) | SfcBody::Other(_) => {
                self.row(format!("{what} {name} in {}", body.language()), what, fate);
            }
        }
    }

    fn step_rows(&mut self) {
        let reached: HashSet<usize> = self.links.order.iter().copied().collect();
        for at in 0..self.steps.len() {
            let step = &self.chart.steps[at];
            let text = format!("step {}", step.name);
            let wrong = self.steps[at].as_ref().err().or(self.links.steps[at].as_ref()).cloned();
            let fate = match wrong {
                Some(why) => {
                    self.stub(ScanPart::Judged, &text, &why);
                    Fate::Todo(why)
                }
                None if reached.is_empty() => {
                    Fate::Todo("a chart without an initial step".to_owned())
                }
                None if reached.contains(&at) => Fate::Exact,
                None => {
                    let why = "no way leads to the step: it is never active";
                    Fate::Different(vec![why.to_owned()])
                }
            };
            self.row(text, if step.is_macro { "macroStep" } else { "step" }, fate);
        }
        if reached.is_empty() {
            self.stub(ScanPart::Judged, "chart", "a chart without an initial step");
        }
    }

    fn link_rows(&mut self) {
        let mut parts: Vec<PartCount> = Vec::new();
        for (at, link) in self.chart.links.iter().enumerate() {
            let kind = link.kind.name();
            let used = self.links.links[at].clone();
            let text = format!("{kind} {}", link.target).trim().to_owned();
            match used.wrong {
                Some(why) => self.row(text, kind, Fate::Todo(why)),
                None if used.is_used => match parts.iter_mut().find(|part| part.kind == kind) {
                    Some(part) => part.count += 1,
                    None => parts.push(PartCount { kind: kind.to_owned(), count: 1 }),
                },
                None => {
                    let why = "no transition leads to it: it does nothing".to_owned();
                    self.row(text, kind, Fate::Different(vec![why]));
                }
            }
        }
        if !parts.is_empty() {
            self.row("ways".to_owned(), "", Fate::Exact);
            if let Some(row) = self.done.outcomes.last_mut() {
                row.parts = parts;
            }
        }
    }
}
