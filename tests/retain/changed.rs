//! The real binary with memory that a different program kept: memory that does not fit, values that
//! the former program would have reset, and a changed preset.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::retain::memory::{Plant, Running, ask, file, find, message, run};
use rungd_state::retain::content::{self, RetainedContent, address};
use rungd_state::retain::file::{Access, FileDevice};
use rungd_state::retain::slots::survey;

fn write(plant: &Plant, name: &str, text: &str) {
    fs::write(plant.0.join(name), text).unwrap();
}

/// A controller that keeps `ranges`; `more` has further lines of `[retain]`.
fn keeps(ranges: &str, more: &str) -> String {
    format!(
        "ladder = [\"ladder.toml\"]\nscan.period = \"2ms\"\n[operator]\nsocket = \"op\"\n\
         [retain]\nranges = [{ranges}]\nfile = \"memory\"\ninterval = \"20ms\"\n{more}\n"
    )
}

const COLD: &str = "cold-start = \"run\"";

fn plant(ladder: &str, ranges: &str) -> Plant {
    let plant = Plant::new(ladder, "");
    write(&plant, "controller.toml", &keeps(ranges, COLD));
    plant
}

fn main(tags: &str, rungs: &str) -> String {
    format!("[tags]\n{tags}\n[[program]]\nname = \"Main\"\nrung = [\n{rungs}\n]\n")
}

/// Runs until memory is kept, then kills the process without a termination pass.
fn run_and_kill(plant: &Plant) {
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    std::thread::sleep(std::time::Duration::from_millis(100));
    ask(plant, &["retain", "save"]);
    running.child.kill().unwrap();
    running.end();
}

fn read(plant: &Plant, operand: &str) -> String {
    ask(plant, &["read", operand]).split_whitespace().last().unwrap_or_default().to_owned()
}

fn content(path: &Path) -> RetainedContent {
    let mut device = FileDevice::open(path, Access::Read).unwrap();
    let newest = survey(&mut device).unwrap().newest.unwrap();
    content::read(&newest.content).unwrap()
}

fn word(content: &RetainedContent, element: &str) -> Option<i32> {
    let mut elements = content.elements.iter();
    elements.find(|(at, _)| address(*at) == element).map(|(_, value)| value.word)
}

const LEVEL: &str = "{ when = [\"$FirstScan\"], do = [\"ADD level 55 to=level\"] }";

#[test]
fn retained_memory_that_does_not_fit_causes_a_cold_start() {
    let plant = plant(&main("level = { at = \"D5\" }", LEVEL), "\"D5\"");
    run(&plant, "5");
    let renamed = main("height = { at = \"D5\" }", &LEVEL.replace("level", "height"));
    write(&plant, "ladder.toml", &renamed);
    write(&plant, "controller.toml", &keeps("\"D5\"", ""));
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    let dropped = running.line("no tag of this name is retained any more");
    assert_eq!(dropped["event"], "retain-dropped");
    let cold = running.line("nothing is restored");
    assert_eq!((&cold["event"], &cold["level"]), (&"retain-cold".into(), &"ERROR".into()));
    assert!(message(&cold).contains("nothing in it matches"), "{cold}");
    running.line("STOP");
    running.stop();
    assert_eq!(word(&content(&file(&plant)), "D5"), Some(55), "the image stays until a run");
    write(&plant, "controller.toml", &keeps("\"D5\"", COLD));
    let lines = run(&plant, "5");
    assert_eq!(find(&lines, "nothing is restored")["level"], "WARN");
}

#[test]
fn a_reload_that_retains_nothing_keeps_the_last_image() {
    let plant = plant(&main("level = { at = \"D5\" }", LEVEL), "\"D5\"");
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    ask(&plant, &["retain", "save"]);
    let with = keeps("\"D5\"", COLD);
    write(&plant, "controller.toml", with.split("[retain]").next().unwrap());
    ask(&plant, &["reload"]);
    let mut save = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let save = save.args(["retain", "save", "--socket"]).arg(plant.0.join("op")).output().unwrap();
    let told = String::from_utf8(save.stderr).unwrap();
    assert!(!save.status.success() && told.contains("nothing"), "{told}");
    std::thread::sleep(std::time::Duration::from_millis(100));
    assert_eq!(word(&content(&file(&plant)), "D5"), Some(55));
    let lines = running.stop();
    assert!(lines.iter().all(|line| line["event"] != "retain-lost"), "{lines:#?}");
    write(&plant, "controller.toml", &with);
    let lines = run(&plant, "5");
    assert_eq!(find(&lines, "restored: image")["restored"], 1);
}

#[test]
fn a_pending_reset_of_the_previous_program_happens_after_a_crash() {
    let before = "{ when = [\"X0\"], do = [\"OUT C5\"] },\n\
        { when = [\"X0\"], do = [\"PD C6\", \"SET C7\"] },\n\
        { when = [\"X0\"], do = [\"ONDTMR T0 preset=1ms output=C8\"] },\n\
        { leg.up = [\"$ScanToggle\"], leg.rst = [\"$Off\"], do = [\"CNT CT0 preset=9\"] },\n\
        { leg.up = [\"$ScanToggle\"], leg.dn = [\"$Off\"], do = [\"UDCG CT1\"] },\n\
        { when = [\"X0\"], do = [\"CTU N0 preset=5\", \"MOVE 6 to=D1\"] },\n\
        { when = [\"C5\"], do = [\"OUT Y0\"] }";
    let tags = "eye = { at = \"X0\", initial = true }\nmoved = { at = \"C8\" }";
    let plant = plant(&main(tags, before), "\"C0..C9\", \"D1\", \"CT0..CT1\", \"N0\", \"T0\"");
    run_and_kill(&plant);
    let found = content(&file(&plant));
    assert_eq!([word(&found, "C5"), word(&found, "C8")], [Some(1); 2]);
    let after = "{ when = [\"X2\"], do = [\"SET C5\"] },\n\
        { when = [\"X3\"], do = [\"RST C5\"] },\n\
        { leg.up = [\"$ScanToggle\"], leg.dn = [\"$Off\"], do = [\"UDCG CT0\"] },\n\
        { leg.up = [\"$ScanToggle\"], leg.dn = [\"$Off\"], do = [\"UDCG CT1\"] },\n\
        { when = [\"C5\"], do = [\"OUT Y0\"] }";
    write(&plant, "ladder.toml", &main(&tags.replace("C8", "C9"), after));
    let mut command = plant.command(&[] as &[&str]);
    let mut running = Running::new(command.arg("--stopped"));
    let restored = running.line("restored: image");
    let terminated = "OFF or 0, according to the program of that time";
    assert!(message(&restored).contains(terminated), "{restored}");
    running.line("STOP");
    let values = |names: &[&str]| names.iter().map(|name| read(&plant, name)).collect::<Vec<_>>();
    assert_eq!(values(&["C5", "C6", "C7", "C9", "Y0"]), ["OFF", "OFF", "ON", "OFF", "OFF"]);
    assert_eq!(values(&["CT0.Acc", "CT0.Reset", "T0.Acc", "D1"]), ["0", "ON", "0", "6"]);
    assert_eq!(values(&["N0.ACC", "N0.CU"]), ["1", "OFF"]);
    assert_ne!(read(&plant, "CT1.Acc"), "0", "a UDCG has no termination logic");
    running.stop();
}

#[test]
fn a_changed_preset_of_the_ladder_overrides_the_retained_one() {
    let counts = |preset: &str| {
        main("", &format!("{{ when = [\"$ScanToggle\"], do = [\"CTU N0{preset}\"] }}"))
    };
    let plant = plant(&counts(" preset=10"), "\"N0\", \"D5\"");
    let start = |ladder: &str, awaited: &str| {
        write(&plant, "ladder.toml", ladder);
        let running = Running::new(&mut plant.command(&[] as &[&str]));
        let told = running.line(awaited);
        running.line("RUN");
        let preset = read(&plant, "N0.PRE");
        (running, preset, message(&told).to_owned())
    };
    run(&plant, "5");
    let (mut running, preset, told) = start(&counts(" preset=3"), "N0.PRE");
    assert_eq!(preset, "3");
    assert_ne!(read(&plant, "N0.ACC"), "0");
    assert!(told.ends_with("it was 10 (the ladder had 10), and is 3 now"), "{told}");
    ask(&plant, &["write", "N0.PRE", "7"]);
    running.stop();
    let (mut running, preset, _) = start(&counts(" preset=3"), "restored: image");
    assert_eq!(preset, "7", "the ladder says what it said");
    running.stop();
    let (mut running, preset, _) = start(&counts(" preset=D5"), "restored: image");
    assert_eq!(preset, "0");
    running.stop();
    let (mut running, preset, _) = start(&counts(" preset=12"), "restored: image");
    assert_eq!(preset, "12");
    running.stop();
}
