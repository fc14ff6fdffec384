//! The templates that keep a bit ON or OFF for a time: pulse, short cycle.

use super::{Bench, bench};

/// Moves X0 without a rhythm, and returns how long a bit was ON, or OFF, each time, in ms. The first
/// and the last time are left out: begin and end cut them off.
fn lengths(b: &mut Bench, name: &str, state: bool) -> Vec<u64> {
    let mut states = Vec::new();
    for scan in 0..5_000 {
        b.set("X0", i32::from(scan % 17 < 3 || scan % 41 < 20));
        states.push(b.scan().on(name));
    }
    let runs: Vec<&[bool]> = states.chunk_by(|one, next| one == next).collect();
    let whole = &runs[1..runs.len() - 1];
    let period = b.plc.period_ns / 1_000_000;
    whole.iter().filter(|run| run[0] == state).map(|run| run.len() as u64 * period).collect()
}

fn assert_shortest(lengths: &[u64], wanted: u64, period: u64) {
    let shortest = lengths.iter().min().expect("it was so at least once");
    let right = *shortest >= wanted && *shortest < wanted + period;
    assert!(right, "scans of {period} ms: {shortest} ms, not {wanted}");
}

#[test]
fn every_pulse_has_its_length_at_any_scan_period() {
    let uses = r#"{ use = "Pulse", name = "p", with = { trigger = "X0", length = "130ms" } },"#;
    for period in [1, 7, 10, 30, 90, 250] {
        let mut p = bench("pulse", "", uses).period(period);
        let on = lengths(&mut p, "p.on", true);
        assert_shortest(&on, 130, period);
        assert!(on.iter().all(|length| *length == on[0]), "scans of {period} ms: {on:?}");
    }
}

#[test]
fn an_edge_within_a_pulse_does_not_retrigger_it() {
    let uses = r#"{ use = "Pulse", name = "p", with = { trigger = "X0", length = "40ms" } },"#;
    for edge in 1..=5 {
        let mut p = bench("pulse", "", uses);
        p.set("X0", 1).scan().set("X0", 0);
        let mut seen = String::from("1");
        for scan in 1..12 {
            p.set("X0", i32::from(scan == edge));
            seen.push(if p.scan().on("p.on") { '1' } else { '0' });
        }
        // The edge of scan 5 comes one scan after the end.
        let wanted = if edge == 5 { "111101111000" } else { "111100000000" };
        assert_eq!(seen, wanted, "the second edge in scan {edge}");
    }
}

#[test]
fn a_stop_ends_a_pulse_and_the_next_pulse_has_its_full_length() {
    let uses = r#"{ use = "Pulse", name = "p", with = { trigger = "X0", length = "40ms" } },"#;
    let mut p = bench("pulse", "", uses);
    assert!(p.set("X0", 1).run(20).set("X0", 0).scan().on("p.on"));
    p.restart();
    assert_eq!(p.watch("p.on", 500), (0, 0));
    p.set("X0", 1);
    assert_eq!(p.watch("p.on", 500), (4, 1));
}

fn compressor() -> Bench {
    let uses = r#"{ use = "ShortCycle", name = "s",
        with = { wanted = "X0", trip = "X1", on_time = "130ms", off_time = "310ms" } },"#;
    bench("short-cycle", "", &uses.replace('\n', " "))
}

#[test]
fn a_short_cycle_keeps_both_minimum_times_at_any_scan_period() {
    for period in [1, 7, 10, 30, 90, 250] {
        let on = lengths(&mut compressor().period(period), "s.run", true);
        let off = lengths(&mut compressor().period(period), "s.run", false);
        let least = |lengths: &[u64]| lengths.iter().min().copied().unwrap_or(u64::MAX);
        assert!(least(&on) >= 130 && least(&off) >= 310, "{period} ms: {on:?}, {off:?}");
    }
    // With short scans X0 moves faster than both times, which then last no longer than they must.
    assert_shortest(&lengths(&mut compressor(), "s.run", true), 130, 10);
    assert_shortest(&lengths(&mut compressor(), "s.run", false), 310, 10);
}

#[test]
fn a_trip_stops_the_machine_at_once_and_a_start_waits_for_the_time_off() {
    let mut s = compressor();
    s.set("X0", 1).run(310);
    assert!(!s.on("s.run") && s.on("s.waiting"));
    assert!(s.scan().on("s.run"));
    assert!(!s.set("X1", 1).scan().on("s.run"));
    s.set("X1", 0).run(300);
    assert!(!s.on("s.run"));
    assert!(s.scan().on("s.run"));
    s.restart().run(310);
    assert!(!s.on("s.run"));
    assert!(s.scan().on("s.run"));
}
