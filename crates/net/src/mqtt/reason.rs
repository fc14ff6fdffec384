//! The reason codes of a broker as texts for people, with remedies. `failure` prints them.

/// A reason code of MQTT 5: its text, and a remedy.
pub(super) fn of_version_5(code: u8) -> (&'static str, &'static str) {
    match code {
        0x80 => ("the broker gives no reason", "see the broker's log"),
        0x81 => ("the broker could not read a packet of ours", "see the broker's log"),
        0x82 => ("the broker reports a protocol error in a packet of ours", LOG),
        0x83 => ("a rule of the broker forbids it", LOG),
        0x84 => ("the broker does not speak this version of MQTT", "set the other version"),
        0x85 => ("the broker does not accept the client id", "set another client id"),
        0x86 => ("user name or password is wrong", "correct the login"),
        0x87 => ("the user is not allowed to do this", "allow it in the broker's settings"),
        0x88 => ("the broker is not available", "wait, or name another broker"),
        0x89 => ("the broker is busy", "wait, or name another broker"),
        0x8a => ("the broker has banned this client", "lift the ban in the broker's settings"),
        0x8b => ("the broker is shutting down", "wait, or name another broker"),
        0x8c => ("the broker requires a different login method", "allow user and password"),
        0x8d => ("the broker received nothing for one and a half keepalives", LINK),
        0x8e => ("another client with the same client id has connected", "give each its own id"),
        0x8f => ("the broker does not accept the topic filter", "correct the filter"),
        0x90 => ("the broker does not accept the topic", "correct the topic"),
        0x91 => ("the broker still has a message with this number", LOG),
        0x93 => ("more messages were unanswered than the broker allows", LOG),
        0x95 => ("the packet is longer than the broker allows", "raise the broker's limit"),
        0x96 => ("the messages came too fast for the broker", "send less, or raise its limit"),
        0x97 => ("a quota of the broker is used up", "raise the quota"),
        0x98 => ("the broker's administrator has closed the connection", "ask the administrator"),
        0x99 => ("the broker does not accept the payload's format", LOG),
        0x9a => ("the broker keeps no retained messages", "turn them on in the broker"),
        0x9b => ("the broker does not offer this QoS", "allow QoS 1 in the broker"),
        0x9c => ("the broker refers to a different broker for now", "name another broker"),
        0x9d => ("the broker has moved", "name the other broker"),
        0x9e => ("the broker has no shared subscriptions", "subscribe without `$share`"),
        0x9f => ("too many clients connect at once", "wait"),
        0xa0 => ("the connection has reached its maximum time", "connect again"),
        0xa2 => ("the broker has no filters with wildcards", "turn them on in the broker"),
        _ => ("the broker sent a code that MQTT does not define", LOG),
    }
}

/// A return code of MQTT 3.1.1 (CONNACK, SUBACK): its text, and a remedy.
pub(super) fn of_version_3(code: u8) -> (&'static str, &'static str) {
    match code {
        1 => of_version_5(0x84),
        2 => of_version_5(0x85),
        3 => of_version_5(0x88),
        4 => of_version_5(0x86),
        5 => ("the broker does not admit this user, or a client without one", "correct the login"),
        0x80 => ("the broker refuses it without a reason", "allow it in the broker's settings"),
        other => of_version_5(other),
    }
}

const LOG: &str = "see the broker's log";
const LINK: &str = "look at the link";
