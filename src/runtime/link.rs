//! The two ends of the exchange: the scan thread's and the world's, joined by rings.
//!
//! [`ScanSide`] is used by the scan thread between two scans; nothing in it locks, allocates or
//! frees. [`WorldSide`] is driven by the monitor thread (or a test): it makes what the scan thread
//! handed over visible in the [`Port`], and drops what may not be dropped by the scan.
//!
//! The idea: snapshots circulate. The world fills a ring with spare ones, the scan thread takes
//! one, copies its image into it and hands it over; when the last reader has let go of it, it is
//! a spare again. Where none is spare, that scan is not published and the next one is.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use rtrb::{Consumer, Producer, RingBuffer};

use super::exchange::{
    Batch, FaultReason, Mode, Port, QUEUED_BATCHES_MAX, Snapshot, StopReason, Ticket, Write,
};

/// Spare snapshots at first, and the least that the world tries to keep.
const SPARES: usize = 8;

/// How many snapshots may wait for their last reader before further ones are simply freed.
const RETIRED_MAX: usize = 64;

/// Sizes and rules that both ends must know.
#[derive(Clone, Debug)]
pub struct Shape {
    /// How many X there are.
    pub inputs: u32,
    /// The image before the first scan: its bits.
    pub bits: Vec<u8>,
    /// The image before the first scan: its words.
    pub words: Vec<i32>,
    /// The cell of Y0; Y1 and so on follow it.
    pub first_output: usize,
    /// What each Y does outside RUN.
    pub safe: Vec<Safe>,
}

/// What an output does outside RUN.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Safe {
    /// OFF.
    #[default]
    Off,
    /// ON.
    On,
    /// In STOP its value after the termination passes; in FAULT the last complete scan's.
    Hold,
}

/// What the scan thread hands over.
#[derive(Debug)]
pub enum Publication {
    /// A complete scan, or the memory after the passes of a stop.
    Image(Arc<Snapshot>),
    /// A fault: there is no new image.
    Fault(FaultReason),
}

/// A batch on its way back, to be dropped outside the scan thread.
#[derive(Debug)]
pub struct Returned {
    /// It.
    pub batch: Batch,
    /// Whether a scan applied it.
    pub applied: bool,
}

/// The scan thread's end.
pub struct ScanSide {
    port: Port,
    batches: Consumer<Batch>,
    returns: Producer<Returned>,
    spares: Consumer<Arc<Snapshot>>,
    published: Producer<Publication>,
    /// What this scan applies.
    taken: Vec<Batch>,
    /// The last ticket that was applied.
    applied: u64,
}

/// The world's end.
pub struct WorldSide {
    port: Port,
    returns: Consumer<Returned>,
    spares: Producer<Arc<Snapshot>>,
    published: Consumer<Publication>,
    retired: Vec<Arc<Snapshot>>,
    first_output: usize,
    safe: Vec<Safe>,
}

/// Makes a port and its two ends.
pub fn link(shape: Shape) -> (Port, ScanSide, WorldSide) {
    let (batch_in, batches) = RingBuffer::new(QUEUED_BATCHES_MAX);
    let (returns, return_out) = RingBuffer::new(2 * QUEUED_BATCHES_MAX);
    let (mut spare_in, spares) = RingBuffer::new(2 * SPARES);
    // Room for every spare and for a fault: handing over never fails for want of room.
    let (published, publish_out) = RingBuffer::new(4 * SPARES);
    let outputs = shape.safe.iter().map(|s| u8::from(*s == Safe::On)).collect();
    let first = Snapshot {
        scans: 0,
        now_ns: 0,
        mode: Mode::Stop(StopReason::NotStarted),
        bits: shape.bits.into(),
        words: shape.words.into(),
        outputs,
        tickets_done: 0,
    };
    for _ in 0..SPARES {
        let _ = spare_in.push(Arc::new(first.clone()));
    }
    let taken = Vec::with_capacity(QUEUED_BATCHES_MAX);
    let port = Port::new(shape.inputs, first, batch_in);
    let scan =
        ScanSide { port: port.clone(), batches, returns, spares, published, taken, applied: 0 };
    let world = WorldSide {
        port: port.clone(),
        returns: return_out,
        spares: spare_in,
        published: publish_out,
        retired: Vec::with_capacity(RETIRED_MAX),
        first_output: shape.first_output,
        safe: shape.safe,
    };
    (port, scan, world)
}

impl ScanSide {
    /// Opens or closes the door for batches. Those that are inside already are answered one by
    /// one: by scans, or by [`ScanSide::refuse_waiting`].
    pub fn set_running(&mut self, running: bool) {
        self.port.shared.running.store(running, Ordering::Release);
    }

    /// Every input, as set last.
    pub fn inputs(&self) -> impl Iterator<Item = (u32, bool)> + '_ {
        let count = self.port.shared.input_count;
        self.port.shared.inputs.iter().enumerate().flat_map(move |(at, word)| {
            let word = word.load(Ordering::Relaxed);
            let first = at as u32 * 64;
            (0..64.min(count - first)).map(move |bit| (first + bit, word >> bit & 1 != 0))
        })
    }

    /// The writes of the next batch, if they fit what this scan may still apply. It is answered
    /// with all others of this scan by [`ScanSide::answer`].
    /// Its inputs are set for the scans to come; for this one, which has read its inputs already,
    /// the scan sets them.
    pub fn next_batch(&mut self, writes_left: usize) -> Option<&[Write]> {
        // Every batch that is taken must find a place in the ring that takes it back.
        if self.taken.len() >= self.returns.slots().min(QUEUED_BATCHES_MAX) {
            return None;
        }
        if self.batches.peek().ok()?.writes.len() > writes_left {
            return None;
        }
        let batch = self.batches.pop().ok()?;
        self.port.shared.waiting_writes.fetch_sub(batch.writes.len(), Ordering::AcqRel);
        for write in &batch.writes {
            if let Write::Input(x, on) = *write {
                self.port.set_input(x, on);
            }
        }
        self.taken.push(batch);
        self.taken.last().map(|batch| &batch.writes[..])
    }

    /// Answers all batches that were taken: applied, once the scan that saw them is complete and
    /// before it is published; or refused.
    pub fn answer(&mut self, applied: bool) {
        for batch in self.taken.drain(..) {
            if applied {
                self.applied = batch.ticket.0;
            }
            if let Err(rtrb::PushError::Full(kept)) = self.returns.push(Returned { batch, applied })
            {
                // `next_batch` saw a free place and nobody else fills it. Freeing here would be a
                // call into the allocator, so in a state that cannot be the memory is let go.
                std::mem::forget(kept);
            }
        }
    }

    /// Outside RUN: refuses what came in while the mode changed.
    pub fn refuse_waiting(&mut self) {
        while self.next_batch(usize::MAX).is_some() {}
        self.answer(false);
    }

    /// Publishes an image; false where no snapshot is spare at present.
    pub fn publish(&mut self, scans: u64, now_ns: u64, mode: Mode, image: (&[u8], &[i32])) -> bool {
        let Ok(mut spare) = self.spares.pop() else { return false };
        // A spare has no other reader: the world saw to that before it put it into the ring.
        if let Some(snapshot) = Arc::get_mut(&mut spare) {
            snapshot.scans = scans;
            snapshot.now_ns = now_ns;
            snapshot.mode = mode;
            snapshot.bits.copy_from_slice(&image.0[..snapshot.bits.len()]);
            snapshot.words.copy_from_slice(&image.1[..snapshot.words.len()]);
            snapshot.tickets_done = self.applied;
        }
        self.hand_over(Publication::Image(spare));
        true
    }

    /// Tells of a fault.
    pub fn publish_fault(&mut self, reason: FaultReason) {
        self.hand_over(Publication::Fault(reason));
    }

    fn hand_over(&mut self, publication: Publication) {
        if let Err(rtrb::PushError::Full(kept)) = self.published.push(publication) {
            std::mem::forget(kept);
        }
    }
}

impl WorldSide {
    /// Makes visible what came from the scan thread. True if anything did.
    pub fn pump(&mut self) -> bool {
        let mut any = false;
        while let Ok(publication) = self.published.pop() {
            any = true;
            // Batches first: a ticket that was refused must be known as such before a snapshot
            // that counts it as done is seen.
            self.drain_returns();
            match publication {
                Publication::Image(snapshot) => self.show(snapshot),
                Publication::Fault(reason) => self.show_fault(reason),
            }
        }
        self.drain_returns();
        self.refill();
        any
    }

    /// Shows a fault that the scan thread cannot tell of itself, and refuses what is pending.
    pub fn trip(&mut self, reason: FaultReason) {
        self.port.refuse_pending();
        self.show_fault(reason);
    }

    fn drain_returns(&mut self) {
        while let Ok(returned) = self.returns.pop() {
            if !returned.applied {
                self.port.refuse(Ticket(returned.batch.ticket.0));
            }
        }
    }

    fn show(&mut self, mut snapshot: Arc<Snapshot>) {
        let Some(fresh) = Arc::get_mut(&mut snapshot) else { return };
        let count = self.safe.len();
        let driven = self.first_output..self.first_output + count;
        fresh.outputs.copy_from_slice(&fresh.bits[driven]);
        if fresh.mode != Mode::Run {
            make_safe(&mut fresh.outputs, &self.safe);
        }
        self.swap(snapshot);
    }

    fn show_fault(&mut self, reason: FaultReason) {
        let mut snapshot = Snapshot::clone(&self.port.latest());
        snapshot.mode = Mode::Fault(reason);
        make_safe(&mut snapshot.outputs, &self.safe);
        self.swap(Arc::new(snapshot));
    }

    fn swap(&mut self, snapshot: Arc<Snapshot>) {
        let old = self.port.publish(snapshot);
        if self.retired.len() < RETIRED_MAX {
            self.retired.push(old);
        }
    }

    /// Turns snapshots that nobody reads any more into spares; makes new ones where too many are
    /// still being read.
    fn refill(&mut self) {
        let mut at = 0;
        while at < self.retired.len() {
            if Arc::get_mut(&mut self.retired[at]).is_none() {
                at += 1;
                continue;
            }
            let spare = self.retired.swap_remove(at);
            let _ = self.spares.push(spare);
        }
        let ring = self.spares.buffer().capacity();
        let waiting = ring - self.spares.slots();
        for _ in waiting..SPARES / 2 {
            let fresh = Snapshot::clone(&self.port.latest());
            let _ = self.spares.push(Arc::new(fresh));
        }
    }
}

fn make_safe(outputs: &mut [u8], safe: &[Safe]) {
    for (output, safe) in outputs.iter_mut().zip(safe) {
        match safe {
            Safe::Off => *output = 0,
            Safe::On => *output = 1,
            Safe::Hold => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::exchange::{BATCH_WRITES_MAX, Outcome, Refused, SCAN_WRITES_MAX};
    use super::*;
    use crate::engine::{BitCell, WordCell};

    /// Three inputs; bits 0..4, of which 1..=3 are Y0..Y2 (off, on, hold); two words.
    fn small() -> (Port, ScanSide, WorldSide) {
        link(Shape {
            inputs: 3,
            bits: vec![0; 4],
            words: vec![0; 2],
            first_output: 1,
            safe: vec![Safe::Off, Safe::On, Safe::Hold],
        })
    }

    fn scan(side: &mut ScanSide, number: u64, bits: [u8; 4]) {
        while side.next_batch(usize::MAX).is_some() {}
        side.answer(true);
        side.publish(number, number * 10, Mode::Run, (&bits, &[number as i32, 0]));
    }

    #[test]
    fn before_the_first_scan_outputs_are_safe_and_nothing_is_taken() {
        let (port, _scan, _world) = small();
        let latest = port.latest();
        assert_eq!((latest.scans, latest.mode), (0, Mode::Stop(StopReason::NotStarted)));
        assert_eq!(*latest.outputs, [0, 1, 0]);
        assert_eq!(port.submit(vec![]), Err(Refused::NotRunning));
    }

    #[test]
    fn inputs_are_read_as_set_last() {
        let (port, scan, _world) = small();
        port.set_input(0, true);
        port.set_input(2, true);
        port.set_input(0, false);
        port.set_input(3, true);
        let inputs: Vec<_> = scan.inputs().collect();
        assert_eq!(inputs, [(0, false), (1, false), (2, true)]);
    }

    #[test]
    fn a_ticket_is_applied_once_its_scan_is_visible() {
        let (port, mut side, mut world) = small();
        side.set_running(true);
        let ticket = port.submit(vec![Write::Bit(BitCell(0), true)]).unwrap();
        assert_eq!(port.outcome(ticket), Outcome::Pending);
        scan(&mut side, 1, [1, 1, 0, 1]);
        assert_eq!(port.outcome(ticket), Outcome::Pending);
        world.pump();
        assert_eq!(port.outcome(ticket), Outcome::Applied);
        let latest = port.latest();
        assert_eq!((latest.scans, *latest.outputs == [1, 0, 1]), (1, true));
        assert!(latest.bit(BitCell(0)) && latest.word(WordCell(0)) == 1);
    }

    #[test]
    fn leaving_run_refuses_what_waits_and_holds_what_holds() {
        let (port, mut side, mut world) = small();
        side.set_running(true);
        let seen = port.submit(vec![]).unwrap();
        scan(&mut side, 1, [0, 1, 0, 1]);
        let late = port.submit(vec![]).unwrap();
        side.set_running(false);
        side.publish_fault(FaultReason::EnginePanic);
        side.refuse_waiting();
        world.pump();
        assert_eq!(port.outcome(seen), Outcome::Applied);
        assert_eq!(port.outcome(late), Outcome::Refused);
        assert_eq!(port.submit(vec![]), Err(Refused::NotRunning));
        let latest = port.latest();
        assert_eq!(latest.mode, Mode::Fault(FaultReason::EnginePanic));
        assert_eq!(*latest.outputs, [0, 1, 1], "off, on, and the last complete scan's");
        assert_eq!(*latest.bits, [0, 1, 0, 1], "the image stays as it was");
    }

    #[test]
    fn a_trip_refuses_what_will_never_be_answered() {
        let (port, mut side, mut world) = small();
        side.set_running(true);
        let ticket = port.submit(vec![]).unwrap();
        assert!(side.next_batch(0).is_some());
        world.trip(FaultReason::ScanNeverEnds);
        assert_eq!(port.outcome(ticket), Outcome::Refused);
        assert_eq!(port.latest().mode, Mode::Fault(FaultReason::ScanNeverEnds));
    }

    #[test]
    fn limits_are_limits() {
        let (port, mut side, _world) = small();
        side.set_running(true);
        let big = vec![Write::Bit(BitCell(0), true); BATCH_WRITES_MAX + 1];
        assert_eq!(port.submit(big), Err(Refused::TooLarge));
        let taken = (0..1000).take_while(|_| port.submit(vec![]).is_ok()).count();
        assert_eq!(taken, QUEUED_BATCHES_MAX);
        assert_eq!(port.submit(vec![]), Err(Refused::QueueFull));
    }

    #[test]
    fn no_more_writes_wait_than_the_next_scan_applies() {
        let (port, mut side, _world) = small();
        side.set_running(true);
        let most = || vec![Write::Bit(BitCell(0), true); BATCH_WRITES_MAX];
        for round in 0..3 {
            assert!(port.submit(most()).is_ok() && port.submit(most()).is_ok(), "{round}");
            assert_eq!(port.submit(most()), Err(Refused::QueueFull));
            assert_eq!(port.submit(vec![Write::Input(0, true)]), Err(Refused::QueueFull));
            assert!(side.next_batch(SCAN_WRITES_MAX).is_some());
            assert!(side.next_batch(SCAN_WRITES_MAX - BATCH_WRITES_MAX).is_some());
            side.answer(true);
        }
    }

    #[test]
    fn a_batch_that_does_not_fit_waits_whole() {
        let (port, mut side, _world) = small();
        side.set_running(true);
        port.submit(vec![Write::Word(WordCell(0), 1); 3]).unwrap();
        assert!(side.next_batch(2).is_none());
        assert_eq!(side.next_batch(3).unwrap().len(), 3);
    }

    #[test]
    fn readers_that_hold_on_do_not_starve_the_scan() {
        let (port, mut side, mut world) = small();
        let mut held = Vec::new();
        for number in 1..200 {
            assert!(side.publish(number, 0, Mode::Run, (&[0; 4], &[0; 2])));
            world.pump();
            held.push(port.latest());
        }
        assert!(held.iter().zip(1..).all(|(snapshot, number)| snapshot.scans == number));
    }
}
