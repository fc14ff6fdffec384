//! The link by Modbus RTU: a serial line, or TCP to a serial server; one question at a time, with
//! a silence before each.
//!
//! Several devices may be on one line: they share it ([`RtuLines`]), question by question. Bytes
//! that arrive between two questions are discarded before the next question. So a late or wrong
//! answer does not disturb the next one, and the port stays open. A port that fails (an unplugged
//! adapter, a closed connection) is closed at once. The next device that connects opens a serial
//! port again; a connection is also opened by the next question, and replaced if `pace` finds that
//! it is over. Echoes of adapters that send requests back are distinguished from answers: see
//! [`Echo`]. This module does not switch a transceiver's direction; adapters and their kernel
//! drivers do so.

use std::collections::HashMap;
use std::io;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::Mutex;
use tokio::time::{Instant, sleep, sleep_until, timeout_at};

use super::answer::expected_bytes;
use super::link::{LinkFailure, PeerLink};
use super::pace::{RequestPace, SilenceHint};
use super::port::RtuWire;
use super::rtu::{self, FRAME_BYTES_MAX, ReceivedFrame};
use super::settings::{ConnectionUse, Parity, PeerHabits, RtuLine, RtuPort};
use super::tcp::{self, NONE_AFTER_ANSWER, REST_IS_LATE};
use crate::device::ExchangeFailure;

/// The most bytes received for a question: a request sent back and an answer. More bytes than that
/// are noise.
const RECEIVED_MAX: usize = 2 * FRAME_BYTES_MAX;

/// The shortest silence between frames at any speed, according to the specification.
const SILENCE_MIN: Duration = Duration::from_micros(1750);

/// The number of the unit that is all units of a line.
const BROADCAST: u8 = 0;

/// All lines by the names of their ports, so that the devices on a line share it.
#[derive(Default)]
pub struct RtuLines {
    by_port: HashMap<String, Arc<Mutex<SharedLine>>>,
}

/// A device's link over its line.
pub struct RtuLink {
    line: Arc<Mutex<SharedLine>>,
    habits: PeerHabits,
    timeout: Duration,
}

/// A line, with its port while that is open.
struct SharedLine {
    settings: RtuLine,
    port: Option<RtuWire>,
    pace: RequestPace,
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

impl RtuLines {
    /// A link over this line, for a device with these habits, whose answers are complete within
    /// `timeout`.
    pub fn link(&mut self, settings: &RtuLine, habits: PeerHabits, timeout: Duration) -> RtuLink {
        let new = || Arc::new(Mutex::new(SharedLine::new(settings.clone())));
        let line = self.by_port.entry(settings.port.name()).or_insert_with(new);
        RtuLink { line: Arc::clone(line), habits, timeout }
    }
}

impl Echo {
    fn hear<'a>(self, received: &'a [u8], frame: &[u8], is_late: bool) -> ReceivedFrame<'a> {
        match self {
            Echo::Wanted => rtu::behind_echo(received, frame),
            Echo::Seen | Echo::Unseen => rtu::hear(received, frame, is_late),
        }
    }

    /// The new state after a request.
    fn after(self, request: &[u8], heard: ReceivedFrame<'_>) -> Echo {
        match (self, heard) {
            (Echo::Wanted, _) => Echo::Wanted,
            (_, ReceivedFrame::Echo) => Echo::Seen,
            (_, ReceivedFrame::Answer(_)) if !rtu::is_answered_by_itself(request) => Echo::Unseen,
            (Echo::Seen | Echo::Unseen, ReceivedFrame::Answer(_) | ReceivedFrame::Nothing) => self,
        }
    }
}

impl PeerLink for RtuLink {
    const STARTS_ANEW: bool = true;

    async fn connect(&mut self) -> Result<(), ExchangeFailure> {
        let mut line = self.line.lock().await;
        match line.port {
            Some(_) => Ok(()),
            None => line.open().await.map_err(ExchangeFailure::disconnected),
        }
    }

    async fn ask(
        &mut self,
        unit: u8,
        request: &[u8],
        answer: &mut Vec<u8>,
    ) -> Result<(), LinkFailure> {
        let mut line = self.line.lock().await;
        line.ready(&self.habits).await?;
        let asked = line.ask(unit, request, self.timeout).await;
        line.pace.end(&self.habits);
        let asked = match asked {
            Ok(Some(pdu)) => {
                line.pace.answer();
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
            Ok(None) => Err(LinkFailure::Silent(line.miss(request, &self.habits, self.timeout))),
            Err(error) => Err(line.fail(&error)),
        };
        line.close_after_request();
        asked
    }

    fn is_broadcast(&self, unit: u8) -> bool {
        unit == BROADCAST
    }

    async fn broadcast(&mut self, request: &[u8]) -> Result<(), LinkFailure> {
        let mut line = self.line.lock().await;
        line.ready(&self.habits).await?;
        let sent = line.send(BROADCAST, request, self.timeout).await;
        if sent.is_ok() {
            let delay = Duration::from_millis(self.habits.broadcast_delay_ms.into());
            sleep(line.wire_time(line.frame.len()) + delay).await;
        }
        line.pace.end(&self.habits);
        let told = sent.map_err(|error| line.fail(&error));
        line.close_after_request();
        told
    }

    fn is_usable(&self) -> bool {
        true
    }

    fn close(&mut self) {
        // The port stays open, because other devices may use it.
    }
}

impl SharedLine {
    fn new(settings: RtuLine) -> SharedLine {
        let (frame, received) = (Vec::new(), Vec::with_capacity(RECEIVED_MAX));
        let echo = if settings.echo { Echo::Wanted } else { Echo::Unseen };
        SharedLine { settings, port: None, pace: RequestPace::new(), frame, received, echo }
    }

    async fn open(&mut self) -> Result<(), String> {
        self.port = Some(RtuWire::open(&self.settings.port).await?);
        self.pace.open();
        Ok(())
    }

    /// The transmission time of this number of bytes. A serial server does not tell its speed: the
    /// author's `timeout` contains it.
    fn wire_time(&self, bytes: usize) -> Duration {
        let RtuPort::Serial(serial) = &self.settings.port else { return Duration::ZERO };
        let parity = u32::from(serial.parity != Parity::None);
        let bits = 1 + 8 + parity + u32::from(serial.stop_bits);
        Duration::from_secs(1) * (bits * bytes as u32) / serial.baud
    }

    /// Waits until a question may be sent to a device with these habits, over a port that is open.
    async fn ready(&mut self, habits: &PeerHabits) -> Result<(), LinkFailure> {
        let silence = match (&self.port, &self.settings.port) {
            // The time of three and a half characters.
            (_, RtuPort::Serial(_)) => (self.wire_time(7) / 2).max(SILENCE_MIN),
            (Some(_), RtuPort::Tcp(_)) => Duration::ZERO,
            (None, RtuPort::Tcp(_)) => {
                self.open().await.map_err(LinkFailure::Broken)?;
                Duration::ZERO
            }
        };
        let ready_at = self.pace.ready_at(habits, silence);
        if ready_at > Instant::now() {
            sleep_until(ready_at).await;
        }
        Ok(())
    }

    /// Sends the frame of a request, behind everything that has arrived.
    async fn send(&mut self, unit: u8, request: &[u8], timeout: Duration) -> io::Result<()> {
        self.received.clear();
        let Some(port) = &mut self.port else { return Err(io::Error::other("the line is closed")) };
        port.discard()?;
        rtu::frame(&mut self.frame, unit, request);
        self.pace.ask();
        let deadline = Instant::now() + timeout;
        let unsent = |_| io::Error::other("the request could not be sent");
        timeout_at(deadline, port.send(&self.frame)).await.map_err(unsent)?
    }

    /// The answer's PDU; `None` if no answer came in time.
    async fn ask(
        &mut self,
        unit: u8,
        request: &[u8],
        timeout: Duration,
    ) -> io::Result<Option<Vec<u8>>> {
        let begun = Instant::now();
        self.send(unit, request, timeout).await?;
        let on_the_wire = self.frame.len() + expected_bytes(request) + 3;
        let deadline = begun + timeout + self.wire_time(on_the_wire);
        let Some(port) = &mut self.port else { return Ok(None) };
        let talk = async {
            while self.received.len() < RECEIVED_MAX {
                port.receive(&mut self.received, RECEIVED_MAX).await?;
                if self.echo.hear(&self.received, &self.frame, false) != ReceivedFrame::Nothing {
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
            ReceivedFrame::Answer(pdu) if self.echo != Echo::Seen => Some(pdu.to_vec()),
            ReceivedFrame::Nothing | ReceivedFrame::Answer(_) | ReceivedFrame::Echo => None,
        })
    }

    /// Handles a silence; returns the reason for the log.
    fn miss(&mut self, request: &[u8], habits: &PeerHabits, timeout: Duration) -> String {
        self.pace.miss();
        let reason = self.why_none(request, timeout);
        if matches!(self.settings.port, RtuPort::Tcp(_)) && self.pace.is_over(habits) {
            self.port = None;
        }
        reason
    }

    /// Handles a port that failed.
    fn fail(&mut self, error: &io::Error) -> LinkFailure {
        self.port = None;
        let is_socket = matches!(self.settings.port, RtuPort::Tcp(_));
        let is_closed = is_socket && tcp::is_closed(error) && self.received.is_empty();
        match is_closed && self.pace.is_proven() {
            true => LinkFailure::Closed(error.to_string()),
            false => LinkFailure::Broken(error.to_string()),
        }
    }

    fn close_after_request(&mut self) {
        if let RtuPort::Tcp(peer) = &self.settings.port
            && peer.connection == ConnectionUse::PerRequest
        {
            self.port = None;
        }
    }

    fn why_none(&self, request: &[u8], timeout: Duration) -> String {
        let limit = timeout.as_millis();
        let behind = match self.echo {
            Echo::Wanted => self.received.strip_prefix(&self.frame[..]),
            Echo::Seen | Echo::Unseen => Some(&self.received[..]),
        };
        let Some(behind) = behind.or_else(|| self.received.is_empty().then_some(&[][..])) else {
            return "the request did not come back first, as `echo = true` says".to_owned();
        };
        let unit = self.frame.first().copied().unwrap_or_default();
        match behind.len() {
            0 => format!("no answer in {limit} ms{}", self.hint()),
            _ if self.received.len() >= RECEIVED_MAX => {
                "endless noise instead of an answer".to_owned()
            }
            _ => match rtu::answering_unit(behind, request) {
                Some(other) if other != unit => {
                    format!("the answer is unit {other}'s, not unit {unit}'s: try `unit = {other}`")
                }
                Some(_) | None => {
                    let is_begun = rtu::begins(behind, unit, request);
                    let hint = if is_begun { REST_IS_LATE } else { "" };
                    format!("no whole, correct answer in {limit} ms{hint}")
                }
            },
        }
    }

    /// What may help after a silence, as an end of its sentence.
    fn hint(&self) -> &'static str {
        match (self.pace.hint(), &self.settings.port) {
            (SilenceHint::SinceOpening, RtuPort::Serial(_)) => {
                ", and none since the port was opened: check `unit`, `baud` and `parity`, or try \
                 `connect-delay`, or a longer `timeout`"
            }
            (SilenceHint::SinceOpening, RtuPort::Tcp(_)) => {
                ", and none since connecting: try `connect-delay`, a longer `timeout`, another \
                 `unit`; for a gateway that translates, `driver = \"modbus-tcp\"`"
            }
            (SilenceHint::AfterAnswer, _) => NONE_AFTER_ANSWER,
            (SilenceHint::None, _) => "",
        }
    }
}

/// The reason why answers are not trusted.
const ECHO_SEEN: &str = "the line sends requests back: set `echo = true`";
