//! Tests of the two ends of the exchange, called without threads.

use super::command::Forces;
use super::earlier::SWAPS_FOLLOWED;
use super::exchange::{
    BATCH_WRITES_MAX, BatchOutcome, BatchRefusal, BatchTerms, FaultReason, Mode, OperandWrite,
    Port, QUEUED_BATCHES_MAX, SCAN_WRITES_MAX, Snapshot, StopReason, WordMask,
};
use super::image::SafeState;
use super::link::*;
use super::machine::ImageCells;
use super::swap::Generations;
use super::unwired::UnwiredInputs;
use std::future::Future;
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::task::{Context, Poll, Wake};
use std::thread;

use super::command::{CommandDenial, CommandOutcome, ScanCommand, StateBefore};
use rungd_engine::{BitCell, Cell, Renumbered, RenumberedCell, WordCell};
/// Three inputs; bits 0..4, of which 1..=3 are Y0..Y2 (off, on, hold); two words.
fn small() -> (Port, ScanSide, WorldSide) {
    link(ExchangeShape {
        inputs: 3,
        bits: vec![0; 4],
        words: vec![0; 2],
        first_output: 1,
        forces_active: 0,
        safe: vec![SafeState::Off, SafeState::On, SafeState::Hold],
    })
}

fn scan(side: &mut ScanSide, number: u64, bits: [u8; 4]) {
    while side.next_batch(usize::MAX).is_some() {}
    side.answer(true);
    publish(side, number, Mode::Run, bits);
}

fn publish(side: &mut ScanSide, scans: u64, mode: Mode, bits: [u8; 4]) -> bool {
    let forces = &Forces::default();
    let facts = ScanFacts { scans, now_ns: scans * 10, mode, since_ns: 0, ending: false, forces };
    side.publish(facts, ImageCells { bits: &bits, words: &[scans as i32, 0] })
}

#[test]
fn outputs_are_safe_and_writes_are_refused_before_the_first_scan() {
    let (port, _scan, _world) = small();
    let latest = port.latest();
    assert_eq!((latest.scans, latest.mode), (0, Mode::Stop(StopReason::NotStarted)));
    assert_eq!(*latest.outputs, [0, 1, 0]);
    assert_eq!(port.submit(vec![]), Err(BatchRefusal::NotRunning));
}

#[test]
fn the_scan_reads_the_last_value_of_each_input() {
    let (port, scan, _world) = small();
    port.set_input(0, true);
    port.set_input(2, true);
    port.set_input(0, false);
    port.set_input(3, true);
    let given =
        |moved: &[u64]| scan.inputs(moved).flat_map(UnwiredInputs::each).collect::<Vec<_>>();
    assert_eq!(given(&[]), [(0, false), (1, false), (2, true)]);
    assert_eq!(given(&[0b10]), [(0, false), (2, true)], "a device moves X1");
}

#[test]
fn a_write_counts_as_applied_once_its_scan_is_published() {
    let (port, mut side, mut world) = small();
    side.set_running(true);
    let ticket = port.submit(vec![OperandWrite::Bit(BitCell(0), true)]).unwrap();
    assert_eq!(port.outcome(ticket), BatchOutcome::Pending);
    scan(&mut side, 1, [1, 1, 0, 1]);
    assert_eq!(port.outcome(ticket), BatchOutcome::Pending);
    world.pump();
    assert_eq!(port.outcome(ticket), BatchOutcome::Applied);
    let latest = port.latest();
    assert_eq!((latest.scans, *latest.outputs == [1, 0, 1]), (1, true));
    assert!(latest.bit(BitCell(0)) && latest.word(WordCell(0)) == 1);
}

#[test]
fn leaving_run_refuses_pending_writes_and_keeps_held_outputs() {
    let (port, mut side, mut world) = small();
    side.set_running(true);
    let seen = port.submit(vec![]).unwrap();
    scan(&mut side, 1, [0, 1, 0, 1]);
    let late = port.submit(vec![]).unwrap();
    side.set_running(false);
    side.publish_fault(FaultReason::EnginePanic, 7);
    side.refuse_waiting();
    world.pump();
    assert_eq!(port.outcome(seen), BatchOutcome::Applied);
    assert_eq!(port.outcome(late), BatchOutcome::Refused(BatchRefusal::NotRunning));
    assert_eq!(port.submit(vec![]), Err(BatchRefusal::NotRunning));
    let latest = port.latest();
    assert_eq!(latest.mode, Mode::Fault(FaultReason::EnginePanic));
    assert_eq!(*latest.outputs, [0, 1, 1], "off, on, and the last complete scan's");
    assert_eq!(*latest.bits, [0, 1, 0, 1], "the image stays as it was");
}

#[test]
fn a_watchdog_trip_refuses_pending_requests() {
    let (port, mut side, mut world) = small();
    side.set_running(true);
    let ticket = port.submit(vec![]).unwrap();
    assert!(side.next_batch(0).is_some());
    world.trip(FaultReason::ScanNeverEnds, 9);
    assert_eq!(port.outcome(ticket), BatchOutcome::Refused(BatchRefusal::NotRunning));
    assert_eq!(port.latest().mode, Mode::Fault(FaultReason::ScanNeverEnds));
}

#[test]
fn writes_are_accepted_again_after_a_late_watchdog_trip() {
    let (port, mut side, mut world) = small();
    world.trip(FaultReason::ScanNeverEnds, 9);
    side.set_running(true);
    assert_eq!(port.submit(vec![]), Err(BatchRefusal::NotRunning), "no sign of life yet");
    scan(&mut side, 1, [0, 0, 0, 0]);
    world.pump();
    assert!(port.submit(vec![]).is_ok());
    world.trip(FaultReason::ScanNeverEnds, 10);
    scan(&mut side, 2, [0, 0, 0, 0]);
    world.pump();
    assert!(port.submit(vec![]).is_ok(), "the scan thread had gone on");
}

#[test]
fn a_batch_and_the_queue_have_a_maximum_size() {
    let (port, mut side, _world) = small();
    side.set_running(true);
    let big = vec![OperandWrite::Bit(BitCell(0), true); BATCH_WRITES_MAX + 1];
    assert_eq!(port.submit(big), Err(BatchRefusal::TooLarge));
    let taken = (0..1000).take_while(|_| port.submit(vec![]).is_ok()).count();
    assert_eq!(taken, QUEUED_BATCHES_MAX);
    assert_eq!(port.submit(vec![]), Err(BatchRefusal::QueueFull));
}

#[test]
fn the_queue_holds_only_as_many_writes_as_one_scan_applies() {
    let (port, mut side, _world) = small();
    side.set_running(true);
    let most = || vec![OperandWrite::Bit(BitCell(0), true); BATCH_WRITES_MAX];
    for round in 0..3 {
        assert!(port.submit(most()).is_ok() && port.submit(most()).is_ok(), "{round}");
        assert_eq!(port.submit(most()), Err(BatchRefusal::QueueFull));
        assert_eq!(port.submit(vec![OperandWrite::Input(0, true)]), Err(BatchRefusal::QueueFull));
        assert!(side.next_batch(SCAN_WRITES_MAX).is_some());
        assert!(side.next_batch(SCAN_WRITES_MAX - BATCH_WRITES_MAX).is_some());
        side.answer(true);
    }
}

#[test]
fn a_batch_that_does_not_fit_is_not_split() {
    let (port, mut side, _world) = small();
    side.set_running(true);
    port.submit(vec![OperandWrite::Word(WordCell(0), 1); 3]).unwrap();
    assert!(side.next_batch(2).is_none());
    assert_eq!(side.next_batch(3).unwrap().1.len(), 3);
}

#[test]
fn readers_that_keep_images_do_not_starve_the_scan() {
    let (port, mut side, mut world) = small();
    let mut held = Vec::new();
    for number in 1..200 {
        assert!(publish(&mut side, number, Mode::Run, [0; 4]));
        world.pump();
        held.push(port.latest());
    }
    assert!(held.iter().zip(1..).all(|(snapshot, number)| snapshot.scans == number));
}

/// Counts how often it is woken.
#[derive(Default)]
struct Bell(AtomicU32);

impl Wake for Bell {
    fn wake(self: Arc<Self>) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

impl Bell {
    fn rung(&self) -> u32 {
        self.0.load(Ordering::Relaxed)
    }
}

fn poll<F: Future>(future: Pin<&mut F>, bell: &Arc<Bell>) -> Poll<F::Output> {
    future.poll(&mut Context::from_waker(&Arc::clone(bell).into()))
}

#[test]
fn writes_and_commands_of_an_earlier_program_reach_the_new_address_of_their_element() {
    let (port, mut side, _world) = small();
    side.set_running(true);
    let [bit, word] = [0, 1].map(|at| (Cell::Bit(BitCell(at)), Cell::Word(WordCell(at))));
    let renumbered = || {
        let moved = RenumberedCell { from: bit.0, to: Some(word.0) };
        Renumbered::new(vec![moved, RenumberedCell { from: bit.1, to: None }])
    };
    let mask = WordMask { and: 0, or: 1 };
    let masked = |at| OperandWrite::Masked { cell: WordCell(at), mask, signed: false };
    let writes =
        [OperandWrite::Bit(BitCell(0), true), OperandWrite::Word(WordCell(1), 6), masked(1)];
    let writes = [&writes[..], &[OperandWrite::Input(0, true)]].concat();
    let moved = [&[OperandWrite::Bit(BitCell(1), true)], &writes[1..]].concat();
    port.submit_to(0, writes.clone()).unwrap();
    side.adopt(1, &mut renumbered());
    assert_eq!(side.next_batch(100).map(|(_, writes)| writes), Some(&moved[..]));
    assert_eq!(side.cell(0, bit.0), Some(word.0));
    assert_eq!((side.cell(0, bit.1), side.cell(1, bit.1)), (None, Some(bit.1)));
    // A write of the present program stays as it is.
    port.submit_to(1, writes.clone()).unwrap();
    assert_eq!(side.next_batch(100).map(|(_, writes)| writes), Some(&writes[..]));
    // Elements are followed over several swaps between two scans, but not over any number.
    for generation in 2..=SWAPS_FOLLOWED as u32 {
        side.adopt(generation, &mut Renumbered::default());
        port.submit_to(0, writes.clone()).unwrap();
        assert_eq!(side.next_batch(100).map(|(_, writes)| writes), Some(&moved[..]));
        assert_eq!(side.cell(0, bit.0), Some(word.0));
    }
    side.adopt(SWAPS_FOLLOWED as u32 + 1, &mut Renumbered::default());
    assert_eq!((side.cell(0, bit.0), side.cell(1, bit.1)), (None, Some(bit.1)));
    side.answer(true);
}

#[test]
fn a_batch_with_a_write_to_a_removed_element_is_refused_whole() {
    let (port, mut side, mut world) = small();
    side.set_running(true);
    let [first, second] = [0, 1].map(|at| OperandWrite::Bit(BitCell(at), true));
    let gone = [
        vec![first, OperandWrite::Input(0, true), second],
        vec![first],
        vec![OperandWrite::Input(0, true)],
    ];
    let tickets = gone.map(|writes| port.submit_to(0, writes).unwrap());
    let gone = RenumberedCell { from: Cell::Bit(BitCell(1)), to: None };
    let mut renumbered = Renumbered::new(vec![gone]);
    side.adopt(1, &mut renumbered);
    assert_eq!(side.next_batch(100), Some((tickets[1], &[first][..])), "the next one is applied");
    assert_eq!(side.next_batch(100), Some((tickets[2], &[OperandWrite::Input(0, true)][..])));
    assert!(side.next_batch(100).is_none());
    side.answer(true);
    world.pump();
    let outcomes = tickets.map(|ticket| port.outcome(ticket));
    let overtaken = BatchOutcome::Refused(BatchRefusal::Overtaken);
    assert_eq!(
        outcomes,
        [overtaken, BatchOutcome::Pending, BatchOutcome::Pending],
        "no image is shown yet"
    );
}

#[test]
fn a_batch_for_one_program_only_is_refused_by_the_next_one() {
    let (port, mut side, mut world) = small();
    side.set_running(true);
    let write = OperandWrite::Bit(BitCell(0), true);
    let submit = |generation: u32, is_bound: bool| {
        let terms = BatchTerms { is_bound, ..BatchTerms::of(generation) };
        port.submit_by(terms, vec![write]).unwrap()
    };
    let own = submit(0, true);
    assert_eq!(side.next_batch(100), Some((own, &[write][..])), "its own program takes it");
    let [bound, free] = [submit(0, true), submit(0, false)];
    side.adopt(1, &mut Renumbered::default());
    assert_eq!(side.next_batch(100), Some((free, &[write][..])));
    side.answer(true);
    world.pump();
    assert_eq!(port.outcome(bound), BatchOutcome::Refused(BatchRefusal::Overtaken));
}

#[test]
fn a_wait_for_a_batch_ends_when_its_scan_is_published_or_the_batch_is_refused() {
    let (port, mut side, mut world) = small();
    side.set_running(true);
    let ticket = port.submit(vec![OperandWrite::Bit(BitCell(0), true)]).unwrap();
    let (bell, mut done) = (Arc::new(Bell::default()), pin!(port.done(ticket)));
    assert_eq!(poll(done.as_mut(), &bell), Poll::Pending);
    scan(&mut side, 1, [1, 1, 0, 1]);
    assert_eq!(bell.rung(), 0, "the scan thread wakes nobody");
    world.pump();
    assert_eq!((bell.rung(), poll(done.as_mut(), &bell)), (1, Poll::Ready(Ok(()))));

    let ticket = port.submit(vec![OperandWrite::Bit(BitCell(0), true)]).unwrap();
    let (bell, mut done) = (Arc::new(Bell::default()), pin!(port.done(ticket)));
    assert_eq!(poll(done.as_mut(), &bell), Poll::Pending);
    side.set_running(false);
    side.refuse_waiting();
    world.pump();
    let refused = Poll::Ready(Err(BatchRefusal::NotRunning));
    assert_eq!((bell.rung(), poll(done.as_mut(), &bell)), (1, refused), "nothing was published");
}

#[test]
fn a_wait_for_a_batch_ends_when_the_scan_thread_is_reported_stuck() {
    let (port, mut side, mut world) = small();
    side.set_running(true);
    let ticket = port.submit(vec![OperandWrite::Bit(BitCell(0), true)]).unwrap();
    let (bell, mut done) = (Arc::new(Bell::default()), pin!(port.done(ticket)));
    assert_eq!(poll(done.as_mut(), &bell), Poll::Pending);
    world.trip(FaultReason::ScanNeverEnds, 99);
    let refused = Poll::Ready(Err(BatchRefusal::NotRunning));
    assert_eq!((bell.rung(), poll(done.as_mut(), &bell)), (1, refused));
}

#[test]
fn a_wait_for_a_command_ends_with_its_answer() {
    let (port, mut side, mut world) = small();
    let before = StateBefore { mode: Mode::Run, value: 0, forced: false };
    let answers = [(CommandOutcome::Done(before), Ok(before)), {
        let denial = CommandDenial::Ending;
        (CommandOutcome::Denied(denial), Err(denial))
    }];
    for (answer, expected) in answers {
        let id = port.command(ScanCommand::Run).unwrap();
        let (bell, mut answered) = (Arc::new(Bell::default()), pin!(port.answered(id)));
        assert_eq!(poll(answered.as_mut(), &bell), Poll::Pending);
        let taken = side.orders.next().unwrap().id;
        side.orders.note(taken, answer);
        side.orders.give();
        world.pump();
        assert_eq!((bell.rung(), poll(answered.as_mut(), &bell)), (1, Poll::Ready(expected)));
    }
}

#[test]
fn a_task_that_waits_for_an_image_sleeps_until_that_image_is_there() {
    let (port, mut side, mut world) = small();
    let (bell, mut shows) = (Arc::new(Bell::default()), pin!(port.shows(|seen| seen.scans >= 2)));
    assert!(poll(shows.as_mut(), &bell).is_pending());
    scan(&mut side, 1, [0; 4]);
    world.pump();
    assert_eq!(bell.rung(), 0);
    scan(&mut side, 2, [0; 4]);
    world.pump();
    let Poll::Ready(image) = poll(shows.as_mut(), &bell) else { panic!("it is there") };
    assert_eq!((bell.rung(), image.scans), (1, 2));
}

#[test]
fn two_waits_of_one_task_are_each_woken_and_a_dropped_one_is_not() {
    let (port, mut side, mut world) = small();
    let bell = Arc::new(Bell::default());
    let (mut third, mut fourth) = (
        Box::pin(port.shows(|seen| seen.scans >= 3)),
        Box::pin(port.shows(|seen| seen.scans >= 4)),
    );
    let mut dropped = Box::pin(port.shows(|seen| seen.scans >= 1));
    assert!(poll(dropped.as_mut(), &bell).is_pending());
    assert!(poll(third.as_mut(), &bell).is_pending() && poll(fourth.as_mut(), &bell).is_pending());
    drop(dropped);
    for (scans, rung) in [(1, 0), (2, 0), (3, 1), (4, 2)] {
        scan(&mut side, scans, [0; 4]);
        world.pump();
        assert_eq!(bell.rung(), rung, "scan {scans}");
    }
    assert!(poll(third.as_mut(), &bell).is_ready() && poll(fourth.as_mut(), &bell).is_ready());
}

#[test]
fn an_image_is_read_with_the_data_of_its_own_program() {
    let (port, _scan, _world) = small();
    let data = Generations::new(0);
    let first = port.latest();
    thread::scope(|threads| {
        let swaps = threads.spawn(|| {
            for generation in 1..20_000 {
                data.insert(generation, generation);
                port.publish(Arc::new(Snapshot { generation, ..(*first).clone() }));
                data.forget_before(generation);
            }
        });
        while !swaps.is_finished() {
            let (image, of) = data.latest(&port);
            assert_eq!(*of, image.generation);
        }
    });
}
