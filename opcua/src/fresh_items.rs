//! Monitored items that were just created. The library reads the first value of an item, and
//! enters the item in its subscription later: a change between the two would never be told. So
//! the node is told again, with its present value, a few times behind the creation; a value that
//! an item has been told already is not queued again.
//!
//! `manager` notes the items, `publish` tells their nodes.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use opcua::types::NodeId;

/// When a node is told again. The library enters an item within milliseconds, and within seconds on
/// a machine that has no time for it.
const TOLD_AFTER: [Duration; 3] =
    [Duration::from_millis(300), Duration::from_secs(2), Duration::from_secs(10)];
/// The most items that are kept. For further ones all nodes are told again.
const ITEMS_MAX: usize = 100_000;

/// The items of the last seconds.
#[derive(Debug, Default)]
pub struct FreshItems(Mutex<Vec<NotedItem>>);

#[derive(Debug)]
struct NotedItem {
    /// `None`: of any node.
    node: Option<NodeId>,
    at: Instant,
    /// How often its node was told again.
    told: usize,
}

/// The nodes to be told again.
#[derive(Debug, PartialEq, Eq)]
pub enum FreshNodes {
    /// These, each once.
    Some(Vec<NodeId>),
    /// All.
    All,
}

impl FreshItems {
    /// Items of these nodes are being created.
    pub fn note(&self, nodes: impl IntoIterator<Item = NodeId>, now: Instant) {
        let mut noted = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        for node in nodes {
            let node = (noted.len() < ITEMS_MAX).then_some(node);
            match (node, noted.last_mut()) {
                (None, Some(last)) if last.node.is_none() => (last.at, last.told) = (now, 0),
                (node, _) => noted.push(NotedItem { node, at: now, told: 0 }),
            }
        }
    }

    /// The nodes that are due to be told again.
    pub fn due(&self, now: Instant) -> FreshNodes {
        let mut noted = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (mut nodes, mut all) = (Vec::new(), false);
        for item in noted.iter_mut() {
            let age = now.duration_since(item.at);
            let reached = TOLD_AFTER.iter().filter(|after| **after <= age).count();
            if reached > item.told {
                item.told = reached;
                all |= item.node.is_none();
                nodes.extend(item.node.clone());
            }
        }
        noted.retain(|item| item.told < TOLD_AFTER.len());
        if all {
            return FreshNodes::All;
        }
        nodes.sort_unstable_by_key(ToString::to_string);
        nodes.dedup();
        FreshNodes::Some(nodes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(name: &str) -> NodeId {
        NodeId::new(2, name)
    }

    fn some(names: &[&str]) -> FreshNodes {
        FreshNodes::Some(names.iter().map(|name| node(name)).collect())
    }

    #[test]
    fn the_nodes_of_new_items_are_told_again_a_few_times() {
        let (items, begin) = (FreshItems::default(), Instant::now());
        assert_eq!(items.due(begin), some(&[]));
        items.note([node("b"), node("a"), node("b")], begin);
        assert_eq!(items.due(begin), some(&[]));
        for after in TOLD_AFTER {
            assert_eq!(items.due(begin + after), some(&["a", "b"]));
            assert_eq!(items.due(begin + after), some(&[]), "once each time");
        }
        assert!(items.0.lock().unwrap().is_empty());
    }

    #[test]
    fn a_late_look_tells_an_item_once() {
        let (items, begin) = (FreshItems::default(), Instant::now());
        items.note([node("a")], begin);
        assert_eq!(items.due(begin + 2 * TOLD_AFTER[2]), some(&["a"]));
        assert_eq!(items.due(begin + 3 * TOLD_AFTER[2]), some(&[]));
    }

    #[test]
    fn more_items_than_are_kept_let_all_nodes_be_told() {
        let (items, begin) = (FreshItems::default(), Instant::now());
        items.note((0..ITEMS_MAX + 5).map(|_| node("a")), begin);
        assert_eq!(items.0.lock().unwrap().len(), ITEMS_MAX + 1);
        assert_eq!(items.due(begin + TOLD_AFTER[0]), FreshNodes::All);
        assert_eq!(items.due(begin + TOLD_AFTER[2]), FreshNodes::All);
        assert_eq!(items.due(begin + 2 * TOLD_AFTER[2]), some(&[]));
    }
}
