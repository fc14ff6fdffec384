//! Stories of a host, each with one fault, and the statements that must notice it.

use rungd_net::sparkplug::{HostState, MessageKind, MetricContent};

use super::spoil::{Spoiler, change, first, leave_out, metric, will};
use super::story::{Published, Step, Story};

const COMMAND: MessageKind = MessageKind::NodeCommand;

/// All STATEs that the host publishes in its first connection. The last one is its death.
fn states(story: &mut Story) -> Vec<&mut Published> {
    let steps = story.connections[0].steps.iter_mut();
    steps.filter_map(Step::sent_mut).filter(|sent| sent.is_state()).collect()
}

fn birth(story: &mut Story) -> &mut Published {
    states(story).remove(0)
}

fn death(story: &mut Story) -> &mut Published {
    states(story).pop().expect("a death")
}

fn state(online: bool, timestamp: u64) -> Vec<u8> {
    HostState { online, timestamp }.bytes()
}

pub const OF_HOSTS: &[Spoiler] = &[
    (&["message-flow-phid-sparkplug-clean-session-311"], |s| {
        s.connections[0].connect.clean = false
    }),
    (&["message-flow-phid-sparkplug-clean-session-50"], |s| s.connections[1].connect.clean = false),
    (
        &["host-topic-phid-death-required", "operational-behavior-host-application-connect-will"],
        |s| s.connections[0].connect.will = None,
    ),
    (
        &[
            "payloads-state-will-message",
            "host-topic-phid-death-topic",
            "operational-behavior-host-application-connect-will-topic",
        ],
        |s| will(s).topic = "STATE/room".to_owned(),
    ),
    (
        &[
            "host-topic-phid-death-qos",
            "operational-behavior-host-application-connect-will-qos",
            "payloads-state-will-message-qos",
        ],
        |s| will(s).qos = 0,
    ),
    (
        &[
            "host-topic-phid-death-retain",
            "operational-behavior-host-application-connect-will-retained",
            "payloads-state-will-message-retain",
        ],
        |s| will(s).retain = false,
    ),
    (
        &[
            "host-topic-phid-death-payload",
            "operational-behavior-host-application-connect-will-payload",
            "payloads-state-will-message-payload",
        ],
        |s| will(s).payload = b"OFFLINE".to_vec(),
    ),
    (&["host-topic-phid-death-payload-timestamp-connect"], |s| will(s).payload = state(false, 5)),
    (
        &[
            "host-topic-phid-birth-sub-required",
            "message-flow-phid-sparkplug-subscription",
            "payloads-state-subscribe",
        ],
        |s| s.connections[0].steps.swap(0, 1),
    ),
    (&["intro-sparkplug-host-state", "components-ph-state", "conformance-primary-host"], |s| {
        leave_out(s, |step| step.sent().is_some_and(Published::is_state))
    }),
    // One of two connections publishes nothing, or publishes too early.
    (
        &[
            "host-topic-phid-birth-required",
            "message-flow-phid-sparkplug-state-publish",
            "operational-behavior-host-application-connect-birth",
        ],
        |s| s.connections[1].steps.truncate(1),
    ),
    (
        &[
            "host-topic-phid-birth-required",
            "message-flow-phid-sparkplug-state-publish",
            "operational-behavior-host-application-connect-birth",
        ],
        |s| s.connections[0].steps.swap(0, 1),
    ),
    // A fault in a birth that answers a death.
    (&["host-topic-phid-birth-qos", "payloads-state-birth"], |s| states(s).remove(1).qos = 0),
    (&["host-topic-phid-birth-retain"], |s| states(s).remove(1).retain = false),
    (&["operational-behavior-host-application-termination"], |s| {
        leave_out(s, |step| matches!(step, Step::Disconnected(_)));
    }),
    (
        &[
            "principles-birth-certificates-order",
            "host-topic-phid-birth-message",
            "operational-behavior-primary-application-state-with-multiple-servers-state",
        ],
        |s| s.connections[0].steps.swap(1, 4),
    ),
    (
        &[
            "host-topic-phid-birth-topic",
            "operational-behavior-host-application-connect-birth-topic",
        ],
        |s| birth(s).topic = "spBv1.0/STATE/other".to_owned(),
    ),
    (
        &[
            "host-topic-phid-birth-qos",
            "operational-behavior-host-application-connect-birth-qos",
            "payloads-state-birth",
        ],
        |s| birth(s).qos = 0,
    ),
    (
        &[
            "host-topic-phid-birth-retain",
            "operational-behavior-host-application-connect-birth-retained",
        ],
        |s| birth(s).retain = false,
    ),
    (
        &[
            "host-topic-phid-birth-payload",
            "message-flow-phid-sparkplug-state-publish-payload",
            "operational-behavior-host-application-connect-birth-payload",
            "payloads-state-birth-payload",
        ],
        |s| birth(s).payload = b"ONLINE".to_vec(),
    ),
    (
        &[
            "host-topic-phid-birth-payload-timestamp",
            "message-flow-phid-sparkplug-state-publish-payload-timestamp",
            "operational-behavior-host-application-multi-server-timestamp",
        ],
        |s| birth(s).payload = state(true, 77),
    ),
    (&["operational-behavior-host-application-termination"], |s| {
        s.connections[0].steps.remove(5);
    }),
    (&["operational-behavior-host-application-death-topic"], |s| {
        death(s).topic = "spBv1.0/STATE/other".to_owned();
    }),
    (&["operational-behavior-host-application-death-payload"], |s| {
        death(s).payload = b"OFFLINE".to_vec();
    }),
    (&["host-topic-phid-death-payload-timestamp-disconnect-clean"], |s| {
        death(s).payload = state(false, 5);
    }),
    (&["operational-behavior-host-application-death-qos"], |s| death(s).qos = 0),
    (&["operational-behavior-host-application-death-retained"], |s| death(s).retain = false),
    (&["operational-behavior-host-application-disconnect-intentional"], |s| {
        s.connections[0].steps.swap(4, 5);
    }),
    (&["message-flow-hid-sparkplug-state-message-delivered"], |s| {
        s.connections[0].steps.remove(3);
    }),
    (&["topics-ncmd-topic"], |s| first(s, COMMAND).topic = "spBv1.0/plant/NCMD".to_owned()),
    (
        &[
            "operational-behavior-data-commands-ncmd-verb",
            "operational-behavior-data-commands-ncmd-rebirth-verb",
        ],
        |s| first(s, COMMAND).topic = "spBv1.0/plant/DCMD/press/io".to_owned(),
    ),
    (&["topics-ncmd-mqtt", "payloads-ncmd-qos"], |s| first(s, COMMAND).qos = 1),
    (&["payloads-ncmd-retain"], |s| first(s, COMMAND).retain = true),
    (&["topics-ncmd-timestamp", "payloads-ncmd-timestamp"], |s| {
        change(s, COMMAND, |payload| payload.timestamp = None);
    }),
    (&["payloads-ncmd-seq"], |s| change(s, COMMAND, |payload| payload.seq = Some(0))),
    (&["topics-ncmd-payload"], |s| change(s, COMMAND, |payload| payload.metrics.clear())),
    (
        &[
            "operational-behavior-data-commands-ncmd-rebirth-name",
            "operational-behavior-data-commands-ncmd-metric-name",
        ],
        |s| metric(s, COMMAND, 0, |it| it.name = Some("Rebirth".to_owned())),
    ),
    (
        &[
            "operational-behavior-data-commands-ncmd-rebirth-value",
            "operational-behavior-data-commands-ncmd-metric-value",
        ],
        |s| metric(s, COMMAND, 0, |it| it.content = Some(MetricContent::Long(1))),
    ),
];
