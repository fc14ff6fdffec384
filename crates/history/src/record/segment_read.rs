//! Reads a file of segments: its programs and the heads of its blocks, by a jump from block to
//! block. Reads single blocks on demand.
//!
//! `recording` keeps the index. Data with a wrong checksum is not used. After a damaged place, the
//! reader searches the next whole head. It distinguishes damage from the end of a file that was cut
//! off by a power failure.

use std::fmt;
use std::io::{self, Read, Seek, SeekFrom};
use std::sync::Arc;

use super::block::BlockHead;
use super::codes::SECTION_BYTES_MAX;
use super::passed::PassedTime;
use super::program::RecordedProgram;
use super::program_read::{PROGRAM_BYTES_MAX, ProgramTexts};
use super::section::SectionBody;
use super::segment::{
    BASE_BYTES_MAX, BLOCK_HEAD_BYTES, BLOCK_MARK, MAGIC, SEGMENT_HEAD_BYTES, VERSION, block_flag,
};
use super::zip::unpacked;
use rungd_base::byte_source::ByteSource;
use rungd_engine::EngineState;

/// The number of bytes that are read at a time after a damaged place.
const SEARCH_BYTES: u64 = 1 << 16;

/// The index of a file.
#[derive(Clone, Debug, Default)]
pub struct FileIndex {
    /// The blocks, in the order of the file.
    pub blocks: Vec<IndexedBlock>,
    /// The flaws of the file, in the order of the file.
    pub flaws: Vec<Flaw>,
}

/// A block in a file.
#[derive(Clone, Debug)]
pub struct IndexedBlock {
    /// Its program.
    pub program: Arc<RecordedProgram>,
    /// Its head.
    pub head: BlockHead,
    /// Whether it has a base image.
    pub has_base: bool,
    /// The place of its parts.
    at: u64,
    lengths: [u32; 2],
    sum: u32,
}

/// The program that was read last, with its packed bytes. The same bytes are not unpacked again.
/// Used for repeated reads of the newest part of a recording.
#[derive(Clone, Debug, Default)]
pub struct LastProgram(Option<(Vec<u8>, Arc<RecordedProgram>)>);

impl LastProgram {
    /// The program that is packed in these bytes; `None`: the bytes are not a program, or the texts
    /// are too many.
    fn read(&mut self, packed: Vec<u8>, texts: &mut ProgramTexts) -> Option<Arc<RecordedProgram>> {
        if let Some((_, program)) = self.0.as_ref().filter(|(bytes, _)| *bytes == packed) {
            return Some(Arc::clone(program));
        }
        let program = Arc::new(texts.read(&packed)?);
        self.0 = Some((packed, Arc::clone(&program)));
        Some(program)
    }
}

/// Reads the files of one recording: equal programs and texts are kept once, and all of them are
/// within one limit.
pub(super) struct RecordIndexer<'l> {
    pub last: &'l mut LastProgram,
    pub texts: ProgramTexts,
}

/// A flaw of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flaw {
    /// It ends within the beginning of a segment or within a block, as after a power cut.
    Torn {
        /// The start of that part, in bytes from the start of the file.
        at: u64,
    },
    /// Bytes have changed since they were written.
    Damaged {
        /// The start of these bytes, in bytes from the start of the file.
        at: u64,
    },
    /// A program that no rungd has written, or too many programs for one recording.
    Program {
        /// The start of its segment, in bytes from the start of the file.
        at: u64,
    },
    /// Not a regular file: it was not read.
    NotAFile,
    /// A segment of a later version of the format.
    Later {
        /// Its version.
        version: u32,
    },
}

impl fmt::Display for Flaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Flaw::Torn { at } => {
                write!(f, "it ends within a block, at byte {at}, as after a power cut")
            }
            Flaw::Damaged { at } => write!(f, "the bytes from {at} on are damaged"),
            Flaw::Program { at } => write!(
                f,
                "the program at byte {at} is not one of rungd, or it and those before it are \
                 larger than {} MB together: its scans are left out",
                PROGRAM_BYTES_MAX >> 20
            ),
            Flaw::NotAFile => write!(f, "it is not a regular file, and was not read"),
            Flaw::Later { version } => write!(f, "a later rungd wrote it (version {version})"),
        }
    }
}

/// A part of a file, by its head.
enum HeadedPart {
    Segment { length: u32, sum: u32, version: u32, head_sum: u32 },
    Block(BlockHead, [u32; 2], u32),
}

/// Reads programs and heads.
///
/// # Errors
/// The error of the source. Errors in its bytes are in the flaws of the index.
pub fn index(source: &mut (impl Read + Seek)) -> io::Result<FileIndex> {
    let last = &mut LastProgram::default();
    RecordIndexer { last, texts: ProgramTexts::all() }.index(source)
}

impl RecordIndexer<'_> {
    /// Reads the programs and heads of the next file.
    ///
    /// # Errors
    /// The error of the source.
    pub fn index(&mut self, source: &mut (impl Read + Seek)) -> io::Result<FileIndex> {
        let size = source.seek(SeekFrom::End(0))?;
        let RecordIndexer { last, texts } = self;
        let mut indexer = Indexer { source, size, at: 0, segment: None, programs: (last, texts) };
        let mut index = FileIndex::default();
        while indexer.at < indexer.size {
            indexer.part(&mut index)?;
        }
        Ok(index)
    }
}

/// The time that is recorded in a file, ns, up to its first flaw. Reads heads only.
///
/// # Errors
/// The error of the source.
pub fn passed_ns(source: &mut (impl Read + Seek)) -> io::Result<u64> {
    let size = source.seek(SeekFrom::End(0))?;
    let (mut at, mut segment_sum, mut passed) = (0, None, PassedTime::default());
    while at < size {
        let mut head = vec![0; (size - at).min(BLOCK_HEAD_BYTES as u64) as usize];
        read_at(source, at, &mut head)?;
        at += match part(&head, segment_sum) {
            Some(HeadedPart::Segment { length, head_sum, .. }) => {
                segment_sum = Some(head_sum);
                SEGMENT_HEAD_BYTES as u64 + u64::from(length)
            }
            Some(HeadedPart::Block(head, lengths, _)) => {
                passed.add(&head);
                let [base, section] = lengths.map(u64::from);
                BLOCK_HEAD_BYTES as u64 + base + section
            }
            None => break,
        };
    }
    Ok(passed.ns())
}

struct Indexer<'s, S> {
    source: &'s mut S,
    size: u64,
    at: u64,
    /// The program of the segment, and the checksum of its head; `None` if they are unknown.
    segment: Option<(Arc<RecordedProgram>, u32)>,
    programs: (&'s mut LastProgram, &'s mut ProgramTexts),
}

impl<S: Read + Seek> Indexer<'_, S> {
    /// Reads the part at `at`, and moves `at` to its end.
    fn part(&mut self, index: &mut FileIndex) -> io::Result<()> {
        let rest = self.size - self.at;
        let mut head = vec![0; rest.min(BLOCK_HEAD_BYTES as u64) as usize];
        read_at(self.source, self.at, &mut head)?;
        match part(&head, self.segment_sum()) {
            Some(HeadedPart::Segment { length, sum, version, head_sum }) => {
                let begin = self.at + SEGMENT_HEAD_BYTES as u64;
                let end = begin + u64::from(length);
                if end > self.size {
                    return self.flaw(Flaw::Torn { at: self.at }, self.size, index);
                }
                self.segment = None;
                if version != VERSION {
                    return self.flaw(Flaw::Later { version }, end, index);
                }
                let mut program = vec![0; length as usize];
                read_at(self.source, begin, &mut program)?;
                let whole = crc32fast::hash(&program) == sum;
                let (last, texts) = &mut self.programs;
                let Some(program) = whole.then(|| last.read(program, texts)).flatten() else {
                    let at = self.at;
                    let flaw = if whole { Flaw::Program { at } } else { Flaw::Damaged { at } };
                    return self.flaw(flaw, end, index);
                };
                self.segment = Some((program, head_sum));
                self.at = end;
            }
            Some(HeadedPart::Block(head, lengths, sum)) => {
                let begin = self.at + BLOCK_HEAD_BYTES as u64;
                let end = begin + lengths.iter().map(|length| u64::from(*length)).sum::<u64>();
                if end > self.size {
                    return self.flaw(Flaw::Torn { at: self.at }, self.size, index);
                }
                if let Some((program, _)) = self.segment.clone() {
                    let (at, has_base) = (begin, lengths[0] > 0);
                    index.blocks.push(IndexedBlock { program, head, has_base, at, lengths, sum });
                }
                self.at = end;
            }
            None => return self.behind_damage(&head, index),
        }
        Ok(())
    }

    fn segment_sum(&self) -> Option<u32> {
        self.segment.as_ref().map(|(_, sum)| *sum)
    }

    fn flaw(&mut self, flaw: Flaw, go_on_at: u64, index: &mut FileIndex) -> io::Result<()> {
        index.flaws.push(flaw);
        self.at = go_on_at;
        Ok(())
    }

    /// Moves `at` to the next whole head.
    fn behind_damage(&mut self, head: &[u8], index: &mut FileIndex) -> io::Result<()> {
        let (at, is_short) = (self.at, self.size - self.at < whole_head_bytes(head) as u64);
        let mut only_zeros = head.iter().all(|byte| *byte == 0);
        let mut from = at + 1;
        let mut found = None;
        while found.is_none() && from < self.size {
            let mut bytes = vec![0; SEARCH_BYTES.min(self.size - from) as usize];
            read_at(self.source, from, &mut bytes)?;
            only_zeros &= bytes.iter().all(|byte| *byte == 0);
            let sum = self.segment_sum();
            let place = (0..bytes.len()).find(|place| part(&bytes[*place..], sum).is_some());
            found = place.map(|place| from + place as u64);
            // A head may cross the end of these bytes.
            let is_last = from + bytes.len() as u64 == self.size;
            from += if is_last { SEARCH_BYTES } else { SEARCH_BYTES - BLOCK_HEAD_BYTES as u64 };
        }
        // A power cut leaves a part of a head, or bytes that were never written.
        let is_torn = found.is_none() && (only_zeros || is_short);
        let flaw = if is_torn { Flaw::Torn { at } } else { Flaw::Damaged { at } };
        self.flaw(flaw, found.unwrap_or(self.size), index)
    }
}

/// The number of bytes of a head with this beginning.
fn whole_head_bytes(head: &[u8]) -> usize {
    let count = head.len().min(4);
    if head[..count] == MAGIC[..count] { SEGMENT_HEAD_BYTES } else { BLOCK_HEAD_BYTES }
}

/// The head at the beginning of bytes, if it is whole: the head of a segment, or of a block in the
/// segment with this checksum.
fn part(bytes: &[u8], segment_sum: Option<u32>) -> Option<HeadedPart> {
    let mark = bytes.get(..4)?;
    if mark == BLOCK_MARK { block_head(bytes, segment_sum?) } else { segment_head(bytes) }
}

/// Whether the last four of these bytes are the checksum of the others.
fn is_whole(bytes: &[u8], initial: u32) -> bool {
    let (head, sum) = bytes.split_at(bytes.len() - 4);
    let mut hasher = crc32fast::Hasher::new_with_initial(initial);
    hasher.update(head);
    hasher.finalize().to_le_bytes() == sum
}

fn segment_head(bytes: &[u8]) -> Option<HeadedPart> {
    let bytes = bytes.get(..SEGMENT_HEAD_BYTES)?;
    if !bytes.starts_with(MAGIC) || !is_whole(bytes, 0) {
        return None;
    }
    let mut bytes = ByteSource(&bytes[MAGIC.len()..]);
    let (version, length, sum) = (bytes.u32()?, bytes.u32()?, bytes.u32()?);
    Some(HeadedPart::Segment { length, sum, version, head_sum: bytes.u32()? })
}

fn block_head(bytes: &[u8], segment_sum: u32) -> Option<HeadedPart> {
    let bytes = bytes.get(..BLOCK_HEAD_BYTES)?;
    if !is_whole(bytes, segment_sum) {
        return None;
    }
    let mut bytes = ByteSource(&bytes[BLOCK_MARK.len()..]);
    let lengths = [bytes.u32()?, bytes.u32()?];
    let scans = bytes.u32()?;
    let (sequence, number) = (bytes.u64()?, bytes.u64()?);
    let (begin_ns, end_ns) = (bytes.i64()?, bytes.i64()?);
    let flags = bytes.u32()?;
    let hash = bytes.take(16)?.try_into().ok()?;
    let end_hash = (flags & block_flag::END_HASH != 0).then_some(hash);
    let follows = flags & block_flag::FOLLOWS != 0;
    let sum = bytes.u32()?;
    let head = BlockHead { sequence, number, scans, begin_ns, end_ns, follows, end_hash };
    Some(HeadedPart::Block(head, lengths, sum))
}

fn read_at(source: &mut (impl Read + Seek), at: u64, into: &mut [u8]) -> io::Result<()> {
    source.seek(SeekFrom::Start(at))?;
    source.read_exact(into)
}

impl IndexedBlock {
    /// The block's base image, if it has one, and its section; `None`: the block is damaged.
    ///
    /// # Errors
    /// The error of the source.
    pub fn read(
        &self,
        source: &mut (impl Read + Seek),
    ) -> io::Result<Option<(Option<EngineState>, SectionBody)>> {
        let [base, section] = self.lengths.map(|length| length as usize);
        let mut bytes = vec![0; base + section];
        read_at(source, self.at, &mut bytes)?;
        Ok(self.parts(&bytes, base))
    }

    fn parts(&self, bytes: &[u8], base: usize) -> Option<(Option<EngineState>, SectionBody)> {
        if crc32fast::hash(bytes) != self.sum {
            return None;
        }
        let (base, section) = bytes.split_at(base);
        let state = match base {
            [] => None,
            base => Some(EngineState::read(&unpacked(base, BASE_BYTES_MAX)?)?),
        };
        Some((state, SectionBody::read(&unpacked(section, SECTION_BYTES_MAX)?)?))
    }

    /// The bytes of the block in the file, with its head.
    ///
    /// # Errors
    /// The error of the source.
    pub fn bytes(&self, source: &mut (impl Read + Seek)) -> io::Result<Vec<u8>> {
        let parts: usize = self.lengths.iter().map(|length| *length as usize).sum();
        let mut bytes = vec![0; BLOCK_HEAD_BYTES + parts];
        read_at(source, self.at - BLOCK_HEAD_BYTES as u64, &mut bytes)?;
        Ok(bytes)
    }
}
