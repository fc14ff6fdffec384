//! The walk along a rung, from left to right, with the condition so far.
//!
//! Called by `routine` for each rung. What an instruction means is in `contacts`, `coils`,
//! `numbers`, `files`, `pid`, `system_values` and `calls`.

use super::contacts::is_contact;
use super::rll::{RllInstruction, RllNode};
use super::translate::{BitWrite, Terms, Translation, contact_on, operand};
use crate::condition::{RungCondition, TouchedPlace};
use crate::model::Term;

impl Translation<'_> {
    /// The steps of a series, and the condition behind it. `is_used`: something behind it acts by
    /// it.
    ///
    /// # Errors
    /// The reason why the rung cannot be translated.
    pub(crate) fn series(
        &mut self,
        nodes: &[RllNode],
        mut when: Terms,
        is_used: bool,
    ) -> Result<Terms, String> {
        for (at, node) in nodes.iter().enumerate() {
            let is_used = is_used || nodes[at + 1..].iter().any(acts);
            when = match node {
                RllNode::RllInstruction(contact) if !is_used && !acts(node) => {
                    self.idle_contact(contact, when)
                }
                RllNode::RllInstruction(instruction) => self.instruction(instruction, when)?,
                RllNode::Branches(branches) => self.branches(branches, when, is_used)?,
            };
        }
        Ok(when)
    }

    fn branches(
        &mut self,
        branches: &[Vec<RllNode>],
        when: Terms,
        is_used: bool,
    ) -> Result<Terms, String> {
        let begun = self.steps.len();
        let parts = self.each_branch(branches, &when, BranchUse { is_used, keeps: false })?;
        let now = self.steps.len();
        let is_changed = |term: &Term| {
            let between = &self.steps[term.at.min(now)..now];
            between.iter().any(|step| term.condition.is_changed_by(&step.action.writes))
        };
        let parts = match is_used && parts.iter().flatten().any(is_changed) {
            false => parts,
            true => {
                self.steps.truncate(begun);
                self.each_branch(branches, &when, BranchUse { is_used, keeps: true })?
            }
        };
        let conditions = parts
            .into_iter()
            .map(|terms| RungCondition::all(terms.into_iter().map(|term| term.condition)));
        let either = RungCondition::any(conditions);
        let mut when = when;
        if either != RungCondition::Constant(true) {
            when.push(Term { condition: either, at: self.steps.len() });
        }
        Ok(when)
    }

    /// The terms that each branch adds.
    fn each_branch(
        &mut self,
        branches: &[Vec<RllNode>],
        when: &Terms,
        branch_use: BranchUse,
    ) -> Result<Vec<Terms>, String> {
        let mut parts = Vec::new();
        for branch in branches {
            let terms = self.series(branch, when.clone(), branch_use.is_used)?;
            let mut own = terms[when.len()..].to_vec();
            if branch_use.keeps && !own.is_empty() {
                let bit = self.own_tag("branch", "bit");
                let place = TouchedPlace::of(&bit);
                self.push(own, format!("OUT {bit}"), vec![place]);
                let at = self.steps.len();
                own = vec![Term { condition: RungCondition::bit(bit), at }];
            }
            parts.push(own);
        }
        Ok(parts)
    }

    /// A contact or NOP by which nothing acts: whatever it names, a text too, changes nothing.
    fn idle_contact(&mut self, contact: &RllInstruction, when: Terms) -> Terms {
        let begun = self.steps.len();
        let behind = self.instruction(contact, when.clone());
        self.steps.truncate(begun);
        behind.unwrap_or(when)
    }

    /// The condition behind an instruction.
    fn instruction(&mut self, instruction: &RllInstruction, when: Terms) -> Result<Terms, String> {
        if self.leaves_out_text(instruction) {
            return Ok(when);
        }
        if let Some(condition) = self.contact(instruction, &when)? {
            let mut when = when;
            if condition != RungCondition::Constant(true) {
                when.push(Term { condition, at: self.steps.len() });
            }
            return Ok(when);
        }
        match instruction.name.as_str() {
            "ONS" => return self.one_shot(instruction, when),
            "NOP" => {}
            "OTE" | "OTL" | "OTU" | "OSR" | "OSF" => self.coil(instruction, &when)?,
            "TON" | "TOF" | "RTO" | "CTU" | "CTD" | "RES" => self.structure(instruction, &when)?,
            "PID" => self.pid(instruction, &when)?,
            "SIZE" => self.size(instruction, &when)?,
            "COP" | "CPS" | "FLL" | "FFL" | "FFU" | "BSL" | "BSR" => {
                self.file(instruction, &when)?;
            }
            "JSR" | "SBR" | "RET" | "TND" | "JMP" | "LBL" => self.call(instruction, &when)?,
            "GSV" | "SSV" | "EVENT" => self.system_value(instruction, &when)?,
            "MCR" => return Err("MCR beside other instructions".to_owned()),
            name if self.number(name, instruction, &when)? => {}
            name => match self.calls.is_own_instruction(name) {
                true => self.own_instruction(instruction, &when)?,
                false => return Err(format!("the instruction {name}")),
            },
        }
        Ok(when)
    }

    /// ONS: behind it there is power at the scan in which power comes.
    fn one_shot(&mut self, instruction: &RllInstruction, when: Terms) -> Result<Terms, String> {
        let storage = self.bit_to_write(operand(instruction, 0)?)?;
        self.prescan.set(self.scope, &storage);
        // The storage bit follows the power before it, also where that is OFF.
        let at = self.steps.len();
        let mut behind = when.clone();
        behind.push(Term { condition: contact_on(&storage).opposite(), at });
        self.write_bit(&storage, when, BitWrite::Follow)?;
        Ok(behind)
    }
}

/// What becomes of the conditions of branches.
#[derive(Clone, Copy)]
struct BranchUse {
    /// Whether something behind the branches acts by them.
    is_used: bool,
    /// Whether each branch puts its condition into a bit at its end: a later one changes it.
    keeps: bool,
}

/// Whether a part of a rung does something, other than contacts and NOP.
fn acts(node: &RllNode) -> bool {
    match node {
        RllNode::RllInstruction(one) => !is_contact(&one.name) && one.name != "NOP",
        RllNode::Branches(branches) => branches.iter().flatten().any(acts),
    }
}
