//! The bytes of a state: bits packed by eight, and numbers.
//!
//! `form` and `elements` write and read them in the same order.

/// Writes bits and numbers.
#[derive(Debug)]
pub(super) struct ByteWriter<'b> {
    pub bytes: &'b mut Vec<u8>,
    /// The byte that takes the next bit, and the number of its bits that are taken.
    at: usize,
    taken: u32,
}

impl<'b> ByteWriter<'b> {
    /// Writes to the end of `bytes`.
    pub fn new(bytes: &'b mut Vec<u8>) -> ByteWriter<'b> {
        ByteWriter { bytes, at: 0, taken: u8::BITS }
    }

    #[inline]
    pub fn bit(&mut self, is_on: bool) {
        if self.taken == u8::BITS {
            (self.at, self.taken) = (self.bytes.len(), 0);
            self.bytes.push(0);
        }
        self.bytes[self.at] |= u8::from(is_on) << self.taken;
        self.taken += 1;
    }

    #[inline]
    pub fn number(&mut self, number: u32) {
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }
}

/// Reads what a writer has written.
#[derive(Debug)]
pub(super) struct ByteReader<'b> {
    bytes: &'b [u8],
    next: usize,
    /// The byte that has the next bit, and the number of its bits that are read.
    at: usize,
    taken: u32,
}

impl<'b> ByteReader<'b> {
    pub fn new(bytes: &'b [u8]) -> ByteReader<'b> {
        ByteReader { bytes, next: 0, at: 0, taken: u8::BITS }
    }

    #[inline]
    pub fn bit(&mut self) -> bool {
        if self.taken == u8::BITS {
            (self.at, self.taken) = (self.next, 0);
            self.next += 1;
        }
        self.taken += 1;
        self.bytes[self.at] >> (self.taken - 1) & 1 != 0
    }

    #[inline]
    pub fn number(&mut self) -> u32 {
        let bytes = &self.bytes[self.next..self.next + 4];
        self.next += 4;
        u32::from_le_bytes(bytes.try_into().expect("four bytes"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_and_numbers_are_read_as_they_were_written() {
        let mut bytes = Vec::new();
        let mut writer = ByteWriter::new(&mut bytes);
        for at in 0..20 {
            writer.bit(at % 3 == 0);
            if at % 5 == 0 {
                writer.number(at * 0x0101_0101);
            }
        }
        assert_eq!(bytes.len(), 3 + 4 * 4);
        let mut reader = ByteReader::new(&bytes);
        for at in 0..20 {
            assert_eq!(reader.bit(), at % 3 == 0);
            if at % 5 == 0 {
                assert_eq!(reader.number(), at * 0x0101_0101);
            }
        }
    }
}
