//! The tape of a rig: all inputs of the engine in the current process.
//!
//! It is kept as sections, for `why`, or passed to a listener, for coverage.

use std::collections::VecDeque;
use std::sync::Arc;

use super::program::RigProgram;
use rungd_engine::{Engine, EngineState};
use rungd_runtime::{Origin, SectionStart, TapeEntry, TapeReader, TapeSection, Taped, tape};

/// The maximum number of sections that are kept: a quarter of an hour. The oldest sections are
/// dropped first.
const SECTIONS_MAX: usize = 900;

/// Receives the tape of a rig, entry by entry.
pub trait TapeListener {
    /// Receives an entry, and the state that belongs to it; `program`: the current program.
    fn hear(&mut self, program: &Arc<RigProgram>, entry: TapeEntry, state: Option<&EngineState>);
}

/// The tape, and the sections made from it so far.
pub(crate) struct RigTape {
    reader: TapeReader,
    listener: Option<Box<dyn TapeListener>>,
    sections: VecDeque<Arc<TapeSection>>,
    now: Option<TapeSection>,
    who: Vec<(Origin, String)>,
    lost: u64,
}

impl RigTape {
    /// An engine with a tape.
    pub fn of(engine: Engine) -> (Taped, RigTape) {
        let (machine, reader) = tape(engine);
        let (sections, now, who, listener) = (VecDeque::new(), None, Vec::new(), None);
        (machine, RigTape { reader, listener, sections, now, who, lost: 0 })
    }

    /// The engine of a new process, with a new tape.
    pub fn begin_process(&mut self, engine: Engine) -> Taped {
        let listener = self.listener.take();
        let (machine, tape) = RigTape::of(engine);
        *self = RigTape { listener, ..tape };
        machine
    }

    /// Takes the entries of the last step from the tape.
    pub fn drain(&mut self, program: &Arc<RigProgram>) {
        while let Some((entry, state)) = self.reader.take() {
            if let Some(listener) = &mut self.listener {
                listener.hear(program, entry, state.as_deref());
            } else {
                self.keep(entry, state.as_deref());
            }
            if let Some(state) = state {
                self.reader.give_back(state);
            }
        }
    }

    /// Passes the kept sections, and all later entries, to a listener.
    pub fn listen(&mut self, program: &Arc<RigProgram>, mut listener: Box<dyn TapeListener>) {
        for section in self.sections() {
            let SectionStart { generation, number, mode, .. } = section.start;
            let first = TapeEntry::State { generation, number, mode };
            listener.hear(program, first, Some(&section.state));
            section.entries.iter().for_each(|entry| listener.hear(program, *entry, None));
        }
        (self.now, self.listener) = (None, Some(listener));
        self.sections.clear();
    }

    fn keep(&mut self, entry: TapeEntry, state: Option<&EngineState>) {
        match (entry, state) {
            (TapeEntry::State { generation, number, mode }, Some(state)) => {
                let follows = self.now.is_some() && self.lost == 0;
                self.cut();
                let (lost, unix_offset_ns) = (std::mem::take(&mut self.lost), 0);
                let start =
                    SectionStart { generation, number, mode, unix_offset_ns, lost, follows };
                let (state, entries, who) = (state.clone(), Vec::new(), Vec::new());
                self.now = Some(TapeSection { start, state, entries, who });
            }
            (TapeEntry::Lost { steps }, _) => self.lost += steps,
            (entry, _) => self.now.iter_mut().for_each(|now| now.entries.push(entry)),
        }
    }

    /// Names an origin.
    pub fn note(&mut self, origin: Origin, who: &str) {
        self.who.push((origin, who.to_owned()));
    }

    /// Ends the current section.
    fn cut(&mut self) {
        let Some(section) = self.now.take() else { return };
        if self.sections.len() == SECTIONS_MAX {
            self.sections.pop_front();
        }
        self.sections.push_back(Arc::new(section));
    }

    /// All sections, the newest last, each with the names of its origins.
    pub fn sections(&self) -> Vec<Arc<TapeSection>> {
        let named = |section: &TapeSection| {
            Arc::new(TapeSection { who: self.who.clone(), ..section.clone() })
        };
        self.sections
            .iter()
            .map(|section| named(section))
            .chain(self.now.as_ref().map(named))
            .collect()
    }
}
