//! Keeps the names of the senders for origins, until a section takes them.
//!
//! `recorder` takes the notes when a section ends. A note may come before its entry or after it; a
//! later note is written with the next section.

use std::collections::{HashSet, VecDeque};

use super::section::numbered;
use rungd_runtime::{Origin, TapeEntry};

/// The maximum number of notes that wait for their entry; the oldest note is dropped first.
const NOTES_MAX: usize = 1024;

/// The maximum number of bytes of a note.
const WHO_BYTES_MAX: usize = 256;

/// The notes that wait.
#[derive(Clone, Debug, Default)]
pub(super) struct WhoNotes {
    notes: VecDeque<(Origin, String)>,
    /// The origins of the section before.
    before: HashSet<(u8, u64)>,
}

impl WhoNotes {
    pub fn note(&mut self, origin: Origin, mut who: String) {
        if self.notes.len() == NOTES_MAX {
            self.notes.pop_front();
        }
        while who.len() > WHO_BYTES_MAX {
            who.pop();
        }
        self.notes.push_back((origin, who));
    }

    /// The notes about the origins of a section that ends, and late notes about the origins of the
    /// section before it.
    pub fn of_section(&mut self, entries: &[TapeEntry]) -> Vec<(Origin, String)> {
        let own: HashSet<_> =
            entries.iter().filter_map(|entry| entry.origin()).map(numbered).collect();
        let mut found = Vec::new();
        self.notes.retain(|(origin, who)| {
            let key = numbered(*origin);
            let is_here = own.contains(&key) || self.before.contains(&key);
            if is_here {
                found.push((*origin, who.clone()));
            }
            !is_here || !is_passing(*origin)
        });
        self.before = own;
        found
    }
}

/// Whether an origin occurs only once.
fn is_passing(origin: Origin) -> bool {
    match origin {
        Origin::Batch(_) | Origin::Command(_) => true,
        Origin::Inputs | Origin::Device(_) => false,
    }
}
