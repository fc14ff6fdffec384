//! Signals to a process, and commands of the system.

use std::ffi::OsStr;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::patience::PATIENCE;

/// Sends a signal to a process: `TERM`, `STOP`.
pub fn signal(process: &Child, name: &str) {
    let pid = process.id().to_string();
    assert!(Command::new("kill").args(["-s", name, &pid]).status().unwrap().success());
}

/// Waits for the end of a process, whose output nobody needs to read.
pub fn end(process: &mut Child) -> ExitStatus {
    let deadline = Instant::now() + PATIENCE;
    while Instant::now() < deadline {
        if let Some(status) = process.try_wait().unwrap() {
            return status;
        }
        sleep(Duration::from_millis(5));
    }
    panic!("process {} did not end", process.id());
}

/// Executes a command without its output; returns whether it succeeds.
pub fn shell<W: AsRef<OsStr>>(words: &[W]) -> bool {
    let mut command = Command::new(&words[0]);
    let command = command.args(&words[1..]).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}
