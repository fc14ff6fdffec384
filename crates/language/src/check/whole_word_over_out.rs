//! `whole-word-over-out`: an instruction or a device's input row writes a whole word, and OUTs
//! drive single bits of it.
//!
//! The two writers share the other bits of the word: the whole write overwrites the driven bit,
//! until its OUT executes again. An instruction that owns a structure writes its `.Acc`.
//!
//! Passes:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["OUT D0.3"] },
//!   { when = ["X1"], do = ["MATH D0.4 = D1 > 5"] },
//! ]
//! ```
//!
//! Fails: the same with `MOVE D1 to=D0` in the second rung.

use crate::resolve::array::Array;
use crate::resolve::writes::WrittenOperand;
use crate::source::finding::{Code, Finding};
use crate::source::span::{Located, Span};
use rungd_engine::isa::{Address, Bit, NumberMap, NumberRange, NumberRanges, Space, Word};

use super::context::{Context, DrivingInstruction};

/// The driven bits of words.
#[derive(Default)]
struct DrivenWords<'c, 'a> {
    /// For each word, its first driven bit with the first driver.
    first: NumberMap<Word, (Bit, &'c DrivingInstruction<'a>)>,
    /// The words of memory blocks among them.
    numbers: NumberRanges<Space>,
    words: Vec<Word>,
}

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let mut driven = DrivenWords::default();
    for (bit, drivers) in context.drivers() {
        let (Some(in_word), Some(driver)) = (bit.of_word(), drivers.first()) else { continue };
        driven.add(in_word.word, bit, driver);
    }
    if driven.words.is_empty() {
        return;
    }
    let written = context.instructions().flat_map(|placed| placed.instruction.writes());
    for Located { value, span } in written {
        let word = match value {
            WrittenOperand::Word(word) => driven.first.contains_key(&word).then_some(word),
            WrittenOperand::Array(array) => driven.in_array(array),
            WrittenOperand::Bit(_) => None,
        };
        findings.extend(word.map(|word| driven.finding(context, word, span)));
    }
    for (structure, owners) in context.owners() {
        let word = Word::Acc(structure);
        if driven.first.contains_key(&word) {
            let owners = owners.iter().map(|owner| owner.instruction.span);
            findings.extend(owners.map(|span| driven.finding(context, word, span)));
        }
    }
    let Some(outside) = context.outside else { return };
    for word in driven.words.iter().filter(|word| outside.moves(Address::Word(**word))) {
        let (_, driver) = driven.first[word];
        let said = context.say(Address::Word(*word));
        let message = format!("a device writes all of {said}, and this drives a bit of it");
        let finding = Finding::new(Code::WholeWordOverOut, driver.span, message);
        findings.push(finding.label("overwritten by the device").help(HELP));
    }
}

const HELP: &str = "let one of the two write to a word of its own";

impl<'c, 'a> DrivenWords<'c, 'a> {
    fn add(&mut self, word: Word, bit: Bit, driver: &'c DrivingInstruction<'a>) {
        if self.first.contains_key(&word) {
            return;
        }
        self.first.insert(word, (bit, driver));
        if let Some((space, number)) = Space::of(Address::Word(word)) {
            self.numbers.add(NumberRange::one(space, number), self.words.len());
        }
        self.words.push(word);
    }

    /// The first of these words in an array of words.
    fn in_array(&self, array: Array) -> Option<Word> {
        let at = self.numbers.first_in(array.numbers()).filter(|_| !array.is_bits())?;
        self.words.get(at).copied()
    }

    fn finding(&self, context: &Context, word: Word, span: Span) -> Finding {
        let (bit, driver) = self.first[&word];
        let message = format!(
            "all of {} is written, and `{}` drives a bit of it, {}",
            context.say(Address::Word(word)),
            driver.placed.name(),
            context.say_bit(bit),
        );
        Finding::new(Code::WholeWordOverOut, span, message)
            .label("overwrites the driven bit")
            .related(driver.span, "driven here")
            .help(HELP)
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::{check, check_main};

    #[test]
    fn whole_writes_of_words_with_driven_bits_are_reported() {
        check(
            r#"
            [tags]
            list = { at = "D10", count = 3 }
            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["OUT D0.3", "PD list[1].0", "OUT CT0.Acc.2"] },
              { when = ["X1"], do = ["MOVE 5 to=D0", "FILL 0 to=list", "MOVE 1 to=list[D1]"] },
              { when = ["X2"], do = ["COPY list[0..1] to=D9..D10", "MATH D0 = D1"] },
              { when = ["X3"], do = ["MOVE 1 to=D1"] },
              { leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT CT0 preset=3"] },
            ]
            "#,
            expect![[r#"
                7:35 whole-word-over-out
                  all of `D0` is written, and `OUT` drives a bit of it, `D0.3`
                    let one of the two write to a word of its own
                7:51 whole-word-over-out
                  all of `list[1]` (D11) is written, and `PD` drives a bit of it,
                  `list[1].0`
                    let one of the two write to a word of its own
                7:69 whole-word-over-out
                  all of `list[1]` (D11) is written, and `PD` drives a bit of it,
                  `list[1].0`
                    let one of the two write to a word of its own
                8:60 whole-word-over-out
                  all of `D0` is written, and `OUT` drives a bit of it, `D0.3`
                    let one of the two write to a word of its own
                10:45 whole-word-over-out
                  all of `CT0.Acc` is written, and `OUT` drives a bit of it, `CT0.Acc.2`
                    let one of the two write to a word of its own
            "#]],
        );
    }

    #[test]
    fn writes_of_other_bits_are_not_reported() {
        check_main(
            r#"
            { when = ["X0"], do = ["OUT D0.3", "SET D0.4", "RST D0.4", "MATH D0.5 = D1"] },
            { when = ["X1"], do = ["MOVE 5 to=D1", "SET D1.3", "RST D1.3"] },
            "#,
            expect![[r#""#]],
        );
    }
}
