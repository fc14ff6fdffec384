//! The keys of local lines (`gpio`) in a `[[device]]` and its map.

use rungd_io::gpio::settings::{Bias, ChipId, LineDrive};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{advise, pair};
use rungd_language::source::key::key;
use rungd_language::source::reader::Table;
use rungd_language::source::span::Located;
use rungd_language::source::value_kind::{KeyWords, Millis, ParsedText};

/// The longest time an exchange may take if `budget-us` is not given, µs.
const BUDGET_US: u32 = 200;

/// The keys of a `[[device]]` for its chip.
#[derive(Clone, Debug, Default)]
pub struct GpioKeys {
    /// Whether the device names this driver; only then can a required key be missing.
    pub is_named: bool,
    /// `chip`: the chip's character device, or its label.
    pub chip: Option<ChipId>,
    /// `budget-us`: the longest time for an exchange.
    pub budget_us: u32,
    /// The keys of each row of the map.
    pub rows: Vec<GpioRowKeys>,
}

/// The keys of a row of the map for its lines.
#[derive(Clone, Debug, Default)]
pub struct GpioRowKeys {
    /// `active-low`: a low level is ON.
    pub active_low: bool,
    /// `debounce`, ms.
    pub debounce_ms: Option<Located<u32>>,
    /// `bias`.
    pub bias: Bias,
    /// `drive`.
    pub drive: Option<Located<LineDrive>>,
}

const CHIP: ParsedText<ChipId> = ParsedText::new(|_, text| {
    if let Some(label) = text.text.strip_prefix("label:") {
        return Ok(ChipId::Label(label.trim().to_owned()));
    }
    if !text.text.starts_with('/') {
        let message = format!("`{}` is no chip", text.text);
        let path = pair("chip = \"/dev/gpiochip0\"").possible();
        let help = advise("write its path: `{}`; or `chip = \"label:…\"`", [path]);
        return Err(Finding::new(Code::Controller, text.span, message).help(help));
    }
    Ok(ChipId::Path(text.text.clone()))
});

impl GpioKeys {
    /// Keys that have not been read yet.
    pub fn of(name: Option<&str>) -> GpioKeys {
        GpioKeys { is_named: name.is_some(), ..GpioKeys::default() }
    }

    pub(super) fn read_device(&mut self, table: &mut Table<'_>) {
        if self.is_named {
            table.require("chip", "\"/dev/gpiochip0\"");
        }
        let explained =
            key("chip", "`gpio`: the chip's character device, or `label:` and the chip's label.");
        self.chip = table.value_of(explained, &CHIP);
        let explained =
            key("budget-us", "`gpio`: the longest time an exchange may take; 200 if not given.");
        let budget_us = table.whole(explained, 1..=1_000_000);
        self.budget_us = budget_us.map_or(BUDGET_US, |us| us.value);
    }
}

impl GpioRowKeys {
    pub(super) fn read(row: &mut Table<'_>) -> GpioRowKeys {
        let active_low = row.flag(key("active-low", "`gpio`: a low level is ON."), false);
        let explained =
            key("debounce", "`gpio`: a level must last this long to count; at most 10s.");
        let debounce_ms = row.value(explained, &Millis::ANY);
        let explained =
            key("bias", "`gpio`: the resistor that holds the line when nothing drives it.");
        let bias = row.value_of(explained, &KeyWords::new(&Bias::NAMES)).unwrap_or_default();
        let explained =
            key("drive", "`gpio`: how an output drives its line; `push-pull` if not given.");
        let drive = row.value(explained, &KeyWords::new(&LineDrive::NAMES));
        GpioRowKeys { active_low, debounce_ms, bias, drive }
    }
}
