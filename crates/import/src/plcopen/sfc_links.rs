//! Which steps a transition leads from and to, and the order in which a chart is written as text.
//!
//! Called by `sfc`. The file connects everything backwards: an element names what stands above it.
//! The order is that of the text which Beremiz and OpenPLC generate: from the initial steps on,
//! each step with its actions, then each of its transitions with what follows; it decides in which
//! order actions act.

use std::collections::{HashMap, HashSet};

use super::elements::Connection;
use super::sfc_elements::{ChartItem, LinkKind, SfcChart};

/// Most elements that are walked over in a chart.
const WALK_MAX: usize = 100_000;

/// How the elements of a chart are connected.
#[derive(Debug, Default)]
pub(super) struct ChartLinks {
    /// Of each transition.
    pub(super) transitions: Vec<TransitionLinks>,
    /// The step of each action block.
    pub(super) blocks: Vec<Result<Vec<usize>, String>>,
    /// What is wrong about the way into a step.
    pub(super) steps: Vec<Option<String>>,
    /// What is wrong about a link; and whether a transition uses it.
    pub(super) links: Vec<LinkUse>,
    /// The steps as the text has them; those that no way leads to are not in it.
    pub(super) order: Vec<usize>,
    /// The transitions as the text has them.
    pub(super) transition_order: Vec<usize>,
    /// The transitions as the generator of the text meets them: what leads to them is executed in
    /// this order.
    pub(super) met: Vec<usize>,
}

/// Where a transition leads from and to.
#[derive(Clone, Debug, Default)]
pub(super) struct TransitionLinks {
    pub(super) from: Vec<usize>,
    pub(super) to: Vec<usize>,
    /// What is wrong about it.
    pub(super) wrong: Option<String>,
}

/// What is known about a jump, a divergence or a convergence.
#[derive(Clone, Debug, Default)]
pub(super) struct LinkUse {
    pub(super) is_used: bool,
    pub(super) wrong: Option<String>,
}

/// A direction in which a way is followed back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sought {
    /// From a transition to the steps before it.
    Steps,
    /// From a step to the transitions before it.
    Transitions,
}

/// Finds the links of a chart.
pub(super) fn links(chart: &SfcChart) -> ChartLinks {
    let mut walk = WayWalk::of(chart);
    let mut found = ChartLinks {
        transitions: vec![TransitionLinks::default(); chart.transitions.len()],
        links: vec![LinkUse::default(); chart.links.len()],
        ..ChartLinks::default()
    };
    for (at, transition) in chart.transitions.iter().enumerate() {
        match walk.back(&transition.input, Sought::Steps) {
            Ok(from) if from.is_empty() => {
                found.transitions[at].wrong = Some("a transition behind no step".to_owned());
            }
            Ok(from) => found.transitions[at].from = from,
            Err(why) => found.transitions[at].wrong = Some(why),
        }
    }
    let before = Before {
        steps: vec![Vec::new(); chart.steps.len()],
        links: vec![Vec::new(); chart.links.len()],
    };
    let mut into = Into { walk, found, before };
    into.steps(chart);
    into.jumps(chart);
    let Into { mut walk, mut found, before } = into;
    found.blocks =
        chart.blocks.iter().map(|block| walk.back(&block.input, Sought::Steps)).collect();
    for (used, link) in walk.used.iter().zip(&mut found.links) {
        link.is_used = *used;
    }
    for transition in &mut found.transitions {
        if transition.to.is_empty() && transition.wrong.is_none() {
            transition.wrong = Some("a transition before no step".to_owned());
        }
    }
    order(chart, &mut found, &before);
    found
}

/// The transitions before each step, without jumps, and before each jump.
struct Before {
    steps: Vec<Vec<usize>>,
    links: Vec<Vec<usize>>,
}

/// The ways into steps, while they are found.
struct Into<'c> {
    walk: WayWalk<'c>,
    found: ChartLinks,
    before: Before,
}

impl Into<'_> {
    fn steps(&mut self, chart: &SfcChart) {
        for (at, step) in chart.steps.iter().enumerate() {
            let before = self.walk.back(&step.input, Sought::Transitions);
            self.found.steps.push(before.as_ref().err().cloned());
            for transition in before.unwrap_or_default() {
                self.before.steps[at].push(transition);
                self.found.transitions[transition].to.push(at);
            }
        }
    }

    fn jumps(&mut self, chart: &SfcChart) {
        let mut named: HashMap<String, usize> = HashMap::new();
        for (at, step) in chart.steps.iter().enumerate() {
            named.entry(step.name.to_lowercase()).or_insert(at);
        }
        for (at, link) in chart.links.iter().enumerate() {
            if link.kind != LinkKind::Jump {
                continue;
            }
            let target = named.get(&link.target.to_lowercase()).copied();
            match self.walk.back(&link.input, Sought::Transitions) {
                Ok(before) => {
                    self.walk.used[at] = !before.is_empty();
                    before.iter().for_each(|one| self.jump(*one, target, &link.target));
                    self.before.links[at] = before;
                }
                Err(why) => self.found.links[at].wrong = Some(why),
            }
            if target.is_none() {
                let why = format!("a jump to `{}`, which no step is called", link.target);
                self.found.links[at].wrong = Some(why);
            }
        }
    }

    fn jump(&mut self, transition: usize, target: Option<usize>, name: &str) {
        let found = &mut self.found.transitions[transition];
        match target {
            Some(step) => found.to.push(step),
            None => {
                found.wrong = Some(format!("a jump to `{name}`, which no step is called"));
            }
        }
    }
}

/// Ways that are followed back.
struct WayWalk<'c> {
    chart: &'c SfcChart,
    by_id: HashMap<u64, ChartItem>,
    /// The links that were passed.
    used: Vec<bool>,
    walked: usize,
}

impl WayWalk<'_> {
    fn of(chart: &SfcChart) -> WayWalk<'_> {
        let mut by_id = HashMap::new();
        for item in &chart.items {
            let id = match item {
                ChartItem::Step(at) => chart.steps[*at].id,
                ChartItem::Transition(at) => chart.transitions[*at].id,
                ChartItem::Link(at) => chart.links[*at].id,
                ChartItem::Block(_) => continue,
            };
            by_id.entry(id).or_insert(*item);
        }
        WayWalk { chart, by_id, used: vec![false; chart.links.len()], walked: 0 }
    }

    /// What is sought behind some lines, from left to right.
    ///
    /// # Errors
    /// A line comes from something else, or from nothing.
    fn back(&mut self, input: &[Connection], sought: Sought) -> Result<Vec<usize>, String> {
        let mut found = Vec::new();
        let mut seen = HashSet::new();
        let mut waiting: Vec<&Connection> = input.iter().rev().collect();
        let chart = self.chart;
        while let Some(connection) = waiting.pop() {
            self.walked += 1;
            if self.walked > WALK_MAX {
                return Err(format!("a chart with more than {WALK_MAX} ways"));
            }
            if !seen.insert(connection.id) {
                continue;
            }
            match self.by_id.get(&connection.id) {
                Some(ChartItem::Step(at)) if sought == Sought::Steps => found.push(*at),
                Some(ChartItem::Transition(at)) if sought == Sought::Transitions => {
                    found.push(*at);
                }
                Some(ChartItem::Link(at)) if leads(chart.links[*at].kind, sought) => {
                    self.used[*at] = true;
                    waiting.extend(chart.links[*at].input.iter().rev());
                }
                Some(item) => return Err(misplaced(chart, *item, sought)),
                None => {
                    let id = connection.id;
                    return Err(format!("a connection to the element {id}, which is none here"));
                }
            }
        }
        Ok(found)
    }
}

/// Whether a link can stand on a way back to what is sought.
fn leads(kind: LinkKind, sought: Sought) -> bool {
    match kind {
        LinkKind::SelectionDivergence | LinkKind::SimultaneousConvergence => {
            sought == Sought::Steps
        }
        LinkKind::SelectionConvergence | LinkKind::SimultaneousDivergence => {
            sought == Sought::Transitions
        }
        LinkKind::Jump => false,
    }
}

fn misplaced(chart: &SfcChart, item: ChartItem, sought: Sought) -> String {
    let what = match item {
        ChartItem::Step(at) => format!("the step {}", chart.steps[at].name),
        ChartItem::Transition(_) => "a transition".to_owned(),
        ChartItem::Link(at) => format!("a {}", chart.links[at].kind.name()),
        ChartItem::Block(_) => "an action block".to_owned(),
    };
    match sought {
        Sought::Steps => format!("{what} where a step must stand before"),
        Sought::Transitions => format!("{what} where a transition must stand before"),
    }
}

/// What is done next, while the order is found.
#[derive(Clone, Copy, Debug)]
enum Visit {
    Step(usize),
    Transition(usize),
    /// A transition leads from a step.
    From {
        step: usize,
        transition: usize,
    },
}

/// Finds the order of the text: first the transitions of each step, as the generator meets them,
/// then the steps from the initial ones on.
fn order(chart: &SfcChart, found: &mut ChartLinks, before: &Before) {
    let leaving = leaving(chart, found, before);
    let mut has_step = vec![false; chart.steps.len()];
    let mut has_transition = vec![false; chart.transitions.len()];
    let initial = (0..chart.steps.len()).filter(|at| chart.steps[*at].is_initial);
    let mut waiting: Vec<Visit> = initial.map(Visit::Step).collect();
    waiting.reverse();
    while let Some(visit) = waiting.pop() {
        match visit {
            Visit::Step(at) if !std::mem::replace(&mut has_step[at], true) => {
                found.order.push(at);
                waiting.extend(leaving[at].iter().rev().map(|one| Visit::Transition(*one)));
            }
            Visit::Transition(at) if !std::mem::replace(&mut has_transition[at], true) => {
                found.transition_order.push(at);
                let to = &found.transitions[at].to;
                waiting.extend(to.iter().rev().map(|one| Visit::Step(*one)));
            }
            Visit::Step(_) | Visit::Transition(_) | Visit::From { .. } => {}
        }
    }
    // What no way leads to is never active; it stands behind the others.
    let rest = (0..chart.transitions.len()).filter(|at| !has_transition[*at]);
    found.transition_order.extend(rest);
}

/// The transitions that leave each step, in the order in which the generator meets them.
fn leaving(chart: &SfcChart, found: &mut ChartLinks, before: &Before) -> Vec<Vec<usize>> {
    let mut leaving: Vec<Vec<usize>> = vec![Vec::new(); chart.steps.len()];
    let mut has_step = vec![false; chart.steps.len()];
    let mut has_transition = vec![false; chart.transitions.len()];
    for item in &chart.items {
        let mut waiting = match item {
            ChartItem::Step(at) => vec![Visit::Step(*at)],
            ChartItem::Transition(at) => vec![Visit::Transition(*at)],
            ChartItem::Link(at) => {
                before.links[*at].iter().rev().map(|one| Visit::Transition(*one)).collect()
            }
            ChartItem::Block(at) => {
                let steps = found.blocks[*at].as_deref().unwrap_or_default();
                steps.iter().rev().map(|one| Visit::Step(*one)).collect()
            }
        };
        while let Some(visit) = waiting.pop() {
            match visit {
                Visit::Step(at) if !std::mem::replace(&mut has_step[at], true) => {
                    waiting
                        .extend(before.steps[at].iter().rev().map(|one| Visit::Transition(*one)));
                }
                Visit::Transition(at) if !std::mem::replace(&mut has_transition[at], true) => {
                    found.met.push(at);
                    for step in found.transitions[at].from.iter().rev() {
                        waiting.push(Visit::From { step: *step, transition: at });
                        waiting.push(Visit::Step(*step));
                    }
                }
                Visit::From { step, transition } => leaving[step].push(transition),
                Visit::Step(_) | Visit::Transition(_) => {}
            }
        }
    }
    leaving
}
