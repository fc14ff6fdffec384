//! The keys of a plant that is a ladder (`ladder`) in a `[[device]]` and its map.

use super::super::scaling::ScalingKeys;
use crate::controller::side_ladder::WrittenSideLadder;
use rungd_language::source::key::key;
use rungd_language::source::reader::Table;
use rungd_language::source::slot::Slot;

/// The keys of a `[[device]]` for its ladder.
#[derive(Clone, Debug, Default)]
pub struct LadderKeys {
    /// Whether the device names this driver; only then can a required key be missing.
    pub is_named: bool,
    /// Its ladder.
    pub side: WrittenSideLadder,
    /// The scaling of each row of the map.
    pub rows: Vec<ScalingKeys>,
}

impl LadderKeys {
    /// Keys that have not been read yet.
    pub fn of(name: Option<&str>) -> LadderKeys {
        LadderKeys { is_named: name.is_some(), ..LadderKeys::default() }
    }

    pub(super) fn read_device(&mut self, table: &mut Table<'_>) {
        if self.is_named {
            table.require("ladder", "[\"plant.toml\"]");
        }
        let ladder = key(
            "ladder",
            "`ladder`: the ladder files of the plant, relative to this file: a program of its own.",
        )
        .holds(Slot::DeviceLadder);
        let period = key(
            "period",
            "`ladder`: the time between two scans of the plant; the controller's if not given.",
        );
        self.side = WrittenSideLadder::read(table, ladder, period);
    }
}
