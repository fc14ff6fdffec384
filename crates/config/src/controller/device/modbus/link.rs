//! The keys of a Modbus client for the way to its peer.
//!
//! Called by [`super::keys`]. The keys of a way that a device does not have are findings.

use std::ops::RangeInclusive;

use std::net::{IpAddr, SocketAddr};

use rungd_io::modbus_client::settings::{
    ConnectionUse, LinkSettings, Parity, PeerHabits, RtuLine, RtuPort, SerialSettings, TcpLink,
    TcpPeer, Transaction,
};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, Help, advise, possible, proposed};
use rungd_language::source::key::key;
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::span::{Located, Span};
use rungd_language::source::value_kind::{KeyWords, Millis, ParsedText};

/// The port of Modbus.
const PORT: u16 = 502;
/// What precedes the address of a serial server.
const SCHEME: &str = "tcp://";
const BAUDS: RangeInclusive<i64> = 50..=4_000_000;
const BAUD: u32 = 19_200;
const CONNECT_TIMEOUT_MS: u32 = 1000;
/// A duration of at least 1 ms.
pub(super) const SOME_TIME: Millis = Millis::some("20ms");

/// The medium to a peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Medium {
    /// `modbus-tcp`.
    Tcp,
    /// `modbus-rtu`.
    Serial,
}

const ADDRESS: ParsedText<SocketAddr> = ParsedText::new(|_, text| {
    let alone = || text.text.parse::<IpAddr>().map(|ip| SocketAddr::new(ip, PORT));
    let address = text.text.parse::<SocketAddr>().or_else(|_| alone());
    let addresses = ["192.168.1.20:502", "[fd00::20]:502"].map(possible);
    let help = advise("write it as `{}`, or `{}`; names are not looked up", addresses);
    with_port(address.ok(), text, help)
});

const PORT_OF_LINE: ParsedText<LinePort> = ParsedText::new(|_, text| {
    if let Some(address) = text.text.strip_prefix(SCHEME) {
        let server = [proposed("tcp://192.168.1.20:4001")];
        let help = advise("write it as `{}`; names are not looked up", server);
        return with_port(address.parse().ok(), text, help).map(LinePort::Server);
    }
    if text.text.starts_with('/') {
        return Ok(LinePort::Serial(text.text.clone()));
    }
    let message = format!("`{}` is no path of a serial line", text.text);
    let help = advise(
        "write it as `{}`, or as `/dev/serial/by-id/…`, which never changes; a serial server is \
         `{}`",
        ["/dev/ttyUSB0", "tcp://192.168.1.20:4001"].map(possible),
    );
    Err(Finding::new(Code::Controller, text.span, message).help(help))
});

fn with_port(address: Option<SocketAddr>, text: &Text, help: Help) -> Result<SocketAddr, Finding> {
    address.filter(|address| address.port() != 0).ok_or_else(|| {
        let message = format!("`{}` is no IP address with a port", text.text);
        Finding::new(Code::Controller, text.span, message).help(help)
    })
}

/// `port` of a line.
#[derive(Clone, Debug)]
enum LinePort {
    Serial(String),
    Server(SocketAddr),
}

/// The keys of a connection, by either driver.
struct ConnectionKeys {
    timeout_ms: Option<Located<u32>>,
    connection: Option<Located<ConnectionUse>>,
}

/// The keys of a line.
struct LineKeys {
    port: Option<LinePort>,
    baud: Option<Located<u32>>,
    parity: Option<Located<Parity>>,
    stop_bits: Option<Located<u8>>,
    echo: bool,
}

/// The way to the peer, and the pause after a broadcast. `None` after a finding, or if there is no
/// medium: then the keys of both media are read.
pub(super) fn read(table: &mut Table<'_>, medium: Option<Medium>) -> (Option<LinkSettings>, u32) {
    let (is_tcp, is_line) = (medium != Some(Medium::Serial), medium != Some(Medium::Tcp));
    match medium {
        Some(Medium::Tcp) => table.require("address", "\"192.168.1.20:502\""),
        Some(Medium::Serial) => table.require("port", "\"/dev/ttyUSB0\""),
        None => {}
    }
    let tcp = is_tcp.then(|| read_tcp(table));
    let line = is_line.then(|| read_line(table));
    let delay_ms = line.as_ref().and_then(|(_, delay_ms)| *delay_ms);
    let keys = read_connection(table);
    let link = match (medium, tcp, line) {
        (Some(Medium::Tcp), Some((address, transaction)), _) => address
            .map(|address| LinkSettings::Tcp(TcpLink { peer: keys.peer(address), transaction })),
        (Some(Medium::Serial), _, Some((line, _))) => line.link(table, &keys),
        (Some(Medium::Tcp | Medium::Serial) | None, ..) => None,
    };
    (link, delay_ms.unwrap_or(PeerHabits::BROADCAST_DELAY_MS))
}

fn read_tcp(table: &mut Table<'_>) -> (Option<SocketAddr>, Transaction) {
    let explained =
        key("address", "`modbus-tcp`: the peer's IP address and port; port 502 if not given.");
    let address = table.value_of(explained, &ADDRESS);
    let explained = key("transaction", "`modbus-tcp`: `ignore` for wrong transactions in answers.");
    let transaction = table.value_of(explained, &KeyWords::new(&Transaction::NAMES));
    (address, transaction.unwrap_or_default())
}

fn read_line(table: &mut Table<'_>) -> (LineKeys, Option<u32>) {
    let explained =
        key("port", "`modbus-rtu`: its serial line's character device, or `tcp://ADDRESS:PORT`.");
    let port = table.value_of(explained, &PORT_OF_LINE);
    let explained = key("baud", "`modbus-rtu`: bits a second; 19200 if not given.");
    let baud = table.whole(explained, BAUDS);
    let explained = key("parity", "`modbus-rtu`: its parity bit; `even` if not given.");
    let parity = table.value(explained, &KeyWords::new(&Parity::NAMES));
    let explained = key("stop-bits", "`modbus-rtu`: stop bits; 1 if not given, 2 without parity.");
    let stop_bits = table.whole(explained, 1..=2);
    let explained =
        key("echo", "`modbus-rtu`: its adapter sends requests back; false if not given.");
    let echo = table.flag(explained, false);
    let explained = key(
        "broadcast-delay",
        "`modbus-rtu`: the pause after a write to unit 0, which is all units; 100ms if not given.",
    );
    let broadcast_delay_ms = table.value_of(explained, &Millis::at_most_s(10));
    (LineKeys { port, baud, parity, stop_bits, echo }, broadcast_delay_ms)
}

fn read_connection(table: &mut Table<'_>) -> ConnectionKeys {
    let explained =
        key("connect-timeout", "By TCP: the time limit for connecting; 1s if not given.");
    let timeout_ms = table.value(explained, &SOME_TIME);
    let explained =
        key("connection", "By TCP: `per-request` opens a new connection for each request.");
    let connection = table.value(explained, &KeyWords::new(&ConnectionUse::NAMES));
    ConnectionKeys { timeout_ms, connection }
}

impl ConnectionKeys {
    fn peer(&self, address: SocketAddr) -> TcpPeer {
        TcpPeer {
            address,
            connect_timeout_ms: self.timeout_ms.as_ref().map_or(CONNECT_TIMEOUT_MS, |ms| ms.value),
            connection: self
                .connection
                .as_ref()
                .map_or_else(Default::default, |connection| connection.value),
        }
    }
}

impl LineKeys {
    fn link(self, table: &Table<'_>, connection: &ConnectionKeys) -> Option<LinkSettings> {
        let port = match &self.port {
            Some(LinePort::Server(address)) => {
                let of_line = [
                    ("baud", self.baud.as_ref().map(|baud| baud.span)),
                    ("parity", self.parity.as_ref().map(|parity| parity.span)),
                    ("stop-bits", self.stop_bits.as_ref().map(|bits| bits.span)),
                ];
                let help = "set it at the serial server, and take it out here";
                refuse(table, &of_line, "is the serial server's, which `port` names", help);
                RtuPort::Tcp(connection.peer(*address))
            }
            Some(LinePort::Serial(path)) => {
                let of_connection = [
                    ("connect-timeout", connection.timeout_ms.as_ref().map(|ms| ms.span)),
                    (
                        "connection",
                        connection.connection.as_ref().map(|connection| connection.span),
                    ),
                ];
                let help = "it goes with `port = \"tcp://192.168.1.20:4001\"`: take it out here";
                let reason = "is of a connection, and a serial line has none";
                refuse(table, &of_connection, reason, help);
                RtuPort::Serial(self.serial(path.clone()))
            }
            None => return None,
        };
        Some(LinkSettings::Rtu(RtuLine { port, echo: self.echo }))
    }

    fn serial(&self, path: String) -> SerialSettings {
        let parity = self.parity.as_ref().map_or(Parity::Even, |parity| parity.value);
        // The specification requires eleven bits per character.
        let usual = if parity == Parity::None { 2 } else { 1 };
        SerialSettings {
            path,
            baud: self.baud.as_ref().map_or(BAUD, |baud| baud.value),
            parity,
            stop_bits: self.stop_bits.as_ref().map_or(usual, |bits| bits.value),
        }
    }
}

/// A finding for each of these keys that is given.
fn refuse(table: &Table<'_>, keys: &[(&str, Option<Span>)], reason: &str, help: &'static str) {
    for (name, place) in keys {
        let Some(span) = *place else { continue };
        let finding = Finding::new(Code::Controller, span, format!("`{name}` {reason}"));
        table.find(finding.help(help).fix(FixEdit::Delete));
    }
}
