//! The refusal of a well-formed request: the exception for the client, the reason for the log.

use std::fmt;

use super::number::RegisterNumberType;
use super::pdu::{ModbusException, ModbusTable};
use rungd_engine::isa::{Address, Word};
use rungd_runtime::exchange::{BatchRefusal, Mode};

/// The reason of a refusal. The exception follows from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModbusRefusal {
    /// An element of the request does not exist.
    NoSuchElement {
        /// The table.
        table: ModbusTable,
        /// The protocol address.
        address: u32,
    },
    /// The controller file does not list the element as writable.
    NotWritable(Address),
    /// The controller file lists the element for other clients only.
    NotByThisClient(Address),
    /// The request has only one of the two registers of a value.
    HalfOf(Word),
    /// A tag does not allow the value, or the word cannot hold it.
    BeyondLimits {
        /// The word.
        word: Word,
        /// The type of the value in the registers.
        kind: RegisterNumberType,
        /// Its bits.
        bits: u64,
        /// The least allowed content of the word's cell.
        min: i32,
        /// The greatest allowed content.
        max: i32,
    },
    /// A mask write to a word that does not accept every 16-bit value.
    NoMask(Word),
    /// The controller is in STOP or FAULT, or left RUN before a scan had seen the write.
    NotRunning(Mode),
    /// Too many writes wait for the next scan.
    QueueFull,
    /// The program was reloaded before a scan saw the write, and does not have one of its elements.
    Overtaken,
    /// No scan was complete within the time limit of the wait. The write may still be applied.
    NotSeen,
}

impl ModbusRefusal {
    /// The refusal for a batch that the exchange did not accept in this mode.
    pub fn of_batch(refused: BatchRefusal, mode: Mode) -> ModbusRefusal {
        match refused {
            BatchRefusal::NotRunning => ModbusRefusal::NotRunning(mode),
            BatchRefusal::QueueFull | BatchRefusal::TooLarge => ModbusRefusal::QueueFull,
            // Of these only the first occurs: no batch of Modbus has an end or a hold.
            BatchRefusal::Overtaken
            | BatchRefusal::Late
            | BatchRefusal::HoldEnded
            | BatchRefusal::HoldsFull
            | BatchRefusal::NoHeldBit => ModbusRefusal::Overtaken,
        }
    }

    /// The exception for the client.
    pub fn exception(self) -> ModbusException {
        match self {
            ModbusRefusal::NoSuchElement { .. }
            | ModbusRefusal::NotWritable(_)
            | ModbusRefusal::NotByThisClient(_)
            | ModbusRefusal::HalfOf(_) => ModbusException::IllegalAddress,
            ModbusRefusal::BeyondLimits { .. } | ModbusRefusal::NoMask(_) => {
                ModbusException::IllegalValue
            }
            ModbusRefusal::NotRunning(_) | ModbusRefusal::Overtaken | ModbusRefusal::NotSeen => {
                ModbusException::DeviceFailure
            }
            ModbusRefusal::QueueFull => ModbusException::DeviceBusy,
        }
    }
}

impl ModbusRefusal {
    /// The reason for the log; `name` returns the name of an address.
    pub fn log_text(self, name: impl Fn(Address) -> String) -> String {
        let word_name = |word| name(Address::Word(word));
        match self {
            ModbusRefusal::NoSuchElement { table, address } => {
                format!("nothing is at {} {address}", table.name())
            }
            ModbusRefusal::NotWritable(what) => format!("{} is not in `writable`", name(what)),
            ModbusRefusal::NotByThisClient(what) => {
                format!("only other clients may write {}", name(what))
            }
            ModbusRefusal::HalfOf(word) => {
                format!("{} needs a write to both of its registers", word_name(word))
            }
            ModbusRefusal::BeyondLimits { word, kind, bits, min, max } => {
                let [min, max] = [min, max].map(|content| word.text(content));
                format!("{} takes {min} to {max}, not {}", word_name(word), kind.text(bits))
            }
            ModbusRefusal::NoMask(word) => {
                format!("{} does not take every value of 16 bits", word_name(word))
            }
            ModbusRefusal::NotRunning(mode) => format!("the controller is in {}", mode.name()),
            ModbusRefusal::QueueFull => "too many writes wait for the next scan".to_owned(),
            ModbusRefusal::Overtaken => {
                "the program was reloaded meanwhile, and does not have one of the elements"
                    .to_owned()
            }
            ModbusRefusal::NotSeen => "no scan has processed it in time".to_owned(),
        }
    }
}

impl fmt::Display for ModbusRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.log_text(|address| address.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_engine::isa::WordSpace;

    #[test]
    fn a_refusal_names_operands_without_an_address_by_their_name() {
        let word = Word::Space(WordSpace::V, 4095);
        let said = |refusal: ModbusRefusal| refusal.log_text(|_| "shift".to_owned());
        assert_eq!(
            said(ModbusRefusal::NotWritable(Address::Word(word))),
            "shift is not in `writable`"
        );
        assert_eq!(said(ModbusRefusal::NoMask(word)), "shift does not take every value of 16 bits");
        assert_eq!(
            ModbusRefusal::HalfOf(word).to_string(),
            "V4095 needs a write to both of its registers"
        );
    }
}
