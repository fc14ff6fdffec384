//! The operand of the question, if its last write did not change the value: when and why it changed
//! last. An output that dropped a while ago is written OFF in every scan, but the user wants to
//! know why it dropped.

use super::answer::{
    Cause, ContactDetail, ContactSeen, Followed, LastChange, LegSeen, ModeSince, Node, Remedy,
    Since, Write,
};
use super::inquiry::{ChangePlace, ExplainedWrite, FoundWrite, FoundWriter, Inquiry};
use super::past::TapeMoment;
use super::replay::{Changed, SEARCHED_MAX};
use rungd_engine::Cell;
use rungd_runtime::exchange::Mode;

/// The search for the last change covers this many times more sections than the search for a lesser
/// fact.
const FARTHER: usize = 30;

impl Inquiry<'_> {
    /// The last change of the operand of the question, and the operand itself. If the change has
    /// reasons, the operand is explained again without the reasons that the change already gives.
    pub fn unchanged(&mut self, root: Node, at: TapeMoment) -> (Node, Option<LastChange>) {
        let is_step = matches!(root.write.cause, Cause::Instruction { .. } | Cause::Pass { .. });
        if !is_step || !root.write.in_last_scan || root.write.before.is_some() {
            return (root, None);
        }
        let Some(found) = self.last_change(&root, at) else { return (root, None) };
        let (cell, value, depth) = (root.operand.cell, root.value, self.limits.depth);
        let is_word = matches!(cell, Cell::Word(_));
        // The reasons of the last change get half of the operands.
        let (nodes, cut) = (self.nodes, (self.cuts, self.deeper, self.is_long));
        let half = self.limits.nodes.div_ceil(2);
        let shown = std::mem::take(&mut self.shown);
        self.nodes = half;
        self.shown.push(ExplainedWrite { cell, at: found.at, depth: u32::MAX });
        let depth_then = if is_word { 0 } else { depth };
        let Write { since, before, cause, .. } = self.write(cell, value, found, depth_then);
        let is_root = matches!(cause, Cause::Initial | Cause::Restored | Cause::Older(_));
        let told = match is_root {
            true => Some(cause),
            false if is_word || same_cause(&cause, &root.write.cause) => None,
            false => Some(cause),
        };
        if is_root || told.is_none() {
            (self.nodes, self.shown) = (nodes, shown);
            (self.cuts, self.deeper, self.is_long) = cut;
            return (root, Some(LastChange { since, before, cause: told }));
        }
        self.nodes = (self.nodes - half).max(1);
        let again = self.node(cell, value, at, depth).unwrap_or(root);
        (again, Some(LastChange { since, before, cause: told }))
    }

    /// The last change, if it is older than the last scan.
    fn last_change(&mut self, root: &Node, at: TapeMoment) -> Option<FoundWrite> {
        let (section, entry) = self.replay.last_begin(at)?;
        let begin = TapeMoment { section, entry, step: 0 };
        let most = SEARCHED_MAX * FARTHER;
        let cell = root.operand.cell;
        match self.replay.last_change(cell, at, most) {
            Changed::At(change, when) if when < begin && change.after == root.value => {
                Some(self.changed(cell, change, ChangePlace { at: when, in_last_scan: false }))
            }
            Changed::At(..) => None,
            Changed::Never(end, section) => Some(FoundWrite {
                at: TapeMoment { section, entry: 0, step: 0 },
                before: None,
                in_last_scan: false,
                writer: FoundWriter::End(end, section),
            }),
        }
    }

    /// The number of sets of two or three edits that were tried.
    pub fn combined(&self, change: Option<&Remedy>) -> u32 {
        match (change, self.singles_end) {
            (Some(Remedy::None(end)), Some(singles)) => end.tried.saturating_sub(singles + 1),
            (_, _) => 0,
        }
    }

    /// The mode at a moment, and since when; `None` if the mode is RUN or is not on the tape.
    pub fn mode(&mut self, at: TapeMoment) -> Option<ModeSince> {
        let (mut section, mut end) = (at.section, at.entries());
        let mut known = None;
        loop {
            let section_tape = self.replay.section(section)?;
            let entries = section_tape.entries.iter().enumerate().take(end);
            let found =
                entries.rev().find_map(|(entry, tape_entry)| Some((entry, tape_entry.mode()?)));
            if let Some((entry, mode)) = found {
                let since = Since::At(self.replay.when_of(section, entry));
                return (mode != Mode::Run).then_some(ModeSince { mode, since });
            }
            let mode = *known.get_or_insert(section_tape.start.mode);
            match self.replay.older(section) {
                Ok(older) => section = older,
                Err(_) => {
                    let since = Since::Before(self.replay.start_of(section));
                    return (mode != Mode::Run).then_some(ModeSince { mode, since });
                }
            }
            end = usize::MAX;
        }
    }
}

/// Whether the same instruction made two writes, for the same reasons.
fn same_cause(then: &Cause, now: &Cause) -> bool {
    match (then, now) {
        (
            Cause::Instruction { place, legs, .. },
            Cause::Instruction { place: place_now, legs: legs_now, .. },
        ) => place == place_now && same_legs(legs, legs_now),
        (then, now) => then == now,
    }
}

fn same_legs(then: &[LegSeen], now: &[LegSeen]) -> bool {
    let same = |(then, now): (&LegSeen, &LegSeen)| {
        (then.name, then.on) == (now.name, now.on) && same_contacts(&then.contacts, &now.contacts)
    };
    then.len() == now.len() && then.iter().zip(now).all(same)
}

fn same_contacts(then: &[ContactSeen], now: &[ContactSeen]) -> bool {
    then.len() == now.len() && then.iter().zip(now).all(|(then, now)| same_contact(then, now))
}

/// Whether two contacts are the same; for a bit, with the same reasons.
fn same_contact(then: &ContactSeen, now: &ContactSeen) -> bool {
    if (&then.place, then.on) != (&now.place, now.on) {
        return false;
    }
    match (&then.detail, &now.detail) {
        (ContactDetail::Bit(_, then), ContactDetail::Bit(_, now)) => same_reasons(then, now),
        (
            ContactDetail::Element { bit: Some((bit, then)), .. },
            ContactDetail::Element { bit: Some((bit_now, now)), .. },
        ) => bit.cell == bit_now.cell && same_reasons(then, now),
        (
            ContactDetail::Edge { inner_on, inner, .. },
            ContactDetail::Edge { inner_on: inner_on_now, inner: inner_now, .. },
        ) => inner_on == inner_on_now && same_contacts(inner, inner_now),
        (ContactDetail::Compare { .. }, ContactDetail::Compare { .. })
        | (ContactDetail::Computed { .. }, ContactDetail::Computed { .. }) => true,
        (_, _) => false,
    }
}

fn same_reasons(then: &Followed, now: &Followed) -> bool {
    match (then, now) {
        (Followed::Node(then), Followed::Node(now)) => {
            let is_rewritten = now.write.before.is_none() && now.write.in_last_scan;
            let is_same_time = then.write.since == now.write.since;
            (is_rewritten || is_same_time) && same_cause(&then.write.cause, &now.write.cause)
        }
        (Followed::Cut(then), Followed::Cut(now)) => then == now,
        (Followed::Node(_), Followed::Cut(_)) | (Followed::Cut(_), Followed::Node(_)) => false,
    }
}
