//! The keys of local lines (`gpio`) in a `[[device]]` and its map.

use super::{Kind, belongs};
use crate::source::reader::{Table, Text};

const DRIVERS: [Kind; 1] = [Kind::Gpio];

/// What a `[[device]]` says of its chip.
#[derive(Clone, Debug, Default)]
pub struct Keys {
    /// `chip`: its character device.
    pub chip: Option<Text>,
}

/// What a row of the map says of its lines.
#[derive(Clone, Debug, Default)]
pub struct EntryKeys {}

impl Keys {
    pub(super) fn read(table: &mut Table<'_>, driver: Option<Kind>) -> Keys {
        if !belongs(driver, &DRIVERS) {
            return Keys::default();
        }
        Keys { chip: table.string("chip") }
    }
}

impl EntryKeys {
    pub(super) fn read(_row: &mut Table<'_>, _driver: Option<Kind>) -> EntryKeys {
        EntryKeys {}
    }
}
