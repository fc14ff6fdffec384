//! What the tests of the real rungd and its recording share: the operator's socket kept open, the
//! engine of a recorded program, and the verification of a folder.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::support::live::{self, Live, PATIENCE, folder, run};
use crate::support::process::message;
use rungd::engine::Engine;
use rungd::load;
use rungd::lower::{Symbols, lower};
use rungd::record::{EXTENSION, RecordedFile, RecordedProgram, Recording, Replay, Verified};
use rungd::resolve::program::Program;
use rungd::source::span::SourceFile;

/// A plant in which much changes: a counter of scans, and words that no rule foretells.
pub const BUSY: &str = r#"
[[program]]
name = "Main"
rung = [
  { when = ["$On"], do = ["ADD D0 1 to=D0", "TMRAG T0 preset=1s"] },
  { when = ["MC1"], do = ["OUT Y0"] },
]
"#;

/// A short period, and a client's writes.
pub const FAST: &str = "[scan]\nperiod = \"2ms\"\n[modbus-server]\nlisten = \"127.0.0.1:0\"\n\
                        writable = [\"MC1..MC2\", \"MHR1..MHR2\"]\n";

/// A number of the environment.
pub fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// The operator's socket, kept open.
pub struct Operator {
    stream: BufReader<UnixStream>,
    socket: PathBuf,
    asked: Instant,
}

/// rungd closes whoever says nothing for a minute.
const IDLE: Duration = Duration::from_secs(40);

impl Operator {
    pub fn new(live: &Live) -> Operator {
        let (stream, socket) = (BufReader::new(live.connect()), live.socket.clone());
        Operator { stream, socket, asked: Instant::now() }
    }

    pub fn ask(&mut self, request: &Value) -> Value {
        if self.asked.elapsed() >= IDLE {
            self.stream = BufReader::new(live::connect(&self.socket));
        }
        self.asked = Instant::now();
        self.stream.get_mut().write_all(format!("{request}\n").as_bytes()).unwrap();
        let mut line = String::new();
        self.stream.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{request}: {error}: `{line}`"))
    }

    pub fn status(&mut self) -> Value {
        self.ask(&json!({"do": "status"}))["ok"].clone()
    }

    /// Complete scans since the start of the process.
    pub fn scans(&mut self) -> u64 {
        self.status()["scans"].as_u64().unwrap()
    }

    /// Waits until so many more scans are complete, as long as there are some now and then.
    pub fn await_scans(&mut self, more: u64) {
        let mut seen = self.scans();
        let wanted = seen + more;
        while seen < wanted {
            let after = |status: &Value| status["scans"].as_u64().filter(|scans| *scans > seen);
            let status = self.await_status(|status| after(status).is_some());
            seen = after(&status).unwrap();
        }
    }

    /// Waits until the status is as wanted, and returns it.
    pub fn await_status(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let status = self.status();
            if wanted(&status) {
                return status;
            }
            assert!(Instant::now() < deadline, "not what was waited for: {status}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

/// `rungd run … --record DIR` of a folder, without the environment's wish.
pub fn recorded_run(folder: &Path, dir: &Path) -> Command {
    let mut command = run(folder, &["--record", dir.to_str().unwrap()]);
    command.env_remove("RUNGD_RECORD").env("RUNGD_FAULTS", folder.join("faults"));
    command
}

/// A controller that records in the folder `log` beside its files.
pub fn recorded(ladder: &str, controller: &str) -> (Live, PathBuf) {
    let folder = folder(ladder, controller);
    let dir = folder.join("log");
    let command = recorded_run(&folder, &dir);
    (Live::of(folder, command), dir)
}

/// The program of a recorded one's files.
pub fn loaded(program: &RecordedProgram) -> Result<(Program, Symbols, Engine), String> {
    let file =
        |file: &RecordedFile| SourceFile { name: file.name.clone(), text: file.text.clone() };
    let files: Vec<SourceFile> = program.files.iter().map(file).collect();
    let program = load::recorded_files(&files).program.ok_or("its files have errors")?;
    let (engine, symbols) = lower(&program);
    Ok((program, symbols, Engine::new(engine)))
}

/// The engine of a recorded program.
pub fn engine(program: &RecordedProgram) -> Result<Engine, String> {
    loaded(program).map(|(_, _, engine)| engine)
}

/// The names of a folder's files of segments, in order.
pub fn logs(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir).map(|entries| entries.map(|entry| entry.unwrap().path()));
    let mut paths: Vec<PathBuf> = entries.into_iter().flatten().collect();
    paths.retain(|path| path.extension().is_some_and(|end| end == EXTENSION));
    paths.sort();
    paths
}

/// Replays a folder: nothing in it may differ, and everything must be replayable. A section that
/// does not follow must say what is missing, or begin a process; a disk's gaps are `excused`.
pub fn verified(dir: &Path, excused: bool) -> Verified {
    let recording = Recording::open(dir).unwrap();
    let count = recording.count();
    for at in 1..count {
        let is_new =
            recording.program(at).process_start_ns != recording.program(at - 1).process_start_ns;
        if !recording.follows(at) && !is_new && !excused {
            let (_, body) = recording.read(at).unwrap().expect("it is whole");
            assert!(body.lost > 0, "section {at} does not follow, and nothing was lost");
        }
    }
    let hashes = (0..count).filter(|at| recording.head(*at).end_hash.is_some()).count();
    let mut replay = Replay::new(recording, engine);
    let verified = replay.verify(0..count);
    let told = format!("{}: {verified:?}", dir.display());
    assert_eq!((verified.first_difference, verified.unreplayable), (None, 0), "{told}");
    assert_eq!((verified.sections, verified.compared), (count as u64, hashes as u64), "{told}");
    verified
}

/// The number of the last scan in a recording.
pub fn last_scan(recording: &Recording) -> u64 {
    let heads = (0..recording.count()).map(|at| recording.head(at));
    let ends = heads.filter(|head| head.scans > 0);
    ends.map(|head| head.number + u64::from(head.scans) - 1).next_back().unwrap_or(0)
}

/// Whether `status` says that the disk cannot be written.
pub fn failing(status: &Value) -> bool {
    status["record"]["disk"]["failing"].is_string()
}

/// How many lines of the log have this event.
pub fn count(lines: &[Value], event: &str) -> usize {
    lines.iter().filter(|line| line["event"] == event).count()
}

/// Ends a controller in an orderly way, and gives the lines of its log that were not read yet.
pub fn ended(live: &mut Live) -> Vec<Value> {
    live.signal("TERM");
    let mut lines = vec![live.line("")];
    while !message(&lines[lines.len() - 1]).contains("statistics of the whole run") {
        lines.push(live.line(""));
    }
    assert_eq!(live.child.wait().unwrap().code(), Some(0), "{lines:#?}");
    lines
}

/// Whether an end that was asked for at a time may lack the last block: rungd waits two seconds for
/// the disk, which may be busy with what other tests do.
pub fn is_late(asked: Instant) -> bool {
    asked.elapsed() >= Duration::from_secs(2)
}

/// What the scans of a stretch were like.
#[derive(Clone, Copy, Debug)]
struct Scans {
    done: f64,
    skipped: f64,
    overruns: f64,
}

impl Scans {
    fn now(operator: &mut Operator) -> Scans {
        let scan = operator.status()["scan"].clone();
        let number = |field: &str| scan[field].as_f64().unwrap();
        Scans { done: number("scans"), skipped: number("skipped"), overruns: number("overruns") }
    }

    fn since(self, before: Scans) -> Scans {
        Scans {
            done: self.done - before.done,
            skipped: self.skipped - before.skipped,
            overruns: self.overruns - before.overruns,
        }
    }

    /// As good as others of the same time on the same machine, but for chance.
    fn are_as_good_as(&self, others: &Scans) -> bool {
        let some = self.done / 100.0 + 2.0;
        self.skipped <= 2.0 * others.skipped + some && self.overruns <= 2.0 * others.overruns + some
    }
}

/// A controller beside the one whose disk is in trouble, and where both began.
pub struct Watch {
    control: Live,
    operator: Operator,
    before: [Scans; 2],
}

impl Watch {
    pub fn begin(troubled: &mut Operator) -> Watch {
        let (control, _) = recorded(BUSY, FAST);
        let mut operator = Operator::new(&control);
        operator.await_scans(100);
        let before = [Scans::now(troubled), Scans::now(&mut operator)];
        Watch { control, operator, before }
    }

    /// Whether the scans of the troubled one were as good as its control's.
    pub fn end(mut self, troubled: &mut Operator) -> bool {
        let troubled = Scans::now(troubled).since(self.before[0]);
        let control = Scans::now(&mut self.operator).since(self.before[1]);
        self.control.end();
        let is_good = troubled.are_as_good_as(&control);
        if !is_good {
            println!("{troubled:?}, and beside it {control:?}");
        }
        is_good
    }
}

/// So often a troubled run and its control may differ: the machine's noise meets either of them,
/// what a disk does meets the same one every time.
const ROUNDS: usize = 4;

/// Repeats a run until its scans are as good as its control's.
pub fn rounds(mut is_good: impl FnMut() -> bool) {
    assert!((0..ROUNDS).any(|_| is_good()), "worse than its control {ROUNDS} times in a row");
}
