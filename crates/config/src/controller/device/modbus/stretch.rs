//! A stretch of points of a Modbus device, and its text in a map. Made by `points` and `manuals`.

use rungd_io::modbus::settings::ModbusTable;

/// The bits or registers that a text names: consecutive addresses of one table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ElementStretch {
    pub table: ModbusTable,
    /// The first address; for bits of registers, 16 times the register plus the bit.
    pub first: u32,
    pub count: u32,
    /// Bits of registers: `holding 5.0..5.7`.
    pub is_bits_of_registers: bool,
    /// Whether a number is written in hexadecimal: `holding 0x9C41`.
    pub is_hexadecimal: bool,
}

impl ElementStretch {
    /// The stretch as it is written in a map; `number` writes a number.
    pub fn text(&self, number: fn(u32) -> String) -> String {
        let element = |at: u32| match self.is_bits_of_registers {
            true => format!("{}.{}", number(at / 16), at % 16),
            false => number(at),
        };
        let (name, first) = (self.table.name(), element(self.first));
        match self.count {
            1 => format!("{name} {first}"),
            count => format!("{name} {first}..{}", element(self.first + count - 1)),
        }
    }

    pub fn decimal(number: u32) -> String {
        number.to_string()
    }

    pub fn hexadecimal(number: u32) -> String {
        format!("0x{number:04X}")
    }
}
