//! `[[device]]` of a controller file as its author wrote it: a field device, its driver's keys, and
//! the map between its points and memory.
//!
//! Called by [`super::super::written`]. This file reads the keys that all drivers share; each
//! driver's folder reads the driver's own keys. A key of a different driver is an unknown key, like
//! a misspelt key. The resolver checks names, points and ranges.

use super::driver::{DriverKeys, MapRow, WrittenDevice, named};
use super::drivers;
use super::settings::OnLoss;
use rungd_language::source::key::{BLOCK_NAME, LEAST_1MS, key, words};
use rungd_language::source::reader::Table;

/// Reads all `[[device]]` tables.
pub(in crate::controller) fn read_in(root: &mut Table<'_>) -> Vec<WrittenDevice> {
    let explained = key("device", "Field devices: remote I/O, local lines, a simulated plant.");
    root.tables(explained, "a device").into_iter().map(read).collect()
}

fn read(mut table: Table<'_>) -> WrittenDevice {
    let span = table.span();
    let name = table.required_string(
        key("name", "Its name: `NAME.Ok` and `NAME.Stale` are its bits.").limited(BLOCK_NAME),
    );
    table.require("driver", "\"modbus-tcp\"");
    let text = table.string(key("driver", "The driver that reaches it.").one_of(drivers::names));
    let known = drivers::names().into_iter().map(|name| (name, name)).collect::<Vec<_>>();
    let name_of_driver = text.and_then(|text| named(&table, &text, "driver", &known));
    let mut drivers = drivers::keys_of(name_of_driver);
    let poll_ms = table
        .duration(key("poll", "The time between exchanges; 20ms if not given.").limited(LEAST_1MS));
    let on_loss = table.string(
        key("on-loss", "The values of its inputs when it is lost; `hold` if not given.")
            .one_of(|| words(&OnLoss::NAMES)),
    );
    let loss_after_ms = table.duration(
        key("loss-after", "It is lost when its last good exchange is this old; 1s if not given.")
            .limited(LEAST_1MS),
    );
    let map_is_table = table.has_table("map");
    let map = table
        .tables(key("map", "Rows that connect its points with bits and words."), "a device's map");
    let map = map.into_iter().map(|row| read_row(row, &mut drivers)).collect();
    drivers.iter_mut().for_each(|driver| driver.read(&mut table));
    table.finish();
    // Without a named driver, the keys of all drivers were read; no settings can be made of them.
    let driver = drivers.pop().filter(|_| name_of_driver.is_some());
    WrittenDevice { span, name, driver, poll_ms, on_loss, loss_after_ms, map, map_is_table }
}

fn read_row(mut table: Table<'_>, drivers: &mut [Box<dyn DriverKeys>]) -> MapRow {
    let row = MapRow {
        span: table.span(),
        from: table.required_string(key(
            "from",
            "The source of the values: points of the device, or bits and words.",
        )),
        to: table.required_string(key("to", "The destination of the values.")),
        safe: table.constant(key(
            "safe",
            "The value in STOP and FAULT of an output that is not a Y; 0 if not given.",
        )),
        hold: table
            .boolean(key("hold", "An output that is not a Y keeps its value in STOP and FAULT.")),
    };
    drivers.iter_mut().for_each(|driver| driver.read_row(&mut table));
    table.finish();
    row
}
