//! Alternation and lead/lag: the pump whose turn it is, and the pump that replaces it.

use super::{Bench, bench};

#[test]
fn two_outputs_take_turns() {
    let uses =
        r#"{ use = "Alternate", name = "a", with = { wanted = "X0", one = "Y0", other = "Y1" } },"#;
    let mut a = bench("alternate", "", uses);
    assert_eq!(a.run(100).bits(&["Y0", "Y1"]), "00");
    for turn in ["10", "01", "10", "01"] {
        assert_eq!(a.set("X0", 1).scan().bits(&["Y0", "Y1"]), turn);
        assert_eq!(a.run(1_000).bits(&["Y0", "Y1"]), turn, "no change while it is wanted");
        assert_eq!(a.set("X0", 0).scan().bits(&["Y0", "Y1"]), "00");
    }
    a.set("X0", 1).scan().set("X0", 0).scan();
    a.restart();
    assert_eq!(a.set("X0", 1).scan().bits(&["Y0", "Y1"]), "01", "a stop takes nobody's turn");
}

const RUNS: [&str; 3] = ["Y1", "Y2", "Y3"];

/// X11 to X13: one, two or three pumps are wanted. X1 to X3: the pumps are ready. Y1 to Y3: the
/// pumps run.
struct Pumps(Bench);

fn three() -> Pumps {
    let uses = r#"{ use = "LeadLag3", name = "l", with = {
        first = "X11", second = "X12", third = "X13", rotate = "X10",
        ready1 = "X1", ready2 = "X2", ready3 = "X3", run1 = "Y1", run2 = "Y2", run3 = "Y3" } },"#;
    all_ready(bench("lead-lag", "", &uses.replace('\n', " ")))
}

fn two() -> Pumps {
    let uses = r#"{ use = "LeadLag2", name = "l", with = { first = "X11", second = "X12",
        rotate = "X10", ready1 = "X1", ready2 = "X2", run1 = "Y1", run2 = "Y2" } },"#;
    all_ready(bench("lead-lag", "", &uses.replace('\n', " ")))
}

fn all_ready(mut bench: Bench) -> Pumps {
    bench.set("X1", 1).set("X2", 1).set("X3", 1).scan();
    Pumps(bench)
}

impl Pumps {
    /// Sets the number of pumps that are wanted, scans, and returns the pumps that run.
    fn wanted(&mut self, count: i32) -> String {
        for at in 1..=3 {
            self.0.set(&format!("X1{at}"), i32::from(count >= at));
        }
        self.runs()
    }

    /// Makes a pump ready or not ready, scans, and returns the pumps that run.
    fn ready(&mut self, pump: usize, ready: bool) -> String {
        self.0.set(&format!("X{pump}"), i32::from(ready));
        self.runs()
    }

    fn runs(&mut self) -> String {
        self.0.scan().bits(&RUNS)
    }
}

#[test]
fn the_lead_changes_after_each_cycle() {
    let mut pumps = three();
    for lead in ["100", "010", "001", "100", "010"] {
        assert_eq!(pumps.wanted(1), lead);
        pumps.0.run(1_000);
        assert_eq!(pumps.runs(), lead);
        assert_eq!(pumps.wanted(0), "000");
    }
    let mut pumps = two();
    for lead in ["100", "010", "100"] {
        assert_eq!(pumps.wanted(1), lead);
        assert_eq!(pumps.wanted(0), "000");
    }
}

#[test]
fn the_next_pump_in_turn_runs_while_more_pumps_are_wanted() {
    let mut pumps = three();
    for [one, two] in [["100", "110"], ["010", "011"], ["001", "101"]] {
        assert_eq!(pumps.wanted(1), one);
        assert_eq!(pumps.wanted(2), two);
        assert_eq!(pumps.wanted(3), "111");
        assert_eq!(pumps.wanted(2), two);
        assert_eq!(pumps.wanted(1), one, "the lead runs on to the end");
        assert_eq!(pumps.wanted(0), "000");
    }
    let mut pumps = two();
    for one in ["100", "010"] {
        assert_eq!(pumps.wanted(1), one);
        assert_eq!(pumps.wanted(2), "110");
        assert_eq!(pumps.wanted(1), one);
        assert_eq!(pumps.wanted(0), "000");
    }
}

/// If the high float is ON without the low float below it, a float is broken: the running pump is
/// not changed.
#[test]
fn the_turn_ends_when_no_pump_is_wanted() {
    for mut pumps in [two(), three()] {
        assert_eq!(pumps.wanted(2), "110");
        pumps.0.set("X11", 0);
        assert_eq!(pumps.runs(), "100", "one is wanted still: the lead");
        assert_eq!(pumps.0.int("l.lead"), 1);
        pumps.0.set("X12", 0).scan();
        assert_eq!(pumps.0.int("l.lead"), 2);
    }
}

#[test]
fn a_pump_that_fails_is_replaced_in_the_same_scan() {
    let mut pumps = three();
    assert_eq!(pumps.wanted(1), "100");
    assert_eq!(pumps.ready(1, false), "010");
    assert_eq!(pumps.ready(2, false), "001");
    assert!(!pumps.0.on("l.short"));
    assert_eq!(pumps.ready(3, false), "000");
    assert!(pumps.0.on("l.short"));
    assert_eq!(pumps.ready(2, true), "010");
    assert!(!pumps.0.on("l.short"));
    let mut pumps = two();
    assert_eq!(pumps.wanted(1), "100");
    assert_eq!(pumps.ready(1, false), "010");
    assert!(!pumps.0.on("l.short"));
    assert_eq!(pumps.wanted(2), "010");
    assert!(pumps.0.on("l.short"), "two are wanted, one can run");
}

#[test]
fn a_failed_lag_pump_is_replaced() {
    let mut pumps = three();
    assert_eq!(pumps.wanted(2), "110");
    assert_eq!(pumps.ready(2, false), "101");
    assert_eq!(pumps.wanted(3), "101");
    assert!(pumps.0.on("l.short"));
}

/// A flickering ready contact must not start and stop pumps at its pace.
#[test]
fn a_lead_pump_that_is_ready_again_waits_for_its_next_turn() {
    let mut pumps = three();
    assert_eq!(pumps.wanted(1), "100");
    assert_eq!(pumps.ready(1, false), "010");
    assert_eq!(pumps.ready(1, true), "010");
    assert_eq!(pumps.ready(1, false), "010");
    assert_eq!(pumps.ready(1, true), "010");
    assert_eq!(pumps.wanted(2), "011");
    let mut pumps = two();
    assert_eq!(pumps.wanted(1), "100");
    assert_eq!(pumps.ready(1, false), "010");
    assert_eq!(pumps.ready(1, true), "010");
    assert_eq!(pumps.wanted(2), "110");
}

/// If a pump is in manual, under repair or failed, the others share its turns.
#[test]
fn a_pump_that_is_not_ready_is_skipped() {
    let mut pumps = three();
    pumps.ready(1, false);
    for lead in ["010", "001", "010", "001"] {
        assert_eq!(pumps.wanted(1), lead);
        assert_eq!(pumps.wanted(2), "011");
        assert_eq!(pumps.wanted(0), "000");
    }
    pumps.ready(1, true);
    pumps.ready(3, false);
    for lead in ["100", "010", "100", "010"] {
        assert_eq!(pumps.wanted(1), lead);
        assert_eq!(pumps.wanted(0), "000");
    }
    let mut pumps = two();
    pumps.ready(2, false);
    for _ in 0..3 {
        assert_eq!(pumps.wanted(1), "100");
        assert_eq!(pumps.wanted(0), "000");
    }
}

/// If a pump is wanted for weeks, a clock gives its turn to the next pump.
#[test]
fn a_clock_can_change_the_lead_while_pumps_run() {
    let mut pumps = three();
    assert_eq!(pumps.wanted(2), "110");
    pumps.0.set("X10", 1);
    assert_eq!(pumps.runs(), "011");
    assert_eq!(pumps.runs(), "011", "at the rise alone");
    let mut pumps = two();
    assert_eq!(pumps.wanted(1), "100");
    pumps.0.set("X10", 1);
    assert_eq!(pumps.runs(), "010");
}

#[test]
fn the_turn_survives_a_stop() {
    for mut pumps in [two(), three()] {
        pumps.wanted(1);
        pumps.wanted(0);
        pumps.0.restart();
        assert_eq!(pumps.wanted(1), "010");
    }
}

/// Every state of three pumps, with each pump as the lead: the number of running pumps is the
/// number wanted, or the number ready if that is smaller.
#[test]
fn the_number_of_running_pumps_is_the_lesser_of_wanted_and_ready() {
    let mut pumps = three();
    for state in 0..3 * 8 * 4 {
        let (lead, ready, wanted) = (state % 3 + 1, state / 3 % 8, state / 24);
        pumps.wanted(0);
        pumps.0.set("l.lead", lead).scan();
        for pump in 0..3 {
            pumps.0.set(&format!("X{}", pump + 1), ready >> pump & 1);
        }
        let runs = pumps.wanted(wanted);
        let running = runs.matches('1').count();
        let most = i32::try_from(ready.count_ones()).expect("small");
        assert_eq!(
            i32::try_from(running),
            Ok(wanted.min(most)),
            "{lead} {ready:b} {wanted}: {runs}"
        );
        assert_eq!(pumps.0.on("l.short"), wanted > most, "{lead} {ready:b} {wanted}");
        for (pump, runs) in runs.chars().enumerate() {
            assert!(runs == '0' || ready >> pump & 1 == 1, "pump {} is not ready", pump + 1);
        }
    }
}
