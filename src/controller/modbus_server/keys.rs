//! `[modbus-server]` of a controller file, as its author wrote it.
//!
//! Called by `written`. Operands, clients and the words of a map entry are still texts:
//! the resolver judges them, with the program's names at hand.

use crate::source::finding::{Code, Finding};
use crate::source::reader::{Table, Text};
use crate::source::span::{Located, Span};

/// `[modbus-server]`.
#[derive(Clone, Debug)]
pub struct ModbusServer {
    /// The place of its header.
    pub span: Span,
    /// `listen`, where it is given.
    pub listen: Option<Text>,
    /// `units`: the unit identifiers that are answered; else all.
    pub units: Option<Located<Vec<i64>>>,
    /// `standard-map`: whether MC, MI, MHR and MIR have their places.
    pub standard_map: bool,
    /// `writable`: what every client may write.
    pub writable: Vec<Text>,
    /// `[[modbus-server.write]]`: what some clients may write.
    pub writes: Vec<WriteList>,
    /// `[[modbus-server.map]]`, in file order.
    pub maps: Vec<MapEntry>,
    /// `image.inputs`: coils that stand for inputs.
    pub inputs: Option<Mapping>,
    /// `image.outputs`: outputs that show as discrete inputs.
    pub outputs: Option<Mapping>,
    /// `connections`: how many at a time.
    pub connections: u32,
    /// `frame-timeout`, ms: a request that begins must be whole by then.
    pub frame_timeout_ms: i32,
    /// `idle-timeout`, ms: a connection without requests ends then.
    pub idle_timeout_ms: i32,
}

/// `[[modbus-server.write]]`.
#[derive(Clone, Debug)]
pub struct WriteList {
    /// The place of its header.
    pub span: Span,
    /// `ranges`: what may be written.
    pub ranges: Vec<Text>,
    /// `clients`: by whom.
    pub clients: Vec<Text>,
}

/// `[[modbus-server.map]]`.
#[derive(Clone, Debug)]
pub struct MapEntry {
    /// The place of its header.
    pub span: Span,
    /// `operand`.
    pub operand: Option<Text>,
    /// `table`.
    pub table: Option<Text>,
    /// `address`: the protocol address of the first element, from 0.
    pub address: Option<Located<i64>>,
    /// `type`: what a register's bits are as a number.
    pub kind: Option<Text>,
    /// `word-order`: which of two registers has the higher 16 bits.
    pub word_order: Option<Text>,
    /// `unit`: it is there for this unit identifier alone.
    pub unit: Option<Located<i64>>,
}

/// One range copied to another.
#[derive(Clone, Debug)]
pub struct Mapping {
    /// The place of the table.
    pub span: Span,
    /// `from`.
    pub from: Option<Text>,
    /// `to`.
    pub to: Option<Text>,
}

/// Unit identifiers are a byte.
const UNITS: (i64, i64) = (0, 255);

pub(in crate::controller) fn read(mut table: Table<'_>) -> ModbusServer {
    let time = |table: &mut Table<'_>, key, default| {
        table.duration(key).map_or(default, |duration| duration.value)
    };
    let mut server = ModbusServer {
        span: table.span(),
        listen: table.string("listen"),
        units: table.integers("units", UNITS),
        standard_map: table.boolean("standard-map").is_none_or(|flag| flag.value),
        writable: strings(&mut table, "writable"),
        writes: Vec::new(),
        maps: Vec::new(),
        inputs: None,
        outputs: None,
        connections: 8,
        frame_timeout_ms: time(&mut table, "frame-timeout", 2_000),
        idle_timeout_ms: time(&mut table, "idle-timeout", 60_000),
    };
    if let Some(connections) = table.integer("connections", (1, 1024)) {
        server.connections = u32::try_from(connections.value).unwrap_or(8);
    }
    let maps = table.tables("map", "an entry of the Modbus map");
    server.maps = maps.into_iter().map(read_entry).collect();
    let writes = table.tables("write", "a list of writes");
    server.writes = writes.into_iter().map(read_list).collect();
    if let Some(mut image) = table.table("image", "`[modbus-server.image]`") {
        server.inputs = image.table("inputs", "`inputs`").map(read_mapping);
        server.outputs = image.table("outputs", "`outputs`").map(read_mapping);
        image.finish();
    }
    table.finish();
    server
}

fn read_entry(mut table: Table<'_>) -> MapEntry {
    let span = table.span();
    let operand = table.required_string("operand");
    let kind_of_table = table.required_string("table");
    table.require("address", "4000");
    let entry = MapEntry {
        span,
        operand,
        table: kind_of_table,
        address: table.integer("address", (0, 65_535)),
        kind: table.string("type"),
        word_order: table.string("word-order"),
        unit: table.integer("unit", UNITS),
    };
    table.finish();
    entry
}

fn read_list(mut table: Table<'_>) -> WriteList {
    let span = table.span();
    table.require("ranges", "[\"MHR10..MHR19\"]");
    table.require("clients", "[\"192.168.1.0/24\"]");
    let ranges = not_empty(&mut table, "ranges");
    let clients = not_empty(&mut table, "clients");
    table.finish();
    WriteList { span, ranges, clients }
}

fn read_mapping(mut table: Table<'_>) -> Mapping {
    let span = table.span();
    let from = table.required_string("from");
    let to = table.required_string("to");
    table.finish();
    Mapping { span, from, to }
}

fn not_empty(table: &mut Table<'_>, key: &'static str) -> Vec<Text> {
    let Some(texts) = table.strings(key) else { return Vec::new() };
    if texts.value.is_empty() && !table.doc().has_finding_in(texts.span) {
        let message = format!("`{key}` names nothing");
        table.find(Finding::new(Code::Controller, texts.span, message));
    }
    texts.value
}

fn strings(table: &mut Table<'_>, key: &'static str) -> Vec<Text> {
    table.strings(key).map_or(Vec::new(), |texts| texts.value)
}
