//! The counters `CTU` and `CTD` of IEC 61131-3, which are `CNT` and `CNTDN` here. Their names
//! belong to Sensaphone's counters in rungd, so without this module the findings would lead to
//! those.
//!
//! Called by `rung`, once per rung. Only a rung whose single instruction cannot be meant as
//! Sensaphone's is taken: it names a counter or a timer, or has legs, or IEC's `PV`, or names
//! nothing that is declared, in a ladder without a tag of a Sensaphone counter. It gets one
//! finding, whose help has the whole rung.

use super::Resolver;
use super::scope::NamedThing;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, advise};
use crate::source::instruction::{OperandText, WrittenInstruction};
use crate::source::ladder;
pub use rungd_engine::isa::{Address, Mnemonic, Structure};

/// The keys of a reset or load leg.
const RESETS: [&str; 8] = ["rst", "r", "reset", "res", "ld", "load", "clr", "clear"];

impl Resolver<'_> {
    /// Whether the rung is IEC's counter. Then its finding has been added, and its instruction is
    /// not to be resolved.
    pub(super) fn is_iec_counter(&mut self, rung: &ladder::WrittenRung) -> bool {
        let ([instruction], true) = (rung.body.as_slice(), rung.branches.is_empty()) else {
            return false;
        };
        let meant = match Mnemonic::from_name(&instruction.mnemonic.value) {
            Some(Mnemonic::Ctu) => Mnemonic::Cnt,
            Some(Mnemonic::Ctd) => Mnemonic::Cntdn,
            Some(_) | None => return false,
        };
        let Some(counter) = instruction.operands.iter().find(|operand| operand.key.is_none())
        else {
            return false;
        };
        let named = self.scope.look_up(&counter.value.to_string()).map(|found| found.thing);
        let has_other_form = !rung.legs.is_empty() || key(instruction, "PV").is_some();
        let is_meant = match named {
            Ok(NamedThing::Address(Address::Structure(Structure::Sensaphone(_)))) => false,
            Ok(NamedThing::Address(Address::Structure(_))) => true,
            Ok(_) => has_other_form,
            Err(_) => has_other_form || !self.scope.has_sensaphone(),
        };
        if !is_meant {
            return false;
        }
        let finding = self.iec_counter(rung, instruction, meant, counter);
        self.find(finding);
        self.structure(&counter.value, Structure::Counter(0), meant.spec());
        true
    }

    fn iec_counter(
        &self,
        rung: &ladder::WrittenRung,
        instruction: &WrittenInstruction,
        meant: Mnemonic,
        counter: &OperandText,
    ) -> Finding {
        let (own, spec) = (instruction.mnemonic.value.to_ascii_uppercase(), meant.spec());
        let is_reset = |leg: &&ladder::WrittenLeg| {
            RESETS.contains(&leg.key.text.to_ascii_lowercase().as_str())
        };
        let reset = rung.legs.iter().find(is_reset);
        let count = rung.legs.iter().find(|leg| !is_reset(leg)).or(rung.when.as_ref());
        let text =
            |leg: Option<&ladder::WrittenLeg>, none| leg.map_or(none, |leg| self.text(leg.span));
        let positional = instruction.operands.iter().filter(|operand| operand.key.is_none()).nth(1);
        let preset = ["preset", "PV"].iter().find_map(|name| key(instruction, name)).or(positional);
        let preset = preset.map_or("10".to_owned(), |preset| preset.value.to_string());
        let instead = if rung.legs.is_empty() { "instead of `when`" } else { "and no other leg" };
        let lines = format!(
            "leg.{:<3} = {}\nleg.rst = {}\ndo = [\"{} {} preset={preset}\"]",
            spec.legs[0].key(),
            text(count, "[\"$On\"]"),
            text(reset, "[\"$Off\"]"),
            spec.name,
            counter.value,
        );
        let message =
            format!("`{own}` is Sensaphone's counter: the `{own}` of IEC is `{}`", spec.name);
        Finding::new(Code::OperandType, instruction.span, message)
            .label(format!("a counter is counted by `{}`", spec.name))
            .help(advise(
                &format!("write its legs {instead}:\n{{}}"),
                [FixEdit::Lines { lines, instead: rung.legs.is_empty().then_some("when") }],
            ))
    }
}

/// The operand with a key, in any case.
fn key<'i>(instruction: &'i WrittenInstruction, name: &str) -> Option<&'i OperandText> {
    let has_name = |operand: &&OperandText| {
        operand.key.as_ref().is_some_and(|key| key.value.eq_ignore_ascii_case(name))
    };
    instruction.operands.iter().find(has_name)
}
