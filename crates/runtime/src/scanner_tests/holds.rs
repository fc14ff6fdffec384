//! Tests of bits that are held ON: the scan itself turns them OFF at the end of their hold.

use super::super::command::ScanCommand;
use super::super::exchange::{BatchTerms, Ticket};
use super::super::hold_step::{HOLDS_MAX, HoldStep};
use super::*;
use rungd_engine::WordBitCell;

/// A bit of the word that counts scans, far above them: nothing else changes it.
const BIT: WordBitCell = WordBitCell { word: WordCell(0), mask: 1 << 20 };

impl Rig {
    fn submit(&self, step: HoldStep, writes: Vec<OperandWrite>) -> Ticket {
        let terms = BatchTerms { hold: Some(step), ..BatchTerms::of(0) };
        self.port.submit_by(terms, writes).expect("it is accepted")
    }

    /// Begins a hold of so many ms from now.
    fn hold(&self, ms: u64) -> Ticket {
        let until_ns = self.clock.boottime_ns() + ms * MS;
        self.submit(HoldStep::Begin { until_ns }, vec![OperandWrite::WordBit(BIT, true)])
    }

    fn keep(&self, hold: Ticket, ms: u64) -> Ticket {
        let until_ns = self.clock.boottime_ns() + ms * MS;
        self.submit(HoldStep::Keep { hold, until_ns }, Vec::new())
    }

    fn is_on(&self) -> bool {
        self.port.latest().value(engine::Cell::WordBit(BIT)) != 0
    }

    /// The time from now to the scan that turned the bit OFF, and to the scan before it, in ms.
    fn goes_off(&mut self) -> (u64, u64) {
        let begun_ns = self.clock.now_ns();
        let ms = |rig: &Rig| (rig.port.latest().now_ns.saturating_sub(begun_ns)) / MS;
        let mut before = 0;
        for _ in 0..100 {
            self.step();
            if !self.is_on() {
                return (before, ms(self));
            }
            before = ms(self);
        }
        panic!("it stays ON");
    }
}

#[test]
fn a_bit_goes_off_in_the_first_scan_after_the_end_of_its_hold() {
    let mut rig = rig(|_, _| {});
    rig.step();
    let hold = rig.hold(400);
    rig.step();
    assert!(rig.is_on());
    assert_eq!(rig.port.outcome(hold), BatchOutcome::Applied);
    let (before, at) = rig.goes_off();
    assert!(before <= 400 && at <= 410 && at > 380, "{before} {at}");
    let late = rig.keep(hold, 400);
    rig.step();
    assert_eq!(rig.port.outcome(late), BatchOutcome::Refused(BatchRefusal::HoldEnded));
    assert!(!rig.is_on());
}

#[test]
fn a_hold_that_is_kept_up_goes_on_and_never_ends_earlier() {
    let mut rig = rig(|_, _| {});
    let hold = rig.hold(100);
    for _ in 0..50 {
        rig.step();
        rig.keep(hold, 100);
        // One that was long on its way does not shorten it.
        rig.keep(hold, 1);
        assert!(rig.is_on());
    }
    let (before, at) = rig.goes_off();
    assert!(before <= 100 && at <= 110, "{before} {at}");
}

#[test]
fn a_renewal_writes_nothing_so_what_the_ladder_turns_off_stays_off() {
    let mut rig = rig(|_, _| {});
    let hold = rig.hold(100);
    rig.step();
    rig.port.submit(vec![OperandWrite::WordBit(BIT, false)]).unwrap();
    rig.step();
    let kept = rig.keep(hold, 100);
    rig.step();
    assert_eq!(rig.port.outcome(kept), BatchOutcome::Applied);
    assert!(!rig.is_on());
}

#[test]
fn a_released_hold_ends_in_the_next_scan_and_another_hold_of_the_bit_goes_on() {
    let mut rig = rig(|_, _| {});
    let [one, two] = [rig.hold(1000), rig.hold(1000)];
    rig.step();
    rig.submit(HoldStep::End { hold: one }, Vec::new());
    rig.steps(2);
    assert!(rig.is_on(), "the second hold goes on");
    rig.submit(HoldStep::End { hold: two }, Vec::new());
    rig.step();
    assert!(!rig.is_on());
    let again = rig.keep(two, 1000);
    rig.step();
    assert_eq!(rig.port.outcome(again), BatchOutcome::Refused(BatchRefusal::HoldEnded));
}

#[test]
fn a_stop_ends_every_hold_before_the_first_scan_of_the_next_run() {
    let mut rig = rig(|_, _| {});
    rig.hold(60_000);
    rig.step();
    for command in [ScanCommand::Stop, ScanCommand::Run] {
        rig.port.command(command).unwrap();
        rig.steps(3);
    }
    assert_eq!(rig.port.latest().mode, Mode::Run);
    assert!(!rig.is_on());
}

#[test]
fn a_hold_ends_though_the_machine_was_suspended_and_over_a_reload() {
    let mut rig = rig(|_, _| {});
    let hold = rig.hold(400);
    rig.step();
    rig.swap(1, MS, false);
    rig.step();
    let kept = rig.keep(hold, 400);
    rig.step();
    assert_eq!(rig.port.outcome(kept), BatchOutcome::Applied, "the hold goes on over a reload");
    rig.clock.2.set(3_600_000 * MS);
    rig.step();
    assert!(!rig.is_on());
}

#[test]
fn there_are_so_many_holds_and_no_more_and_each_of_one_bit() {
    let mut rig = rig(|_, _| {});
    let all: Vec<Ticket> = (0..HOLDS_MAX).map(|_| rig.hold(1000)).collect();
    let more = rig.hold(1000);
    let two = vec![OperandWrite::WordBit(BIT, true), OperandWrite::WordBit(BIT, true)];
    let until_ns = rig.clock.boottime_ns() + 1000 * MS;
    let wrong = rig.submit(HoldStep::Begin { until_ns }, two);
    rig.step();
    assert!(all.iter().all(|hold| rig.port.outcome(*hold) == BatchOutcome::Applied));
    assert_eq!(rig.port.outcome(more), BatchOutcome::Refused(BatchRefusal::HoldsFull));
    assert_eq!(rig.port.outcome(wrong), BatchOutcome::Refused(BatchRefusal::NoHeldBit));
}
