//! The keys of local lines (`gpio`) in a `[[device]]` and its map.

use super::super::keys::{DriverKind, belongs};
use crate::io::gpio::settings::{Bias, Drive};
use crate::source::key::{key, words};
use crate::source::reader::{Table, Text};
use crate::source::span::Located;

const DRIVERS: [DriverKind; 1] = [DriverKind::Gpio];

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
    pub(in crate::controller::device) fn read(
        table: &mut Table<'_>,
        driver: Option<DriverKind>,
    ) -> Keys {
        if !belongs(driver, &DRIVERS) {
            return Keys::default();
        }
        if driver.is_some() {
            table.require("chip", "\"/dev/gpiochip0\"");
        }
        Keys {
            chip: table.string(key(
                "chip",
                "`gpio`: its character device, or `label:` and what the chip calls itself.",
            )),
            budget_us: table.integer(
                key("budget-us", "`gpio`: so long may an exchange take; 200 if not given."),
                (1, 1_000_000),
            ),
        }
    }
}

impl EntryKeys {
    pub(in crate::controller::device) fn read(
        row: &mut Table<'_>,
        driver: Option<DriverKind>,
    ) -> EntryKeys {
        if !belongs(driver, &DRIVERS) {
            return EntryKeys::default();
        }
        EntryKeys {
            active_low: row
                .boolean(key("active-low", "`gpio`: ON is a low level."))
                .is_some_and(|low| low.value),
            debounce_ms: row.duration(key(
                "debounce",
                "`gpio`: a level lasts so long before it counts; at most 10s.",
            )),
            bias: row.string(
                key("bias", "`gpio`: what holds the line where nothing drives it.")
                    .one_of(|| words(&Bias::NAMES)),
            ),
            drive: row.string(
                key("drive", "`gpio`: how an output drives its line; `push-pull` if not given.")
                    .one_of(|| words(&Drive::NAMES)),
            ),
        }
    }
}
