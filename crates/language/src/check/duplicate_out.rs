//! `duplicate-out`: within one block's own rungs, or one stage, two instructions drive one bit.
//!
//! Drivers write their bit, ON or OFF, at every execution: OUT, PD, ND, and ONDTMR and OFFDTMR with
//! their output. If a bit has two drivers, the last one determines it in every scan. SET, RST and
//! PONOFF do not write at every execution and are not drivers.
//!
//! Passes:
//!
//! ```toml
//! rung = [ { when = ["X0 | X1"], do = ["OUT Y0"] } ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["OUT Y0"] },
//!   { when = ["X1"], do = ["OUT Y0"] },
//! ]
//! ```

use std::collections::BTreeMap;

use crate::resolve::program::TagMeaning;
use crate::source::finding::{Code, Finding};
pub use rungd_engine::isa::{Address, Bit, Mnemonic, NumberMap};

use super::context::{Context, DrivingInstruction};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let named = named(context);
    for (bit, drivers) in context.drivers() {
        let subject = || subject(context, bit, named.get(&Address::Bit(bit)));
        let mut elements: BTreeMap<_, Vec<&DrivingInstruction>> = BTreeMap::new();
        for driver in drivers {
            elements.entry(driver.placed.place.element()).or_default().push(driver);
        }
        for all in elements.values() {
            let [first, again @ ..] = &all[..] else { continue };
            let Some(second) = again.first() else { continue };
            // The help contains the conditions of all drivers, so it is made only once.
            let help = help(context, bit, all);
            findings.push(finding(&subject(), first, second).help(help));
            let more = context.progress.during(&again[1..]);
            let more = more.map(|later| finding(&subject(), first, later));
            findings.extend(more);
        }
    }
}

fn finding(subject: &str, first: &DrivingInstruction, second: &DrivingInstruction) -> Finding {
    let message = format!(
        "{subject} driven twice, by `{}` in {}, and by `{}` in {}: the last one decides",
        first.placed.name(),
        first.placed.place,
        second.placed.name(),
        second.placed.place,
    );
    Finding::new(Code::DuplicateOut, second.span, message)
        .label("driven again")
        .related(first.span, "overwritten")
}

/// The names of the tags of each address.
fn named<'c>(context: &'c Context) -> NumberMap<Address, Vec<&'c str>> {
    let mut named: NumberMap<Address, Vec<&str>> = NumberMap::default();
    for tag in &context.program.tags {
        if let TagMeaning::Address(address) = tag.meaning {
            named.entry(address).or_default().push(&tag.name);
        }
    }
    named
}

/// The bit, with all its tags: drivers that name different tags do not show that they share it.
fn subject(context: &Context, bit: Bit, tags: Option<&Vec<&str>>) -> String {
    let tags = tags.into_iter().flatten().map(|tag| format!("`{tag}`"));
    match tags.collect::<Vec<String>>().as_slice() {
        [] | [_] => format!("{} is", context.say_bit(bit)),
        [others @ .., last] => {
            format!("{} and {last} share {}, which is", others.join(", "), Address::Bit(bit))
        }
    }
}

fn help(context: &Context, bit: Bit, all: &[&DrivingInstruction]) -> String {
    let name = context.name(Address::Bit(bit));
    let outs = all.iter().all(|d| d.placed.mnemonic() == Mnemonic::Out);
    let powers = all.iter().map(|d| context.power(&d.placed.place).filter(|_| outs));
    match context.any_of(powers) {
        Some(when) => format!(
            "drive it in one rung, if either condition is to turn it ON:\n\
             when = [\"{when}\"]\ndo   = [\"OUT {name}\"]"
        ),
        None => {
            format!("let each drive a bit of its own, and drive this one from both: `OUT {name}`")
        }
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::{check, check_main};

    #[test]
    fn the_help_joins_the_conditions_of_both_coils() {
        check_main(
            r#"
            { when = ["X0", "X1"], do = ["OUT Y0"] },
            { when = ["X2 | rise(X3)"], do = ["OUT Y0"] },
            "#,
            expect![[r#"
                5:40 duplicate-out
                  `Y0` is driven twice, by `OUT` in program `Main`, rung 1, and by `OUT`
                  in program `Main`, rung 2: the last one decides
                    drive it in one rung, if either condition is to turn it ON:
                    when = ["(X0 & X1) | X2 | rise(X3)"]
                    do = ["OUT Y0"]
            "#]],
        );
    }

    #[test]
    fn all_driving_instructions_count_but_set_and_rst_do_not() {
        check_main(
            r#"
            { when = ["X0"], do = ["PD Y0", "SET C0", "SET C0", "RST C0", "PONOFF C0"] },
            { when = ["X1"], do = ["ND Y0"] },
            { when = ["X2"], do = ["ONDTMR T0 preset=1s output=Y1"] },
            { when = ["X3"], do = ["OFFDTMR T1 preset=1s output=Y1"] },
            "#,
            expect![[r#"
                5:28 duplicate-out
                  `Y0` is driven twice, by `PD` in program `Main`, rung 1, and by `ND` in
                  program `Main`, rung 2: the last one decides
                    let each drive a bit of its own, and drive this one from both: `OUT Y0`
                7:53 duplicate-out
                  `Y1` is driven twice, by `ONDTMR` in program `Main`, rung 3, and by
                  `OFFDTMR` in program `Main`, rung 4: the last one decides
                    let each drive a bit of its own, and drive this one from both: `OUT Y1`
            "#]],
        );
    }

    #[test]
    fn duplicate_coils_within_a_branch_or_stage_are_reported() {
        check(
            r#"
            [tags]
            lamp = { at = "Y0" }

            [[program]]
            name = "Main"

            [[program.rung]]
            when = ["X0"]
            do   = ["OUT lamp", "RUN Day"]

            [[program.rung.branch]]
            when = ["D0 > 5 & !X1"]
            do   = ["OUT Y0"]

            [[program]]
            name = "Day"

            [[program.stage]]
            name = "A"
            rung = [
              { when = ["$On"], do = ["OUT Y1"] },
              { when = ["X1"], do = ["OUT Y1", "JMP B"] },
            ]

            [[program.stage]]
            name = "B"
            rung = [ { when = ["X1"], do = ["OUT Y1"] } ]
            "#,
            expect![[r#"
                13:14 duplicate-out
                  `lamp` (Y0) is driven twice, by `OUT` in program `Main`, rung 1, and by
                  `OUT` in program `Main`, rung 1, branch 1: the last one decides
                    drive it in one rung, if either condition is to turn it ON:
                    when = ["X0 | (X0 & D0 > 5 & !X1)"]
                    do = ["OUT lamp"]
                22:29 duplicate-out
                  `Y1` is driven twice, by `OUT` in program `Day`, stage `A`, rung 1, and
                  by `OUT` in program `Day`, stage `A`, rung 2: the last one decides
                    let each drive a bit of its own, and drive this one from both: `OUT Y1`
            "#]],
        );
    }
}
