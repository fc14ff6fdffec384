//! Executes one scan again on a copy of the engine, and observes it rung by rung. Answers `why`:
//! the question for the reason of an operand's value.
//!
//! A [`Subject`] is made once for a program. The daemon asks about the tape in memory, a command
//! asks about a recording; both pass a [`Past`], the sections of a tape. An answer is data; `text`
//! and `json` render it. Nothing here reads a clock or a file. A damaged tape causes no panic: the
//! past ends at a section that does not fit the program.

mod answer;
mod causes;
mod cell_index;
mod change;
mod changes;
mod compares;
mod coverage;
mod decide;
mod earlier;
mod facts;
mod glimpse;
mod idle;
mod inquiry;
mod json;
mod leaves;
mod limits;
mod logic;
mod names;
mod node_walk;
mod noted_cells;
mod operands;
mod past;
mod phrases;
mod place;
mod power;
mod reasons;
mod replay;
mod restarts;
mod rung_words;
mod section_log;
mod seen_parts;
mod seen_values;
mod slice_run;
mod sparing;
mod step_numbers;
mod subject;
#[cfg(test)]
mod tests;
mod text;
mod unchanged;
mod uses;
mod walk;
mod watch;
mod why;

pub use answer::{
    About, BlockPlace, Cause, ContactDetail, ContactSeen, Cut, Edit, Explanation, Followed,
    Hindrance, Idle, LastChange, LegSeen, Node, OperandName, Place, Remedy, Restart, RungName,
    SearchEnd, Since, Stop, TapeEnd, When, Write,
};
pub use changes::CellChanged;
pub use compares::{CompareText, FormulaNumber, LadderCompare};
pub use coverage::{ContactCoverage, CoverageRun, LadderCoverage, PartCoverage, SeenStates};
pub use limits::Limits;
pub use node_walk::NodeReach;
pub use past::{EarlierPast, Past, QuestionTime, WhyRefusal};
pub use power::{PartContacts, PowerRun, ScanPower};
pub use sparing::{SparingEngine, WholeProgram};
pub use subject::Subject;
pub use uses::{ProgramUses, ReadUse, WriteUse};
