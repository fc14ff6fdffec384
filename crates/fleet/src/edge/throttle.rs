//! How often a tag is published: its deadband, and at most one value in a given time.
//!
//! The result depends only on the times of scans, so that the same part of the log always gives the
//! same values. A value that has to wait is published at the end of its wait, with that time.

use super::tags::{TagMetric, number, value};
use rungd_client::live::LoggedChange;

/// The publishing state of a tag.
#[derive(Clone, Copy, Debug, Default)]
struct TagPublication {
    /// The last published content and its time, ns since 1970 (UTC).
    last: Option<(i32, i64)>,
    /// A change that waits.
    waits: Option<LoggedChange>,
}

/// The publishing state of all tags.
#[derive(Clone, Debug, Default)]
pub(super) struct Throttle {
    tags: Vec<TagPublication>,
    /// Whether a change waits.
    any_waits: bool,
}

impl Throttle {
    /// The state for this number of tags before their first values.
    pub fn new(tags: usize) -> Throttle {
        Throttle { tags: vec![TagPublication::default(); tags], any_waits: false }
    }

    /// Notes that a birth published all tags.
    pub fn born(&mut self, values: &[i32], unix_ns: i64) {
        for (tag, value) in self.tags.iter_mut().zip(values) {
            *tag = TagPublication { last: Some((*value, unix_ns)), waits: None };
        }
        self.any_waits = false;
    }

    /// Takes a change of the tag with this number; adds the changes to be published to `out`.
    pub fn take(
        &mut self,
        at: usize,
        metric: &TagMetric,
        change: LoggedChange,
        out: &mut DueChanges,
    ) {
        let Some(tag) = self.tags.get_mut(at) else { return };
        let every_ns = i64::try_from(metric.rule.every.as_nanos()).unwrap_or(i64::MAX);
        if every_ns == 0 && metric.rule.deadband == 0.0 {
            tag.last = Some((change.value, change.unix_ns));
            out.push((at, change));
            return;
        }
        tag.release(at, metric, change.unix_ns, out);
        match tag.last {
            Some((_, at_ns)) if change.unix_ns < at_ns.saturating_add(every_ns) => {
                tag.waits = Some(change);
                self.any_waits = true;
            }
            Some((known, _)) if !differs(metric, known, change.value) => {}
            Some(_) | None => {
                tag.last = Some((change.value, change.unix_ns));
                out.push((at, change));
            }
        }
    }

    /// Adds the changes whose wait has ended before a time.
    pub fn release(&mut self, tags: &[TagMetric], until_ns: i64, out: &mut DueChanges) {
        if !self.any_waits {
            return;
        }
        for (at, (tag, metric)) in self.tags.iter_mut().zip(tags).enumerate() {
            tag.release(at, metric, until_ns, out);
        }
        self.any_waits = self.tags.iter().any(|tag| tag.waits.is_some());
    }
}

/// The changes to be published, each with the number of its tag.
pub(super) type DueChanges = Vec<(usize, LoggedChange)>;

impl TagPublication {
    fn release(&mut self, at: usize, metric: &TagMetric, until_ns: i64, out: &mut DueChanges) {
        let every_ns = i64::try_from(metric.rule.every.as_nanos()).unwrap_or(i64::MAX);
        let Some((waits, (known, last_ns))) = self.waits.zip(self.last) else { return };
        let unix_ns = last_ns.saturating_add(every_ns);
        if unix_ns > until_ns {
            return;
        }
        self.waits = None;
        if differs(metric, known, waits.value) {
            self.last = Some((waits.value, unix_ns));
            out.push((at, LoggedChange { unix_ns, ..waits }));
        }
    }
}

/// Whether a content differs from the known one by at least the deadband.
fn differs(metric: &TagMetric, known: i32, now: i32) -> bool {
    let number = |content| number(&value(metric.metric.datatype, content)?);
    match number(known).zip(number(now)) {
        Some((known, now)) => known != now && (known - now).abs() >= metric.rule.deadband,
        None => known != now,
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::super::settings::PublishRule;
    use super::*;
    use rungd_net::sparkplug::{BornMetric, DataType, MetricProperties};

    fn tag(deadband: f64, every_ms: u64) -> TagMetric {
        let (name, alias, datatype) = ("level".to_owned(), Some(1), DataType::Int32);
        let metric = BornMetric { name, alias, datatype, properties: MetricProperties::default() };
        let every = Duration::from_millis(every_ms);
        let rule = PublishRule { tags: Vec::new(), deadband, every };
        TagMetric { metric, rule, may_write: false }
    }

    /// The values that are published for these changes (ms, value) up to a time.
    fn told(metric: &TagMetric, changes: &[(i64, i32)], until_ms: i64) -> Vec<(i64, i32)> {
        let (mut throttle, mut out) = (Throttle::new(1), Vec::new());
        for (ms, value) in changes {
            let unix_ns = ms * 1_000_000;
            let change = LoggedChange { cell: 0, value: *value, scan: 0, unix_ns };
            throttle.take(0, metric, change, &mut out);
        }
        throttle.release(std::slice::from_ref(metric), until_ms * 1_000_000, &mut out);
        out.iter().map(|(_, change)| (change.unix_ns / 1_000_000, change.value)).collect()
    }

    #[test]
    fn every_change_is_published_without_a_rule() {
        let changes = [(0, 1), (1, 2), (2, 3)];
        assert_eq!(told(&tag(0.0, 0), &changes, 10), changes);
    }

    #[test]
    fn a_deadband_counts_from_the_last_published_value() {
        let changes = [(0, 10), (1, 12), (2, 14), (3, 15), (4, 11), (5, 10)];
        assert_eq!(told(&tag(5.0, 0), &changes, 10), [(0, 10), (3, 15), (5, 10)]);
    }

    #[test]
    fn the_last_of_many_changes_is_published() {
        let changes = [(0, 1), (10, 2), (20, 3), (150, 4), (400, 5)];
        let expected = [(0, 1), (100, 3), (200, 4), (400, 5)];
        assert_eq!(told(&tag(0.0, 100), &changes, 1000), expected);
        // A value that returns to the published one within the time is not published.
        assert_eq!(told(&tag(0.0, 100), &[(0, 1), (10, 2), (20, 1)], 1000), [(0, 1)]);
        assert_eq!(told(&tag(0.0, 100), &[(0, 1), (10, 2)], 99), [(0, 1)]);
    }
}
