//! The rungs and the outcome of a body whose last pass is made; called by `passes`.

use std::collections::HashSet;

use super::body::{BodyPlace, Pass, PassNeeds, TranslatedBody};
use super::elements::ElementBody;
use super::graph::LadderGraph;
use super::memory::PlcopenMemory;
use super::networks::{LadderNetwork, conditions, description, parts};
use super::rung_names::RungNames;
use crate::model::{Fate, ProjectRung, RungBody, RungOutcome};
use crate::rungs::{ForeignRung, rungs};
use rungd_language::source::renaming::kebab;

/// The networks of a body.
#[derive(Clone, Copy)]
pub(super) struct Networks<'n> {
    pub(super) graph: &'n LadderGraph<'n>,
    pub(super) networks: &'n [LadderNetwork],
}

/// A body whose last pass is made.
#[derive(Clone, Copy)]
pub(super) struct DoneBody<'n> {
    pub(super) needs: &'n PassNeeds,
    pub(super) all: Networks<'n>,
    pub(super) place: BodyPlace<'n>,
}

/// The rungs of the last pass.
pub(super) fn finished(
    memory: &mut PlcopenMemory,
    pass: Pass,
    body: DoneBody<'_>,
) -> TranslatedBody {
    let DoneBody { needs, all, place } = body;
    let mut done = TranslatedBody::default();
    let mut names = RungNames::default();
    let mut seen = HashSet::new();
    memory.scopes[place.scope].tags.extend(pass.tags);
    done.blocks = pass.blocks;
    if !place.is_template {
        memory.driven = pass.driven;
    }
    for turn in pass.turns {
        let network = &all.networks[turn.network];
        let is_first = seen.insert(turn.network);
        let name = rung_name(all, network, &mut names);
        let doc = if is_first { network.doc.clone() } else { String::new() };
        if let Some(reason) = needs.failed.get(&turn.network) {
            if is_first {
                let was = description(all.graph, network);
                let body = RungBody::Todo { reason: reason.clone(), was };
                let rungs = if turn.is_head { &mut done.heads } else { &mut done.rungs };
                rungs.push(ProjectRung { name: Some(name), doc, body });
            }
            continue;
        }
        let mut tags = Vec::new();
        let prefix = format!("{}_{}", place.prefix, name.replace('-', "_"));
        let foreign = ForeignRung { name, doc, prefix, names: &mut memory.names, tags: &mut tags };
        let mut made = rungs(turn.steps, foreign);
        // `stop-2` may be the second rung of `stop`, or of a coil `stop_2`.
        made.iter_mut().skip(1).for_each(|rung| names.keep_apart(rung));
        if turn.is_head { &mut done.heads } else { &mut done.rungs }.extend(made);
        memory.scopes[place.scope].tags.extend(tags);
    }
    done.conditions = pass.conditions;
    let is_chart = !conditions(all.graph).is_empty();
    for (number, network) in all.networks.iter().enumerate() {
        let mut differences: Vec<String> = pass.differences[number].iter().cloned().collect();
        if is_chart && !is_judged(all, network) {
            differences.push("it leads to no transition, and does nothing".to_owned());
        }
        let fate = match needs.failed.get(&number) {
            Some(reason) => Fate::Todo(reason.clone()),
            None if differences.is_empty() => Fate::Exact,
            None => Fate::Different(differences),
        };
        // A network without anything that acts does nothing here and there.
        done.outcomes.push(RungOutcome {
            place: place.title.to_owned(),
            number,
            text: description(all.graph, network),
            parts: parts(all.graph, network),
            fate,
        });
    }
    done
}

/// Whether a network leads to a transition.
fn is_judged(all: Networks<'_>, network: &LadderNetwork) -> bool {
    let mut bodies = network.elements.iter().map(|at| &all.graph.elements[*at].body);
    bodies.any(|body| matches!(body, ElementBody::Condition(_)))
}

/// A name for the rungs of a network: what it writes first.
fn rung_name(all: Networks<'_>, network: &LadderNetwork, names: &mut RungNames) -> String {
    let bodies = || network.elements.iter().map(|at| &all.graph.elements[*at].body);
    let named = bodies().find_map(|body| {
        if let ElementBody::Coil { variable: name, .. }
        | ElementBody::OutVariable { expression: name, .. } = body
        {
            Some(kebab(name))
        } else if let ElementBody::Condition(condition) = body {
            Some(kebab(&condition.label))
        } else {
            None
        }
    });
    let block = bodies().find_map(ElementBody::block);
    let block = block.map(|block| kebab(block.instance.as_ref().unwrap_or(&block.kind)));
    let is_legal =
        |name: &String| name.len() <= 60 && name.starts_with(|c: char| c.is_ascii_lowercase());
    let base = named.or(block).filter(is_legal).unwrap_or_else(|| "network".to_owned());
    // The rungs of a network are called `name`, `name-2` …
    names.fresh(base)
}
