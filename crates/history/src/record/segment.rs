//! A segment as bytes: a program, then blocks. A recording is a sequence of segments.
//!
//! `recent` and the store append segments and blocks; `segment_read` reads them.
//! `docs/record-format.md` describes the layout under *Segments* and *Blocks*. A checksum covers
//! every byte.

use super::block::{BlockHead, RecordBlock};
use super::program::RecordedProgram;

/// The first bytes of a segment.
pub(super) const MAGIC: &[u8; 16] = b"rungd record\r\n\x1A\n";

/// The version of the format.
pub const VERSION: u32 = 1;

/// The number of bytes of a segment before its program.
pub(super) const SEGMENT_HEAD_BYTES: usize = 32;

/// The first bytes of a block.
pub(super) const BLOCK_MARK: &[u8; 4] = b"BLCK";

/// The number of bytes of a block before its base image.
pub(super) const BLOCK_HEAD_BYTES: usize = 76;

/// The maximum number of bytes of a base image before packing.
pub(super) const BASE_BYTES_MAX: usize = 1 << 26;

/// The flags of a block.
pub(super) mod block_flag {
    pub const FOLLOWS: u32 = 1;
    pub const END_HASH: u32 = 2;
}

/// The beginning of a segment.
#[derive(Clone, Debug)]
pub struct SegmentStart {
    /// Its head and its program.
    pub bytes: Vec<u8>,
    /// The checksum of its head. The checksums of its blocks start from it, so that a block cannot
    /// be taken for a block of a different program.
    pub sum: u32,
}

impl SegmentStart {
    /// The beginning of a segment of a program.
    pub fn new(program: &RecordedProgram) -> SegmentStart {
        let program = program.write();
        let mut bytes = MAGIC.to_vec();
        let length = u32::try_from(program.len()).expect("a program is shorter than 4 GiB");
        for number in [VERSION, length, crc32fast::hash(&program)] {
            bytes.extend(number.to_le_bytes());
        }
        let sum = crc32fast::hash(&bytes);
        bytes.extend(sum.to_le_bytes());
        bytes.extend(program);
        SegmentStart { bytes, sum }
    }
}

impl RecordBlock {
    /// Appends the block, with its base image or without it. `segment_sum`: the checksum of the
    /// start of its segment.
    pub fn write(&self, segment_sum: u32, with_base: bool, out: &mut Vec<u8>) {
        let base = self.base.as_deref().filter(|_| with_base).unwrap_or_default();
        let mut sum = crc32fast::Hasher::new();
        sum.update(base);
        sum.update(&self.section);
        let mut head = head(&self.head, [base.len(), self.section.len()], sum.finalize());
        let mut sum = crc32fast::Hasher::new_with_initial(segment_sum);
        sum.update(&head);
        head.extend(sum.finalize().to_le_bytes());
        out.extend_from_slice(&head);
        out.extend_from_slice(base);
        out.extend_from_slice(&self.section);
    }

    /// The number of bytes that [`RecordBlock::write`] appends.
    pub fn bytes(&self, with_base: bool) -> usize {
        let base = self.base.as_ref().filter(|_| with_base).map_or(0, Vec::len);
        BLOCK_HEAD_BYTES + base + self.section.len()
    }
}

/// The head of a block with parts of these lengths, without its checksum.
fn head(head: &BlockHead, lengths: [usize; 2], sum: u32) -> Vec<u8> {
    let mut out = BLOCK_MARK.to_vec();
    for length in lengths {
        let length = u32::try_from(length).expect("a block is shorter than 4 GiB");
        out.extend(length.to_le_bytes());
    }
    out.extend(head.scans.to_le_bytes());
    out.extend(head.sequence.to_le_bytes());
    out.extend(head.number.to_le_bytes());
    out.extend(head.begin_ns.to_le_bytes());
    out.extend(head.end_ns.to_le_bytes());
    let follows = if head.follows { block_flag::FOLLOWS } else { 0 };
    let hashed = if head.end_hash.is_some() { block_flag::END_HASH } else { 0 };
    out.extend((follows | hashed).to_le_bytes());
    out.extend(head.end_hash.unwrap_or_default());
    out.extend(sum.to_le_bytes());
    out
}
