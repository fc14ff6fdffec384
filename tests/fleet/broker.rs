//! Real brokers for tests: mosquitto, and a cluster of three NATS servers. Each broker is a process
//! on loopback ports that the system chooses. A test kills it, pauses it (SIGSTOP) or starts it
//! again. `mosquitto.rs` and `nats.rs` use this file; it does not depend on them.

use std::fs::File;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

pub use rungd_test_support::patience::PATIENCE;

/// A broker's process. Dropping this value ends it by SIGKILL.
pub struct Process {
    command: Vec<String>,
    log: PathBuf,
    child: Option<Child>,
}

impl Process {
    /// A process that is not started yet; `log` receives its output.
    pub fn new(command: Vec<String>, log: PathBuf) -> Process {
        Process { command, log, child: None }
    }

    /// Starts the process.
    pub fn start(&mut self) {
        assert!(self.child.is_none(), "{:?} runs already", self.command);
        let log = File::options().create(true).append(true).open(&self.log).unwrap();
        let mut command = Command::new(&self.command[0]);
        command.args(&self.command[1..]).stdin(Stdio::null());
        command.stdout(log.try_clone().unwrap()).stderr(log);
        self.child = Some(command.spawn().unwrap());
    }

    /// Ends the process by SIGKILL. It writes nothing of its memory to the disk.
    pub fn kill(&mut self) {
        if let Some(mut child) = self.child.take() {
            child.kill().unwrap();
            child.wait().unwrap();
        }
    }

    /// Pauses the process (SIGSTOP): its sockets stay open, and it answers nothing.
    pub fn stop(&self) {
        self.signal(Signal::STOP);
    }

    /// Continues the process after [`Process::stop`].
    pub fn cont(&self) {
        self.signal(Signal::CONT);
    }

    /// Whether the process has ended by itself.
    pub fn has_ended(&mut self) -> bool {
        self.child.as_mut().is_none_or(|child| child.try_wait().unwrap().is_some())
    }

    /// The output of the process since its first start.
    pub fn said(&self) -> String {
        let bytes = std::fs::read(&self.log).unwrap_or_default();
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// Waits until the process has printed a word `count` times. False if it ended earlier.
    pub fn waits_for(&mut self, word: &str, count: usize) -> bool {
        let begun = Instant::now();
        loop {
            if self.said().matches(word).count() >= count {
                return true;
            }
            if self.has_ended() {
                return false;
            }
            assert!(begun.elapsed() < PATIENCE, "no `{word}`: {}", self.said());
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    fn signal(&self, signal: Signal) {
        let child = self.child.as_ref().expect("it runs");
        kill_process(Pid::from_child(child), signal).unwrap();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

/// Ports of 127.0.0.1 that were free a moment ago. A broker whose port is taken by then ends, and
/// is started again with other ports.
pub fn free_ports(count: usize) -> Vec<u16> {
    let open = || TcpListener::bind("127.0.0.1:0").unwrap();
    let listeners: Vec<TcpListener> = (0..count).map(|_| open()).collect();
    listeners.iter().map(|listener| listener.local_addr().unwrap().port()).collect()
}

/// The path of a program: in `PATH`, or in the folders that `.ci/run` and Debian install to.
pub fn program(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    folders.push(std::env::temp_dir().join("rungd-ci-venv/bin"));
    folders.push(Path::new("/usr/sbin").to_owned());
    folders.into_iter().map(|folder| folder.join(name)).find(|path| path.is_file())
}
