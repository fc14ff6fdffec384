//! Contacts that repeat another contact of the same series or group. They have no effect, so a
//! mutation of one of them may change nothing.
//!
//! Called by `mutants`, for the rungs that a mutant changes. Contacts with a memory or an index
//! (edges, elements, expressions) are left as they are.

use rungd_language::resolve::program::{Contact, Rung};

use super::mutation::without_lone_groups;

/// Leaves out each contact that repeats one before it; returns whether there was any.
pub(super) fn leave_out_repeats(rung: &mut Rung) -> bool {
    let mut was_any = false;
    let legs = rung.legs.iter_mut().map(|leg| &mut leg.contacts);
    let branches = rung.branches.iter_mut().map(|branch| &mut branch.contacts);
    for series in legs.chain(branches) {
        was_any |= series_without_repeats(series, GroupKind::All);
        without_lone_groups(series);
    }
    was_any
}

/// How the contacts of a series or group are connected.
#[derive(Clone, Copy, PartialEq, Eq)]
enum GroupKind {
    /// By `&`; also the contacts of a leg or branch.
    All,
    /// By `|`.
    Any,
}

/// A group within a group of its kind becomes a part of it; the members are sorted.
fn series_without_repeats(series: &mut Vec<Contact>, kind: GroupKind) -> bool {
    let mut was_any = false;
    let mut members: Vec<Contact> = Vec::with_capacity(series.len());
    for mut contact in series.drain(..) {
        was_any |= match &mut contact {
            Contact::All(members, _) => series_without_repeats(members, GroupKind::All),
            Contact::Any(members, _) => series_without_repeats(members, GroupKind::Any),
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Not(..)
            | Contact::Edge(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => false,
        };
        without_lone_groups(std::slice::from_mut(&mut contact));
        match contact {
            Contact::All(inner, _) if kind == GroupKind::All => members.extend(inner),
            Contact::Any(inner, _) if kind == GroupKind::Any => members.extend(inner),
            contact @ (Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Not(..)
            | Contact::All(..)
            | Contact::Any(..)
            | Contact::Edge(..)
            | Contact::Compare(..)
            | Contact::Computed(..)) => members.push(contact),
        }
    }
    members.sort_by_cached_key(key);
    for contact in members {
        let is_repeat = key(&contact).is_some() && series.last().map(key) == Some(key(&contact));
        was_any |= is_repeat;
        if !is_repeat {
            series.push(contact);
        }
    }
    was_any
}

/// A text that contacts share if they are ON in the same scans, as their parts show; `None`: this
/// cannot be told.
fn key(contact: &Contact) -> Option<String> {
    let keys = |members: &[Contact]| members.iter().map(key).collect::<Option<Vec<_>>>();
    match contact {
        Contact::Bit(bit, _) => Some(format!("{bit:?}")),
        Contact::Not(inner, _) => key(inner).map(|inner| format!("!{inner}")),
        Contact::Compare(a, how, b, _) => Some(format!("{a:?} {how:?} {b:?}")),
        Contact::All(members, _) => keys(members).map(|members| format!("all {members:?}")),
        Contact::Any(members, _) => keys(members).map(|members| format!("any {members:?}")),
        Contact::Element(..) | Contact::Edge(..) | Contact::Computed(..) => None,
    }
}
