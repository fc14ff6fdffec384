//! The passes over a body, until one finds nothing more that the next one must do.
//!
//! Called by `project`. A value of a function stands directly where it is used, as long as nothing
//! changes between; if a pass finds that something does, the next one keeps the value in a tag. A
//! network that cannot be translated gets a stub in the next pass, and with it what reads its
//! blocks.

use std::collections::{BTreeSet, HashMap, HashSet};

use super::body::{BodyMemo, BodyPlace, LadderBody, PassNeeds, TranslatedBody, UnitBlocks};
use super::elements::LadderElement;
use super::finish::{DoneBody, Networks, finished};
use super::graph::LadderGraph;
use super::memory::PlcopenMemory;
use super::networks::{networks, order};

/// Most passes over a body.
const PASSES_MAX: usize = 12;

/// Translates a body.
pub(super) fn translated(
    memory: &mut PlcopenMemory,
    units: &UnitBlocks,
    elements: &[LadderElement],
    place: BodyPlace<'_>,
) -> TranslatedBody {
    let graph = LadderGraph::of(elements);
    let (networks, network_of) = networks(&graph);
    let order = order(&graph, &networks);
    let mut needs = PassNeeds::default();
    let mut own = BodyMemo::default();
    for pass in 0.. {
        needs.keeps_all = pass > PASSES_MAX / 2;
        let work = BodyWork { units, graph: &graph, needs: &needs, network_of: &network_of, place };
        let body = body(memory, work, &mut own);
        let done = body.pass(&order, &network_of, networks.len());
        let known = needs.size();
        needs.kept.extend(done.found.kept.iter().copied());
        needs.kept_edges.extend(done.found.kept_edges.iter().copied());
        for (network, why) in &done.found.failed {
            needs.failed.entry(*network).or_insert_with(|| why.clone());
        }
        if needs.size() == known {
            let all = Networks { graph: &graph, networks: &networks };
            return finished(memory, done, DoneBody { needs: &needs, all, place });
        }
        if pass >= PASSES_MAX {
            let why = "a body whose parts depend on each other too much";
            (0..networks.len()).for_each(|at| {
                needs.failed.entry(at).or_insert_with(|| why.to_owned());
            });
        }
    }
    TranslatedBody::default()
}

/// Asks something of a body that has no elements; with the differences that the answer has.
pub(super) fn asked<T>(
    memory: &mut PlcopenMemory,
    units: &UnitBlocks,
    place: BodyPlace<'_>,
    question: impl FnOnce(&mut LadderBody<'_, '_>) -> T,
) -> (T, BTreeSet<String>) {
    let graph = LadderGraph::of(&[]);
    let (needs, mut own) = (PassNeeds::default(), BodyMemo::default());
    let work = BodyWork { units, graph: &graph, needs: &needs, network_of: &[], place };
    let mut body = body(memory, work, &mut own);
    let answer = question(&mut body);
    (answer, body.differences)
}

/// What a pass works on.
#[derive(Clone, Copy)]
struct BodyWork<'m, 'g> {
    units: &'m UnitBlocks,
    graph: &'g LadderGraph<'g>,
    needs: &'g PassNeeds,
    /// The network of each element.
    network_of: &'g [Option<usize>],
    place: BodyPlace<'g>,
}

impl BodyWork<'_, '_> {
    /// The instances whose calls have a stub.
    fn dead(&self, memory: &PlcopenMemory) -> HashSet<usize> {
        let failed = |at: &usize| {
            self.network_of[*at].is_some_and(|network| self.needs.failed.contains_key(&network))
        };
        let all = (0..self.graph.elements.len()).filter(failed);
        let blocks = all.filter_map(|at| self.graph.elements[at].body.block());
        let names = blocks.filter_map(|block| block.instance.as_deref());
        names.filter_map(|name| memory.variable(self.place.scope, name)).collect()
    }
}

fn body<'m, 'g>(
    memory: &'m mut PlcopenMemory,
    work: BodyWork<'m, 'g>,
    own: &'g mut BodyMemo,
) -> LadderBody<'m, 'g> {
    let BodyWork { units, graph, needs, network_of: _, place } = work;
    let driven = memory.driven.clone();
    let dead = work.dead(memory);
    LadderBody {
        memory,
        scope: place.scope,
        graph,
        units,
        needs,
        found: PassNeeds::default(),
        steps: Vec::new(),
        turn: 0,
        statement: 0,
        values: HashMap::new(),
        called: HashSet::new(),
        powers: HashMap::new(),
        uses: HashMap::new(),
        edges: HashMap::new(),
        driven: if place.is_template { HashSet::new() } else { driven },
        dead,
        differences: BTreeSet::new(),
        tags: Vec::new(),
        lines: 0,
        blocks: Vec::new(),
        is_template: place.is_template,
        own,
        prefix: place.prefix,
        depth: 0,
        is_judging: false,
        reads_steps: false,
        conditions: HashMap::new(),
    }
}
