//! The log on a terminal: a line a fact, at most 100 columns, local time, the code at the end. The
//! terminal is a pty, made by `script`.

use std::fs;
use std::path::Path;
use std::process::Command;

use rungd_test_support::calm::calmed;
use rungd_test_support::needs::{usable, works};
use rungd_test_support::page;
use rungd_test_support::running::process::list_of_controllers;
use rungd_test_support::running::process::{BLINKS, Plant};
use rungd_test_support::shown::lines_match;

/// What a run of some scans writes to a terminal, without the carriage returns.
fn on_terminal(plant: &Plant, arguments: &str, no_color: &str) -> Option<String> {
    let run = format!("run {}/controller.toml {arguments}", plant.0.display());
    let (text, is_done) = shown(&plant.0, &run, no_color)?;
    assert!(is_done, "{text}");
    Some(text)
}

/// What rungd writes to a terminal, and whether it ends with 0.
fn shown(folder: &Path, arguments: &str, no_color: &str) -> Option<(String, bool)> {
    if !usable(works("script", Command::new("script").args(["-qec", "true", "/dev/null"]))) {
        return None;
    }
    let run = format!("{} {arguments}", env!("CARGO_BIN_EXE_rungd"));
    let mut command = Command::new("script");
    command.args(["-qec", &run, "/dev/null"]).env("TZ", "NPT-5:45").env("NO_COLOR", no_color);
    command.current_dir(folder).env("XDG_RUNTIME_DIR", list_of_controllers());
    for name in ["RUNGD_LOG", "RUNGD_SOCKET", "RUNTIME_DIRECTORY", "JOURNAL_STREAM"] {
        command.env_remove(name);
    }
    let output = command.output().expect("script runs");
    let text = String::from_utf8(output.stdout).expect("text");
    Some((text.replace('\r', ""), output.status.success()))
}

const CONTROLLER: &str = "log.statistics = \"1s\"\nscan.watchdog = \"30s\"\n";

#[test]
fn a_terminal_shows_short_lines_in_local_time_with_the_code_at_the_end() {
    let plant = Plant::new(BLINKS, CONTROLLER);
    let Some(text) = on_terminal(&plant, "--scans 115", "1") else { return };
    let mut lines = text.lines();
    let date = lines.next().unwrap_or_default();
    assert!(date.len() == 21 && date.ends_with(", UTC+05:45"), "{text}");
    assert!(!text.contains('\x1b'), "{text:?}");
    for line in lines.clone() {
        assert!(line.chars().count() <= 100, "{line}");
    }
    let whole: Vec<&str> = lines.filter(|line| !line.starts_with(' ')).collect();
    let is_time = |line: &str| line.as_bytes().get(8) == Some(&b'.') && line.as_bytes()[2] == b':';
    assert!(whole.iter().all(|line| is_time(line)), "{text}");
    let run = whole.iter().find(|line| line.contains("RUN: scanning")).expect("RUN");
    assert!(run.ends_with("       RUN: scanning every 10ms  scan=0 RUNGD-0201"), "{run}");
    let beat = whole.iter().find(|line| line.ends_with("RUNGD-0502")).expect("a heartbeat");
    for part in ["RUN every 10ms: p99 ", ", lateness ", ", overruns ", " in 1"] {
        assert!(beat.contains(part), "{beat}");
    }
    let end = text.lines().last().unwrap_or_default();
    assert!(end.ends_with("rungd ends  scans=115 mode=STOP RUNGD-0005"), "{end}");
}

#[test]
fn the_level_is_coloured_unless_colours_are_off_or_a_log_format_is_named() {
    let plant = Plant::new(BLINKS, &format!("{CONTROLLER}realtime.cpus = [1023]\n"));
    let Some(text) = on_terminal(&plant, "--scans 3", "") else { return };
    let warning = text.lines().find(|line| line.contains("\x1b[33mWARN ")).expect(&text);
    assert!(warning.contains("\x1b[33mreal-time posture: "), "{warning:?}");
    let Some(text) = on_terminal(&plant, "--scans 3 --log-format text", "1") else { return };
    assert!(text.contains("+05:45") || text.contains("Z  INFO RUNGD-0201 mode-run: "), "{text}");
    assert!(!text.contains('\x1b'), "{text:?}");
}

/// The page shows the first lines; a busy machine may have warnings between them.
#[test]
fn the_start_page_shows_the_log_lines_of_a_terminal() {
    let page = page::text("start.md");
    let block = page::blocks(&page, "text").remove(0);
    let (command, wanted) = block.split_once('\n').expect("a command");
    let plant = Plant::new(BLINKS, "");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    fs::create_dir_all(plant.0.join("config/programs")).expect("a folder");
    for name in ["config/rungd.toml", "config/programs/parts-bin.toml"] {
        let text = fs::read_to_string(root.join(name)).expect("a file");
        let text = if name.ends_with("rungd.toml") { calmed(&text) } else { text };
        fs::write(plant.0.join(name), text).expect("a copy");
    }
    let run = command.strip_prefix("$ rungd ").expect("a command");
    let Some((text, _)) = shown(&plant.0, &format!("{run} --scans 60"), "1") else { return };
    let mut is_warning = false;
    let lines = text.lines().filter(|line| {
        is_warning = line.contains(" WARN ") || is_warning && line.starts_with(' ');
        !is_warning
    });
    let (wanted, lines): (Vec<&str>, Vec<&str>) = (wanted.lines().collect(), lines.collect());
    assert!(lines_match(&wanted, &lines), "{text}");
}

#[test]
fn findings_are_folded_to_the_width_of_a_terminal() {
    let plant = Plant::new(BLINKS, &format!("{CONTROLLER}[retain]\nranges = [\"Y0\"]\n"));
    for run in ["run controller.toml", "check controller.toml"] {
        let Some((text, is_done)) = shown(&plant.0, run, "1") else { return };
        assert!(!is_done && text.contains("error[retain-range]: `Y0`: "), "{text}");
        let long = text.lines().find(|line| line.chars().count() > 100);
        assert_eq!(long, None, "{run}");
    }
    let output = Command::new(env!("CARGO_BIN_EXE_rungd"))
        .args(["check", "controller.toml"])
        .current_dir(&plant.0)
        .output();
    let text = String::from_utf8(output.expect("it runs").stderr).expect("text");
    assert!(text.lines().any(|line| line.chars().count() > 100), "a pipe has whole lines: {text}");
}
