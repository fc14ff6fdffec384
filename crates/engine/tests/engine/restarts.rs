//! STOP → RUN without a restart of the process, and RUN after a fault: the state that survives, and
//! the state that starts again. Tests the engine alone; see `docs/semantics.md`, section 4, stop
//! and start.

use rungd_engine::EngineState;
use rungd_test_support::plc::{Plc, plc, retaining};

const MAIN: &str = r#"
rung = [
  { leg.up = ["X0"], leg.dn = ["$Off"], do = ["UDCG CT0 up-preset=9"] },
  { leg.up = ["X0"], leg.rst = ["$Off"], do = ["CNT CT1 preset=9"] },
  { when = ["X1"], do = ["TMRAG T0 preset=1s"] },
  { when = ["X1"], do = ["ONDTMR T1 preset=20ms output=C0"] },
  { when = ["X1"], do = ["OUT Y0", "SET C1", "ADD D0 1 to=D0", "CTU N0 preset=3"] },
  { when = ["rise(X1)"], do = ["ADD D1 1 to=D1"] },
  { when = ["$FirstScan"], do = ["ADD D2 1 to=D2"] },
  { when = ["X2"], do = ["RUN Side"] },
  { when = ["X2"], do = ["ENTASK Once"] },
]
[[program]]
name = "Auto"
autostart = true
[[program.stage]]
name = "A"
rung = [ { when = ["X3"], do = ["JMP B"] } ]
[[program.stage]]
name = "B"
rung = [ { when = ["$On"], do = ["OUT Y1"] } ]
[[program]]
name = "Side"
rung = [ { when = ["$On"], do = ["OUT Y2"] } ]
[[task]]
name = "Once"
rung = [ { when = ["$On"], do = ["ADD D3 1 to=D3"] } ]
[[task]]
name = "FirstScan"
rung = [ { when = ["$On"], do = ["ADD D4 1 to=D4", "OUT C5"] } ]
[[task]]
name = "LastScan"
rung = [ { when = ["$On"], do = ["ADD D5 1 to=D5"] } ]
"#;

const SURVIVES: [&str; 6] = ["CT0.Acc", "T0.Acc", "C1", "D0", "N0.ACC", "D1"];
const RUNS: [&str; 6] =
    ["Main.Running", "Auto.Running", "Side.Running", "Auto.A", "Auto.B", "Once.Done"];
const STOPPED: [&str; 7] = ["CT1.Acc", "T1.Acc", "C0", "Y0", "Y1", "Y2", "C5"];

/// An engine after five scans with all inputs ON.
fn busy() -> Plc {
    let mut plc = plc(MAIN);
    plc.scan(&[("X0", 1), ("X1", 1), ("X2", 1), ("X3", 1)]);
    plc.scans(4);
    assert_eq!(plc.values(SURVIVES), [1, 40, 1, 5, 1, 1]);
    assert_eq!(plc.values(RUNS), [1, 1, 1, 0, 1, 1]);
    assert_eq!(plc.values(STOPPED), [1, 40, 1, 1, 1, 1, 0]);
    plc
}

/// Starts an hour later, and makes one scan in which X0, X2 and X3 are OFF and the other inputs are
/// unchanged.
fn start_later(plc: &mut Plc) {
    plc.now_ns += 3_600_000_000_000;
    plc.engine.start(plc.now_ns);
    plc.scan(&[("X0", 0), ("X2", 0), ("X3", 0)]);
}

fn assert_started_afresh(plc: &Plc) {
    // UDCG, TMRAG, SET, words and Sensaphone values survive. An input that is still ON counts as a
    // new edge, except for a counter, which keeps its own history.
    assert_eq!(plc.values(RUNS), [1, 1, 0, 1, 0, 1], "autostart alone, at the first Stage");
    assert_eq!(plc.values(["D2", "D4"]), [2, 2], "$FirstScan and FirstScan again");
    assert_eq!(plc.values(["$ScanCounter", "$LastScan"]), [0, 0]);
    assert_eq!(plc.values(["Y0", "Y1", "Y2", "CT1.Acc", "T1.Acc", "C0"]), [1, 0, 0, 0, 0, 0]);
}

#[test]
fn a_stop_and_a_start_keep_memory_and_restart_the_blocks() {
    let mut plc = busy();
    plc.stop();
    assert_eq!(plc.values(SURVIVES), [1, 50, 1, 6, 1, 1]);
    assert_eq!(plc.values(STOPPED), [0; 7]);
    assert_eq!(plc.values(["Main.Running", "Auto.Running", "Side.Running"]), [0; 3]);
    start_later(&mut plc);
    assert_started_afresh(&plc);
    assert_eq!(plc.values(SURVIVES), [1, 50, 1, 7, 2, 2], "the hour in STOP does not count");
    assert_eq!(plc.value("D5"), 1, "one last scan");
    plc.scans(2);
    assert_eq!(plc.values(["T0.Acc", "T1.Acc", "C0"]), [70, 20, 1]);
}

#[test]
fn executed_blocks_terminate_before_the_start_after_a_fault() {
    // At a fault there is no last scan and no pass: the runtime executes the passes before it
    // starts.
    let mut plc = busy();
    plc.now_ns += 3_600_000_000_000;
    plc.engine.terminate();
    assert_eq!(plc.values(SURVIVES), [1, 40, 1, 5, 1, 1]);
    assert_eq!(plc.values(STOPPED), [0; 7]);
    start_later(&mut plc);
    assert_started_afresh(&plc);
    assert_eq!(plc.values(SURVIVES), [1, 40, 1, 6, 2, 2], "the hours in FAULT do not count");
    assert_eq!(plc.value("D5"), 0, "LastScan did not execute");
}

#[test]
fn a_fault_discards_an_earlier_stop_request() {
    let mut plc = busy();
    plc.engine.request_stop();
    plc.engine.terminate();
    start_later(&mut plc);
    assert!(!plc.scan(&[]).last);
}

#[test]
fn a_start_reports_the_blocks_that_it_starts() {
    let mut plc = busy();
    plc.stop();
    start_later(&mut plc);
    let events = plc.events();
    for event in ["started Main", "started Auto", "started FirstScan", "on Auto.A"] {
        assert!(events.iter().any(|e| e == event), "{event} in {events:?}");
    }
    assert!(!events.iter().any(|event| event.contains("terminated")), "{events:?}");
}

#[test]
fn forces_survive_a_stop_and_can_be_released_in_stop() {
    let mut plc = busy();
    plc.force("Y0", 1);
    plc.force("CT1.Acc", 7);
    plc.stop();
    assert_eq!(plc.values(["Y0", "CT1.Acc", "$ForcesActive"]), [1, 7, 1]);
    plc.release("CT1.Acc");
    plc.release("Y0");
    assert_eq!(plc.values(["Y0", "CT1.Acc", "$ForcesActive"]), [1, 7, 0], "in STOP too");
}

/// The same ladder, with the Stages of Auto retained, in Stage B.
fn in_stage_b() -> Plc {
    let mut plc = retaining(&format!("[[program]]\nname = \"Main\"\n{MAIN}\n"), &["Auto"]);
    plc.engine.start(0);
    plc.scan(&[("X3", 1)]);
    plc.scan(&[("X3", 0)]);
    assert_eq!(plc.values(["Auto.Running", "Auto.A", "Auto.B", "Y1"]), [1, 0, 1, 1]);
    plc
}

#[test]
fn retained_stages_go_on_after_a_fault() {
    let mut plc = in_stage_b();
    plc.engine.terminate();
    assert_eq!(plc.values(["Auto.Running", "Auto.A", "Auto.B", "Y1"]), [0, 0, 0, 0]);
    plc.engine.start(plc.now_ns);
    assert_eq!(plc.values(["Auto.Running", "Auto.A", "Auto.B", "Y1"]), [1, 0, 1, 0]);
    plc.scan(&[]);
    assert_eq!(plc.values(["Auto.Running", "Auto.A", "Auto.B", "Y1"]), [1, 0, 1, 1]);
}

/// The last scan itself leaves the Stage: the image of the stop has the Stage that it entered.
#[test]
fn a_stage_that_the_last_scan_enters_is_kept() {
    let mut plc = retaining(&format!("[[program]]\nname = \"Main\"\n{MAIN}\n"), &["Auto"]);
    plc.engine.start(0);
    plc.scan(&[]);
    plc.engine.request_stop();
    assert!(plc.scan(&[("X3", 1)]).last);
    plc.engine.terminate();
    plc.engine.start(plc.now_ns);
    assert_eq!(plc.values(["Auto.Running", "Auto.A", "Auto.B"]), [1, 0, 1]);
}

#[test]
fn a_state_with_retained_stages_is_read_back() {
    let busy = in_stage_b();
    let mut bytes = Vec::new();
    EngineState::of(&busy.engine).write(&mut bytes);
    let mut other = retaining(&format!("[[program]]\nname = \"Main\"\n{MAIN}\n"), &["Auto"]);
    assert!(other.engine.resume(&EngineState::read(&bytes).expect("a state")));
    other.engine.terminate();
    other.engine.start(0);
    assert_eq!(other.values(["Auto.Running", "Auto.A", "Auto.B"]), [1, 0, 1]);
    // A program that retains no Stages has other cells.
    let mut other = plc(MAIN);
    assert!(!other.engine.resume(&EngineState::read(&bytes).expect("a state")));
}
