//! The link over a serial line: Modbus RTU, one question at a time, with a silence before each.
//!
//! Several devices may be on one line: they share it ([`SerialLines`]), question by question. Bytes
//! that arrive between two questions are discarded before the next question. So a late or wrong
//! answer does not disturb the next one, and the port stays open. A port that fails (an unplugged
//! adapter) is closed at once; the next device that connects opens it again. Echoes of adapters
//! that send requests back are distinguished from answers: see [`Echo`]. This module does not
//! switch a transceiver's direction; adapters and their kernel drivers do so.

use std::collections::HashMap;
use std::io::{self, ErrorKind};
use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::time::Duration;

use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::termios::{
    ControlModes, InputModes, OptionalActions, QueueSelector, SpecialCodeIndex, tcflush, tcgetattr,
    tcsetattr,
};
use tokio::io::unix::AsyncFd;
use tokio::sync::Mutex;
use tokio::time::{Instant, sleep_until, timeout_at};

use super::answer::expected_bytes;
use super::link::{Link, LinkFailure};
use super::rtu::{self, FRAME_BYTES_MAX, Heard};
use super::settings::{Parity, Serial};
use crate::io::device::Trouble;

/// The most bytes received for a question: a request sent back and an answer. More bytes than that
/// are noise.
const RECEIVED_MAX: usize = 2 * FRAME_BYTES_MAX;

/// The shortest silence between frames at any speed, according to the specification.
const SILENCE_MIN: Duration = Duration::from_micros(1750);

/// All lines by port, so that the devices on a line share it.
#[derive(Default)]
pub struct SerialLines {
    by_port: HashMap<String, Arc<Mutex<SerialLine>>>,
}

/// A device's link over its line.
pub struct Rtu {
    line: Arc<Mutex<SerialLine>>,
    timeout: Duration,
}

/// A line, with its port while that is open.
struct SerialLine {
    settings: Serial,
    port: Option<AsyncFd<OwnedFd>>,
    /// The time of the last byte received or sent.
    quiet_since: Instant,
    frame: Vec<u8>,
    received: Vec<u8>,
    echo: Echo,
}

/// Whether the line sends requests back. If that is not known, the answer to a write of one coil or
/// register may be an echo. It counts as an answer until a read has shown an echo. A read can show
/// one because its answer never equals its request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Echo {
    /// According to the settings, each request comes back before its answer.
    Wanted,
    /// A read has shown an echo, against the settings: no answer can be trusted.
    Seen,
    /// No echo has been seen.
    Unseen,
}

impl SerialLines {
    /// A link over this line, for a device whose answers are complete within `timeout`.
    pub fn link(&mut self, settings: &Serial, timeout: Duration) -> Rtu {
        let new = || Arc::new(Mutex::new(SerialLine::new(settings.clone())));
        let line = self.by_port.entry(settings.port.clone()).or_insert_with(new);
        Rtu { line: Arc::clone(line), timeout }
    }
}

impl Echo {
    fn hear<'a>(self, received: &'a [u8], frame: &[u8], is_late: bool) -> Heard<'a> {
        match self {
            Echo::Wanted => rtu::behind_echo(received, frame),
            Echo::Seen | Echo::Unseen => rtu::hear(received, frame, is_late),
        }
    }

    /// The new state after a request.
    fn after(self, request: &[u8], heard: Heard<'_>) -> Echo {
        match (self, heard) {
            (Echo::Wanted, _) => Echo::Wanted,
            (_, Heard::Echo) => Echo::Seen,
            (_, Heard::Answer(_)) if !rtu::is_answered_by_itself(request) => Echo::Unseen,
            (Echo::Seen | Echo::Unseen, Heard::Answer(_) | Heard::Nothing) => self,
        }
    }
}

impl Link for Rtu {
    const STARTS_ANEW: bool = true;

    async fn connect(&mut self) -> Result<(), Trouble> {
        let mut line = self.line.lock().await;
        if line.port.is_none() {
            let port = open_port(&line.settings);
            line.port = Some(
                port.map_err(|error| Trouble::disconnected(format!("cannot open it: {error}")))?,
            );
        }
        Ok(())
    }

    async fn ask(
        &mut self,
        unit: u8,
        request: &[u8],
        answer: &mut Vec<u8>,
    ) -> Result<(), LinkFailure> {
        let mut line = self.line.lock().await;
        let asked = line.ask(unit, request, self.timeout).await;
        line.quiet_since = Instant::now();
        match asked {
            Ok(Some(pdu)) => {
                answer.clear();
                answer.extend_from_slice(&pdu);
                Ok(())
            }
            Ok(None) if line.echo == Echo::Seen && !line.received.is_empty() => {
                let failure = match rtu::is_answered_by_itself(request) {
                    true => LinkFailure::Doubtful,
                    false => LinkFailure::Silent,
                };
                Err(failure(ECHO_SEEN.to_owned()))
            }
            Ok(None) => Err(LinkFailure::Silent(line.why_none(self.timeout))),
            Err(error) => {
                line.port = None;
                Err(LinkFailure::Broken(error.to_string()))
            }
        }
    }

    fn close(&mut self) {
        // The port stays open, because other devices may use it.
    }
}

impl SerialLine {
    fn new(settings: Serial) -> SerialLine {
        let (frame, received) = (Vec::new(), Vec::with_capacity(RECEIVED_MAX));
        let echo = if settings.echo { Echo::Wanted } else { Echo::Unseen };
        SerialLine { settings, port: None, quiet_since: Instant::now(), frame, received, echo }
    }

    /// The transmission time of this number of bytes.
    fn wire_time(&self, bytes: usize) -> Duration {
        let parity = u32::from(self.settings.parity != Parity::None);
        let bits = 1 + 8 + parity + u32::from(self.settings.stop_bits);
        Duration::from_secs(1) * (bits * bytes as u32) / self.settings.baud
    }

    /// The answer's PDU; `None` if no answer came in time.
    async fn ask(
        &mut self,
        unit: u8,
        request: &[u8],
        timeout: Duration,
    ) -> io::Result<Option<Vec<u8>>> {
        // The time of three and a half characters.
        let silence = (self.wire_time(7) / 2).max(SILENCE_MIN);
        sleep_until(self.quiet_since + silence).await;
        let Some(port) = &self.port else { return Err(io::Error::other("the line is closed")) };
        tcflush(port, QueueSelector::IOFlush)?;
        rtu::frame(&mut self.frame, unit, request);
        let on_the_wire = self.frame.len() + expected_bytes(request) + 3;
        let deadline = Instant::now() + timeout + self.wire_time(on_the_wire);
        self.received.clear();
        let talk = async {
            send(port, &self.frame).await?;
            while self.received.len() < RECEIVED_MAX {
                receive(port, &mut self.received).await?;
                if self.echo.hear(&self.received, &self.frame, false) != Heard::Nothing {
                    break;
                }
            }
            io::Result::Ok(())
        };
        let done = timeout_at(deadline, talk).await;
        let is_late = done.is_err();
        done.unwrap_or(Ok(()))?;
        let heard = self.echo.hear(&self.received, &self.frame, is_late);
        self.echo = self.echo.after(request, heard);
        Ok(match heard {
            Heard::Answer(pdu) if self.echo != Echo::Seen => Some(pdu.to_vec()),
            Heard::Nothing | Heard::Answer(_) | Heard::Echo => None,
        })
    }

    fn why_none(&self, timeout: Duration) -> String {
        let limit = timeout.as_millis();
        if self.echo == Echo::Wanted && !self.received.is_empty() {
            return match self.received.starts_with(&self.frame) {
                true if self.received.len() == self.frame.len() => {
                    format!("no answer in {limit} ms")
                }
                true => format!("no whole, correct answer in {limit} ms"),
                false => "the request did not come back first, as `echo = true` says".to_owned(),
            };
        }
        match self.received.len() {
            0 => format!("no answer in {limit} ms"),
            RECEIVED_MAX.. => "endless noise instead of an answer".to_owned(),
            _ => format!("no whole, correct answer in {limit} ms"),
        }
    }
}

/// The reason why answers are not trusted.
const ECHO_SEEN: &str = "the line sends requests back: set `echo = true`";

async fn send(port: &AsyncFd<OwnedFd>, mut bytes: &[u8]) -> io::Result<()> {
    while !bytes.is_empty() {
        let mut ready = port.writable().await?;
        match ready.try_io(|port| Ok(rustix::io::write(port, bytes)?)) {
            Ok(Ok(count)) => bytes = &bytes[count..],
            Ok(Err(error)) if error.kind() != ErrorKind::Interrupted => return Err(error),
            Ok(Err(_)) | Err(_) => {}
        }
    }
    Ok(())
}

/// Receives at least one byte, and at most as many as there is room for.
async fn receive(port: &AsyncFd<OwnedFd>, received: &mut Vec<u8>) -> io::Result<()> {
    let mut bytes = [0; FRAME_BYTES_MAX];
    let room = (RECEIVED_MAX - received.len()).min(bytes.len());
    loop {
        let mut ready = port.readable().await?;
        match ready.try_io(|port| Ok(rustix::io::read(port, &mut bytes[..room])?)) {
            Ok(Ok(0)) => return Err(io::Error::other("the line is gone")),
            Ok(Ok(count)) => {
                received.extend_from_slice(&bytes[..count]);
                return Ok(());
            }
            Ok(Err(error)) if error.kind() != ErrorKind::Interrupted => return Err(error),
            Ok(Err(_)) | Err(_) => {}
        }
    }
}

/// Opens a port, and sets it to raw bytes with the speed and format of the settings.
fn open_port(settings: &Serial) -> io::Result<AsyncFd<OwnedFd>> {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let port = open(&settings.port, flags, Mode::empty())?;
    let mut modes = tcgetattr(&port)?;
    flock(&port, FlockOperation::NonBlockingLockExclusive)
        .map_err(|_| io::Error::other("another program has it"))?;
    modes.make_raw();
    modes.input_modes.remove(InputModes::INPCK);
    modes.control_modes.remove(
        ControlModes::CSIZE
            | ControlModes::PARENB
            | ControlModes::PARODD
            | ControlModes::CSTOPB
            | ControlModes::CRTSCTS,
    );
    modes.control_modes.insert(ControlModes::CS8 | ControlModes::CREAD | ControlModes::CLOCAL);
    if settings.parity != Parity::None {
        modes.control_modes.insert(ControlModes::PARENB);
        modes.control_modes.set(ControlModes::PARODD, settings.parity == Parity::Odd);
    }
    modes.control_modes.set(ControlModes::CSTOPB, settings.stop_bits == 2);
    // If there are no bytes, a read must not return 0, which means the end of the line.
    modes.special_codes[SpecialCodeIndex::VMIN] = 1;
    modes.special_codes[SpecialCodeIndex::VTIME] = 0;
    modes.set_speed(settings.baud)?;
    tcsetattr(&port, OptionalActions::Now, &modes)?;
    watched(port)
}

#[allow(unsafe_code)]
fn watched(port: OwnedFd) -> io::Result<AsyncFd<OwnedFd>> {
    // SAFETY: an `OwnedFd` is the same open descriptor until it is dropped; nothing takes it out.
    Ok(unsafe { AsyncFd::register(port) }?)
}
