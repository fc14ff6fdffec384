//! The keys of local lines (`gpio`) in a `[[device]]` and its map.

use super::super::keys::{Kind, belongs};
use crate::source::reader::{Table, Text};
use crate::source::span::Located;

const DRIVERS: [Kind; 1] = [Kind::Gpio];

/// What a `[[device]]` says of its chip.
#[derive(Clone, Debug, Default)]
pub struct Keys {
    /// `chip`: its character device, or its label.
    pub chip: Option<Text>,
    /// `budget-us`: how long an exchange may take.
    pub budget_us: Option<Located<i64>>,
}

/// What a row of the map says of its lines.
#[derive(Clone, Debug, Default)]
pub struct EntryKeys {
    /// `active-low`: ON is a low level.
    pub active_low: bool,
    /// `debounce`, ms.
    pub debounce_ms: Option<Located<i32>>,
    /// `bias`.
    pub bias: Option<Text>,
    /// `drive`.
    pub drive: Option<Text>,
}

impl Keys {
    pub(in crate::controller::device) fn read(table: &mut Table<'_>, driver: Option<Kind>) -> Keys {
        if !belongs(driver, &DRIVERS) {
            return Keys::default();
        }
        if driver.is_some() {
            table.require("chip", "\"/dev/gpiochip0\"");
        }
        Keys { chip: table.string("chip"), budget_us: table.integer("budget-us", (1, 1_000_000)) }
    }
}

impl EntryKeys {
    pub(in crate::controller::device) fn read(
        row: &mut Table<'_>,
        driver: Option<Kind>,
    ) -> EntryKeys {
        if !belongs(driver, &DRIVERS) {
            return EntryKeys::default();
        }
        EntryKeys {
            active_low: row.boolean("active-low").is_some_and(|low| low.value),
            debounce_ms: row.duration("debounce"),
            bias: row.string("bias"),
            drive: row.string("drive"),
        }
    }
}
