//! The disk's thread of the scan log: writes blocks to the folder, and logs failures and
//! recoveries.
//!
//! `record_thread` hands blocks over and never waits. While the disk stalls, a limited number of
//! blocks waits; further blocks are left out, which the recording shows as a gap.

use std::io;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, TrySendError};
use std::sync::mpsc::{channel, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use super::config::Setup;
use super::narration::span;
use super::record::clock;
use super::record_stall::{Backlog, DiskStall, StallNews};
use crate::faults::{self, FaultPoint};
use crate::locked::locked;
use crate::record::{FolderOnDisk, RecordBlock, Store, StoreNews, StoreSettings};
use crate::say::say;

/// The most blocks that wait for the disk: two minutes of a plant with short periods.
const BLOCKS_MAX: usize = 120;
/// How often the log repeats that a trouble lasts.
const REPEAT: Duration = Duration::from_secs(60);
/// The longest time between two checks of what is due.
const TICK: Duration = Duration::from_millis(500);
/// The reason that is shown while the disk stalls.
const NO_ANSWER: &str = "the disk does not answer";
const SECOND_NS: u64 = 1_000_000_000;
/// The longest time and the most bytes of one file.
const FILE_NS: u64 = 3600 * SECOND_NS;
const FILE_BYTES: u64 = 16_000_000;

/// The figures of the folder that `status` shows.
#[derive(Clone, Debug, Default)]
pub(super) struct DiskFigures {
    pub dir: String,
    pub bytes: u64,
    /// The most bytes that the folder may take.
    pub size: u64,
    /// Why the folder cannot be written now.
    pub failing: Option<String>,
}

/// A handle to the thread.
pub(super) struct RecordDisk {
    blocks: SyncSender<DiskOrder>,
    figures: Arc<Mutex<DiskFigures>>,
    dir: String,
    backlog: Arc<Backlog>,
    stall: DiskStall,
}

enum DiskOrder {
    Block(Box<RecordBlock>),
    End(Sender<()>),
}

impl RecordDisk {
    /// Starts the thread for a folder.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(dir: &Path, setup: &Setup) -> io::Result<RecordDisk> {
        let settings = StoreSettings {
            controller: controller_name(&setup.controller),
            keep_ns: i64::try_from(setup.record.keep_s * SECOND_NS).unwrap_or(i64::MAX),
            bytes_max: setup.record.size_bytes,
            file_ns: FILE_NS,
            file_bytes: FILE_BYTES,
        };
        let name = dir.display().to_string();
        let figures =
            DiskFigures { dir: name.clone(), size: settings.bytes_max, ..DiskFigures::default() };
        let figures = Arc::new(Mutex::new(figures));
        say!(
            RECORD_BEGINS,
            dir = %name,
            keep = %span(setup.record.keep_s.saturating_mul(SECOND_NS)),
            size_mb = settings.bytes_max / 1_000_000,
            "the scan log is recorded"
        );
        let (blocks, inbox) = sync_channel(BLOCKS_MAX);
        let backlog = Arc::new(Backlog::default());
        let writer = DiskWriter {
            store: Store::new(FolderOnDisk::new(dir), settings),
            figures: Arc::clone(&figures),
            dir: name.clone(),
            failing: None,
            backlog: Arc::clone(&backlog),
        };
        thread::Builder::new().name("rungd-record-io".into()).spawn(move || writer.work(&inbox))?;
        Ok(RecordDisk { blocks, figures, dir: name, backlog, stall: DiskStall::default() })
    }

    /// Hands a block over; leaves it out if too many blocks wait.
    pub fn put(&mut self, block: RecordBlock) {
        // The block is counted before the disk can take it.
        self.backlog.put();
        match self.blocks.try_send(DiskOrder::Block(Box::new(block))) {
            Ok(()) => {
                let news = self.stall.put(&self.backlog, BLOCKS_MAX);
                self.tell(news);
            }
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                self.backlog.taken();
                let news = self.stall.left_out(&self.backlog, Instant::now());
                self.tell(news);
            }
        }
    }

    fn tell(&self, news: Option<StallNews>) {
        match news {
            Some(StallNews::Begins) => {
                locked(&self.figures).failing = Some(NO_ANSWER.to_owned());
                tell_failure(&self.dir, NO_ANSWER);
            }
            Some(StallNews::Ends(since, lost)) => {
                let mut figures = locked(&self.figures);
                figures.failing.take_if(|why| why == NO_ANSWER);
                drop(figures);
                tell_resumed(since.elapsed(), lost);
            }
            None => {}
        }
    }

    /// The current figures.
    pub fn figures(&self) -> DiskFigures {
        locked(&self.figures).clone()
    }

    /// Waits until the last block is durable.
    pub fn end(&mut self, most: Duration) {
        let (reply, done) = channel();
        let is_asked = self.blocks.try_send(DiskOrder::End(reply)).is_ok();
        if !is_asked || done.recv_timeout(most).is_err() {
            let waited = span(most.as_nanos() as u64);
            let why =
                format!("the disk has not answered for {waited}; the last scans may be missing");
            tell_failure(&self.dir, &why);
            return;
        }
        let news = self.stall.over(&self.backlog);
        self.tell(news);
    }
}

struct DiskWriter {
    store: Store<FolderOnDisk>,
    figures: Arc<Mutex<DiskFigures>>,
    dir: String,
    /// The time when the trouble began, and the time when it was last logged.
    failing: Option<(Instant, Instant)>,
    backlog: Arc<Backlog>,
}

impl DiskWriter {
    fn work(mut self, inbox: &Receiver<DiskOrder>) {
        loop {
            let news = match inbox.recv_timeout(TICK) {
                Ok(DiskOrder::Block(block)) => {
                    self.backlog.taken();
                    faults::point(FaultPoint::RecordDisk);
                    self.store.put(&block, clock())
                }
                Ok(DiskOrder::End(done)) => {
                    let news = self.store.finish(clock());
                    self.tell(news);
                    let _ = done.send(());
                    return;
                }
                Err(RecvTimeoutError::Timeout) => self.store.tick(clock()),
                Err(RecvTimeoutError::Disconnected) => return,
            };
            self.tell(news);
            self.show();
        }
    }

    fn show(&self) {
        let status = self.store.status();
        let mut figures = locked(&self.figures);
        figures.bytes = status.bytes;
        let no_answer = || self.backlog.is_stalled().then(|| NO_ANSWER.to_owned());
        figures.failing = status.trouble.or_else(no_answer);
    }

    fn tell(&mut self, news: Option<StoreNews>) {
        match news {
            Some(StoreNews::Stopped(error)) => {
                self.failing = Some((Instant::now(), Instant::now()));
                tell_failure(&self.dir, &error.to_string());
            }
            Some(StoreNews::Resumed { lost_blocks }) => {
                let since = self.failing.take().map(|(since, _)| since.elapsed());
                tell_resumed(since.unwrap_or_default(), lost_blocks);
            }
            None => self.repeat(),
        }
    }

    /// Logs a lasting trouble again when this is due.
    fn repeat(&mut self) {
        let Some((_, told)) = &mut self.failing else { return };
        if told.elapsed() >= REPEAT {
            *told = Instant::now();
            if let Some(why) = self.store.status().trouble {
                tell_failure(&self.dir, &why);
            }
        }
    }
}

fn tell_failure(dir: &str, why: &str) {
    say!(
        RECORD_FAILED,
        dir,
        "the scan log cannot be written: {why}. Control continues; rungd tries again by itself"
    );
}

fn tell_resumed(after: Duration, lost: u64) {
    let lasted = span(after.as_nanos() as u64);
    say!(RECORD_RESUMED, blocks_lost = lost, "the scan log is written again, after {lasted}");
}

/// The prefix of the names of a controller's recordings: the name of the controller file without
/// its extension.
fn controller_name(file: &str) -> String {
    Path::new(file).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
