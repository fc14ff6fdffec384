//! `rungd mode` with the real binary: STOP and RUN with memory kept, the way out of FAULT, a start
//! in STOP.

use rungd_test_support::needs::{Need, skip};
use rungd_test_support::running::live;
use std::io::{BufRead, BufReader};
use std::os::fd::OwnedFd;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with};

use rungd_test_support::running::live::Live;

const LADDER: &str = r#"
[tags]
go = { at = "C100" }
[[program]]
name = "Main"
rung = [
  { leg.up = ["go"], leg.dn = ["$Off"], do = ["UDCG CT0 up-preset=9"] },
  { leg.up = ["go"], leg.rst = ["$Off"], do = ["CNT CT1 preset=9"] },
  { when = ["go"], do = ["TMRAG T0 preset=1h"] },
  { when = ["go"], do = ["ONDTMR T1 preset=20ms output=C0"] },
  { when = ["go"], do = ["OUT Y0", "OUT Y1", "SET C1", "MOVE 7 to=D0", "CTU N0 preset=3"] },
  { when = ["go"], do = ["RUN Side"] },
  { when = ["$FirstScan"], do = ["ADD D9 1 to=D9"] },
]
[[program]]
name = "Side"
rung = [ { when = ["$On"], do = ["OUT Y2"] } ]
[[task]]
name = "LastScan"
rung = [ { when = ["$On"], do = ["ADD D8 1 to=D8"] } ]
"#;

/// `KEPT`: operands that keep their values over a stop. `ENDED`: operands that the passes of a stop
/// switch OFF or reset.
const KEPT: &str = "CT0.Acc C1 D0 N0.ACC";
const ENDED: &str = "CT1.Acc T1.Acc C0 Y0 Y2 Side.Running";

#[test]
fn stop_and_run_keep_memory_as_the_termination_table_defines() {
    let live = Live::start(LADDER, "scan.period = \"5ms\"\noutputs.hold = [\"Y1\"]\n", &[]);
    live.ok("write go on");
    live.await_values("C0 Y2", "ON ON");
    assert_eq!(live.ok("mode stop"), "STOP (an operator requested it), was RUN\n");
    let [stop, told] = live.lines(["STOP: an operator requested it", "asked for STOP"]);
    assert_eq!(stop["level"], "WARN");
    assert_eq!(told["event"], "operator-mode");
    assert_eq!((&told["before"], &told["after"]), (&"RUN".into(), &"STOP".into()));
    live.await_values(KEPT, "1 ON 7 1");
    live.await_values(ENDED, "0 0 OFF OFF OFF OFF");
    live.await_values("D8 D9 Main.Running", "1 1 OFF");
    assert_eq!(live.ok("mode stop"), "STOP (an operator requested it), was STOP\n");
    let timed = live.ok("read T0.Acc");
    let scans = || live.say("status --json").json()["scans"].as_u64().unwrap();
    let stopped = scans();
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(scans(), stopped, "no scan in STOP");
    assert_eq!(live.say("write D0 1").code, 1);
    live.ok("force D3 44");
    live.await_values("D3 $ForcesActive", "44 ON");

    assert_eq!(live.ok("mode run"), "RUN, was STOP\n");
    live.line("RUN: scanning every 5ms");
    live.await_values("D9 D3", "2 44");
    live.await_values(KEPT, "1 ON 7 2");
    live.await_values("CT1.Acc C0 Side.Running", "1 ON ON");
    let ms = |text: &str| text.split_whitespace().last().unwrap().parse::<u32>().unwrap();
    let (before, after) = (ms(&timed), ms(&live.ok("read T0.Acc")));
    assert!(after >= before, "TMRAG is kept: {before} {after}");
    assert_eq!(live.ok("mode run"), "RUN, was RUN\n");
    let statistics = &live.say("status --json").json()["scan"];
    let fresh = statistics["scans"].as_u64().unwrap();
    assert!(fresh < scans(), "statistics begin anew at RUN");
}

#[test]
fn the_run_command_after_a_start_in_stop_begins_with_initial_memory() {
    let live = Live::start(LADDER, "", &["--stopped"]);
    live.line("STOP: the command line requested it");
    live.await_values("D9 Main.Running", "0 OFF");
    assert!(live.ok("status").contains("STOP (the command line requested it (`--stopped`))"));
    let said = live.say("mode run --no-wait");
    assert!(said.code == 2 && said.err.contains("`--no-wait` is for `mode stop`"), "{said:?}");
    assert_eq!(live.ok("mode run"), "RUN, was STOP\n");
    live.await_values("D9 Main.Running", "1 ON");
}

#[test]
fn the_run_command_leaves_a_fault_that_can_occur_again() {
    let Some(live) = with_faults() else { return };
    live.ok("write go on");
    live.await_values("C0", "ON");
    for _ in 0..2 {
        live.stall();
        live.await_mode("FAULT");
        let status = live.say("status --json").json();
        assert_eq!(status["mode"], "FAULT");
        assert!(status["reason"].as_str().unwrap().contains("the watchdog"), "{status}");
        let said = live.say("mode stop");
        assert_eq!(said.code, 1, "nothing scans");
        assert!(said.err.contains("held up") || said.err.contains("`rungd mode run`"), "{said:?}");
        live.await_ok("force D3 9");
        live.await_values("D3 $ForcesActive", "9 ON");
        assert_eq!(live.await_ok("mode run"), "RUN, was FAULT\n");
        live.await_values("CT0.Acc C1 D3", "1 ON 9");
        live.await_values("C0", "ON");
        live.ok("unforce --all");
    }
    live.await_values("D8", "0");
    live.await_values("D9", "3");
}

/// A controller with a watchdog that makes a stalled scan a FAULT. `None` in a build without the
/// named points at which faults can be caused.
fn with_faults() -> Option<Live> {
    if !cfg!(debug_assertions) {
        skip(Need::Faults, "a release build has no faults on purpose");
        return None;
    }
    let controller = "scan.period = \"2ms\"\nscan.watchdog = \"500ms\"\n";
    Some(Live::start_to_stall(LADDER, controller, &[]))
}

#[test]
fn the_run_command_reports_a_fault_in_the_first_scan() {
    let Some(live) = with_faults() else { return };
    live.stall();
    live.line("FAULT: a scan");
    // The next scan is the first scan after `mode run`.
    live.stall();
    let deadline = Instant::now() + live::PATIENCE;
    let mut said = live.say("mode run");
    while said.err.contains("held up") && Instant::now() < deadline {
        // The stalled scan is still running.
        std::thread::sleep(Duration::from_millis(20));
        said = live.say("mode run");
    }
    assert_eq!(said.code, 1, "{said:?}");
    assert!(said.out.starts_with("FAULT (a scan "), "{said:?}");
    assert!(said.out.ends_with(", was FAULT\n"), "{said:?}");
    assert!(said.err.contains("RUN was requested, but the controller is in FAULT"), "{said:?}");
}

#[test]
fn the_run_command_is_answered_with_the_mode_after_the_first_scan() {
    let ladder = "[[program]]\nname = \"Main\"\nrung = [ { when = [\"$On\"], do = [\"STOP\"] } ]\n\
                  [[task]]\nname = \"LastScan\"\nrung = [ { when = [\"$On\"], do = [\"ADD D8 1 to=D8\"] } ]\n";
    let live = Live::start(ladder, "", &["--stopped"]);
    for run in 1..=20 {
        let said = live.say("mode run");
        assert!(said.out.starts_with("STOP (the ladder executed STOP"), "run {run}: {said:?}");
        assert!(said.err.contains("RUN was requested, but the controller is in STOP"), "{said:?}");
        assert_eq!(said.code, 1);
        live.await_values("D8", &run.to_string());
    }
}

/// Waits for a line on the standard error of a command.
fn line(child: &mut Child) -> String {
    let mut line = String::new();
    BufReader::new(child.stderr.as_mut().unwrap()).read_line(&mut line).unwrap();
    line
}

#[test]
fn a_command_reports_a_hung_process_and_ends() {
    let live = Live::start(LADDER, "", &[]);
    live.signal("STOP");
    let stopped = format!("`kill -CONT {}` continues it", live.child.id());
    let mut stop = live.command("mode stop").stderr(Stdio::piped()).spawn().unwrap();
    let told = line(&mut stop);
    assert!(told.contains("has not answered for 2 s; it is answered when the image"), "{told}");
    assert!(told.contains(&stopped), "{told}");
    let status = live.say("status");
    assert_eq!((status.code, status.err.lines().count()), (74, 2), "{status:?}");
    let [told, ended] = [0, 1].map(|at| status.err.lines().nth(at).unwrap());
    assert!(told.contains("has not answered for 2 s; waiting up to 10 s"), "{told}");
    assert!(ended.contains("gave no answer in 10 s: it hangs") && ended.contains(&stopped));
    // If the queue of the socket is full, no further client can connect.
    let waiting: Vec<_> = (0..200).map_while(|_| connected(&live)).collect();
    assert!(waiting.len() < 200);
    let said = live.say("log-level warn");
    assert!(said.code == 74 && said.err.contains("no client was accepted for 5 s"), "{said:?}");
    drop(waiting);
    live.signal("CONT");
    assert_eq!(stop.wait().unwrap().code(), Some(0), "it was only waiting");
    live.await_mode("STOP");
}

/// A connection, unless the queue of the socket is full.
fn connected(live: &Live) -> Option<OwnedFd> {
    let (flags, path) = (SocketFlags::NONBLOCK, SocketAddrUnix::new(&live.socket).unwrap());
    let stream = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None).unwrap();
    connect(&stream, &path).is_ok().then_some(stream)
}

#[test]
fn a_force_of_an_output_outside_run_reports_that_the_output_stays_safe() {
    let live = Live::start(LADDER, "", &["--stopped"]);
    let words = "only in RUN does the force reach the output";
    let said = live.say("force Y7 on");
    assert!(said.code == 0 && said.err.contains(words), "{said:?}");
    assert!(!live.say("force C7 on").err.contains(words));
    live.ok("mode run");
    assert!(!live.say("force Y7 on").err.contains(words));
}

/// Y0 is SET, Y1 holds its value, Y2 is ON when it is safe.
#[test]
fn an_output_is_shown_with_its_driven_value_outside_run() {
    let ladder = "[tags]\nfeeder = { at = \"Y0\" }\n[[program]]\nname = \"Main\"\nrung = [\n\
                  { when = [\"$FirstScan\"], do = [\"SET feeder\", \"SET Y1\"] },\n\
                  { when = [\"$On\"], do = [\"OUT C7\", \"OUT Y3\"] },\n]\n";
    let safe = "[outputs]\nhold = [\"Y1\"]\non = [\"Y2\"]\n";
    let live = Live::start(ladder, safe, &[]);
    live.await_values("C7", "ON");
    let in_run = "feeder  Y0  ON\nY1      Y1  ON\nY2      Y2  OFF\n";
    assert_eq!(live.ok("read Y0..Y2"), in_run);
    assert!(!live.ok("read feeder --json").contains("driven"));
    assert!(!live.ok("status").contains("\n  outputs "));
    live.ok("mode stop");
    assert_eq!(
        live.ok("read Y0..Y3 C7"),
        "\
feeder  Y0  ON  output OFF
Y1      Y1  ON  output ON
Y2      Y2  OFF  output ON
Y3      Y3  OFF  output OFF
C7      C7  OFF
"
    );
    let json = live.say("read --json feeder Y2 C7").json();
    let driven = |at: usize| json["values"][at]["driven"].clone();
    assert_eq!((driven(0), driven(1)), (false.into(), true.into()));
    assert!(driven(2).is_null(), "not of a C");
    let look = live.ok("watch feeder Y2 C7 --count 1");
    assert!(look.contains(" feeder=ON,output=OFF Y2=OFF,output=ON C7=OFF\n"), "{look}");
    let text = live.ok("status");
    let rows = "  outputs     at their safe values; these differ from memory:\n\
                \x20             feeder  Y0  ON  output OFF\n\
                \x20             Y2      Y2  OFF  output ON\n";
    assert!(text.contains(rows), "{text}");
    live.ok("force feeder off");
    live.ok("force Y2 on");
    let text = live.ok("status");
    assert!(text.contains("  outputs     at their safe values, as in memory\n"), "{text}");
    assert!(text.contains("feeder  Y0  OFF  forced  output OFF\n"), "{text}");
    assert_eq!(live.say("status --json").json()["outputs"], serde_json::json!([]));
}

#[test]
fn a_fault_keeps_memory_and_makes_outputs_safe() {
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a release build has no faults on purpose");
    }
    let ladder = "[[program]]\nname = \"Main\"\n\
                  rung = [ { when = [\"$On\"], do = [\"OUT Y1\"] } ]\n";
    let controller = "scan.period = \"2ms\"\nscan.watchdog = \"500ms\"\n";
    let live = Live::start_to_stall(ladder, controller, &[]);
    live.await_values("Y1", "ON");
    live.stall();
    live.await_mode("FAULT");
    assert_eq!(live.ok("read Y1"), "Y1  Y1  ON  output OFF\n");
    assert!(live.ok("status").contains("\n              Y1  Y1  ON  output OFF\n"));
}
