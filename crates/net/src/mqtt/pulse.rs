//! When a session must send a PINGREQ, and when the broker's silence is too long. Times are
//! arguments: `session` reports events, and requests a verdict at the end of each step.

use std::time::Duration;

use tokio::time::Instant;

use super::failure::LinkSilence;

/// A silence counts only after this additional time without a byte: a process that was stopped or
/// busy may not have read its socket since.
const DOUBT: Duration = Duration::from_millis(50);

/// The maximum time for a PINGRESP while other bytes come, in keepalives.
const PONG_KEEPALIVES: u32 = 4;

/// The next action of the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum KeepAliveVerdict {
    /// Nothing is to be done.
    Well,
    /// A PINGREQ is due.
    Ask,
    /// The session has failed.
    Silent(LinkSilence),
}

/// The times that decide the verdict.
pub(super) struct KeepAliveTimes {
    keepalive: Duration,
    /// The time of the last queued packet.
    sent: Instant,
    /// The time of the last received byte.
    heard: Instant,
    /// The last time at which the link took a byte, or no byte was waiting.
    taken: Instant,
    /// Whether a PINGREQ has no answer yet.
    questioned: bool,
    /// The time since which a sent PINGREQ has no answer.
    asked: Option<Instant>,
    /// The time since which a silence seems too long.
    doubted: Option<Instant>,
}

impl KeepAliveTimes {
    pub fn new(keepalive: Duration, now: Instant) -> KeepAliveTimes {
        KeepAliveTimes {
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

    /// Shortens the keepalive: a broker of MQTT 5 may require a shorter one.
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

    /// Notes that a PINGREQ was queued.
    pub fn questioned(&mut self, now: Instant) {
        (self.sent, self.questioned) = (now, true);
    }

    /// Notes that a PINGREQ has left the queue.
    pub fn asked(&mut self, now: Instant) {
        self.asked.get_or_insert(now);
    }

    /// Notes a PINGRESP. `more`: other PINGREQs have no answer yet; `left`: one of them has left
    /// the queue.
    pub fn answered(&mut self, more: bool, left: bool, now: Instant) {
        (self.questioned, self.asked) = (more, (more && left).then_some(now));
    }

    /// The verdict after the socket was read and written as far as possible. `waiting`: bytes wait
    /// to be sent. `reading`: the receive queue has room, so that bytes from the broker would have
    /// been read.
    pub fn judge(&mut self, waiting: bool, reading: bool, now: Instant) -> KeepAliveVerdict {
        let Some(silence) = self.silence(waiting, reading, now) else {
            self.doubted = None;
            let due = now >= self.ask_at();
            return if due { KeepAliveVerdict::Ask } else { KeepAliveVerdict::Well };
        };
        let since = *self.doubted.get_or_insert(now);
        if now >= since + DOUBT {
            KeepAliveVerdict::Silent(silence)
        } else {
            KeepAliveVerdict::Well
        }
    }

    /// The time of the next verdict, if nothing happens.
    pub fn next(&self, waiting: bool, reading: bool) -> Instant {
        if let Some(since) = self.doubted {
            return since + DOUBT;
        }
        let limits = self.limits(waiting, reading);
        limits.into_iter().flatten().map(|(limit, _)| limit).fold(self.ask_at(), Instant::min)
    }

    /// The time at which a PINGREQ is due: half of a keepalive after the last sent packet or the
    /// last received byte, whichever is earlier. Received bytes count too: otherwise a link that
    /// swallows a steady stream would never be checked.
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
