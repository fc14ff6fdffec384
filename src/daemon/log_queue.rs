//! Log lines on their way to standard error, which may be slow, or stuck.
//!
//! Who logs hands a line to a bounded queue and goes on; one thread writes. When the reader of the
//! log stalls, lines are dropped and counted, and a line says so once it reads again; lines that
//! cannot be written, as on a full disk, are counted too. So neither the Modbus server nor the
//! monitor ever waits for a terminal or for the journal.

use std::cell::RefCell;
use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use tracing_subscriber::fmt::MakeWriter;

/// How many lines wait before further ones are dropped.
const LINES_MAX: usize = 4096;
/// For how long the end of the process waits for a log that does not move.
const FLUSH_MAX: Duration = Duration::from_secs(1);
/// Dropped lines are told of this often at most.
const TELL_DROPPED_EVERY: Duration = Duration::from_secs(1);

/// How long the writing thread rests where standard error does not block and has no room.
const REST: Duration = Duration::from_millis(5);

enum Item {
    Line(Vec<u8>),
    /// All before it is written: answer.
    Flush(SyncSender<()>),
}

/// Lines dropped since the process started, for who asks.
pub(super) static LINES_DROPPED: AtomicU64 = AtomicU64::new(0);

/// The end that logs. Cheap to clone.
#[derive(Clone)]
pub struct LogQueue {
    sender: SyncSender<Item>,
    dropped: Arc<AtomicU64>,
}

impl LogQueue {
    /// A queue, and the thread that writes what is in it.
    ///
    /// # Errors
    /// The machine gives no thread.
    pub fn new(out: impl Write + Send + 'static) -> io::Result<LogQueue> {
        let (sender, receiver) = sync_channel(LINES_MAX);
        let dropped = Arc::new(AtomicU64::new(0));
        let queue = LogQueue { sender, dropped: Arc::clone(&dropped) };
        let writer = thread::Builder::new().name("rungd-log".into());
        writer.spawn(move || write_lines(&receiver, &dropped, out))?;
        Ok(queue)
    }

    /// Waits until what was logged so far is written; not for ever.
    pub fn flush(&self) {
        let deadline = Instant::now() + FLUSH_MAX;
        let (done, answer) = sync_channel(1);
        let mut item = Item::Flush(done);
        while let Err(error) = self.sender.try_send(item) {
            item = match error {
                std::sync::mpsc::TrySendError::Full(item) if Instant::now() < deadline => item,
                _ => return,
            };
            thread::sleep(Duration::from_millis(5));
        }
        let _ = answer.recv_timeout(deadline.saturating_duration_since(Instant::now()));
    }
}

impl Write for LogQueue {
    /// A whole line, as `tracing_subscriber` writes them.
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let own = OWN.with_borrow_mut(|own| own.as_mut().map(|own| own.extend(line)));
        if own.is_none() && self.sender.try_send(Item::Line(line.to_vec())).is_err() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
            LINES_DROPPED.fetch_add(1, Ordering::Relaxed);
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<'a> MakeWriter<'a> for LogQueue {
    type Writer = LogQueue;

    fn make_writer(&'a self) -> LogQueue {
        self.clone()
    }
}

thread_local! {
    /// On the writing thread: what it logs itself. It cannot queue behind itself in a full queue.
    static OWN: RefCell<Option<Vec<u8>>> = const { RefCell::new(None) };
}

/// Where the lines go.
struct Sink<W> {
    out: W,
    /// The last line stopped in its midst.
    torn: bool,
}

impl<W: Write> Sink<W> {
    /// Writes a line, however long that takes; false if it cannot be written.
    fn line(&mut self, line: &[u8]) -> bool {
        if self.torn && self.write(b"\n") == 0 {
            return false;
        }
        let written = self.write(line);
        self.torn = (1..line.len()).contains(&written);
        written == line.len()
    }

    /// How many of the bytes could be written.
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

fn write_lines(receiver: &Receiver<Item>, dropped: &AtomicU64, out: impl Write) {
    OWN.set(Some(Vec::new()));
    let mut out = Sink { out, torn: false };
    let mut told: Option<Instant> = None;
    for item in receiver {
        match item {
            Item::Line(line) => {
                // A log that is gone is no reason to end; one that comes back hears of it.
                if !out.line(&line) {
                    dropped.fetch_add(1, Ordering::Relaxed);
                    LINES_DROPPED.fetch_add(1, Ordering::Relaxed);
                }
                if told.is_none_or(|told| told.elapsed() >= TELL_DROPPED_EVERY) {
                    told = tell_dropped(dropped, &mut out).or(told);
                }
            }
            Item::Flush(done) => {
                tell_dropped(dropped, &mut out);
                let _ = out.out.flush();
                let _ = done.try_send(());
            }
        }
    }
}

/// Tells how many lines were dropped since it was told last, in the form of the log; when it tried.
fn tell_dropped<W: Write>(dropped: &AtomicU64, out: &mut Sink<W>) -> Option<Instant> {
    let lines = dropped.swap(0, Ordering::Relaxed);
    if lines == 0 {
        return None;
    }
    tracing::warn!(
        lines,
        "log lines were dropped: the log was read too slowly, or could not be written"
    );
    let own = OWN.with_borrow_mut(|own| own.as_mut().map(std::mem::take));
    if !out.line(&own.unwrap_or_default()) {
        dropped.fetch_add(lines, Ordering::Relaxed);
    }
    Some(Instant::now())
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    /// Writes nothing until it is let.
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

    /// Takes a byte at a time, and between them has no room; fails while it is to.
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

    #[test]
    fn a_log_without_room_is_waited_for_and_failures_are_counted() {
        let narrow = Narrow::default();
        let mut queue = LogQueue::new(narrow.clone()).unwrap();
        queue.write_all(b"one\n").unwrap();
        LogQueue::flush(&queue);
        assert_eq!(*narrow.text.lock().unwrap(), b"one\n");
        let dropped = AtomicU64::new(5);
        let mut sink = Sink { out: narrow.clone(), torn: true };
        *narrow.fails.lock().unwrap() = true;
        OWN.set(Some(b"dropped\n".to_vec()));
        assert!(!sink.line(b"two\n") && tell_dropped(&dropped, &mut sink).is_some());
        assert_eq!(dropped.load(Ordering::Relaxed), 5, "still to be told");
        *narrow.fails.lock().unwrap() = false;
        OWN.set(Some(b"dropped\n".to_vec()));
        assert!(tell_dropped(&dropped, &mut sink).is_some() && sink.line(b"three\n"));
        assert_eq!(*narrow.text.lock().unwrap(), b"one\n\ndropped\nthree\n");
        assert_eq!(dropped.load(Ordering::Relaxed), 0);
        OWN.set(None);
    }

    #[test]
    fn a_stuck_log_costs_lines_and_no_time() {
        let stuck = Stuck::default();
        let mut queue = LogQueue::new(stuck.clone()).unwrap();
        let held = stuck.0.lock().unwrap();
        let before = Instant::now();
        for _ in 0..2 * LINES_MAX {
            queue.write_all(b"x\n").unwrap();
        }
        assert!(before.elapsed() < Duration::from_secs(1));
        let dropped = queue.dropped.load(Ordering::Relaxed) as usize;
        assert!(dropped >= LINES_MAX - 1, "{dropped}");
        drop(held);
        LogQueue::flush(&queue);
        // Without a subscriber the line that tells of them goes nowhere.
        assert_eq!(stuck.0.lock().unwrap().len() / 2, 2 * LINES_MAX - dropped);
        assert_eq!(queue.dropped.load(Ordering::Relaxed), 0, "told");
    }
}
