//! One run: starts rungd and the watcher, causes the end, and collects the changes of the outputs.

use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::watcher::{Change, Watcher};
use super::ways::{Fate, Way};
use rungd_test_support::running::process::{PATIENCE, Plant, Running};

/// The watchdog of the second device.
const DEVICE_WATCHDOG_MS: u32 = 600;
/// The least time in RUN before the cause.
const SETTLED: Duration = Duration::from_millis(200);
/// The time that is recorded after the cause. Everything that must happen takes less time.
const AFTER: Duration = Duration::from_millis(1000);
/// The same after a scan that takes a second.
const AFTER_STALL: Duration = Duration::from_millis(1300);
/// The time that is recorded after the outputs are as in RUN again.
const AFTER_RETURN: Duration = Duration::from_millis(100);
/// The scans of [`Way::LastScan`].
const SCANS: &str = "150";

/// The values of coils 0 to 2 and holding register 0 in RUN.
pub const IN_RUN: [u64; 4] = [1, 0, 1, 1234];
/// Their values outside RUN, if the held coil was ON.
pub const SAFE: [u64; 4] = [0, 1, 1, 17];
/// The outputs of each device that the tests compare.
const POINTS: [(&str, u64); 4] = [("coil", 0), ("coil", 1), ("coil", 2), ("holding", 0)];
/// The register of the first device that receives the number of scans.
const BEAT: (&str, u64) = ("holding", 1);
/// The coils of the second device that show `.Ok` and `.Stale` of the first.
const SHOWN: [(&str, u64); 2] = [("coil", 8), ("coil", 9)];

/// The event of a lost device in the log, and the reason that a busy machine gives it.
const DEVICE_LOST: &str = "\"device-lost\"";
const NO_ANSWER: &str = "no answer in";

/// The device that always answers, in the log.
const GUARDED: &str = "\"device\":\"guarded\"";

/// The event of a FAULT in the log.
const FAULT: &str = "\"mode-fault\"";

const LADDER: &str = r#"
[[program]]
name = "Main"
rung = [
  { when = ["$On"], do = ["OUT Y0", "SET Y2", "OUT Y10", "SET Y12"] },
  { when = ["$On"], do = ["MOVE 1234 to=D0", "MOVE 1234 to=D2"] },
  { when = ["$Off"], do = ["OUT Y1", "OUT Y11"] },
  { when = ["X0"], do = ["STOP"] },
]
"#;

/// The four outputs of a device.
#[derive(Debug)]
pub struct Outputs(pub [Vec<Change>; 4]);

/// The records of one run.
pub struct Story {
    /// The outputs of the device without a watchdog, then of the device with a watchdog.
    pub outputs: [Outputs; 2],
    /// The time of the last recorded scan, in ms since the cause; negative: before it.
    pub live_ms: f64,
    /// The values of the first device's `.Ok`, as the second device received them.
    pub ok: Vec<u64>,
    /// The same of `.Stale`.
    pub stale: Vec<u64>,
    /// The exit code, if rungd ended by itself.
    pub code: Option<i32>,
    /// Counted from the end of the cause or from a new start: the time in ms until each device had
    /// its values of RUN again, and the changes of the first device's outputs until then.
    pub back: Option<([f64; 2], Vec<Change>)>,
    /// The outputs of the first device after that.
    pub last: [Option<u64>; 4],
    pub log: Vec<String>,
    /// Whether SIGSTOP came within a scan, so that rungd was in FAULT after SIGCONT.
    pub faulted: bool,
}

impl Outputs {
    fn of(changes: &[Change]) -> Outputs {
        Outputs(POINTS.map(|(bank, address)| of(changes, bank, address)))
    }

    /// Whether the device's watchdog fired before the end: the machine delayed rungd for longer
    /// than the watchdog allows, and may do so again after the end.
    fn dropped_before(&self) -> bool {
        self.0.iter().flatten().any(|change| change.by_watchdog && change.ms < 0.0)
    }

    /// Whether the device's watchdog fired at any time.
    fn was_dropped(&self) -> bool {
        self.0.iter().flatten().any(|change| change.by_watchdog)
    }

    pub fn values(&self) -> [Vec<u64>; 4] {
        [0, 1, 2, 3].map(|at| self.0[at].iter().map(|change| change.value).collect())
    }
}

/// The changes of a point of the device.
fn of(changes: &[Change], bank: &str, address: u64) -> Vec<Change> {
    let own = |change: &&Change| change.point.0 == bank && change.point.1 == address;
    changes.iter().filter(own).cloned().collect()
}

impl Story {
    /// Whether the machine was too busy for this run. There are three cases: the device's watchdog
    /// fired although rungd continued its exchanges, it did not fire although rungd was stopped, or
    /// a device that was there did not answer in time. (A stopped rungd misses answers in any
    /// case.)
    pub fn was_held_up(&self, way: Way) -> bool {
        let is_late = |line: &String| {
            let is_there = way == Way::PanicInDriver && line.contains(DEVICE_LOST);
            line.contains(NO_ANSWER) && (is_there || line.contains(GUARDED))
        };
        let late = way != Way::Stand && self.log.iter().any(is_late);
        let dropped = self.outputs.iter().any(Outputs::was_dropped);
        let misjudged = match way.fate() {
            Fate::Safe | Fate::InRun => dropped,
            Fate::AsTheyWere => way == Way::Stand && !dropped,
            Fate::SafeThenGone(_) => false,
        };
        late || misjudged || self.outputs.iter().any(Outputs::dropped_before)
    }
}

impl Way {
    /// Whether the test starts rungd again afterwards.
    fn starts_again(self) -> bool {
        matches!(self, Way::Kill | Way::Segment | Way::PanicInMonitor | Way::PanicInShell)
    }

    /// Whether the outputs must return to their values of RUN.
    pub fn comes_back(self) -> bool {
        self.starts_again() || self.loses_one() || self == Way::Stand
    }

    /// Whether only the connection to the first device is lost.
    pub fn loses_one(self) -> bool {
        matches!(self, Way::Silent | Way::Cut)
    }
}

/// The folder, the file of faults and the socket of one run.
struct Stage {
    plant: Plant,
    faults: String,
}

impl Stage {
    fn new(ports: &[u64]) -> Stage {
        let plant = Plant::new(LADDER, &controller(ports));
        let faults = plant.0.join("faults").display().to_string();
        Stage { plant, faults }
    }

    fn start(&self, way: Way) -> Running {
        let mut command = self.plant.command::<&str>(&[]);
        command.env("RUNGD_FAULTS", &self.faults);
        command.env("RUNGD_SOCKET", self.plant.0.join("socket"));
        if way == Way::LastScan {
            command.args(["--scans", SCANS]);
        }
        Running::new(&mut command)
    }
}

fn controller(ports: &[u64]) -> String {
    let device = |name: &str, port: u64, rest: &str| {
        format!(
            "[[device]]\nname = \"{name}\"\ndriver = \"modbus-tcp\"\n\
             address = \"127.0.0.1:{port}\"\npoll = \"20ms\"\ntimeout = \"200ms\"\n\
             loss-after = \"300ms\"\n{rest}\n"
        )
    };
    let plain = "map = [\n  { from = \"discrete 0\", to = \"X0\" },\n  \
         { from = \"Y0..Y2\", to = \"coil 0..2\" },\n  \
         { from = \"D0\", to = \"holding 0\", safe = 17 },\n  \
         { from = \"$ScanCounter\", to = \"holding 1\", hold = true },\n]";
    // After the device's watchdog has switched outputs OFF, rungd writes them again, although no
    // scan changes them and `write-every` is off.
    let guarded = "write-every = \"0ms\"\n\
         watchdog = { register = 100, every = \"100ms\" }\nmap = [\n  \
         { from = \"Y10..Y12\", to = \"coil 0..2\" },\n  \
         { from = \"D2\", to = \"holding 0\", safe = 17 },\n  \
         { from = \"plain.Ok\", to = \"coil 8\", hold = true },\n  \
         { from = \"plain.Stale\", to = \"coil 9\", hold = true },\n]";
    let outputs = "outputs = { on = [\"Y1\", \"Y11\"], hold = [\"Y2\", \"Y12\"] }\n";
    let (plain, guarded) = (device("plain", ports[0], plain), device("guarded", ports[1], guarded));
    // A long watchdog: a busy machine must not cause a FAULT.
    format!("scan.watchdog = \"500ms\"\n{outputs}{plain}{guarded}")
}

/// Runs a way once.
pub fn play(way: Way) -> Story {
    let mut watcher = Watcher::start(DEVICE_WATCHDOG_MS);
    let stage = Stage::new(&watcher.ports.clone());
    let mut rungd = stage.start(way);
    let deadline = Instant::now() + PATIENCE;
    while !wait_for_run(&mut watcher) {
        assert!(Instant::now() < deadline, "outputs stay safe");
    }
    sleep(SETTLED);
    let _ = [0, 1].map(|device| watcher.seen(device, 0));
    let cause_us = cause(way, &mut watcher, &stage, &mut rungd);
    sleep(if way == Way::Watchdog { AFTER_STALL } else { AFTER });
    let code = rungd.child.try_wait().unwrap().and_then(|status| status.code());
    let plain = watcher.seen(0, cause_us);
    let guarded = watcher.seen(1, cause_us);
    let (back, last, seen) = come_back(way, &mut watcher, &stage, &mut rungd);
    let shown = |(bank, address)| {
        let all = [of(&guarded, bank, address), of(&seen, bank, address)].concat();
        all.iter().filter(|change| !change.by_watchdog).map(|change| change.value).collect()
    };
    let _ = rungd.child.kill();
    let log: Vec<String> = rungd.rest().iter().map(ToString::to_string).collect();
    let mut story = Story {
        outputs: [Outputs::of(&plain), Outputs::of(&guarded)],
        live_ms: last_live(&plain),
        ok: shown(SHOWN[0]),
        stale: shown(SHOWN[1]),
        code,
        last,
        faulted: back.is_none() && way == Way::Stand && log.iter().any(|l| l.contains(FAULT)),
        back,
        log,
    };
    if way == Way::LastScan {
        story.count_from_the_last_scan();
    }
    story
}

/// The time between the cause and the first device's return: well within the two seconds for which
/// rungd tries to reach it.
const AWAY: Duration = Duration::from_millis(700);
/// If the device returned later than this, the run proves nothing: the machine was busy.
const AWAY_US_MAX: u64 = 1_200_000;

/// The records of an end during which the first device could not be reached.
pub struct Away {
    pub outputs: [u64; 4],
    pub code: Option<i32>,
    pub log: Vec<String>,
}

/// Runs a way while the first device cannot be reached, as if a network switch restarted. With
/// `is_back` the device returns soon, otherwise never. `None` if this machine was too slow.
pub fn play_away(way: Way, is_back: bool) -> Option<Away> {
    let mut watcher = Watcher::start(DEVICE_WATCHDOG_MS);
    let stage = Stage::new(&watcher.ports.clone());
    let mut rungd = stage.start(way);
    assert!(wait_for_run(&mut watcher));
    watcher.tell("cut 0");
    let cause_us = cause(way, &mut watcher, &stage, &mut rungd);
    let mut back_us = cause_us;
    if is_back {
        sleep(AWAY);
        back_us = watcher.tell("mend 0");
    }
    let code = rungd.end().code();
    if !is_back {
        watcher.tell("mend 0");
    }
    let log = rungd.rest().iter().map(ToString::to_string).collect();
    let in_time = back_us - cause_us < AWAY_US_MAX;
    in_time.then(|| Away { outputs: in_run(&mut watcher, 0), code, log })
}

/// The time of the last scan that was recorded before the outputs changed.
fn last_live(plain: &[Change]) -> f64 {
    let judged = |change: &&Change| POINTS.iter().any(|(b, a)| change.point == (b.to_string(), *a));
    let over_ms = plain.iter().find(judged).map_or(f64::INFINITY, |change| change.ms - 0.5);
    let beats = of(plain, BEAT.0, BEAT.1);
    beats.iter().rev().find(|beat| beat.ms < over_ms).map_or(0.0, |beat| beat.ms)
}

impl Story {
    /// Makes the times relative to the last scan in RUN: this end has no cause from outside.
    fn count_from_the_last_scan(&mut self) {
        let live_ms = std::mem::take(&mut self.live_ms);
        let changes = self.outputs.iter_mut().flat_map(|outputs| &mut outputs.0).flatten();
        changes.for_each(|change| change.ms -= live_ms);
    }
}

/// Causes the end; returns the time of the cause by the watcher's clock, in us.
fn cause(way: Way, watcher: &mut Watcher, stage: &Stage, rungd: &mut Running) -> u64 {
    let mut at = way.cause(watcher, rungd.child.id(), &stage.faults);
    match way {
        Way::Operator => {
            let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
            command.args(["mode", "stop"]).env("RUNGD_SOCKET", stage.plant.0.join("socket"));
            assert!(command.output().unwrap().status.success());
        }
        // Two signals at the same time count as one.
        Way::Segment => {
            while rungd.child.try_wait().unwrap().is_none() {
                at = way.cause(watcher, rungd.child.id(), &stage.faults);
                sleep(Duration::from_millis(1));
            }
        }
        Way::LastScan => assert_eq!(rungd.end().code(), Some(0)),
        _ => {}
    }
    at
}

type Back = (Option<([f64; 2], Vec<Change>)>, [Option<u64>; 4], Vec<Change>);

/// Ends the cause or starts a new process, and waits for RUN. Also returns the changes at the
/// second device meanwhile.
fn come_back(way: Way, watcher: &mut Watcher, stage: &Stage, rungd: &mut Running) -> Back {
    if !way.comes_back() {
        return (None, [None; 4], Vec::new());
    }
    let since_us = match way.return_of(watcher, rungd.child.id()) {
        Some(since_us) => since_us,
        None => {
            let since_us = watcher.tell("mark");
            let _ = rungd.child.wait();
            *rungd = stage.start(way);
            since_us
        }
    };
    let is_in_run = wait_for_run(watcher);
    if way == Way::Stand && !is_in_run {
        // SIGSTOP came within a scan, which therefore was longer than the watchdog.
        return (None, [None; 4], watcher.seen(1, since_us));
    }
    sleep(AFTER_RETURN);
    let last = in_run(watcher, 0).map(Some);
    let (plain, guarded) = (watcher.seen(0, since_us), watcher.seen(1, since_us));
    let beat_ms = of(&plain, BEAT.0, BEAT.1).first().map_or(f64::NAN, |beat| beat.ms);
    let is_output =
        |change: &&Change| POINTS.iter().any(|(b, a)| change.point == (b.to_string(), *a));
    let last_ms = |changes: &[Change]| changes.iter().rfind(is_output).map(|change| change.ms);
    let times = [last_ms(&plain).unwrap_or(beat_ms), last_ms(&guarded).unwrap_or(0.0)];
    let way_there = plain.iter().filter(is_output).cloned().collect();
    (Some((times, way_there)), last, guarded)
}

fn in_run(watcher: &mut Watcher, device: usize) -> [u64; 4] {
    let coils = watcher.values(device, "coil", 0, 3);
    let word = watcher.values(device, "holding", 0, 1);
    [coils[0], coils[1], coils[2], word[0]]
}

/// Waits until both devices have their values of RUN and the number of scans grows. Returns false
/// if both have their safe values instead.
fn wait_for_run(watcher: &mut Watcher) -> bool {
    let deadline = Instant::now() + PATIENCE;
    let beat = |watcher: &mut Watcher| watcher.values(0, BEAT.0, BEAT.1 as u16, 1)[0];
    let before = beat(watcher);
    loop {
        let both = [0, 1].map(|device| in_run(watcher, device));
        if both == [IN_RUN; 2] && beat(watcher) != before {
            return true;
        }
        // The held output of the second device, which its watchdog switched OFF, is ON again too.
        if both == [SAFE; 2] {
            return false;
        }
        assert!(Instant::now() < deadline, "no RUN: {both:?}");
        sleep(Duration::from_millis(5));
    }
}
