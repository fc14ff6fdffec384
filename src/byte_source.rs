//! Reads little-endian numbers from bytes that may be wrong.
//!
//! Called by the readers of states (`engine`), retentive contents (`retain`) and recordings
//! (`record`), which add the forms of their own. A read beyond the end returns `None`. Nothing is
//! allocated.

/// The bytes that are not read yet.
pub(crate) struct ByteSource<'b>(pub &'b [u8]);

impl<'b> ByteSource<'b> {
    pub fn take(&mut self, count: usize) -> Option<&'b [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    pub fn byte(&mut self) -> Option<u8> {
        self.take(1).map(|bytes| bytes[0])
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.take(4)?.try_into().ok().map(u32::from_le_bytes)
    }

    pub fn i32(&mut self) -> Option<i32> {
        self.take(4)?.try_into().ok().map(i32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Option<u64> {
        self.take(8)?.try_into().ok().map(u64::from_le_bytes)
    }

    pub fn i64(&mut self) -> Option<i64> {
        self.take(8)?.try_into().ok().map(i64::from_le_bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::ByteSource;

    #[test]
    fn numbers_are_little_endian_and_end_with_the_bytes() {
        let mut bytes = ByteSource(&[1, 2, 0, 0, 0, 254, 255, 255, 255, 3]);
        assert_eq!((bytes.byte(), bytes.u32(), bytes.i32()), (Some(1), Some(2), Some(-2)));
        assert_eq!((bytes.u32(), bytes.u64(), bytes.take(2)), (None, None, None));
        assert_eq!((bytes.byte(), bytes.byte()), (Some(3), None));
    }
}
