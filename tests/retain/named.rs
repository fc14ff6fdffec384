//! The real binary with tags that have a `type`: they are kept by name, in any place.

use std::fs;
use std::process::Command;

use crate::retain::memory::{Plant, Running, file, find, message, run};

const CONTROLLER: &str = "ladder = [\"ladder.toml\"]\nscan.period = \"2ms\"\n\
    [operator]\nsocket = \"op\"\n[retain]\ntags = [\"total_*\", \"parts\", \"old\"]\n\
    ranges = [\"D5\"]\nfile = \"memory\"\ninterval = \"20ms\"\ncold-start = \"run\"\n";

const TAGS: &str = "parts = { type = \"counter\" }\ntotal_b = { type = \"int\" }\n\
    total_c = { type = \"bit\" }\nother = { type = \"int\" }\nold = { at = \"D6\" }\n";

const RUNGS: &str = "{ leg.up = [\"$ScanToggle\"], leg.dn = [\"$Off\"], do = [\"UDCG parts\"] },\n\
    { when = [\"$FirstScan\"], do = [\"ADD total_b 40 to=total_b\", \"ADD other 1 to=other\"] },\n\
    { when = [\"$FirstScan\"], do = [\"SET total_c\", \"ADD D5 1 to=D5\", \"ADD old 7 to=old\"] },\n\
    { when = [\"X1\"], do = [\"RST total_c\"] },\n";

fn write(plant: &Plant, tags: &str, rungs: &str) {
    let ladder = format!("[tags]\n{tags}\n[[program]]\nname = \"Main\"\nrung = [\n{rungs}\n]\n");
    fs::write(plant.0.join("ladder.toml"), ladder).unwrap();
}

fn plant() -> Plant {
    let plant = Plant::new("", "");
    fs::write(plant.0.join("controller.toml"), CONTROLLER).unwrap();
    write(&plant, TAGS, RUNGS);
    plant
}

fn ask(plant: &Plant, words: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let output = command.args(words).arg("--socket").arg(plant.0.join("op")).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    format!("{}{}", text(&output.stdout), text(&output.stderr))
}

fn read(plant: &Plant, operand: &str) -> String {
    ask(plant, &["read", operand]).split_whitespace().last().unwrap_or_default().to_owned()
}

/// Additional tags before and after the others, so that every place changes.
const MORE: &str = "a = { type = \"int\", spare = true }\nb = { type = \"counter\", spare = true }\n\
    c = { type = \"bit\", spare = true }\nz = { type = \"int\", spare = true }\n";

#[test]
fn a_restart_with_more_tags_in_another_order_keeps_every_value() {
    let plant = plant();
    run(&plant, "7");
    let shown = Command::new(env!("CARGO_BIN_EXE_rungd"))
        .args(["retain", "show"])
        .arg(file(&plant))
        .output()
        .unwrap();
    let shown = String::from_utf8(shown.stdout).unwrap();
    let line = |name: &str| shown.lines().find(|line| line.contains(name)).unwrap_or_default();
    assert!(line("total_b").trim().starts_with("int "), "{shown}");
    assert!(line("parts").trim().starts_with("counter "), "{shown}");
    assert!(line("old").trim().starts_with("D6 "), "{shown}");
    write(&plant, &format!("{MORE}{TAGS}"), RUNGS);
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    let restored = running.line("restored: image");
    assert_eq!((&restored["restored"], &restored["dropped"]), (&5.into(), &0.into()), "{restored}");
    running.line("RUN");
    assert_eq!([read(&plant, "total_b"), read(&plant, "other")], ["80", "1"]);
    assert_eq!(
        [read(&plant, "total_c"), read(&plant, "D5"), read(&plant, "old")],
        ["ON", "2", "14"]
    );
    let parts = ask(&plant, &["read", "parts.Acc"]);
    let count: i32 = parts.split_whitespace().last().unwrap().parse().expect(&parts);
    assert!(count > 3, "{parts}");
    running.stop();
}

#[test]
fn a_value_is_kept_by_name_when_an_address_becomes_a_type_and_back() {
    let plant = plant();
    run(&plant, "5");
    write(&plant, &TAGS.replace("at = \"D6\"", "type = \"int\""), RUNGS);
    run(&plant, "5");
    write(&plant, TAGS, RUNGS);
    let lines = run(&plant, "5");
    assert_eq!(find(&lines, "restored: image")["dropped"], 0);
    write(&plant, TAGS, RUNGS);
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    assert_eq!([read(&plant, "old"), read(&plant, "D6")], ["28", "28"]);
    running.stop();
}

#[test]
fn a_removed_tag_is_reported_by_name() {
    let plant = plant();
    run(&plant, "5");
    let rungs = RUNGS.replace("total_b", "total_x");
    write(&plant, &TAGS.replace("total_b", "total_x"), &rungs);
    let lines = run(&plant, "5");
    let told = message(find(&lines, "no tag of this name is retained any more"));
    assert!(told.contains("total_b") && !told.contains("D40"), "{told}");
}

#[test]
fn commands_accept_placed_tags_and_refuse_their_addresses() {
    let plant = plant();
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    for words in [
        &["read", "D4095"][..],
        &["write", "D4095", "3"],
        &["force", "C2047", "1"],
        &["read", "D4090..D4095"],
    ] {
        let told = ask(&plant, words);
        assert!(told.contains("can be used only by its name"), "{words:?}: {told}");
    }
    ask(&plant, &["write", "total_b", "5"]);
    ask(&plant, &["force", "total_c", "0"]);
    let told = ask(&plant, &["read", "total_b", "total_c", "parts"]);
    assert!(told.contains("total_c       OFF  forced"), "{told}");
    for address in ["D40", "C20", "CT2"] {
        assert!(!told.contains(address), "{told}");
        assert!(!ask(&plant, &["status"]).contains(address));
    }
    // With additional tags, the force and the value move to the new places.
    write(&plant, &format!("{MORE}{TAGS}"), RUNGS);
    let told = ask(&plant, &["reload"]);
    assert!(!told.contains("force"), "{told}");
    assert!(ask(&plant, &["status"]).contains("total_c"), "{}", ask(&plant, &["status"]));
    assert_eq!([read(&plant, "total_b"), read(&plant, "total_c")], ["5", "forced"]);
    write(&plant, &TAGS.replace("total_c", "total_d"), &RUNGS.replace("total_c", "total_d"));
    ask(&plant, &["reload"]);
    let lines = running.stop();
    let ended = find(&lines, "tag total_c is gone");
    assert_eq!(ended["event"], "reload-difference");
    assert!(message(ended).ends_with("its force ends"), "{ended}");
    // The log repeats a refused command as it was given.
    let others = lines.iter().filter(|line| line["event"] != "operator-refused");
    let log = others.map(ToString::to_string).collect::<String>();
    assert!(!log.contains("D4095") && !log.contains("C2047"), "{log}");
}
