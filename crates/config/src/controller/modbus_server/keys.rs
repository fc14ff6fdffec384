//! `[modbus-server]` of a controller file, as its author wrote it.
//!
//! Called by `written`. Operands and clients are still texts here: the resolver checks them,
//! because it has the program's names. All other values are settings.

use std::ops::RangeInclusive;

use std::net::SocketAddr;

use rungd_io::modbus::number::{RegisterNumberType, WordOrder};
use rungd_io::modbus::settings::{ModbusServerSettings, ModbusTable};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, advise, pair, possible, propose};
use rungd_language::source::key::{NOT_EMPTY, key};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::slot::Slot;
use rungd_language::source::span::{Located, Span};
use rungd_language::source::value_kind::{KeyWords, Millis, ParsedText, WrongWord};

/// `[modbus-server]`.
#[derive(Clone, Debug)]
pub struct WrittenModbusServer {
    /// The place of its header.
    pub span: Span,
    /// The keys that contain no names of the program.
    pub settings: ModbusServerSettings,
    /// The place of `units`.
    pub units_at: Span,
    /// `writable`: the ranges that every client may write.
    pub writable: Vec<Text>,
    /// `[[modbus-server.write]]`: the ranges that certain clients may write.
    pub writes: Vec<WrittenWriteList>,
    /// `[[modbus-server.map]]`, in file order.
    pub maps: Vec<WrittenMapEntry>,
    /// `image.inputs`: coils that are copied to inputs.
    pub inputs: Option<Mapping>,
    /// `image.outputs`: outputs that are copied to discrete inputs.
    pub outputs: Option<Mapping>,
}

/// `[[modbus-server.write]]`.
#[derive(Clone, Debug)]
pub struct WrittenWriteList {
    /// `ranges`: the ranges that may be written.
    pub ranges: Vec<Text>,
    /// `clients`: the addresses of the clients that may write them.
    pub clients: Vec<Text>,
}

/// `[[modbus-server.map]]`.
#[derive(Clone, Debug)]
pub struct WrittenMapEntry {
    /// The place of its header.
    pub span: Span,
    /// `operand`.
    pub operand: Option<Text>,
    /// `table`.
    pub table: Option<ModbusTable>,
    /// `address`: the protocol address of the first element, from 0.
    pub address: Option<Located<u16>>,
    /// `type`: the number type of its registers.
    pub kind: Option<Located<RegisterNumberType>>,
    /// `word-order`: the register of a pair that has the higher 16 bits.
    pub word_order: Option<Located<WordOrder>>,
    /// `unit`: only this unit identifier shows it.
    pub unit: Option<Located<u8>>,
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
const UNITS: RangeInclusive<i64> = 0..=255;

const LISTEN: ParsedText<SocketAddr> = ParsedText::new(|_, listen| {
    listen.text.parse().map_err(|_| {
        let message = format!("`{}` is no address to listen at", listen.text);
        let finding = Finding::new(Code::Controller, listen.span, message);
        let addresses = ["127.0.0.1:1502", "[::]:502"].map(possible);
        finding.help(advise("write an IP address and a port: `{}`, `{}`", addresses))
    })
});
const TABLE: KeyWords<ModbusTable> = KeyWords::new(&ModbusTable::NAMES).refused_as(WrongWord::No(
    "table",
    "`coil` or `discrete` of bits, `holding` or `input` of words",
));
pub(super) const NUMBER_TYPE: KeyWords<RegisterNumberType> =
    KeyWords::new(RegisterNumberType::NARROW)
        .refused_as(WrongWord::No("type", "`u16`, `i16`, `u32`, `i32` or `f32`"));
const WORD_ORDER: KeyWords<WordOrder> = KeyWords::new(&WordOrder::NAMES)
    .refused_as(WrongWord::No("word order", "`high-first` or `low-first`"));
/// The time limit of a client.
const TIMEOUT: Millis = Millis::some("10ms");

/// Reads `[modbus-server]`, if there is one.
pub(in crate::controller) fn read_in(root: &mut Table<'_>) -> Option<WrittenModbusServer> {
    let explained = key("modbus-server", "A Modbus TCP server; without this table there is none.");
    root.table(explained, "`[modbus-server]`").map(read)
}

fn read(mut table: Table<'_>) -> WrittenModbusServer {
    let mut settings = ModbusServerSettings::default();
    let explained = key("listen", "Address and port; 127.0.0.1:1502 if not given.");
    settings.listen = table.value_of(explained, &LISTEN).unwrap_or(settings.listen);
    let units = read_units(&mut table);
    let explained =
        key("standard-map", "MC, MI, MHR and MIR have their standard places; true if not given.");
    settings.standard_map = table.flag(explained, settings.standard_map);
    let writable = table.texts(
        key("writable", "The ranges that every client may write; none if not given.")
            .holds(Slot::Operand),
    );
    let explained =
        key("frame-timeout", "The time limit for a whole request, from its first byte.");
    let frame_timeout_ms = table.value_of(explained, &TIMEOUT);
    settings.frame_timeout_ms = frame_timeout_ms.unwrap_or(settings.frame_timeout_ms);
    let explained = key("idle-timeout", "A connection without requests ends after this time.");
    let idle_timeout_ms = table.value_of(explained, &TIMEOUT);
    settings.idle_timeout_ms = idle_timeout_ms.unwrap_or(settings.idle_timeout_ms);
    let explained = key("connections", "The most connections at a time; 8 if not given.");
    let connections = table.whole(explained, 1..=1024);
    settings.connections = connections.map_or(settings.connections, |most| most.value);
    let maps = table
        .tables(key("map", "Further places for any bits and words."), "an entry of the Modbus map");
    let maps = maps.into_iter().map(read_entry).collect();
    let writes = table
        .tables(key("write", "The ranges that certain clients may write."), "a list of writes");
    let writes = writes.into_iter().map(read_list).collect();
    let [inputs, outputs] = read_image(&mut table);
    let (span, units_at) = (table.span(), units.as_ref().map_or(table.span(), |units| units.span));
    settings.units = units.map(|units| units.value);
    table.finish();
    WrittenModbusServer { span, settings, units_at, writable, writes, maps, inputs, outputs }
}

fn read_units(table: &mut Table<'_>) -> Option<Located<Vec<u8>>> {
    let explained = key("units", "The unit identifiers that are answered; all if not given.");
    let Located { value, span } = table.integers(explained.limited(NOT_EMPTY), UNITS)?;
    if value.is_empty() && !table.doc().has_finding_in(span) {
        let finding = Finding::new(Code::Controller, span, "no unit is answered");
        let help = propose(pair("units = [1]")).and(", or take the key out");
        table.find(finding.help(help).fix(FixEdit::Delete));
    }
    let units = value.into_iter().filter_map(|unit| u8::try_from(unit).ok()).collect();
    Some(Located { value: units, span })
}

fn read_image(table: &mut Table<'_>) -> [Option<Mapping>; 2] {
    let explained = key("image", "Inputs and outputs that clients see.");
    let Some(mut image) = table.table(explained, "`[modbus-server.image]`") else {
        return [None, None];
    };
    let inputs = image.table(key("inputs", "Coils copied to inputs."), "`inputs`");
    let outputs = image.table(key("outputs", "Outputs copied to discrete inputs."), "`outputs`");
    image.finish();
    [
        inputs.map(|table| {
            read_mapping(table, ["A range of MC.", "A range of X of the same length."])
        }),
        outputs.map(|table| {
            read_mapping(table, ["A range of Y.", "A range of MI of the same length."])
        }),
    ]
}

fn read_entry(mut table: Table<'_>) -> WrittenMapEntry {
    let span = table.span();
    let operand = table.required_string(
        key("operand", "A bit or word, or a range of them: `CT0.Acc`, `X0..X15`, a tag.")
            .holds(Slot::Operand),
    );
    table.require("table", "\"…\"");
    let kind_of_table = table.value_of(
        key("table", "For bits `coil` or `discrete`, for words `holding` or `input`."),
        &TABLE,
    );
    table.require("address", "4000");
    let address = table.whole(
        key("address", "The protocol address of the first element, counted from 0."),
        0..=65_535,
    );
    let explained = key(
        "type",
        "For words: 16 bits are one register, 32 are two; the type that fits if not given.",
    );
    let kind = table.value(explained, &NUMBER_TYPE);
    let explained =
        key("word-order", "For 32 bits: the half that comes first; `high-first` if not given.");
    let word_order = table.value(explained, &WORD_ORDER);
    let unit = table.whole(key("unit", "Only this unit identifier shows it."), UNITS);
    table.finish();
    WrittenMapEntry { span, operand, table: kind_of_table, address, kind, word_order, unit }
}

fn read_list(mut table: Table<'_>) -> WrittenWriteList {
    table.require("ranges", "[\"MHR10..MHR19\"]");
    table.require("clients", "[\"192.168.1.0/24\"]");
    let nothing = |name: &'static str| {
        move |span| {
            let message = format!("`{name}` names nothing");
            Finding::new(Code::Controller, span, message).fix(possible(FixEdit::Delete))
        }
    };
    let explained = key("ranges", "The ranges that they may write.").holds(Slot::Operand);
    let ranges = table.some_texts(explained, nothing(explained.name));
    let explained = key("clients", "The clients: `10.0.0.5`, `192.168.1.0/24`, `fd00::/8`.");
    let clients = table.some_texts(explained, nothing(explained.name));
    table.finish();
    WrittenWriteList { ranges, clients }
}

fn read_mapping(mut table: Table<'_>, [from, to]: [&'static str; 2]) -> Mapping {
    let span = table.span();
    let from = table.required_string(key("from", from).holds(Slot::Operand));
    let to = table.required_string(key("to", to).holds(Slot::Operand));
    table.finish();
    Mapping { span, from, to }
}
