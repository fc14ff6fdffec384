//! The places at which a program writes and reads its cells: instructions and contacts, each with
//! its rung.
//!
//! `draw::xref` makes the cross-reference from them. The writers are the same as those of `why`, so
//! the two never differ; the readers come from the program as it is written.

use std::collections::{BTreeSet, HashSet};

use super::answer::{BlockPlace, Place, RungName};
use super::cell_index::CellIndex;
use super::leaves::own_contacts;
use super::subject::Subject;
use rungd_engine::isa::{BlockId, ElementId};
use rungd_engine::{Cell, ScanStep, Stretches};
use rungd_language::resolve::program::{BlockKind, Contact};
pub use rungd_language::resolve::reads::ReadOperand;
use rungd_language::source::span::Span;

/// The uses of all cells of a program.
#[derive(Debug)]
pub struct ProgramUses<'s> {
    subject: &'s Subject,
    sites: Vec<ReadSite>,
    /// By cell: the numbers of its sites.
    reads: CellIndex<u32>,
}

/// An instruction that may write a cell.
#[derive(Clone, Debug)]
pub struct WriteUse {
    /// Its rung.
    pub rung: RungName,
    /// Its place, with its text.
    pub place: Place,
    /// The block or Stage whose end resets the cell.
    pub reset_at_end: Option<String>,
}

/// A contact or instruction that reads a cell.
#[derive(Clone, Debug)]
pub struct ReadUse {
    /// Its rung.
    pub rung: RungName,
    /// Its place, with its text.
    pub place: Place,
}

/// All uses of some cells.
#[derive(Clone, Debug, Default)]
pub struct CellUses {
    /// Instructions that write them, in file order.
    pub writes: Vec<WriteUse>,
    /// Blocks that write them by their own start and end: the bits of their Stages.
    pub turns: Vec<BlockPlace>,
    /// Contacts and instructions that read them, in file order.
    pub reads: Vec<ReadUse>,
}

#[derive(Clone, Copy, Debug)]
struct ReadSite {
    part: u32,
    span: Span,
}

impl Subject {
    /// The uses of all cells. Walks the whole program.
    pub fn uses(&self) -> ProgramUses<'_> {
        let mut list = ReadList { subject: self, sites: Vec::new(), cells: Vec::new() };
        (0..self.sites.parts.len() as u32).for_each(|part| list.part(part));
        let reads = CellIndex::new((0..).zip(&list.cells));
        ProgramUses { subject: self, sites: list.sites, reads }
    }
}

impl ProgramUses<'_> {
    /// The uses of some cells, each place once.
    pub fn of_cells(&self, cells: &[Cell]) -> CellUses {
        let mut uses = CellUses::default();
        let mut deeds: Vec<ScanStep> =
            cells.iter().flat_map(|cell| self.subject.writers(*cell)).collect();
        let mut sites: Vec<u32> = cells.iter().flat_map(|cell| self.reads.entries(*cell)).collect();
        deeds.sort_unstable_by_key(order);
        deeds.dedup();
        sites.sort_unstable();
        sites.dedup();
        uses.reads = sites.into_iter().map(|at| self.read(self.sites[at as usize])).collect();
        let (mut written, mut reset) = (BTreeSet::new(), HashSet::new());
        for deed in deeds {
            match deed {
                ScanStep::Turn(block) => {
                    let element = ElementId { block, stage: None };
                    uses.turns.push(self.subject.element(element));
                }
                ScanStep::Batch(_) | ScanStep::Pass(_) => {
                    let site = self.subject.site(deed);
                    let at = site.and_then(|site| Some((site.part, site.instruction?)));
                    written.extend(at);
                    reset.extend(at.filter(|_| matches!(deed, ScanStep::Pass(_))));
                }
                ScanStep::Element(_) => {}
            }
        }
        let write = |(part, number)| self.write(part, number, reset.contains(&(part, number)));
        uses.writes = written.into_iter().filter_map(write).collect();
        uses
    }

    /// The CALLs of a subroutine, in file order.
    pub fn calls(&self, subroutine: BlockId) -> Vec<ReadUse> {
        let calls = self.subject.calls_of(subroutine).into_iter();
        calls.map(|(_, part, call)| self.read(ReadSite { part, span: call.span })).collect()
    }

    /// The parts of rungs that read a cell.
    pub fn reading_parts(&self, cell: Cell) -> Vec<u32> {
        self.reads.entries(cell).into_iter().map(|at| self.sites[at as usize].part).collect()
    }

    fn write(&self, part: u32, number: u32, is_reset: bool) -> Option<WriteUse> {
        let instruction = self.subject.instruction(part, number)?;
        let rung = self.subject.place_of_rung(part);
        let reset_at_end = (is_reset && self.ends(part)).then(|| rung.element.name.clone());
        Some(WriteUse { place: self.subject.place(instruction.span), rung, reset_at_end })
    }

    fn read(&self, ReadSite { part, span }: ReadSite) -> ReadUse {
        ReadUse { rung: self.subject.place_of_rung(part), place: self.subject.place(span) }
    }

    /// Whether the block or Stage of a part can end while the controller runs.
    fn ends(&self, part: u32) -> bool {
        let element = self.subject.part(part).element;
        let block = self.subject.program.block(element.block);
        let may_end = match block.kind {
            BlockKind::Program => !block.is_main(),
            BlockKind::Task | BlockKind::Subroutine => true,
            BlockKind::FirstScan
            | BlockKind::TopOfScan
            | BlockKind::BottomOfScan
            | BlockKind::LastScan => false,
        };
        may_end || element.stage.is_some()
    }
}

fn order(deed: &ScanStep) -> (u32, u32) {
    match deed {
        ScanStep::Turn(block) => (0, block.0),
        ScanStep::Element(_) => (1, 0),
        ScanStep::Batch(at) => (2, *at),
        ScanStep::Pass(at) => (3, *at),
    }
}

/// The list of the readers of a program while it is made.
struct ReadList<'s> {
    subject: &'s Subject,
    sites: Vec<ReadSite>,
    /// For each site, the cells that it reads.
    cells: Vec<Stretches>,
}

impl ReadList<'_> {
    fn part(&mut self, part: u32) {
        let subject = self.subject;
        for contact in own_contacts(subject, part) {
            self.contact(part, contact, None);
        }
        for instruction in subject.body(part) {
            let site = ReadSite { part, span: instruction.span };
            self.add(site, &instruction.reads());
        }
    }

    /// Adds a contact and its parts. `around`: the `!` or edge that contains only this contact.
    fn contact(&mut self, part: u32, contact: &Contact, around: Option<Span>) {
        let span = around.unwrap_or(contact.span());
        match contact {
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => {
                self.add(ReadSite { part, span }, &contact.reads());
            }
            Contact::Not(inner, _) | Contact::Edge(_, inner, _) => {
                self.contact(part, inner, Some(span));
            }
            Contact::All(parts, _) | Contact::Any(parts, _) => {
                parts.iter().for_each(|inner| self.contact(part, inner, None));
            }
        }
    }

    fn add(&mut self, site: ReadSite, reads: &[ReadOperand]) {
        let layout = &self.subject.symbols.layout;
        let mut cells = Stretches::default();
        for read in reads {
            let (first, count) = match read {
                ReadOperand::Address(address) => (*address, 1),
                // The flags of structures are not neighbours.
                ReadOperand::Array(array) if array.member.is_some() => {
                    let each = array.addresses().filter_map(|member| layout.cell(member));
                    each.for_each(|cell| cells.add_cells(cell, 1));
                    continue;
                }
                ReadOperand::Array(array) => (array.element(0), array.count),
            };
            match (layout.cell(first), read) {
                (Some(Cell::WordBit(_)), ReadOperand::Array(array)) => {
                    let each = array.addresses().filter_map(|bit| layout.cell(bit));
                    each.for_each(|bit| cells.add_cells(bit, 1));
                }
                (Some(cell), _) => cells.add_cells(cell, count),
                (None, _) => {}
            }
        }
        if cells != Stretches::default() {
            self.sites.push(site);
            self.cells.push(cells);
        }
    }
}
