//! A rung of Logix as steps: which instruction means what.
//!
//! [`Translation`] walks the rung from left to right with the condition so far. A contact adds a
//! term to it, an instruction becomes steps under it. What rungd cannot say is an error with its
//! reason: the whole rung then gets a stub.

use std::collections::{BTreeSet, HashMap, HashSet};

use super::call_book::CallBook;
use super::locate::{Index, LocatedOperand, Operand};
use super::memory::LogixMemory;
use super::prescan::Prescan;
use super::rll::RllInstruction;
use super::types::Kind;
use crate::condition::{RungCondition, TouchedPlace};
use crate::model::{Action, ActionForm, ProjectBlock, ProjectTag, RungStep, Term};

/// What the rungs of a routine share.
pub(crate) struct Translation<'m> {
    pub(crate) memory: &'m mut LogixMemory,
    pub(crate) scope: usize,
    pub(crate) calls: &'m CallBook,
    pub(crate) prescan: &'m mut Prescan,
    /// The beginning of the names of this rung's bits: `Main_r3`.
    pub(crate) prefix: String,
    /// The bits that an OUT of this block drives already.
    pub(crate) driven: HashSet<String>,
    /// The steps of this rung.
    pub(crate) steps: Vec<RungStep>,
    /// What this rung does other than the original.
    pub(crate) differences: BTreeSet<String>,
    /// What the rungs of this block may do.
    pub(crate) block: BlockNature,
    /// Subroutines that calls of Add-On Instructions need.
    pub(crate) own_blocks: Vec<ProjectBlock>,
    /// Bits that a jump sets, by label.
    pub(crate) labels: HashMap<String, String>,
}

/// The condition of a place in a rung.
pub(crate) type Terms = Vec<Term>;

impl Translation<'_> {
    /// A term for the value that a bit has now.
    pub(crate) fn term(&self, condition: RungCondition) -> Term {
        Term { condition, at: self.steps.len() }
    }

    /// Adds a step with an instruction.
    pub(crate) fn push(&mut self, when: Terms, text: String, writes: Vec<TouchedPlace>) {
        self.steps.push(RungStep { when, action: Action { form: ActionForm::Do(text), writes } });
    }

    /// A new tag for this rung.
    pub(crate) fn own_tag(&mut self, what: &str, kind: &str) -> String {
        let name = self.memory.names.fresh(&format!("{}_{what}", self.prefix));
        let home = self.memory.scopes[self.scope].home;
        self.memory.homes[home].push(ProjectTag {
            name: name.clone(),
            kind: kind.to_owned(),
            doc: "A value within a rung, made by the import".to_owned(),
            is_own: true,
            ..ProjectTag::default()
        });
        name
    }

    /// A tag that is read.
    pub(crate) fn read(&mut self, text: &str, guess: &Kind) -> Result<LocatedOperand, String> {
        let located = self.memory.locate(self.scope, text, guess)?;
        self.memory.variables[located.variable].is_read = true;
        Ok(located)
    }

    /// A constant, or a tag that is read.
    pub(crate) fn value(&mut self, text: &str) -> Result<Operand, String> {
        let operand = self.memory.operand(self.scope, text, &Kind::Dint)?;
        if let Operand::ProjectTag(located) = &operand {
            self.memory.variables[located.variable].is_read = true;
        }
        Ok(operand)
    }

    /// A tag that is written.
    pub(crate) fn written(&mut self, text: &str, guess: &Kind) -> Result<LocatedOperand, String> {
        let located = self.memory.locate(self.scope, text, guess)?;
        self.memory.variables[located.variable].is_written = true;
        Ok(located)
    }

    /// A bit that is written.
    pub(crate) fn bit_to_write(&mut self, text: &str) -> Result<LocatedOperand, String> {
        let located = self.written(text, &Kind::Bool)?;
        match located.kind == Kind::Bool && located.dimensions.is_empty() {
            true => Ok(located),
            false => Err(format!("`{text}` is no bit")),
        }
    }

    /// Whether another use of an Add-On Instruction can have the same bit.
    fn is_shared(&self, bit: &LocatedOperand) -> bool {
        let name = &self.memory.variables[bit.variable].original;
        !self.calls.shared.is_empty() && self.calls.shared.contains(&name.to_lowercase())
    }

    /// Writes a bit under a condition.
    ///
    /// # Errors
    /// rungd cannot write it.
    pub(crate) fn write_bit(
        &mut self,
        bit: &LocatedOperand,
        when: Terms,
        write: BitWrite,
    ) -> Result<(), String> {
        let places = vec![bit.word.as_ref().map_or_else(|| bit.place(), |word| word.word.place())];
        let is_fixed = !matches!(bit.index, Index::Moving(_))
            && bit.word.as_ref().is_none_or(|word| word.is_fixed);
        let set = |is_on: bool| set_text(bit, is_on, is_fixed);
        match write {
            BitWrite::Follow
                if is_fixed && !self.is_shared(bit) && self.driven.insert(bit.text.clone()) =>
            {
                self.push(when, format!("OUT {}", bit.text), places.clone());
            }
            BitWrite::Follow => {
                let on = self.whole(when);
                let off = self.term(on.clone().opposite());
                let on = self.term(on);
                self.push(vec![on], set(true), places.clone());
                self.push(vec![off], set(false), places.clone());
            }
            BitWrite::Set => self.push(when, set(true), places.clone()),
            BitWrite::Reset => self.push(when, set(false), places.clone()),
        }
        let narrow = bit.word.as_ref().filter(|word| {
            let bits = word.word.kind.bits().unwrap_or(32);
            let is_sign = word.bit == (bits - 1).to_string() || !word.is_fixed;
            bits < 32 && is_sign && matches!(word.word.kind, Kind::Sint | Kind::Int)
        });
        if let Some(word) = narrow {
            // A word of 16 or 8 bits lies in one of 32: the bits above its sign are the sign.
            let shift = 32 - word.word.kind.bits().unwrap_or(32);
            let text = &word.word.text;
            self.push(Vec::new(), format!("MATH {text} = {text} << {shift} >> {shift}"), places);
        }
        Ok(())
    }

    /// The terms as one condition that can be evaluated now. If something changed one of them since
    /// it was evaluated, the condition is in a bit.
    pub(crate) fn whole(&mut self, when: Terms) -> RungCondition {
        let now = self.steps.len();
        let is_changed = |term: &Term| {
            let between = self.steps.get(term.at..now).unwrap_or_default();
            between.iter().any(|step| term.condition.is_changed_by(&step.action.writes))
        };
        if !when.iter().any(is_changed) {
            return RungCondition::all(when.into_iter().map(|term| term.condition));
        }
        let bit = self.own_tag("power", "bit");
        self.push(when, format!("OUT {bit}"), vec![TouchedPlace::of(&bit)]);
        RungCondition::bit(bit)
    }
}

/// Where a rung stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BlockNature {
    /// In a Program or Task, which RETURN cannot end.
    Main,
    /// In a subroutine that is the whole routine.
    Routine,
    /// In a part of a routine, which a jump may leave out.
    JumpedSegment,
    /// In a template, the logic of an Add-On Instruction.
    ProjectTemplate,
}

/// How a bit is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BitWrite {
    /// ON or OFF, as the condition.
    Follow,
    /// ON while the condition is.
    Set,
    /// OFF while the condition is ON.
    Reset,
}

/// The instruction that turns a bit ON or OFF.
fn set_text(bit: &LocatedOperand, is_on: bool, is_fixed: bool) -> String {
    if is_fixed {
        let verb = if is_on { "SET" } else { "RST" };
        return format!("{verb} {}", bit.text);
    }
    match bit.word.as_ref().filter(|word| !word.is_fixed) {
        Some(word) => {
            let (text, number) = (&word.word.text, &word.bit);
            match is_on {
                true => format!("MATH {text} = {text} | (1 << ({number}))"),
                false => format!("MATH {text} = {text} & ~(1 << ({number}))"),
            }
        }
        None => format!("MATH {} = {}", bit.text, u8::from(is_on)),
    }
}

/// A contact on a bit; its word bit has a fixed number.
pub(crate) fn contact_on(bit: &LocatedOperand) -> RungCondition {
    RungCondition::Bit { text: bit.text.clone(), reads: bit.reads.clone() }
}

/// An operand of an instruction.
///
/// # Errors
/// The instruction has fewer operands.
pub(crate) fn operand(instruction: &RllInstruction, at: usize) -> Result<&str, String> {
    let text = instruction.operands.get(at).map(String::as_str).filter(|text| !text.is_empty());
    text.ok_or_else(|| format!("{} without its operand {}", instruction.name, at + 1))
}
