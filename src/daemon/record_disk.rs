//! The disk's thread of the scan log: writes blocks to the folder, and tells what becomes of it.
//!
//! `record_thread` hands blocks over and never waits: while the disk stalls, a bounded number of
//! blocks waits; then blocks are left out, which the recording shows as a gap.

use std::io;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, TrySendError};
use std::sync::mpsc::{channel, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::config::Setup;
use super::narration::span;
use super::record::clock;
use crate::faults::{self, FaultPoint};
use crate::record::{FolderOnDisk, RecordBlock, Store, StoreNews, StoreSettings};
use crate::say::say;

/// The most blocks that wait for the disk: two minutes of a plant with short periods.
const BLOCKS_MAX: usize = 120;
/// How often the log repeats a lasting trouble.
const REPEAT: Duration = Duration::from_secs(60);
/// The longest time between two looks at what is due.
const TICK: Duration = Duration::from_millis(500);
const SECOND_NS: u64 = 1_000_000_000;
/// The longest time, and the most bytes, in one file.
const FILE_NS: u64 = 3600 * SECOND_NS;
const FILE_BYTES: u64 = 16_000_000;

/// What `status` shows of the folder.
#[derive(Clone, Debug, Default)]
pub(super) struct DiskFigures {
    pub dir: String,
    pub bytes: u64,
    /// The most bytes that it may take.
    pub size: u64,
    /// Why it cannot be written at present.
    pub failing: Option<String>,
}

/// A handle to the thread.
pub(super) struct RecordDisk {
    blocks: SyncSender<DiskOrder>,
    figures: Arc<Mutex<DiskFigures>>,
    dir: String,
    /// Since when the disk does not answer, and the blocks that were left out for it.
    stalled: Option<(Instant, u64)>,
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
        let writer = DiskWriter {
            store: Store::new(FolderOnDisk::new(dir), settings),
            figures: Arc::clone(&figures),
            dir: name.clone(),
            failing: None,
        };
        thread::Builder::new().name("rungd-record-io".into()).spawn(move || writer.work(&inbox))?;
        Ok(RecordDisk { blocks, figures, dir: name, stalled: None })
    }

    /// Hands a block over; leaves it out if too many wait.
    pub fn put(&mut self, block: RecordBlock) {
        match self.blocks.try_send(DiskOrder::Block(Box::new(block))) {
            Ok(()) => {
                if let Some((since, lost)) = self.stalled.take() {
                    let lasted = span(since.elapsed().as_nanos() as u64);
                    say!(
                        RECORD_RESUMED,
                        blocks_lost = lost,
                        "the scan log is written again, after {lasted}"
                    );
                }
            }
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                let is_first = self.stalled.is_none();
                self.stalled.get_or_insert((Instant::now(), 0)).1 += 1;
                if is_first {
                    let why = "the disk does not answer";
                    locked(&self.figures).failing = Some(why.to_owned());
                    tell_failure(&self.dir, why);
                }
            }
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
        }
    }
}

struct DiskWriter {
    store: Store<FolderOnDisk>,
    figures: Arc<Mutex<DiskFigures>>,
    dir: String,
    /// When the trouble was told last.
    failing: Option<(Instant, Instant)>,
}

impl DiskWriter {
    fn work(mut self, inbox: &Receiver<DiskOrder>) {
        loop {
            let news = match inbox.recv_timeout(TICK) {
                Ok(DiskOrder::Block(block)) => {
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
        (figures.bytes, figures.failing) = (status.bytes, status.trouble);
    }

    fn tell(&mut self, news: Option<StoreNews>) {
        match news {
            Some(StoreNews::Stopped(error)) => {
                self.failing = Some((Instant::now(), Instant::now()));
                tell_failure(&self.dir, &error.to_string());
            }
            Some(StoreNews::Resumed { lost_blocks }) => {
                let since = self.failing.take().map_or(0, |(since, _)| since.elapsed().as_nanos());
                say!(
                    RECORD_RESUMED,
                    blocks_lost = lost_blocks,
                    "the scan log is written again, after {}",
                    span(since as u64)
                );
            }
            None => self.repeat(),
        }
    }

    /// Tells a lasting trouble again.
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
        "the scan log cannot be written: {why}. Control goes on; rungd tries again by itself"
    );
}

/// The name with which a controller's files begin: that of its file, without its ending.
fn controller_name(file: &str) -> String {
    Path::new(file).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
