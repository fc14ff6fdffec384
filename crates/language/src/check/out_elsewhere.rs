//! `out-elsewhere`: two drivers of one bit in different places of the program.
//!
//! The driver that executes last in a scan determines the bit, and the termination of one driver
//! turns the bit OFF although the other may have turned it ON. Two stages of one program are
//! allowed, because they take turns (see `out-lost-on-jump-back`). `duplicate_out` lists the
//! drivers.
//!
//! Passes:
//!
//! ```toml
//! [[program]]
//! name = "Main"
//! rung = [ { when = ["X0 | (Drain.Running & X1)"], do = ["OUT Y0"] } ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! [[program]]
//! name = "Main"
//! rung = [ { when = ["X0"], do = ["OUT Y0", "RUN Drain"] } ]
//!
//! [[program]]
//! name = "Drain"
//! rung = [ { when = ["X1"], do = ["OUT Y0"] } ]
//! ```

use std::cell::OnceCell;
use std::collections::HashMap;

use crate::source::finding::{Code, Finding};
pub use rungd_engine::isa::{Address, Bit, BlockId, ElementId, Mnemonic};

use super::context::{Context, DrivingInstruction};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for (bit, drivers) in context.drivers() {
        let help = OnceCell::new();
        let mut firsts = FirstDrivers::default();
        for second in context.progress.during(drivers) {
            if let Some(first) = firsts.competitor(second) {
                let help = help.get_or_init(|| self::help(context, bit, drivers));
                findings.push(finding(context, bit, first, second).help(help.as_str()));
            }
            firsts.add(second);
        }
    }
}

/// The first drivers of a bit, collected so that thousands of drivers are compared in one pass.
#[derive(Default)]
struct FirstDrivers<'c> {
    /// For each block: the first driver in its own rungs, and the first in one of its stages.
    of_block: HashMap<BlockId, [Option<(usize, &'c DrivingInstruction<'c>)>; 2]>,
    /// The first driver, and the first driver in a different block.
    of_two_blocks: Vec<(usize, &'c DrivingInstruction<'c>)>,
    count: usize,
}

impl<'c> FirstDrivers<'c> {
    fn add(&mut self, driver: &'c DrivingInstruction<'c>) {
        let ElementId { block, stage } = driver.placed.place.element();
        let first = &mut self.of_block.entry(block).or_default()[usize::from(stage.is_some())];
        first.get_or_insert((self.count, driver));
        let is_other =
            |(_, other): &(usize, &DrivingInstruction)| other.placed.place.block.id != block;
        if self.of_two_blocks.len() < 2 && self.of_two_blocks.iter().all(is_other) {
            self.of_two_blocks.push((self.count, driver));
        }
        self.count += 1;
    }

    /// The first driver in a different element, unless both elements are stages of one program.
    fn competitor(&self, driver: &DrivingInstruction) -> Option<&'c DrivingInstruction<'c>> {
        let ElementId { block, stage } = driver.placed.place.element();
        let in_block =
            self.of_block.get(&block).and_then(|firsts| firsts[usize::from(stage.is_none())]);
        let is_other =
            |(_, other): &&(usize, &DrivingInstruction)| other.placed.place.block.id != block;
        let elsewhere = self.of_two_blocks.iter().find(is_other).copied();
        let both = in_block.into_iter().chain(elsewhere);
        both.min_by_key(|(at, _)| *at).map(|(_, first)| first)
    }
}

fn finding(
    context: &Context,
    bit: Bit,
    first: &DrivingInstruction,
    second: &DrivingInstruction,
) -> Finding {
    let message = format!(
        "{} is driven in two places, {}, and {}: the one that executes last in a scan decides",
        context.say_bit(bit),
        first.placed.place,
        second.placed.place,
    );
    Finding::new(Code::OutElsewhere, second.span, message)
        .label("driven here too")
        .related(first.span, "driven here")
}

fn help(context: &Context, bit: Bit, all: &[DrivingInstruction]) -> String {
    let name = context.name(Address::Bit(bit));
    let outs = all.iter().all(|d| d.placed.mnemonic() == Mnemonic::Out);
    let powers = all.iter().map(|d| context.power_from_outside(&d.placed.place).filter(|_| outs));
    let remedy = match context.any_of(powers) {
        Some(when) => format!(
            "drive it once, in the last of these programs or in one after them:\n\
             when = [\"{when}\"]\ndo   = [\"OUT {name}\"]"
        ),
        None => format!(
            "let each place drive a bit of its own, and drive this one once from all of them: \
             `OUT {name}`"
        ),
    };
    format!("{remedy}\nif they never run in one scan, on this rung: allow = [\"out-elsewhere\"]")
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn coils_driven_in_two_blocks_are_reported() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["RUN Drain", "OUT Y0"] },
              { when = ["X5"], do = ["ENTASK Report every=1s"] },
            ]

            [[program]]
            name = "Drain"
            rung = [
              { when = ["X1"], do = ["OUT Y0"] },
              { when = ["X2"], do = ["OUT Y1"] },
              { when = ["X3"], do = ["ONDTMR T0 preset=1s output=Y2"] },
            ]

            [[program.stage]]
            name = "A"
            rung = [ { when = ["X2"], do = ["OUT Y1", "JMP B"] } ]

            [[program.stage]]
            name = "B"
            rung = [ { when = ["X2"], do = ["OUT Y3"] } ]

            [[task]]
            name = "Report"
            rung = [ { when = ["X4"], do = ["OUT Y2"] } ]
            "#,
            expect![[r#"
                11:29 out-elsewhere
                  `Y0` is driven in two places, program `Main`, rung 1, and program
                  `Drain`, rung 1: the one that executes last in a scan decides
                    drive it once, in the last of these programs or in one after them:
                    when = ["X0 | (Drain.Running & X1)"]
                    do = ["OUT Y0"]
                    if they never run in one scan, on this rung: allow = ["out-elsewhere"]
                18:38 out-elsewhere
                  `Y1` is driven in two places, program `Drain`, rung 2, and program
                  `Drain`, stage `A`, rung 1: the one that executes last in a scan decides
                    drive it once, in the last of these programs or in one after them:
                    when = ["(Drain.Running & X2) | (Drain.A & X2)"]
                    do = ["OUT Y1"]
                    if they never run in one scan, on this rung: allow = ["out-elsewhere"]
                26:38 out-elsewhere
                  `Y2` is driven in two places, program `Drain`, rung 3, and task
                  `Report`, rung 1: the one that executes last in a scan decides
                    let each place drive a bit of its own, and drive this one once from all
                    of them: `OUT Y2`
                    if they never run in one scan, on this rung: allow = ["out-elsewhere"]
            "#]],
        );
    }

    #[test]
    fn coils_driven_in_two_stages_of_one_program_are_not_reported() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["RUN Day"] } ]

            [[program]]
            name = "Day"

            [[program.stage]]
            name = "A"
            rung = [ { when = ["X1"], do = ["OUT Y0", "JMP B"] } ]

            [[program.stage]]
            name = "B"
            rung = [ { when = ["X2"], do = ["OUT Y0", "EXIT"] } ]
            "#,
            expect![[""]],
        );
    }
}
