//! The input of every rule: the program, and every instruction and contact with its place.
//!
//! [`Context::new`] walks the program once, in file order. The rules then look up instructions, the
//! drivers of a bit, the owners of a structure, or contacts. A walk over them ends early if the
//! load must end. This module makes no findings; the names in findings come from `names`. Drivers
//! are compared by *element* (a block's own rungs, or one stage), because a termination pass acts
//! on an element.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::fmt;

use crate::resolve::program::{
    Block, BlockKind, Branch, Contact, Instruction, Program, ProgramPart, Rung, Stage, Tag,
    TagMeaning,
};
use crate::resolve::range::Range;
use crate::source::span::{Located, Span};
use rungd_base::progress::Progress;
pub use rungd_engine::isa::{
    Address, Bit, ElementId, Mnemonic, NumberMap, NumberRange, NumberRanges, NumberSet, Space,
    Structure, Word,
};

use super::outside_operands::OutsideOperands;

/// The data that a check uses in addition to the program.
#[derive(Clone, Copy)]
pub struct CheckInputs<'a> {
    /// The retained ranges of the controller file; empty without a controller file.
    pub retained: &'a [Range],
    /// The writers of the controller file; `None` without a controller file.
    pub outside: Option<&'a OutsideOperands>,
    /// The progress of the load.
    pub progress: &'a Progress,
}

impl<'a> CheckInputs<'a> {
    /// The data for a load of ladders without a controller file and without a time limit.
    pub fn of(retained: &'a [Range]) -> CheckInputs<'a> {
        CheckInputs { retained, outside: None, progress: &rungd_base::progress::UNASKED }
    }
}

/// The program, with its instructions and contacts listed.
pub struct Context<'a> {
    /// The program.
    pub program: &'a Program,
    /// Whether the program is complete: no part of it, not even a contact, is left out.
    pub whole: bool,
    /// The retained ranges of the controller file; empty without a controller file.
    pub retained: &'a [Range],
    /// The same ranges, by their elements.
    retained_numbers: NumberRanges<Space>,
    /// The writers of the controller file; `None` without a controller file.
    pub outside: Option<&'a OutsideOperands>,
    /// The progress of the load.
    pub progress: &'a Progress,
    instructions: Vec<ProgramInstruction<'a>>,
    contacts: Vec<&'a Contact>,
    drivers: BTreeMap<Bit, Vec<DrivingInstruction<'a>>>,
    owners: BTreeMap<Structure, Vec<ProgramInstruction<'a>>>,
    /// For counters, timers and Sensaphone counters: the first that is free, if there is one.
    free: [OnceCell<Option<Structure>>; 3],
    /// The limits that tags set for words.
    limits: NumberMap<Word, WriteLimits<'a>>,
    /// The addresses of tags with `initial`, `min` or `max`, which an operator sets, and the bits
    /// that acknowledgements turn ON.
    pub settings: NumberSet<Address>,
    /// The addresses that the ladder reads and writes. `usage` makes both, once for all rules.
    pub reads: OnceCell<Vec<(Address, Span)>>,
    /// The addresses that the ladder writes, with the effect.
    pub writes: OnceCell<NumberMap<Address, WriteEffect>>,
}

/// The combined effect of all writes of the ladder on a bit or word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum WriteEffect {
    /// The bit can only go OFF: all writes are RST.
    Off,
    /// The bit or word can change to any value.
    Any,
}

/// The limits of a write to a word.
#[derive(Clone, Copy)]
pub struct WriteLimits<'a> {
    /// The least number.
    pub min: i32,
    /// The greatest number.
    pub max: i32,
    /// The tag that sets the limits; `None` if the limits are the range of the word.
    pub of_tag: Option<&'a Tag>,
}

/// The place of an instruction in the program.
#[derive(Clone, Copy)]
pub struct RungPlace<'a> {
    /// Its block.
    pub block: &'a Block,
    /// Its stage; `None` in a block's own rungs.
    pub stage: Option<&'a Stage>,
    /// Its rung.
    pub rung: &'a Rung,
    /// The rung's number in its element, from 1.
    pub rung_number: usize,
    /// Its branch; `None` in the rung's own `do`.
    pub branch: Option<&'a Branch>,
}

/// An instruction and its place.
#[derive(Clone, Copy)]
pub struct ProgramInstruction<'a> {
    /// The place.
    pub place: RungPlace<'a>,
    /// The instruction.
    pub instruction: &'a Instruction,
}

/// An instruction that writes a bit ON and OFF at every execution: OUT, PD, ND, and the outputs
/// of ONDTMR and OFFDTMR.
#[derive(Clone, Copy)]
pub struct DrivingInstruction<'a> {
    /// The instruction and its place.
    pub placed: ProgramInstruction<'a>,
    /// The place of the operand that names the bit.
    pub span: Span,
}

impl<'a> Context<'a> {
    /// Walks the program.
    pub fn new(program: &'a Program, around: CheckInputs<'a>, whole: bool) -> Context<'a> {
        let CheckInputs { retained, outside, progress } = around;
        let mut context = Context {
            program,
            whole,
            retained,
            retained_numbers: NumberRanges::default(),
            outside,
            progress,
            instructions: Vec::new(),
            contacts: Vec::new(),
            drivers: BTreeMap::new(),
            owners: BTreeMap::new(),
            free: Default::default(),
            limits: NumberMap::default(),
            settings: NumberSet::default(),
            reads: OnceCell::new(),
            writes: OnceCell::new(),
        };
        for tag in &program.tags {
            if let TagMeaning::Address(address) = tag.meaning {
                if tag.initial.is_some() || tag.min.is_some() || tag.max.is_some() {
                    context.settings.insert(address);
                }
                let ack = tag.terms.ack.as_ref().map(|ack| Address::Bit(ack.bit).without_bit());
                context.settings.extend(ack);
                context.narrow(address, tag);
            }
        }
        for (at, range) in retained.iter().enumerate() {
            context.retained_numbers.add(range.numbers(), at);
        }
        program.parts().for_each(|part| context.walk(part));
        context.index();
        context
    }

    fn walk(&mut self, ProgramPart { block, stage, rungs }: ProgramPart<'a>) {
        for (at, rung) in rungs.iter().enumerate() {
            rung.legs.iter().for_each(|leg| self.walk_contacts(&leg.contacts));
            rung.branches.iter().for_each(|branch| self.walk_contacts(&branch.contacts));
            self.instructions.extend(rung.instructions().map(|(branch, instruction)| {
                let place = RungPlace { block, stage, rung, rung_number: at + 1, branch };
                ProgramInstruction { place, instruction }
            }));
        }
    }

    fn walk_contacts(&mut self, contacts: &'a [Contact]) {
        for contact in contacts {
            self.contacts.push(contact);
            match contact {
                Contact::Not(inner, _) | Contact::Edge(_, inner, _) => {
                    self.walk_contacts(std::slice::from_ref(&**inner));
                }
                Contact::All(parts, _) | Contact::Any(parts, _) => self.walk_contacts(parts),
                Contact::Bit(..)
                | Contact::Element(..)
                | Contact::Compare(..)
                | Contact::Computed(..) => {}
            }
        }
    }

    fn index(&mut self) {
        for &placed in &self.instructions {
            if let Some(Located { value: bit, span }) = placed.instruction.driven() {
                self.drivers.entry(bit).or_default().push(DrivingInstruction { placed, span });
            }
            if let Some(structure) = placed.instruction.owned() {
                self.owners.entry(structure).or_default().push(placed);
            }
        }
    }

    /// Every instruction, in file order, until the load must end.
    pub fn instructions(&self) -> impl Iterator<Item = &ProgramInstruction<'a>> {
        self.progress.during(&self.instructions)
    }

    /// Every contact, in file order, until the load must end; a contact with parts comes before its
    /// parts.
    pub fn contacts(&self) -> impl Iterator<Item = &'a Contact> {
        self.progress.during(self.contacts.iter().copied())
    }

    /// Every driven bit with its drivers, in file order, until the load must end.
    pub fn drivers(&self) -> impl Iterator<Item = (Bit, &[DrivingInstruction<'a>])> {
        self.progress.during(&self.drivers).map(|(bit, drivers)| (*bit, drivers.as_slice()))
    }

    /// The drivers of a bit, in file order.
    pub fn drivers_of(&self, bit: Bit) -> &[DrivingInstruction<'a>] {
        self.drivers.get(&bit).map_or(&[], Vec::as_slice)
    }

    /// Every owned structure with its owners, in file order, until the load must end.
    pub fn owners(&self) -> impl Iterator<Item = (Structure, &[ProgramInstruction<'a>])> {
        self.progress
            .during(&self.owners)
            .map(|(structure, owners)| (*structure, owners.as_slice()))
    }

    fn narrow(&mut self, address: Address, tag: &'a Tag) {
        let Address::Word(word) = address else { return };
        let (min, max) = (tag.min.map(|(n, _)| n), tag.max.map(|(n, _)| n));
        if min.is_none() && max.is_none() {
            return;
        }
        let limits = self.limits.entry(word).or_insert(WriteLimits::of(word));
        limits.min = limits.min.max(min.unwrap_or(limits.min));
        limits.max = limits.max.min(max.unwrap_or(limits.max));
        limits.of_tag.get_or_insert(tag);
    }

    /// The limits of the results that an instruction stores in a word.
    pub fn limits(&self, word: Word) -> WriteLimits<'a> {
        self.limits.get(&word).copied().unwrap_or(WriteLimits::of(word))
    }

    /// The first tag of an address.
    pub fn tag_at(&self, address: Address) -> Option<&'a Tag> {
        self.program.names.tag_index(address).map(|index| &self.program.tags[index])
    }

    /// The retained range with an element; the first, if several have it.
    pub fn retained_with(&self, space: Space, number: u32) -> Option<&'a Range> {
        let at = self.retained_numbers.first_in(NumberRange::one(space, number))?;
        self.retained.get(at)
    }

    /// The place for the first free structure of this kind.
    pub(super) fn free_cell(&self, structure: Structure) -> &OnceCell<Option<Structure>> {
        &self.free[match structure {
            Structure::Counter(_) => 0,
            Structure::Timer(_) => 1,
            Structure::Sensaphone(_) => 2,
        }]
    }

    /// The owned structures of the same kind, in order.
    pub fn owned_like(&self, structure: Structure) -> impl Iterator<Item = Structure> {
        let all = structure.numbered(0)..=structure.numbered(u32::MAX);
        self.owners.range(all).map(|(owned, _)| *owned)
    }

    /// Whether an instruction owns the structure.
    pub fn is_owned(&self, structure: Structure) -> bool {
        self.owners.contains_key(&structure)
    }
}

impl WriteLimits<'_> {
    fn of(word: Word) -> Self {
        let (min, max) = word.range();
        WriteLimits { min, max, of_tag: None }
    }
}

impl<'a> ProgramInstruction<'a> {
    /// The mnemonic.
    pub fn mnemonic(&self) -> Mnemonic {
        self.instruction.mnemonic
    }

    /// The mnemonic as written.
    pub fn name(&self) -> &'static str {
        self.mnemonic().spec().name
    }
}

impl RungPlace<'_> {
    /// The element of the place.
    pub fn element(&self) -> ElementId {
        ElementId { block: self.block.id, stage: self.stage.map(|stage| stage.id) }
    }

    /// Whether its block is no program: a task, built-in or not, or a subroutine.
    pub fn is_outside_programs(&self) -> bool {
        self.block.kind != BlockKind::Program
    }
}

impl fmt::Display for RungPlace<'_> {
    /// ``program `Day`, stage `Green`, rung 2``, for a sentence.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} `{}`", self.block.kind.word(), self.block.name)?;
        if let Some(stage) = self.stage {
            write!(f, ", stage `{}`", stage.name)?;
        }
        match &self.rung.name {
            Some(name) => write!(f, ", rung `{name}`")?,
            None => write!(f, ", rung {}", self.rung_number)?,
        }
        let Some(branch) = self.branch else { return Ok(()) };
        // A rung may have thousands of branches; they are in order of their places in memory.
        let of_branch = std::ptr::from_ref(branch);
        let before = |other: &Branch| std::ptr::from_ref(other) < of_branch;
        write!(f, ", branch {}", self.rung.branches.partition_point(before) + 1)
    }
}
