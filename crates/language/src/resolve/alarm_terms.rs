//! The terms of an alarm: everything that a tag says about it, but its text.
//!
//! `tags` takes them from a tag, and `alarm_keys` judges them; `lower` passes them on with the
//! text. Nothing in a scan depends on them.

use super::priority::Priority;
use crate::source::reader::Text;
use crate::source::tag::WrittenTag;
use rungd_engine::isa::Bit;

/// The bit that an acknowledgement of an alarm turns ON.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AckBit {
    /// Its name, as operators write it.
    pub name: String,
    /// The bit.
    pub bit: Bit,
}

/// An `ack` that is not looked up yet.
#[derive(Debug)]
pub(super) struct WrittenAck {
    /// The index of its tag in the program.
    pub tag: usize,
    /// The name of the bit.
    pub name: Text,
}

/// The terms of an alarm.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AlarmTerms {
    /// `priority`: how soon a person has to act.
    pub priority: Priority,
    /// `delay`, in ms: how long its bit is ON before the alarm rises.
    pub delay_ms: u32,
    /// `off-delay`, in ms: how long its bit is OFF before the alarm goes away.
    pub off_delay_ms: u32,
    /// `group`: the part of the machine that it is of.
    pub group: Option<String>,
    /// `ack`: the bit that an acknowledgement turns ON.
    pub ack: Option<AckBit>,
}

impl AlarmTerms {
    /// The terms of a tag; those of a wrong key are the defaults. `ack` is added once all names are
    /// declared.
    pub(super) fn of(tag: &WrittenTag) -> AlarmTerms {
        let priority = tag.priority.as_ref();
        AlarmTerms {
            priority: priority
                .and_then(|written| Priority::named(&written.text))
                .unwrap_or_default(),
            delay_ms: tag.delay.as_ref().map_or(0, |delay| delay.value),
            off_delay_ms: tag.off_delay.as_ref().map_or(0, |delay| delay.value),
            group: tag.group.as_ref().map(|group| group.text.clone()),
            ack: None,
        }
    }

    /// Whether the alarm follows its bit later than at once.
    pub fn is_delayed(&self) -> bool {
        self.delay_ms > 0 || self.off_delay_ms > 0
    }
}
