//! What Logix does before its first scan: it runs every rung with its condition false, so that
//! coils are OFF, timers begin anew, and no input that is ON already counts as an edge.
//!
//! Collected while rungs are translated; `project` makes rungs of the Task `FirstScan` of it, which
//! rungd executes at every start, before all other blocks.

use super::locate::{Index, LocatedOperand};
use crate::condition::TouchedPlace;
use crate::model::{ProjectRung, ProjectTag};

/// What the prescan does.
#[derive(Debug, Default)]
pub(crate) struct Prescan {
    entries: Vec<PrescanEntry>,
    /// Places that something else than a coil writes.
    others: Vec<TouchedPlace>,
    instances: Vec<PrescanInstance>,
}

/// An instance of an Add-On Instruction.
#[derive(Debug)]
struct PrescanInstance {
    scope: usize,
    rung: ProjectRung,
}

#[derive(Debug)]
struct PrescanEntry {
    scope: usize,
    text: String,
    /// The coil that it resets; it may be superfluous.
    coil: Option<TouchedPlace>,
}

impl Prescan {
    /// A bit that the prescan turns ON.
    pub(crate) fn set(&mut self, scope: usize, bit: &LocatedOperand) {
        self.bit(scope, bit, "SET");
    }

    /// A bit that the prescan turns OFF.
    pub(crate) fn reset(&mut self, scope: usize, bit: &LocatedOperand) {
        self.bit(scope, bit, "RST");
    }

    fn bit(&mut self, scope: usize, bit: &LocatedOperand, verb: &str) {
        if is_fixed(bit) {
            self.text(scope, format!("{verb} {}", bit.text));
        }
    }

    /// A coil: the prescan turns it OFF. It begins OFF, and OUT turns it OFF at a stop, so that
    /// only a coil that something else writes needs it, or one that the file has ON.
    pub(crate) fn coil(&mut self, scope: usize, bit: &LocatedOperand) {
        if is_fixed(bit) {
            let text = format!("RST {}", bit.text);
            self.entries.push(PrescanEntry { scope, text, coil: Some(bit.place()) });
        }
    }

    /// A place that something else than a coil writes.
    pub(crate) fn other(&mut self, place: &TouchedPlace) {
        self.others.push(place.clone());
    }

    /// An instruction of the prescan.
    pub(crate) fn text(&mut self, scope: usize, text: String) {
        self.entries.push(PrescanEntry { scope, text, coil: None });
    }

    /// An instance of an Add-On Instruction, whose logic has a prescan too.
    pub(crate) fn instance(&mut self, scope: usize, rung: ProjectRung) {
        if !self.instances.iter().any(|one| one.rung.body == rung.body) {
            self.instances.push(PrescanInstance { scope, rung });
        }
    }

    /// The uses for the instances of a scope.
    pub(crate) fn uses(&self, scope: usize) -> Vec<ProjectRung> {
        let own = self.instances.iter().filter(|one| one.scope == scope);
        own.map(|one| one.rung.clone()).collect()
    }

    /// The instructions of a scope, each once.
    pub(crate) fn texts(&self, scope: usize, tags: &[&ProjectTag]) -> Vec<String> {
        let begins_on = |place: &TouchedPlace| {
            tags.iter()
                .any(|tag| tag.initial.is_some() && TouchedPlace::of(&tag.name).overlaps(place))
        };
        let is_needed = |entry: &&PrescanEntry| match &entry.coil {
            None => true,
            Some(place) => {
                begins_on(place) || self.others.iter().any(|other| other.overlaps(place))
            }
        };
        let mut texts: Vec<String> = Vec::new();
        for entry in self.entries.iter().filter(|entry| entry.scope == scope).filter(is_needed) {
            if !texts.contains(&entry.text) {
                texts.push(entry.text.clone());
            }
        }
        texts
    }
}

fn is_fixed(bit: &LocatedOperand) -> bool {
    !matches!(bit.index, Index::Moving(_)) && bit.word.as_ref().is_none_or(|word| word.is_fixed)
}
