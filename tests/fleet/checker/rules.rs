//! The rules' common form: a function reads a story and returns its complaints.

use rungd_net::sparkplug::{MessageKind, Metric, MetricContent, vocabulary};

use super::story::{Connection, Published, Story};

/// The faults, a sentence each.
pub type Complaints = Vec<String>;

/// The identifiers of statements, and the function that judges a story by them.
pub type Rule = (&'static [&'static str], fn(&Story) -> Complaints);

/// A complaint for each message that does not fit.
pub fn each<'s>(
    messages: impl IntoIterator<Item = &'s Published>,
    wrong: &str,
    fits: impl Fn(&Published) -> bool,
) -> Complaints {
    let bad = messages.into_iter().filter(|message| !fits(message));
    bad.map(|message| format!("{}: {wrong}", message.topic)).collect()
}

/// A complaint if the story has nothing to judge: a rule that sees nothing proves nothing.
pub fn some<T>(things: &[T], what: &str) -> Complaints {
    if things.is_empty() { vec![format!("the story has no {what}")] } else { Vec::new() }
}

/// A complaint unless `fits`.
pub fn unless(fits: bool, wrong: &str) -> Complaints {
    if fits { Vec::new() } else { vec![wrong.to_owned()] }
}

/// A metric of a message by its name.
pub fn metric<'m>(metrics: &'m [Metric], name: &str) -> Option<&'m Metric> {
    metrics.iter().find(|metric| metric.name.as_deref() == Some(name))
}

/// The `bdSeq` of a message.
pub fn bd_seq(message: &Published) -> Option<u64> {
    match metric(&message.read().metrics, vocabulary::BD_SEQ)?.content {
        Some(MetricContent::Long(number)) => Some(number),
        _ => None,
    }
}

/// The births of a connection.
pub fn births(connection: &Connection) -> impl Iterator<Item = &Published> {
    connection.sent().filter(|sent| sent.kind() == Some(MessageKind::NodeBirth))
}

/// Whether a time is within a minute of the time at which a message arrived.
pub fn is_about(time_ms: u64, came_ms: u64) -> bool {
    time_ms.abs_diff(came_ms) < 60_000
}
