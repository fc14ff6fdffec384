//! An orderly end of the real rungd: every complete scan is in the recording, or the log reports
//! what is missing, however busy the machine is.

use std::thread;

use crate::record::live_rig::{BUSY, last_scan, recorded_run, verified};
use rungd_history::record::Recording;
use rungd_test_support::calm::calm;
use rungd_test_support::running::live::{folder, said};

/// Runs so many processes at once that they delay each other; each has a different number of scans.
#[test]
fn a_recording_with_an_orderly_end_contains_every_scan() {
    let home = folder(BUSY, "");
    // No socket, because only one of the processes could have it.
    let controller = "ladder = [\"ladder.toml\"]\nscan.period = \"1ms\"\n";
    std::fs::write(home.join("controller.toml"), calm(controller)).unwrap();
    thread::scope(|scope| {
        for lane in 0..8_u64 {
            let home = &home;
            scope.spawn(move || {
                for turn in 0..4 {
                    let scans = 990 + 13 * turn + lane;
                    let dir = home.join(format!("log-{lane}-{turn}"));
                    let mut command = recorded_run(home, &dir);
                    let said = said(command.args(["--scans", &scans.to_string()]));
                    assert_eq!(said.code, 0, "{said:?}");
                    // At its end rungd waits only seconds for its threads and the disk.
                    let told = ["record-lost", "record-failed"];
                    let is_told = told.iter().any(|event| said.err.contains(event));
                    let verified = verified(&dir, false);
                    let last = last_scan(&Recording::open(&dir).unwrap());
                    let is_whole = verified.gaps > 0 || verified.scans == scans;
                    assert!(
                        is_told || is_whole && last == scans,
                        "of {scans}: {last}, {verified:?}, {}",
                        said.err
                    );
                }
            });
        }
    });
    std::fs::remove_dir_all(&home).unwrap();
}
