//! Starting, stopping and starting again with memory unchanged; the scan times; the timestamps.

use rungd_base::calendar::LocalTime;
use rungd_engine::{EngineState, ScanTimes};
use rungd_test_support::plc::{plc, stopped};

#[test]
fn no_block_runs_before_the_start_and_the_on_bit_is_on() {
    let plc = stopped(r#"rung = [ { when = ["$On"], do = ["OUT Y0"] } ]"#);
    assert_eq!(plc.values(["Main.Running", "$On", "$FirstScan", "Y0"]), [0, 1, 0, 0]);
}

#[test]
fn a_change_from_stop_to_run_starts_with_unchanged_memory() {
    let main = r#"
rung = [
  { leg.up = ["$On"], leg.rst = ["$Off"], do = ["CNT CT0 preset=2"] },
  { leg.up = ["$On"], leg.dn = ["$Off"], do = ["UDCG CT1"] },
  { when = ["$On"], do = ["ADD D0 1 to=D0", "OUT Y0", "SET C0", "TMRAG T0 preset=1s"] },
  { when = ["X0"], do = ["RUN P"] },
]
[[program]]
name = "P"
rung = [ { when = ["$On"], do = ["ADD D1 1 to=D1"] } ]
[[program]]
name = "Q"
autostart = true
rung = [ { when = ["$On"], do = ["ADD D2 1 to=D2"] } ]
"#;
    let mut plc = plc(main);
    plc.scan(&[("X0", 1)]);
    plc.scan(&[("X0", 0)]);
    plc.stop();
    let names = ["CT0.Acc", "CT1.Acc", "D0", "Y0", "C0", "T0.Acc", "D1", "D2", "Q.Running"];
    assert_eq!(plc.values(names), [0, 1, 3, 0, 1, 20, 3, 3, 0]);
    let start_ns = plc.now_ns + 500_000_000;
    plc.now_ns = start_ns;
    plc.engine.start(start_ns);
    assert_eq!(plc.values(["Main.Running", "P.Running", "Q.Running"]), [1, 0, 1]);
    plc.scan(&[]);
    assert_eq!(plc.values(names), [1, 1, 4, 1, 1, 20, 3, 4, 1]);
    assert_eq!(plc.values(["$FirstScan", "$LastScan", "DST0", "$ScanToggle"]), [1, 0, 0, 0]);
    plc.scan(&[]);
    assert_eq!(plc.values(["$FirstScan", "T0.Acc", "DST0", "$ScanToggle"]), [0, 30, 1, 1]);
}

#[test]
fn the_stages_of_a_stopped_program_restart() {
    let main = r#"
[[program.stage]]
name = "A"
rung = [ { when = ["X0"], do = ["JMP B"] } ]
[[program.stage]]
name = "B"
rung = [ { when = ["$On"], do = ["OUT Y0"] } ]
"#;
    let mut plc = plc(main);
    plc.scan(&[("X0", 1)]);
    assert_eq!(plc.values(["Main.A", "Main.B", "Y0"]), [0, 1, 1]);
    plc.stop();
    assert_eq!(plc.values(["Main.A", "Main.B", "Y0"]), [0, 0, 0]);
    plc.engine.start(plc.now_ns);
    plc.scan(&[("X0", 0)]);
    assert_eq!(plc.values(["Main.A", "Main.B", "Y0"]), [1, 0, 0]);
}

#[test]
fn the_done_bit_of_a_task_survives_a_stop_until_the_task_starts_again() {
    let main = r#"
rung = [ { when = ["X0"], do = ["ENTASK Job"] } ]
[[task]]
name = "Job"
rung = [ { when = ["$On"], do = ["ADD D0 1 to=D0"] } ]
[[task]]
name = "FirstScan"
rung = [ { when = ["$On"], do = ["ADD D1 1 to=D1", "OUT Y1"] } ]
[[task]]
name = "LastScan"
rung = [ { when = ["$On"], do = ["ADD D2 1 to=D2"] } ]
"#;
    let mut plc = plc(main);
    plc.scan(&[("X0", 1)]);
    assert_eq!(plc.values(["Job.Done", "FirstScan.Done", "LastScan.Done"]), [1, 1, 0]);
    plc.stop();
    assert_eq!(plc.values(["Job.Done", "FirstScan.Done", "LastScan.Done"]), [1, 1, 1]);
    plc.engine.start(plc.now_ns);
    let names = ["Job.Done", "FirstScan.Done", "FirstScan.Running", "LastScan.Done"];
    assert_eq!(plc.values(names), [1, 0, 1, 1]);
    plc.scan(&[("X0", 0)]);
    assert_eq!(plc.values(names), [1, 1, 0, 1]);
    assert_eq!(plc.values(["D0", "D1", "D2", "Y1"]), [1, 2, 1, 1]);
    plc.scan(&[("X0", 1)]);
    assert_eq!(plc.values(["D0", "D1", "Y1"]), [2, 2, 0]);
    plc.stop();
    assert_eq!(plc.values(["D2", "LastScan.Done"]), [2, 1]);
}

#[test]
fn a_termination_pass_counts_as_the_first_load_of_cntdn_over_a_stop() {
    let main = r#"rung = [
      { leg.dn = ["X0"], leg.rst = ["$Off"], do = ["CNTDN CT0 preset=D0"] },
      { leg.en = ["X0"], leg.rst = ["$Off"], do = ["TMRADOWN T0 preset=D0"] },
    ]"#;
    let mut plc = plc(main);
    plc.scan(&[("D0", 4)]);
    plc.stop();
    assert_eq!(plc.values(["CT0.Acc", "T0.Acc"]), [4, 4]);
    plc.engine.start(plc.now_ns);
    plc.scan(&[("D0", 9), ("CT0.Acc", 7), ("T0.Acc", 8)]);
    assert_eq!(plc.values(["CT0.Acc", "T0.Acc"]), [7, 8]);
}

#[test]
fn a_second_stop_terminates_only_blocks_executed_since_the_first() {
    let main = r#"
rung = [ { when = ["X0"], do = ["RUN P"] } ]
[[program]]
name = "P"
rung = [ { leg.up = ["$On"], leg.rst = ["$Off"], do = ["CNT CT0 preset=2"] } ]
"#;
    let mut plc = plc(main);
    plc.scan(&[("X0", 1)]);
    plc.stop();
    assert_eq!(plc.values(["CT0.Acc", "CT0.Reset"]), [0, 1]);
    plc.engine.start(plc.now_ns);
    plc.scan(&[("X0", 0), ("CT0.Acc", 6)]);
    plc.stop();
    assert_eq!(plc.value("CT0.Acc"), 6);
}

#[test]
fn a_block_halted_in_the_last_scan_terminates_within_that_run() {
    let main = r#"
rung = [ { when = ["X0"], do = ["RESTART P"] } ]
[[program]]
name = "P"
autostart = true
rung = [ { when = ["$On"], do = ["TMRAG T0 preset=1s", "PONOFF C0"] } ]
"#;
    let mut plc = plc(main);
    plc.scans(2);
    plc.engine.request_stop();
    plc.scan(&[("X0", 1)]);
    plc.engine.terminate();
    assert_eq!(plc.values(["P.Running", "C0"]), [0, 0]);
    plc.engine.start(plc.now_ns);
    plc.scan(&[("X0", 0)]);
    assert_eq!(plc.value("C0"), 1);
    plc.scan(&[]);
    assert_eq!(plc.value("C0"), 1);
}

#[test]
fn a_stop_resets_the_interval_of_a_recurrent_task() {
    let main = r#"
rung = [ { when = ["$On"], do = ["ENTASK Job every=30ms"] } ]
[[task]]
name = "Job"
rung = [ { when = ["$On"], do = ["ADD D0 1 to=D0"] } ]
"#;
    let mut plc = plc(main);
    plc.scan(&[]);
    plc.stop();
    assert_eq!(plc.value("D0"), 1);
    plc.engine.start(plc.now_ns);
    plc.scan(&[]);
    assert_eq!(plc.value("D0"), 2);
    plc.scans(2);
    assert_eq!(plc.value("D0"), 2);
    plc.scan(&[]);
    assert_eq!(plc.value("D0"), 3);
}

#[test]
fn status_words_show_the_scan_times() {
    let mut plc = plc(r#"rung = [ { when = ["$On"], do = ["MOVE $MaxScanTime to=D0"] } ]"#);
    plc.times = ScanTimes { mean_us: 12, min_us: 7, max_us: 40, last_us: 13 };
    plc.scan(&[]);
    let names = ["DST0", "$ScanTime", "$MinScanTime", "$MaxScanTime", "DST4", "D0"];
    assert_eq!(plc.values(names), [0, 12, 7, 40, 13, 40]);
    plc.times = ScanTimes { mean_us: 13, min_us: 6, max_us: 50, last_us: 6 };
    plc.scan(&[]);
    assert_eq!(plc.values(names), [1, 13, 6, 50, 6, 50]);
}

#[test]
fn timers_and_clock_bits_do_not_follow_the_time_of_day() {
    let mut plc = plc(r#"rung = [ { when = ["$On"], do = ["TMR T0 preset=1h"] },
      { when = ["$Hour == 14"], do = ["OUT Y0"] } ]"#);
    let names = ["$Hour", "$Minute", "Y0", "T0.Acc", "$100ms", "$ScanCounter"];
    let noon_s = LocalTime::SIMULATED_S + 12 * 3600;
    let mut scan_at = |local_s: i64| {
        plc.local = LocalTime::of(local_s);
        plc.scan(&[]);
        plc.values(names)
    };
    assert_eq!(scan_at(noon_s), [12, 0, 0, 0, 1, 0]);
    assert_eq!(scan_at(noon_s + 7200), [14, 0, 1, 10, 1, 1]);
    assert_eq!(scan_at(noon_s - 60), [11, 59, 0, 20, 1, 2]);
    assert_eq!(scan_at(noon_s - 3652 * 86_400), [12, 0, 0, 30, 1, 3]);
    assert_eq!(scan_at(noon_s), [12, 0, 0, 40, 1, 4]);
    assert_eq!(scan_at(noon_s), [12, 0, 0, 50, 0, 5]);
    // A reload copies the words of the time of day, and the next scan sets them again. In STOP they
    // keep their values.
    plc.local = LocalTime::of(noon_s + 3600);
    plc.stop();
    assert_eq!(plc.values(["$Hour", "$Minute"]), [13, 0]);
}

#[test]
fn the_clock_bits_count_from_the_start_of_run() {
    let mut plc = stopped(r#"rung = [ { when = ["$1Second"], do = ["OUT Y0"] } ]"#);
    plc.now_ns = 123_456_789;
    plc.period_ns = 500_000_000;
    plc.engine.start(plc.now_ns);
    let mut seen = Vec::new();
    for _ in 0..4 {
        plc.scan(&[]);
        seen.push(plc.values(["$1Second", "$1Minute", "$100ms", "$50ms"]));
    }
    assert_eq!(seen, [[1, 1, 1, 1], [0, 1, 1, 1], [1, 1, 1, 1], [0, 1, 1, 1]]);
    plc.now_ns = 123_456_789 + 499_999_999;
    plc.scan(&[]);
    assert_eq!(plc.values(["$1Second", "$100ms", "$50ms"]), [1, 0, 0]);
}

#[test]
fn timers_count_the_difference_of_whole_milliseconds() {
    let mut plc = plc(r#"rung = [ { when = ["$On"], do = ["TMR T0 preset=1s"] } ]"#);
    plc.now_ns = 999_999;
    plc.period_ns = 400_000;
    let mut seen = Vec::new();
    for _ in 0..6 {
        plc.scan(&[]);
        seen.push(plc.value("T0.Acc"));
    }
    // Timestamps 0.999999, 1.399999, 1.799999, 2.199999, 2.599999, 2.999999 ms.
    assert_eq!(seen, [0, 1, 1, 2, 2, 2]);
}

#[test]
fn timers_survive_the_wrap_of_the_millisecond_counter() {
    let mut plc = plc(r#"rung = [ { when = ["$On"], do = ["TMR T0 preset=1s"] } ]"#);
    plc.now_ns = (u64::from(u32::MAX) - 4) * 1_000_000;
    plc.scans(3);
    assert_eq!(plc.value("T0.Acc"), 20);
}

#[test]
fn recurrent_tasks_count_nanoseconds_from_their_first_execution() {
    let main = r#"
rung = [ { when = ["$On"], do = ["ENTASK Job every=1ms"] } ]
[[task]]
name = "Job"
rung = [ { when = ["$On"], do = ["ADD D0 1 to=D0"] } ]
"#;
    let mut plc = plc(main);
    plc.now_ns = 600_000;
    plc.period_ns = 500_000;
    let mut seen = Vec::new();
    for _ in 0..5 {
        plc.scan(&[]);
        seen.push(plc.value("D0"));
    }
    assert_eq!(seen, [1, 1, 2, 2, 3]);
}

#[test]
fn a_requested_stop_takes_effect_after_the_next_scan() {
    let mut plc = plc(r#"rung = [ { when = ["X0"], do = ["STOP"] } ]"#);
    assert!(!plc.scan(&[]).last);
    assert!(!plc.scan(&[("X0", 1)]).last);
    assert!(plc.scan(&[("X0", 0)]).last);
    plc.engine.terminate();
    plc.engine.start(plc.now_ns);
    assert!(!plc.scan(&[]).last);
    assert!(!plc.scan(&[]).last);
}

/// The bytes of a state begin with the timestamp, the start of RUN and the number of scans.
#[test]
fn the_scan_counter_wraps_to_0() {
    let main = r#"
rung = [
  { when = ["$ScanCounter > 100"], do = ["OUT Y0"] },
  { when = ["$On"], do = ["MATH D0 = $ScanCounter % 3", "MATH D1 = $ScanCounter % 4"] },
]
"#;
    let mut plc = plc(main);
    plc.scan(&[]);
    let mut bytes = Vec::new();
    EngineState::of(&plc.engine).write(&mut bytes);
    bytes[16..24].copy_from_slice(&(i32::MAX as u64 - 1).to_le_bytes());
    let near = EngineState::read(&bytes).expect("a state");
    assert!(plc.engine.resume(&near));
    let mut shown = Vec::new();
    for _ in 0..4 {
        plc.scan(&[]);
        let names = ["$ScanCounter", "$FirstScan", "$ScanToggle", "Y0", "D0", "D1"];
        shown.push(plc.values(names));
    }
    assert_eq!(
        shown,
        [
            [2_147_483_646, 0, 0, 1, 0, 2],
            [2_147_483_647, 0, 1, 1, 1, 3],
            [0, 0, 0, 0, 0, 0],
            [1, 0, 1, 0, 1, 1],
        ]
    );
}
