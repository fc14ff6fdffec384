//! `config/lift-station.toml`: its ladder with its simulated well in virtual time.
//!
//! In dry weather 25 mm/s flow in, and a pump removes 40 mm/s: from 1.6 m a pump runs for 53 s, and
//! the well fills again in 32 s.

use std::path::Path;

use rungd_config::load;
use rungd_test_support::bench::Plant;

const PUMPS: [&str; 3] = ["pump1", "pump2", "pump3"];
const ALARMS: [&str; 9] = [
    "p1.failed",
    "p2.failed",
    "p3.failed",
    "p1.tripped",
    "p2.tripped",
    "p3.tripped",
    "level.broken",
    "high_level",
    "lost",
];

fn plant() -> Plant {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("config/lift-station.toml");
    Plant::of(load::controller_file(&path).unwrap())
}

fn run(plant: &mut Plant, seconds: u64) {
    plant.until(plant.now_ms + seconds * 1000, |_| {});
}

/// The well's level in metres by its raw signal, even if the ladder rejects the signal.
fn level(plant: &Plant) -> f64 {
    f64::from(plant.value("level_raw") - 4000) / 4000.0
}

/// Runs for some seconds; returns the pumps that start, in order, and the lowest and the highest
/// level.
fn watch(plant: &mut Plant, seconds: u64) -> (Vec<&'static str>, f64, f64) {
    let mut starts = Vec::new();
    let mut before = plant.on(&PUMPS);
    let (mut low, mut high) = (f64::MAX, f64::MIN);
    plant.until(plant.now_ms + seconds * 1000, |plant| {
        let now = plant.on(&PUMPS);
        starts.extend(now.iter().filter(|pump| !before.contains(pump)));
        before = now;
        (low, high) = (low.min(level(plant)), high.max(level(plant)));
    });
    (starts, low, high)
}

#[test]
fn the_pumps_hold_the_level_and_the_lead_rotates() {
    let mut plant = plant();
    run(&mut plant, 1);
    let (starts, low, high) = watch(&mut plant, 200);
    // The shower from 60 s to 90 s brings more than one pump removes, and ends before the level is
    // 2.2 m.
    assert!(low > 0.79 && (1.7..1.8).contains(&high), "{low} to {high}");
    assert_eq!(plant.on(&ALARMS), [""; 0]);
    assert_eq!(starts, ["pump1", "pump2", "pump3"]);
}

#[test]
fn a_storm_starts_all_three_pumps_one_after_another() {
    let mut plant = plant();
    plant.force("C103", true);
    let (starts, _, high) = watch(&mut plant, 59);
    assert_eq!(starts, ["pump1", "pump2", "pump3"]);
    assert!((2.8..3.0).contains(&high), "{high}");
    assert_eq!(plant.on(&ALARMS), [""; 0]);
    // With the shower, more flows in than three pumps remove, but too briefly to reach 3.6 m.
    let (_, _, high) = watch(&mut plant, 60);
    assert!(high < 3.6, "{high}");
}

#[test]
fn a_failed_pump_is_replaced_until_acknowledged() {
    let mut plant = plant();
    // The contactor of pump 1, the first lead pump, does not answer.
    plant.force("C101", true);
    let (starts, low, _) = watch(&mut plant, 58);
    assert_eq!(starts, ["pump1", "pump2"]);
    assert_eq!(plant.on(&ALARMS), ["p1.failed"]);
    assert_eq!(plant.on(&["horn", "lamp", "p1.ready"]), ["horn", "lamp"]);
    assert_eq!(plant.value("alarms.first"), 1);
    assert!(low > 0.79);
    // Pump 1 is skipped from now on.
    let (starts, ..) = watch(&mut plant, 220);
    assert!(!starts.contains(&"pump1") && starts.contains(&"pump3"), "{starts:?}");
    // After the repair and an acknowledgement, pump 1 takes its turn again.
    plant.force("C101", false);
    plant.force("C105", true);
    run(&mut plant, 1);
    plant.force("C105", false);
    assert_eq!(plant.on(&["horn", "p1.failed", "p1.ready"]), ["p1.ready"]);
    let (starts, ..) = watch(&mut plant, 200);
    assert!(starts.contains(&"pump1"), "{starts:?}");
}

#[test]
fn a_pump_that_trips_is_replaced_at_once() {
    let mut plant = plant();
    run(&mut plant, 30);
    assert_eq!(plant.on(&PUMPS), ["pump1"]);
    plant.force("C102", true);
    let (starts, ..) = watch(&mut plant, 200);
    assert_eq!(plant.on(&ALARMS), ["p2.tripped"]);
    assert!(!starts.contains(&"pump2") && starts.contains(&"pump3"), "{starts:?}");
    plant.force("C102", false);
    run(&mut plant, 1);
    assert_eq!(plant.on(&ALARMS), [""; 0]);
}

#[test]
fn a_broken_wire_raises_its_alarm_and_the_float_takes_over() {
    let mut plant = plant();
    run(&mut plant, 30);
    plant.force("C100", true);
    run(&mut plant, 2);
    assert_eq!(plant.on(&ALARMS), ["level.broken"]);
    assert_eq!(plant.on(&PUMPS), [""; 0]);
    let held = plant.real("level.value");
    assert!((0.9..1.6).contains(&held), "not an empty well: {held}");
    // The float calls the pumps repeatedly, and no pump runs dry.
    let (mut calls, mut was_high) = (0, false);
    plant.until(plant.now_ms + 200_000, |plant| {
        let is_high = plant.value("high_level") != 0;
        calls += u32::from(is_high && !was_high);
        was_high = is_high;
        assert!(plant.value("level.broken") != 0 && plant.real("level.value") == held);
    });
    assert!(calls >= 2, "{calls} calls");
    plant.force("C100", false);
    run(&mut plant, 1);
    assert_eq!(plant.on(&["level.broken"]), [""; 0]);
    assert!((0.5..3.7).contains(&level(&plant)), "{}", level(&plant));
}

#[test]
fn each_pump_has_its_own_hours_and_a_lost_device_raises_one_alarm() {
    let mut plant = plant();
    run(&mut plant, 30);
    let first = plant.value("p1.meter.part.Acc");
    assert!((25_000..=27_000).contains(&first), "{first} ms");
    assert_eq!(plant.value("p2.meter.part.Acc"), 0);
    plant.force("C104", true);
    run(&mut plant, 3);
    assert_eq!(plant.on(&ALARMS), ["lost"]);
    assert_eq!(plant.value("alarms.first"), 4);
}
