//! `[retain] stages`, with the real binary: it is killed and ended, and goes on in the Stages of its
//! last image.
//!
//! A few kills in the normal run; fifty:
//!
//! ```console
//! cargo test --release --test controller retain::stages -- --ignored --nocapture
//! ```

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::retain::crash::status;
use crate::retain::memory::{Plant, Running, file, find, message, run, until};
use rungd_state::retain::content;
use rungd_state::retain::file::{Access, FileDevice};
use rungd_state::retain::slots::survey;
use rungd_test_support::numbers::Numbers;

/// A Program that goes round its four Stages, a few scans in each. D0 has the bits of the Stages in
/// the first scan before any rung of a Program, D1 counts scans.
const LADDER: &str = r#"
[[program]]
name = "Main"
rung = [{ when = ["$On"], do = ["ADD D1 1 to=D1"] }]

[[program]]
name      = "Batch"
autostart = true

[[program.stage]]
name = "S0"
rung = [{ when = ["D1 % 7 == 0"], do = ["JMP S1"] }]

[[program.stage]]
name = "S1"
rung = [{ when = ["D1 % 5 == 0"], do = ["SGDIVRG S2 S3"] }]

[[program.stage]]
name = "S2"
rung = [{ when = ["D1 % 3 == 0"], do = ["SGCONVRG S2 S3 to=S0"] }]

[[program.stage]]
name = "S3"

[[task]]
name = "FirstScan"
rung = [
  { when = ["$On"], do = ["MATH D0 = Batch.Running + 2 * Batch.S0 + 4 * Batch.S1 + 8 * Batch.S2 + 16 * Batch.S3"] },
]
"#;

const KEEPS: &str = "scan.period = \"2ms\"\n[retain]\nstages = [\"Batch\"]\n\
    ranges = [\"D0..D1\"]\nfile = \"memory\"\ninterval = \"5ms\"\ncold-start = \"run\"\n\
    [operator]\nsocket = \"op\"\n";

/// What the newest image of a file has: D0, and the bits that D0 has if it is restored.
struct Kept {
    first_scan: i32,
    stages: i32,
}

fn kept(path: &Path) -> Option<Kept> {
    let mut device = FileDevice::open(path, Access::Read).ok()?;
    let newest = survey(&mut device).expect("a file of ours").newest?;
    let content = content::read(&newest.content).expect("it makes sense");
    let [program] = &content.programs[..] else { panic!("{:?}", content.programs) };
    assert_eq!((program.name.as_str(), program.begins), ("Batch", false));
    let bit = |(n, name): (i32, &str)| i32::from(program.on.iter().any(|on| on == name)) << n;
    let stages = [(1, "S0"), (2, "S1"), (3, "S2"), (4, "S3")].map(bit).iter().sum::<i32>();
    let first_scan = content.elements[0].1.word;
    Some(Kept { first_scan, stages: stages + i32::from(program.runs) })
}

/// Kills a controller at random moments; each time the next process goes on in the Stages of the
/// image.
fn kills(count: u64) {
    let plant = Plant::new(LADDER, KEEPS);
    let (path, mut numbers) = (file(&plant), Numbers(1));
    let mut seen = std::collections::BTreeSet::new();
    for kill in 0..count {
        let mut running = Running::new(&mut plant.command(&[] as &[&str]));
        let scans = 20 + numbers.below(60);
        until(|| status(&plant).is_some_and(|status| status.scans > scans));
        until(|| kept(&path).is_some());
        running.child.kill().unwrap();
        running.end();
        let before = kept(&path).expect("an image");
        run(&plant, "1");
        let after = kept(&path).expect("an image");
        assert_eq!(after.first_scan, before.stages, "kill {kill}");
        seen.insert(before.stages);
    }
    println!("{count} kills; Stages: {seen:?}");
}

#[test]
fn a_killed_process_goes_on_in_its_stages() {
    kills(3);
}

#[test]
#[ignore = "some seconds"]
fn fifty_killed_processes_go_on_in_their_stages() {
    kills(50);
}

/// The output of `rungd retain show`.
fn shown(plant: &Plant) -> String {
    let mut rungd = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let shown = rungd.args(["retain", "show", file(plant).to_str().unwrap()]).output().unwrap();
    String::from_utf8(shown.stdout).unwrap()
}

/// Replaces the ladder and the settings of a plant.
fn edit(plant: &Plant, ladder: &str, settings: &str) {
    fs::write(plant.0.join("ladder.toml"), ladder).unwrap();
    let controller = format!("ladder = [\"ladder.toml\"]\n{settings}");
    fs::write(plant.0.join("controller.toml"), controller).unwrap();
}

fn dropped(lines: &[serde_json::Value]) -> Vec<String> {
    let dropped = lines.iter().filter(|line| line["event"] == "retain-dropped");
    dropped.map(|line| message(line).to_owned()).collect()
}

#[test]
fn a_stage_that_is_gone_is_named_and_its_program_begins_at_its_initial_stage() {
    let plant = Plant::new(LADDER, KEEPS);
    // Scan 7 leaves S0.
    run(&plant, "8");
    assert!(shown(&plant).contains("runs, ON: S1"), "{}", shown(&plant));
    let renamed = LADDER.replace("S1", "Fill");
    edit(&plant, &renamed, KEEPS);
    let lines = run(&plant, "1");
    assert_eq!(find(&lines, "restored: image")["restored"], 3);
    let why = "retentive memory: Stage Batch.S1 is not restored: Batch has no such Stage now: it \
               begins at its initial Stage";
    assert_eq!(dropped(&lines), [why]);
    assert!(shown(&plant).contains("runs, ON: S0"), "{}", shown(&plant));
}

#[test]
fn a_program_without_an_entry_starts_as_at_a_cold_start() {
    let plant = Plant::new(LADDER, KEEPS);
    let without = KEEPS.replace("stages = [\"Batch\"]\n", "");
    edit(&plant, LADDER, &without);
    run(&plant, "8");
    edit(&plant, LADDER, KEEPS);
    let lines = run(&plant, "1");
    assert_eq!(find(&lines, "restored: image")["fresh"], 1);
    assert_eq!(kept(&file(&plant)).expect("an image").first_scan, 1, "running, no Stage yet");
    edit(&plant, LADDER, &without);
    let lines = run(&plant, "1");
    let why = "retentive memory: Stages of Batch is not restored: they are not retained any more";
    assert_eq!(dropped(&lines), [why]);
}

/// A recording of the start has the restored Stages: it is executed again with the same hashes.
#[test]
fn a_recorded_start_has_the_restored_stages() {
    let plant = Plant::new(LADDER, KEEPS);
    run(&plant, "8");
    let folder = plant.0.join("rec");
    let mut command = plant.command(&[] as &[&str]);
    let mut running = Running::new(command.args(["--scans", "40", "--record"]).arg(&folder));
    running.rest();
    running.end();
    let said = |arguments: &[&str]| {
        let mut rungd = Command::new(env!("CARGO_BIN_EXE_rungd"));
        let output = rungd.args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap() + &String::from_utf8_lossy(&output.stderr)
    };
    let folder = folder.to_str().unwrap();
    let verified = said(&["record", "verify", folder]);
    assert!(verified.contains("40 scans in") && verified.contains("equal"), "{verified}");
    let why = said(&["why", "Batch.S1", "--recording", folder, "--at", "scan 1"]);
    let start = "the start turned it ON before the first scan: it is retained by `[retain] stages`";
    assert!(why.contains(start), "{why}");
}
