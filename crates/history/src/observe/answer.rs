//! The answer to `why` as data, for text, JSON and tests.
//!
//! Types only, with their forms as JSON (`json` has those that depend on the content); `inquiry`
//! makes the answers. The value of a word is the content of its cell.

use serde::Serialize;

use rungd_config::controller::OutputState;
use rungd_language::lower::formula_value::FormulaNumber;
use rungd_runtime::Origin;
use rungd_runtime::exchange::Mode;

pub use super::place::{BlockPlace, CallPlace, OperandName, Place, RungName, Since, When};

/// The answer to `why`.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// The time that the question is about.
    pub at: When,
    /// The operand, its value, and the reasons.
    pub root: Node,
    /// The last change, if it is older than the last scan and the write in the last scan did not
    /// change the value.
    pub changed: Option<LastChange>,
    /// The remedy that would change the bit in the next scan; `None` for a word.
    pub change: Option<Remedy>,
    /// The number of sets of two or three edits that were tried.
    pub combined: u32,
    /// The mode, if it is not RUN, and since when.
    pub mode: Option<ModeSince>,
    /// For a Y: the state of its output, where it is not the value in memory.
    pub output: OutputState,
    /// The depth that would explain all reasons that this answer cuts because of its depth.
    pub deeper: Option<u32>,
    /// Whether reasons are cut because the answer is long enough.
    pub is_long: bool,
}

/// A mode, and since when the controller is in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeSince {
    /// The mode.
    pub mode: Mode,
    /// Since when.
    pub since: Since,
}

/// When a value changed last, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct LastChange {
    /// The time of the change; before the tape, if nothing on the tape changed the value.
    pub since: Since,
    /// The value before.
    pub before: Option<i32>,
    /// The cause of the change, with the reasons at that time. `None` for a word, and for a bit if
    /// the same instruction wrote it in the last scan for the same reasons.
    pub cause: Option<Cause>,
}

/// An operand at a moment, and why it had its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// The operand.
    pub operand: OperandName,
    /// Its value.
    pub value: i32,
    /// The write that decided the value.
    pub write: Write,
    /// The state of the timer or counter that it belongs to.
    pub about: Option<About>,
    /// Instructions that could change the value, each with its hindrance.
    pub idle: Vec<Idle>,
    /// The answer of the program before the last reload, if nothing has changed the value since.
    pub earlier: Option<Box<Explanation>>,
}

impl Node {
    /// Whether the answer of the program before the last reload says all about the value.
    pub(super) fn is_told_by_earlier(&self) -> bool {
        let is_same = self.earlier.as_ref().is_some_and(|earlier| earlier.root.value == self.value);
        is_same && self.write.cause == Cause::Older(TapeEnd::Swapped)
    }
}

/// A write that decided a value.
#[derive(Clone, Debug, PartialEq)]
pub struct Write {
    /// When it happened.
    pub since: Since,
    /// The value before the write, if the write changed it.
    pub before: Option<i32>,
    /// Whether it happened in the last scan before the moment.
    pub in_last_scan: bool,
    /// The cause of the write.
    pub cause: Cause,
}

/// The cause of a write.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// An instruction.
    Instruction {
        /// Its rung.
        rung: RungName,
        /// Its place and text.
        place: Place,
        /// Its legs, each with the contacts that decided its power.
        legs: Vec<LegSeen>,
        /// The operands whose values it used.
        operands: Vec<ExplainedOperand>,
        /// The number of further operands, all of them 0, that add nothing to a sum or an OR.
        zeros: usize,
        /// The CALLs that lead to its subroutine, the innermost first.
        calls: Vec<CallPlace>,
    },
    /// A termination pass over the block or Stage of an instruction.
    Pass {
        /// The rung of the instruction.
        rung: RungName,
        /// The place and text of the instruction.
        place: Place,
        /// What caused the pass.
        stop: Stop,
    },
    /// The turn of a block: the start of its initial Stage, the end of a Task that runs once,
    /// Stages that go OFF with their Program.
    Turn {
        /// The block.
        block: BlockPlace,
        /// The block's `.Running`.
        running: Option<Box<Node>>,
        /// The RESTART that caused the turn.
        restart: Option<Box<Restart>>,
    },
    /// A force.
    Force {
        /// The name of the sender of the force.
        who: Option<String>,
    },
    /// A write from outside: an input, a field device, a queued write, a command.
    Outside {
        /// Where it came from.
        origin: Origin,
        /// The name of the device or of the sender.
        who: Option<String>,
    },
    /// The controller writes status bits and words at the start of each scan.
    Status,
    /// RUN or the last scan began: the controller started or stopped the blocks that run by
    /// themselves.
    Controller,
    /// RUN began, and the controller turned a Stage ON again that is retained, or a Program.
    Resumed,
    /// The value at the start of the process, after a cold start.
    Initial,
    /// The value at the start of the process, restored.
    Restored,
    /// Nothing on the tape changed it.
    Older(TapeEnd),
}

/// Why a block or Stage was terminated.
#[derive(Clone, Debug, PartialEq)]
pub enum Stop {
    /// The controller stopped.
    Controller,
    /// The block or Stage was stopped: its bit, and why it went OFF.
    Bit(Box<Node>),
    /// The block was stopped and started again at once, by a RESTART.
    Again(BlockPlace, Option<Box<Restart>>),
}

/// A RESTART that acted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Restart {
    /// The scan in which it acted.
    pub at: When,
    /// Its rung.
    pub rung: RungName,
    /// Its place and text.
    pub place: Place,
    /// Its leg.
    pub legs: Vec<LegSeen>,
}

/// The end of the tape that can be searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TapeEnd {
    /// The oldest section.
    Oldest,
    /// A new program was loaded.
    Swapped,
    /// Scans are missing.
    Lost,
    /// A different process or recording begins.
    Restarted,
    /// The search ended there: the program is large, and the operand is a reason of the operand of
    /// the question.
    Searched,
    /// A section that cannot be read, or does not fit the program.
    Unreadable,
}

/// A leg of an instruction, at its execution.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LegSeen {
    /// `when`, or the name after `leg.`.
    pub name: &'static str,
    /// Its power.
    pub on: bool,
    /// The places of its contacts, in series; for a branch, the contacts of its rung come first.
    pub series: Vec<Place>,
    /// The contacts that alone decide its power.
    pub contacts: Vec<ContactSeen>,
    /// The order in which they are told, as indices of `contacts`: of many, those that changed last
    /// come first.
    #[serde(skip)]
    pub latest: Vec<usize>,
    /// Other contacts of a series that were OFF.
    pub also_off: Vec<ContactSeen>,
}

/// A contact with its state when its rung was executed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactSeen {
    /// Its place and text.
    pub place: Place,
    /// Its state.
    pub on: bool,
    /// Its kind, with its operands.
    #[serde(rename = "is")]
    pub detail: ContactDetail,
}

/// An operand that was read: its value, and the reasons for it.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct ExplainedOperand {
    pub operand: OperandName,
    pub value: i32,
    pub followed: Followed,
}

/// A value that was read, and the reasons for it; a constant has no operand.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct ExplainedValue {
    pub value: i32,
    pub operand: Option<OperandName>,
    pub followed: Followed,
}

/// The kind of a contact, with its operands.
#[derive(Clone, Debug, PartialEq)]
pub enum ContactDetail {
    /// A bit.
    Bit(OperandName, Followed),
    /// A bit of an array, selected by a word.
    Element {
        /// The bit; `None` if the word selects no element of the array.
        bit: Option<(OperandName, Followed)>,
        /// The word that selects the bit.
        index: ExplainedOperand,
    },
    /// A compare: the left and right values with their operands; a constant has no operand.
    Compare {
        /// Left and right.
        sides: [ExplainedValue; 2],
        /// Whether left and right are reals.
        real: [bool; 2],
    },
    /// A contact that computes.
    Computed {
        /// The values of a compare's sides, left and right; none of a bit.
        sides: Vec<FormulaNumber>,
        /// Whether these are times.
        is_time: bool,
        /// The bits and words that it reads, each with its value.
        operands: Vec<ExplainedOperand>,
    },
    /// An edge: when it was ON last, and the contacts within it.
    Edge {
        /// When it was ON last.
        last: Since,
        /// Whether the contacts within were ON.
        inner_on: bool,
        /// The contacts within that decide this state.
        inner: Vec<ContactSeen>,
    },
}

/// The reasons of an operand, or why they are not given.
#[derive(Clone, Debug, PartialEq)]
pub enum Followed {
    /// They are given.
    Node(Box<Node>),
    /// They are not given.
    Cut(Cut),
}

/// Why reasons are not given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Cut {
    /// The depth is reached.
    Depth,
    /// They are given elsewhere in the answer.
    Shown,
    /// The answer is long enough.
    Length,
    /// It is a constant.
    Constant,
}

/// The state of a timer or counter.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum About {
    /// A timer.
    Timer {
        /// `.Acc`, ms.
        acc_ms: i32,
        /// The preset, ms.
        preset_ms: Option<i32>,
        /// Whether it is timing.
        timing: bool,
        /// Since when it is timing; if it is not timing, since when it is not.
        since: Since,
        /// Since when it is done; `None`: it is not done.
        done: Option<Since>,
    },
    /// A counter.
    Counter {
        /// `.Acc`.
        acc: i32,
        /// The presets.
        presets: Vec<i32>,
        /// When it counted last.
        counted: Since,
        /// When it was reset last.
        reset: Since,
    },
}

/// An instruction that could change a value, but does not.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Idle {
    /// The rung of the instruction.
    pub rung: RungName,
    /// The place and text of the instruction.
    pub place: Place,
    /// The hindrance.
    pub because: Hindrance,
}

/// The hindrance that prevents an instruction from acting.
#[derive(Clone, Debug, PartialEq)]
pub enum Hindrance {
    /// Its block or Stage does not run: the bit, and why it is OFF.
    Stopped(OperandName, Followed),
    /// The powers of its legs, in the last scan.
    Legs(Vec<LegSeen>),
}

/// The remedy that would change a bit in the next scan.
#[derive(Clone, Debug, PartialEq)]
pub enum Remedy {
    /// All of these edits together; they were tried on a copy of the engine.
    Edits(Vec<Edit>),
    /// No edit: the bit changes by itself.
    Itself,
    /// The end of its force.
    Release,
    /// The controller scans nothing.
    NoScan,
    /// None of the edits that were tried.
    None(SearchEnd),
}

/// An edit of memory before a scan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Edit {
    /// An operand gets a value.
    Write {
        /// The operand.
        operand: OperandName,
        /// The value.
        value: i32,
    },
    /// A Program is started.
    Run {
        /// The Program.
        block: BlockPlace,
    },
}

/// How far a search for a change went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SearchEnd {
    /// Whether every edit of a single input or operand was tried. Only operands that nothing in the
    /// program writes are tried.
    pub every_single: bool,
    /// The number of scans that were tried.
    pub tried: u32,
}
