//! `[[device]]` of a controller file as its author wrote it: a field device, its driver's keys, and
//! the map from its points to memory.
//!
//! Called by [`super::super::written`]. Keys of all drivers are read here, a driver's own keys in
//! its folder; a key of another driver is as unknown as a misspelt one. What names, points and
//! ranges mean is the resolver's business.

use super::gpio::keys as gpio;
use super::modbus::keys as modbus;
use super::simulated::keys as simulated;
use crate::source::finding::{Code, Finding};
use crate::source::key::{BLOCK_NAME, LEAST_1MS, key, words};
use crate::source::nearest::did_you_mean;
use crate::source::reader::{Constant, Table, Text};
use crate::source::span::{Located, Span};

/// One `[[device]]`.
#[derive(Clone, Debug)]
pub struct Device {
    /// The place of its header.
    pub span: Span,
    /// `name`.
    pub name: Option<Text>,
    /// `driver`, where it is one.
    pub driver: Option<DriverKind>,
    /// `poll`, ms: from exchange to exchange.
    pub poll_ms: Option<Located<i32>>,
    /// `on-loss`: what becomes of its inputs.
    pub on_loss: Option<Text>,
    /// `loss-after`, ms: how old its last good exchange may become.
    pub loss_after_ms: Option<Located<i32>>,
    /// `map`, in file order.
    pub map: Vec<Entry>,
    /// The keys of the Modbus clients.
    pub modbus: modbus::Keys,
    /// The keys of local lines.
    pub gpio: gpio::Keys,
    /// The keys of the simulated plant.
    pub simulated: simulated::Keys,
}

/// A driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum DriverKind {
    ModbusTcp,
    ModbusRtu,
    Gpio,
    Simulated,
}

/// One row of a map: a stretch of points and the memory that goes with it.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The place of its table.
    pub span: Span,
    /// `from`: where the values come from.
    pub from: Option<Text>,
    /// `to`: where they go.
    pub to: Option<Text>,
    /// `safe`: what an output that is no Y is outside RUN.
    pub safe: Option<Located<Constant>>,
    /// `hold`: an output that is no Y stays outside RUN as it was.
    pub hold: Option<Located<bool>>,
    /// The keys of the Modbus clients.
    pub modbus: modbus::EntryKeys,
    /// The keys of local lines.
    pub gpio: gpio::EntryKeys,
}

impl DriverKind {
    /// All drivers by name.
    pub const NAMES: [(&'static str, DriverKind); 4] = [
        ("modbus-tcp", DriverKind::ModbusTcp),
        ("modbus-rtu", DriverKind::ModbusRtu),
        ("gpio", DriverKind::Gpio),
        ("simulated", DriverKind::Simulated),
    ];
}

/// Reads one `[[device]]`.
pub(in crate::controller) fn read(mut table: Table<'_>) -> Device {
    let span = table.span();
    let name = table.required_string(
        key("name", "Its name: `NAME.Ok` and `NAME.Stale` are its bits.").limited(BLOCK_NAME),
    );
    table.require("driver", "\"modbus-tcp\"");
    let text =
        table.string(key("driver", "How it is reached.").one_of(|| words(&DriverKind::NAMES)));
    let driver = text.and_then(|text| named(&table, &text, "driver", &DriverKind::NAMES));
    let poll_ms = table
        .duration(key("poll", "From exchange to exchange; 20ms if not given.").limited(LEAST_1MS));
    let on_loss = table.string(
        key("on-loss", "What becomes of its inputs when it is lost; `hold` if not given.")
            .limited(r#"{"enum":["hold","zero"]}"#),
    );
    let loss_after_ms = table.duration(
        key("loss-after", "So old may its last good exchange be; 1s if not given.")
            .limited(LEAST_1MS),
    );
    let map = table
        .tables(key("map", "Which of its points goes with which bit or word."), "a device's map");
    let map = map.into_iter().map(|row| read_entry(row, driver)).collect();
    let device = Device {
        span,
        name,
        driver,
        poll_ms,
        on_loss,
        loss_after_ms,
        map,
        modbus: modbus::Keys::read(&mut table, driver),
        gpio: gpio::Keys::read(&mut table, driver),
        simulated: simulated::Keys::read(&mut table, driver),
    };
    table.finish();
    device
}

/// What a text names, of those that there are; `what` they are, for a finding.
pub(super) fn named<T: Copy>(
    table: &Table<'_>,
    text: &Text,
    what: &str,
    known: &[(&'static str, T)],
) -> Option<T> {
    let found = known.iter().find(|(name, _)| *name == text.text);
    if let Some((_, thing)) = found {
        return Some(*thing);
    }
    let message = format!("no {what} is called `{}`", text.text);
    let names = || known.iter().map(|(name, _)| *name);
    let list = names().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let help = did_you_mean(&text.text, names()).unwrap_or_else(|| format!("there are {list}"));
    table.find(Finding::new(Code::Controller, text.span, message).help(help));
    None
}

fn read_entry(mut row: Table<'_>, driver: Option<DriverKind>) -> Entry {
    let entry = Entry {
        span: row.span(),
        from: row.required_string(key(
            "from",
            "Where the values come from: points of the device, or bits and words.",
        )),
        to: row.required_string(key("to", "Where they go.")),
        safe: row.constant(key(
            "safe",
            "What an output that is no Y is in STOP and FAULT; 0 if not given.",
        )),
        hold: row.boolean(key("hold", "An output that is no Y stays in STOP and FAULT as it was.")),
        modbus: modbus::EntryKeys::read(&mut row, driver),
        gpio: gpio::EntryKeys::read(&mut row, driver),
    };
    row.finish();
    entry
}

/// Whether keys of these drivers belong here; all do where the driver is not known.
pub(super) fn belongs(driver: Option<DriverKind>, to: &[DriverKind]) -> bool {
    driver.is_none_or(|driver| to.contains(&driver))
}
