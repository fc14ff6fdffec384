//! The events of a scan, from which the log makes its lines about blocks and Stages.

use rungd_test_support::plc::{plc, stopped};

const BLOCKS: &str = r#"
rung = [
  { when = ["X0"], do = ["RUN P"] },
  { when = ["X1"], do = ["HALT P"] },
  { when = ["X2"], do = ["ENTASK Job"] },
  { when = ["X4"], do = ["ENTASK Tick every=1s"] },
]
[[program]]
name = "P"
rung = [ { when = ["$On"], do = ["ADD D0 1 to=D0"] } ]
[[program.stage]]
name = "A"
rung = [ { when = ["X3"], do = ["JMP B"] } ]
[[program.stage]]
name = "B"
rung = [ { when = ["X5"], do = ["SGSET A", "SGRST B"] } ]
[[task]]
name = "Job"
rung = [ { when = ["$On"], do = ["ADD D1 1 to=D1"] } ]
[[task]]
name = "Tick"
rung = [ { when = ["$On"], do = ["ADD D2 1 to=D2"] } ]
"#;

#[test]
fn blocks_and_stages_report_their_changes_as_events() {
    let mut plc = plc(BLOCKS);
    plc.scan(&[]);
    assert_eq!(plc.events(), ["started Main"]);
    plc.scan(&[("X0", 1)]);
    assert_eq!(plc.events(), ["started P", "on P.A"]);
    plc.scan(&[("X0", 0)]);
    assert!(plc.events().is_empty());
    plc.scan(&[("X3", 1)]);
    assert_eq!(plc.events(), ["off P.A", "on P.B"]);
    plc.scan(&[("X3", 0)]);
    assert_eq!(plc.events(), ["terminated P.A"]);
    plc.scan(&[("X5", 1)]);
    assert_eq!(plc.events(), ["on P.A", "off P.B"]);
    plc.scan(&[("X5", 0), ("X1", 1)]);
    assert_eq!(plc.events(), ["stopped P", "terminated P", "terminated P.B", "off P.A"]);
}

#[test]
fn tasks_report_their_changes_as_events() {
    let mut plc = plc(BLOCKS);
    plc.scan(&[("X2", 1), ("X4", 1)]);
    assert_eq!(plc.events(), ["started Main", "started Job", "started Tick", "completed Job"]);
    plc.scan(&[("X4", 0)]);
    assert_eq!(plc.events(), ["stopped Tick", "terminated Job", "terminated Tick"]);
}

#[test]
fn a_stop_reports_each_termination_and_each_stopped_block() {
    let mut plc = plc(BLOCKS);
    plc.scan(&[("X0", 1), ("X4", 1)]);
    plc.stop();
    assert_eq!(
        plc.events(),
        [
            "stopped Tick",
            "terminated Main",
            "terminated P",
            "terminated P.A",
            "off P.A",
            "terminated Tick",
            "stopped Main",
            "stopped P",
        ]
    );
}

#[test]
fn a_start_reports_the_blocks_that_run_from_the_first_scan() {
    let main = r#"
rung = [ { when = ["$On"], do = ["ADD D0 1 to=D0"] } ]
[[program]]
name = "P"
autostart = true
rung = [ { when = ["$On"], do = ["ADD D1 1 to=D1"] } ]
"#;
    let mut plc = stopped(main);
    plc.engine.start(0);
    assert_eq!(plc.events(), ["started Main", "started P"]);
    plc.scan(&[]);
    assert_eq!(plc.events(), ["started Main", "started P"]);
    plc.scan(&[]);
    assert!(plc.events().is_empty());
    assert_eq!(plc.engine.events_dropped(), 0);
}

#[test]
fn a_scan_keeps_256_events_and_counts_the_others() {
    let pair = r#"{ when = ["X0"], do = ["RUN P", "HALT P"] },"#;
    let main = format!(
        "rung = [ {} ]\n[[program]]\nname = \"P\"\nrung = [ {{ when = [\"$On\"], do = [\"OUT Y0\"] \
         }} ]\n",
        pair.repeat(150)
    );
    let mut plc = plc(&main);
    plc.scan(&[]);
    assert_eq!((plc.engine.events().len(), plc.engine.events_dropped()), (1, 0));
    plc.scan(&[("X0", 1)]);
    assert_eq!((plc.engine.events().len(), plc.engine.events_dropped()), (256, 44));
    plc.scan(&[("X0", 0)]);
    assert_eq!((plc.engine.events().len(), plc.engine.events_dropped()), (0, 0));
}
