//! One mosquitto, with or without TLS and passwords.

use std::path::{Path, PathBuf};

use crate::fleet::broker::{Process, free_ports, program};
use crate::fleet::certificates::Certificates;
use rungd_test_support::folder::TestFolder;
use rungd_test_support::needs::{self, not_installed, usable};

/// The options of a mosquitto.
#[derive(Default)]
pub struct MosquittoOptions {
    /// Use TLS, and refuse clients without a certificate of the test's authority.
    pub tls: bool,
    /// The only accepted user, with the password.
    pub login: Option<(&'static str, &'static str)>,
    /// Additional lines of its configuration.
    pub lines: &'static str,
}

/// A mosquitto on a port of 127.0.0.1. A new start keeps the port.
pub struct Mosquitto {
    pub port: u16,
    /// Present with TLS.
    pub certificates: Option<Certificates>,
    process: Process,
    /// Dropped after the process, which writes to it.
    _folder: TestFolder,
    lives: usize,
}

impl Mosquitto {
    /// Starts a mosquitto, and waits until it listens. If it is not installed, prints that and
    /// returns `None`.
    pub fn start(options: &MosquittoOptions) -> Option<Mosquitto> {
        let Some(mosquitto) = program("mosquitto") else {
            not_installed("mosquitto");
            return None;
        };
        let openssl = || usable(needs::openssl(Path::new("openssl")));
        if !usable(needs::mosquitto(&mosquitto)) || options.tls && !openssl() {
            return None;
        }
        let folder = TestFolder::new("mosquitto");
        let certificates = options.tls.then(|| Certificates::make(&folder.path().join("tls")));
        loop {
            let [port] = free_ports(1)[..] else { panic!("one port was asked for") };
            let conf = configuration(options, certificates.as_ref(), folder.path());
            let conf = format!("listener {port} 127.0.0.1\n{conf}");
            let file = folder.path().join("mosquitto.conf");
            std::fs::write(&file, &conf).unwrap();
            let words = [mosquitto.clone(), "-c".into(), file, "-v".into()];
            let command = words.iter().map(|word| word.display().to_string()).collect();
            let log = folder.path().join(format!("log-{port}"));
            let mut process = Process::new(command, log);
            process.start();
            if process.waits_for(" running", 1) {
                return Some(Mosquitto { port, certificates, process, _folder: folder, lives: 1 });
            }
            let said = process.said();
            assert!(said.contains("Address already in use"), "{conf}\n{said}");
        }
    }

    /// The address as rungd's settings write it.
    pub fn url(&self) -> String {
        let scheme = if self.certificates.is_some() { "mqtts" } else { "mqtt" };
        format!("{scheme}://localhost:{}", self.port)
    }

    /// Ends the broker by SIGKILL.
    pub fn kill(&mut self) {
        self.process.kill();
    }

    /// Starts the broker again after [`Mosquitto::kill`], and waits until it listens.
    pub fn start_again(&mut self) {
        self.lives += 1;
        self.process.start();
        let runs = self.process.waits_for(" running", self.lives);
        assert!(runs, "{}", self.process.said());
    }

    /// Pauses the broker: its sockets stay open, and it answers nothing.
    pub fn stop(&self) {
        self.process.stop();
    }

    /// Continues the broker.
    pub fn cont(&self) {
        self.process.cont();
    }

    /// The broker's log.
    pub fn said(&self) -> String {
        self.process.said()
    }
}

fn configuration(
    options: &MosquittoOptions,
    certificates: Option<&Certificates>,
    folder: &Path,
) -> String {
    let mut conf = "user root\nlog_dest stderr\n".to_owned();
    if let Some(Certificates { ca, server, server_key, .. }) = certificates {
        let named = |key: &str, file: &PathBuf| format!("{key} {}\n", file.display());
        conf += &named("cafile", ca);
        conf += &named("certfile", server);
        conf += &named("keyfile", server_key);
        conf += "require_certificate true\n";
    }
    conf += &match options.login {
        None => "allow_anonymous true\n".to_owned(),
        Some((user, password)) => {
            let file = folder.join("passwords");
            passwords(&file, user, password);
            format!("allow_anonymous false\npassword_file {}\n", file.display())
        }
    };
    conf + options.lines + "\n"
}

fn passwords(file: &Path, user: &str, password: &str) {
    let mut command = std::process::Command::new("mosquitto_passwd");
    command.args(["-c", "-b"]).arg(file).args([user, password]);
    assert!(command.output().unwrap().status.success(), "mosquitto_passwd");
}
