//! The exchange: how the rest of the process meets the scan.
//!
//! A [`Port`] is all that a driver or a server holds. Through it inputs go in, whole batches of
//! writes go in, and the image of the last complete scan comes out, never two scans mixed. Every
//! call returns at once, and none can delay the scan: what is behind a `Mutex` here is shared by
//! the world's threads alone, the scan thread takes none of them (its end is `link::ScanSide`).
//!
//! Deliberately absent: names, Modbus, waiting. A driver that wants to know when its write was
//! seen asks [`Port::outcome`] again after a millisecond.

use std::collections::VecDeque;
use std::fmt;
use std::future::{Future, poll_fn};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Poll, Waker};
use std::time::Duration;

use super::command::{Answer, Command, CommandId, Denial, Desk, Forces};
use super::link::Safe;
use crate::engine::{BitCell, Cell, WordCell};

/// The most writes that one batch may hold. (A Modbus request writes at most 1968 coils, and each
/// may stand for an input too.)
pub const BATCH_WRITES_MAX: usize = 4096;

/// The most batches that wait for a scan; one more is refused with [`Refused::QueueFull`].
pub const QUEUED_BATCHES_MAX: usize = 256;

/// The most writes that wait for a scan, and that one scan applies; with more a batch is refused
/// with [`Refused::QueueFull`]. Any batch fits, and what waits is seen by the next scan.
pub const SCAN_WRITES_MAX: usize = 2 * BATCH_WRITES_MAX;

/// How many refused tickets are remembered. No more can be on the way at once.
const REFUSED_TICKETS_KEPT: usize = 4 * QUEUED_BATCHES_MAX;

/// What the controller does at present.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// It scans, and outputs are driven.
    Run,
    /// It does not scan; outputs are safe; every block had its termination pass.
    Stop(StopReason),
    /// It does not scan; outputs are safe; no termination pass ran.
    Fault(FaultReason),
}

/// Why the controller is in STOP.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// The first scan is still to come.
    NotStarted,
    /// The ladder executed STOP.
    Instruction,
    /// A signal asked for it.
    Signal,
    /// The number of scans that was asked for is complete.
    ScanLimit,
    /// An operator asked for it.
    Operator,
    /// It was restarted too often in too short a time, and so started in STOP.
    RestartGuard,
    /// Nothing was found to be restored, and memory is as after a cold start.
    NothingRestored,
}

/// Why the controller is in FAULT.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultReason {
    /// A scan took longer than the watchdog allows.
    ScanTooLong {
        /// How long, in microseconds.
        scan_us: u32,
    },
    /// A scan has not ended though the watchdog's time is over.
    ScanNeverEnds,
    /// A scan was due and has not begun though the watchdog's time is over.
    ScanNeverBegins,
    /// The engine met a state that cannot be (a bug in rungd, not in the ladder).
    EnginePanic,
    /// The scan thread is gone (a bug in rungd).
    ScanThreadGone,
}

impl StopReason {
    /// Whether the process stays, for an operator to run it again.
    pub fn waits_for_operator(self) -> bool {
        self == StopReason::Instruction || self.is_meant()
    }

    /// Whether a start may be meant to be in STOP for it.
    pub fn is_meant(self) -> bool {
        use StopReason::{NothingRestored, Operator, RestartGuard};
        matches!(self, Operator | RestartGuard | NothingRestored)
    }
}

impl Mode {
    /// `RUN`, `STOP` or `FAULT`.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Run => "RUN",
            Mode::Stop(_) => "STOP",
            Mode::Fault(_) => "FAULT",
        }
    }
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            StopReason::NotStarted => "the first scan is still to come",
            StopReason::Instruction => "the ladder executed STOP",
            StopReason::Signal => "a signal asked for it",
            StopReason::ScanLimit => "the number of scans asked for is complete",
            StopReason::Operator => "an operator asked for it",
            StopReason::RestartGuard => "it was restarted too often in too short a time",
            StopReason::NothingRestored => {
                "nothing was found to be restored, and memory is as after a cold start"
            }
        })
    }
}

impl fmt::Display for FaultReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FaultReason::ScanTooLong { scan_us } => {
                write!(f, "a scan took {scan_us} us, longer than the watchdog allows")
            }
            FaultReason::ScanNeverEnds => {
                f.write_str("a scan has not ended though the watchdog's time is over")
            }
            FaultReason::ScanNeverBegins => {
                f.write_str("a scan was due and has not begun though the watchdog's time is over")
            }
            FaultReason::EnginePanic => f.write_str("the engine met a state that cannot be"),
            FaultReason::ScanThreadGone => f.write_str("the scan thread is gone"),
        }
    }
}

/// What the world sees: the image of the last complete scan, whole.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Which program's: one more with every reload. Cells are that program's.
    pub generation: u32,
    /// Complete scans since the process started.
    pub scans: u64,
    /// The timestamp of that scan (CLOCK_MONOTONIC, ns).
    pub now_ns: u64,
    /// The mode.
    pub mode: Mode,
    /// Since when it has been so (CLOCK_MONOTONIC, ns).
    pub since_ns: u64,
    /// Every bit, by [`BitCell`]; 0 or 1.
    pub bits: Box<[u8]>,
    /// Every word, by [`WordCell`].
    pub words: Box<[i32]>,
    /// Y0, Y1, … as driven: the image's in RUN, else the safe values. 0 or 1.
    pub outputs: Box<[u8]>,
    /// Every batch with a ticket up to this one has been seen by a complete scan or refused.
    pub tickets_done: u64,
    /// What is forced.
    pub forces: Forces,
    /// What each Y does outside RUN.
    pub safe: Arc<[Safe]>,
}

impl Snapshot {
    /// A bit.
    pub fn bit(&self, cell: BitCell) -> bool {
        self.bits[cell.0 as usize] != 0
    }

    /// A word.
    pub fn word(&self, cell: WordCell) -> i32 {
        self.words[cell.0 as usize]
    }

    /// A bit (0 or 1) or word.
    pub fn value(&self, cell: Cell) -> i32 {
        match cell {
            Cell::Bit(bit) => i32::from(self.bit(bit)),
            Cell::Word(word) => self.word(word),
        }
    }
}

/// One write, its value within its operand's range (the caller sees to that).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Write {
    Bit(BitCell, bool),
    Word(WordCell, i32),
    /// The low 16 bits of a word that holds no more: those of `and` stay, the others become those
    /// of `or`. Of what the word holds in the scan, so that nothing comes between.
    Masked {
        cell: WordCell,
        and: u16,
        or: u16,
        /// The 16 bits are a signed number.
        signed: bool,
    },
    /// An input, as [`Port::set_input`], but together with the rest of the batch. It stays as it
    /// is set until it is set again, in whichever way.
    Input(u32, bool),
}

impl Write {
    /// What a word becomes by a mask.
    pub fn masked(value: i32, (and, or): (u16, u16), signed: bool) -> i32 {
        let bits = value as u16 & and | or & !and;
        if signed { i32::from(bits as i16) } else { i32::from(bits) }
    }
}

/// Why a batch was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// The controller is in STOP or FAULT.
    NotRunning,
    /// [`QUEUED_BATCHES_MAX`] batches wait already, or [`SCAN_WRITES_MAX`] writes would.
    QueueFull,
    /// More than [`BATCH_WRITES_MAX`] writes.
    TooLarge,
}

/// A batch that was taken: the first of a process is 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ticket(pub u64);

/// What became of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// No complete scan has seen it yet.
    Pending,
    /// A scan that saw it is complete, and in [`Port::latest`].
    Applied,
    /// The controller left RUN before a scan that saw it was complete.
    Refused,
}

/// A batch on its way to the scan, and back to be dropped.
#[derive(Debug)]
pub struct Batch {
    /// Its ticket.
    pub ticket: Ticket,
    /// Applied whole, in this order.
    pub writes: Vec<Write>,
}

/// What a driver holds. Cheap to clone.
#[derive(Clone)]
pub struct Port {
    pub(super) shared: Arc<Shared>,
}

/// What the ports share with each other, and (its atomics alone) with the scan thread.
pub(super) struct Shared {
    /// Inputs, 64 to a word.
    pub(super) inputs: Box<[AtomicU64]>,
    pub(super) input_count: u32,
    /// Whether batches are taken: ON in RUN.
    pub(super) running: AtomicBool,
    /// The writes of all batches that no scan has taken.
    pub(super) waiting_writes: AtomicUsize,
    latest: Mutex<Arc<Snapshot>>,
    door: Mutex<Door>,
    refusals: Mutex<Refusals>,
    /// The monitor has called the scan thread stuck, and has heard nothing of it since.
    stuck: AtomicBool,
    desk: Mutex<Desk>,
    /// Who waits for a further image.
    waiting: Mutex<Vec<Waker>>,
    /// The [`Tempo`] that scans have, in ns.
    period_ns: AtomicU64,
    watchdog_ns: AtomicU64,
}

/// How often scans come, and how long one may take. Another program may bring another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tempo {
    /// From scan to scan.
    pub period_ns: u64,
    /// A scan longer than this is a fault.
    pub watchdog_ns: u64,
}

impl Tempo {
    /// So many periods, and a scan that takes as long as it may.
    pub fn patience(self, periods: u64) -> Duration {
        let periods_ns = self.period_ns.saturating_mul(periods);
        Duration::from_nanos(periods_ns.saturating_add(self.watchdog_ns))
    }
}

/// Where batches go in.
struct Door {
    queue: rtrb::Producer<Batch>,
    last: u64,
}

/// Tickets that were taken and then refused.
#[derive(Default)]
struct Refusals {
    tickets: VecDeque<u64>,
    /// The scan thread will not answer any more: what is pending is refused.
    all_pending: bool,
}

impl Port {
    pub(super) fn new(
        inputs: u32,
        first: Snapshot,
        queue: rtrb::Producer<Batch>,
        desk: Desk,
    ) -> Port {
        let words = inputs.div_ceil(64) as usize;
        let shared = Shared {
            inputs: (0..words).map(|_| AtomicU64::new(0)).collect(),
            input_count: inputs,
            running: AtomicBool::new(false),
            waiting_writes: AtomicUsize::new(0),
            latest: Mutex::new(Arc::new(first)),
            door: Mutex::new(Door { queue, last: 0 }),
            refusals: Mutex::default(),
            stuck: AtomicBool::new(false),
            desk: Mutex::new(desk),
            waiting: Mutex::default(),
            period_ns: AtomicU64::new(0),
            watchdog_ns: AtomicU64::new(0),
        };
        Port { shared: Arc::new(shared) }
    }

    /// How often scans come at present, and how long one may take.
    pub fn tempo(&self) -> Tempo {
        let shared = &self.shared;
        Tempo {
            period_ns: shared.period_ns.load(Ordering::Acquire),
            watchdog_ns: shared.watchdog_ns.load(Ordering::Acquire),
        }
    }

    /// From here on it is this. The scan thread's, and before there is one.
    pub(super) fn set_tempo(&self, tempo: Tempo) {
        self.shared.period_ns.store(tempo.period_ns, Ordering::Release);
        self.shared.watchdog_ns.store(tempo.watchdog_ns, Ordering::Release);
    }

    /// How long who asks for something waits at least for the scan that sees it.
    pub fn patience(&self) -> Duration {
        self.tempo().patience(3)
    }

    /// Sets an input; the next scan reads it at its input step. An X that does not exist is
    /// ignored.
    pub fn set_input(&self, x: u32, on: bool) {
        if x >= self.shared.input_count {
            return;
        }
        let word = &self.shared.inputs[x as usize / 64];
        let bit = 1_u64 << (x % 64);
        if on {
            word.fetch_or(bit, Ordering::Relaxed);
        } else {
            word.fetch_and(!bit, Ordering::Relaxed);
        }
    }

    /// The last complete scan as published, and the mode.
    pub fn latest(&self) -> Arc<Snapshot> {
        Arc::clone(&locked(&self.shared.latest))
    }

    /// Ends once [`Port::latest`] is another than `seen`.
    pub fn changed(&self, seen: &Arc<Snapshot>) -> impl Future<Output = ()> + use<> {
        let (port, seen) = (self.clone(), Arc::clone(seen));
        poll_fn(move |context| {
            let mut waiting = locked(&port.shared.waiting);
            // Behind the lock: whoever publishes takes it last, and so wakes this one.
            if !Arc::ptr_eq(&port.latest(), &seen) {
                return Poll::Ready(());
            }
            if !waiting.iter().any(|waker| waker.will_wake(context.waker())) {
                waiting.push(context.waker().clone());
            }
            Poll::Pending
        })
    }

    /// Hands in a batch: applied whole, between two scans, in the order of tickets.
    ///
    /// # Errors
    /// At once, and nothing of the batch is applied: see [`Refused`].
    pub fn submit(&self, writes: Vec<Write>) -> Result<Ticket, Refused> {
        if writes.len() > BATCH_WRITES_MAX {
            return Err(Refused::TooLarge);
        }
        let mut door = locked(&self.shared.door);
        if !self.shared.running.load(Ordering::Acquire) {
            return Err(Refused::NotRunning);
        }
        // It grows behind the door alone, and shrinks when a scan takes a batch.
        let (waiting, count) = (&self.shared.waiting_writes, writes.len());
        if door.queue.is_full() || waiting.load(Ordering::Acquire) + count > SCAN_WRITES_MAX {
            return Err(Refused::QueueFull);
        }
        waiting.fetch_add(count, Ordering::AcqRel);
        let ticket = Ticket(door.last + 1);
        door.queue.push(Batch { ticket, writes }).map_err(|_| Refused::QueueFull)?;
        door.last = ticket.0;
        Ok(ticket)
    }

    /// What became of a batch.
    pub fn outcome(&self, ticket: Ticket) -> Outcome {
        // `latest` first: what it shows as done was entered among the refused before it.
        let seen = ticket.0 <= self.latest().tickets_done;
        let refusals = locked(&self.shared.refusals);
        if refusals.tickets.contains(&ticket.0) {
            Outcome::Refused
        } else if seen {
            Outcome::Applied
        } else if refusals.all_pending {
            Outcome::Refused
        } else {
            Outcome::Pending
        }
    }

    /// Hands in a command: done between two scans, or at a tick, in the order of numbers.
    ///
    /// # Errors
    /// At once: too many wait, or nobody would hear it.
    pub fn command(&self, command: Command) -> Result<CommandId, Denial> {
        if self.is_stuck() {
            return Err(Denial::ScanThreadStuck);
        }
        locked(&self.shared.desk).hand_in(command)
    }

    /// Whether the scan thread is held up, or gone: it hears nothing.
    pub(super) fn is_stuck(&self) -> bool {
        self.shared.stuck.load(Ordering::Acquire)
    }

    /// What became of a command, once that is in [`Port::latest`]; told once. A scan thread that
    /// is stuck meanwhile answers when it comes back.
    pub fn answer(&self, id: CommandId) -> Option<Answer> {
        locked(&self.shared.desk).answer(id)
    }

    pub(super) fn at_desk(&self, show: impl FnOnce(&mut Desk)) {
        show(&mut locked(&self.shared.desk));
    }

    /// The scan thread was heard of: it is not stuck (any more). True if it was.
    pub(super) fn hear(&self) -> bool {
        let was_stuck = self.shared.stuck.swap(false, Ordering::AcqRel);
        if was_stuck {
            locked(&self.shared.refusals).all_pending = false;
        }
        was_stuck
    }

    pub(super) fn publish(&self, snapshot: Arc<Snapshot>) -> Arc<Snapshot> {
        let old = std::mem::replace(&mut *locked(&self.shared.latest), snapshot);
        locked(&self.shared.waiting).drain(..).for_each(Waker::wake);
        old
    }

    pub(super) fn refuse(&self, ticket: Ticket) {
        let mut refusals = locked(&self.shared.refusals);
        if refusals.tickets.len() == REFUSED_TICKETS_KEPT {
            refusals.tickets.pop_front();
        }
        refusals.tickets.push_back(ticket.0);
    }

    /// Until the scan thread is heard of again: what is pending is refused, and it is told nothing.
    pub(super) fn refuse_pending(&self) {
        self.shared.running.store(false, Ordering::Release);
        self.shared.stuck.store(true, Ordering::Release);
        locked(&self.shared.refusals).all_pending = true;
    }
}

/// A lock that a panic elsewhere does not spoil: what it guards is whole after every statement.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
