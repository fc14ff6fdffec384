//! The rules of a reload for Programs, Stages and Tasks, a named case each.

use crate::reload::reloaded::*;

const DRAIN: &str = r#"
rung = [ { when = ["X0"], do = ["RUN Drain"] }, { when = ["X1"], do = ["HALT Drain"] } ]
[[program]]
name = "Drain"
rung = [ { when = ["$On"], do = ["OUT Y0"] } ]
[[program.stage]]
name = "Open"
rung = [ { when = ["X2"], do = ["JMP Close"] }, { when = ["$On"], do = ["OUT Y1"] } ]
[[program.stage]]
name = "Close"
rung = [ { when = ["$On"], do = ["OUT Y2", "TMR T0 preset=9s"] } ]
"#;

fn draining() -> Reloaded {
    main_with(DRAIN).scan(&[("X0", 1)]).scan(&[("X2", 1), ("X0", 0)]).scans(3)
}

#[test]
fn running_programs_and_active_stages_continue_by_name() {
    let more = "[[program]]\nname = \"Before\"\n[[program.stage]]\nname = \"Open\"\nrung = [ { when = [\"$On\"], do = [\"OUT Y7\"] } ]\n";
    let drain = DRAIN.replacen("[[program]]", &format!("{more}[[program]]"), 1);
    draining()
        .holds([("Drain.Running", 1), ("Drain.Open", 0), ("Drain.Close", 1), ("T0.Acc", 30)])
        .main(&drain)
        .says("Stage Drain.Close stays ON")
        .says("Program Drain continues to run")
        .says("Program Before is new")
        .holds([("Drain.Running", 1), ("Drain.Open", 0), ("Drain.Close", 1), ("Before.Running", 0)])
        .scan(&[])
        .holds([("Y0", 1), ("Y1", 0), ("Y2", 1), ("T0.Acc", 40), ("Before.Open", 0)]);
}

#[test]
fn a_removed_program_is_terminated_first() {
    draining()
        .main(&format!("rung = [ {ON} ]"))
        .says("Program Drain is gone and was terminated")
        .holds([("Y0", 0), ("Y1", 0), ("Y2", 0), ("T0.Acc", 0), ("T0.Reset", 1)]);
}

#[test]
fn a_program_that_loses_its_active_stage_restarts_at_its_first_stage() {
    draining()
        .main(&DRAIN.replace("Close", "Shut"))
        .says("Stage Drain.Close is gone and was terminated")
        .says("Stage Drain.Shut is new")
        .says("Program Drain begins at its Stage Drain.Open")
        .holds([("Drain.Open", 1), ("Drain.Shut", 0)])
        .scan(&[("X2", 0)])
        .holds([("Y1", 1), ("Y2", 0), ("T0.Acc", 0), ("T0.Reset", 1)]);
}

#[test]
fn an_instruction_moved_into_an_inactive_stage_is_terminated() {
    let moved = DRAIN
        .replace("\"OUT Y1\"] }", "\"OUT Y1\", \"TMR T0 preset=9s\"] }")
        .replace("\"OUT Y2\", \"TMR T0 preset=9s\"", "\"OUT Y2\"");
    draining()
        .main(&moved)
        .says("T0 keeps 30 ms of 9 s, until the pass of Stage Drain.Open, which is OFF")
        .scan(&[])
        .holds([("T0.Acc", 0), ("T0.Reset", 1), ("Y2", 1)]);
}

#[test]
fn a_new_autostart_program_starts_and_a_known_one_keeps_its_state() {
    let drain = DRAIN.replace("name = \"Drain\"", "name = \"Drain\"\nautostart = true");
    main_with(DRAIN).scans(2).main(&drain).scans(1).holds([("Drain.Running", 0)]);
    main_with(&format!("rung = [ {ON} ]")).scans(2).main(&drain).scans(1).holds([
        ("Drain.Running", 1),
        ("Drain.Open", 1),
        ("Y1", 1),
    ]);
}

fn recurrent(every: &str, more: &str) -> String {
    format!(
        "rung = [ {more} {{ when = [\"X0\"], do = [\"ENTASK Work every={every}\"] }} ]\n[[task]]\n\
         name = \"Work\"\nrung = [ {{ when = [\"$On\"], do = [\"ADD D0 1 to=D0\", \"OUT Y0\"] }} ]"
    )
}

#[test]
fn a_recurrent_task_keeps_its_timing() {
    main_with(&recurrent("50ms", ""))
        .scan(&[("X0", 1)])
        .scans(3)
        .holds([("D0", 1)])
        .main(&recurrent("50ms", ON))
        .scan(&[])
        .holds([("D0", 1)])
        .scan(&[])
        .holds([("D0", 2)]);
}

#[test]
fn an_edited_interval_counts_from_the_same_start() {
    main_with(&recurrent("50ms", ""))
        .scan(&[("X0", 1)])
        .scans(3)
        .main(&recurrent("200ms", ""))
        .says("interval of Work 50 ms → 200 ms")
        .scans(16)
        .holds([("D0", 1)])
        .scans(1)
        .holds([("D0", 2)]);
}

#[test]
fn a_task_that_no_instruction_enables_any_more_is_disabled() {
    let text = recurrent("50ms", "");
    let without = text.replace("do = [\"ENTASK Work every=50ms\"]", "do = [\"OUT C3\"]");
    main_with(&text)
        .scan(&[("X0", 1)])
        .holds([("Y0", 1), ("Work.Running", 1)])
        .main(&without)
        .says("Task Work is disabled and was terminated: the ENTASK that enabled it is gone")
        .holds([("Work.Running", 0)])
        .scan(&[])
        .holds([("Y0", 0)]);
}

#[test]
fn a_task_removed_with_its_entask_is_terminated_if_it_ran() {
    let text = recurrent("50ms", "");
    main_with(&text)
        .scan(&[("X0", 1)])
        .main(&format!("rung = [ {ON} ]"))
        .says("Task Work is gone and was terminated")
        .holds([("Y0", 0)]);
    main_with(&text)
        .scan(&[])
        .main(&format!("rung = [ {ON} ]"))
        .says("Task Work is gone; it was not running");
}

#[test]
fn a_task_is_disabled_if_the_program_of_its_entask_is_removed() {
    let text = "rung = [ { when = [\"X1\"], do = [\"RUN Side\"] } ]\n[[task]]\nname = \"Work\"\n\
                rung = [ { when = [\"$On\"], do = [\"OUT Y0\"] } ]\n";
    let side = "[[program]]\nname = \"Side\"\nautostart = true\nrung = [ { when = [\"X0\"], do = \
                [\"ENTASK Work every=50ms\"] } ]\n";
    main_with(&format!("{text}{side}"))
        .scan(&[("X0", 1)])
        .holds([("Y0", 1), ("Work.Running", 1)])
        .scan(&[])
        .main(&text.replace("RUN Side", "OUT C1"))
        .says("Program Side is gone and was terminated")
        .says("Task Work is disabled and was terminated: the ENTASK that enabled it is gone")
        .holds([("Work.Running", 0)])
        .scan(&[])
        .holds([("Y0", 0)]);
}

#[test]
fn an_entask_moved_into_an_inactive_stage_is_terminated() {
    let stages = |open: &str, close: &str| {
        format!(
            "rung = [ {{ when = [\"$On\"], do = [\"RUN Drain\"] }} ]\n[[program]]\nname = \"Drain\"\n\
             [[program.stage]]\nname = \"Open\"\nrung = [ {{ when = [\"$On\"], do = [{open}] }} ]\n\
             [[program.stage]]\nname = \"Close\"\nrung = [ {{ when = [\"$On\"], do = [{close}] }} ]\n\
             [[task]]\nname = \"Work\"\nrung = [ {{ when = [\"$On\"], do = [\"OUT Y0\"] }} ]"
        )
    };
    let (enable, other) = ("\"ENTASK Work every=50ms\"", "\"OUT C1\"");
    main_with(&stages(&format!("{enable}, {other}"), "\"OUT C2\""))
        .scans(2)
        .holds([("Work.Running", 1), ("Y0", 1)])
        .main(&stages(other, &format!("{enable}, \"OUT C2\"")))
        .scans(2)
        .holds([("Work.Running", 0), ("Y0", 0)]);
}

#[test]
fn a_bit_that_is_no_longer_driven_turns_off_only_if_its_coil_executed() {
    let main = "{ when = [\"$On\"], do = [\"OUT Y2\"] },";
    let drain = |text: &str| {
        DRAIN.replacen("rung = [", &format!("rung = [ {main}"), 1).replace("OUT Y2\", \"TMR", text)
    };
    main_with(&drain("OUT C7\", \"OUT Y1\", \"TMR"))
        .scan(&[("X0", 1)])
        .main(&drain("TMR"))
        .says("C7 is not driven in Drain any more")
        .holds([("Y2", 1)]);
    let both = |close: &str| drain(&format!("{close}TMR"));
    main_with(&both("OUT Y2\", \""))
        .scan(&[("X0", 1)])
        .main(&both(""))
        .says("Y2 is not driven in Drain any more")
        .holds([("Y2", 1)]);
}
