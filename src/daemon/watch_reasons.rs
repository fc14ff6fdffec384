//! Why a line of `[[watch]]` did not hold: the answers of `rungd why` for the operands that decided
//! it, as of that scan.
//!
//! Called by `record_thread`, which has the recording of the last minute. The answers are made on a
//! thread of their own, one at a time, because the tape must be read meanwhile. The alarm keeps
//! them, also when the recording has gone on.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;
use std::thread;
use std::time::{Duration, Instant};

use super::watches::{WatchMessage, WatchNews};
use rungd_history::observe::{Limits, QuestionTime};
use rungd_history::playback::{self, RecordedQuestion};
use rungd_history::record::Recording;

/// The limits of the explanation of an operand.
const WHY: Limits = Limits { depth: 2, nodes: 8, change: false };
/// The maximum number of operands that are explained, and of the lines about them.
const EXPLAINED_MAX: usize = 3;
const LINES_MAX: usize = 40;
/// The most alarms that wait for an explanation; of more, the first are explained.
const WAITING_MAX: usize = 8;
/// The shortest time between two recordings that are read again.
const EVERY: Duration = Duration::from_secs(1);

/// The explanations that are to be made.
pub(super) struct WatchReasons {
    waiting: Vec<(String, WatchNews)>,
    is_busy: Arc<AtomicBool>,
    last: Option<Instant>,
    answers: SyncSender<WatchMessage>,
}

impl WatchReasons {
    /// No explanation is to be made.
    pub fn new(answers: SyncSender<WatchMessage>) -> WatchReasons {
        WatchReasons { waiting: Vec::new(), is_busy: Arc::default(), last: None, answers }
    }

    /// Adds lines that have ceased to hold, with their names.
    pub fn add(&mut self, broken: Vec<(String, WatchNews)>) {
        let room = WAITING_MAX.saturating_sub(self.waiting.len());
        self.waiting.extend(broken.into_iter().take(room));
    }

    /// Begins what waits, if nothing is being explained. `recording`: the last minute, up to now.
    pub fn turn(&mut self, recording: impl FnOnce() -> Vec<u8>) {
        let is_early = self.last.is_some_and(|last| last.elapsed() < EVERY);
        if self.waiting.is_empty() || is_early || self.is_busy.swap(true, Ordering::AcqRel) {
            return;
        }
        self.last = Some(Instant::now());
        let (asked, bytes) = (std::mem::take(&mut self.waiting), recording());
        let (is_busy, answers) = (Arc::clone(&self.is_busy), self.answers.clone());
        let work = move || {
            let recording = Arc::new(Recording::of_bytes(bytes));
            for (name, news) in asked {
                let why = explained(&recording, &news)
                    .unwrap_or_else(|why| vec![format!("not explained: {why}")]);
                let message = WatchMessage::Explained { name, scan: news.scan, why };
                let _ = answers.try_send(message);
            }
            is_busy.store(false, Ordering::Release);
        };
        let spawned = thread::Builder::new().name("rungd-watch-why".into()).spawn(work);
        if spawned.is_err() {
            self.is_busy.store(false, Ordering::Release);
        }
    }
}

/// The answers for the operands that decided a line.
///
/// # Errors
/// The recording does not have the scan.
fn explained(recording: &Arc<Recording>, news: &WatchNews) -> Result<Vec<String>, String> {
    let scan = news.judged_scan;
    let section = recording.place_of_scan(scan).ok_or("the scan log does not have the scan")?;
    let subject = playback::subject(recording.program(section))?;
    let mut lines = Vec::new();
    for operand in news.deciding.iter().take(EXPLAINED_MAX) {
        let is_before = operand.name != operand.place;
        let at = QuestionTime::Scan(scan.saturating_sub(u64::from(is_before)).max(1));
        let question = RecordedQuestion { section, at, limits: WHY };
        match playback::why(&subject, recording, &operand.place, question) {
            Ok(mut answer) => {
                answer.root.operand.name.clone_from(&operand.name);
                lines.extend(answer.text().lines().map(str::to_owned));
            }
            Err(why) => lines.push(format!("{}: {why}", operand.name)),
        }
    }
    if lines.len() > LINES_MAX {
        lines.truncate(LINES_MAX);
        lines.push("…".to_owned());
    }
    Ok(lines)
}
