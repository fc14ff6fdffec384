//! zlib with a size limit. It packs programs, sections and base images.
//!
//! Bytes from outside may unpack to any size; the reader stops at the limit.

use std::io::{Read, Write};

use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;

/// Packs bytes.
pub(super) fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).expect("a Vec takes all");
    encoder.finish().expect("a Vec takes all")
}

/// Unpacks bytes; `None`: they are not packed bytes, bytes are left over, or the result is longer
/// than `limit`.
pub(super) fn unpacked(bytes: &[u8], limit: usize) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    let mut decoder = ZlibDecoder::new(bytes);
    decoder.by_ref().take(limit as u64 + 1).read_to_end(&mut out).ok()?;
    (out.len() <= limit && decoder.total_in() == bytes.len() as u64).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_beyond_the_size_limit_is_not_unpacked() {
        let zeros = vec![0; 1 << 20];
        let packed = packed(&zeros);
        assert!(packed.len() < 2000);
        assert_eq!(unpacked(&packed, 1 << 20), Some(zeros));
        assert_eq!(unpacked(&packed, (1 << 20) - 1), None);
        assert_eq!(unpacked(&packed[..packed.len() - 1], 1 << 20), None);
        let more = [&packed[..], &[0]].concat();
        assert_eq!(unpacked(&more, 1 << 20), None);
    }
}
