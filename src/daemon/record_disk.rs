//! The disk's thread of the scan log: writes blocks to the folder, and logs failures and
//! recoveries.
//!
//! `record_thread` hands blocks over and never waits. The disk's thread writes all blocks that wait
//! and then makes them durable with one sync, so a slow disk is behind by two syncs at most. While
//! the disk stalls, a limited number of blocks waits; further blocks are left out, which the
//! recording shows as a gap. The order to end is that no further block can come: it needs no room
//! among the blocks that wait.

use std::io;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, TrySendError};
use std::sync::mpsc::{channel, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use super::config::ControllerSetup;
use super::record::clock;
use super::record_stall::{Backlog, DiskLag, DiskStall, LagNews, StallNews};
use rungd_base::duration_text::duration_text;
use rungd_base::faults::{self, FaultPoint};
use rungd_base::locked::locked;
use rungd_history::record::{
    FolderOnDisk, RecordBlock, RecordFolder, Store, StoreNews, StoreSettings, TapeClock,
};
use rungd_runtime::say::say;

/// The most blocks that wait for the disk: two minutes of a plant with short periods.
const BLOCKS_MAX: usize = 120;
/// An end that takes longer than this is reported.
const END_TOLD: Duration = Duration::from_secs(1);
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
    /// How far the copy on disk is behind.
    pub behind: Duration,
}

/// A handle to the thread.
pub(super) struct RecordDisk {
    /// Its end orders the disk's thread to end.
    blocks: SyncSender<Box<RecordBlock>>,
    /// The disk's thread has ended in order.
    done: Receiver<()>,
    figures: Arc<Mutex<DiskFigures>>,
    dir: String,
    backlog: Arc<Backlog>,
    stall: DiskStall,
    lag: DiskLag,
}

impl RecordDisk {
    /// Starts the thread for a folder.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(dir: &Path, setup: &ControllerSetup) -> io::Result<RecordDisk> {
        let settings = StoreSettings {
            controller: controller_name(&setup.controller),
            keep_ns: setup.record.keep_s.saturating_mul(SECOND_NS),
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
            keep = %duration_text(setup.record.keep_s.saturating_mul(SECOND_NS)),
            size_mb = settings.bytes_max / 1_000_000,
            "the scan log is recorded"
        );
        let (blocks, inbox) = sync_channel(BLOCKS_MAX);
        let (ended, done) = channel();
        let backlog = Arc::new(Backlog::default());
        let writer = DiskWriter {
            store: Store::new(FolderOnDisk::new(dir), settings),
            figures: Arc::clone(&figures),
            dir: name.clone(),
            failing: None,
            backlog: Arc::clone(&backlog),
            taken: 0,
            clock,
        };
        thread::Builder::new().name("rungd-record-io".into()).spawn(move || {
            writer.work(&inbox, &ended);
        })?;
        let (stall, lag) = (DiskStall::default(), DiskLag::default());
        Ok(RecordDisk { blocks, done, figures, dir: name, backlog, stall, lag })
    }

    /// Hands a block over; leaves it out if too many blocks wait.
    pub fn put(&mut self, block: RecordBlock) {
        // The block is counted before the disk can take it.
        self.backlog.put(Instant::now());
        match self.blocks.try_send(Box::new(block)) {
            Ok(()) => {
                let news = self.stall.put(&self.backlog, BLOCKS_MAX);
                tell_stall(&self.figures, &self.dir, news);
            }
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                self.backlog.refused();
                let news = self.stall.left_out(&self.backlog, Instant::now());
                tell_stall(&self.figures, &self.dir, news);
            }
        }
    }

    /// Reports a disk that is behind.
    pub fn look(&mut self) {
        let now = Instant::now();
        match self.lag.look(self.backlog.behind(now), now) {
            Some(LagNews::Begins(behind)) => {
                let behind = text_of(behind);
                say!(
                    RECORD_BEHIND,
                    dir = %self.dir,
                    behind = %behind,
                    "the disk is slow: the scan log on it is {behind} behind, which a power cut \
                     would cost. Nothing is lost so far, and an orderly stop writes all of it"
                );
            }
            Some(LagNews::Ends(since, most)) => {
                let (most, lasted) = (text_of(most), text_of(since.elapsed()));
                say!(
                    RECORD_CAUGHT_UP,
                    dir = %self.dir,
                    behind_most = %most,
                    "the scan log on the disk is complete again, after {lasted}; it was {most} \
                     behind at most"
                );
            }
            None => {}
        }
    }

    /// The current figures.
    pub fn figures(&self) -> DiskFigures {
        let behind = self.backlog.behind(Instant::now());
        DiskFigures { behind, ..locked(&self.figures).clone() }
    }

    /// Ends the thread. Waits until all blocks that wait are durable, for at most this time.
    pub fn end(self, most: Duration) {
        let RecordDisk { blocks, done, figures, dir, backlog, mut stall, .. } = self;
        let begin = Instant::now();
        drop(blocks);
        let wait = |most: Duration| done.recv_timeout(most.saturating_sub(begin.elapsed())).is_ok();
        let mut is_done = wait(END_TOLD.min(most));
        if !is_done {
            let behind = text_of(backlog.behind(Instant::now()));
            let longest = text_of(most);
            say!(
                RECORD_ENDS,
                dir = %dir,
                behind = %behind,
                "the scan log: the disk is slow, and the last {behind} are being written; the end \
                 waits for them, {longest} at most"
            );
            is_done = wait(most);
        }
        let took = text_of(begin.elapsed());
        if !is_done {
            let why =
                format!("the disk has not answered for {took}; the last scans may be missing");
            return tell_failure(&dir, &why);
        }
        if begin.elapsed() > END_TOLD {
            say!(
                RECORD_ENDS,
                dir = %dir,
                took = %took,
                "the scan log: the last scans are on the disk, after {took}"
            );
        }
        tell_stall(&figures, &dir, stall.over(&backlog));
    }
}

struct DiskWriter<F> {
    store: Store<F>,
    figures: Arc<Mutex<DiskFigures>>,
    dir: String,
    /// The time when the trouble began, and the time when it was last logged.
    failing: Option<(Instant, Instant)>,
    backlog: Arc<Backlog>,
    /// The blocks taken from the queue that are not durable yet.
    taken: usize,
    clock: fn() -> TapeClock,
}

impl<F: RecordFolder> DiskWriter<F> {
    /// Works until no further block can come, and all that came are written.
    fn work(mut self, inbox: &Receiver<Box<RecordBlock>>, ended: &Sender<()>) {
        loop {
            let mut next = match inbox.recv_timeout(TICK) {
                Ok(block) => Some(block),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => break,
            };
            // All blocks that wait are written before the sync, which may take seconds.
            while let Some(block) = next.take() {
                self.write(&block);
                if self.taken < BLOCKS_MAX {
                    next = inbox.try_recv().ok();
                }
            }
            faults::point(FaultPoint::RecordSync);
            let news = self.store.tick((self.clock)());
            self.log_news(news);
            self.settle();
        }
        let news = self.store.finish((self.clock)());
        self.log_news(news);
        self.settle();
        let _ = ended.send(());
    }

    fn write(&mut self, block: &RecordBlock) {
        self.backlog.taken();
        self.taken += 1;
        faults::point(FaultPoint::RecordDisk);
        let news = self.store.put(block, (self.clock)());
        self.log_news(news);
        self.show();
    }

    /// Counts the blocks that are durable now; blocks that are lost wait no more either.
    fn settle(&mut self) {
        if self.store.is_durable() {
            self.backlog.settled(std::mem::take(&mut self.taken));
        }
        self.show();
    }

    fn show(&self) {
        let status = self.store.status();
        let mut figures = locked(&self.figures);
        figures.bytes = status.bytes;
        let no_answer = || self.backlog.is_stalled().then(|| NO_ANSWER.to_owned());
        figures.failing = status.trouble.or_else(no_answer);
    }

    fn log_news(&mut self, news: Option<StoreNews>) {
        match news {
            Some(StoreNews::Stopped(error)) => {
                self.failing = Some((Instant::now(), Instant::now()));
                tell_failure(&self.dir, &error.to_string());
            }
            Some(StoreNews::Resumed { lost_blocks }) => {
                let since = self.failing.take().map(|(since, _)| since.elapsed());
                tell_resumed(since.unwrap_or_default(), lost_blocks);
            }
            Some(StoreNews::FileGone { name }) => tell_gone(&self.dir, &name),
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

fn tell_stall(figures: &Mutex<DiskFigures>, dir: &str, news: Option<StallNews>) {
    match news {
        Some(StallNews::Begins) => {
            locked(figures).failing = Some(NO_ANSWER.to_owned());
            tell_failure(dir, NO_ANSWER);
        }
        Some(StallNews::Ends(since, lost)) => {
            locked(figures).failing.take_if(|why| why == NO_ANSWER);
            tell_resumed(since.elapsed(), lost);
        }
        None => {}
    }
}

fn tell_failure(dir: &str, why: &str) {
    say!(
        RECORD_FAILED,
        dir,
        "the scan log cannot be written: {why}. Control continues; rungd tries again by itself"
    );
}

fn tell_gone(dir: &str, name: &str) {
    say!(
        RECORD_FILE_GONE,
        dir,
        file = name,
        "the file {name} of the scan log was removed, renamed or replaced: its scans are lost if \
         it was removed. Recording goes on in a new file"
    );
}

fn tell_resumed(after: Duration, lost: u64) {
    let lasted = text_of(after);
    say!(RECORD_RESUMED, blocks_lost = lost, "the scan log is written again, after {lasted}");
}

fn text_of(time: Duration) -> String {
    duration_text(time.as_nanos() as u64)
}

/// The prefix of the names of a controller's recordings: the name of the controller file without
/// its extension.
fn controller_name(file: &str) -> String {
    Path::new(file).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use rungd_history::record::{BlockHead, RecordedProgram, SectionBody};
    use rungd_runtime::exchange::Mode;

    /// A folder that counts its calls.
    #[derive(Default)]
    struct CountingFolder(Arc<Mutex<Vec<&'static str>>>);

    impl CountingFolder {
        fn call(&self, name: &'static str) -> io::Result<()> {
            locked(&self.0).push(name);
            Ok(())
        }
    }

    impl RecordFolder for CountingFolder {
        fn own(&mut self, _: &str) -> io::Result<()> {
            Ok(())
        }
        fn order(&mut self) -> Vec<i64> {
            Vec::new()
        }
        fn note_order(&mut self, _: &[i64]) {}
        fn list(&mut self) -> io::Result<Vec<(String, u64)>> {
            Ok(Vec::new())
        }
        fn create(&mut self, _: &str) -> io::Result<()> {
            self.call("create")
        }
        fn append(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.call("append").map(|()| bytes.len())
        }
        fn sync(&mut self) -> io::Result<()> {
            self.call("sync")
        }
        fn is_there(&mut self, _: &str) -> bool {
            true
        }
        fn passed_ns(&mut self, _: &str) -> io::Result<u64> {
            Ok(0)
        }
        fn close(&mut self) {}
        fn remove(&mut self, _: &str) -> io::Result<()> {
            Ok(())
        }
    }

    fn block(program: &Arc<RecordedProgram>, sequence: u64) -> RecordBlock {
        let (begin_ns, end_ns, follows) = (0, 0, sequence > 0);
        let (number, scans, end_hash) = (sequence, 1, None);
        let head = BlockHead { sequence, number, scans, begin_ns, end_ns, follows, end_hash };
        let (who, entries) = (Vec::new(), Vec::new());
        let body = SectionBody { mode: Mode::Run, unix_offset_ns: 0, lost: 0, who, entries };
        RecordBlock::new(Arc::clone(program), head, Some(&[]), &body)
    }

    /// A clock by which every call takes three seconds, like a sync of a slow disk.
    fn slow_clock() -> TapeClock {
        thread_local!(static NOW_NS: Cell<i64> = const { Cell::new(0) });
        NOW_NS.set(NOW_NS.get() + 3 * SECOND_NS as i64);
        TapeClock { unix_ns: NOW_NS.get(), unix_offset_ns: 0 }
    }

    #[test]
    fn a_full_queue_is_written_before_one_sync_and_still_accepts_a_shutdown() {
        let (folder, backlog) = (CountingFolder::default(), Arc::new(Backlog::default()));
        let calls = Arc::clone(&folder.0);
        let settings = StoreSettings {
            controller: "line".into(),
            keep_ns: u64::MAX,
            bytes_max: 1 << 30,
            file_ns: u64::MAX,
            file_bytes: 1 << 30,
        };
        let (blocks, inbox) = sync_channel(BLOCKS_MAX);
        let program = Arc::new(RecordedProgram::default());
        let most = BLOCKS_MAX as u64;
        for sequence in 0..most {
            backlog.put(Instant::now());
            assert!(blocks.try_send(Box::new(block(&program, sequence))).is_ok());
        }
        assert!(blocks.try_send(Box::new(block(&program, most))).is_err(), "the queue is full");
        drop(blocks);
        let (ended, done) = channel();
        let writer = DiskWriter {
            store: Store::new(folder, settings),
            figures: Arc::default(),
            dir: String::new(),
            failing: None,
            backlog: Arc::clone(&backlog),
            taken: 0,
            clock: slow_clock,
        };
        writer.work(&inbox, &ended);
        assert!(done.try_recv().is_ok());
        let calls = locked(&calls);
        assert_eq!(calls.iter().filter(|call| **call == "append").count() as u64, most);
        assert_eq!(calls.iter().filter(|call| **call == "sync").count(), 1, "{calls:?}");
        assert_eq!((calls[0], calls[calls.len() - 1]), ("create", "sync"));
        assert_eq!(backlog.behind(Instant::now() + REPEAT), Duration::ZERO);
    }
}
