//! Tests of the time of day that the scanner passes to the machine.

use super::*;

#[test]
fn the_clock_of_the_day_may_jump_and_no_scan_comes_sooner_or_later() {
    let mut rig = rig(|_, _| {});
    let mut scan_at = |local_s: i64| {
        rig.clock.1.set(local_s);
        let at = rig.scans_at_ms(1)[0];
        let local = rig.local.get();
        (at, local.year, local.hour)
    };
    assert_eq!(scan_at(LocalTime::SIMULATED_S + 7199), (0, 2001, 1));
    assert_eq!(scan_at(LocalTime::SIMULATED_S + 7200), (10, 2001, 2));
    assert_eq!(scan_at(LocalTime::SIMULATED_S + 3600), (20, 2001, 1));
    assert_eq!(scan_at(LocalTime::SIMULATED_S + 3652 * 86_400), (30, 2011, 0));
    assert_eq!(scan_at(-1), (40, 1969, 23));
    assert_eq!(rig.scanner.report().statistics.overruns, 0);
}
