//! The queue of log lines for standard error or the journal, which may be slow or stuck.
//!
//! A thread that logs puts a line into a bounded queue and continues; one thread writes. When the
//! reader of the log stalls, lines are dropped and counted; when it reads again, a line reports the
//! count. Lines that cannot be written, for example on a full disk, are counted too. So neither the
//! Modbus server nor the monitor ever waits for a terminal or for the journal. The writing thread
//! also reports the lines that were withheld from events that come too often.

use std::cell::RefCell;
use std::io::{self, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, TrySendError, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use super::journal::Socket;
use super::log_chain::{ChainedForm, LogChain};
use super::log_channel::{LineReceiver, LineSender, LogItem, LogRoom, line_channel};
use rungd_base::duration_text::duration_text;
use rungd_base::locked::locked;
use rungd_runtime::events::Event;
use rungd_runtime::events::limit::{Limiter, WithheldLines};
use rungd_runtime::say::say;

/// The last places are for lines that are no details.
const ROOM: LogRoom = LogRoom { details: 4096, lines: 4096 + 512 };
/// If no line is written for this time, the end of the process waits no longer.
const FLUSH_MAX: Duration = Duration::from_secs(1);
/// The greatest number of such times that the end of the process waits for a slow reader.
const FLUSH_ROUNDS_MAX: u32 = 5;
/// The shortest time between two lines about dropped and withheld lines.
const TELL_EVERY: Duration = Duration::from_secs(1);
/// The pause of the writing thread when standard error is non-blocking and has no room.
const REST: Duration = Duration::from_millis(5);
/// journald determines the unit of an entry only when it reads the entry. A process that ends
/// within its first second waits this long, so that its lines are assigned to its unit.
const LINGER: Duration = Duration::from_millis(50);

/// Lines lost since the process started.
static LINES_DROPPED: AtomicU64 = AtomicU64::new(0);

/// The number of lines that the log has lost since the process started.
pub fn lines_dropped() -> u64 {
    LINES_DROPPED.load(Ordering::Relaxed)
}

/// The limits of events, by name.
type EventLimits = Limiter<&'static str>;

/// A formatted line.
pub(super) struct FormedLine {
    /// The line for standard error, including its end of line.
    pub line: Vec<u8>,
    /// The entry for the journal's socket; empty if there is none.
    pub entry: Vec<u8>,
    /// Whether its level is debug or trace: such lines are dropped first.
    pub detail: bool,
    /// How the line has its link, if it belongs to a chained audit trail.
    pub chained: Option<ChainedForm>,
}

/// The sending end of the queue. Cheap to clone.
#[derive(Clone)]
pub(super) struct LogQueue {
    sender: LineSender<FormedLine>,
    limits: Arc<Mutex<EventLimits>>,
    started: Instant,
}

impl LogQueue {
    /// Makes a queue, and starts the thread that writes its lines: to the journal if there is a
    /// socket, else to `out`.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn new(
        out: impl Write + Send + 'static,
        journal: Option<Socket>,
        chain: Option<LogChain>,
    ) -> io::Result<LogQueue> {
        let (queue, tally) = LogQueue::with_tally();
        let sink = LineSink { out, rest: Vec::new(), journal, chain, unkept: None };
        let writer = thread::Builder::new().name("rungd-log".into());
        writer.spawn(move || write_lines(tally, sink))?;
        Ok(queue)
    }

    /// A queue, and the end of the thread that writes its lines.
    fn with_tally() -> (LogQueue, LineTally) {
        let (sender, receiver) = line_channel(ROOM);
        let (limits, started) = (Arc::new(Mutex::new(EventLimits::new())), Instant::now());
        let tally = LineTally {
            receiver,
            limits: Arc::clone(&limits),
            started,
            told: None,
            is_unkept_told: false,
        };
        (LogQueue { sender, limits, started }, tally)
    }

    /// Whether the event's limit permits one more line.
    pub fn may_write(&self, event: &'static Event) -> bool {
        let now_ns = self.started.elapsed().as_nanos() as u64;
        locked(&self.limits).take(event.name, event.limit, now_ns)
    }

    /// Hands a line over, or counts it as dropped. Never waits.
    pub fn push(&self, formed: FormedLine) {
        let not_own = OWN.with_borrow_mut(|own| match own {
            Some(own) => {
                own.push(formed);
                None
            }
            None => Some(formed),
        });
        let Some(formed) = not_own else { return };
        let is_detail = formed.detail;
        if !self.sender.send(formed, is_detail) {
            LINES_DROPPED.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Waits until the lines logged so far are written, for a limited time.
    pub fn flush(&self) {
        let deadline = Instant::now() + FLUSH_MAX;
        let (done, answer) = sync_channel(1);
        while let Err(error) = self.sender.request_flush(done.clone()) {
            match error {
                TrySendError::Full(_) if Instant::now() < deadline => {}
                TrySendError::Full(_) | TrySendError::Disconnected(_) => return,
            }
            thread::sleep(Duration::from_millis(5));
        }
        // If the writing thread is gone, there is no answer to wait for.
        drop(done);
        // The wait for a slow reader lasts as long as it reads.
        for _ in 0..FLUSH_ROUNDS_MAX {
            let waiting = self.sender.waiting();
            let timed_out = answer.recv_timeout(FLUSH_MAX) == Err(RecvTimeoutError::Timeout);
            if !timed_out || self.sender.waiting() >= waiting {
                return;
            }
        }
    }
}

thread_local! {
    /// The lines logged by the writing thread itself: it cannot queue them, because its own queue
    /// may be full.
    static OWN: RefCell<Option<Vec<FormedLine>>> = const { RefCell::new(None) };
}

/// The destination of the lines.
struct LineSink<W> {
    out: W,
    /// The part of the last line that is not written yet: nothing else comes before it, so that
    /// every line of the log stays whole, with its link.
    rest: Vec<u8>,
    journal: Option<Socket>,
    /// The chain of the audit trail.
    chain: Option<LogChain>,
    /// Why the newest link of the chain is not kept, until the log reports it.
    unkept: Option<io::Error>,
}

impl<W: Write> LineSink<W> {
    /// Writes a line, however long this takes; false if it cannot be written. A line that is not
    /// written has no link, so the chain stays whole.
    fn put(&mut self, formed: &FormedLine) -> bool {
        let Some((chain, form)) = self.chain.as_ref().zip(formed.chained) else {
            return self.put_bytes(&formed.line, &formed.entry);
        };
        let chained = chain.chained(form, &formed.line, &formed.entry);
        let is_written = self.put_bytes(&chained.line, &chained.entry);
        if let Some(chain) = self.chain.as_mut().filter(|_| is_written) {
            self.unkept = chain.keep(chained.link).err().or(self.unkept.take());
        }
        is_written
    }

    fn put_bytes(&mut self, line: &[u8], entry: &[u8]) -> bool {
        let sent = match &self.journal {
            Some(journal) if !entry.is_empty() => sent(journal, entry),
            _ => false,
        };
        sent || self.line(line)
    }

    /// Writes the newest link of the chain to the disk.
    fn sync_chain(&mut self) {
        if let Some(chain) = &mut self.chain {
            self.unkept = chain.sync().err().or(self.unkept.take());
        }
    }

    /// Writes a line; true also if its rest is still to be written.
    fn line(&mut self, line: &[u8]) -> bool {
        if !self.finish() {
            return false;
        }
        let written = self.write(line);
        if written > 0 {
            self.rest = line[written..].to_vec();
        }
        written > 0
    }

    /// Writes the rest of a line of which only a part was written; false if there is still one.
    fn finish(&mut self) -> bool {
        let mut rest = std::mem::take(&mut self.rest);
        let written = self.write(&rest);
        self.rest = rest.split_off(written);
        self.rest.is_empty()
    }

    /// Writes as many of the bytes as possible, and returns their number.
    fn write(&mut self, bytes: &[u8]) -> usize {
        let mut written = 0;
        while written < bytes.len() {
            match self.out.write(&bytes[written..]) {
                Ok(0) => break,
                Ok(count) => written += count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => thread::sleep(REST),
                Err(_) => break,
            }
        }
        written
    }
}

/// Sends an entry, however long the journal does not read; false if it cannot be sent.
fn sent(journal: &Socket, entry: &[u8]) -> bool {
    // Only few datagrams fit in at once. So the first pause is short, for a journal that is
    // reading.
    let mut rest = REST / 64;
    loop {
        match journal.send(entry) {
            Ok(()) => return true,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                thread::sleep(rest);
                rest = REST.min(2 * rest);
            }
            Err(_) => return false,
        }
    }
}

/// The writing thread's end of the queue, and the counts that it reports.
struct LineTally {
    receiver: LineReceiver<FormedLine>,
    limits: Arc<Mutex<EventLimits>>,
    started: Instant,
    told: Option<Instant>,
    /// Whether the log has reported that the chain is not kept.
    is_unkept_told: bool,
}

impl LineTally {
    /// Reports the dropped and withheld lines, in the form of the log: those that are due, or at
    /// the end all of them.
    fn report_withheld<W: Write>(&mut self, out: &mut LineSink<W>, all: bool) {
        if !all && self.told.is_some_and(|told| told.elapsed() < TELL_EVERY) {
            return;
        }
        self.told = Some(Instant::now());
        out.sync_chain();
        let now_ns = self.started.elapsed().as_nanos() as u64;
        let told = locked(&self.limits).due_reports(now_ns, all);
        for (withheld, WithheldLines { lines, lasted_ns }) in told {
            let over = duration_text(lasted_ns);
            say!(
                LINES_WITHHELD,
                withheld,
                lines,
                "{withheld} comes too often: {lines} lines of the last {over} were left out"
            );
        }
        if let Some(why) = out.unkept.take().filter(|_| !self.is_unkept_told) {
            self.is_unkept_told = true;
            say!(
                LOG_CHAIN at Error,
                "the newest link of the chain cannot be kept: {why}; a next start will not go on \
                 behind it"
            );
        }
        let lines = self.receiver.take_dropped();
        if lines > 0 {
            say!(
                LOG_DROPPED,
                lines,
                lost = lines_dropped(),
                "log lines were dropped: the log was read too slowly, or could not be written"
            );
        }
        let own = OWN.with_borrow_mut(|own| own.as_mut().map(std::mem::take));
        let mut written = true;
        for formed in own.unwrap_or_default() {
            written &= out.put(&formed);
        }
        if !written {
            // These lines must be reported later.
            self.receiver.count_dropped(lines);
        }
    }
}

fn write_lines(mut tally: LineTally, mut out: LineSink<impl Write>) {
    OWN.set(Some(Vec::new()));
    loop {
        match tally.receiver.receive(TELL_EVERY) {
            Ok(LogItem::Line(formed)) => {
                // A lost log does not end rungd; when it comes back, it receives the count.
                if !out.put(&formed) {
                    tally.receiver.count_dropped(1);
                    LINES_DROPPED.fetch_add(1, Ordering::Relaxed);
                }
                tally.report_withheld(&mut out, false);
            }
            Ok(LogItem::Flush(done)) => {
                tally.report_withheld(&mut out, true);
                out.finish();
                let _ = out.out.flush();
                out.sync_chain();
                if out.journal.is_some() && tally.started.elapsed() < TELL_EVERY {
                    thread::sleep(LINGER);
                }
                let _ = done.try_send(());
            }
            Err(RecvTimeoutError::Timeout) => {
                out.finish();
                tally.report_withheld(&mut out, false);
            }
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::log_chain::ChainLink;
    use super::*;

    fn formed(line: &[u8]) -> FormedLine {
        FormedLine { line: line.to_vec(), entry: Vec::new(), detail: false, chained: None }
    }

    /// Writes nothing while the test holds its lock.
    #[derive(Clone, Default)]
    struct Stuck(Arc<Mutex<Vec<u8>>>);

    impl Write for Stuck {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Takes a byte at a time, and has no room in between; fails while `fails` is true.
    #[derive(Clone, Default)]
    struct Narrow {
        text: Arc<Mutex<Vec<u8>>>,
        turn: bool,
        fails: Arc<Mutex<bool>>,
    }

    impl Write for Narrow {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if *self.fails.lock().unwrap() {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.turn = !self.turn;
            if self.turn {
                return Err(io::ErrorKind::WouldBlock.into());
            }
            self.text.lock().unwrap().push(bytes[0]);
            Ok(1)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn sink<W>(out: W, chain: Option<LogChain>) -> LineSink<W> {
        LineSink { out, rest: Vec::new(), journal: None, chain, unkept: None }
    }

    /// Has room for some bytes, and then for none.
    #[derive(Default)]
    struct FullDisk {
        text: Vec<u8>,
        room: usize,
    }

    impl Write for FullDisk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let count = bytes.len().min(self.room);
            if count == 0 {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.room -= count;
            self.text.extend(&bytes[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_line_that_was_written_in_part_is_completed_first_and_the_chain_stays_whole() {
        let file = std::env::temp_dir().join(format!("rungd-torn-{}", std::process::id()));
        let _ = std::fs::remove_file(&file);
        let chained = |text: &[u8]| FormedLine { chained: Some(ChainedForm::Text), ..formed(text) };
        let mut sink = sink(FullDisk::default(), Some(LogChain::open(&file).unwrap().0));
        sink.out.room = 20;
        assert!(sink.put(&chained(b"one\n")), "its rest comes first");
        assert!(!sink.put(&chained(b"lost\n")));
        sink.out.room = 1000;
        assert!(sink.put(&chained(b"two\n")));
        let one = ChainLink::NONE.next(b"one");
        let expected = format!("one chain={one}\ntwo chain={}\n", one.next(b"two"));
        assert_eq!(String::from_utf8(sink.out.text.clone()).unwrap(), expected);
        assert!(!sink.chain.as_ref().unwrap().is_synced());
        LogQueue::with_tally().1.report_withheld(&mut sink, false);
        assert!(sink.chain.as_ref().unwrap().is_synced(), "though lines come without a pause");
        let _ = std::fs::remove_file(file);
    }

    #[test]
    fn a_full_log_is_retried_and_failures_are_counted() {
        let narrow = Narrow::default();
        let queue = LogQueue::new(narrow.clone(), None, None).unwrap();
        queue.push(formed(b"one\n"));
        queue.flush();
        assert_eq!(*narrow.text.lock().unwrap(), b"one\n");
        let (_, mut tally) = LogQueue::with_tally();
        tally.receiver.count_dropped(5);
        let mut sink = sink(narrow.clone(), None);
        sink.rest = b"1\n".to_vec();
        *narrow.fails.lock().unwrap() = true;
        OWN.set(Some(vec![formed(b"dropped\n")]));
        assert!(!sink.line(b"two\n"));
        tally.report_withheld(&mut sink, true);
        assert_eq!(tally.receiver.take_dropped(), 5, "still to be told");
        tally.receiver.count_dropped(5);
        *narrow.fails.lock().unwrap() = false;
        OWN.set(Some(vec![formed(b"dropped\n")]));
        tally.report_withheld(&mut sink, true);
        assert!(sink.line(b"three\n"));
        assert_eq!(*narrow.text.lock().unwrap(), b"one\n1\ndropped\nthree\n");
        assert_eq!(tally.receiver.take_dropped(), 0);
        OWN.set(None);
    }

    #[test]
    fn a_stuck_log_loses_lines_but_does_not_block() {
        let stuck = Stuck::default();
        let queue = LogQueue::new(stuck.clone(), None, None).unwrap();
        let held = stuck.0.lock().unwrap();
        let before = Instant::now();
        for _ in 0..2 * ROOM.lines {
            queue.push(formed(b"x\n"));
        }
        assert!(before.elapsed() < Duration::from_secs(1));
        let dropped = queue.sender.dropped() as usize;
        assert!(dropped >= ROOM.lines - 1, "{dropped}");
        drop(held);
        queue.flush();
        // Without a subscriber the line about the dropped lines goes nowhere.
        assert_eq!(stuck.0.lock().unwrap().len() / 2, 2 * ROOM.lines - dropped);
        assert_eq!(queue.sender.dropped(), 0, "told");
    }

    #[test]
    fn details_leave_room_for_important_lines() {
        let stuck = Stuck::default();
        let queue = LogQueue::new(stuck.clone(), None, None).unwrap();
        let held = stuck.0.lock().unwrap();
        for _ in 0..2 * ROOM.lines {
            queue.push(FormedLine { detail: true, ..formed(b"x\n") });
        }
        let dropped = queue.sender.dropped();
        (0..500).for_each(|_| queue.push(formed(b"n\n")));
        assert_eq!(queue.sender.dropped(), dropped, "all of them had room");
        drop(held);
        queue.flush();
        let news = stuck.0.lock().unwrap().iter().filter(|byte| **byte == b'n').count();
        assert_eq!(news, 500);
    }
}
