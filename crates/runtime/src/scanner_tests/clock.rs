//! Tests of the time of day that the scanner passes to the machine, and of the clock of deadlines.

use super::super::command::{CommandDenial, CommandOutcome, ScanCommand};
use super::super::exchange::BatchTerms;
use super::*;

#[test]
fn a_jump_of_the_wall_clock_does_not_move_any_scan() {
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

/// The clock of the scan's grid stands still in a suspend, the client's wait does not.
#[test]
fn a_write_that_waited_through_a_suspend_expires() {
    let mut rig = rig(|_, _| {});
    rig.step();
    let until_ns = rig.clock.now_ns() + 5_000 * MS;
    let terms = BatchTerms { until_ns, ..BatchTerms::of(0) };
    let hand_in = |port: &Port| {
        let force = ScanCommand::Force { cell: engine::Cell::Word(WordCell(0)), value: 7 };
        let write = port.submit_by(terms, vec![OperandWrite::Bit(BitCell(2), true)]).unwrap();
        (write, port.command_until(until_ns, 0, force).unwrap())
    };
    let (write, force) = hand_in(&rig.port);
    rig.steps(2);
    assert_eq!(rig.port.outcome(write), BatchOutcome::Applied);
    assert!(matches!(rig.port.answer(force), Some(CommandOutcome::Done(_))));
    let (write, force) = hand_in(&rig.port);
    rig.clock.2.set(3_600_000 * MS);
    rig.steps(2);
    assert_eq!(rig.port.outcome(write), BatchOutcome::Refused(BatchRefusal::Late));
    assert_eq!(rig.port.answer(force), Some(CommandOutcome::Denied(CommandDenial::Late)));
}
