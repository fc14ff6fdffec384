//! Enters in the book of alarms the changes that the scan thread reports to the log's observer.
//!
//! Called by `log_writer` on the monitor thread, which must not wait: while a reader has locked the
//! book, changes wait here, and are entered at the next turn. If records of the scan thread are
//! lost, the book is corrected from the latest image.

use std::sync::{Arc, Mutex, TryLockError};

use super::alarm_book::{AlarmBook, BookTime};
use super::narration::Narration;
use rungd_base::wall_clock::now_ns;
use rungd_runtime::ScanTime;
use rungd_runtime::exchange::Snapshot;
use rungd_runtime::monotonic_ns;

/// The most changes that wait.
const WAITING_MAX: usize = 10_000;

/// The book, for the monitor thread and the operator's service.
pub(super) type SharedBook = Arc<Mutex<AlarmBook>>;

/// A change to be entered.
enum BookNews {
    /// An alarm, by its number, went ON or OFF.
    Edge(usize, bool, BookTime),
    /// A new program is running.
    Swap(u32, Arc<Narration>),
    /// Why a watch did not hold, for the alarm that rose in a scan.
    Explained(String, u64, Vec<String>),
}

/// The monitor thread's side of the book.
pub(super) struct BookKeeper {
    book: SharedBook,
    waiting: Vec<BookNews>,
    /// Changes are lost: the book must be corrected from the next image.
    lost: bool,
    /// The book knows the first scan.
    has_begun: bool,
}

impl BookKeeper {
    pub fn new(book: SharedBook) -> BookKeeper {
        BookKeeper { book, waiting: Vec::new(), lost: false, has_begun: false }
    }

    /// Notes that an alarm went ON or OFF.
    pub fn edge(&mut self, number: u32, on: bool, ScanTime { scan, at_ns }: ScanTime) {
        if self.waiting.len() >= WAITING_MAX {
            self.lost = true;
            return;
        }
        let at = BookTime { scan, at_ns, unix_ns: unix_ns(at_ns) };
        self.waiting.push(BookNews::Edge(number as usize, on, at));
    }

    /// Notes that a new program with these alarms is running.
    pub fn swap(&mut self, generation: u32, narration: &Arc<Narration>) {
        self.waiting.push(BookNews::Swap(generation, Arc::clone(narration)));
    }

    /// Notes why a watch did not hold.
    pub fn explain(&mut self, name: String, scan: u64, why: Vec<String>) {
        if self.waiting.len() < WAITING_MAX {
            self.waiting.push(BookNews::Explained(name, scan, why));
        }
    }

    /// Notes that records of the scan thread are lost.
    pub fn lost(&mut self) {
        self.lost = true;
    }

    /// Enters the waiting changes, unless a reader has locked the book.
    pub fn turn(&mut self, latest: &Snapshot) {
        if self.waiting.is_empty() && !self.lost && self.has_begun {
            return;
        }
        let mut book = match self.book.try_lock() {
            Ok(book) => book,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return,
        };
        book.begin(latest);
        self.has_begun = latest.scans > 0;
        for news in self.waiting.drain(..) {
            match news {
                BookNews::Edge(number, on, at) => book.edge(number, on, at),
                BookNews::Swap(generation, narration) => book.swap(generation, &narration.alarms),
                BookNews::Explained(name, scan, why) => book.explain(&name, scan, why),
            }
        }
        if self.lost && book.reconcile(latest, unix_ns(latest.now_ns)) {
            self.lost = false;
        }
    }
}

/// Converts a time of CLOCK_MONOTONIC to ns since 1970 (UTC), based on the current difference of
/// the two clocks.
pub(super) fn unix_ns(at_ns: u64) -> i64 {
    let ago = i64::try_from(monotonic_ns().saturating_sub(at_ns)).unwrap_or(i64::MAX);
    now_ns().saturating_sub(ago)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daemon::alarm_book::{self, AlarmSource, KnownAlarm};
    use rungd_runtime::exchange::Mode;

    fn image(scans: u64, on: bool) -> Snapshot {
        let image = alarm_book::tests::image(scans, Mode::Run);
        Snapshot { now_ns: scans, bits: vec![u8::from(on)].into(), ..image }
    }

    #[test]
    fn changes_during_a_read_of_the_alarm_book_are_applied_later() {
        let alarm = KnownAlarm {
            of: AlarmSource::Bit(rungd_engine::Cell::Bit(rungd_engine::BitCell(0))),
            tag: "jam".to_owned(),
            text: "Jammed".to_owned(),
            terms: rungd_language::resolve::alarm_terms::AlarmTerms::default(),
            may_be_shelved: true,
        };
        let book: SharedBook = Arc::new(Mutex::new(AlarmBook::new(&[alarm])));
        let mut keeper = BookKeeper::new(Arc::clone(&book));
        keeper.edge(0, true, ScanTime { scan: 4, at_ns: 4 });
        {
            let read = book.lock().unwrap();
            keeper.turn(&image(4, true));
            assert!(read.list(9).is_empty(), "it does not wait for the reader");
        }
        keeper.turn(&image(5, true));
        assert_eq!(book.lock().unwrap().list(9)[0].since.map(|since| since.scan), Some(4));
        keeper.lost();
        keeper.turn(&image(8, false));
        let read = book.lock().unwrap();
        assert_eq!(read.list(9)[0].ended.map(|ended| ended.scan), Some(8));
        assert!(read.agrees(&image(8, false)) && !read.agrees(&image(8, true)));
    }
}
