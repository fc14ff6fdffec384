//! The talk with a peer: a request to a unit, and what its answer means for unit and connection.
//!
//! Called by `client`, which knows what to ask. Here is decided what trouble concerns: an exception
//! concerns its request, silence its unit, garbage the connection. Two troubles end a connection
//! and not the exchange ([`Cut::Anew`]), which goes on over a new one.

use std::fmt;
use std::time::Duration;

use super::answer::{self, Wrong};
use super::link::{Failure, Link};
use super::settings::Table;
use super::unit::Unit;
use crate::io::device::Trouble;

/// The link, and what is known of the units behind it.
pub(super) struct Talk<L> {
    pub link: L,
    pub units: Vec<Unit>,
    pub request: Vec<u8>,
    answer: Vec<u8>,
    /// The least time for which a silent unit is left alone. Where an answer does not say to which
    /// question it belongs, a late one must have come, and gone, before the next question.
    pause: Duration,
    /// A request of this exchange has been answered, rightly or not.
    has_heard: bool,
    /// A unit was silent in it, and took the connection with it.
    was_silent: bool,
}

/// A connection that is of no use any more.
pub(super) enum Cut {
    /// The exchange has failed.
    Off(Trouble),
    /// The exchange can go on over a new connection. With the reason, should there be none.
    Anew(Trouble),
}

/// What is asked, for the log.
#[derive(Clone, Copy)]
pub(super) struct What {
    pub verb: &'static str,
    pub unit: u8,
    pub table: Table,
    pub first: u16,
    pub count: u16,
}

/// What a question is called that asks for inputs.
pub(super) const READING: &str = "reading";

impl<L: Link> Talk<L> {
    /// With these units, whose answers are whole within `timeout`.
    pub fn new(link: L, mut units: Vec<u8>, timeout: Duration) -> Talk<L> {
        units.sort_unstable();
        units.dedup();
        let units = units.into_iter().map(Unit::new).collect();
        let pause = if L::STARTS_ANEW { timeout } else { Duration::ZERO };
        let (request, answer) = (Vec::new(), Vec::new());
        Talk { link, units, request, answer, pause, has_heard: false, was_silent: false }
    }

    /// An exchange begins.
    pub fn begin(&mut self, begin: impl FnMut(&mut Unit)) {
        (self.has_heard, self.was_silent) = (false, false);
        self.units.iter_mut().for_each(begin);
    }

    /// Whether nothing but silence came in this exchange: it is the peer itself that is lost.
    pub fn is_dead(&self) -> bool {
        self.was_silent && !self.has_heard
    }

    pub fn unit(&mut self, number: u8) -> &mut Unit {
        let at = self.units.binary_search_by_key(&number, |unit| unit.number);
        &mut self.units[at.expect("every unit of the plan is listed")]
    }

    /// Puts the request to its unit: the data of the answer, or nothing where the unit is in
    /// trouble, which it notes.
    ///
    /// # Errors
    /// The link is of no use any more.
    pub async fn ask(&mut self, what: &What) -> Result<Option<&[u8]>, Cut> {
        if self.unit(what.unit).is_left {
            return Ok(None);
        }
        let Talk { link, request, answer, .. } = self;
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

    /// No answer came.
    fn fail(&mut self, what: &What, failure: Failure) -> Result<(), Cut> {
        let (pause, is_alone, is_first) = (self.pause, self.units.len() == 1, !self.has_heard);
        let unit = self.unit(what.unit);
        match failure {
            Failure::Silent(reason) => {
                let reason = format!("{what}: {reason}");
                if L::STARTS_ANEW {
                    unit.miss(reason, pause);
                    return Ok(());
                }
                let trouble = Trouble::disconnected(reason.clone());
                if is_alone {
                    return Err(Cut::Off(trouble));
                }
                // The others behind the link may be well.
                unit.miss(reason, pause);
                self.was_silent = true;
                Err(Cut::Anew(trouble))
            }
            // Asked further: a read shows whether it is there.
            Failure::Doubtful(reason) => {
                unit.trouble.get_or_insert(format!("{what}: {reason}"));
                Ok(())
            }
            // The peer closed it while nothing was asked. If it has executed the request all the
            // same, asking again does no harm: a read changes nothing, a write sets values.
            Failure::Closed(reason) if is_first => {
                Err(Cut::Anew(Trouble::disconnected(format!("{what}: {reason}"))))
            }
            Failure::Closed(reason) | Failure::Broken(reason) => {
                Err(Cut::Off(Trouble::disconnected(format!("{what}: {reason}"))))
            }
        }
    }

    /// What came is no good answer.
    fn refuse(&mut self, what: &What, wrong: Wrong) -> Result<(), Cut> {
        let (reason, pause) = (format!("{what}: {wrong}"), self.pause);
        let unit = self.unit(what.unit);
        match wrong {
            Wrong::Exception(_) if wrong.is_absence() => unit.miss(reason, Duration::ZERO),
            Wrong::Exception(_) => {
                unit.found();
                // One that refuses a read takes its outputs all the same.
                let noted = if what.verb == READING { &mut unit.unread } else { &mut unit.trouble };
                noted.get_or_insert(reason);
            }
            // It may have been to an earlier question, and the right one on its way.
            Wrong::Empty
            | Wrong::Function(_)
            | Wrong::Length
            | Wrong::Count { .. }
            | Wrong::Echo => {
                if !L::STARTS_ANEW {
                    return Err(Cut::Off(Trouble::disconnected(reason)));
                }
                unit.miss(reason, pause);
            }
        }
        Ok(())
    }
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let What { verb, unit, table, first, count } = *self;
        write!(f, "{verb} {} {first}", table.name())?;
        if count > 1 {
            write!(f, "..{}", u32::from(first) + u32::from(count) - 1)?;
        }
        write!(f, " of unit {unit}")
    }
}
