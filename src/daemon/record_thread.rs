//! The thread of the scan log: it reads the scan thread's tape, makes blocks of it, keeps the last
//! minute in memory, and hands every block to the disk's thread.
//!
//! It is an ordinary thread, and touches no file: a disk that stalls delays only `record_disk`. The
//! operator's service requests the scans in memory; a reload announces its program before the swap.

use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use tokio::sync::oneshot;

use super::config::FileAccess;
use super::record::clock;
use super::record_disk::{DiskFigures, RecordDisk};
use super::watch_reasons::WatchReasons;
use super::watches::{WatchMessage, WatchPlan, WatchRun};
use rungd_base::duration_text::duration_text;
use rungd_base::faults::{self, FaultPoint};
use rungd_base::locked::locked;
use rungd_client::operator::protocol::RECORDING_BYTES_MAX;
use rungd_history::record::{Recent, RecordBlock, RecordedProgram, Recorder};
use rungd_runtime::exchange::Port;
use rungd_runtime::say::say;
use rungd_runtime::{TapeEntry, TapeReader};

/// The longest time between two looks at the tape.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// A section ends after this time if the scans are far apart, or in STOP.
const SECTION_MAX: Duration = Duration::from_secs(2);
/// The longest time that the process waits for the last block before it ends: a second more than
/// this thread waits for the disk.
const END_MAX: Duration = Duration::from_secs(61);
/// The time that this thread waits for the disk at the end. If the disk has not answered by then,
/// the log reports it. `TimeoutStopSec=` of the unit is longer.
const DISK_END_MAX: Duration = Duration::from_secs(60);

/// A handle to the thread. Cheap to clone.
#[derive(Clone)]
pub(super) struct RecordHandle {
    orders: Sender<RecordOrder>,
    figures: Arc<Mutex<RecordFigures>>,
}

/// The figures that `status` shows.
#[derive(Clone, Debug, Default)]
pub(super) struct RecordFigures {
    /// The bytes that memory has room for.
    pub memory_bytes: u64,
    /// The time that the recording in memory covers, ns.
    pub reach_ns: u64,
    /// The number of steps that the tape has lost.
    pub lost: u64,
    /// The folder, if there is one.
    pub disk: Option<DiskFigures>,
}

/// A pending request for the recording in memory, from a section's number on.
struct AskedRecent {
    from: u64,
    reply: oneshot::Sender<RecentPart>,
}

/// The recording in memory, or the last part of it.
pub(super) struct RecentPart {
    pub bytes: Vec<u8>,
    /// Whether everybody could read the files of all its programs when they were loaded.
    pub is_public: bool,
}

enum RecordOrder {
    Program(Box<RecordedProgram>, FileAccess, Option<Box<WatchPlan>>),
    Recent(AskedRecent),
    End(oneshot::Sender<()>),
}

/// The thread's parts.
pub(super) struct RecordParts {
    pub tape: TapeReader,
    pub port: Port,
    pub first: (RecordedProgram, FileAccess),
    /// What is watched in the first program, and who gets what is found.
    pub watches: (Option<WatchPlan>, SyncSender<WatchMessage>),
    pub memory_bytes: u64,
    pub disk: Option<RecordDisk>,
}

impl RecordHandle {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(parts: RecordParts) -> io::Result<RecordHandle> {
        let RecordParts { tape, port, first: (first, access), watches, memory_bytes, disk } = parts;
        let (plan, news) = watches;
        let mut watches = WatchRun::new(news.clone());
        watches.announce(first.generation, plan);
        let private = access.private(first.generation).into_iter().collect();
        let figures = RecordFigures { memory_bytes, ..RecordFigures::default() };
        let figures = Arc::new(Mutex::new(figures));
        let (orders, inbox) = channel();
        let worker = RecordWorker {
            inbox,
            tape,
            port,
            recorder: Recorder::new(first),
            recent: Recent::new(usize::try_from(memory_bytes).unwrap_or(usize::MAX)),
            disk,
            figures: Arc::clone(&figures),
            section: Instant::now(),
            asked: Vec::new(),
            private,
            ended: None,
            watches,
            reasons: WatchReasons::new(news),
        };
        thread::Builder::new().name("rungd-record".into()).spawn(move || worker.work())?;
        Ok(RecordHandle { orders, figures })
    }

    /// Announces the program of a reload. Call this before the program is handed to the scan
    /// thread.
    pub fn program(&self, program: RecordedProgram, access: FileAccess, plan: Option<WatchPlan>) {
        let plan = plan.map(Box::new);
        let _ = self.orders.send(RecordOrder::Program(Box::new(program), access, plan));
    }

    /// The recording in memory from a section's number on; `None`: the thread is gone (a bug).
    pub async fn recent(&self, from: u64) -> Option<RecentPart> {
        let (reply, answer) = oneshot::channel();
        self.orders.send(RecordOrder::Recent(AskedRecent { from, reply })).ok()?;
        answer.await.ok()
    }

    /// The current figures.
    pub fn figures(&self) -> RecordFigures {
        locked(&self.figures).clone()
    }

    /// Orders the thread to end, after the end of the scan thread.
    pub fn end(&self) -> RecordEnd {
        let (reply, done) = oneshot::channel();
        let _ = self.orders.send(RecordOrder::End(reply));
        RecordEnd { done, begin: Instant::now() }
    }
}

/// The end of the thread: everything that waits is being written.
pub(super) struct RecordEnd {
    done: oneshot::Receiver<()>,
    begin: Instant,
}

impl RecordEnd {
    /// Waits until the last block is written, for a limited time. `hurry` ends the wait.
    pub async fn wait(self, hurry: impl Future<Output = &'static str>) {
        let why = tokio::select! {
            _ = self.done => return,
            name = hurry => format!("{name} came before its thread had finished"),
            () = tokio::time::sleep(END_MAX.saturating_sub(self.begin.elapsed())) => {
                let waited = duration_text(END_MAX.as_nanos() as u64);
                format!("its thread had not finished after {waited}")
            }
        };
        say!(RECORD_LOST, "the scan log may lack the last scans: {why}");
    }
}

struct RecordWorker {
    inbox: Receiver<RecordOrder>,
    tape: TapeReader,
    port: Port,
    recorder: Recorder,
    recent: Recent,
    disk: Option<RecordDisk>,
    figures: Arc<Mutex<RecordFigures>>,
    /// When the current section began.
    section: Instant,
    /// The pending requests for the recording in memory.
    asked: Vec<AskedRecent>,
    /// The generations in memory whose files not everybody could read when they were loaded.
    private: Vec<u32>,
    /// Set if the order to end came while the tape was read.
    ended: Option<oneshot::Sender<()>>,
    watches: WatchRun,
    reasons: WatchReasons,
}

impl RecordWorker {
    fn work(mut self) {
        loop {
            let ended = match self.inbox.recv_timeout(LOOK_EVERY) {
                Ok(order) => self.obey(order),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => return,
            };
            let ended = ended.or(self.obey_all());
            faults::point(FaultPoint::Record);
            self.read();
            let ended = ended.or(self.ended.take());
            let is_cut_short = faults::is_due(FaultPoint::RecordSection);
            if self.section.elapsed() >= SECTION_MAX || ended.is_some() || is_cut_short {
                self.flush();
            }
            self.answer();
            self.explain();
            if let Some(done) = ended {
                match self.tape.unheard() {
                    0 => {}
                    steps => self.lose(steps),
                }
                if let Some(disk) = self.disk.take() {
                    disk.end(DISK_END_MAX);
                }
                let _ = done.send(());
                return;
            }
        }
    }

    fn obey(&mut self, order: RecordOrder) -> Option<oneshot::Sender<()>> {
        match order {
            RecordOrder::Program(program, access, plan) => {
                self.private.extend(access.private(program.generation));
                self.watches.announce(program.generation, plan.map(|plan| *plan));
                self.recorder.program(*program);
            }
            RecordOrder::Recent(asked) => self.asked.push(asked),
            RecordOrder::End(done) => return Some(done),
        }
        None
    }

    fn obey_all(&mut self) -> Option<oneshot::Sender<()>> {
        let mut ended = None;
        while let Ok(order) = self.inbox.try_recv() {
            ended = self.obey(order).or(ended);
        }
        ended
    }

    /// Takes all entries from the tape.
    fn read(&mut self) {
        let clock = clock();
        for (origin, who) in self.port.signatures() {
            self.recorder.note(origin, who);
        }
        while let Some((entry, state)) = self.tape.take() {
            match entry {
                // The program of this state was announced before.
                TapeEntry::State { .. } => self.learn_programs(),
                TapeEntry::Lost { steps } => self.lose(steps),
                TapeEntry::Call(_)
                | TapeEntry::Origin(_)
                | TapeEntry::Number(_)
                | TapeEntry::Mode(_)
                | TapeEntry::Swap { .. } => {}
            }
            self.reasons.add(self.watches.take(entry, state.as_deref()));
            let block = self.recorder.take(entry, state.as_deref(), clock);
            if let Some(state) = state {
                self.tape.give_back(state);
            }
            if let Some(block) = block {
                self.keep(block);
            }
        }
        if let Some(disk) = &mut self.disk {
            disk.look();
            locked(&self.figures).disk = Some(disk.figures());
        }
    }

    fn learn_programs(&mut self) {
        while let Ok(order) = self.inbox.try_recv() {
            // The order to end waits until the tape is read and its last block is written.
            self.ended = self.obey(order).or(self.ended.take());
        }
    }

    fn lose(&mut self, steps: u64) {
        locked(&self.figures).lost += steps;
        say!(
            RECORD_LOST,
            steps,
            "the scan log lacks {steps} scans: its thread was late; control was not affected"
        );
    }

    fn flush(&mut self) {
        if let Some(block) = self.recorder.flush(clock()) {
            self.keep(block);
        }
    }

    fn keep(&mut self, block: RecordBlock) {
        self.section = Instant::now();
        self.recent.put(&block);
        locked(&self.figures).reach_ns = self.recent.reach_ns();
        if let Some(disk) = &mut self.disk {
            disk.put(block);
        }
    }

    /// Explains what is watched and does not hold.
    fn explain(&mut self) {
        let RecordWorker { recorder, recent, reasons, .. } = self;
        reasons.turn(|| recent.write_from(0, recorder.under_way().as_ref(), RECORDING_BYTES_MAX));
    }

    /// Answers with everything up to now. The current section is not ended: otherwise frequent
    /// requests would make many small blocks, also on disk.
    fn answer(&mut self) {
        if self.asked.is_empty() {
            return;
        }
        let last = self.recorder.under_way();
        let oldest = self.recent.oldest_generation();
        let oldest = oldest.or(last.as_ref().map(|last| last.program.generation)).unwrap_or(0);
        self.private.retain(|generation| *generation >= oldest);
        let is_public = self.private.is_empty();
        for AskedRecent { from, reply } in self.asked.drain(..) {
            let bytes = self.recent.write_from(from, last.as_ref(), RECORDING_BYTES_MAX);
            let _ = reply.send(RecentPart { bytes, is_public });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daemon::watches::watch_news;
    use rungd_engine::{Engine, ScanTimes};
    use rungd_language::lower::lower;
    use rungd_language::resolve::{LoadOptions, load_ladders};
    use rungd_language::source::span::SourceFile;
    use rungd_runtime::{ExchangeShape, ScanStart, ScannedMachine, link, tape};

    fn engine() -> Engine {
        let text =
            "[[program]]\nname = \"Main\"\nrung = [{ when = [\"X0\"], do = [\"OUT Y0\"] }]\n";
        let file = SourceFile { name: "main.toml".into(), text: text.into() };
        let (program, _) = load_ladders(&[file], &LoadOptions::default());
        Engine::new(lower(&program.expect("it has no errors")).0)
    }

    fn worker(tape: TapeReader) -> (RecordWorker, Sender<RecordOrder>) {
        let (bits, words) = (vec![0; 2], vec![0]);
        let shape = ExchangeShape {
            inputs: 1,
            bits,
            words,
            first_output: 1,
            forces_active: 0,
            safe: Vec::new(),
        };
        let first = RecordedProgram {
            version: String::new(),
            process_start_ns: 0,
            generation: 0,
            source: String::new(),
            hash: String::new(),
            files: Vec::new(),
        };
        let (orders, inbox) = channel();
        let worker = RecordWorker {
            inbox,
            tape,
            port: link(shape).0,
            recorder: Recorder::new(first),
            recent: Recent::new(1 << 20),
            disk: None,
            figures: Arc::default(),
            section: Instant::now(),
            asked: Vec::new(),
            private: Vec::new(),
            ended: None,
            watches: WatchRun::new(watch_news().0),
            reasons: WatchReasons::new(watch_news().0),
        };
        (worker, orders)
    }

    /// The tape begins with a state, and the worker reads the orders before it takes the state.
    #[test]
    fn a_shutdown_while_a_state_is_read_waits_for_the_last_block() {
        let (mut taped, reader) = tape(engine());
        taped.start(1_000_000);
        let (times, now_ns) = (ScanTimes::default(), 2_000_000);
        taped.begin_scan(&ScanStart { number: 1, now_ns, times, local_s: 0 });
        taped.execute();
        taped.settle();
        let (mut worker, orders) = worker(reader);
        let figures = Arc::clone(&worker.figures);
        let (reply, mut done) = oneshot::channel();
        let _ = orders.send(RecordOrder::End(reply));
        worker.read();
        assert!(done.try_recv().is_err(), "the last block is not kept yet");
        worker.work();
        assert!(done.try_recv().is_ok() && locked(&figures).reach_ns > 0);
    }
}
