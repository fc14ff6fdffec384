//! Numbers and texts as bytes: little-endian numbers, numbers of variable length, texts after their
//! length. The reader takes bytes that may be wrong.
//!
//! Called by the readers and writers of states (`engine`), retentive contents (`retain`) and
//! recordings (`record`), which add the forms of their own. The reader trusts no length: a read
//! beyond the end returns `None`, and nothing is allocated before its bytes were found.

/// The bytes that are not read yet.
pub struct ByteSource<'b>(pub &'b [u8]);

impl<'b> ByteSource<'b> {
    /// The next `count` bytes.
    pub fn take(&mut self, count: usize) -> Option<&'b [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    /// The next byte.
    pub fn byte(&mut self) -> Option<u8> {
        self.take(1).map(|bytes| bytes[0])
    }

    /// A number of four bytes.
    pub fn u32(&mut self) -> Option<u32> {
        self.take(4)?.try_into().ok().map(u32::from_le_bytes)
    }

    /// A signed number of four bytes.
    pub fn i32(&mut self) -> Option<i32> {
        self.take(4)?.try_into().ok().map(i32::from_le_bytes)
    }

    /// A number of eight bytes.
    pub fn u64(&mut self) -> Option<u64> {
        self.take(8)?.try_into().ok().map(u64::from_le_bytes)
    }

    /// A signed number of eight bytes.
    pub fn i64(&mut self) -> Option<i64> {
        self.take(8)?.try_into().ok().map(i64::from_le_bytes)
    }

    /// A number of variable length, as [`put_number`] writes it.
    pub fn number(&mut self) -> Option<u64> {
        number_from(|| self.byte())
    }

    /// A number of at most 32 bits.
    pub fn small(&mut self) -> Option<u32> {
        self.number()?.try_into().ok()
    }

    /// A signed number, as [`put_signed`] writes it.
    pub fn signed(&mut self) -> Option<i64> {
        self.number().map(unfolded)
    }

    /// A signed number of 32 bits.
    pub fn small_signed(&mut self) -> Option<i32> {
        self.signed()?.try_into().ok()
    }

    /// A text, as [`put_text`] writes it; `None` if it is not UTF-8.
    pub fn text(&mut self) -> Option<String> {
        let count = self.number()?.try_into().ok()?;
        let text = std::str::from_utf8(self.take(count)?).ok()?;
        Some(text.to_owned())
    }
}

/// Appends a number, seven bits in each byte, the lowest first; the top bit is set if more bytes
/// follow.
pub fn put_number(out: &mut Vec<u8>, mut number: u64) {
    while number > 0x7F {
        out.push(number as u8 | 0x80);
        number >>= 7;
    }
    out.push(number as u8);
}

/// A signed number as an unsigned one, small for both signs: 0, -1, 1, -2 …
pub fn folded(number: i64) -> u64 {
    (number << 1 ^ number >> 63) as u64
}

fn unfolded(number: u64) -> i64 {
    (number >> 1) as i64 ^ -((number & 1) as i64)
}

/// Appends a signed number.
pub fn put_signed(out: &mut Vec<u8>, number: i64) {
    put_number(out, folded(number));
}

/// Appends the number of bytes of a text, then the text.
pub fn put_text(out: &mut Vec<u8>, text: &str) {
    put_number(out, text.len() as u64);
    out.extend_from_slice(text.as_bytes());
}

/// Reads a number of variable length, as [`put_number`] writes it, byte by byte.
pub fn number_from(mut next: impl FnMut() -> Option<u8>) -> Option<u64> {
    let mut number = 0;
    for shift in (0..64).step_by(7) {
        let byte = next()?;
        let bits = u64::from(byte & 0x7F);
        if shift == 63 && bits > 1 {
            return None;
        }
        number |= bits << shift;
        if byte & 0x80 == 0 {
            return Some(number);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_little_endian_until_the_bytes_end() {
        let mut bytes = ByteSource(&[1, 2, 0, 0, 0, 254, 255, 255, 255, 3]);
        assert_eq!((bytes.byte(), bytes.u32(), bytes.i32()), (Some(1), Some(2), Some(-2)));
        assert_eq!((bytes.u32(), bytes.u64(), bytes.take(2)), (None, None, None));
        assert_eq!((bytes.byte(), bytes.byte()), (Some(3), None));
    }

    #[test]
    fn written_numbers_are_read_back() {
        let edges = [0, 1, 0x7F, 0x80, 1 << 32, u64::MAX >> 1, u64::MAX - 1, u64::MAX];
        let mut out = Vec::new();
        for number in edges {
            put_number(&mut out, number);
            put_signed(&mut out, number as i64);
        }
        let mut bytes = ByteSource(&out);
        for number in edges {
            assert_eq!(bytes.number(), Some(number));
            assert_eq!(bytes.signed(), Some(number as i64));
        }
        assert_eq!(bytes.byte(), None);
    }

    #[test]
    fn a_number_of_more_than_64_bits_is_refused() {
        let mut bytes = [0xFF; 10];
        bytes[9] = 2;
        assert_eq!(ByteSource(&bytes).number(), None);
        bytes[9] = 0x81;
        assert_eq!(ByteSource(&bytes).number(), None);
        assert_eq!(ByteSource(&[0x80]).number(), None);
    }
}
