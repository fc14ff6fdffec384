//! A controller file as its author wrote it: its ladders, its period, its tables.
//!
//! [`read`] takes the file's text. Names and ranges are still texts here, because they can contain
//! tags: the resolver turns them into addresses once the ladders are loaded.

use super::device::driver::WrittenDevice;
use super::device::keys as device;
use super::log::{self, LogSettings};
use super::modbus_server::keys::{self as modbus_server, ModbusServer};
use super::operator::{self, WrittenOperator};
use super::realtime;
use super::record::{self, WrittenRecord};
use super::retain::{self, WrittenRetain};
use super::simulated_device::{self, WrittenRule};
use super::web::{self, WrittenWeb};
use rungd_base::progress::{Progress, UNASKED};
use rungd_engine::isa::MemorySizes;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::key::{Key, LEAST_1MS, NOT_EMPTY, key};
use rungd_language::source::lost::LostText;
use rungd_language::source::reader::{self, Table, Text};
use rungd_language::source::room::Room;
use rungd_language::source::shape::Shape;
use rungd_language::source::span::{FileId, Located, Span};
use rungd_runtime::Posture;

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
    pub scan: Scan,
    /// `[realtime]`.
    pub realtime: Posture,
    /// `[outputs]`.
    pub outputs: SafeOutputs,
    /// `[retain]`.
    pub(crate) retain: WrittenRetain,
    /// `[modbus-server]`.
    pub modbus_server: Option<ModbusServer>,
    /// `[[simulated-device]]`, in file order.
    pub rules: Vec<WrittenRule>,
    /// `[[device]]`, in file order.
    pub devices: Vec<WrittenDevice>,
    /// `[operator]`.
    pub operator: Option<WrittenOperator>,
    /// `[record]`.
    pub(crate) record: WrittenRecord,
    /// `[web]` and `[[panel]]`.
    pub(crate) web: WrittenWeb,
    /// `[log]`.
    pub(crate) log: LogSettings,
    /// `[reload] probation`, ms; 0: none.
    pub probation_ms: i32,
    /// The text that is missing, if a part of the file is not TOML.
    pub lost: Option<LostText>,
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
pub struct Scan {
    /// `period`, ms.
    pub period_ms: Located<i32>,
    /// `watchdog`, ms.
    pub watchdog_ms: Located<i32>,
}

const PROBATION_MS: i32 = 10_000;

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
    let mut room = Room::of(progress.clone());
    reader::document_within(&mut room, source, file, |root| read_root(root, file))
}

/// The settings of an empty controller file.
pub(super) fn defaults(file: FileId) -> WrittenController {
    let (written, _) = reader::document("", file, |root| read_root(root, file));
    written.expect("an empty text is TOML")
}

/// The keys of a controller file.
pub fn shape() -> Shape {
    reader::shape(|root| drop(read_root(root, FileId(0))))
}

fn read_root(mut root: Table<'_>, file: FileId) -> WrittenController {
    root.require("ladder", "[\"ladder.toml\"]");
    let controller = WrittenController {
        strings: root.all_strings(),
        ladder: read_ladders(&mut root),
        order: root
            .strings(key("order", "The scan order of all Programs and Tasks of all ladder files.")),
        memory: read_memory(&mut root),
        scan: read_scan(&mut root, file),
        realtime: realtime::read_in(&mut root),
        outputs: read_outputs(&mut root),
        retain: retain::read_in(&mut root, file),
        modbus_server: modbus_server::read_in(&mut root),
        rules: simulated_device::read_in(&mut root),
        devices: device::read_in(&mut root),
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
        on: strings(&mut table, key("on", "Outputs that are ON in the safe state.")),
        hold: strings(&mut table, key("hold", "Outputs that keep their value.")),
    };
    table.finish();
    outputs
}

fn read_probation(root: &mut Table<'_>) -> i32 {
    let Some(mut table) = root.table(key("reload", "Settings of reloads."), "`[reload]`") else {
        return PROBATION_MS;
    };
    let probation = table.duration(key(
        "probation",
        "A program that faults within this time after its reload is taken back; 0ms: never.",
    ));
    table.finish();
    probation.map_or(PROBATION_MS, |probation| probation.value)
}

fn read_ladders(root: &mut Table<'_>) -> Vec<Text> {
    let Some(ladder) = root.strings(
        key("ladder", "The ladder files, relative to this file: one program.").limited(NOT_EMPTY),
    ) else {
        return Vec::new();
    };
    if ladder.value.is_empty() && !root.doc().has_finding_in(ladder.span) {
        let finding = Finding::new(Code::Controller, ladder.span, "no ladder file is named");
        root.find(finding.help("write `ladder = [\"ladder.toml\"]`"));
    }
    ladder.value
}

fn strings(table: &mut Table<'_>, key: Key) -> Vec<Text> {
    table.strings(key).map_or(Vec::new(), |texts| texts.value)
}

fn read_memory(root: &mut Table<'_>) -> MemorySizes {
    let mut sizes = MemorySizes::default();
    let Some(mut table) =
        root.table(key("memory", "The number of elements of each space of memory."), "`[memory]`")
    else {
        return sizes;
    };
    // Modbus numbers its elements with 16 bits; the other spaces need no more.
    let blocks: [(Key, &mut u32); 12] = [
        (key("X", "Inputs."), &mut sizes.x),
        (key("Y", "Outputs."), &mut sizes.y),
        (key("C", "Control relays."), &mut sizes.c),
        (key("MC", "Modbus coils."), &mut sizes.mc),
        (key("MI", "Modbus discrete inputs."), &mut sizes.mi),
        (key("V", "Words, unsigned, 16 bits."), &mut sizes.v),
        (key("D", "Words, signed, 32 bits."), &mut sizes.d),
        (key("R", "Reals, 32 bits."), &mut sizes.r),
        (key("MHR", "Modbus holding registers."), &mut sizes.mhr),
        (key("MIR", "Modbus input registers."), &mut sizes.mir),
        (key("CT", "Counters."), &mut sizes.ct),
        (key("T", "Timers."), &mut sizes.t),
    ];
    for (key, size) in blocks {
        if let Some(count) = table.integer(key, (1, 65_536)) {
            *size = u32::try_from(count.value).unwrap_or(*size);
        }
    }
    table.finish();
    sizes
}

fn read_scan(root: &mut Table<'_>, file: FileId) -> Scan {
    let nowhere = Span { file, start: 0, end: 0 };
    let mut scan = Scan {
        period_ms: Located { value: 10, span: nowhere },
        watchdog_ms: Located { value: 200, span: nowhere },
    };
    let Some(mut table) =
        root.table(key("scan", "The scan's period and its longest time."), "`[scan]`")
    else {
        return scan;
    };
    scan.period_ms = table
        .duration(
            key("period", "The time between the beginnings of two scans; 10ms if not given.")
                .limited(LEAST_1MS),
        )
        .unwrap_or(scan.period_ms);
    scan.watchdog_ms = table
        .duration(
            key("watchdog", "A scan longer than this is a fault; 200ms if not given.")
                .limited(LEAST_1MS),
        )
        .unwrap_or(scan.watchdog_ms);
    table.finish();
    scan
}
