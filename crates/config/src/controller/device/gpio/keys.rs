//! The keys of local lines (`gpio`) in a `[[device]]` and its map.

use rungd_io::gpio::settings::{Bias, LineDrive};
use rungd_language::source::key::{key, words};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::span::Located;

/// The keys of a `[[device]]` for its chip.
#[derive(Clone, Debug, Default)]
pub struct Keys {
    /// Whether the device names this driver; only then can a required key be missing.
    pub is_named: bool,
    /// `chip`: the chip's character device, or its label.
    pub chip: Option<Text>,
    /// `budget-us`: the longest time for an exchange.
    pub budget_us: Option<Located<i64>>,
    /// The keys of each row of the map.
    pub rows: Vec<RowKeys>,
}

/// The keys of a row of the map for its lines.
#[derive(Clone, Debug, Default)]
pub struct RowKeys {
    /// `active-low`: a low level is ON.
    pub active_low: bool,
    /// `debounce`, ms.
    pub debounce_ms: Option<Located<i32>>,
    /// `bias`.
    pub bias: Option<Text>,
    /// `drive`.
    pub drive: Option<Text>,
}

impl Keys {
    /// Keys that have not been read yet.
    pub fn of(name: Option<&str>) -> Keys {
        Keys { is_named: name.is_some(), ..Keys::default() }
    }

    pub(super) fn read_device(&mut self, table: &mut Table<'_>) {
        if self.is_named {
            table.require("chip", "\"/dev/gpiochip0\"");
        }
        self.chip = table.string(key(
            "chip",
            "`gpio`: the chip's character device, or `label:` and the chip's label.",
        ));
        self.budget_us = table.integer(
            key("budget-us", "`gpio`: the longest time an exchange may take; 200 if not given."),
            (1, 1_000_000),
        );
    }
}

impl RowKeys {
    pub(super) fn read(row: &mut Table<'_>) -> RowKeys {
        RowKeys {
            active_low: row
                .boolean(key("active-low", "`gpio`: a low level is ON."))
                .is_some_and(|low| low.value),
            debounce_ms: row.duration(key(
                "debounce",
                "`gpio`: a level must last this long to count; at most 10s.",
            )),
            bias: row.string(
                key("bias", "`gpio`: the resistor that holds the line when nothing drives it.")
                    .one_of(|| words(&Bias::NAMES)),
            ),
            drive: row.string(
                key("drive", "`gpio`: how an output drives its line; `push-pull` if not given.")
                    .one_of(|| words(&LineDrive::NAMES)),
            ),
        }
    }
}
