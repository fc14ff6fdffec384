//! Latches that always have the same value, or opposite values, as one.
//!
//! Called by `race`. They begin alike, and in each scan their next values are one gate if they were
//! alike before: then they stay alike. A ladder has many (the power of a contact and its edge's
//! history, the halves of two ladders that are compared), and each is one question less for a
//! solver. (C. van Eijk: Sequential Equivalence Checking Based on Structural Similarities, 2000.)

use rustc_hash::FxHashMap;

use crate::aig::Literal;
use crate::gates::Gates;
use rungd_base::random::SplitMix64;

/// The number of scans after which latches with the same values are taken for alike, at first.
const SCANS: usize = 24;
/// The maximum number of refinements.
const REFINEMENTS_MAX: usize = 100;

/// The same gates with one latch for all that are always alike.
pub(crate) fn merged(gates: &Gates) -> Gates {
    let mut groups = AlikeLatches::simulated(gates);
    for _ in 0..REFINEMENTS_MAX {
        let assumed = gates.replaced(&groups.instead(gates));
        if !groups.refine(&assumed.next) {
            return assumed.gates;
        }
    }
    gates.clone()
}

/// The latches by group: those of a group are alike so far.
struct AlikeLatches {
    /// By latch; the first latch of a group stands for it.
    group: Vec<usize>,
    /// By latch: whether it begins ON. A latch and another one are alike if both differ from their
    /// beginnings at the same times.
    begins_on: Vec<bool>,
}

impl AlikeLatches {
    /// The groups after some scans with random inputs.
    fn simulated(gates: &Gates) -> AlikeLatches {
        let begins_on: Vec<bool> =
            gates.latches.iter().map(|latch| latch.initial == Some(true)).collect();
        let mut random = SplitMix64(1);
        let mut values: Vec<u64> = begins_on.iter().map(|on| if *on { !0 } else { 0 }).collect();
        let mut seen: Vec<Vec<u64>> = vec![Vec::with_capacity(SCANS); values.len()];
        for (at, latch) in gates.latches.iter().enumerate() {
            // What begins with any value is alike to nothing.
            if latch.initial.is_none() {
                seen[at].push(at as u64);
            }
        }
        for _ in 0..SCANS {
            let inputs: Vec<u64> = gates.inputs.iter().map(|_| random.next()).collect();
            let nodes = gates.evaluated(&values, &inputs);
            values = gates.latches.iter().map(|latch| nodes.of_literal(latch.next)).collect();
            for ((seen, value), on) in seen.iter_mut().zip(&values).zip(&begins_on) {
                seen.push(if *on { !value } else { *value });
            }
        }
        let mut groups = AlikeLatches { group: vec![0; values.len()], begins_on };
        groups.split(&seen);
        groups
    }

    /// Puts latches into one group if they were in one before, and have the same key. Returns true
    /// if a group was split.
    fn split<K: Clone + Eq + std::hash::Hash>(&mut self, keys: &[K]) -> bool {
        let mut firsts: FxHashMap<(usize, K), usize> = FxHashMap::default();
        let before = std::mem::take(&mut self.group);
        for (at, group) in before.iter().enumerate() {
            let first = *firsts.entry((*group, keys[at].clone())).or_insert(at);
            self.group.push(first);
        }
        before != self.group
    }

    /// By node: the literal that stands for it.
    fn instead(&self, gates: &Gates) -> Vec<Option<Literal>> {
        let mut instead = vec![None; gates.graph.nodes().len()];
        for (at, first) in self.group.iter().enumerate() {
            if at != *first {
                let differ = self.begins_on[at] != self.begins_on[*first];
                let literal = gates.latches[*first].literal.inverted_if(differ);
                instead[gates.latches[at].literal.node() as usize] = Some(literal);
            }
        }
        instead
    }

    /// Splits the groups whose next values are not one literal. `next`: by latch.
    fn refine(&mut self, next: &[Literal]) -> bool {
        let changes = next.iter().zip(&self.begins_on).map(|(next, on)| next.inverted_if(*on));
        let keys: Vec<Literal> = changes.collect();
        self.split(&keys)
    }
}
