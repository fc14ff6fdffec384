//! Frames of Modbus RTU: the CRC, and the answer among whatever a line brings.
//!
//! A frame is the unit, a PDU and a CRC; its end is not marked, but what a PDU says of itself tells
//! how long it is. [`find`] looks for the answer at every byte, so that noise before it, or the
//! request itself as some converters send it back, costs nothing. No bytes make it panic.

/// Bytes of the longest frame: the unit, a PDU of 253, the CRC.
pub const FRAME_BYTES_MAX: usize = 256;

/// The checksum of Modbus RTU: CRC-16 with the polynomial 0x8005, reflected, from 0xffff on.
pub fn crc(bytes: &[u8]) -> u16 {
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

/// Puts the frame of a PDU in the place of what `frame` holds.
pub fn frame(frame: &mut Vec<u8>, unit: u8, pdu: &[u8]) {
    frame.clear();
    frame.push(unit);
    frame.extend_from_slice(pdu);
    frame.extend_from_slice(&crc(frame).to_le_bytes());
}

/// The PDU of the first whole frame in which this unit answers this request: by the same function,
/// or by an exception. What it says is not judged.
pub fn find<'a>(received: &'a [u8], unit: u8, request: &[u8]) -> Option<&'a [u8]> {
    let function = *request.first()?;
    let from = |start: usize| {
        let bytes = &received[start..];
        let end = match *bytes {
            [by, code, ..] if by == unit && code == function | 0x80 => 3,
            [by, code, count, ..] if by == unit && code == function => match function {
                1..=4 => 3 + usize::from(count),
                _ => 6,
            },
            _ => return None,
        };
        let (body, sum) = (bytes.get(..end)?, bytes.get(end..end + 2)?);
        (sum == crc(body).to_le_bytes()).then(|| &body[1..])
    };
    (0..received.len()).find_map(from)
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
    fn the_checksum_is_the_specifications() {
        // The example of the specification, and the check value of catalogues.
        assert_eq!(crc(&[2, 7]), 0x1241);
        assert_eq!(crc(b"123456789"), 0x4b37);
        assert_eq!(framed(1, &[3, 0, 0, 0, 10]), [1, 3, 0, 0, 0, 10, 0xc5, 0xcd]);
    }

    #[test]
    fn an_answer_is_found_whatever_is_around_it() {
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
    fn what_is_no_answer_is_not_found() {
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

    proptest! {
        #[test]
        fn any_bytes_are_searched_without_a_panic(
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
        fn any_answer_is_found_in_noise_that_is_shorter(
            noise in prop::collection::vec(any::<u8>(), 0..20),
            data in prop::collection::vec(any::<u8>(), 0..250),
        ) {
            let pdu = [&[3, data.len() as u8], &data[..]].concat();
            let line = [&noise[..], &framed(1, &pdu)].concat();
            // Noise that has a right CRC of its own is one in 65,536.
            if let Some(found) = find(&line, 1, &READ) {
                prop_assert!(found == pdu || noise.len() > 4);
            } else {
                prop_assert!(false, "not found");
            }
        }
    }
}
