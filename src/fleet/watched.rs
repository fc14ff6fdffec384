//! Which metrics a reader wants to see: names, in which `*` stands for any characters.

use crate::sparkplug::{fits, vocabulary};

/// Patterns; none of them: all but what every heartbeat changes.
#[derive(Clone, Debug, Default)]
pub(crate) struct WatchedMetrics {
    patterns: Vec<String>,
}

impl WatchedMetrics {
    pub fn new(patterns: Vec<String>) -> WatchedMetrics {
        WatchedMetrics { patterns }
    }

    /// Whether a metric is wanted.
    pub fn has(&self, name: &str) -> bool {
        match self.patterns.is_empty() {
            true => name != vocabulary::SCAN,
            false => self.patterns.iter().any(|pattern| fits(pattern, name)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_pattern_all_but_the_heartbeat() {
        let all = WatchedMetrics::default();
        assert!(all.has("jam") && all.has("rungd/mode") && !all.has("rungd/scan"));
        assert!(WatchedMetrics::new(vec!["rungd/*".to_owned()]).has("rungd/scan"));
    }
}
