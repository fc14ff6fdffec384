//! The log on a terminal: a line a fact, at most 100 columns, local time, the code at the end. The
//! terminal is a pty, made by `script`.

use std::process::Command;

use crate::support::needs::{usable, works};
use crate::support::process::{BLINKS, Plant};

/// What a run of some scans writes to a terminal, without the carriage returns.
fn on_terminal(plant: &Plant, arguments: &str, no_color: &str) -> Option<String> {
    if !usable(works("script", Command::new("script").args(["-qec", "true", "/dev/null"]))) {
        return None;
    }
    let folder = plant.0.display();
    let run = format!("{} run {folder}/controller.toml {arguments}", env!("CARGO_BIN_EXE_rungd"));
    let mut command = Command::new("script");
    command.args(["-qec", &run, "/dev/null"]).env("TZ", "NPT-5:45").env("NO_COLOR", no_color);
    for name in ["RUNGD_LOG", "RUNGD_SOCKET", "RUNTIME_DIRECTORY", "JOURNAL_STREAM"] {
        command.env_remove(name);
    }
    let output = command.output().expect("script runs");
    let text = String::from_utf8(output.stdout).expect("text");
    assert!(output.status.success(), "{text}");
    Some(text.replace('\r', ""))
}

const CONTROLLER: &str = "log.statistics = \"1s\"\nscan.watchdog = \"30s\"\n";

#[test]
fn a_terminal_gets_a_line_a_fact_in_local_time_with_the_code_at_the_end() {
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
fn the_level_is_a_colour_unless_none_is_wanted_and_a_named_form_stays() {
    let plant = Plant::new(BLINKS, &format!("{CONTROLLER}realtime.cpus = [1023]\n"));
    let Some(text) = on_terminal(&plant, "--scans 3", "") else { return };
    let warning = text.lines().find(|line| line.contains("\x1b[33mWARN ")).expect(&text);
    assert!(warning.contains("\x1b[33mreal-time posture: "), "{warning:?}");
    let Some(text) = on_terminal(&plant, "--scans 3 --log-format text", "1") else { return };
    assert!(text.contains("+05:45") || text.contains("Z  INFO RUNGD-0201 mode-run: "), "{text}");
    assert!(!text.contains('\x1b'), "{text:?}");
}
