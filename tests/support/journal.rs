//! A journal for tests: a socket in place of journald's, and a real journal made from its
//! datagrams.
//!
//! The datagrams are written to a file in the journal's export format, together with the fields
//! that journald would add. `systemd-journal-remote` turns this file into a journal for
//! `journalctl`.

use crate::needs::not_installed;
use crate::patience::PATIENCE;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Whether a program is installed; CI requires it.
pub fn installed(program: &str, package: &str) -> bool {
    let there = Path::new(program).exists()
        || Command::new("sh")
            .args(["-c", &format!("command -v {program}")])
            .output()
            .is_ok_and(|output| output.status.success());
    if !there {
        not_installed(&format!("{program} (apt: {package})"));
    }
    there
}

/// The program that makes a journal from an export file.
pub const JOURNAL_REMOTE: &str = "/lib/systemd/systemd-journal-remote";

/// A datagram and its time of arrival.
struct Received {
    at_us: u128,
    bytes: Vec<u8>,
}

/// The fields of an entry.
pub type Fields = BTreeMap<String, String>;

/// The datagrams so far. Each is parsed once, when somebody looks at the entries.
#[derive(Default)]
struct Inbox {
    received: Vec<Received>,
    entries: Vec<Fields>,
}

impl Inbox {
    fn entries(&mut self) -> &[Fields] {
        let new = &self.received[self.entries.len()..];
        self.entries.extend(new.iter().map(|received| fields(&received.bytes)));
        &self.entries
    }
}

/// A socket in place of journald's.
pub struct FakeJournal {
    pub folder: PathBuf,
    inbox: Arc<Mutex<Inbox>>,
    /// While a test holds this lock, no datagram is received.
    gate: Arc<Mutex<()>>,
}

impl FakeJournal {
    pub fn new() -> FakeJournal {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        // A short name: a socket's path has at most 107 bytes.
        let name = format!("rungd-journal-{}-{number}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).unwrap();
        let socket = UnixDatagram::bind(folder.join("socket")).unwrap();
        let inbox = Arc::new(Mutex::new(Inbox::default()));
        let (sink, gate) = (Arc::clone(&inbox), Arc::new(Mutex::new(())));
        let passing = Arc::clone(&gate);
        thread::spawn(move || {
            let mut bytes = vec![0; 1 << 18];
            while let Ok(length) = socket.recv(&mut bytes) {
                drop(passing.lock().unwrap());
                let at_us = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_micros();
                let bytes = bytes[..length].to_vec();
                sink.lock().unwrap().received.push(Received { at_us, bytes });
            }
        });
        FakeJournal { folder, inbox, gate }
    }

    pub fn socket(&self) -> PathBuf {
        self.folder.join("socket")
    }

    /// All entries so far.
    pub fn entries(&self) -> Vec<Fields> {
        self.inbox.lock().unwrap().entries().to_vec()
    }

    /// Receives nothing while the returned guard is held.
    pub fn freeze(&self) -> MutexGuard<'_, ()> {
        self.gate.lock().unwrap()
    }

    /// Waits for an entry of this event.
    pub fn wait_for(&self, event: &str) -> Fields {
        let is = |entry: &&Fields| entry["RUNGD_EVENT"] == event;
        self.wait_until(|entries| entries.iter().any(|entry| is(&entry)));
        let mut inbox = self.inbox.lock().unwrap();
        inbox.entries().iter().find(is).expect("it was there").clone()
    }

    /// Waits until `wanted` accepts the entries.
    pub fn wait_until(&self, wanted: impl Fn(&[Fields]) -> bool) {
        let deadline = Instant::now() + PATIENCE;
        while !wanted(self.inbox.lock().unwrap().entries()) {
            if Instant::now() > deadline {
                let entries = self.entries();
                let last = &entries[entries.len().saturating_sub(50)..];
                panic!("not what was waited for, at the end: {last:#?}");
            }
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Makes a real journal from the datagrams so far, and returns its folder.
    pub fn written(&self) -> PathBuf {
        let folder = self.folder.join("journal");
        fs::create_dir_all(&folder).unwrap();
        let mut export = Vec::new();
        let inbox = self.inbox.lock().unwrap();
        for (number, Received { at_us, bytes }) in inbox.received.iter().enumerate() {
            let trusted = format!(
                "__REALTIME_TIMESTAMP={at_us}\n__MONOTONIC_TIMESTAMP={}\n\
                 _BOOT_ID=f0e1d2c3b4a5968778695a4b3c2d1e0f\n_TRANSPORT=journal\n_HOSTNAME=plant\n\
                 _SYSTEMD_UNIT=rungd.service\n_PID=4711\n",
                1_000_000 + number
            );
            export.extend(trusted.as_bytes());
            export.extend(bytes);
            export.push(b'\n');
        }
        let file = self.folder.join("export");
        fs::write(&file, export).unwrap();
        let output = Command::new(JOURNAL_REMOTE)
            .arg("--output")
            .arg(folder.join("plant.journal"))
            .arg(&file)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        folder
    }
}

impl Drop for FakeJournal {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// The fields of a datagram, as journald parses them.
pub fn fields(mut bytes: &[u8]) -> Fields {
    let mut fields = Fields::new();
    while let Some(end) = bytes.iter().position(|byte| *byte == b'\n') {
        let (line, rest) = (&bytes[..end], &bytes[end + 1..]);
        let (name, value) = match line.iter().position(|byte| *byte == b'=') {
            Some(at) => {
                bytes = rest;
                (&line[..at], &line[at + 1..])
            }
            None => {
                let length = u64::from_le_bytes(rest[..8].try_into().unwrap()) as usize;
                assert_eq!(rest[8 + length], b'\n');
                bytes = &rest[9 + length..];
                (line, &rest[8..8 + length])
            }
        };
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        assert!(fields.insert(text(name), text(value)).is_none(), "{} twice", text(name));
    }
    assert!(bytes.is_empty());
    fields
}
