//! The book's entry of an alarm: its state, its last rise, and how often it rose in a day.

use std::collections::VecDeque;

use super::known::KnownAlarm;
use super::shelf::{BookedShelf, EndedShelf, ShelfEnd};
use super::time::BookTime;
use rungd_client::operator::protocol::{
    AckedAlarm, AlarmAck, AlarmShelf, AlarmState, AlarmStatus, ShelvedAlarm,
};
use rungd_language::resolve::alarm_terms::AckBit;

/// Rises are counted per period of ten minutes.
pub(super) const SLICE_NS: u64 = 600 * 1_000_000_000;
/// The number of such periods in a day.
pub(super) const SLICES: u64 = 144;

/// How often an alarm rose in each period of ten minutes, the oldest period first; covers at most a
/// day.
#[derive(Clone, Debug, Default)]
pub(super) struct DayCount(pub VecDeque<(u64, u32)>);

impl DayCount {
    pub fn add(&mut self, at_ns: u64) {
        let slice = at_ns / SLICE_NS;
        match self.0.back_mut() {
            Some((last, count)) if *last >= slice => *count = count.saturating_add(1),
            Some(_) | None => self.0.push_back((slice, 1)),
        }
        while self.0.front().is_some_and(|(first, _)| first + SLICES <= slice) {
            self.0.pop_front();
        }
    }

    pub fn of_the_day_before(&self, now_ns: u64) -> u32 {
        let now = now_ns / SLICE_NS;
        let counted = self.0.iter().filter(|(slice, _)| slice + SLICES > now);
        counted.fold(0, |sum, (_, count)| sum.saturating_add(*count))
    }
}

/// The last time that an alarm rose.
#[derive(Clone, Copy, Debug)]
pub(super) struct AlarmRise {
    pub at: BookTime,
    pub episode: u64,
    pub order: u32,
}

/// The book's entry of an alarm.
#[derive(Clone, Debug)]
pub(super) struct BookedAlarm {
    pub known: KnownAlarm,
    pub state: AlarmState,
    pub rise: Option<AlarmRise>,
    /// When the alarm went OFF; `None` if it has not gone OFF since it last rose.
    pub ended: Option<BookTime>,
    pub acknowledged: Option<AlarmAck>,
    pub shelf: Option<BookedShelf>,
    pub day: DayCount,
    /// Why its watch did not hold when it last rose; empty while that is not known.
    pub why: Vec<String>,
}

impl BookedAlarm {
    pub fn new(known: KnownAlarm) -> BookedAlarm {
        BookedAlarm {
            known,
            state: AlarmState::Normal,
            rise: None,
            ended: None,
            acknowledged: None,
            shelf: None,
            day: DayCount::default(),
            why: Vec::new(),
        }
    }

    pub fn shown(&self, now_ns: u64) -> AlarmStatus {
        let end_ns = self.ended.map_or(now_ns, |ended| ended.at_ns);
        let begin_ns = self.rise.map_or(end_ns, |rise| rise.at.at_ns);
        let listed = self.rise.filter(|_| self.shelf.is_none());
        AlarmStatus {
            tag: self.known.tag.clone(),
            text: self.known.text.clone(),
            priority: self.known.terms.priority,
            group: self.known.terms.group.clone(),
            state: self.state,
            since: self.rise.map(|rise| rise.at.shown()),
            ended: self.ended.map(BookTime::shown),
            lasted_ms: end_ns.saturating_sub(begin_ns) / 1_000_000,
            episode: listed.map_or(0, |rise| rise.episode),
            order: listed.map_or(0, |rise| rise.order),
            day: self.day.of_the_day_before(now_ns),
            acknowledged: self.acknowledged.clone(),
            shelved: self.shelf.as_ref().map(|shelf| shelf.shown.clone()),
            watch: self.known.line().map(str::to_owned),
            why: self.why.clone(),
        }
    }

    /// Whether it is in the list of those that somebody has to care for.
    pub fn is_standing(&self) -> bool {
        self.state.is_active() && self.shelf.is_none()
    }

    /// The change of its shelf.
    pub fn shelf_change(&self, before: Option<AlarmShelf>) -> ShelvedAlarm {
        ShelvedAlarm {
            tag: self.known.tag.clone(),
            text: self.known.text.clone(),
            before,
            after: self.shelf.as_ref().map(|shelf| shelf.shown.clone()),
            is_active: self.state.is_active(),
        }
    }

    /// Its shelf, as one that ends.
    pub fn ended_shelf(&self, why: ShelfEnd) -> Option<EndedShelf> {
        let shelf = self.shelf.as_ref()?.shown.clone();
        Some(EndedShelf { tag: self.known.tag.clone(), text: self.known.text.clone(), shelf, why })
    }
}

/// An alarm that somebody acknowledged, and its `ack`.
#[derive(Debug, PartialEq, Eq)]
pub(in super::super) struct Acknowledgement {
    pub alarm: AckedAlarm,
    pub(super) bit: Option<AckBit>,
}

impl Acknowledgement {
    /// The bit to turn ON: also if the alarm was acknowledged before, so that somebody can repeat
    /// it for a ladder that was in STOP.
    pub fn written(&self) -> Option<&AckBit> {
        self.bit.as_ref().filter(|_| self.alarm.before != AlarmState::Normal)
    }
}
