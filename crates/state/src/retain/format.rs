//! Headers and slots as bytes, in the order of `docs/retain-format.md`.
//!
//! This module does no I/O. All numbers are little-endian.
//!
//! Two independent sums over the same bytes decide whether a slot is whole. The first is CRC-32, as
//! in zip and Ethernet; every language has it. It detects every single wrong bit, and every burst
//! of up to 32 bits. The second is a running sum. It lowers the chance that a mixture of two images
//! is accepted, by a factor of about 2^64. The sequence and scan number are at both ends of a slot,
//! so that the beginning of one image and the end of a different one do not match.

/// Headers and slots begin and end at multiples of this, which is a multiple of any sector's size.
pub(crate) const BLOCK_BYTES: usize = 4096;
/// The number of copies of the header. Each takes one block; the slots follow.
pub(crate) const HEADER_COPIES: usize = 2;
/// The version that this program reads and writes.
pub(crate) const VERSION: u32 = 1;
/// The maximum size of a slot.
pub(crate) const SLOT_BYTES_MAX: u32 = 64 << 20;
/// The maximum number of slots.
pub(crate) const SLOTS_MAX: u32 = 64;
/// The minimum number of slots: while one is written, a different one is known to be durable.
pub(crate) const SLOTS_LEAST: u32 = 3;
/// The number of slots in a new file.
pub(crate) const SLOTS_DEFAULT: u32 = 4;
/// Flag of an image that was written after an orderly stop and its termination passes.
pub const FLAG_FINAL: u32 = 1;

const MAGIC: [u8; 16] = *b"rungd retain\r\n\x1a\n";
const HEADER_BYTES: usize = 64;
const SLOT_MAGIC: [u8; 8] = *b"RETSLOT\n";
const HEAD_BYTES: usize = 64;
const TAIL_BYTES: usize = 32;
const TAIL_MAGIC: [u8; 4] = *b"END\n";

/// The division of a file into slots, and the identity of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Geometry {
    /// The size of one slot; a multiple of [`BLOCK_BYTES`].
    pub slot_bytes: u32,
    /// The number of slots.
    pub slots: u32,
    /// A number that no other file has. It marks the slots that belong to this file.
    pub id: u64,
}

/// The numbers of an image, without its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageStamp {
    /// The number of the image in its file, from 1 on. The newest image has the highest.
    pub sequence: u64,
    /// The number of complete scans of the process that wrote the image.
    pub scan: u64,
    /// The time of writing, in ms since 1970. The clock may be wrong, so nothing depends on it.
    pub saved_ms: u64,
    /// [`FLAG_FINAL`], or 0.
    pub flags: u32,
    /// The time of the scan, in ms since 1970 (UTC); 0 in an image of rungd 0.2, which is without.
    pub scanned_ms: u64,
}

impl ImageStamp {
    /// `$DownSeconds` of a process that starts at a time and restores the image: whole seconds
    /// since the scan; 0 if the clock went back.
    pub fn down_seconds(&self, start_ms: u64) -> i32 {
        down_seconds(self.scanned_ms, start_ms)
    }
}

/// Whole seconds from a scan to the start of a process, both in ms since 1970. 0 if the clock went
/// back, or if the time of the scan is 0, which is unknown.
pub fn down_seconds(scanned_ms: u64, start_ms: u64) -> i32 {
    let down_ms = if scanned_ms == 0 { 0 } else { start_ms.saturating_sub(scanned_ms) };
    i32::try_from(down_ms / 1000).unwrap_or(i32::MAX)
}

/// The reason why a file is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadHeader {
    /// The file is not of this kind.
    Foreign,
    /// The file has a later version, which this program does not know.
    Newer(u32),
    /// The file is of this kind, but both copies of its header are damaged.
    Damaged,
}

/// The reason why a slot has no usable image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadSlot {
    /// Nothing was written there yet.
    Empty,
    /// The slot is too short: the file was shortened.
    Cut,
    /// The slot holds something else.
    NoImage,
    /// The image belongs to a different file.
    OtherFile,
    /// The beginning of the image is damaged.
    Head,
    /// The image was not written completely, or was damaged later.
    Torn,
    /// The slot cannot be read.
    Unreadable,
}

impl Geometry {
    /// A geometry for contents of this length, with a quarter of it as reserve.
    pub fn for_content(content_bytes: usize, id: u64) -> Geometry {
        let wanted = slot_bytes(content_bytes + content_bytes / 4);
        Geometry { slot_bytes: wanted as u32, slots: SLOTS_DEFAULT, id }
    }

    /// The size of the whole file.
    pub fn file_bytes(&self) -> u64 {
        self.slot_at(self.slots as usize)
    }

    /// The offset of a slot in the file.
    pub fn slot_at(&self, slot: usize) -> u64 {
        (HEADER_COPIES * BLOCK_BYTES) as u64 + slot as u64 * u64::from(self.slot_bytes)
    }

    /// Whether a content of this length fits into a slot.
    pub(crate) fn fits(&self, content_bytes: usize) -> bool {
        slot_bytes(content_bytes) <= self.slot_bytes as usize
    }

    fn is_sane(&self) -> bool {
        self.slot_bytes >= BLOCK_BYTES as u32
            && (self.slot_bytes as usize).is_multiple_of(BLOCK_BYTES)
            && self.slot_bytes <= SLOT_BYTES_MAX
            && (SLOTS_LEAST..=SLOTS_MAX).contains(&self.slots)
    }
}

/// The size of an image with a content of this length, in whole blocks.
pub fn slot_bytes(content_bytes: usize) -> usize {
    let bytes = HEAD_BYTES + content_bytes.next_multiple_of(8) + TAIL_BYTES;
    bytes.next_multiple_of(BLOCK_BYTES)
}

/// One copy of the header, as a whole block.
pub(crate) fn header(geometry: &Geometry) -> Vec<u8> {
    let mut block = Vec::with_capacity(BLOCK_BYTES);
    block.extend_from_slice(&MAGIC);
    for number in [VERSION, geometry.slot_bytes, geometry.slots, 0] {
        block.extend_from_slice(&number.to_le_bytes());
    }
    block.extend_from_slice(&geometry.id.to_le_bytes());
    block.resize(HEADER_BYTES - 4, 0);
    block.extend_from_slice(&crc32fast::hash(&block).to_le_bytes());
    block.resize(BLOCK_BYTES, 0);
    block
}

/// The geometry in a file's first blocks, from the first undamaged copy of the header.
///
/// # Errors
/// [`BadHeader`].
pub(crate) fn read_header(blocks: &[u8]) -> Result<Geometry, BadHeader> {
    let copies = || blocks.chunks(BLOCK_BYTES).take(HEADER_COPIES);
    if let Some(geometry) = copies().find_map(header_copy) {
        return Ok(geometry);
    }
    let known = copies().filter(|copy| copy.len() >= HEADER_BYTES && copy.starts_with(&MAGIC));
    let newer = known.clone().map(|copy| u32_at(copy, 16)).filter(|version| *version > VERSION);
    match (newer.min(), known.count()) {
        (Some(version), _) => Err(BadHeader::Newer(version)),
        (None, 0) => Err(BadHeader::Foreign),
        (None, _) => Err(BadHeader::Damaged),
    }
}

fn header_copy(copy: &[u8]) -> Option<Geometry> {
    let copy = copy.get(..HEADER_BYTES)?;
    let geometry =
        Geometry { slot_bytes: u32_at(copy, 20), slots: u32_at(copy, 24), id: u64_at(copy, 32) };
    let whole = copy.starts_with(&MAGIC)
        && u32_at(copy, 16) == VERSION
        && u32_at(copy, HEADER_BYTES - 4) == crc32fast::hash(&copy[..HEADER_BYTES - 4]);
    (whole && geometry.is_sane()).then_some(geometry)
}

/// Writes an image to a buffer, as whole blocks for the beginning of a slot.
pub fn put_slot(into: &mut Vec<u8>, id: u64, stamp: &ImageStamp, content: &[u8]) {
    into.clear();
    into.extend_from_slice(&SLOT_MAGIC);
    for number in [id, stamp.sequence, stamp.scan, stamp.saved_ms] {
        into.extend_from_slice(&number.to_le_bytes());
    }
    into.extend_from_slice(&(content.len() as u32).to_le_bytes());
    into.extend_from_slice(&stamp.flags.to_le_bytes());
    into.extend_from_slice(&stamp.scanned_ms.to_le_bytes());
    into.resize(HEAD_BYTES - 4, 0);
    into.extend_from_slice(&crc32fast::hash(into).to_le_bytes());
    into.extend_from_slice(content);
    into.resize(HEAD_BYTES + content.len().next_multiple_of(8), 0);
    let sum = running_sum(into);
    for number in [stamp.sequence, stamp.scan, sum] {
        into.extend_from_slice(&number.to_le_bytes());
    }
    into.extend_from_slice(&crc32fast::hash(into).to_le_bytes());
    into.extend_from_slice(&TAIL_MAGIC);
    into.resize(into.len().next_multiple_of(BLOCK_BYTES), 0);
}

/// The stamp and the content of the image in a slot's bytes.
///
/// # Errors
/// [`BadSlot`].
pub fn read_slot(bytes: &[u8], id: u64) -> Result<(ImageStamp, &[u8]), BadSlot> {
    let head = bytes.get(..HEAD_BYTES).ok_or(BadSlot::Cut)?;
    if head.iter().all(|byte| *byte == 0) {
        return Err(BadSlot::Empty);
    }
    if !head.starts_with(&SLOT_MAGIC) {
        return Err(BadSlot::NoImage);
    }
    if u32_at(head, HEAD_BYTES - 4) != crc32fast::hash(&head[..HEAD_BYTES - 4]) {
        return Err(BadSlot::Head);
    }
    if u64_at(head, 8) != id {
        return Err(BadSlot::OtherFile);
    }
    let stamp = ImageStamp {
        sequence: u64_at(head, 16),
        scan: u64_at(head, 24),
        saved_ms: u64_at(head, 32),
        flags: u32_at(head, 44),
        scanned_ms: u64_at(head, 48),
    };
    let content_bytes = u32_at(head, 40) as usize;
    let tail_at = HEAD_BYTES + content_bytes.next_multiple_of(8);
    let tail = bytes.get(tail_at..tail_at + TAIL_BYTES).ok_or(BadSlot::Cut)?;
    let whole = tail[28..] == TAIL_MAGIC
        && (u64_at(tail, 0), u64_at(tail, 8)) == (stamp.sequence, stamp.scan)
        && u32_at(tail, 24) == crc32fast::hash(&bytes[..tail_at + 24])
        && u64_at(tail, 16) == running_sum(&bytes[..tail_at]);
    if !whole {
        return Err(BadSlot::Torn);
    }
    Ok((stamp, &bytes[HEAD_BYTES..HEAD_BYTES + content_bytes]))
}

/// Fletcher's sum over 32-bit words. The low half is the sum of the words. The high half is the sum
/// of all partial sums, so it depends on the position of each word.
fn running_sum(bytes: &[u8]) -> u64 {
    let (mut low, mut high) = (0_u32, 0_u32);
    for word in bytes.as_chunks().0 {
        low = low.wrapping_add(u32::from_le_bytes(*word));
        high = high.wrapping_add(low);
    }
    u64::from(high) << 32 | u64::from(low)
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from(u32_at(bytes, at + 4)) << 32 | u64::from(u32_at(bytes, at))
}

impl std::fmt::Display for BadSlot {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            BadSlot::Empty => "empty",
            BadSlot::Cut => "cut off: the file is shorter than it should be",
            BadSlot::NoImage => "no image",
            BadSlot::OtherFile => "an image of a different file",
            BadSlot::Head => "its beginning is damaged",
            BadSlot::Torn => "torn: begun and not completed, or damaged",
            BadSlot::Unreadable => "cannot be read",
        })
    }
}

impl std::fmt::Display for BadHeader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            BadHeader::Foreign => f.write_str("it is not a file of retentive memory"),
            BadHeader::Newer(version) => write!(
                f,
                "it has version {version}, and this rungd reads version {VERSION}: a later rungd \
                 wrote it"
            ),
            BadHeader::Damaged => f.write_str("both copies of its header are damaged"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GEOMETRY: Geometry = Geometry { slot_bytes: 8192, slots: 4, id: 7 };

    fn stamp() -> ImageStamp {
        ImageStamp { sequence: 3, scan: 99, saved_ms: 5, flags: FLAG_FINAL, scanned_ms: 4 }
    }

    #[test]
    fn a_header_is_read_from_either_copy() {
        let mut blocks = [header(&GEOMETRY), header(&GEOMETRY)].concat();
        assert_eq!(read_header(&blocks), Ok(GEOMETRY));
        blocks[30] ^= 1;
        assert_eq!(read_header(&blocks), Ok(GEOMETRY));
        blocks[BLOCK_BYTES + 20] ^= 1;
        assert_eq!(read_header(&blocks), Err(BadHeader::Damaged));
        assert_eq!(read_header(b"hello"), Err(BadHeader::Foreign));
        assert_eq!(read_header(&[]), Err(BadHeader::Foreign));
    }

    #[test]
    fn the_first_valid_header_counts_and_sizes_out_of_range_are_invalid() {
        let other = Geometry { id: 8, ..GEOMETRY };
        assert_eq!(read_header(&[header(&GEOMETRY), header(&other)].concat()), Ok(GEOMETRY));
        for (slot_bytes, slots) in
            [(0, 4), (4095, 4), (8192, 2), (8192, 65), (SLOT_BYTES_MAX * 2, 4)]
        {
            let wrong = Geometry { slot_bytes, slots, id: 7 };
            assert_eq!(read_header(&[header(&wrong), header(&other)].concat()), Ok(other));
        }
    }

    #[test]
    fn the_time_without_a_process_is_in_whole_seconds_and_never_negative() {
        let stamp = ImageStamp { scanned_ms: 5_500, ..stamp() };
        for (start_ms, seconds) in
            [(0, 0), (5_500, 0), (6_499, 0), (6_500, 1), (125_499, 119), (u64::MAX, i32::MAX)]
        {
            assert_eq!(stamp.down_seconds(start_ms), seconds, "{start_ms}");
        }
        let of_0_2 = ImageStamp { scanned_ms: 0, ..stamp };
        assert_eq!(of_0_2.down_seconds(1_795_000_000_000), 0);
    }

    #[test]
    fn a_later_version_is_reported_as_newer() {
        let mut blocks = [header(&GEOMETRY), header(&GEOMETRY)].concat();
        blocks[16] = 2;
        assert_eq!(read_header(&blocks), Ok(GEOMETRY), "one copy is damaged");
        blocks[BLOCK_BYTES + 16] = 2;
        assert_eq!(read_header(&blocks), Err(BadHeader::Newer(2)));
    }

    #[test]
    fn an_image_is_read_back_and_any_flipped_bit_is_detected() {
        for length in [0, 1, 7, 8, 100, 5000] {
            let content: Vec<u8> = (0..length).map(|n| n as u8).collect();
            let mut slot = Vec::new();
            put_slot(&mut slot, 7, &stamp(), &content);
            assert_eq!(slot.len(), slot_bytes(length));
            assert_eq!(read_slot(&slot, 7), Ok((stamp(), &content[..])));
            assert_eq!(read_slot(&slot, 8), Err(BadSlot::OtherFile));
            let end = HEAD_BYTES + length.next_multiple_of(8) + TAIL_BYTES;
            for at in 0..end {
                slot[at] ^= 1 << (at % 8);
                assert!(read_slot(&slot, 7).is_err(), "byte {at} of {length}");
                slot[at] ^= 1 << (at % 8);
            }
            for cut in 0..end {
                assert!(read_slot(&slot[..cut], 7).is_err(), "cut at {cut} of {length}");
            }
        }
        assert_eq!(read_slot(&[0; 8192], 7), Err(BadSlot::Empty));
    }
}
