//! A controller file as its author wrote it: its ladders, its period, its tables.
//!
//! [`read`] takes the file's text. Names and ranges are still texts here, because they can contain
//! tags: the resolver turns them into addresses once the ladders are loaded.

use super::alarms::{self, AlarmSettings};
use super::device::driver::{DriverKeys, WrittenDevice};
use super::device::keys as device;
use super::log::{self, LogSettings};
use super::memory;
use super::modbus_server::keys::{self as modbus_server, WrittenModbusServer};
use super::operator::{self, WrittenOperator};
use super::realtime::{self, WrittenRealtime};
use super::record::{self, RecordSettings};
use super::retain::{self, WrittenRetain};
use super::simulated_device::{self, WrittenRule};
use super::simulated_side::{self, WrittenSimulated};
use super::watch::{self, WrittenWatch};
use super::web::{self, WrittenWeb};
use rungd_base::progress::{Progress, UNASKED};
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::MemorySizes;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::pair;
use rungd_language::source::key::key;
use rungd_language::source::lost::LostText;
use rungd_language::source::reader::{self, Table, Text};
use rungd_language::source::room::LoadRoom;
use rungd_language::source::shape::TableShape;
use rungd_language::source::slot::Slot;
use rungd_language::source::span::{FileId, Located, Span};
use rungd_language::source::value_kind::{Millis, Periods};

/// One controller file.
#[derive(Debug)]
pub struct WrittenController {
    /// `ladder`: the ladder files, relative to this file.
    pub ladder: Vec<Text>,
    /// All strings of the file, among them all names of addresses.
    pub strings: Vec<String>,
    /// `order`: the scan order of all blocks.
    pub order: Option<Located<Vec<Text>>>,
    /// `[memory]`.
    pub memory: MemorySizes,
    /// `[scan]`.
    pub scan: WrittenScan,
    /// `[realtime]`.
    pub(crate) realtime: WrittenRealtime,
    /// `[outputs]`.
    pub outputs: SafeOutputs,
    /// `[retain]`.
    pub(crate) retain: WrittenRetain,
    /// `[modbus-server]`.
    pub modbus_server: Option<WrittenModbusServer>,
    /// `[[simulated-device]]`, in file order.
    pub rules: Vec<WrittenRule>,
    /// `[[device]]`, in file order.
    pub devices: Vec<WrittenDevice>,
    /// `[[simulated]]`, in file order.
    pub simulated: Vec<WrittenSimulated>,
    /// `[operator]`.
    pub operator: Option<WrittenOperator>,
    /// `[record]`.
    pub(crate) record: RecordSettings,
    /// `[web]` and `[[panel]]`.
    pub(crate) web: WrittenWeb,
    /// `[[watch]]`, in file order.
    pub(super) watches: Vec<WrittenWatch>,
    /// `[alarms]`.
    pub(super) alarms: AlarmSettings,
    /// `[log]`.
    pub(crate) log: LogSettings,
    /// `[reload] probation`, ms; 0: none.
    pub probation_ms: u32,
    /// The text that is missing, if a part of the file is not TOML.
    pub lost: Option<LostText>,
}

impl WrittenController {
    /// The names of all ladder files: of the program, and of the ladders beside it.
    pub(crate) fn all_ladders(&self) -> impl Iterator<Item = &Text> {
        let devices = self.devices.iter().filter_map(|device| device.driver.as_deref());
        let plants = devices.filter_map(DriverKeys::side_ladder);
        let sides = plants.chain(self.simulated.iter().map(|simulated| &simulated.side));
        self.ladder.iter().chain(sides.flat_map(|side| &side.ladder))
    }
}

/// `[outputs]`.
#[derive(Clone, Debug, Default)]
pub struct SafeOutputs {
    /// `on`: outputs that are ON in the safe state.
    pub on: Vec<Text>,
    /// `hold`: outputs that keep their values in the safe state.
    pub hold: Vec<Text>,
}

/// `[scan]`.
#[derive(Clone, Debug)]
pub struct WrittenScan {
    /// `period`.
    pub period: Located<ScanPeriod>,
    /// `watchdog`, ms; at least 1.
    pub watchdog_ms: u32,
    /// Whether the scans are those of a test, which need no machine that keeps the period.
    pub in_virtual_time: bool,
}

const WATCHDOG_MS: u32 = 200;
const PROBATION_MS: u32 = 10_000;
/// The longest time of a scan.
const SCAN_TIME: Millis = Millis::some("10ms");

/// Reads a controller file; `None` if the text is not TOML.
pub fn read(source: &str, file: FileId) -> (Option<WrittenController>, Vec<Finding>) {
    read_within(source, file, &UNASKED)
}

/// As [`read`], for a load that its caller may end.
pub fn read_within(
    source: &str,
    file: FileId,
    progress: &Progress,
) -> (Option<WrittenController>, Vec<Finding>) {
    let mut room = LoadRoom::of(progress.clone()).for_bytes(source.len());
    reader::document_within(&mut room, source, file, |root| read_root(root, file))
}

/// The settings of an empty controller file.
pub(super) fn defaults(file: FileId) -> WrittenController {
    let (written, _) = reader::document("", file, |root| read_root(root, file));
    written.expect("an empty text is TOML")
}

/// The keys of a controller file.
pub fn shape() -> TableShape {
    reader::shape(|root| drop(read_root(root, FileId(0))))
}

fn read_root(mut root: Table<'_>, file: FileId) -> WrittenController {
    root.require("ladder", "[\"ladder.toml\"]");
    let controller = WrittenController {
        strings: root.all_strings(),
        ladder: read_ladders(&mut root),
        order: root.strings(
            key("order", "The scan order of all Programs and Tasks of all ladder files.")
                .holds(Slot::Block),
        ),
        memory: memory::read_in(&mut root),
        scan: read_scan(&mut root, file),
        realtime: realtime::read_in(&mut root),
        outputs: read_outputs(&mut root),
        retain: retain::read_in(&mut root),
        modbus_server: modbus_server::read_in(&mut root),
        rules: simulated_device::read_in(&mut root),
        devices: device::read_in(&mut root),
        simulated: simulated_side::read_in(&mut root),
        watches: watch::read_in(&mut root),
        alarms: alarms::read_in(&mut root),
        log: log::read_in(&mut root),
        probation_ms: read_probation(&mut root),
        operator: operator::read_in(&mut root),
        record: record::read_in(&mut root),
        web: web::read_in(&mut root),
        lost: root.doc().lost(),
    };
    root.finish();
    controller
}

fn read_outputs(root: &mut Table<'_>) -> SafeOutputs {
    let explained =
        key("outputs", "The safe values of outputs, in STOP and FAULT; OFF if not given.");
    let Some(mut table) = root.table(explained, "`[outputs]`") else {
        return SafeOutputs::default();
    };
    let outputs = SafeOutputs {
        on: table.texts(key("on", "Outputs that are ON in the safe state.").holds(Slot::Operand)),
        hold: table.texts(key("hold", "Outputs that keep their value.").holds(Slot::Operand)),
    };
    table.finish();
    outputs
}

fn read_probation(root: &mut Table<'_>) -> u32 {
    let Some(mut table) = root.table(key("reload", "Settings of reloads."), "`[reload]`") else {
        return PROBATION_MS;
    };
    let explained = key(
        "probation",
        "A program that faults within this time after its reload is taken back; 0ms: never.",
    );
    let probation_ms = table.value_of(explained, &Millis::ANY);
    table.finish();
    probation_ms.unwrap_or(PROBATION_MS)
}

fn read_ladders(root: &mut Table<'_>) -> Vec<Text> {
    let explained =
        key("ladder", "The ladder files, relative to this file: one program.").holds(Slot::File);
    root.some_texts(explained, |span| {
        let finding = Finding::new(Code::Controller, span, "no ladder file is named");
        finding.propose(pair("ladder = [\"ladder.toml\"]"))
    })
}

fn read_scan(root: &mut Table<'_>, file: FileId) -> WrittenScan {
    let nowhere = Span { file, start: 0, end: 0 };
    let mut scan = WrittenScan {
        period: Located { value: ScanPeriod::DEFAULT, span: nowhere },
        watchdog_ms: WATCHDOG_MS,
        in_virtual_time: false,
    };
    let Some(mut table) =
        root.table(key("scan", "The scan's period and its longest time."), "`[scan]`")
    else {
        return scan;
    };
    read_period(&mut table, &mut scan);
    let explained = key("watchdog", "A scan longer than this is a fault; 200ms if not given.");
    scan.watchdog_ms = table.value_of(explained, &SCAN_TIME).unwrap_or(WATCHDOG_MS);
    table.finish();
    scan
}

/// Reads `period`, of `[scan]` or of a test.
pub(super) fn read_period(table: &mut Table<'_>, scan: &mut WrittenScan) {
    let explained =
        key("period", "The time between the beginnings of two scans; 10ms if not given.");
    if let Some(period) = table.value(explained, &Periods) {
        scan.period = period;
    }
}
