//! Tests of the model itself: traces computed by hand from the tables of the semantics.

use super::clock::BEGIN;
use super::exec::Sim;
use super::parse::load;
use super::{Options, simulate};

/// Runs a ladder with a period of 10 ms and returns its rows without scan and time.
fn rows(ladder: &str, watch: &str, stimulus: &str, scans: i64, stop: bool) -> Vec<String> {
    let watch: Vec<String> = watch.split_whitespace().map(str::to_string).collect();
    let options = Options { period: 10, scans, stop, clock: BEGIN, watch: &watch, stimulus };
    let trace = match simulate(ladder, &options) {
        Ok(trace) => trace,
        Err(message) => return vec![message],
    };
    let cells = trace.lines().skip(1).map(|line| line.split(',').skip(2).collect::<Vec<_>>());
    cells.map(|cells| cells.join(" ")).collect()
}

/// Compares a trace with the expected rows. `stimulus` has a header of operands and one line for
/// each scan; an empty cell is `.`.
fn check(ladder: &str, watch: &str, stimulus: &[&str], expected: &[&str]) {
    let mut csv = String::new();
    for (n, line) in stimulus.iter().enumerate() {
        let cells = line.split_whitespace().map(|cell| if cell == "." { "" } else { cell });
        let cells: Vec<&str> = cells.collect();
        let first = if n == 0 { "scan".to_string() } else { (n - 1).to_string() };
        csv.push_str(&format!("{first},{}\n", cells.join(",")));
    }
    let scans = expected.len() as i64;
    assert_eq!(rows(ladder, watch, &csv, scans, false), expected, "{ladder}");
}

fn main_with(rungs: &str) -> String {
    format!("[[program]]\nname = \"Main\"\nrung = [\n{rungs}\n]\n")
}

#[test]
fn cnt_counts_resets_and_sets_its_flags() {
    check(
        &main_with(r#"{ leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT CT0 preset=2"] }"#),
        "CT0.Acc CT0.Done CT0.Reset CT0.Zero CT0.DnDone",
        &["X0 X1", "1 0", "0 0", "1 0", "0 0", "1 0", "1 1", "1 0", "0 0", "0 1", "1 0"],
        &[
            "1 0 0 0 0",
            "1 0 0 0 0",
            "2 1 0 0 0",
            "2 1 0 0 0",
            "3 1 0 0 0",
            "0 0 1 1 0",
            "0 0 0 1 0",
            "0 0 0 1 0",
            "0 0 1 1 0",
            "1 0 0 0 0",
        ],
    );
}

#[test]
fn cnt_with_preset_0_is_done_even_in_reset() {
    check(
        &main_with(r#"{ leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT CT0 preset=D0"] }"#),
        "CT0.Acc CT0.Done CT0.Reset",
        &["X0 X1 D0", "0 1 0", "0 0 1", "0 0 -5"],
        &["0 1 1", "0 0 0", "0 1 0"],
    );
}

#[test]
fn cntdn_loads_at_its_first_execution_and_follows_its_preset_in_reset() {
    check(
        &main_with(r#"{ leg.dn = ["X0"], leg.rst = ["X1"], do = ["CNTDN CT0 preset=D0"] }"#),
        "CT0.Acc CT0.Done CT0.Reset CT0.Zero",
        &["X0 X1 D0", "1 0 2", "0 0 9", "1 0 .", "0 0 .", "1 0 .", "0 1 .", "0 1 4", "0 0 7"],
        &["1 0 0 0", "1 0 0 0", "0 1 0 1", "0 1 0 1", "-1 1 0 0", "9 0 1 0", "4 0 1 0", "4 0 0 0"],
    );
}

#[test]
fn udc_counts_both_ways_and_compares_with_both_presets() {
    let udc = r#"{ leg.up = ["X0"], leg.dn = ["X1"], leg.rst = ["X2"],
        do = ["UDC CT0 up-preset=1 dn-preset=-1"] }"#;
    check(
        &main_with(&udc.replace('\n', "")),
        "CT0.Acc CT0.Done CT0.DnDone CT0.Zero",
        &["X0 X1 X2", "1 1 0", "0 0 0", "1 0 0", "0 1 0", "0 0 0", "0 1 0", "0 1 1"],
        &["0 0 0 1", "0 0 0 1", "1 1 0 0", "0 0 0 1", "0 0 0 1", "-1 0 1 0", "0 0 0 1"],
    );
}

#[test]
fn rstct_acts_at_once_and_through_the_next_execution() {
    check(
        &main_with(
            r#"{ leg.up = ["X0"], leg.dn = ["$Off"], do = ["UDCG CT0 up-preset=2"] },
               { when = ["CT0.Done"], do = ["OUT Y0"] },
               { when = ["X1"], do = ["RSTCT CT0"] }"#,
        ),
        "CT0.Acc CT0.Done CT0.Reset CT0.Zero Y0",
        &["X0 X1", "1 0", "0 0", "1 0", "0 1", "1 0", "1 0", "0 0", "1 0"],
        &[
            "1 0 0 0 0",
            "1 0 0 0 0",
            "2 1 0 0 1",
            "0 0 1 1 1",
            "0 0 1 1 0",
            "0 0 0 1 0",
            "0 0 0 1 0",
            "1 0 0 0 0",
        ],
    );
}

#[test]
fn ondtmr_delays_its_output_and_saturates() {
    check(
        &main_with(r#"{ when = ["X0"], do = ["ONDTMR T0 preset=20ms output=Y0"] }"#),
        "T0.Acc T0.Done T0.Reset T0.Zero T0.Timing Y0",
        &["X0 T0.Acc", "0", "1", "1", "1", "1", "0", "1", "1 100", "1 -50"],
        &[
            "0 0 1 1 0 0",
            "0 0 0 1 1 0",
            "10 0 0 0 1 0",
            "20 1 0 0 1 1",
            "30 1 0 0 1 1",
            "0 0 1 1 0 0",
            "0 0 0 1 1 0",
            "110 1 0 0 1 1",
            "-40 0 0 0 1 0",
        ],
    );
}

#[test]
fn offdtmr_delays_the_off_edge_of_its_output() {
    check(
        &main_with(
            r#"{ when = ["X0"], do = ["OFFDTMR T0 preset=D0 output=Y0"] },
               { when = ["X1"], do = ["RSTT T0"] }"#,
        ),
        "T0.Acc Y0 T0.Timing T0.Reset T0.Done T0.Zero",
        &[
            "X0 X1 D0", "0 0 20", "1 0 30", "1 0 20", "0 0 .", "0 0 .", "1 0 .", "0 0 .", "0 0 .",
            "0 0 .", "0 0 .", "1 0 0", "0 0 .", "1 0 20", "0 0 .", "0 1 .", "0 0 .", "0 0 .",
            "1 1 .", "1 0 .", "0 0 .",
        ],
        &[
            "0 0 0 0 1 1",
            "30 1 0 1 0 0",
            "20 1 0 1 0 0",
            "20 1 1 0 0 0",
            "10 1 1 0 0 0",
            "20 1 0 1 0 0",
            "20 1 1 0 0 0",
            "10 1 1 0 0 0",
            "0 0 0 0 1 1",
            "0 0 0 0 1 1",
            "0 1 0 1 0 1",
            "0 0 0 0 1 1",
            "20 1 0 1 0 0",
            "20 1 1 0 0 0",
            "0 1 0 1 0 1",
            "0 0 0 1 0 1",
            "0 0 0 0 1 1",
            "0 1 0 1 0 1",
            "20 1 0 1 0 0",
            "20 1 1 0 0 0",
        ],
    );
}

#[test]
fn tmrdown_loads_at_the_first_execution_with_the_leg_on() {
    check(
        &main_with(r#"{ when = ["X0"], do = ["TMRDOWN T0 preset=D0"] }"#),
        "T0.Acc T0.Done T0.Reset T0.Zero T0.Timing",
        &["X0 D0 T0.Acc", "0 5", "0 20", "1 25", "1 9", "1 .", "1 .", "1 . -7", "0 0", "1 0"],
        &[
            "5 0 1 0 0",
            "20 0 1 0 0",
            "25 0 0 0 1",
            "15 0 0 0 1",
            "5 0 0 0 1",
            "0 1 0 1 0",
            "0 1 0 1 0",
            "0 0 1 1 0",
            "0 1 0 1 0",
        ],
    );
}

#[test]
fn accumulating_timers_keep_their_time_until_a_reset() {
    check(
        &main_with(
            r#"{ leg.en = ["X0"], leg.rst = ["X1"], do = ["TMRA T0 preset=20"] },
               { leg.en = ["X0"], leg.rst = ["X1"], do = ["TMRADOWN T1 preset=20ms"] }"#,
        ),
        "T0.Acc T0.Done T0.Reset T0.Timing T1.Acc T1.Done T1.Reset T1.Timing",
        &["X0 X1", "1 0", "1 0", "0 0", "1 0", "1 0", "1 1", "1 0", "1 0", "0 0"],
        &[
            "0 0 0 1 20 0 0 1",
            "10 0 0 1 10 0 0 1",
            "10 0 0 0 10 0 0 0",
            "10 0 0 1 10 0 0 1",
            "20 1 0 1 0 1 0 0",
            "0 0 1 0 20 0 1 0",
            "0 0 0 1 20 0 0 1",
            "10 0 0 1 10 0 0 1",
            "10 0 0 0 10 0 0 0",
        ],
    );
}

/// Alpha runs in scans 0 and 1, exits in scan 1, terminates in scan 2, and runs again in scan 3.
#[test]
fn a_termination_pass_acts_one_scan_after_the_exit() {
    let alpha = |first: &str, second: &str| {
        format!(
            "{}[[program]]\nname = \"Alpha\"\nrung = [{{ when = [\"X1\"], do = [\"EXIT\"] }},\n\
             {first},\n{second}]\n",
            main_with(r#"{ when = ["X0"], do = ["RUN Alpha"] }"#)
        )
    };
    let inputs = ["X0 X1", "1 0", "0 1", "0 0", "1 0", "1 0"];
    check(
        &alpha(
            r#"{ when = ["$On"], do = ["OUT Y0", "SET Y1", "TMRAG T0 preset=0"] }"#,
            r#"{ leg.dn = ["$On"], leg.rst = ["$Off"], do = ["CNTDN CT0 preset=3"] }"#,
        ),
        "Alpha.Running Y0 Y1 T0.Acc CT0.Acc CT0.Reset",
        &inputs,
        &["1 1 1 0 2 0", "0 1 1 0 2 0", "0 0 1 0 3 1", "1 1 1 0 2 0", "1 1 1 10 2 0"],
    );
    check(
        &alpha(
            r#"{ leg.up = ["$On"], leg.dn = ["$Off"], do = ["UDCG CT0 up-preset=1"] }"#,
            concat!(
                r#"{ when = ["rise($On)"], "#,
                r#"do = ["PD Y2", "PONOFF Y3", "OFFDTMR T1 preset=0 output=Y1"] }"#
            ),
        ),
        "CT0.Acc CT0.Done Y1 Y2 Y3 T1.Reset T1.Done",
        &inputs,
        &["1 1 1 1 1 1 0", "1 1 1 1 1 1 0", "1 1 0 0 1 1 0", "1 1 1 1 0 1 0", "1 1 0 0 0 0 1"],
    );
}

const STAGES: &str = r#"
[[program]]
name = "Main"
[[program.stage]]
name = "A"
rung = [{ when = ["$On"], do = ["OUT Y0"] }, { when = ["X0"], do = ["JMP B"] },
        { when = ["$On"], do = ["ADD D0 1 to=D0"] }, { when = ["X2"], do = ["JMP A"] }]
[[program.stage]]
name = "B"
rung = [{ when = ["$On"], do = ["OUT Y1", "ADD D1 1 to=D1"] }, { when = ["X1"], do = ["JMP A"] }]
"#;

#[test]
fn jumps_forward_back_and_to_the_same_stage_change_stages() {
    check(
        STAGES,
        "Main.A Main.B Y0 Y1 D0 D1",
        &["X0 X1 X2", "0 0 0", "1 0 0", "0 0 0", "0 1 0", "0 0 0", "0 0 1", "1 1 0", "0 0 0"],
        &[
            "1 0 1 0 1 0",
            "0 1 1 1 2 1",
            "0 1 0 1 2 2",
            "1 0 0 1 2 3",
            "1 0 1 0 3 3",
            "1 0 1 0 4 3",
            "1 0 1 1 5 4",
            "1 0 1 0 6 4",
        ],
    );
}

#[test]
fn tasks_execute_once_or_at_their_interval() {
    let ladder = |entask: &str| {
        main_with(&format!(r#"{{ when = ["X0"], do = ["{entask}"] }}"#))
            + "[[task]]\nname = \"House\"\nrung = [{ when = [\"$On\"], \
               do = [\"ADD D0 1 to=D0\", \"OUT Y0\"] }]\n"
    };
    check(
        &ladder("ENTASK House"),
        "House.Running House.Done D0 Y0",
        &["X0", "0", "1", "1", "0", "1", "0", "1"],
        &["0 0 0 0", "0 1 1 1", "0 1 1 0", "0 1 1 0", "0 1 2 1", "0 1 2 0", "0 1 3 1"],
    );
    check(
        &ladder("ENTASK House every=25ms"),
        "House.Running House.Done D0 Y0",
        &["X0", "1", "1", "1", "1", "1", "1", "1", "1", "1", "0", "1"],
        &[
            "1 0 1 1", "1 0 1 1", "1 0 1 1", "1 0 2 1", "1 0 2 1", "1 0 3 1", "1 0 3 1", "1 0 3 1",
            "1 0 4 1", "0 0 4 0", "1 0 5 1",
        ],
    );
}

/// A Task that comes before Main in the order starts and terminates a scan later.
#[test]
fn a_task_earlier_in_the_order_starts_and_terminates_a_scan_later() {
    let ladder = "[ladder]\norder = [\"House\", \"Main\"]\n".to_string()
        + &main_with(r#"{ when = ["X0"], do = ["ENTASK House"] }"#)
        + "[[task]]\nname = \"House\"\nrung = [{ when = [\"$On\"], do = [\"OUT Y0\"] }]\n";
    check(
        &ladder,
        "House.Running House.Done Y0",
        &["X0", "0", "1", "0", "1"],
        &["0 0 0", "1 0 0", "0 1 1", "1 0 0", "0 1 1"],
    );
}

#[test]
fn sensaphone_counters_wrap_at_16_bits() {
    check(
        &main_with(
            r#"{ when = ["X0"], do = ["CTU N0 preset=5"] }, { when = ["X1"], do = ["CTD N0"] },
               { when = ["X2"], do = ["RES N0"] }"#,
        ),
        "N0.ACC N0.PRE N0.CU N0.CD N0.DN N0.OV N0.UN",
        &["X0 X1 X2 N0.ACC", "1 0 0 32767", "0 1 0", "1 0 0 4", "0 1 0 -32768", "1 0 0", "1 0 1"],
        &[
            "-32768 5 1 0 0 1 0",
            "32767 5 0 1 1 0 0",
            "5 5 1 0 1 0 0",
            "32767 5 0 1 1 0 1",
            "-32768 5 1 0 0 0 0",
            "0 5 0 0 0 0 0",
        ],
    );
}

#[test]
fn words_saturate_at_their_range_and_the_limits_of_their_tag() {
    let tags = "[tags]\nsize = { at = \"D1\", initial = 12, min = 1, max = 500 }\n";
    check(
        &(tags.to_string()
            + &main_with(
                r#"{ when = ["X0"], do = ["MOVE -5 to=V0", "ADD D0 0x7fffffff to=D0",
                   "SUB V0 1m10s to=V1", "MOVE 70000 to=MHR1", "MOVE D0 to=D1",
                   "MOVE -1 to=N0.ACC"] }"#
                    .replace('\n', "")
                    .as_str(),
            )),
        "V0 D0 V1 MHR1 D1 N0.ACC",
        &["X0 D0", "0 1", "1 .", "1 -2147483648"],
        &["0 1 0 0 12 0", "0 2147483647 0 65535 500 -1", "0 -1 0 65535 1 -1"],
    );
}

#[test]
fn contacts_combine_bits_compares_and_branches() {
    check(
        &main_with(
            r#"{ when = ["X0 | X1 & !X2"], do = ["OUT Y0"] },
               { when = ["!(X0 | X1)", "D0 < -1 | D0>=0x10"], do = ["OUT Y1"] },
               { when = ["X1"], do = ["ADD D1 1 to=D1"], branch = [
                   { when = ["rise(X0) & D1 == 1 | fall(X0)"], do = ["SET Y2"] }] }"#
                .replace("[\n", "[")
                .as_str(),
        ),
        "Y0 Y1 Y2 D1",
        &["X0 X1 X2 D0", "1 0 0 0", "0 0 0 -2", "0 1 1 16", "0 1 0", "1 1 1 0", "0 1 0"],
        &["1 0 0 0", "0 1 0 0", "0 0 0 1", "1 0 0 2", "1 0 0 3", "1 0 1 4"],
    );
}

#[test]
fn a_stop_terminates_blocks_and_runs_the_last_scan_task() {
    let ladder = main_with(
        r#"{ when = ["$On"], do = ["OUT Y0", "SET Y1", "TMR T0 preset=1s"] },
           { when = ["$ScanCounter == 1"], do = ["STOP"] }"#,
    ) + "[[task]]\nname = \"LastScan\"\nrung = [{ when = [\"$On\"], do = [\"SET C0\"] }]\n";
    let watch = "Y0 Y1 T0.Acc T0.Reset C0 $LastScan Main.Running LastScan.Done";
    let expected = ["1 1 0 0 0 0 1 0", "1 1 10 0 0 0 1 0", "1 1 20 0 1 1 1 1", "0 1 0 1 1 1 0 1"];
    assert_eq!(rows(&ladder, watch, "scan\n", 9, false), expected);
    assert_eq!(rows(&ladder, watch, "scan\n", 3, true), expected);
    assert_eq!(rows(&ladder, watch, "scan\n", 2, false), expected[..2]);
}

/// A simulation that reaches the end of the counter would take 2147483648 scans.
#[test]
fn the_scan_counter_wraps_to_0() {
    let ladder = r#"
[[program]]
name = "Main"
rung = [ { when = ["$On"], do = ["MATH D0 = $ScanCounter % 3"] } ]
"#;
    let loaded = load(ladder).expect("a ladder");
    let [counter, third] = ["$ScanCounter", "D0"].map(|name| loaded.names.place(name).expect(name));
    let mut sim = Sim::new(&loaded.program);
    let shown = (2_147_483_646..2_147_483_650).map(|scan| {
        sim.scan(scan, scan * 10, false, &[], &[]);
        (sim.memory.get(counter), sim.memory.get(third))
    });
    let shown: Vec<(i64, i64)> = shown.collect();
    assert_eq!(shown, [(2_147_483_646, 0), (2_147_483_647, 1), (0, 0), (1, 1)]);
}
