//! The keys of a Modbus client for the way to its peer, and for the peer's habits.

use std::net::{IpAddr, SocketAddr};

use super::super::driver::{WrittenDevice, at_least_one, one_word};
use super::keys::{Keys, Medium};
use rungd_io::modbus_client::settings::{
    ConnectionUse, Habits, Link, Parity, RtuLine, RtuPort, Serial, TcpLink, TcpPeer, Transaction,
};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::reader::Text;
use rungd_language::source::span::{Located, Span};

/// The port of Modbus.
const PORT: u16 = 502;
/// What precedes the address of a serial server.
const SCHEME: &str = "tcp://";
/// The longest `connect-delay`, ms.
const CONNECT_DELAY_MAX_MS: i32 = 60_000;
/// The longest `pause` and `broadcast-delay`, ms.
const PAUSE_MAX_MS: i32 = 10_000;

/// The reader of one device's keys for its link.
pub(super) struct LinkReader<'a> {
    pub keys: &'a Keys,
    pub device: &'a WrittenDevice,
    pub findings: &'a mut Vec<Finding>,
}

impl LinkReader<'_> {
    /// The way to the peer.
    pub fn link(&mut self) -> Option<Link> {
        match self.keys.medium? {
            Medium::Tcp => self.tcp(),
            Medium::Serial => self.line(),
        }
    }

    /// The habits of the peer.
    pub fn habits(&mut self) -> Habits {
        let keys = self.keys;
        let usual = Habits::default();
        let connect_delay = ("connect-delay", keys.connect_delay_ms.as_ref(), CONNECT_DELAY_MAX_MS);
        let pause = ("pause", keys.pause_ms.as_ref(), PAUSE_MAX_MS);
        let broadcast = ("broadcast-delay", keys.broadcast_delay_ms.as_ref(), PAUSE_MAX_MS);
        let habits = Habits {
            connect_delay_ms: self.at_most(connect_delay).unwrap_or(usual.connect_delay_ms),
            pause_ms: self.at_most(pause).unwrap_or(usual.pause_ms),
            broadcast_delay_ms: self.at_most(broadcast).unwrap_or(usual.broadcast_delay_ms),
            registers_max: keys.max_registers.as_ref().map_or(usual.registers_max, most),
            bits_max: keys.max_bits.as_ref().map_or(usual.bits_max, most),
        };
        self.pause_in_time(habits.pause_ms);
        habits
    }

    /// A duration in ms, with a finding if it is too long.
    fn at_most(&mut self, (key, ms, most_ms): (&str, Option<&Located<i32>>, i32)) -> Option<u32> {
        let ms = ms?;
        if ms.value > most_ms {
            let seconds = most_ms / 1000;
            let message = format!("`{key}` is at most {seconds}s");
            let finding = Finding::new(Code::OutOfRange, ms.span, message);
            self.findings.push(finding.help(format!("write `{key} = \"{seconds}s\"`, or less")));
        }
        Some(ms.value.clamp(0, most_ms).unsigned_abs())
    }

    /// A finding for a pause in which the device would be lost.
    fn pause_in_time(&mut self, pause_ms: u32) {
        let Some(pause) = &self.keys.pause_ms else { return };
        let poll_ms = self.device.poll_ms.as_ref().map_or(20, |ms| ms.value.unsigned_abs());
        let usual = poll_ms.saturating_mul(3).max(1000);
        let loss_after = self.device.loss_after_ms.as_ref();
        let loss_after_ms = loss_after.map_or(usual, |ms| ms.value.unsigned_abs());
        if pause_ms >= loss_after_ms {
            let message = format!("the device is lost after {loss_after_ms} ms, in one `pause`");
            let finding = Finding::new(Code::Controller, pause.span, message);
            let help = format!(
                "write `loss-after = \"{}ms\"`, or more: an exchange has a pause for each of its \
                 requests",
                u64::from(pause_ms) * 3
            );
            self.findings.push(finding.help(help));
        }
    }

    fn tcp(&mut self) -> Option<Link> {
        let keys = self.keys;
        let (connect_timeout_ms, connection) = self.connection();
        let transaction =
            one_word("transaction", keys.transaction.as_ref(), &Transaction::NAMES, self.findings);
        let Some(text) = &keys.address else { return self.missing("address", "192.168.1.20:502") };
        let alone = || text.text.parse::<IpAddr>().map(|ip| SocketAddr::new(ip, PORT));
        let address = text.text.parse::<SocketAddr>().or_else(|_| alone()).ok();
        let Some(address) = address.filter(|address| address.port() != 0) else {
            let message = format!("`{}` is no IP address with a port", text.text);
            let help =
                "write it as `192.168.1.20:502`, or `[fd00::20]:502`; names are not looked up";
            return self.refuse(text.span, message, help);
        };
        let peer = TcpPeer { address, connect_timeout_ms, connection };
        Some(Link::Tcp(TcpLink { peer, transaction: transaction.unwrap_or_default() }))
    }

    /// The keys of a connection, by either driver.
    fn connection(&mut self) -> (u32, ConnectionUse) {
        let keys = self.keys;
        let timeout = keys.connect_timeout_ms.as_ref();
        let timeout_ms = at_least_one("connect-timeout", timeout, 1000, self.findings);
        let connection =
            one_word("connection", keys.connection.as_ref(), &ConnectionUse::NAMES, self.findings);
        (timeout_ms, connection.unwrap_or_default())
    }

    fn line(&mut self) -> Option<Link> {
        let keys = self.keys;
        let Some(port) = &keys.port else { return self.missing("port", "/dev/ttyUSB0") };
        let port = match port.text.strip_prefix(SCHEME) {
            Some(address) => RtuPort::Tcp(self.serial_server(port, address)?),
            None => RtuPort::Serial(self.serial(port)?),
        };
        let echo = keys.echo.as_ref().is_some_and(|echo| echo.value);
        Some(Link::Rtu(RtuLine { port, echo }))
    }

    fn serial_server(&mut self, port: &Text, address: &str) -> Option<TcpPeer> {
        let keys = self.keys;
        let (connect_timeout_ms, connection) = self.connection();
        let of_lines = [
            ("baud", keys.baud.as_ref().map(|baud| baud.span)),
            ("parity", keys.parity.as_ref().map(|parity| parity.span)),
            ("stop-bits", keys.stop_bits.as_ref().map(|bits| bits.span)),
        ];
        let help = "set it at the serial server, and take it out here";
        self.misplaced(of_lines, "is the serial server's, which `port` names", help);
        let address = address.parse::<SocketAddr>().ok().filter(|address| address.port() != 0);
        let Some(address) = address else {
            let message = format!("`{}` is no IP address with a port", port.text);
            let help = "write it as `tcp://192.168.1.20:4001`; names are not looked up";
            return self.refuse(port.span, message, help);
        };
        Some(TcpPeer { address, connect_timeout_ms, connection })
    }

    fn serial(&mut self, port: &Text) -> Option<Serial> {
        let keys = self.keys;
        let of_connections = [
            ("connect-timeout", keys.connect_timeout_ms.as_ref().map(|ms| ms.span)),
            ("connection", keys.connection.as_ref().map(|text| text.span)),
        ];
        let help = "it goes with `port = \"tcp://192.168.1.20:4001\"`: take it out here";
        self.misplaced(of_connections, "is of a connection, and a serial line has none", help);
        let baud = keys.baud.as_ref().map_or(19_200, |baud| baud.value as u32);
        let parity = one_word("parity", keys.parity.as_ref(), &Parity::NAMES, self.findings)
            .unwrap_or(Parity::Even);
        // The specification requires eleven bits per character.
        let usual = if parity == Parity::None { 2 } else { 1 };
        let stop_bits = keys.stop_bits.as_ref().map_or(usual, |bits| bits.value as u8);
        if !port.text.starts_with('/') {
            let message = format!("`{}` is no path of a serial line", port.text);
            let help = "write it as `/dev/ttyUSB0`, or as `/dev/serial/by-id/…`, which never \
                        changes; a serial server is `tcp://192.168.1.20:4001`";
            return self.refuse(port.span, message, help);
        }
        Some(Serial { path: port.text.clone(), baud, parity, stop_bits })
    }

    /// A finding for each of these keys that is given.
    fn misplaced<const N: usize>(
        &mut self,
        keys: [(&str, Option<Span>); N],
        reason: &str,
        help: &str,
    ) {
        for (name, place) in keys {
            let Some(span) = place else { continue };
            let finding = Finding::new(Code::Controller, span, format!("`{name}` {reason}"));
            self.findings.push(finding.help(help.to_owned()));
        }
    }

    fn missing<T>(&mut self, key: &str, example: &str) -> Option<T> {
        let message = format!("a device has no `{key}`");
        let help = format!("give it one: `{key} = \"{example}\"`");
        let finding = Finding::new(Code::MissingKey, self.device.span, message);
        self.findings.push(finding.help(help));
        None
    }

    fn refuse<T>(&mut self, span: Span, message: String, help: &'static str) -> Option<T> {
        self.findings.push(Finding::new(Code::Controller, span, message).help(help));
        None
    }
}

/// A limit that the reader of the key has checked.
fn most(limit: &Located<i64>) -> u16 {
    limit.value as u16
}
