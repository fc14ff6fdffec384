//! The facts that a survey is about, before anything is known of them: what each is called, and the
//! conditions that decide it.
//!
//! Called by `survey`. The order is that of the ladder: outputs, alarms, Stages, structures and
//! interlocks, then rung by rung.

use std::sync::Arc;

use rungd_engine::isa::{Address, Bit, BlockId, ElementId};
use rungd_lab::draw::instruction_text;
use rungd_lab::testing::Suite;
use rungd_language::resolve::program::{BlockKind, Contact, Edge, Program, Rung};
use rungd_language::source::span::Span;

use super::contacts::not;
use super::facts::FactKind;
use super::probes::{Probe, ProbedRung, Prober, WatchedPlace};
use crate::equal::driven_by;

/// A fact that is still to be decided.
#[derive(Clone, Debug)]
pub(super) struct Draft {
    /// What it says.
    pub kind: FactKind,
    /// What it is about: `output pump`.
    pub subject: String,
    /// The bit that it is about, for outputs and alarms.
    pub bit: Option<Bit>,
    /// Where that stands.
    pub span: Span,
    /// The conditions: each is asked whether it can be ON.
    pub asks: Vec<Contact>,
    /// The number of the first of them among those of all drafts.
    pub first: usize,
    /// The number of the draft of the power around it: a rung that is never ON has no other facts.
    pub within: Option<usize>,
}

/// A ladder with its probes.
pub(super) struct ProbedLadder {
    pub program: Program,
    pub probes: Vec<Bit>,
    pub drafts: Vec<Draft>,
}

impl ProbedLadder {
    /// Those of the first program of a test file.
    pub fn of(suite: &Suite) -> ProbedLadder {
        let first = &suite.programs[0];
        let seen = first.view.as_ref().map(|view| view.observed());
        let program = seen.map_or(&*first.program, |observed| &observed.program);
        let observer = seen.and_then(|observed| observed.observer);
        let prober = Prober::of(program);
        let mut drafting = Drafting { program, prober, all: Vec::new() };
        drafting.outputs(suite);
        let mut probed = program.clone();
        let rungs = drafting.elements(&mut probed, observer);
        drafting.interlocks(suite);
        rungs.into_iter().for_each(|rung| drafting.rung(rung));
        let Drafting { prober, all, .. } = drafting;
        probed.sizes.c = prober.size();
        ProbedLadder { program: probed, probes: prober.bits, drafts: all }
    }
}

struct Drafting<'p> {
    program: &'p Program,
    prober: Prober,
    all: Vec<Draft>,
}

impl Drafting<'_> {
    fn add(&mut self, kind: FactKind, subject: String, asks: Vec<Contact>) -> &mut Draft {
        let (bit, span, within) = (None, Span::default(), None);
        let first = self.all.last().map_or(0, |last| last.first + last.asks.len());
        self.all.push(Draft { kind, subject, bit, span, asks, first, within });
        self.all.last_mut().expect("one was added")
    }

    /// The outputs and alarms, in the order in which the ladder names them.
    fn outputs(&mut self, suite: &Suite) {
        let program = self.program;
        let mut driven = driven_by(suite);
        let named = |address: &Address| {
            program.operands.iter().position(|operand| operand.address == *address)
        };
        driven.sort_by_key(|address| named(address).unwrap_or(usize::MAX));
        let alarm = |address: &Address| {
            let tag = program.names.tag_index(*address)?;
            program.tags[tag].alarm.as_ref().map(|_| program.tags[tag].span)
        };
        let (alarms, outputs): (Vec<_>, Vec<_>) =
            driven.into_iter().partition(|address| alarm(address).is_some());
        for (kind, word, all) in
            [(FactKind::Output, "output", outputs), (FactKind::Alarm, "alarm", alarms)]
        {
            for address in all {
                let Address::Bit(bit) = address else { continue };
                let name = program.names.name(address);
                let span = alarm(&address).unwrap_or_default();
                let draft = self.add(kind, format!("{word} {name}"), comes_and_goes(bit));
                (draft.bit, draft.span) = (Some(bit), span);
            }
        }
    }

    /// Puts probes into all elements; adds the facts about Stages and structures.
    fn elements(&mut self, probed: &mut Program, observer: Option<BlockId>) -> Vec<WatchedRung> {
        let mut all = Vec::new();
        let names = Arc::clone(&self.program.names);
        for block in &mut probed.blocks {
            if block.kind == BlockKind::LastScan || Some(block.id) == observer {
                continue;
            }
            let element = ElementId { block: block.id, stage: None };
            self.rungs(&mut block.rungs, names.element(element), &mut all);
            for stage in &mut block.stages {
                let element = ElementId { block: block.id, stage: Some(stage.id) };
                let name = names.element(element);
                let bit = Bit::Stage(stage.id);
                let (rung, executes) = self.prober.executes();
                let [is_on, executes] = [bit, executes].map(|bit| Contact::Bit(bit, stage.span));
                let comes = Contact::Any(vec![is_on.clone(), executes.clone()], stage.span);
                let fall = Contact::Edge(Edge::Fall, Box::new(is_on.clone()), stage.span);
                let passed = Contact::All(vec![executes, not(is_on)], stage.span);
                let goes = Contact::Any(vec![fall, passed], stage.span);
                let span = stage.span;
                self.add(FactKind::Stage, format!("Stage {name}"), vec![comes, goes]).span = span;
                self.rungs(&mut stage.rungs, name, &mut all);
                stage.rungs.insert(0, rung);
            }
        }
        for rung in &all {
            for Probe { watched, bit, span } in &rung.probes {
                let WatchedPlace::Done(structure) = watched else { continue };
                let name = names.name(Address::Structure(*structure));
                let done = vec![Contact::Bit(*bit, *span)];
                let word = structure.done_name();
                self.add(FactKind::Done, format!("{name}.{word}"), done).span = *span;
            }
        }
        all
    }

    /// Puts probes into the rungs of an element.
    fn rungs(&mut self, rungs: &mut Vec<Rung>, element: &str, all: &mut Vec<WatchedRung>) {
        let mut probed = Vec::new();
        for (at, rung) in rungs.iter().enumerate() {
            let label = format!("{element}, {}", rung.label(element, at));
            let ProbedRung { before, rung, behind, probes } = self.prober.rung(rung);
            all.push(WatchedRung { label, span: rung.extent, probes });
            probed.extend(before.into_iter().chain([rung]).chain(behind));
        }
        *rungs = probed;
    }

    fn interlocks(&mut self, suite: &Suite) {
        let always = &suite.always[0];
        let first = always.len() - suite.interlocked;
        for condition in &always[first..] {
            let subject = format!("interlock {}", condition.text);
            self.add(FactKind::Interlock, subject, vec![not(condition.contact.clone())]);
        }
    }

    fn rung(&mut self, WatchedRung { label, span, probes }: WatchedRung) {
        let first = self.all.len();
        // By probe: the number of its draft.
        let mut numbers = vec![first; probes.len()];
        for (at, Probe { watched, bit, span: own }) in probes.into_iter().enumerate() {
            numbers[at] = self.all.len();
            let asks = vec![Contact::Bit(bit, own)];
            let (kind, subject, within) = match watched {
                WatchedPlace::Done(_) => continue,
                WatchedPlace::Power(None) => (FactKind::Power, label.clone(), None),
                WatchedPlace::Power(Some(of)) => (FactKind::Power, format!("{label}, {of}"), None),
                WatchedPlace::Part(part, around) => {
                    let part = self.program.names.contact(&part);
                    let subject = format!("{label}, contact `{part}`");
                    (FactKind::Part, subject, Some(numbers[around]))
                }
                WatchedPlace::Mishap(mishap, instruction) => {
                    let text = instruction.map_or("its contacts".to_owned(), |instruction| {
                        format!("`{}`", instruction_text(self.program, &instruction))
                    });
                    let subject = format!("{label}, {text}, {}", mishap.word());
                    (FactKind::Mishap(mishap), subject, None)
                }
            };
            let draft = self.add(kind, subject, asks);
            (draft.within, draft.span) = (within, if own == Span::default() { span } else { own });
        }
    }
}

/// A rung, as it is called, and its probes.
struct WatchedRung {
    label: String,
    span: Span,
    probes: Vec<Probe>,
}

/// A bit is ON, and a bit goes OFF.
fn comes_and_goes(bit: Bit) -> Vec<Contact> {
    let on = Contact::Bit(bit, Span::default());
    let fall = Contact::Edge(Edge::Fall, Box::new(on.clone()), Span::default());
    vec![on, fall]
}
