//! Shelved alarms in the book: an operator takes an alarm out of the list for a time, or out of
//! service until somebody brings it back (ISA-18.2).
//!
//! Part of the book. A shelved alarm is followed as before, but it belongs to no episode, and
//! nobody has to acknowledge it. An alarm that stands when it comes back has to be acknowledged
//! then. The end of a shelf is a time of CLOCK_MONOTONIC, so that a change of the clock moves no
//! end.

use super::book::AlarmBook;
use super::shelf::{BookedShelf, EndedShelf, ShelfEnd, WantedShelf};
use super::time::BookTime;
use rungd_client::operator::protocol::{AlarmState, ShelvedAlarm};

impl AlarmBook {
    /// Whether the alarm may be shelved.
    pub fn may_shelve(&self, number: usize) -> bool {
        self.alarms.get(number).is_some_and(|alarm| alarm.known.may_be_shelved)
    }

    /// The tag of an alarm.
    pub fn tag(&self, number: usize) -> &str {
        self.alarms.get(number).map_or("", |alarm| &alarm.known.tag)
    }

    /// Shelves an alarm from now on. A second shelf replaces the first one.
    pub fn shelve(
        &mut self,
        number: usize,
        wanted: WantedShelf,
        now: BookTime,
    ) -> Option<ShelvedAlarm> {
        let alarm = self.alarms.get_mut(number)?;
        let stood = alarm.is_standing();
        let before = alarm.shelf.replace(BookedShelf::new(wanted, now)).map(|shelf| shelf.shown);
        if before.is_none() {
            alarm.acknowledged = None;
            alarm.state = match alarm.state.is_active() {
                true => AlarmState::Unacknowledged,
                false => AlarmState::Normal,
            };
        }
        let change = alarm.shelf_change(before);
        if stood {
            self.leave(now.at_ns);
        }
        Some(change)
    }

    /// Brings an alarm back. If it stands, it joins the others, and has to be acknowledged.
    pub fn unshelve(&mut self, number: usize, now: BookTime) -> Option<ShelvedAlarm> {
        let alarm = self.alarms.get_mut(number)?;
        let before = alarm.shelf.take().map(|shelf| shelf.shown);
        let change = alarm.shelf_change(before);
        let risen = alarm.rise.filter(|_| change.before.is_some() && change.is_active);
        if let Some(rise) = risen {
            self.join(number, rise.at, now.at_ns);
        }
        Some(change)
    }

    /// Ends the shelves whose time is over, and those of alarms that may not be shelved. Returns
    /// all that ended without a request since the last call.
    pub fn lapse(&mut self, now: BookTime) -> Vec<EndedShelf> {
        for number in 0..self.alarms.len() {
            let alarm = &mut self.alarms[number];
            let Some(shelf) = &mut alarm.shelf else { continue };
            shelf.follow_clock(now);
            let is_over = shelf.until_ns.is_some_and(|until_ns| until_ns <= now.at_ns);
            let why = match alarm.known.may_be_shelved {
                true if is_over => ShelfEnd::TimeOver,
                true => continue,
                false => ShelfEnd::Critical,
            };
            let ended = alarm.ended_shelf(why);
            self.ended.extend(ended);
            self.unshelve(number, now);
        }
        std::mem::take(&mut self.ended)
    }
}
