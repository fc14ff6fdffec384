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
fn running_programs_and_stages_that_are_on_go_on_by_name() {
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
fn a_program_that_is_gone_has_its_pass_first() {
    draining()
        .main(&format!("rung = [ {ON} ]"))
        .says("Program Drain is gone and was terminated")
        .holds([("Y0", 0), ("Y1", 0), ("Y2", 0), ("T0.Acc", 0), ("T0.Reset", 1)]);
}

#[test]
fn a_program_that_loses_the_stage_that_is_on_begins_at_its_first() {
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
fn an_instruction_that_moves_into_a_stage_that_is_off_is_terminated_there() {
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
fn an_autostart_program_that_is_new_starts_and_a_known_one_is_as_it_was() {
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
fn recurrent_timing_goes_on() {
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
fn an_edited_interval_counts_from_the_same_beginning() {
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
fn a_task_that_nothing_enables_any_more_is_disabled() {
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
fn a_task_that_goes_with_its_entask_ran() {
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
fn a_task_whose_entask_goes_with_its_program_is_disabled() {
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
fn an_entask_that_moves_into_a_stage_that_is_off_has_its_pass_there() {
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
fn what_is_not_driven_any_more_goes_off_only_if_it_executed() {
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
