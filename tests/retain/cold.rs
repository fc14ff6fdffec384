//! The real binary that finds nothing to restore, with `cold-start = "stop"`: the log names a
//! restart as a remedy only if the restart would run the controller.

use std::fs;
use std::process::Command;

use crate::retain::memory::{COUNTS, KEEPS, Plant, Running, file, held, message, until};
use serde_json::Value;

/// A controller that waits in STOP after a cold start, with this line in `[operator]`.
fn cold(operator: &str) -> Plant {
    let keeps = KEEPS.replace("cold-start = \"run\"\n", "");
    Plant::new(COUNTS, &keeps.replace("socket = \"op\"", operator))
}

const SOCKET: &str = "socket = \"op\"";
const NO_SOCKET: &str = "enabled = false";
/// The remedies.
const NO_RESTART: &str = "`rungd mode run` runs it again; a restart finds nothing to restore";
const RESTART: &str = "`rungd mode run`, or a restart of rungd, runs it again";
const BY_HAND: &str = "rungd run --cold-start run FILE";

/// The next line of this event; its message must contain `words`.
fn line(running: &Running, event: &str, words: &str) -> Value {
    loop {
        let line = running.line("");
        if line["event"] == event {
            assert!(message(&line).contains(words), "no `{words}`: {line}");
            return line;
        }
    }
}

/// Whether the command succeeds.
fn is_done(plant: &Plant, words: &[&str]) -> bool {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let output = command.args(words).arg("--socket").arg(plant.0.join("op")).output().unwrap();
    output.status.success()
}

/// The start of a process that the restart guard keeps in STOP.
fn guarded(plant: &Plant) -> Running {
    let count = plant.0.join("restarts");
    fs::write(&count, "restarts=10 process=running\n").unwrap();
    let mut command = plant.command(&[] as &[&str]);
    command.arg("--restart-guard").arg(count).args(["--repeat-reason", "100ms"]);
    Running::new(&mut command)
}

#[test]
fn the_restart_guard_does_not_suggest_a_restart_without_retained_memory() {
    let plant = cold(SOCKET);
    let mut running = guarded(&plant);
    let guard = line(&running, "restart-guard", "STOP");
    assert!(!message(&guard).contains("runs it again"), "{guard}");
    for event in ["mode-stop", "mode-still"] {
        line(&running, event, NO_RESTART);
    }
    running.stop();
    // The next start finds nothing to restore, as the line says.
    let again = Running::new(&mut plant.command(&[] as &[&str]));
    line(&again, "mode-stop", "a restart finds nothing to restore either");
    drop(again);
    let alone = cold(NO_SOCKET);
    line(&guarded(&alone), "mode-stop", BY_HAND);
}

#[test]
fn a_start_in_stop_without_an_operator_socket_names_the_way_to_run() {
    let plant = cold(NO_SOCKET);
    let start = || {
        let mut command = plant.command(&[] as &[&str]);
        Running::new(command.args(["--stopped", "--repeat-reason", "100ms"]))
    };
    let mut running = start();
    for event in ["mode-stop", "mode-still"] {
        let said = line(&running, event, BY_HAND);
        assert!(message(&said).contains("without `--stopped`"), "{said}");
    }
    running.stop();
    let mut command = plant.command(&[] as &[&str]);
    let mut once = Running::new(command.args(["--cold-start", "run", "--scans", "5"]));
    once.rest();
    assert_eq!(once.end().code(), Some(0));
    line(&start(), "mode-stop", "restart rungd without `--stopped`");
}

#[test]
fn a_fault_before_the_first_image_does_not_suggest_a_restart() {
    let keeps = KEEPS.replace("cold-start = \"run\"\n", "");
    let plant = Plant::new(COUNTS, &format!("scan.watchdog = \"500ms\"\n{keeps}"));
    let faults = plant.0.join("faults");
    let mut command = plant.command(&[] as &[&str]);
    command.env("RUNGD_FAULTS", &faults).args(["--repeat-reason", "100ms"]);
    let running = Running::new(&mut command);
    line(&running, "mode-stop", "");
    let stall = || {
        fs::write(&faults, "stall").unwrap();
        until(|| !faults.exists());
    };
    stall();
    // The first scan stalls: the answer may be RUN or FAULT.
    is_done(&plant, &["mode", "run"]);
    for event in ["mode-fault", "mode-still"] {
        line(&running, event, NO_RESTART);
    }
    assert_eq!(held(&file(&plant)), None);
    until(|| is_done(&plant, &["mode", "run"]) && held(&file(&plant)).is_some());
    stall();
    line(&running, "mode-fault", RESTART);
}

#[test]
fn a_restart_is_suggested_once_an_image_is_kept() {
    let plant = cold(SOCKET);
    let running = Running::new(&mut plant.command(&[] as &[&str]));
    line(&running, "mode-stop", "");
    assert!(is_done(&plant, &["mode", "run"]));
    until(|| held(&file(&plant)).is_some());
    assert!(is_done(&plant, &["mode", "stop"]));
    line(&running, "mode-stop", RESTART);
}

#[test]
fn a_restart_is_not_suggested_if_no_image_can_be_written() {
    let plant = cold(SOCKET);
    fs::create_dir_all(plant.0.join("memory.new/in-the-way")).unwrap();
    let running = Running::new(&mut plant.command(&[] as &[&str]));
    line(&running, "mode-stop", "");
    assert!(is_done(&plant, &["mode", "run"]));
    line(&running, "mode-run", "");
    line(&running, "retain-failed", "");
    plant.ask_for(&["mode", "stop"], 74);
    line(&running, "mode-stop", NO_RESTART);
}
