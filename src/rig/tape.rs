//! The tape of a rig: all that came into the engine of the present process, for `why`.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::engine::Engine;
use crate::runtime::{Origin, SectionStart, TapeEntry, TapeReader, TapeSection, Taped, tape};

/// The most sections that are kept: a quarter of an hour. The oldest go first.
const SECTIONS_MAX: usize = 900;

/// The tape, and the sections that it has given so far.
pub(super) struct RigTape {
    reader: TapeReader,
    sections: VecDeque<Arc<TapeSection>>,
    now: Option<TapeSection>,
    who: Vec<(Origin, String)>,
    lost: u64,
}

impl RigTape {
    /// An engine with a tape.
    pub fn of(engine: Engine) -> (Taped, RigTape) {
        let (machine, reader) = tape(engine);
        let (sections, now) = (VecDeque::new(), None);
        (machine, RigTape { reader, sections, now, who: Vec::new(), lost: 0 })
    }

    /// Takes what the last step has handed over.
    pub fn drain(&mut self) {
        while let Some((entry, state)) = self.reader.take() {
            match (entry, state) {
                (TapeEntry::State { generation, number, mode }, Some(state)) => {
                    let follows = self.now.is_some() && self.lost == 0;
                    self.cut();
                    let lost = std::mem::take(&mut self.lost);
                    let unix_offset_ns = 0;
                    let start = SectionStart {
                        generation,
                        number,
                        mode,
                        unix_offset_ns,
                        lost,
                        follows,
                    };
                    let (entries, who) = (Vec::new(), Vec::new());
                    let state_now = (*state).clone();
                    self.reader.give_back(state);
                    self.now = Some(TapeSection { start, state: state_now, entries, who });
                }
                (TapeEntry::Lost { steps }, _) => self.lost += steps,
                (entry, _) => self.now.iter_mut().for_each(|now| now.entries.push(entry)),
            }
        }
    }

    /// Names an origin.
    pub fn note(&mut self, origin: Origin, who: &str) {
        self.who.push((origin, who.to_owned()));
    }

    /// The section under way ends.
    fn cut(&mut self) {
        let Some(section) = self.now.take() else { return };
        if self.sections.len() == SECTIONS_MAX {
            self.sections.pop_front();
        }
        self.sections.push_back(Arc::new(section));
    }

    /// All sections, the newest last, each with the names of its origins.
    pub fn sections(&self) -> Vec<Arc<TapeSection>> {
        let newest = self.now.iter().map(|now| Arc::new(now.clone()));
        let named = |section: &Arc<TapeSection>| {
            Arc::new(TapeSection { who: self.who.clone(), ..TapeSection::clone(section) })
        };
        self.sections.iter().cloned().chain(newest).map(|section| named(&section)).collect()
    }
}
