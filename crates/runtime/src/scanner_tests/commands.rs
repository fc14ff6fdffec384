//! Tests of an operator's commands to the scanner.

use super::super::command::{CommandDenial, CommandId, CommandOutcome, ScanCommand, StateBefore};
use super::super::exchange::WordMask;
use super::super::link::SPARES;
use super::*;

const FORCED: engine::Cell = engine::Cell::Word(WordCell(0));

impl Rig {
    pub(super) fn order(&self, command: ScanCommand) -> CommandId {
        self.port.command(command).unwrap()
    }

    pub(super) fn order_and_step(&mut self, command: ScanCommand) -> CommandId {
        let id = self.order(command);
        self.step();
        id
    }

    /// The mode before a command; the command must be done.
    fn done(&self, id: CommandId) -> StateBefore {
        match self.port.answer(id) {
            Some(CommandOutcome::Done(before)) => before,
            other => panic!("{other:?}"),
        }
    }

    fn mode(&self) -> Mode {
        self.port.latest().mode
    }
}

#[test]
fn a_stop_by_an_operator_is_orderly_and_keeps_the_scan_thread() {
    let mut rig = rig(|_, _| {});
    rig.step();
    let stop = rig.order(ScanCommand::Stop);
    assert_eq!(rig.port.answer(stop), None);
    assert!(rig.step() && rig.step());
    assert_eq!(rig.done(stop).mode, Mode::Run);
    let latest = rig.port.latest();
    assert_eq!((latest.scans, latest.mode), (2, Mode::Stop(StopReason::Operator)));
    assert_eq!(latest.since_ns, 1010 * MS);
    assert_eq!((&*latest.bits, &*latest.outputs), (&[1, 0, 0][..], &[0][..]), "terminated");
    let again = rig.order(ScanCommand::Stop);
    rig.step();
    assert_eq!(rig.done(again).mode, Mode::Stop(StopReason::Operator), "nothing to do");
    rig.monitor.beat.request_stop();
    assert!(!rig.step());
}

#[test]
fn a_run_by_an_operator_keeps_memory_and_resets_statistics() {
    let mut rig = rig(|fake, _| fake.takes_ns = vec![25 * MS, MS]);
    rig.steps(2);
    rig.order(ScanCommand::Stop);
    rig.steps(5);
    let words = rig.port.latest().words.clone();
    let run = rig.order(ScanCommand::Run);
    rig.step();
    assert_eq!(rig.done(run).mode, Mode::Stop(StopReason::Operator));
    let began = rig.clock.now_ns();
    rig.step();
    let latest = rig.port.latest();
    assert_eq!((latest.scans, latest.mode, latest.now_ns), (4, Mode::Run, began), "at once");
    assert_eq!(latest.words[0], words[0] + 1);
    assert!(rig.port.submit(vec![]).is_ok());
    rig.steps(3);
    let statistics = rig.scanner.report().statistics;
    assert_eq!((statistics.scans, statistics.overruns), (4, 0));
    let whole = rig.scanner.meter().read(rig.clock.now_ns()).statistics;
    assert_eq!((whole.scans, whole.execution.max_ns), (4, MS));
    let again = rig.order_and_step(ScanCommand::Run);
    assert_eq!(rig.done(again).mode, Mode::Run, "nothing to do");
}

#[test]
fn the_run_command_leaves_a_start_in_stop() {
    let reason = StopReason::RestartGuard;
    let mut rig = rig(|_, settings| settings.pace.start_in_stop = Some(reason));
    rig.step();
    let run = rig.order_and_step(ScanCommand::Run);
    rig.step();
    assert_eq!(rig.done(run).mode, Mode::Stop(reason));
    assert_eq!((rig.mode(), rig.port.latest().scans), (Mode::Run, 1));
}

#[test]
fn an_operator_outside_run_does_not_wait_for_a_long_period() {
    let mut rig = rig(|_, settings| settings.pace.tempo.period_ns = 60_000 * MS);
    rig.order_and_step(ScanCommand::Stop);
    let run = rig.order(ScanCommand::Run);
    let asked = rig.clock.now_ns();
    rig.step();
    assert_eq!(rig.done(run).mode, Mode::Stop(StopReason::Operator));
    assert!(rig.clock.now_ns() - asked <= 100 * MS);
    rig.step();
    assert_eq!((rig.mode(), rig.port.latest().scans), (Mode::Run, 2));
}

#[test]
fn the_run_command_clears_a_fault_after_terminating_executed_blocks() {
    let mut rig = rig(|fake, _| fake.takes_ns = vec![MS, 36 * MS, MS]);
    rig.steps(3);
    let fault = Mode::Fault(FaultReason::ScanTooLong { scan_us: 36_000 });
    assert_eq!(rig.mode(), fault);
    let stop = rig.order_and_step(ScanCommand::Stop);
    assert_eq!(rig.port.answer(stop), Some(CommandOutcome::Denied(CommandDenial::Faulted)));
    rig.heard.take();
    let run = rig.order_and_step(ScanCommand::Run);
    assert_eq!(rig.done(run).mode, fault);
    rig.step();
    // The pass has turned bit 0 ON, and then the scan has toggled it.
    assert_eq!((rig.mode(), rig.port.latest().bits[0]), (Mode::Run, 0));
    assert_eq!(rig.port.latest().scans, 2);
    assert_eq!(rig.heard.take(), ["1: Mode(Run)"]);
}

#[test]
fn a_fault_in_the_first_scan_after_run_is_a_new_fault() {
    let mut rig = rig(|fake, _| fake.takes_ns = vec![36 * MS]);
    rig.step();
    let first = rig.port.latest().since_ns;
    rig.order_and_step(ScanCommand::Run);
    rig.step();
    let latest = rig.port.latest();
    assert!(matches!(latest.mode, Mode::Fault(_)) && latest.since_ns > first);
}

#[test]
fn a_broken_engine_is_not_run_again() {
    let mut rig = rig(|fake, _| fake.panics_in = Some(1));
    rig.steps(3);
    for command in
        [ScanCommand::Run, ScanCommand::Force { cell: FORCED, value: 1 }, ScanCommand::ReleaseAll]
    {
        let id = rig.order_and_step(command);
        assert_eq!(rig.port.answer(id), Some(CommandOutcome::Denied(CommandDenial::EngineBroken)));
    }
    assert_eq!(rig.mode(), Mode::Fault(FaultReason::EnginePanic));
}

#[test]
fn a_stuck_scan_thread_accepts_no_command_until_its_scan_ends() {
    let mut rig = rig(|_, _| {});
    rig.step();
    let waiting = rig.port.submit(vec![]).unwrap();
    let due = rig.clock.now_ns() + 9 * MS;
    rig.monitor.beat.expect(due);
    (0..=36).for_each(|ms| {
        rig.monitor.turn(due + ms * MS);
    });
    assert_eq!(rig.mode(), Mode::Fault(FaultReason::ScanNeverBegins));
    assert_eq!(rig.port.command(ScanCommand::Run), Err(CommandDenial::ScanThreadStuck));
    assert_eq!(rig.port.outcome(waiting), BatchOutcome::Refused(BatchRefusal::NotRunning));
    rig.step();
    rig.step();
    assert_eq!(rig.port.outcome(waiting), BatchOutcome::Refused(BatchRefusal::NotRunning));
    let run = rig.order_and_step(ScanCommand::Run);
    assert_eq!(rig.done(run).mode, Mode::Fault(FaultReason::ScanNeverBegins));
    rig.step();
    assert_eq!(rig.mode(), Mode::Run);
    let ticket = rig.port.submit(vec![OperandWrite::Word(WordCell(0), 50)]).unwrap();
    assert_eq!(rig.port.outcome(ticket), BatchOutcome::Pending);
    rig.step();
    assert_eq!(rig.port.outcome(ticket), BatchOutcome::Applied);
    // The watchdog works again.
    let due = rig.clock.now_ns() + 9 * MS;
    rig.monitor.beat.expect(due);
    (0..=36).for_each(|ms| {
        rig.monitor.turn(due + ms * MS);
    });
    assert_eq!(rig.mode(), Mode::Fault(FaultReason::ScanNeverBegins));
}

#[test]
fn forces_are_shown_in_every_mode_and_change_no_output_outside_run() {
    let output = engine::Cell::Bit(BitCell(1));
    let mut rig = rig(|fake, _| fake.takes_ns = vec![MS, MS, 36 * MS]);
    let force = rig.order_and_step(ScanCommand::Force { cell: FORCED, value: 40 });
    assert_eq!(rig.done(force), StateBefore { mode: Mode::Run, value: 0, forced: false });
    assert_eq!(rig.port.latest().forces.list(), [FORCED]);
    rig.order_and_step(ScanCommand::Stop);
    let force = rig.order_and_step(ScanCommand::Force { cell: output, value: 1 });
    assert_eq!(rig.done(force).value, 0);
    let latest = rig.port.latest();
    assert_eq!((latest.bits[1], latest.outputs[0]), (1, 0), "hold: as terminated");
    let release = rig.order_and_step(ScanCommand::Release(output));
    assert!(rig.done(release).forced);
    assert_eq!(rig.port.latest().forces.list(), [FORCED]);
    rig.order_and_step(ScanCommand::Run);
    rig.step();
    assert!(matches!(rig.mode(), Mode::Fault(_)));
    let word = rig.port.latest().words[0];
    rig.order_and_step(ScanCommand::Force { cell: output, value: 0 });
    let latest = rig.port.latest();
    assert!(matches!(latest.mode, Mode::Fault(_)));
    assert_eq!((latest.bits[1], latest.words[0] == word, latest.outputs[0]), (0, false, 0));
    rig.order_and_step(ScanCommand::ReleaseAll);
    assert_eq!(rig.port.latest().forces.list(), []);
}

#[test]
fn commands_execute_in_order_and_a_run_after_a_stop_runs_again() {
    let mut rig = rig(|_, _| {});
    rig.step();
    let (stop, run) = (rig.order(ScanCommand::Stop), rig.order(ScanCommand::Run));
    rig.steps(3);
    assert_eq!(rig.done(stop).mode, Mode::Run);
    assert_eq!(rig.done(run).mode, Mode::Stop(StopReason::Operator));
    assert_eq!((rig.mode(), rig.port.latest().scans), (Mode::Run, 3));
}

/// A rig with ten seconds between scans; the first scan, at 1 s, is complete.
fn slow() -> Rig {
    let mut rig = rig(|_, settings| {
        settings.pace.tempo = Tempo { period_ns: 10_000 * MS, watchdog_ns: 35 * MS };
    });
    rig.step();
    rig
}

#[test]
fn a_force_does_not_wait_for_the_next_scan_of_a_long_period() {
    let mut rig = slow();
    let force = rig.order(ScanCommand::Force { cell: FORCED, value: 7 });
    let pulses = rig.monitor.beat.pulses();
    rig.step();
    assert_eq!(rig.done(force).mode, Mode::Run);
    assert_eq!(rig.scanner.machine.forced_ns, 1101 * MS, "the scan took 1 ms");
    let latest = rig.port.latest();
    assert_eq!((latest.scans, latest.now_ns), (2, 11_000 * MS), "on the grid");
    assert_eq!(rig.monitor.beat.pulses() - pulses, 100, "it shows that it lives meanwhile");
}

#[test]
fn the_last_scan_does_not_wait_for_the_end_of_a_long_period() {
    let mut rig = slow();
    let stop = rig.order(ScanCommand::Stop);
    rig.step();
    assert_eq!(rig.done(stop).mode, Mode::Run);
    let latest = rig.port.latest();
    assert_eq!((latest.scans, latest.mode), (2, Mode::Stop(StopReason::Operator)));
    assert_eq!(latest.now_ns, 1101 * MS);

    let mut rig = slow();
    rig.monitor.beat.request_stop();
    assert!(!rig.step());
    assert_eq!(rig.port.latest().mode, Mode::Stop(StopReason::Signal));
    assert_eq!(rig.clock.now_ns(), 1102 * MS);
}

#[test]
fn a_queued_stop_does_not_wait_for_the_end_of_a_long_period() {
    let mut rig = slow();
    let force = rig.order(ScanCommand::Force { cell: FORCED, value: 7 });
    let stop = rig.order(ScanCommand::Stop);
    rig.step();
    assert_eq!((rig.done(force).mode, rig.done(stop).mode), (Mode::Run, Mode::Run));
    assert_eq!(rig.port.latest().now_ns, 1101 * MS);
}

/// Steps without a monitor until there are no spare snapshots.
fn without_spares(rig: &mut Rig) {
    for _ in 0..=2 * SPARES {
        rig.scanner.step();
    }
}

#[test]
fn an_answer_waits_for_the_image_that_shows_the_change() {
    let mut rig = rig(|_, _| {});
    without_spares(&mut rig);
    let force = rig.order_and_step(ScanCommand::Force { cell: FORCED, value: 7 });
    assert_eq!((rig.port.answer(force), rig.port.latest().forces.list()), (None, &[][..]));
    rig.step();
    assert_eq!((rig.done(force).mode, rig.port.latest().forces.list()), (Mode::Run, &[FORCED][..]));

    without_spares(&mut rig);
    let stop = rig.order_and_step(ScanCommand::Stop);
    assert_eq!((rig.port.answer(stop), rig.mode()), (None, Mode::Run));
    rig.step();
    assert_eq!(rig.done(stop).mode, Mode::Run);
    assert_eq!(rig.mode(), Mode::Stop(StopReason::Operator));
}

#[test]
fn an_answer_does_not_wait_for_a_free_image_in_a_long_period() {
    let mut rig = slow();
    without_spares(&mut rig);
    let force = rig.order(ScanCommand::Force { cell: FORCED, value: 7 });
    assert!(rig.scanner.pause());
    rig.monitor.turn(rig.clock.now_ns());
    assert_eq!(rig.port.answer(force), None);
    assert!(rig.scanner.pause());
    rig.monitor.turn(rig.clock.now_ns());
    assert_eq!(rig.done(force).mode, Mode::Run);
    assert_eq!(rig.port.latest().forces.list(), [FORCED]);
}

#[test]
fn a_force_in_a_failing_scan_is_shown() {
    let mut rig = rig(|fake, _| fake.takes_ns = vec![MS, 36 * MS]);
    rig.step();
    let force = rig.order_and_step(ScanCommand::Force { cell: FORCED, value: 7 });
    let fault = Mode::Fault(FaultReason::ScanTooLong { scan_us: 36_000 });
    assert_eq!((rig.port.answer(force), rig.mode()), (None, fault));
    rig.step();
    let latest = rig.port.latest();
    assert_eq!((rig.done(force).mode, latest.forces.list()), (Mode::Run, &[FORCED][..]));
    assert_eq!((latest.mode, latest.words[0], latest.scans), (fault, 8, 1));
}

#[test]
fn a_masked_write_changes_the_value_present_in_the_scan() {
    let mut rig = rig(|_, _| {});
    let cell = WordCell(0);
    let mask = |and, or, signed| OperandWrite::Masked { cell, mask: WordMask { and, or }, signed };
    rig.port.submit(vec![OperandWrite::Word(cell, 0x12), mask(0xf2, 0x25, false)]).unwrap();
    rig.step();
    assert_eq!(
        rig.port.latest().words[0],
        0x17 + 1,
        "behind the write before it, and then the scan"
    );
    rig.port.submit(vec![mask(0, 0xff00, true)]).unwrap();
    rig.step();
    assert_eq!(rig.port.latest().words[0], -0x100 + 1);
    rig.port.submit(vec![mask(0x00ff, 0xff00, false)]).unwrap();
    rig.step();
    assert_eq!(rig.port.latest().words[0], 0xff01 + 1);
}
