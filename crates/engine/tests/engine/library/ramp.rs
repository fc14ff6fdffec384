//! Ramp: its rate, both directions, no overshoot, with any scan period.

use super::{Bench, bench};

fn ramp(up: &str, down: &str) -> Bench {
    let uses = format!(
        "{{ use = \"Ramp\", name = \"r\", \
         with = {{ target = \"target\", up = {up}, down = {down}, hold = \"X0\" }} }},"
    );
    bench("ramp", "target = { at = \"R0\" }", &uses)
}

const PERIODS: [u64; 7] = [1, 10, 30, 60, 100, 250, 1_000];

#[test]
fn a_ramp_keeps_its_rates_at_any_scan_period() {
    for period in PERIODS {
        let mut r = ramp("10", "20").period(period);
        assert_eq!((r.run(1_000).real("r.value"), r.on("r.there")), (0.0, true));
        let slack = 10.0 * (period as f32) / 1_000.0 + 1e-3;
        r.put("target", 50.0).run(3_000);
        let value = r.real("r.value");
        assert!((value - 30.0).abs() <= slack, "{period} ms: {value} after 3 s");
        r.run(2_000 + period);
        assert_eq!((r.real("r.value"), r.on("r.there")), (50.0, true), "{period} ms");
        r.put("target", -50.0).run(3_000);
        let value = r.real("r.value");
        assert!((value - -10.0).abs() <= 2.0 * slack, "{period} ms: {value} after 3 s down");
        r.run(2_000 + period);
        assert_eq!((r.real("r.value"), r.on("r.there")), (-50.0, true), "{period} ms");
    }
}

/// No step is greater than the rate allows, and no step passes the target.
#[test]
fn a_ramp_never_jumps_and_never_overshoots() {
    for period in PERIODS {
        let mut r = ramp("7", "3").period(period);
        let seconds = period as f32 / 1_000.0;
        let targets = [33.3, 20.0, 20.5, -4.0, 100.0, 0.0];
        for target in targets {
            r.put("target", target);
            for _ in 0..2_000 / period + 2 {
                let before = r.real("r.value");
                r.scan();
                let (step, now) = (r.real("r.value") - before, r.real("r.value"));
                let most = if target > before { 7.0 } else { 3.0 } * seconds;
                assert!(step.abs() <= most + 1e-4, "{period} ms: a step of {step}");
                assert!((target - before) * (target - now) >= 0.0, "{period} ms: past {target}");
            }
        }
    }
}

/// A furnace with 1 K per hour: the change per scan is too small for a real near 1000.
#[test]
fn a_slow_ramp_keeps_its_rate() {
    let mut r = ramp("0.000277777", "1").period(100);
    r.put("target", 1_000.0).put("r.value", 1_000.0).run(1_000);
    assert_eq!(r.real("r.value"), 1_000.0);
    r.put("target", 1_010.0).run(2 * 3_600_000);
    let value = r.real("r.value");
    assert!((value - 1_002.0).abs() < 0.01, "{value} after two hours");
}

/// The rate also holds for a target that changes in every scan.
#[test]
fn a_moving_target_does_not_change_the_rate() {
    let mut r = ramp("1", "1");
    for step in 0..3_000_u16 {
        r.put("target", 500.0 + f32::from(step % 17)).scan();
    }
    let value = r.real("r.value");
    assert!((value - 30.0).abs() < 0.05, "{value} after 30 s");
}

#[test]
fn a_held_ramp_keeps_its_value_and_resumes() {
    let mut r = ramp("10", "10");
    r.put("target", 50.0).run(2_010);
    let held = r.set("X0", 1).scan().real("r.value");
    assert_eq!(r.run(5_000).real("r.value"), held);
    r.set("X0", 0).run(1_000);
    assert!((r.real("r.value") - held - 10.0).abs() < 0.3, "{}", r.real("r.value"));
}

#[test]
fn a_ramp_continues_from_a_written_value() {
    let mut r = ramp("10", "10");
    r.put("target", 50.0).run(1_000);
    r.put("r.value", 40.0).scan();
    assert!((r.real("r.value") - 40.0).abs() <= 0.2);
    r.run(500);
    assert!((r.real("r.value") - 45.0).abs() <= 0.3, "{}", r.real("r.value"));
}

#[test]
fn a_ramp_resumes_after_a_stop() {
    let mut r = ramp("10", "10");
    r.put("target", 50.0).run(2_000);
    let before = r.real("r.value");
    r.restart();
    r.scan().scan();
    let now = r.real("r.value");
    assert!((now - before).abs() <= 0.5, "{before}, then {now}");
}

#[test]
fn a_changed_rate_applies_from_the_next_scan() {
    let uses = r#"{ use = "Ramp", name = "r", with = { target = 100, up = "up", down = 1 } },"#;
    let mut r = bench("ramp", "up = { at = \"R0\", initial = 10.0 }", uses);
    r.run(3_000);
    let before = r.real("r.value");
    r.put("up", 1.0).run(2_000);
    assert!((r.real("r.value") - before - 2.0).abs() < 0.1, "{before}, then {}", r.real("r.value"));
    r.put("up", 0.0).scan();
    let before = r.real("r.value");
    assert_eq!(r.run(1_000).real("r.value"), before);
    r.put("up", -5.0);
    assert_eq!(r.run(1_000).real("r.value"), before, "a negative rate moves nothing");
}
