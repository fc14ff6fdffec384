//! Why a well-formed request is not done: the exception for the client, the reason for the log.

use std::fmt;

use super::pdu::{Exception, Table};
use crate::runtime::exchange::{Mode, Refused};

/// Why a request is not done. Its exception follows from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// An element of the request does not exist.
    NoSuchElement {
        /// Of which table.
        table: Table,
        /// How many elements there are, from 1.
        count: u32,
    },
    /// The controller file does not list the element as writable.
    NotWritable {
        /// Of which table.
        table: Table,
        /// Its number, from 1.
        element: u32,
    },
    /// A tag does not allow the value.
    BeyondLimits {
        /// The register's number, from 1.
        element: u32,
        /// The value.
        value: u16,
        /// The least allowed.
        min: i32,
        /// The greatest allowed.
        max: i32,
    },
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
            Refusal::NoSuchElement { .. } | Refusal::NotWritable { .. } => {
                Exception::IllegalAddress
            }
            Refusal::BeyondLimits { .. } => Exception::IllegalValue,
            Refusal::NotRunning(_) | Refusal::NotSeen => Exception::DeviceFailure,
            Refusal::QueueFull => Exception::DeviceBusy,
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::NoSuchElement { table, count } => {
                write!(f, "there are {count} {} only", table.prefix())
            }
            Refusal::NotWritable { table, element } => {
                write!(f, "{}{element} is not in `writable`", table.prefix())
            }
            Refusal::BeyondLimits { element, value, min, max } => {
                write!(f, "MHR{element} takes {min} to {max}, not {value}")
            }
            Refusal::NotRunning(mode) => write!(f, "the controller is in {}", mode.name()),
            Refusal::QueueFull => f.write_str("too many writes wait for the next scan"),
            Refusal::NotSeen => f.write_str("no scan was complete in time to see it"),
        }
    }
}
