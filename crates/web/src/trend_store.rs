//! Trends over hours: what is known of each operand, and the reading of the scan log for what is
//! not.
//!
//! Called by `api`. The last minute comes from the live view, of which each question adds what is
//! whole. What is older is read from the scan log (`live::past_trend`) on one thread, which reads
//! all operands in turn, of each the newest part first, in pieces, with a pause as long as the
//! work; it ends when nobody asks any more. So a question never waits for the log: it gets what is
//! known, and names the rest.

use std::cmp::Reverse;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::journal::say;
use super::trend_line::{
    CHUNK_NS, EmptyStep, SECOND_NS, StepValues, TREND_MAX_NS, TrendLine, TrendStep,
};
use rungd_base::locked::locked;
use rungd_client::live::{NewestPiece, OpenedPast, TrendPast};

/// The most operands that are kept; the one that was asked for longest ago is forgotten.
const LINES_MAX: usize = 24;
/// The points of a trend, at most, and about.
const STEPS_MAX: i64 = 600;
/// The most chunks that are read at once: ten minutes.
const CHUNKS_READ_MAX: i64 = 40;
/// Nobody has asked for so long: the reading ends.
const UNASKED: Duration = Duration::from_secs(60);
/// The shortest time between two readings for one operand.
const READ_AGAIN: Duration = Duration::from_secs(5);
/// The longest pause between two pieces.
const PAUSE_MAX: Duration = Duration::from_secs(2);

/// The trends of all operands that somebody has asked for.
#[derive(Clone, Default)]
pub(super) struct TrendStore {
    trends: Arc<Mutex<HashMap<String, StoredTrend>>>,
    /// Whether a thread reads the scan log.
    is_read: Arc<AtomicBool>,
}

/// Lets another reader begin after a panic of this one.
struct ReaderEnd<'a>(&'a AtomicBool);

impl Drop for ReaderEnd<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.store(false, Ordering::Relaxed);
        }
    }
}

/// The trend of an operand.
struct StoredTrend {
    line: TrendLine,
    asked: Instant,
    /// What was asked for: from this time on.
    from_ns: i64,
    /// Up to here the scan log is read: the end of the chunk in which the live view begins.
    until_ns: i64,
    /// When the last reading ended.
    read: Option<Instant>,
    /// Why a part cannot be read.
    note: Option<String>,
}

/// What somebody asks for.
pub(super) struct TrendQuestion {
    pub operand: String,
    /// The time that it covers, ns.
    pub span_ns: i64,
    /// The socket of the controller.
    pub socket: Option<PathBuf>,
}

impl TrendStore {
    /// A trend as it is known now; what is not known begins to be read.
    pub fn answer(&self, question: TrendQuestion, newest: &NewestPiece) -> Value {
        let TrendQuestion { operand, span_ns, socket } = question;
        let span_ns = span_ns.clamp(60 * SECOND_NS, TREND_MAX_NS);
        let seconds = (span_ns / SECOND_NS / STEPS_MAX).max(1);
        let step_ns = seconds * SECOND_NS;
        let to_ns = newest.end_ns;
        let count = (span_ns / step_ns) as usize;
        let from_ns = (to_ns.div_euclid(step_ns) + 1) * step_ns - count as i64 * step_ns;
        let mut all = locked(&self.trends);
        let stored = all.entry(operand.clone()).or_insert_with(StoredTrend::new);
        // A chunk that is not over is not read: the live view has its newest part.
        let until_ns = whole(newest.begin_ns + CHUNK_NS - 1).min(whole(to_ns));
        (stored.asked, stored.from_ns, stored.until_ns) = (Instant::now(), from_ns, until_ns);
        stored.line.fill(&newest.piece, newest.begin_ns, to_ns);
        stored.line.continue_with(&newest.piece, newest.begin_ns, to_ns);
        stored.line.forget(to_ns);
        let steps = stored.line.steps(from_ns, seconds, count);
        let (is_bit, note) = (stored.line.is_bit, stored.note.clone());
        let is_due = stored.is_due();
        drop_oldest(&mut all);
        // Under the lock: a reader that ends has found nothing that is due.
        let begins = is_due && socket.is_some() && !self.is_read.swap(true, Ordering::Relaxed);
        drop(all);
        if let Some(socket) = socket.filter(|_| begins) {
            self.read(socket);
        }
        let drawn = DrawnSteps { from_ns, step_ns, is_bit, steps: &steps };
        let (points, gaps) = (drawn.points(), drawn.gaps());
        json!({
            "operand": operand,
            "span_ms": [from_ns / 1_000_000, to_ns / 1_000_000],
            "points": points,
            "gaps": gaps,
            "note": note,
        })
    }

    /// Reads what is missing of all operands, on a thread of its own.
    fn read(&self, socket: PathBuf) {
        let store = self.clone();
        let read = move || {
            let _end = ReaderEnd(&store.is_read);
            while let Some(operand) = store.next_due() {
                let found = store.read_all(&socket, &operand);
                if let Some(stored) = locked(&store.trends).get_mut(&operand) {
                    (stored.note, stored.read) = (found.err(), Some(Instant::now()));
                }
            }
        };
        if thread::Builder::new().name("trend".to_owned()).spawn(read).is_err() {
            self.is_read.store(false, Ordering::Relaxed);
        }
    }

    /// The operand whose past is read next: one that was never read, else the one whose reading
    /// ended longest ago, so that each has its turn. Of several, the one that was asked for last.
    /// Without one, no thread reads any more.
    fn next_due(&self) -> Option<String> {
        let all = locked(&self.trends);
        let due = all.iter().filter(|(_, stored)| stored.is_due());
        let next = due.min_by_key(|(_, stored)| (stored.read, Reverse(stored.asked)));
        let next = next.map(|(operand, _)| operand.clone());
        self.is_read.store(next.is_some(), Ordering::Relaxed);
        next
    }

    /// # Errors
    /// What cannot be read, and why.
    fn read_all(&self, socket: &std::path::Path, operand: &str) -> Result<(), String> {
        let Some((from_ns, _)) = self.missing(operand) else { return Ok(()) };
        let from_ns = from_ns.min(self.wanted_ns(operand));
        let opened = TrendPast::open(socket, from_ns - CHUNK_NS);
        let OpenedPast { mut past, note } = opened.map_err(|failure| failure.to_string())?;
        note.iter().for_each(|note| say(note));
        let end_ns = past.end_ns().unwrap_or(i64::MIN);
        // What is newer than the log that was opened is for the next reading.
        while let Some((from_ns, to_ns)) = self.missing(operand).filter(|part| part.1 <= end_ns) {
            let begun = Instant::now();
            let piece = past.piece(operand, from_ns, to_ns);
            if let Some(stored) = locked(&self.trends).get_mut(operand) {
                stored.line.fill(&piece, from_ns, to_ns);
            }
            thread::sleep(begun.elapsed().min(PAUSE_MAX));
        }
        note.map_or(Ok(()), Err)
    }

    /// The newest part that somebody wants and that is missing.
    fn missing(&self, operand: &str) -> Option<(i64, i64)> {
        let all = locked(&self.trends);
        let stored = all.get(operand).filter(|stored| stored.asked.elapsed() < UNASKED)?;
        stored.line.missing(stored.from_ns, stored.until_ns, CHUNKS_READ_MAX)
    }

    /// From when on somebody wants an operand.
    fn wanted_ns(&self, operand: &str) -> i64 {
        locked(&self.trends).get(operand).map_or(i64::MAX, |stored| stored.from_ns)
    }
}

impl StoredTrend {
    /// Whether a part is missing that somebody wants, and was not just tried.
    fn is_due(&self) -> bool {
        self.asked.elapsed() < UNASKED
            && self.read.is_none_or(|read| read.elapsed() >= READ_AGAIN)
            && self.line.missing(self.from_ns, self.until_ns, 1).is_some()
    }

    fn new() -> StoredTrend {
        let (line, asked, note) = (TrendLine::default(), Instant::now(), None);
        StoredTrend { line, asked, from_ns: i64::MAX, until_ns: i64::MIN, read: None, note }
    }
}

/// The beginning of the chunk of a time.
fn whole(ns: i64) -> i64 {
    ns.div_euclid(CHUNK_NS) * CHUNK_NS
}

/// Forgets the operand that was asked for longest ago, if there are too many.
fn drop_oldest(all: &mut HashMap<String, StoredTrend>) {
    while all.len() > LINES_MAX {
        let oldest = all.iter().min_by_key(|(_, stored)| stored.asked);
        let Some(oldest) = oldest.map(|(operand, _)| operand.clone()) else { return };
        all.remove(&oldest);
    }
}

/// Steps as points of a drawing.
struct DrawnSteps<'a> {
    from_ns: i64,
    step_ns: i64,
    is_bit: bool,
    steps: &'a [TrendStep],
}

impl DrawnSteps<'_> {
    /// The time of a part of a step, ms.
    fn ms(&self, at: usize, thirds: i64) -> i64 {
        (self.from_ns + at as i64 * self.step_ns + thirds * self.step_ns / 3) / 1_000_000
    }

    /// The values: of a step with several, its least, its greatest and its last one.
    fn points(&self) -> Vec<Value> {
        let mut points = Vec::new();
        let mut before: Option<TrendStep> = None;
        for (at, step) in self.steps.iter().enumerate() {
            let is_as_before = match (before, step) {
                (Some(TrendStep::Values(known)), TrendStep::Values(now)) => {
                    now.least == now.greatest && known.last == now.last
                }
                (Some(TrendStep::Unknown), TrendStep::Unknown) => true,
                (None | Some(_), _) => false,
            };
            before = Some(*step);
            match step {
                _ if is_as_before => {}
                TrendStep::Values(StepValues { least, greatest, last }) => {
                    let moves = least < greatest;
                    if moves {
                        points.push(json!([self.ms(at, 0), Value::Null, self.value(*least)]));
                        points.push(json!([self.ms(at, 1), Value::Null, self.value(*greatest)]));
                    }
                    let thirds = if moves { 2 } else { 0 };
                    points.push(json!([self.ms(at, thirds), Value::Null, self.value(*last)]));
                }
                TrendStep::Unknown => {
                    points.push(json!([self.ms(at, 0), Value::Null, Value::Null]));
                }
                TrendStep::Empty(_) => {}
            }
        }
        points
    }

    fn value(&self, value: f64) -> Value {
        if self.is_bit {
            json!(value != 0.0)
        } else if value.fract() == 0.0 {
            json!(value as i64)
        } else {
            json!(value)
        }
    }

    /// The times without a value, each with its reason.
    fn gaps(&self) -> Vec<Value> {
        let mut gaps: Vec<(i64, i64, EmptyStep)> = Vec::new();
        for (at, step) in self.steps.iter().enumerate() {
            let TrendStep::Empty(why) = step else { continue };
            let (from, to) = (self.ms(at, 0), self.ms(at + 1, 0));
            match gaps.last_mut() {
                Some((_, end, known)) if *end == from && known.words() == why.words() => *end = to,
                Some(_) | None => gaps.push((from, to, *why)),
            }
        }
        gaps.into_iter().map(|(from, to, why)| json!([from, to, why.words()])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_client::live::PastPiece;

    #[test]
    fn many_operands_are_neither_all_kept_nor_read_by_a_second_thread() {
        let store = TrendStore::default();
        let hour_ns = 3600 * SECOND_NS;
        let newest =
            NewestPiece { piece: PastPiece::default(), begin_ns: hour_ns, end_ns: hour_ns };
        let ask = |number: u32, socket: Option<&str>| {
            let (operand, socket) = (format!("D{number}"), socket.map(PathBuf::from));
            store.answer(TrendQuestion { operand, span_ns: hour_ns, socket }, &newest);
        };
        (0..100).for_each(|number| ask(number, None));
        assert_eq!(locked(&store.trends).len(), LINES_MAX);
        assert!(!store.is_read.load(Ordering::Relaxed), "nowhere to read from");
        // A thread reads: no other one begins, which would find that there is no such socket.
        store.is_read.store(true, Ordering::Relaxed);
        ask(99, Some("/nonexistent/s"));
        assert!(locked(&store.trends).values().all(|stored| stored.note.is_none()));
        // The reader begins with what was asked for last, and ends when nothing is due.
        assert_eq!(store.next_due().as_deref(), Some("D99"));
        locked(&store.trends).values_mut().for_each(|stored| stored.read = Some(Instant::now()));
        assert_eq!(store.next_due(), None);
        assert!(!store.is_read.load(Ordering::Relaxed), "the thread has ended");
    }

    #[test]
    fn an_operand_whose_reading_ended_long_ago_is_read_before_one_that_was_just_asked_for() {
        let store = TrendStore::default();
        let now = Instant::now();
        // Each has a missing part, and a time in seconds since it was asked for and since it was
        // read.
        let known = |operand: &str, asked: u64, read: Option<u64>| {
            let ago = |seconds: u64| now.checked_sub(Duration::from_secs(seconds)).expect("a time");
            let (asked, read) = (ago(asked), read.map(ago));
            let (from_ns, until_ns) = (0, 4 * CHUNK_NS);
            let stored = StoredTrend { asked, read, from_ns, until_ns, ..StoredTrend::new() };
            locked(&store.trends).insert(operand.to_owned(), stored);
        };
        known("just_read", 0, Some(1));
        known("unasked", 61, None);
        known("earlier", 30, Some(20));
        known("later", 0, Some(10));
        assert_eq!(store.next_due().as_deref(), Some("earlier"));
        known("new", 2, None);
        known("newest", 1, None);
        assert_eq!(store.next_due().as_deref(), Some("newest"));
        assert!(store.is_read.load(Ordering::Relaxed));
    }

    #[test]
    fn another_reader_begins_after_a_panic_of_one() {
        let store = TrendStore::default();
        store.is_read.store(true, Ordering::Relaxed);
        let is_read = Arc::clone(&store.is_read);
        let reader = thread::spawn(move || {
            let _end = ReaderEnd(&is_read);
            std::panic::resume_unwind(Box::new("the scan log cannot be read"));
        });
        assert!(reader.join().is_err());
        assert!(!store.is_read.load(Ordering::Relaxed));
    }
}
