//! The operands of an answer that nothing has changed since the program was exchanged: the program
//! that ran before has to explain them.
//!
//! Called by `why` when an answer is complete.

use super::answer::{Cause, Explanation, LastChange, Node, TapeEnd};
use super::node_walk::{NodeReach, visit};

/// The maximum number of operands of an answer that are explained by an earlier program.
const OPERANDS_MAX: usize = 8;

/// An operand whose explanation ends at the exchange of the program.
pub(super) struct EndedOperand {
    /// Its name in both programs: an address if it has one, because a reload keeps memory by
    /// address.
    pub name: String,
    /// The number of steps that are left for its reasons.
    pub depth: u32,
}

/// The operands of an answer whose explanation ends at the exchange of the program; that of the
/// question is the first one. `depth`: the depth of the answer.
pub(super) fn ended_there(answer: &mut Explanation, depth: u32) -> Vec<EndedOperand> {
    let mut ended = Vec::new();
    each_ended(answer, depth, &mut |node, depth| {
        let operand = &node.operand;
        let name = operand.address.clone().unwrap_or_else(|| operand.name.clone());
        ended.push(EndedOperand { name, depth });
    });
    ended
}

/// Gives these operands the explanations by the earlier program, in the order of `ended_there`.
pub(super) fn explain_ended(
    answer: &mut Explanation,
    depth: u32,
    explanations: Vec<Option<Box<Explanation>>>,
) {
    let mut explanations = explanations.into_iter();
    each_ended(answer, depth, &mut |node, _| {
        if let Some(earlier) = explanations.next() {
            node.earlier = earlier;
        }
    });
}

fn each_ended(answer: &mut Explanation, depth: u32, found: &mut dyn FnMut(&mut Node, u32)) {
    let mut is_ended = answer.changed.as_ref().is_some_and(is_swapped);
    let mut count = 0;
    let reach = NodeReach { depth, scan: None };
    visit(&mut answer.root, reach, &mut |node, NodeReach { depth, .. }| {
        // Only the node of the question may end beside the cause of its write.
        let ends = std::mem::take(&mut is_ended) || node.write.cause == swapped();
        if ends && count < OPERANDS_MAX {
            count += 1;
            found(node, depth);
        }
        true
    });
}

fn is_swapped(changed: &LastChange) -> bool {
    changed.cause == Some(swapped())
}

fn swapped() -> Cause {
    Cause::Older(TapeEnd::Swapped)
}
