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

impl Refusal {
    /// The reason for the log; `name` gives the name of an address.
    pub fn say(self, name: impl Fn(Address) -> String) -> String {
        let of = |word| name(Address::Word(word));
        match self {
            Refusal::NoSuchElement { table, address } => {
                format!("nothing is at {} {address}", table.name())
            }
            Refusal::NotWritable(what) => format!("{} is not in `writable`", name(what)),
            Refusal::NotByThisClient(what) => {
                format!("{} is for other clients to write", name(what))
            }
            Refusal::HalfOf(word) => format!("{} is written by both of its registers", of(word)),
            Refusal::BeyondLimits { word, kind, bits, min, max } => {
                let [min, max] = [min, max].map(|content| word.text(content));
                format!("{} takes {min} to {max}, not {}", of(word), kind.text(bits))
            }
            Refusal::NoMask(word) => {
                format!("{} does not take every value of 16 bits", of(word))
            }
            Refusal::NotRunning(mode) => format!("the controller is in {}", mode.name()),
            Refusal::QueueFull => "too many writes wait for the next scan".to_owned(),
            Refusal::NotSeen => "no scan was complete in time to see it".to_owned(),
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.say(|address| address.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::WordSpace;

    #[test]
    fn what_has_a_name_alone_is_told_by_it() {
        let word = Word::Space(WordSpace::V, 4095);
        let said = |refusal: Refusal| refusal.say(|_| "shift".to_owned());
        assert_eq!(said(Refusal::NotWritable(Address::Word(word))), "shift is not in `writable`");
        assert_eq!(said(Refusal::NoMask(word)), "shift does not take every value of 16 bits");
        assert_eq!(Refusal::HalfOf(word).to_string(), "V4095 is written by both of its registers");
    }
}
