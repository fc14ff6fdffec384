//! `[modbus-server]` of a controller file, as its author wrote it.
//!
//! Called by `written`. Operands, clients and the words of a map entry are still texts here: the
//! resolver checks them, because it has the program's names.

use rungd_io::modbus::number::{NumberType, WordOrder};
use rungd_io::modbus::settings::Table as ModbusTable;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::key::{Key, NOT_EMPTY, key, words};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::span::{Located, Span};

/// `[modbus-server]`.
#[derive(Clone, Debug)]
pub struct ModbusServer {
    /// The place of its header.
    pub span: Span,
    /// `listen`, if it is given.
    pub listen: Option<Text>,
    /// `units`: the unit identifiers that are answered; all if not given.
    pub units: Option<Located<Vec<i64>>>,
    /// `standard-map`: whether MC, MI, MHR and MIR have their standard places.
    pub standard_map: bool,
    /// `writable`: the ranges that every client may write.
    pub writable: Vec<Text>,
    /// `[[modbus-server.write]]`: the ranges that certain clients may write.
    pub writes: Vec<WriteList>,
    /// `[[modbus-server.map]]`, in file order.
    pub maps: Vec<MapEntry>,
    /// `image.inputs`: coils that are copied to inputs.
    pub inputs: Option<Mapping>,
    /// `image.outputs`: outputs that are copied to discrete inputs.
    pub outputs: Option<Mapping>,
    /// `connections`: the most connections at a time.
    pub connections: u32,
    /// `frame-timeout`, ms: the time limit for a whole request, from its first byte.
    pub frame_timeout_ms: i32,
    /// `idle-timeout`, ms: a connection without requests ends after this time.
    pub idle_timeout_ms: i32,
}

/// `[[modbus-server.write]]`.
#[derive(Clone, Debug)]
pub struct WriteList {
    /// `ranges`: the ranges that may be written.
    pub ranges: Vec<Text>,
    /// `clients`: the addresses of the clients that may write them.
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
    /// `type`: the number type of its registers.
    pub kind: Option<Text>,
    /// `word-order`: the register of a pair that has the higher 16 bits.
    pub word_order: Option<Text>,
    /// `unit`: only this unit identifier shows it.
    pub unit: Option<Located<i64>>,
}

/// A range, and the range that it is copied to.
#[derive(Clone, Debug)]
pub struct Mapping {
    /// The place of the table.
    pub span: Span,
    /// `from`.
    pub from: Option<Text>,
    /// `to`.
    pub to: Option<Text>,
}

/// A unit identifier is one byte.
const UNITS: (i64, i64) = (0, 255);

/// Reads `[modbus-server]`, if there is one.
pub(in crate::controller) fn read_in(root: &mut Table<'_>) -> Option<ModbusServer> {
    let explained = key("modbus-server", "A Modbus TCP server; without this table there is none.");
    root.table(explained, "`[modbus-server]`").map(read)
}

fn read(mut table: Table<'_>) -> ModbusServer {
    let time = |table: &mut Table<'_>, key: Key, default| {
        table.duration(key).map_or(default, |duration| duration.value)
    };
    let mut server = ModbusServer {
        span: table.span(),
        listen: table.string(key("listen", "Address and port; 127.0.0.1:1502 if not given.")),
        units: table.integers(
            key("units", "The unit identifiers that are answered; all if not given."),
            UNITS,
        ),
        standard_map: table
            .boolean(key(
                "standard-map",
                "MC, MI, MHR and MIR have their standard places; true if not given.",
            ))
            .is_none_or(|flag| flag.value),
        writable: strings(
            &mut table,
            key("writable", "The ranges that every client may write; none if not given."),
        ),
        writes: Vec::new(),
        maps: Vec::new(),
        inputs: None,
        outputs: None,
        connections: 8,
        frame_timeout_ms: time(
            &mut table,
            key("frame-timeout", "The time limit for a whole request, from its first byte."),
            2_000,
        ),
        idle_timeout_ms: time(
            &mut table,
            key("idle-timeout", "A connection without requests ends after this time."),
            60_000,
        ),
    };
    if let Some(connections) = table
        .integer(key("connections", "The most connections at a time; 8 if not given."), (1, 1024))
    {
        server.connections = u32::try_from(connections.value).unwrap_or(8);
    }
    let maps = table
        .tables(key("map", "Further places for any bits and words."), "an entry of the Modbus map");
    server.maps = maps.into_iter().map(read_entry).collect();
    let writes = table
        .tables(key("write", "The ranges that certain clients may write."), "a list of writes");
    server.writes = writes.into_iter().map(read_list).collect();
    if let Some(mut image) =
        table.table(key("image", "Inputs and outputs that clients see."), "`[modbus-server.image]`")
    {
        server.inputs =
            image.table(key("inputs", "Coils copied to inputs."), "`inputs`").map(|table| {
                read_mapping(table, ["A range of MC.", "A range of X of the same length."])
            });
        server.outputs =
            image.table(key("outputs", "Outputs copied to discrete inputs."), "`outputs`").map(
                |table| read_mapping(table, ["A range of Y.", "A range of MI of the same length."]),
            );
        image.finish();
    }
    table.finish();
    server
}

fn read_entry(mut table: Table<'_>) -> MapEntry {
    let span = table.span();
    let operand = table.required_string(key(
        "operand",
        "A bit or word, or a range of them: `CT0.Acc`, `X0..X15`, a tag.",
    ));
    let kind_of_table = table.required_string(
        key("table", "For bits `coil` or `discrete`, for words `holding` or `input`.")
            .one_of(|| ModbusTable::ALL.map(ModbusTable::name).to_vec()),
    );
    table.require("address", "4000");
    let entry = MapEntry {
        span,
        operand,
        table: kind_of_table,
        address: table.integer(
            key("address", "The protocol address of the first element, counted from 0."),
            (0, 65_535),
        ),
        kind: table.string(
            key(
                "type",
                "For words: 16 bits are one register, 32 are two; the type that fits if not given.",
            )
            .one_of(|| words(NumberType::NARROW)),
        ),
        word_order: table.string(
            key("word-order", "For 32 bits: the half that comes first; `high-first` if not given.")
                .one_of(|| words(&WordOrder::NAMES)),
        ),
        unit: table.integer(key("unit", "Only this unit identifier shows it."), UNITS),
    };
    table.finish();
    entry
}

fn read_list(mut table: Table<'_>) -> WriteList {
    table.require("ranges", "[\"MHR10..MHR19\"]");
    table.require("clients", "[\"192.168.1.0/24\"]");
    let ranges =
        not_empty(&mut table, key("ranges", "The ranges that they may write.").limited(NOT_EMPTY));
    let clients = not_empty(
        &mut table,
        key("clients", "The clients: `10.0.0.5`, `192.168.1.0/24`, `fd00::/8`.").limited(NOT_EMPTY),
    );
    table.finish();
    WriteList { ranges, clients }
}

fn read_mapping(mut table: Table<'_>, [from, to]: [&'static str; 2]) -> Mapping {
    let span = table.span();
    let from = table.required_string(key("from", from));
    let to = table.required_string(key("to", to));
    table.finish();
    Mapping { span, from, to }
}

fn not_empty(table: &mut Table<'_>, key: Key) -> Vec<Text> {
    let Some(texts) = table.strings(key) else { return Vec::new() };
    if texts.value.is_empty() && !table.doc().has_finding_in(texts.span) {
        let message = format!("`{}` names nothing", key.name);
        table.find(Finding::new(Code::Controller, texts.span, message));
    }
    texts.value
}

fn strings(table: &mut Table<'_>, key: Key) -> Vec<Text> {
    table.strings(key).map_or(Vec::new(), |texts| texts.value)
}
