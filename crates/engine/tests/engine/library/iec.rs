//! The blocks of IEC 61131-3: what their timing diagrams leave open, with short and long scans.

use super::{Bench, bench};

fn timers(span: &str) -> Bench {
    let timer = |template: &str, name: &str| {
        format!(
            "{{ use = \"{template}\", name = \"{name}\", with = {{ IN = \"X0\", PT = \"{span}\" }} }},"
        )
    };
    let uses = [timer("Ton", "on"), timer("Tof", "off"), timer("Tp", "pulse")].concat();
    bench("iec", "", &uses)
}

#[test]
fn a_time_is_over_in_the_first_scan_at_or_after_it_whatever_the_period_is() {
    for period in [1, 7, 10, 30, 90] {
        let mut t = timers("100ms").period(period);
        t.run(500).set("X0", 1);
        let scans = 100_u64.div_ceil(period);
        for scan in 0..=scans {
            t.scan();
            let is_over = scan == scans;
            assert_eq!(t.on("on.Q"), is_over, "period {period}, scan {scan}");
            assert_eq!(t.on("pulse.Q"), !is_over, "period {period}, scan {scan}");
        }
        assert_eq!([t.int("on.ET"), t.int("pulse.ET")], [100, 100]);
        t.set("X0", 0);
        for scan in 0..=scans {
            t.scan();
            assert_eq!(t.on("off.Q"), scan < scans, "period {period}, scan {scan}");
        }
        assert_eq!(t.int("off.ET"), 100);
    }
}

#[test]
fn a_time_of_0_is_over_one_scan_after_the_edge() {
    let mut t = timers("0ms");
    t.run(50).set("X0", 1).scan();
    assert_eq!([t.on("on.Q"), t.on("pulse.Q"), t.on("off.Q")], [false, true, true]);
    t.scan();
    assert_eq!([t.on("on.Q"), t.on("pulse.Q"), t.on("off.Q")], [true, false, true]);
    assert!(t.set("X0", 0).scan().on("off.Q"));
    assert!(!t.scan().on("off.Q"));
}

#[test]
fn a_pulse_begins_again_only_after_its_input_was_off() {
    let mut t = timers("30ms");
    t.run(50);
    let inputs = [1, 0, 1, 1, 1, 0, 1, 1, 1, 1, 0, 0];
    let pulse: String = inputs
        .into_iter()
        .map(|input| if t.set("X0", input).scan().on("pulse.Q") { '1' } else { '0' })
        .collect();
    assert_eq!(pulse, "111000111000");
}

#[test]
fn counters_stop_at_their_limits_and_their_resets_use_up_an_edge() {
    let uses = "{ use = \"Ctu\", name = \"up\", with = { CU = \"X0\", R = \"X1\", PV = 2 } },\
                { use = \"Ctd\", name = \"down\", with = { CD = \"X0\", LD = \"X1\", PV = 2 } },";
    let mut c = bench("iec", "", uses);
    assert_eq!([c.scan().on("up.Q"), c.on("down.Q")], [false, true]);
    c.set("X1", 1).set("X0", 1).scan();
    assert_eq!([c.int("up.CV"), c.int("down.CV")], [0, 2]);
    c.set("X1", 0).scan();
    assert_eq!([c.int("up.CV"), c.int("down.CV")], [0, 2], "the edge is used up");
    for _ in 0..4 {
        c.set("X0", 0).scan();
        c.set("X0", 1).scan();
    }
    assert_eq!([c.int("up.CV"), c.int("down.CV")], [2, 0]);
    assert_eq!([c.on("up.Q"), c.on("down.Q")], [true, true]);
}
