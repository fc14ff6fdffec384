//! The shell around the node: the broker, the clock, the end of the process.
//!
//! It tries the brokers in turn, tells the node what happens, and does what it hands out. A Pong
//! confirms: the broker has read all that was published before its question. Nothing is decided
//! here about what is published.

use std::collections::VecDeque;
use std::future::pending;
use std::path::PathBuf;
use std::pin::pin;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::{Context as _, Result};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::time::{Instant, MissedTickBehavior, interval, sleep, sleep_until};

use super::cursor::NodeCursor;
use super::journal::{LimitedLines, say};
use super::log_thread::{LogAsk, LogThread, LogTold};
use super::node::{EdgeNode, NodeOut};
use super::settings::{BrokerKeys, EdgeSettings};
use crate::live::{HistorySpan, LogPosition};
use crate::mqtt::{
    BrokerAddress, BrokerLogin, BrokerSettings, LastWill, MqttEvent, MqttFailure, MqttSession,
    MqttVersion, Qos, TlsFiles,
};
use crate::sparkplug::Topic;

/// The time between two looks at the clock.
const TICK: Duration = Duration::from_millis(100);
/// The time between two confirmations.
const CONFIRM_EVERY: Duration = Duration::from_secs(1);
/// The time between two writes of the confirmed place: it spares a flash card, and a node that is
/// killed sends so much more again.
const KEEP_EVERY: Duration = Duration::from_secs(5);
/// The shortest and the longest pause before a broker is tried again.
const PAUSES: (Duration, Duration) = (Duration::from_secs(1), Duration::from_secs(30));
/// A node with several brokers looks for its primary host at each of them so long.
const HOST_WAIT: Duration = Duration::from_secs(10);
/// The longest wait for a broker at the end.
const END_MAX: Duration = Duration::from_secs(2);
/// A second of the past is sent in this time at least: what is live goes on beside it.
const PAST_PACE: Duration = Duration::from_millis(10);
/// The pause before a past that could not be read is asked for again.
const PAST_RETRY: Duration = Duration::from_secs(2);
/// The variable in which systemd names the folder of a service's state.
const STATE_VARIABLE: &str = "STATE_DIRECTORY";

/// Whether a text is the address of a broker.
///
/// # Errors
/// Why it is none.
pub(super) fn judged_address(text: &str) -> Result<(), String> {
    BrokerAddress::parse(text).map(|_| ())
}

/// Publishes until the process is told to end.
///
/// # Errors
/// The settings' files cannot be read; the system refuses a thread.
pub fn run(settings: &EdgeSettings) -> Result<()> {
    let state = settings.state_dir.clone();
    let state = state.or_else(|| std::env::var_os(STATE_VARIABLE).map(PathBuf::from));
    match &state {
        Some(dir) => std::fs::create_dir_all(dir).with_context(|| dir.display().to_string())?,
        None => say(
            "it has no folder for its place in the log: after a start of its own it sends no past \
             (`[node] state-dir`, or $STATE_DIRECTORY)",
        ),
    }
    let broker = broker(settings)?;
    let mut cursor = NodeCursor::new(state);
    let (birth, confirmed) = (cursor.last_birth(), cursor.position());
    let node = EdgeNode::new(settings.clone(), birth, confirmed);
    let log = LogThread::start(settings).context("a thread")?;
    let shell = EdgeShell {
        broker,
        node,
        log,
        cursor,
        lines: LimitedLines::default(),
        confirmed: None,
        kept: None,
        tried: 0,
        past: 0,
        span: None,
        unread: None,
        next_past: None,
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.context("an event loop")?.block_on(shell.serve())
}

/// The settings of the client of MQTT.
fn broker(settings: &EdgeSettings) -> Result<BrokerSettings> {
    let BrokerKeys { addresses, is_v5, keepalive, .. } = &settings.broker;
    let addresses = addresses.iter().map(|text| BrokerAddress::parse(text));
    let addresses: Vec<_> = addresses.collect::<Result<_, _>>().map_err(anyhow::Error::msg)?;
    let client_id = format!("rungd-{}-{}", settings.group, settings.name);
    let mut broker = BrokerSettings::new(addresses, &client_id);
    broker.version = if *is_v5 { MqttVersion::V5 } else { MqttVersion::V3 };
    broker.keepalive = *keepalive;
    if let Some(user) = settings.broker.user.clone() {
        let password = match &settings.broker.password_file {
            Some(path) => {
                let text = std::fs::read_to_string(path);
                let text = text.with_context(|| path.display().to_string())?;
                text.lines().next().unwrap_or_default().to_owned()
            }
            None => String::new(),
        };
        broker.login = Some(BrokerLogin { user, password });
    }
    let (certificate, key) = settings.broker.certificate.clone().unzip();
    let ca = settings.broker.ca.clone();
    let has_files = ca.is_some() || certificate.is_some();
    broker.tls = has_files.then_some(TlsFiles { ca, certificate, key });
    Ok(broker)
}

/// Whether a topic is that of a command, and not of a host's state.
fn is_command(topic: &str) -> bool {
    matches!(Topic::read(topic), Some(Topic::Node { .. }))
}

struct EdgeShell {
    broker: BrokerSettings,
    node: EdgeNode,
    log: LogThread,
    cursor: NodeCursor,
    lines: LimitedLines,
    /// The place up to which a broker has everything, and when it was kept last.
    confirmed: Option<LogPosition>,
    kept: Option<Instant>,
    /// The number of tries to reach a broker: each takes the next address.
    tried: usize,
    /// The number of the past that was asked for last; 0: none is wanted.
    past: u64,
    /// The part of the past that was asked for last.
    span: Option<HistorySpan>,
    /// It could not be read, and is to be asked for again.
    unread: Option<HistorySpan>,
    /// When the next piece of the past is asked for.
    next_past: Option<Instant>,
}

/// Why a time with a broker, or without one, is over.
enum EndedTime {
    /// The process is told to end.
    Told,
    /// The broker is gone, or is left.
    Broker(String),
}

impl EdgeShell {
    async fn serve(mut self) -> Result<()> {
        let mut ends = [signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?];
        let _ = sd_notify::notify(&[sd_notify::NotifyState::Ready]);
        let mut pause = Duration::ZERO;
        loop {
            if self.wait(pause, &mut ends).await {
                return Ok(());
            }
            let began = Instant::now();
            let why = match self.connect(&mut ends).await {
                Ok(None) => return Ok(()),
                Ok(Some(session)) => match self.converse(session, &mut ends).await {
                    EndedTime::Told => return Ok(()),
                    EndedTime::Broker(why) => why,
                },
                Err(failure) => failure.to_string(),
            };
            self.node.disconnected();
            (self.next_past, self.unread) = (None, None);
            self.tried = self.tried.wrapping_add(1);
            pause = if began.elapsed() > PAUSES.1 { Duration::ZERO } else { pause };
            pause = (pause * 2).clamp(PAUSES.0, PAUSES.1);
            pause = pause.mul_f64(0.75 + jitter() / 2.0).clamp(PAUSES.0, PAUSES.1);
            say(&format!("{why}; the next try in {:.1} s", pause.as_secs_f64()));
        }
    }

    /// A pause without a broker; true: the process is to end.
    async fn wait(&mut self, pause: Duration, ends: &mut [Signal; 2]) -> bool {
        let mut over = pin!(sleep(pause));
        loop {
            tokio::select! {
                () = &mut over => return false,
                () = told_to_end(ends) => return true,
                told = self.log.told.recv() => self.take(told),
            }
            self.drop_out();
        }
    }

    /// Reaches the next broker; `None`: the process is to end.
    async fn connect(
        &mut self,
        ends: &mut [Signal; 2],
    ) -> Result<Option<MqttSession>, MqttFailure> {
        let settings = self.broker.clone();
        let address = settings.addresses[self.tried % settings.addresses.len()].clone();
        let birth = self.node.next_birth();
        if let Err(error) = self.cursor.keep_birth(birth) {
            self.lines.say(&format!("the number of the birth cannot be kept: {error}"));
        }
        let (topic, payload) = self.node.death(now_ms());
        let will = LastWill { topic, payload, qos: Qos::AtLeastOnce, retain: false };
        let mut connecting = pin!(async {
            let mut session = MqttSession::connect(&settings, &address, Some(&will)).await?;
            let filters = self.node.filters();
            let filters: Vec<_> =
                filters.iter().map(|filter| (filter.as_str(), Qos::AtLeastOnce)).collect();
            session.subscribe(&filters).await?;
            Ok(session)
        });
        tokio::select! {
            session = &mut connecting => session.map(Some),
            () = told_to_end(ends) => Ok(None),
        }
    }

    /// A time with a broker.
    async fn converse(&mut self, mut session: MqttSession, ends: &mut [Signal; 2]) -> EndedTime {
        say(&format!("the broker at {} answers", session.broker()));
        let connected = Instant::now();
        self.node.connected(now_ms());
        let mut ticks = interval(TICK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut confirms = interval(CONFIRM_EVERY);
        confirms.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut asked: VecDeque<(u64, LogPosition)> = VecDeque::new();
        loop {
            if let Err(ended) = self.send(&mut session).await {
                return self.leave(session, ended).await;
            }
            let next_past = self.next_past;
            tokio::select! {
                event = session.next() => match event {
                    // A command that the broker keeps would be done again at each connection.
                    Ok(MqttEvent::Message { topic, retained: true, .. }) if is_command(&topic) => {
                        self.lines.say("a retained command is left out: commands are not retained");
                    }
                    Ok(MqttEvent::Message { topic, payload, .. }) => {
                        self.node.message(&topic, &payload, now_ms());
                    }
                    Ok(MqttEvent::Pong(count)) => self.confirm(count, &mut asked),
                    Ok(MqttEvent::Acknowledged(_)) => {}
                    Err(failure) => return EndedTime::Broker(failure.to_string()),
                },
                told = self.log.told.recv() => self.take(told),
                () = at(next_past) => {
                    self.next_past = None;
                    match self.unread.take() {
                        Some(span) => self.replay(span),
                        None => drop(self.log.asks.send(LogAsk::Next)),
                    }
                }
                _ = ticks.tick() => {
                    self.node.tick(now_ms());
                    let is_one = self.broker.addresses.len() == 1;
                    if self.node.waits() && !is_one && connected.elapsed() > HOST_WAIT {
                        let why = "the primary host is not at this broker".to_owned();
                        return self.leave(session, EndedTime::Broker(why)).await;
                    }
                }
                _ = confirms.tick() => {
                    let Some(published) = self.node.published() else { continue };
                    match session.ping().await {
                        Ok(count) => asked.push_back((count, published)),
                        Err(failure) => return EndedTime::Broker(failure.to_string()),
                    }
                }
                () = told_to_end(ends) => return self.leave(session, EndedTime::Told).await,
            }
        }
    }

    /// Does what the node hands out.
    async fn send(&mut self, session: &mut MqttSession) -> Result<(), EndedTime> {
        while let Some(out) = self.node.take_out() {
            match out {
                NodeOut::Publish(topic, payload) => {
                    let sent = session.publish(&topic, &payload, Qos::AtMostOnce, false).await;
                    sent.map_err(|failure| EndedTime::Broker(failure.to_string()))?;
                }
                NodeOut::Leave(why) => return Err(EndedTime::Broker(why)),
                NodeOut::Replay(span) => self.replay(span),
                NodeOut::Write(operand, value) => {
                    let _ = self.log.asks.send(LogAsk::Write(operand, value));
                }
                NodeOut::Say(line) => say(&line),
                NodeOut::SayLimited(line) => self.lines.say(&line),
            }
        }
        Ok(())
    }

    /// Asks for a part of the past; what was asked for before is not wanted any more.
    fn replay(&mut self, span: HistorySpan) {
        (self.past, self.span) = (self.past + 1, Some(span));
        (self.next_past, self.unread) = (None, None);
        let _ = self.log.asks.send(LogAsk::Replay(self.past, span));
    }

    /// Nobody hears what is published; the journal hears its lines.
    fn drop_out(&mut self) {
        while let Some(out) = self.node.take_out() {
            match out {
                NodeOut::Say(line) => say(&line),
                NodeOut::SayLimited(line) => self.lines.say(&line),
                NodeOut::Publish(..)
                | NodeOut::Leave(_)
                | NodeOut::Replay(_)
                | NodeOut::Write(..) => {}
            }
        }
    }

    /// What the log's thread tells.
    fn take(&mut self, told: Option<LogTold>) {
        match told {
            Some(LogTold::Live(events, at)) => self.node.live(events, at, now_ms()),
            Some(LogTold::Facts(facts)) => self.node.facts(facts, now_ms()),
            Some(LogTold::Past(number, events, at)) if number == self.past => {
                self.node.past(events, at, now_ms());
                self.next_past = Some(Instant::now() + PAST_PACE);
            }
            Some(LogTold::PastDone(number)) if number == self.past => {
                self.node.past_done(now_ms());
            }
            Some(LogTold::PastFailed(number)) if number == self.past => {
                self.next_past = Some(Instant::now() + PAST_RETRY);
                self.unread = self.span;
            }
            // Of a connection before.
            Some(LogTold::Past(..) | LogTold::PastDone(_) | LogTold::PastFailed(_)) | None => {}
        }
    }

    /// The broker has read all before this question.
    fn confirm(&mut self, count: u64, asked: &mut VecDeque<(u64, LogPosition)>) {
        while let Some((_, at)) = asked.front().copied().filter(|(of, _)| *of <= count) {
            asked.pop_front();
            self.node.confirm(at);
            self.confirmed = Some(at);
        }
        if self.kept.is_none_or(|kept| kept.elapsed() >= KEEP_EVERY) {
            self.keep();
        }
    }

    /// Keeps the place that is confirmed.
    fn keep(&mut self) {
        self.kept = Some(Instant::now());
        let kept = self.confirmed.map_or(Ok(()), |at| self.cursor.keep(at));
        if let Err(error) = kept {
            self.lines.say(&format!("the place in the log cannot be kept: {error}"));
        }
    }

    /// Says that the node dies, and leaves the broker in order.
    async fn leave(&mut self, mut session: MqttSession, ended: EndedTime) -> EndedTime {
        self.keep();
        let (topic, payload) = self.node.death(now_ms());
        let farewell = async {
            session.publish(&topic, &payload, Qos::AtLeastOnce, false).await?;
            session.disconnect_with_will().await
        };
        let _ = tokio::time::timeout(END_MAX, farewell).await;
        ended
    }
}

async fn told_to_end(ends: &mut [Signal; 2]) {
    let [terminate, interrupt] = ends;
    tokio::select! {
        _ = terminate.recv() => {}
        _ = interrupt.recv() => {}
    }
}

async fn at(time: Option<Instant>) {
    match time {
        Some(time) => sleep_until(time).await,
        None => pending().await,
    }
}

/// Now, ms since 1970 (UTC).
fn now_ms() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}

/// 0 to 1, another one for each node: so that a hundred nodes do not come back at once.
fn jitter() -> f64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let seed = u64::from(since.subsec_nanos()) ^ u64::from(std::process::id()) << 32;
    let random = crate::random::SplitMix64(seed).next();
    (random >> 11) as f64 / (1_u64 << 53) as f64
}
