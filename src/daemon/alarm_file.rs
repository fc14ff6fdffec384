//! The file of alarms: shelves and acknowledgements survive a restart.
//!
//! `start_parts` reads the file, and the shell enters its content in the book before the first
//! scan. A thread of its own writes the file as a whole after each change, and ends the shelves
//! whose time is over; it looks once a second. A disk that stalls holds only this thread. The file
//! is there only while there is something to keep. A file that cannot be read is renamed: then no
//! alarm is shelved, and every alarm has to be acknowledged again.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use tokio::sync::oneshot;
use tokio::time::{Instant, sleep, timeout};

use super::alarm_book::{BookTime, EndedShelf, KeptAlarms, ShelfEnd};
use super::alarm_keeper::{SharedBook, unix_ns};
use super::narration::one_line;
use rungd_base::directories;
use rungd_base::duration_text::duration_text;
use rungd_base::locked::locked;
use rungd_base::regular_file;
use rungd_base::whole_file::{FileRights, replace};
use rungd_runtime::exchange::Port;
use rungd_runtime::monotonic_ns;
use rungd_runtime::say::say;
use rungd_state::retain::file::rename_aside;

/// The file's name in systemd's state directory, and its extension beside a controller file.
const FILE_NAME: &str = "alarms";
/// How often the thread looks for shelves that end.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// The longest time that a request waits for the disk.
const KEPT_MAX: Duration = Duration::from_secs(5);
/// The most ends of shelves that are told one by one.
const TOLD_MAX: usize = 100;

/// The file as it was at the start.
pub(super) struct AlarmFile {
    path: PathBuf,
    kept: KeptAlarms,
}

impl AlarmFile {
    /// The path of a controller's file: in systemd's state directory, else beside the controller
    /// file.
    pub fn place(controller: &Path) -> PathBuf {
        directories::state_file(FILE_NAME, controller)
    }

    /// Reads the file. One that is not what rungd wrote is renamed.
    pub fn read(path: PathBuf) -> AlarmFile {
        let kept = match regular_file::read_bytes(&path) {
            Ok(bytes) => KeptAlarms::read(&bytes),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(KeptAlarms::default()),
            Err(error) => Err(error.to_string()),
        };
        let kept = kept.unwrap_or_else(|why| {
            tell_unreadable(&path, &why);
            KeptAlarms::default()
        });
        AlarmFile { path, kept }
    }

    /// Enters the content in the book, and starts the thread that writes the file.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(self, book: SharedBook, port: Port) -> io::Result<AlarmFileHandle> {
        let AlarmFile { path, kept } = self;
        locked(&book).restore(kept.clone(), now(&port));
        let (orders, inbox) = channel();
        let file = path.display().to_string().into();
        let handle = AlarmFileHandle { orders, book: Arc::clone(&book), file };
        let writer = AlarmFileWriter { path, book, port, written: kept, failed: None };
        thread::Builder::new().name("rungd-alarms".into()).spawn(move || writer.work(&inbox))?;
        Ok(handle)
    }
}

/// The present time by both clocks, and the latest scan.
pub(super) fn now(port: &Port) -> BookTime {
    let at_ns = monotonic_ns();
    BookTime { scan: port.latest().scans, at_ns, unix_ns: unix_ns(at_ns) }
}

fn tell_unreadable(path: &Path, why: &str) {
    let aside = match rename_aside(path) {
        Ok(aside) => format!("it was renamed to {}", aside.display()),
        Err(error) => format!("it stays, because it cannot be renamed: {error}"),
    };
    let (file, why) = (path.display(), one_line(why));
    say!(
        ALARM_FILE,
        %file,
        why,
        "{file} is not used: {why}; {aside}. No alarm is shelved, and every alarm has to be \
         acknowledged"
    );
}

/// Who waits until the file has a change.
type KeptOrder = oneshot::Sender<Result<(), String>>;

/// A handle to the thread. Cheap to clone.
#[derive(Clone)]
pub(super) struct AlarmFileHandle {
    orders: Sender<Option<KeptOrder>>,
    book: SharedBook,
    /// The path, as the log shows it.
    file: Arc<str>,
}

impl AlarmFileHandle {
    /// The book that the file keeps a part of.
    pub fn book(&self) -> SharedBook {
        Arc::clone(&self.book)
    }

    /// Has a change written, without waiting for it.
    pub fn changed(&self) {
        let _ = self.orders.send(None);
    }

    /// Has all changes written; returns once they are durable.
    ///
    /// # Errors
    /// Why they are not.
    pub async fn kept(&self) -> Result<(), String> {
        match timeout(KEPT_MAX, self.order()).await {
            Ok(Ok(kept)) => kept,
            Ok(Err(_)) => Err("the thread that writes the file has ended".to_owned()),
            Err(_) => Err("the disk has not answered yet".to_owned()),
        }
    }

    /// Orders the last changes to be written, after the end of the scan thread.
    pub fn end(&self) -> AlarmFileEnd {
        let (answer, file) = (self.order(), Arc::clone(&self.file));
        AlarmFileEnd { answer, begin: Instant::now(), file }
    }

    fn order(&self) -> oneshot::Receiver<Result<(), String>> {
        let (order, answer) = oneshot::channel();
        let _ = self.orders.send(Some(order));
        answer
    }
}

/// The end of the process: the last changes are being written.
pub(super) struct AlarmFileEnd {
    answer: oneshot::Receiver<Result<(), String>>,
    begin: Instant,
    file: Arc<str>,
}

impl AlarmFileEnd {
    /// Waits until the file has them, for a limited time. `hurry` ends the wait: then this is
    /// false.
    pub async fn wait(self, hurry: impl Future<Output = &'static str>) -> bool {
        let (why, continues) = tokio::select! {
            answer = self.answer => match answer {
                // If it failed, the thread has logged why.
                Ok(_) => return true,
                Err(_) => ("the thread that writes it has ended".to_owned(), true),
            },
            name = hurry => (format!("{name} came before they were durable"), false),
            () = sleep(KEPT_MAX.saturating_sub(self.begin.elapsed())) => {
                let waited = duration_text(KEPT_MAX.as_nanos() as u64);
                (format!("the disk has not answered for {waited}"), true)
            }
        };
        say!(
            ALARM_FILE,
            file = %self.file,
            why,
            "the next start may not know the last shelves and acknowledgements: {why}"
        );
        continues
    }
}

/// The thread.
struct AlarmFileWriter {
    path: PathBuf,
    book: SharedBook,
    port: Port,
    /// What the file has.
    written: KeptAlarms,
    /// Why the last write failed.
    failed: Option<String>,
}

impl AlarmFileWriter {
    /// Works until the last handle is gone.
    fn work(mut self, inbox: &Receiver<Option<KeptOrder>>) {
        loop {
            let first = match inbox.recv_timeout(LOOK_EVERY) {
                Ok(order) => order,
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => return,
            };
            let waiting: Vec<KeptOrder> =
                [first].into_iter().chain(inbox.try_iter()).flatten().collect();
            let ended = locked(&self.book).lapse(now(&self.port));
            tell_ended(&ended);
            let written = self.write();
            waiting.into_iter().for_each(|order| drop(order.send(written.clone())));
        }
    }

    /// Writes what is to be kept, if the file does not have it.
    fn write(&mut self) -> Result<(), String> {
        let kept = {
            // The image is read behind the book, which is then no newer than it.
            let book = locked(&self.book);
            book.kept(&self.written, &self.port.latest())
        };
        if kept == self.written {
            return Ok(());
        }
        let done = match kept.is_empty() {
            true => removed(&self.path),
            false => replace(&self.path, &kept.bytes(), FileRights::Kept(0o640)),
        };
        let done = done.map_err(|error| format!("{}: {error}", self.path.display()));
        match &done {
            Ok(()) => (self.written, self.failed) = (kept, None),
            Err(why) if self.failed.as_ref() == Some(why) => {}
            Err(why) => {
                self.failed = Some(why.clone());
                let file = self.path.display();
                say!(
                    ALARM_FILE,
                    %file,
                    why,
                    "a restart would forget shelves and acknowledgements: {why}; rungd tries again"
                );
            }
        }
        done
    }
}

fn removed(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// Logs the shelves that ended without a request.
fn tell_ended(ended: &[EndedShelf]) {
    for EndedShelf { tag, text, shelf, why } in ended.iter().take(TOLD_MAX) {
        let why = match why {
            ShelfEnd::TimeOver => "its time is over",
            ShelfEnd::Critical => {
                "it is critical, and the controller file has no `[alarms] shelve-critical = true`"
            }
            ShelfEnd::Gone => "the program does not have it",
        };
        let (tag, was) = (one_line(tag), shelf.words());
        // A program that does not have the alarm does not have its text.
        let text = match text.is_empty() {
            true => String::new(),
            false => format!(" ({})", one_line(text)),
        };
        let (who, reason) = (one_line(&shelf.who), one_line(&shelf.why));
        let lasted_ns = unix_ns(monotonic_ns()).saturating_sub(shelf.since_ns).max(0);
        let lasted = duration_text(lasted_ns.unsigned_abs());
        say!(
            ALARM_UNSHELVED,
            %tag,
            why,
            "alarm {tag} is no longer {was}: {why}; {who} wanted it {lasted} ago: {reason}{text}"
        );
    }
    if let Some(more) = ended.len().checked_sub(TOLD_MAX).filter(|more| *more > 0) {
        say!(ALARM_UNSHELVED, more, "{more} more alarms are no longer shelved");
    }
}

#[cfg(test)]
mod tests {
    use std::future::{pending, ready};
    use std::sync::Mutex;

    use super::super::alarm_book::AlarmBook;
    use super::*;

    /// A handle to a thread that does not answer, and its orders.
    fn stalled() -> (AlarmFileHandle, Receiver<Option<KeptOrder>>) {
        let (orders, inbox) = channel();
        let book = Arc::new(Mutex::new(AlarmBook::new(&[])));
        (AlarmFileHandle { orders, book, file: "controller.alarms".into() }, inbox)
    }

    #[tokio::test(start_paused = true)]
    async fn a_second_signal_ends_the_wait_for_a_disk_that_stalls() {
        let (handle, _inbox) = stalled();
        let begin = Instant::now();
        assert!(!handle.end().wait(ready("SIGTERM")).await);
        assert_eq!(begin.elapsed(), Duration::ZERO);
    }

    #[tokio::test(start_paused = true)]
    async fn the_wait_for_the_disk_counts_from_its_order() {
        let (handle, _inbox) = stalled();
        let begin = Instant::now();
        let end = handle.end();
        sleep(KEPT_MAX / 2).await;
        assert!(end.wait(pending()).await, "the process ends without it");
        // The clock of tokio counts whole ms.
        assert!(begin.elapsed() <= KEPT_MAX + Duration::from_millis(1));
    }

    #[tokio::test(start_paused = true)]
    async fn the_end_waits_no_longer_than_the_thread_works() {
        let (handle, inbox) = stalled();
        let end = handle.end();
        let order = inbox.try_recv().ok().flatten().expect("it is ordered before the wait");
        order.send(Err("no space".to_owned())).expect("somebody waits");
        assert!(end.wait(pending()).await);
    }
}
