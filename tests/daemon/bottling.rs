//! A bottling plant with a lamp and a jam, run by the real binary. The tests of `rungd run` share
//! it.
//!
//! Each test writes its files into a folder of its own and starts the binary. The log goes to
//! standard error, as JSON lines or in a different form; the test reads it as a person or a machine
//! would.

use rungd_test_support::calm::calm;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

use serde_json::Value;

pub use rungd_test_support::running::process::*;

/// A ladder whose Main has the given rungs.
pub fn ladder(rungs: &str) -> String {
    format!(
        "[ladder]\nname = \"bottling\"\n\
         [tags]\n\
         jam = {{ at = \"C0\", alarm = \"Bottles jammed\" }}\n\
         lamp = {{ at = \"Y0\", log = \"change\" }}\n\
         [[program]]\nname = \"Main\"\n{rungs}"
    )
}

/// The lamp blinks; the jam alarm is ON from scan 10 to 39.
pub const ALIVE: &str = "[[program.rung]]\nwhen = [\"$100ms\"]\ndo = [\"OUT lamp\"]\n\
     [[program.rung]]\nwhen = [\"$ScanCounter >= 10\", \"$ScanCounter < 40\"]\n\
     do = [\"OUT jam\"]\n";
pub const STOPS: &str = "[[program.rung]]\nwhen = [\"$ScanCounter >= 5\"]\ndo = [\"STOP\"]\n\
     [[program.rung]]\nwhen = [\"$On\"]\ndo = [\"OUT lamp\", \"OUT jam\"]\n";

/// A folder with `controller.toml` and `ladder.toml`.
pub struct Plant(pub PathBuf);

impl Plant {
    pub fn new(rungs: &str, controller: &str) -> Plant {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let name = format!("run-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("ladder.toml"), ladder(rungs)).unwrap();
        let controller = calm(&format!("ladder = [\"ladder.toml\"]\n{controller}"));
        std::fs::write(folder.join("controller.toml"), controller).unwrap();
        Plant(folder)
    }

    pub fn command(&self, arguments: &[&str]) -> Command {
        // Under `nohup`, SIGHUP would stay ignored.
        let mut command = Command::new("env");
        command.args(["--default-signal=HUP", env!("CARGO_BIN_EXE_rungd"), "run"]);
        command.arg(self.0.join("controller.toml")).args(arguments);
        command.env_remove("RUNGD_LOG").env_remove("NOTIFY_SOCKET").env_remove("JOURNAL_STREAM");
        command.env_remove("RUNTIME_DIRECTORY").env_remove("STATE_DIRECTORY");
        command.stderr(Stdio::piped()).stdout(Stdio::piped());
        command
    }

    pub fn start(&self, arguments: &[&str]) -> Running {
        Running::new(self.command(arguments).args(["--log-format", "json"]))
    }

    /// Runs to the end; returns the exit code and the lines of the log.
    pub fn run(&self, arguments: &[&str]) -> (i32, Vec<Value>) {
        said(self.command(arguments).args(["--log-format", "json"]))
    }
}

/// The exit code and the log lines of a command that logs JSON.
pub fn said(command: &mut Command) -> (i32, Vec<Value>) {
    let output = command.output().unwrap();
    assert_eq!(output.stdout, b"", "standard output is for results");
    let text = String::from_utf8(output.stderr).unwrap();
    let lines = text.lines().map(|line| serde_json::from_str(line).expect(line));
    (output.status.code().unwrap(), lines.collect())
}

impl Drop for Plant {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
