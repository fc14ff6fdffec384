//! Signals to a process, and commands of the system.

use std::ffi::OsStr;
use std::process::{Child, Command, Stdio};

/// Sends a signal to a process: `TERM`, `STOP`.
pub fn signal(process: &Child, name: &str) {
    let pid = process.id().to_string();
    assert!(Command::new("kill").args(["-s", name, &pid]).status().unwrap().success());
}

/// Executes a command without its output; returns whether it succeeds.
pub fn shell<W: AsRef<OsStr>>(words: &[W]) -> bool {
    let mut command = Command::new(&words[0]);
    let command = command.args(&words[1..]).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}
