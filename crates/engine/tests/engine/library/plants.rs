//! The templates of plants: they go by time, so they end alike at any scan period, and over a stop.

use super::{Bench, bench};

const PERIODS: [u64; 6] = [1, 7, 10, 30, 90, 250];

fn near(value: f32, wanted: f32, slack: f32) -> bool {
    (value - wanted).abs() <= slack
}

fn tank() -> Bench {
    let uses = "{ use = \"PlantTank\", name = \"t\", with = { inflow = \"in\", outflow = \"out\", \
                capacity = 1000 } },";
    bench("plant-tank", "in = { at = \"R0\" }\nout = { at = \"R1\" }", uses)
}

#[test]
fn a_tank_fills_by_the_time_that_passed() {
    for period in PERIODS {
        let mut t = tank().period(period);
        t.put("in", 50.0).put("out", 20.0).run(10_000);
        let (slack, level) = (30.0 * period as f32 / 1000.0 + 0.01, t.real("t.level"));
        assert!(near(level, 300.0, slack), "{period} ms: {level}");
        t.run(30_000);
        assert!(t.on("t.full") && !t.on("t.empty"), "{period} ms");
        t.put("in", 0.0).put("out", 200.0).run(6_000);
        assert_eq!((t.real("t.level"), t.on("t.empty")), (0.0, true), "{period} ms");
    }
}

/// A litre in a day into 900 litres is less than the digits of a real in a scan.
#[test]
fn a_tank_keeps_what_is_too_small_for_its_digits() {
    let mut t = tank().period(100);
    t.put("t.level", 900.0).put("in", 1.0 / 86_400.0).run(6 * 3_600_000);
    assert!(near(t.real("t.level"), 900.25, 0.001), "{}", t.real("t.level"));
}

#[test]
fn a_tank_goes_on_after_a_stop_as_if_no_time_had_passed() {
    let mut t = tank();
    t.put("in", 10.0).run(1_000);
    let before = t.real("t.level");
    t.restart();
    t.plc.now_ns += 3_600_000_000_000;
    t.run(10);
    assert!(t.real("t.level") - before < 0.3, "{} after {before}", t.real("t.level"));
}

#[test]
fn a_lag_covers_its_share_at_any_scan_period() {
    for period in PERIODS {
        let uses =
            "{ use = \"PlantLag\", name = \"g\", with = { input = \"in\", constant = 10 } },";
        let mut g = bench("plant-lag", "in = { at = \"R0\" }", uses).period(period);
        g.put("in", 1000.0).run(10_000 + period);
        let slack = 1000.0 / 10.0 * period as f32 / 1000.0 + 0.1;
        assert!(near(g.real("g.value"), 632.12, slack), "{period} ms: {}", g.real("g.value"));
        g.run(100_000);
        assert!(near(g.real("g.value"), 1000.0, 0.1), "{period} ms: {}", g.real("g.value"));
    }
}

#[test]
fn a_motor_and_a_valve_need_their_times_at_any_scan_period() {
    for period in PERIODS {
        let uses =
            "{ use = \"PlantMotor\", name = \"m\", with = { run = \"X0\", runup = \"5s\" } },";
        let mut m = bench("plant-motor", "", uses).period(period);
        m.set("X0", 1).run(2_500);
        let slack = 3.0 + 2.0 * 20.0 * period as f32 / 1000.0;
        assert!(near(m.real("m.speed"), 48.8, slack), "{period} ms: {}", m.real("m.speed"));
        m.run(4_000).set("X0", 0).run(6_000);
        assert_eq!((m.real("m.speed"), m.on("m.running")), (0.0, false), "{period} ms");
        let uses = "{ use = \"PlantValve\", name = \"v\", with = { open = \"X0\", close = \"!X0\", \
                    travel = \"5s\" } },";
        let mut v = bench("plant-valve", "", uses).period(period);
        v.set("X0", 1).run(2_500);
        assert!(near(v.real("v.position"), 50.0, slack), "{period} ms: {}", v.real("v.position"));
        v.run(3_000);
        assert!(v.on("v.is_open") && !v.on("v.is_closed"), "{period} ms");
        v.set("X0", 0).run(6_000);
        assert!(v.on("v.is_closed"), "{period} ms");
    }
}

#[test]
fn a_belt_brings_every_part_to_its_end_at_any_scan_period() {
    for period in [1, 7, 10, 30, 90] {
        let uses = "{ use = \"PlantBelt\", name = \"b\", with = { run = \"X0\", feed = \"X1\", speed = \
                    500, length = 2000, at1 = 400, at2 = 1200 } },";
        let mut b = bench("plant-belt", "", uses).period(period);
        b.set("X0", 1).scan();
        let (mut seen, mut eyes) = ([false; 2], [0; 2]);
        for part in 0..50_u64 {
            for half in 0..2 {
                b.set("X1", i32::from(half == 0));
                let end = b.plc.now_ns + 300_000_000 + part * 1_000_000;
                while b.plc.now_ns < end {
                    b.scan();
                    for (at, name) in ["b.eye1", "b.eye2"].into_iter().enumerate() {
                        eyes[at] += i32::from(b.on(name) && !seen[at]);
                        seen[at] = b.on(name);
                    }
                }
            }
        }
        b.run(10_000);
        assert_eq!((b.int("b.passed"), b.int("b.parts")), (50, 0), "{period} ms");
        let counted = eyes.map(|times| (47..=50).contains(&times));
        assert_eq!(counted, [true; 2], "{period} ms: {eyes:?}");
    }
}

#[test]
fn a_drive_reaches_its_reference_at_any_scan_period() {
    for period in PERIODS {
        let tags = "c = { at = \"D0\" }\nr = { at = \"D1\" }\ns = { at = \"D2\" }";
        let uses = "{ use = \"PlantDrive\", name = \"d\", with = { control = \"c\", reference = \"r\", \
                    status = \"s\", rate = 500, fault = \"X0\" } },";
        let mut d = bench("plant-drive", tags, uses).period(period);
        d.set("c", 15).set("r", -1500).run(1_000);
        let slack = 500.0 * period as f32 / 1000.0 + 0.1;
        assert!(near(d.real("d.speed"), -500.0, slack), "{period} ms: {}", d.real("d.speed"));
        d.run(3_000);
        assert_eq!((d.real("d.speed"), d.int("s")), (-1500.0, 0x637), "{period} ms");
        d.set("X0", 1).run(4_000);
        assert_eq!((d.real("d.speed"), d.int("s")), (0.0, 0x238), "{period} ms");
    }
}
