//! PID: each part by itself, with any scan period; limits, windup, hand and automatic.

use super::{Bench, bench, started};

const TAGS: &str = r#"
value    = { at = "R0" }
setpoint = { at = "R1" }
hand     = { at = "R2" }
gain     = { at = "R3", initial = 2.0 }
high     = { at = "R4", initial = 100.0 }
"#;

fn with(more: &str) -> String {
    format!(
        "{{ use = \"Pid\", name = \"p\", with = {{ value = \"value\", setpoint = \"setpoint\", \
         by_hand = \"X0\", hand = \"hand\", gain = \"gain\", high = \"high\"{more} }} }},"
    )
}

fn pid(more: &str) -> Bench {
    bench("pid", TAGS, &with(more))
}

const PERIODS: [u64; 6] = [10, 30, 60, 100, 250, 1_000];

#[test]
fn the_proportional_part_is_gain_times_error() {
    let mut p = pid("");
    p.put("value", 40.0).put("setpoint", 50.0).run(1_000);
    assert_eq!((p.real("p.out"), p.real("p.error")), (20.0, 10.0));
    p.put("value", 45.0).run(100);
    assert_eq!(p.real("p.out"), 10.0);
}

/// With an error of 1 the integral part grows by the gain in each reset time, with short and with
/// long scans.
#[test]
fn the_integral_part_depends_on_time_and_not_on_scans() {
    for period in PERIODS {
        let mut p = pid(", reset = 10").period(period);
        p.put("value", 49.0).put("setpoint", 50.0).run(30_000);
        let (integral, slack) = (p.real("p.integral"), 0.2 * period.max(100) as f32 / 1_000.0);
        assert!((integral - 6.0).abs() <= 2.0 * slack, "{period} ms: {integral} after 30 s");
        let out = p.real("p.out");
        assert!((out - integral - 2.0).abs() < 1e-4, "{period} ms: {out}");
    }
}

/// A step of 1.4e-7 is too small for a real near 50, and counts nevertheless.
#[test]
fn a_slow_integral_keeps_small_steps() {
    let mut p = pid(", reset = 3600").period(100);
    p.put("gain", 0.5).put("hand", 50.0).set("X0", 1).put("value", 49.99).put("setpoint", 50.0);
    p.scan().set("X0", 0).scan();
    let before = p.real("p.integral");
    let moved = p.run(3_600_000).real("p.integral") - before;
    assert!((moved - 0.005).abs() < 0.0001, "{moved} after an hour");
}

/// A value that falls by 1 per second adds gain times rate to the output.
#[test]
fn the_differential_part_depends_on_time_and_not_on_scans() {
    for period in PERIODS {
        let mut p = pid(", rate = 5").period(period);
        p.put("value", 50.0).put("setpoint", 50.0).run(2_000);
        let mut value = 50.0;
        for _ in 0..3_000 / period {
            value -= period as f32 / 1_000.0;
            p.put("value", value).scan();
        }
        let (out, error) = (p.real("p.out"), p.real("p.error"));
        assert!((out - 2.0 * error - 10.0).abs() < 0.05, "{period} ms: {out}");
    }
}

/// The setpoint does not enter the differential part: an operator's step gives no kick.
#[test]
fn a_setpoint_step_does_not_kick_the_output() {
    let mut p = pid(", rate = 50");
    p.put("value", 50.0).put("setpoint", 50.0).run(1_000);
    p.put("setpoint", 55.0).run(100);
    assert_eq!(p.real("p.out"), 10.0);
}

#[test]
fn the_first_step_of_a_loop_does_not_kick_the_output() {
    let mut p = pid(", rate = 50");
    p.put("value", 50.0).put("setpoint", 50.0);
    for _ in 0..100 {
        assert_eq!(p.scan().real("p.out"), 0.0);
    }
    // The same in a Program that is started late, halted, and started again at a different value.
    let blocks = format!(
        "[[program]]\nname = \"Main\"\nrung = [ {{ when = [\"rise(X1)\"], do = [\"RUN Loop\"] }}, \
         {{ when = [\"X2\"], do = [\"HALT Loop\"] }} ]\n\
         [[program]]\nname = \"Loop\"\nrung = [ {} ]\n",
        with(", rate = 50, low = -100").replace("} },", "} }")
    );
    let mut p = started("pid", TAGS, &blocks);
    for value in [50.0, 80.0] {
        p.put("value", value).put("setpoint", value).run(1_000).set("X1", 1).scan();
        for _ in 0..100 {
            assert_eq!(p.scan().real("p.out"), 0.0, "the value stands still at {value}");
        }
        p.set("X1", 0).set("X2", 1).run(100).set("X2", 0).scan();
    }
}

#[test]
fn the_output_stays_within_its_limits() {
    let mut p = pid(", reset = 1, rate = 1, low = -10");
    for value in [0.0, 1e6, -1e6, 50.0, 1e30, -1e30] {
        p.put("value", value).put("setpoint", 50.0);
        for _ in 0..500 {
            let out = p.scan().real("p.out");
            assert!((-10.0..=100.0).contains(&out), "{out}");
        }
    }
}

/// After a quarter of an hour at its limit, the output leaves the limit as soon as the value has
/// reached the setpoint.
#[test]
fn the_integral_does_not_wind_up_at_a_limit() {
    for (value, limit) in [(0.0, 100.0), (100.0, 0.0)] {
        let mut p = pid(", reset = 5").period(100);
        p.put("value", value).put("setpoint", 50.0).run(1_000_000);
        assert_eq!(p.real("p.out"), limit);
        let beyond = if limit > 0.0 { 51.0 } else { 49.0 };
        p.put("value", beyond).run(100);
        let out = p.real("p.out");
        assert!((out - limit).abs() >= 1.9, "the value is beyond the setpoint: {out}");
    }
}

/// After one wrong sample the output returns to its former value, except for the integral of that
/// sample.
#[test]
fn a_spike_at_the_limit_does_not_move_the_integral() {
    let mut p = pid(", reset = 100");
    p.put("hand", 50.0).set("X0", 1).put("value", 50.0).put("setpoint", 50.0).scan();
    p.set("X0", 0).run(5_000);
    assert_eq!(p.real("p.out"), 50.0);
    for spike in [-10_000.0, 10_000.0] {
        p.put("value", spike).run(100);
        p.put("value", 50.0).run(200);
        let out = p.real("p.out");
        assert!((out - 50.0).abs() < 1.0, "after a spike to {spike}: {out}");
    }
}

/// If a limit is narrowed, the integral is reduced too.
#[test]
fn the_integral_does_not_wind_up_at_a_moving_limit() {
    let mut p = pid(", reset = 5").period(100);
    p.put("value", 49.0).put("setpoint", 50.0).run(1_000_000);
    assert_eq!(p.real("p.out"), 100.0);
    p.put("high", 40.0).run(1_000);
    assert_eq!(p.real("p.out"), 40.0);
    p.put("value", 51.0).run(200);
    assert!(p.real("p.out") <= 38.0, "{}", p.real("p.out"));
}

#[test]
fn switching_between_hand_and_automatic_does_not_jump() {
    for (value, setpoint) in [(50.0, 50.0), (20.0, 60.0), (90.0, 10.0)] {
        let mut p = pid(", reset = 100, rate = 2");
        p.put("value", value).put("setpoint", setpoint).set("X0", 1).put("hand", 35.0).run(500);
        assert_eq!(p.real("p.out"), 35.0);
        p.set("X0", 0).scan();
        assert!((p.real("p.out") - 35.0).abs() < 1e-4, "the switch itself");
        p.run(110);
        let out = p.real("p.out");
        let step = 2.0 * (setpoint - value).abs() / 100.0 * 0.1;
        assert!((out - 35.0).abs() <= step * 1.2 + 1e-4, "the first step: {out}");
        let out = p.run(3_000).real("p.out");
        assert_eq!(p.real("hand"), out, "hand follows");
        assert_eq!(p.set("X0", 1).scan().real("p.out"), out);
        assert_eq!(p.run(1_000).real("p.out"), out);
    }
}

#[test]
fn the_output_in_hand_stays_within_its_limits() {
    let mut p = pid("");
    p.set("X0", 1);
    for (hand, out) in [(150.0, 100.0), (-3.0, 0.0), (42.0, 42.0)] {
        assert_eq!(p.put("hand", hand).scan().real("p.out"), out);
    }
}

/// Cooling has a negative gain: more output lowers the value.
#[test]
fn a_negative_gain_reverses_the_action() {
    let mut p = pid(", reset = 10");
    p.put("gain", -2.0).put("value", 60.0).put("setpoint", 50.0).run(1_100);
    let out = p.real("p.out");
    assert!((out - 22.0).abs() <= 0.4, "20, and 2 a second: {out}");
    p.put("value", 40.0).run(60_000);
    assert_eq!(p.real("p.out"), 0.0);
    p.put("value", 51.0).run(100);
    assert!(p.real("p.out") >= 1.9, "no windup there either: {}", p.real("p.out"));
}

/// A first-order plant: 2 K per percent of output above 20 K, a time constant of 30 s.
#[test]
fn a_loop_settles_at_its_setpoint_with_short_and_with_long_scans() {
    for period in PERIODS {
        let mut p = pid(", reset = 30").period(period);
        let (mut value, mut most) = (20.0_f32, 0.0_f32);
        p.put("setpoint", 80.0);
        for _ in 0..400_000 / period {
            let target = 20.0 + 2.0 * p.real("p.out");
            value += (target - value) * (period as f32 / 1_000.0) / 30.0;
            most = most.max(value);
            p.put("value", value).scan();
        }
        assert!((value - 80.0).abs() < 0.1, "{period} ms: {value}");
        assert!(most < 90.0, "{period} ms: an overshoot to {most}");
    }
}
