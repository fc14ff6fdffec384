//! `docs/questions.md`, executed. A plant goes through its troubles and logs to a fake journal
//! socket. A real journal is made from the entries. Each command of the page must print the answer
//! that the page shows. The commands for a text log read a real text log, once in UTC and once in
//! local time. The commands for the scan log read the plant's real recording.
//!
//! The command lines are those of the page, with `journalctl -D FOLDER` for `journalctl`. Without
//! journalctl or systemd-journal-remote, the test prints the reason and passes, unless
//! `RUNGD_REQUIRE` names `programs`.

use rungd_test_support::page;
use rungd_test_support::patience::PATIENCE;
use rungd_test_support::shown;
use rungd_test_support::system;
use std::fs::{self, File};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rungd_runtime::events::{self, Silence};
use rungd_test_support::journal::{FakeJournal, Fields, JOURNAL_REMOTE, installed};
use rungd_test_support::needs::{Need, skip};

/// The number of questions on the page, and the number of those for the log; the others are for the
/// scan log.
const QUESTIONS: (usize, usize) = (30, 20);

/// Settings of a fast plant that a busy machine does not bring to FAULT.
const QUICK: &str = "scan.period = \"1ms\"\nscan.watchdog = \"10s\"\n";

/// The time zone of a text log. Its date equals that of UTC for only ten hours of the day.
const ZONE: &str = "<+1345>-13:45";

/// The destination of a controller's log.
enum Log<'a> {
    Journal(&'a Path),
    File(&'a Path, Clock),
}

/// The time in a text log.
#[derive(Clone, Copy)]
enum Clock {
    Utc,
    /// The local time of [`ZONE`].
    Local,
}

impl Clock {
    /// Whether a command of the page is only for logs with the other kind of time.
    fn is_not_of(self, command: &str) -> bool {
        match self {
            Clock::Utc => command.contains("$(date +"),
            Clock::Local => command.contains("$(date -u +"),
        }
    }
}

impl Log<'_> {
    /// The line of the controller file that sets the log's time.
    fn setting(&self) -> &'static str {
        match self {
            Log::Journal(_) | Log::File(_, Clock::Utc) => "",
            Log::File(_, Clock::Local) => "log.time = \"local\"\n",
        }
    }
}

/// The command `rungd run` in the folder.
fn rungd(folder: &Path, controller: &str, log: &Log, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.current_dir(folder).args(["run", controller]).args(arguments);
    match log {
        Log::Journal(socket) => {
            command.args(["--log-format", "journal", "--journal-socket"]).arg(socket);
            command.stderr(Stdio::inherit());
        }
        Log::File(path, _) => {
            let file = File::options().append(true).create(true).open(path).unwrap();
            command.args(["--log-format", "text"]).env("TZ", ZONE).stderr(file);
        }
    }
    for name in ["RUNGD_LOG", "NOTIFY_SOCKET", "JOURNAL_STREAM"] {
        command.env_remove(name);
    }
    command
}

fn write(folder: &Path, name: &str, ladder: &str, controller: &str) {
    fs::write(folder.join(format!("{name}.toml")), ladder).unwrap();
    let controller = format!("ladder = [\"{name}.toml\"]\n{controller}");
    fs::write(folder.join(format!("{name}-controller.toml")), controller).unwrap();
}

/// A start that is refused.
fn wrong(folder: &Path, log: &Log) {
    let rung = "rung = [ { when = [\"X0\"], do = [\"OUTT Y0\"] } ]\n";
    write(folder, "wrong", &format!("[[program]]\nname = \"Main\"\n{rung}"), "");
    let status = rungd(folder, "wrong-controller.toml", log, &[]).status().unwrap();
    assert_eq!(status.code(), Some(78));
}

/// A controller that a signal ends.
fn signalled(folder: &Path, journal: &FakeJournal) {
    write(folder, "brief", "[[program]]\nname = \"Main\"\nrung = []\n", QUICK);
    let socket = journal.socket();
    let mut command = rungd(folder, "brief-controller.toml", &Log::Journal(&socket), &[]);
    let plant = Mixing { child: command.spawn().unwrap() };
    journal.wait_for("mode-run");
    plant.end();
}

/// Logs more lines than a stopped journal can take, until some are dropped.
fn flood(folder: &Path, journal: &FakeJournal) {
    let names: Vec<String> = (0..16).map(|n| format!("Job-{n}")).collect();
    let calls: Vec<String> = names.iter().map(|name| format!("\"ENTASK {name}\"")).collect();
    let main = format!("rung = [ {{ when = [\"$ScanToggle\"], do = [{}] }} ]\n", calls.join(", "));
    let task = |name: &String| format!("[[task]]\nname = \"{name}\"\nrung = []\n");
    let tasks: String = names.iter().map(task).collect();
    let ladder = format!("[[program]]\nname = \"Main\"\n{main}{tasks}");
    write(folder, "flood", &ladder, &with_operator(folder, QUICK));
    let socket = journal.socket();
    let log = Log::Journal(&socket);
    let mut command = rungd(folder, "flood-controller.toml", &log, &["--log-level", "trace"]);
    let plant = Mixing { child: command.spawn().unwrap() };
    journal.wait_for("operator-listens");
    let held = journal.freeze();
    let deadline = Instant::now() + PATIENCE;
    while lines_dropped(folder) == 0 {
        assert!(Instant::now() < deadline, "no line was dropped");
        thread::sleep(Duration::from_millis(20));
    }
    drop(held);
    journal.wait_for("log-dropped");
    // Kills the plant: it still drops lines, and would also drop the lines of an orderly end.
    drop(plant);
}

/// The number of log lines that the running controller has dropped, from its status.
fn lines_dropped(folder: &Path) -> u64 {
    let status: serde_json::Value =
        serde_json::from_str(&operator(folder, &["status", "--json"])).unwrap();
    status["log"]["lines_dropped"].as_u64().expect("a count")
}

/// A bouncing sensor and then STOP; an operator sets RUN, and the ladder stops again.
fn chatter(folder: &Path, journal: &FakeJournal) {
    let ladder = "[tags]\nbounce = { at = \"C0\", log = \"change\" }\n\
         [[program]]\nname = \"Main\"\nrung = [\n\
         { when = [\"$ScanToggle\"], do = [\"OUT bounce\"] },\n\
         { when = [\"$ScanCounter >= 600\"], do = [\"STOP\"] } ]\n";
    write(folder, "chatter", ladder, &with_operator(folder, QUICK));
    let socket = journal.socket();
    let mut command = rungd(folder, "chatter-controller.toml", &Log::Journal(&socket), &[]);
    let plant = Mixing { child: command.spawn().unwrap() };
    let stopped = |times: usize| {
        let is = |entry: &&Fields| {
            entry["RUNGD_EVENT"] == "mode-stop" && entry["MESSAGE"].contains("executed STOP")
        };
        journal.wait_until(|entries| entries.iter().filter(is).count() >= times);
    };
    stopped(1);
    operator(folder, &["mode", "run"]);
    stopped(2);
    plant.end();
}

/// A scan that takes longer than the watchdog allows.
fn fault(folder: &Path, log: &Log) {
    let faults = folder.join("faults");
    fs::write(&faults, "stall").unwrap();
    let ladder = "[[program]]\nname = \"Main\"\nrung = []\n";
    write(folder, "long", ladder, "scan.watchdog = \"500ms\"\n");
    let mut command = rungd(folder, "long-controller.toml", log, &["--scans", "5000"]);
    let status = command.env("RUNGD_FAULTS", faults).status().unwrap();
    assert_eq!(status.code(), Some(75));
}

/// A running plant; it ends when this is dropped.
struct Mixing {
    child: Child,
}

impl Drop for Mixing {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Mixing {
    fn start(folder: &Path, log: &Log) -> Mixing {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let controller = format!(
            "{}log.statistics = \"300ms\"\nscan.watchdog = \"10s\"\n\
             [modbus-server]\nlisten = \"127.0.0.1:{port}\"\nconnections = 1\n",
            log.setting()
        );
        let controller = with_operator(folder, &controller);
        write(folder, "mixing", include_str!("../questions/mixing.toml"), &controller);
        let child =
            rungd(folder, "mixing-controller.toml", log, &["--record", "record"]).spawn().unwrap();
        let mixing = Mixing { child };
        mixing.refuse(port);
        mixing
    }

    /// One client writes to an unwritable address fifty times. A second client exceeds the limit of
    /// connections.
    fn refuse(&self, port: u16) {
        let deadline = Instant::now() + PATIENCE;
        let mut client = loop {
            match TcpStream::connect(("127.0.0.1", port)) {
                Ok(client) => break client,
                Err(why) => assert!(Instant::now() < deadline, "{why}"),
            }
            thread::sleep(Duration::from_millis(5));
        };
        for _ in 0..50 {
            client.write_all(&[0, 1, 0, 0, 0, 6, 1, 5, 0, 0, 0xff, 0]).unwrap();
            let mut reply = [0; 9];
            client.read_exact(&mut reply).unwrap();
            assert_eq!(reply[7], 0x85, "an exception");
        }
        let mut other = TcpStream::connect(("127.0.0.1", port)).unwrap();
        assert_eq!(other.read(&mut [0; 1]).unwrap_or(0), 0, "closed");
    }

    /// Ends the plant in an orderly way.
    fn end(mut self) {
        self.signal("TERM");
        assert_eq!(self.child.wait().unwrap().code(), Some(0));
    }

    fn signal(&self, name: &str) {
        system::signal(&self.child, name);
    }

    /// Stops the process for a while, as a busy machine would.
    fn pause(&self) {
        self.signal("STOP");
        thread::sleep(Duration::from_millis(60));
        self.signal("CONT");
    }
}

/// Runs an operator's command, and returns its output.
fn operator(folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let output = command.args(arguments).env("RUNGD_SOCKET", folder.join("rungd.sock")).output();
    let output = output.unwrap();
    assert!(output.status.success(), "{arguments:?}: {output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// A controller file with an operator socket in the folder.
fn with_operator(folder: &Path, controller: &str) -> String {
    format!("operator.socket = \"{}\"\n{controller}", folder.join("rungd.sock").display())
}

/// All troubles of the page, logged to the journal.
fn told_to_journal(journal: &FakeJournal, folder: &Path) -> Mixing {
    let socket = journal.socket();
    signalled(folder, journal);
    flood(folder, journal);
    let log = Log::Journal(&socket);
    chatter(folder, journal);
    fault(folder, &log);
    wrong(folder, &log);
    let mixing = Mixing::start(folder, &log);
    let full = "bin_full is ON tag=bin_full scan=71";
    let reached = |fields: &Fields| fields["MESSAGE"].contains(full);
    journal.wait_until(|entries| entries.iter().any(reached));
    operator(folder, &["force", "mixer", "off"]);
    operator(folder, &["unforce", "mixer"]);
    operator(folder, &["write", "recipe", "5"]);
    // The overrun can be told before `pause` returns.
    let since = journal.entries().len();
    mixing.pause();
    let overrun = |entries: &[Fields]| {
        let is = |entry: &Fields| entry["RUNGD_EVENT"] == "overrun";
        entries[since..].iter().position(is).map(|at| since + at)
    };
    let is_withheld = |entry: &Fields| {
        entry.get("RUNGD_WITHHELD").map(String::as_str) == Some("modbus-write-refused")
    };
    journal.wait_until(|entries| overrun(entries).is_some() && entries.iter().any(is_withheld));
    journal.wait_until(|entries| {
        overrun(entries).is_some_and(|at| entries[at..].iter().any(is_heartbeat))
    });
    mixing
}

fn is_heartbeat(entry: &Fields) -> bool {
    entry["RUNGD_EVENT"] == "heartbeat"
}

/// The troubles that the page looks up in a text log, logged to a file.
fn told_to_file(folder: &Path, clock: Clock) -> Mixing {
    let path = folder.join("rungd.log");
    let log = Log::File(&path, clock);
    let wait_for = |words: &[&str]| {
        let is = |line: &str| words.iter().all(|word| line.contains(word));
        let deadline = Instant::now() + PATIENCE;
        while !fs::read_to_string(&path).unwrap().lines().any(is) {
            assert!(Instant::now() < deadline, "{words:?}");
            thread::sleep(Duration::from_millis(10));
        }
    };
    wrong(folder, &log);
    stopped(folder, &log, &wait_for);
    let mixing = Mixing::start(folder, &log);
    wait_for(&["scan=71"]);
    operator(folder, &["force", "mixer", "off"]);
    operator(folder, &["unforce", "mixer"]);
    operator(folder, &["write", "recipe", "5"]);
    mixing.pause();
    wait_for(&[" overrun: "]);
    wait_for(&[" modbus-gone: "]);
    wait_for(&[" lines-withheld: ", "withheld=modbus-write-refused"]);
    mixing
}

/// A controller that starts in STOP; an operator sets RUN, and a signal ends it.
fn stopped(folder: &Path, log: &Log, wait_for: &dyn Fn(&[&str])) {
    let ladder = "[[program]]\nname = \"Main\"\nrung = []\n";
    let controller = format!("{}{QUICK}", log.setting());
    write(folder, "short", ladder, &with_operator(folder, &controller));
    let mut command = rungd(folder, "short-controller.toml", log, &["--stopped"]);
    let plant = Mixing { child: command.spawn().unwrap() };
    wait_for(&[" operator-listens: "]);
    wait_for(&[" mode-stop: "]);
    operator(folder, &["mode", "run"]);
    plant.end();
}

fn run(command: &str, folder: &Path, journal: &Path) -> String {
    let place = format!("journalctl -D {} -u rungd", journal.display());
    let command = command.replace("journalctl -u rungd", &place);
    let bin = Path::new(env!("CARGO_BIN_EXE_rungd")).parent().unwrap();
    let path = std::env::var("PATH").unwrap_or_default();
    let mut shell = Command::new("sh");
    if reads_file(&command) {
        shell.env("TZ", ZONE);
    }
    let output = shell
        .args(["-c", &command])
        .current_dir(folder)
        .env("PATH", format!("{}:{path}", bin.display()))
        .env("RUNGD_SOCKET", folder.join("rungd.sock"))
        .env_remove("JOURNAL_STREAM")
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(error.is_empty(), "{command}: {error}");
    String::from_utf8(output.stdout).unwrap()
}

/// Runs the page's commands that `wanted` selects, and compares their output with the page.
fn compare(folder: &Path, journal: &Path, wanted: impl Fn(&str) -> bool) {
    let page = page::text("questions.md");
    let mut wrong = Vec::new();
    for block in page::blocks(&page, "console") {
        for exchange in format!("\n{block}").split("\n$ ").skip(1) {
            let (command, shown) = exchange.split_once('\n').unwrap_or((exchange, ""));
            if !wanted(command) {
                continue;
            }
            let printed = run(command, folder, journal);
            let (shown_lines, printed_lines): (Vec<_>, Vec<_>) =
                (shown.lines().collect(), printed.lines().collect());
            if !shown::lines_match(&shown_lines, &printed_lines) {
                wrong.push(format!("$ {command}\nshown:\n{shown}\nprinted:\n{printed}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Whether a command of the page does not read the journal.
fn reads_file(command: &str) -> bool {
    !command.starts_with("journalctl ")
}

#[test]
fn each_command_for_the_journal_gives_the_answer_of_the_page() {
    let there = installed("journalctl", "systemd");
    if !(there && installed(JOURNAL_REMOTE, "systemd-journal-remote")) {
        return;
    }
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a release build has no faults on purpose");
    }
    let journal = FakeJournal::new();
    let _plant = told_to_journal(&journal, &journal.folder);
    let written = journal.written();
    compare(&journal.folder, &written, |command| !reads_file(command));
}

#[test]
fn each_command_for_a_text_log_gives_the_answer_of_the_page() {
    for clock in [Clock::Utc, Clock::Local] {
        let file = FakeJournal::new();
        let _plant = told_to_file(&file.folder, clock);
        let wanted = |command: &str| reads_file(command) && !clock.is_not_of(command);
        compare(&file.folder, &file.folder, wanted);
    }
}

/// A controller file can silence the log lines of an answer only for the questions that the page
/// names.
#[test]
fn the_page_names_the_questions_with_log_lines_that_can_be_silenced() {
    let page = page::text("questions.md");
    let is_letter = |c: char| c.is_ascii_lowercase() || c == '-';
    let can_be_silenced = |question: &str| {
        let commands = question.lines().filter(|line| line.starts_with("$ journalctl "));
        let mut words = commands.flat_map(|line| line.split(|c: char| !is_letter(c)));
        words.any(|word| events::named(word).is_some_and(|row| row.silence != Silence::Never))
    };
    let questions = (1..).zip(page.split("\n### ").skip(1));
    let silenced: Vec<u32> =
        questions.filter(|(_, text)| can_be_silenced(text)).map(|(at, _)| at).collect();
    assert_eq!(silenced, [6, 7, 9, 10, 11, 14, 15, 18, 19]);
    let words = page.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("questions 6, 7, 9 to 11, 14, 15, 18 and 19 read"));
}

#[test]
fn the_page_has_commands_for_thirty_questions_and_twenty_for_both_logs() {
    let page = page::text("questions.md");
    let questions: Vec<&str> = page.split("\n### ").skip(1).collect();
    assert_eq!(questions.len(), QUESTIONS.0);
    for (at, question) in questions.iter().enumerate() {
        let title = question.lines().next().unwrap();
        assert!(title.starts_with(&format!("{}. ", at + 1)) && title.ends_with('?'), "{title}");
        let is_to_log = at < QUESTIONS.1;
        let journal = question.matches("\n$ journalctl -u rungd ").count();
        assert_eq!(journal, usize::from(is_to_log), "{title}");
        let text_log = |line: &&str| line.starts_with("$ ") && line.contains(" rungd.log");
        for clock in [Clock::Utc, Clock::Local] {
            let commands = question.lines().filter(text_log).filter(|line| !clock.is_not_of(line));
            assert_eq!(commands.count(), journal, "{title}");
        }
        let recording = question.matches("$ rungd ").count() + question.matches("; rungd ").count();
        assert_eq!(recording > 0, !is_to_log || at + 1 == QUESTIONS.0, "{title}");
    }
}
