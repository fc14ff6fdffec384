//! When a session must ask the broker for a word, and when its silence is too long. Times are
//! arguments: `session` says what happened, and asks at the end of each step.

use std::time::Duration;

use tokio::time::Instant;

use super::failure::LinkSilence;

/// A silence is judged only when this time more has brought nothing: a process that was held, or
/// busy, has not looked into its socket since.
const DOUBT: Duration = Duration::from_millis(50);

/// An answer to a question may take so many keepalives while other bytes come.
const PONG_KEEPALIVES: u32 = 4;

/// What is to be done now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PulseVerdict {
    /// Nothing.
    Well,
    /// A question is due.
    Ask,
    /// The session is at its end.
    Silent(LinkSilence),
}

/// The times that decide.
pub(super) struct Pulse {
    keepalive: Duration,
    /// A packet was queued.
    sent: Instant,
    /// A byte came.
    heard: Instant,
    /// The link took a byte, or there was none to take.
    taken: Instant,
    /// A question is without an answer.
    questioned: bool,
    /// It has left.
    asked: Option<Instant>,
    /// A silence seems too long.
    doubted: Option<Instant>,
}

impl Pulse {
    pub fn new(keepalive: Duration, now: Instant) -> Pulse {
        Pulse {
            keepalive,
            sent: now,
            heard: now,
            taken: now,
            questioned: false,
            asked: None,
            doubted: None,
        }
    }

    pub fn keepalive(&self) -> Duration {
        self.keepalive
    }

    /// A broker of MQTT 5 may want a shorter one.
    pub fn shorten(&mut self, keepalive: Duration) {
        self.keepalive = self.keepalive.min(keepalive);
    }

    pub fn sent(&mut self, now: Instant) {
        self.sent = now;
    }

    pub fn heard(&mut self, now: Instant) {
        self.heard = now;
    }

    pub fn taken(&mut self, now: Instant) {
        self.taken = now;
    }

    /// A question is queued.
    pub fn questioned(&mut self, now: Instant) {
        (self.sent, self.questioned) = (now, true);
    }

    /// A question has left our queue.
    pub fn asked(&mut self, now: Instant) {
        self.asked.get_or_insert(now);
    }

    /// An answer came. `more`: questions are without one; `left`: one of these has left.
    pub fn answered(&mut self, more: bool, left: bool, now: Instant) {
        (self.questioned, self.asked) = (more, (more && left).then_some(now));
    }

    /// What is to be done, when all that the socket has is read and all that it takes is written.
    /// `waiting`: bytes wait to be sent. `reading`: our own queue has room, so that what the
    /// broker says would be seen.
    pub fn judge(&mut self, waiting: bool, reading: bool, now: Instant) -> PulseVerdict {
        let Some(silence) = self.silence(waiting, reading, now) else {
            self.doubted = None;
            let due = now >= self.ask_at();
            return if due { PulseVerdict::Ask } else { PulseVerdict::Well };
        };
        let since = *self.doubted.get_or_insert(now);
        if now >= since + DOUBT { PulseVerdict::Silent(silence) } else { PulseVerdict::Well }
    }

    /// When to judge again, if nothing happens.
    pub fn next(&self, waiting: bool, reading: bool) -> Instant {
        if let Some(since) = self.doubted {
            return since + DOUBT;
        }
        let limits = self.limits(waiting, reading);
        limits.into_iter().flatten().map(|(limit, _)| limit).fold(self.ask_at(), Instant::min)
    }

    /// Something was heard and something was sent within half of a keepalive. What is heard
    /// counts too: a link that swallows a steady stream would never be asked otherwise.
    fn ask_at(&self) -> Instant {
        let quiet_since = if self.questioned { self.sent } else { self.sent.min(self.heard) };
        quiet_since + self.keepalive / 2
    }

    fn silence(&self, waiting: bool, reading: bool, now: Instant) -> Option<LinkSilence> {
        let over = self.limits(waiting, reading).into_iter().flatten();
        over.filter(|(limit, _)| now >= *limit).map(|(_, what)| what).next()
    }

    fn limits(&self, waiting: bool, reading: bool) -> [Option<(Instant, LinkSilence)>; 3] {
        let asked = self.asked.filter(|_| reading);
        [
            waiting.then_some((self.taken + self.keepalive, LinkSilence::NoProgress)),
            asked.map(|at| (at.max(self.heard) + self.keepalive, LinkSilence::NoByte)),
            asked.map(|at| (at + self.keepalive * PONG_KEEPALIVES, LinkSilence::NoPong)),
        ]
    }
}
