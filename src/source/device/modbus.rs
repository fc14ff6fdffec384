//! The keys of the Modbus clients (`modbus-tcp`, `modbus-rtu`) in a `[[device]]` and its map.

use super::{Kind, belongs};
use crate::source::reader::{Table, Text};

const DRIVERS: [Kind; 2] = [Kind::ModbusTcp, Kind::ModbusRtu];

/// What a `[[device]]` says of its line.
#[derive(Clone, Debug, Default)]
pub struct Keys {
    /// `address`: host and port.
    pub address: Option<Text>,
}

/// What a row of the map says of its points.
#[derive(Clone, Debug, Default)]
pub struct EntryKeys {}

impl Keys {
    pub(super) fn read(table: &mut Table<'_>, driver: Option<Kind>) -> Keys {
        if !belongs(driver, &DRIVERS) {
            return Keys::default();
        }
        Keys { address: table.string("address") }
    }
}

impl EntryKeys {
    pub(super) fn read(_row: &mut Table<'_>, _driver: Option<Kind>) -> EntryKeys {
        EntryKeys {}
    }
}
