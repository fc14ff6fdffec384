//! The past that is being told: which parts of it wait, and how its tags are called now.

use std::collections::{HashMap, VecDeque};

use super::tags::TagMetric;
use super::throttle::{Throttle, ToldChanges};
use crate::live::{HistorySpan, LogPosition, LoggedChange};
use crate::sparkplug::DataType;

/// The parts of the past that are still to be told; the first one is being told.
#[derive(Debug, Default)]
pub(super) struct TellsHistory {
    spans: VecDeque<HistorySpan>,
    /// Of the first one: up to here it is told.
    at: Option<LogPosition>,
    /// The tags of the program that the past is about.
    names: Vec<(String, DataType)>,
    /// By tag of the past: its number now.
    places: Vec<Option<usize>>,
    throttle: Throttle,
    /// Values of tags that the present program does not have.
    unplaced: u64,
}

impl TellsHistory {
    /// Whether something is to be told.
    pub fn is_under_way(&self) -> bool {
        !self.spans.is_empty()
    }

    /// Up to here all is told, while something is.
    pub fn position(&self) -> Option<LogPosition> {
        self.spans.front().map(|span| self.at.unwrap_or(span.from))
    }

    /// Forgets all: what is to be told begins anew.
    pub fn clear(&mut self) {
        *self = TellsHistory::default();
    }

    /// Adds a part of the past; gives it, if it is the one to be told now.
    pub fn add(&mut self, span: HistorySpan) -> Option<HistorySpan> {
        self.spans.push_back(span);
        (self.spans.len() == 1).then_some(span)
    }

    /// The first part is told; gives the next one, and the number of values that had no place.
    pub fn done(&mut self) -> (Option<HistorySpan>, u64) {
        self.spans.pop_front();
        self.at = None;
        (self.spans.front().copied(), std::mem::take(&mut self.unplaced))
    }

    /// All is told up to a place.
    pub fn told(&mut self, at: LogPosition) {
        self.at = Some(at);
    }

    /// The past goes on with this program; `tags`: those of the present one.
    pub fn begins(&mut self, past: &[TagMetric], tags: &[TagMetric]) {
        self.names = past.iter().map(|of| (of.metric.name.clone(), of.metric.datatype)).collect();
        self.place(tags);
        if self.at.is_none() {
            self.throttle = Throttle::new(tags.len());
        }
    }

    /// The present program is another one.
    pub fn replaced(&mut self, tags: &[TagMetric]) {
        self.place(tags);
        self.throttle = Throttle::new(tags.len());
    }

    fn place(&mut self, tags: &[TagMetric]) {
        let now = tags.iter().enumerate();
        let now = now.map(|(at, of)| ((of.metric.name.as_str(), of.metric.datatype), at));
        let now: HashMap<(&str, DataType), usize> = now.collect();
        let place =
            |(name, datatype): &(String, DataType)| now.get(&(name.as_str(), *datatype)).copied();
        self.places = self.names.iter().map(place).collect();
    }

    /// Takes a change of the past; adds what is to be told.
    pub fn take(&mut self, change: LoggedChange, tags: &[TagMetric], out: &mut ToldChanges) {
        let place = self.places.get(change.cell as usize).copied().flatten();
        match place.and_then(|at| Some((at, tags.get(at)?))) {
            Some(tag) => self.throttle.take(tag, change, out),
            None => self.unplaced += 1,
        }
    }

    /// Adds the changes whose wait has ended before a time.
    pub fn release(&mut self, tags: &[TagMetric], until_ns: i64, out: &mut ToldChanges) {
        self.throttle.release(tags, until_ns, out);
    }
}
