//! ABC (of Berkeley) as a judge of AIGER files. Called by the tests of proofs.

use super::needs::not_installed;
use std::path::Path;
use std::process::Command;

/// The program's name in Debian.
const PROGRAM: &str = "berkeley-abc";

/// What ABC says of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AbcAnswer {
    /// No bad output is ever ON.
    Proved,
    /// The bad output of this number, from 0, can be ON.
    Asserted(usize),
}

/// Whether it is installed. If not, the test is skipped.
pub fn is_installed() -> bool {
    let is_installed = Command::new(PROGRAM).args(["-c", "quit"]).output().is_ok();
    if !is_installed {
        not_installed(PROGRAM);
    }
    is_installed
}

/// Property-directed reachability on a file; `None` if it does not end within these seconds. The exit
/// code says nothing. A file that ABC refuses, as one with two inputs of one name, fails the test.
pub fn judge(file: &Path, seconds: u32) -> Option<AbcAnswer> {
    let commands = format!("read_aiger {}; fold; pdr -T {seconds}", file.display());
    let output = Command::new(PROGRAM).args(["-c", &commands]).output().expect("ABC runs");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(!said.contains("from file has failed"), "{said}");
    if said.contains("Property proved") {
        return Some(AbcAnswer::Proved);
    }
    let line = said.lines().find(|line| line.contains("was asserted in frame"))?;
    let number = line.strip_prefix("Output ")?.split(' ').next()?.parse().ok()?;
    Some(AbcAnswer::Asserted(number))
}
