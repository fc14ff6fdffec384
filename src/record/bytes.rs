//! Numbers and texts as bytes: little-endian numbers, numbers of variable length, texts after their
//! length.
//!
//! The other files of `record` build sections and segments from them. The reader trusts no length:
//! it returns `None` if the bytes are wrong, and never allocates memory before it has read them.

pub(super) use crate::byte_source::ByteSource;

/// Appends a number, seven bits in each byte, the lowest first; the top bit is set if more bytes
/// follow.
pub(super) fn put_number(out: &mut Vec<u8>, mut number: u64) {
    while number > 0x7F {
        out.push(number as u8 | 0x80);
        number >>= 7;
    }
    out.push(number as u8);
}

/// A signed number as an unsigned one, small for both signs: 0, -1, 1, -2 …
pub(super) fn folded(number: i64) -> u64 {
    (number << 1 ^ number >> 63) as u64
}

fn unfolded(number: u64) -> i64 {
    (number >> 1) as i64 ^ -((number & 1) as i64)
}

/// Appends a signed number.
pub(super) fn put_signed(out: &mut Vec<u8>, number: i64) {
    put_number(out, folded(number));
}

/// Appends the number of bytes of a text, then the text.
pub(super) fn put_text(out: &mut Vec<u8>, text: &str) {
    put_number(out, text.len() as u64);
    out.extend_from_slice(text.as_bytes());
}

/// Reads a number of variable length, as [`put_number`] writes it, byte by byte.
pub(super) fn number_from(mut next: impl FnMut() -> Option<u8>) -> Option<u64> {
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

impl ByteSource<'_> {
    /// A number of variable length, as [`put_number`] writes it.
    pub fn number(&mut self) -> Option<u64> {
        number_from(|| self.byte())
    }

    /// A number of at most 32 bits.
    pub fn small(&mut self) -> Option<u32> {
        self.number()?.try_into().ok()
    }

    pub fn signed(&mut self) -> Option<i64> {
        self.number().map(unfolded)
    }

    /// A signed number of 32 bits.
    pub fn small_signed(&mut self) -> Option<i32> {
        self.signed()?.try_into().ok()
    }

    pub fn text(&mut self) -> Option<String> {
        let count = self.number()?.try_into().ok()?;
        let text = std::str::from_utf8(self.take(count)?).ok()?;
        Some(text.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back() {
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
    fn a_number_of_more_than_64_bits_is_none() {
        let mut bytes = [0xFF; 10];
        bytes[9] = 2;
        assert_eq!(ByteSource(&bytes).number(), None);
        bytes[9] = 0x81;
        assert_eq!(ByteSource(&bytes).number(), None);
        assert_eq!(ByteSource(&[0x80]).number(), None);
    }
}
