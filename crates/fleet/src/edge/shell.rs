//! The shell around the node: the broker, the clock, the end of the process.
//!
//! It tries the brokers in turn, passes events to the node, and carries out the node's actions. A
//! Pong confirms that the broker has read everything that was published before the Ping. The node
//! alone decides what is published.

use std::collections::VecDeque;
use std::future::pending;
use std::pin::pin;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::{Context as _, Result, bail};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::time::{Instant, MissedTickBehavior, interval, sleep, sleep_until};

use super::cursor::NodeCursor;
use super::journal::{EdgeLines, LineSubject, say};
use super::log_thread::{LogReport, LogRequest, LogThread};
use super::node::{EdgeNode, NodeAction};
use super::settings::{BrokerKeys, EdgeSettings};
use rungd_base::directories;
use rungd_base::wall_clock::now_ms;
use rungd_client::live::{HistorySpan, LogPosition};
use rungd_net::mqtt::{
    BrokerAddress, BrokerLogin, BrokerSettings, LastWill, MqttCause, MqttEvent, MqttFailure,
    MqttSession, MqttVersion, Qos, TlsFiles,
};
use rungd_net::sparkplug::Topic;

/// The time between two ticks of the node.
const TICK: Duration = Duration::from_millis(100);
/// The time between two checks for withheld lines, while no broker is connected.
const TELL_EVERY: Duration = Duration::from_secs(1);
/// The time between two Pings, each of which requests a confirmation.
const CONFIRM_EVERY: Duration = Duration::from_secs(1);
/// The time between two writes of the confirmed log position. Few writes spare a flash card; after
/// a kill, the node repeats the data of at most this time.
const KEEP_EVERY: Duration = Duration::from_secs(5);
/// The shortest and the longest pause before a broker is tried again.
const PAUSES: (Duration, Duration) = (Duration::from_secs(1), Duration::from_secs(30));
/// The time that a node waits for its primary host. Then it tries the next broker; if there is only
/// one broker, it logs that it waits.
const HOST_WAIT: Duration = Duration::from_secs(10);
/// The maximum time for publishing the death and closing the session.
const END_MAX: Duration = Duration::from_secs(2);
/// The minimum time between two pieces of the past, each a second of the log. It leaves time for
/// live data.
const PAST_PACE: Duration = Duration::from_millis(10);
/// The pause before a part of the past that could not be read is requested again.
const PAST_RETRY: Duration = Duration::from_secs(2);

/// Whether a text is the address of a broker.
///
/// # Errors
/// The reason why the text is no address.
pub(super) fn judged_address(text: &str) -> Result<(), String> {
    BrokerAddress::parse(text).map(|_| ())
}

/// Publishes until the process receives a signal to end.
///
/// # Errors
/// A file of the settings cannot be read, the state folder cannot be created, or the system refuses
/// a thread.
pub fn run(settings: &EdgeSettings) -> Result<()> {
    let state = settings.state_dir.clone().or_else(directories::state);
    match &state {
        Some(dir) => std::fs::create_dir_all(dir).with_context(|| dir.display().to_string())?,
        None => say(
            "there is no folder for the log position, so the node sends no past after a restart \
             (`[node] state-dir`, or $STATE_DIRECTORY)",
        ),
    }
    let broker = broker(settings)?;
    let mut cursor = NodeCursor::new(state);
    let (birth, confirmed) = (cursor.last_birth(), cursor.position());
    let node = EdgeNode::new(settings.clone(), birth, confirmed);
    let lines = EdgeLines::new();
    let log = LogThread::start(settings, lines.clone()).context("a thread")?;
    let shell = EdgeShell {
        broker,
        node,
        log,
        cursor,
        lines,
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

/// The settings of the MQTT client.
fn broker(settings: &EdgeSettings) -> Result<BrokerSettings> {
    let BrokerKeys { addresses, is_v5, keepalive, .. } = &settings.broker;
    let addresses = addresses.iter().map(|text| BrokerAddress::parse(text));
    let addresses: Vec<_> = addresses.collect::<Result<_, _>>().map_err(anyhow::Error::msg)?;
    let client_id = format!("rungd-{}-{}", settings.group, settings.name);
    let mut broker = BrokerSettings::new(addresses, &client_id);
    broker.version = if *is_v5 { MqttVersion::V5 } else { MqttVersion::V3 };
    broker.keepalive = *keepalive;
    if let Some(user) = &settings.broker.user {
        broker.login = Some(match &settings.broker.password_file {
            Some(path) => {
                BrokerLogin::of_file(user, path).with_context(|| path.display().to_string())?
            }
            None => BrokerLogin { user: user.clone(), password: String::new() },
        });
    }
    let (certificate, key) = settings.broker.certificate.clone().unzip();
    let ca = settings.broker.ca.clone();
    let has_files = ca.is_some() || certificate.is_some();
    broker.tls = has_files.then_some(TlsFiles { ca, certificate, key });
    Ok(broker)
}

/// Whether a topic is that of a command, rather than that of a host's state.
fn is_command(topic: &str) -> bool {
    matches!(Topic::read(topic), Some(Topic::Node { .. }))
}

struct EdgeShell {
    broker: BrokerSettings,
    node: EdgeNode,
    log: LogThread,
    cursor: NodeCursor,
    lines: EdgeLines,
    /// The log position up to which a broker has everything, and the time at which it was last
    /// stored.
    confirmed: Option<LogPosition>,
    kept: Option<Instant>,
    /// The number of tries to reach a broker: each takes the next address.
    tried: usize,
    /// The number of the last request for the past; 0: none yet.
    past: u64,
    /// The part of the past that was requested last.
    span: Option<HistorySpan>,
    /// The part of the past that could not be read and is to be requested again.
    unread: Option<HistorySpan>,
    /// The time at which the next piece of the past is requested.
    next_past: Option<Instant>,
}

/// The reason for the end of a connection.
enum ConnectionEndReason {
    /// The process received a signal to end. The text reports whether the death was published.
    Told(String),
    /// The broker is gone or was left, for this reason.
    Broker(String),
}

impl EdgeShell {
    async fn serve(mut self) -> Result<()> {
        let mut ends = [signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?];
        let _ = sd_notify::notify(&[sd_notify::NotifyState::Ready]);
        let ended = self.work(&mut ends).await;
        self.lines.report_withheld(true);
        say(&format!("ends after a signal: {}", ended?));
        Ok(())
    }

    /// Tries brokers until the process receives a signal to end. Returns a text about whether the
    /// death was published.
    async fn work(&mut self, ends: &mut [Signal; 2]) -> Result<String> {
        let mut pause = Duration::ZERO;
        loop {
            if self.wait(pause, ends).await? {
                return Ok("it has no broker to publish its death".to_owned());
            }
            let began = Instant::now();
            let why = match self.connect(ends).await {
                Ok(None) => return Ok("it had not reached a broker yet".to_owned()),
                Ok(Some(session)) => match self.converse(session, ends).await? {
                    ConnectionEndReason::Told(death) => return Ok(death),
                    ConnectionEndReason::Broker(why) => why,
                },
                Err(failure) => failure.to_string(),
            };
            self.keep();
            self.node.disconnected();
            (self.next_past, self.unread) = (None, None);
            self.tried = self.tried.wrapping_add(1);
            pause = if began.elapsed() > PAUSES.1 { Duration::ZERO } else { pause };
            pause = (pause * 2).clamp(PAUSES.0, PAUSES.1);
            pause = pause.mul_f64(0.75 + jitter() / 2.0).clamp(PAUSES.0, PAUSES.1);
            say(&format!("{why}; the next try in {:.1} s", pause.as_secs_f64()));
        }
    }

    /// Waits without a broker; true: the process is to end.
    async fn wait(&mut self, pause: Duration, ends: &mut [Signal; 2]) -> Result<bool> {
        let mut over = pin!(sleep(pause));
        let mut tells = interval(TELL_EVERY);
        loop {
            tokio::select! {
                () = &mut over => return Ok(false),
                () = told_to_end(ends) => return Ok(true),
                told = self.log.told.recv() => self.take(told)?,
                _ = tells.tick() => self.lines.report_withheld(false),
            }
            self.drop_out();
        }
    }

    /// Connects to the next broker; `None`: the process is to end.
    async fn connect(
        &mut self,
        ends: &mut [Signal; 2],
    ) -> Result<Option<MqttSession>, MqttFailure> {
        let settings = self.broker.clone();
        let address = settings.addresses[self.tried % settings.addresses.len()].clone();
        let birth = self.node.next_birth();
        if let Err(error) = self.cursor.keep_birth(birth) {
            let line = format!("the number of the birth cannot be saved: {error}");
            self.lines.say(LineSubject::Unkept, &line);
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

    /// Serves a connection until its end.
    async fn converse(
        &mut self,
        mut session: MqttSession,
        ends: &mut [Signal; 2],
    ) -> Result<ConnectionEndReason> {
        say(&format!("the broker at {} answers", session.broker()));
        self.node.connected(now_ms());
        let mut host_until = Some(Instant::now() + HOST_WAIT);
        let mut ticks = interval(TICK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut confirms = interval(CONFIRM_EVERY);
        confirms.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut asked: VecDeque<(u64, LogPosition)> = VecDeque::new();
        loop {
            match self.send(&mut session).await {
                Ok(None) => {}
                Ok(Some(why)) => return Ok(self.leave(session, &why).await),
                Err(failure) => return Ok(self.broken(&failure)),
            }
            let next_past = self.next_past;
            tokio::select! {
                event = session.next() => match event {
                    Ok(event) => self.hear(event, &mut asked),
                    Err(failure) => return Ok(self.broken(&failure)),
                },
                told = self.log.told.recv() => self.take(told)?,
                () = at(next_past) => {
                    self.next_past = None;
                    match self.unread.take() {
                        Some(span) => self.replay(span),
                        None => drop(self.log.asks.send(LogRequest::Next)),
                    }
                }
                _ = ticks.tick() => {
                    self.node.tick(now_ms());
                    self.lines.report_withheld(false);
                    if let Some(why) = self.missed_host(&mut host_until) {
                        return Ok(self.leave(session, &why).await);
                    }
                }
                _ = confirms.tick() => {
                    let Some(published) = self.node.published() else { continue };
                    match session.ping().await {
                        Ok(count) => asked.push_back((count, published)),
                        Err(failure) => return Ok(self.broken(&failure)),
                    }
                }
                () = told_to_end(ends) => {
                    return Ok(ConnectionEndReason::Told(self.farewell(session).await));
                }
            }
        }
    }

    /// The reason for a failed session. It includes the client's id if the broker ended the
    /// session: two nodes with the same name end each other's sessions.
    fn broken(&self, failure: &MqttFailure) -> ConnectionEndReason {
        let id = &self.broker.client_id;
        let is_ended = matches!(failure.cause, MqttCause::Closed | MqttCause::Ended(_));
        ConnectionEndReason::Broker(if is_ended {
            format!("{failure} (this client's id is `{id}`, of the node's group and name)")
        } else {
            failure.to_string()
        })
    }

    /// Handles an event from the broker.
    fn hear(&mut self, event: MqttEvent, asked: &mut VecDeque<(u64, LogPosition)>) {
        match event {
            // A retained command would be carried out again at each connection.
            MqttEvent::Message { topic, retained: true, .. } if is_command(&topic) => {
                let line = format!(
                    "a retained command is ignored: it would be carried out at each connection (an \
                     empty retained message for `{topic}` removes it)"
                );
                self.lines.say(LineSubject::RetainedCommand, &line);
            }
            MqttEvent::Message { topic, payload, .. } => {
                self.node.message(&topic, &payload, now_ms());
            }
            MqttEvent::LeftOut(message) => {
                self.lines.say(LineSubject::LongMessage, &format!("left out: {message}"));
            }
            MqttEvent::Pong(count) => self.confirm(count, asked),
            MqttEvent::Acknowledged(_) => {}
        }
    }

    /// The reason to leave for the next broker, if the primary host is not at this broker in time.
    /// If there is only one broker, the reason is only logged.
    fn missed_host(&self, until: &mut Option<Instant>) -> Option<String> {
        let host = self.node.awaited()?;
        if until.is_none_or(|until| Instant::now() < until) {
            return None;
        }
        *until = None;
        let why = format!("the primary host `{host}` is not at this broker");
        if self.broker.addresses.len() > 1 {
            return Some(why);
        }
        say(&format!("{why}: nothing is published until `spBv1.0/STATE/{host}` reports it online"));
        None
    }

    /// Carries out the node's actions. Returns the reason if the node leaves the broker.
    async fn send(&mut self, session: &mut MqttSession) -> Result<Option<String>, MqttFailure> {
        while let Some(out) = self.node.take_out() {
            match out {
                NodeAction::Publish(topic, payload) => {
                    session.publish(&topic, &payload, Qos::AtMostOnce, false).await?;
                }
                NodeAction::Leave(why) => return Ok(Some(why)),
                NodeAction::Replay(span) => self.replay(span),
                NodeAction::Write(operand, value) => {
                    let now = std::time::Instant::now();
                    let _ = self.log.asks.send(LogRequest::Write(operand, value, now));
                }
                NodeAction::Say(line) => say(&line),
                NodeAction::SayLimited(kind, line) => self.lines.say(kind, &line),
            }
        }
        Ok(None)
    }

    /// Requests a part of the past. Replaces the previous request.
    fn replay(&mut self, span: HistorySpan) {
        (self.past, self.span) = (self.past + 1, Some(span));
        (self.next_past, self.unread) = (None, None);
        let _ = self.log.asks.send(LogRequest::Replay(self.past, span));
    }

    /// Drops the node's actions, because no broker is connected. Lines for the journal are still
    /// printed.
    fn drop_out(&mut self) {
        while let Some(out) = self.node.take_out() {
            match out {
                NodeAction::Say(line) => say(&line),
                NodeAction::SayLimited(kind, line) => self.lines.say(kind, &line),
                NodeAction::Publish(..)
                | NodeAction::Leave(_)
                | NodeAction::Replay(_)
                | NodeAction::Write(..) => {}
            }
        }
    }

    /// Handles a report of the log thread.
    ///
    /// # Errors
    /// The log thread has ended.
    fn take(&mut self, told: Option<LogReport>) -> Result<()> {
        let Some(told) = told else {
            bail!("the log thread has ended: the reason is in the lines above")
        };
        match told {
            LogReport::Live(events, at) => self.node.live(events, at, now_ms()),
            LogReport::Facts(facts) => self.node.facts(facts, now_ms()),
            LogReport::Past(number, events, at) if number == self.past => {
                self.node.past(events, at, now_ms());
                self.next_past = Some(Instant::now() + PAST_PACE);
            }
            LogReport::PastDone(number) if number == self.past => {
                self.node.past_done(now_ms());
            }
            LogReport::PastFailed(number) if number == self.past => {
                self.next_past = Some(Instant::now() + PAST_RETRY);
                self.unread = self.span;
            }
            // Reports for an earlier request.
            LogReport::Past(..) | LogReport::PastDone(_) | LogReport::PastFailed(_) => {}
        }
        Ok(())
    }

    /// Notes that the broker has read everything that was published before this Ping.
    fn confirm(&mut self, count: u64, asked: &mut VecDeque<(u64, LogPosition)>) {
        while let Some((_, at)) =
            asked.front().copied().filter(|(asked_count, _)| *asked_count <= count)
        {
            asked.pop_front();
            self.node.confirm(at);
            self.confirmed = Some(at);
        }
        if self.kept.is_none_or(|kept| kept.elapsed() >= KEEP_EVERY) {
            self.keep();
        }
    }

    /// Stores the confirmed log position.
    fn keep(&mut self) {
        self.kept = Some(Instant::now());
        let kept = self.confirmed.map_or(Ok(()), |at| self.cursor.keep(at));
        if let Err(error) = kept {
            let line = format!("the log position cannot be saved: {error}");
            self.lines.say(LineSubject::Unkept, &line);
        }
    }

    /// Leaves a broker that may still work.
    async fn leave(&mut self, session: MqttSession, why: &str) -> ConnectionEndReason {
        let broker = session.broker().clone();
        let death = self.farewell(session).await;
        ConnectionEndReason::Broker(format!("disconnects from {broker}: {why}; {death}"))
    }

    /// Publishes the death and closes the session in order. Returns a text about whether the death
    /// was published.
    async fn farewell(&mut self, mut session: MqttSession) -> String {
        self.keep();
        let (topic, payload) = self.node.death(now_ms());
        let said = async {
            session.publish(&topic, &payload, Qos::AtLeastOnce, false).await?;
            session.disconnect_with_will().await
        };
        let why = match tokio::time::timeout(END_MAX, said).await {
            Ok(Ok(())) => return "its death was published".to_owned(),
            Ok(Err(failure)) => failure.to_string(),
            Err(_) => format!("no answer within {END_MAX:?}"),
        };
        format!("its death may not have been published: then the broker publishes it ({why})")
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

/// A number from 0 to 1, different for each node, so that a hundred nodes do not reconnect at once.
fn jitter() -> f64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let seed = u64::from(since.subsec_nanos()) ^ u64::from(std::process::id()) << 32;
    let random = rungd_base::random::SplitMix64(seed).next();
    (random >> 11) as f64 / (1_u64 << 53) as f64
}
