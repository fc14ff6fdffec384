//! Why a well-formed request is not done: the exception for the client, the reason for the log.

use std::fmt;

use super::pdu::{Exception, Table};
use crate::isa::{Address, Word};
use crate::runtime::exchange::{Mode, Refused};

/// Why a request is not done. Its exception follows from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// An element of the request does not exist.
    NoSuchElement {
        /// Of which table.
        table: Table,
        /// At which protocol address.
        address: u32,
    },
    /// The controller file does not list the element as writable.
    NotWritable(Address),
    /// It lists it for other clients.
    NotByThisClient(Address),
    /// The request ends between the two registers of a value.
    HalfOf(Word),
    /// A tag does not allow the value, or the word does not hold it.
    BeyondLimits {
        /// The word.
        word: Word,
        /// The value.
        value: i64,
        /// The least allowed.
        min: i32,
        /// The greatest allowed.
        max: i32,
    },
    /// Not every value of the register's 16 bits is one that the word takes.
    NoMask(Word),
    /// The controller is in STOP or FAULT, or was before a scan had seen the write.
    NotRunning(Mode),
    /// Too many writes wait for the next scan.
    QueueFull,
    /// No scan was complete for so long that the client is told not to wait. The write may yet
    /// be applied.
    NotSeen,
}

impl Refusal {
    /// A batch that the exchange did not take in a mode.
    pub fn of_batch(refused: Refused, mode: Mode) -> Refusal {
        match refused {
            Refused::NotRunning => Refusal::NotRunning(mode),
            Refused::QueueFull | Refused::TooLarge => Refusal::QueueFull,
        }
    }

    /// What the client is told.
    pub fn exception(self) -> Exception {
        match self {
            Refusal::NoSuchElement { .. }
            | Refusal::NotWritable(_)
            | Refusal::NotByThisClient(_)
            | Refusal::HalfOf(_) => Exception::IllegalAddress,
            Refusal::BeyondLimits { .. } | Refusal::NoMask(_) => Exception::IllegalValue,
            Refusal::NotRunning(_) | Refusal::NotSeen => Exception::DeviceFailure,
            Refusal::QueueFull => Exception::DeviceBusy,
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::NoSuchElement { table, address } => {
                write!(f, "nothing is at {} {address}", table.name())
            }
            Refusal::NotWritable(what) => write!(f, "{what} is not in `writable`"),
            Refusal::NotByThisClient(what) => write!(f, "{what} is for other clients to write"),
            Refusal::HalfOf(word) => write!(f, "{word} is written by both of its registers"),
            Refusal::BeyondLimits { word, value, min, max } => {
                write!(f, "{word} takes {min} to {max}, not {value}")
            }
            Refusal::NoMask(word) => write!(f, "{word} does not take every value of 16 bits"),
            Refusal::NotRunning(mode) => write!(f, "the controller is in {}", mode.name()),
            Refusal::QueueFull => f.write_str("too many writes wait for the next scan"),
            Refusal::NotSeen => f.write_str("no scan was complete in time to see it"),
        }
    }
}
