//! Tells what a start waits for: a line of the log and a status for systemd, once it takes seconds.
//!
//! The parts of a start that touch a disk run under [`StartWatch::during`], with the name of what
//! they touch. A thread measures the time, because the disk can hold the caller in one call of the
//! system for any time. As long as a part takes, systemd gets a request for more time: a restart
//! would wait for the same disk, and would count as an unclean end.

use std::fmt;
use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use super::systemd::{Systemd, SystemdNotice};
use rungd_base::duration_text::duration_text;
use rungd_base::progress::{LoadStep, Progress};
use rungd_runtime::say::say;

/// The time after which a part of the start is told.
const TELL_AFTER: Duration = Duration::from_secs(3);
/// How often the thread looks while a part of the start runs; each notice to systemd requests ten
/// times this time.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// A part of the start that can take any time.
#[derive(Clone, Debug)]
pub enum StartPart {
    /// The file that counts restarts.
    RestartCount(String),
    /// The controller file and its ladders.
    Files(Progress),
    /// The operator's socket and the view socket, of this controller file.
    Sockets(String),
    /// The file of retentive memory.
    Memory(String),
    /// The file of alarms.
    Alarms(String),
}

impl fmt::Display for StartPart {
    /// What the start waits for.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            StartPart::RestartCount(file) => {
                write!(f, "the disk of the count of restarts, {file}")
            }
            StartPart::Files(progress) => match progress.current() {
                Some(LoadStep::Reading(file)) => write!(f, "the disk of `{file}`"),
                Some(step) => write!(f, "a long file: {step}"),
                None => f.write_str("the disk of the controller file"),
            },
            StartPart::Sockets(controller) => {
                write!(f, "the disk of the operator's socket of {controller}")
            }
            StartPart::Memory(file) => write!(f, "the disk of retentive memory, {file}"),
            StartPart::Alarms(file) => write!(f, "the disk of the file of alarms, {file}"),
        }
    }
}

impl StartPart {
    /// What a signal interrupts.
    pub(super) fn interrupted(&self) -> String {
        match self {
            StartPart::Files(_) => "the ladder was still being loaded".to_owned(),
            StartPart::RestartCount(_)
            | StartPart::Sockets(_)
            | StartPart::Memory(_)
            | StartPart::Alarms(_) => {
                format!("the start was waiting for {self}")
            }
        }
    }
}

/// Measures the parts of one start.
#[derive(Clone)]
pub(super) struct StartWatch(Sender<Option<StartPart>>);

impl StartWatch {
    /// Starts the thread, which ends with the last copy of this. A part that lasts is told every
    /// `repeat`.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn begin(repeat: Duration) -> io::Result<StartWatch> {
        let (sender, parts) = channel();
        thread::Builder::new().name("rungd-start".into()).spawn(move || watch(&parts, repeat))?;
        Ok(StartWatch(sender))
    }

    /// Does a part of the start.
    pub fn during<T>(&self, part: StartPart, work: impl FnOnce() -> T) -> T {
        let part = self.enter(part);
        let done = work();
        drop(part);
        done
    }

    /// Begins a part of the start, which lasts until the returned value is dropped.
    pub fn enter(&self, part: StartPart) -> EnteredPart<'_> {
        let _ = self.0.send(Some(part));
        EnteredPart(self)
    }
}

/// A part of the start that has begun.
pub(super) struct EnteredPart<'a>(&'a StartWatch);

impl Drop for EnteredPart<'_> {
    fn drop(&mut self) {
        let _ = self.0.0.send(None);
    }
}

fn watch(parts: &Receiver<Option<StartPart>>, repeat: Duration) {
    let mut current: Option<LongPart> = None;
    let systemd = Systemd::of_environment();
    let look_every = LOOK_EVERY.min(repeat);
    loop {
        // Between two parts there is nothing to measure.
        let wait = current.as_ref().map_or(Duration::MAX, |_| look_every);
        match parts.recv_timeout(wait) {
            Ok(next) => {
                let ended =
                    std::mem::replace(&mut current, next.map(|part| LongPart::new(part, repeat)));
                if let Some(took) = ended.and_then(|ended| ended.told_for(Instant::now())) {
                    let took = text_of(took);
                    say!(START_GOES_ON, waited = %took, "the start goes on, after {took}");
                }
            }
            Err(RecvTimeoutError::Timeout) => {
                if let Some(current) = &mut current {
                    current.log_wait(&systemd);
                }
            }
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

/// A part of the start, and when it was told.
struct LongPart {
    part: StartPart,
    since: Instant,
    told: Option<Instant>,
    repeat: Duration,
}

impl LongPart {
    fn new(part: StartPart, repeat: Duration) -> LongPart {
        LongPart { part, since: Instant::now(), told: None, repeat }
    }

    /// Whether a line is due; notes its time if so.
    fn is_due(&mut self, now: Instant) -> bool {
        let passed = |since| now.saturating_duration_since(since);
        let is_due = match self.told {
            None => passed(self.since) >= TELL_AFTER.min(self.repeat),
            Some(told) => passed(told) >= self.repeat,
        };
        if is_due {
            self.told = Some(now);
        }
        is_due
    }

    /// The time that it took, if it was told.
    fn told_for(&self, now: Instant) -> Option<Duration> {
        self.told.map(|_| now.saturating_duration_since(self.since))
    }

    fn log_wait(&mut self, systemd: &Systemd) {
        let now = Instant::now();
        if self.is_due(now) {
            let (part, waited) = (self.part.to_string(), text_of(now - self.since));
            let _ = systemd.send(&SystemdNotice::Status(format!("the start waits for {part}")));
            say!(
                START_WAITS,
                waits_for = %part,
                waited = %waited,
                "the start has waited {waited} for {part}. No scan comes before; rungd goes on by \
                 itself"
            );
        }
        if self.told.is_some() {
            let extend_us = LOOK_EVERY.as_micros() as u64 * 10;
            let _ = systemd.send(&SystemdNotice::Starting { extend_us });
        }
    }
}

fn text_of(time: Duration) -> String {
    // Whole tenths of a second: nobody needs more of a wait.
    duration_text(time.as_millis() as u64 / 100 * 100_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory() -> StartPart {
        StartPart::Memory("/var/lib/rungd/retain".to_owned())
    }

    #[test]
    fn a_slow_part_of_the_start_is_logged_after_three_seconds_and_every_minute() {
        let mut part = LongPart::new(memory(), Duration::from_secs(60));
        let (begin, mut told) = (part.since, Vec::new());
        for second in 0..=130 {
            let now = begin + Duration::from_secs(second);
            if part.is_due(now) {
                told.push(second);
            }
            assert_eq!(part.told_for(now), (second >= 3).then(|| now - begin));
        }
        assert_eq!(told, [3, 63, 123]);
    }

    #[test]
    fn the_start_names_what_it_waits_for() {
        let files = Progress::new();
        let part = StartPart::Files(files.clone());
        assert_eq!(part.to_string(), "the disk of the controller file");
        files.begin(LoadStep::Reading("main.toml".to_owned()));
        assert_eq!(part.to_string(), "the disk of `main.toml`");
        files.begin(LoadStep::Names);
        assert_eq!(part.to_string(), "a long file: looking up names");
        assert_eq!(part.interrupted(), "the ladder was still being loaded");
        let said = "the start was waiting for the disk of retentive memory, /var/lib/rungd/retain";
        assert_eq!(memory().interrupted(), said);
    }
}
