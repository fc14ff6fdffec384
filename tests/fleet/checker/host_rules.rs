//! Rules for host applications: STATE, subscriptions, and the commands that they send.

use rungd_net::sparkplug::{MessageKind, MetricContent, Topic, vocabulary};
use serde_json::Value;

use super::rules::{Complaints, Rule, each, is_about, metric, some, unless};
use super::story::{Connection, Published, Step, Story};

pub const RULES: &[Rule] = &[
    (&["message-flow-phid-sparkplug-clean-session-311"], |story| {
        unless(by_version(story, 4).all(|it| it.connect.clean), "CONNECT without Clean Session")
    }),
    (&["message-flow-phid-sparkplug-clean-session-50"], |story| {
        let fits = |it: &Connection| it.connect.clean && it.connect.session_expiry_s == 0;
        unless(by_version(story, 5).all(fits), "CONNECT without Clean Start, or its session stays")
    }),
    (
        &[
            "host-topic-phid-death-required",
            "operational-behavior-host-application-connect-will",
            "payloads-state-will-message",
            "host-topic-phid-death-topic",
            "operational-behavior-host-application-connect-will-topic",
        ],
        will_topic,
    ),
    (
        &[
            "host-topic-phid-death-qos",
            "operational-behavior-host-application-connect-will-qos",
            "payloads-state-will-message-qos",
        ],
        |story| each(wills(story), "the will has not QoS 1", |will| will.qos == 1),
    ),
    (
        &[
            "host-topic-phid-death-retain",
            "operational-behavior-host-application-connect-will-retained",
            "payloads-state-will-message-retain",
        ],
        |story| each(wills(story), "the will is not retained", |will| will.retain),
    ),
    (
        &[
            "host-topic-phid-death-payload",
            "host-topic-phid-death-payload-timestamp-connect",
            "operational-behavior-host-application-connect-will-payload",
            "payloads-state-will-message-payload",
        ],
        |story| {
            each(wills(story), "the will says not that the host is gone", |will| {
                is_state(will, false, will.at_ms)
            })
        },
    ),
    (
        &[
            "host-topic-phid-birth-sub-required",
            "message-flow-phid-sparkplug-subscription",
            "payloads-state-subscribe",
        ],
        subscribes_first,
    ),
    (
        &[
            "intro-sparkplug-host-state",
            "components-ph-state",
            "conformance-primary-host",
            "principles-birth-certificates-order",
            "host-topic-phid-birth-message",
            "operational-behavior-primary-application-state-with-multiple-servers-state",
            "host-topic-phid-birth-topic",
            "operational-behavior-host-application-connect-birth-topic",
        ],
        birth_is_first,
    ),
    (
        &[
            "host-topic-phid-birth-required",
            "message-flow-phid-sparkplug-state-publish",
            "operational-behavior-host-application-connect-birth",
        ],
        birth_follows_subscriptions,
    ),
    (
        &[
            "host-topic-phid-birth-qos",
            "host-topic-phid-birth-retain",
            "operational-behavior-host-application-connect-birth-qos",
            "operational-behavior-host-application-connect-birth-retained",
            "payloads-state-birth",
        ],
        |story| {
            each(births(story), "STATE without QoS 1, or not retained", |it| {
                it.qos == 1 && it.retain
            })
        },
    ),
    (
        &[
            "host-topic-phid-birth-payload",
            "message-flow-phid-sparkplug-state-publish-payload",
            "operational-behavior-host-application-connect-birth-payload",
            "payloads-state-birth-payload",
        ],
        |story| {
            each(births(story), "STATE says not that the host is there", |it| {
                state(it).is_some_and(|(online, _)| online)
            })
        },
    ),
    (
        &[
            "host-topic-phid-birth-payload-timestamp",
            "message-flow-phid-sparkplug-state-publish-payload-timestamp",
            "operational-behavior-host-application-multi-server-timestamp",
        ],
        one_time,
    ),
    (
        &[
            "operational-behavior-host-application-termination",
            "operational-behavior-host-application-death-topic",
            "operational-behavior-host-application-death-payload",
            "operational-behavior-host-application-death-qos",
            "operational-behavior-host-application-death-retained",
            "operational-behavior-host-application-disconnect-intentional",
            "host-topic-phid-death-payload-timestamp-disconnect-clean",
        ],
        death_before_end,
    ),
    (&["message-flow-hid-sparkplug-state-message-delivered"], answers_a_death),
    (
        &[
            "topics-ncmd-topic",
            "topics-ncmd-mqtt",
            "payloads-ncmd-qos",
            "payloads-ncmd-retain",
            "operational-behavior-data-commands-ncmd-verb",
            "operational-behavior-data-commands-ncmd-rebirth-verb",
        ],
        commands_are_plain,
    ),
    (&["topics-ncmd-timestamp", "payloads-ncmd-timestamp"], |story| {
        each(commands(story), "no timestamp of its time", |it| {
            it.read().timestamp.is_some_and(|told| is_about(told, it.at_ms))
        })
    }),
    (&["payloads-ncmd-seq"], |story| {
        each(commands(story), "a command with a seq", |it| it.read().seq.is_none())
    }),
    (
        &[
            "topics-ncmd-payload",
            "operational-behavior-data-commands-ncmd-rebirth-name",
            "operational-behavior-data-commands-ncmd-rebirth-value",
            "operational-behavior-data-commands-ncmd-metric-name",
            "operational-behavior-data-commands-ncmd-metric-value",
        ],
        commands_ask_for_births,
    ),
];

fn by_version(story: &Story, version: u8) -> impl Iterator<Item = &Connection> {
    story.connections.iter().filter(move |connection| connection.connect.version == version)
}

fn own_topic(story: &Story) -> String {
    Topic::of_host(story.host.as_deref().unwrap_or_default()).to_string()
}

/// The contents of a STATE: whether the host is online, and the time. Reads only keys and types.
fn state(message: &Published) -> Option<(bool, u64)> {
    let state: Value = serde_json::from_slice(&message.payload).ok()?;
    let known = state.as_object()?.len() == 2;
    known.then_some((state["online"].as_bool()?, state["timestamp"].as_u64()?))
}

fn is_state(message: &Published, online: bool, at_ms: u64) -> bool {
    state(message).is_some_and(|(is, time)| is == online && is_about(time, at_ms))
}

fn wills(story: &Story) -> Vec<&Published> {
    story.connections.iter().filter_map(|it| it.connect.will.as_ref()).collect()
}

fn will_topic(story: &Story) -> Complaints {
    let topic = own_topic(story);
    let fits = |it: &Connection| it.connect.will.as_ref().is_some_and(|will| will.topic == topic);
    let mut wrong = some(&story.connections, "connection");
    wrong.extend(unless(story.connections.iter().all(fits), "CONNECT without STATE as its will"));
    wrong
}

/// The first STATE of each connection, and each STATE that reports the host as online: an answer to
/// a death is a birth too.
fn births(story: &Story) -> Vec<&Published> {
    story.connections.iter().flat_map(births_of).collect()
}

fn births_of(connection: &Connection) -> Vec<&Published> {
    let states = connection.sent().filter(|sent| sent.is_state()).enumerate();
    let is_born = |it: &Published| state(it).is_some_and(|(online, _)| online);
    states.filter(|(at, it)| *at == 0 || is_born(it)).map(|(_, it)| it).collect()
}

/// In each connection the birth follows the subscriptions and precedes all other messages.
fn birth_follows_subscriptions(story: &Story) -> Complaints {
    let topic = own_topic(story);
    let fits = |connection: &Connection| {
        let subscribed = connection.place(|step| matches!(step, Step::Subscribed(_)));
        let first = connection.place(|step| step.sent().is_some());
        let is_birth = connection
            .sent()
            .next()
            .is_some_and(|it| it.topic == topic && state(it).is_some_and(|(online, _)| online));
        is_birth && subscribed.zip(first).is_some_and(|(subscribed, first)| subscribed < first)
    };
    let wrong = "a connection without the birth after its subscriptions";
    unless(story.connections.iter().all(fits), wrong)
}

fn subscribes_first(story: &Story) -> Complaints {
    let mut wrong = Vec::new();
    let topic = own_topic(story);
    for connection in &story.connections {
        let Some(born) = connection.place(|step| step.sent().is_some()) else { continue };
        let before = connection.steps[..born].iter().flat_map(|step| match step {
            Step::Subscribed(filters) => filters.as_slice(),
            Step::Sent(_) | Step::Got(_) | Step::Disconnected(_) => &[],
        });
        let filters: Vec<&str> = before.map(|(filter, _)| filter.as_str()).collect();
        let of_nodes = filters.iter().any(|it| it.contains("NBIRTH") || *it == "spBv1.0/#");
        let fits = of_nodes && filters.contains(&topic.as_str());
        wrong.extend(unless(fits, "STATE before the subscriptions of nodes and of itself"));
    }
    wrong
}

fn birth_is_first(story: &Story) -> Complaints {
    let topic = own_topic(story);
    let firsts: Vec<&Published> =
        story.connections.iter().filter_map(|connection| connection.sent().next()).collect();
    let mut wrong = some(&firsts, "message");
    wrong.extend(each(firsts, "comes before the birth of the host", |it| it.topic == topic));
    wrong
}

fn one_time(story: &Story) -> Complaints {
    let mut wrong = some(&births(story), "STATE");
    for connection in &story.connections {
        let will = connection.connect.will.as_ref().and_then(state).map(|(_, time)| time);
        let born = connection.sent().filter(|it| state(it).is_some_and(|(online, _)| online));
        wrong.extend(each(born, "STATE has another time than its will", |it| {
            state(it).map(|(_, time)| time) == will
        }));
    }
    wrong
}

fn death_before_end(story: &Story) -> Complaints {
    let topic = own_topic(story);
    let is_end = |step: &Step| matches!(step, Step::Disconnected(_));
    let ends = story.connections.iter().filter(|it| it.steps.iter().any(is_end));
    let mut wrong = some(&ends.collect::<Vec<_>>(), "connection that was closed in order");
    for connection in &story.connections {
        let Some(end) = connection.place(|step| matches!(step, Step::Disconnected(_))) else {
            continue;
        };
        let last = connection.steps[..end].iter().rev().find_map(Step::sent);
        let fits = last.is_some_and(|it| {
            it.topic == topic && it.qos == 1 && it.retain && is_state(it, false, it.at_ms)
        });
        wrong.extend(unless(fits, "DISCONNECT without the death of the host before it"));
    }
    wrong
}

fn answers_a_death(story: &Story) -> Complaints {
    let topic = own_topic(story);
    let is_death = |step: &Step| match step {
        Step::Got(got) => got.topic == topic && state(got).is_some_and(|(online, _)| !online),
        Step::Sent(_) | Step::Subscribed(_) | Step::Disconnected(_) => false,
    };
    let mut wrong = Vec::new();
    for connection in &story.connections {
        let born = connection.place(|step| step.sent().is_some()).unwrap_or(usize::MAX);
        for (at, step) in connection.steps.iter().enumerate().skip(born.saturating_add(1)) {
            let next = connection.steps[at..].iter().find_map(Step::sent);
            let lives = next
                .is_some_and(|it| it.topic == topic && state(it).is_some_and(|(online, _)| online));
            wrong.extend(unless(!is_death(step) || lives, "its death is not answered"));
        }
    }
    wrong
}

/// All sent messages except STATE.
fn commands(story: &Story) -> Vec<&Published> {
    story.sent().map(|(_, sent)| sent).filter(|sent| !sent.is_state()).collect()
}

fn commands_are_plain(story: &Story) -> Complaints {
    each(commands(story), "no NCMD with QoS 0, not retained", |it| {
        it.kind() == Some(MessageKind::NodeCommand) && it.qos == 0 && !it.retain
    })
}

fn commands_ask_for_births(story: &Story) -> Complaints {
    each(commands(story), "another command than `Node Control/Rebirth` = true", |it| {
        let metrics = it.read().metrics;
        let asks = metric(&metrics, vocabulary::REBIRTH)
            .is_some_and(|metric| metric.content == Some(MetricContent::Boolean(true)));
        metrics.len() == 1 && asks
    })
}
