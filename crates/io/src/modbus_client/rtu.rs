//! Frames of Modbus RTU: the CRC, and the search for the answer in the received bytes.
//!
//! A frame has the unit, a PDU and a CRC. Its end is not marked; its length follows from the PDU.
//! [`find`] looks for the answer at every byte, so that noise before the answer does no harm. Some
//! adapters send the request back, and such an echo can look like an answer: [`behind_echo`]
//! removes it, and [`hear`] detects it. No input makes these functions panic.

/// The number of bytes of the longest frame: the unit, a PDU of 253, the CRC.
pub(crate) const FRAME_BYTES_MAX: usize = 256;

/// The checksum of Modbus RTU: CRC-16 with the polynomial 0x8005, reflected, from 0xffff on.
pub(crate) fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xffff, |crc, byte| {
        let at = (crc ^ u16::from(*byte)) & 0xff;
        crc >> 8 ^ TABLE[usize::from(at)]
    })
}

const TABLE: [u16; 256] = table();

const fn table() -> [u16; 256] {
    let mut table = [0; 256];
    let mut at = 0;
    while at < 256 {
        let (mut crc, mut bit) = (at as u16, 0);
        while bit < 8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xa001 } else { crc >> 1 };
            bit += 1;
        }
        table[at] = crc;
        at += 1;
    }
    table
}

/// Replaces the content of `frame` by the frame of a PDU.
pub fn frame(frame: &mut Vec<u8>, unit: u8, pdu: &[u8]) {
    frame.clear();
    frame.push(unit);
    frame.extend_from_slice(pdu);
    frame.extend_from_slice(&crc(frame).to_le_bytes());
}

/// The content of the bytes received so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReceivedFrame<'a> {
    /// No answer yet.
    Nothing,
    /// The PDU of an answer.
    Answer(&'a [u8]),
    /// The request itself, which is no answer.
    Echo,
}

/// Whether the right answer to a request equals the request, as for a write of one coil or
/// register. Then an echo looks like an answer.
pub(crate) fn is_answered_by_itself(request: &[u8]) -> bool {
    matches!(request.first(), Some(5 | 6))
}

/// Reads the bytes of a line that should not send requests back; `frame` is the request's frame.
/// Until the time limit is over (`is_late`), bytes that may still become an echo count as nothing.
pub(crate) fn hear<'a>(received: &'a [u8], frame: &[u8], is_late: bool) -> ReceivedFrame<'a> {
    let Some((unit, request)) = parts(frame) else { return ReceivedFrame::Nothing };
    if is_answered_by_itself(request) {
        return find(received, unit, request).map_or(ReceivedFrame::Nothing, ReceivedFrame::Answer);
    }
    for start in 0..received.len() {
        let bytes = &received[start..];
        if bytes.starts_with(frame) {
            return ReceivedFrame::Echo;
        }
        if frame.starts_with(bytes) && !is_late {
            return ReceivedFrame::Nothing;
        }
        if let Some(answer) = at_start(bytes, unit, request) {
            return ReceivedFrame::Answer(answer);
        }
    }
    ReceivedFrame::Nothing
}

/// Reads the bytes of a line that sends requests back: the answer follows the request's frame.
pub(crate) fn behind_echo<'a>(received: &'a [u8], frame: &[u8]) -> ReceivedFrame<'a> {
    let behind = received.strip_prefix(frame).zip(parts(frame));
    let answer = behind.and_then(|(received, (unit, request))| find(received, unit, request));
    answer.map_or(ReceivedFrame::Nothing, ReceivedFrame::Answer)
}

/// The unit and the PDU of a frame.
fn parts(frame: &[u8]) -> Option<(u8, &[u8])> {
    let (unit, rest) = frame.split_first()?;
    Some((*unit, rest.get(..rest.len().checked_sub(2)?)?))
}

/// The PDU of the first whole frame in which this unit answers this request, with the same function
/// or with an exception. The content of the PDU is not checked.
pub fn find<'a>(received: &'a [u8], unit: u8, request: &[u8]) -> Option<&'a [u8]> {
    (0..received.len()).find_map(|start| at_start(&received[start..], unit, request))
}

/// The unit of the first whole frame that would answer this request if it were asked of that unit.
pub(crate) fn answering_unit(received: &[u8], request: &[u8]) -> Option<u8> {
    let unit_at = |start: usize| {
        let bytes = &received[start..];
        let unit = *bytes.first()?;
        at_start(bytes, unit, request).map(|_| unit)
    };
    (0..received.len()).find_map(unit_at)
}

/// Whether the bytes end with the beginning of a frame in which this unit answers this request.
pub(crate) fn begins(received: &[u8], unit: u8, request: &[u8]) -> bool {
    let is_cut = |start: usize| {
        let bytes = &received[start..];
        length(bytes, unit, request).is_some_and(|length| bytes.len() < length)
    };
    (0..received.len()).any(is_cut)
}

/// Like [`find`], but only for a frame at the start of the bytes.
fn at_start<'a>(bytes: &'a [u8], unit: u8, request: &[u8]) -> Option<&'a [u8]> {
    let frame = bytes.get(..length(bytes, unit, request)?)?;
    let (body, sum) = frame.split_at(frame.len() - 2);
    (sum == crc(body).to_le_bytes()).then(|| &body[1..])
}

/// The length of the frame at the start of the bytes, if this unit answers this request in it.
fn length(bytes: &[u8], unit: u8, request: &[u8]) -> Option<usize> {
    let function = *request.first()?;
    match *bytes {
        [by, code, ..] if by == unit && code == function | 0x80 => Some(5),
        [by, code, count, ..] if by == unit && code == function => match function {
            1..=4 => Some(5 + usize::from(count)),
            _ => Some(8),
        },
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const READ: [u8; 5] = [3, 0, 0, 0, 1];

    fn framed(unit: u8, pdu: &[u8]) -> Vec<u8> {
        let mut bytes = vec![0xaa; 3];
        frame(&mut bytes, unit, pdu);
        bytes
    }

    #[test]
    fn the_checksum_equals_the_examples_of_the_specification() {
        // The example of the specification, and the check value of CRC catalogues.
        assert_eq!(crc(&[2, 7]), 0x1241);
        assert_eq!(crc(b"123456789"), 0x4b37);
        assert_eq!(framed(1, &[3, 0, 0, 0, 10]), [1, 3, 0, 0, 0, 10, 0xc5, 0xcd]);
    }

    #[test]
    fn an_answer_is_found_between_other_bytes() {
        let answer = framed(1, &[3, 2, 0, 7]);
        let request = framed(1, &READ);
        let other = framed(2, &[3, 2, 0, 9]);
        for before in [&[][..], &[0xff, 1, 3], &[1; 40], &request, &other, &[1, 3, 200]] {
            let line = [before, &answer, &[1, 3, 0x55]].concat();
            assert_eq!(find(&line, 1, &READ), Some(&[3, 2, 0, 7][..]), "{before:?}");
        }
        assert_eq!(find(&framed(1, &[0x83, 2]), 1, &READ), Some(&[0x83, 2][..]));
        let write = [6, 0, 1, 0, 3];
        assert_eq!(find(&framed(1, &write), 1, &write), Some(&write[..]));
    }

    #[test]
    fn incomplete_or_corrupt_answers_are_not_found() {
        let answer = framed(1, &[3, 2, 0, 7]);
        for end in 0..answer.len() {
            assert_eq!(find(&answer[..end], 1, &READ), None, "{end}");
        }
        for at in 0..answer.len() {
            let mut broken = answer.clone();
            broken[at] ^= 0x10;
            assert_eq!(find(&broken, 1, &READ), None, "{at}");
        }
        assert_eq!(find(&framed(2, &[3, 2, 0, 7]), 1, &READ), None);
        assert_eq!(find(&framed(1, &[4, 2, 0, 7]), 1, &READ), None);
    }

    #[test]
    fn an_answer_of_another_unit_is_recognized() {
        let answer = framed(7, &[3, 2, 0, 7]);
        let line = [&[0xff, 7, 3][..], &answer].concat();
        assert_eq!(answering_unit(&line, &READ), Some(7));
        assert_eq!(answering_unit(&answer[..6], &READ), None);
        assert_eq!(answering_unit(&framed(7, &[4, 2, 0, 7]), &READ), None);
    }

    #[test]
    fn the_beginning_of_an_answer_is_recognized() {
        let answer = framed(1, &[3, 4, 0, 7, 0, 8]);
        for end in 3..answer.len() {
            assert!(begins(&[&[0xff], &answer[..end]].concat(), 1, &READ), "{end}");
        }
        assert!(!begins(&answer, 1, &READ) && !begins(&answer[..6], 2, &READ));
        assert!(begins(&[1, 0x83, 2], 1, &READ) && !begins(&[1, 4, 2], 1, &READ));
    }

    #[test]
    fn every_echo_is_recognized() {
        // If the high byte of the address is 3, it looks like a byte count.
        for function in [1, 2, 3, 4] {
            for at in 0..=0x03ff_u16 {
                let [high, low] = at.to_be_bytes();
                let request = framed(1, &[function, high, low, 0, 8]);
                for end in 0..8 {
                    assert_eq!(
                        hear(&request[..end], &request, false),
                        ReceivedFrame::Nothing,
                        "{at}"
                    );
                }
                assert_eq!(hear(&request, &request, false), ReceivedFrame::Echo, "{at}");
                let noisy = [&[0xff, 0], &request[..]].concat();
                assert_eq!(hear(&noisy, &request, false), ReceivedFrame::Echo, "{at}");
                assert_eq!(behind_echo(&request, &request), ReceivedFrame::Nothing);
            }
        }
    }

    #[test]
    fn the_answer_is_read_after_the_echo_of_the_request() {
        let answer = framed(1, &[3, 2, 0, 7]);
        let read = framed(1, &READ);
        let both = [&read[..], &answer].concat();
        assert_eq!(behind_echo(&both, &read), ReceivedFrame::Answer(&[3, 2, 0, 7]));
        assert_eq!(hear(&both, &read, false), ReceivedFrame::Echo);
        assert_eq!(hear(&answer, &read, false), ReceivedFrame::Answer(&[3, 2, 0, 7]));
        assert_eq!(behind_echo(&answer, &read), ReceivedFrame::Nothing, "no echo");
        let write = framed(1, &[6, 0, 1, 0, 3]);
        assert_eq!(behind_echo(&write, &write), ReceivedFrame::Nothing);
        let twice = [&write[..], &write].concat();
        assert_eq!(behind_echo(&twice, &write), ReceivedFrame::Answer(&[6, 0, 1, 0, 3]));
    }

    #[test]
    fn an_answer_that_begins_like_its_echo_is_accepted_if_no_more_bytes_follow() {
        // The request's first six bytes are a whole answer with one byte of data.
        let (unit, at) = (0..=255u8)
            .flat_map(|unit| (0..=255u8).map(move |at| (unit, at)))
            .find(|(unit, at)| crc(&[*unit, 1, 1, *at]).to_le_bytes()[0] == 0)
            .unwrap();
        let [zero, count] = crc(&[unit, 1, 1, at]).to_le_bytes();
        let mut request = Vec::new();
        frame(&mut request, unit, &[1, 1, at, zero, count]);
        assert_eq!(hear(&request[..6], &request, false), ReceivedFrame::Nothing);
        assert_eq!(hear(&request[..6], &request, true), ReceivedFrame::Answer(&[1, 1, at]));
        assert_eq!(hear(&request, &request, true), ReceivedFrame::Echo);
    }

    proptest! {
        #[test]
        fn interpreting_any_bytes_does_not_panic(
            received in prop::collection::vec(any::<u8>(), 0..300),
            frame in prop::collection::vec(any::<u8>(), 0..10),
            is_late: bool,
        ) {
            let _ = hear(&received, &frame, is_late);
            let _ = behind_echo(&received, &frame);
            let _ = (answering_unit(&received, &frame), begins(&received, 1, &frame));
        }

        #[test]
        fn searching_any_bytes_does_not_panic(
            received in prop::collection::vec(any::<u8>(), 0..300),
            request in prop::collection::vec(any::<u8>(), 0..8),
            unit in 0u8..4,
        ) {
            if let Some(pdu) = find(&received, unit, &request) {
                prop_assert!(pdu.len() <= received.len());
                prop_assert_eq!(pdu[0] & 0x7f, request[0] & 0x7f);
            }
        }

        #[test]
        fn any_answer_is_found_after_shorter_noise(
            noise in prop::collection::vec(any::<u8>(), 0..20),
            data in prop::collection::vec(any::<u8>(), 0..250),
        ) {
            let pdu = [&[3, data.len() as u8], &data[..]].concat();
            let line = [&noise[..], &framed(1, &pdu)].concat();
            // Noise has a right CRC of its own in one of 65,536 cases.
            if let Some(found) = find(&line, 1, &READ) {
                prop_assert!(found == pdu || noise.len() > 4);
            } else {
                prop_assert!(false, "not found");
            }
        }
    }
}
