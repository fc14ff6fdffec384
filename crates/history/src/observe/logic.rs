//! Contacts as one boolean expression, and the smallest reason for its value.
//!
//! Leaves are bits, elements, compares and edges, numbered from left to right, as `lower::sites`
//! lists their powers. The leaves within an edge come before the edge, and belong to an expression
//! of their own. Rules: `docs/why.md`.

use std::collections::HashSet;

use rungd_language::resolve::program::Contact;

/// The maximum number of contacts of a leg among which repeated contacts are searched.
const LEAVES_MAX: usize = 500;

/// A boolean expression over leaves.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Logic {
    Leaf(usize),
    Not(Box<Logic>),
    All(Vec<Logic>),
    Any(Vec<Logic>),
}

/// The leaves of contacts.
#[derive(Debug, Default)]
pub(super) struct Leaves<'p> {
    /// The contact of each leaf.
    pub contacts: Vec<&'p Contact>,
    /// For each leaf that is an edge, the expression within it.
    pub inner: Vec<Option<Logic>>,
}

impl<'p> Leaves<'p> {
    /// Adds a contact.
    pub fn add(&mut self, contact: &'p Contact) -> Logic {
        match contact {
            Contact::Not(inner, _) => Logic::Not(Box::new(self.add(inner))),
            Contact::All(all, _) => Logic::All(all.iter().map(|one| self.add(one)).collect()),
            Contact::Any(any, _) => Logic::Any(any.iter().map(|one| self.add(one)).collect()),
            Contact::Edge(_, of, _) => {
                let inner = self.add(of);
                self.leaf(contact, Some(inner))
            }
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => self.leaf(contact, None),
        }
    }

    fn leaf(&mut self, contact: &'p Contact, inner: Option<Logic>) -> Logic {
        self.contacts.push(contact);
        self.inner.push(inner);
        Logic::Leaf(self.contacts.len() - 1)
    }
}

/// The reason of a power: the leaves that alone decide it, and other leaves of a series that were
/// OFF.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct PowerReason {
    pub named: Vec<usize>,
    pub also_off: Vec<usize>,
}

impl Logic {
    /// Its value.
    pub fn is_on(&self, on: &dyn Fn(usize) -> bool) -> bool {
        match self {
            Logic::Leaf(at) => on(*at),
            Logic::Not(inner) => !inner.is_on(on),
            Logic::All(all) => all.iter().all(|one| one.is_on(on)),
            Logic::Any(any) => any.iter().any(|one| one.is_on(on)),
        }
    }

    /// Its value if some leaves are unknown; `None` if it depends on them.
    fn known(&self, on: &dyn Fn(usize) -> Option<bool>) -> Option<bool> {
        let series = |all: &[Logic], decides: bool| {
            let mut known = Some(!decides);
            for one in all {
                match one.known(on) {
                    Some(value) if value == decides => return Some(decides),
                    Some(_) => {}
                    None => known = None,
                }
            }
            known
        };
        match self {
            Logic::Leaf(at) => on(*at),
            Logic::Not(inner) => inner.known(on).map(|value| !value),
            Logic::All(all) => series(all, false),
            Logic::Any(any) => series(any, true),
        }
    }

    fn reason(&self, on: &dyn Fn(usize) -> bool, into: &mut PowerReason) {
        match self {
            Logic::Leaf(at) => into.named.push(*at),
            Logic::Not(inner) => inner.reason(on, into),
            Logic::All(all) if self.is_on(on) => all.iter().for_each(|one| one.reason(on, into)),
            Logic::All(all) => {
                let mut off = all.iter().filter(|one| !one.is_on(on));
                if let Some(first) = off.next() {
                    first.reason(on, into);
                }
                for other in off {
                    let mut also = PowerReason::default();
                    other.reason(on, &mut also);
                    into.also_off.extend(also.named.into_iter().chain(also.also_off));
                }
            }
            Logic::Any(any) => match any.iter().find(|one| one.is_on(on)) {
                Some(first) => first.reason(on, into),
                None => any.iter().for_each(|one| one.reason(on, into)),
            },
        }
    }

    fn leaves(&self, into: &mut Vec<usize>) {
        match self {
            Logic::Leaf(at) => into.push(*at),
            Logic::Not(inner) => inner.leaves(into),
            Logic::All(terms) | Logic::Any(terms) => terms.iter().for_each(|one| one.leaves(into)),
        }
    }

    /// The smallest reason for its value. `key` returns the number of the first leaf with the same
    /// contact: a contact has the same state at all its places.
    pub fn why(&self, on: &dyn Fn(usize) -> bool, key: &dyn Fn(usize) -> usize) -> PowerReason {
        let mut found = PowerReason::default();
        self.reason(on, &mut found);
        let mut all = Vec::new();
        self.leaves(&mut all);
        let mut repeated: Vec<usize> = all.iter().map(|at| key(*at)).collect();
        repeated.sort_unstable();
        let mut seen: Vec<usize> =
            repeated.windows(2).filter(|w| w[0] == w[1]).map(|w| w[0]).collect();
        seen.dedup();
        once(&mut found.named, key);
        if !seen.is_empty() && all.len() <= LEAVES_MAX {
            let mut at = 0;
            while at < found.named.len() {
                let mut without = found.named.clone();
                without.remove(at);
                if self.is_decided(&without, &seen, on, key) {
                    found.named = without;
                } else {
                    at += 1;
                }
            }
        }
        once(&mut found.also_off, key);
        let named: HashSet<usize> = found.named.iter().map(|at| key(*at)).collect();
        found.also_off.retain(|at| !named.contains(&key(*at)));
        found
    }

    /// Whether these leaves alone decide its value. For an exact result, contacts with several
    /// places are tried both ways, unless they are too many.
    fn is_decided(
        &self,
        named: &[usize],
        repeated: &[usize],
        on: &dyn Fn(usize) -> bool,
        key: &dyn Fn(usize) -> usize,
    ) -> bool {
        let named: Vec<usize> = named.iter().map(|at| key(*at)).collect();
        let free: Vec<usize> = repeated.iter().copied().filter(|at| !named.contains(at)).collect();
        let free = if free.len() > 12 { Vec::new() } else { free };
        let value = self.is_on(on);
        (0..1u32 << free.len()).all(|bits| {
            let state = |at: usize| {
                let at = key(at);
                if named.contains(&at) {
                    return Some(on(at));
                }
                free.iter().position(|leaf| *leaf == at).map(|place| bits >> place & 1 == 1)
            };
            self.known(&state) == Some(value)
        })
    }
}

fn once(leaves: &mut Vec<usize>, key: &dyn Fn(usize) -> usize) {
    let mut seen = HashSet::new();
    leaves.retain(|at| seen.insert(key(*at)));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaf(at: usize) -> Logic {
        Logic::Leaf(at)
    }

    fn why(logic: &Logic, states: &[u8]) -> (Vec<usize>, Vec<usize>) {
        let found = logic.why(&|at| states[at] != 0, &|at| at);
        (found.named, found.also_off)
    }

    #[test]
    fn a_series_names_all_contacts_when_on_and_the_leftmost_off_contact_when_off() {
        let series = Logic::All(vec![leaf(0), leaf(1), leaf(2)]);
        assert_eq!(why(&series, &[1, 1, 1]), (vec![0, 1, 2], vec![]));
        assert_eq!(why(&series, &[1, 0, 0]), (vec![1], vec![2]));
    }

    #[test]
    fn a_parallel_names_its_first_on_branch_when_on_and_all_branches_when_off() {
        let any = Logic::Any(vec![leaf(0), Logic::All(vec![leaf(1), leaf(2)])]);
        assert_eq!(why(&any, &[1, 1, 1]), (vec![0], vec![]));
        assert_eq!(why(&any, &[0, 1, 1]), (vec![1, 2], vec![]));
        assert_eq!(why(&any, &[0, 0, 0]), (vec![0, 1], vec![2]));
    }

    #[test]
    fn a_negation_swaps_the_reasons_of_on_and_off() {
        let not = Logic::Not(Box::new(Logic::Any(vec![leaf(0), leaf(1)])));
        assert_eq!(why(&not, &[0, 0]), (vec![0, 1], vec![]));
        assert_eq!(why(&not, &[0, 1]), (vec![1], vec![]));
    }

    #[test]
    fn a_contact_decided_by_another_contact_is_omitted() {
        // (a | b) & b
        let logic = Logic::All(vec![Logic::Any(vec![leaf(0), leaf(1)]), leaf(2)]);
        let found = logic.why(&|_| true, &|at| at.min(1));
        assert_eq!(found.named, [2]);
        // a & (b | !b)
        let either = Logic::Any(vec![leaf(1), Logic::Not(Box::new(leaf(2)))]);
        let logic = Logic::All(vec![leaf(0), either]);
        let found = logic.why(&|_| true, &|at| at.min(1));
        assert_eq!(found.named, [0]);
    }
}
