//! `retained-but-reset`: the controller file retains a structure, but its owner resets it at every
//! stop; or it names a bit, or retains a word with a bit, that an instruction turns OFF at every
//! stop.
//!
//! The termination passes of an orderly stop run before memory is saved, so a CNT is saved as 0,
//! and what OUT, PD, ND and the output of a timer drive is saved OFF. After a crash these passes
//! run before the first scan. UDCG, TMRAG and the Sensaphone counters have no termination logic.
//! A bit that only a range catches is no mistake: ranges have such bits between others. A bit of a
//! word has no range of its own, so one of a retained word is a mistake, however the word is
//! retained; but a structure of a record is retained for the record's other fields. The finding's
//! place is the owner or the first driver, because `allow` can silence it there; the
//! range or the tag's pattern is a related place.
//!
//! Passes: `ranges = ["CT0", "C0..C9"]`, `tags = ["auto"]` and
//!
//! ```toml
//! do = ["UDCG CT0 up-preset=12", "OUT C3", "SET auto"]
//! ```
//!
//! Fails: the same and
//!
//! ```toml
//! do = ["CNT CT0 preset=12", "OUT auto"]
//! ```

use std::cell::OnceCell;
use std::collections::BTreeSet;

use crate::resolve::range::Range;
use crate::source::finding::{Code, Finding};
use rungd_engine::isa::instruction::Termination;
use rungd_engine::isa::{
    Address, Bit, NumberRange, NumberRanges, Space, Structure, Word, WordSpace,
};

use super::context::{Context, DrivingInstruction, ProgramInstruction};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let copy = OnceCell::new();
    for (structure, owners) in context.owners() {
        let range = context.retained_with(structure.space(), structure.number());
        // A whole record is retained for its other fields.
        let Some(range) = range.filter(|range| !range.of_record) else { continue };
        let resets =
            |p: &&ProgramInstruction| p.mnemonic().spec().termination == Termination::Reset;
        if let Some(owner) = owners.iter().find(resets) {
            let copy = *copy.get_or_init(|| copy_word(context));
            findings.push(finding(context, ResettingOwner { structure, owner }, range, copy));
        }
    }
    check_bits(context, findings);
}

/// The bits that `[retain] tags` names and an instruction drives, and the driven bits of retained
/// words.
fn check_bits(context: &Context, findings: &mut Vec<Finding>) {
    let mut named = NumberRanges::default();
    for (at, range) in context.retained.iter().enumerate().filter(|(_, range)| range.of_tag) {
        named.add(range.numbers(), at);
    }
    for (bit, drivers) in context.drivers() {
        let place = Space::with_members(Address::Bit(bit).without_bit());
        let Some((space, number)) = place else { continue };
        let range = match bit.of_word() {
            Some(_) => context.retained_with(space, number).filter(|range| !range.of_record),
            None => named
                .first_in(NumberRange::one(space, number))
                .and_then(|at| context.retained.get(at)),
        };
        if let (Some(range), Some(driver)) = (range, drivers.first()) {
            findings.push(driven(context, bit, driver, range));
        }
    }
}

/// A structure, and an owner that resets it.
#[derive(Clone, Copy)]
struct ResettingOwner<'a> {
    structure: Structure,
    owner: &'a ProgramInstruction<'a>,
}

/// A word for a copy of a count, and a text about retaining the word too.
#[derive(Clone, Copy)]
struct CopyWord {
    word: Word,
    and_retain: &'static str,
}

fn driven(context: &Context, bit: Bit, driver: &DrivingInstruction, range: &Range) -> Finding {
    let by = driver.placed.name();
    let said = context.say_bit(bit);
    let (retained, otherwise) = match bit.of_word() {
        Some(_) => ("is a bit of a retained word", "let a word that is not retained have it"),
        None => ("is retained", "take it out of `[retain] tags`"),
    };
    let message = format!(
        "{said} {retained}, but a stop turns OFF every bit that `{by}` drives: it is OFF after \
         every start"
    );
    let name = context.name(Address::Bit(bit));
    Finding::new(Code::RetainedButReset, driver.span, message)
        .label("OFF at every stop")
        .related(range.span, "retained here")
        .help(format!(
            "to keep it, turn it ON by `SET {name}` and OFF by `RST {name}`; or {otherwise}"
        ))
}

fn finding(
    context: &Context,
    ResettingOwner { structure, owner }: ResettingOwner<'_>,
    range: &Range,
    CopyWord { word, and_retain }: CopyWord,
) -> Finding {
    let said = context.say_structure(structure);
    let message = format!(
        "{} {said} is retained, but `{}` resets it at every stop, before it is kept",
        structure.kind_name(),
        owner.name()
    );
    let name = context.name(Address::Structure(structure));
    let help = match structure {
        Structure::Timer(_) => format!("TMRAG keeps its time; `RSTT {name}` resets it"),
        Structure::Counter(_) | Structure::Sensaphone(_) => {
            format!(
                "UDCG keeps its count, and `RSTCT {name}` resets it; or keep a copy{and_retain}:\n\
                 `MOVE {name}.Acc to={word}` in every scan, and in task FirstScan `MOVE {word} \
                 to={name}.Acc`"
            )
        }
    };
    Finding::new(Code::RetainedButReset, owner.instruction.span, message)
        .label("reset at every stop")
        .related(range.span, "retained here")
        .help(help)
}

/// A retained D that the ladder does not name; else `D0`, with a text about retaining it too.
fn copy_word(context: &Context) -> CopyWord {
    let named: BTreeSet<Address> = context.program.operands.iter().map(|o| o.address).collect();
    let data = context.retained.iter().filter(|range| range.space == Space::Word(WordSpace::D));
    let mut seen = NumberRanges::default();
    let words = data.flat_map(|range| seen.add(range.numbers(), 0));
    let words = words.flat_map(|(first, last)| first..=last);
    let is_placed = |word: &Word| context.program.names.places.at(Address::Word(*word)).is_some();
    match words
        .map(|n| Word::Space(WordSpace::D, n))
        .find(|word| !named.contains(&Address::Word(*word)) && !is_placed(word))
    {
        Some(word) => CopyWord { word, and_retain: "" },
        None => {
            let word = Word::Space(WordSpace::D, 0);
            CopyWord { word, and_retain: ", in a word that you retain" }
        }
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::{check_retained, check_retained_tags};

    #[test]
    fn retained_structures_that_a_termination_pass_resets_are_reported() {
        check_retained(
            &["CT0..CT2", "T0..T1", "N0", "D10..D20"],
            r#"
            { leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT CT0 preset=12"] },
            { leg.up = ["X0"], leg.dn = ["X1"], do = ["UDCG CT1 up-preset=12"] },
            { leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT CT3 preset=12"] },
            { when = ["X0"], do = ["TMR T0 preset=3s", "TMRAG T1 preset=3s"] },
            { when = ["X0"], do = ["CTU N0 preset=3", "MOVE 0 to=D10"] },
            "#,
            expect![[r#"
                4:45 retained-but-reset
                  counter `CT0` is retained, but `CNT` resets it at every stop, before it
                  is kept
                    UDCG keeps its count, and `RSTCT CT0` resets it; or keep a copy:
                    `MOVE CT0.Acc to=D11` in every scan, and in task FirstScan `MOVE D11
                    to=CT0.Acc`
                7:25 retained-but-reset
                  timer `T0` is retained, but `TMR` resets it at every stop, before it is
                  kept
                    TMRAG keeps its time; `RSTT T0` resets it
            "#]],
        );
    }

    const DRIVEN: &str = r#"
        { when = ["X0"], do = ["OUT C0", "SET C4", "MATH C5 = !X4"] },
        { when = ["X1"], do = ["PD C1", "ND MC2", "OUT C6"] },
        { when = ["X2"], do = ["OFFDTMR T0 preset=3s output=C3", "RST C4"] },
    "#;

    #[test]
    fn retained_tags_that_a_stop_turns_off_are_reported() {
        check_retained_tags(
            &["C0..C5", "MC2"],
            DRIVEN,
            expect![[r#"
                4:29 retained-but-reset
                  `C0` is retained, but a stop turns OFF every bit that `OUT` drives: it
                  is OFF after every start
                    to keep it, turn it ON by `SET C0` and OFF by `RST C0`; or take it out
                    of `[retain] tags`
                5:28 retained-but-reset
                  `C1` is retained, but a stop turns OFF every bit that `PD` drives: it is
                  OFF after every start
                    to keep it, turn it ON by `SET C1` and OFF by `RST C1`; or take it out
                    of `[retain] tags`
                5:37 retained-but-reset
                  `MC2` is retained, but a stop turns OFF every bit that `ND` drives: it
                  is OFF after every start
                    to keep it, turn it ON by `SET MC2` and OFF by `RST MC2`; or take it out
                    of `[retain] tags`
                6:53 retained-but-reset
                  `C3` is retained, but a stop turns OFF every bit that `OFFDTMR` drives:
                  it is OFF after every start
                    to keep it, turn it ON by `SET C3` and OFF by `RST C3`; or take it out
                    of `[retain] tags`
            "#]],
        );
    }

    const DRIVEN_IN_WORDS: &str = r#"
        { when = ["X0"], do = ["OUT D0.3", "SET D0.4", "RST D0.4", "MATH D0.5 = X1", "OUT D9.1"] },
        { when = ["X2"], do = ["OFFDTMR T0 preset=3s output=V1.15", "OUT CT0.Acc.2"] },
        { leg.up = ["X0"], leg.dn = ["X1"], do = ["UDCG CT0 up-preset=12"] },
    "#;

    #[test]
    fn driven_bits_of_retained_words_are_reported_however_the_word_is_retained() {
        let expected = expect![[r#"
            4:29 retained-but-reset
              `D0.3` is a bit of a retained word, but a stop turns OFF every bit that
              `OUT` drives: it is OFF after every start
                to keep it, turn it ON by `SET D0.3` and OFF by `RST D0.3`; or let a
                word that is not retained have it
            5:53 retained-but-reset
              `V1.15` is a bit of a retained word, but a stop turns OFF every bit that
              `OFFDTMR` drives: it is OFF after every start
                to keep it, turn it ON by `SET V1.15` and OFF by `RST V1.15`; or let a
                word that is not retained have it
            5:66 retained-but-reset
              `CT0.Acc.2` is a bit of a retained word, but a stop turns OFF every bit
              that `OUT` drives: it is OFF after every start
                to keep it, turn it ON by `SET CT0.Acc.2` and OFF by `RST CT0.Acc.2`; or
                let a word that is not retained have it
            6:44 whole-word-over-out
              all of `CT0.Acc` is written, and `OUT` drives a bit of it, `CT0.Acc.2`
                let one of the two write to a word of its own
        "#]];
        check_retained(&["D0..D8", "V1", "CT0"], DRIVEN_IN_WORDS, expected);
    }

    #[test]
    fn a_bit_of_a_word_is_reported_for_the_words_tag_too() {
        check_retained_tags(
            &["D0"],
            DRIVEN_IN_WORDS,
            expect![[r#"
            4:29 retained-but-reset
              `D0.3` is a bit of a retained word, but a stop turns OFF every bit that
              `OUT` drives: it is OFF after every start
                to keep it, turn it ON by `SET D0.3` and OFF by `RST D0.3`; or let a
                word that is not retained have it
            6:44 whole-word-over-out
              all of `CT0.Acc` is written, and `OUT` drives a bit of it, `CT0.Acc.2`
                let one of the two write to a word of its own
        "#]],
        );
    }

    #[test]
    fn bits_of_a_retained_word_that_nothing_drives_are_not_reported() {
        check_retained(
            &["D0..D8", "C0"],
            r#"
            { when = ["X0"], do = ["SET D0.4", "MATH D0.5 = X1", "OUT D9.1", "PONOFF D0.6"] },
            { when = ["X1"], do = ["RST D0.4", "PACK C8..C9 to=D1", "OUT C1"] },
            "#,
            expect![""],
        );
    }

    #[test]
    fn driven_bits_retained_only_by_a_range_are_not_reported() {
        check_retained(&["C0..C5", "MC2"], DRIVEN, expect![""]);
    }
}
