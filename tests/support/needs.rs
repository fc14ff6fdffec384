//! The requirements of a test on the machine. If one is missing, the test prints the reason and
//! passes. If `RUNGD_REQUIRE` names the requirement, the test fails instead. `.ci/run` probes the
//! machine and sets this variable.
//!
//! A probe asks an optional program for what the tests need of it: a version, a module, a
//! permission. An installed program that is too old is a reason to skip, not a failure.

use std::path::Path;
use std::process::{Command, Stdio};

/// A property that not every machine has.
#[derive(Clone, Copy, Debug)]
pub enum Need {
    /// Programs and Python modules that `.ci/run` installs.
    Programs,
    /// Permission to make a mount namespace.
    MountNamespace,
    /// Permission to make a time namespace.
    TimeNamespace,
    /// An ext4 image on a loop device.
    Ext4,
    Root,
    /// The named points of `crates/base/src/faults.rs`, which a release build lacks.
    Faults,
}

impl Need {
    fn word(self) -> &'static str {
        match self {
            Need::Programs => "programs",
            Need::MountNamespace => "mount-namespace",
            Need::TimeNamespace => "time-namespace",
            Need::Ext4 => "ext4",
            Need::Root => "root",
            Need::Faults => "faults",
        }
    }
}

/// Prints the reason why a test is skipped; fails if the need is required.
pub fn skip(need: Need, why: &str) {
    skip_under(&std::env::var("RUNGD_REQUIRE").unwrap_or_default(), need, why);
}

fn skip_under(required: &str, need: Need, why: &str) {
    let word = need.word();
    let is_required = required.split_whitespace().any(|required| required == word);
    assert!(!is_required, "{why}, and RUNGD_REQUIRE wants {word}");
    eprintln!("skipped: {why}");
}

/// Skips a test because a program is not installed.
pub fn not_installed(program: &str) {
    skip(Need::Programs, &format!("{program} is not installed"));
}

/// The result of a probe: the reason why the tests cannot use what is installed.
pub type Probed = Result<(), String>;

/// Whether a probe succeeded. If not, the test is skipped.
pub fn usable(probed: Probed) -> bool {
    if let Err(why) = &probed {
        skip(Need::Programs, why);
    }
    probed.is_ok()
}

/// A probe: this command succeeds. The last line of what it says is the reason if it does not.
pub fn works(what: &str, command: &mut Command) -> Probed {
    let output = command.stdin(Stdio::null()).output();
    let output = output.map_err(|_| format!("{what} is not installed"))?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let why = said.trim().lines().last().unwrap_or("it ends with an error");
    if output.status.success() { Ok(()) } else { Err(format!("{what} is not usable here: {why}")) }
}

/// A probe: the version that this command prints is at least `least`. Its exit code is ignored:
/// some programs print their version in their help.
fn at_least(what: &str, command: &mut Command, least: [u32; 3]) -> Probed {
    let output = command.stdin(Stdio::null()).output();
    let output = output.map_err(|_| format!("{what} is not installed"))?;
    let said = [output.stdout, output.stderr].concat();
    let is = version(&String::from_utf8_lossy(&said));
    let is = is.ok_or_else(|| format!("{what} prints no version"))?;
    let written = |of: [u32; 3]| of.map(|part| part.to_string()).join(".");
    let why = || format!("{what} is {}, and the tests need {}", written(is), written(least));
    if is >= least { Ok(()) } else { Err(why()) }
}

/// The first version in a text.
fn version(text: &str) -> Option<[u32; 3]> {
    let mut words = text.split(|c: char| !(c.is_ascii_digit() || c == '.'));
    words.find_map(|word| {
        let mut parts = word.split('.').map(|part| part.parse().ok());
        let (first, second) = (parts.next()??, parts.next()??);
        Some([first, second, parts.next().flatten().unwrap_or(0)])
    })
}

/// 2.9 takes no `.` in a topic, and every topic of Sparkplug begins with `spBv1.0`.
pub fn nats_server(program: &Path) -> Probed {
    at_least("nats-server", Command::new(program).arg("--version"), [2, 10, 0])
}

/// The tests configure a listener as mosquitto 2 wants it.
pub fn mosquitto(program: &Path) -> Probed {
    at_least("mosquitto", Command::new(program).arg("-h"), [2, 0, 0])
}

/// Earlier versions have no `-addext`.
pub fn openssl(program: &Path) -> Probed {
    at_least("openssl", Command::new(program).arg("version"), [1, 1, 1])
}

/// The first version with the functions of the oldest configuration of `docs/editors.md`.
pub fn neovim(program: &Path) -> Probed {
    at_least("nvim", Command::new(program).arg("--version"), [0, 7, 0])
}

/// Some images have a `man` that only says that there are no pages.
pub fn man(program: &Path) -> Probed {
    at_least("man", Command::new(program).arg("--version"), [2, 0, 0])
}

/// `program` is `prometheus` or `promtool`; the version is the oldest that the tests have run with.
pub fn prometheus(program: &str) -> Probed {
    at_least(program, Command::new(program).arg("--version"), [2, 42, 0])
}

/// The readers of the pages about files, and the peers that need no module.
pub fn python() -> Probed {
    at_least("python3", Command::new("python3").arg("--version"), [3, 7, 0])
}

/// A probe: a Python can execute this line, which uses what a test needs of a module.
pub fn python_can(python: &Path, what: &str, line: &str) -> Probed {
    works(what, Command::new(python).args(["-c", line]))
}

/// It may be installed where no process may trace another.
pub fn strace(program: &Path) -> Probed {
    works("strace", Command::new(program).args(["-o", "/dev/null", "true"]))
}

/// Writes a program that prints a text to both outputs, and ends with a code. A process of its own
/// writes it: a file that is open for writing cannot be executed ("text file busy"), and a process
/// that another test starts meanwhile would keep it open.
#[cfg(test)]
fn fake(folder: &Path, name: &str, text: &str, code: i32) -> std::path::PathBuf {
    let path = folder.join(name);
    let script = format!("#!/bin/sh\necho \"{text}\"\necho \"{text}\" >&2\nexit {code}\n");
    let mut shell = Command::new("sh");
    shell.args(["-c", "printf %s \"$1\" > \"$2\" && chmod 755 \"$2\"", "sh", &script]);
    assert!(shell.arg(&path).status().unwrap().success());
    path
}

#[test]
fn a_test_is_skipped_if_its_program_is_too_old() {
    let folder = super::folder::TestFolder::new("needs-old");
    let of = |name: &str, said: &str, code| fake(folder.path(), name, said, code);
    let refused = |probed: Probed, why: &str| assert_eq!(probed, Err(why.to_owned()));
    let old = of("nats-server", "nats-server: v2.9.10", 0);
    refused(nats_server(&old), "nats-server is 2.9.10, and the tests need 2.10.0");
    let old = of("mosquitto", "mosquitto version 1.4.15", 3);
    refused(mosquitto(&old), "mosquitto is 1.4.15, and the tests need 2.0.0");
    let old = of("nvim", "NVIM v0.6.1", 0);
    refused(neovim(&old), "nvim is 0.6.1, and the tests need 0.7.0");
    let old = of("openssl", "OpenSSL 1.1.0l  10 Sep 2019", 0);
    refused(openssl(&old), "openssl is 1.1.0, and the tests need 1.1.1");
    let stub = of("man", "This system has been minimized", 0);
    refused(man(&stub), "man prints no version");
    refused(neovim(&folder.path().join("none")), "nvim is not installed");
}

#[test]
fn a_test_runs_if_its_program_is_new_enough() {
    let folder = super::folder::TestFolder::new("needs-new");
    let of = |name: &str, said: &str, code| fake(folder.path(), name, said, code);
    assert_eq!(nats_server(&of("nats-server", "nats-server: v2.10.0", 0)), Ok(()));
    assert_eq!(mosquitto(&of("mosquitto", "mosquitto version 2.0.11", 3)), Ok(()));
    assert_eq!(neovim(&of("nvim", "NVIM v0.10.4", 0)), Ok(()));
    assert_eq!(openssl(&of("openssl", "OpenSSL 3.0.15 3 Sep 2024", 0)), Ok(()));
    assert_eq!(man(&of("man", "man 2.11.2", 0)), Ok(()));
}

#[test]
fn the_reason_of_a_skip_is_the_error_of_the_missing_module() {
    let folder = super::folder::TestFolder::new("needs-module");
    let error = "ModuleNotFoundError: No module named 'serial'";
    let python = fake(folder.path(), "python3", &format!("Traceback:\n{error}"), 1);
    let why = Err(format!("pyserial is not usable here: {error}"));
    assert_eq!(python_can(&python, "pyserial", "import serial"), why);
    let strace_here = fake(folder.path(), "strace", "ptrace: Operation not permitted", 1);
    let why = "strace is not usable here: ptrace: Operation not permitted".to_owned();
    assert_eq!(strace(&strace_here), Err(why));
}

#[test]
fn a_need_that_is_not_required_is_skipped() {
    skip_under("", Need::Ext4, "no ext4");
    skip_under("programs root", Need::Ext4, "no ext4");
}

#[test]
#[should_panic = "no ext4, and RUNGD_REQUIRE wants ext4"]
fn a_required_need_is_never_skipped() {
    skip_under("programs ext4", Need::Ext4, "no ext4");
}
