//! A walk through the nodes of an answer: the operand of the question, then the operands that are
//! its reasons, each with the number of steps that are left for reasons of its own.
//!
//! `earlier` looks for the operands that a program before the last reload has to explain; a test
//! replaces those of its observer that the controller explains. The answer of an earlier program
//! within a node is not walked.

use super::answer::{
    Cause, ContactDetail, ContactSeen, Explanation, Followed, Hindrance, LegSeen, Node, Since, Stop,
};

/// Where a node is in an answer.
#[derive(Clone, Copy, Debug)]
pub struct NodeReach {
    /// The number of steps that are left for reasons of reasons.
    pub depth: u32,
    /// The scan at whose end the operand has its value; `None`: the time of the question.
    pub scan: Option<u64>,
}

/// Receives each node; false: the nodes within it are left out.
pub(super) type NodeVisitor<'v> = &'v mut dyn FnMut(&mut Node, NodeReach) -> bool;

impl Explanation {
    /// Replaces the nodes for which `other` has another explanation. `depth`: the depth of the
    /// answer.
    pub fn replace_nodes(
        &mut self,
        depth: u32,
        other: &mut dyn FnMut(&Node, NodeReach) -> Option<Node>,
    ) {
        let reach = NodeReach { depth, scan: None };
        visit(&mut self.root, reach, &mut |node, reach| match other(node, reach) {
            Some(replacement) => {
                *node = replacement;
                false
            }
            None => true,
        });
    }
}

/// Visits a node, and the nodes within it.
pub(super) fn visit(node: &mut Node, reach: NodeReach, see: NodeVisitor<'_>) {
    if !see(node, reach) {
        return;
    }
    let now = NodeReach { depth: reach.depth.saturating_sub(1), ..reach };
    let scan = match node.write.since {
        Since::At(when) => when.scan.or(reach.scan),
        Since::Before(_) => reach.scan,
    };
    let reach = NodeReach { scan, ..now };
    match &mut node.write.cause {
        Cause::Instruction { legs, operands, .. } => {
            legs.iter_mut().for_each(|leg| of_leg(leg, reach, see));
            operands.iter_mut().for_each(|operand| of_followed(&mut operand.followed, reach, see));
        }
        Cause::Pass { stop: Stop::Bit(bit), .. } => visit(bit, reach, see),
        Cause::Turn { running: Some(running), .. } => visit(running, reach, see),
        Cause::Pass { stop: Stop::Again(_, Some(restart)), .. }
        | Cause::Turn { restart: Some(restart), .. } => {
            restart.legs.iter_mut().for_each(|leg| of_leg(leg, reach, see));
        }
        Cause::Pass { stop: Stop::Controller | Stop::Again(_, None), .. }
        | Cause::Turn { running: None, restart: None, .. }
        | Cause::Force { .. }
        | Cause::Outside { .. }
        | Cause::Status
        | Cause::Controller
        | Cause::Resumed
        | Cause::Initial
        | Cause::Restored
        | Cause::Older(_) => {}
    }
    for idle in &mut node.idle {
        match &mut idle.because {
            Hindrance::Stopped(_, next) => of_followed(next, now, see),
            Hindrance::Legs(legs) => legs.iter_mut().for_each(|leg| of_leg(leg, now, see)),
        }
    }
}

fn of_leg(leg: &mut LegSeen, reach: NodeReach, see: NodeVisitor<'_>) {
    leg.contacts.iter_mut().for_each(|contact| of_contact(contact, reach, see));
    leg.also_off.iter_mut().for_each(|contact| of_contact(contact, reach, see));
}

fn of_contact(contact: &mut ContactSeen, reach: NodeReach, see: NodeVisitor<'_>) {
    match &mut contact.detail {
        ContactDetail::Bit(_, next) => of_followed(next, reach, see),
        ContactDetail::Element { bit, index } => {
            bit.iter_mut().for_each(|(_, next)| of_followed(next, reach, see));
            of_followed(&mut index.followed, reach, see);
        }
        ContactDetail::Compare { sides, real: _ } => {
            sides.iter_mut().for_each(|side| of_followed(&mut side.followed, reach, see));
        }
        ContactDetail::Computed { operands, .. } => {
            operands.iter_mut().for_each(|read| of_followed(&mut read.followed, reach, see));
        }
        ContactDetail::Edge { inner, .. } => {
            inner.iter_mut().for_each(|contact| of_contact(contact, reach, see));
        }
    }
}

fn of_followed(followed: &mut Followed, reach: NodeReach, see: NodeVisitor<'_>) {
    match followed {
        Followed::Node(node) => visit(node, reach, see),
        Followed::Cut(_) => {}
    }
}
