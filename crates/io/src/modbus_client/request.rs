//! Requests: the PDUs that a client sends.
//!
//! The callers keep all numbers within the limits of the protocol; this module does not check them.

use super::settings::ModbusTable;

/// The function codes of writes.
const WRITE_COIL: u8 = 5;
const WRITE_REGISTER: u8 = 6;
const WRITE_COILS: u8 = 15;
const WRITE_REGISTERS: u8 = 16;

/// Appends a read of `count` elements from `first` on.
pub fn push_read(pdu: &mut Vec<u8>, table: ModbusTable, first: u16, count: u16) {
    let function = match table {
        ModbusTable::Coils => 1,
        ModbusTable::DiscreteInputs => 2,
        ModbusTable::HoldingRegisters => 3,
        ModbusTable::InputRegisters => 4,
    };
    push(pdu, function, [first, count]);
}

/// Appends a write of one coil (not 0 is ON) or of one holding register.
pub fn push_write_single(pdu: &mut Vec<u8>, is_coil: bool, first: u16, value: u16) {
    match (is_coil, value) {
        (true, 0) => push(pdu, WRITE_COIL, [first, 0]),
        (true, _) => push(pdu, WRITE_COIL, [first, 0xff00]),
        (false, _) => push(pdu, WRITE_REGISTER, [first, value]),
    }
}

/// Appends a write of several coils (not 0 is ON) or holding registers.
pub fn push_write_multiple(pdu: &mut Vec<u8>, are_coils: bool, first: u16, values: &[u16]) {
    let count = values.len() as u16;
    if are_coils {
        push(pdu, WRITE_COILS, [first, count]);
        pdu.push(values.len().div_ceil(8) as u8);
        for eight in values.chunks(8) {
            let bits = eight.iter().enumerate();
            pdu.push(bits.fold(0, |byte, (at, value)| byte | u8::from(*value != 0) << at));
        }
    } else {
        push(pdu, WRITE_REGISTERS, [first, count]);
        pdu.push((values.len() * 2) as u8);
        pdu.extend(values.iter().flat_map(|value| value.to_be_bytes()));
    }
}

fn push(pdu: &mut Vec<u8>, function: u8, words: [u16; 2]) {
    pdu.push(function);
    pdu.extend(words.iter().flat_map(|word| word.to_be_bytes()));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modbus::pdu;

    fn request_bytes(make: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
        let mut pdu = Vec::new();
        make(&mut pdu);
        pdu
    }

    #[test]
    fn requests_equal_the_examples_of_the_specification() {
        assert_eq!(request_bytes(|p| push_read(p, ModbusTable::Coils, 19, 19)), [1, 0, 19, 0, 19]);
        assert_eq!(
            request_bytes(|p| push_read(p, ModbusTable::InputRegisters, 8, 1)),
            [4, 0, 8, 0, 1]
        );
        assert_eq!(request_bytes(|p| push_write_single(p, true, 172, 1)), [5, 0, 172, 0xff, 0]);
        assert_eq!(request_bytes(|p| push_write_single(p, true, 172, 0)), [5, 0, 172, 0, 0]);
        assert_eq!(request_bytes(|p| push_write_single(p, false, 1, 3)), [6, 0, 1, 0, 3]);
        let coils = [1, 0, 1, 1, 0, 0, 1, 1, 1, 0];
        let pdu = request_bytes(|p| push_write_multiple(p, true, 19, &coils));
        assert_eq!(pdu, [15, 0, 19, 0, 10, 2, 0xcd, 1]);
        let pdu = request_bytes(|p| push_write_multiple(p, false, 1, &[10, 258]));
        assert_eq!(pdu, [16, 0, 1, 0, 2, 4, 0, 10, 1, 2]);
    }

    #[test]
    fn a_server_accepts_the_longest_requests() {
        let tables = [(ModbusTable::Coils, 2000), (ModbusTable::HoldingRegisters, 125)];
        for (table, count) in tables {
            assert!(pdu::parse(&request_bytes(|p| push_read(p, table, 0, count))).is_ok());
        }
        let longest = request_bytes(|p| push_write_multiple(p, true, 0, &[1; 1968]));
        assert!(pdu::parse(&longest).is_ok());
        let longest = request_bytes(|p| push_write_multiple(p, false, 0, &[1; 123]));
        assert!(pdu::parse(&longest).is_ok());
    }
}
