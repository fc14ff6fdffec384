//! `owned-twice`: two instructions own one structure. A structure has exactly one owner in the
//! whole program.
//!
//! Passes: a CTU and a CTD on one Sensaphone counter; RSTCT, contacts and compares anywhere.
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["TMR T0 preset=3s"] },
//!   { when = ["T0.Done"], do = ["OUT Y0"] },
//! ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["TMR T0 preset=3s"] },
//!   { when = ["X1"], do = ["TMR T0 preset=5s"] },
//! ]
//! ```

use std::cell::OnceCell;

use crate::source::finding::{Code, Finding};
use rungd_engine::isa::{Address, Structure};

use super::context::{Context, ProgramInstruction};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for (structure, owners) in context.owners() {
        let free = OnceCell::new();
        let mut firsts: Vec<&ProgramInstruction> = Vec::new();
        for owner in owners {
            match firsts.iter().find(|first| collide(structure, first, owner)) {
                Some(first) => {
                    let free = *free.get_or_init(|| context.free_like(structure));
                    findings.extend(finding(context, free, first, owner));
                }
                None => firsts.push(owner),
            }
        }
    }
}

/// Whether two owners conflict. Only one CTU and one CTD may share a Sensaphone counter.
fn collide(structure: Structure, first: &ProgramInstruction, second: &ProgramInstruction) -> bool {
    !matches!(structure, Structure::Sensaphone(_)) || first.mnemonic() == second.mnemonic()
}

fn finding(
    context: &Context,
    free: Option<Structure>,
    first: &ProgramInstruction,
    second: &ProgramInstruction,
) -> Option<Finding> {
    let structure = second.instruction.structure()?;
    let message = format!(
        "{} {} is owned twice: by `{}` in {}, and by `{}` in {}",
        structure.kind_name(),
        context.say_structure(structure),
        first.name(),
        first.place,
        second.name(),
        second.place,
    );
    let name = context.name(Address::Structure(structure));
    let share = match structure {
        Structure::Sensaphone(_) => format!("one CTU and one CTD may share `{name}`"),
        Structure::Counter(_) | Structure::Timer(_) => {
            format!("`{name}` can be read anywhere, but only one instruction may execute it")
        }
    };
    let help = match free.filter(|_| context.whole) {
        Some(free) => format!("{share}\ngive this one a structure that is free: `{free}`"),
        None => share,
    };
    let finding = Finding::new(Code::OwnedTwice, second.instruction.span, message)
        .label("second owner")
        .related(first.instruction.span, "first owner");
    Some(finding.help(help))
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::{check, check_main};

    #[test]
    fn two_owners_of_one_structure_are_reported_in_any_blocks() {
        check_main(
            r#"
            { when = ["X0"], do = ["TMR T0 preset=3s"] },
            { when = ["X1"], do = ["ONDTMR T0 preset=5s output=Y0"] },
            { name = "third", when = ["X2"], do = ["TMR T0 preset=7s"] },
            "#,
            expect![[r#"
                5:25 owned-twice
                  timer `T0` is owned twice: by `TMR` in program `Main`, rung 1, and by
                  `ONDTMR` in program `Main`, rung 2
                    `T0` can be read anywhere, but only one instruction may execute it
                    give this one a structure that is free: `T1`
                6:41 owned-twice
                  timer `T0` is owned twice: by `TMR` in program `Main`, rung 1, and by
                  `TMR` in program `Main`, rung `third`
                    `T0` can be read anywhere, but only one instruction may execute it
                    give this one a structure that is free: `T1`
            "#]],
        );
    }

    #[test]
    fn the_finding_names_the_tag_and_suggests_a_free_structure() {
        check(
            r#"
            [tags]
            bottles = { at = "CT0" }
            caps = { at = "CT1" }

            [[program]]
            name = "Main"
            rung = [
              { leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT bottles preset=12"] },
              { when = ["$On"], do = ["ENTASK Report every=1s"] },
              { leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT caps preset=12"] },
            ]

            [[task]]
            name = "Report"
            rung = [ { leg.dn = ["X0"], leg.rst = ["X1"], do = ["CNTDN CT0 preset=12"] } ]
            "#,
            expect![[r#"
                15:54 owned-twice
                  counter `bottles` (CT0) is owned twice: by `CNT` in program `Main`, rung
                  1, and by `CNTDN` in task `Report`, rung 1
                    `bottles` can be read anywhere, but only one instruction may execute it
                    give this one a structure that is free: `CT2`
            "#]],
        );
    }

    #[test]
    fn one_ctu_and_one_ctd_can_share_a_counter() {
        check_main(
            r#"
            { when = ["X0"], do = ["CTU N0 preset=5"] },
            { when = ["X1"], do = ["CTD N0"] },
            { when = ["X2"], do = ["CTU N0 preset=5"] },
            { when = ["X3"], do = ["CTU N1 preset=5"] },
            "#,
            expect![[r#"
                6:25 owned-twice
                  Sensaphone counter `N0` is owned twice: by `CTU` in program `Main`, rung
                  1, and by `CTU` in program `Main`, rung 3
                    one CTU and one CTD may share `N0`
                    give this one a structure that is free: `N2`
            "#]],
        );
    }
}
