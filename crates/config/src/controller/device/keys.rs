//! `[[device]]` of a controller file as its author wrote it: a field device, its driver's keys, and
//! the map between its points and memory.
//!
//! Called by [`super::super::written`]. This file reads the keys that all drivers share; each
//! driver's folder reads the driver's own keys. A key of a different driver is an unknown key, like
//! a misspelt key. The resolver checks names, points and ranges.

use super::driver::{DriverKeys, MapRow, WrittenDevice};
use super::drivers;
use super::settings::OnLoss;
use rungd_language::source::finding::Finding;
use rungd_language::source::key::{BLOCK_NAME, key};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::shape::ValueForm;
use rungd_language::source::slot::{DeclaredKind, Slot};
use rungd_language::source::value_kind::{KeyWords, Millis, ValueKind, WrongWord};

/// The name of a driver.
struct DriverName;

impl ValueKind for DriverName {
    type Value = &'static str;

    fn form(&self) -> ValueForm {
        ValueForm::Words(drivers::names())
    }

    fn read(&self, key: &str, text: &Text, find: &mut dyn FnMut(Finding)) -> Option<&'static str> {
        let names = drivers::names();
        let found = names.iter().find(|name| **name == text.text).copied();
        if found.is_none() {
            find(WrongWord::NoneCalled("driver").finding(key, text, &names));
        }
        found
    }
}

/// Reads all `[[device]]` tables.
pub(in crate::controller) fn read_in(root: &mut Table<'_>) -> Vec<WrittenDevice> {
    let explained = key("device", "Field devices: remote I/O, local lines, a simulated plant.");
    root.tables(explained, "a device").into_iter().map(read).collect()
}

fn read(mut table: Table<'_>) -> WrittenDevice {
    let span = table.span();
    let name = table.required_string(
        key("name", "Its name: `NAME.Ok` and `NAME.Stale` are its bits.")
            .limited(BLOCK_NAME)
            .declares(DeclaredKind::Device),
    );
    table.require("driver", "\"modbus-tcp\"");
    let name_of_driver = table.value_of(key("driver", "The driver that reaches it."), &DriverName);
    let mut drivers = drivers::keys_of(name_of_driver);
    let explained = key("poll", "The time between exchanges; 20ms if not given.");
    let poll = table.value(explained, &Millis::some("20ms"));
    let explained =
        key("on-loss", "The values of its inputs when it is lost; `hold` if not given.");
    let on_loss = table.value_of(explained, &KeyWords::new(&OnLoss::NAMES)).unwrap_or_default();
    let explained = key(
        "loss-after",
        "It is lost when its last good exchange is this old; if not given, 1s or three polls, \
         whichever is more.",
    );
    let loss_after = table.value(explained, &Millis::some("20ms"));
    let map_is_table = table.has_table("map");
    let map = table
        .tables(key("map", "Rows that connect its points with bits and words."), "a device's map");
    let mut map: Vec<MapRow> = map.into_iter().map(|row| read_row(row, &mut drivers)).collect();
    drivers.iter_mut().for_each(|driver| driver.read(&mut table));
    table.finish();
    // Without a named driver, the keys of all drivers were read; no settings can be made of them.
    let mut driver = drivers.pop().filter(|_| name_of_driver.is_some());
    map.extend(driver.iter_mut().flat_map(|driver| driver.rows_of_parts()));
    WrittenDevice { span, name, driver, poll, on_loss, loss_after, map, map_is_table }
}

fn read_row(mut table: Table<'_>, drivers: &mut [Box<dyn DriverKeys>]) -> MapRow {
    let row = MapRow {
        span: table.span(),
        from: table.required_string(
            key("from", "The source of the values: points of the device, or bits and words.")
                .holds(Slot::Point),
        ),
        to: table.required_string(key("to", "The destination of the values.").holds(Slot::Point)),
        safe: table.constant(key(
            "safe",
            "The value in STOP and FAULT of an output that is not a Y; 0 if not given.",
        )),
        hold: table
            .boolean(key("hold", "An output that is not a Y keeps its value in STOP and FAULT.")),
        of_part: None,
    };
    drivers.iter_mut().for_each(|driver| driver.read_row(&mut table));
    table.finish();
    row
}
