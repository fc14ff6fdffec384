//! The talk with a peer: sends a request to a unit, and decides the effect of the answer.
//!
//! Called by `client`, which chooses the requests. This module decides the scope of trouble: an
//! exception affects its request, silence affects its unit, and garbage affects the connection. Two
//! kinds of trouble end the connection but not the exchange ([`ConnectionLoss::Anew`]): the
//! exchange continues over a new connection.

use std::fmt;
use std::time::Duration;

use super::answer::{self, AnswerFault};
use super::link::{LinkFailure, PeerLink};
use super::settings::ModbusTable;
use super::unit::UnitState;
use crate::device::ExchangeFailure;

/// The link, and the state of the units that it reaches.
pub(super) struct UnitTalk<L> {
    pub link: L,
    pub units: Vec<UnitState>,
    pub request: Vec<u8>,
    answer: Vec<u8>,
    /// The shortest time for which no request is sent to a silent unit. If answers do not identify
    /// their requests, a late answer has to arrive and be discarded before the next request.
    pause: Duration,
    /// Whether any request of this exchange has been answered, correctly or not.
    has_heard: bool,
    /// Whether a unit was silent in this exchange, and the connection was closed for that reason.
    was_silent: bool,
}

/// The end of a connection during an exchange.
pub(super) enum ConnectionLoss {
    /// The exchange has failed.
    Off(ExchangeFailure),
    /// The exchange can continue over a new connection. If connecting fails, this trouble is
    /// reported.
    Anew(ExchangeFailure),
}

/// The question, for the log.
#[derive(Clone, Copy)]
pub(super) struct RequestText {
    pub verb: &'static str,
    pub unit: u8,
    pub table: ModbusTable,
    pub first: u16,
    pub count: u16,
    /// Whether a smaller limit of elements would divide it into several requests.
    pub is_joined: bool,
}

/// The verb of questions for inputs.
pub(super) const READING: &str = "reading";

impl<L: PeerLink> UnitTalk<L> {
    /// A talk with these units, whose answers are complete within `timeout`.
    pub fn new(link: L, mut units: Vec<u8>, timeout: Duration) -> UnitTalk<L> {
        units.sort_unstable();
        units.dedup();
        let units = units.into_iter().map(UnitState::new).collect();
        let pause = if L::STARTS_ANEW { timeout } else { Duration::ZERO };
        let (request, answer) = (Vec::new(), Vec::new());
        UnitTalk { link, units, request, answer, pause, has_heard: false, was_silent: false }
    }

    /// Begins an exchange.
    pub fn begin(&mut self, begin: impl FnMut(&mut UnitState)) {
        (self.has_heard, self.was_silent) = (false, false);
        self.units.iter_mut().for_each(begin);
    }

    /// Whether units were silent and none answered in this exchange, so that the peer itself is
    /// lost.
    pub fn is_dead(&self) -> bool {
        self.was_silent && !self.has_heard
    }

    pub fn unit(&mut self, number: u8) -> &mut UnitState {
        let at = self.units.binary_search_by_key(&number, |unit| unit.number);
        &mut self.units[at.expect("every unit of the plan is listed")]
    }

    /// Sends the request to its unit. Returns the data of the answer; `None` if the unit is in
    /// trouble. The unit's state then has the trouble.
    ///
    /// # Errors
    /// The connection has ended.
    pub async fn ask(&mut self, what: &RequestText) -> Result<Option<&[u8]>, ConnectionLoss> {
        if self.unit(what.unit).is_left {
            return Ok(None);
        }
        let UnitTalk { link, request, answer, .. } = self;
        if link.is_broadcast(what.unit) {
            // Nobody answers: that it is sent is all that is known.
            return match link.broadcast(request).await {
                Ok(()) => Ok(Some(&[])),
                Err(failure) => self.fail(what, failure).map(|()| None),
            };
        }
        if let Err(failure) = link.ask(what.unit, request, answer).await {
            return self.fail(what, failure).map(|()| None);
        }
        self.has_heard = true;
        match answer::check(&self.request, &self.answer).map(|data| data.len()) {
            Ok(length) => {
                self.unit(what.unit).found();
                let from = self.answer.len() - length;
                Ok(Some(&self.answer[from..]))
            }
            Err(wrong) => self.refuse(what, wrong).map(|()| None),
        }
    }

    /// Handles a missing answer.
    fn fail(&mut self, what: &RequestText, failure: LinkFailure) -> Result<(), ConnectionLoss> {
        let (pause, is_alone, is_first) = (self.pause, self.units.len() == 1, !self.has_heard);
        let (is_usable, now) = (self.link.is_usable(), self.link.now());
        let unit = self.unit(what.unit);
        match failure {
            LinkFailure::Silent(reason) => {
                let reason = format!("{what}: {reason}");
                if is_usable {
                    unit.miss(reason, pause, now);
                    return Ok(());
                }
                let trouble = ExchangeFailure::disconnected(reason.clone());
                if is_alone {
                    return Err(ConnectionLoss::Off(trouble));
                }
                // The other units of the link may still answer.
                unit.miss(reason, pause, now);
                self.was_silent = true;
                Err(ConnectionLoss::Anew(trouble))
            }
            // The unit receives further requests: a read shows whether it is present.
            LinkFailure::Doubtful(reason) => {
                unit.trouble.get_or_insert(format!("{what}: {reason}"));
                Ok(())
            }
            // The peer closed the connection while it was idle. The request can be repeated even if
            // the peer has executed it: a read changes nothing, and a write sets the same values
            // again.
            LinkFailure::Closed(reason) if is_first => Err(ConnectionLoss::Anew(
                ExchangeFailure::disconnected(format!("{what}: {reason}")),
            )),
            LinkFailure::Closed(reason) => {
                let reason = format!("{what}: {reason} {CLOSED_AFTER_ANSWER}");
                Err(ConnectionLoss::Off(ExchangeFailure::disconnected(reason)))
            }
            LinkFailure::Broken(reason) => {
                Err(ConnectionLoss::Off(ExchangeFailure::disconnected(format!("{what}: {reason}"))))
            }
        }
    }

    /// Handles a PDU that is not a good answer.
    fn refuse(&mut self, what: &RequestText, wrong: AnswerFault) -> Result<(), ConnectionLoss> {
        let hint = what.hint(&self.request, wrong);
        let (reason, pause) = (format!("{what}: {wrong}{hint}"), self.pause);
        let now = self.link.now();
        let unit = self.unit(what.unit);
        match wrong {
            AnswerFault::Exception(_) if wrong.is_absence() => {
                unit.miss(reason, Duration::ZERO, now)
            }
            AnswerFault::Exception(_) => {
                unit.found();
                // A unit that refuses a read still accepts its outputs.
                let noted = if what.verb == READING { &mut unit.unread } else { &mut unit.trouble };
                noted.get_or_insert(reason);
            }
            // The PDU may answer an earlier request, and the right answer may still arrive.
            AnswerFault::Empty
            | AnswerFault::Function(_)
            | AnswerFault::Length
            | AnswerFault::Count { .. }
            | AnswerFault::Echo => {
                if !L::STARTS_ANEW {
                    return Err(ConnectionLoss::Off(ExchangeFailure::disconnected(reason)));
                }
                unit.miss(reason, pause, now);
            }
        }
        Ok(())
    }
}

/// What may help a peer that closes the connection after an answer.
const CLOSED_AFTER_ANSWER: &str = "after an answer: for a device that always does so, set \
     `connection = \"per-request\"`";

impl RequestText {
    /// The key that a peer with this refusal may need, as an end of its sentence.
    fn hint(&self, request: &[u8], wrong: AnswerFault) -> &'static str {
        let is_bits = self.table.is_bits();
        let is_short = matches!(wrong, AnswerFault::Count { came, asked } if came < asked);
        match (wrong, request.first()) {
            (AnswerFault::Exception(2..=4), _) | (AnswerFault::Count { .. }, _)
                if self.is_joined && (is_short || matches!(wrong, AnswerFault::Exception(_))) =>
            {
                match is_bits {
                    true => "; if it accepts shorter requests, set `max-bits`",
                    false => "; if it accepts shorter requests, set `max-registers`",
                }
            }
            (AnswerFault::Exception(1), Some(5 | 6)) => "; try `writes = \"multiple\"`",
            (AnswerFault::Exception(1), Some(15 | 16)) => "; try `writes = \"single\"`",
            _ => "",
        }
    }
}

impl fmt::Display for RequestText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let RequestText { verb, unit, table, first, count, .. } = *self;
        write!(f, "{verb} {} {first}", table.name())?;
        if count > 1 {
            write!(f, "..{}", u32::from(first) + u32::from(count) - 1)?;
        }
        write!(f, " of unit {unit}")
    }
}
