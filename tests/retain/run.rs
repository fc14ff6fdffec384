//! The real binary and its retentive memory: starts, ends, changed programs, wrong files.

use std::fs;
use std::process::Command;
use std::time::Duration;

use crate::retain::crash::status;
use crate::retain::memory::{
    COUNTS, Held, KEEPS, Plant, Running, file, find, held, message, run, until,
};
use rungd_state::retain::content;
use rungd_state::retain::file::{Access, FileDevice};
use rungd_state::retain::slots::survey;
use serde_json::Value;

fn write(plant: &Plant, name: &str, text: &str) {
    fs::write(plant.0.join(name), text).unwrap();
}

fn controller(plant: &Plant, text: &str) {
    write(plant, "controller.toml", &format!("ladder = [\"ladder.toml\"]\n{text}"));
}

fn events(lines: &[Value], event: &str) -> Vec<String> {
    let named = lines.iter().filter(|line| line["event"] == event);
    named.map(|line| message(line).to_owned()).collect()
}

/// A controller that keeps `ranges`, and runs after a cold start.
fn keeps(ranges: &str) -> String {
    format!(
        "scan.period = \"2ms\"\n[retain]\nranges = [{ranges}]\nfile = \"memory\"\n\
         cold-start = \"run\"\n[operator]\nenabled = false\n"
    )
}

#[test]
fn an_orderly_stop_loses_no_retained_value() {
    let plant = Plant::new(COUNTS, KEEPS);
    let lines = run(&plant, "50");
    assert_eq!(events(&lines, "retain-cold").len(), 1);
    assert_eq!(events(&lines, "retain-made").len(), 1);
    let found = held(&file(&plant)).unwrap();
    assert_eq!((found.count, found.counter, found.is_final), (50, 25, true));
    let lines = run(&plant, "31");
    let restored = find(&lines, "restored: image");
    assert_eq!((&restored["restored"], &restored["dropped"]), (&4001.into(), &0.into()));
    assert!(message(restored).contains("after an orderly stop"), "{restored}");
    let found = held(&file(&plant)).unwrap();
    // The eye was ON at the end, and is not counted again: its history is retained.
    assert_eq!((found.count, found.counter, found.is_final), (81, 40, true));
}

#[test]
fn a_cold_start_without_permission_is_in_stop_and_keeps_nothing() {
    let plant = Plant::new(COUNTS, &KEEPS.replace("cold-start = \"run\"\n", ""));
    for _ in 0..2 {
        let mut running = Running::new(&mut plant.command(&[] as &[&str]));
        let cold = running.line("nothing is restored");
        assert_eq!((&cold["event"], &cold["level"]), (&"retain-cold".into(), &"ERROR".into()));
        running.line("STOP");
        std::thread::sleep(Duration::from_millis(100));
        running.stop();
        assert_eq!(held(&file(&plant)), None, "what nobody ran is not kept");
    }
}

#[test]
fn a_restart_after_a_kill_terminates_everything_with_termination_logic() {
    let ladder = "[[program]]\nname = \"Main\"\nrung = [\n\
        { when = [\"$On\"], do = [\"ADD D0 1 to=D0\", \"OUT C1\", \"SET C2\"] },\n\
        { leg.up = [\"$ScanToggle\"], leg.rst = [\"$Off\"], do = [\"CNT CT1 preset=5\"] },\n\
        { leg.up = [\"$ScanToggle\"], leg.dn = [\"$Off\"], do = [\"UDCG CT0\"] },\n\
        { when = [\"$On\"], do = [\"TMRAG T0 preset=3s\", \"TMR T1 preset=3s\"] },\n]\n";
    let interval = "interval = \"10ms\"\n[operator]\nsocket = \"op\"\n";
    let text = keeps("\"C1..C2\", \"D0\", \"CT0..CT1\", \"T0..T1\"");
    let text = text.replace("[operator]\nenabled = false\n", interval);
    let plant = Plant::new(ladder, &text);
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    let value = |operand: &str| {
        let socket = plant.0.join("op");
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_rungd"))
            .args(["read", operand, "--socket"])
            .arg(&socket)
            .output()
            .unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        text.split_whitespace().last().unwrap_or_default().to_owned()
    };
    let number = |operand: &str| value(operand).parse::<i32>().unwrap_or_default();
    until(|| number("D0") > 50 && number("T0.Acc") > 100);
    // Only an image that begins after the one under way is sure to have these values.
    let kept_so_far = || status(&plant).and_then(|told| told.retain?.image);
    let before = kept_so_far().unwrap_or_default();
    until(|| kept_so_far() >= Some(before + 2));
    running.child.kill().unwrap();
    running.end();
    let mut command = plant.command(&[] as &[&str]);
    let mut running = Running::new(command.arg("--stopped"));
    let restored = running.line("restored: image");
    assert_eq!(restored["orderly"], false, "{restored}");
    running.line("STOP");
    let kept: i32 = value("D0").parse().unwrap();
    assert!(kept > 50, "{kept}");
    assert_eq!((value("C1"), value("C2")), ("OFF".into(), "ON".into()));
    assert_eq!((value("CT1.Acc"), value("CT1.Reset")), ("0".into(), "ON".into()));
    assert_eq!(value("CT0.Acc").parse::<i32>().unwrap(), kept / 2);
    assert_eq!((value("T1.Acc"), value("T1.Reset")), ("0".into(), "ON".into()));
    assert!(value("T0.Acc").parse::<i32>().unwrap() > 100);
    running.stop();
}

const TAGGED: &str = "[tags]\nlevel = { at = \"D5\" }\nstarts = { at = \"D6\" }\n\
    [[program]]\nname = \"Main\"\n[[program.rung]]\nwhen = [\"$FirstScan\"]\ndo = [\n\
    \"MOVE 55 to=level\", \"MOVE 66 to=starts\", \"MOVE 77 to=D7\", \"MOVE 88 to=D8\"]\n";

/// A program that copies the restored values of these tags.
fn shows(tags: &str, named: &str) -> String {
    format!(
        "[tags]\n{tags}[[program]]\nname = \"Main\"\n[[program.rung]]\nwhen = [\"$On\"]\ndo = [{named}]\n"
    )
}

#[test]
fn values_follow_their_tags_and_values_of_changed_elements_are_dropped() {
    let plant = Plant::new(TAGGED, &keeps("\"D5..D8\""));
    run(&plant, "3");
    let tags = "level = { at = \"D50\" }\nstarts = { at = \"CT3\" }\nnewcomer = { at = \"D8\" }\n";
    let named = "\"MOVE level to=D100\", \"MOVE D7 to=D101\", \"MOVE newcomer to=D102\"";
    write(&plant, "ladder.toml", &shows(tags, named));
    controller(&plant, &keeps("\"D7..D8\", \"D50\", \"CT3\", \"D100..D102\""));
    let lines = run(&plant, "3");
    assert_eq!(
        events(&lines, "retain-dropped"),
        [
            "retentive memory: starts (D6) is not restored: its type changed: `starts` was a \
             32-bit word and is a counter, CT3",
            "retentive memory: D8 is not restored: it had no tag, and is `newcomer` now",
        ]
    );
    let mut shown = std::process::Command::new(env!("CARGO_BIN_EXE_rungd"));
    let output = shown.args(["retain", "show"]).arg(file(&plant)).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let line = |name: &str| {
        let words = text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
        words.into_iter().find(|words| words[0] == name).map(|words| words[1..].join(" "))
    };
    assert_eq!(line("D100").as_deref(), Some("55"), "{text}");
    assert_eq!(line("D101").as_deref(), Some("77"), "{text}");
    assert_eq!(line("D102"), None, "it is 0: {text}");
    assert_eq!(line("D50").as_deref(), Some("level 55"), "{text}");
}

#[test]
fn a_value_beyond_the_new_limits_of_its_tag_is_dropped() {
    let tags = |limits: &str| {
        format!(
            "[tags]\nsize = {{ at = \"D5\"{limits} }}\nrate = {{ at = \"D6\"{} }}\n\
             low = {{ at = \"D7\"{} }}\nbatch = {{ at = \"CT0.Acc\"{} }}\n",
            if limits.is_empty() { "" } else { ", max = 66" },
            if limits.is_empty() { "" } else { ", min = 3" },
            if limits.is_empty() { "" } else { ", max = 2" },
        )
    };
    let first = "{ when = [\"$FirstScan\"], do = [\"MOVE 900 to=size\", \"MOVE 66 to=rate\"] }";
    let counts = "{ leg.up = [\"$ScanToggle\"], leg.dn = [\"$Off\"], do = [\"UDCG CT0\"] }";
    let reads = "{ when = [\"low == 0\", \"batch == 0\"], do = [\"OUT Y0\"] }";
    let ladder = |limits: &str, rungs: &str| {
        format!("{}[[program]]\nname = \"Main\"\nrung = [{rungs}]\n", tags(limits))
    };
    let plant = Plant::new(
        &ladder("", &format!("{first}, {counts}, {reads}")),
        &keeps("\"D5..D7\", \"CT0\""),
    );
    run(&plant, "20");
    let limits = ", initial = 12, min = 1, max = 500";
    let copies = "{ when = [\"$On\"], do = [\"MOVE size to=D100\"] }, \
        { when = [\"rate > 0\"], do = [\"OUT Y1\"] }";
    write(&plant, "ladder.toml", &ladder(limits, &format!("{counts}, {reads}, {copies}")));
    let lines = run(&plant, "1");
    assert_eq!(
        events(&lines, "retain-dropped"),
        ["retentive memory: size (D5) is not restored: it was 900, but its limits are 1 to 500 \
          now; it begins with 12"]
    );
    let restored = find(&lines, "restored: image");
    // A counter's count has no limits, and `low` begins with 0 in any case.
    assert_eq!((&restored["restored"], &restored["dropped"]), (&3.into(), &1.into()));
    let mut device = FileDevice::open(&file(&plant), Access::Read).unwrap();
    let newest = survey(&mut device).unwrap().newest.unwrap();
    let found = content::read(&newest.content).unwrap();
    let words: Vec<i32> = found.elements.iter().map(|(_, value)| value.word).collect();
    assert_eq!(words[..3], [12, 66, 0]);
    assert!(words[3] > 2, "{words:?}");
}

/// A program with one count: the eye is ON from the first scan to the last.
fn eye(block: &str, mnemonic: &str) -> String {
    let rst = if mnemonic == "UDC" { "leg.rst = [\"$Off\"], " } else { "" };
    format!(
        "[[program]]\nname = \"Main\"\nrung = [ {{ when = [\"$On\"], do = [\"OUT C0\"] }} ]\n\
         [[program]]\nname = \"{block}\"\nautostart = true\nrung = [ {{ leg.up = [\"$On\"], \
         leg.dn = [\"$Off\"], {rst}do = [\"{mnemonic} CT0 up-preset=5\"] }} ]\n"
    )
}

#[test]
fn an_edge_history_is_retained_if_mnemonic_and_block_are_unchanged() {
    let plant = Plant::new(&eye("Count", "UDCG"), &keeps("\"CT0\""));
    let count = || {
        run(&plant, "5");
        let mut device = FileDevice::open(&file(&plant), Access::Read).unwrap();
        let newest = survey(&mut device).unwrap().newest.unwrap();
        content::read(&newest.content).unwrap().elements[0].1.word
    };
    assert_eq!((count(), count()), (1, 1), "an eye that was blocked does not count again");
    write(&plant, "ladder.toml", &eye("Counting", "UDCG"));
    assert_eq!((count(), count()), (2, 2), "another block's eye is another eye");
    write(&plant, "ladder.toml", &eye("Counting", "UDC"));
    assert_eq!(count(), 0, "a UDC is terminated at the stop");
}

#[test]
fn a_program_that_retains_more_moves_the_image_to_a_longer_file() {
    let plant = Plant::new(COUNTS, &keeps("\"D0..D1\", \"D3999\", \"CT0\""));
    run(&plant, "40");
    let short = fs::metadata(file(&plant)).unwrap().len();
    controller(&plant, &keeps("\"D0..D3999\", \"CT0\""));
    let lines = run(&plant, "10");
    assert_eq!(find(&lines, "restored: image")["restored"], 4);
    assert!(fs::metadata(file(&plant)).unwrap().len() > short);
    assert_eq!(held(&file(&plant)).unwrap().count, 50);
}

#[test]
fn foreign_and_newer_files_are_renamed_and_never_overwritten() {
    let plant = Plant::new(COUNTS, KEEPS);
    let aside = |number: u32| plant.0.join(format!("memory.aside-{number}"));
    write(&plant, "memory", "my only copy of something else\n");
    let lines = run(&plant, "5");
    assert_eq!(events(&lines, "retain-aside").len(), 1);
    assert!(events(&lines, "retain-cold")[0].contains("not a file of retentive memory"));
    assert_eq!(fs::read(aside(1)).unwrap(), b"my only copy of something else\n");
    let mut later = fs::read(file(&plant)).unwrap();
    (later[16], later[4096 + 16]) = (2, 2);
    fs::write(file(&plant), &later).unwrap();
    let lines = run(&plant, "5");
    assert!(events(&lines, "retain-cold")[0].contains("version 2"));
    assert!(fs::read(aside(2)).unwrap() == later);
    assert_eq!(held(&file(&plant)).unwrap().count, 5);
}

#[test]
fn a_damaged_image_is_reported_and_the_earlier_image_is_used() {
    let plant = Plant::new(COUNTS, KEEPS);
    run(&plant, "5");
    run(&plant, "5");
    let before = held(&file(&plant)).unwrap();
    let mut bytes = fs::read(file(&plant)).unwrap();
    // The newest image is in the slot with the highest sequence number.
    let slot = bytes.windows(8).enumerate().filter(|(_, window)| window == b"RETSLOT\n");
    let sequence = |at: usize| u64::from_le_bytes(bytes[at + 16..at + 24].try_into().unwrap());
    let newest = slot.map(|(at, _)| at).max_by_key(|at| sequence(*at)).unwrap();
    assert_eq!(sequence(newest), before.sequence);
    bytes[newest + 200] ^= 4;
    fs::write(file(&plant), &bytes).unwrap();
    let lines = run(&plant, "1");
    assert_eq!(events(&lines, "retain-slot").len(), 1);
    assert!(find(&lines, "restored: image")["image"].as_u64().unwrap() < before.sequence);
}

#[test]
fn two_controllers_do_not_share_a_retentive_file() {
    let plant = Plant::new(COUNTS, KEEPS);
    let mut first = Running::new(&mut plant.command(&[] as &[&str]));
    first.line("RUN");
    let mut second = Running::new(&mut plant.second());
    second.line("another rungd uses this file");
    assert_eq!(second.end().code(), Some(74));
    first.stop();
}

#[test]
fn a_save_by_an_operator_shows_in_status() {
    let plant = Plant::new(COUNTS, &KEEPS.replace("20ms", "1h"));
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    let ask = |words: &[&str]| {
        let socket = plant.0.join("op");
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_rungd"));
        let output = command.args(words).arg("--socket").arg(socket).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let read = || -> i32 {
        let text = ask(&["read", "D0"]);
        text.split_whitespace().last().unwrap().parse().unwrap()
    };
    std::thread::sleep(Duration::from_millis(100));
    let before = read();
    let told = ask(&["retain", "save"]);
    assert!(told.contains("durable in"), "{told}");
    let kept = held(&file(&plant)).unwrap();
    assert!(kept.count >= before && !kept.is_final, "{kept:?} {before}");
    let status = ask(&["status"]);
    assert!(status.contains("of scan ") && status.contains("every 1h"), "{status}");
    let json: Value = serde_json::from_str(&ask(&["status", "--json"])).unwrap();
    assert!(json["retain"]["flush_us"].as_u64().unwrap() > 0, "{json}");
    // The interval of an hour has not passed; the stop keeps the rest.
    running.stop();
    let last: Held = held(&file(&plant)).unwrap();
    assert!(last.count > kept.count && last.is_final);
}

#[test]
fn exceeding_the_daily_write_budget_is_reported_at_once() {
    let budget = "cold-start = \"run\"\nbudget-mb-per-day = 1\n";
    let plant = Plant::new(COUNTS, &KEEPS.replace("cold-start = \"run\"\n", budget));
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    let wear = running.line("MB a day are written at the present rate");
    assert_eq!((&wear["event"], &wear["level"]), (&"retain-wear".into(), &"WARN".into()));
    assert_eq!(wear["budget_mb_per_day"], 1);
    let a_day = wear["mb_per_day"].as_u64().unwrap();
    assert!(a_day > 1000, "a MB within seconds: {wear}");
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_rungd"));
    let output = command.args(["status", "--json", "--socket"]).arg(plant.0.join("op")).output();
    let status: Value = serde_json::from_slice(&output.unwrap().stdout).unwrap();
    let retain = &status["retain"];
    assert_eq!(retain["budget_per_day"], 1_000_000);
    assert!(retain["bytes"].as_u64() > Some(1_000_000), "{retain}");
    assert!(retain["bytes_per_day"].as_u64() > Some(1_000_000_000), "{retain}");
    assert!(events(&running.stop(), "retain-wear").is_empty(), "once a day is enough");
}

#[test]
fn a_reloaded_program_is_retained_by_its_own_names_and_ranges() {
    let text = keeps("\"D5..D8\"").replace("enabled = false", "socket = \"op\"");
    let plant = Plant::new(TAGGED, &text);
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    let ask = |words: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_rungd"));
        let output = command.args(words).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let (socket, path) = (plant.0.join("op"), file(&plant));
    let (socket, path) = (socket.to_str().unwrap(), path.to_str().unwrap());
    ask(&["retain", "save", "--socket", socket]);
    assert!(ask(&["retain", "show", path]).contains("level"));
    write(&plant, "ladder.toml", &TAGGED.replace("level", "height"));
    // The new range is longer, so the file must grow.
    controller(&plant, &text.replace("D5..D8", "D5..D4000"));
    ask(&["reload", "--socket", socket]);
    ask(&["retain", "save", "--socket", socket]);
    let shown = ask(&["retain", "show", path]);
    assert!(shown.contains("height") && !shown.contains("level"), "{shown}");
    assert!(shown.contains("55") && shown.contains("and 39"), "{shown}");
    running.stop();
}

/// The output of `rungd mode stop` with these arguments, at a controller whose disk takes a second.
fn stopped_on_a_slow_disk(words: &[&str]) -> (Plant, String) {
    let plant = Plant::new(COUNTS, &KEEPS.replace("20ms", "1m"));
    let faults = plant.0.join("faults");
    let mut command = plant.command(&[] as &[&str]);
    let mut running = Running::new(command.env("RUNGD_FAULTS", &faults));
    running.line("RUN");
    until(|| held(&file(&plant)).is_some());
    fs::write(&faults, "disk").unwrap();
    until(|| !faults.exists());
    let said = plant.ask(&[&["mode", "stop"], words].concat());
    running.kill();
    (plant, said)
}

#[test]
fn a_stop_command_is_answered_once_its_image_is_durable() {
    let (plant, said) = stopped_on_a_slow_disk(&[]);
    assert!(said.starts_with("STOP (an operator requested it), was RUN\n"), "{said}");
    assert!(said.contains("memory: image ") && said.contains(", durable"), "{said}");
    assert!(held(&file(&plant)).unwrap().is_final, "killed right behind the answer");
}

/// The figure of `docs/retain.md`. The next test is its control: there the image is lost.
#[test]
#[ignore = "a minute"]
fn no_image_of_45_answered_stops_is_lost() {
    let lost = (0..45).filter(|_| {
        let (plant, _) = stopped_on_a_slow_disk(&[]);
        !held(&file(&plant)).unwrap().is_final
    });
    assert_eq!(lost.count(), 0);
}

#[test]
fn a_stop_without_waiting_is_answered_at_once() {
    let (plant, said) = stopped_on_a_slow_disk(&["--no-wait"]);
    assert_eq!(said, "STOP (an operator requested it), was RUN\n");
    assert!(!held(&file(&plant)).unwrap().is_final, "killed while the disk was busy");
}

#[test]
fn a_stop_with_an_unwritable_image_reports_the_failure_and_a_remedy() {
    let plant = Plant::new(COUNTS, KEEPS);
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    until(|| held(&file(&plant)).is_some());
    // Now the file is gone, and a new file cannot be made.
    fs::create_dir_all(plant.0.join("memory.new/in-the-way")).unwrap();
    fs::remove_file(file(&plant)).unwrap();
    let said = plant.ask_for(&["mode", "stop"], 74);
    assert!(said.contains("STOP (an operator requested it), was RUN\n"), "{said}");
    assert!(said.contains("the last image is not kept: "), "{said}");
    assert!(said.contains("then run `rungd retain save`"), "{said}");
    fs::remove_dir_all(plant.0.join("memory.new")).unwrap();
    plant.ask(&["retain", "save"]);
    assert!(held(&file(&plant)).unwrap().is_final);
    fs::create_dir_all(plant.0.join("memory.new/in-the-way")).unwrap();
    fs::remove_file(file(&plant)).unwrap();
    let (lines, code) = running.stop_with_code();
    assert_eq!(events(&lines, "retain-lost").len(), 1);
    assert_eq!(code, Some(74));
}

/// Starts a controller that stays in STOP, and says how it runs without an operator's command.
fn starts_cold_without_a_socket(command: &mut Command) {
    let mut running = Running::new(command);
    for words in ["nothing is restored", "STOP: nothing was found"] {
        let line = running.line(words);
        let said = message(&line);
        assert!(said.contains("rungd run --cold-start run FILE"), "{said}");
        assert!(said.contains("`[retain] cold-start = \"run\"`"), "{said}");
        assert!(!said.contains("restart"), "{said}");
    }
    running.stop();
}

/// The environment names a socket that cannot be made; then a controller runs without one.
#[test]
fn a_cold_start_without_the_default_socket_names_the_way_to_run() {
    let keeps = KEEPS.replace("cold-start = \"run\"\n", "");
    let keeps = keeps.replace("[operator]\nsocket = \"op\"\n", "");
    let too_long = format!("/tmp/{}", "x".repeat(120));
    for socket in ["/no/such/folder/rungd.sock", &too_long] {
        let plant = Plant::new(COUNTS, &keeps);
        let mut command = plant.command(&[] as &[&str]);
        starts_cold_without_a_socket(command.env("RUNGD_SOCKET", socket));
    }
}

#[test]
fn a_cold_start_without_an_operator_socket_names_the_way_to_run() {
    let keeps =
        KEEPS.replace("cold-start = \"run\"\n", "").replace("socket = \"op\"", "enabled = false");
    let plant = Plant::new(COUNTS, &keeps);
    for _ in 0..2 {
        starts_cold_without_a_socket(&mut plant.command(&[] as &[&str]));
    }
    let mut command = plant.command(&[] as &[&str]);
    let mut running = Running::new(command.args(["--cold-start", "run", "--scans", "50"]));
    running.rest();
    assert_eq!(running.end().code(), Some(0));
    assert_eq!(held(&file(&plant)).unwrap().count, 50);
    run(&plant, "7");
    assert_eq!(held(&file(&plant)).unwrap().count, 57);
}
