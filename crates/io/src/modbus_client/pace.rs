//! The pace of requests over one connection or line, and what a missing answer suggests.
//!
//! Used by both links. Before a request, [`RequestPace::ready_at`] gives the earliest time at
//! which the peer's habits allow it; afterwards the link notes the result. The notes serve two
//! more purposes. [`RequestPace::hint`] names the key that a peer with such a silence may need; a
//! peer that was once as fast as it would have to be now gets no hint. [`RequestPace::is_over`]
//! says when silence is a reason for a new connection: not at once, because many devices lose
//! requests after connecting.

use std::time::Duration;

use tokio::time::Instant;

use super::settings::PeerHabits;

/// The silences in a row after which the connection may be over.
const SILENCES_MAX: u32 = 2;
/// The age of a connection without any answer up to which silence does not end it. Devices are
/// known that lose requests for two seconds after connecting.
const DEAF_MAX: Duration = Duration::from_secs(3);
/// The longest time after an answer for which a missing pause can explain a silence.
const SOON: Duration = Duration::from_secs(1);

/// The state of one connection or line.
#[derive(Debug)]
pub(super) struct RequestPace {
    opened: Instant,
    /// The time of the last byte received or sent.
    quiet_since: Instant,
    /// The end of the pause that the last peer needs.
    rests_until: Instant,
    /// The last answer over this connection.
    answered: Option<Instant>,
    /// The silences since the last answer.
    silences: u32,
    /// The present request.
    asked: RequestTime,
    /// The earliest that was answered.
    earliest: RequestTime,
}

/// The time at which a request is sent.
#[derive(Clone, Copy, Debug, Default)]
struct RequestTime {
    /// After the opening of the connection.
    after_open: Option<Duration>,
    /// After the last answer over this connection.
    after_answer: Option<Duration>,
}

/// What a silence suggests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SilenceHint {
    /// Nothing more than the silence itself.
    None,
    /// Nothing has been answered over this connection, and no request so early ever was.
    SinceOpening,
    /// The request before was answered, and no request so soon after an answer ever was.
    AfterAnswer,
}

impl RequestPace {
    pub fn new() -> RequestPace {
        let now = Instant::now();
        RequestPace {
            opened: now,
            quiet_since: now,
            rests_until: now,
            answered: None,
            silences: 0,
            asked: RequestTime::default(),
            earliest: RequestTime::default(),
        }
    }

    /// Notes a new connection, or a port that was opened.
    pub fn open(&mut self) {
        (self.opened, self.answered, self.silences) = (Instant::now(), None, 0);
    }

    /// Whether a request was answered over this connection.
    pub fn is_proven(&self) -> bool {
        self.answered.is_some()
    }

    /// The earliest time of a request to a peer with these habits; `silence` separates the frames
    /// of a line.
    pub fn ready_at(&self, habits: &PeerHabits, silence: Duration) -> Instant {
        let pause = silence.max(ms(habits.pause_ms));
        let deaf_until = self.opened + ms(habits.connect_delay_ms);
        deaf_until.max(self.rests_until).max(self.quiet_since + pause)
    }

    /// Notes that a request is sent now.
    pub fn ask(&mut self) {
        let since = |then: Instant| then.elapsed();
        let after_open = self.answered.is_none().then(|| since(self.opened));
        self.asked = RequestTime { after_open, after_answer: self.answered.map(since) };
    }

    /// Notes the end of a request to a peer with these habits.
    pub fn end(&mut self, habits: &PeerHabits) {
        self.quiet_since = Instant::now();
        self.rests_until = self.quiet_since + ms(habits.pause_ms);
    }

    /// Notes an answer.
    pub fn answer(&mut self) {
        let earlier = |known: &mut Option<Duration>, now: Option<Duration>| {
            *known = [*known, now].into_iter().flatten().min();
        };
        earlier(&mut self.earliest.after_open, self.asked.after_open);
        earlier(&mut self.earliest.after_answer, self.asked.after_answer);
        (self.answered, self.silences) = (Some(Instant::now()), 0);
    }

    /// Notes a silence.
    pub fn miss(&mut self) {
        self.silences += 1;
    }

    /// What the silence after the present request suggests.
    pub fn hint(&self) -> SilenceHint {
        let is_new = |asked: Option<Duration>, earliest: Option<Duration>| {
            asked.is_some_and(|asked| earliest.is_none_or(|earliest| asked < earliest))
        };
        let RequestTime { after_open, after_answer } = self.asked;
        if is_new(after_open, self.earliest.after_open) {
            return SilenceHint::SinceOpening;
        }
        let is_soon = after_answer.is_some_and(|after| after < SOON) && self.silences <= 1;
        match is_soon && is_new(after_answer, self.earliest.after_answer) {
            true => SilenceHint::AfterAnswer,
            false => SilenceHint::None,
        }
    }

    /// Whether the silences are a reason for a new connection.
    pub fn is_over(&self, habits: &PeerHabits) -> bool {
        let is_deaf =
            !self.is_proven() && self.opened.elapsed() < DEAF_MAX + ms(habits.connect_delay_ms);
        self.silences >= SILENCES_MAX && !is_deaf
    }
}

fn ms(ms: u32) -> Duration {
    Duration::from_millis(ms.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(time_ms: u64) -> impl Future<Output = ()> {
        tokio::time::advance(ms(time_ms as u32))
    }

    #[tokio::test(start_paused = true)]
    async fn a_request_waits_for_every_delay_of_the_peer() {
        let habits = PeerHabits { connect_delay_ms: 2000, pause_ms: 50, ..PeerHabits::default() };
        let mut pace = RequestPace::new();
        after(10).await;
        pace.open();
        let begun = Instant::now();
        let ready =
            |pace: &RequestPace, habits| pace.ready_at(&habits, ms(2)).duration_since(begun);
        assert_eq!(ready(&pace, habits), ms(2000));
        assert_eq!(ready(&pace, PeerHabits::default()), ms(0));
        after(2000).await;
        pace.end(&habits);
        assert_eq!(ready(&pace, habits), ms(2050));
        assert_eq!(ready(&pace, PeerHabits::default()), ms(2050), "the last peer's pause");
        after(100).await;
        pace.end(&PeerHabits::default());
        assert_eq!(ready(&pace, PeerHabits::default()), ms(2102));
    }

    #[tokio::test(start_paused = true)]
    async fn a_hint_is_given_only_if_the_peer_never_answered_at_this_pace() {
        let mut pace = RequestPace::new();
        pace.open();
        pace.ask();
        assert_eq!(pace.hint(), SilenceHint::SinceOpening);
        after(1200).await;
        pace.ask();
        pace.answer();
        pace.ask();
        assert_eq!(pace.hint(), SilenceHint::AfterAnswer);
        pace.answer();
        after(20).await;
        pace.ask();
        assert_eq!(pace.hint(), SilenceHint::None, "it was answered sooner before");
        pace.open();
        pace.ask();
        assert_eq!(pace.hint(), SilenceHint::SinceOpening);
        after(1300).await;
        pace.ask();
        assert_eq!(pace.hint(), SilenceHint::None, "it was answered earlier before");
    }

    #[tokio::test(start_paused = true)]
    async fn two_silences_end_a_connection_but_a_new_connection_gets_more_time() {
        let mut pace = RequestPace::new();
        let habits = PeerHabits::default();
        pace.open();
        for _ in 0..5 {
            pace.miss();
        }
        assert!(!pace.is_over(&habits), "it may be deaf yet");
        after(3000).await;
        assert!(pace.is_over(&habits));
        pace.answer();
        pace.miss();
        assert!(!pace.is_over(&habits), "a second try over the same connection");
        pace.miss();
        assert!(pace.is_over(&habits));
    }
}
