//! `config/bottling-plant.toml`: its ladder with its simulated plant in virtual time, where every
//! fault causes its alarm; and a few seconds with the real binary.

use rungd_test_support::calm::calmed;
use rungd_test_support::running::live;
use std::path::{Path, PathBuf};

use rungd_config::load;
use rungd_test_support::bench::Plant;

fn config() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("config")
}

/// The controller and its plant, on one time grid.
fn plant() -> Plant {
    Plant::of(load::controller_file(&config().join("bottling-plant.toml")).unwrap())
}

const ALARMS: [&str; 5] =
    ["contactor_fault", "no_bottle", "not_leaving", "signal_fault", "plant_lost"];

#[test]
fn the_plant_fills_bottles_for_a_minute_without_an_alarm() {
    let mut plant = plant();
    let (mut least, mut most) = (i32::MAX, 0);
    plant.until(60_000, |plant| {
        assert_eq!(plant.on(&ALARMS), [""; 0], "at {} ms", plant.now_ms);
        assert!(plant.value("filler") == 0 || plant.value("belt") == 0, "filled on the move");
        (least, most) = (least.min(plant.value("level")), most.max(plant.value("level")));
    });
    // The first bottle reaches the filler 5.1 s after the start, and leaves 9 s later. Each bottle
    // stops for 1.5 s, and the belt moves for 3 s between two bottles.
    assert_eq!(plant.value("bottles"), 11);
    assert!((150..300).contains(&least) && (900..=910).contains(&most), "{least} to {most}");
}

#[test]
fn every_fault_raises_its_alarm_and_start_acknowledges_it() {
    for (fault, alarm) in [
        ("C100", "no_bottle"),
        ("C101", "not_leaving"),
        ("C102", "contactor_fault"),
        ("C103", "no_bottle"),
        ("C104", "signal_fault"),
        ("C106", "plant_lost"),
    ] {
        let mut plant = plant();
        plant.until(21_500, |_| {});
        assert_eq!((plant.value("running"), plant.on(&ALARMS)), (1, vec![]), "{fault}");
        plant.force(fault, true);
        plant.until(32_000, |_| {});
        assert_eq!((plant.value("running"), plant.on(&ALARMS)), (0, vec![alarm]), "{fault}");
        assert_eq!(plant.on(&["belt", "filler"]), [""; 0], "{fault}");
        plant.force(fault, false);
        // START comes every 20 s: the first one acknowledges, the second one starts.
        plant.until(42_000, |_| {});
        assert_eq!((plant.value("running"), plant.on(&ALARMS)), (0, vec![]), "{fault}");
        plant.until(62_000, |_| {});
        assert_eq!((plant.value("running"), plant.on(&ALARMS)), (1, vec![]), "{fault}");
    }
}

#[test]
fn noise_on_the_level_raises_no_alarm() {
    let mut plant = plant();
    plant.force("C105", true);
    plant.until(60_000, |plant| assert_eq!(plant.on(&ALARMS), [""; 0]));
    assert_eq!(plant.value("bottles"), 11);
}

#[test]
fn the_stop_button_stops_the_line() {
    let mut plant = plant();
    plant.until(3_000, |_| {});
    plant.force("C107", true);
    plant.until(3_100, |_| {});
    assert_eq!(plant.on(&["running", "belt"]), [""; 0]);
}

#[test]
fn the_binary_runs_the_plant_and_a_forced_bit_cuts_the_cable() {
    let text = |name: &str| std::fs::read_to_string(config().join(name)).unwrap();
    let controller = text("bottling-plant.toml");
    let controller = controller.replace("ladder = [\"programs/bottling-plant.toml\"]", "");
    let controller = controller.replace("operator.socket = \"bottling-plant.sock\"", "");
    // A long watchdog prevents FAULT, in which nothing changes. A long `loss-after` keeps a busy
    // machine from looking like a cut cable.
    let controller = calmed(&controller);
    let controller = controller.replace("on-loss", "loss-after = \"5s\"\non-loss");
    let mut live = live::Live::start(&text("programs/bottling-plant.toml"), &controller, &[]);
    live.line("belt is ON");
    live.await_values("plant.Ok plant.Stale running belt_aux", "ON OFF ON ON");
    live.ok("force C106 1");
    live.await_values("plant.Ok plant.Stale plant_lost running stop_ok", "OFF ON ON OFF OFF");
    assert!(live.ok("status").contains("the plant does not answer"));
    live.ok("force C106 0");
    live.await_values("plant.Ok plant.Stale stop_ok", "ON OFF ON");
    live.end();
}
