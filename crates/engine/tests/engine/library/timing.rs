//! The templates that measure time: debounce, flasher, hour meter, tick, totalizer.

use super::{Bench, bench};

fn debounce(delays: &str) -> Bench {
    let uses =
        format!("{{ use = \"Debounce\", name = \"d\", with = {{ raw = \"X0\"{delays} }} }},");
    bench("debounce", "", &uses)
}

#[test]
fn a_bounce_shorter_than_the_delay_does_not_change_the_output() {
    let mut d = debounce("");
    for _ in 0..20 {
        d.set("X0", 1).run(40);
        assert!(!d.on("d.on"), "each bounce begins the time anew");
        d.set("X0", 0).run(10);
        assert!(!d.on("d.on"));
    }
}

#[test]
fn both_edges_are_delayed_by_their_times() {
    let mut d = debounce(", on_delay = \"50ms\", off_delay = \"30ms\"");
    assert!(!d.set("X0", 1).run(50).on("d.on"), "50 ms are over at the next scan");
    assert!(d.scan().on("d.on"));
    for _ in 0..20 {
        d.set("X0", 0).run(20);
        assert!(d.on("d.on"));
        assert!(d.set("X0", 1).run(10).on("d.on"));
    }
    assert!(d.set("X0", 0).run(30).on("d.on"));
    assert!(!d.scan().on("d.on"));
    assert!(!d.run(1_000).on("d.on"));
}

#[test]
fn a_debounce_without_delays_follows_its_input() {
    let mut d = debounce(", on_delay = \"0ms\", off_delay = \"0ms\"");
    for state in [1, 0, 0, 1, 1, 0, 1] {
        assert_eq!(d.set("X0", state).scan().int("d.on"), i64::from(state));
    }
}

fn flasher(bright: &str, dark: &str) -> Bench {
    let uses = format!(
        "{{ use = \"Flasher\", name = \"f\", \
         with = {{ wanted = \"X0\", bright = \"{bright}\", dark = \"{dark}\" }} }},"
    );
    bench("flasher", "", &uses)
}

#[test]
fn a_flasher_starts_lit_and_keeps_both_times() {
    let mut f = flasher("50ms", "30ms");
    assert!(!f.run(100).on("f.lit"), "it is not wanted");
    f.set("X0", 1);
    let lit: String = (0..24).map(|_| if f.scan().on("f.lit") { '1' } else { '0' }).collect();
    assert_eq!(lit, "111110001111100011111000");
    assert!(!f.set("X0", 0).scan().on("f.lit"));
    assert!(f.set("X0", 1).scan().on("f.lit"), "it begins bright again");
}

/// 60 periods of 1 s last a minute with scans of any length.
#[test]
fn a_flasher_does_not_drift() {
    for period in [1, 7, 10, 30, 90] {
        let mut f = flasher("300ms", "700ms").period(period);
        f.set("X0", 1);
        let (scans, rises) = f.watch("f.lit", 60_000);
        let lit_ms = u64::from(scans) * period;
        assert_eq!(rises, 60, "scans of {period} ms");
        assert!(lit_ms.abs_diff(18_000) <= period * 5, "scans of {period} ms: {lit_ms} ms");
    }
}

#[test]
fn two_flashers_of_the_same_contact_flash_together() {
    let uses = r#"
        { use = "Flasher", name = "f", with = { wanted = "X0" } },
        { use = "Flasher", name = "g", with = { wanted = "X0" } },"#;
    let mut both = bench("flasher", "", uses).period(30);
    both.set("X0", 1);
    for _ in 0..1_000 {
        both.scan();
        assert_eq!(both.on("f.lit"), both.on("g.lit"));
    }
}

#[test]
fn a_flasher_with_one_zero_time_stays_in_the_other_state() {
    for (bright, dark, lit) in [("500ms", "0ms", true), ("0ms", "500ms", false)] {
        let mut f = flasher(bright, dark);
        f.set("X0", 1);
        for _ in 0..200 {
            assert_eq!(f.scan().on("f.lit"), lit);
        }
    }
    let mut f = flasher("0ms", "0ms");
    assert!(!f.set("X0", 1).run(100).on("$DivideByZero"));
}

fn hour_meter(hour: &str) -> Bench {
    let uses = format!(
        "{{ use = \"HourMeter\", name = \"h\", \
         with = {{ running = \"X0\", service = 3, done = \"X1\", hour = \"{hour}\" }} }},"
    );
    bench("hour-meter", "", &uses)
}

#[test]
fn an_hour_meter_counts_only_while_running() {
    let mut h = hour_meter("1s");
    assert_eq!(h.run(5_000).int("h.hours"), 0);
    h.set("X0", 1).run(1_500).set("X0", 0).run(10_000);
    assert_eq!((h.int("h.hours"), h.int("h.part.Acc")), (1, 490), "one scan to see it run");
    h.set("X0", 1).run(520).set("X0", 0).run(1_000);
    assert_eq!(h.int("h.hours"), 2, "the part of an hour is kept");
}

/// 200 hours, here of 1 s each, with scans that do not divide a second.
#[test]
fn an_hour_meter_does_not_drift() {
    for period in [7, 10, 30, 300] {
        let mut h = hour_meter("1s").period(period);
        h.set("X0", 1).run(200_000 + period);
        let total = h.int("h.hours") * 1_000 + h.int("h.part.Acc");
        assert!(total.abs_diff(200_000) <= period, "scans of {period} ms: {total} ms");
    }
}

#[test]
fn an_hour_meter_keeps_a_fraction_of_an_hour_over_a_stop() {
    let mut h = hour_meter("1h").period(1_000);
    h.set("X0", 1);
    for _ in 0..10 {
        h.run(600_000).restart();
    }
    assert_eq!(h.int("h.hours"), 1, "ten times ten minutes, {} ms", h.int("h.part.Acc"));
    assert!(h.int("h.part.Acc") >= 2_380_000, "a scan is lost at each start");
}

#[test]
fn service_stays_due_until_it_is_reset() {
    let mut h = hour_meter("1s");
    h.set("X0", 1).run(2_990);
    assert_eq!((h.int("h.since"), h.on("h.due")), (2, false));
    h.run(40);
    assert_eq!((h.int("h.since"), h.on("h.due")), (3, true));
    h.set("X1", 1).scan().set("X1", 0).scan();
    assert_eq!((h.int("h.since"), h.on("h.due"), h.int("h.hours")), (0, false, 3));
    h.run(1_000);
    assert_eq!((h.int("h.since"), h.int("h.hours")), (1, 4));
}

/// The sum of a word over the scans of some time.
fn sum(bench: &mut Bench, name: &str, ms: u64) -> i64 {
    let end = bench.plc.now_ns + ms * 1_000_000;
    let mut sum = 0;
    while bench.plc.now_ns < end {
        sum += bench.scan().int(name);
    }
    sum
}

/// 600 periods of 100 ms last a minute with scans of any length, longer ones too.
#[test]
fn a_tick_does_not_drift() {
    let uses = "{ use = \"Tick\", name = \"t\", with = { every = \"100ms\" } },";
    for period in [1, 7, 10, 30, 90, 250] {
        let mut t = bench("tick", "", uses).period(period);
        t.scan();
        let ticks = sum(&mut t, "t.count", 60_000);
        let part = t.int("t.time.Acc");
        let passed = (t.plc.now_ns / 1_000_000).cast_signed() - period.cast_signed();
        assert_eq!(ticks * 100 + part, passed, "scans of {period} ms");
        let mut t = bench("tick", "", uses).period(period);
        t.scan();
        let (scans, _) = t.watch("t.now", 60_000);
        let most = 60_000 / period.max(100);
        assert!(u64::from(scans).abs_diff(most) <= 1, "scans of {period} ms: {scans}");
    }
}

#[test]
fn a_disabled_tick_restarts_its_interval() {
    let uses = "{ use = \"Tick\", name = \"t\", with = { every = \"50ms\", wanted = \"X0\" } },";
    let mut t = bench("tick", "", uses);
    assert_eq!(sum(&mut t, "t.count", 1_000), 0);
    t.set("X0", 1).run(40).set("X0", 0).run(100).set("X0", 1);
    let ticks: String = (0..16).map(|_| if t.scan().on("t.now") { '1' } else { '0' }).collect();
    assert_eq!(ticks, "0000010000100001");
    t.restart();
    assert_eq!(sum(&mut t, "t.count", 50), 0, "a stop begins anew");
}

/// Sixty days, longer than milliseconds fit into 32 bits, with scans of about a minute.
#[test]
fn a_tick_is_exact_over_weeks() {
    let uses = "{ use = \"Tick\", name = \"t\", with = { every = \"1h\" } },";
    let mut t = bench("tick", "", uses).period(61_007);
    t.scan();
    let begin = t.plc.now_ns;
    let hours = sum(&mut t, "t.count", 60 * 24 * 3_600_000);
    let passed = ((t.plc.now_ns - begin) / 1_000_000).cast_signed();
    assert_eq!((hours, t.int("t.time.Acc")), (passed / 3_600_000, passed % 3_600_000));
    assert_eq!(hours, 1_440);
}

fn totalizer(rate: &str, per: &str) -> Bench {
    let uses = format!(
        "{{ use = \"Totalizer\", name = \"q\", \
         with = {{ rate = \"{rate}\", per = \"{per}\", count = \"X0\", clear = \"X1\" }} }},"
    );
    bench("totalizer", "flow = { at = \"R0\" }", &uses)
}

/// In billionths of a unit.
fn totalled(q: &Bench) -> i64 {
    q.int("q.total") * 1_000_000_000 + q.int("q.part")
}

/// The total is that of the time that passed, with scans of any length: to a billionth.
#[test]
fn a_totalizer_counts_exactly_at_any_scan_period() {
    for period in [1, 7, 10, 250] {
        for (rate, per, each_ms) in [
            ("90.0", "1m", 90.0 / 60_000.0),
            ("0.01", "1h", f64::from(0.01_f32) / 3_600_000.0),
            ("3600000.0", "1s", 3_600.0),
        ] {
            let mut q = totalizer(rate, per).period(period);
            q.set("X0", 1).scan();
            let begin = q.plc.now_ns;
            q.run(20_000);
            let passed = (q.plc.now_ns - begin) as f64 / 1e6;
            let wanted = passed * each_ms * 1e9;
            let total = totalled(&q);
            let off = (total as f64 - wanted).abs();
            assert!(off <= 2.0, "{rate} in {per}, scans of {period} ms: {total}, not {wanted}");
        }
    }
}

#[test]
fn a_totalizer_counts_only_while_enabled_and_accepts_negative_flow() {
    let mut q = totalizer("flow", "1s");
    q.set("X0", 1).put("flow", 4.0).scan();
    q.run(1_000).set("X0", 0).run(5_000);
    assert_eq!(totalled(&q), 4_000_000_000, "its time while it does not count is left out");
    q.set("X0", 1).run(510);
    assert_eq!(totalled(&q), 6_000_000_000);
    q.put("flow", -1.0).run(500);
    assert_eq!(totalled(&q), 5_500_000_000);
    q.restart().run(260);
    assert_eq!(totalled(&q), 5_240_000_000, "the last scan counts, the stop adds nothing");
    q.set("X1", 1).scan();
    assert_eq!(totalled(&q), 0);
}

/// A river for sixty days: 1.25 units in each scan of 10 s, on top of a hundred million units.
#[test]
fn a_totalizer_is_exact_over_weeks() {
    let mut q = totalizer("0.125", "1s").period(10_000);
    q.set("X0", 1).set("q.total", 100_000_000).scan();
    q.run(60 * 24 * 3_600_000);
    assert_eq!((q.int("q.total"), q.int("q.part")), (100_648_000, 0));
    q.run(10_000);
    assert_eq!((q.int("q.total"), q.int("q.part")), (100_648_001, 250_000_000));
}
