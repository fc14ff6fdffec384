//! What a reload keeps, terminates and begins anew: a named case for every rule of
//! `docs/semantics.md`, section 4, *Reload*; and properties over random programs.

use crate::support::plc::Plc;
use crate::support::run;
use rungd::engine::{Cell, Engine};
use rungd::lower::lower;
use rungd::reload::{ReloadPlan, Seen, Side};

/// A controller that is reloaded in the middle.
struct Reloaded {
    plc: Plc,
    forces: Vec<Cell>,
    report: Vec<String>,
}

fn plc(ladder: &str) -> Reloaded {
    let program = run::load(ladder).unwrap_or_else(|errors| panic!("{errors}"));
    let (engine_program, symbols) = lower(&program);
    let mut engine = Engine::new(engine_program);
    engine.start(0);
    let times = rungd::engine::ScanTimes::default();
    let plc = Plc { program, symbols, engine, now_ns: 0, period_ns: 10_000_000, times };
    Reloaded { plc, forces: Vec::new(), report: Vec::new() }
}

/// Main with these rungs.
fn main_with(rungs: &str) -> Reloaded {
    plc(&main_text(rungs))
}

fn main_text(rungs: &str) -> String {
    format!("[[program]]\nname = \"Main\"\n{rungs}")
}

impl Reloaded {
    fn scan(mut self, changes: &[(&str, i32)]) -> Self {
        self.plc.scan(changes);
        self
    }

    fn scans(mut self, count: u32) -> Self {
        self.plc.scans(count);
        self
    }

    fn force(mut self, name: &str, value: i32) -> Self {
        self.plc.force(name, value);
        self.forces.push(self.plc.cell(name));
        self
    }

    fn main(self, rungs: &str) -> Self {
        self.reload(&main_text(rungs))
    }

    fn reload(mut self, ladder: &str) -> Self {
        let program = run::load(ladder).unwrap_or_else(|errors| panic!("{errors}"));
        let (engine_program, symbols) = lower(&program);
        let plan = ReloadPlan::new(
            Side { program: self.plc.engine.program(), symbols: &self.plc.symbols },
            Side { program: &engine_program, symbols: &symbols },
        );
        let image = self.plc.engine.image();
        let (bits, words) = (image.bits().to_vec(), image.words().to_vec());
        let seen = Seen { bits: &bits, words: &words, forces: &self.forces, passed: None };
        let forecast = plan.report(&seen);
        let mut engine = Engine::new(engine_program);
        engine.adopt(&mut self.plc.engine, &plan.transfer, true, &self.forces);
        let passed = Some(self.plc.engine.image().bits());
        self.report = plan.report(&Seen { passed, ..seen });
        assert_eq!(forecast, self.report, "what a dry run says is what is done");
        self.forces = self.forces.iter().filter_map(|c| plan.transfer.cell(*c)).collect();
        (self.plc.engine, self.plc.program, self.plc.symbols) = (engine, program, symbols);
        self
    }

    #[track_caller]
    fn holds<const N: usize>(self, expected: [(&str, i64); N]) -> Self {
        let found = expected.map(|(name, _)| (name, self.plc.value(name)));
        assert_eq!(found, expected);
        self
    }

    #[track_caller]
    fn says(self, words: &str) -> Self {
        assert!(self.report.iter().any(|line| line == words), "{words}: {:#?}", self.report);
        self
    }
}

const ON: &str = "{ when = [\"$On\"], do = [\"OUT C99\"] },";

fn cnt(preset: &str) -> String {
    format!(
        "rung = [ {{ leg.up = [\"X0\"], leg.rst = [\"X1\"], do = [\"CNT CT0 preset={preset}\"] }} ]"
    )
}

fn counted() -> Reloaded {
    main_with(&cnt("12")).scan(&[("X0", 1)]).scan(&[("X0", 0)]).scan(&[("X0", 1)])
}

#[test]
fn an_edited_preset_keeps_the_count() {
    counted()
        .main(&cnt("2"))
        .says("preset of CT0 12 → 2")
        .says("CT0 keeps 2 of 2")
        .holds([("CT0.Acc", 2), ("CT0.Done", 0)])
        .scan(&[])
        .holds([("CT0.Acc", 2), ("CT0.Done", 1)]);
}

#[test]
fn a_leg_that_was_on_does_not_count_again() {
    counted().main(&cnt("3")).scan(&[("X0", 1)]).holds([("CT0.Acc", 2)]);
}

#[test]
fn a_structure_follows_its_address_whatever_else_of_the_rung_was_edited() {
    counted()
        .main(&format!(
            "rung = [ {ON} {{ leg.up = [\"X0\", \"!X7\"], leg.rst = [\"X5\"], do = [\"CNT CT0 preset=D3\"] }} ]"
        ))
        .scan(&[("X0", 1)])
        .holds([("CT0.Acc", 2)])
        .scan(&[("X0", 0)])
        .scan(&[("X0", 1)])
        .holds([("CT0.Acc", 3)]);
}

#[test]
fn another_mnemonic_terminates_the_old_and_begins_anew() {
    counted()
        .main("rung = [ { leg.dn = [\"X0\"], leg.rst = [\"X1\"], do = [\"CNTDN CT0 preset=5\"] } ]")
        .says("CT0 begins anew: CNTDN in Main, was CNT in Main")
        .holds([("CT0.Acc", 0), ("CT0.Reset", 0)])
        .scan(&[("X0", 0)])
        .holds([("CT0.Acc", 5)]);
}

#[test]
fn another_block_begins_anew() {
    let side =
        format!("rung = [ {ON} ]\n[[program]]\nname = \"Side\"\nautostart = true\n{}", cnt("12"));
    counted()
        .main(&side)
        .says("CT0 begins anew: CNT in Side, was CNT in Main")
        .says("Program Side is new, and starts")
        .holds([("CT0.Acc", 0)]);
}

#[test]
fn a_counter_that_is_gone_is_terminated_and_udcg_is_not() {
    let udcg = "{ leg.up = [\"X0\"], leg.dn = [\"X2\"], do = [\"UDCG CT1 up-preset=5\"] }";
    let both = format!(
        "rung = [ {{ leg.up = [\"X0\"], leg.rst = [\"X1\"], do = [\"CNT CT0 preset=5\"] }}, {udcg} ]"
    );
    main_with(&both)
        .scan(&[("X0", 1)])
        .holds([("CT0.Acc", 1), ("CT1.Acc", 1)])
        .main(&format!("rung = [ {ON} ]"))
        .says("CT0 is gone: CNT in Main")
        .holds([("CT0.Acc", 0), ("CT0.Reset", 1), ("CT1.Acc", 1)]);
}

#[test]
fn a_new_structure_is_as_after_a_cold_start() {
    main_with(&format!("rung = [ {ON} ]"))
        .scan(&[("CT0.Acc", 7)])
        .main(&cnt("5"))
        .says("CT0 is new")
        .holds([("CT0.Acc", 0)]);
}

#[test]
fn a_timer_goes_on_timing() {
    let tmr = |preset| {
        format!("rung = [ {{ when = [\"X0\"], do = [\"ONDTMR T3 preset={preset} output=Y0\"] }} ]")
    };
    main_with(&tmr("10s"))
        .scan(&[("X0", 1)])
        .scans(420)
        .main(&tmr("4210ms"))
        .says("T3 keeps 4.2 s of 4.21 s")
        .says("preset of T3 10 s → 4.21 s")
        .holds([("T3.Timing", 1), ("Y0", 0)])
        .scan(&[])
        .holds([("T3.Acc", 4210), ("Y0", 1)]);
}

#[test]
fn a_pending_reset_stays_pending() {
    let rungs = |text: &str| format!("rung = [ {text} ]");
    let count = "{ leg.up = [\"X0\"], leg.rst = [\"X1\"], do = [\"CNT CT0 preset=9\"] },";
    let reset = "{ when = [\"X2\"], do = [\"RSTCT CT0\"] },";
    main_with(&rungs(&format!("{count}{reset}")))
        .scan(&[("X0", 0), ("X2", 1)])
        .main(&rungs(&format!("{ON}{count}")))
        .scan(&[("X0", 1), ("X2", 0)])
        .holds([("CT0.Acc", 0), ("CT0.Reset", 1)])
        .scan(&[("X0", 0)])
        .scan(&[("X0", 1)])
        .holds([("CT0.Acc", 1)]);
}

#[test]
fn an_off_delay_goes_on_timing_down() {
    let rungs = |more: &str| {
        format!(
            "rung = [ {more} {{ when = [\"X0\"], do = [\"OFFDTMR T0 preset=50ms output=Y1\"] }} ]"
        )
    };
    main_with(&rungs(""))
        .scan(&[("X0", 1)])
        .scan(&[("X0", 0)])
        .scans(2)
        .main(&rungs(ON))
        .scan(&[])
        .holds([("T0.Acc", 20), ("Y1", 1)])
        .scans(2)
        .holds([("T0.Acc", 0), ("Y1", 0)]);
}

#[test]
fn a_contact_history_follows_its_text() {
    let rung = |n: u32| format!("{{ when = [\"rise(X{n})\"], do = [\"ADD D{n} 1 to=D{n}\"] }},");
    main_with(&format!("rung = [ {} ]", rung(0)))
        .scan(&[("X0", 1), ("X1", 1)])
        .main(&format!("rung = [ {} {} ]", rung(1), rung(0)))
        .scan(&[])
        .holds([("D0", 1), ("D1", 1)]);
}

#[test]
fn a_contact_history_follows_the_name_of_its_rung() {
    let rung = |contact: &str| {
        format!(
            "rung = [ {{ name = \"count\", when = [\"{contact}\"], do = [\"ADD D0 1 to=D0\"] }} ]"
        )
    };
    main_with(&rung("rise(X0)"))
        .scan(&[("X0", 1), ("X1", 1)])
        .main(&rung("rise(X1)"))
        .scan(&[])
        .holds([("D0", 1)]);
}

/// Unnamed rungs, each with this contact and one instruction.
fn rungs(of: &[(&str, &str)]) -> String {
    let rung =
        |(when, run): &(&str, &str)| format!("{{ when = [\"{when}\"], do = [\"{run}\"] }},\n");
    format!("rung = [ {} ]", of.iter().map(rung).collect::<String>())
}

const NONE: &str = "no difference in what the program does";
const ADD: (&str, &str) = ("rise(X0)", "ADD D0 1 to=D0");
const SET: (&str, &str) = ("rise(X0)", "SET C1");

#[test]
fn a_rung_that_is_put_before_others_has_none_of_them_fire() {
    let new = ("rise(X0)", "SET C7");
    for after in [[new, ADD, SET], [ADD, new, SET], [ADD, SET, new]] {
        main_with(&rungs(&[ADD, SET]))
            .scan(&[("X0", 1)])
            .scan(&[("C1", 0)])
            .main(&rungs(&after))
            .scan(&[])
            .holds([("D0", 1), ("C1", 0), ("C7", 0)])
            .scan(&[("X0", 0)])
            .scan(&[("X0", 1)])
            .holds([("D0", 2), ("C1", 1), ("C7", 1)]);
    }
}

#[test]
fn a_new_fall_sees_what_the_one_beside_it_saw() {
    let fall = ("fall(X0)", "ADD D0 1 to=D0");
    main_with(&rungs(&[fall]))
        .scan(&[("X0", 1)])
        .main(&rungs(&[("fall(X0)", "SET C7"), fall]))
        .scan(&[("X0", 0)])
        .holds([("D0", 1), ("C7", 1)]);
}

#[test]
fn instructions_of_rungs_that_nobody_edited_keep_their_own_history() {
    let (a, b) = (("X0", "PONOFF C0"), ("X1", "PONOFF C0"));
    main_with(&rungs(&[a, b]))
        .scan(&[("X0", 1)])
        .holds([("C0", 1)])
        .main(&rungs(&[("X2", "PONOFF C0"), a, b]))
        .scan(&[])
        .holds([("C0", 1)])
        .scan(&[("X1", 1)])
        .holds([("C0", 0)]);
}

#[test]
fn a_history_follows_the_name_of_its_rung_only_to_its_own_kind() {
    let check = |was: &str, is: &str, scan: &[(&str, i32)], fires: i64| {
        let rung = |when: &str| {
            let named = format!("name = \"n\", when = [{when}]");
            format!("rung = [ {{ {named}, do = [\"ADD D0 1 to=D0\"] }} ]")
        };
        main_with(&rung(was))
            .scan(&[("X0", 1)])
            .scan(&[("D0", 0)])
            .main(&rung(is))
            .scan(scan)
            .holds([("D0", fires)]);
    };
    check("\"rise(X0)\"", "\"fall(X1)\"", &[], 0);
    check("\"rise(X0)\"", "\"fall(X0)\"", &[], 0);
    // A `fall` has seen its own bit alone.
    check("\"fall(X0)\"", "\"fall(X1)\"", &[], 0);
    check("\"rise(X0)\"", "\"rise(X1)\"", &[("X1", 1)], 0);
    check("\"rise(X0)\"", "\"!rise(X5)\", \"rise(X0)\"", &[], 0);
    check("\"fall(X0)\", \"!X7\"", "\"fall(X0)\"", &[("X0", 0)], 1);
}

#[test]
fn a_new_contact_history_is_off() {
    let rung = |contact: &str| {
        format!("rung = [ {{ when = [\"{contact}\"], do = [\"ADD D0 1 to=D0\"] }} ]")
    };
    main_with(&rung("rise(X0)"))
        .scan(&[("X0", 1), ("X1", 1)])
        .main(&rung("rise(X1)"))
        .scan(&[])
        .holds([("D0", 2)]);
}

#[test]
fn instructions_with_a_history_keep_it() {
    let rungs = |more: &str| {
        format!(
            "rung = [ {more} {{ when = [\"X0\"], do = [\"PONOFF C0\", \"PD C1\", \"ND C2\"] }} ]"
        )
    };
    main_with(&rungs(""))
        .scan(&[("X0", 1)])
        .main(&rungs(ON))
        .scan(&[])
        .holds([("C0", 1), ("C1", 0), ("C2", 0)])
        .scan(&[("X0", 0)])
        .holds([("C0", 1), ("C2", 1)]);
}

#[test]
fn an_output_that_nothing_drives_any_more_goes_off_and_set_bits_stay() {
    main_with("rung = [ { when = [\"$On\"], do = [\"OUT Y0\", \"SET C5\", \"OUT Y1\"] } ]")
        .scans(1)
        .main("rung = [ { when = [\"Y0\"], do = [\"OUT C1\"] }, { when = [\"Y1\"], do = [\"OUT C2\"] }, { when = [\"$On\"], do = [\"OUT Y1\"] } ]")
        .says("Y0 is not driven in Main any more, and goes OFF")
        .scan(&[])
        .holds([("Y0", 0), ("C5", 1), ("C1", 0), ("C2", 1)]);
}

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
        .says("Program Drain goes on running")
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

#[test]
fn a_tag_that_moves_leaves_its_value_behind_and_the_report_warns() {
    let main = main_text(
        "rung = [ { when = [\"Level == 5\", \"count.Done\", \"V20 == 3\"], do = [\"OUT Y0\"] }, { leg.up = [\"X0\"], leg.rst = [\"$Off\"], do = [\"CNT count preset=9\"] } ]",
    );
    let tags = |level: &str, count: &str| {
        format!(
            "[tags]\neye = {{ at = \"X{level}\" }}\nLevel = {{ at = \"V{level}\" }}\n\
             count = {{ at = \"{count}\" }}\n{main}"
        )
    };
    plc(&tags("10", "CT0"))
        .scan(&[("V10", 17), ("V20", 3), ("X0", 1)])
        .reload(&tags("20", "CT1"))
        .says("tag eye moved from X10 to X20")
        .says("warning: tag Level moved from V10 to V20: V20 keeps its own value 3; V10's was 17")
        .says("warning: tag count moved from CT0 to CT1: CT1 begins at 0; CT0's was 1")
        .holds([("V20", 3), ("CT1.Acc", 0)])
        .scan(&[("V20", 17)])
        .reload(&tags("10", "CT1"))
        .says("tag Level moved from V20 to V10: both are 17");
}

#[test]
fn a_force_that_stays_behind_its_tag_is_said() {
    let ladder = |fan: &str, heater: &str| {
        let tags =
            format!("[tags]\nfan = {{ at = \"{fan}\" }}\nheater = {{ at = \"{heater}\" }}\n");
        tags + &main_text(&rungs(&[("X0", "OUT fan"), ("X1", "OUT heater")]))
    };
    plc(&ladder("Y2", "Y3")).force("Y2", 0).scan(&[]).reload(&ladder("Y5", "Y2")).says(
        "warning: tag fan moved from Y2 to Y5: Y5 keeps its own value OFF; Y2's was OFF \
             (forced); the force stays on Y2, which is heater now; fan (Y5) is not forced",
    );
}

#[test]
fn a_bit_that_stays_on_and_that_no_rung_writes_is_a_warning() {
    let set = [("X0", "SET Y0"), ("X0", "SET C5"), ("X0", "OUT Y1"), ("X1", "RST C6")];
    let plc = main_with(&rungs(&set)).scan(&[("X0", 1)]).main(&rungs(&[("X1", "RST C5")]));
    let warnings: Vec<_> = plc.report.iter().filter(|l| l.starts_with("warning: ")).collect();
    assert_eq!(warnings, ["warning: Y0 stays ON, and no rung writes it any more"]);
    plc.scan(&[]).holds([("Y0", 1)]);
}

#[test]
fn a_value_beyond_new_limits_is_a_warning() {
    let tagged = |limits: &str| {
        let tags = format!("[tags]\nsize = {{ at = \"D1\"{limits} }}\n");
        tags + &main_text(&rungs(&[("size == 5", "OUT Y0")]))
    };
    let plc = |value: i32| plc(&tagged("")).scan(&[("D1", value)]);
    plc(17).reload(&tagged(", min = 0, max = 10")).says(
        "warning: size (D1) keeps 17, which is not within 0 to 10, its limits now; a restart \
         would drop it",
    );
    assert_eq!(plc(10).reload(&tagged(", min = 0, max = 10")).report, [NONE]);
}

#[test]
fn a_tag_of_another_name_is_said() {
    let tagged = |tag: &str| {
        let tags = format!("[tags]\n{tag} = {{ at = \"D1\" }}\n");
        tags + &main_text(&rungs(&[("D1 == 5", "OUT Y0")]))
    };
    assert_eq!(plc(&tagged("a")).reload(&tagged("b")).report, ["tag a (D1) is called b now"]);
}

#[test]
fn rungs_are_counted() {
    let (a, b, c) = (("X0", "OUT C0"), ("X1", "OUT C1"), ("X2", "OUT C2"));
    let said = |was: &[(&str, &str)], is: &[(&str, &str)]| {
        main_with(&rungs(was)).main(&rungs(is)).report.join("; ")
    };
    assert_eq!(said(&[a, b], &[a, b]), NONE);
    assert_eq!(said(&[a, b], &[b, a]), "the rungs are in another order");
    assert_eq!(said(&[a, b], &[a, c, b]), "0 rungs edited, 1 new, 0 gone");
    assert_eq!(said(&[a, b], &[a, ("X5", "OUT C1")]), "1 rung edited, 0 new, 0 gone");
    assert_eq!(said(&[a, ("X7", "SET C3")], &[a]), "0 rungs edited, 0 new, 1 gone");
}

#[test]
fn an_initial_of_what_is_forced_is_not_put_there() {
    let tagged = "[tags]\nsize = { at = \"D1\", initial = 4 }\n";
    let main = main_text("rung = [ { when = [\"D2 == 5\"], do = [\"OUT Y0\"] } ]");
    plc(&main)
        .force("D1", 7)
        .scan(&[])
        .reload(&format!("{tagged}{}", main.replace("D2", "size")))
        .says("size (D1) is new: 4, but stays 7 (forced)")
        .holds([("D1", 7)]);
}

#[test]
fn data_is_kept_by_address_and_what_is_new_takes_its_initial() {
    let tagged =
        "[tags]\nsize = { at = \"D1\", initial = 12 }\nlot = { at = \"D2\", initial = 7 }\n";
    let old = main_text("rung = [ { when = [\"D2 == 5\"], do = [\"OUT Y0\"] } ]");
    let new = main_text("rung = [ { when = [\"D2 == size\", \"lot > 1\"], do = [\"OUT Y0\"] } ]");
    plc(&old)
        .scan(&[("D2", 5), ("D9", 3)])
        .reload(&format!("{tagged}{new}"))
        .says("size (D1) is new: 12")
        .holds([("D1", 12), ("D2", 5), ("D9", 3)]);
}

#[test]
fn forces_survive() {
    main_with(&cnt("5"))
        .force("Y3", 1)
        .force("D7", 42)
        .scan(&[])
        .main(&format!("{}\n[[task]]\nname = \"T\"\nrung = [ {{ when = [\"$On\"], do = [\"MOVE 1 to=D7\", \"OUT Y3\"] }} ]", cnt("6")))
        .scan(&[("Y3", 0), ("D7", 1)])
        .holds([("Y3", 1), ("D7", 42), ("$ForcesActive", 1)]);
}

#[test]
fn a_sensaphone_counter_goes_on_and_an_edited_preset_counts() {
    let up = |preset| format!("{{ when = [\"X0\"], do = [\"CTU N0 preset={preset}\"] }},");
    let down = "{ when = [\"X1\"], do = [\"CTD N0\"] },";
    main_with(&format!("rung = [ {} {down} ]", up(5)))
        .scan(&[("X0", 1), ("X1", 1)])
        .scan(&[("X0", 0)])
        .scan(&[("X0", 1)])
        .holds([("N0.ACC", 1), ("N0.PRE", 5), ("N0.CD", 1)])
        .main(&format!("rung = [ {} ]", up(8)))
        .scan(&[])
        .holds([("N0.ACC", 1), ("N0.PRE", 8), ("N0.CD", 0)]);
}

#[test]
fn a_sensaphone_preset_that_was_written_stays_where_the_constant_does() {
    let up =
        |more: &str| format!("rung = [ {more} {{ when = [\"X0\"], do = [\"CTU N0 preset=5\"] }} ]");
    main_with(&up("")).scan(&[("N0.PRE", 9)]).main(&up(ON)).scan(&[]).holds([("N0.PRE", 9)]);
}

#[test]
fn first_scan_is_over_and_status_goes_on() {
    let first = "rung = [ { when = [\"$FirstScan\"], do = [\"ADD D0 1 to=D0\"] } ]\n[[task]]\nname = \"FirstScan\"\nrung = [ { when = [\"$On\"], do = [\"ADD D1 1 to=D1\"] } ]";
    main_with(&format!("rung = [ {ON} ]")).scans(3).main(first).scans(2).holds([
        ("D0", 0),
        ("D1", 0),
        ("DST0", 4),
    ]);
}

#[test]
fn a_stop_that_was_asked_for_comes() {
    let stop = |more: &str| format!("rung = [ {more} {{ when = [\"X0\"], do = [\"STOP\"] }} ]");
    let mut reloaded = main_with(&stop("")).scan(&[("X0", 1)]).main(&stop(ON));
    assert!(reloaded.plc.scan(&[]).last);
}
