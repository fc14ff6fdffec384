//! The operands of an answer that nothing has changed since the program was exchanged: the program
//! that ran before has to explain them.
//!
//! Called by `why` when an answer is complete.

use super::answer::{
    Cause, ContactDetail, ContactSeen, Explanation, Followed, Hindrance, LastChange, LegSeen, Node,
    Stop, TapeEnd,
};

/// The maximum number of operands of an answer that are explained by an earlier program.
const OPERANDS_MAX: usize = 8;

/// An operand whose explanation ends at the exchange of the program.
pub(super) struct EndedOperand<'n> {
    /// Its name in both programs: an address if it has one, because a reload keeps memory by
    /// address.
    pub name: String,
    /// The number of steps that are left for its reasons.
    pub depth: u32,
    /// The place for the explanation by the earlier program.
    pub earlier: &'n mut Option<Box<Explanation>>,
}

/// The operands of an answer whose explanation ends at the exchange of the program; that of the
/// question is the first one. `depth`: the depth of the answer.
pub(super) fn ended_there(answer: &mut Explanation, depth: u32) -> Vec<EndedOperand<'_>> {
    let mut ended = Vec::new();
    let is_root = answer.changed.as_ref().is_some_and(is_swapped);
    collect(&mut answer.root, depth, is_root, &mut ended);
    ended.truncate(OPERANDS_MAX);
    ended
}

fn is_swapped(changed: &LastChange) -> bool {
    changed.cause == Some(Cause::Older(TapeEnd::Swapped))
}

/// Collects the operands of a node that end there; `is_ended`: whether the node itself does, beside
/// the cause of its write.
fn collect<'n>(node: &'n mut Node, depth: u32, is_ended: bool, into: &mut Vec<EndedOperand<'n>>) {
    if is_ended || node.write.cause == Cause::Older(TapeEnd::Swapped) {
        let operand = &node.operand;
        let name = operand.address.clone().unwrap_or_else(|| operand.name.clone());
        into.push(EndedOperand { name, depth, earlier: &mut node.earlier });
    }
    let depth = depth.saturating_sub(1);
    match &mut node.write.cause {
        Cause::Instruction { legs, operands, .. } => {
            legs.iter_mut().for_each(|leg| of_leg(leg, depth, into));
            operands.iter_mut().for_each(|operand| of_followed(&mut operand.followed, depth, into));
        }
        Cause::Pass { stop: Stop::Bit(bit), .. } => collect(bit, depth, false, into),
        Cause::Turn { running: Some(running), .. } => collect(running, depth, false, into),
        Cause::Pass { stop: Stop::Again(_, Some(restart)), .. }
        | Cause::Turn { restart: Some(restart), .. } => {
            restart.legs.iter_mut().for_each(|leg| of_leg(leg, depth, into));
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
            Hindrance::Stopped(_, next) => of_followed(next, depth, into),
            Hindrance::Legs(legs) => legs.iter_mut().for_each(|leg| of_leg(leg, depth, into)),
        }
    }
}

fn of_leg<'n>(leg: &'n mut LegSeen, depth: u32, into: &mut Vec<EndedOperand<'n>>) {
    leg.contacts.iter_mut().for_each(|contact| of_contact(contact, depth, into));
    leg.also_off.iter_mut().for_each(|contact| of_contact(contact, depth, into));
}

fn of_contact<'n>(contact: &'n mut ContactSeen, depth: u32, into: &mut Vec<EndedOperand<'n>>) {
    match &mut contact.detail {
        ContactDetail::Bit(_, next) => of_followed(next, depth, into),
        ContactDetail::Element { bit, index } => {
            bit.iter_mut().for_each(|(_, next)| of_followed(next, depth, into));
            of_followed(&mut index.followed, depth, into);
        }
        ContactDetail::Compare { sides, real: _ } => {
            sides.iter_mut().for_each(|side| of_followed(&mut side.followed, depth, into));
        }
        ContactDetail::Computed { operands, sides: _ } => {
            operands.iter_mut().for_each(|read| of_followed(&mut read.followed, depth, into));
        }
        ContactDetail::Edge { inner, .. } => {
            inner.iter_mut().for_each(|contact| of_contact(contact, depth, into));
        }
    }
}

fn of_followed<'n>(followed: &'n mut Followed, depth: u32, into: &mut Vec<EndedOperand<'n>>) {
    match followed {
        Followed::Node(node) => collect(node, depth, false, into),
        Followed::Cut(_) => {}
    }
}
