//! Frames of Modbus TCP: finds the end of a frame in a stream of bytes, and reads its header.
//!
//! A frame has a header of seven bytes (transaction, protocol 0, length, unit) and a PDU of at most
//! 253. The connection calls [`split`] on the received bytes, and builds a reply with [`around`].
//! Nothing here interprets a PDU, reads a socket or allocates. No input makes it panic, or makes it
//! wait for more than [`FRAME_BYTES_MAX`] bytes.
//!
//! Reasons for not using a crate: tokio-modbus 0.17 panics on a request to write more coils than
//! its bytes hold, and on a register count of 32,768 in a debug build; it closes the connection
//! instead of sending exception 3, which the protocol requires, accepts a frame of up to 64 KiB,
//! and its server has no time limits for an unfinished frame and an idle client. rmodbus 0.13
//! writes into its own storage piece by piece, but a write here must be one batch for one scan,
//! applied as a whole or not.

/// The number of bytes of the header.
pub(crate) const HEADER_BYTES: usize = 7;

/// The number of bytes of the longest frame: six, plus a length of at most 254.
pub const FRAME_BYTES_MAX: usize = 260;

/// The length field counts the unit and the PDU, which has at least a function code.
const LENGTH_MIN: usize = 2;
const LENGTH_MAX: usize = 254;

/// The fields that a reply copies from its request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameHeader {
    /// The client's number for the request.
    pub(crate) transaction: u16,
    /// The unit that the request addresses.
    pub unit: u8,
}

/// The content at the start of the received bytes.
#[derive(Debug, PartialEq, Eq)]
pub enum FrameSplit<'a> {
    /// No whole frame yet.
    More,
    /// A frame.
    Frame {
        /// Its header.
        header: FrameHeader,
        /// Its PDU: the function code and what follows; 1 to 253 bytes.
        pdu: &'a [u8],
        /// The number of bytes of the frame.
        bytes: usize,
    },
    /// Not Modbus TCP; the start of the next frame cannot be found.
    Broken(FrameError),
}

/// The reason why bytes are not a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// The protocol identifier is not 0.
    Protocol(u16),
    /// The length is below 2 or above 254.
    Length(u16),
}

impl std::fmt::Display for FrameError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            FrameError::Protocol(id) => write!(f, "not Modbus TCP: protocol identifier {id}"),
            FrameError::Length(n) => write!(f, "not Modbus TCP: length {n}, not 2 to 254"),
        }
    }
}

/// The first frame of the bytes received so far. A wrong header is reported as soon as the wrong
/// field has been received, so no caller waits for the rest.
pub fn split(bytes: &[u8]) -> FrameSplit<'_> {
    let word = |at: usize| Some(u16::from_be_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]));
    if let Some(protocol @ 1..) = word(2) {
        return FrameSplit::Broken(FrameError::Protocol(protocol));
    }
    let (Some(transaction), Some(length)) = (word(0), word(4)) else {
        return FrameSplit::More;
    };
    if !(LENGTH_MIN..=LENGTH_MAX).contains(&usize::from(length)) {
        return FrameSplit::Broken(FrameError::Length(length));
    }
    let end = HEADER_BYTES - 1 + usize::from(length);
    match (bytes.get(HEADER_BYTES - 1), bytes.get(HEADER_BYTES..end)) {
        (Some(&unit), Some(pdu)) => {
            FrameSplit::Frame { header: FrameHeader { transaction, unit }, pdu, bytes: end }
        }
        _ => FrameSplit::More,
    }
}

/// A frame: the header, and the PDU that `pdu` appends. A reply has the header of its request.
///
/// # Panics
/// If `pdu` appends more bytes than a PDU can have. The callers' PDUs are never longer.
pub fn around(header: FrameHeader, pdu: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut frame = Vec::with_capacity(FRAME_BYTES_MAX);
    frame.extend_from_slice(&header.transaction.to_be_bytes());
    frame.extend_from_slice(&[0, 0, 0, 0, header.unit]);
    pdu(&mut frame);
    assert!(frame.len() <= FRAME_BYTES_MAX, "a frame of {} bytes", frame.len());
    let length = (frame.len() - (HEADER_BYTES - 1)) as u16;
    frame[4..6].copy_from_slice(&length.to_be_bytes());
    frame
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn an_incomplete_frame_waits_for_more_bytes() {
        let bytes = [0x12, 0x34, 0, 0, 0, 6, 9, 3, 0, 0, 0, 1, 0xff];
        for end in 0..12 {
            assert_eq!(split(&bytes[..end]), FrameSplit::More, "{end}");
        }
        let header = FrameHeader { transaction: 0x1234, unit: 9 };
        let frame = FrameSplit::Frame { header, pdu: &bytes[7..12], bytes: 12 };
        assert_eq!(split(&bytes), frame);
    }

    #[test]
    fn bytes_that_are_not_modbus_are_detected_in_the_header() {
        assert_eq!(split(b"GET "), FrameSplit::Broken(FrameError::Protocol(0x5420)));
        let length = |n: u16| split_length(n.to_be_bytes());
        assert_eq!(length(0), Some(FrameError::Length(0)));
        assert_eq!(length(1), Some(FrameError::Length(1)));
        assert_eq!(length(2), None);
        assert_eq!(length(254), None);
        assert_eq!(length(255), Some(FrameError::Length(255)));
        assert_eq!(length(u16::MAX), Some(FrameError::Length(u16::MAX)));
    }

    fn split_length(length: [u8; 2]) -> Option<FrameError> {
        match split(&[0, 1, 0, 0, length[0], length[1]]) {
            FrameSplit::Broken(broken) => Some(broken),
            FrameSplit::More | FrameSplit::Frame { .. } => None,
        }
    }

    #[test]
    fn a_reply_is_framed_with_the_header_of_its_request() {
        let header = FrameHeader { transaction: 7, unit: 1 };
        let bytes = around(header, |pdu| pdu.extend_from_slice(&[0x83, 2]));
        assert_eq!(bytes, [0, 7, 0, 0, 0, 3, 1, 0x83, 2]);
    }

    proptest! {
        #[test]
        fn any_bytes_split_without_a_panic_and_within_bounds(bytes: Vec<u8>) {
            match split(&bytes) {
                FrameSplit::Frame { pdu, bytes: taken, .. } => {
                    prop_assert!(taken <= bytes.len() && taken <= FRAME_BYTES_MAX);
                    prop_assert_eq!(pdu.len(), taken - HEADER_BYTES);
                    prop_assert!(!pdu.is_empty());
                }
                FrameSplit::More => prop_assert!(bytes.len() < FRAME_BYTES_MAX),
                FrameSplit::Broken(_) => {}
            }
        }
    }
}
