//! `limited-pack`: PACK writes a word whose address has limits, from `min` or `max` of any tag, and
//! some patterns of the bits lie outside of them.
//!
//! It is legal: the word becomes the nearest allowed number. But that number has other bits. With a
//! moving index, every element counts that the instruction can reach.
//!
//! Passes:
//!
//! ```toml
//! [tags]
//! drive = { at = "D0", min = 0, max = 255 }
//! [[program]]
//! name = "Main"
//! rung = [ { when = ["X0"], do = ["PACK C0..C7 to=drive"] } ]
//! ```
//!
//! Fails: the same with `max = 100`.

use crate::resolve::array::Array;
use crate::resolve::writes::WrittenOperand;
use crate::source::finding::{Code, Finding};
use crate::source::span::Located;
use rungd_engine::isa::{Address, Mnemonic, Word};

use super::context::{Context, ProgramInstruction};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    findings.extend(context.instructions().filter_map(|placed| judge(context, placed)));
}

fn judge(context: &Context, placed: &ProgramInstruction) -> Option<Finding> {
    let instruction = placed.instruction;
    if instruction.mnemonic != Mnemonic::Pack {
        return None;
    }
    let count = instruction.operands.required::<Array>("bits").count;
    let Located { value, span } = instruction.writes().next()?;
    let limiting = |word: Word| {
        let (low, high) = patterns(word, count);
        let limits = context.limits(word);
        limits.of_tag.filter(|_| low < limits.min || high > limits.max)
    };
    let tag = match value {
        WrittenOperand::Word(word) => limiting(word),
        WrittenOperand::Array(array) => array.addresses().find_map(|address| match address {
            Address::Word(word) => limiting(word),
            Address::Bit(_) | Address::Structure(_) => None,
        }),
        WrittenOperand::Bit(_) => None,
    }?;
    let message = format!("`PACK` writes any pattern of bits, and tag `{}` limits it", tag.name);
    let limited = context.say_limited(&tag.name);
    let help = format!(
        "take `min` and `max` out of {limited}, or PACK to a word of its own and MOVE that"
    );
    let finding = Finding::new(Code::LimitedPack, span, message);
    let finding = finding.label("a limited number has other bits");
    Some(finding.related(tag.span, "limited here").help(help))
}

/// The least and the greatest number that so many bits of a word make.
fn patterns(word: Word, count: u32) -> (i32, i32) {
    let (low, high) = word.range();
    match count < u32::from(word.bit_count()) {
        true => (0, i32::MAX >> (31 - count)),
        false => (low, high),
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn packs_of_patterns_beyond_the_limits_are_reported() {
        check(
            r#"
            [tags]
            byte = { at = "D0", min = 0, max = 255, initial = 0 }
            list = { at = "V0", count = 4 }
            third = { at = "V3", min = 1, initial = 1 }
            low = { at = "D9", min = -2147483648, max = 2147483646, initial = 0 }

            [[program]]
            name = "Main"
            rung = [
              { when = ["byte == third"], do = ["PACK C0..C7 to=byte", "PACK C0..C8 to=byte"] },
              { when = ["X0"], do = ["PACK C0..C7 to=list[D1]", "PACK C0..C15 to=list[2]"] },
              { when = ["X0"], do = ["PACK C0..C30 to=low", "PACK C0..C29 to=low"] },
              { when = ["X0"], do = ["PACK C0..C31 to=D0", "UNPACK byte to=C40..C49"] },
            ]
            "#,
            expect![[r#"
                10:74 limited-pack
                  `PACK` writes any pattern of bits, and tag `byte` limits it
                    take `min` and `max` out of the tag, or PACK to a word of its own and
                    MOVE that
                11:40 limited-pack
                  `PACK` writes any pattern of bits, and tag `third` limits it
                    take `min` and `max` out of the tag, or PACK to a word of its own and
                    MOVE that
                12:41 limited-pack
                  `PACK` writes any pattern of bits, and tag `low` limits it
                    take `min` and `max` out of the tag, or PACK to a word of its own and
                    MOVE that
                13:41 limited-pack
                  `PACK` writes any pattern of bits, and tag `byte` limits it
                    take `min` and `max` out of the tag, or PACK to a word of its own and
                    MOVE that
            "#]],
        );
    }
}
