//! The table of drivers.
//!
//! A driver has a folder beside this file and a row here; `daemon/devices.rs` starts it.

use super::driver::{DriverKeys, OfferedPoints};
use super::{gpio, ladder, modbus, simulated};

/// A driver.
pub struct DriverRow {
    /// The words for `driver` that select it: one for each variant.
    pub(crate) names: &'static [&'static str],
    /// Its keys, still unread, for one of its names; without a name, the keys of all its variants.
    pub(crate) keys: fn(Option<&str>) -> Box<dyn DriverKeys>,
    /// The points that an editor offers for the maps of its devices.
    pub points: OfferedPoints,
}

/// All drivers.
pub const DRIVERS: [DriverRow; 4] = [
    DriverRow {
        names: &modbus::keys::NAMES,
        keys: |name| Box::new(modbus::keys::ModbusKeys::of(name)),
        points: OfferedPoints::Beginnings(modbus::points::beginnings),
    },
    DriverRow {
        names: &["gpio"],
        keys: |name| Box::new(gpio::keys::GpioKeys::of(name)),
        points: OfferedPoints::Beginnings(gpio::beginnings),
    },
    DriverRow {
        names: &["simulated"],
        keys: |_| Box::new(simulated::keys::PlantKeys::default()),
        points: OfferedPoints::OfParts,
    },
    DriverRow {
        names: &["ladder"],
        keys: |name| Box::new(ladder::keys::LadderKeys::of(name)),
        points: OfferedPoints::OfLadder,
    },
];

/// The row of a named driver; `None` if no driver has this name.
pub fn row(name: &str) -> Option<&'static DriverRow> {
    DRIVERS.iter().find(|driver| driver.names.contains(&name))
}

/// The names of all drivers.
pub fn names() -> Vec<&'static str> {
    DRIVERS.iter().flat_map(|driver| driver.names).copied().collect()
}

/// The unread keys of a named driver; of all drivers if no driver has this name.
pub(crate) fn keys_of(name: Option<&str>) -> Vec<Box<dyn DriverKeys>> {
    let is_named = |driver: &&DriverRow| name.is_none_or(|name| driver.names.contains(&name));
    DRIVERS.iter().filter(is_named).map(|driver| (driver.keys)(name)).collect()
}
