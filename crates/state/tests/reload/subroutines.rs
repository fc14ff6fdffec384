//! The rules of a reload for subroutines, a named case each.

use crate::reload::reloaded::*;

const DOSE: &str = r#"
rung = [ { when = ["X0"], do = ["CALL Dose"] } ]
[[program]]
name = "Fill"
autostart = true
rung = [ { when = ["X1"], do = ["CALL Dose"] } ]
[[subroutine]]
name = "Dose"
rung = [
  { when = ["$On"], do = ["OUT Y0", "TMR T0 preset=9s"] },
  { when = ["rise(X2)"], do = ["ADD D0 1 to=D0"] },
  { when = ["X3"], do = ["RETURN"] },
  { when = ["$On"], do = ["TMR T1 preset=9s"] },
]
"#;

fn dosing() -> Reloaded {
    main_with(DOSE).scan(&[("X0", 1), ("X2", 1)]).scans(3)
}

#[test]
fn timers_and_histories_of_a_subroutine_are_kept() {
    let more = "{ when = [\"X9\"], do = [\"OUT Y9\"] },\n  { when = [\"$On\"], do = [\"OUT Y0\"";
    dosing()
        .holds([("T0.Acc", 30), ("D0", 1), ("Y0", 1)])
        .main(&DOSE.replace("{ when = [\"$On\"], do = [\"OUT Y0\"", more))
        .holds([("T0.Acc", 30), ("T1.Acc", 30), ("Y0", 1)])
        .scan(&[])
        .holds([("T0.Acc", 40), ("T1.Acc", 40), ("D0", 1), ("Y0", 1)]);
}

#[test]
fn timers_behind_a_return_keep_the_time_that_they_missed() {
    dosing()
        .scan(&[("X3", 1)])
        .scan(&[])
        .holds([("T0.Acc", 50), ("T1.Acc", 30)])
        .main(&DOSE.replace("OUT Y0", "OUT Y1"))
        .scan(&[("X3", 0)])
        .holds([("T0.Acc", 60), ("T1.Acc", 60)]);
}

#[test]
fn a_removed_subroutine_is_terminated_first() {
    let without = DOSE.split("[[subroutine]]").next().unwrap_or("");
    dosing()
        .main(&without.replace("CALL Dose", "OUT C5").replacen("OUT C5", "OUT C6", 1))
        .says("Subroutine Dose is gone and was terminated")
        .holds([("Y0", 0), ("T0.Acc", 0), ("T0.Reset", 1)]);
}

#[test]
fn a_subroutine_that_no_block_can_reach_is_treated_as_gone() {
    dosing()
        .main(&DOSE.replace("CALL Dose", "OUT C5").replacen("OUT C5", "OUT C6", 1))
        .says("Subroutine Dose is not called any more and was terminated")
        .holds([("Y0", 0), ("T0.Acc", 0)]);
}

#[test]
fn a_subroutine_stays_with_the_program_that_executed_it_last() {
    let halt = "{ when = [\"X7\"], do = [\"HALT Fill\"] }, { when = [\"X0\"]";
    let more = "[[program]]\nname = \"Before\"\nrung = []\n[[program]]\nname = \"Fill\"";
    let text = DOSE.replacen("{ when = [\"X0\"]", halt, 1);
    main_with(&text)
        .scan(&[("X1", 1)])
        .scans(1)
        .main(&text.replace("[[program]]\nname = \"Fill\"", more))
        .holds([("Y0", 1)])
        .scan(&[("X7", 1), ("X1", 0)])
        .holds([("Y0", 0), ("T0.Acc", 0), ("T0.Reset", 1)]);
}

#[test]
fn a_subroutine_is_terminated_if_the_program_that_executed_it_is_gone() {
    let without = DOSE.replace(
        "[[program]]\nname = \"Fill\"\nautostart = true\nrung = [ { when = [\"X1\"], do = [\"CALL Dose\"] } ]\n",
        "",
    );
    main_with(DOSE)
        .scan(&[("X1", 1)])
        .scans(1)
        .main(&without)
        .says("Program Fill is gone and was terminated")
        .holds([("Y0", 0), ("T0.Acc", 0)]);
}

#[test]
fn a_new_subroutine_begins_afresh() {
    main_with(&DOSE.replace("CALL Dose", "OUT C5").replacen("OUT C5", "OUT C6", 1))
        .scans(4)
        .main(DOSE)
        .scan(&[("X0", 1), ("X2", 1)])
        .holds([("T0.Acc", 0), ("D0", 1), ("Y0", 1)])
        .scan(&[])
        .holds([("T0.Acc", 10), ("D0", 1)]);
}
