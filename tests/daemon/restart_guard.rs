//! The restart guard with the real binary: after ten restarts with unclean ends, it starts in STOP.

use rungd_test_support::running::process;
use std::fs;
use std::path::Path;
use std::process::Command;

use rungd_test_support::running::process::{BLINKS, Plant, Running, message};
use serde_json::Value;

fn plant() -> Plant {
    let plant = Plant::new(BLINKS, "");
    fs::create_dir(plant.0.join("run")).unwrap();
    plant
}

/// The command as systemd runs it.
fn command(plant: &Plant) -> Command {
    let mut command = plant.command(&[] as &[&str]);
    command.env("RUNTIME_DIRECTORY", plant.0.join("run"));
    command
}

fn kill(mut running: Running) {
    running.signal("KILL");
    running.end();
}

/// Starts the controller, lets it scan and kills it, this number of times.
fn crash(plant: &Plant, times: u32) {
    for _ in 0..times {
        let running = Running::new(&mut command(plant));
        running.line("RUN: scanning");
        kill(running);
    }
}

#[test]
fn the_controller_starts_in_stop_after_ten_kills_and_reports_the_reason() {
    let plant = plant();
    crash(&plant, 10);
    let (socket, path) = plant.notify();
    let mut tenth = command(&plant);
    tenth.env("NOTIFY_SOCKET", path).args(["--repeat-reason", "100ms"]);
    let mut running = Running::new(&mut tenth);
    let guard = running.line("10 restarts after unclean ends, without 10m in RUN between them");
    assert_eq!((&guard["event"], &guard["level"]), (&"restart-guard".into(), &"WARN".into()));
    let stop = running.line("STOP: it was restarted too often");
    assert!(message(&stop).contains("`rungd mode run`, or an orderly restart"), "{stop}");
    running.line("still in STOP after");
    running.line("still in STOP after");
    let mut bytes = [0; 512];
    while !bytes.starts_with(b"READY=1") {
        socket.recv(&mut bytes).unwrap();
    }
    // After a kill in STOP it starts in STOP again. After an orderly stop the count starts at zero,
    // because an orderly stop is a person's decision.
    running.signal("KILL");
    running.end();
    let mut running = Running::new(&mut command(&plant));
    running.line("11 restarts after unclean ends");
    let lines = running.stop();
    assert!(lines.iter().all(|line| !message(line).starts_with("RUN")), "{lines:#?}");
    let mut running = Running::new(&mut command(&plant));
    running.line("RUN: scanning");
    running.stop();
}

#[test]
fn a_healthy_time_in_run_resets_the_restart_count() {
    let plant = plant();
    crash(&plant, 9);
    let mut healthy = command(&plant);
    let running = Running::new(healthy.args(["--healthy-after", "200ms"]));
    let counted = running.line("restart 9 of 10");
    assert_eq!((&counted["event"], &counted["restarts"]), (&"restart-counted".into(), &9.into()));
    let reset = running.line("200ms in RUN: the count of restarts starts again at 0");
    assert_eq!(reset["event"], "restart-guard-reset");
    let file = plant.0.join("run/restarts");
    let written = || fs::read_to_string(&file).unwrap() == "restarts=0 process=running\n";
    while !written() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    kill(running);
    Running::new(&mut command(&plant)).line("restart 1 of 10");
}

#[test]
fn a_refused_program_does_not_change_the_restart_count() {
    let plant = plant();
    crash(&plant, 2);
    let ladder = plant.0.join("ladder.toml");
    fs::write(&ladder, "[[program]]\n").unwrap();
    for _ in 0..3 {
        assert_eq!(Running::new(&mut command(&plant)).end().code(), Some(78));
    }
    let count = fs::read_to_string(plant.0.join("run/restarts")).unwrap();
    assert_eq!(count, "restarts=2 process=ended\n");
    fs::write(&ladder, BLINKS).unwrap();
    crash(&plant, 1);
    Running::new(&mut command(&plant)).line("restart 3 of 10");
}

/// The lines of an orderly run of three scans.
fn three_scans(command: &mut Command) -> Vec<Value> {
    let mut running = Running::new(command.args(["--scans", "3"]));
    let lines = running.rest();
    assert_eq!(running.end().code(), Some(0), "{lines:#?}");
    lines
}

fn guard_events(lines: &[Value]) -> Vec<&Value> {
    let names = lines.iter().map(|line| &line["event"]);
    names.filter(|name| name.as_str().is_some_and(|n| n.starts_with("restart"))).collect()
}

#[test]
fn an_invalid_guard_file_is_reported_and_the_start_succeeds() {
    let plant = plant();
    let file = plant.0.join("run/restarts");
    type Spoiling = fn(&Path);
    let spoil: [(&str, Spoiling); 4] = [
        ("is lost: it is not what rungd wrote", |file| fs::write(file, "ten").unwrap()),
        ("is left as it is: it is no file", |file| fs::create_dir(file).unwrap()),
        ("is left as it is: it is no file", |file| {
            assert!(Command::new("mkfifo").arg(file).status().unwrap().success());
        }),
        ("are not counted", |file| fs::remove_dir_all(file.parent().unwrap()).unwrap()),
    ];
    for (words, spoil) in spoil {
        let _ = fs::remove_dir_all(&file);
        let _ = fs::remove_file(&file);
        spoil(&file);
        let mut named = plant.command(&[] as &[&str]);
        let lines = three_scans(named.arg("--restart-guard").arg(&file));
        let told = process::find(&lines, words);
        assert_eq!(
            (&told["event"], &told["level"]),
            (&"restart-guard-file".into(), &"WARN".into())
        );
        process::find(&lines, "RUN: scanning");
    }
}

#[test]
fn restarts_without_systemd_are_counted_only_in_a_named_file() {
    let plant = plant();
    let lines = three_scans(&mut plant.command(&[] as &[&str]));
    assert!(guard_events(&lines).is_empty(), "{lines:#?}");
    let file = plant.0.join("count");
    fs::write(&file, "restarts=3 process=running\n").unwrap();
    let mut named = plant.command(&[] as &[&str]);
    let lines = three_scans(named.arg("--restart-guard").arg(&file));
    assert_eq!(guard_events(&lines), ["restart-counted"]);
    assert!(!file.exists(), "an orderly end");
}
