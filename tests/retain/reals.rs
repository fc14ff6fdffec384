//! Reals in retentive memory, with the real binary: a restart keeps every bit of an f32, and `rungd
//! retain show` prints it as the ladder writes it; and values with the texts of their tags.

use std::process::Command;

use crate::retain::crash::status;
use crate::retain::memory::{Plant, Running, ask, file, find, message, run, until};

const LADDER: &str = "[tags]\nlevel = { at = \"R5\" }\n[[program]]\nname = \"Main\"\nrung = [\n\
    { when = [\"$FirstScan\", \"R6 == 0\"], do = [\"MOVE 0.1 to=level\", \"MOVE -2.5e-7 to=R6\",\n\
      \"MOVE 3.4028235e38 to=R7\", \"MOVE 1e-45 to=R8\"] },\n\
    { when = [\"$On\"], do = [\"MATH R6 = R6 * 2\"] },\n]\n";

const KEEPS: &str = "scan.period = \"2ms\"\n[retain]\nranges = [\"R5..R8\", \"D0\"]\n\
    file = \"memory\"\ncold-start = \"run\"\n[operator]\nsocket = \"op\"\n";

/// The output of a command of rungd.
fn rungd(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_rungd")).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The words of a file's elements, as `rungd retain show` prints them.
fn shown(plant: &Plant) -> Vec<String> {
    let text = rungd(&["retain", "show", file(plant).to_str().unwrap()]);
    let lines = text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "));
    lines.filter(|line| line.starts_with('R')).collect()
}

#[test]
fn a_restart_keeps_every_bit_of_a_real() {
    let plant = Plant::new(LADDER, KEEPS);
    run(&plant, "3");
    let kept = ["R5 level 0.1", "R6 -2e-6", "R7 3.4028235e38", "R8 1e-45"];
    assert_eq!(shown(&plant), kept);
    let lines = run(&plant, "1");
    assert_eq!(find(&lines, "restored: image")["restored"], 5);
    let kept = ["R5 level 0.1", "R6 -4e-6", "R7 3.4028235e38", "R8 1e-45"];
    assert_eq!(shown(&plant), kept, "it went on from there");
}

#[test]
fn the_texts_of_values_are_shown_if_the_files_of_the_ladder_are_named() {
    let ladder = "[tags]\nmode = { type = \"int\", texts = { 0 = \"idle\", 3 = \"dosing\" } }\n\
                  door = { at = \"C5\", texts = { 1 = \"open\" } }\n\
                  [[program]]\nname = \"Main\"\nrung = [\n\
                  { when = [\"$On\"], do = [\"MOVE 3 to=mode\", \"SET door\"] } ]\n";
    let keeps = "scan.period = \"2ms\"\n[retain]\ntags = [\"mode\", \"door\"]\n\
                 file = \"memory\"\ncold-start = \"run\"\n[operator]\nsocket = \"op\"\n";
    let plant = Plant::new(ladder, keeps);
    run(&plant, "3");
    let show = |more: &[&str]| {
        let text = rungd(&[&["retain", "show", file(&plant).to_str().unwrap()], more].concat());
        let words = text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "));
        words.filter(|line| line.contains("mode") || line.contains("door")).collect::<Vec<_>>()
    };
    assert_eq!(show(&[]), ["C5 door ON", "int mode 3"]);
    let controller = plant.0.join("controller.toml");
    let told = show(&["--in", controller.to_str().unwrap()]);
    assert_eq!(told, ["C5 door ON (open)", "int mode 3 (dosing)"]);
}

#[test]
fn a_killed_process_keeps_reals_like_words() {
    let plant = Plant::new(LADDER, &KEEPS.replace("cold-start", "interval = \"10ms\"\ncold-start"));
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    // Before a complete scan no memory can be kept: its first scan writes the values.
    until(|| status(&plant).is_some_and(|status| status.scans > 0));
    ask(&plant, &["retain", "save"]);
    running.child.kill().unwrap();
    running.end();
    let mut running = Running::new(plant.command(&[] as &[&str]).arg("--stopped"));
    running.line("restored: image");
    running.line("STOP");
    let read = ask(&plant, &["read", "level", "R7", "R8"]);
    let values: Vec<_> = read.lines().filter_map(|line| line.split_whitespace().nth(2)).collect();
    assert_eq!(values, ["0.1", "3.4028235e38", "1e-45"]);
    running.stop();
}

#[test]
fn a_real_follows_its_tag_but_not_to_an_integer_word() {
    let plant = Plant::new(LADDER, KEEPS);
    run(&plant, "3");
    let moved = LADDER.replace("level = { at = \"R5\" }", "level = { at = \"R9\", max = 1.5 }");
    std::fs::write(plant.0.join("ladder.toml"), &moved).unwrap();
    let controller = format!("ladder = [\"ladder.toml\"]\n{KEEPS}").replace("R5..R8", "R6..R9");
    std::fs::write(plant.0.join("controller.toml"), &controller).unwrap();
    run(&plant, "1");
    assert_eq!(shown(&plant)[3], "R9 level 0.1");
    for (tag, why) in [
        ("at = \"D0\"", "its type changed: `level` was a real and is a 32-bit word, D0"),
        (
            "at = \"R9\", min = 0.25",
            "it was 0.1, but its limits are 0.25 to 3.4028235e38 now; it begins with 0.0",
        ),
    ] {
        let text = moved.replace("at = \"R9\", max = 1.5", tag);
        std::fs::write(
            plant.0.join("ladder.toml"),
            text.replace("MOVE 0.1 to=level", "MOVE 1 to=level"),
        )
        .unwrap();
        let lines = run(&plant, "1");
        let said = lines.iter().filter(|line| line["event"] == "retain-dropped");
        let said: Vec<_> = said.map(|line| message(line).to_owned()).collect();
        assert!(said.iter().any(|line| line.contains(why)), "{why}: {said:?}");
        std::fs::remove_file(file(&plant)).unwrap();
        std::fs::write(plant.0.join("ladder.toml"), &moved).unwrap();
        run(&plant, "3");
    }
}
