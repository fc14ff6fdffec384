//! The messages between the parts of the monitor: keys and news in, wishes out.
//!
//! `keys` and `asker` make events; `update` takes them and makes wishes. Only data.

use std::sync::Arc;

use super::power_of::PowerOf;
use rungd_client::live::LiveProgram;
pub use rungd_client::operator::protocol::{ControllerStatus, OfferedName, Request, ShownValue};

/// A key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum KeyPress {
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
    /// Ctrl-C: ends the monitor, whatever is open.
    Interrupt,
}

/// An event for the monitor.
#[derive(Clone, Debug)]
pub(super) enum MonitorEvent {
    /// A key.
    Press(KeyPress),
    /// News from the controller.
    News(MonitorNews),
    /// The time since the start, in ms.
    Tick(u64),
}

/// The result of a request to the controller.
#[derive(Clone, Debug)]
pub(super) enum MonitorNews {
    /// A look at the controller.
    Look(Box<ControllerLook>),
    /// The controller does not answer, for this reason.
    Silent(String),
    /// The hash of the program, and its ladder, or why there is none.
    Ladder(String, Result<Arc<LiveProgram>, String>),
    /// The power of a scan, or why there is none.
    Power(Result<Arc<dyn PowerOf>, String>),
    /// The names that begin with a text.
    Names(String, Vec<OfferedName>),
    /// The values of an operand to be watched.
    Found(Result<Vec<ShownValue>, String>),
    /// The answer to `why`.
    Why(String, Result<String, String>),
    /// The result of a change, or why it was refused.
    Changed(Result<String, String>),
}

/// One look at the controller.
#[derive(Clone, Debug)]
pub(super) struct ControllerLook {
    /// The controller's status.
    pub status: ControllerStatus,
    /// The values of the ordered operands.
    pub values: Vec<ShownValue>,
    /// The ordered operands that the program does not have.
    pub unknown: Vec<String>,
}

/// An action that `update` requests from `run`.
#[derive(Clone, Debug)]
pub(super) enum MonitorAction {
    /// End the monitor.
    Quit,
    /// Send an order to `asker`.
    Ask(ThreadOrder),
}

/// An order to `asker`.
#[derive(Clone, Debug)]
pub(super) enum ThreadOrder {
    /// Read these operands at each look.
    Read(Vec<String>),
    /// Start or stop following the power of the ladder.
    Follow(bool),
    /// Load the ladder.
    Ladder,
    /// Look up names.
    Names(String),
    /// Look up an operand to be watched.
    Find(String),
    /// Explain an operand.
    Why(String),
    /// Force, write or release.
    Change(Request),
}
