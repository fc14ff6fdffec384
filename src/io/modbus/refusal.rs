//! The refusal of a well-formed request: the exception for the client, the reason for the log.

use std::fmt;

use super::number::NumberType;
use super::pdu::{Exception, Table};
use crate::isa::{Address, Word};
use crate::runtime::exchange::{Mode, Refused};

/// The reason of a refusal. The exception follows from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// An element of the request does not exist.
    NoSuchElement {
        /// The table.
        table: Table,
        /// The protocol address.
        address: u32,
    },
    /// The controller file does not list the element as writable.
    NotWritable(Address),
    /// The controller file lists the element for other clients only.
    NotByThisClient(Address),
    /// The request ends between the two registers of a value.
    HalfOf(Word),
    /// A tag does not allow the value, or the word does not hold it.
    BeyondLimits {
        /// The word.
        word: Word,
        /// The type of the value in the registers.
        kind: NumberType,
        /// Its bits.
        bits: u32,
        /// The least content of the word's cell that is allowed.
        min: i32,
        /// The greatest.
        max: i32,
    },
    /// A mask write to a word that does not take every 16-bit value.
    NoMask(Word),
    /// The controller is in STOP or FAULT, or left RUN before a scan had seen the write.
    NotRunning(Mode),
    /// Too many writes wait for the next scan.
    QueueFull,
    /// No scan was complete within the time limit of the wait. The write may still be applied.
    NotSeen,
}

impl Refusal {
    /// The refusal for a batch that the exchange did not take in this mode.
    pub fn of_batch(refused: Refused, mode: Mode) -> Refusal {
        match refused {
            Refused::NotRunning => Refusal::NotRunning(mode),
            Refused::QueueFull | Refused::TooLarge => Refusal::QueueFull,
        }
    }

    /// The exception for the client.
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
            Refusal::BeyondLimits { word, kind, bits, min, max } => {
                let [min, max] = [min, max].map(|content| word.text(*content));
                write!(f, "{word} takes {min} to {max}, not {}", kind.text(*bits))
            }
            Refusal::NoMask(word) => write!(f, "{word} does not take every value of 16 bits"),
            Refusal::NotRunning(mode) => write!(f, "the controller is in {}", mode.name()),
            Refusal::QueueFull => f.write_str("too many writes wait for the next scan"),
            Refusal::NotSeen => f.write_str("no scan was complete in time to see it"),
        }
    }
}
