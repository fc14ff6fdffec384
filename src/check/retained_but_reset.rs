//! `retained-but-reset`: the controller file retains a structure, but its owner resets it at every
//! stop.
//!
//! The termination passes of an orderly stop run before memory is saved, so a CNT is saved as 0.
//! UDCG, TMRAG and the Sensaphone counters have no termination logic. The finding's place is the
//! owner, because `allow` can silence it there; the range is a related place.
//!
//! Passes: `ranges = ["CT0"]` and
//!
//! ```toml
//! do = ["UDCG CT0 up-preset=12"]
//! ```
//!
//! Fails: `ranges = ["CT0"]` and
//!
//! ```toml
//! do = ["CNT CT0 preset=12"]
//! ```

use std::cell::OnceCell;
use std::collections::BTreeSet;

use crate::isa::instruction::Termination;
use crate::isa::{Address, NumberRanges, Space, Structure, Word, WordSpace};
use crate::resolve::range::Range;
use crate::source::finding::{Code, Finding};

use super::context::{Context, Placed};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let word = OnceCell::new();
    for (structure, owners) in context.owners() {
        let range = context.retained_with(structure.space(), structure.number());
        let Some(range) = range else { continue };
        let resets = |p: &&Placed| p.mnemonic().spec().termination == Termination::Reset;
        if let Some(owner) = owners.iter().find(resets) {
            let word = *word.get_or_init(|| self::word(context));
            findings.push(finding(context, (structure, owner), range, word));
        }
    }
}

fn finding(
    context: &Context,
    (structure, owner): (Structure, &Placed),
    range: &Range,
    (word, and_retain): (Word, &str),
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
fn word(context: &Context) -> (Word, &'static str) {
    let named: BTreeSet<Address> = context.program.operands.iter().map(|o| o.address).collect();
    let data = context.retained.iter().filter(|range| range.space == Space::Word(WordSpace::D));
    let mut seen = NumberRanges::default();
    let words = data.flat_map(|range| seen.add(range.numbers(), 0));
    let words = words.flat_map(|(first, last)| first..=last);
    let is_placed = |word: &Word| context.program.places.at(Address::Word(*word)).is_some();
    match words
        .map(|n| Word::Space(WordSpace::D, n))
        .find(|word| !named.contains(&Address::Word(*word)) && !is_placed(word))
    {
        Some(word) => (word, ""),
        None => (Word::Space(WordSpace::D, 0), ", in a word that you retain"),
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check_retained;

    #[test]
    fn owners_with_termination_logic() {
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
}
