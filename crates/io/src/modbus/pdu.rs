//! Requests and replies of the ten functions: reads requests from bytes, and writes replies.
//!
//! `answer` passes each frame's PDU to [`parse`]; the map supplies the values of the reply, and
//! [`push_bits`] and [`push_words`] write them. This module checks only the form of a request:
//! function, length, quantity, the two values of a coil. The map checks addresses.

use std::fmt;

pub use super::settings::ModbusTable;

/// A well-formed request. Addresses are those of the protocol, from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModbusRequest<'a> {
    /// FC 1 to 4.
    Read {
        /// The table.
        table: ModbusTable,
        /// The first address.
        first: u16,
        /// The number of elements: 1..=2000 bits, 1..=125 words.
        count: u16,
    },
    /// FC 5, 15.
    WriteCoils {
        /// The first address.
        first: u16,
        /// The number of elements: 1..=1968.
        count: u16,
        /// Eight coils per byte, the first in the lowest bit.
        packed: &'a [u8],
    },
    /// FC 6, 16.
    WriteRegisters {
        /// The first address.
        first: u16,
        /// Two bytes per value, the higher first: 1..=123 values.
        values: &'a [u8],
    },
    /// FC 22: the bits in `and` stay, the others take their values from `or`.
    MaskWrite {
        /// The register.
        first: u16,
        /// The bits that stay.
        and: u16,
        /// The values of the other bits.
        or: u16,
    },
    /// FC 23: writes, then reads.
    ReadWrite {
        /// The first address that it reads.
        read_first: u16,
        /// The number of elements: 1..=125.
        read_count: u16,
        /// The first address that it writes.
        first: u16,
        /// Two bytes per value, the higher first: 1..=121 values.
        values: &'a [u8],
    },
}

/// The exceptions that the server sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModbusException {
    /// 1: the function is not one of the ten.
    IllegalFunction = 1,
    /// 2: the address does not exist, or cannot be written.
    IllegalAddress = 2,
    /// 3: a quantity or value is out of its range, or the request has a wrong length.
    IllegalValue = 3,
    /// 4: the controller is not in RUN (STOP, FAULT).
    DeviceFailure = 4,
    /// 6: too many writes are waiting already.
    DeviceBusy = 6,
    /// 11: the server does not answer for the unit.
    NoSuchUnit = 11,
}

const MASK_WRITE: u8 = 22;

/// The most bits that one request reads.
pub const READ_BITS_MAX: u16 = 2000;
/// The most registers that one request reads.
pub const READ_WORDS_MAX: u16 = 125;
/// The most coils that one request writes.
pub const WRITE_BITS_MAX: u16 = 1968;
/// The most registers that one request writes.
pub const WRITE_WORDS_MAX: u16 = 123;
/// The most registers that FC 23 writes.
const READ_WRITE_WORDS_MAX: u16 = 121;

/// Reads a request from a PDU.
///
/// # Errors
/// [`ModbusException::IllegalFunction`] or [`ModbusException::IllegalValue`].
pub fn parse(pdu: &[u8]) -> Result<ModbusRequest<'_>, ModbusException> {
    let (&function, body) = pdu.split_first().ok_or(ModbusException::IllegalFunction)?;
    match function {
        1 => read(ModbusTable::Coils, body, READ_BITS_MAX),
        2 => read(ModbusTable::DiscreteInputs, body, READ_BITS_MAX),
        3 => read(ModbusTable::HoldingRegisters, body, READ_WORDS_MAX),
        4 => read(ModbusTable::InputRegisters, body, READ_WORDS_MAX),
        5 => write_coil(body),
        6 => write_register(body),
        15 => write_coils(body),
        16 => write_registers(body),
        MASK_WRITE => mask_write(body),
        23 => read_write(body),
        _ => Err(ModbusException::IllegalFunction),
    }
}

fn read(table: ModbusTable, body: &[u8], max: u16) -> Result<ModbusRequest<'_>, ModbusException> {
    match words(body) {
        Some(([first, count], [])) if (1..=max).contains(&count) => {
            Ok(ModbusRequest::Read { table, first, count })
        }
        _ => Err(ModbusException::IllegalValue),
    }
}

fn write_coil(body: &[u8]) -> Result<ModbusRequest<'_>, ModbusException> {
    let (first, packed) = match words(body) {
        Some(([first, 0xff00], [])) => (first, &[1]),
        Some(([first, 0x0000], [])) => (first, &[0]),
        _ => return Err(ModbusException::IllegalValue),
    };
    Ok(ModbusRequest::WriteCoils { first, count: 1, packed })
}

fn write_register(body: &[u8]) -> Result<ModbusRequest<'_>, ModbusException> {
    match words(body) {
        Some(([first, _], [])) => Ok(ModbusRequest::WriteRegisters { first, values: &body[2..] }),
        _ => Err(ModbusException::IllegalValue),
    }
}

fn write_coils(body: &[u8]) -> Result<ModbusRequest<'_>, ModbusException> {
    match words(body) {
        Some(([first, count], [bytes, packed @ ..]))
            if (1..=WRITE_BITS_MAX).contains(&count)
                && packed.len() == usize::from(count.div_ceil(8))
                && packed.len() == usize::from(*bytes) =>
        {
            Ok(ModbusRequest::WriteCoils { first, count, packed })
        }
        _ => Err(ModbusException::IllegalValue),
    }
}

fn write_registers(body: &[u8]) -> Result<ModbusRequest<'_>, ModbusException> {
    match words(body) {
        Some(([first, count], [bytes, values @ ..]))
            if (1..=WRITE_WORDS_MAX).contains(&count)
                && values.len() == usize::from(count) * 2
                && values.len() == usize::from(*bytes) =>
        {
            Ok(ModbusRequest::WriteRegisters { first, values })
        }
        _ => Err(ModbusException::IllegalValue),
    }
}

fn mask_write(body: &[u8]) -> Result<ModbusRequest<'_>, ModbusException> {
    match body {
        [a, b, c, d, e, f] => {
            let word = |high: &u8, low: &u8| u16::from_be_bytes([*high, *low]);
            Ok(ModbusRequest::MaskWrite { first: word(a, b), and: word(c, d), or: word(e, f) })
        }
        _ => Err(ModbusException::IllegalValue),
    }
}

fn read_write(body: &[u8]) -> Result<ModbusRequest<'_>, ModbusException> {
    let Some(([read_first, read_count], write)) = words(body) else {
        return Err(ModbusException::IllegalValue);
    };
    match words(write) {
        Some(([first, count], [bytes, values @ ..]))
            if (1..=READ_WORDS_MAX).contains(&read_count)
                && (1..=READ_WRITE_WORDS_MAX).contains(&count)
                && values.len() == usize::from(count) * 2
                && values.len() == usize::from(*bytes) =>
        {
            Ok(ModbusRequest::ReadWrite { read_first, read_count, first, values })
        }
        _ => Err(ModbusException::IllegalValue),
    }
}

/// The two words at the start of every request, and the bytes after them.
fn words(body: &[u8]) -> Option<([u16; 2], &[u8])> {
    let (four, rest) = body.split_first_chunk::<4>()?;
    let [a, b, c, d] = *four;
    Some(([u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d])], rest))
}

/// Appends the reply to a read of bits: function, byte count, the bits packed.
pub fn push_bits(reply: &mut Vec<u8>, function: u8, bits: impl ExactSizeIterator<Item = bool>) {
    reply.extend_from_slice(&[function, bits.len().div_ceil(8) as u8]);
    for (at, bit) in bits.enumerate() {
        if at % 8 == 0 {
            reply.push(0);
        }
        if let Some(last) = reply.last_mut() {
            *last |= u8::from(bit) << (at % 8);
        }
    }
}

/// Appends the reply to a read of words: function, byte count, two bytes per word.
pub fn push_words(reply: &mut Vec<u8>, function: u8, words: impl ExactSizeIterator<Item = u16>) {
    reply.extend_from_slice(&[function, (words.len() * 2) as u8]);
    reply.extend(words.flat_map(u16::to_be_bytes));
}

/// Appends the reply to a write: its function and address, and its value, quantity or masks.
pub fn push_written(reply: &mut Vec<u8>, request: &[u8]) {
    let echoed = if request.first() == Some(&MASK_WRITE) { 7 } else { 5 };
    reply.extend_from_slice(&request[..request.len().min(echoed)]);
}

/// Appends the reply of a refusal.
pub fn push_exception(reply: &mut Vec<u8>, function: u8, exception: ModbusException) {
    reply.extend_from_slice(&[function | 0x80, exception as u8]);
}

/// Consecutive elements of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ElementRange {
    /// The table.
    pub table: ModbusTable,
    /// The first address.
    pub first: u16,
    /// The number of elements.
    pub count: u16,
}

impl ModbusRequest<'_> {
    /// The elements of the request; for FC 23, those of its write.
    pub fn place(&self) -> ElementRange {
        let (table, first, count) = match *self {
            ModbusRequest::Read { table, first, count } => (table, first, count),
            ModbusRequest::WriteCoils { first, count, .. } => (ModbusTable::Coils, first, count),
            ModbusRequest::WriteRegisters { first, values }
            | ModbusRequest::ReadWrite { first, values, .. } => {
                (ModbusTable::HoldingRegisters, first, (values.len() / 2) as u16)
            }
            ModbusRequest::MaskWrite { first, .. } => (ModbusTable::HoldingRegisters, first, 1),
        };
        ElementRange { table, first, count }
    }
}

impl fmt::Display for ModbusException {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "exception {}", *self as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn refused(pdu: &[u8]) -> u8 {
        parse(pdu).map(|request| panic!("{request:?}")).unwrap_err() as u8
    }

    #[test]
    fn read_requests_are_parsed_and_limited() {
        let tables = [
            (1, ModbusTable::Coils, 2000u16),
            (2, ModbusTable::DiscreteInputs, 2000),
            (3, ModbusTable::HoldingRegisters, 125),
            (4, ModbusTable::InputRegisters, 125),
        ];
        for (function, table, max) in tables {
            let pdu = |count: u16| {
                let [high, low] = count.to_be_bytes();
                [function, 1, 2, high, low]
            };
            for count in [1, max] {
                let read = ModbusRequest::Read { table, first: 0x0102, count };
                assert_eq!(parse(&pdu(count)), Ok(read));
            }
            assert_eq!(refused(&pdu(0)), 3);
            assert_eq!(refused(&pdu(max + 1)), 3);
            assert_eq!(refused(&pdu(1)[..4]), 3);
            assert_eq!(refused(&[function, 0, 0, 0, 1, 0]), 3);
        }
    }

    #[test]
    fn single_write_requests_are_parsed_or_refused() {
        let on = ModbusRequest::WriteCoils { first: 7, count: 1, packed: &[1] };
        let off = ModbusRequest::WriteCoils { first: 7, count: 1, packed: &[0] };
        assert_eq!(parse(&[5, 0, 7, 0xff, 0]), Ok(on));
        assert_eq!(parse(&[5, 0, 7, 0, 0]), Ok(off));
        assert_eq!(refused(&[5, 0, 7, 0, 1]), 3);
        assert_eq!(refused(&[5, 0, 7, 0xff, 0xff]), 3);
        assert_eq!(refused(&[5, 0, 7, 0xff]), 3);
        let word = ModbusRequest::WriteRegisters { first: 7, values: &[1, 2] };
        assert_eq!(parse(&[6, 0, 7, 1, 2]), Ok(word));
        assert_eq!(refused(&[6, 0, 7, 1]), 3);
        assert_eq!(refused(&[6, 0, 7, 1, 2, 3]), 3);
    }

    #[test]
    fn multiple_write_requests_are_parsed_or_refused() {
        let coils = ModbusRequest::WriteCoils { first: 0, count: 9, packed: &[0xff, 1] };
        assert_eq!(parse(&[15, 0, 0, 0, 9, 2, 0xff, 1]), Ok(coils));
        assert_eq!(refused(&[15, 0, 0, 0, 9, 1, 0xff]), 3, "nine coils in one byte");
        assert_eq!(refused(&[15, 0, 0, 0, 9, 2, 0xff]), 3, "a byte is missing");
        assert_eq!(refused(&[15, 0, 0, 0, 0, 0]), 3);
        assert_eq!(refused(&[15, 0, 0, 0xff, 0xff, 1, 1]), 3);
        let words = ModbusRequest::WriteRegisters { first: 0, values: &[0, 1, 0, 2] };
        assert_eq!(parse(&[16, 0, 0, 0, 2, 4, 0, 1, 0, 2]), Ok(words));
        assert_eq!(refused(&[16, 0, 0, 0, 2, 4, 0, 1, 0]), 3);
        assert_eq!(refused(&[16, 0, 0, 0x80, 0, 0]), 3, "twice the count overflows 16 bits");
        assert_eq!(refused(&[16, 0, 0]), 3);
    }

    #[test]
    fn unknown_functions_are_refused_with_exception_1() {
        for function in [0, 7, 8, 14, 17, 21, 24, 43, 0x80, 0x83, 0xff] {
            assert_eq!(refused(&[function, 0, 0, 0, 1]), 1);
        }
        assert_eq!(refused(&[]), 1);
    }

    #[test]
    fn replies_are_packed_as_the_specification_defines() {
        let mut reply = Vec::new();
        let bits = [true, false, true, false, false, false, false, false, true];
        push_bits(&mut reply, 1, bits.into_iter());
        assert_eq!(reply, [1, 2, 0b101, 1]);
        reply.clear();
        push_words(&mut reply, 3, [1u16, 0x0203].into_iter());
        assert_eq!(reply, [3, 4, 0, 1, 2, 3]);
    }

    #[test]
    fn a_mask_write_is_parsed_and_echoed() {
        let pdu = [22, 0, 4, 0, 0xf2, 0, 0x25];
        assert_eq!(parse(&pdu), Ok(ModbusRequest::MaskWrite { first: 4, and: 0xf2, or: 0x25 }));
        assert_eq!(refused(&pdu[..6]), 3);
        assert_eq!(refused(&[22, 0, 4, 0, 0xf2, 0, 0x25, 0]), 3);
        let mut reply = Vec::new();
        push_written(&mut reply, &pdu);
        assert_eq!(reply, pdu);
    }

    #[test]
    fn a_read_write_request_is_parsed_and_limited() {
        let pdu = |read: u16, write: u16, bytes: u8, values: usize| {
            let head = [[0, 3], read.to_be_bytes(), [0, 14], write.to_be_bytes()].concat();
            [vec![23], head, vec![bytes], vec![7; values]].concat()
        };
        let both = ModbusRequest::ReadWrite {
            read_first: 3,
            read_count: 6,
            first: 14,
            values: &[7, 7, 7, 7],
        };
        assert_eq!(parse(&pdu(6, 2, 4, 4)), Ok(both));
        assert!(parse(&pdu(125, 121, 242, 242)).is_ok());
        for (read, write, bytes, values) in [
            (0, 2, 4, 4),
            (126, 2, 4, 4),
            (6, 0, 0, 0),
            (6, 122, 244, 244),
            (6, 2, 2, 4),
            (6, 2, 4, 2),
            (6, 2, 4, 5),
            (6, 0x8002, 4, 4),
        ] {
            assert_eq!(refused(&pdu(read, write, bytes, values)), 3, "{read} {write} {bytes}");
        }
        assert_eq!(refused(&pdu(6, 2, 4, 4)[..9]), 3);
        assert_eq!(refused(&[23]), 3);
    }

    proptest! {
        #[test]
        fn any_bytes_parse_without_a_panic(pdu in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = parse(&pdu);
        }

        #[test]
        fn any_bytes_after_a_function_code_parse_without_a_panic(
            function in 0u8..25, rest: [u8; 16], len in 0usize..16,
        ) {
            let pdu = [&[function], &rest[..len]].concat();
            if let Ok(request) = parse(&pdu) {
                let count = request.place().count;
                prop_assert!(count > 0);
            }
        }
    }
}
