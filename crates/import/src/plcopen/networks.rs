//! The networks of a ladder body, and the order in which its coils and blocks act.
//!
//! A network is what is connected, without the power rails: the rungs of the report. The order is
//! that of Beremiz' and OpenPLC's generator, from the top down and from left to right; a body
//! without positions, as CODESYS writes it, is executed network by network in the file's order.

use super::elements::{ElementBody, LadderElement};
use super::graph::{LadderGraph, inputs};
use crate::model::{Fate, PartCount, RungOutcome};

/// What is connected.
#[derive(Clone, Debug, Default)]
pub(super) struct LadderNetwork {
    pub(super) elements: Vec<usize>,
    pub(super) doc: String,
}

/// Elements whose places differ by less stand in one row.
const ROW: i64 = 10;
/// Longest comment that is kept.
const DOC_MAX: usize = 1000;

/// The networks of a graph, from the top down, and the network of each element.
pub(super) fn networks(graph: &LadderGraph<'_>) -> (Vec<LadderNetwork>, Vec<Option<usize>>) {
    let mut joined: Vec<usize> = (0..graph.elements.len()).collect();
    for (at, element) in graph.elements.iter().enumerate() {
        if !is_part(element) {
            continue;
        }
        for connection in inputs(element) {
            if let Ok(source) = graph.source(connection)
                && is_part(&graph.elements[source])
            {
                join(&mut joined, at, source);
            }
        }
        if let ElementBody::Continuation { name } = &element.body
            && let Some(connector) = graph.connector(name)
        {
            join(&mut joined, at, connector);
        }
    }
    let mut networks: Vec<LadderNetwork> = Vec::new();
    let mut number = vec![None; graph.elements.len()];
    let mut order: Vec<usize> =
        (0..graph.elements.len()).filter(|at| is_part(&graph.elements[*at])).collect();
    if has_places(graph.elements) {
        order.sort_by_key(|at| (graph.elements[*at].y, graph.elements[*at].x));
    }
    for at in order {
        let root = root(&mut joined, at);
        let network = *number[root].get_or_insert_with(|| {
            networks.push(LadderNetwork::default());
            networks.len() - 1
        });
        networks[network].elements.push(at);
    }
    let mut of = vec![None; graph.elements.len()];
    for (at, network) in networks.iter_mut().enumerate() {
        network.elements.sort_unstable();
        network.elements.iter().for_each(|element| of[*element] = Some(at));
    }
    comments(graph, &mut networks);
    (networks, of)
}

fn is_part(element: &LadderElement) -> bool {
    !matches!(
        element.body,
        ElementBody::LeftRail | ElementBody::RightRail | ElementBody::Comment(_)
    ) && !is_decoration(element)
}

/// Whether an element says nothing about what the body does: titles of a vendor.
fn is_decoration(element: &LadderElement) -> bool {
    let ElementBody::Other { name, input } = &element.body else { return false };
    name == "vendorElement" && input.is_empty()
}

/// The first one of what is joined with one.
pub(super) fn root(joined: &mut [usize], mut at: usize) -> usize {
    while joined[at] != at {
        joined[at] = joined[joined[at]];
        at = joined[at];
    }
    at
}

/// Joins two.
pub(super) fn join(joined: &mut [usize], one: usize, other: usize) {
    let (one, other) = (root(joined, one), root(joined, other));
    joined[one.max(other)] = one.min(other);
}

fn has_places(elements: &[LadderElement]) -> bool {
    let first = elements.first().map(|element| [element.x, element.y]);
    elements.iter().any(|element| Some([element.x, element.y]) != first)
}

/// Gives each comment to the network below it.
fn comments(graph: &LadderGraph<'_>, networks: &mut [LadderNetwork]) {
    let is_placed = has_places(graph.elements);
    for (at, element) in graph.elements.iter().enumerate() {
        let ElementBody::Comment(text) = &element.body else { continue };
        let is_below = |network: &&mut LadderNetwork| match is_placed {
            true => network.elements.iter().all(|one| graph.elements[*one].y + 2 * ROW > element.y),
            false => network.elements.iter().all(|one| *one > at),
        };
        let Some(network) = networks.iter_mut().find(is_below) else { continue };
        let fits = network.doc.len() + text.len() <= DOC_MAX;
        if fits && !text.is_empty() {
            if !network.doc.is_empty() {
                network.doc.push('\n');
            }
            network.doc += text;
        }
    }
}

/// The coils, variables and blocks in the order in which they act. In a chart the conditions of
/// its transitions act alone, in the order of the elements, with the blocks that lead to them.
pub(super) fn order(graph: &LadderGraph<'_>, networks: &[LadderNetwork]) -> Vec<usize> {
    let conditions = conditions(graph);
    if !conditions.is_empty() {
        return conditions;
    }
    let acts = |at: &usize| {
        matches!(
            graph.elements[*at].body,
            ElementBody::Coil { .. }
                | ElementBody::OutVariable { .. }
                | ElementBody::InOutVariable { .. }
                | ElementBody::Block(_)
                | ElementBody::Other { .. }
        )
    };
    if !has_places(graph.elements) {
        return networks
            .iter()
            .flat_map(|network| &network.elements)
            .copied()
            .filter(acts)
            .collect();
    }
    let all: Vec<usize> = networks.iter().flat_map(|network| &network.elements).copied().collect();
    let all: Vec<usize> = all.into_iter().filter(acts).collect();
    let of = |at: &usize| &graph.elements[*at];
    let has_order =
        |at: &usize| of(at).order > 0 && !matches!(of(at).body, ElementBody::Coil { .. });
    let is_block = |at: &usize| matches!(of(at).body, ElementBody::Block(_));
    let (mut ordered, rest): (Vec<usize>, Vec<usize>) = all.into_iter().partition(has_order);
    ordered.sort_by_key(|at| of(at).order);
    let (blocks, coils): (Vec<usize>, Vec<usize>) = rest.into_iter().partition(is_block);
    ordered.extend(by_place(graph, coils));
    ordered.extend(by_place(graph, blocks));
    ordered
}

/// The conditions of transitions.
pub(super) fn conditions(graph: &LadderGraph<'_>) -> Vec<usize> {
    let is_one = |at: &usize| matches!(graph.elements[*at].body, ElementBody::Condition(_));
    (0..graph.elements.len()).filter(is_one).collect()
}

/// Elements by rows from the top, each from left to right.
fn by_place(graph: &LadderGraph<'_>, mut elements: Vec<usize>) -> Vec<usize> {
    elements.sort_by_key(|at| (graph.elements[*at].y, *at));
    let mut rows: Vec<Vec<usize>> = Vec::new();
    let mut top = i64::MIN;
    for at in elements {
        let y = graph.elements[at].y;
        match rows.last_mut() {
            Some(row) if y < top + ROW => row.push(at),
            _ => {
                top = y;
                rows.push(vec![at]);
            }
        }
    }
    let sorted = rows.into_iter().flat_map(|mut row| {
        row.sort_by_key(|at| (graph.elements[*at].x, *at));
        row
    });
    sorted.collect()
}

/// What stands for a network in the report.
pub(super) fn description(graph: &LadderGraph<'_>, network: &LadderNetwork) -> String {
    let mut words = Vec::new();
    for at in &network.elements {
        words.push(match &graph.elements[*at].body {
            ElementBody::Contact { variable, modifier, .. } if modifier.is_negated => {
                format!("contact NOT {variable}")
            }
            ElementBody::Contact { variable, .. } => format!("contact {variable}"),
            ElementBody::Coil { variable, .. } => format!("coil {variable}"),
            ElementBody::Block(block) => match &block.instance {
                Some(name) => format!("{} {name}", block.kind),
                None => block.kind.clone(),
            },
            ElementBody::InVariable { expression, .. } => expression.clone(),
            ElementBody::OutVariable { expression, .. }
            | ElementBody::InOutVariable { expression, .. } => format!("variable {expression}"),
            ElementBody::Condition(one) => format!("{} {}", one.part, one.label),
            ElementBody::Other { name, .. } => name.clone(),
            ElementBody::Connector { .. }
            | ElementBody::Continuation { .. }
            | ElementBody::Comment(_)
            | ElementBody::LeftRail
            | ElementBody::RightRail => continue,
        });
    }
    words.join(", ")
}

/// How many parts of each kind a network has.
pub(super) fn parts(graph: &LadderGraph<'_>, network: &LadderNetwork) -> Vec<PartCount> {
    let mut parts: Vec<PartCount> = Vec::new();
    for at in &network.elements {
        let kind = match &graph.elements[*at].body {
            ElementBody::Contact { .. } => "contact",
            ElementBody::Coil { .. } => "coil",
            ElementBody::Block(block) => &block.kind,
            ElementBody::InVariable { .. } => "inVariable",
            ElementBody::OutVariable { .. } => "outVariable",
            ElementBody::InOutVariable { .. } => "inOutVariable",
            ElementBody::Connector { .. } => "connector",
            ElementBody::Continuation { .. } => "continuation",
            ElementBody::Condition(one) => one.part,
            ElementBody::Other { name, .. } => name,
            ElementBody::LeftRail | ElementBody::RightRail | ElementBody::Comment(_) => continue,
        };
        match parts.iter_mut().find(|part| part.kind == kind) {
            Some(part) => part.count += 1,
            None => parts.push(PartCount { kind: kind.to_owned(), count: 1 }),
        }
    }
    parts
}

/// The networks of a ladder that have one fate.
pub(super) fn network_rows(
    title: &str,
    elements: &[LadderElement],
    fate: &Fate,
) -> Vec<RungOutcome> {
    let graph = LadderGraph::of(elements);
    let (networks, _) = networks(&graph);
    let rows = networks.iter().enumerate().map(|(number, network)| RungOutcome {
        place: title.to_owned(),
        number,
        text: description(&graph, network),
        parts: parts(&graph, network),
        fate: fate.clone(),
    });
    rows.collect()
}
