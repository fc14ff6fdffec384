//! The limits of what is kept of a broker's messages, and the counts of what is left out.

use serde::Serialize;

/// The limits of a view. Anything beyond them is counted, but not kept.
#[derive(Clone, Copy, Debug)]
pub struct FleetLimits {
    /// Nodes.
    pub nodes_max: usize,
    /// Metrics of a node.
    pub metrics_max: usize,
    /// Bytes of a metric's name, and of its unit.
    pub name_bytes_max: usize,
    /// Bytes of a text value, and of the texts that say what a metric's values mean.
    pub text_bytes_max: usize,
    /// Bytes of all names and values.
    pub bytes_max: usize,
    /// Bytes of a message.
    pub payload_bytes_max: usize,
}

/// The room of a node.
#[derive(Clone, Copy)]
pub(super) struct NodeRoom<'l> {
    /// The limits of the view.
    pub limits: &'l FleetLimits,
    /// The bytes that the node may take in total.
    pub bytes: usize,
}

impl Default for FleetLimits {
    fn default() -> FleetLimits {
        FleetLimits {
            nodes_max: 5_000,
            metrics_max: 20_000,
            name_bytes_max: 512,
            text_bytes_max: 256 << 10,
            bytes_max: 256 << 20,
            payload_bytes_max: 4 << 20,
        }
    }
}

/// The counts of messages, and of messages that are not kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FleetCounts {
    /// Messages in all.
    pub messages: u64,
    /// Messages on topics that do not belong to Sparkplug B 3.0.
    pub foreign_topics: u64,
    /// Messages that the broker retained: they do not show the present.
    pub kept_by_broker: u64,
    /// Messages larger than the limit.
    pub too_large: u64,
    /// Messages that are no payload of Sparkplug, or have more metrics than are read.
    pub garbage: u64,
    /// Messages of nodes beyond the limit.
    pub nodes_refused: u64,
    /// States of hosts beyond the limit.
    pub hosts_refused: u64,
    /// Commands to nodes from other hosts.
    pub commands: u64,
}

impl FleetCounts {
    /// The left-out messages, for people; empty if there are none.
    pub fn left_out(&self) -> Vec<String> {
        let told = self.rows().into_iter().filter(|(count, _)| *count > 0);
        told.map(|(count, what)| format!("{count} {} {what}", messages(count))).collect()
    }

    /// The kinds of messages that were left out for the first time since `before`.
    pub fn begun(&self, before: &FleetCounts) -> Vec<&'static str> {
        let rows = self.rows().into_iter().zip(before.rows());
        let begun = rows.filter(|((now, _), (before, _))| *now > 0 && *before == 0);
        begun.map(|((_, what), _)| what).collect()
    }

    fn rows(&self) -> [(u64, &'static str); 6] {
        [
            (self.foreign_topics, "on topics that do not belong to Sparkplug B 3.0"),
            (self.kept_by_broker, "retained by the broker: not current"),
            (self.too_large, "larger than 4 MiB"),
            (self.garbage, "without a payload of Sparkplug (of at most 50,000 metrics)"),
            (self.nodes_refused, "of nodes beyond the first 5,000: choose some by `--group`"),
            (self.hosts_refused, "of hosts beyond the first 100"),
        ]
    }
}

/// The maximum number of bytes of a text in an answer. One node must not fill the answer for all
/// nodes: a control character takes six bytes of JSON.
const SHOWN_BYTES_MAX: usize = 512;

/// A text for an answer; a long text is cut to its beginning.
pub(super) fn cut(text: &str) -> String {
    if text.len() <= SHOWN_BYTES_MAX {
        return text.to_owned();
    }
    let end = (0..=SHOWN_BYTES_MAX).rev().find(|at| text.is_char_boundary(*at));
    format!("{}…", &text[..end.unwrap_or(0)])
}

fn messages(count: u64) -> &'static str {
    if count == 1 { "message" } else { "messages" }
}

#[cfg(test)]
mod tests {
    use super::super::view::HOSTS_MAX;
    use super::*;
    use rungd_language::source::wording::thousands;

    #[test]
    fn the_texts_of_the_counts_name_the_limits() {
        let limits = FleetLimits::default();
        let texts = FleetCounts::default().rows().map(|(_, text)| text);
        let says = |what: String| assert!(texts.iter().any(|text| text.contains(&what)), "{what}");
        says(format!("than {} MiB", limits.payload_bytes_max >> 20));
        says(format!("nodes beyond the first {}:", thousands(limits.nodes_max as u64)));
        says(format!("hosts beyond the first {HOSTS_MAX}"));
    }
}
