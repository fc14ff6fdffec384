//! The thread of retentive memory: takes the images that scans publish, and writes them to the
//! file.
//!
//! It is an ordinary thread. A stalled disk stalls only this thread: the scan thread publishes its
//! image for all readers and waits for none of them. An image is written if it differs from the
//! last one: at most once per interval, at once when the mode leaves RUN, when an operator requests
//! it, and at the end.

use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use tokio::sync::oneshot;

use super::alarm_keeper::unix_ns;
use super::retain::{NothingKept, RestoredFile, RetainSettings};
use rungd_base::duration_text::duration_text;
use rungd_base::faults::{self, FaultPoint};
use rungd_base::locked::locked;
use rungd_base::wall_clock::now_ms;
use rungd_runtime::Generations;
use rungd_runtime::exchange::{Mode, Port};
use rungd_runtime::say::say;
use rungd_state::retain::keeper::ScanImage;
use rungd_state::retain::{Keeper, RetainPlan, StoredImage};

/// The longest time until the thread notices a change of mode.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// While no image changes, how often the thread checks whether the file was removed or written by a
/// different process.
const WATCH_EVERY: Duration = Duration::from_secs(1);
/// The shortest time between a failed write and the next attempt.
const RETRY_LEAST: Duration = Duration::from_secs(1);
/// How often the log repeats that a trouble lasts.
const REPEAT: Duration = Duration::from_secs(60);
/// The shortest time of measurement before the wear is projected.
const MEASURED_LEAST: Duration = Duration::from_secs(60);
/// The longest time that the process waits for the last image before it ends.
const END_MAX: Duration = Duration::from_secs(60);
const DAY_S: u64 = 86_400;
const NS_PER_MS: u64 = 1_000_000;

/// A handle to the thread. Cheap to clone.
#[derive(Clone)]
pub(super) struct RetainHandle {
    orders: Sender<RetainOrder>,
    figures: Arc<Mutex<RetainFigures>>,
    pub wanted: Arc<RetainSettings>,
    /// The retained elements and their names, for each program.
    pub plans: Generations<RetainPlan>,
}

/// The figures that `status` shows.
#[derive(Clone, Debug, Default)]
pub(super) struct RetainFigures {
    pub restored: String,
    pub kept: Option<(StoredImage, Instant)>,
    pub flush: Duration,
    pub flush_max: Duration,
    pub writes: u64,
    pub bytes: u64,
    /// The error of the last write, if it failed.
    pub failing: Option<String>,
    since: Option<Instant>,
}

/// An image that is durable.
pub(super) struct DurableImage {
    pub kept: StoredImage,
    /// The time of the write; zero if the image was durable already.
    pub flush: Duration,
}

/// Why no image was written.
pub(super) enum NotSaved {
    /// No scan is complete yet: memory is unchanged since the start.
    NothingToKeep,
    /// The running program has no retentive elements; the file keeps its last image.
    NothingRetained,
    /// The disk failed, or the thread has ended.
    Failed(String),
}

/// The last image at the end of the process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LastImage {
    /// It is durable, or there was no image to write.
    Kept,
    /// A second signal came before it was durable.
    Hurried,
    /// It is lost: the disk failed, or did not answer.
    Lost,
}

type SaveResult = Result<DurableImage, NotSaved>;

enum RetainOrder {
    Save(oneshot::Sender<SaveResult>),
    End(oneshot::Sender<SaveResult>),
}

impl RetainHandle {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(opened: RestoredFile, port: Port) -> io::Result<RetainHandle> {
        let RestoredFile { keeper, wanted, restored, nothing_kept, .. } = opened;
        let figures = RetainFigures { restored, ..RetainFigures::default() };
        let figures = Arc::new(Mutex::new(figures));
        let wanted = Arc::new(wanted);
        let plans = Generations::new(wanted.plan.clone());
        let (orders, inbox) = channel();
        let worker = RetainWorker {
            plans: plans.clone(),
            generation: 0,
            keeper,
            port,
            wanted: Arc::clone(&wanted),
            figures: Arc::clone(&figures),
            nothing_kept,
            tried: None,
            watched: Instant::now(),
            ran: false,
            failed: None,
            told_slow: None,
            told_wear: None,
        };
        let named = thread::Builder::new().name("rungd-retain".into());
        named.spawn(move || worker.work(&inbox))?;
        Ok(RetainHandle { orders, figures, wanted, plans })
    }

    /// The current figures.
    pub fn figures(&self) -> RetainFigures {
        locked(&self.figures).clone()
    }

    /// Writes the latest image; returns once it is durable.
    pub async fn save(&self) -> SaveResult {
        self.order(RetainOrder::Save).await
    }

    /// Writes the last image at the end of the process. `hurry` ends the wait for it.
    pub async fn end(&self, hurry: impl Future<Output = &'static str>) -> LastImage {
        let begin = Instant::now();
        let (outcome, why) = tokio::select! {
            saved = self.order(RetainOrder::End) => match saved {
                Ok(durable) => {
                    say!(
                        RETAIN_FINAL,
                        image = durable.kept.stamp.sequence,
                        scan = durable.kept.stamp.scan,
                        flush = %duration_text(begin.elapsed().as_nanos() as u64),
                        "retentive memory: the last image is durable"
                    );
                    return LastImage::Kept;
                }
                // The file keeps the image that it has.
                Err(NotSaved::NothingToKeep | NotSaved::NothingRetained) => {
                    return LastImage::Kept;
                }
                Err(NotSaved::Failed(why)) => (LastImage::Lost, why),
            },
            name = hurry => (LastImage::Hurried, format!("{name} came before it was durable")),
            () = tokio::time::sleep(END_MAX) => {
                let waited = duration_text(END_MAX.as_nanos() as u64);
                (LastImage::Lost, format!("the disk has not answered for {waited}"))
            }
        };
        say!(
            RETAIN_LOST,
            file = %self.wanted.path.display(),
            "retentive memory: the last image is not kept: {why}. The next start restores the \
             image before it"
        );
        outcome
    }

    async fn order(&self, order: fn(oneshot::Sender<SaveResult>) -> RetainOrder) -> SaveResult {
        let gone = || NotSaved::Failed("its thread is gone (a bug in rungd)".to_owned());
        let (reply, answer) = oneshot::channel();
        self.orders.send(order(reply)).map_err(|_| gone())?;
        answer.await.unwrap_or_else(|_| Err(gone()))
    }
}

impl RetainFigures {
    /// Bytes per day at the rate so far; `None` if the time of measurement was too short.
    pub fn projected(&self, budget: u64) -> Option<u64> {
        projected(self.bytes, self.since?.elapsed(), budget)
    }
}

/// Projects the bytes per day. A total above the daily budget is projected at once, even before the
/// shortest time of measurement has passed.
fn projected(bytes: u64, over: Duration, budget: u64) -> Option<u64> {
    let seconds = over.as_secs_f64().max(1.0);
    let tells = over >= MEASURED_LEAST || bytes > budget;
    tells.then(|| (bytes as f64 * DAY_S as f64 / seconds) as u64)
}

impl std::fmt::Display for NotSaved {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            NotSaved::NothingToKeep => "no scan is complete: memory is as it was at the start",
            NotSaved::NothingRetained => {
                "the program that runs retains nothing; the last image stays"
            }
            NotSaved::Failed(why) => why,
        })
    }
}

struct RetainWorker {
    keeper: Keeper,
    plans: Generations<RetainPlan>,
    /// The generation of the keeper's plan.
    generation: u32,
    port: Port,
    wanted: Arc<RetainSettings>,
    figures: Arc<Mutex<RetainFigures>>,
    nothing_kept: NothingKept,
    /// The start of the last write.
    tried: Option<Instant>,
    /// The time of the last check of the file.
    watched: Instant,
    /// Whether the mode was RUN at the last look.
    ran: bool,
    /// The time of the last log line about a failed write; `None` while writes succeed.
    failed: Option<Instant>,
    told_slow: Option<Instant>,
    told_wear: Option<Instant>,
}

impl RetainWorker {
    fn work(mut self, inbox: &Receiver<RetainOrder>) {
        loop {
            let due = self
                .tried
                .map_or(LOOK_EVERY, |tried| self.wanted.interval.saturating_sub(tried.elapsed()));
            match inbox.recv_timeout(due.clamp(Duration::from_millis(1), LOOK_EVERY)) {
                Ok(RetainOrder::Save(reply)) => drop(reply.send(self.save())),
                Ok(RetainOrder::End(reply)) => return drop(reply.send(self.save())),
                Err(RecvTimeoutError::Timeout) => self.look(),
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn look(&mut self) {
        let runs = self.port.latest().mode == Mode::Run;
        let left = std::mem::replace(&mut self.ran, runs) && !runs;
        // While the disk fails, attempts are less frequent.
        let rest = if self.failed.is_some() { RETRY_LEAST } else { Duration::ZERO };
        let wait = self.wanted.interval.max(rest);
        let due = self.tried.is_none_or(|tried| tried.elapsed() >= wait);
        if left || due || self.is_disturbed() {
            let _ = self.save();
        }
    }

    /// Checks once per `WATCH_EVERY` whether a different process has changed the file.
    fn is_disturbed(&mut self) -> bool {
        if self.watched.elapsed() < WATCH_EVERY {
            return false;
        }
        self.watched = Instant::now();
        self.failed.is_none() && self.keeper.is_disturbed()
    }

    /// Writes the latest image, if there is one and it differs from the durable one.
    fn save(&mut self) -> SaveResult {
        let (latest, plan) = self.plans.latest(&self.port);
        if latest.scans == 0 {
            return Err(NotSaved::NothingToKeep);
        }
        if latest.generation != self.generation {
            self.generation = latest.generation;
            self.keeper.set_plan(RetainPlan::clone(&plan));
        }
        let begin = Instant::now();
        self.tried = Some(begin);
        if self.keeper.plan().is_empty() {
            return Err(NotSaved::NothingRetained);
        }
        let image = ScanImage {
            scan: latest.scans,
            bits: &latest.bits,
            words: &latest.words,
            is_final: matches!(latest.mode, Mode::Stop(_)),
            now_ms: now_ms(),
            scanned_ms: unix_ns(latest.now_ns).max(0).unsigned_abs() / NS_PER_MS,
        };
        faults::point(FaultPoint::Disk);
        let mut saved = self.keeper.save(image);
        if let Err(error) = &saved
            && error.kind() == io::ErrorKind::NotFound
        {
            // The file is gone or was changed: the log reports this, and the second save makes the
            // file again.
            self.tell_failure(error);
            saved = self.keeper.save(image);
        }
        match saved {
            Ok(None) => {
                let kept = self.keeper.kept().ok_or(NotSaved::NothingToKeep)?;
                Ok(DurableImage { kept, flush: Duration::ZERO })
            }
            Ok(Some(kept)) => {
                self.nothing_kept.kept();
                self.count(kept, begin);
                Ok(DurableImage { kept, flush: begin.elapsed() })
            }
            Err(error) => {
                self.tell_failure(&error);
                Err(NotSaved::Failed(error.to_string()))
            }
        }
    }

    fn count(&mut self, kept: StoredImage, begin: Instant) {
        let flush = begin.elapsed();
        let path = self.wanted.path.display();
        {
            let mut figures = locked(&self.figures);
            figures.kept = Some((kept, begin));
            figures.flush = flush;
            figures.flush_max = figures.flush_max.max(flush);
            figures.writes += 1;
            figures.bytes += kept.bytes as u64;
            figures.since.get_or_insert(begin);
            figures.failing = None;
        }
        if self.failed.take().is_some() {
            say!(
                RETAIN_RECOVERED,
                file = %path,
                "retentive memory: {path} is written again"
            );
        }
        if flush > self.wanted.interval && due(&mut self.told_slow, REPEAT) {
            let (took, interval) = (flush, self.wanted.interval);
            let [took, interval] =
                [took, interval].map(|time| duration_text(time.as_nanos() as u64));
            say!(
                RETAIN_SLOW,
                flush = %took,
                "retentive memory: an image took {took} to become durable; the interval is \
                 {interval}, and a power cut may cost the changes of both"
            );
        }
        self.tell_wear();
    }

    fn tell_wear(&mut self) {
        let budget = self.wanted.budget;
        let projected = locked(&self.figures).projected(budget);
        let Some(projected) = projected.filter(|projected| *projected > budget) else { return };
        if due(&mut self.told_wear, Duration::from_secs(DAY_S)) {
            let [a_day, budget] = [projected, budget].map(|bytes| bytes / 1_000_000);
            say!(
                RETAIN_WEAR,
                mb_per_day = a_day,
                budget_mb_per_day = budget,
                "retentive memory: {a_day} MB a day are written at the present rate, the budget is \
                 {budget}: a longer `[retain] interval` or fewer ranges spare the disk"
            );
        }
    }

    fn tell_failure(&mut self, error: &io::Error) {
        self.nothing_kept.failed();
        locked(&self.figures).failing = Some(error.to_string());
        if due(&mut self.failed, REPEAT) {
            let path = self.wanted.path.display();
            say!(
                RETAIN_FAILED,
                file = %path,
                why = %error,
                "retentive memory: {path} cannot be written, and a restart would lose all later \
                 changes: {error}. rungd tries again"
            );
        }
    }
}

/// Whether a log line is due: the first line, or the next one after `every`. Notes its time if so.
fn due(told: &mut Option<Instant>, every: Duration) -> bool {
    if told.is_some_and(|told| told.elapsed() < every) {
        return false;
    }
    *told = Some(Instant::now());
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disk_wear_is_projected_from_measured_writes() {
        let s = Duration::from_secs;
        assert_eq!(projected(4096, s(59), 4096), None);
        assert_eq!(projected(4097, s(2), 4096), Some(4097 * 43_200));
        assert_eq!(projected(4097, s(0), 4096), Some(4097 * 86_400));
        assert_eq!(projected(60 * 4096, s(60), u64::MAX), Some(4096 * 86_400));
        assert_eq!(projected(0, s(600), 4096), Some(0));
    }
}
