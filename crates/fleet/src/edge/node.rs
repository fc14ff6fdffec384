//! The edge node as a state machine without I/O, clock and threads: what it publishes, and when.
//!
//! `shell` passes in each event with its time, and carries out the actions that the node returns
//! ([`NodeAction`]). Present values are published as they arrive. Past values are published in
//! between, with a flag. Each of these two streams is in the order of scans.

use std::collections::VecDeque;

use super::commands::{CommandPace, CommandRequest, asked};
use super::facts::{ALIASES, FactTable, NodeFact};
use super::history::HistoryPublication;
use super::journal::LineSubject;
use super::primary::{HostNews, PrimaryHost};
use super::settings::EdgeSettings;
use super::tags::{self, TagMetric};
use super::throttle::{DueChanges, Throttle};
use rungd_base::calendar::Utc;
use rungd_client::live::{HistorySpan, LogEvent, LogGap, LogPosition, LoggedProgram};
use rungd_client::operator::protocol::GivenValue;
use rungd_net::sparkplug::{BornMetric, DataType, MetricProperties};
use rungd_net::sparkplug::{
    HostState, MessageKind, Metric, MetricValue, Payload, Sequence, Topic, metric_of, vocabulary,
};

/// The time between two heartbeats, which publish the last scan even if nothing has changed.
const HEARTBEAT_MS: u64 = 10_000;

/// The minimum time between two births that hosts request.
const REBIRTH_MS: u64 = 1000;

/// The maximum number of metrics in a data message.
const METRICS_MAX: usize = 1000;

/// An action for `shell`.
#[derive(Clone, Debug, PartialEq)]
pub enum NodeAction {
    /// Publish this payload on this topic, unretained, with QoS 0.
    Publish(String, Vec<u8>),
    /// Read this part of the past.
    Replay(HistorySpan),
    /// Write a tag.
    Write(String, GivenValue),
    /// Publish a death and leave the broker, for this reason.
    Leave(String),
    /// A line for the journal.
    Say(String),
    /// A line for the journal that a stranger can cause.
    SayLimited(LineSubject, String),
}

/// The state of the node towards its host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NodeState {
    /// No broker is connected.
    Away,
    /// The node waits for its primary host.
    Waits,
    /// A birth was published.
    Born,
}

/// The edge node.
pub struct EdgeNode {
    settings: EdgeSettings,
    state: NodeState,
    birth: Sequence,
    seq: Sequence,
    tags: Vec<TagMetric>,
    values: Vec<i32>,
    throttle: Throttle,
    facts: FactTable,
    /// The last scan whose changes were received from the controller.
    live_at: Option<LogPosition>,
    /// The log position up to which a broker has everything.
    confirmed: Option<LogPosition>,
    history: HistoryPublication,
    /// Whether the past is to be published as soon as the present is known.
    owes_history: bool,
    lost: u64,
    host: PrimaryHost,
    wants_rebirth: bool,
    /// The time at which a host's request for a birth was last answered.
    reborn_ms: Option<u64>,
    /// The first birth for a host: its time, and the log position from which the past followed.
    began: (u64, Option<LogPosition>),
    beat_ms: u64,
    pace: CommandPace,
    out: VecDeque<NodeAction>,
}

impl EdgeNode {
    /// A node with the number of its last birth and the confirmed log position.
    pub fn new(settings: EdgeSettings, birth: Sequence, confirmed: Option<LogPosition>) -> Self {
        let mut facts = FactTable::default();
        for name in [vocabulary::CONTROLLER, vocabulary::HISTORY_REPLAYING, vocabulary::REBIRTH] {
            facts.set(name, MetricValue::Bool(false));
        }
        facts.set(vocabulary::HISTORY_LOST, MetricValue::Signed(0));
        EdgeNode {
            settings,
            state: NodeState::Away,
            birth,
            seq: Sequence::default(),
            tags: Vec::new(),
            values: Vec::new(),
            throttle: Throttle::default(),
            facts,
            live_at: None,
            confirmed,
            history: HistoryPublication::default(),
            owes_history: false,
            lost: 0,
            host: PrimaryHost::default(),
            wants_rebirth: false,
            reborn_ms: None,
            began: (0, None),
            beat_ms: 0,
            pace: CommandPace::new(),
            out: VecDeque::new(),
        }
    }

    /// The next action.
    pub fn take_out(&mut self) -> Option<NodeAction> {
        self.out.pop_front()
    }

    /// Increments and returns the number of the birth, for the will of a new connection.
    pub fn next_birth(&mut self) -> Sequence {
        self.birth = self.birth.next();
        self.birth
    }

    /// The topic and payload of the death: the will of a connection, and its last message.
    pub fn death(&self, now_ms: u64) -> (String, Vec<u8>) {
        let metrics = vec![self.birth_number(now_ms)];
        let payload = Payload { timestamp: Some(now_ms), metrics, seq: None };
        (self.topic(MessageKind::NodeDeath), payload.bytes())
    }

    /// The topic filters that the node subscribes to.
    pub fn filters(&self) -> Vec<String> {
        let host = self.settings.primary_host.clone();
        let state = host.map(|host| Topic::HostState { host }.to_string());
        [self.topic(MessageKind::NodeCommand)].into_iter().chain(state).collect()
    }

    /// The primary host, while the node waits for it.
    pub fn awaited(&self) -> Option<&str> {
        self.settings.primary_host.as_deref().filter(|_| self.state == NodeState::Waits)
    }

    /// The log position up to which everything is published after the actions so far.
    pub fn published(&self) -> Option<LogPosition> {
        if self.state != NodeState::Born || self.owes_history {
            return None;
        }
        self.history.position().or(self.live_at)
    }

    /// Notes that a broker has everything up to a log position.
    pub fn confirm(&mut self, at: LogPosition) {
        self.confirmed = Some(at);
    }

    /// Notes that a broker is connected and has the node's subscriptions.
    pub fn connected(&mut self, now_ms: u64) {
        self.host.forget();
        match self.settings.primary_host {
            Some(_) => self.state = NodeState::Waits,
            None => self.begin(now_ms),
        }
    }

    /// Notes that the broker is gone. Nothing is published, and waiting actions are dropped.
    pub fn disconnected(&mut self) {
        (self.state, self.wants_rebirth, self.owes_history) = (NodeState::Away, false, false);
        self.history.clear();
        self.out.clear();
    }

    /// Publishes the first birth for a host, and then what the host may have missed.
    fn begin(&mut self, now_ms: u64) {
        self.state = NodeState::Born;
        self.began = (now_ms, None);
        self.tell_all(now_ms);
    }

    /// Publishes the present as a birth, and then the past.
    fn tell_all(&mut self, now_ms: u64) {
        self.history.clear();
        self.owes_history = true;
        self.owe();
        self.bear(now_ms);
    }

    /// Requests the past, if it is still due and the present is known.
    fn owe(&mut self) {
        let (Some(until), true) = (self.live_at, self.owes_history) else { return };
        self.owes_history = false;
        let from = self.confirmed.unwrap_or(until);
        self.began.1.get_or_insert(from);
        if (from.process_start_ns, from.scan) != (until.process_start_ns, until.scan) {
            self.replay(HistorySpan { from, margin_ns: self.settings.margin_ns(), until });
        }
    }

    fn replay(&mut self, span: HistorySpan) {
        let next = self.history.add(span);
        self.out.extend(next.map(NodeAction::Replay));
        self.facts.set(vocabulary::HISTORY_REPLAYING, MetricValue::Bool(true));
    }

    /// Publishes a birth: all metrics with their values.
    fn bear(&mut self, now_ms: u64) {
        (self.seq, self.wants_rebirth) = (Sequence::default(), false);
        self.beat_ms = now_ms;
        let at = self.live_at.unwrap_or_default();
        let at_ms = ms(at.unix_ns);
        let mut metrics = vec![self.birth_number(now_ms)];
        metrics.extend(self.facts.born(now_ms));
        metrics.extend(self.tags.iter().zip(&self.values).map(|(tag, content)| {
            let value = tags::value(tag.metric.datatype, *content);
            tag.metric.born(value.as_ref(), at_ms)
        }));
        self.throttle.born(&self.values, at.unix_ns);
        let payload = Payload { timestamp: Some(now_ms), metrics, seq: Some(self.seq.number()) };
        let topic = self.topic(MessageKind::NodeBirth);
        self.out.push_back(NodeAction::Publish(topic, payload.bytes()));
    }

    fn birth_number(&self, now_ms: u64) -> Metric {
        let born = BornMetric {
            name: vocabulary::BD_SEQ.to_owned(),
            alias: None,
            datatype: DataType::Int64,
            properties: MetricProperties::default(),
        };
        born.born(Some(&MetricValue::Signed(self.birth.number() as i64)), now_ms)
    }

    fn topic(&self, kind: MessageKind) -> String {
        let (group, node) = (self.settings.group.clone(), self.settings.name.clone());
        Topic::Node { group, kind, node, device: None }.to_string()
    }

    /// Publishes data, in messages of a bounded size.
    fn data(&mut self, mut metrics: Vec<Metric>, now_ms: u64) {
        while !metrics.is_empty() && self.state == NodeState::Born {
            let rest = metrics.split_off(metrics.len().min(METRICS_MAX));
            self.seq = self.seq.next();
            let (timestamp, seq) = (Some(now_ms), Some(self.seq.number()));
            let payload = Payload { timestamp, metrics, seq };
            let topic = self.topic(MessageKind::NodeData);
            self.out.push_back(NodeAction::Publish(topic, payload.bytes()));
            metrics = rest;
        }
    }

    /// Publishes changes as data, in the order of their times.
    fn publish_changes(&mut self, mut told: DueChanges, is_historical: bool, now_ms: u64) {
        told.sort_by_key(|(_, change)| change.unix_ns);
        let metric = |(at, change): &(usize, rungd_client::live::LoggedChange)| {
            let tag = self.tags.get(*at)?;
            let value = tags::value(tag.metric.datatype, change.value);
            let data = metric_of(tag.metric.datatype, value.as_ref(), ms(change.unix_ns));
            let is_historical = is_historical.then_some(true);
            Some(Metric { alias: tag.metric.alias, is_historical, ..data })
        };
        let metrics = told.iter().filter_map(metric).collect();
        self.data(metrics, now_ms);
    }

    fn tell_facts(&mut self, now_ms: u64, all_scans: bool) {
        if self.state == NodeState::Born {
            let news = self.facts.news(now_ms, all_scans);
            self.data(news, now_ms);
        }
    }

    /// Takes the events of the controller up to a scan.
    pub fn live(&mut self, events: Vec<LogEvent>, at: LogPosition, now_ms: u64) {
        let mut told = DueChanges::new();
        for event in events {
            match event {
                LogEvent::Begins { program, values, at } => {
                    self.publish_changes(std::mem::take(&mut told), false, now_ms);
                    self.run_on(&program, values, at);
                    if self.state == NodeState::Born {
                        self.bear(now_ms);
                    }
                }
                LogEvent::Changed(change) => {
                    let number = change.cell as usize;
                    let tag = self.tags.get(number).zip(self.values.get_mut(number));
                    let Some((tag, value)) = tag else { continue };
                    *value = change.value;
                    if self.state == NodeState::Born {
                        self.throttle.take(number, tag, change, &mut told);
                    }
                }
                LogEvent::Jumped { from, to } => {
                    if self.state == NodeState::Born && !self.owes_history {
                        self.replay(HistorySpan { from, margin_ns: 0, until: to });
                    }
                }
                LogEvent::Missing(gap) => self.missing(&gap),
            }
        }
        self.throttle.release(&self.tags, at.unix_ns, &mut told);
        self.live_at = Some(at);
        // At the very first start, no host waits for the past before this scan.
        self.confirmed.get_or_insert(at);
        let scan = i64::try_from(at.scan).unwrap_or(i64::MAX);
        self.facts.set(vocabulary::SCAN, MetricValue::Signed(scan));
        self.publish_changes(told, false, now_ms);
        if self.state == NodeState::Born {
            self.owe();
        }
        self.tell_facts(now_ms, false);
    }

    /// Takes the tags and values of the program that the controller now runs.
    fn run_on(&mut self, program: &LoggedProgram, values: Vec<i32>, at: LogPosition) {
        self.tags = tags::metrics(&self.settings, program, ALIASES);
        self.values = values;
        self.throttle = Throttle::new(self.tags.len());
        self.history.replaced(&self.tags);
        self.live_at = Some(at);
        for name in &self.settings.commands {
            if !self.tags.iter().any(|tag| tag.metric.name == *name) {
                self.out.push_back(NodeAction::Say(format!(
                    "`[commands] tags` lists {name}: the program publishes no such tag"
                )));
            }
        }
    }

    /// Takes facts about the controller.
    pub fn facts(&mut self, facts: Vec<NodeFact>, now_ms: u64) {
        facts.into_iter().for_each(|(name, value)| self.facts.set(name, value));
        self.tell_facts(now_ms, false);
    }

    /// Takes a piece of the past, up to a log position.
    pub fn past(&mut self, events: Vec<LogEvent>, at: LogPosition, now_ms: u64) {
        if self.state != NodeState::Born || !self.history.is_under_way() {
            return;
        }
        let mut told = DueChanges::new();
        for event in events {
            match event {
                LogEvent::Begins { program, .. } => {
                    let past = tags::metrics(&self.settings, &program, ALIASES);
                    self.history.begins(&past, &self.tags);
                }
                LogEvent::Changed(change) => self.history.take(change, &self.tags, &mut told),
                LogEvent::Missing(gap) => self.missing(&gap),
                LogEvent::Jumped { .. } => {}
            }
        }
        self.history.release(&self.tags, at.unix_ns, &mut told);
        self.publish_changes(told, true, now_ms);
        self.history.mark_published(at);
        self.tell_facts(now_ms, false);
    }

    /// Notes that the requested part of the past is complete.
    pub fn past_done(&mut self, now_ms: u64) {
        if !self.history.is_under_way() {
            return;
        }
        let (next, unplaced) = self.history.done();
        if unplaced > 0 {
            let why = "the current program has no tag of that name and type";
            let line = format!("{unplaced} past values are not sent: {why}");
            self.out.push_back(NodeAction::Say(line));
        }
        self.facts.set(vocabulary::HISTORY_REPLAYING, MetricValue::Bool(next.is_some()));
        self.out.extend(next.map(NodeAction::Replay));
        self.tell_facts(now_ms, true);
    }

    fn missing(&mut self, gap: &LogGap) {
        self.lost = self.lost.saturating_add(gap.scans.unwrap_or(0));
        let lost = i64::try_from(self.lost).unwrap_or(i64::MAX);
        self.facts.set(vocabulary::HISTORY_LOST, MetricValue::Signed(lost));
        let scans = match gap.scans {
            Some(scans) => format!("{scans} scans"),
            None => "perhaps some scans".to_owned(),
        };
        let time = |unix_ns: i64| Utc::of((unix_ns / 1_000_000_000).try_into().unwrap_or(0));
        let (from, to) = (time(gap.from_ns), time(gap.to_ns));
        let why = &gap.why;
        self.out.push_back(NodeAction::Say(format!("lost: {scans} from {from}Z to {to}Z: {why}")));
    }

    /// Publishes a requested birth or a heartbeat, if it is due.
    pub fn tick(&mut self, now_ms: u64) {
        if self.state != NodeState::Born {
            return;
        }
        self.answer_request(now_ms);
        if now_ms.abs_diff(self.beat_ms) >= HEARTBEAT_MS {
            self.beat_ms = now_ms;
            self.tell_facts(now_ms, true);
        }
    }

    /// Publishes a birth and the past again if a host lacks the aliases, at most once a second.
    fn answer_request(&mut self, now_ms: u64) {
        let is_soon = self.reborn_ms.is_some_and(|last| now_ms.abs_diff(last) < REBIRTH_MS);
        if !self.wants_rebirth || is_soon {
            return;
        }
        self.reborn_ms = Some(now_ms);
        if std::mem::take(&mut self.host.is_owed) {
            return self.begin(now_ms);
        }
        // The host may have missed values since the first birth, further back than the margin.
        let (begun_ms, from) = self.began;
        if u128::from(now_ms.abs_diff(begun_ms)) <= self.settings.whole_margin().as_millis() {
            self.confirmed = from.or(self.confirmed);
        }
        self.tell_all(now_ms);
    }

    /// Takes a message from the broker.
    pub fn message(&mut self, topic: &str, payload: &[u8], now_ms: u64) {
        match Topic::read(topic) {
            Some(Topic::HostState { host })
                if self.settings.primary_host.as_ref() == Some(&host) =>
            {
                match HostState::read(payload) {
                    Ok(state) => self.host(state, now_ms),
                    Err(why) => {
                        self.out.push_back(NodeAction::SayLimited(LineSubject::HostState, why))
                    }
                }
            }
            Some(Topic::Node { kind: MessageKind::NodeCommand, group, node, device: None })
                if group == self.settings.group && node == self.settings.name =>
            {
                match Payload::read(payload) {
                    Ok(payload) => self.command(&payload, now_ms),
                    Err(why) => self.refuse(LineSubject::UnreadCommand, &why),
                }
            }
            Some(_) | None => {
                let line = "a message of a topic that was not subscribed to is ignored".to_owned();
                self.out.push_back(NodeAction::SayLimited(LineSubject::UnaskedMessage, line));
            }
        }
    }

    fn refuse(&mut self, subject: LineSubject, why: &impl std::fmt::Display) {
        let line = format!("a command is refused: {why}");
        self.out.push_back(NodeAction::SayLimited(subject, line));
    }

    /// Takes a state of the primary host.
    fn host(&mut self, state: HostState, now_ms: u64) {
        match (self.state, self.host.hear(state)) {
            (NodeState::Waits, HostNews::Came | HostNews::Still) => self.begin(now_ms),
            (NodeState::Born, HostNews::Gone) => {
                self.out.push_back(NodeAction::Leave("the primary host is offline".to_owned()));
            }
            (NodeState::Born, HostNews::Came) => {
                (self.host.is_owed, self.wants_rebirth) = (true, true);
                self.tick(now_ms);
            }
            (NodeState::Away | NodeState::Waits | NodeState::Born, _) => {}
        }
    }

    fn command(&mut self, payload: &Payload, now_ms: u64) {
        if self.state != NodeState::Born {
            return;
        }
        for asked in asked(payload, &self.tags) {
            match asked {
                CommandRequest::Rebirth => self.wants_rebirth = true,
                CommandRequest::Refused(subject, why) => self.refuse(subject, &why),
                CommandRequest::Write(operand, value) if self.pace.take(now_ms) => {
                    self.out.push_back(NodeAction::Write(operand, value));
                }
                CommandRequest::Write(operand, _) => {
                    let why = format!("{operand}: too many in a second");
                    self.refuse(LineSubject::FastCommand, &why);
                }
            }
        }
        self.tick(now_ms);
    }
}

/// A time in the unit of Sparkplug: ms since 1970 (UTC).
fn ms(unix_ns: i64) -> u64 {
    (unix_ns / 1_000_000).try_into().unwrap_or(0)
}
