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
use crate::source::key::{Key, LEAST_1MS, NOT_EMPTY, key};
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

/// Of a rule as a whole.
const PULSES_OR_FOLLOWS: &str = r#"{"oneOf":[
            {"required":["pulse","every"],
             "not":{"anyOf":[{"required":["after"]},{"required":["release"]}]}},
            {"required":["follows"],
             "not":{"anyOf":[{"required":["pulse"]},{"required":["every"]},
                             {"required":["offset"]}]}}]}"#;

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
    let order =
        root.strings(key("order", "The scan order of all Programs and Tasks of all ladder files."));
    let memory = read_memory(&mut root);
    let scan = read_scan(&mut root, file);
    let realtime = root
        .table(key("realtime", "What is asked of the operating system."), "`[realtime]`")
        .map_or_else(Realtime::default, realtime::read);
    let (mut outputs_on, mut outputs_hold) = (Vec::new(), Vec::new());
    if let Some(mut outputs) = root.table(
        key("outputs", "The safe values of outputs, in STOP and FAULT; OFF where not said."),
        "`[outputs]`",
    ) {
        outputs_on = strings(&mut outputs, key("on", "Outputs that are ON in the safe state."));
        outputs_hold = strings(&mut outputs, key("hold", "Outputs that keep their value."));
        outputs.finish();
    }
    let retain = root.table(key("retain", "What a restart keeps."), "`[retain]`");
    let retain =
        retain.map_or_else(|| WrittenRetain::absent(file), |table| retain::read(table, file));
    let modbus_server = root
        .table(
            key("modbus-server", "A Modbus TCP server; none where this is absent."),
            "`[modbus-server]`",
        )
        .map(modbus_server::read);
    let rules = root.tables(
        key("simulated-device", "Inputs that move by themselves, instead of a plant."),
        "a simulated device",
    );
    let rules = rules.into_iter().map(read_rule).collect();
    let devices = root
        .tables(
            key("device", "Field devices: remote I/O, local lines, a simulated plant."),
            "a device",
        )
        .into_iter()
        .map(device::read)
        .collect();
    let mut log = Log { statistics_ms: 60_000 };
    if let Some(mut table) = root.table(key("log", "What the log tells by itself."), "`[log]`") {
        log.statistics_ms = duration(
            &mut table,
            key("statistics", "How often scan statistics are logged; 0ms: never."),
            log.statistics_ms,
        );
        table.finish();
    }
    let mut probation_ms = 10_000;
    if let Some(mut table) = root.table(key("reload", "How a reload goes."), "`[reload]`") {
        probation_ms = duration(
            &mut table,
            key(
                "probation",
                "A program that faults so soon after its reload is taken back; 0ms: never.",
            ),
            probation_ms,
        );
        table.finish();
    }
    let operator = root
        .table(key("operator", "The socket by which operators ask and command."), "`[operator]`")
        .map(operator::read);
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

fn duration(table: &mut Table<'_>, key: Key, default: i32) -> i32 {
    table.duration(key).map_or(default, |duration| duration.value)
}

fn flag(table: &mut Table<'_>, key: Key) -> bool {
    table.boolean(key).is_some_and(|flag| flag.value)
}

fn read_memory(root: &mut Table<'_>) -> MemorySizes {
    let mut sizes = MemorySizes::default();
    let Some(mut table) =
        root.table(key("memory", "How many elements each space of memory has."), "`[memory]`")
    else {
        return sizes;
    };
    // Modbus numbers its elements with 16 bits, and the others need no more than that either.
    let blocks: [(Key, &mut u32); 11] = [
        (key("X", "Inputs."), &mut sizes.x),
        (key("Y", "Outputs."), &mut sizes.y),
        (key("C", "Control relays."), &mut sizes.c),
        (key("MC", "Modbus coils."), &mut sizes.mc),
        (key("MI", "Modbus discrete inputs."), &mut sizes.mi),
        (key("V", "Words, unsigned, 16 bits."), &mut sizes.v),
        (key("D", "Words, signed, 32 bits."), &mut sizes.d),
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
    let Some(mut table) = root.table(key("scan", "How often, and how long at most."), "`[scan]`")
    else {
        return scan;
    };
    scan.period_ms = table
        .duration(key("period", "From one scan to the next; 10ms if not given.").limited(LEAST_1MS))
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

fn read_rule(mut table: Table<'_>) -> DeviceRule {
    table.together(PULSES_OR_FOLLOWS);
    let rule = DeviceRule {
        span: table.span(),
        input: table.required_string(key("input", "The input that moves: an X, or a tag of one.")),
        pulse_ms: table.duration(key("pulse", "How long it is ON in each `every`.")),
        every_ms: table.duration(key("every", "How often it pulses.")),
        offset_ms: table.duration(key("offset", "When the first pulse begins.")),
        follows: table.string(key("follows", "The bit that it follows.")),
        after_ms: table.duration(key("after", "How long that bit is ON before the input is.")),
        release_ms: table.duration(key(
            "release",
            "How long that bit is OFF before the input is; else as `after`.",
        )),
        while_on: table.string(key("while", "It moves only while this bit is ON.")),
        invert: flag(&mut table, key("invert", "ON where the rule says OFF.")),
    };
    table.finish();
    rule
}
