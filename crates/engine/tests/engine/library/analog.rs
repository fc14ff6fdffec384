//! Analog scaling and hysteresis.

use super::{Bench, bench};

fn input(more: &str) -> Bench {
    let uses = format!(
        "{{ use = \"AnalogIn\", name = \"a\", \
         with = {{ raw = \"raw\", low = 0, high = 50{more} }} }},"
    );
    bench("scaling", "raw = { at = \"D0\", initial = 12000 }", &uses)
}

#[test]
fn the_raw_value_is_scaled_to_its_unit() {
    let mut a = input("");
    for (raw, value) in [(4_000, 0.0), (20_000, 50.0), (12_000, 25.0), (4_001, 0.003_125)] {
        assert!((a.set("raw", raw).scan().real("a.value") - value).abs() < 1e-6, "{raw}");
        assert!(!a.on("a.broken"));
    }
    let mut falling =
        input(", raw_low = 0, raw_high = 100, below = -5, above = 105, limit = \"$On\"");
    for (raw, value) in [(0, 0.0), (100, 50.0), (-3, 0.0), (103, 50.0)] {
        assert_eq!(falling.set("raw", raw).scan().real("a.value"), value, "{raw}");
    }
}

/// Currents of 3.6 to 4 mA and of 20 to 21 mA are not a broken wire: the value goes a little beyond
/// its range.
#[test]
fn a_value_beyond_its_range_is_passed_on_or_limited() {
    let mut free = input("");
    let mut kept = input(", limit = \"$On\"");
    for (raw, value, within) in [(3_600, -1.25, 0.0), (21_000, 53.125, 50.0), (8_000, 12.5, 12.5)] {
        assert_eq!(free.set("raw", raw).scan().real("a.value"), value, "{raw}");
        assert_eq!(kept.set("raw", raw).scan().real("a.value"), within, "{raw}");
        assert!(!free.run(2_000).on("a.broken"));
    }
    let uses = r#"{ use = "AnalogIn", name = "a",
        with = { raw = "raw", low = 100, high = 0, limit = "$On" } },"#;
    let tags = "raw = { at = \"D0\", initial = 12000 }";
    let mut falling = bench("scaling", tags, &uses.replace('\n', " "));
    for (raw, value) in [(3_800, 100.0), (12_000, 50.0), (20_500, 0.0)] {
        assert_eq!(falling.set("raw", raw).scan().real("a.value"), value, "a range that falls");
    }
}

#[test]
fn a_broken_wire_is_flagged_and_the_last_value_stays() {
    for raw in [0, 3_599, 21_001, 32_767, -1] {
        let mut a = input("");
        assert_eq!(a.scan().real("a.value"), 25.0);
        a.set("raw", raw).run(500);
        assert!(!a.on("a.broken") && !a.on("a.good"), "{raw}");
        assert!(a.scan().on("a.broken"), "{raw}");
        assert_eq!(a.run(10_000).real("a.value"), 25.0);
        a.set("raw", 4_000).scan();
        assert_eq!((a.on("a.broken"), a.on("a.good"), a.real("a.value")), (false, true, 0.0));
    }
}

#[test]
fn a_spike_neither_flags_a_broken_wire_nor_changes_the_value() {
    let mut a = input("");
    a.scan();
    for _ in 0..20 {
        assert!(!a.set("raw", 0).run(490).on("a.broken"));
        assert_eq!(a.real("a.value"), 25.0);
        a.set("raw", 12_000).scan();
    }
}

/// If the wire was never whole, there is no last value: `good` is OFF from the first scan on.
#[test]
fn a_wire_broken_from_the_start_is_flagged() {
    let mut a = bench(
        "scaling",
        "raw = { at = \"D0\" }",
        "{ use = \"AnalogIn\", name = \"a\", with = { raw = \"raw\", low = 10, high = 50 } },",
    );
    assert_eq!((a.scan().on("a.good"), a.real("a.value")), (false, 0.0));
    assert!(a.run(510).on("a.broken"));
}

fn thermostat(template: &str, tag: &str) -> Bench {
    let uses = format!(
        "{{ use = \"{template}\", name = \"h\", \
         with = {{ value = \"value\", high = 60, low = 40 }} }},"
    );
    bench("hysteresis", &format!("value = {{ at = \"{tag}\" }}"), &uses)
}

/// Values in this order, each with the state of the bit.
const STORY: [(i16, bool); 13] = [
    (50, false),
    (60, false),
    (61, true),
    (60, true),
    (41, true),
    (40, true),
    (39, false),
    (40, false),
    (59, false),
    (60, false),
    (32_000, true),
    (-32_000, false),
    (50, false),
];

#[test]
fn hysteresis_turns_a_bit_on_above_one_limit_and_off_below_the_other() {
    let mut reals = thermostat("Hysteresis", "R0");
    let mut integers = thermostat("HysteresisInt", "D0");
    for (value, on) in STORY {
        assert_eq!(reals.put("value", f32::from(value)).scan().on("h.on"), on, "{value}");
        assert_eq!(integers.set("value", i32::from(value)).scan().on("h.on"), on, "{value}");
    }
}

#[test]
fn noise_within_the_band_does_not_switch_the_output() {
    for (begin, on) in [(70.0, true), (30.0, false)] {
        let mut h = thermostat("Hysteresis", "R0");
        h.put("value", begin).scan();
        for step in 0..1_000_u16 {
            h.put("value", 40.0 + f32::from(step * 7 % 201) / 10.0).scan();
            assert_eq!(h.on("h.on"), on);
        }
    }
}
