//! What carries the frames of Modbus RTU: a serial line of this machine, or a connection to a
//! serial server. Bytes in, bytes out; `line` has the frames.

use std::io::{self, ErrorKind};
use std::os::fd::OwnedFd;

use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::termios::{
    ControlModes, InputModes, OptionalActions, QueueSelector, SpecialCodeIndex, tcflush, tcgetattr,
    tcsetattr,
};
use tokio::io::unix::AsyncFd;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use super::rtu::FRAME_BYTES_MAX;
use super::settings::{Parity, RtuPort, SerialSettings};
use super::tcp;

/// The most bytes that are discarded before a request: a peer that sends more never stops.
const DISCARDED_MAX: usize = 64 * 1024;

/// An open port.
pub(super) enum RtuWire {
    Serial(AsyncFd<OwnedFd>),
    Socket(TcpStream),
}

impl RtuWire {
    /// Opens a port; the error is the reason for the log.
    pub async fn open(settings: &RtuPort) -> Result<RtuWire, String> {
        match settings {
            RtuPort::Serial(serial) => {
                let port = open_serial(serial);
                port.map(RtuWire::Serial).map_err(|error| format!("cannot open it: {error}"))
            }
            RtuPort::Tcp(peer) => tcp::connect(peer).await.map(RtuWire::Socket),
        }
    }

    /// Discards the bytes that have arrived. Of a connection that is closed, this shows the end.
    pub fn discard(&self) -> io::Result<()> {
        let stream = match self {
            RtuWire::Serial(port) => return Ok(tcflush(port, QueueSelector::IOFlush)?),
            RtuWire::Socket(stream) => stream,
        };
        let (mut bytes, mut discarded) = ([0; FRAME_BYTES_MAX], 0);
        while discarded < DISCARDED_MAX {
            match stream.try_read(&mut bytes) {
                Ok(0) => return Err(tcp::closed()),
                Ok(count) => discarded += count,
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) => return Err(error),
            }
        }
        Err(io::Error::other("endless noise"))
    }

    pub async fn send(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        let port = match self {
            RtuWire::Serial(port) => port,
            RtuWire::Socket(stream) => return stream.write_all(bytes).await,
        };
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

    /// Receives at least one byte, and at most as many as `received` may still take to have `most`.
    pub async fn receive(&mut self, received: &mut Vec<u8>, most: usize) -> io::Result<()> {
        let mut bytes = [0; FRAME_BYTES_MAX];
        let room = most.saturating_sub(received.len()).min(bytes.len());
        let port = match self {
            RtuWire::Serial(port) => port,
            RtuWire::Socket(stream) => {
                return match stream.read(&mut bytes[..room]).await? {
                    0 => Err(tcp::closed()),
                    count => {
                        received.extend_from_slice(&bytes[..count]);
                        Ok(())
                    }
                };
            }
        };
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
}

/// Opens a port, and sets it to raw bytes with the speed and format of the settings.
fn open_serial(settings: &SerialSettings) -> io::Result<AsyncFd<OwnedFd>> {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let port = open(&settings.path, flags, Mode::empty())?;
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
