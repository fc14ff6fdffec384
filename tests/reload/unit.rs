//! `rungd reload --controller FILE --pid PID`, as the systemd unit runs it: files with errors, and
//! a socket at which a different process answers.

use std::fs;
use std::process::Command;

use rungd_test_support::running::live::said;
use rungd_test_support::running::process::{Plant, Running};
use serde_json::Value;

const LADDER: &str =
    "[[program]]\nname = \"Main\"\nrung = [ { when = [\"X0\"], do = [\"OUT Y0\"] } ]\n";

/// `rungd reload` with the controller file of this plant.
fn reload(plant: &Plant) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.arg("reload").arg("--controller").arg(plant.0.join("controller.toml"));
    ["RUNGD_SOCKET", "RUNTIME_DIRECTORY"].iter().for_each(|name| {
        command.env_remove(name);
    });
    command
}

fn started(plant: &Plant) -> Running {
    let running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN: scanning every");
    running
}

fn write(plant: &Plant, name: &str, text: &str) {
    fs::write(plant.0.join(name), text).unwrap();
}

/// Stops the controller; no line of its log may be about a reload.
fn stopped_without_a_reload(mut running: Running) {
    let lines = running.stop();
    let of_reload = |line: &&Value| line["event"].as_str().unwrap_or("").starts_with("reload");
    assert_eq!(lines.iter().find(of_reload), None);
}

#[test]
fn a_reload_of_a_file_with_errors_is_refused_without_a_signal() {
    let not_toml = "ladder = [\"ladder.toml\"\n[operator]\nsocket = \"op\"\n";
    let misspelt = "ladder = [\"ladder.toml\"]\n[operator]\nsoket = \"op\"\n";
    let wrong_key = "ladder = [\"ladder.toml\"]\nfoo = 1\n[operator]\nenabled = false\n";
    let wrong_name = "ladder = [\"nowhere.toml\"]\n[operator]\nenabled = false\n";
    for (operator, broken, finding) in [
        ("socket = \"op\"", not_toml, "error[toml-syntax]"),
        ("socket = \"op\"", misspelt, "error[unknown-key]"),
        ("enabled = false", wrong_key, "error[unknown-key]"),
        ("enabled = false", wrong_name, "nowhere.toml"),
    ] {
        let plant = Plant::new(LADDER, &format!("[operator]\n{operator}\n"));
        let running = started(&plant);
        write(&plant, "controller.toml", broken);
        let said = said(reload(&plant).args(["--pid", &running.pid()]));
        assert_eq!(said.code, 78, "{said:?}");
        assert!(said.err.contains(finding), "{said:?}");
        assert!(said.err.ends_with("nothing is changed\n"), "{said:?}");
        stopped_without_a_reload(running);
    }
}

#[test]
fn a_reload_of_a_missing_file_is_refused_without_a_signal() {
    let plant = Plant::new(LADDER, "[operator]\nsocket = \"op\"\n");
    let running = started(&plant);
    fs::remove_file(plant.0.join("controller.toml")).unwrap();
    let said = said(reload(&plant).args(["--pid", &running.pid()]));
    assert_eq!(said.code, 78, "{said:?}");
    assert!(said.err.contains("No such file"), "{said:?}");
    stopped_without_a_reload(running);
}

/// The packaged controller file names no socket, so an error in it does not hide the socket.
#[test]
fn the_process_at_the_default_socket_refuses_a_file_with_errors() {
    let plant = Plant::new(LADDER, "");
    let folder = plant.0.join("run");
    fs::create_dir(&folder).unwrap();
    let mut command = plant.command(&[] as &[&str]);
    let mut running = Running::new(command.env("RUNTIME_DIRECTORY", &folder));
    running.line("RUN: scanning every");
    write(&plant, "controller.toml", "ladder = [");
    let mut command = reload(&plant);
    command.args(["--pid", &running.pid()]).env("RUNTIME_DIRECTORY", &folder);
    let said = said(&mut command);
    assert_eq!(said.code, 78, "{said:?}");
    assert!(said.err.contains("error[toml-syntax]"), "{said:?}");
    let lines = running.stop();
    assert!(lines.iter().any(|line| line["event"] == "reload-refused"), "{lines:#?}");
}

#[test]
fn a_different_process_at_the_socket_is_not_reloaded() {
    let plant = Plant::new(LADDER, "[operator]\nsocket = \"op\"\n");
    let other = Plant::new(LADDER, "[operator]\nenabled = false\n");
    let (first, second) = (started(&plant), started(&other));
    write(&plant, "ladder.toml", &format!("{LADDER}# edited\n"));
    let said = said(reload(&plant).args(["--pid", &second.pid()]));
    assert_eq!((said.code, said.out.as_str()), (69, ""), "{said:?}");
    let (answers, meant) = (first.pid(), second.pid());
    assert!(said.err.contains(&format!("process {answers} answers at ")), "{said:?}");
    assert!(said.err.contains(&format!("not process {meant}: nothing is reloaded")), "{said:?}");
    stopped_without_a_reload(first);
    stopped_without_a_reload(second);
}

/// Without a process, a file with errors does not lead to the socket of the environment: its
/// controller may be a different one.
#[test]
fn a_file_with_errors_does_not_reload_the_controller_of_the_environment() {
    let other = Plant::new(LADDER, "[operator]\nsocket = \"op\"\n");
    let running = started(&other);
    write(&other, "ladder.toml", &format!("{LADDER}# edited\n"));
    let plant = Plant::new(LADDER, "[operator]\nsocket = \"op\"\n");
    write(&plant, "controller.toml", "ladder = [");
    let said = said(reload(&plant).env("RUNGD_SOCKET", other.0.join("op")));
    assert_eq!((said.code, said.out.as_str()), (78, ""), "{said:?}");
    stopped_without_a_reload(running);
}
