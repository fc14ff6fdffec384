//! The real rungd records to a full disk, to a read-only disk, or to a path that is not a folder.
//! No scan is later than in a control run at the same time. The log reports the trouble once,
//! `status` shows it, and recording resumes by itself. A gap is reported and never bridged.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::record::live_rig::{
    BUSY, FAST, Operator, Watch, count, ended, failing, is_late, last_scan, logs, recorded_run,
    rounds, verified,
};
use rungd_history::record::Recording;
use rungd_test_support::disk_pace::DiskPace;
use rungd_test_support::needs::{Need, skip};
use rungd_test_support::running::live::{Live, folder};
use rungd_test_support::running::process::{message, mounted};
use rungd_test_support::system::shell;

/// A disk that delays a write for less than this time makes no controller report a stall.
const DISK_DELAY_LEAST: Duration = Duration::from_millis(500);

/// rungd with its folder on a tmpfs with these options, in its own mount namespace.
struct OnTmpfs {
    live: Live,
    /// The tmpfs's path in its namespace.
    inside: PathBuf,
}

impl OnTmpfs {
    fn start(options: &str) -> Option<OnTmpfs> {
        let home = folder(BUSY, FAST);
        let inside = home.join("disk");
        fs::create_dir(&inside).unwrap();
        let mount = format!("mount -t tmpfs -o {options} tmpfs {}", inside.display());
        let Some(prefix) = mounted(&format!("{mount} && exec \"$@\"")) else {
            fs::remove_dir_all(&home).unwrap();
            skip(Need::MountNamespace, "no mount namespace to be had");
            return None;
        };
        let plain = recorded_run(&home, &inside.join("log"));
        let mut command = Command::new(&prefix[0]);
        command.args(&prefix[1..]).arg(plain.get_program()).args(plain.get_args());
        for (name, value) in plain.get_envs() {
            match value {
                Some(value) => command.env(name, value),
                None => command.env_remove(name),
            };
        }
        command.stderr(Stdio::piped()).stdout(Stdio::null());
        Some(OnTmpfs { live: Live::of(home, command), inside })
    }

    /// The tmpfs's path from outside, while the process lives.
    fn seen(&self) -> PathBuf {
        PathBuf::from(format!("/proc/{}/root{}", self.live.child.id(), self.inside.display()))
    }

    /// Remounts the tmpfs; false if its namespace cannot be entered.
    fn remount(&self, options: &str) -> bool {
        let (pid, options) = (self.live.child.id().to_string(), format!("remount,{options}"));
        let inside = self.inside.to_str().unwrap();
        let again = |namespaces: &[&str]| {
            let enter = ["nsenter", "-t", &pid, "-m"];
            shell(&[&enter, namespaces, &["mount", "-o", &options, inside]].concat())
        };
        again(&[]) || again(&["-U", "--preserve-credentials"])
    }
}

impl OnTmpfs {
    fn goes_on(&mut self, operator: &mut Operator) -> Recording {
        let (seen, to) = (self.seen().join("log"), self.live.folder.join("copy"));
        goes_on(&mut self.live, operator, || copy(&seen, &to))
    }
}

/// Copies a folder, because a tmpfs disappears with its process.
fn copy(from: &Path, to: &Path) -> PathBuf {
    let _ = fs::remove_dir_all(to);
    fs::create_dir(to).unwrap();
    for log in logs(from) {
        fs::copy(&log, to.join(log.file_name().unwrap())).unwrap();
    }
    to.to_owned()
}

/// Waits until a disk works again and has the new scans, then ends the controller. The log must
/// have reported the failure and its end once. `copy` returns a folder with the disk's contents.
fn goes_on(live: &mut Live, operator: &mut Operator, copy: impl Fn() -> PathBuf) -> Recording {
    operator.await_status(|status| !failing(status));
    let wanted = operator.scans();
    let at_disk = |_: &Value| last_scan(&Recording::open(&copy()).unwrap()) >= wanted;
    operator.await_status(at_disk);
    let dir = copy();
    let recording = Recording::open(&dir).unwrap();
    let verified = verified(&dir, true);
    assert!(verified.scans < last_scan(&recording), "nothing is missing: {verified:?}");
    let lines = ended(live);
    assert_eq!(count(&lines, "record-resumed"), 1, "{lines:#?}");
    let told = count(&lines, "record-failed");
    assert!((1..=1 + repeats_max(&lines)).contains(&told), "{told} times: {lines:#?}");
    recording
}

/// How often a log may repeat that recording fails: once for each complete minute of the trouble, by
/// the log's own times. Usually never.
fn repeats_max(lines: &[Value]) -> usize {
    let second_of_day = |event: &str| {
        let line = lines.iter().find(|line| line["event"] == event).expect("a line of the event");
        // `YYYY-MM-DDThh:mm:ss.ssssssZ`
        let time = line["timestamp"].as_str().unwrap()[11..].trim_end_matches('Z');
        time.split(':').fold(0.0, |all, part| 60.0 * all + part.parse::<f64>().unwrap())
    };
    let trouble_s = second_of_day("record-resumed") - second_of_day("record-failed");
    (trouble_s.rem_euclid(86_400.0) / 60.0) as usize
}

/// A controller in trouble continues to scan, and reports the trouble.
fn scans_on(operator: &mut Operator) {
    let status = operator.await_status(failing);
    assert_eq!((&status["mode"], &status["record"]["lost"]), (&"RUN".into(), &0.into()));
    operator.await_scans(600);
}

#[test]
fn a_folder_that_cannot_be_made_is_reported_and_used_once_it_can_be_made() {
    rounds(|| {
        let home = folder(BUSY, FAST);
        // No user, not even root, can create a folder in a file.
        let (dir, file) = (home.join("log/deep"), home.join("log"));
        fs::write(&file, "a file").unwrap();
        let mut live = Live::of(home.clone(), recorded_run(&home, &dir));
        let mut operator = Operator::new(&live);
        let watch = Watch::begin(&mut operator);
        scans_on(&mut operator);
        let is_good = watch.end(&mut operator);
        assert_eq!(fs::read(&file).unwrap(), b"a file");
        fs::remove_file(&file).unwrap();
        let recording = goes_on(&mut live, &mut operator, || dir.clone());
        assert!(recording.head(0).number > 1);
        is_good
    });
}

#[test]
fn a_read_only_disk_delays_no_scan_and_is_used_once_it_is_writable() {
    rounds(|| {
        let Some(mut disk) = OnTmpfs::start("size=4m,ro") else { return true };
        let mut operator = Operator::new(&disk.live);
        let watch = Watch::begin(&mut operator);
        scans_on(&mut operator);
        let is_good = watch.end(&mut operator);
        if !disk.remount("rw") {
            skip(Need::MountNamespace, "no way into the mount namespace");
            return true;
        }
        let recording = disk.goes_on(&mut operator);
        assert!(recording.head(0).number > 1);
        is_good
    });
}

#[test]
fn a_full_disk_delays_no_scan_and_is_used_once_it_has_space() {
    rounds(|| {
        let Some(mut disk) = OnTmpfs::start("size=4m") else { return true };
        let mut operator = Operator::new(&disk.live);
        operator.await_status(|status| status["record"]["disk"]["bytes"].as_u64() > Some(0));
        let watch = Watch::begin(&mut operator);
        let fill = disk.seen().join("fill");
        let filled =
            File::create(&fill).and_then(|mut fill| io::copy(&mut io::repeat(1), &mut fill));
        assert!(filled.is_err(), "it has no end");
        scans_on(&mut operator);
        let is_good = watch.end(&mut operator);
        fs::remove_file(&fill).unwrap();
        let recording = disk.goes_on(&mut operator);
        let gaps = (1..recording.count()).filter(|at| !recording.follows(*at)).count();
        assert!(recording.head(0).number == 1 && gaps >= 1, "{gaps}");
        is_good
    });
}

#[test]
fn a_second_controller_of_the_same_name_records_once_the_first_has_ended() {
    let homes = [folder(BUSY, FAST), folder(BUSY, FAST)];
    let (dir, disk) = (homes[1].join("log"), DiskPace::start(&homes[1]));
    let [mut first, mut second] =
        homes.map(|home| Live::of(home.clone(), recorded_run(&home, &dir)));
    let mut operators = [Operator::new(&first), Operator::new(&second)];
    // Either controller may have been first.
    let has_file = |status: &Value| status["record"]["disk"]["bytes"].as_u64() > Some(0);
    operators[0].await_status(|status| has_file(status) || failing(status));
    if failing(&operators[0].status()) {
        (first, second) = (second, first);
        operators.reverse();
    }
    let status = operators[1].await_status(failing);
    let why = status["record"]["disk"]["failing"].as_str().unwrap();
    assert!(why.starts_with("another rungd records under the same name"), "{why}");
    assert_eq!((status["mode"].as_str(), logs(&dir).len()), (Some("RUN"), 1));
    // If other tests keep the disk busy, either controller also reports a stall.
    let refused = |lines: &[Value]| {
        let lines = lines.iter().filter(|line| line["event"] == "record-failed");
        lines.filter(|line| message(line).contains("another rungd records")).count()
    };
    let (scans, asked) = (operators[0].scans(), Instant::now());
    let of_first = ended(&mut first);
    assert_eq!(refused(&of_first), 0, "{of_first:#?}");
    assert!(last_scan(&Recording::open(&dir).unwrap()) >= scans || is_late(asked));
    operators[1].await_status(|status| !failing(status) && has_file(status));
    let lines = ended(&mut second);
    assert_eq!(refused(&lines), 1, "{lines:#?}");
    assert!(count(&lines, "record-resumed") >= 1, "{lines:#?}");
    if disk.slowest() < DISK_DELAY_LEAST {
        assert_eq!(count(&of_first, "record-failed"), 0, "{of_first:#?}");
        assert_eq!(count(&lines, "record-failed"), 1, "{lines:#?}");
        assert_eq!(count(&lines, "record-resumed"), 1, "{lines:#?}");
    }
    assert_eq!((logs(&dir).len(), verified(&dir, true).unreplayable), (2, 0));
}
