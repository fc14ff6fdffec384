//! The real binary is killed at random, and its disk is cut off, full, read-only or stalled. Every
//! restored image is one scan's, every image that was reported as durable is there, and no scan is
//! missed.
//!
//! The normal run makes a few of each. A thousand kills, a hundred cuts and a stall of 30 s:
//!
//! ```console
//! cargo test --release --test controller retain::crash -- --ignored --nocapture --test-threads 1
//! ```
//!
//! Cuts and stalls require root and a loop device. For a cut, an ext4 image is shut down without
//! writing its journal, unmounted, mounted again and checked. For a stall, it is frozen.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::retain::memory::{
    COUNTS, Held, KEEPS, PATIENCE, Plant, Running, file, find, held, mounted,
};
use crate::retain::memory::{Need, message, no_scan_missed, scans_are_accounted_for, skip, until};
use rungd_client::operator::client;
use rungd_client::operator::protocol::{ControllerStatus, Request};
use rungd_test_support::numbers::Numbers;
use rungd_test_support::system::shell;

const PERIOD: Duration = Duration::from_millis(2);

/// The controller's status; `None` if it does not answer (yet).
pub fn status(plant: &Plant) -> Option<ControllerStatus> {
    client::ask(&plant.0.join("op"), &Request::Status {}).ok()
}

/// Successive processes ("lives") on one file: each continues from the image of the process before.
struct Lives {
    numbers: Numbers,
    lives: u64,
    /// The most scans that the end of a process lost.
    lost_most: u64,
    scans: u64,
}

impl Lives {
    fn new() -> Lives {
        Lives { numbers: Numbers(1), lives: 0, lost_most: 0, scans: 0 }
    }

    /// Starts rungd, lets it run for a random time, ends it by `death`, and checks the file. A life
    /// beyond the wanted `count` is needed because none kept an image so far: it begins with one.
    fn one(&mut self, plant: &Plant, path: &Path, count: u64, death: impl FnOnce(&mut Running)) {
        let before = held(path);
        let mut running = Running::new(&mut plant.command(&[] as &[&str]));
        if self.lives >= count {
            until(|| held(path).is_some_and(|held| held.count > 0));
        }
        std::thread::sleep(Duration::from_millis(self.numbers.below(200)));
        let told = status(plant);
        death(&mut running);
        let after = held(path);
        self.lives += 1;
        let order = |held: Option<Held>| held.map_or(0, |held| held.sequence);
        assert!(order(after) >= order(before), "{before:?} {after:?}");
        let counts = (before.map_or(0, |held| held.count), after.map_or(0, |held| held.count));
        assert!(counts.1 >= counts.0, "{before:?} {after:?}");
        let Some(retain) = told.as_ref().and_then(|told| told.retain.as_ref()) else { return };
        if let Some(image) = retain.image {
            assert!(order(after) >= image, "image {image} was durable: {after:?}");
        }
        let done = told.as_ref().map_or(0, |told| told.scans);
        let lived = counts.0 as u64 + done;
        self.lost_most = self.lost_most.max(lived.saturating_sub(counts.1 as u64));
        self.scans += done;
    }

    /// Whether more lives are needed: at least `count`, and until one of them has kept an image. On
    /// a busy machine a life may end before its first image; the life after the last wanted one
    /// waits for it.
    fn are_to_go_on(&self, count: u64, path: &Path) -> bool {
        let has_kept = held(path).is_some_and(|held| held.count > 0);
        assert!(has_kept || self.lives <= count, "no life keeps anything");
        self.lives < count || !has_kept
    }

    fn told(&self, what: &str, begin: Instant) {
        println!(
            "{what}: {} lives, {} scans, nothing wrong restored; at most {} ms lost, interval 20 \
             ms; {:.0} s",
            self.lives,
            self.scans,
            self.lost_most * 2,
            begin.elapsed().as_secs_f64()
        );
    }
}

fn kills(count: u64) {
    let (plant, mut lives, begin) = (Plant::new(COUNTS, KEEPS), Lives::new(), Instant::now());
    while lives.are_to_go_on(count, &file(&plant)) {
        lives.one(&plant, &file(&plant), count, |running| {
            running.child.kill().unwrap();
            running.end();
        });
    }
    lives.told("killed", begin);
}

/// An ext4 image, mounted while this lives.
struct Disk {
    image: PathBuf,
    at: PathBuf,
}

impl Disk {
    fn new(plant: &Plant) -> Option<Disk> {
        let disk = Disk { image: plant.0.join("image"), at: plant.0.join("disk") };
        fs::create_dir(&disk.at).unwrap();
        File::create(&disk.image).unwrap().set_len(32 << 20).unwrap();
        let image = disk.image.as_os_str();
        let made = shell(&["mkfs.ext4".as_ref(), "-q".as_ref(), image]);
        (made && disk.mount()).then_some(disk)
    }

    fn mount(&self) -> bool {
        let (image, at) = (self.image.as_os_str(), self.at.as_os_str());
        shell(&["mount".as_ref(), "-o".as_ref(), "loop".as_ref(), image, at])
    }

    fn unmount(&self) -> bool {
        shell(&["umount".as_ref(), self.at.as_os_str()])
    }

    /// The power fails: nothing more is written to the disk.
    fn cut(&self) {
        const SHUTDOWN: libc::c_ulong = 0x8004_587D;
        const WITHOUT_LOG_FLUSH: u32 = 2;
        let root = File::open(&self.at).unwrap();
        // SAFETY: the call reads a number that outlives the call.
        let done = unsafe { libc::ioctl(root.as_raw_fd(), SHUTDOWN as _, &WITHOUT_LOG_FLUSH) };
        assert_eq!(done, 0, "{}", std::io::Error::last_os_error());
    }

    /// Mounts the file system again with its contents on the disk. A different test's mount
    /// namespace may hold it for a while: meanwhile a mount finds it still shut down, and nothing
    /// can be written. A process of a different test may hold its root open: meanwhile it cannot be
    /// unmounted.
    fn mount_anew(&self) {
        let (probe, mut is_mounted) = (self.at.join("probe"), true);
        until(|| {
            is_mounted = is_mounted && !self.unmount();
            if !is_mounted {
                is_mounted = self.mount();
            }
            is_mounted && File::create(&probe).and_then(|_| fs::remove_file(&probe)).is_ok()
        });
    }

    fn freeze(&self, on: bool) {
        let word = if on { "--freeze" } else { "--unfreeze" };
        assert!(shell(&["fsfreeze".as_ref(), word.as_ref(), self.at.as_os_str()]));
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = shell(&["fsfreeze".as_ref(), "--unfreeze".as_ref(), self.at.as_os_str()]);
        let since = Instant::now();
        while !self.unmount() && since.elapsed() < Duration::from_secs(5) {
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

fn on_disk() -> (Plant, PathBuf) {
    // A long watchdog, because a busy machine or a test may delay the controller.
    let keeps = format!("scan.watchdog = \"30s\"\n{KEEPS}");
    let plant = Plant::new(COUNTS, &keeps.replace("\"memory\"", "\"disk/memory\""));
    let path = plant.0.join("disk/memory");
    (plant, path)
}

fn cuts(count: u64) {
    let (plant, path) = on_disk();
    let Some(disk) = Disk::new(&plant) else {
        return skip(Need::Ext4, "no ext4 on a loop device to be had");
    };
    let (mut lives, begin) = (Lives::new(), Instant::now());
    while lives.are_to_go_on(count, &path) {
        lives.one(&plant, &path, count, |running| {
            disk.cut();
            running.child.kill().unwrap();
            running.end();
            disk.mount_anew();
        });
    }
    lives.told("power cut", begin);
}

/// A controller with its own disk.
struct OnDisk {
    running: Running,
    disk: Disk,
    plant: Plant,
    path: PathBuf,
}

impl OnDisk {
    fn new() -> Option<OnDisk> {
        let (plant, path) = on_disk();
        let disk = Disk::new(&plant)?;
        let running = Running::new(&mut plant.command(&[] as &[&str]));
        running.line("RUN");
        Some(OnDisk { running, disk, plant, path })
    }

    /// Stops the controller; returns the statistics of its scans.
    fn scans(mut self, what: &str, time: Duration) -> Scans {
        let lines = self.running.stop();
        scans_are_accounted_for(&lines, PERIOD, time);
        assert!(held(&self.path).unwrap().is_final);
        let whole = find(&lines, "scan statistics of the whole run");
        println!("{what}: {whole}");
        let number = |field: &str| whole[field].as_f64().unwrap();
        Scans {
            done: number("scans"),
            lost: number("skipped"),
            late: number("overruns"),
            late_us: number("late_us_p99"),
        }
    }
}

/// The statistics of a run's scans.
struct Scans {
    done: f64,
    lost: f64,
    late: f64,
    late_us: f64,
}

impl Scans {
    /// Whether these scans are as good as other scans of the same time on the same machine, with
    /// room for chance.
    fn are_as_good_as(&self, others: &Scans) -> bool {
        let some = self.done / 100.0;
        self.lost <= 2.0 * others.lost + some
            && self.late <= 2.0 * others.late + some
            && self.late_us <= 2.0 * others.late_us + PERIOD.as_micros() as f64 / 2.0
    }
}

/// The most rounds of a judgement. The machine's noise makes either run worse, as often the one as
/// the other; a stall makes the same run worse every time. With six busy loops on two processors,
/// the stalled run is worse in 5 of 32 rounds, and in 4 of 32 without a stall.
const ROUNDS: i32 = 21;

/// The lead that ends a judgement as good. A round in which the control is the worse one counts
/// twice: it shows noise, which makes the troubled run worse as often.
const GOOD_LEAD: i32 = 3;

/// The lead of the rounds with a worse run that ends a judgement. If noise makes every fourth round
/// worse for each of the two runs, it causes this lead once in 1,300 judgements.
const WORSE_LEAD: i32 = 6;

/// Runs two controllers at once, each with its own disk. For a time, `happens` troubles one of
/// them. Returns the scans of the troubled one and of the other one, its control. The start of the
/// second controller disturbs the first, so the round decides which one is troubled.
fn with_control(round: i32, time: Duration, happens: impl Fn(&OnDisk, bool)) -> Option<[Scans; 2]> {
    let (first, second) = (OnDisk::new()?, OnDisk::new()?);
    let (troubled, control) = if round % 2 == 1 { (second, first) } else { (first, second) };
    std::thread::sleep(Duration::from_millis(200));
    happens(&troubled, true);
    // It answers while it happens, and scans: the machine may delay both.
    let answer = || {
        let mut answer = None;
        until(|| {
            answer = status(&troubled.plant);
            answer.is_some()
        });
        answer.expect("an answer")
    };
    let begin = answer();
    std::thread::sleep(time);
    until(|| answer().scans > begin.scans);
    assert_eq!(answer().mode, "RUN");
    happens(&troubled, false);
    let troubled = troubled.scans(&format!("for {time:?}"), time);
    Some([troubled, control.scans("its control", time)])
}

/// Whether the troubled controller is as good as its control in most rounds, so that the machine's
/// load does not matter. `None` without disks.
fn is_as_good_as_its_control(time: Duration, happens: impl Fn(&OnDisk, bool)) -> Option<bool> {
    let mut lead = 0;
    for round in 1..=ROUNDS {
        let [troubled, control] = with_control(round, time, &happens)?;
        let is_as_good = troubled.are_as_good_as(&control);
        let is_noise = !control.are_as_good_as(&troubled);
        lead += match (is_as_good, is_noise) {
            (true, true) => 2,
            (true, false) => 1,
            (false, _) => -1,
        };
        println!("round {round}: as good: {is_as_good}, lead of the good rounds: {lead}");
        if lead >= GOOD_LEAD || lead <= -WORSE_LEAD {
            break;
        }
    }
    Some(lead > 0)
}

/// Checks that the scans of a controller with a stalled disk are as good as its control's.
fn stall(time: Duration) {
    let stalls = |on: &OnDisk, begins: bool| on.disk.freeze(begins);
    match is_as_good_as_its_control(time, stalls) {
        Some(is_as_good) => assert!(is_as_good, "the stalled one was worse in most rounds"),
        None => skip(Need::Ext4, "no ext4 on a loop device to be had"),
    }
}

#[test]
fn the_control_measurement_shows_a_paused_controller() {
    // Each delay is longer, because a busy machine delays the control too.
    for hold in [100, 600, 3_600, 21_600].map(Duration::from_millis) {
        let held_up = |on: &OnDisk, begins: bool| {
            if begins {
                on.running.signal("STOP");
                std::thread::sleep(hold);
                on.running.signal("CONT");
            }
        };
        match is_as_good_as_its_control(Duration::from_millis(400), held_up) {
            Some(true) => {}
            Some(false) => return,
            None => return skip(Need::Ext4, "no ext4 on a loop device to be had"),
        }
    }
    panic!("a controller was held up again and again, and nobody saw it");
}

#[test]
fn retained_memory_survives_random_kills() {
    kills(12);
}

#[test]
fn retained_memory_survives_random_power_cuts() {
    cuts(6);
}

#[test]
fn a_stalled_disk_delays_no_scan() {
    stall(Duration::from_millis(800));
}

#[test]
#[ignore = "some minutes"]
fn retained_memory_survives_a_thousand_kills() {
    kills(1000);
}

#[test]
#[ignore = "half a minute"]
fn retained_memory_survives_a_hundred_power_cuts() {
    cuts(100);
}

#[test]
#[ignore = "some minutes"]
fn a_disk_stall_of_30_seconds_delays_no_scan() {
    stall(Duration::from_secs(30));
}

/// rungd with its file on a tmpfs of a given size, in its own mount namespace.
fn on_tmpfs(size: &str, before: &str) -> Option<(Plant, Running, PathBuf)> {
    let (plant, _) = on_disk();
    let at = plant.0.join("disk");
    fs::create_dir(&at).unwrap();
    let shown = at.display();
    let shell = format!("mount -t tmpfs -o size={size} tmpfs {shown} && {before} exec \"$@\"");
    let prefix = mounted(&shell)?;
    let running = Running::new(&mut plant.command(&prefix));
    let seen = PathBuf::from(format!("/proc/{}/root{shown}", running.pid()));
    Some((plant, running, seen))
}

#[test]
fn a_full_disk_delays_no_scan_and_is_used_once_it_has_space() {
    let Some((_plant, mut running, seen)) = on_tmpfs("40k", "") else {
        return skip(Need::MountNamespace, "no mount namespace to be had");
    };
    assert_eq!(running.line("cannot be written")["event"], "retain-failed");
    running.line("RUN");
    std::thread::sleep(Duration::from_millis(300));
    let inside = seen.to_string_lossy().split_once("/root").unwrap().1.to_owned();
    let pid = running.pid();
    let remount = |namespaces: &[&str]| {
        let command = ["mount", "-o", "remount,size=1m", &inside];
        let mut words = vec!["nsenter", "-t", &pid, "-m"];
        words.extend(namespaces);
        words.extend(command);
        shell(&words.iter().map(|word| word.as_ref()).collect::<Vec<&OsStr>>())
    };
    if !remount(&[]) && !remount(&["-U", "--preserve-credentials"]) {
        return skip(Need::MountNamespace, "no way into the mount namespace");
    }
    assert_eq!(running.line("is written again")["event"], "retain-recovered");
    // The file has its full size by now, so a full disk takes nothing from it.
    let fill = File::create(seen.join("fill"))
        .and_then(|mut fill| std::io::copy(&mut std::io::repeat(1), &mut fill));
    assert!(fill.is_err(), "the disk is full");
    let full = held(&seen.join("memory")).unwrap();
    let since = Instant::now();
    while held(&seen.join("memory")).unwrap().sequence < full.sequence + 3 {
        assert!(since.elapsed() < PATIENCE, "it is kept on a full disk too");
        std::thread::sleep(Duration::from_millis(10));
    }
    let lines = running.stop();
    no_scan_missed(&lines, PERIOD, Duration::from_millis(300));
    assert!(lines.iter().any(|line| line["event"] == "retain-final"), "{lines:#?}");
}

#[test]
fn a_read_only_disk_restores_its_image_and_delays_no_scan() {
    let (plant, _) = on_disk();
    fs::create_dir(plant.0.join("disk")).unwrap();
    let mut command = plant.command(&[] as &[&str]);
    let mut first = Running::new(command.args(["--scans", "40"]));
    assert_eq!((first.rest().is_empty(), first.end().code()), (false, Some(0)));
    let shown = plant.0.join("disk").display().to_string();
    let shell =
        format!("mount --bind {shown} {shown} && mount -o remount,bind,ro {shown} && exec \"$@\"");
    let Some(prefix) = mounted(&shell) else {
        return skip(Need::MountNamespace, "no mount namespace to be had");
    };
    let mut running = Running::new(&mut plant.command(&prefix));
    assert_eq!(running.line("cannot be written")["event"], "retain-failed");
    assert_eq!(running.line("restored: image")["restored"], 4001);
    running.line("RUN");
    std::thread::sleep(Duration::from_millis(300));
    let (lines, code) = running.stop_with_code();
    no_scan_missed(&lines, PERIOD, Duration::from_millis(300));
    assert_eq!(code, Some(74), "the last image is lost");
    let lost = lines.iter().find(|line| line["event"] == "retain-lost").unwrap();
    assert!(message(lost).contains("The next start restores the image before it"), "{lost}");
    assert_eq!(held(&plant.0.join("disk/memory")).unwrap().count, 40);
}
