//! The book: the alarms of the running program, in the order in which they rose.
//!
//! Pure: times are arguments. `shelves` and `kept` have the rest of it.

use std::cmp::Reverse;
use std::collections::HashMap;

use super::entry::{Acknowledgement, AlarmRise, BookedAlarm};
use super::known::KnownAlarm;
use super::pending::PendingAcks;
use super::shelf::{EndedShelf, ShelfEnd};
use super::time::BookTime;
use rungd_client::operator::protocol::{AckedAlarm, AlarmAck, AlarmState, AlarmStatus};
use rungd_engine::Cell;
use rungd_runtime::exchange::Snapshot;

/// The book.
#[derive(Debug)]
pub(in super::super) struct AlarmBook {
    /// The generation of the program that has these alarms.
    pub(super) generation: u32,
    /// In the order of a scan, which is also the scan thread's numbering; behind them the watches.
    pub(super) alarms: Vec<BookedAlarm>,
    pub(super) standing: usize,
    episode: u64,
    /// The alarms that rose in this episode.
    risen: u32,
    /// When the last standing alarm went away (CLOCK_MONOTONIC).
    quiet_ns: Option<u64>,
    /// The shelves that ended without a request, and are not told yet.
    pub(super) ended: Vec<EndedShelf>,
    /// The acknowledgements of the process before.
    pub(super) pending: PendingAcks,
}

impl AlarmBook {
    /// An empty book of the first program's alarms.
    pub fn new(alarms: &[KnownAlarm]) -> AlarmBook {
        let alarms = alarms.iter().cloned().map(BookedAlarm::new).collect();
        AlarmBook {
            generation: 0,
            alarms,
            standing: 0,
            episode: 0,
            risen: 0,
            quiet_ns: None,
            ended: Vec::new(),
            pending: PendingAcks::default(),
        }
    }

    /// Enters that an alarm went ON or OFF. A state that the book has already changes nothing.
    pub fn edge(&mut self, number: usize, on: bool, at: BookTime) {
        let Some(alarm) = self.alarms.get_mut(number) else { return };
        if alarm.state.is_active() == on {
            return;
        }
        let is_shelved = alarm.shelf.is_some();
        if !on {
            alarm.state = match alarm.state {
                AlarmState::Unacknowledged if !is_shelved => AlarmState::Returned,
                AlarmState::Unacknowledged | AlarmState::Acknowledged => AlarmState::Normal,
                other @ (AlarmState::Normal | AlarmState::Returned) => other,
            };
            alarm.ended = Some(at);
            if !is_shelved {
                self.leave(at.at_ns);
            }
            return;
        }
        alarm.acknowledged = self.pending.take(alarm, at.at_ns).filter(|_| !is_shelved);
        alarm.state = match &alarm.acknowledged {
            Some(_) => AlarmState::Acknowledged,
            None => AlarmState::Unacknowledged,
        };
        alarm.ended = None;
        alarm.why.clear();
        alarm.day.add(at.at_ns);
        match is_shelved {
            true => alarm.rise = Some(AlarmRise { at, episode: 0, order: 0 }),
            false => self.join(number, at, at.at_ns),
        }
    }

    /// An alarm that rose at a time joins those that stand, now.
    pub(super) fn join(&mut self, number: usize, at: BookTime, now_ns: u64) {
        let AlarmBook { alarms, standing, episode, risen, quiet_ns, .. } = self;
        // The order of two changes in one scan is unknown. So an alarm that rises in the scan in
        // which the last standing alarm goes away belongs to the same episode.
        if *standing == 0 && *quiet_ns != Some(now_ns) {
            *episode += 1;
            *risen = 0;
        }
        let alarm = &mut alarms[number];
        let before = alarm.rise.filter(|rise| rise.episode == *episode);
        let order = before.map_or_else(
            || {
                *risen += 1;
                *risen
            },
            |rise| rise.order,
        );
        alarm.rise = Some(AlarmRise { at, episode: *episode, order });
        *standing += 1;
    }

    /// An alarm is no longer among those that stand.
    pub(super) fn leave(&mut self, now_ns: u64) {
        self.standing -= 1;
        self.quiet_ns = Some(now_ns);
    }

    /// Continues with the alarms of a new program. An alarm whose name stays keeps its entry.
    pub fn swap(&mut self, generation: u32, alarms: &[KnownAlarm]) {
        let old = std::mem::take(&mut self.alarms);
        let mut old: HashMap<String, BookedAlarm> =
            old.into_iter().map(|alarm| (alarm.known.tag.clone(), alarm)).collect();
        let booked = |known: &KnownAlarm| match old.remove(&known.tag) {
            Some(alarm) => BookedAlarm { known: known.clone(), ..alarm },
            None => BookedAlarm::new(known.clone()),
        };
        self.alarms = alarms.iter().map(booked).collect();
        self.standing = self.alarms.iter().filter(|alarm| alarm.is_standing()).count();
        self.ended.extend(old.values().filter_map(|alarm| alarm.ended_shelf(ShelfEnd::Gone)));
        self.generation = generation;
    }

    /// Whether the book has the same alarms ON as an image.
    pub fn agrees(&self, image: &Snapshot) -> bool {
        // What is watched is told later, by the recording's thread, and what waits for its delay
        // by the log.
        let agrees = |alarm: &BookedAlarm| {
            let on = alarm.known.bit().map(|bit| image.value(bit) != 0);
            on.is_none_or(|on| on == alarm.state.is_active() || alarm.known.waits(on))
        };
        self.generation == image.generation && self.alarms.iter().all(agrees)
    }

    /// Enters the state of all alarms in an image, after records of the scan thread were lost.
    /// False if the image belongs to a different program.
    pub fn reconcile(&mut self, image: &Snapshot, unix_ns: i64) -> bool {
        if self.generation != image.generation {
            return false;
        }
        let at = BookTime { scan: image.scans, at_ns: image.now_ns, unix_ns };
        for number in 0..self.alarms.len() {
            let known = &self.alarms[number].known;
            // An alarm with a delay comes from the log, which corrects itself.
            let Some(bit) = known.bit().filter(|_| !known.terms.is_delayed()) else { continue };
            self.edge(number, image.value(bit) != 0, at);
        }
        true
    }

    /// The standing alarms, in the order in which they rose; then the alarms that went away
    /// unacknowledged, the last episode first; then those that are shelved.
    pub fn list(&self, now_ns: u64) -> Vec<AlarmStatus> {
        let is_listed =
            |alarm: &&BookedAlarm| alarm.state != AlarmState::Normal || alarm.shelf.is_some();
        let listed = self.alarms.iter().filter(is_listed);
        let mut list: Vec<AlarmStatus> = listed.map(|alarm| alarm.shown(now_ns)).collect();
        list.sort_by_key(|alarm| {
            let since_ns = alarm.shelved.as_ref().map(|shelf| shelf.since_ns);
            (since_ns, !alarm.state.is_active(), Reverse(alarm.episode), alarm.order)
        });
        list
    }

    /// Enters why a watch did not hold, for the alarm that rose in this scan.
    pub fn explain(&mut self, name: &str, scan: u64, why: Vec<String>) {
        let is_it = |alarm: &&mut BookedAlarm| {
            alarm.known.tag == name && alarm.rise.is_some_and(|rise| rise.at.scan == scan)
        };
        if let Some(alarm) = self.alarms.iter_mut().find(is_it) {
            alarm.why = why;
        }
    }

    /// The watches whose lines do not hold.
    pub fn broken_watches(&self, now_ns: u64) -> impl Iterator<Item = AlarmStatus> {
        let of_watch = |alarm: &&BookedAlarm| alarm.known.line().is_some();
        let active = self.alarms.iter().filter(of_watch).filter(|alarm| alarm.state.is_active());
        active.map(move |alarm| alarm.shown(now_ns))
    }

    /// The alarm with this number in the program of a generation, if its bit is ON; it may be
    /// shelved.
    pub fn active(&self, generation: u32, number: usize, now_ns: u64) -> Option<AlarmStatus> {
        let alarm = self.alarms.get(number).filter(|alarm| alarm.state.is_active())?;
        (self.generation == generation).then(|| alarm.shown(now_ns))
    }

    /// The number of a tag's alarm.
    pub fn of_tag(&self, tag: &str) -> Option<usize> {
        self.alarms.iter().position(|alarm| alarm.known.tag == tag)
    }

    /// The numbers of all alarms of a bit of a program: several tags may watch the bit.
    pub fn of_bit(&self, generation: u32, bit: Cell) -> Vec<usize> {
        let is_ours = self.generation == generation;
        let watches = |number: &usize| is_ours && self.alarms[*number].known.bit() == Some(bit);
        (0..self.alarms.len()).filter(watches).collect()
    }

    /// The numbers of the unacknowledged alarms, in the order of the list.
    pub fn unacknowledged(&self) -> Vec<usize> {
        let waits = |alarm: &BookedAlarm| alarm.state.waits() && alarm.shelf.is_none();
        let mut numbers: Vec<usize> =
            (0..self.alarms.len()).filter(|number| waits(&self.alarms[*number])).collect();
        numbers.sort_by_key(|number| {
            let BookedAlarm { state, rise, .. } = &self.alarms[*number];
            (!state.is_active(), rise.map(|rise| (Reverse(rise.episode), rise.order)))
        });
        numbers
    }

    /// Enters an acknowledgement. A standing alarm becomes acknowledged; an alarm that went away
    /// leaves the list; any other alarm stays as it is, as one that is shelved does.
    pub fn acknowledge(&mut self, number: usize, ack: AlarmAck) -> Option<Acknowledgement> {
        let alarm = self.alarms.get_mut(number)?;
        let (before, shelved) = (alarm.state, alarm.shelf.is_some());
        match before {
            _ if shelved => {}
            AlarmState::Unacknowledged => {
                alarm.state = AlarmState::Acknowledged;
                alarm.acknowledged = Some(ack);
            }
            AlarmState::Returned => alarm.state = AlarmState::Normal,
            AlarmState::Normal | AlarmState::Acknowledged => {}
        }
        let (tag, text) = (alarm.known.tag.clone(), alarm.known.text.clone());
        let bit = alarm.known.terms.ack.clone().filter(|_| !shelved);
        let (after, bit_refused) = (alarm.state, None);
        let alarm = AckedAlarm { tag, text, before, after, shelved, bit: None, bit_refused };
        Some(Acknowledgement { alarm, bit })
    }
}
