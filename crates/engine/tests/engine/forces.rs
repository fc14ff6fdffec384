//! Forces, which no ladder can set: a forced bit or word keeps its value during the whole scan.
//! Inputs, queued writes and the writes of all instructions to it are discarded.

use proptest::prelude::*;
use rungd_runtime::{ScannedMachine, UnwiredInputs};

use rungd_test_support::plc::{Plc, plc};

/// Every instruction that writes bits or words, each to an operand of its own, in a Program that
/// can be halted. X1 drives every reset, X0 every other leg.
const ALL: &str = r#"
rung = [ { when = ["X8"], do = ["RUN P"] }, { when = ["X9"], do = ["HALT P"] } ]
[[program]]
name = "P"
autostart = true
rung = [
  { when = ["X0"], do = ["OUT C0", "SET C1", "RST C2", "PD C3", "ND C4", "PONOFF C5"] },
  { leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT CT0 preset=1"] },
  { leg.dn = ["X0"], leg.rst = ["X1"], do = ["CNTDN CT1 preset=1"] },
  { leg.up = ["X0"], leg.dn = ["$Off"], leg.rst = ["X1"], do = ["UDC CT2 up-preset=1 dn-preset=0"] },
  { leg.up = ["X0"], leg.dn = ["$Off"], do = ["UDCG CT3 up-preset=1 dn-preset=0"] },
  { when = ["X0"], do = ["ONDTMR T0 preset=10ms output=Y0", "OFFDTMR T1 preset=10ms output=Y1"] },
  { when = ["X0"], do = ["TMR T2 preset=10ms", "TMRDOWN T3 preset=10ms", "TMRAG T6 preset=10ms"] },
  { leg.en = ["X0"], leg.rst = ["X1"], do = ["TMRA T4 preset=10ms"] },
  { leg.en = ["X0"], leg.rst = ["X1"], do = ["TMRADOWN T5 preset=10ms"] },
  { when = ["X0"], do = ["CTU N0 preset=D9", "CTD N1 preset=1", "CTD N2 preset=1"] },
  { when = ["X1"], do = ["RES N2"] },
  { when = ["X0"], do = ["MOVE 3 to=D0", "ADD 1 3 to=D1", "SUB 1 3 to=D2"] },
  { when = ["X1"], do = ["RSTCT CT3", "RSTT T6", "RSTCT CT0", "RSTT T2"] },
]
"#;

const BITS: [&str; 42] = [
    "C0",
    "C1",
    "C2",
    "C3",
    "C4",
    "C5",
    "Y0",
    "Y1",
    "CT0.Done",
    "CT0.Reset",
    "CT0.Zero",
    "CT0.DnDone",
    "CT1.Done",
    "CT1.Reset",
    "CT1.Zero",
    "CT2.Done",
    "CT2.Reset",
    "CT2.DnDone",
    "CT3.Done",
    "CT3.Reset",
    "CT3.DnDone",
    "T0.Done",
    "T0.Reset",
    "T0.Timing",
    "T1.Done",
    "T1.Reset",
    "T1.Timing",
    "T2.Done",
    "T2.Reset",
    "T2.Zero",
    "T3.Done",
    "T3.Timing",
    "T4.Done",
    "T4.Reset",
    "T5.Reset",
    "T6.Reset",
    "N0.CU",
    "N0.DN",
    "N1.CD",
    "N2.DN",
    "N0.OV",
    "N1.UN",
];

const WORDS: [&str; 17] = [
    "D0", "D1", "D2", "CT0.Acc", "CT1.Acc", "CT2.Acc", "CT3.Acc", "T0.Acc", "T1.Acc", "T2.Acc",
    "T3.Acc", "T4.Acc", "T5.Acc", "T6.Acc", "N0.ACC", "N1.ACC", "N0.PRE",
];

/// Runs scans with counting, resetting, timing and a termination pass, and then a stop. `watch` is
/// called after every scan and after the stop.
fn through_everything(plc: &mut Plc, mut watch: impl FnMut(&Plc, u32)) {
    for scan in 0..24u32 {
        let (x0, x1) = (i32::from(scan % 3 != 0), i32::from(scan % 7 == 5));
        let (run, halt) = (i32::from(scan == 16), i32::from(scan == 14));
        plc.scan(&[("X0", x0), ("X1", x1), ("X8", run), ("X9", halt)]);
        watch(plc, scan);
    }
    plc.stop();
    watch(plc, 24);
}

#[test]
fn a_forced_bit_keeps_its_value_against_every_instruction_and_pass() {
    for value in [0, 1] {
        for name in BITS {
            let mut plc = plc(ALL);
            plc.force(name, value);
            through_everything(&mut plc, |plc, scan| {
                assert_eq!(plc.value(name), i64::from(value), "{name} in scan {scan}");
            });
        }
    }
}

#[test]
fn a_forced_word_keeps_its_value_against_every_instruction_and_pass() {
    for value in [-7, 0, 5000] {
        for name in WORDS {
            let mut plc = plc(ALL);
            plc.force(name, value);
            through_everything(&mut plc, |plc, scan| {
                assert_eq!(plc.value(name), i64::from(value), "{name} in scan {scan}");
            });
        }
    }
}

#[test]
fn a_force_does_not_affect_other_cells() {
    let watched = || BITS.iter().chain(&WORDS);
    let mut free = plc(ALL);
    let mut other_forced = plc(ALL);
    other_forced.force("C77", 1);
    let mut rows = Vec::new();
    through_everything(&mut free, |plc, _| {
        rows.push(watched().map(|name| plc.value(name)).collect::<Vec<_>>());
    });
    through_everything(&mut other_forced, |plc, scan| {
        let row: Vec<i64> = watched().map(|name| plc.value(name)).collect();
        assert_eq!(row, rows[scan as usize], "scan {scan}");
    });
}

#[test]
fn inputs_do_not_change_forced_cells() {
    let mut plc = plc(r#"rung = [ { when = ["X0"], do = ["OUT Y0"] } ]"#);
    plc.force("X0", 1);
    plc.scan(&[("X0", 0)]);
    assert_eq!(plc.values(["X0", "Y0"]), [1, 1]);
    plc.force("X0", 0);
    plc.scan(&[("X0", 1)]);
    assert_eq!(plc.values(["X0", "Y0"]), [0, 0]);
}

#[test]
fn queued_writes_do_not_change_forced_cells() {
    let mut plc = plc(r#"rung = [ { when = ["C0", "D0 == 4"], do = ["OUT Y0"] } ]"#);
    plc.force("C0", 1);
    plc.force("D0", 4);
    plc.scan(&[("C0", 0), ("D0", 9)]);
    assert_eq!(plc.values(["C0", "D0", "Y0"]), [1, 4, 1]);
}

#[test]
fn a_released_cell_keeps_its_value_until_something_writes_it() {
    let mut plc = plc(r#"rung = [ { when = ["X0"], do = ["MOVE 1 to=D0", "SET C0"] } ]"#);
    plc.force("D0", 9);
    plc.force("C0", 0);
    plc.scan(&[("X0", 1)]);
    assert_eq!(plc.values(["D0", "C0"]), [9, 0]);
    plc.release("D0");
    plc.release("C0");
    assert_eq!(plc.values(["D0", "C0"]), [9, 0]);
    plc.scan(&[("X0", 0)]);
    assert_eq!(plc.values(["D0", "C0"]), [9, 0]);
    plc.scan(&[("X0", 1)]);
    assert_eq!(plc.values(["D0", "C0"]), [1, 1]);
}

#[test]
fn later_rungs_read_the_forced_value_of_a_coil() {
    let main = r#"rung = [
      { when = ["X0"], do = ["OUT C0"] },
      { when = ["C0"], do = ["OUT Y0"] },
    ]"#;
    let mut plc = plc(main);
    plc.force("C0", 1);
    plc.scan(&[]);
    assert_eq!(plc.value("Y0"), 1);
}

#[test]
fn the_flags_of_a_counter_follow_its_forced_accumulator() {
    let main = r#"rung = [ { leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT CT0 preset=5"] } ]"#;
    let mut plc = plc(main);
    plc.force("CT0.Acc", 5);
    plc.scan(&[("X0", 1), ("X1", 0)]);
    assert_eq!(plc.values(["CT0.Acc", "CT0.Done", "CT0.Zero"]), [5, 1, 0]);
    plc.scan(&[("X1", 1)]);
    assert_eq!(plc.values(["CT0.Acc", "CT0.Done", "CT0.Zero", "CT0.Reset"]), [5, 1, 0, 1]);
    plc.force("CT0.Acc", 0);
    plc.scan(&[("X0", 0), ("X1", 0)]);
    plc.scan(&[("X0", 1)]);
    assert_eq!(plc.values(["CT0.Acc", "CT0.Done", "CT0.Zero"]), [0, 0, 1]);
    plc.release("CT0.Acc");
    plc.scan(&[("X0", 0)]);
    plc.scan(&[("X0", 1)]);
    assert_eq!(plc.value("CT0.Acc"), 1);
}

#[test]
fn the_flags_of_a_timer_follow_its_forced_accumulator() {
    let main = r#"rung = [
      { when = ["$On"], do = ["ONDTMR T0 preset=30ms output=Y0", "TMRDOWN T1 preset=30ms"] },
    ]"#;
    let mut plc = plc(main);
    plc.force("T0.Acc", 30);
    plc.force("T1.Acc", 0);
    plc.scan(&[]);
    assert_eq!(plc.values(["T0.Done", "T0.Zero", "Y0", "T1.Done", "T1.Timing"]), [1, 0, 1, 1, 0]);
    plc.force("T0.Acc", 0);
    plc.force("T1.Acc", 8);
    plc.scans(9);
    assert_eq!(plc.values(["T0.Done", "T0.Zero", "Y0", "T1.Done", "T1.Timing"]), [0, 1, 0, 0, 1]);
    plc.release("T0.Acc");
    plc.scan(&[]);
    assert_eq!(plc.value("T0.Acc"), 10);
}

#[test]
fn an_off_delay_timer_with_a_forced_accumulator_keeps_timing() {
    let main = r#"rung = [ { when = ["X0"], do = ["OFFDTMR T0 preset=30ms output=Y0"] } ]"#;
    let mut plc = plc(main);
    plc.scan(&[("X0", 1)]);
    plc.scan(&[("X0", 0)]);
    plc.force("T0.Acc", 5);
    plc.scans(6);
    assert_eq!(plc.values(["T0.Acc", "T0.Timing", "T0.Done", "Y0"]), [5, 1, 0, 1]);
    plc.force("T0.Acc", 0);
    plc.scan(&[]);
    assert_eq!(plc.values(["T0.Acc", "T0.Timing", "T0.Done", "Y0"]), [0, 0, 1, 0]);
}

#[test]
fn the_done_bit_of_a_sensaphone_counter_follows_its_forced_accumulator() {
    let mut plc = plc(r#"rung = [ { when = ["X0"], do = ["CTU N0 preset=3"] } ]"#);
    plc.force("N0.ACC", 3);
    plc.scan(&[("X0", 1)]);
    assert_eq!(plc.values(["N0.ACC", "N0.DN", "N0.CU"]), [3, 1, 1]);
    plc.force("N0.PRE", 9);
    plc.scan(&[]);
    assert_eq!(plc.values(["N0.ACC", "N0.DN"]), [3, 0]);
}

#[test]
fn forces_active_is_on_while_anything_is_forced() {
    let mut plc = plc(r#"rung = [ { when = ["$ForcesActive"], do = ["OUT Y0"] } ]"#);
    plc.scan(&[]);
    assert_eq!(plc.values(["ST9", "Y0"]), [0, 0]);
    plc.force("C5", 0);
    plc.force("D5", 0);
    plc.force("C5", 1);
    assert_eq!(plc.engine.image().forces(), 2);
    plc.scan(&[]);
    assert_eq!(plc.values(["ST9", "Y0"]), [1, 1]);
    plc.release("C5");
    plc.release("C5");
    plc.scan(&[]);
    assert_eq!(plc.values(["ST9", "Y0"]), [1, 1]);
    plc.release("D5");
    plc.release("D5");
    assert_eq!(plc.engine.image().forces(), 0);
    plc.scan(&[]);
    assert_eq!(plc.values(["ST9", "Y0"]), [0, 0]);
}

#[test]
fn forces_active_follows_at_once_outside_run() {
    let mut plc =
        rungd_test_support::plc::stopped(r#"rung = [ { when = ["X0"], do = ["OUT Y0"] } ]"#);
    assert_eq!(plc.value("ST9"), 0);
    plc.force("C5", 1);
    assert_eq!(plc.value("ST9"), 1);
    plc.release("C5");
    assert_eq!(plc.value("ST9"), 0);
}

#[test]
fn a_forced_status_bit_or_word_keeps_its_value() {
    let mut plc = plc(r#"rung = [ { when = ["$FirstScan"], do = ["OUT Y0"] } ]"#);
    plc.force("$FirstScan", 1);
    plc.force("DST0", 77);
    plc.scans(3);
    assert_eq!(plc.values(["ST0", "Y0", "DST0"]), [1, 1, 77]);
}

proptest! {
    /// The scanner sets inputs 64 at a time, and skips those that already have their value: all end
    /// as if they were set one by one, forced inputs and those of devices included.
    #[test]
    fn setting_64_inputs_at_once_equals_setting_each_input(
        before: u64, values: u64, given: u64, forced: u64,
    ) {
        let bit = |of: u64, at: u32| of >> at & 1 != 0;
        let mut plc = rungd_test_support::plc::stopped("");
        for at in 0..64 {
            plc.engine.set_input(64 + at, bit(before, at));
            if bit(forced, at) {
                plc.force(&format!("X{}", 64 + at), i32::from(bit(before, at)));
            }
        }
        ScannedMachine::set_inputs(&mut plc.engine, UnwiredInputs { first: 64, values, given });
        let expected = values & given & !forced | before & !(given & !forced);
        for at in 0..64 {
            let name = format!("X{}", 64 + at);
            prop_assert_eq!(plc.value(&name) != 0, bit(expected, at), "{}", name);
        }
        prop_assert_eq!([plc.value("X63"), plc.value("X128")], [0, 0]);
    }
}
