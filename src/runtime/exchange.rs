//! The exchange: how the rest of the process meets the scan.
//!
//! A [`Port`] is all that a driver or a server holds. Through it inputs go in, whole batches of
//! writes go in, and the image of the last complete scan comes out, never two scans mixed. Every
//! call returns at once, and none can delay the scan: what is behind a `Mutex` here is shared by
//! the world's threads alone, the scan thread takes none of them (its end is `link::ScanSide`).
//!
//! Waiting is here too: [`Port::done`] ends with a batch, [`Port::answered`] with a command,
//! [`Port::shows`] with an image. Each is a plain future, woken by the monitor thread when it has
//! shown something; the scan thread wakes nobody.
//!
//! Deliberately absent: names, Modbus, and any limit of time: the caller sets its own.

use std::collections::VecDeque;
use std::future::{Future, poll_fn};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Poll, Waker};
use std::time::Duration;

use super::command::{Answer, Before, Command, CommandId, Denial, Desk};
pub use super::image::{Safe, Snapshot};
pub use super::mode::{FaultReason, Mode, StopReason};
use crate::engine::{BitCell, WordCell};

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
    /// The value of a word after a mask.
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

/// The outcome of a batch.
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

/// A driver's end of the exchange. Cheap to clone.
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
    /// The tasks that wait for something to be shown.
    waiting: Mutex<Vec<Waker>>,
    /// The [`Tempo`] that scans have, in ns.
    period_ns: AtomicU64,
    watchdog_ns: AtomicU64,
}

/// How often scans come, and how long one may take. A reload may change it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tempo {
    /// From scan to scan.
    pub period_ns: u64,
    /// A scan longer than this is a fault.
    pub watchdog_ns: u64,
}

impl Tempo {
    /// The time of this many periods and of one scan that takes as long as it may.
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
    /// The scan thread will not answer any more: pending writes and commands are refused.
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

    /// Sets the tempo. Called by the scan thread, and once before that thread exists.
    pub(super) fn set_tempo(&self, tempo: Tempo) {
        self.shared.period_ns.store(tempo.period_ns, Ordering::Release);
        self.shared.watchdog_ns.store(tempo.watchdog_ns, Ordering::Release);
    }

    /// The shortest time that a caller should wait for the scan that sees its request.
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

    /// Ends once [`Port::latest`] is a newer image than `seen`.
    pub fn changed(&self, seen: &Arc<Snapshot>) -> impl Future<Output = ()> + use<> {
        let seen = Arc::clone(seen);
        self.until(move |port| (!Arc::ptr_eq(&port.latest(), &seen)).then_some(()))
    }

    /// Ends with the first image that is as wanted; the latest one may be.
    pub fn shows(&self, wanted: impl Fn(&Snapshot) -> bool) -> impl Future<Output = Arc<Snapshot>> {
        self.until(move |port| Some(port.latest()).filter(|latest| wanted(latest)))
    }

    /// Ends with the result of `look`, which is called now and each time that something was shown.
    fn until<T, L: FnMut(&Port) -> Option<T>>(
        &self,
        mut look: L,
    ) -> impl Future<Output = T> + use<T, L> {
        let port = self.clone();
        poll_fn(move |context| {
            let mut waiting = locked(&port.shared.waiting);
            // The look is made behind the lock. Whoever shows something takes the lock last, and
            // so either this look finds it or this waker is called.
            if let Some(found) = look(&port) {
                return Poll::Ready(found);
            }
            if !waiting.iter().any(|waker| waker.will_wake(context.waker())) {
                waiting.push(context.waker().clone());
            }
            Poll::Pending
        })
    }

    /// Wakes all that wait, so that they look again. The monitor calls it after it has shown news.
    fn wake(&self) {
        let waiting = std::mem::take(&mut *locked(&self.shared.waiting));
        waiting.into_iter().for_each(Waker::wake);
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

    /// Ends when a batch is done: `Ok` once a scan that saw it is complete and in
    /// [`Port::latest`].
    ///
    /// # Errors
    /// [`Refused::NotRunning`]: the controller left RUN first.
    pub fn done(&self, ticket: Ticket) -> impl Future<Output = Result<(), Refused>> + use<> {
        self.until(move |port| match port.outcome(ticket) {
            Outcome::Pending => None,
            Outcome::Applied => Some(Ok(())),
            Outcome::Refused => Some(Err(Refused::NotRunning)),
        })
    }

    /// The outcome of a batch.
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

    /// Ends when a command is answered, with how things were before it.
    ///
    /// # Errors
    /// The command is denied, and nothing changed.
    pub fn answered(&self, id: CommandId) -> impl Future<Output = Result<Before, Denial>> + use<> {
        self.until(move |port| match port.answer(id)? {
            Answer::Done(before) => Some(Ok(before)),
            Answer::Denied(denial) => Some(Err(denial)),
        })
    }

    /// What became of a command, once that is in [`Port::latest`]; told once. A scan thread that
    /// is stuck meanwhile answers when it comes back.
    pub fn answer(&self, id: CommandId) -> Option<Answer> {
        locked(&self.shared.desk).answer(id)
    }

    pub(super) fn at_desk(&self, show: impl FnOnce(&mut Desk)) {
        show(&mut locked(&self.shared.desk));
        self.wake();
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
        self.wake();
        old
    }

    pub(super) fn refuse(&self, ticket: Ticket) {
        let mut refusals = locked(&self.shared.refusals);
        if refusals.tickets.len() == REFUSED_TICKETS_KEPT {
            refusals.tickets.pop_front();
        }
        refusals.tickets.push_back(ticket.0);
        drop(refusals);
        self.wake();
    }

    /// Until the scan thread is heard of again: pending requests are refused.
    pub(super) fn refuse_pending(&self) {
        self.shared.running.store(false, Ordering::Release);
        self.shared.stuck.store(true, Ordering::Release);
        locked(&self.shared.refusals).all_pending = true;
    }
}

/// A lock that a panic elsewhere does not spoil: its data is whole after every statement.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
