//! Stories of an edge node, each with one fault, and the statements that must notice it.

use rungd_net::sparkplug::{DataType, HostState, MessageKind, MetricContent};

use super::spoil::{Spoiler, change, first, leave_out, metric, will};
use super::story::{Published, Step, Story};

const BIRTH: MessageKind = MessageKind::NodeBirth;
const DATA: MessageKind = MessageKind::NodeData;
const DEATH: MessageKind = MessageKind::NodeDeath;

/// The primary host's first state.
fn primary(story: &mut Story) -> &mut Published {
    let steps = story.connections[0].steps.iter_mut();
    let mut told = steps.filter_map(|step| match step {
        Step::Got(got) => Some(got),
        Step::Sent(_) | Step::Subscribed(_) | Step::Disconnected(_) => None,
    });
    told.find(|got| got.is_state()).expect("the story has a primary host")
}

/// Faults of CONNECT, will, subscriptions, order and end.
pub const OF_CONNECTIONS: &[Spoiler] = &[
    (&["principles-persistence-clean-session-311"], |s| s.connections[0].connect.clean = false),
    (&["principles-persistence-clean-session-50"], |s| {
        s.connections[2].connect.session_expiry_s = 60;
    }),
    (&["message-flow-edge-node-birth-publish-will-message", "payloads-ndeath-will-message"], |s| {
        s.connections[1].connect.will = None
    }),
    (&["message-flow-edge-node-birth-publish-will-message-topic", "topics-ndeath-topic"], |s| {
        will(s).topic = "spBv1.0/plant/NDEATH/other".to_owned()
    }),
    (&["message-flow-edge-node-birth-publish-will-message-payload"], |s| {
        will(s).payload = b"dead".to_vec();
    }),
    (
        &[
            "message-flow-edge-node-birth-publish-will-message-payload-bdSeq",
            "topics-nbirth-bdseq-increment",
        ],
        |s| drop(s.connections.remove(1)),
    ),
    (
        &[
            "message-flow-edge-node-birth-publish-will-message-qos",
            "payloads-ndeath-will-message-qos",
        ],
        |s| will(s).qos = 0,
    ),
    (
        &[
            "message-flow-edge-node-birth-publish-will-message-will-retained",
            "payloads-ndeath-will-message-retain",
        ],
        |s| will(s).retain = true,
    ),
    (&["message-flow-edge-node-ncmd-subscribe"], |s| {
        leave_out(s, |step| matches!(step, Step::Subscribed(_)));
    }),
    (&["principles-birth-certificates-order"], |s| {
        let data = Step::Sent(first(s, DATA).clone());
        s.connections[0].steps.insert(0, data);
    }),
    (
        &[
            "operational-behavior-edge-node-intentional-disconnect-ndeath",
            "payloads-ndeath-will-message-publisher",
            "payloads-ndeath-will-message-publisher-disconnect-mqtt311",
        ],
        |s| leave_out(s, |step| step.sent().is_some_and(|it| it.kind() == Some(DEATH))),
    ),
    (&["operational-behavior-edge-node-intentional-disconnect-packet"], |s| {
        let data = Step::Sent(first(s, DATA).clone());
        let steps = &mut s.connections[0].steps;
        steps.insert(steps.len() - 1, data);
    }),
    (&["payloads-ndeath-will-message-publisher-disconnect-mqtt50"], |s| {
        *s.connections[2].steps.last_mut().expect("an end") = Step::Disconnected(0);
    }),
    (
        &[
            "message-flow-edge-node-birth-publish-phid-wait",
            "operational-behavior-edge-node-birth-sequence-wait",
        ],
        |s| leave_out(s, |step| matches!(step, Step::Got(got) if got.is_state())),
    ),
    (&["message-flow-edge-node-birth-publish-phid-wait-id"], |s| {
        s.host = Some("other".to_owned());
    }),
    (&["message-flow-edge-node-birth-publish-phid-wait-online"], |s| {
        for step in &mut s.connections[0].steps {
            if let Step::Got(got) = step
                && got.is_state()
            {
                got.payload = HostState { online: false, timestamp: 1 }.bytes();
            }
        }
    }),
    (&["message-flow-edge-node-birth-publish-phid-wait-timestamp"], |s| {
        let mut newer = primary(s).clone();
        newer.payload = HostState { online: false, timestamp: u64::MAX }.bytes();
        s.connections[0].steps.insert(0, Step::Got(newer));
    }),
    (&["operational-behavior-edge-node-termination-host-offline-timestamp"], |s| {
        let steps = &mut s.connections[0].steps;
        let is_state = |step: &Step| matches!(step, Step::Got(got) if got.is_state());
        let last = steps.iter().rposition(is_state).expect("a death of the host");
        if let Step::Got(got) = &mut steps[last] {
            got.payload = HostState { online: false, timestamp: 7 }.bytes();
        }
    }),
    (&["operational-behavior-primary-application-state-with-multiple-servers-state-subs"], |s| {
        for step in &mut s.connections[0].steps {
            if let Step::Subscribed(filters) = step {
                filters.pop();
            }
        }
    }),
    (
        &[
            "message-flow-edge-node-birth-publish-phid-offline",
            "operational-behavior-edge-node-termination-host-offline",
        ],
        |s| {
            let data = Step::Sent(first(s, DATA).clone());
            let steps = &mut s.connections[0].steps;
            steps.insert(steps.len() - 2, data);
        },
    ),
    (&["payloads-ndata-order", "message-flow-edge-node-birth-publish-connect"], |s| {
        let data = Step::Sent(first(s, DATA).clone());
        s.connections[0].steps.insert(0, data);
    }),
    (
        &[
            "operational-behavior-data-commands-rebirth-action-1",
            "operational-behavior-data-commands-rebirth-action-2",
        ],
        |s| {
            let steps = &mut s.connections[0].steps;
            let is_birth = |step: &Step| step.sent().is_some_and(|sent| sent.kind() == Some(BIRTH));
            let last = steps.iter().rposition(is_birth).expect("a birth");
            steps.remove(last);
        },
    ),
];

/// Faults of payloads.
pub const OF_PAYLOADS: &[Spoiler] = &[
    (&["topic-structure", "topic-structure-namespace-a", "topics-nbirth-topic"], |s| {
        first(s, BIRTH).topic = "spAv1.0/plant/NBIRTH/press".to_owned()
    }),
    (
        &[
            "topic-structure-namespace-valid-edge-node-id",
            "topic-structure-namespace-valid-group-id",
            "topic-structure-namespace-device-id-non-associated-message-types",
            "topics-ndata-topic",
            "intro-group-id-chars",
            "intro-edge-node-id-chars",
        ],
        |s| first(s, DATA).topic = "spBv1.0/plant/NDATA/press/3".to_owned(),
    ),
    (
        &[
            "message-flow-edge-node-birth-publish-nbirth-topic",
            "intro-group-id-string",
            "intro-edge-node-id-string",
        ],
        |s| first(s, BIRTH).topic = "spBv1.0/other/NBIRTH/press".to_owned(),
    ),
    (
        &[
            "topics-nbirth-mqtt",
            "message-flow-edge-node-birth-publish-nbirth-qos",
            "payloads-nbirth-qos",
        ],
        |s| first(s, BIRTH).qos = 1,
    ),
    (&["message-flow-edge-node-birth-publish-nbirth-retained", "payloads-nbirth-retain"], |s| {
        first(s, BIRTH).retain = true
    }),
    (&["topics-ndata-mqtt", "payloads-ndata-qos"], |s| first(s, DATA).qos = 1),
    (&["payloads-ndata-retain"], |s| first(s, DATA).retain = true),
    (&["message-flow-edge-node-birth-publish-nbirth-payload"], |s| {
        first(s, BIRTH).payload = b"born".to_vec();
    }),
    (
        &[
            "topics-nbirth-seq-num",
            "payloads-nbirth-seq",
            "payloads-sequence-num-zero-nbirth",
            "message-flow-edge-node-birth-publish-nbirth-payload-seq",
        ],
        |s| change(s, BIRTH, |payload| payload.seq = Some(1)),
    ),
    (
        &["topics-ndata-seq-num", "payloads-ndata-seq-inc", "payloads-sequence-num-incrementing"],
        |s| change(s, DATA, |payload| payload.seq = Some(2)),
    ),
    (&["payloads-ndata-seq", "payloads-sequence-num-always-included"], |s| {
        change(s, DATA, |payload| payload.seq = None);
    }),
    (&["topics-nbirth-timestamp", "payloads-nbirth-timestamp"], |s| {
        change(s, BIRTH, |payload| payload.timestamp = None);
    }),
    (&["topics-ndata-timestamp", "payloads-ndata-timestamp"], |s| {
        change(s, DATA, |payload| payload.timestamp = None);
    }),
    (&["payloads-timestamp-in-UTC"], |s| {
        // Two hours ahead, like local time.
        change(s, DATA, |payload| payload.timestamp = payload.timestamp.map(|at| at + 7_200_000));
    }),
    (&["payloads-name-birth-data-requirement"], |s| metric(s, DATA, 0, |it| it.timestamp = None)),
    (&["payloads-metric-timestamp-in-UTC"], |s| {
        metric(s, DATA, 0, |it| it.timestamp = it.timestamp.map(|at| at + 7_200_000));
    }),
    (&["topics-nbirth-bdseq-included", "payloads-nbirth-bdseq"], |s| {
        change(s, BIRTH, |payload| drop(payload.metrics.remove(0)));
    }),
    (
        &[
            "topics-nbirth-bdseq-matching",
            "message-flow-edge-node-birth-publish-nbirth-payload-bdSeq",
            "payloads-nbirth-bdseq-repeat",
            "payloads-ndeath-bdseq",
            "operational-behavior-data-commands-rebirth-action-3",
        ],
        |s| metric(s, BIRTH, 0, |it| it.content = Some(MetricContent::Long(77))),
    ),
    (
        &[
            "topics-nbirth-rebirth-metric",
            "operational-behavior-data-commands-rebirth-name",
            "payloads-nbirth-rebirth-req",
        ],
        |s| change(s, BIRTH, |payload| drop(payload.metrics.remove(1))),
    ),
    (&["operational-behavior-data-commands-rebirth-datatype"], |s| {
        metric(s, BIRTH, 1, |it| it.datatype = Some(DataType::Int8.number()));
    }),
    (&["operational-behavior-data-commands-rebirth-value"], |s| {
        metric(s, BIRTH, 1, |it| it.content = Some(MetricContent::Boolean(true)));
    }),
    (&["operational-behavior-data-commands-rebirth-name-aliases"], |s| {
        metric(s, BIRTH, 1, |it| it.alias = Some(1));
    }),
    (&["topics-nbirth-metrics", "payloads-metric-datatype-req"], |s| {
        metric(s, BIRTH, 2, |it| it.datatype = None);
    }),
    (&["payloads-metric-datatype-value", "payloads-metric-datatype-value-type"], |s| {
        metric(s, BIRTH, 2, |it| it.datatype = Some(99));
    }),
    (&["operational-behavior-data-publish-nbirth-values"], |s| {
        metric(s, BIRTH, 2, |it| it.content = None);
    }),
    (&["topics-nbirth-metric-reqs", "operational-behavior-data-publish-nbirth"], |s| {
        metric(s, DATA, 0, |it| it.alias = Some(99));
    }),
    (&["payloads-alias-uniqueness"], |s| metric(s, BIRTH, 2, |it| it.alias = Some(8))),
    (&["payloads-alias-birth-requirement"], |s| metric(s, BIRTH, 2, |it| it.alias = None)),
    (&["payloads-name-requirement"], |s| metric(s, BIRTH, 2, |it| it.name = None)),
    (&["payloads-alias-data-cmd-requirement"], |s| {
        metric(s, DATA, 0, |it| it.name = Some("level".to_owned()));
    }),
    (&["payloads-metric-datatype-not-req"], |s| {
        metric(s, DATA, 0, |it| it.datatype = Some(DataType::Int16.number()));
    }),
    (&["operational-behavior-data-publish-nbirth-order"], |s| {
        metric(s, DATA, 2, |it| it.timestamp = it.timestamp.map(|at| at - 5));
    }),
    (
        &[
            "topics-ndata-payload",
            "operational-behavior-data-publish-nbirth-change",
            "principles-rbe-recommended",
        ],
        |s| change(s, DATA, |payload| payload.metrics.clear()),
    ),
    (&["case-sensitivity-metric-names"], |s| {
        metric(s, BIRTH, 2, |it| it.name = Some("JAM".to_owned()));
    }),
    (&["payloads-propertyset-keys-array-size", "payloads-propertyset-values-array-size"], |s| {
        metric(s, BIRTH, 2, |it| it.properties.as_mut().expect("a set").keys.clear())
    }),
    (&["payloads-metric-propertyvalue-type-req", "payloads-metric-propertyvalue-type-type"], |s| {
        metric(s, BIRTH, 2, |it| it.properties.as_mut().expect("a set").values[0].datatype = None)
    }),
    (&["payloads-metric-propertyvalue-type-value"], |s| {
        metric(s, BIRTH, 2, |it| {
            it.properties.as_mut().expect("a set").values[0].datatype = Some(99);
        });
    }),
    (&["topics-ndeath-payload"], |s| change(s, DEATH, |payload| payload.metrics.clear())),
    (&["topics-ndeath-seq", "payloads-ndeath-seq"], |s| {
        change(s, DEATH, |payload| payload.seq = Some(3));
    }),
];
