//! The two ends of the exchange: the scan thread's and the world's, joined by rings.
//!
//! The scan thread uses [`ScanSide`] between two scans; it does not lock, allocate or free. The
//! world is all other threads. The monitor thread (or a test) uses [`WorldSide`]: it makes the scan
//! thread's publications visible in the [`Port`], and frees the objects that the scan thread must
//! not free.
//!
//! The idea: snapshots circulate. The world fills a ring with spare snapshots. The scan thread
//! takes one, copies its image into it and hands it over. After the last reader has dropped it, it
//! is a spare again. If there is no spare, this scan is not published, but the next one is.

use std::sync::Arc;

use rtrb::{Consumer, Producer, RingBuffer};

use super::command::{AnswerReceiver, CommandReceiver, command_rings};
use super::earlier::EarlierPrograms;
use super::exchange::{
    BatchRefusal, BatchTerms, OperandWrite, Port, QUEUED_BATCHES_MAX, Tempo, Ticket, WriteBatch,
};
use super::forces::Forces;
use super::hold::{EndedHold, Holds};
use super::image::{SafeState, Snapshot};
use super::machine::ImageCells;
use super::mode::{FaultReason, Mode, StopReason};
pub use super::publication::{Publication, ScanFacts};
use super::unwired::UnwiredInputs;
use rungd_engine::{BitCell, Cell, Renumbered, WordCell};

/// The number of spare snapshots at the start; the world refills the ring below half of it.
pub(super) const SPARES: usize = 8;

/// The greatest number of snapshots that wait for their last reader; further ones are freed.
const RETIRED_MAX: usize = 64;

/// The sizes and rules that both ends use.
#[derive(Clone, Debug)]
pub struct ExchangeShape {
    /// The number of X.
    pub inputs: u32,
    /// The image before the first scan: its bits.
    pub bits: Vec<u8>,
    /// The image before the first scan: its words.
    pub words: Vec<i32>,
    /// The cell of Y0; Y1 and so on follow it.
    pub first_output: usize,
    /// The cell of `$ForcesActive`.
    pub forces_active: usize,
    /// The safe state of each Y, outside RUN.
    pub safe: Vec<SafeState>,
}

/// A batch on its way back, to be dropped outside the scan thread.
#[derive(Debug)]
pub struct ReturnedBatch {
    /// The batch.
    pub batch: WriteBatch,
    /// `Ok` if a scan applied it.
    pub outcome: Result<(), BatchRefusal>,
}

/// The scan thread's end.
pub struct ScanSide {
    port: Port,
    batches: Consumer<WriteBatch>,
    returns: Producer<ReturnedBatch>,
    spares: Consumer<Arc<Snapshot>>,
    published: Producer<Publication>,
    /// The writes that this scan applies.
    taken: Vec<WriteBatch>,
    /// The last ticket that was applied.
    applied: u64,
    /// The present moment of the deadlines' clock: batches that are meant for before it are late.
    pub(super) now_ns: u64,
    /// Commands and their answers.
    pub(super) orders: CommandReceiver,
    /// The generation of the program.
    pub(super) generation: u32,
    /// The programs before it.
    earlier: EarlierPrograms,
    /// The bits that somebody holds ON.
    holds: Holds,
    /// Spare snapshots that came with the program.
    pub(super) fresh: Vec<Arc<Snapshot>>,
}

/// The world's end.
pub struct WorldSide {
    port: Port,
    returns: Consumer<ReturnedBatch>,
    spares: Producer<Arc<Snapshot>>,
    published: Consumer<Publication>,
    retired: Vec<Arc<Snapshot>>,
    /// The beginning of a program that no image is shown of yet.
    beginning: Option<Arc<Snapshot>>,
    answers: AnswerReceiver,
    first_output: usize,
    forces_active: usize,
}

/// Makes a port and its two ends.
pub fn link(shape: ExchangeShape) -> (Port, ScanSide, WorldSide) {
    let (batch_in, batches) = RingBuffer::new(QUEUED_BATCHES_MAX);
    let (returns, return_out) = RingBuffer::new(2 * QUEUED_BATCHES_MAX);
    let (mut spare_in, spares) = RingBuffer::new(2 * SPARES);
    // There is room for every spare and for a fault, so a publication always finds a place.
    let (published, publish_out) = RingBuffer::new(4 * SPARES);
    let outputs = shape.safe.iter().map(|s| u8::from(*s == SafeState::On)).collect();
    let first = Snapshot {
        generation: 0,
        safe: shape.safe.into(),
        scans: 0,
        now_ns: 0,
        mode: Mode::Stop(StopReason::NotStarted),
        since_ns: 0,
        ending: false,
        bits: shape.bits.into(),
        words: shape.words.into(),
        outputs,
        tickets_done: 0,
        forces: Forces::default(),
    };
    for _ in 0..SPARES {
        let _ = spare_in.push(Arc::new(first.clone()));
    }
    let taken = Vec::with_capacity(QUEUED_BATCHES_MAX);
    let (commands, orders, answers) = command_rings();
    let port = Port::new(shape.inputs, first, batch_in, commands);
    let scan = ScanSide {
        port: port.clone(),
        batches,
        returns,
        spares,
        published,
        taken,
        applied: 0,
        now_ns: 0,
        orders,
        generation: 0,
        earlier: EarlierPrograms::default(),
        holds: Holds::default(),
        fresh: Vec::new(),
    };
    let world = WorldSide {
        port: port.clone(),
        returns: return_out,
        spares: spare_in,
        published: publish_out,
        retired: Vec::with_capacity(RETIRED_MAX),
        beginning: None,
        answers,
        first_output: shape.first_output,
        forces_active: shape.forces_active,
    };
    (port, scan, world)
}

impl ScanSide {
    /// Opens or closes the entry for batches. Batches that wait already are answered later: by
    /// scans, or by [`ScanSide::refuse_waiting`].
    pub fn set_running(&mut self, running: bool) {
        if running {
            self.holds.end_all();
        }
        self.port.shared.gate.set_running(running);
    }

    /// Continues with the program of this generation. Takes its new numbers of cells, and returns
    /// those of the last swap in the same variable, so that they are freed elsewhere.
    pub fn adopt(&mut self, generation: u32, renumbered: &mut Renumbered) {
        self.earlier.enter(self.generation, renumbered);
        self.holds.follow(self.generation, &self.earlier);
        self.generation = generation;
    }

    /// The cell of the present program for a cell of the program of `generation`. `None` if the
    /// present program does not have the element, or if `generation` is more than
    /// `SWAPS_FOLLOWED` swaps ago.
    pub fn cell(&self, generation: u32, cell: Cell) -> Option<Cell> {
        if generation == self.generation { Some(cell) } else { self.earlier.cell(generation, cell) }
    }

    /// Sets the tempo of the next scans.
    pub fn set_tempo(&self, tempo: Tempo) {
        self.port.set_tempo(tempo);
    }

    /// All inputs with their latest values; those of `moved`, 64 to a word, are not given.
    pub fn inputs(&self, moved: &[u64]) -> impl Iterator<Item = UnwiredInputs> {
        self.port.shared.gate.inputs().map(move |word| {
            let inputs =
                UnwiredInputs { first: word.first, values: word.values, given: word.present };
            inputs.not_moved(moved)
        })
    }

    /// The next batch with its writes, if there are at most `writes_left`. [`ScanSide::answer`]
    /// answers all batches of a scan. The batch's inputs are set here for the next scans; this scan
    /// has read its inputs already, so it must apply them itself.
    pub fn next_batch(&mut self, writes_left: usize) -> Option<(Ticket, &[OperandWrite])> {
        let batch = loop {
            // Every taken batch needs a place in the ring of returned batches.
            if self.taken.len() >= self.returns.slots().min(QUEUED_BATCHES_MAX) {
                return None;
            }
            if self.batches.peek().ok()?.writes.len() > writes_left {
                return None;
            }
            let mut batch = self.batches.pop().ok()?;
            self.port.shared.gate.release(batch.writes.len());
            let BatchTerms { generation, is_bound, until_ns, .. } = batch.terms;
            let earlier = &self.earlier;
            let is_present = |write: &mut OperandWrite| earlier.is_renumbered(generation, write);
            let why = if until_ns < self.now_ns {
                BatchRefusal::Late
            } else if generation == self.generation
                || (!is_bound && batch.writes.iter_mut().all(is_present))
            {
                match self.holds.take(&batch, self.now_ns) {
                    Ok(()) => break batch,
                    Err(why) => why,
                }
            } else {
                BatchRefusal::Overtaken
            };
            give_back(&mut self.returns, ReturnedBatch { batch, outcome: Err(why) });
        };
        for write in &batch.writes {
            if let OperandWrite::Input(x, on) = *write {
                self.port.set_input(x, on);
            }
        }
        self.taken.push(batch);
        self.taken.last().map(|batch| (batch.ticket, &batch.writes[..]))
    }

    /// Takes a hold that has ended; the machine turns its bit OFF. Called after the batches.
    pub fn ended_hold(&mut self) -> Option<EndedHold> {
        self.holds.ended(self.now_ns)
    }

    /// Answers all taken batches: as applied, after their scan is complete and before it is
    /// published; or as refused.
    pub fn answer(&mut self, applied: bool) {
        let outcome = if applied { Ok(()) } else { Err(BatchRefusal::NotRunning) };
        for batch in self.taken.drain(..) {
            if applied {
                self.applied = batch.ticket.0;
            }
            give_back(&mut self.returns, ReturnedBatch { batch, outcome });
        }
    }

    /// Refuses the batches that came in while the mode changed; called outside RUN.
    pub fn refuse_waiting(&mut self) {
        while self.next_batch(usize::MAX).is_some() {}
        self.answer(false);
    }

    /// Publishes an image; false if there is no spare snapshot.
    pub fn publish(&mut self, facts: ScanFacts<'_>, image: ImageCells<'_>) -> bool {
        let Some(snapshot) = self.snapshot(facts, image) else { return false };
        self.hand_over(Publication::Image(snapshot));
        true
    }

    /// Publishes the beginning of a program that was swapped in.
    pub fn publish_beginning(&mut self, facts: ScanFacts<'_>, image: ImageCells<'_>) {
        // The program has brought spare snapshots.
        if let Some(snapshot) = self.snapshot(facts, image) {
            self.hand_over(Publication::Beginning(snapshot));
        }
    }

    /// A spare snapshot with this image; `None` if there is no spare.
    fn snapshot(&mut self, facts: ScanFacts<'_>, image: ImageCells<'_>) -> Option<Arc<Snapshot>> {
        let mut spare = self.spare()?;
        // A spare has no reader: the world has checked that before it put it into the ring.
        if let Some(snapshot) = Arc::get_mut(&mut spare) {
            snapshot.scans = facts.scans;
            snapshot.now_ns = facts.now_ns;
            snapshot.mode = facts.mode;
            snapshot.since_ns = facts.since_ns;
            snapshot.ending = facts.ending;
            snapshot.forces.copy_from(facts.forces);
            snapshot.bits.copy_from_slice(&image.bits[..snapshot.bits.len()]);
            snapshot.words.copy_from_slice(&image.words[..snapshot.words.len()]);
            snapshot.tickets_done = self.applied;
        }
        Some(spare)
    }

    /// A spare of this program. Spares of earlier programs are returned to the world, which drops
    /// them.
    fn spare(&mut self) -> Option<Arc<Snapshot>> {
        if let Some(spare) = self.fresh.pop() {
            return Some(spare);
        }
        while let Ok(spare) = self.spares.pop() {
            if spare.generation == self.generation {
                return Some(spare);
            }
            self.hand_over(Publication::Outlived(spare));
        }
        None
    }

    /// Publishes a fault.
    pub fn publish_fault(&mut self, reason: FaultReason, now_ns: u64) {
        self.hand_over(Publication::Fault(reason, now_ns));
    }

    fn hand_over(&mut self, publication: Publication) {
        if let Err(rtrb::PushError::Full(kept)) = self.published.push(publication) {
            std::mem::forget(kept);
        }
    }
}

impl WorldSide {
    /// Makes the scan thread's publications visible. True if there were any.
    pub fn pump(&mut self) -> bool {
        let mut any = false;
        // An answer must come after the publication that shows its effect. The answers that wait
        // now are delivered after all publications of this call.
        let answers = self.answers.waiting();
        while let Ok(publication) = self.published.pop() {
            match publication {
                Publication::Outlived(spare) => drop(spare),
                Publication::Beginning(snapshot) => self.beginning = Some(snapshot),
                Publication::Image(snapshot) => {
                    self.hear();
                    self.show(snapshot);
                    any = true;
                }
                Publication::Fault(reason, now_ns) => {
                    // If it was stuck, the monitor has reported this fault already: its time stays.
                    let was_stuck = self.hear();
                    self.show_fault(reason, (!was_stuck).then_some(now_ns));
                    any = true;
                }
            }
        }
        self.drain_returns();
        if answers > 0 {
            let WorldSide { port, answers: ring, .. } = self;
            port.at_commands(|entry| ring.show(answers, entry));
        }
        self.refill();
        any
    }

    /// Notes a sign of life; returns whether the scan thread was stuck. Takes the returned batches:
    /// a refusal must be known before a snapshot that counts the ticket is visible.
    fn hear(&mut self) -> bool {
        let was_stuck = self.port.hear();
        self.drain_returns();
        was_stuck
    }

    /// Shows a fault that the scan thread cannot report itself, and refuses pending requests.
    pub fn trip(&mut self, reason: FaultReason, now_ns: u64) {
        self.port.refuse_pending();
        self.show_fault(reason, Some(now_ns));
    }

    fn drain_returns(&mut self) {
        while let Ok(returned) = self.returns.pop() {
            if let Err(why) = returned.outcome {
                self.port.refuse(Ticket(returned.batch.ticket.0), why);
            }
        }
    }

    fn show(&mut self, mut snapshot: Arc<Snapshot>) {
        let Some(fresh) = Arc::get_mut(&mut snapshot) else { return };
        // An image of its program, or of a later one.
        self.retired.extend(self.beginning.take());
        let latest = self.port.latest();
        let same = fresh.generation == latest.generation;
        if matches!(fresh.mode, Mode::Fault(_)) && same {
            self.keep_image(fresh, &latest);
        }
        if fresh.mode != Mode::Run && latest.mode != Mode::Run {
            // Outside RUN only changed safe values move an output: those of a new program apply
            // from its swap on. Outputs with `hold` stay as they are.
            fresh.outputs.copy_from_slice(&latest.outputs);
            if fresh.safe != latest.safe {
                let safe = Arc::clone(&fresh.safe);
                make_safe(&mut fresh.outputs, &safe);
            }
        } else {
            let driven = self.first_output..self.first_output + fresh.safe.len();
            fresh.outputs.copy_from_slice(&fresh.bits[driven]);
            if fresh.mode != Mode::Run {
                let safe = Arc::clone(&fresh.safe);
                make_safe(&mut fresh.outputs, &safe);
            }
        }
        drop(latest);
        self.swap(snapshot);
    }

    /// In FAULT the image stays that of the last complete scan that was published, except for
    /// forced cells.
    fn keep_image(&self, fresh: &mut Snapshot, latest: &Snapshot) {
        fresh.scans = latest.scans;
        let forced = fresh.forces.list().iter().map(|cell| (*cell, fresh.value(*cell)));
        let active = Cell::Bit(BitCell(self.forces_active as u32));
        let kept: Vec<_> = forced.chain([(active, fresh.value(active))]).collect();
        fresh.bits.copy_from_slice(&latest.bits);
        fresh.words.copy_from_slice(&latest.words);
        for (cell, value) in kept {
            match cell {
                Cell::Bit(BitCell(at)) => fresh.bits[at as usize] = value as u8,
                Cell::Word(WordCell(at)) => fresh.words[at as usize] = value,
                Cell::WordBit(_) => unreachable!("a bit of a word is never forced"),
            }
        }
    }

    fn show_fault(&mut self, reason: FaultReason, since_ns: Option<u64>) {
        let mut snapshot = self.before_fault();
        snapshot.since_ns = since_ns.unwrap_or(snapshot.since_ns);
        snapshot.mode = Mode::Fault(reason);
        let safe = Arc::clone(&snapshot.safe);
        make_safe(&mut snapshot.outputs, &safe);
        self.swap(Arc::new(snapshot));
    }

    /// The latest image. If the fault is in the first scan of a new program: the memory with which
    /// that scan began, and the outputs as they are driven.
    fn before_fault(&mut self) -> Snapshot {
        let latest = self.port.latest();
        let Some(beginning) = self.beginning.take() else { return Snapshot::clone(&latest) };
        let mut snapshot = Snapshot::clone(&beginning);
        snapshot.outputs.copy_from_slice(&latest.outputs);
        snapshot.since_ns = latest.since_ns;
        self.retired.push(beginning);
        snapshot
    }

    fn swap(&mut self, snapshot: Arc<Snapshot>) {
        let old = self.port.publish(snapshot);
        if self.retired.len() < RETIRED_MAX {
            self.retired.push(old);
        }
    }

    /// Turns snapshots without readers into spares; makes new spares if there are too few.
    fn refill(&mut self) {
        let generation = self.port.latest().generation;
        let mut at = 0;
        while at < self.retired.len() {
            if Arc::get_mut(&mut self.retired[at]).is_none() {
                at += 1;
                continue;
            }
            let spare = self.retired.swap_remove(at);
            if spare.generation == generation {
                let _ = self.spares.push(spare);
            }
        }
        let ring = self.spares.buffer().capacity();
        let waiting = ring - self.spares.slots();
        for _ in waiting..SPARES / 2 {
            let fresh = Snapshot::clone(&self.port.latest());
            let _ = self.spares.push(Arc::new(fresh));
        }
    }
}

fn give_back(returns: &mut Producer<ReturnedBatch>, returned: ReturnedBatch) {
    if let Err(rtrb::PushError::Full(kept)) = returns.push(returned) {
        // Never reached: `next_batch` has checked for a free place, and only this side fills the
        // ring. The memory is leaked, because the scan thread must not free.
        std::mem::forget(kept);
    }
}

fn make_safe(outputs: &mut [u8], safe: &[SafeState]) {
    for (output, safe) in outputs.iter_mut().zip(safe) {
        *output = u8::from(safe.driven(*output != 0));
    }
}
