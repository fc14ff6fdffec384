//! Reachability in a graph. Called by the rules about stages that are never entered and blocks that
//! are never started.

use std::collections::{BTreeMap, BTreeSet};

/// All nodes reachable from the roots, the roots included. An edge `(None, b)` makes `b` a root.
pub fn reached<T: Ord + Copy>(
    roots: impl IntoIterator<Item = T>,
    edges: &[(Option<T>, T)],
) -> BTreeSet<T> {
    let mut leads: BTreeMap<Option<T>, Vec<T>> = BTreeMap::new();
    for (from, to) in edges {
        leads.entry(*from).or_default().push(*to);
    }
    let outside = leads.get(&None).into_iter().flatten().copied();
    let mut open: Vec<T> = roots.into_iter().chain(outside).collect();
    let mut reached = BTreeSet::new();
    while let Some(next) = open.pop() {
        if reached.insert(next) {
            open.extend(leads.get(&Some(next)).into_iter().flatten());
        }
    }
    reached
}

/// For each node, the nodes with an edge to it; these may include the node itself.
pub fn sources<T: Ord + Copy>(edges: &[(Option<T>, T)]) -> BTreeMap<T, BTreeSet<T>> {
    let mut sources: BTreeMap<T, BTreeSet<T>> = BTreeMap::new();
    for (from, to) in edges {
        sources.entry(*to).or_default().extend(from);
    }
    sources
}
