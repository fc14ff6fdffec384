//! Requests and replies of the eight functions: bytes to meaning, and back.
//!
//! The connection hands each frame's PDU to [`parse`]; the map gives the answer's values, which
//! [`push_bits`] and [`push_words`] write. A request is judged here by its form alone: function,
//! length, quantity, the two values of a coil. Whether an address exists is the map's business.

use std::fmt;

/// What a client can address, each in element numbers from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Table {
    /// MC: bits, read and write.
    Coils,
    /// MI: bits, read.
    DiscreteInputs,
    /// MHR: words, read and write.
    HoldingRegisters,
    /// MIR: words, read.
    InputRegisters,
}

/// A well-formed request. `first` is a PDU address: element n is n - 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request<'a> {
    /// FC 1 to 4.
    Read {
        /// Of which table.
        table: Table,
        /// From which address.
        first: u16,
        /// How many: 1..=2000 bits, 1..=125 words.
        count: u16,
    },
    /// FC 5, 15.
    WriteCoils {
        /// From which address.
        first: u16,
        /// How many: 1..=1968.
        count: u16,
        /// Eight a byte, the first in the lowest bit.
        packed: &'a [u8],
    },
    /// FC 6, 16.
    WriteRegisters {
        /// From which address.
        first: u16,
        /// Two bytes a value, the higher first: 1..=123 values.
        values: &'a [u8],
    },
}

/// The exceptions that are used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exception {
    /// 1: the function is none of the eight.
    IllegalFunction = 1,
    /// 2: the address does not exist, or cannot be written.
    IllegalAddress = 2,
    /// 3: a quantity or value is out of its range, or the request is not as long as it says.
    IllegalValue = 3,
    /// 4: the controller does not run (STOP, FAULT).
    DeviceFailure = 4,
    /// 6: too many writes wait already.
    DeviceBusy = 6,
}

/// The most bits that one request reads.
pub const READ_BITS_MAX: u16 = 2000;
/// The most registers.
pub const READ_WORDS_MAX: u16 = 125;
/// The most coils that one request writes.
pub const WRITE_BITS_MAX: u16 = 1968;
/// The most registers.
pub const WRITE_WORDS_MAX: u16 = 123;

/// What a PDU asks for.
///
/// # Errors
/// [`Exception::IllegalFunction`] or [`Exception::IllegalValue`].
pub fn parse(pdu: &[u8]) -> Result<Request<'_>, Exception> {
    let (&function, body) = pdu.split_first().ok_or(Exception::IllegalFunction)?;
    match function {
        1 => read(Table::Coils, body, READ_BITS_MAX),
        2 => read(Table::DiscreteInputs, body, READ_BITS_MAX),
        3 => read(Table::HoldingRegisters, body, READ_WORDS_MAX),
        4 => read(Table::InputRegisters, body, READ_WORDS_MAX),
        5 => write_coil(body),
        6 => write_register(body),
        15 => write_coils(body),
        16 => write_registers(body),
        _ => Err(Exception::IllegalFunction),
    }
}

fn read(table: Table, body: &[u8], max: u16) -> Result<Request<'_>, Exception> {
    match words(body) {
        Some(([first, count], [])) if (1..=max).contains(&count) => {
            Ok(Request::Read { table, first, count })
        }
        _ => Err(Exception::IllegalValue),
    }
}

fn write_coil(body: &[u8]) -> Result<Request<'_>, Exception> {
    let (first, packed) = match words(body) {
        Some(([first, 0xff00], [])) => (first, &[1]),
        Some(([first, 0x0000], [])) => (first, &[0]),
        _ => return Err(Exception::IllegalValue),
    };
    Ok(Request::WriteCoils { first, count: 1, packed })
}

fn write_register(body: &[u8]) -> Result<Request<'_>, Exception> {
    match words(body) {
        Some(([first, _], [])) => Ok(Request::WriteRegisters { first, values: &body[2..] }),
        _ => Err(Exception::IllegalValue),
    }
}

fn write_coils(body: &[u8]) -> Result<Request<'_>, Exception> {
    match words(body) {
        Some(([first, count], [bytes, packed @ ..]))
            if (1..=WRITE_BITS_MAX).contains(&count)
                && packed.len() == usize::from(count.div_ceil(8))
                && packed.len() == usize::from(*bytes) =>
        {
            Ok(Request::WriteCoils { first, count, packed })
        }
        _ => Err(Exception::IllegalValue),
    }
}

fn write_registers(body: &[u8]) -> Result<Request<'_>, Exception> {
    match words(body) {
        Some(([first, count], [bytes, values @ ..]))
            if (1..=WRITE_WORDS_MAX).contains(&count)
                && values.len() == usize::from(count) * 2
                && values.len() == usize::from(*bytes) =>
        {
            Ok(Request::WriteRegisters { first, values })
        }
        _ => Err(Exception::IllegalValue),
    }
}

/// The two words that every request begins with, and what follows them.
fn words(body: &[u8]) -> Option<([u16; 2], &[u8])> {
    let (four, rest) = body.split_first_chunk::<4>()?;
    let [a, b, c, d] = *four;
    Some(([u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d])], rest))
}

/// The reply to a read of bits: function, byte count, the bits packed.
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

/// The reply to a read of words: function, byte count, two bytes a word.
pub fn push_words(reply: &mut Vec<u8>, function: u8, words: impl ExactSizeIterator<Item = u16>) {
    reply.extend_from_slice(&[function, (words.len() * 2) as u8]);
    reply.extend(words.flat_map(u16::to_be_bytes));
}

/// The reply to a write: its function, address, and value or quantity again.
pub fn push_written(reply: &mut Vec<u8>, request: &[u8]) {
    reply.extend_from_slice(&request[..request.len().min(5)]);
}

/// The reply that refuses.
pub fn push_exception(reply: &mut Vec<u8>, function: u8, exception: Exception) {
    reply.extend_from_slice(&[function | 0x80, exception as u8]);
}

impl Table {
    /// The prefix of its elements.
    pub fn prefix(self) -> &'static str {
        match self {
            Table::Coils => "MC",
            Table::DiscreteInputs => "MI",
            Table::HoldingRegisters => "MHR",
            Table::InputRegisters => "MIR",
        }
    }
}

impl Request<'_> {
    /// The table, the first address and the quantity.
    pub fn place(&self) -> (Table, u16, u16) {
        match *self {
            Request::Read { table, first, count } => (table, first, count),
            Request::WriteCoils { first, count, .. } => (Table::Coils, first, count),
            Request::WriteRegisters { first, values } => {
                (Table::HoldingRegisters, first, (values.len() / 2) as u16)
            }
        }
    }
}

impl fmt::Display for Request<'_> {
    /// The elements as an author writes them: `MHR10..MHR12`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (table, first, count) = self.place();
        let (prefix, first) = (table.prefix(), u32::from(first) + 1);
        match count {
            0 | 1 => write!(f, "{prefix}{first}"),
            _ => write!(f, "{prefix}{first}..{prefix}{}", first + u32::from(count) - 1),
        }
    }
}

impl fmt::Display for Exception {
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
    fn reads() {
        let tables = [
            (1, Table::Coils, 2000u16),
            (2, Table::DiscreteInputs, 2000),
            (3, Table::HoldingRegisters, 125),
            (4, Table::InputRegisters, 125),
        ];
        for (function, table, max) in tables {
            let pdu = |count: u16| {
                let [high, low] = count.to_be_bytes();
                [function, 1, 2, high, low]
            };
            for count in [1, max] {
                let read = Request::Read { table, first: 0x0102, count };
                assert_eq!(parse(&pdu(count)), Ok(read));
            }
            assert_eq!(refused(&pdu(0)), 3);
            assert_eq!(refused(&pdu(max + 1)), 3);
            assert_eq!(refused(&pdu(1)[..4]), 3);
            assert_eq!(refused(&[function, 0, 0, 0, 1, 0]), 3);
        }
    }

    #[test]
    fn single_writes() {
        let on = Request::WriteCoils { first: 7, count: 1, packed: &[1] };
        let off = Request::WriteCoils { first: 7, count: 1, packed: &[0] };
        assert_eq!(parse(&[5, 0, 7, 0xff, 0]), Ok(on));
        assert_eq!(parse(&[5, 0, 7, 0, 0]), Ok(off));
        assert_eq!(refused(&[5, 0, 7, 0, 1]), 3);
        assert_eq!(refused(&[5, 0, 7, 0xff, 0xff]), 3);
        assert_eq!(refused(&[5, 0, 7, 0xff]), 3);
        let word = Request::WriteRegisters { first: 7, values: &[1, 2] };
        assert_eq!(parse(&[6, 0, 7, 1, 2]), Ok(word));
        assert_eq!(refused(&[6, 0, 7, 1]), 3);
        assert_eq!(refused(&[6, 0, 7, 1, 2, 3]), 3);
    }

    #[test]
    fn multiple_writes() {
        let coils = Request::WriteCoils { first: 0, count: 9, packed: &[0xff, 1] };
        assert_eq!(parse(&[15, 0, 0, 0, 9, 2, 0xff, 1]), Ok(coils));
        assert_eq!(refused(&[15, 0, 0, 0, 9, 1, 0xff]), 3, "nine coils in one byte");
        assert_eq!(refused(&[15, 0, 0, 0, 9, 2, 0xff]), 3, "a byte is missing");
        assert_eq!(refused(&[15, 0, 0, 0, 0, 0]), 3);
        assert_eq!(refused(&[15, 0, 0, 0xff, 0xff, 1, 1]), 3);
        let words = Request::WriteRegisters { first: 0, values: &[0, 1, 0, 2] };
        assert_eq!(parse(&[16, 0, 0, 0, 2, 4, 0, 1, 0, 2]), Ok(words));
        assert_eq!(refused(&[16, 0, 0, 0, 2, 4, 0, 1, 0]), 3);
        assert_eq!(refused(&[16, 0, 0, 0x80, 0, 0]), 3, "twice the count overflows 16 bits");
        assert_eq!(refused(&[16, 0, 0]), 3);
    }

    #[test]
    fn other_functions() {
        for function in [0, 7, 8, 14, 17, 22, 23, 43, 0x80, 0x83, 0xff] {
            assert_eq!(refused(&[function, 0, 0, 0, 1]), 1);
        }
        assert_eq!(refused(&[]), 1);
    }

    #[test]
    fn replies() {
        let mut reply = Vec::new();
        let bits = [true, false, true, false, false, false, false, false, true];
        push_bits(&mut reply, 1, bits.into_iter());
        assert_eq!(reply, [1, 2, 0b101, 1]);
        reply.clear();
        push_words(&mut reply, 3, [1u16, 0x0203].into_iter());
        assert_eq!(reply, [3, 4, 0, 1, 2, 3]);
    }

    #[test]
    fn a_request_names_its_elements() {
        let place = |pdu: &[u8]| parse(pdu).map(|request| request.to_string());
        assert_eq!(place(&[3, 0, 9, 0, 3]).as_deref(), Ok("MHR10..MHR12"));
        assert_eq!(place(&[5, 0xff, 0xff, 0, 0]).as_deref(), Ok("MC65536"));
    }

    proptest! {
        #[test]
        fn any_bytes_parse_without_a_panic(pdu in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = parse(&pdu);
        }

        #[test]
        fn bytes_behind_each_function_too(function in 0u8..24, rest: [u8; 12], len in 0usize..12) {
            let pdu = [&[function], &rest[..len]].concat();
            if let Ok(request) = parse(&pdu) {
                let (_, _, count) = request.place();
                prop_assert!(count > 0);
                let _ = request.to_string();
            }
        }
    }
}
