//! Reads a recording: a file or a folder of segments, or bytes of memory. Finds its sections by
//! time or scan.
//!
//! `playback` executes a recording, `cli` lists and cuts it. Opening reads only the heads. Sections
//! are in the order of their times; the file names do not matter.

use std::cmp::Reverse;
use std::fs;
use std::io::{self, Cursor, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::block::BlockHead;
use super::file_name::{EXTENSION, begun_ns};
use super::folder::open_file;
use super::program::RecordedProgram;
use super::program_read::ProgramTexts;
use super::section::SectionBody;
use super::segment::{BLOCK_HEAD_BYTES, SegmentStart};
use super::segment_read::{FileIndex, Flaw, IndexedBlock, LastProgram, RecordIndexer};
use rungd_engine::EngineState;
use rungd_runtime::SectionStart;

/// A recording.
#[derive(Debug, Default)]
pub struct Recording {
    sources: Vec<RecordSource>,
    sections: Vec<RecordedSection>,
    /// The flaws of its files, each with the path of the file.
    pub flaws: Vec<(PathBuf, Flaw)>,
}

/// The place of segments.
#[derive(Debug)]
enum RecordSource {
    File(PathBuf),
    Bytes(Vec<u8>),
}

/// The place of a section.
#[derive(Debug)]
struct RecordedSection {
    source: usize,
    block: IndexedBlock,
    /// Whether it continues the section before it in this recording without a gap.
    follows: bool,
    /// The nearest section with a base image from which this section can be reached.
    base: Option<usize>,
}

/// A section that was read: its state, if it has a base image, and its content.
pub type ReadSection = (Option<EngineState>, SectionBody);

/// The folder in which a controller records.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedFolder {
    /// The folder.
    pub dir: PathBuf,
    /// The controller's name. The names of its files begin with it.
    pub controller: String,
}

impl Recording {
    /// Opens a file of segments, or all files of segments in a folder.
    ///
    /// # Errors
    /// The error of the system.
    pub fn open(path: &Path) -> io::Result<Recording> {
        Recording::open_with(path, ProgramTexts::all())
    }

    /// As [`Recording::open`], without the texts of the programs: for lists. It cannot be executed.
    ///
    /// # Errors
    /// The error of the system.
    pub fn open_heads(path: &Path) -> io::Result<Recording> {
        Recording::open_with(path, ProgramTexts::names())
    }

    fn open_with(path: &Path, texts: ProgramTexts) -> io::Result<Recording> {
        let mut paths = Vec::new();
        if fs::metadata(path)?.is_dir() {
            for entry in fs::read_dir(path)? {
                paths.push(entry?.path());
            }
            paths.retain(|path| path.extension().is_some_and(|end| end == EXTENSION));
            paths.sort();
        } else {
            paths.push(path.to_owned());
        }
        let mut indexes = Vec::new();
        let last = &mut LastProgram::default();
        let mut indexer = RecordIndexer { last, texts };
        for path in &paths {
            match open_file(path) {
                Ok(mut file) => indexes.push((path.clone(), indexer.index(&mut file)?)),
                Err(error) if paths.len() > 1 => {
                    indexes.extend(excused(error)?.map(|index| (path.clone(), index)));
                }
                Err(error) => return Err(error),
            }
        }
        let sources = indexes.iter().map(|(path, _)| RecordSource::File(path.clone())).collect();
        Ok(Recording::new(sources, indexes))
    }

    /// The recording of one controller: the files of its folder with scans after a time, ns since
    /// 1970 (UTC), and the recording in its memory, as `Recent` writes it.
    ///
    /// # Errors
    /// The error of the system.
    pub fn of_controller(
        folder: Option<&RecordedFolder>,
        from_ns: i64,
        memory: Vec<u8>,
    ) -> io::Result<Recording> {
        let (mut sources, mut indexes) = (Vec::new(), Vec::new());
        let last = &mut LastProgram::default();
        let mut indexer = RecordIndexer { last, texts: ProgramTexts::all() };
        for path in folder.map_or(Ok(Vec::new()), |folder| own_files(folder, from_ns))? {
            let index = match open_file(&path) {
                Ok(mut file) => Some(indexer.index(&mut file)?),
                Err(error) => excused(error)?,
            };
            let Some(index) = index else { continue };
            indexes.push((path.clone(), index));
            sources.push(RecordSource::File(path));
        }
        let of_memory = indexer.index(&mut Cursor::new(&memory[..]))?;
        indexes.push((PathBuf::new(), of_memory));
        sources.push(RecordSource::Bytes(memory));
        Ok(Recording::new(sources, indexes))
    }

    /// A recording in memory, as `Recent` writes it.
    pub fn of_bytes(bytes: Vec<u8>) -> Recording {
        Recording::newest(bytes, &mut LastProgram::default())
    }

    /// As [`Recording::of_bytes`], for repeated reads of the newest part of a recording: a program
    /// that is in `last` is not unpacked again.
    pub fn newest(bytes: Vec<u8>, last: &mut LastProgram) -> Recording {
        let mut indexer = RecordIndexer { last, texts: ProgramTexts::all() };
        let index = indexer.index(&mut Cursor::new(&bytes[..])).expect("memory can be read");
        Recording::new(vec![RecordSource::Bytes(bytes)], vec![(PathBuf::new(), index)])
    }

    fn new(sources: Vec<RecordSource>, indexes: Vec<(PathBuf, FileIndex)>) -> Recording {
        let (mut sections, mut flaws) = (Vec::new(), Vec::new());
        for (source, (path, index)) in indexes.into_iter().enumerate() {
            flaws.extend(index.flaws.into_iter().map(|flaw| (path.clone(), flaw)));
            let section = |block| RecordedSection { source, block, follows: false, base: None };
            sections.extend(index.blocks.into_iter().map(section));
        }
        let place = |section: &RecordedSection| {
            (section.block.program.process_start_ns, section.block.head.sequence)
        };
        // If a section has two copies, the copy with a base image is kept.
        sections.sort_by_key(|section| (place(section), Reverse(section.block.has_base)));
        sections.dedup_by_key(|section| place(section));
        let mut before: Option<&RecordedSection> = None;
        for (at, section) in sections.iter_mut().enumerate() {
            if let Some(before) = before {
                let (process, sequence) = place(before);
                let follows = place(section) == (process, sequence.wrapping_add(1));
                section.follows = follows && section.block.head.follows;
            }
            let is_same = |before: &&RecordedSection| before.block.program == section.block.program;
            section.base = if section.block.has_base {
                Some(at)
            } else {
                before.filter(is_same).filter(|_| section.follows).and_then(|before| before.base)
            };
            before = Some(section);
        }
        Recording { sources, sections, flaws }
    }

    /// The number of sections.
    pub fn count(&self) -> usize {
        self.sections.len()
    }

    /// The size of its files in bytes.
    pub fn bytes(&self) -> u64 {
        let bytes = |source: &RecordSource| match source {
            RecordSource::File(path) => fs::metadata(path).map_or(0, |facts| facts.len()),
            RecordSource::Bytes(bytes) => bytes.len() as u64,
        };
        self.sources.iter().map(bytes).sum()
    }

    /// The head of a section.
    pub fn head(&self, at: usize) -> &BlockHead {
        &self.sections[at].block.head
    }

    /// The program of a section.
    pub fn program(&self, at: usize) -> &Arc<RecordedProgram> {
        &self.sections[at].block.program
    }

    /// Whether a section continues the section before it in this recording without a gap. A swap of
    /// programs may lie between the two.
    pub fn follows(&self, at: usize) -> bool {
        self.sections[at].follows
    }

    /// Whether a section has a base image.
    pub fn has_base(&self, at: usize) -> bool {
        self.sections[at].block.has_base
    }

    /// The nearest section with a base image from which this section can be reached.
    pub fn base_of(&self, at: usize) -> Option<usize> {
        self.sections[at].base
    }

    /// The section that contains a time, ns since 1970 (UTC), or the last section before that time.
    pub fn place_of_time(&self, unix_ns: i64) -> Option<usize> {
        self.sections.iter().rposition(|section| section.block.head.begin_ns <= unix_ns)
    }

    /// The section that contains a scan; if several processes have it, the section of the newest
    /// process.
    pub fn place_of_scan(&self, number: u64) -> Option<usize> {
        self.sections.iter().rposition(
            |RecordedSection { block: IndexedBlock { head, .. }, .. }| {
                (head.number..head.number.saturating_add(head.scans.into())).contains(&number)
            },
        )
    }

    /// The start of a section.
    pub fn start(&self, at: usize, body: &SectionBody) -> SectionStart {
        SectionStart {
            generation: self.program(at).generation,
            number: self.head(at).number,
            mode: body.mode,
            unix_offset_ns: body.unix_offset_ns,
            lost: body.lost,
            follows: self.follows(at),
        }
    }

    /// Reads a section; `None`: it is damaged.
    ///
    /// # Errors
    /// The error of the system.
    pub fn read(&self, at: usize) -> io::Result<Option<ReadSection>> {
        let RecordedSection { source, block, .. } = &self.sections[at];
        match &self.sources[*source] {
            RecordSource::File(path) => block.read(&mut open_file(path)?),
            RecordSource::Bytes(bytes) => block.read(&mut Cursor::new(&bytes[..])),
        }
    }

    /// Writes a part of the recording as a separate file. The file begins with a base image, and
    /// therefore perhaps with an earlier section.
    ///
    /// # Errors
    /// The error of the system.
    pub fn cut(&self, range: Range<usize>, out: &mut impl Write) -> io::Result<()> {
        let Some(first) = range.clone().find_map(|at| self.base_of(at)) else { return Ok(()) };
        let mut segment: Option<(&Arc<RecordedProgram>, SegmentStart)> = None;
        for at in first..range.end {
            let program = self.program(at);
            let start = match segment {
                Some((known_program, start)) if known_program == program => start,
                Some(_) | None => {
                    let start = SegmentStart::new(program);
                    out.write_all(&start.bytes)?;
                    start
                }
            };
            let mut bytes = self.block_bytes(at)?;
            put_head_sum(&mut bytes[..BLOCK_HEAD_BYTES], start.sum);
            out.write_all(&bytes)?;
            segment = Some((program, start));
        }
        Ok(())
    }

    fn block_bytes(&self, at: usize) -> io::Result<Vec<u8>> {
        let RecordedSection { source, block, .. } = &self.sections[at];
        match &self.sources[*source] {
            RecordSource::File(path) => block.bytes(&mut open_file(path)?),
            RecordSource::Bytes(bytes) => block.bytes(&mut Cursor::new(&bytes[..])),
        }
    }
}

/// The index of one of several files that could not be opened; `None` if it is gone.
///
/// # Errors
/// All other errors.
fn excused(error: io::Error) -> io::Result<Option<FileIndex>> {
    if error.kind() == io::ErrorKind::NotFound {
        // The oldest file may just have been deleted.
        return Ok(None);
    }
    if error.kind() == io::ErrorKind::InvalidInput {
        return Ok(Some(FileIndex { flaws: vec![Flaw::NotAFile], ..FileIndex::default() }));
    }
    Err(error)
}

/// The files of a controller in a folder with scans after a time, in the order of their start
/// times: the newest file that starts before that time, and all later files.
fn own_files(folder: &RecordedFolder, from_ns: i64) -> io::Result<Vec<PathBuf>> {
    let RecordedFolder { dir, controller } = folder;
    let mut files = Vec::new();
    for entry in fs::read_dir(dir)? {
        let path = entry?.path();
        let name = path.file_name().and_then(|name| name.to_str());
        if let Some(begun_ns) = name.and_then(|name| begun_ns(controller, name)) {
            files.push((begun_ns, path));
        }
    }
    files.sort();
    let first = files.iter().rposition(|(begun_ns, _)| *begun_ns <= from_ns).unwrap_or(0);
    Ok(files.into_iter().skip(first).map(|(_, path)| path).collect())
}

/// Changes the checksum of a block's head, so that it belongs to the segment with this checksum.
fn put_head_sum(head: &mut [u8], segment_sum: u32) {
    let (head, sum) = head.split_at_mut(BLOCK_HEAD_BYTES - 4);
    let mut hasher = crc32fast::Hasher::new_with_initial(segment_sum);
    hasher.update(head);
    sum.copy_from_slice(&hasher.finalize().to_le_bytes());
}
