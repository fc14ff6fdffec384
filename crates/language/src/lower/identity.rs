//! The state that a program keeps from scan to scan, under names that are the same in all versions
//! of the program.
//!
//! `lower` collects it and stores it in `Symbols`. A reload compares the identities of the old and
//! the new program. The names do not contain cell numbers, because cell numbers can change with
//! each lowering. Retentive memory uses only the shift registers
//! and the Programs whose Stages are retained.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::resolve::array::{Array, ArrayElement, ShiftBits};
use crate::resolve::name_book::NameBook;
use crate::resolve::program::{Instruction, Program, TagMeaning, Value};
use crate::source::span::Span;
use rungd_engine::isa::{Address, Bit, BlockId, ElementId, Mnemonic, NumberSet, Structure};
use rungd_engine::{BitCell, ResumeBits, WordCell};

/// Everything in a program that keeps a state from scan to scan.
#[derive(Clone, Debug, Default)]
pub struct Identity {
    /// The names of blocks, Stages and tags.
    pub names: Arc<NameBook>,
    /// The owners of structures, in file order: one for each structure; up to two for a Sensaphone
    /// counter.
    pub owners: Vec<Owner>,
    /// Edge histories outside structures, in file order.
    pub histories: Vec<History>,
    /// SRs, in file order; their histories are in `histories` too.
    pub shifts: Vec<ShiftRegister>,
    /// The instructions that may end a subroutine's execution, in file order.
    pub missed_times: Vec<MissedTime>,
    /// The subroutines that a CALL can reach from a Program or Task.
    pub called_subroutines: BTreeSet<BlockId>,
    /// The Programs whose Stages are retained, in file order.
    pub kept: Vec<ResumeBits>,
    /// Rungs, in file order.
    pub rungs: Vec<RungText>,
    /// Bits that instructions write.
    pub written: NumberSet<Bit>,
    /// Recurrent ENTASKs, in file order.
    pub intervals: Vec<Interval>,
    /// Every address that the program tags or names.
    pub addresses: NumberSet<Address>,
    /// The address of every tag that has one.
    pub tags: BTreeMap<String, Address>,
    /// The constants of the ladder, each with its value as text.
    pub constants: BTreeMap<String, String>,
    /// The values after a cold start, from the tags' `initial`.
    pub initial: BTreeMap<Address, i32>,
}

/// The owning instruction of a structure: it writes the flags and keeps the private state.
#[derive(Clone, Debug)]
pub struct Owner {
    /// The structure.
    pub structure: Structure,
    /// The instruction.
    pub mnemonic: Mnemonic,
    /// The element that contains the instruction.
    pub element: ElementId,
    /// Its presets, by the names of their operands.
    pub presets: Box<[(&'static str, Value)]>,
}

/// An edge history: of `rise`, `fall`, PD, ND, PONOFF, RESTART, a run-once ENTASK.
#[derive(Clone, Debug)]
pub struct History {
    /// Its cell.
    pub cell: BitCell,
    /// The element that contains its contact or instruction.
    pub element: ElementId,
    /// The name of its rung.
    pub rung: Option<String>,
    /// The text of its rung, in addresses.
    pub whole: Arc<str>,
    /// Its contact or instruction, in addresses: `rise(X0)`, `PONOFF C0`.
    pub text: String,
}

/// The time that the timers behind an instruction have missed, because it ended the subroutine's
/// execution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MissedTime {
    /// Its word.
    pub cell: WordCell,
    /// The subroutine.
    pub block: BlockId,
}

/// An SR.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShiftRegister {
    /// Its bits.
    pub bits: ShiftBits,
    /// The history of CLK, a public cell.
    pub cell: BitCell,
    /// Its block.
    pub block: BlockId,
}

/// A rung: its element, its name, and its text in addresses.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct RungText {
    pub element: ElementId,
    pub name: Option<String>,
    pub whole: Arc<str>,
    /// The rung for people: `Main, rung count-bottles`.
    pub said: Arc<str>,
    /// Its first instruction with its first operand: `CNT CT0`.
    pub acts: String,
    /// The author's text, for people.
    pub parts: Arc<[RungPartText]>,
}

/// A part of a rung's text: `when`, `leg.up`, `do`, and those of its branches.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RungPartText {
    /// The key; of a branch with its number: `branch 2 do`.
    pub key: Cow<'static, str>,
    /// The contacts or instructions, by their places in files.
    pub texts: Box<[Span]>,
}

/// A recurrent ENTASK.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Interval {
    pub task: BlockId,
    pub every: Value,
    /// The word that holds it.
    pub word: WordCell,
}

impl Identity {
    /// The identity of a program, without histories; lowering adds each when it allots the cell.
    pub(super) fn new(program: &Program) -> Identity {
        let names = Arc::clone(&program.names);
        let called_subroutines = program.called_subroutines();
        let mut identity = Identity { names, called_subroutines, ..Identity::default() };
        for tag in &program.tags {
            let address = match tag.meaning {
                TagMeaning::Address(address) => address,
                TagMeaning::Constant(value, written) => {
                    identity.constants.insert(tag.name.clone(), written.text(value));
                    continue;
                }
                TagMeaning::Real(value) => {
                    identity.constants.insert(tag.name.clone(), value.to_string());
                    continue;
                }
                TagMeaning::Array(_) => continue,
            };
            identity.addresses.insert(address);
            identity.tags.insert(tag.name.clone(), address);
            if let Some((value, _)) = tag.initial {
                identity.initial.insert(address, value);
            }
        }
        identity.addresses.extend(program.operands.iter().map(|operand| operand.address));
        identity
    }

    /// Records the structure that an instruction owns and the bit that it writes.
    pub(super) fn instruction(&mut self, instruction: &Instruction, element: ElementId) {
        if let Some(structure) = instruction.owned() {
            let presets =
                instruction.operands.of().map(|(name, preset)| (name, preset.value)).collect();
            self.owners.push(Owner { structure, mnemonic: instruction.mnemonic, element, presets });
        }
        self.written.extend(instruction.written_bits());
    }

    /// Records a history.
    pub(super) fn history(&mut self, cell: BitCell, site: &LoweringSite, text: String) {
        let LoweringSite { element, rung, whole, place: _ } = site.clone();
        self.histories.push(History { cell, element, rung, whole, text });
    }

    /// Records a rung.
    pub(super) fn rung(&mut self, site: &LoweringSite, acts: String, parts: Arc<[RungPartText]>) {
        let LoweringSite { element, rung: name, whole, place: said } = site.clone();
        self.rungs.push(RungText { element, name, whole, said, acts, parts });
    }

    /// The name of an address in every version of the program, without its tag.
    pub fn address(&self, address: Address) -> String {
        self.names.address(address)
    }

    /// The name of an element that a word selects. Array and word are separate in the name, because
    /// each can be renamed.
    pub fn element(&self, element: &ArrayElement) -> String {
        format!("{} by {}", self.array(element.array), self.address(Address::Word(element.index)))
    }

    /// The name of an array or slice; without an address, it is the name of the tag.
    pub(crate) fn array(&self, array: Array) -> String {
        let named = match self.names.places.at(array.element(0)) {
            None => return array.to_string(),
            Some((place, 0)) if place.count == array.count => place.name.clone(),
            Some((place, first)) => {
                format!("{}[{first}..{}]", place.name, first + array.count - 1)
            }
        };
        match array.member {
            Some(member) => format!("{named}.{member}"),
            None => named,
        }
    }

    /// The name of the bits that SR shifts.
    pub(crate) fn run(&self, run: ShiftBits) -> String {
        match run.down {
            true => run.to_string(),
            false => self.array(run.array),
        }
    }

    /// Every address that the program tags or names, in order.
    pub fn addresses_in_order(&self) -> Vec<Address> {
        in_order(&self.addresses)
    }

    /// The bits that instructions write, in order.
    pub fn written_in_order(&self) -> Vec<Bit> {
        in_order(&self.written)
    }

    /// The same identity with converted texts of rungs and histories.
    pub fn with_texts(&self, text: &dyn Fn(&str) -> String) -> Identity {
        let mut other = self.clone();
        for history in &mut other.histories {
            history.text = text(&history.text);
            history.whole = text(&history.whole).into();
        }
        for rung in &mut other.rungs {
            rung.whole = text(&rung.whole).into();
        }
        other
    }

    /// The text of an instruction with a history: its mnemonic and operands.
    pub(super) fn edge_instruction(&self, instruction: &Instruction) -> String {
        let (bit, block) = (instruction.written_bit(), instruction.target_block());
        let bit = bit.map(|bit| self.address(Address::Bit(bit.value)));
        let operand = bit.or_else(|| Some(self.names.block(block?.value).name.clone()));
        let shifted = || instruction.first_operand().map(|bits| self.run(bits.value));
        let operand = operand.or_else(shifted).unwrap_or_default();
        format!("{} {operand}", instruction.mnemonic.spec().name)
    }
}

fn in_order<T: Copy + Ord>(set: &NumberSet<T>) -> Vec<T> {
    let mut all: Vec<T> = set.iter().copied().collect();
    all.sort_unstable();
    all
}

impl Default for LoweringSite {
    fn default() -> LoweringSite {
        let element = ElementId { block: BlockId(0), stage: None };
        LoweringSite { element, rung: None, whole: "".into(), place: "".into() }
    }
}

/// The current place of lowering.
#[derive(Clone, Debug)]
pub(super) struct LoweringSite {
    pub(crate) element: ElementId,
    pub rung: Option<String>,
    pub whole: Arc<str>,
    /// The rung for people: `Main, rung 3`.
    pub place: Arc<str>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lower::lower;
    use crate::resolve::{LoadOptions, load_ladders};
    use crate::source::span::SourceFile;

    fn identity(ladder: &str) -> Arc<Identity> {
        let file = SourceFile { name: "ladder.toml".into(), text: ladder.into() };
        let (program, findings) = load_ladders(&[file], &LoadOptions::default());
        lower(&program.unwrap_or_else(|| panic!("{findings:?}"))).1.identity
    }

    #[test]
    fn every_element_with_a_state_has_a_name() {
        let identity = identity(
            r#"
            [tags]
            parts = { at = "CT0" }
            size = { at = "D1", initial = 12 }
            [[program]]
            name = "Main"
            [[program.rung]]
            name = "count"
            leg.up = ["rise(X0)", "fall(X1)"]
            leg.rst = ["$Off"]
            do = ["CNT parts preset=size"]
            [[program.rung]]
            when = ["rise(X0)", "rise(X0) | rise(Side.Open)"]
            do = ["PONOFF C0", "RESTART Side", "ENTASK Work every=2s"]
            [[program]]
            name = "Side"
            [[program.stage]]
            name = "Open"
            [[program.stage.rung]]
            when = ["X3"]
            do = ["TMR T1 preset=3s", "PD C9"]
            [[task]]
            name = "Work"
            [[task.rung]]
            when = ["$On"]
            do = ["OUT Y0"]
            "#,
        );
        let texts: Vec<&str> = identity.histories.iter().map(|h| h.text.as_str()).collect();
        let rise = "rise(X0)";
        let texts_wanted =
            [rise, "fall(X1)", rise, rise, "rise(Side.Open)", "PONOFF C0", "RESTART Side", "PD C9"];
        assert_eq!(texts, texts_wanted);
        let owner = |o: &Owner| format!("{} {:?} {:?}", o.structure, o.mnemonic, o.element.stage);
        let owners: Vec<String> = identity.owners.iter().map(owner).collect();
        assert_eq!(owners, ["CT0 Cnt None", "T1 Tmr Some(StageId(0))"]);
        assert_eq!(identity.intervals.len(), 1);
        assert_eq!(identity.initial.values().collect::<Vec<_>>(), [&12]);
        assert_eq!(identity.names.say(Address::Structure(Structure::Counter(0))), "parts (CT0)");
    }
}
