//! What the controller file's `[modbus-server]` comes to, with every default in its place.
//!
//! The reader of the controller file fills it in; the map and the server take it as it is. Ranges
//! hold elements as an author writes them: `MC1` is 1, `X0` is 0. Both ends belong to a range.

use std::net::{Ipv4Addr, SocketAddr};
use std::ops::RangeInclusive;
use std::time::Duration;

/// A Modbus TCP server's settings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Where it listens: loopback, unless the file says otherwise. The vendors' port, 502, wants
    /// a privilege; 1502 does not.
    pub listen: SocketAddr,
    /// MC elements that a client may write, beside those of `image.inputs`.
    pub writable_coils: Vec<RangeInclusive<u32>>,
    /// MHR elements that a client may write.
    pub writable_registers: Vec<RangeInclusive<u32>>,
    /// How many clients may be connected at a time.
    pub connections: u32,
    /// How long a frame may take from its first byte to its last, and a reply to be taken.
    pub frame_timeout: Duration,
    /// How long a client may be silent between two requests.
    pub idle_timeout: Duration,
    /// What of the inputs and outputs a client is.
    pub image: Image,
}

/// `[modbus-server.image]`: a client as the plant's inputs and outputs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Image {
    /// MC that a client writes, and that become X at the scan's input step. These MC are
    /// writable without being listed.
    pub inputs: Option<Run>,
    /// Y as driven, safe values included, that a client reads as MI.
    pub outputs: Option<Run>,
}

/// A run of elements that stand for another, one by one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// The first element of `from`: MC of inputs, Y of outputs.
    pub from: u32,
    /// The first element of `to`: X of inputs, MI of outputs.
    pub to: u32,
    /// How many.
    pub count: u32,
}

/// As many clients as a small plant has, with room.
pub const CONNECTIONS: u32 = 32;
/// Frames travel in one packet as a rule; two seconds are for the worst of lines.
pub const FRAME_TIMEOUT: Duration = Duration::from_secs(2);
/// Longer than the polling of a patient client, short enough to forget one whose line is cut.
pub const IDLE_TIMEOUT: Duration = Duration::from_secs(60);
/// Where a server listens that is not told.
pub const LISTEN: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 1502);

impl Default for Settings {
    fn default() -> Self {
        Settings {
            listen: LISTEN,
            writable_coils: Vec::new(),
            writable_registers: Vec::new(),
            connections: CONNECTIONS,
            frame_timeout: FRAME_TIMEOUT,
            idle_timeout: IDLE_TIMEOUT,
            image: Image::default(),
        }
    }
}

impl Run {
    /// Which element of `to` an element of `from` becomes.
    pub fn forward(&self, from: u32) -> Option<u32> {
        let at = from.checked_sub(self.from)?;
        (at < self.count).then(|| self.to + at)
    }

    /// Which element of `from` an element of `to` is.
    pub fn back(&self, to: u32) -> Option<u32> {
        Run { from: self.to, to: self.from, count: self.count }.forward(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_goes_both_ways_and_ends() {
        let run = Run { from: 1, to: 8, count: 4 };
        let forward: Vec<_> = (0..6).map(|n| run.forward(n)).collect();
        assert_eq!(forward, [None, Some(8), Some(9), Some(10), Some(11), None]);
        assert_eq!((run.back(7), run.back(8), run.back(11), run.back(12)).1, Some(1));
        assert_eq!(run.back(12), None);
    }
}
