//! What an input of a model is for people, and how a test sets it.
//!
//! `question`, `given_inputs`, `retained` and `equal` make it; `trial` makes steps of it. It has no
//! limits and no cells of the model.

use rungd_engine::isa::DeviceId;
use rungd_lab::testing::TestOperand;

/// An input with its name.
#[derive(Clone, Debug)]
pub struct NamedInput {
    /// Its name for people.
    pub name: String,
    /// How a test sets it.
    pub setting: InputSetting,
    /// Whether an operator writes it: the ladder may write it, too.
    pub is_written: bool,
}

/// How a test sets an input.
#[derive(Clone, Debug)]
pub enum InputSetting {
    /// By `set`.
    Set(TestOperand),
    /// By `force`, because a device of the test moves it in every scan.
    Force(TestOperand),
    /// By `set` of the scenario, before the first scan.
    Start(TestOperand),
    /// By `set` of the scenario, with others: what an image says of a Program's Stages.
    Stored(TestOperand),
    /// By `lose` and `restore`: whether the device is there.
    Device(DeviceId),
    /// Not at all: another input decides it, or the step of an event says it.
    Follows,
    /// Not at all: it has any value, for this reason.
    Any(&'static str),
}
