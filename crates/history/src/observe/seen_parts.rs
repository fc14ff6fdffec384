//! The contacts and compares of a ladder as their rungs saw them last, over the scans of a run.
//!
//! A part of a rung is looked at again only if a cell that it reads has changed since. So a scan of
//! a large ladder in which little changes is seen in little time. Used by `power`.

use std::ops::Range;
use std::sync::Arc;

use super::compares::{FormulaNumber, LadderCompare};
use super::leaves::{powers, states};
use super::slice_run::StepWitness;
use super::sparing::WholeProgram;
use rungd_engine::{BitCell, Cell, Image, ScanStep, Slice, WordCell};

/// A contact of a rung that was not executed in the scan.
pub(super) const IDLE: u8 = 2;

/// The values of the sides of compares.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ComparedValues {
    /// Their numbers among the contacts, in order.
    pub contacts: Arc<[u32]>,
    /// The values. Those of a compare that was not evaluated mean nothing.
    pub values: Vec<[FormulaNumber; 2]>,
}

/// What each part saw when its contacts were evaluated last.
pub(super) struct SeenParts {
    program: WholeProgram,
    compares: Vec<LadderCompare>,
    /// The contacts that are compares.
    compare_contacts: Arc<[u32]>,
    /// The cells that parts read, each with the batch before which the part is seen; by cell.
    readers: Vec<(u32, u32)>,
    /// One bit for each batch before which a part must be seen again.
    wanted: Vec<u64>,
    /// The batches of parts that read elements of arrays: always wanted.
    always: Vec<u64>,
    contacts: Vec<u8>,
    compared: Vec<[FormulaNumber; 2]>,
    /// How far each element has executed in the scan.
    reached: Vec<ReachedBatches>,
    /// What follows from this, for the last scan that was seen.
    executed: ExecutedParts,
}

/// How far an element has executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct ReachedBatches {
    first: u32,
    end: u32,
    /// The batches before this one were reached.
    to: u32,
}

/// The parts that were executed in a scan.
#[derive(Default)]
struct ExecutedParts {
    reached: Vec<ReachedBatches>,
    /// By part.
    parts: Arc<[bool]>,
    /// The contacts of all others, and those of them that are compares.
    idle_contacts: Vec<Range<usize>>,
    idle_compares: Vec<Range<usize>>,
}

const NO_VALUES: [FormulaNumber; 2] = [FormulaNumber::Integer(0); 2];

impl SeenParts {
    /// Parts that are all to be seen.
    pub fn new(program: &WholeProgram) -> SeenParts {
        let WholeProgram { subject, slice } = program;
        let compares = subject.compares();
        let mut always = vec![0; slice.places.len().div_ceil(64)];
        let mut readers = Vec::new();
        for (at, places) in (0..).zip(&slice.places) {
            for part in subject.ready_at(places.clone()) {
                readers.extend(powers(subject, part).iter().map(|power| (power.cell(), at)));
                for compare in &compares[compares_of(&compares, &subject.part(part).leaves)] {
                    let cells = compare.cells();
                    readers.extend(cells.map(|cell| (number(slice, cell), at)));
                    always[at as usize / 64] |= u64::from(compare.has_elements()) << (at % 64);
                }
            }
        }
        readers.sort_unstable();
        readers.dedup();
        let wanted = vec![u64::MAX; always.len()];
        let contacts = vec![0; subject.sites.leaves.len()];
        let compared = vec![NO_VALUES; compares.len()];
        let compare_contacts = compares.iter().map(|compare| compare.contact).collect();
        SeenParts {
            program: program.clone(),
            compares,
            compare_contacts,
            readers,
            wanted,
            always,
            contacts,
            compared,
            reached: Vec::new(),
            executed: ExecutedParts::default(),
        }
    }

    /// Begins a scan that is seen.
    pub fn begin(&mut self) {
        self.reached.clear();
    }

    /// Whether each part was executed in the scan, the contacts, and the values of the compares.
    pub fn scan(&mut self) -> (Arc<[bool]>, Vec<u8>, ComparedValues) {
        if self.executed.reached != self.reached || self.executed.parts.is_empty() {
            self.executed = self.executed();
        }
        let mut contacts = self.contacts.clone();
        for idle in &self.executed.idle_contacts {
            contacts[idle.clone()].fill(IDLE);
        }
        let mut values = self.compared.clone();
        for idle in &self.executed.idle_compares {
            values[idle.clone()].fill(NO_VALUES);
        }
        let compared = ComparedValues { contacts: Arc::clone(&self.compare_contacts), values };
        (Arc::clone(&self.executed.parts), contacts, compared)
    }

    fn executed(&self) -> ExecutedParts {
        let WholeProgram { subject, slice } = &self.program;
        let mut parts = vec![false; subject.sites.parts.len()];
        for ReachedBatches { first, to, .. } in &self.reached {
            for places in &slice.places[*first as usize..*to as usize] {
                subject.ready_at(places.clone()).for_each(|part| parts[part as usize] = true);
            }
        }
        let idle = subject.sites.parts.iter().zip(&parts).filter(|(_, executed)| !*executed);
        let leaves: Vec<&Range<u32>> = idle.map(|(part, _)| &part.leaves).collect();
        let contacts = leaves.iter().map(|leaves| leaves.start as usize..leaves.end as usize);
        let compares = leaves.iter().map(|leaves| compares_of(&self.compares, leaves));
        ExecutedParts {
            reached: self.reached.clone(),
            idle_contacts: contacts.collect(),
            idle_compares: compares.collect(),
            parts: parts.into(),
        }
    }

    /// Sees the parts whose contacts have been evaluated right before a batch.
    fn look(&mut self, batch: u32, slice: &Slice, image: &Image) {
        let (word, bit) = (batch as usize / 64, 1 << (batch % 64));
        if self.wanted[word] & bit == 0 {
            return;
        }
        self.wanted[word] &= !bit | self.always[word];
        let subject = &self.program.subject;
        for part in subject.ready_at(slice.places[batch as usize].clone()) {
            let leaves = &subject.part(part).leaves;
            let states = states(subject, part, image);
            for (place, on) in self.contacts.iter_mut().skip(leaves.start as usize).zip(states) {
                *place = u8::from(on);
            }
            let own = compares_of(&self.compares, leaves);
            for (values, compare) in self.compared[own.clone()].iter_mut().zip(&self.compares[own])
            {
                *values = compare.values(image);
            }
        }
    }
}

impl StepWitness for SeenParts {
    fn wanted(&self) -> &[u64] {
        &self.wanted
    }

    fn passes(&mut self, batches: Range<u32>, next: u32) {
        let reached = self.reached.iter_mut().rfind(|reached| reached.end == batches.end);
        if let Some(reached) = reached {
            reached.to = reached.end.min(next + 1);
        }
    }

    /// What is shown of a subroutine is its last execution.
    fn before(&mut self, deed: ScanStep, slice: &Slice, image: &Image) {
        match deed {
            ScanStep::Batch(at) => self.look(at, slice, image),
            ScanStep::Element(element) => {
                let batches = slice.code(element).batches.clone();
                if !batches.is_empty() {
                    let Range { start: first, end } = batches;
                    self.reached.retain(|reached| reached.end != end);
                    self.reached.push(ReachedBatches { first, end, to: first });
                }
            }
            ScanStep::Turn(_) | ScanStep::Pass(_) => {}
        }
    }

    fn changed(&mut self, number: u32) {
        let from = self.readers.partition_point(|(cell, _)| *cell < number);
        for (_, batch) in self.readers[from..].iter().take_while(|(cell, _)| *cell == number) {
            self.wanted[*batch as usize / 64] |= 1 << (batch % 64);
        }
    }
}

/// The compares among these contacts.
fn compares_of(compares: &[LadderCompare], leaves: &Range<u32>) -> Range<usize> {
    let before = |end: u32| compares.partition_point(|compare| compare.contact < end);
    before(leaves.start)..before(leaves.end)
}

/// The number of a cell in the wiring.
fn number(slice: &Slice, cell: Cell) -> u32 {
    match cell {
        Cell::Bit(BitCell(at)) => at,
        Cell::Word(WordCell(at)) => slice.program.bit_count + at,
        Cell::WordBit(bit) => number(slice, Cell::Word(bit.word)),
    }
}
