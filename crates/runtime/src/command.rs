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
pub enum Command {
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
pub enum Denial {
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
pub enum Answer {
    /// The command is done and its effect is published. Contains the state before it.
    Done(Before),
    /// The command is not done, and nothing changed.
    Denied(Denial),
}

/// The state before a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Before {
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
    pub command: Command,
    /// After this moment the command is denied; ns of the scan's
    /// [`boottime_ns`](super::pacing::Clock::boottime_ns).
    pub until_ns: u64,
}

#[derive(Clone, Copy, Debug)]
struct Answered {
    id: u64,
    answer: Answer,
}

/// The entry for commands, and the answers that no caller has fetched yet.
pub(super) struct Desk {
    orders: Producer<WaitingCommand>,
    last: u64,
    answers: VecDeque<(u64, Answer)>,
}

/// The scan thread's end.
pub(super) struct Orders {
    orders: Consumer<WaitingCommand>,
    answers: Producer<Answered>,
    /// The answers of this step, sent at its end.
    taken: Vec<Answered>,
}

/// The monitor's end of the ring of answers.
pub(super) struct Answers(Consumer<Answered>);

pub(super) fn desk() -> (Desk, Orders, Answers) {
    let (order_in, orders) = RingBuffer::new(COMMANDS_MAX);
    let (answer_in, answers) = RingBuffer::new(2 * COMMANDS_MAX);
    let desk = Desk { orders: order_in, last: 0, answers: VecDeque::with_capacity(ANSWERS_KEPT) };
    let taken = Vec::with_capacity(COMMANDS_MAX);
    (desk, Orders { orders, answers: answer_in, taken }, Answers(answers))
}

impl Desk {
    pub(crate) fn hand_in(
        &mut self,
        generation: u32,
        command: Command,
        until_ns: u64,
    ) -> Result<CommandId, Denial> {
        let order = WaitingCommand { id: CommandId(self.last + 1), generation, command, until_ns };
        self.orders.push(order).map_err(|_| Denial::QueueFull)?;
        self.last = order.id.0;
        Ok(order.id)
    }

    /// Returns an answer, once, and forgets it.
    pub(crate) fn answer(&mut self, id: CommandId) -> Option<Answer> {
        let at = self.answers.iter().position(|(of, _)| *of == id.0)?;
        self.answers.remove(at).map(|(_, answer)| answer)
    }

    fn put(&mut self, answered: Answered) {
        if self.answers.len() == ANSWERS_KEPT {
            self.answers.pop_front();
        }
        self.answers.push_back((answered.id, answered.answer));
    }
}

impl Orders {
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
    pub(crate) fn note(&mut self, id: CommandId, answer: Answer) {
        self.taken.push(Answered { id: id.0, answer });
    }

    /// Sends the answers of this step, after its images are published.
    pub(crate) fn give(&mut self) {
        for answered in self.taken.drain(..) {
            // `next` has checked for a free place, and no other thread fills it.
            let _ = self.answers.push(answered);
        }
    }
}

impl Answers {
    /// The number of answers in the ring.
    pub(crate) fn waiting(&self) -> usize {
        self.0.slots()
    }

    /// Makes this number of answers visible.
    pub(crate) fn show(&mut self, count: usize, desk: &mut Desk) {
        for _ in 0..count {
            if let Ok(answered) = self.0.pop() {
                desk.put(answered);
            }
        }
    }
}

/// Why a command or a batch that is late is not carried out.
pub(crate) const LATE: &str =
    "nothing is done: the scan thread came to it after its client had stopped waiting";

impl fmt::Display for Denial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Denial::QueueFull => f.write_str("too many commands wait for the scan thread"),
            Denial::ScanThreadStuck => f.write_str(
                "the scan thread is held up and executes no command; if that lasts, restart rungd",
            ),
            Denial::EngineBroken => f.write_str(
                "the engine panicked, which is a bug in rungd, and its memory may be wrong; \
                 restart rungd",
            ),
            Denial::Ending => f.write_str("rungd is about to end"),
            Denial::Faulted => f.write_str(
                "the controller is in FAULT: it does not scan, and its outputs are safe; `rungd \
                 mode run` leaves FAULT, and then `rungd mode stop` stops it",
            ),
            Denial::NoProgram => f.write_str("the program did not come with its command"),
            Denial::Gone => f.write_str(
                "the program was reloaded meanwhile, and the new program does not have the named \
                 operand",
            ),
            Denial::Late => f.write_str(LATE),
            Denial::TooManyForces => write!(f, "{FORCES_MAX} bits and words are forced already"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_limits_and_every_command_has_its_answer() {
        let (mut desk, mut orders, mut answers) = desk();
        let ids: Vec<_> =
            (0..1000).map_while(|_| desk.hand_in(0, Command::Run, u64::MAX).ok()).collect();
        assert_eq!(ids.len(), COMMANDS_MAX);
        while let Some(order) = orders.next() {
            orders.note(order.id, Answer::Denied(Denial::Ending));
        }
        assert_eq!(desk.answer(ids[0]), None);
        orders.give();
        answers.show(answers.waiting(), &mut desk);
        assert!(ids.iter().all(|id| desk.answer(*id) == Some(Answer::Denied(Denial::Ending))));
        assert_eq!(desk.answer(ids[0]), None, "once");
    }
}
