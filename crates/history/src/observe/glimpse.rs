//! Bits within a scan: a bit that is OFF at the end of a scan may have been ON before.
//!
//! A condition of a test is judged at the end of each scan, so it cannot see such a bit; the
//! explanation of its failure asks here. Coverage follows Stages and alarms with the same list of
//! writers.

use std::collections::HashMap;
use std::sync::Arc;

use super::subject::Subject;
use super::walk::{WalkedProgram, Witness, walk};
use rungd_engine::{Cell, Engine, EngineCall, Image, ScanStep, Slice};
use rungd_runtime::TapeSection;

/// The steps that may write some bits.
pub(super) struct BitWriters {
    by_step: HashMap<ScanStep, Vec<usize>>,
    /// The bits that turns of blocks write, at the begin of the turn too: a turn starts the initial
    /// Stage, and that may be left before the turn ends.
    turned: Vec<usize>,
}

impl BitWriters {
    /// The writers of these bits.
    pub fn new(subject: &Subject, bits: &[Cell]) -> BitWriters {
        let mut writers = BitWriters { by_step: HashMap::new(), turned: Vec::new() };
        for (at, bit) in bits.iter().enumerate() {
            for deed in subject.writers(*bit) {
                writers.by_step.entry(deed).or_default().push(at);
                if matches!(deed, ScanStep::Turn(_)) && writers.turned.last() != Some(&at) {
                    writers.turned.push(at);
                }
            }
        }
        writers
    }

    /// The bits that may have changed before a step, by their places in the list.
    pub fn before(&self, deed: ScanStep) -> &[usize] {
        match deed {
            ScanStep::Element(_) => &self.turned,
            ScanStep::Turn(_) | ScanStep::Batch(_) | ScanStep::Pass(_) => &[],
        }
    }

    /// The bits that a step may have changed, by their places in the list.
    pub fn after(&self, deed: ScanStep) -> &[usize] {
        self.by_step.get(&deed).map_or(&[], Vec::as_slice)
    }
}

impl Subject {
    /// For each of these bits the last scan, from scan `from` on, within which it was ON, although
    /// it was OFF at its end and before it. `sections`: the tape of one process; only those of its
    /// last program count.
    pub fn glimpses(
        &self,
        sections: &[Arc<TapeSection>],
        bits: &[Cell],
        from: u64,
    ) -> Vec<Option<u64>> {
        let slice = self.seen.whole();
        let mut glimpser = BitObserver {
            subject: self,
            engine: Engine::new(slice.program.clone()),
            slice,
            from,
            bits: bits.iter().map(|bit| BitStates::new(*bit)).collect(),
            writers: BitWriters::new(self, bits),
        };
        let generation = sections.last().map(|section| section.start.generation);
        let same = |section: &&Arc<TapeSection>| Some(section.start.generation) == generation;
        sections.iter().filter(same).for_each(|section| glimpser.section(section));
        glimpser.bits.iter().map(|states| states.glimpse).collect()
    }
}

/// The states of a bit.
struct BitStates {
    bit: Cell,
    /// At the end of the scan before.
    before: bool,
    /// Whether it was ON within this scan.
    within: bool,
    glimpse: Option<u64>,
}

impl BitStates {
    fn new(bit: Cell) -> BitStates {
        BitStates { bit, before: false, within: false, glimpse: None }
    }
}

/// An engine that executes a tape.
struct BitObserver<'s> {
    subject: &'s Subject,
    slice: Slice,
    engine: Engine,
    from: u64,
    bits: Vec<BitStates>,
    writers: BitWriters,
}

impl BitObserver<'_> {
    fn section(&mut self, section: &TapeSection) {
        self.engine.resume(&section.state);
        self.note_ends(None);
        for step in section.steps() {
            match step.entry.call() {
                Some(EngineCall::Execute) => self.scan(step.number),
                Some(call) => self.engine.apply(call),
                None => {}
            }
        }
    }

    fn scan(&mut self, number: u64) {
        if number < self.from {
            self.engine.apply(EngineCall::Execute);
            self.note_ends(None);
            return;
        }
        let BitObserver { subject, slice, engine, bits, writers, .. } = self;
        bits.iter_mut().for_each(|states| states.within = engine.image().value(states.bit) != 0);
        let program = WalkedProgram { subject, slice };
        walk(program, engine, EngineCall::Execute, &mut Within { bits, writers });
        self.note_ends(Some(number));
    }

    /// Notes the states at the end of a scan; `number`: its number, if it was observed.
    fn note_ends(&mut self, number: Option<u64>) {
        let image = self.engine.image();
        for states in &mut self.bits {
            let now = image.value(states.bit) != 0;
            if states.within && !now && !states.before {
                states.glimpse = number.or(states.glimpse);
            }
            (states.before, states.within) = (now, false);
        }
    }
}

/// Notes which bits are ON within a scan.
struct Within<'a> {
    bits: &'a mut [BitStates],
    writers: &'a BitWriters,
}

impl Witness for Within<'_> {
    const PARTS: bool = false;

    fn before(&mut self, deed: ScanStep, _: u32, image: &Image) {
        self.look(self.writers.before(deed), image);
    }

    fn after(&mut self, deed: ScanStep, _: u32, image: &Image) {
        self.look(self.writers.after(deed), image);
    }
}

impl Within<'_> {
    fn look(&mut self, places: &[usize], image: &Image) {
        for at in places {
            let states = &mut self.bits[*at];
            states.within |= image.value(states.bit) != 0;
        }
    }
}
