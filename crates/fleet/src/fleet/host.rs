//! The state of this host application, with `--host-id`: what it publishes about itself, and when
//! (specification, 4.2.3 and 5.13).
//!
//! Edge nodes with a `primary-host` hold back their values while that host is offline. A session is
//! one connection: its will and its birth have the same time. This module is pure; `listen` sends
//! the messages.

use rungd_net::sparkplug::{HostState, Topic};

/// The minimum time between two answers to deaths of this host that somebody else published, ms.
const REPEAT_MS: u64 = 200;

/// The state of a host in one connection.
#[derive(Clone, Debug)]
pub(crate) struct HostSession {
    topic: String,
    began_ms: u64,
    /// Whether the birth is published.
    is_born: bool,
    repeated_ms: Option<u64>,
    /// Whether a death by somebody else still has no answer, because it came too soon after the
    /// last answer.
    owes: bool,
}

/// A state to publish: with QoS 1, retained by the broker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct StateMessage {
    pub topic: String,
    pub payload: Vec<u8>,
}

impl HostSession {
    /// The state before a connection is opened. `host` is a name that
    /// [`rungd_net::sparkplug::check_name`] accepts.
    pub fn new(host: &str, now_ms: u64) -> HostSession {
        let topic = Topic::of_host(host).to_string();
        HostSession { topic, began_ms: now_ms, is_born: false, repeated_ms: None, owes: false }
    }

    /// The topic of the state, to which this host subscribes too.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// The will, which the broker publishes if the connection breaks.
    pub fn will(&self) -> StateMessage {
        self.state(false, self.began_ms)
    }

    /// The birth, after the subscriptions are confirmed.
    pub fn birth(&mut self) -> StateMessage {
        self.is_born = true;
        self.state(true, self.began_ms)
    }

    /// Takes a message. Returns the birth to publish at once, if the message is a death of this
    /// host by somebody else (the will of an earlier connection).
    pub fn hear(&mut self, topic: &str, payload: &[u8], now_ms: u64) -> Option<StateMessage> {
        if topic != self.topic || !self.is_born {
            return None;
        }
        // The last state counts, because the broker retains it.
        let state = HostState::read(payload).ok()?;
        self.owes = !state.online;
        self.due(now_ms)
    }

    /// The birth again, if a death by somebody else waits for an answer.
    pub fn due(&mut self, now_ms: u64) -> Option<StateMessage> {
        let waits = |last: u64| now_ms.saturating_sub(last) < REPEAT_MS;
        if !self.owes || self.repeated_ms.is_some_and(waits) {
            return None;
        }
        (self.repeated_ms, self.owes) = (Some(now_ms), false);
        Some(self.state(true, self.began_ms))
    }

    /// The death, before the connection is closed.
    pub fn death(&mut self, now_ms: u64) -> StateMessage {
        (self.is_born, self.owes) = (false, false);
        self.state(false, now_ms)
    }

    fn state(&self, online: bool, timestamp: u64) -> StateMessage {
        let payload = HostState { online, timestamp }.bytes();
        StateMessage { topic: self.topic.clone(), payload }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(message: &StateMessage) -> &str {
        std::str::from_utf8(&message.payload).expect("JSON")
    }

    #[test]
    fn the_will_and_the_birth_of_a_host_have_the_same_timestamp() {
        let mut host = HostSession::new("control-room", 1000);
        assert_eq!(host.will().topic, "spBv1.0/STATE/control-room");
        assert_eq!(text(&host.will()), r#"{"online":false,"timestamp":1000}"#);
        assert_eq!(text(&host.birth()), r#"{"online":true,"timestamp":1000}"#);
        assert_eq!(text(&host.death(5000)), r#"{"online":false,"timestamp":5000}"#);
    }

    #[test]
    fn a_death_published_by_another_client_is_answered_with_a_birth() {
        let mut host = HostSession::new("h", 1000);
        let dead = HostState { online: false, timestamp: 900 }.bytes();
        let topic = host.topic().to_owned();
        assert_eq!(host.hear(&topic, &dead, 1001), None, "it is not born yet");
        host.birth();
        let answer = host.hear(&topic, &dead, 1002).expect("it lives");
        assert_eq!(text(&answer), r#"{"online":true,"timestamp":1000}"#);
        assert_eq!(host.hear(&topic, &dead, 1003), None, "a flood is not answered one by one");
        assert!(host.hear(&topic, &dead, 1202).is_some());
        assert_eq!(host.hear(&topic, &dead, 1203), None);
        assert_eq!(host.due(1401), None);
        assert!(host.due(1402).is_some(), "the last death of a flood is answered too");
        assert_eq!(host.due(9000), None, "once");
        let alive = HostState { online: true, timestamp: 1000 }.bytes();
        assert_eq!(host.hear(&topic, &alive, 9000), None);
        assert_eq!(host.hear("spBv1.0/STATE/other", &dead, 9000), None);
        assert_eq!(host.hear(&topic, b"OFFLINE", 9000), None);
    }
}
