//! Listens to a broker for a while, or until it is told to end: the shell around [`FleetView`].
//!
//! One session at a time. If it breaks, every node is stale and the next address is tried, later
//! and later. Called by `cli::fleet`, which gets every change and every word about the
//! link, and prints them. Nothing is published but what the options ask for: the state of this host
//! (`--host-id`), and requests for births (`--rebirth`).

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::Result;
use tokio::time::{Instant, MissedTickBehavior, interval, timeout, timeout_at};

use super::ask::rebirth_request;
use super::heard::HeardMessage;
use super::host::{HostSession, StateMessage};
use super::limits::FleetLimits;
use super::news::FleetChange;
use super::stop::StopSignals;
use super::view::FleetView;
use crate::mqtt::{
    BrokerAddress, BrokerSettings, LastWill, MqttCause, MqttEvent, MqttFailure, MqttSession, Qos,
};
use crate::sparkplug::MessageKind;

/// How often it looks whether births are to be asked for, and its own state is to be told again.
const ASK_EVERY: Duration = Duration::from_millis(500);
/// The first and the longest wait before the next attempt to connect.
const AGAIN: Duration = Duration::from_secs(1);
const AGAIN_MAX: Duration = Duration::from_secs(30);
/// The longest that it reads on after the end has come: a broker that floods it holds up no end.
const REST_MAX: Duration = Duration::from_secs(1);
/// How long a broker may take to close the connection, if nothing depends on it.
const CLOSE_MAX: Duration = Duration::from_secs(1);
/// What nodes and their devices send.
const HEARD: [MessageKind; 6] = [
    MessageKind::NodeBirth,
    MessageKind::NodeData,
    MessageKind::NodeDeath,
    MessageKind::DeviceBirth,
    MessageKind::DeviceData,
    MessageKind::DeviceDeath,
];

/// Whom to listen to, and how.
#[derive(Clone, Debug)]
pub(crate) struct FleetOptions {
    /// The brokers. One of them at a time.
    pub brokers: BrokerSettings,
    /// One group; `None`: all.
    pub group: Option<String>,
    /// The name of this host, if it tells its state.
    pub host_id: Option<String>,
    /// Whether it asks for the births that are missing.
    pub asks_births: bool,
    /// How long; `None`: until SIGINT or SIGTERM.
    pub lasts: Option<Duration>,
}

/// What happens while it listens.
#[derive(Debug)]
pub(crate) enum FleetWord<'w> {
    /// A session with a broker has begun.
    Connected(&'w BrokerAddress),
    /// There is none, or no longer one.
    Failed(&'w MqttFailure),
    /// The fleet has changed.
    Changed(&'w [FleetChange]),
    /// Messages of a kind are left out; said when the first one comes.
    LeftOut(&'static str),
}

/// What is known in the end.
#[derive(Debug)]
pub(crate) struct FleetHeard {
    pub view: FleetView,
    /// Why there is no session in the end.
    pub failure: Option<MqttFailure>,
    /// Whether there was one at all.
    pub was_connected: bool,
    /// How long it listened.
    pub lasted: Duration,
}

/// Prints, or does whatever else with a word.
pub(crate) type FleetEar<'e> = &'e mut dyn FnMut(FleetWord) -> Result<()>;

/// Listens.
///
/// # Errors
/// What `ear` fails with; the machine gives no thread.
pub(crate) fn listen(options: &FleetOptions, ear: FleetEar) -> Result<FleetHeard> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let stop = StopSignals::new(options.lasts)?;
        let view = FleetView::new(FleetLimits::default(), options.group.clone());
        let (began, lasted) = (Instant::now(), Duration::ZERO);
        let heard = FleetHeard { view, failure: None, was_connected: false, lasted };
        let mut heard = FleetListener { options, ear, stop, heard }.run().await?;
        heard.lasted = began.elapsed();
        Ok(heard)
    })
}

/// This machine's clock, ms since 1970.
pub(crate) fn now_ms() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}

/// Why a session is over.
enum Over {
    /// It is to end.
    Stopped,
    /// It broke.
    Broken(MqttFailure),
}

struct FleetListener<'l> {
    options: &'l FleetOptions,
    ear: FleetEar<'l>,
    stop: StopSignals,
    heard: FleetHeard,
}

impl FleetListener<'_> {
    async fn run(mut self) -> Result<FleetHeard> {
        let mut wait = AGAIN;
        let addresses = &self.options.brokers.addresses;
        for (number, address) in (1..).zip(addresses.iter().cycle()) {
            let began = Instant::now();
            let failure = match self.session(address).await? {
                Over::Stopped => return Ok(self.heard),
                Over::Broken(failure) => failure,
            };
            (self.ear)(FleetWord::Failed(&failure))?;
            let is_ours = is_ours(&failure);
            self.heard.failure = Some(failure);
            let changes = self.heard.view.lose_link(now_ms());
            (self.ear)(FleetWord::Changed(&changes))?;
            if is_ours {
                break;
            }
            // A session that lasted makes the next attempt early again.
            wait = if began.elapsed() > AGAIN_MAX { AGAIN } else { wait };
            // Another broker may be there now.
            if number % addresses.len() != 0 && self.stop.is_going_on() {
                continue;
            }
            if timeout_at(began + wait, self.stop.wait()).await.is_ok() {
                break;
            }
            wait = (wait * 2).min(AGAIN_MAX);
        }
        Ok(self.heard)
    }

    /// One session, from its connection to its end.
    async fn session(&mut self, address: &BrokerAddress) -> Result<Over> {
        let mut link = tokio::select! {
            begun = begin(self.options, address) => match begun {
                Ok(link) => link,
                Err(failure) => return Ok(Over::Broken(failure)),
            },
            () = self.stop.wait() => return Ok(Over::Stopped),
        };
        (self.heard.was_connected, self.heard.failure) = (true, None);
        let over = self.follow(&mut link, address).await;
        if !matches!(over, Ok(Over::Broken(_))) {
            // Also if a change could not be printed: this host goes.
            end(link).await;
        }
        over
    }

    /// What comes in a session, until it breaks or is to end.
    async fn follow(&mut self, link: &mut FleetLink, address: &BrokerAddress) -> Result<Over> {
        (self.ear)(FleetWord::Connected(address))?;
        let mut asks = interval(ASK_EVERY);
        asks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let step = tokio::select! {
                event = link.session.next() => match event {
                    Ok(event) => self.take(link, event).await?,
                    Err(failure) => Err(failure),
                },
                _ = asks.tick() => self.ask(link).await,
                () = self.stop.wait() => {
                    self.take_rest(link).await?;
                    return Ok(Over::Stopped);
                }
            };
            if let Err(failure) = step {
                return Ok(Over::Broken(failure));
            }
        }
    }

    /// What has come by the end, and was not read yet; a flood of it has an end.
    async fn take_rest(&mut self, link: &mut FleetLink) -> Result<()> {
        let end = Instant::now() + REST_MAX;
        while Instant::now() < end {
            // Time for what is there already, and for nothing else.
            let Ok(Ok(event)) = timeout(Duration::ZERO, link.session.next()).await else { break };
            if self.take(link, event).await?.is_err() {
                break;
            }
        }
        Ok(())
    }

    /// An event of the session.
    async fn take(
        &mut self,
        link: &mut FleetLink,
        event: MqttEvent,
    ) -> Result<Result<(), MqttFailure>> {
        let (now_ms, before) = (now_ms(), self.heard.view.counts);
        let (changes, answer) = match event {
            MqttEvent::Message { topic, payload, retained: is_retained, .. } => {
                let host = link.host.as_mut();
                let answer = host.and_then(|host| host.hear(&topic, &payload, now_ms));
                let message = HeardMessage { topic: &topic, payload: &payload, is_retained };
                (self.heard.view.hear(message, now_ms), answer)
            }
            MqttEvent::LeftOut(message) => (self.heard.view.miss(&message, now_ms), None),
            MqttEvent::Acknowledged(_) | MqttEvent::Pong(_) => return Ok(Ok(())),
        };
        for what in self.heard.view.counts.begun(&before) {
            (self.ear)(FleetWord::LeftOut(what))?;
        }
        if !changes.is_empty() {
            (self.ear)(FleetWord::Changed(&changes))?;
        }
        Ok(match answer {
            Some(state) => tell(&mut link.session, state).await,
            None => Ok(()),
        })
    }

    /// Asks for the births that are missing, if it is to, and tells its state again, if that is
    /// due.
    async fn ask(&mut self, link: &mut FleetLink) -> Result<(), MqttFailure> {
        let now_ms = now_ms();
        if let Some(state) = link.host.as_mut().and_then(|host| host.due(now_ms)) {
            tell(&mut link.session, state).await?;
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

/// A session, and what it tells of this host.
struct FleetLink {
    session: MqttSession,
    host: Option<HostSession>,
}

/// Connects, subscribes, and tells the birth of this host.
async fn begin(options: &FleetOptions, address: &BrokerAddress) -> Result<FleetLink, MqttFailure> {
    let mut host = options.host_id.as_ref().map(|id| HostSession::new(id, now_ms()));
    let will = host.as_ref().map(|host| last_will(host.will()));
    let mut session = MqttSession::connect(&options.brokers, address, will.as_ref()).await?;
    let filters = filters(options.group.as_deref(), host.as_ref());
    let filters: Vec<(&str, Qos)> =
        filters.iter().map(|filter| (filter.as_str(), Qos::AtLeastOnce)).collect();
    session.subscribe(&filters).await?;
    if let Some(host) = &mut host {
        tell(&mut session, host.birth()).await?;
    }
    Ok(FleetLink { session, host })
}

/// What is subscribed to. No two filters fit one topic: a broker could send it twice.
fn filters(group: Option<&str>, host: Option<&HostSession>) -> Vec<String> {
    let group = group.unwrap_or("+");
    let of_nodes = HEARD.iter().map(|kind| {
        let device = if kind.has_device() { "/+" } else { "" };
        format!("spBv1.0/{group}/{}/+{device}", kind.name())
    });
    let of_hosts = host.map_or("spBv1.0/STATE/+".to_owned(), |host| host.topic().to_owned());
    of_nodes.chain([of_hosts]).collect()
}

async fn tell(session: &mut MqttSession, state: StateMessage) -> Result<(), MqttFailure> {
    session.publish(&state.topic, &state.payload, Qos::AtLeastOnce, true).await.map(drop)
}

fn last_will(state: StateMessage) -> LastWill {
    LastWill { topic: state.topic, payload: state.payload, qos: Qos::AtLeastOnce, retain: true }
}

/// Says that this host goes, and closes the session. What fails here changes nothing: the broker
/// publishes the will.
async fn end(FleetLink { mut session, host }: FleetLink) {
    let Some(mut host) = host else {
        let _ = timeout(CLOSE_MAX, session.disconnect()).await;
        return;
    };
    if tell(&mut session, host.death(now_ms())).await.is_ok() {
        let _ = session.disconnect().await;
    }
}

/// Whether the cause lies with the arguments: no other attempt ends otherwise.
fn is_ours(failure: &MqttFailure) -> bool {
    let cause = &failure.cause;
    matches!(cause, MqttCause::File(..) | MqttCause::Settings(_) | MqttCause::NotSendable(_))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_do_not_overlap() {
        let all = filters(None, None);
        assert_eq!(all[0], "spBv1.0/+/NBIRTH/+");
        assert_eq!(all[4], "spBv1.0/+/DDATA/+/+");
        assert_eq!(all[6], "spBv1.0/STATE/+");
        let host = HostSession::new("room", 1);
        assert_eq!(filters(Some("north"), Some(&host))[6], "spBv1.0/STATE/room");
        assert_eq!(filters(Some("north"), None)[1], "spBv1.0/north/NDATA/+");
    }
}
