//! Rules for edge nodes: CONNECT, will, subscriptions, birth first, the end of a connection.

use rungd_net::sparkplug::{HostState, MessageKind, Payload, Topic};

use super::rules::{Complaints, Rule, bd_seq, births, each, some, unless};
use super::story::{Connection, Published, Step, Story};

pub const RULES: &[Rule] = &[
    (&["principles-persistence-clean-session-311"], clean_by_3),
    (&["principles-persistence-clean-session-50"], clean_by_5),
    (
        &["message-flow-edge-node-birth-publish-will-message", "payloads-ndeath-will-message"],
        has_will,
    ),
    (
        &["message-flow-edge-node-birth-publish-will-message-topic", "topics-ndeath-topic"],
        will_topic,
    ),
    (&["message-flow-edge-node-birth-publish-will-message-payload"], will_payload),
    (
        &[
            "message-flow-edge-node-birth-publish-will-message-payload-bdSeq",
            "topics-nbirth-bdseq-increment",
        ],
        will_number,
    ),
    (
        &[
            "message-flow-edge-node-birth-publish-will-message-qos",
            "payloads-ndeath-will-message-qos",
        ],
        will_qos,
    ),
    (
        &[
            "message-flow-edge-node-birth-publish-will-message-will-retained",
            "payloads-ndeath-will-message-retain",
        ],
        will_retained,
    ),
    (&["message-flow-edge-node-ncmd-subscribe"], subscribes_commands),
    (&["principles-birth-certificates-order"], birth_is_first),
    (
        &[
            "operational-behavior-edge-node-intentional-disconnect-ndeath",
            "operational-behavior-edge-node-intentional-disconnect-packet",
            "payloads-ndeath-will-message-publisher",
            "payloads-ndeath-will-message-publisher-disconnect-mqtt311",
        ],
        death_before_end,
    ),
    (&["payloads-ndeath-will-message-publisher-disconnect-mqtt50"], end_with_will),
    (
        &[
            "message-flow-edge-node-birth-publish-phid-wait",
            "message-flow-edge-node-birth-publish-phid-wait-id",
            "message-flow-edge-node-birth-publish-phid-wait-online",
            "message-flow-edge-node-birth-publish-phid-wait-timestamp",
            "operational-behavior-edge-node-birth-sequence-wait",
            "operational-behavior-primary-application-state-with-multiple-servers-state-subs",
        ],
        waits_for_host,
    ),
    (
        &[
            "message-flow-edge-node-birth-publish-phid-offline",
            "operational-behavior-edge-node-termination-host-offline",
        ],
        ends_without_host,
    ),
    (&["operational-behavior-edge-node-termination-host-offline-timestamp"], ignores_old_deaths),
];

fn by_version(story: &Story, version: u8) -> impl Iterator<Item = &Connection> {
    story.connections.iter().filter(move |connection| connection.connect.version == version)
}

fn clean_by_3(story: &Story) -> Complaints {
    unless(by_version(story, 4).all(|it| it.connect.clean), "CONNECT without Clean Session")
}

fn clean_by_5(story: &Story) -> Complaints {
    let fits = |it: &Connection| it.connect.clean && it.connect.session_expiry_s == 0;
    unless(by_version(story, 5).all(fits), "CONNECT without Clean Start, or its session stays")
}

fn wills(story: &Story) -> Vec<&Published> {
    story.connections.iter().filter_map(|it| it.connect.will.as_ref()).collect()
}

fn has_will(story: &Story) -> Complaints {
    let mut wrong = some(&story.connections, "connection");
    let has = story.connections.iter().all(|it| it.connect.will.is_some());
    wrong.extend(unless(has, "CONNECT without a will"));
    wrong
}

fn will_topic(story: &Story) -> Complaints {
    let topic = story.topic(MessageKind::NodeDeath);
    each(wills(story), "the will is no NDEATH of this node", |will| will.topic == topic)
}

fn will_payload(story: &Story) -> Complaints {
    each(wills(story), "no payload of Sparkplug", |will| Payload::read(&will.payload).is_ok())
}

fn will_number(story: &Story) -> Complaints {
    let numbers: Vec<Option<u64>> = wills(story).into_iter().map(bd_seq).collect();
    let follows = |pair: &[Option<u64>]| match pair {
        [Some(before), Some(after)] => *after == (before + 1) % 256,
        _ => false,
    };
    let in_range = numbers.iter().all(|number| number.is_some_and(|number| number < 256));
    let fits = in_range && numbers.windows(2).all(follows);
    unless(fits, "bdSeq of the wills does not rise by one from 0 to 255")
}

fn will_qos(story: &Story) -> Complaints {
    each(wills(story), "the will has not QoS 1", |will| will.qos == 1)
}

fn will_retained(story: &Story) -> Complaints {
    each(wills(story), "the will is retained", |will| !will.retain)
}

fn subscribes_commands(story: &Story) -> Complaints {
    let wanted = (story.topic(MessageKind::NodeCommand), 1);
    let all = story.connections.iter().filter(|it| births(it).next().is_some());
    let fits = |it: &Connection| it.subscribed().any(|filter| *filter == wanted);
    unless(all.into_iter().all(fits), "no subscription of NCMD with QoS 1 before the birth")
}

/// If a connection ends before its birth, its first message is NDEATH.
fn birth_is_first(story: &Story) -> Complaints {
    let firsts: Vec<&Published> =
        story.connections.iter().filter_map(|connection| connection.sent().next()).collect();
    let mut wrong = some(&firsts, "message");
    let kinds = [Some(MessageKind::NodeBirth), Some(MessageKind::NodeDeath)];
    wrong.extend(each(firsts, "comes before the birth", |sent| kinds.contains(&sent.kind())));
    wrong
}

/// A connection that the client ends has NDEATH as its last message, followed only by DISCONNECT.
fn death_before_end(story: &Story) -> Complaints {
    let mut wrong = Vec::new();
    for connection in &story.connections {
        let Some(end) = connection.place(|step| matches!(step, Step::Disconnected(_))) else {
            continue;
        };
        let last = connection.steps[..end].iter().rev().find_map(Step::sent);
        let is_death = last.is_some_and(|sent| sent.kind() == Some(MessageKind::NodeDeath));
        let number = last.and_then(bd_seq);
        let same = number == connection.connect.will.as_ref().and_then(bd_seq);
        wrong.extend(unless(is_death && same, "DISCONNECT without an NDEATH of this session"));
    }
    wrong
}

fn end_with_will(story: &Story) -> Complaints {
    let ends = by_version(story, 5).flat_map(|connection| &connection.steps);
    let fits = ends.into_iter().all(|step| match step {
        Step::Disconnected(reason) => *reason == 4,
        Step::Subscribed(_) | Step::Sent(_) | Step::Got(_) => true,
    });
    unless(fits, "DISCONNECT of MQTT 5 without the reason `Disconnect with Will Message`")
}

/// The primary host's state in a step that delivers one.
fn primary(story: &Story, step: &Step) -> Option<HostState> {
    let topic = Topic::of_host(story.host.as_ref()?).to_string();
    match step {
        Step::Got(got) if got.topic == topic => HostState::read(&got.payload).ok(),
        Step::Got(_) | Step::Subscribed(_) | Step::Sent(_) | Step::Disconnected(_) => None,
    }
}

fn waits_for_host(story: &Story) -> Complaints {
    let Some(host) = &story.host else { return Vec::new() };
    let topic = Topic::of_host(host).to_string();
    let mut wrong = Vec::new();
    for connection in &story.connections {
        let Some(born) = connection.place(|step| step.sent().is_some()) else { continue };
        let subscribed = connection.subscribed().any(|(filter, _)| *filter == topic);
        wrong.extend(unless(subscribed, "no subscription of the primary host's STATE"));
        let told = connection.steps[..born].iter().filter_map(|step| primary(story, step));
        // A state that is older than a state before it is ignored.
        let newest =
            told.reduce(|known, it| if it.timestamp < known.timestamp { known } else { it });
        let is_online = newest.is_some_and(|state| state.online);
        wrong.extend(unless(is_online, "born while the primary host is not online"));
    }
    wrong
}

/// After a death of the primary host that is not older than its birth, the node sends only NDEATH.
fn ends_without_host(story: &Story) -> Complaints {
    let mut wrong = Vec::new();
    for connection in &story.connections {
        let (mut since, mut is_over) = (0, false);
        for step in &connection.steps {
            if let Some(state) = primary(story, step) {
                is_over |= !state.online && state.timestamp >= since && since > 0;
                since = if state.online { since.max(state.timestamp) } else { since };
            }
            let goes_on = step.sent().is_some_and(|it| it.kind() != Some(MessageKind::NodeDeath));
            wrong.extend(unless(!(is_over && goes_on), "goes on while the primary host is gone"));
        }
    }
    wrong
}

/// A death of the primary host that is older than its birth belongs to an older session.
fn ignores_old_deaths(story: &Story) -> Complaints {
    let mut wrong = Vec::new();
    for connection in &story.connections {
        let mut since = 0;
        for (at, step) in connection.steps.iter().enumerate() {
            let Some(state) = primary(story, step) else { continue };
            let next = connection.steps[at..].iter().find_map(Step::sent);
            let ends = next.is_some_and(|sent| sent.kind() == Some(MessageKind::NodeDeath));
            let is_old = !state.online && state.timestamp < since;
            wrong.extend(unless(!(is_old && ends), "ends by an old death of the primary host"));
            since = if state.online { since.max(state.timestamp) } else { since };
        }
    }
    wrong
}
