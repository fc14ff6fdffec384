//! One edge node according to its messages: unborn, online, stale, offline.
//!
//! The rules are those of the specification, chapters 5.4 to 5.9 and 6.4. A birth begins a session
//! with the sequence number of its message. Each further message of the node and of its devices has
//! the next number. A death ends the session with the same `bdSeq`. After a gap, a birth may be
//! missing and aliases may have a different meaning: values by alias are not taken until the next
//! birth. [`super::view`] passes in the messages.

use super::limits::{FleetLimits, NodeRoom};
use super::metrics::{KnownMetric, MetricFault, MetricTable, told_by_name};
use super::news::FleetNews;
use rungd_net::sparkplug::{Metric, MetricContent, Payload, Sequence, vocabulary};

/// The state of a node's session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum NodeSession {
    /// Messages came, but no birth: the node's metrics are not known.
    Unborn,
    /// All messages since its birth came.
    Online,
    /// Its values may be old.
    Stale(StaleReason),
    /// It has died.
    Offline,
}

/// The reason why values may be old.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum StaleReason {
    /// Messages are missing: the expected number, and the received number.
    Gap { due: u64, came: Option<u64> },
    /// A message has a metric that the birth does not have.
    Unknown(Option<u64>),
    /// A message is no payload.
    Garbage,
    /// A message is larger than the limit.
    TooLarge,
    /// The link to the broker is down.
    LinkLost,
}

impl StaleReason {
    /// The reason, for people.
    pub fn text(&self) -> String {
        match self {
            StaleReason::Gap { due, came: Some(came) } => {
                format!("messages are missing: number {due} was due, {came} came")
            }
            StaleReason::Gap { due, came: None } => {
                format!("a message without a number came, {due} was due")
            }
            StaleReason::Unknown(Some(alias)) => format!("its birth has no alias {alias}"),
            StaleReason::Unknown(None) => "it sent a metric that is not in its birth".to_owned(),
            StaleReason::Garbage => "a message of the node cannot be read".to_owned(),
            StaleReason::TooLarge => "a message of the node is larger than the limit".to_owned(),
            StaleReason::LinkLost => "the link to the broker is down".to_owned(),
        }
    }
}

/// A node.
#[derive(Clone, Debug)]
pub(super) struct NodeView {
    pub standing: NodeSession,
    pub metrics: MetricTable,
    /// The time of its last message by this machine's clock, ms since 1970.
    pub heard_ms: u64,
    /// The time of its last birth by this machine's clock.
    pub born_ms: Option<u64>,
    /// The time of its last message by the node's clock, and by this machine's clock.
    pub told_ms: Option<(u64, u64)>,
    pub counts: NodeCounts,
    /// The time at which a birth was last requested.
    pub asked_ms: Option<u64>,
    bd_seq: Option<u64>,
    seq: Option<Sequence>,
}

/// Counts of a node's messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct NodeCounts {
    pub messages: u64,
    pub births: u64,
    pub gaps: u64,
    /// Deaths of earlier sessions.
    pub old_deaths: u64,
    /// Values of the past.
    pub historical: u64,
    /// Metrics beyond the limits.
    pub metrics_refused: u64,
    /// Values that are not of the birth's type, metrics without a name, and metrics that a birth
    /// has twice.
    pub values_refused: u64,
}

/// A metric of a message.
#[derive(Clone, Copy)]
struct TimedMetric<'m> {
    metric: &'m Metric,
    /// The time of its value by the node's clock.
    told_ms: Option<u64>,
}

/// The kind of a value.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ValueAge {
    /// The value has changed.
    Present,
    /// The value is from a birth, and no earlier value is known.
    First,
    /// The value is from the past.
    Past,
}

impl ValueAge {
    fn of_birth(is_first: bool) -> ValueAge {
        if is_first { ValueAge::First } else { ValueAge::Present }
    }
}

impl NodeView {
    pub fn new(now_ms: u64) -> NodeView {
        NodeView {
            standing: NodeSession::Unborn,
            metrics: MetricTable::default(),
            heard_ms: now_ms,
            born_ms: None,
            told_ms: None,
            counts: NodeCounts::default(),
            asked_ms: None,
            bd_seq: None,
            seq: None,
        }
    }

    /// Notes a message of any kind. `payload`: that of a message with the node's present time.
    pub fn hear(&mut self, payload: Option<&Payload>, now_ms: u64) {
        self.counts.messages += 1;
        self.heard_ms = now_ms;
        let told = payload.and_then(|payload| payload.timestamp);
        self.told_ms = told.map(|told| (told, now_ms)).or(self.told_ms);
    }

    /// NBIRTH: replaces all metrics. Also returns the values that have changed or were not known.
    pub fn born(&mut self, payload: &Payload, now_ms: u64, room: NodeRoom) -> Vec<FleetNews> {
        let before = std::mem::take(&mut self.metrics);
        self.counts.births += 1;
        self.born_ms = Some(now_ms);
        self.bd_seq = bd_seq(payload);
        self.seq = payload.seq.and_then(Sequence::of);
        self.standing = NodeSession::Online;
        let mut values = Vec::new();
        for metric in &payload.metrics {
            let count = self.metrics.len();
            if let Err(fault) = self.metrics.born(metric, room) {
                self.count(fault);
            }
            if self.metrics.len() == count {
                continue;
            }
            let known = self.metrics.at(count);
            let old = before.get(&known.name);
            if old.is_none_or(|old| old.value != known.value) {
                let told_ms = metric.timestamp.or(payload.timestamp);
                values.push(value_news(known, ValueAge::of_birth(old.is_none()), told_ms));
            }
        }
        let metrics = self.metrics.len();
        [FleetNews::Born { metrics }].into_iter().chain(values).collect()
    }

    /// NDATA.
    pub fn take_data(&mut self, payload: &Payload, room: NodeRoom) -> Vec<FleetNews> {
        let mut news: Vec<FleetNews> = self.follow(payload).into_iter().collect();
        for metric in &payload.metrics {
            // A metric may make the node stale; the metrics after it then need names.
            let fits = self.standing == NodeSession::Online || metric.name.is_some();
            let told_ms = metric.timestamp.or(payload.timestamp);
            news.extend(fits.then(|| self.metric(TimedMetric { metric, told_ms }, room)).flatten());
        }
        news
    }

    /// Takes a message of a device: only its sequence number counts.
    pub fn device_told(&mut self, payload: &Payload) -> Vec<FleetNews> {
        self.follow(payload).into_iter().collect()
    }

    /// NDEATH of this session, or of an older one.
    pub fn died(&mut self, payload: &Payload) -> Vec<FleetNews> {
        let is_born = self.born_ms.is_some();
        let number = bd_seq(payload);
        if is_born && number != self.bd_seq && !self.is_of_missed_session(number) {
            self.counts.old_deaths += 1;
            return Vec::new();
        }
        self.seq = None;
        let was = std::mem::replace(&mut self.standing, NodeSession::Offline);
        let is_new = was != NodeSession::Offline;
        is_new.then_some(FleetNews::Died).into_iter().collect()
    }

    /// Whether a death is that of a later session than the one whose birth is known. Messages are
    /// missing, and the birth of that session may be among them. Numbers rise by one, and start
    /// again after 255.
    fn is_of_missed_session(&self, number: Option<u64>) -> bool {
        let ahead = number.zip(self.bd_seq).map(|(theirs, ours)| theirs.wrapping_sub(ours) % 256);
        let is_doubted = matches!(self.standing, NodeSession::Stale(_));
        is_doubted && ahead.is_some_and(|ahead| (1..128).contains(&ahead))
    }

    /// Notes that the values may be old from now on.
    pub fn doubt(&mut self, why: StaleReason) -> Vec<FleetNews> {
        match self.standing {
            NodeSession::Unborn | NodeSession::Offline | NodeSession::Stale(_) => Vec::new(),
            NodeSession::Online => {
                let news = FleetNews::Stale { why: why.text() };
                self.standing = NodeSession::Stale(why);
                vec![news]
            }
        }
    }

    /// Checks the sequence number of a message of this session.
    fn follow(&mut self, payload: &Payload) -> Option<FleetNews> {
        if self.standing == NodeSession::Offline {
            // The node is alive, but its birth was missed.
            self.standing = NodeSession::Unborn;
            return Some(FleetNews::Heard);
        }
        let came = payload.seq.and_then(Sequence::of);
        let due = self.seq.map(Sequence::next);
        self.seq = came.or(self.seq);
        if self.standing != NodeSession::Online || (came.is_some() && came == due) {
            return None;
        }
        self.counts.gaps += 1;
        let due = due.map_or(0, Sequence::number);
        self.doubt(StaleReason::Gap { due, came: payload.seq }).pop()
    }

    /// Takes a metric of data, with the time of its value.
    fn metric(&mut self, timed: TimedMetric, room: NodeRoom) -> Option<FleetNews> {
        let TimedMetric { metric, told_ms } = timed;
        let at = match self.metrics.find(metric) {
            Ok(at) => at,
            Err(fault) => return self.unknown(timed, fault, room),
        };
        if metric.is_historical == Some(true) {
            return self.past(at, timed);
        }
        match self.metrics.take(at, metric, room) {
            Ok(is_new) => {
                is_new.then(|| value_news(self.metrics.at(at), ValueAge::Present, told_ms))
            }
            Err(fault) => {
                self.count(fault);
                None
            }
        }
    }

    /// Takes a value of the past: it is reported and counted, but does not become the present
    /// value.
    fn past(&mut self, at: usize, timed: TimedMetric) -> Option<FleetNews> {
        let TimedMetric { metric, told_ms } = timed;
        self.counts.historical += 1;
        let mut then = MetricTable::default();
        let known = self.metrics.at(at);
        let datatype = metric.datatype.or(known.number());
        let named = Metric { name: Some(known.name.clone()), datatype, ..metric.clone() };
        let limits = FleetLimits::default();
        let taken = then.born(&named, NodeRoom { limits: &limits, bytes: limits.bytes_max });
        let (unit, texts) = (known.unit.clone(), known.texts.clone());
        if let Err(fault) = taken {
            self.count(fault);
            return None;
        }
        let mut told = then.at(0).clone();
        (told.unit, told.texts) = (unit, texts);
        Some(value_news(&told, ValueAge::Past, told_ms))
    }

    /// Takes a metric that the birth does not have.
    fn unknown(
        &mut self,
        TimedMetric { metric, told_ms }: TimedMetric,
        fault: MetricFault,
        room: NodeRoom,
    ) -> Option<FleetNews> {
        let MetricFault::Unknown(alias) = fault else {
            self.count(fault);
            return None;
        };
        if self.standing == NodeSession::Online {
            return self.doubt(StaleReason::Unknown(alias)).pop();
        }
        // Without a birth, a metric with a name is taken.
        let told = told_by_name(metric).filter(|_| metric.is_historical != Some(true))?;
        match self.metrics.born(&told, room) {
            Ok(()) => {
                let known = self.metrics.at(self.metrics.len() - 1);
                Some(value_news(known, ValueAge::Present, told_ms))
            }
            Err(fault) => {
                self.count(fault);
                None
            }
        }
    }

    fn count(&mut self, fault: MetricFault) {
        match fault {
            MetricFault::Limit => self.counts.metrics_refused += 1,
            MetricFault::Unknown(_)
            | MetricFault::Nameless
            | MetricFault::Twice
            | MetricFault::Value => self.counts.values_refused += 1,
        }
    }
}

fn value_news(metric: &KnownMetric, kind: ValueAge, told_ms: Option<u64>) -> FleetNews {
    let (name, value, unit) = (metric.name.clone(), metric.value.clone(), metric.unit.clone());
    let (historical, first) = (kind == ValueAge::Past, kind == ValueAge::First);
    let text = metric.text().map(str::to_owned);
    FleetNews::Value { name, value, text, unit, historical, first, told_ms }
}

/// The session number in a birth or a death.
fn bd_seq(payload: &Payload) -> Option<u64> {
    let is_birth_number = |metric: &&Metric| metric.name.as_deref() == Some(vocabulary::BD_SEQ);
    match payload.metrics.iter().find(is_birth_number)?.content.as_ref()? {
        MetricContent::Int(number) | MetricContent::Long(number) => Some(*number),
        MetricContent::Float(_)
        | MetricContent::Double(_)
        | MetricContent::Boolean(_)
        | MetricContent::Text(_)
        | MetricContent::Bytes(_) => None,
    }
}
