//! `config/temperature-loop.toml`: its ladder with its simulated oven in virtual time.
//!
//! The heater at its limit of 80 per cent finally heats the oven to 220 °C. The transmitter
//! resolves hundredths of a degree; the heater's cycle of a second causes ripples of a few
//! hundredths.

use std::path::Path;

use rungd_config::load;
use rungd_engine::isa::Real;
use rungd_test_support::bench::Plant;

fn plant() -> Plant {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .join("config/temperature-loop.toml");
    Plant::of(load::controller_file(&path).unwrap())
}

fn write(plant: &mut Plant, name: &str, number: &str) {
    plant.write(name, number.parse::<Real>().unwrap().cell());
}

fn temperature(plant: &Plant) -> f64 {
    plant.real("oven.value")
}

/// Runs for some seconds; returns the lowest and the highest value of a word during them.
fn range(plant: &mut Plant, seconds: u64, name: &str) -> (f64, f64) {
    let (mut low, mut high) = (f64::MAX, f64::MIN);
    plant.until(plant.now_ms + seconds * 1000, |plant| {
        let value = plant.real(name);
        (low, high) = (low.min(value), high.max(value));
    });
    (low, high)
}

/// Runs for some seconds.
fn run(plant: &mut Plant, seconds: u64) {
    range(plant, seconds, "oven.value");
}

/// A plant that has settled at 120 °C.
fn settled() -> Plant {
    let mut plant = plant();
    run(&mut plant, 80);
    let now = temperature(&plant);
    assert!((119.0..121.0).contains(&now), "{now}");
    plant
}

#[test]
fn the_loop_reaches_its_setpoint_without_overshoot_and_stays_there() {
    let mut plant = plant();
    // The ramp needs 50 s.
    let (_, high) = range(&mut plant, 70, "oven.value");
    assert!(high < 122.4, "an overshoot of more than 2 %: {high}");
    let (low, high) = range(&mut plant, 30, "oven.value");
    assert!((118.8..=121.2).contains(&low) && high < 121.2, "1 %: {low} to {high}");
    write(&mut plant, "wanted", "80.0");
    let (low, _) = range(&mut plant, 60, "oven.value");
    assert!(low > 78.4, "undershoot {low}");
    let (low, high) = range(&mut plant, 30, "oven.value");
    assert!(low > 79.2 && high < 80.8, "{low} to {high}");
}

#[test]
fn the_output_stays_within_its_limits_and_does_not_wind_up() {
    let mut plant = settled();
    // The heater's 80 per cent cannot follow quickly: the ramp rises faster than the oven.
    write(&mut plant, "wanted", "200.0");
    let (low, high) = range(&mut plant, 30, "loop.out");
    assert!(low >= 0.0 && high == 80.0, "{low} to {high}");
    let mut on = 0;
    plant.until(plant.now_ms + 10_000, |plant| on += plant.value("heater"));
    assert!((780..820).contains(&on), "of 1000 scans {on}");
    let (_, high) = range(&mut plant, 100, "oven.value");
    assert!(high < 204.0, "{high}");
    assert_eq!(plant.value("too_hot"), 0);
}

#[test]
fn switching_between_hand_and_automatic_is_bumpless() {
    let mut plant = settled();
    let before = plant.real("loop.out");
    plant.force("by_hand", true);
    let (low, high) = range(&mut plant, 1, "loop.out");
    assert!((low - before).abs() < 2.0 && low == high, "{before}, then {low} to {high}");
    // By hand, the operator's power and its limits apply.
    write(&mut plant, "power", "75.0");
    run(&mut plant, 60);
    assert_eq!(plant.real("loop.out"), 75.0);
    let hot = temperature(&plant);
    assert!(hot > 180.0, "{hot}");
    // Back in automatic, the output begins at 75 per cent and the setpoint at the oven's value.
    plant.force("by_hand", false);
    plant.until(plant.now_ms + 100, |_| {});
    let (out, setpoint) = (plant.real("loop.out"), plant.real("setpoint.value"));
    assert!((out - 75.0).abs() < 3.0, "{out}");
    assert!((setpoint - hot).abs() < 1.0, "{setpoint} at {hot}");
    let (low, _) = range(&mut plant, 80, "oven.value");
    assert!(low > 117.6 && (temperature(&plant) - 120.0).abs() < 1.2, "{low}");
}

#[test]
fn a_welded_relay_raises_the_alarm_with_hysteresis() {
    let mut plant = settled();
    plant.force("C101", true);
    let mut came = 0.0;
    plant.until(plant.now_ms + 60_000, |plant| {
        if came == 0.0 && plant.value("too_hot") != 0 {
            came = temperature(plant);
        }
        assert!(plant.value("too_hot") == 0 || plant.value("heater") == 0, "the heater is cut off");
    });
    assert!((210.0..210.5).contains(&came), "{came}");
    assert_eq!(plant.value("lamp"), 1);
    // After the repair the oven cools: the alarm ends at 200 °C, and the loop takes over.
    plant.force("C101", false);
    let mut went = 0.0;
    plant.until(plant.now_ms + 90_000, |plant| {
        if went == 0.0 && plant.value("too_hot") == 0 {
            went = temperature(plant);
        }
    });
    assert!((199.5..200.0).contains(&went), "{went}");
    assert!((temperature(&plant) - 120.0).abs() < 1.2);
}

#[test]
fn a_broken_wire_turns_the_heater_off_without_wind_up() {
    let mut plant = settled();
    let out = plant.real("loop.out");
    plant.force("C100", true);
    // The ladder does not yet notice a wire that has just broken: the value stays as it was.
    plant.until(plant.now_ms + 400, |plant| assert_eq!(plant.value("oven.broken"), 0));
    run(&mut plant, 30);
    assert_eq!(plant.on(&["oven.broken", "lamp", "heater"]), ["oven.broken", "lamp"]);
    assert!((plant.real("loop.out") - out).abs() < 2.0);
    plant.force("C100", false);
    let (_, high) = range(&mut plant, 100, "oven.value");
    assert!(high < 123.6 && (temperature(&plant) - 120.0).abs() < 1.2, "{high}");
}

#[test]
fn noise_does_not_disturb_the_loop() {
    let mut plant = settled();
    plant.force("C102", true);
    let (low, high) = range(&mut plant, 40, "oven.value");
    // 30 uA correspond to half a degree.
    assert!((118.5..=121.5).contains(&low) && high < 121.5, "{low} to {high}");
}

/// What a scan is too long is taken off the next cycle, so any share is exact in the long run.
#[test]
fn the_heater_is_on_for_exactly_the_requested_share_of_time() {
    for (percent, wanted) in [("0.0", 0), ("1.0", 40), ("0.5", 20), ("33.3", 1332), ("79.9", 3196)]
    {
        let mut plant = plant();
        plant.force("by_hand", true);
        run(&mut plant, 1);
        write(&mut plant, "power", percent);
        run(&mut plant, 2);
        let mut on = 0;
        plant.until(plant.now_ms + 40_000, |plant| on += plant.value("heater"));
        assert!((on - wanted).abs() <= 2, "{percent} per cent: of 4000 scans {on}, not {wanted}");
    }
}
