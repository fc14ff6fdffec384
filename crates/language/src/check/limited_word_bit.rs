//! `limited-word-bit`: an instruction writes a bit of a word whose address has limits, from `min`
//! or `max` of any tag.
//!
//! The limits bind every write of the ladder, but a bit alone cannot be limited: the nearest
//! allowed word would differ in other bits too. With a moving index, every element counts that the
//! instruction can reach.
//!
//! Passes:
//!
//! ```toml
//! [tags]
//! drive = { at = "D0" }
//! [[program]]
//! name = "Main"
//! rung = [ { when = ["X0"], do = ["OUT drive.3"] } ]
//! ```
//!
//! Fails: the same with `drive = { at = "D0", max = 100 }`.

use crate::resolve::program::Tag;
use crate::resolve::writes::WrittenOperand;
use crate::source::finding::{Code, Finding};
use crate::source::span::Located;
use rungd_engine::isa::{Address, Bit};

use super::context::Context;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let written = context.instructions().flat_map(|placed| placed.instruction.writes());
    for Located { value, span } in written {
        let limited = match value {
            WrittenOperand::Bit(bit) => limit(context, Address::Bit(bit)),
            WrittenOperand::Array(array) if array.bit.is_some() => {
                array.addresses().find_map(|bit| limit(context, bit))
            }
            WrittenOperand::Word(_) | WrittenOperand::Array(_) => None,
        };
        let Some(tag) = limited else { continue };
        let name = &tag.name;
        let message = format!("a bit is written alone, and tag `{name}` limits its word");
        let limited = context.say_limited(name);
        let help =
            format!("take `min` and `max` out of {limited}, or compute the whole word by a MATH");
        let finding = Finding::new(Code::LimitedWordBit, span, message);
        let finding = finding.label("a bit alone cannot be limited");
        findings.push(finding.related(tag.span, "limited here").help(help));
    }
}

/// The tag that limits the word of a bit.
fn limit<'a>(context: &Context<'a>, bit: Address) -> Option<&'a Tag> {
    let Address::Bit(Bit::InWord(bit)) = bit else { return None };
    context.limits(bit.word).of_tag
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn bits_of_words_with_limits_are_reported() {
        check(
            r#"
            [tags]
            drive = { at = "D0" }
            again = { at = "D0", max = 100, initial = 0 }
            list = { at = "V0", count = 4 }
            third = { at = "V3", min = 1, initial = 1 }
            free = { at = "D1" }

            [[program]]
            name = "Main"
            rung = [
              { when = ["drive.1", "again.2"], do = ["OUT drive.3", "OUT free.3"] },
              { when = ["list[2].1", "third == 2"], do = ["SET list[free].0", "RST list[2].0"] },
              { when = ["X0"], do = ["MATH list[free + 1].2 = drive", "MATH list[1].4 = 1"] },
            ]
            "#,
            expect![[r#"
                11:45 limited-word-bit
                  a bit is written alone, and tag `again` limits its word
                    take `min` and `max` out of the tag, or compute the whole word by a MATH
                12:50 limited-word-bit
                  a bit is written alone, and tag `third` limits its word
                    take `min` and `max` out of the tag, or compute the whole word by a MATH
                13:30 limited-word-bit
                  a bit is written alone, and tag `third` limits its word
                    take `min` and `max` out of the tag, or compute the whole word by a MATH
            "#]],
        );
    }
}
