//! The exchange of data between the scan and the rest of the process.
//!
//! A driver or a server holds a [`Port`]. It takes inputs and whole batches of writes, and returns
//! the image of the last complete scan, never a mix of two scans. Every call returns at once, and
//! none can delay the scan: only threads other than the scan thread lock the mutexes here (the scan
//! thread's end is `link::ScanSide`).
//!
//! Callers wait here too: [`Port::done`] for a batch, [`Port::answered`] for a command,
//! [`Port::shows`] for an image. Each is a plain future. The monitor thread wakes it after it has
//! published something (`waiting`); the scan thread wakes no task.
//!
//! Deliberately absent: names, Modbus, and time limits. The caller sets its own limit.

use std::collections::VecDeque;
use std::future::Future;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::command::{
    CommandDenial, CommandEntry, CommandId, CommandOutcome, ScanCommand, StateBefore,
};
use super::gate::ScanGate;
pub use super::gate::Tempo;
use super::hold_step::HoldStep;
pub use super::image::{SafeState, Snapshot};
pub use super::mode::{FaultReason, Mode, StopReason};
use super::origin::Origin;
pub use super::origin::Ticket;
use super::waiting::{PortWait, Waiting};
use rungd_base::locked::locked;
use rungd_engine::{BitCell, Cell, WordBitCell, WordCell};

/// The greatest number of writes in one batch. (A Modbus request writes at most 1968 coils, and
/// each coil may stand for an input as well.)
pub const BATCH_WRITES_MAX: usize = 4096;

/// The greatest number of waiting batches; a further one is refused with
/// [`BatchRefusal::QueueFull`].
pub const QUEUED_BATCHES_MAX: usize = 256;

/// The greatest number of waiting writes, all of which one scan can apply. A batch that would
/// exceed it is refused with [`BatchRefusal::QueueFull`]. So the next scan sees every waiting
/// write.
pub(crate) const SCAN_WRITES_MAX: usize = 2 * BATCH_WRITES_MAX;

/// The number of refused tickets that are remembered: as many as can be under way at once.
const REFUSED_TICKETS_KEPT: usize = 4 * QUEUED_BATCHES_MAX;

/// The greatest number of signatures that wait for the scan log.
const SIGNATURES_KEPT: usize = 4 * QUEUED_BATCHES_MAX;

/// One write. The caller has checked that the value is within the operand's range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum OperandWrite {
    Bit(BitCell, bool),
    Word(WordCell, i32),
    /// Turns a bit of a word ON or OFF, in the word's current value.
    WordBit(WordBitCell, bool),
    /// Changes the low 16 bits of a 16-bit word. The scan applies the mask to the word's current
    /// value, so that no write of the ladder is lost.
    Masked {
        cell: WordCell,
        mask: WordMask,
        /// The 16 bits are a signed number.
        signed: bool,
    },
    /// Sets an input as [`Port::set_input`] does, but in the same scan as the rest of the batch.
    /// The input keeps the value until it is set again, in either way.
    Input(u32, bool),
}

impl OperandWrite {
    /// A write of a bit.
    ///
    /// # Panics
    /// If the cell is a whole word.
    pub fn of_bit(cell: Cell, on: bool) -> OperandWrite {
        match cell {
            Cell::Bit(cell) => OperandWrite::Bit(cell, on),
            Cell::WordBit(bit) => OperandWrite::WordBit(bit, on),
            Cell::Word(_) => unreachable!("a word is no bit"),
        }
    }
}

/// A change of 16 bits: those that are 1 in `and` stay, the others become those of `or`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WordMask {
    /// The bits that stay.
    pub and: u16,
    /// The new values of the others.
    pub or: u16,
}

impl WordMask {
    /// The value of a word after the change. `signed`: its 16 bits are a signed number.
    pub fn apply(self, value: i32, signed: bool) -> i32 {
        let bits = value as u16 & self.and | self.or & !self.and;
        if signed { i32::from(bits as i16) } else { i32::from(bits) }
    }
}

/// Why a batch was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BatchRefusal {
    /// The controller is in STOP or FAULT.
    NotRunning,
    /// [`QUEUED_BATCHES_MAX`] batches wait already, or [`SCAN_WRITES_MAX`] writes would.
    QueueFull,
    /// More than [`BATCH_WRITES_MAX`] writes.
    TooLarge,
    /// The program was reloaded before a scan saw the batch, and the new program does not have one
    /// of its cells, or the batch was for the earlier program only.
    Overtaken,
    /// No scan took the batch before the moment until which it was to be taken.
    Late,
    /// The hold that the batch was to put off or to end has ended.
    HoldEnded,
    /// The batch was to begin a hold, and there are [`HOLDS_MAX`](super::hold_step::HOLDS_MAX)
    /// already.
    HoldsFull,
    /// The batch was to begin a hold, and is not one write that turns one bit of memory ON.
    NoHeldBit,
}

/// The outcome of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BatchOutcome {
    /// No complete scan has seen it yet.
    Pending,
    /// A scan that saw it is complete, and in [`Port::latest`].
    Applied,
    /// The controller left RUN before a scan that saw it was complete, or a reload came first.
    Refused(BatchRefusal),
}

/// A batch. It goes to the scan, and comes back to be freed.
#[derive(Debug)]
pub(crate) struct WriteBatch {
    /// Its ticket.
    pub ticket: Ticket,
    /// The program and the time for which it is meant.
    pub terms: BatchTerms,
    /// The writes; the scan applies all of them, in this order, or none.
    pub writes: Vec<OperandWrite>,
}

/// The program and the time for which a batch is meant.
#[derive(Clone, Copy, Debug)]
pub struct BatchTerms {
    /// The generation of the program that the cells belong to.
    pub generation: u32,
    /// Whether the batch is for this program only: after a reload it is refused, even if the new
    /// program has all of its cells.
    pub is_bound: bool,
    /// A scan that begins after this moment refuses the batch; ns of the scan's
    /// [`boottime_ns`](super::pacing::Clock::boottime_ns).
    pub until_ns: u64,
    /// What the batch does with a hold.
    pub hold: Option<HoldStep>,
}

impl BatchTerms {
    /// The terms of a batch without a hold, for the cells of the program of this generation, at any
    /// time.
    pub fn of(generation: u32) -> BatchTerms {
        BatchTerms { generation, is_bound: false, until_ns: u64::MAX, hold: None }
    }
}

/// A driver's end of the exchange. Cheap to clone.
#[derive(Clone)]
pub struct Port {
    pub(super) shared: Arc<ExchangeState>,
}

/// The state that all ports share. The scan thread uses only the gate.
pub(super) struct ExchangeState {
    pub(super) gate: ScanGate,
    latest: Mutex<Arc<Snapshot>>,
    door: Mutex<BatchEntry>,
    refusals: Mutex<LateRefusals>,
    commands: Mutex<CommandEntry>,
    /// The tasks that wait for a change.
    waiting: Arc<Waiting>,
    /// The senders of batches and commands, for the scan log.
    signatures: Mutex<VecDeque<(Origin, String)>>,
}

/// The entry for batches.
struct BatchEntry {
    queue: rtrb::Producer<WriteBatch>,
    last: u64,
}

/// The accepted batches that were refused later.
#[derive(Default)]
struct LateRefusals {
    tickets: VecDeque<(u64, BatchRefusal)>,
    /// The scan thread no longer answers: pending writes and commands are refused.
    all_pending: bool,
}

impl Port {
    pub(super) fn new(
        inputs: u32,
        first: Snapshot,
        queue: rtrb::Producer<WriteBatch>,
        commands: CommandEntry,
    ) -> Port {
        let shared = ExchangeState {
            gate: ScanGate::new(inputs),
            latest: Mutex::new(Arc::new(first)),
            door: Mutex::new(BatchEntry { queue, last: 0 }),
            refusals: Mutex::default(),
            commands: Mutex::new(commands),
            waiting: Arc::default(),
            signatures: Mutex::default(),
        };
        Port { shared: Arc::new(shared) }
    }

    /// The current tempo.
    pub fn tempo(&self) -> Tempo {
        self.shared.gate.tempo()
    }

    /// Sets the tempo. Called by the scan thread, and once before that thread exists.
    pub(super) fn set_tempo(&self, tempo: Tempo) {
        self.shared.gate.set_tempo(tempo);
    }

    /// Notes the sender of a batch or a command, for the scan log.
    pub fn sign(&self, origin: Origin, who: String) {
        let mut signatures = locked(&self.shared.signatures);
        if signatures.len() == SIGNATURES_KEPT {
            signatures.pop_front();
        }
        signatures.push_back((origin, who));
    }

    /// Takes the signatures since the last call.
    pub fn signatures(&self) -> VecDeque<(Origin, String)> {
        std::mem::take(&mut *locked(&self.shared.signatures))
    }

    /// The shortest time that a caller should wait for the scan that sees its request.
    pub fn patience(&self) -> Duration {
        self.tempo().patience(3)
    }

    /// Sets an input; the next scan reads it at its input step. An X that does not exist is
    /// ignored.
    pub fn set_input(&self, x: u32, on: bool) {
        self.shared.gate.set_input(x, on);
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

    /// Ends with the first image that meets the condition; that may be the latest one. The monitor
    /// thread judges each image, and wakes the task for that one only.
    pub fn shows<W>(&self, wanted: W) -> impl Future<Output = Arc<Snapshot>> + use<W>
    where
        W: Fn(&Snapshot) -> bool + Send + Sync + 'static,
    {
        let wanted = Arc::new(wanted);
        let is_wanted = Arc::clone(&wanted);
        let port = self.clone();
        let look = move || Some(port.latest()).filter(|latest| wanted(latest));
        PortWait::new(Arc::clone(&self.shared.waiting), look, Some(is_wanted))
    }

    /// Ends with the result of `look`. Calls `look` now and after every change.
    fn until<T, L: FnMut(&Port) -> Option<T> + Unpin>(
        &self,
        mut look: L,
    ) -> impl Future<Output = T> + use<T, L> {
        let port = self.clone();
        PortWait::new(Arc::clone(&self.shared.waiting), move || look(&port), None)
    }

    /// Wakes the waiting tasks that have to look again. The monitor calls it after every change.
    fn wake(&self) {
        self.shared.waiting.wake(|| self.latest());
    }

    /// Hands in a batch for the cells of the latest image's program. The scan applies all its
    /// writes between two scans, in the order of tickets.
    ///
    /// # Errors
    /// The batch is refused, and none of its writes is applied: see [`BatchRefusal`].
    pub fn submit(&self, writes: Vec<OperandWrite>) -> Result<Ticket, BatchRefusal> {
        self.submit_to(self.latest().generation, writes)
    }

    /// Does the same as [`Port::submit`], for the cells of the program of this generation. If it is
    /// reloaded before the scan, each write goes to the cell of its element in the new program; if
    /// one of the elements is gone, the batch is refused.
    ///
    /// # Errors
    /// The same as those of [`Port::submit`].
    pub fn submit_to(
        &self,
        generation: u32,
        writes: Vec<OperandWrite>,
    ) -> Result<Ticket, BatchRefusal> {
        self.submit_by(BatchTerms::of(generation), writes)
    }

    /// Does the same as [`Port::submit_to`], with terms.
    ///
    /// # Errors
    /// The same as those of [`Port::submit`].
    pub fn submit_by(
        &self,
        terms: BatchTerms,
        writes: Vec<OperandWrite>,
    ) -> Result<Ticket, BatchRefusal> {
        if writes.len() > BATCH_WRITES_MAX {
            return Err(BatchRefusal::TooLarge);
        }
        let mut door = locked(&self.shared.door);
        let gate = &self.shared.gate;
        if !gate.is_open() {
            return Err(BatchRefusal::NotRunning);
        }
        if door.queue.is_full() || !gate.reserve(writes.len(), SCAN_WRITES_MAX) {
            return Err(BatchRefusal::QueueFull);
        }
        let ticket = Ticket(door.last + 1);
        let batch = WriteBatch { ticket, terms, writes };
        door.queue.push(batch).map_err(|_| BatchRefusal::QueueFull)?;
        door.last = ticket.0;
        Ok(ticket)
    }

    /// Ends when a batch is done: `Ok` once a scan that saw it is complete and in
    /// [`Port::latest`].
    ///
    /// # Errors
    /// [`BatchRefusal::NotRunning`]: the controller left RUN first. [`BatchRefusal::Overtaken`]: a
    /// reload came first.
    pub fn done(&self, ticket: Ticket) -> impl Future<Output = Result<(), BatchRefusal>> + use<> {
        self.until(move |port| match port.outcome(ticket) {
            BatchOutcome::Pending => None,
            BatchOutcome::Applied => Some(Ok(())),
            BatchOutcome::Refused(why) => Some(Err(why)),
        })
    }

    /// The outcome of a batch.
    pub(crate) fn outcome(&self, ticket: Ticket) -> BatchOutcome {
        // `latest` is read first: a refusal is entered before the snapshot that counts its ticket.
        let seen = ticket.0 <= self.latest().tickets_done;
        let refusals = locked(&self.shared.refusals);
        match refusals.tickets.iter().find(|(refused, _)| *refused == ticket.0) {
            Some((_, why)) => BatchOutcome::Refused(*why),
            None if seen => BatchOutcome::Applied,
            None if refusals.all_pending => BatchOutcome::Refused(BatchRefusal::NotRunning),
            None => BatchOutcome::Pending,
        }
    }

    /// Hands in a command. The scan thread executes it between two scans, or at a tick, in the
    /// order of numbers.
    ///
    /// # Errors
    /// Too many commands wait, or the scan thread is stuck.
    pub fn command(&self, command: ScanCommand) -> Result<CommandId, CommandDenial> {
        self.command_to(self.latest().generation, command)
    }

    /// Does the same as [`Port::command`], for the cells of the program of this generation.
    ///
    /// # Errors
    /// The same as those of [`Port::command`].
    pub fn command_to(
        &self,
        generation: u32,
        command: ScanCommand,
    ) -> Result<CommandId, CommandDenial> {
        self.command_until(u64::MAX, generation, command)
    }

    /// Does the same as [`Port::command_to`]. After `until_ns` the command is denied.
    ///
    /// # Errors
    /// The same as those of [`Port::command`].
    pub fn command_until(
        &self,
        until_ns: u64,
        generation: u32,
        command: ScanCommand,
    ) -> Result<CommandId, CommandDenial> {
        if self.is_stuck() {
            return Err(CommandDenial::ScanThreadStuck);
        }
        locked(&self.shared.commands).hand_in(generation, command, until_ns)
    }

    /// Whether the scan thread is stuck or has ended, so that it accepts no command.
    pub(super) fn is_stuck(&self) -> bool {
        self.shared.gate.is_stuck()
    }

    /// Ends with the answer to a command: the state before it.
    ///
    /// # Errors
    /// The command was denied, and nothing changed.
    pub fn answered(
        &self,
        id: CommandId,
    ) -> impl Future<Output = Result<StateBefore, CommandDenial>> + use<> {
        self.until(move |port| match port.answer(id)? {
            CommandOutcome::Done(before) => Some(Ok(before)),
            CommandOutcome::Denied(denial) => Some(Err(denial)),
        })
    }

    /// The answer to a command, after its effect is in [`Port::latest`]. It is returned once. A
    /// stuck scan thread answers when it comes back.
    pub fn answer(&self, id: CommandId) -> Option<CommandOutcome> {
        locked(&self.shared.commands).answer(id)
    }

    pub(super) fn at_commands(&self, show: impl FnOnce(&mut CommandEntry)) {
        show(&mut locked(&self.shared.commands));
        self.wake();
    }

    /// Notes a sign of life of the scan thread: it is not stuck. Returns whether it was.
    pub(super) fn hear(&self) -> bool {
        let was_stuck = self.shared.gate.hear();
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

    pub(super) fn refuse(&self, ticket: Ticket, why: BatchRefusal) {
        let mut refusals = locked(&self.shared.refusals);
        if refusals.tickets.len() == REFUSED_TICKETS_KEPT {
            refusals.tickets.pop_front();
        }
        refusals.tickets.push_back((ticket.0, why));
        drop(refusals);
        self.wake();
    }

    /// Refuses pending requests until the scan thread gives a sign of life.
    pub(super) fn refuse_pending(&self) {
        self.shared.gate.set_stuck();
        locked(&self.shared.refusals).all_pending = true;
    }
}
