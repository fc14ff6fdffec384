//! A controller file as its author wrote it: its ladders, its period, its tables.
//!
//! [`read`] takes the file's text. Names and ranges are still texts here, since tags can stand in
//! them: the resolver makes addresses of them once the ladders are loaded.

use super::device::keys::{self as device, Device};
use super::modbus_server::keys::{self as modbus_server, ModbusServer};
use super::operator::{self, WrittenOperator};
use super::realtime::{self, Realtime};
use super::retain::{self, WrittenRetain};
use crate::isa::MemorySizes;
use crate::source::finding::{Code, Finding};
use crate::source::reader::{self, Table, Text};
use crate::source::shape::{self, Shape};
use crate::source::span::{FileId, Located, Span};

/// One controller file.
#[derive(Clone, Debug)]
pub struct WrittenController {
    /// `ladder`: the ladder files, relative to this file.
    pub ladder: Vec<Text>,
    /// `order`: the scan order of all blocks.
    pub order: Option<Located<Vec<Text>>>,
    /// `[memory]`.
    pub memory: MemorySizes,
    /// `[scan]`.
    pub scan: Scan,
    /// `[realtime]`.
    pub realtime: Realtime,
    /// `[outputs] on`: ON in the safe state.
    pub outputs_on: Vec<Text>,
    /// `[outputs] hold`: as they were, in the safe state.
    pub outputs_hold: Vec<Text>,
    /// `[retain]`.
    pub retain: WrittenRetain,
    /// `[modbus-server]`.
    pub modbus_server: Option<ModbusServer>,
    /// `[[simulated-device]]`, in file order.
    pub rules: Vec<DeviceRule>,
    /// `[[device]]`, in file order.
    pub devices: Vec<Device>,
    /// `[operator]`.
    pub operator: Option<WrittenOperator>,
    /// `[log]`.
    pub log: Log,
    /// `[reload] probation`, ms; 0: none.
    pub probation_ms: i32,
}

/// `[scan]`.
#[derive(Clone, Debug)]
pub struct Scan {
    /// `period`, ms.
    pub period_ms: Located<i32>,
    /// `watchdog`, ms.
    pub watchdog_ms: Located<i32>,
}

/// `[[simulated-device]]`: one rule by which an input moves.
#[derive(Clone, Debug)]
pub struct DeviceRule {
    /// The place of its header.
    pub span: Span,
    /// `input`.
    pub input: Option<Text>,
    /// `pulse`, ms.
    pub pulse_ms: Option<Located<i32>>,
    /// `every`, ms.
    pub every_ms: Option<Located<i32>>,
    /// `offset`, ms.
    pub offset_ms: Option<Located<i32>>,
    /// `follows`.
    pub follows: Option<Text>,
    /// `after`, ms.
    pub after_ms: Option<Located<i32>>,
    /// `release`, ms.
    pub release_ms: Option<Located<i32>>,
    /// `while`.
    pub while_on: Option<Text>,
    /// `invert`.
    pub invert: bool,
}

/// `[log]`.
#[derive(Clone, Debug)]
pub struct Log {
    /// `statistics`: how often scan statistics are logged, ms; 0: never.
    pub statistics_ms: i32,
}

/// Reads a controller file. It is `None` when the text is not TOML.
pub fn read(source: &str, file: FileId) -> (Option<WrittenController>, Vec<Finding>) {
    reader::document(source, file, |root| read_root(root, file))
}

/// The keys of a controller file.
pub fn shape() -> Shape {
    shape::of(|root| drop(read_root(root, FileId(0))))
}

fn read_root(mut root: Table<'_>, file: FileId) -> WrittenController {
    root.require("ladder", "[\"ladder.toml\"]");
    let ladder = read_ladders(&mut root);
    let order = root.strings("order");
    let memory = read_memory(&mut root);
    let scan = read_scan(&mut root, file);
    let realtime =
        root.table("realtime", "`[realtime]`").map_or_else(Realtime::default, realtime::read);
    let (mut outputs_on, mut outputs_hold) = (Vec::new(), Vec::new());
    if let Some(mut outputs) = root.table("outputs", "`[outputs]`") {
        outputs_on = strings(&mut outputs, "on");
        outputs_hold = strings(&mut outputs, "hold");
        outputs.finish();
    }
    let retain = root.table("retain", "`[retain]`");
    let retain =
        retain.map_or_else(|| WrittenRetain::absent(file), |table| retain::read(table, file));
    let modbus_server = root.table("modbus-server", "`[modbus-server]`").map(modbus_server::read);
    let rules = root.tables("simulated-device", "a simulated device");
    let rules = rules.into_iter().map(read_rule).collect();
    let devices = root.tables("device", "a device").into_iter().map(device::read).collect();
    let mut log = Log { statistics_ms: 60_000 };
    if let Some(mut table) = root.table("log", "`[log]`") {
        log.statistics_ms = duration(&mut table, "statistics", log.statistics_ms);
        table.finish();
    }
    let mut probation_ms = 10_000;
    if let Some(mut table) = root.table("reload", "`[reload]`") {
        probation_ms = duration(&mut table, "probation", probation_ms);
        table.finish();
    }
    let operator = root.table("operator", "`[operator]`").map(operator::read);
    root.finish();
    WrittenController {
        ladder,
        order,
        memory,
        scan,
        realtime,
        outputs_on,
        outputs_hold,
        retain,
        modbus_server,
        rules,
        devices,
        operator,
        log,
        probation_ms,
    }
}

fn read_ladders(root: &mut Table<'_>) -> Vec<Text> {
    let Some(ladder) = root.strings("ladder") else { return Vec::new() };
    if ladder.value.is_empty() && !root.doc().has_finding_in(ladder.span) {
        let finding = Finding::new(Code::Controller, ladder.span, "no ladder file is named");
        root.find(finding.help("write `ladder = [\"ladder.toml\"]`"));
    }
    ladder.value
}

fn strings(table: &mut Table<'_>, key: &'static str) -> Vec<Text> {
    table.strings(key).map_or(Vec::new(), |texts| texts.value)
}

fn duration(table: &mut Table<'_>, key: &'static str, default: i32) -> i32 {
    table.duration(key).map_or(default, |duration| duration.value)
}

fn flag(table: &mut Table<'_>, key: &'static str) -> bool {
    table.boolean(key).is_some_and(|flag| flag.value)
}

fn read_memory(root: &mut Table<'_>) -> MemorySizes {
    let mut sizes = MemorySizes::default();
    let Some(mut table) = root.table("memory", "`[memory]`") else { return sizes };
    // Modbus numbers its elements with 16 bits, and the others need no more than that either.
    let blocks: [(&'static str, &mut u32); 11] = [
        ("X", &mut sizes.x),
        ("Y", &mut sizes.y),
        ("C", &mut sizes.c),
        ("MC", &mut sizes.mc),
        ("MI", &mut sizes.mi),
        ("V", &mut sizes.v),
        ("D", &mut sizes.d),
        ("MHR", &mut sizes.mhr),
        ("MIR", &mut sizes.mir),
        ("CT", &mut sizes.ct),
        ("T", &mut sizes.t),
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
    let Some(mut table) = root.table("scan", "`[scan]`") else { return scan };
    scan.period_ms = table.duration("period").unwrap_or(scan.period_ms);
    scan.watchdog_ms = table.duration("watchdog").unwrap_or(scan.watchdog_ms);
    table.finish();
    scan
}

fn read_rule(mut table: Table<'_>) -> DeviceRule {
    let rule = DeviceRule {
        span: table.span(),
        input: table.required_string("input"),
        pulse_ms: table.duration("pulse"),
        every_ms: table.duration("every"),
        offset_ms: table.duration("offset"),
        follows: table.string("follows"),
        after_ms: table.duration("after"),
        release_ms: table.duration("release"),
        while_on: table.string("while"),
        invert: flag(&mut table, "invert"),
    };
    table.finish();
    rule
}
