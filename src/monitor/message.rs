//! What goes between the parts of the monitor: keys and news come in, wishes go out.
//!
//! `keys` and `asker` make events, `update` takes them and makes wishes. Data alone.

use std::sync::Arc;

use super::power_of::PowerOf;
use crate::live::LiveProgram;
use crate::operator::protocol::{Name, Request, ShownValue, Status};

/// A key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Press {
    Char(char),
    Enter,
    Escape,
    Tab,
    BackTab,
    Up,
    Down,
    Left,
    Right,
    PageUp,
    PageDown,
    Home,
    End,
    Backspace,
    Delete,
    /// Ctrl-C: ends, whatever is open.
    Interrupt,
}

/// What happens to the monitor.
#[derive(Clone, Debug)]
pub(super) enum MonitorEvent {
    /// A key.
    Press(Press),
    /// News of the controller.
    News(MonitorNews),
    /// The time since the start, in ms.
    Tick(u64),
}

/// What the thread that asks the controller found.
#[derive(Clone, Debug)]
pub(super) enum MonitorNews {
    /// A look at the controller.
    Look(Box<Look>),
    /// It does not answer, for this reason.
    Silent(String),
    /// The ladder of the program with this hash, or why there is none.
    Ladder(String, Result<Arc<LiveProgram>, String>),
    /// The power of a scan; or why there is none.
    Power(Result<Arc<dyn PowerOf>, String>),
    /// The names that begin with a text.
    Names(String, Vec<Name>),
    /// The values of an operand that is to be watched.
    Found(Result<Vec<ShownValue>, String>),
    /// The answer to `why`.
    Why(String, Result<String, String>),
    /// What a change did, or why it was refused.
    Changed(Result<String, String>),
}

/// One look at the controller.
#[derive(Clone, Debug)]
pub(super) struct Look {
    /// Its state.
    pub status: Status,
    /// The values of the operands that were ordered.
    pub values: Vec<ShownValue>,
    /// Those among them that the program does not know.
    pub unknown: Vec<String>,
}

/// What the monitor wants done.
#[derive(Clone, Debug)]
pub(super) enum MonitorWish {
    /// To end.
    Quit,
    /// Something of the controller.
    Ask(MonitorOrder),
}

/// An order to the thread that asks the controller.
#[derive(Clone, Debug)]
pub(super) enum MonitorOrder {
    /// Read these operands at each look.
    Read(Vec<String>),
    /// Follow the power of the ladder, or stop that.
    Follow(bool),
    /// Load the ladder.
    Ladder,
    /// Look up names.
    Names(String),
    /// Look up an operand that is to be watched.
    Find(String),
    /// Explain an operand.
    Why(String),
    /// Force, write or release.
    Change(Request),
}
