//! The store: writes blocks into files of segments, and keeps their folder within its limits.
//!
//! The daemon's thread passes it every block. The store reports once that the disk has failed, and
//! once that it works again. After a failure, at the start of a process, and if its file was
//! removed or replaced, it begins a new file; it never appends to an older one. It deletes only
//! files of this controller, the oldest first (`stored_files`). [`Store::put`] does not wait for
//! the disk to make a block durable: the caller writes all blocks that wait, then calls
//! [`Store::tick`] once.
//! While another process owns the files of this name, nothing is written. Deliberately absent:
//! threads, clocks, and the log of the daemon.

use std::io;
use std::sync::Arc;

use super::block::RecordBlock;
use super::file_name::{begun_ns, file_name};
use super::folder::RecordFolder;
use super::program::RecordedProgram;
use super::recorder::TapeClock;
use super::segment::SegmentStart;
use super::stored_files::{ListedFile, StoreLimits, StoredFiles};

const SECOND_NS: u64 = 1_000_000_000;

/// The first pause before the store tries again.
const FIRST_PAUSE_NS: u64 = SECOND_NS;

/// The longest pause before the store tries again.
const LONGEST_PAUSE_NS: u64 = 60 * SECOND_NS;

/// The time between two base images in a file.
const BASE_EVERY_NS: u64 = 60 * SECOND_NS;

/// The time between two syncs.
const SYNC_EVERY_NS: u64 = SECOND_NS;

/// The settings of the store.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoreSettings {
    /// The controller's name, with which its files begin.
    pub controller: String,
    /// A file is deleted when this much time was recorded after its last scan, ns.
    pub keep_ns: u64,
    /// The maximum number of bytes of all files.
    pub bytes_max: u64,
    /// The maximum time in one file, ns.
    pub file_ns: u64,
    /// The maximum number of bytes of one file. A quarter of `bytes_max` is the upper limit.
    pub file_bytes: u64,
}

/// A message that the store returns once.
#[derive(Debug)]
pub enum StoreNews {
    /// Nothing is recorded any more, with the reason. The store continues to try.
    Stopped(io::Error),
    /// The store records again.
    Resumed {
        /// The blocks that were not written.
        lost_blocks: u64,
    },
    /// The open file was removed or replaced by somebody else; the next block begins a new file.
    FileGone {
        /// Its name.
        name: String,
    },
}

/// The state of the store.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoreStatus {
    /// The files.
    pub files: usize,
    /// The bytes of the files.
    pub bytes: u64,
    /// The reason why nothing is recorded at present.
    pub trouble: Option<String>,
    /// The blocks that were not written since the start.
    pub lost_blocks: u64,
}

/// The files of segments in a folder.
pub struct Store<F> {
    folder: F,
    settings: StoreSettings,
    /// This controller's files.
    files: StoredFiles,
    /// Whether `files` agrees with the folder.
    is_known: bool,
    open: Option<OpenFile>,
    trouble: Option<StoreTrouble>,
    last_trouble: LastTrouble,
    lost_blocks: u64,
    /// The name of a file that was found removed, until this is told.
    gone: Option<String>,
}

/// The last failure that is over.
#[derive(Clone, Copy, Default)]
struct LastTrouble {
    /// The last pause before the store worked again.
    pause_ns: u64,
    /// The time at which the store worked again.
    worked_ns: u64,
}

/// The file that is open for writing.
struct OpenFile {
    name: String,
    program: Arc<RecordedProgram>,
    segment_sum: u32,
    begun_ns: u64,
    base_ns: u64,
    synced_ns: u64,
    is_synced: bool,
    bytes: u64,
    /// The sequence number of the last whole block.
    sequence: Option<u64>,
}

struct StoreTrouble {
    error: String,
    /// The number of blocks lost before the failure.
    lost_before: u64,
    retry_ns: u64,
    pause_ns: u64,
}

/// The monotonic time, ns.
fn now_ns(clock: TapeClock) -> u64 {
    clock.unix_ns.saturating_sub(clock.unix_offset_ns).max(0) as u64
}

impl<F: RecordFolder> Store<F> {
    /// A store in a folder. The folder is not touched before the first block.
    pub fn new(folder: F, settings: StoreSettings) -> Store<F> {
        Store {
            folder,
            settings,
            files: StoredFiles::default(),
            is_known: false,
            open: None,
            trouble: None,
            last_trouble: LastTrouble::default(),
            lost_blocks: 0,
            gone: None,
        }
    }

    /// Writes a block. It is durable after the next successful sync, by `tick` or `finish`.
    pub fn put(&mut self, block: &RecordBlock, clock: TapeClock) -> Option<StoreNews> {
        let now_ns = now_ns(clock);
        if self.trouble.as_ref().is_some_and(|trouble| now_ns < trouble.retry_ns) {
            self.lost_blocks += 1;
            return None;
        }
        let written = self.write(block, clock).and_then(|written| {
            // A failed disk counts as working again when a block is durable.
            let is_tried = written && self.trouble.is_some();
            if is_tried { self.sync(now_ns) } else { Ok(()) }.map(|()| written)
        });
        match written {
            Ok(true) => self.works(now_ns).or_else(|| self.gone()),
            Ok(false) => {
                self.lost_blocks += 1;
                self.gone()
            }
            Err(error) => {
                let news = self.fail(error, now_ns);
                self.lost_blocks += 1;
                news
            }
        }
    }

    /// Syncs the open file if a sync is due. Call it at least once a second.
    pub fn tick(&mut self, clock: TapeClock) -> Option<StoreNews> {
        let now_ns = now_ns(clock);
        let open = self.open.as_ref()?;
        let is_due = now_ns >= open.synced_ns.saturating_add(SYNC_EVERY_NS);
        if open.is_synced || !is_due {
            return None;
        }
        self.finish(clock)
    }

    /// Makes all blocks durable at once, as before the process ends.
    pub fn finish(&mut self, clock: TapeClock) -> Option<StoreNews> {
        match self.sync(now_ns(clock)) {
            Ok(()) => self.gone(),
            Err(error) => self.fail(error, now_ns(clock)),
        }
    }

    /// Whether no written block waits for a sync.
    pub fn is_durable(&self) -> bool {
        self.open.as_ref().is_none_or(|open| open.is_synced)
    }

    fn gone(&mut self) -> Option<StoreNews> {
        self.gone.take().map(|name| StoreNews::FileGone { name })
    }

    /// The state.
    pub fn status(&self) -> StoreStatus {
        StoreStatus {
            files: self.files.count(),
            bytes: self.files.bytes(),
            trouble: self.trouble.as_ref().map(|trouble| trouble.error.clone()),
            lost_blocks: self.lost_blocks,
        }
    }

    fn works(&mut self, now_ns: u64) -> Option<StoreNews> {
        let StoreTrouble { lost_before, pause_ns, .. } = self.trouble.take()?;
        self.last_trouble = LastTrouble { pause_ns, worked_ns: now_ns };
        Some(StoreNews::Resumed { lost_blocks: self.lost_blocks - lost_before })
    }

    fn fail(&mut self, error: io::Error, now_ns: u64) -> Option<StoreNews> {
        self.folder.close();
        self.is_known = false;
        // A file without a whole block is deleted, if that is possible.
        if let Some(open) = self.open.take().filter(|open| open.sequence.is_none()) {
            let _ = self.folder.remove(&open.name);
        }
        let before = self.trouble.take();
        let last = self.last_trouble;
        let pause_ns = match &before {
            Some(before) => before.pause_ns * 2,
            // A disk that fails again soon gets longer pauses.
            None if now_ns < last.worked_ns.saturating_add(LONGEST_PAUSE_NS) => last.pause_ns * 2,
            None => FIRST_PAUSE_NS,
        };
        let pause_ns = pause_ns.clamp(FIRST_PAUSE_NS, LONGEST_PAUSE_NS);
        let retry_ns = now_ns.saturating_add(pause_ns);
        let lost_before = before.as_ref().map_or(self.lost_blocks, |before| before.lost_before);
        self.trouble =
            Some(StoreTrouble { error: error.to_string(), lost_before, retry_ns, pause_ns });
        before.is_none().then_some(StoreNews::Stopped(error))
    }

    /// Writes a block; returns false if a base image is missing, or the block does not fit within
    /// the limits.
    fn write(&mut self, block: &RecordBlock, clock: TapeClock) -> io::Result<bool> {
        let now_ns = now_ns(clock);
        self.look(clock.unix_ns)?;
        let must_begin = match &self.open {
            Some(open) => *open.program != *block.program,
            None => true,
        };
        let is_full = self.open.as_ref().is_some_and(|open| {
            let file_bytes = self.settings.file_bytes.min(self.settings.bytes_max / 4);
            open.bytes >= file_bytes
                || now_ns >= open.begun_ns.saturating_add(self.settings.file_ns)
        });
        let begins = must_begin || is_full && block.has_base();
        let has_gap = self.open.as_ref().is_none_or(|open| {
            !block.head.follows
                || open.sequence.map(|last| last.wrapping_add(1)) != Some(block.head.sequence)
        });
        if (begins || has_gap) && !block.has_base() {
            return Ok(false);
        }
        let bytes =
            if begins { self.first(block, clock)? } else { self.next(block, has_gap, now_ns) };
        if !self.make_room(bytes.len() as u64)? {
            return Ok(false);
        }
        if begins {
            self.begin(block, clock)?;
        }
        self.append(&bytes, block)?;
        Ok(true)
    }

    /// The first bytes of a new file. Closes the file before it.
    fn first(&mut self, block: &RecordBlock, clock: TapeClock) -> io::Result<Vec<u8>> {
        self.sync(now_ns(clock))?;
        self.open = None;
        self.folder.close();
        let SegmentStart { mut bytes, sum } = SegmentStart::new(&block.program);
        block.write(sum, true, &mut bytes);
        Ok(bytes)
    }

    /// The bytes of a block in the open file.
    fn next(&mut self, block: &RecordBlock, has_gap: bool, now_ns: u64) -> Vec<u8> {
        let mut bytes = Vec::new();
        if let Some(open) = &mut self.open {
            let is_due = now_ns >= open.base_ns.saturating_add(BASE_EVERY_NS);
            let with_base = block.has_base() && (has_gap || is_due);
            open.base_ns = if with_base { now_ns } else { open.base_ns };
            block.write(open.segment_sum, with_base, &mut bytes);
        }
        bytes
    }

    /// Reads the list of this controller's files.
    fn look(&mut self, unix_ns: i64) -> io::Result<()> {
        if self.is_known {
            return Ok(());
        }
        self.folder.own(&self.settings.controller)?;
        let own = |(name, bytes): (String, u64)| {
            let begun_ns = begun_ns(&self.settings.controller, &name)?;
            Some(ListedFile { name, begun_ns, bytes })
        };
        let listed = self.folder.list()?.into_iter().filter_map(own);
        let listed = listed.collect();
        self.files.look(listed, &self.folder.order(), unix_ns);
        self.is_known = true;
        Ok(())
    }

    /// Deletes the oldest files until this number of additional bytes is within the limits; returns
    /// false if that is impossible.
    fn make_room(&mut self, bytes: u64) -> io::Result<bool> {
        let open = self.open.as_ref().map(|open| &*open.name);
        let open_bytes = self.open.as_ref().map_or(0, |open| open.bytes);
        let StoreSettings { keep_ns, bytes_max, file_ns, .. } = self.settings;
        if open_bytes.saturating_add(bytes) > bytes_max {
            return Ok(false);
        }
        let limits = StoreLimits { keep_ns, bytes_max, file_ns };
        while let Some(name) = self.files.next_deleted(bytes, open, limits, &mut self.folder) {
            match self.folder.remove(&name) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                Ok(()) | Err(_) => self.files.forget(&name),
            }
        }
        Ok(true)
    }

    /// Begins a file.
    fn begin(&mut self, block: &RecordBlock, clock: TapeClock) -> io::Result<()> {
        let now_ns = now_ns(clock);
        let begun_ns = self.files.free_start_ns(clock.unix_ns.max(0));
        let name = file_name(&self.settings.controller, begun_ns);
        // The order is durable before the file.
        self.folder.note_order(&[self.files.order(), vec![begun_ns]].concat());
        let created = self.folder.create(&name);
        if let Err(error) = &created
            && error.kind() == io::ErrorKind::AlreadyExists
        {
            // The file belongs to another process: it is left alone.
            return created;
        }
        self.files.begin(name.clone(), begun_ns);
        self.open = Some(OpenFile {
            name,
            program: block.program.clone(),
            segment_sum: SegmentStart::new(&block.program).sum,
            begun_ns: now_ns,
            base_ns: now_ns,
            synced_ns: now_ns,
            is_synced: true,
            bytes: 0,
            sequence: None,
        });
        created
    }

    fn append(&mut self, bytes: &[u8], block: &RecordBlock) -> io::Result<()> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let written = match self.folder.append(bytes) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => self.folder.append(bytes),
            other => other,
        }?;
        open.bytes += written as u64;
        open.is_synced = false;
        self.files.grow(&open.name, open.bytes, &block.head);
        if written < bytes.len() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        open.sequence = Some(block.head.sequence);
        Ok(())
    }

    fn sync(&mut self, now_ns: u64) -> io::Result<()> {
        let Some(open) = self.open.as_mut().filter(|open| !open.is_synced) else { return Ok(()) };
        self.folder.sync()?;
        open.is_synced = true;
        open.synced_ns = now_ns;
        if !self.folder.is_there(&open.name) {
            // What follows would go into a file that nobody finds any more.
            self.gone = self.open.take().map(|open| open.name);
            self.folder.close();
            self.is_known = false;
        }
        Ok(())
    }
}
