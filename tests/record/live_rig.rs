//! Helpers for the tests of the real rungd and its recording: the engine of a recorded program, the
//! verification of a folder, and a control.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::Value;

use rungd_config::load;
use rungd_engine::Engine;
use rungd_history::playback::{Playback, Verified};
use rungd_history::record::{EXTENSION, RecordedFile, RecordedProgram, Recording};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::program::Program;
use rungd_language::source::span::SourceFile;
use rungd_test_support::running::live::{Live, folder, run};
pub use rungd_test_support::running::operator::Operator;
use rungd_test_support::running::process::message;

/// A plant with many changes: a counter of scans, and words that are hard to predict.
pub const BUSY: &str = r#"
[[program]]
name = "Main"
rung = [
  { when = ["$On"], do = ["ADD D0 1 to=D0", "TMRAG T0 preset=1s"] },
  { when = ["MC1"], do = ["OUT Y0"] },
]
"#;

/// A short period, and a Modbus server that clients may write to.
pub const FAST: &str = "[scan]\nperiod = \"2ms\"\n[modbus-server]\nlisten = \"127.0.0.1:0\"\n\
                        writable = [\"MC1..MC2\", \"MHR1..MHR2\"]\n";

/// `rungd run … --record DIR` of a folder, without `RUNGD_RECORD` in the environment.
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

/// The program from the files in a recording.
pub fn loaded(program: &RecordedProgram) -> Result<(Program, Symbols, Engine), String> {
    let file =
        |file: &RecordedFile| SourceFile { name: file.name.clone(), text: file.text.to_string() };
    let files: Vec<SourceFile> = program.files.iter().map(file).collect();
    let program = load::recorded_files(&files).program.ok_or("its files have errors")?;
    let (engine, symbols) = lower(&program);
    Ok((program, symbols, Engine::new(engine)))
}

/// The engine of a recorded program.
pub fn engine(program: &RecordedProgram) -> Result<Engine, String> {
    loaded(program).map(|(_, _, engine)| engine)
}

/// The paths of the scan log files in a folder, in order.
pub fn logs(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir).map(|entries| entries.map(|entry| entry.unwrap().path()));
    let mut paths: Vec<PathBuf> = entries.into_iter().flatten().collect();
    paths.retain(|path| path.extension().is_some_and(|end| end == EXTENSION));
    paths.sort();
    paths
}

/// Replays a folder: nothing may differ, and every section must be replayable. A section after a
/// gap must record lost steps, or begin a process; with `excused`, a disk may also cause gaps.
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
    let mut replay = Playback::new(recording, engine);
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

/// Whether `status` reports that the disk cannot be written.
pub fn failing(status: &Value) -> bool {
    status["record"]["disk"]["failing"].is_string()
}

/// The number of log lines with this event.
pub fn count(lines: &[Value], event: &str) -> usize {
    lines.iter().filter(|line| line["event"] == event).count()
}

/// Ends a controller in order, and returns the lines of its log that were not yet read.
pub fn ended(live: &mut Live) -> Vec<Value> {
    live.signal("TERM");
    let mut lines = vec![live.line("")];
    while !message(&lines[lines.len() - 1]).contains("statistics of the whole run") {
        lines.push(live.line(""));
    }
    assert_eq!(live.child.wait().unwrap().code(), Some(0), "{lines:#?}");
    lines
}

/// Whether an end that was requested at `asked` may lack the last block: rungd waits a minute for
/// the disk, which other tests may keep busy.
pub fn is_late(asked: Instant) -> bool {
    asked.elapsed() >= Duration::from_secs(60)
}

/// Whether a log tells that the disk was too slow for the last blocks at the end. What is behind
/// them is not in the recording: neither they nor the gap before them.
pub fn lacks_the_last(lines: &[Value]) -> bool {
    lines.iter().any(|line| message(line).contains("the last scans may be missing"))
}

/// The scans of a period of time: their number, and how many were skipped or overran.
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

    /// Whether these scans are as good as other scans of the same time on the same machine, with
    /// room for chance.
    fn are_as_good_as(&self, others: &Scans) -> bool {
        let some = self.done / 100.0 + 2.0;
        self.skipped <= 2.0 * others.skipped + some && self.overruns <= 2.0 * others.overruns + some
    }
}

/// A control: a second controller without trouble, and the state of both controllers at the begin.
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

    /// Whether the scans of the troubled controller were as good as those of its control.
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

/// The most runs until a troubled run is as good as its control. The machine's noise affects either
/// run, but trouble with a disk affects the same run every time.
const ROUNDS: usize = 4;

/// Repeats a run until its scans are as good as its control's.
pub fn rounds(mut is_good: impl FnMut() -> bool) {
    assert!((0..ROUNDS).any(|_| is_good()), "worse than its control {ROUNDS} times in a row");
}
