//! Files and folders that somebody removes under the running rungd: it notices it, says it, and
//! goes on in a new file, which has everything from then on.

use std::fs;
use std::path::Path;

use serde_json::json;

use crate::record::live_rig::{
    BUSY, Operator, ended, is_late, last_scan, logs, recorded, verified,
};
use rungd_history::record::Recording;
use rungd_test_support::running::process::until;

/// Takes something away under a running controller, twice, and ends it in order.
#[track_caller]
fn goes_on_without(takes_away: impl Fn(&Path)) {
    let (mut live, dir) = recorded(BUSY, "");
    let mut operator = Operator::new(&live);
    for _ in 0..2 {
        until(|| logs(&dir).iter().any(|path| fs::metadata(path).is_ok_and(|of| of.len() > 0)));
        let before = logs(&dir);
        takes_away(&dir);
        let told = live.line("was removed, renamed or replaced");
        assert_eq!((&told["event"], &told["level"]), (&json!("record-file-gone"), &json!("WARN")));
        let name = before.last().unwrap().file_name().unwrap();
        assert_eq!(told["file"], name.to_str().unwrap(), "{told}");
        until(|| logs(&dir).last().is_some_and(|newest| !before.contains(newest)));
    }
    let scans = operator.scans();
    let asked = std::time::Instant::now();
    let lines = ended(&mut live);
    let is_late = is_late(asked);
    let failed: Vec<_> = lines.iter().filter(|line| line["event"] == "record-failed").collect();
    assert!(is_late || failed.is_empty(), "{failed:#?}");
    verified(&dir, true);
    assert!(is_late || last_scan(&Recording::open(&dir).unwrap()) >= scans);
}

#[test]
fn recording_continues_in_a_new_file_after_its_file_is_removed() {
    goes_on_without(|dir| logs(dir).iter().for_each(|path| fs::remove_file(path).unwrap()));
}

#[test]
fn recording_continues_in_a_new_file_after_its_folder_is_removed() {
    goes_on_without(|dir| fs::remove_dir_all(dir).unwrap());
}

#[test]
fn recording_continues_in_a_new_file_after_its_folder_is_renamed() {
    goes_on_without(|dir| {
        let aside = (0..).map(|at| dir.with_extension(at.to_string())).find(|path| !path.exists());
        fs::rename(dir, aside.unwrap()).unwrap();
    });
}
