//! An operator's commands to the scan thread: run, stop, force, release.
//!
//! Other threads hand commands in at the [`super::exchange::Port`]. The scan thread takes them in
//! order between two scans (in STOP and FAULT: at a tick), and answers each one after its effect is
//! published. Commands and answers pass through rings; the scan thread never locks a `Mutex` here.
//!
//! Deliberately absent: permissions, and the names of commands.

use std::collections::VecDeque;
use std::fmt;

use rtrb::{Consumer, Producer, RingBuffer};

pub(crate) use super::forces::FORCES_MAX;
pub use super::forces::Forces;
use super::mode::Mode;
use rungd_engine::Cell;

/// The maximum number of commands that wait for the scan thread; a further one is denied.
pub(crate) const COMMANDS_MAX: usize = 64;

/// The maximum number of answers that are kept for the callers.
const ANSWERS_KEPT: usize = 4 * COMMANDS_MAX;

/// A command to the scan thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScanCommand {
    /// STOP or FAULT → RUN, with memory as it is.
    Run,
    /// RUN → STOP: the next scan is the last, then the passes.
    Stop,
    /// Forces a bit (0 or 1) or word, its value within its range.
    Force {
        /// The bit or word.
        cell: Cell,
        /// The value.
        value: i32,
    },
    /// Ends a force.
    Release(Cell),
    /// Ends all forces.
    ReleaseAll,
    /// Continues with a new program, whose package was handed in.
    Swap {
        /// The generation of the program.
        generation: u32,
        /// In FAULT, RUN continues with the new program, with memory as it is and without a pass.
        resume: bool,
    },
}

/// The reason why a command is denied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandDenial {
    /// [`COMMANDS_MAX`] commands wait already.
    QueueFull,
    /// The scan thread is stuck, or has ended.
    ScanThreadStuck,
    /// The engine panicked, so its memory cannot be trusted.
    EngineBroken,
    /// The process is about to end.
    Ending,
    /// A stop in FAULT, in which there are no scans.
    Faulted,
    /// [`FORCES_MAX`] bits and words are forced already.
    TooManyForces,
    /// No package with this program was handed in.
    NoProgram,
    /// The program was reloaded in between, and the new one does not have the cell of the command.
    Gone,
    /// The scan thread came to the command after the moment until which it was to be executed.
    Late,
}

/// The outcome of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandOutcome {
    /// The command is done and its effect is published. Contains the state before it.
    Done(StateBefore),
    /// The command is not done, and nothing changed.
    Denied(CommandDenial),
}

/// The state before a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StateBefore {
    /// The mode.
    pub mode: Mode,
    /// The value of the bit or word; 0 for a command without one.
    pub value: i32,
    /// Whether the bit or word was forced.
    pub forced: bool,
}

/// The number of an accepted command; the first one of a process is 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct CommandId(pub u64);

/// A command that waits.
#[derive(Clone, Copy, Debug)]
pub(super) struct WaitingCommand {
    pub id: CommandId,
    /// The generation of the program that the command's cell belongs to.
    pub generation: u32,
    pub command: ScanCommand,
    /// After this moment the command is denied; ns of the scan's
    /// [`boottime_ns`](super::pacing::Clock::boottime_ns).
    pub until_ns: u64,
}

#[derive(Clone, Copy, Debug)]
struct CommandAnswer {
    id: u64,
    answer: CommandOutcome,
}

/// The entry for commands, and the answers that no caller has fetched yet.
pub(super) struct CommandEntry {
    orders: Producer<WaitingCommand>,
    last: u64,
    answers: VecDeque<(u64, CommandOutcome)>,
}

/// The scan thread's end.
pub(super) struct CommandReceiver {
    orders: Consumer<WaitingCommand>,
    answers: Producer<CommandAnswer>,
    /// The answers of this step, sent at its end.
    taken: Vec<CommandAnswer>,
}

/// The monitor's end of the ring of answers.
pub(super) struct AnswerReceiver(Consumer<CommandAnswer>);

pub(super) fn command_rings() -> (CommandEntry, CommandReceiver, AnswerReceiver) {
    let (order_in, orders) = RingBuffer::new(COMMANDS_MAX);
    let (answer_in, answers) = RingBuffer::new(2 * COMMANDS_MAX);
    let entry =
        CommandEntry { orders: order_in, last: 0, answers: VecDeque::with_capacity(ANSWERS_KEPT) };
    let taken = Vec::with_capacity(COMMANDS_MAX);
    (entry, CommandReceiver { orders, answers: answer_in, taken }, AnswerReceiver(answers))
}

impl CommandEntry {
    pub(crate) fn hand_in(
        &mut self,
        generation: u32,
        command: ScanCommand,
        until_ns: u64,
    ) -> Result<CommandId, CommandDenial> {
        let order = WaitingCommand { id: CommandId(self.last + 1), generation, command, until_ns };
        self.orders.push(order).map_err(|_| CommandDenial::QueueFull)?;
        self.last = order.id.0;
        Ok(order.id)
    }

    /// Returns an answer, once, and forgets it.
    pub(crate) fn answer(&mut self, id: CommandId) -> Option<CommandOutcome> {
        let at = self.answers.iter().position(|(answered_id, _)| *answered_id == id.0)?;
        self.answers.remove(at).map(|(_, answer)| answer)
    }

    fn put(&mut self, answered: CommandAnswer) {
        if self.answers.len() == ANSWERS_KEPT {
            self.answers.pop_front();
        }
        self.answers.push_back((answered.id, answered.answer));
    }
}

impl CommandReceiver {
    /// The next command, if there is room to answer it.
    pub(super) fn next(&mut self) -> Option<WaitingCommand> {
        if self.taken.len() >= self.answers.slots().min(COMMANDS_MAX) {
            return None;
        }
        self.orders.pop().ok()
    }

    /// Whether a command waits.
    pub(crate) fn wait(&self) -> bool {
        !self.orders.is_empty()
    }

    /// Adds an answer to those of this step.
    pub(crate) fn note(&mut self, id: CommandId, answer: CommandOutcome) {
        self.taken.push(CommandAnswer { id: id.0, answer });
    }

    /// Sends the answers of this step, after its images are published.
    pub(crate) fn give(&mut self) {
        for answered in self.taken.drain(..) {
            // `next` has checked for a free place, and no other thread fills it.
            let _ = self.answers.push(answered);
        }
    }
}

impl AnswerReceiver {
    /// The number of answers in the ring.
    pub(crate) fn waiting(&self) -> usize {
        self.0.slots()
    }

    /// Makes this number of answers visible.
    pub(crate) fn show(&mut self, count: usize, entry: &mut CommandEntry) {
        for _ in 0..count {
            if let Ok(answered) = self.0.pop() {
                entry.put(answered);
            }
        }
    }
}

/// Why a command or a batch that is late is not carried out.
pub(crate) const LATE: &str =
    "nothing is done: the scan thread came to it after its client had stopped waiting";

impl fmt::Display for CommandDenial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CommandDenial::QueueFull => f.write_str("too many commands wait for the scan thread"),
            CommandDenial::ScanThreadStuck => f.write_str(
                "the scan thread is held up and executes no command; if that lasts, restart rungd",
            ),
            CommandDenial::EngineBroken => f.write_str(
                "the engine panicked, which is a bug in rungd, and its memory may be wrong; \
                 restart rungd",
            ),
            CommandDenial::Ending => f.write_str("rungd is about to end"),
            CommandDenial::Faulted => f.write_str(
                "the controller is in FAULT: it does not scan, and its outputs are safe; `rungd \
                 mode run` leaves FAULT, and then `rungd mode stop` stops it",
            ),
            CommandDenial::NoProgram => f.write_str("the program did not come with its command"),
            CommandDenial::Gone => f.write_str(
                "the program was reloaded meanwhile, and the new program does not have the named \
                 operand",
            ),
            CommandDenial::Late => f.write_str(LATE),
            CommandDenial::TooManyForces => {
                write!(f, "{FORCES_MAX} bits and words are forced already")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_queue_is_limited_and_every_command_is_answered() {
        let (mut entry, mut orders, mut answers) = command_rings();
        let ids: Vec<_> =
            (0..1000).map_while(|_| entry.hand_in(0, ScanCommand::Run, u64::MAX).ok()).collect();
        assert_eq!(ids.len(), COMMANDS_MAX);
        while let Some(order) = orders.next() {
            orders.note(order.id, CommandOutcome::Denied(CommandDenial::Ending));
        }
        assert_eq!(entry.answer(ids[0]), None);
        orders.give();
        answers.show(answers.waiting(), &mut entry);
        assert!(
            ids.iter()
                .all(|id| entry.answer(*id) == Some(CommandOutcome::Denied(CommandDenial::Ending)))
        );
        assert_eq!(entry.answer(ids[0]), None, "once");
    }
}
