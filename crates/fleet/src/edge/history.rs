//! The past that is being published: the waiting parts, and the present numbers of its tags.

use std::collections::{HashMap, VecDeque};

use super::tags::TagMetric;
use super::throttle::{DueChanges, Throttle};
use rungd_client::live::{HistorySpan, LogPosition, LoggedChange};
use rungd_net::sparkplug::DataType;

/// The parts of the past that are still to be published; the first part is under way.
#[derive(Debug, Default)]
pub(super) struct HistoryPublication {
    spans: VecDeque<HistorySpan>,
    /// The log position up to which the first part is published.
    at: Option<LogPosition>,
    /// The tags of the past program.
    names: Vec<(String, DataType)>,
    /// The present number of each tag of the past program; `None`: the tag does not exist any more.
    places: Vec<Option<usize>>,
    throttle: Throttle,
    /// The number of values of tags that the present program does not have.
    unplaced: u64,
}

impl HistoryPublication {
    /// Whether a part is still to be published.
    pub fn is_under_way(&self) -> bool {
        !self.spans.is_empty()
    }

    /// The log position up to which everything is published; `None`: no part is under way.
    pub fn position(&self) -> Option<LogPosition> {
        self.spans.front().map(|span| self.at.unwrap_or(span.from))
    }

    /// Forgets all parts.
    pub fn clear(&mut self) {
        *self = HistoryPublication::default();
    }

    /// Adds a part of the past; returns it if it is to be read now.
    pub fn add(&mut self, span: HistorySpan) -> Option<HistorySpan> {
        self.spans.push_back(span);
        (self.spans.len() == 1).then_some(span)
    }

    /// Removes the first part, which is published. Returns the next part, and the number of values
    /// whose tags do not exist any more.
    pub fn done(&mut self) -> (Option<HistorySpan>, u64) {
        self.spans.pop_front();
        self.at = None;
        (self.spans.front().copied(), std::mem::take(&mut self.unplaced))
    }

    /// Notes that everything is published up to a log position.
    pub fn mark_published(&mut self, at: LogPosition) {
        self.at = Some(at);
    }

    /// Takes `past`, the tags of the program that ran next in the past; `tags`: those of the
    /// present program.
    pub fn begins(&mut self, past: &[TagMetric], tags: &[TagMetric]) {
        self.names =
            past.iter().map(|tag| (tag.metric.name.clone(), tag.metric.datatype)).collect();
        self.place(tags);
        if self.at.is_none() {
            self.throttle = Throttle::new(tags.len());
        }
    }

    /// Takes the tags of a new present program.
    pub fn replaced(&mut self, tags: &[TagMetric]) {
        self.place(tags);
        self.throttle = Throttle::new(tags.len());
    }

    fn place(&mut self, tags: &[TagMetric]) {
        let now = tags.iter().enumerate();
        let now = now.map(|(at, tag)| ((tag.metric.name.as_str(), tag.metric.datatype), at));
        let now: HashMap<(&str, DataType), usize> = now.collect();
        let place =
            |(name, datatype): &(String, DataType)| now.get(&(name.as_str(), *datatype)).copied();
        self.places = self.names.iter().map(place).collect();
    }

    /// Takes a change of the past; adds the changes to be published to `out`.
    pub fn take(&mut self, change: LoggedChange, tags: &[TagMetric], out: &mut DueChanges) {
        let place = self.places.get(change.cell as usize).copied().flatten();
        match place.and_then(|at| Some((at, tags.get(at)?))) {
            Some((at, tag)) => self.throttle.take(at, tag, change, out),
            None => self.unplaced += 1,
        }
    }

    /// Adds the changes whose wait has ended before a time.
    pub fn release(&mut self, tags: &[TagMetric], until_ns: i64, out: &mut DueChanges) {
        self.throttle.release(tags, until_ns, out);
    }
}
