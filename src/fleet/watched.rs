//! Which metrics a reader wants to see: names, in which `*` stands for any characters.

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
            true => name != crate::sparkplug::vocabulary::SCAN,
            false => self.patterns.iter().any(|pattern| fits(pattern, name)),
        }
    }
}

/// Whether a name fits a pattern. Each `*` takes as little as possible, which is enough: what
/// stands between two of them is found at its first place.
fn fits(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = name.strip_prefix(first) else { return false };
    let mut parts: Vec<&str> = parts.collect();
    let Some(last) = parts.pop() else { return rest.is_empty() };
    for part in parts {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns() {
        for (pattern, name) in [
            ("*", ""),
            ("jam", "jam"),
            ("rungd/*", "rungd/mode"),
            ("*.Acc", "a.Acc"),
            ("a*b*c", "axbbxc"),
        ] {
            assert!(fits(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [("jam", "jams"), ("", "x"), ("*.Acc", "a.Acc2"), ("a*a", "a")] {
            assert!(!fits(pattern, name), "{pattern} {name}");
        }
    }

    #[test]
    fn without_a_pattern_all_but_the_heartbeat() {
        let all = WatchedMetrics::default();
        assert!(all.has("jam") && all.has("rungd/mode") && !all.has("rungd/scan"));
        assert!(WatchedMetrics::new(vec!["rungd/*".to_owned()]).has("rungd/scan"));
    }
}
