//! A plant whose memory shows whether it is from one scan, and a reader of its file.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use rungd_engine::isa::{Space, WordSpace};
use rungd_state::retain::content::{self, RetainedElement};
use rungd_state::retain::file::{Access, FileDevice};
use rungd_state::retain::slots::survey;
use serde_json::Value;

pub use rungd_test_support::running::process::*;

/// D0 counts scans, D1 is the sum of all values of D0, D3999 is a copy of D0, and CT0 counts every
/// second scan.
pub const COUNTS: &str = "[[program]]\nname = \"Main\"\nrung = [\n\
    { when = [\"$On\"], do = [\"ADD D0 1 to=D0\", \"ADD D1 D0 to=D1\", \"MOVE D0 to=D3999\"] },\n\
    { leg.up = [\"$ScanToggle\"], leg.dn = [\"$Off\"], do = [\"UDCG CT0 up-preset=5\"] },\n\
    { when = [\"X5\"], do = [\"SET C1\"] },\n]\n";

/// Scans every 2 ms, and keeps memory every 20 ms.
pub const KEEPS: &str = "scan.period = \"2ms\"\n[retain]\nranges = [\"D0..D3999\", \"CT0\"]\n\
    file = \"memory\"\ninterval = \"20ms\"\ncold-start = \"run\"\n[operator]\nsocket = \"op\"\n";

/// The contents of a file that such a plant wrote.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Held {
    pub sequence: u64,
    pub is_final: bool,
    pub count: i32,
    pub counter: i32,
}

/// Runs a number of scans; returns the lines of the log. The exit code must be 0, or 74 if the log
/// reports that the last image is lost.
pub fn run(plant: &Plant, scans: &str) -> Vec<Value> {
    let mut running = Running::new(plant.command(&[] as &[&str]).args(["--scans", scans]));
    let lines = running.rest();
    assert_eq!(running.end().code(), Some(code_of(&lines)), "{lines:#?}");
    lines
}

/// The output of a command that calls a plant's controller; it must succeed. A command that waits
/// until memory is durable gives up if the machine's disk stalls for a minute, and every command if
/// the machine leaves the controller no time for ten seconds. It says so, and is run again.
pub fn ask(plant: &Plant, words: &[&str]) -> String {
    let deadline = Instant::now() + PATIENCE;
    loop {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
        let output = command.args(words).arg("--socket").arg(plant.0.join("op")).output().unwrap();
        if output.status.success() {
            return String::from_utf8(output.stdout).unwrap();
        }
        let said = String::from_utf8_lossy(&output.stderr);
        let stalls = ["the disk has not answered in time", "gave no answer in 10 s"];
        let stalls = stalls.iter().any(|words| said.contains(words));
        assert!(stalls && Instant::now() < deadline, "{words:?}: {said}");
    }
}

pub fn file(plant: &Plant) -> PathBuf {
    plant.0.join("memory")
}

/// The newest image of a file, or `None`; checks that the image is from one scan.
pub fn held(path: &Path) -> Option<Held> {
    let mut device = FileDevice::open(path, Access::Read).ok()?;
    let newest = survey(&mut device).expect("a file of ours").newest?;
    let content = content::read(&newest.content).expect("it makes sense");
    let value = |space, number| {
        let element = RetainedElement { space, number };
        let found = content.elements.iter().find(|(at, _)| *at == element);
        found.expect("it is retained").1.word
    };
    let d = Space::Word(WordSpace::D);
    let (count, sum, far) = (value(d, 0), value(d, 1), value(d, 3999));
    let wanted = i64::from(count) * (i64::from(count) + 1) / 2;
    assert_eq!((i64::from(sum), far), (wanted.min(i64::from(i32::MAX)), count), "a mixture");
    Some(Held {
        sequence: newest.stamp.sequence,
        is_final: newest.stamp.flags != 0,
        count,
        counter: value(Space::Counter, 0),
    })
}
