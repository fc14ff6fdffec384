//! The metrics that a reader wants to see: names, in which `*` stands for any characters.
//! `cli::fleet` uses this module before it prints a change.

use super::news::FleetNews;
use rungd_net::sparkplug::{fits, vocabulary};

/// The patterns. Without a pattern, all metrics are wanted except `NO_NEWS`.
#[derive(Clone, Debug, Default)]
pub struct WatchedMetrics {
    patterns: Vec<String>,
    wants_first: bool,
}

/// The metrics that every heartbeat or every birth changes.
const NO_NEWS: [&str; 3] = [vocabulary::SCAN, vocabulary::BD_SEQ, vocabulary::REBIRTH];

impl WatchedMetrics {
    /// `asks_births`: the reader wants the contents of births, and so the first values too. A
    /// reader who names metrics also wants first values.
    pub fn new(patterns: Vec<String>, asks_births: bool) -> WatchedMetrics {
        let wants_first = asks_births || !patterns.is_empty();
        WatchedMetrics { patterns, wants_first }
    }

    /// Whether a change is wanted.
    pub fn wants(&self, news: &FleetNews) -> bool {
        match news {
            FleetNews::Value { name, first, .. } => (self.wants_first || !first) && self.has(name),
            FleetNews::Heard
            | FleetNews::Born { .. }
            | FleetNews::Died
            | FleetNews::Stale { .. } => true,
        }
    }

    /// Whether a metric is wanted.
    fn has(&self, name: &str) -> bool {
        match self.patterns.is_empty() {
            true => !NO_NEWS.contains(&name),
            false => self.patterns.iter().any(|pattern| fits(pattern, name)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_metric_but_the_heartbeat_is_watched_without_a_pattern() {
        let all = WatchedMetrics::default();
        assert!(all.has("jam") && all.has("rungd/mode") && !all.has("rungd/scan"));
        assert!(!all.has("bdSeq") && !all.has("Node Control/Rebirth"));
        assert!(WatchedMetrics::new(vec!["rungd/*".to_owned()], false).has("rungd/scan"));
    }

    #[test]
    fn first_values_are_shown_only_if_requested() {
        let first = |name: &str| FleetNews::Value {
            name: name.to_owned(),
            value: None,
            text: None,
            unit: None,
            historical: false,
            first: true,
            told_ms: None,
        };
        let jam = || vec!["jam".to_owned()];
        assert!(!WatchedMetrics::default().wants(&first("jam")));
        assert!(WatchedMetrics::new(Vec::new(), true).wants(&first("jam")));
        assert!(WatchedMetrics::new(jam(), false).wants(&first("jam")));
        assert!(!WatchedMetrics::new(jam(), true).wants(&first("other")));
    }
}
