//! A start whose disk does not answer says what it waits for, to the log and to systemd; a signal
//! ends it.

use std::fs;
use std::os::unix::net::UnixDatagram;

use crate::retain::memory::{COUNTS, KEEPS, Need, Plant, Running, message, skip};

/// A controller whose retentive memory cannot be opened until `faults.hold` is gone.
fn stalled(plant: &Plant) -> Running {
    fs::write(plant.0.join("faults.hold"), "").unwrap();
    fs::write(plant.0.join("faults"), "retain-open").unwrap();
    let mut command = plant.command(&[] as &[&str]);
    command.env("RUNGD_FAULTS", plant.0.join("faults"));
    command.env("NOTIFY_SOCKET", plant.0.join("notify"));
    Running::new(command.args(["--repeat-reason", "100ms"]))
}

/// Waits for a notice that contains these words.
fn notice(socket: &UnixDatagram, words: &str) -> String {
    let mut bytes = [0; 4096];
    loop {
        let read = socket.recv(&mut bytes).expect(words);
        let text = String::from_utf8_lossy(&bytes[..read]).into_owned();
        if text.contains(words) {
            return text;
        }
    }
}

#[test]
fn a_start_on_a_stalled_disk_names_the_disk_that_it_waits_for() {
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a build without debug assertions has no faults on purpose");
    }
    let plant = Plant::new(COUNTS, KEEPS);
    let (systemd, _) = plant.notify();
    let mut running = stalled(&plant);
    let line = running.line("the start has waited");
    assert_eq!((&line["event"], &line["level"]), (&"start-waits".into(), &"WARN".into()));
    let memory = plant.0.join("memory").display().to_string();
    assert_eq!(line["waits_for"], format!("the disk of retentive memory, {memory}"));
    running.line("the start has waited");
    let status = notice(&systemd, "STATUS=");
    assert_eq!(
        status,
        format!("STATUS=the start waits for the disk of retentive memory, {memory}\n")
    );
    notice(&systemd, "EXTEND_TIMEOUT_USEC=");
    fs::remove_file(plant.0.join("faults.hold")).unwrap();
    let line = running.line("the start goes on, after");
    assert_eq!((&line["event"], &line["level"]), (&"start-goes-on".into(), &"INFO".into()));
    running.line("RUN");
    notice(&systemd, "READY=1");
    running.stop();
}

#[test]
fn a_signal_ends_a_start_on_a_stalled_disk() {
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a build without debug assertions has no faults on purpose");
    }
    let plant = Plant::new(COUNTS, KEEPS);
    let mut running = stalled(&plant);
    running.line("the start has waited");
    let (lines, code) = running.stop_with_code();
    let said = lines.iter().map(message).find(|said| said.starts_with("SIGTERM")).unwrap();
    assert!(said.contains("the start was waiting for the disk of retentive memory, "), "{said}");
    assert!(said.ends_with(", nothing was scanned"), "{said}");
    assert_eq!(code, Some(0));
}
