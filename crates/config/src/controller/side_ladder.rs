//! A ladder beside the controller's, as its author wrote it: the plant of a device with
//! `driver = "ladder"`, or the own side of a Modbus device (`simulated_side`).
//!
//! `load` reads the files that it names. Each is a program of its own, with its own memory and
//! period.

use std::sync::Arc;

use super::memory;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::{DeviceBit, MemorySizes};
use rungd_language::resolve::program::Program;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::pair;
use rungd_language::source::key::Key;
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::value_kind::Periods;

/// A ladder beside the controller's.
#[derive(Clone, Debug, Default)]
pub struct WrittenSideLadder {
    /// `ladder`: its files, relative to the file that names them.
    pub ladder: Vec<Text>,
    /// `period`, ms; at least 1.
    pub period: Option<ScanPeriod>,
    /// `[memory]` of this ladder.
    pub memory: MemorySizes,
    /// The texts that may be addresses of its memory: no tag with a `type` is placed there.
    pub addresses: Vec<String>,
}

/// The ladders that were loaded; `None` for one that cannot be read.
#[derive(Clone, Debug, Default)]
pub struct SidePrograms {
    /// Of each `[[device]]` in file order; `None` also for a device without a ladder.
    pub devices: Vec<Option<Arc<Program>>>,
    /// Of each `[[simulated]]`, in file order.
    pub simulated: Vec<Option<Arc<Program>>>,
}

/// The operand of a device's own ladder that a text names: `level` of `tank.level`; `None` if it
/// names none. The bits of the device itself are the controller's.
pub fn operand_of<'t>(text: &'t str, device: &str) -> Option<&'t str> {
    let operand = text.strip_prefix(device)?.strip_prefix('.')?;
    DeviceBit::from_name(operand).is_none().then_some(operand)
}

impl WrittenSideLadder {
    /// Whether it is the same program as another one: of the same files, in the same memory.
    pub(crate) fn is_like(&self, other: &WrittenSideLadder) -> bool {
        let names = |side: &WrittenSideLadder| -> Vec<String> {
            side.ladder.iter().map(|name| name.text.clone()).collect()
        };
        names(self) == names(other)
            && self.memory == other.memory
            && self.addresses == other.addresses
    }

    /// Reads `ladder`, `period` and `[memory]`.
    pub(super) fn read(table: &mut Table<'_>, ladder: Key, period: Key) -> WrittenSideLadder {
        let ladder = table.some_texts(ladder, |span| {
            let finding = Finding::new(Code::Controller, span, "no ladder file is named");
            finding.propose(pair("ladder = [\"plant.toml\"]"))
        });
        WrittenSideLadder {
            ladder,
            period: table.value(period, &Periods).map(|period| period.value),
            memory: memory::read_in(table),
            addresses: Vec::new(),
        }
    }
}
