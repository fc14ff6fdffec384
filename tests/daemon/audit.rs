//! `rungd audit` with the real binary: who has changed what, in each form of the log; and the chain
//! of the trail over starts, with each of its lines changed, removed, moved and inserted.

use std::fs::{self, File};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rungd_test_support::journal::{self, FakeJournal, JOURNAL_REMOTE};
use rungd_test_support::patience::PATIENCE;
use rungd_test_support::running::live::{Said, folder, run, said};
use rungd_test_support::running::program;
use rungd_test_support::system;

const LADDER: &str = r#"
[tags]
low   = { at = "C0", alarm = "Oil is low" }
level = { at = "V0" }
[[program]]
name = "Main"
rung = [ { when = ["low"], do = ["OUT Y0"] } ]
"#;

/// A controller whose log is a file, or goes to a journal's socket.
struct Logged {
    folder: PathBuf,
    child: Option<Child>,
}

impl Logged {
    fn new() -> Logged {
        Logged { folder: folder(LADDER, ""), child: None }
    }

    fn log(&self) -> PathBuf {
        self.folder.join("log")
    }

    /// Starts the controller; its log is appended to the file.
    fn start(&mut self, arguments: &[&str]) {
        let words = run(&self.folder, &[]);
        let mut command = Command::new(words.get_program());
        let given = words.get_args().filter(|word| !word.to_string_lossy().contains("json"));
        let given = given.filter(|word| *word != "--log-format").collect::<Vec<_>>();
        command.args(given).args(arguments);
        for (name, value) in words.get_envs() {
            match value {
                Some(value) => command.env(name, value),
                None => command.env_remove(name),
            };
        }
        let log = File::options().create(true).append(true).open(self.log()).unwrap();
        command.env("RUNGD_LOG_CHAIN", self.folder.join("chain"));
        self.child = Some(command.stderr(log).stdout(Stdio::null()).spawn().unwrap());
        let deadline = Instant::now() + PATIENCE;
        while !self.say(&["status", "--json"]).out.contains("\"mode\":\"RUN\"") {
            assert!(Instant::now() < deadline, "it does not run");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Ends the controller in an orderly way.
    fn end(&mut self) {
        let mut child = self.child.take().unwrap();
        system::signal(&child, "TERM");
        assert!(child.wait().unwrap().success());
    }

    fn say(&self, words: &[&str]) -> Said {
        let mut command = Command::new(program());
        command.args(words).env("RUNGD_SOCKET", self.folder.join("s")).env("TZ", "UTC0");
        said(&mut command)
    }

    fn ok(&self, words: &[&str]) {
        let said = self.say(words);
        assert_eq!(said.code, 0, "{words:?}: {said:?}");
    }

    /// `rungd audit` of the file.
    fn audit(&self, words: &[&str]) -> Said {
        self.say(&[&["audit", self.log().to_str().unwrap()], words].concat())
    }

    /// What people do in a shift.
    fn shift(&self) {
        self.ok(&["write", "level", "42"]);
        self.ok(&["force", "low", "on"]);
        self.ok(&["shelve", "low", "--for", "8h", "--why", "Filter is \"changed\" who=eve"]);
        self.ok(&["unshelve", "low"]);
        self.ok(&["ack", "low"]);
        self.ok(&["unforce", "low"]);
        self.ok(&["mode", "stop"]);
        self.ok(&["mode", "run"]);
        let changed = LADDER.replace("OUT Y0", "OUT Y1");
        fs::write(self.folder.join("ladder.toml"), changed).unwrap();
        self.ok(&["reload"]);
        assert_ne!(self.say(&["write", "Nothing", "1"]).code, 0);
    }
}

impl Drop for Logged {
    fn drop(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// The log of a shift, in a form.
fn shift(form: &str) -> Logged {
    let mut logged = Logged::new();
    logged.start(&["--log-format", form]);
    logged.shift();
    logged.end();
    logged
}

/// The events of the trail of a shift.
const TRAIL: [&str; 15] = [
    "log-chain",
    "process-start",
    "operator-write",
    "operator-force",
    "operator-shelve",
    "operator-unshelve",
    "operator-ack",
    "operator-unforce",
    "operator-mode",
    "operator-mode",
    "reload-difference",
    "reload-difference",
    "reload-done",
    "operator-refused",
    "process-end",
];

#[test]
fn each_change_is_told_with_who_old_new_and_reason_in_each_form() {
    for form in ["text", "json"] {
        let logged = shift(form);
        let json = logged.audit(&["--json"]).json();
        let all = json["changes"].as_array().unwrap();
        let events: Vec<&str> = all.iter().map(|one| one["event"].as_str().unwrap()).collect();
        let mut expected = TRAIL.to_vec();
        expected.retain(|event| *event != "reload-difference");
        let mut found = events.clone();
        found.retain(|event| *event != "reload-difference");
        assert_eq!(found, expected, "{form}: {events:?}");
        let of = |event: &str| all.iter().find(|one| one["event"] == event).unwrap();
        let write = of("operator-write");
        assert_eq!(["what", "old", "new"].map(|name| &write[name]), ["level", "0", "42"]);
        let shelve = of("operator-shelve");
        assert_eq!(shelve["reason"], "Filter is \"changed\" who=eve", "{form}");
        assert_eq!((&shelve["who"], &shelve["what"]), (&write["who"], &"low".into()));
        let mode = of("operator-mode");
        assert_eq!((&mode["old"], &mode["new"]), (&"RUN".into(), &"STOP".into()));
        let who = write["who"].as_str().unwrap();
        assert_eq!(logged.audit(&["--who", "eve", "--csv"]).out.lines().count(), 1, "the head");
        let csv = logged.audit(&["--who", who, "--csv"]).out;
        assert_eq!(csv.lines().next(), Some("time,event,who,what,old,new,reason,text,chain"));
        assert!(csv.contains(",\"level\",\"0\",\"42\",\"\","), "{csv}");
        let text = logged.audit(&["--since", "-1h"]).out;
        assert!(text.contains(" wrote 42 to level ("), "{text}");
        assert_eq!(logged.audit(&["--until", "-1h"]).out, "", "{form}");
        assert_eq!(logged.audit(&["--since", "scan 3"]).code, 2);
        let verdict = logged.audit(&["--verify"]);
        assert!(verdict.out.starts_with("intact: links 1 to "), "{verdict:?}");
    }
}

#[test]
fn an_empty_trail_is_told_as_one() {
    let logged = Logged::new();
    fs::write(logged.log(), "a line of another program\n").unwrap();
    let told = logged.audit(&[]);
    assert_eq!((told.code, told.out.as_str()), (0, ""), "{}", told.err);
    assert_eq!(told.err, "no such change in this log\n");
}

#[test]
fn a_line_that_is_changed_removed_moved_or_inserted_is_found_at_its_place() {
    for form in ["text", "json"] {
        let logged = shift(form);
        let whole = fs::read_to_string(logged.log()).unwrap();
        let lines: Vec<&str> = whole.lines().collect();
        let links: Vec<usize> = (0..lines.len()).filter(|at| has_link(lines[*at])).collect();
        assert!(links.len() >= 12, "{whole}");
        let judged = |lines: &[&str]| {
            fs::write(logged.log(), lines.join("\n") + "\n").unwrap();
            logged.audit(&["--verify"])
        };
        for (number, &at) in links.iter().enumerate() {
            let is_last = number + 1 == links.len();
            let mut changed = lines.clone();
            let text = lines[at].replacen("rungd", "Rungd", 1).replacen(" (uid ", " (Uid ", 1);
            let text = if text == lines[at] { lines[at].replacen("T", "t", 1) } else { text };
            assert_ne!(text, lines[at]);
            changed[at] = &text;
            is_broken(&judged(&changed), &format!("log:{}: ", at + 1), "was changed");
            let mut removed = lines.clone();
            removed.remove(at);
            let told = judged(&removed);
            if is_last {
                assert_eq!(told.code, 0, "the end of a log is known to its next start alone");
            } else if number > 0 {
                is_broken(&told, &format!("log:{}: ", links[number + 1]), "was removed");
            }
            let mut twice = lines.clone();
            twice.insert(at, lines[at]);
            is_broken(&judged(&twice), &format!("log:{}: ", at + 2), "inserted");
            let mut inserted = lines.clone();
            let unlinked = without_link(lines[at]);
            inserted.insert(at + 1, &unlinked);
            is_broken(&judged(&inserted), &format!("log:{}: ", at + 2), "has no link");
        }
        assert_eq!(judged(&lines).code, 0);
    }
}

fn has_link(line: &str) -> bool {
    line.contains(" chain=") || line.contains(",\"chain\":")
}

fn without_link(line: &str) -> String {
    match line.rsplit_once(",\"chain\":") {
        Some((line, _)) => format!("{line}}}"),
        None => line.rsplit_once(" chain=").unwrap().0.to_owned(),
    }
}

fn is_broken(told: &Said, place: &str, words: &str) {
    assert_eq!(told.code, 1, "{told:?}");
    assert!(told.out.starts_with("NOT INTACT: "), "{told:?}");
    assert!(told.out.contains(place) && told.out.contains(words), "{place} {words}: {told:?}");
}

#[test]
fn a_new_start_goes_on_behind_the_last_link_and_an_end_that_was_cut_off_is_found() {
    let mut logged = shift("text");
    let first = logged.audit(&["--verify"]).out;
    let newest = first.rsplit("newest link: ").next().unwrap().trim().to_owned();
    let cut = fs::read_to_string(logged.log()).unwrap();
    logged.start(&["--log-format", "json"]);
    logged.end();
    let log = fs::read_to_string(logged.log()).unwrap();
    let behind = newest.split_once(':').unwrap().0;
    assert!(log.contains(&format!("it goes on behind link {behind}")), "{log}");
    let told = logged.audit(&["--verify", "--expect", &newest]);
    assert_eq!(told.code, 0, "a text log goes on as JSON: {told:?}");
    // The last line of the first run is removed.
    let end = cut.trim_end().rfind('\n').unwrap() + 1;
    let shorter = format!("{}{}", &cut[..end], &log[cut.len()..]);
    fs::write(logged.log(), shorter).unwrap();
    is_broken(&logged.audit(&["--verify"]), "log:", "was removed");
    // A whole chain that was made anew fits in itself, but does not have the link.
    for file in ["log", "chain"] {
        fs::remove_file(logged.folder.join(file)).unwrap();
    }
    logged.start(&["--log-format", "text"]);
    logged.end();
    assert_eq!(logged.audit(&["--verify"]).code, 0);
    is_broken(&logged.audit(&["--verify", "--expect", &newest]), "", "the chain was made anew");
    // An old file of the chain, as after a power cut.
    fs::write(logged.folder.join("chain"), format!("{newest}\n")).unwrap();
    logged.start(&["--log-format", "text"]);
    logged.end();
    assert_eq!(logged.audit(&["--verify"]).code, 1);
}

#[test]
fn a_chain_that_cannot_go_on_is_told_and_the_controller_runs() {
    let mut logged = Logged::new();
    let log = |logged: &Logged| fs::read_to_string(logged.log()).unwrap();
    fs::write(logged.folder.join("chain"), "nonsense").unwrap();
    logged.start(&["--log-format", "text"]);
    assert!(log(&logged).contains("a new chain begins, because the file has no link"));
    logged.end();
    assert_eq!(logged.audit(&["--verify"]).code, 0);
    fs::remove_file(logged.folder.join("chain")).unwrap();
    fs::create_dir(logged.folder.join("chain")).unwrap();
    logged.start(&["--log-format", "text"]);
    assert!(log(&logged).contains("ERROR RUNGD-0606 log-chain: the audit trail is not chained: "));
    logged.end();
    is_broken(&logged.audit(&["--verify"]), "", "has no link");
    let none = logged.say(&["audit", "none.log"]);
    assert!(none.code != 0 && none.err.contains("none.log"), "{none:?}");
    fs::write(logged.log(), "nothing of rungd\n").unwrap();
    assert_eq!(logged.audit(&[]).out, "");
    is_broken(&logged.audit(&["--verify"]), "", "RUNGD_LOG_CHAIN was not set");
    let wrong = logged.audit(&["--verify", "--expect", "1:ab"]);
    assert!(wrong.code == 2 && wrong.err.contains("64 hexadecimal digits"), "{wrong:?}");
}

#[test]
fn the_trail_of_the_journal_is_read_and_judged() {
    if !journal::installed(JOURNAL_REMOTE, "systemd-journal-remote")
        || !journal::installed("journalctl", "systemd")
    {
        return;
    }
    let fake = FakeJournal::new();
    let mut logged = Logged::new();
    let socket = fake.socket();
    let socket = socket.to_str().unwrap();
    logged.start(&["--log-format", "journal", "--journal-socket", socket]);
    logged.shift();
    logged.end();
    fake.wait_for("process-end");
    let entries = fake.written();
    // `journalctl` of this machine, with the journal of the test.
    let bin = logged.folder.join("bin");
    fs::create_dir(&bin).unwrap();
    let script = format!(
        "#!/bin/sh\nPATH=/usr/bin:/bin exec journalctl --directory={} \"$@\"\n",
        entries.display()
    );
    fs::write(bin.join("journalctl"), script).unwrap();
    assert!(system::shell(&["chmod", "+x", bin.join("journalctl").to_str().unwrap()]));
    let audit = |words: &[&str]| {
        let mut command = Command::new(program());
        command.arg("audit").args(words).env("PATH", &bin).env("TZ", "UTC0");
        said(&mut command)
    };
    let trail = audit(&[]).out;
    assert!(trail.contains(" wrote 42 to level (") && trail.contains("Filter is"), "{trail}");
    let verdict = audit(&["--verify"]);
    assert!(verdict.out.starts_with("intact: links 1 to "), "{verdict:?}");
    assert_eq!(audit(&["--unit", "other"]).out, "");
    fs::write(bin.join("journalctl"), "#!/bin/sh\nexit 3\n").unwrap();
    let failed = audit(&[]);
    assert!(failed.code != 0 && failed.err.contains("`rungd audit FILE`"), "{failed:?}");
}
