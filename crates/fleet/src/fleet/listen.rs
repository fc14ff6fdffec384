//! Listens to a broker for a time, or until a signal: the shell around [`FleetView`].
//!
//! There is one session at a time. If it breaks, every node becomes stale and the next address is
//! tried, with growing pauses. Called by `cli::fleet`, which receives and prints every change and
//! every event of the link. Only the messages that the options request are published: the state of
//! this host (`--host-id`), and requests for births (`--rebirth`).

use std::ops::ControlFlow;
use std::time::Duration;

use anyhow::Result;
use tokio::time::{Instant, MissedTickBehavior, interval, timeout, timeout_at};

use super::ask::rebirth_request;
use super::heard::ReceivedMessage;
use super::host::{HostSession, StateMessage};
use super::limits::FleetLimits;
use super::news::FleetChange;
use super::stop::StopSignals;
use super::view::FleetView;
use rungd_base::wall_clock::now_ms;
use rungd_net::mqtt::{
    BrokerAddress, BrokerSettings, LastWill, MqttCause, MqttEvent, MqttFailure, MqttSession, Qos,
};
use rungd_net::sparkplug::MessageKind;

/// The time between two checks whether births are to be requested and the host's own state is to be
/// published again.
const ASK_EVERY: Duration = Duration::from_millis(500);
/// The first and the longest wait before the next attempt to connect.
const AGAIN: Duration = Duration::from_secs(1);
const AGAIN_MAX: Duration = Duration::from_secs(30);
/// The maximum time of reading after the end has come, so that a flood by the broker does not hold
/// up the end.
const REST_MAX: Duration = Duration::from_secs(1);
/// The maximum wait for the broker to close the connection, if nothing depends on it.
const CLOSE_MAX: Duration = Duration::from_secs(1);
/// The kinds of message that nodes and their devices send.
const HEARD: [MessageKind; 6] = [
    MessageKind::NodeBirth,
    MessageKind::NodeData,
    MessageKind::NodeDeath,
    MessageKind::DeviceBirth,
    MessageKind::DeviceData,
    MessageKind::DeviceDeath,
];

/// The options of listening.
#[derive(Clone, Debug)]
pub struct FleetOptions {
    /// The brokers, used one at a time.
    pub brokers: BrokerSettings,
    /// The group to listen to; `None`: all groups.
    pub group: Option<String>,
    /// The name of this host, if it publishes its state.
    pub host_id: Option<String>,
    /// Whether missing births are requested.
    pub asks_births: bool,
    /// The time of listening; `None`: until SIGINT or SIGTERM.
    pub lasts: Option<Duration>,
}

/// An event during listening.
#[derive(Debug)]
pub enum FleetEvent<'w> {
    /// A session with a broker has begun.
    Connected(&'w BrokerAddress),
    /// No session could begin, or the session has ended.
    Failed(&'w MqttFailure),
    /// The fleet has changed.
    Changed(&'w [FleetChange]),
    /// Messages of a kind are left out; reported when the first of them comes.
    LeftOut(&'static str),
    /// Listening goes on; reported every half second of a session, and before each wait for the
    /// next attempt. The receiver ends it by an error, for example because nobody reads its output.
    Waiting,
}

/// The result of listening.
#[derive(Debug)]
pub struct FleetResult {
    /// The nodes and hosts.
    pub view: FleetView,
    /// The reason why there is no session at the end.
    pub failure: Option<MqttFailure>,
    /// Whether there was a session at any time.
    pub was_connected: bool,
    /// The duration of listening.
    pub lasted: Duration,
}

/// Receives the events, for example to print them.
pub(crate) type FleetEventSink<'e> = &'e mut dyn FnMut(FleetEvent) -> Result<()>;

/// Listens until the end.
///
/// # Errors
/// `ear` fails, or the system refuses a thread.
pub fn listen(options: &FleetOptions, ear: FleetEventSink) -> Result<FleetResult> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let stop = StopSignals::new(options.lasts)?;
        let view = FleetView::new(FleetLimits::default(), options.group.clone());
        let (began, lasted) = (Instant::now(), Duration::ZERO);
        let heard = FleetResult { view, failure: None, was_connected: false, lasted };
        let mut heard = FleetListener { options, ear, stop, heard }.run().await?;
        heard.lasted = began.elapsed();
        Ok(heard)
    })
}

/// The reason for the end of a session.
enum FleetSessionEnd {
    /// Listening is to end.
    Stopped,
    /// The session broke.
    Broken(MqttFailure),
}

struct FleetListener<'l> {
    options: &'l FleetOptions,
    ear: FleetEventSink<'l>,
    stop: StopSignals,
    heard: FleetResult,
}

impl FleetListener<'_> {
    async fn run(mut self) -> Result<FleetResult> {
        let mut wait = AGAIN;
        let addresses = &self.options.brokers.addresses;
        for (number, address) in (1..).zip(addresses.iter().cycle()) {
            let began = Instant::now();
            let failure = match self.session(address).await? {
                FleetSessionEnd::Stopped => return Ok(self.heard),
                FleetSessionEnd::Broken(failure) => failure,
            };
            (self.ear)(FleetEvent::Failed(&failure))?;
            let is_ours = is_ours(&failure);
            self.heard.failure = Some(failure);
            let changes = self.heard.view.lose_link(now_ms());
            (self.ear)(FleetEvent::Changed(&changes))?;
            if is_ours {
                break;
            }
            // After a session that lasted, the next attempt is early again.
            wait = if began.elapsed() > AGAIN_MAX { AGAIN } else { wait };
            // The other addresses are tried first, without a pause.
            if number % addresses.len() != 0 && self.stop.is_going_on() {
                continue;
            }
            (self.ear)(FleetEvent::Waiting)?;
            if timeout_at(began + wait, self.stop.wait()).await.is_ok() {
                break;
            }
            wait = (wait * 2).min(AGAIN_MAX);
        }
        Ok(self.heard)
    }

    /// One session, from its connection to its end.
    async fn session(&mut self, address: &BrokerAddress) -> Result<FleetSessionEnd> {
        let mut link = tokio::select! {
            begun = begin(self.options, address) => match begun {
                Ok(link) => link,
                Err(failure) => return Ok(FleetSessionEnd::Broken(failure)),
            },
            () = self.stop.wait() => return Ok(FleetSessionEnd::Stopped),
        };
        (self.heard.was_connected, self.heard.failure) = (true, None);
        let over = self.follow(&mut link, address).await;
        if !matches!(over, Ok(FleetSessionEnd::Broken(_))) {
            // Publishes the death of this host, even if a change could not be printed.
            end(link).await;
        }
        over
    }

    /// Handles the events of a session, until it breaks or is to end.
    async fn follow(
        &mut self,
        link: &mut FleetLink,
        address: &BrokerAddress,
    ) -> Result<FleetSessionEnd> {
        (self.ear)(FleetEvent::Connected(address))?;
        let mut asks = interval(ASK_EVERY);
        asks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let step = tokio::select! {
                event = link.session.next() => match event {
                    Ok(event) => self.take(link, event).await?,
                    Err(failure) => ControlFlow::Break(failure),
                },
                _ = asks.tick() => {
                    (self.ear)(FleetEvent::Waiting)?;
                    session_flow(self.ask(link).await)
                }
                () = self.stop.wait() => {
                    self.take_rest(link).await?;
                    return Ok(FleetSessionEnd::Stopped);
                }
            };
            if let ControlFlow::Break(failure) = step {
                return Ok(FleetSessionEnd::Broken(failure));
            }
        }
    }

    /// Handles the events that came before the end and were not read yet, within a time limit.
    async fn take_rest(&mut self, link: &mut FleetLink) -> Result<()> {
        let end = Instant::now() + REST_MAX;
        while Instant::now() < end {
            // This timeout lets only data through that has already arrived.
            let Ok(Ok(event)) = timeout(Duration::ZERO, link.session.next()).await else { break };
            if self.take(link, event).await?.is_break() {
                break;
            }
        }
        Ok(())
    }

    /// Handles an event of the session. Breaks if the session has failed.
    async fn take(
        &mut self,
        link: &mut FleetLink,
        event: MqttEvent,
    ) -> Result<ControlFlow<MqttFailure>> {
        let (now_ms, before) = (now_ms(), self.heard.view.counts);
        let (changes, answer) = match event {
            MqttEvent::Message { topic, payload, retained: is_retained, .. } => {
                let host = link.host.as_mut();
                let answer = host.and_then(|host| host.hear(&topic, &payload, now_ms));
                let message = ReceivedMessage { topic: &topic, payload: &payload, is_retained };
                (self.heard.view.hear(message, now_ms), answer)
            }
            MqttEvent::LeftOut(message) => (self.heard.view.miss(&message, now_ms), None),
            MqttEvent::Acknowledged(_) | MqttEvent::Pong(_) => {
                return Ok(ControlFlow::Continue(()));
            }
        };
        for what in self.heard.view.counts.begun(&before) {
            (self.ear)(FleetEvent::LeftOut(what))?;
        }
        if !changes.is_empty() {
            (self.ear)(FleetEvent::Changed(&changes))?;
        }
        Ok(match answer {
            Some(state) => session_flow(publish_state(&mut link.session, state).await),
            None => ControlFlow::Continue(()),
        })
    }

    /// Requests missing births, if the options say so, and publishes the host's own state again, if
    /// that is due.
    async fn ask(&mut self, link: &mut FleetLink) -> Result<(), MqttFailure> {
        let now_ms = now_ms();
        if let Some(state) = link.host.as_mut().and_then(|host| host.due(now_ms)) {
            publish_state(&mut link.session, state).await?;
        }
        if !self.options.asks_births {
            return Ok(());
        }
        for node in self.heard.view.wants_birth(now_ms) {
            let (topic, payload) = rebirth_request(&node, now_ms);
            link.session.publish(&topic, &payload, Qos::AtMostOnce, false).await?;
        }
        Ok(())
    }
}

/// Breaks if an action has failed.
fn session_flow(done: Result<(), MqttFailure>) -> ControlFlow<MqttFailure> {
    match done {
        Ok(()) => ControlFlow::Continue(()),
        Err(failure) => ControlFlow::Break(failure),
    }
}

/// A session, and the state of this host in it.
struct FleetLink {
    session: MqttSession,
    host: Option<HostSession>,
}

/// Connects, subscribes, and publishes the birth of this host.
async fn begin(options: &FleetOptions, address: &BrokerAddress) -> Result<FleetLink, MqttFailure> {
    let mut host = options.host_id.as_ref().map(|id| HostSession::new(id, now_ms()));
    let will = host.as_ref().map(|host| last_will(host.will()));
    let mut session = MqttSession::connect(&options.brokers, address, will.as_ref()).await?;
    let filters = filters(options.group.as_deref(), host.as_ref());
    let filters: Vec<(&str, Qos)> =
        filters.iter().map(|filter| (filter.as_str(), Qos::AtLeastOnce)).collect();
    session.subscribe(&filters).await?;
    if let Some(host) = &mut host {
        publish_state(&mut session, host.birth()).await?;
    }
    Ok(FleetLink { session, host })
}

/// The filters to subscribe to. No two filters match the same topic, because a broker could send
/// its messages twice.
fn filters(group: Option<&str>, host: Option<&HostSession>) -> Vec<String> {
    let group = group.unwrap_or("+");
    let of_nodes = HEARD.iter().map(|kind| {
        let device = if kind.has_device() { "/+" } else { "" };
        format!("spBv1.0/{group}/{}/+{device}", kind.name())
    });
    let of_hosts = host.map_or("spBv1.0/STATE/+".to_owned(), |host| host.topic().to_owned());
    of_nodes.chain([of_hosts]).collect()
}

async fn publish_state(session: &mut MqttSession, state: StateMessage) -> Result<(), MqttFailure> {
    session.publish(&state.topic, &state.payload, Qos::AtLeastOnce, true).await.map(drop)
}

fn last_will(state: StateMessage) -> LastWill {
    LastWill { topic: state.topic, payload: state.payload, qos: Qos::AtLeastOnce, retain: true }
}

/// Publishes the death of this host, and closes the session. A failure has no consequence: the
/// broker then publishes the will.
async fn end(FleetLink { mut session, host }: FleetLink) {
    let Some(mut host) = host else {
        let _ = timeout(CLOSE_MAX, session.disconnect()).await;
        return;
    };
    if publish_state(&mut session, host.death(now_ms())).await.is_ok() {
        let _ = session.disconnect().await;
    }
}

/// Whether the arguments are the cause, so that every further attempt would fail too.
fn is_ours(failure: &MqttFailure) -> bool {
    let cause = &failure.cause;
    matches!(cause, MqttCause::File(..) | MqttCause::Settings(_) | MqttCause::NotSendable(_))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subscription_filters_do_not_overlap() {
        let all = filters(None, None);
        assert_eq!(all[0], "spBv1.0/+/NBIRTH/+");
        assert_eq!(all[4], "spBv1.0/+/DDATA/+/+");
        assert_eq!(all[6], "spBv1.0/STATE/+");
        let host = HostSession::new("room", 1);
        assert_eq!(filters(Some("north"), Some(&host))[6], "spBv1.0/STATE/room");
        assert_eq!(filters(Some("north"), None)[1], "spBv1.0/north/NDATA/+");
    }
}
