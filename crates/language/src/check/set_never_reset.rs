//! `set-never-reset`: a bit is SET, and no instruction turns it OFF.
//!
//! RST, PONOFF, MATH and drivers (see `duplicate_out`) turn a bit OFF. MC bits are not reported,
//! because a Modbus client may write them.
//!
//! Passes:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["SET C0"] },
//!   { when = ["X1"], do = ["RST C0"] },
//! ]
//! ```
//!
//! Fails: the first rung alone.

use std::cell::LazyCell;
use std::collections::BTreeSet;

use crate::resolve::writes::WrittenOperand;
use crate::source::finding::{Code, Finding};
use crate::source::span::Located;
use rungd_engine::isa::{Address, Bit, BitSpace, NumberRanges, OperandRole};

use super::context::{Context, ProgramInstruction};
use super::usage::whole_writes;
use super::writers::is_writable;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let mut off: BTreeSet<Bit> = context.drivers().map(|(bit, _)| bit).collect();
    let is_set = |placed: &&ProgramInstruction| {
        placed.instruction.acting_role() == Some(OperandRole::TurnsOn)
    };
    let others = context.instructions().filter(|placed| !is_set(placed));
    let mut arrays = NumberRanges::default();
    for written in others.flat_map(|placed| placed.instruction.writes()) {
        let array = match written.value {
            WrittenOperand::Bit(bit) => {
                off.insert(bit);
                continue;
            }
            WrittenOperand::Array(array) => array,
            WrittenOperand::Word(_) => continue,
        };
        let new = arrays.add(array.numbers(), 0).into_iter().flat_map(|(first, last)| first..=last);
        off.extend(new.filter_map(|n| match array.space.address(n) {
            Address::Bit(bit) => Some(bit),
            Address::Word(_) | Address::Structure(_) => None,
        }));
    }
    // Needed for bits of words alone.
    let whole = LazyCell::new(|| whole_writes(context));
    for placed in context.instructions() {
        let Some(Located::<Bit> { value: bit, span }) =
            placed.instruction.operand_with(OperandRole::TurnsOn)
        else {
            continue;
        };
        // Anything may turn OFF the bit of a word that is written as a whole.
        let word = bit.of_word().map(|bit| Address::Word(bit.word));
        if word.is_some_and(|word| whole.contains(&word) || is_writable(context, word)) {
            continue;
        }
        // One finding for each bit is enough, at the first SET.
        if matches!(bit, Bit::Space(BitSpace::Mc, _)) || !off.insert(bit) {
            continue;
        }
        let message = format!("{} is SET, and nothing ever turns it OFF", context.say_bit(bit));
        let name = context.name(Address::Bit(bit));
        findings.push(Finding::new(Code::SetNeverReset, span, message).label("stays ON").help(
            format!(
                "`RST {name}` in a rung with its condition, or `OUT {name}` if the bit is to \
                 follow this rung"
            ),
        ));
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check_main;

    #[test]
    fn bits_that_no_instruction_turns_off_are_reported() {
        check_main(
            r#"
            { when = ["X0"], do = ["SET C0", "SET C1", "SET C2", "SET C3"] },
            { when = ["X0"], do = ["SET C4", "SET MC1", "SET Y0"] },
            { when = ["X1"], do = ["RST C0", "PONOFF C1", "OUT C2"] },
            { when = ["X2"], do = ["ONDTMR T0 preset=1s output=C3", "SET C4"] },
            "#,
            expect![[r#"
                5:29 set-never-reset
                  `C4` is SET, and nothing ever turns it OFF
                    `RST C4` in a rung with its condition, or `OUT C4` if the bit is to
                    follow this rung
                5:50 set-never-reset
                  `Y0` is SET, and nothing ever turns it OFF
                    `RST Y0` in a rung with its condition, or `OUT Y0` if the bit is to
                    follow this rung
            "#]],
        );
    }
}
