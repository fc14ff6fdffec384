//! The state of a unit that the link reaches: its trouble, and the time of the next question.
//!
//! Kept by `talk`. A silent unit soon receives one more request, then fewer and fewer, so that the
//! other units of the same link lose little time.

use std::time::Duration;

use tokio::time::Instant;

use crate::device::{ExchangeReason, Retry};

pub(super) struct UnitState {
    pub number: u8,
    /// The first silence or refused write of this exchange; of an earlier exchange if the unit
    /// receives no request in this one.
    pub trouble: Option<String>,
    /// The first reason why some of its inputs are missing, since the read of the first group.
    pub unread: Option<String>,
    /// Whether it was silent or refused a write in the previous exchange.
    pub was_troubled: bool,
    /// Whether it receives no more requests in this exchange.
    pub is_left: bool,
    /// Whether it received no request in this exchange, so that its trouble is an earlier one's.
    rests: bool,
    /// The number of consecutive silences.
    absences: u32,
    retry: Retry,
    rests_until: Option<Instant>,
}

impl UnitState {
    pub fn new(number: u8) -> UnitState {
        UnitState {
            number,
            trouble: None,
            unread: None,
            was_troubled: false,
            is_left: false,
            rests: false,
            absences: 0,
            retry: Retry::new(),
            rests_until: None,
        }
    }

    pub fn begin_anew(&mut self) {
        *self = UnitState::new(self.number);
    }

    /// Prepares for an exchange: a unit in trouble receives requests when inputs are due, not at
    /// every change. `is_anew`: inputs are read from the first group on.
    pub fn begin(&mut self, occasion: ExchangeReason, now: Instant, is_anew: bool) {
        self.was_troubled = self.trouble.is_some();
        self.is_left = match occasion {
            ExchangeReason::Change => self.was_troubled,
            ExchangeReason::First | ExchangeReason::Poll => {
                self.rests_until.is_some_and(|until| now < until)
            }
            ExchangeReason::Last => false,
        };
        self.rests = self.is_left;
        if !self.is_left {
            self.trouble = None;
        }
        if is_anew {
            self.unread = None;
        }
    }

    /// Whether a request of this exchange failed.
    pub fn has_failed(&self) -> bool {
        !self.rests && (self.trouble.is_some() || self.unread.is_some())
    }

    /// Notes that some of its inputs were not read.
    pub fn leave_unread(&mut self) {
        if self.unread.is_none() {
            self.unread.clone_from(&self.trouble);
        }
    }

    /// Notes that it did not answer.
    pub fn miss(&mut self, trouble: String, pause: Duration, now: Instant) {
        self.trouble.get_or_insert(trouble);
        self.is_left = true;
        self.absences += 1;
        let wait = if self.absences > 1 { self.retry.next() } else { Duration::ZERO };
        self.rests_until = Some(now + wait.max(pause));
    }

    /// Notes that it answered.
    pub fn found(&mut self) {
        if self.absences > 0 {
            self.absences = 0;
            self.retry.reset();
            self.rests_until = None;
        }
    }
}
