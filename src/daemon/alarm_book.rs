//! The book of alarms: which alarms are active, since when, in which order they rose, who
//! acknowledged them.
//!
//! Pure: times are arguments. `alarm_keeper` enters the alarms' changes that the scan thread
//! reports; `operator` reads the book and acknowledges alarms. The size of the book is bounded by
//! the number of alarms. The book lives as long as the process. The states are those of ISA-18.2:
//! an alarm that went away unacknowledged stays in the list until somebody acknowledges it.

use std::cmp::Reverse;
use std::collections::{HashMap, VecDeque};

use rungd_client::operator::protocol::{AckedAlarm, AlarmAck, AlarmState, AlarmStatus, AlarmTime};
use rungd_config::controller::watch::WatchSettings;
use rungd_engine::Cell;
use rungd_language::lower;
use rungd_language::resolve::alarm_terms::{AckBit, AlarmTerms};
use rungd_runtime::AlarmDelay;
use rungd_runtime::exchange::Snapshot;

/// Rises are counted per period of ten minutes.
const SLICE_NS: u64 = 600 * 1_000_000_000;
/// The number of such periods in a day.
const SLICES: u64 = 144;

/// The time of an event: its scan, and its time by both clocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct BookTime {
    pub scan: u64,
    /// CLOCK_MONOTONIC.
    pub at_ns: u64,
    /// Since 1970 (UTC).
    pub unix_ns: i64,
}

impl BookTime {
    fn shown(self) -> AlarmTime {
        AlarmTime { scan: self.scan, unix_ns: self.unix_ns }
    }
}

/// An alarm of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct KnownAlarm {
    /// The name of its tag or watch.
    pub tag: String,
    pub text: String,
    pub terms: AlarmTerms,
    pub of: AlarmSource,
}

/// What an alarm is of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum AlarmSource {
    /// A bit that is ON.
    Bit(Cell),
    /// A line of `[[watch]]` that does not hold, as it is written.
    Watch(String),
}

impl KnownAlarm {
    /// The alarms of a program: those of its bits, in the scan thread's numbering, then its
    /// watches.
    pub fn all(alarms: &[lower::Alarm], watches: &WatchSettings) -> Vec<KnownAlarm> {
        let bits = alarms.iter().map(|alarm| KnownAlarm {
            tag: alarm.tag.clone(),
            text: alarm.text.clone(),
            terms: alarm.terms.clone(),
            of: AlarmSource::Bit(alarm.bit),
        });
        let watches = watches.all.iter().map(|watch| KnownAlarm {
            tag: watch.name.clone(),
            text: watch.text.clone(),
            terms: AlarmTerms { priority: watch.priority, ..AlarmTerms::default() },
            of: AlarmSource::Watch(watch.always.clone()),
        });
        bits.chain(watches).collect()
    }

    /// Among the alarms of a program: that of a line that is watched, with its number.
    pub fn of_watch(all: &[KnownAlarm], line: usize) -> Option<(usize, &KnownAlarm)> {
        all.iter().enumerate().filter(|(_, alarm)| alarm.line().is_some()).nth(line)
    }

    /// Its bit; a watch has none.
    pub fn bit(&self) -> Option<Cell> {
        if let AlarmSource::Bit(bit) = self.of { Some(bit) } else { None }
    }

    /// Whether it follows a change of its bit to this state later than at once.
    fn waits(&self, on: bool) -> bool {
        let ms = if on { self.terms.delay_ms } else { self.terms.off_delay_ms };
        ms > 0
    }

    /// Its delays.
    pub fn delay(&self) -> AlarmDelay {
        AlarmDelay::of_ms(self.terms.delay_ms, self.terms.off_delay_ms)
    }

    /// The line that is watched.
    pub fn line(&self) -> Option<&str> {
        if let AlarmSource::Watch(line) = &self.of { Some(line) } else { None }
    }
}

/// How often an alarm rose in each period of ten minutes, the oldest period first; covers at most a
/// day.
#[derive(Clone, Debug, Default)]
struct DayCount(VecDeque<(u64, u32)>);

impl DayCount {
    fn add(&mut self, at_ns: u64) {
        let slice = at_ns / SLICE_NS;
        match self.0.back_mut() {
            Some((last, count)) if *last >= slice => *count = count.saturating_add(1),
            Some(_) | None => self.0.push_back((slice, 1)),
        }
        while self.0.front().is_some_and(|(first, _)| first + SLICES <= slice) {
            self.0.pop_front();
        }
    }

    fn of_the_day_before(&self, now_ns: u64) -> u32 {
        let now = now_ns / SLICE_NS;
        let counted = self.0.iter().filter(|(slice, _)| slice + SLICES > now);
        counted.fold(0, |sum, (_, count)| sum.saturating_add(*count))
    }
}

/// The last time that an alarm rose.
#[derive(Clone, Copy, Debug)]
struct AlarmRise {
    at: BookTime,
    episode: u64,
    order: u32,
}

/// The book's entry of an alarm.
#[derive(Clone, Debug)]
struct BookedAlarm {
    known: KnownAlarm,
    state: AlarmState,
    rise: Option<AlarmRise>,
    /// When the alarm went OFF; `None` if it has not gone OFF since it last rose.
    ended: Option<BookTime>,
    acknowledged: Option<AlarmAck>,
    day: DayCount,
    /// Why its watch did not hold when it last rose; empty while that is not known.
    why: Vec<String>,
}

impl BookedAlarm {
    fn new(known: KnownAlarm) -> BookedAlarm {
        BookedAlarm {
            known,
            state: AlarmState::Normal,
            rise: None,
            ended: None,
            acknowledged: None,
            day: DayCount::default(),
            why: Vec::new(),
        }
    }

    fn shown(&self, now_ns: u64) -> AlarmStatus {
        let end_ns = self.ended.map_or(now_ns, |ended| ended.at_ns);
        let begin_ns = self.rise.map_or(end_ns, |rise| rise.at.at_ns);
        AlarmStatus {
            tag: self.known.tag.clone(),
            text: self.known.text.clone(),
            priority: self.known.terms.priority,
            group: self.known.terms.group.clone(),
            state: self.state,
            since: self.rise.map(|rise| rise.at.shown()),
            ended: self.ended.map(BookTime::shown),
            lasted_ms: end_ns.saturating_sub(begin_ns) / 1_000_000,
            episode: self.rise.map_or(0, |rise| rise.episode),
            order: self.rise.map_or(0, |rise| rise.order),
            day: self.day.of_the_day_before(now_ns),
            acknowledged: self.acknowledged.clone(),
            watch: self.known.line().map(str::to_owned),
            why: self.why.clone(),
        }
    }
}

/// An alarm that somebody acknowledged, and its `ack`.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Acknowledgement {
    pub alarm: AckedAlarm,
    bit: Option<AckBit>,
}

impl Acknowledgement {
    /// The bit to turn ON: also if the alarm was acknowledged before, so that somebody can repeat
    /// it for a ladder that was in STOP.
    pub fn written(&self) -> Option<&AckBit> {
        self.bit.as_ref().filter(|_| self.alarm.before != AlarmState::Normal)
    }
}

/// The book.
#[derive(Debug)]
pub(super) struct AlarmBook {
    /// The generation of the program that has these alarms.
    generation: u32,
    /// In the order of a scan, which is also the scan thread's numbering; behind them the watches.
    alarms: Vec<BookedAlarm>,
    standing: usize,
    episode: u64,
    /// The alarms that rose in this episode.
    risen: u32,
    /// When the last standing alarm went away (CLOCK_MONOTONIC).
    quiet_ns: Option<u64>,
}

impl AlarmBook {
    /// An empty book of the first program's alarms.
    pub fn new(alarms: &[KnownAlarm]) -> AlarmBook {
        let alarms = alarms.iter().cloned().map(BookedAlarm::new).collect();
        AlarmBook { generation: 0, alarms, standing: 0, episode: 0, risen: 0, quiet_ns: None }
    }

    /// Enters that an alarm went ON or OFF. A state that the book has already changes nothing.
    pub fn edge(&mut self, number: usize, on: bool, at: BookTime) {
        let AlarmBook { alarms, standing, episode, risen, quiet_ns, .. } = self;
        let Some(alarm) = alarms.get_mut(number) else { return };
        if alarm.state.is_active() == on {
            return;
        }
        if !on {
            alarm.state = match alarm.state {
                AlarmState::Unacknowledged => AlarmState::Returned,
                AlarmState::Acknowledged => AlarmState::Normal,
                other @ (AlarmState::Normal | AlarmState::Returned) => other,
            };
            alarm.ended = Some(at);
            *standing -= 1;
            *quiet_ns = Some(at.at_ns);
            return;
        }
        // The order of two changes in one scan is unknown. So an alarm that rises in the scan in
        // which the last standing alarm goes away belongs to the same episode.
        if *standing == 0 && *quiet_ns != Some(at.at_ns) {
            *episode += 1;
            *risen = 0;
        }
        let before = alarm.rise.filter(|rise| rise.episode == *episode);
        let order = before.map_or_else(
            || {
                *risen += 1;
                *risen
            },
            |rise| rise.order,
        );
        alarm.rise = Some(AlarmRise { at, episode: *episode, order });
        (alarm.state, alarm.ended, alarm.acknowledged) = (AlarmState::Unacknowledged, None, None);
        alarm.why.clear();
        alarm.day.add(at.at_ns);
        *standing += 1;
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
        self.standing = self.alarms.iter().filter(|alarm| alarm.state.is_active()).count();
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
    /// unacknowledged, the last episode first.
    pub fn list(&self, now_ns: u64) -> Vec<AlarmStatus> {
        let listed = self.alarms.iter().filter(|alarm| alarm.state != AlarmState::Normal);
        let mut list: Vec<AlarmStatus> = listed.map(|alarm| alarm.shown(now_ns)).collect();
        list.sort_by_key(|alarm| (!alarm.state.is_active(), Reverse(alarm.episode), alarm.order));
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

    /// The alarm with this number in the program of a generation, if it is active.
    pub fn standing(&self, generation: u32, number: usize, now_ns: u64) -> Option<AlarmStatus> {
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
        let waits = |alarm: &BookedAlarm| match alarm.state {
            AlarmState::Unacknowledged | AlarmState::Returned => true,
            AlarmState::Normal | AlarmState::Acknowledged => false,
        };
        let mut numbers: Vec<usize> =
            (0..self.alarms.len()).filter(|number| waits(&self.alarms[*number])).collect();
        numbers.sort_by_key(|number| {
            let BookedAlarm { state, rise, .. } = &self.alarms[*number];
            (!state.is_active(), rise.map(|rise| (Reverse(rise.episode), rise.order)))
        });
        numbers
    }

    /// Enters an acknowledgement. A standing alarm becomes acknowledged; an alarm that went away
    /// leaves the list; any other alarm stays as it is.
    pub fn acknowledge(&mut self, number: usize, ack: AlarmAck) -> Option<Acknowledgement> {
        let alarm = self.alarms.get_mut(number)?;
        let before = alarm.state;
        match before {
            AlarmState::Unacknowledged => {
                alarm.state = AlarmState::Acknowledged;
                alarm.acknowledged = Some(ack);
            }
            AlarmState::Returned => alarm.state = AlarmState::Normal,
            AlarmState::Normal | AlarmState::Acknowledged => {}
        }
        let (tag, text) = (alarm.known.tag.clone(), alarm.known.text.clone());
        let (after, bit) = (alarm.state, alarm.known.terms.ack.clone());
        let alarm = AckedAlarm { tag, text, before, after, bit: None, bit_refused: None };
        Some(Acknowledgement { alarm, bit })
    }
}

#[cfg(test)]
#[path = "alarm_book_tests.rs"]
mod tests;
