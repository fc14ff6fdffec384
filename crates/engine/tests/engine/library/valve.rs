//! The valve, with one that moves as it is told, and one that does not.

use super::{Bench, bench};

/// A valve and its motor. Its position is between 0, closed, and its travel time in ms.
struct Machine {
    bench: Bench,
    travel_ms: i64,
    position_ms: i64,
    /// It does not move.
    stuck: bool,
}

impl Machine {
    fn new(period: u64, travel_ms: i64) -> Machine {
        let uses = "{ use = \"Valve\", name = \"v\", with = { wanted = \"X0\", open_switch = \
                    \"X1\", closed_switch = \"X2\", open_time = \"2s\", close_time = \"2s\", \
                    reset = \"X3\" } },";
        let bench = bench("valve", "", uses).period(period);
        Machine { bench, travel_ms, position_ms: 0, stuck: false }
    }

    /// A scan, and what the motor does until the next one.
    fn scan(&mut self) -> &mut Machine {
        let bench = &mut self.bench;
        bench.set("X1", i32::from(self.position_ms == self.travel_ms));
        bench.set("X2", i32::from(self.position_ms == 0)).scan();
        let way = i64::from(bench.on("v.opening")) - i64::from(bench.on("v.closing"));
        let step = way * (bench.plc.period_ns / 1_000_000).cast_signed();
        if !self.stuck {
            self.position_ms = (self.position_ms + step).clamp(0, self.travel_ms);
        }
        self
    }

    fn run(&mut self, ms: u64) -> &mut Machine {
        let end = self.bench.plc.now_ns + ms * 1_000_000;
        while self.bench.plc.now_ns < end {
            self.scan();
        }
        self
    }

    /// How long the motor has power within some time, in ms.
    fn power(&mut self, ms: u64) -> u64 {
        let end = self.bench.plc.now_ns + ms * 1_000_000;
        let mut scans = 0;
        while self.bench.plc.now_ns < end {
            self.scan();
            scans += u64::from(self.bench.on("v.opening") || self.bench.on("v.closing"));
        }
        scans * self.bench.plc.period_ns / 1_000_000
    }

    fn faults(&self) -> String {
        self.bench.bits(&["v.not_opened", "v.not_closed", "v.moved", "v.switches", "v.fault"])
    }
}

#[test]
fn a_valve_that_moves_has_no_fault_at_any_scan_period() {
    for period in [1, 7, 10, 30, 90, 250] {
        let mut valve = Machine::new(period, 1_500);
        for _ in 0..5 {
            valve.bench.set("X0", 1);
            valve.run(3_000);
            assert!(valve.bench.on("v.is_open"), "scans of {period} ms");
            valve.bench.set("X0", 0);
            valve.run(3_000);
            assert!(valve.bench.on("v.is_closed"), "scans of {period} ms");
        }
        assert_eq!(valve.faults(), "00000", "scans of {period} ms");
    }
}

#[test]
fn a_valve_that_is_too_slow_reports_a_fault_and_closes() {
    for period in [1, 7, 10, 30, 90, 250] {
        let mut valve = Machine::new(period, 2_600);
        valve.run(1_000).bench.set("X0", 1);
        valve.run(2_000 + 2 * period);
        assert_eq!(valve.faults(), "10001", "scans of {period} ms");
        assert!(!valve.bench.on("v.drive"), "scans of {period} ms");
        valve.run(5_000);
        assert!(valve.bench.on("v.is_closed"), "it came back in its time: {period} ms");
        assert_eq!(valve.faults(), "10001", "scans of {period} ms");
    }
}

/// Whatever fails, a motor has no power for longer than a travel time after each command, reset or
/// departure.
#[test]
fn a_stalled_motor_loses_its_power_after_the_travel_time() {
    for period in [1, 7, 10, 30, 90] {
        let mut valve = Machine::new(period, 1_500);
        valve.run(1_000).stuck = true;
        valve.bench.set("X0", 1);
        assert!(valve.power(60_000) <= 2_000 + period, "opening, scans of {period} ms");
        let mut valve = Machine::new(period, 1_500);
        valve.bench.set("X0", 1);
        valve.run(1_000).stuck = true;
        let power = valve.power(60_000);
        assert!(power <= 3_000 + 2 * period, "on its way: {power} ms, scans of {period} ms");
        assert_eq!(valve.faults(), "11001");
        valve.bench.set("X0", 0).set("X3", 1);
        assert!(valve.power(60_000) <= 2_000 + period, "after a reset, scans of {period} ms");
        valve.stuck = false;
        valve.bench.set("X3", 0);
        valve.run(100);
        valve.bench.set("X3", 1);
        valve.run(3_000);
        assert!(valve.bench.on("v.is_closed"), "scans of {period} ms");
        assert_eq!(valve.faults(), "00000");
        // By hand, without a command.
        valve.position_ms = 700;
        valve.stuck = true;
        assert!(valve.power(60_000) <= 2_500 + 2 * period, "scans of {period} ms");
        assert_eq!(valve.faults(), "01101");
    }
}

#[test]
fn a_valve_keeps_its_faults_over_a_stop_and_gets_a_whole_travel_time() {
    let mut valve = Machine::new(10, 1_500);
    valve.bench.set("X0", 1);
    valve.run(3_000).bench.restart();
    valve.bench.set("X0", 0);
    valve.run(3_000);
    assert_eq!(valve.faults(), "00000", "it was open at the start");
    assert!(valve.bench.on("v.is_closed"));
    valve.stuck = true;
    valve.bench.set("X0", 1);
    valve.run(3_000).bench.restart();
    assert!(!valve.scan().bench.on("v.drive"));
    assert_eq!(valve.faults(), "10001");
}
