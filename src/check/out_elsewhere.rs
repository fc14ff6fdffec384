//! `out-elsewhere`: two drivers of one bit in different places of the program.
//!
//! Whichever executes last in a scan decides, and the termination of one turns the bit OFF behind
//! the other's back. Stages of one program are left out: they take turns (see
//! `out-lost-on-jump-back`). What drives is said in `duplicate_out`.
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

use crate::isa::{Address, Bit, Mnemonic};
use crate::source::finding::{Code, Finding};

use super::context::{Context, Driver};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for (bit, drivers) in context.drivers() {
        for (at, second) in drivers.iter().enumerate() {
            if let Some(first) = drivers[..at].iter().find(|first| compete(first, second)) {
                findings.push(finding(context, bit, (first, second), drivers));
            }
        }
    }
}

/// In different elements that are not stages of one program.
fn compete(first: &Driver, second: &Driver) -> bool {
    let ((block_1, stage_1), (block_2, stage_2)) =
        (first.placed.place.element(), second.placed.place.element());
    let stages_of_one = block_1 == block_2 && stage_1.is_some() && stage_2.is_some();
    (block_1, stage_1) != (block_2, stage_2) && !stages_of_one
}

fn finding(context: &Context, bit: Bit, pair: (&Driver, &Driver), all: &[Driver]) -> Finding {
    let (first, second) = pair;
    let message = format!(
        "{} is driven in two places, {}, and {}: the one that executes last in a scan decides",
        context.say_bit(bit),
        first.placed.place,
        second.placed.place,
    );
    Finding::new(Code::OutElsewhere, second.span, message)
        .label("driven here too")
        .related(first.span, "driven here")
        .help(help(context, bit, all))
}

fn help(context: &Context, bit: Bit, all: &[Driver]) -> String {
    let name = context.name(Address::Bit(bit));
    let outs = all.iter().all(|d| d.placed.mnemonic() == Mnemonic::Out);
    let powers = all.iter().map(|d| context.power_from_outside(&d.placed.place).filter(|_| outs));
    let remedy = match context.any_of(powers) {
        Some(when) => format!(
            "drive it once, in the last of these programs or in one behind them:\n\
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
    fn two_programs_a_task_and_a_stage() {
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
                    drive it once, in the last of these programs or in one behind them:
                    when = ["X0 | (Drain.Running & X1)"]
                    do = ["OUT Y0"]
                    if they never run in one scan, on this rung: allow = ["out-elsewhere"]
                18:38 out-elsewhere
                  `Y1` is driven in two places, program `Drain`, rung 2, and program
                  `Drain`, stage `A`, rung 1: the one that executes last in a scan decides
                    drive it once, in the last of these programs or in one behind them:
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
    fn stages_of_one_program_take_turns() {
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
