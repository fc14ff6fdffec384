//! A recording that rungd 0.2.0 made: its memory has fewer status words, and every hash is equal.

use std::process::Command;

/// 400 scans of 10 ms of a ladder with an edge, a counter, a MATH and two Stages.
const RECORDING: &str = "tests/record/by-0.2.rungd-log";

fn rungd(arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let output = command.args(arguments).output().unwrap();
    let [out, err] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(output.status.success(), "{arguments:?}: {out}{err}");
    out + &err
}

#[test]
fn a_recording_of_rungd_0_2_is_executed_again_with_the_same_hashes() {
    let said = rungd(&["record", "verify", RECORDING]);
    assert!(said.contains("400 scans in 5 sections were executed again: all 5 hashes"), "{said}");
}

#[test]
fn a_value_in_a_recording_of_rungd_0_2_has_its_reason() {
    let said = rungd(&["why", "Batch.Fill", "--recording", RECORDING, "--at", "scan 350"]);
    assert!(said.contains("JMP"), "{said}");
    let said = rungd(&["why", "$DownSeconds", "--recording", RECORDING, "--at", "scan 350"]);
    assert!(said.contains("$DownSeconds is 0"), "{said}");
}
