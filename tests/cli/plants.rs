//! Each controller file of `config/` with its own simulated device, in virtual time: the plant
//! fulfils its purpose.
//!
//! The plant moves every millisecond, so every time here is exact to the scan. It receives an
//! output in the millisecond after the scan that set it. `tests/cli/examples.rs` tests single rungs.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use rungd_config::load;
use rungd_engine::Cell;
use rungd_lab::rig::{Rig, RigProgram, RigSetup};
use rungd_language::resolve::scope::Scope;
use rungd_runtime::exchange::Ticket;
use rungd_test_support::calm::calmed;

/// A controller with its simulated device.
struct Plant {
    scope: Scope,
    rig: Rig,
    now_ms: u64,
    stopped: bool,
}

/// A bit's changes: the time in ms and the new value of each.
type Changes = Vec<(u64, bool)>;

impl Plant {
    fn of(controller: &str) -> Plant {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config").join(controller);
        let loaded = load::controller_file(&path).expect("a readable controller file");
        assert!(loaded.findings.is_empty(), "{:#?}", loaded.findings);
        let (program, controller) = (loaded.program.unwrap(), loaded.controller.unwrap());
        let lowered = Arc::new(RigProgram::new(&program, &Arc::new(controller)));
        Plant {
            scope: Scope::of(&program),
            rig: Rig::new(&lowered, &RigSetup::default()),
            now_ms: 0,
            stopped: false,
        }
    }

    fn cell(&self, name: &str) -> Cell {
        let address = self.scope.address(name).expect("an operand");
        self.rig.program().symbols.layout.cell(address).expect("a bit or a word")
    }

    fn on(&self, name: &str) -> bool {
        let Cell::Bit(bit) = self.cell(name) else { panic!("{name} is a word") };
        self.rig.image().bit(bit)
    }

    fn word(&self, name: &str) -> i32 {
        let Cell::Word(word) = self.cell(name) else { panic!("{name} is a bit") };
        self.rig.image().word(word)
    }

    fn force(&mut self, name: &str, on: bool) {
        self.rig.force(self.cell(name), on.into(), Ticket(1));
    }

    fn scan(&mut self) {
        let is_last = self.rig.scan();
        self.rig.end_scan(is_last);
        self.stopped = is_last;
    }

    /// Scans up to a time, including the scan at that time; calls `look` after each scan.
    fn until(&mut self, end_ms: u64, mut look: impl FnMut(&Plant)) {
        while self.now_ms <= end_ms && !self.stopped {
            self.scan();
            look(self);
            self.now_ms += self.rig.period_ns() / 1_000_000;
        }
    }

    /// Scans up to a time; returns the changes of some bits. OFF at the beginning is not a change.
    fn changes<const N: usize>(&mut self, end_ms: u64, names: [&str; N]) -> [Changes; N] {
        let mut changes = [const { Changes::new() }; N];
        self.until(end_ms, |plant| {
            for (changes, name) in changes.iter_mut().zip(names) {
                let on = plant.on(name);
                if changes.last().is_some_and(|(_, was)| *was) != on {
                    changes.push((plant.now_ms, on));
                }
            }
        });
        changes
    }
}

/// The TOML files of a folder.
fn files(folder: PathBuf) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect()
}

/// Writes a changed controller file of `config/` and returns its path. It uses the original
/// ladders.
fn copy(text: &str, name: &str) -> PathBuf {
    let programs = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/programs/");
    let text = text.replace("\"programs/", &format!("\"{}", programs.display()));
    let copy = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&copy, text).expect("writable");
    copy
}

/// A ladder, with the files of the library that its controller file names.
fn with_library(ladder: &Path) -> Vec<PathBuf> {
    let controller = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
    let controller = controller.join(ladder.file_name().expect("a file"));
    let text = std::fs::read_to_string(&controller).expect("a controller file of the same name");
    let list = text.split_once("ladder = [").expect("its ladders").1.split(']').next();
    let names = list.unwrap_or_default().split('"').filter(|name| name.starts_with("lib:"));
    names.map(PathBuf::from).chain([ladder.to_owned()]).collect()
}

#[test]
fn every_file_in_config_passes_check_without_a_warning() {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
    let (controllers, ladders) = (files(config.clone()), files(config.join("programs")));
    assert!(controllers.len() >= 8 && ladders.len() >= 7);
    for path in controllers {
        let loaded = load::controller_file(&path).expect("readable");
        assert!(loaded.findings.is_empty(), "{}: {:#?}", path.display(), loaded.findings);
        let alive = loaded.controller.is_some_and(|c| !c.rules.is_empty() || !c.devices.is_empty());
        assert!(alive, "{}", path.display());
    }
    for path in ladders {
        let loaded = load::ladder_files(&with_library(&path)).expect("readable");
        assert!(loaded.findings.is_empty(), "{}: {:#?}", path.display(), loaded.findings);
        let program = loaded.program.expect("a program");
        let undocumented: Vec<&str> = program
            .tags
            .iter()
            .filter(|t| t.doc.is_none() && t.alarm.is_none())
            // A library explains its own tags, such as `oven.wrong`. An array has its doc at its
            // first element.
            .filter(|t| !t.name.contains('.') && (t.name.ends_with("[0]") || !t.name.contains('[')))
            .map(|t| t.name.as_str())
            .collect();
        assert!(
            undocumented.is_empty(),
            "{}: {undocumented:?} say not what they are",
            path.display()
        );
    }
}

/// The `[retain]` table that a controller file proposes in a comment is right too.
#[test]
fn the_retain_settings_proposed_by_the_examples_pass_check() {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
    let mut seen = 0;
    for path in files(config) {
        let text = std::fs::read_to_string(&path).expect("readable");
        let Some((before, behind)) = text.split_once("# [retain]\n") else { continue };
        let proposed = behind.lines().take_while(|line| line.starts_with("# "));
        let proposed: Vec<&str> = proposed.map(|line| &line[2..]).collect();
        let text = format!("{before}[retain]\n{}\n{behind}", proposed.join("\n"));
        let copy = copy(&text, "plants-retain.toml");
        let loaded = load::controller_file(&copy).expect("readable");
        assert!(loaded.findings.is_empty(), "{}: {:#?}", path.display(), loaded.findings);
        assert!(!loaded.controller.expect("a controller").retain.is_empty());
        seen += 1;
    }
    assert!(seen >= 4);
}

#[test]
fn every_shipped_controller_runs() {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
    let state = Path::new(env!("CARGO_TARGET_TMPDIR")).join("plants-state");
    let _ = std::fs::remove_dir_all(&state);
    for path in files(config) {
        let state = state.join(path.file_stem().expect("a name"));
        std::fs::create_dir_all(&state).unwrap();
        let text = std::fs::read_to_string(&path).expect("a controller file");
        let output = Command::new(env!("CARGO_BIN_EXE_rungd"))
            .arg("run")
            .arg(copy(&calmed(&text), "plants-run.toml"))
            .args(["--scans", "5"])
            .env("STATE_DIRECTORY", &state)
            .output()
            .expect("rungd runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{}: {said}", path.display());
        // A busy machine may cause overruns, a disk that stalls lets a start and its writes wait,
        // and the first start finds no memory to restore. Any other warning would be a fault of
        // the example.
        const USUAL: [&str; 5] =
            ["overrun", "start-waits", "retain-slow", "record-behind", "retain-cold"];
        let usual = |line: &str| USUAL.iter().any(|event| line.contains(event));
        let warns = |line: &&str| line.contains("WARN") && !usual(line);
        assert_eq!(said.lines().find(warns), None, "{}", path.display());
    }
}

/// The device sees the feeder run at 10 ms. The first part comes 250 ms later, and further parts
/// every 400 ms: the twelfth at 4660 ms. The device removes the bin 1 s after it sees the lamp, and
/// the ladder accepts that 200 ms later. The next bin is there 500 ms after the device sees that
/// the lamp is out.
#[test]
fn the_first_controller_fills_its_first_bin_within_five_seconds() {
    let mut plant = Plant::of("rungd.toml");
    let [full, feeder, present] = plant.changes(7_000, ["bin_full", "feeder", "bin_present"]);
    assert_eq!(full, [(4_660, true), (5_870, false)]);
    assert_eq!(present, [(0, true), (5_670, false), (6_380, true)]);
    assert_eq!(feeder, [(0, true), (4_660, false), (6_380, true)]);
    assert_eq!(plant.word("bins_filled"), 1);
}

#[test]
fn the_parts_bin_is_filled_and_changed_and_filled_again() {
    let mut plant = Plant::of("parts-bin.toml");
    let mut most = 0;
    plant.until(60_000, |plant| {
        most = most.max(plant.word("parts.Acc"));
        assert!(!(plant.on("feeder") && plant.on("bin_full")), "fed over the brim");
        assert!(!plant.on("overfilled") && !plant.on("eye_blocked"));
    });
    // A bin takes 500 ms + 11 × 800 ms to fill and 8.2 s to change: 17.5 s.
    assert_eq!((plant.word("bins_filled"), most), (3, 12));
}

#[test]
fn the_robot_empties_the_bin_and_waits_for_the_refill() {
    let mut plant = Plant::of("bin-emptying.toml");
    let mut least = 12;
    plant.until(60_000, |plant| {
        least = least.min(plant.word("left.Acc"));
        assert!(!plant.on("miscount"), "taken from an empty bin");
        assert!(plant.on("low_lamp") || plant.on("robot_enable"));
    });
    // The first refill comes after 2 s. Then a bin lasts 400 ms + 11 × 700 ms, and the next refill
    // takes 2 s: 10.1 s.
    assert_eq!((plant.word("refills"), least), (6, 0));
}

#[test]
fn the_conveyor_sounds_its_horn_runs_and_runs_empty() {
    let mut plant = Plant::of("conveyor.toml");
    let names = ["horn", "feeder", "belt", "exit_eye", "fault_lamp"];
    let [horn, feeder, belt, eye, fault] = plant.changes(45_000, names);
    assert_eq!(horn, [(1_000, true), (4_000, false), (41_000, true), (44_000, false)]);
    assert_eq!(feeder, [(4_000, true), (20_000, false), (44_000, true)]);
    assert_eq!(belt, [(4_000, true), (25_000, false), (44_000, true)]);
    assert_eq!(eye.first(), Some(&(8_010, true)), "a belt's length after it began to move");
    assert!(eye.len() > 20);
    assert_eq!(fault, []);
}

#[test]
fn a_full_car_park_admits_no_car() {
    let mut plant = Plant::of("car-park.toml");
    let mut was_full = false;
    let mut was_up = false;
    plant.until(120_000, |plant| {
        let (full, up) = (plant.on("full_lamp"), plant.on("entry_barrier"));
        assert!(!(was_full && full && up && !was_up), "opened for a car without a space");
        assert!(!plant.on("overfull") && !plant.on("lost_count"));
        assert_eq!(plant.word("free"), 12 - plant.word("cars.Acc"));
        assert_ne!(full, plant.on("free_lamp"));
        (was_full, was_up) = (full, up);
    });
    let mut plant = Plant::of("car-park.toml");
    let [full] = plant.changes(120_000, ["full_lamp"]);
    assert!(full.len() >= 6, "it fills up, and somebody leaves: {full:?}");
}

const STAGES: [&str; 10] = [
    "Day.AllRed",
    "Day.Walk",
    "Day.WalkClear",
    "Day.NsReady",
    "Day.NsGreen",
    "Day.NsAmber",
    "Day.NsClear",
    "Day.EwReady",
    "Day.EwGreen",
    "Day.EwAmber",
];

#[test]
fn the_lights_cycle_in_order_and_are_never_green_together() {
    let mut plant = Plant::of("traffic-light.toml");
    let mut order: Vec<&str> = Vec::new();
    let mut flashes = 0;
    let mut amber = false;
    plant.until(120_000, |plant| {
        assert!(!plant.on("conflict"));
        let dark = |lamps: [&str; 3]| lamps.iter().all(|lamp| !plant.on(lamp));
        let night = plant.on("Night.Running");
        if !night {
            assert!(!dark(["ns_red", "ns_amber", "ns_green"]), "dark at {}", plant.now_ms);
            assert!(!dark(["ew_red", "ew_amber", "ew_green"]), "dark at {}", plant.now_ms);
        }
        flashes += u32::from(night && plant.on("ns_amber") && !amber);
        amber = plant.on("ns_amber");
        let on: Vec<&&str> = STAGES.iter().filter(|stage| plant.on(stage)).collect();
        assert!(on.len() <= 1, "{on:?}");
        if let Some(stage) = on.first().filter(|stage| order.last() != Some(**stage)) {
            order.push(stage);
        }
    });
    // A pedestrian presses the button at 10 s, is served after the first cycle, and presses it
    // again at 55 s, late in the second cycle. Then the night begins at an all-red, and the day
    // returns at 75 s.
    let streets = &STAGES[3..];
    let mut wanted = vec!["Day.AllRed"];
    wanted.extend(streets);
    wanted.extend(&STAGES[..]);
    assert_eq!(order[..wanted.len()], wanted[..]);
    assert!(order[wanted.len()..].starts_with(&["Day.AllRed"]), "{order:?}");
    assert!(flashes >= 5, "amber flashed {flashes} times");
}

/// The Stages cannot give two greens, but a force can. The last rungs must detect that.
#[test]
fn two_greens_stop_the_traffic_light() {
    let mut plant = Plant::of("traffic-light.toml");
    plant.until(5_000, |_| {});
    assert!(plant.on("ns_green") && plant.on("healthy"));
    plant.force("ew_green", true);
    plant.until(6_000, |_| {});
    assert!(plant.stopped);
    assert_eq!(plant.now_ms, 5_060, "STOP in the first scan, the last scan behind it");
    assert!(!plant.on("healthy"), "and the relay flashes amber");
}

#[test]
fn the_mixer_makes_a_batch_to_its_recipe() {
    let mut plant = Plant::of("batch-mixer.toml");
    let names = ["drain_valve", "water_valve", "syrup_valve", "agitator", "busy_lamp"];
    let [drain, water, syrup, agitator, busy] = plant.changes(39_000, names);
    // Draining takes 3 s from 1 s on, and the tank must be dry for 1 s. Then the water takes 150 ms
    // + 19 × 250 ms, the syrup 300 ms + 7 × 500 ms.
    assert_eq!(drain[..2], [(1_000, true), (5_010, false)]);
    assert_eq!(water, [(5_010, true), (9_920, false)]);
    assert_eq!(syrup, [(5_010, true), (8_820, false)]);
    // Mix begins a scan after the water. TMRA reads the agitator a scan late: ON from 9.94 s to the
    // scan at 14 s, which is 4.06 s, and from 16.01 s on for the remaining 1.94 s.
    assert_eq!(agitator[..3], [(9_930, true), (14_000, false), (16_000, true)]);
    assert_eq!(drain[2], (17_950, true));
    assert_eq!(busy[..2], [(1_000, true), (21_960, false)]);
    let totals = ["batches", "water_total", "syrup_total"].map(|name| plant.word(name));
    assert_eq!(totals, [1, 20, 8]);
    assert!(!plant.on("dosing_fault") && !plant.on("aborted"));
}

#[test]
fn the_pumps_share_the_running_time() {
    let mut plant = Plant::of("pump-station.toml");
    let mut both = false;
    plant.until(180_000, |plant| {
        let pumps = (plant.on("pump1"), plant.on("pump2"));
        both |= pumps == (true, true);
        assert!(plant.on("low_float") || pumps == (false, false), "runs dry");
        assert!(!plant.on("float_fault") && !plant.on("high_level"));
        assert!(!plant.on("trip1") && !plant.on("trip2"));
    });
    let starts = (plant.word("starts1.ACC"), plant.word("starts2.ACC"));
    assert!(starts.0 >= 5 && starts.1 >= 5, "{starts:?}");
    assert_eq!(plant.word("balance.ACC"), starts.0 - starts.1);
    assert!(both, "the shower called for both");
}

#[test]
fn the_lubrication_gives_a_stroke_at_every_interval_of_machine_time() {
    let mut plant = Plant::of("lubrication.toml");
    // A stroke takes 1.2 s and a few scans: the strokes begin at 10 s, 21.2 s, 32.5 s and 43.7 s.
    plant.until(60_000, |plant| assert!(!plant.on("fault")));
    assert_eq!((plant.word("total_strokes"), plant.word("total_faults")), (4, 0));
    // The machine did not run from 50 s to 60 s; 5.1 s of the interval had passed before that.
    plant.until(64_500, |_| {});
    assert_eq!(plant.word("total_strokes"), 4);
    plant.until(67_000, |_| {});
    assert_eq!(plant.word("total_strokes"), 5);
    // Without pressure the pump is switched off after 3 s.
    plant.force("pressure", false);
    plant.until(90_000, |_| {});
    assert!(plant.on("fault") && !plant.on("pump"));
    assert_eq!((plant.word("total_strokes"), plant.word("total_faults")), (5, 1));
}
