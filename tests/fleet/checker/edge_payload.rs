//! Rules for edge nodes: births, data and deaths as they are published.

use std::collections::{HashMap, HashSet};

use rungd_net::sparkplug::{
    DataType, MessageKind, Metric, MetricContent, Payload, PropertyContent, Topic, vocabulary,
};

use super::rules::{Complaints, Rule, bd_seq, births, each, is_about, metric, some, unless};
use super::story::{Published, Step, Story};

pub const RULES: &[Rule] = &[
    (
        &[
            "topic-structure",
            "topic-structure-namespace-a",
            "topic-structure-namespace-valid-group-id",
            "topic-structure-namespace-valid-edge-node-id",
            "topic-structure-namespace-device-id-non-associated-message-types",
            "topics-nbirth-topic",
            "topics-ndata-topic",
            "message-flow-edge-node-birth-publish-nbirth-topic",
            "intro-group-id-string",
            "intro-group-id-chars",
            "intro-edge-node-id-string",
            "intro-edge-node-id-chars",
        ],
        topics,
    ),
    (
        &[
            "topics-nbirth-mqtt",
            "message-flow-edge-node-birth-publish-nbirth-qos",
            "message-flow-edge-node-birth-publish-nbirth-retained",
            "payloads-nbirth-qos",
            "payloads-nbirth-retain",
        ],
        |story| plain(story, MessageKind::NodeBirth),
    ),
    (&["topics-ndata-mqtt", "payloads-ndata-qos", "payloads-ndata-retain"], |story| {
        plain(story, MessageKind::NodeData)
    }),
    (&["message-flow-edge-node-birth-publish-nbirth-payload"], |story| {
        each(story.sent().map(|(_, sent)| sent), "no payload", |sent| {
            Payload::read(&sent.payload).is_ok()
        })
    }),
    (
        &[
            "topics-nbirth-seq-num",
            "payloads-nbirth-seq",
            "payloads-sequence-num-zero-nbirth",
            "message-flow-edge-node-birth-publish-nbirth-payload-seq",
        ],
        |story| {
            each(story.published(MessageKind::NodeBirth), "seq is not 0", |it| {
                it.read().seq == Some(0)
            })
        },
    ),
    (
        &[
            "topics-ndata-seq-num",
            "payloads-ndata-seq",
            "payloads-ndata-seq-inc",
            "payloads-sequence-num-always-included",
            "payloads-sequence-num-incrementing",
        ],
        numbers_rise,
    ),
    (
        &[
            "topics-nbirth-timestamp",
            "topics-ndata-timestamp",
            "payloads-nbirth-timestamp",
            "payloads-ndata-timestamp",
            "payloads-timestamp-in-UTC",
        ],
        told_when,
    ),
    (
        &["payloads-name-birth-data-requirement", "payloads-metric-timestamp-in-UTC"],
        metrics_told_when,
    ),
    (
        &[
            "topics-nbirth-bdseq-included",
            "topics-nbirth-bdseq-matching",
            "message-flow-edge-node-birth-publish-nbirth-payload-bdSeq",
            "payloads-nbirth-bdseq",
            "payloads-nbirth-bdseq-repeat",
            "payloads-ndeath-bdseq",
            "operational-behavior-data-commands-rebirth-action-3",
        ],
        births_have_the_number,
    ),
    (
        &[
            "topics-nbirth-rebirth-metric",
            "operational-behavior-data-commands-rebirth-name",
            "operational-behavior-data-commands-rebirth-datatype",
            "operational-behavior-data-commands-rebirth-value",
            "payloads-nbirth-rebirth-req",
        ],
        births_have_rebirth,
    ),
    (&["operational-behavior-data-commands-rebirth-name-aliases"], rebirth_has_no_alias),
    (
        &[
            "topics-nbirth-metrics",
            "payloads-metric-datatype-req",
            "payloads-metric-datatype-value",
            "payloads-metric-datatype-value-type",
            "operational-behavior-data-publish-nbirth-values",
        ],
        births_are_whole,
    ),
    (&["topics-nbirth-metric-reqs", "operational-behavior-data-publish-nbirth"], data_is_born),
    (&["payloads-alias-uniqueness"], aliases_are_unique),
    (&["payloads-alias-birth-requirement", "payloads-name-requirement"], births_have_names),
    (&["payloads-alias-data-cmd-requirement", "payloads-metric-datatype-not-req"], data_is_short),
    (&["payloads-ndata-order", "message-flow-edge-node-birth-publish-connect"], data_after_birth),
    (&["operational-behavior-data-publish-nbirth-order"], in_order),
    (
        &[
            "topics-ndata-payload",
            "operational-behavior-data-publish-nbirth-change",
            "principles-rbe-recommended",
        ],
        tells_changes,
    ),
    (&["case-sensitivity-metric-names"], names_differ),
    (
        &[
            "payloads-propertyset-keys-array-size",
            "payloads-propertyset-values-array-size",
            "payloads-metric-propertyvalue-type-type",
            "payloads-metric-propertyvalue-type-value",
            "payloads-metric-propertyvalue-type-req",
        ],
        properties_are_whole,
    ),
    (&["topics-ndeath-payload"], deaths_are_short),
    (&["topics-ndeath-seq", "payloads-ndeath-seq"], deaths_have_no_seq),
    (
        &[
            "operational-behavior-data-commands-rebirth-action-1",
            "operational-behavior-data-commands-rebirth-action-2",
        ],
        answers_rebirth,
    ),
];

/// The messages that have a sequence number.
fn numbered(story: &Story) -> Vec<&Published> {
    let kinds = [Some(MessageKind::NodeBirth), Some(MessageKind::NodeData)];
    story.sent().map(|(_, sent)| sent).filter(|sent| kinds.contains(&sent.kind())).collect()
}

fn topics(story: &Story) -> Complaints {
    let own = |sent: &Published| match Topic::read(&sent.topic) {
        Some(Topic::Node { group, node, device: None, .. }) => {
            group == story.group && node == story.node
        }
        Some(Topic::Node { .. } | Topic::HostState { .. }) | None => false,
    };
    each(story.sent().map(|(_, sent)| sent), "no topic of this node", own)
}

fn plain(story: &Story, kind: MessageKind) -> Complaints {
    let all = story.published(kind);
    let mut wrong = some(&all, kind.name());
    wrong.extend(each(all, "not QoS 0, or retained", |sent| sent.qos == 0 && !sent.retain));
    wrong
}

fn numbers_rise(story: &Story) -> Complaints {
    let mut wrong = some(&story.published(MessageKind::NodeData), "NDATA");
    for connection in &story.connections {
        let mut due = None;
        for sent in connection.sent() {
            let seq = sent.read().seq;
            match sent.kind() {
                Some(MessageKind::NodeBirth) => due = seq.map(|seq| (seq + 1) % 256),
                Some(MessageKind::NodeData) => {
                    wrong.extend(unless(seq.is_some() && seq == due, "NDATA's seq does not rise"));
                    due = seq.map(|seq| (seq + 1) % 256);
                }
                _ => {}
            }
        }
    }
    wrong
}

fn told_when(story: &Story) -> Complaints {
    each(numbered(story), "no timestamp of its time", |sent| {
        sent.read().timestamp.is_some_and(|told| is_about(told, sent.at_ms))
    })
}

/// No time is in the future. A historical value may have any earlier time; a present value has one
/// after 2001.
fn metrics_told_when(story: &Story) -> Complaints {
    let has = |metric: &Metric, at_ms: u64| match (metric.timestamp, metric.is_historical) {
        (Some(told), Some(true)) => told <= at_ms + 60_000,
        (Some(told), _) => told <= at_ms + 60_000 && told > 1_000_000_000_000,
        (None, _) => false,
    };
    each(numbered(story), "a metric without its time", |sent| {
        sent.read().metrics.iter().all(|metric| has(metric, sent.at_ms))
    })
}

fn births_have_the_number(story: &Story) -> Complaints {
    let mut wrong = some(&story.published(MessageKind::NodeBirth), "NBIRTH");
    for connection in &story.connections {
        let own = connection.connect.will.as_ref().and_then(bd_seq);
        let typed = |sent: &Published| {
            let metrics = sent.read().metrics;
            let number = metric(&metrics, vocabulary::BD_SEQ).map(|metric| metric.datatype);
            number == Some(Some(DataType::Int64.number()))
        };
        let fits = |sent: &Published| own.is_some() && bd_seq(sent) == own && typed(sent);
        wrong.extend(each(births(connection), "bdSeq is not the will's, as Int64", fits));
    }
    wrong
}

fn births_have_rebirth(story: &Story) -> Complaints {
    each(
        story.published(MessageKind::NodeBirth),
        "no `Node Control/Rebirth`, Boolean, false",
        |sent| {
            metric(&sent.read().metrics, vocabulary::REBIRTH).is_some_and(|metric| {
                metric.datatype == Some(DataType::Boolean.number())
                    && metric.content == Some(MetricContent::Boolean(false))
            })
        },
    )
}

fn rebirth_has_no_alias(story: &Story) -> Complaints {
    each(story.published(MessageKind::NodeBirth), "`Node Control/Rebirth` has an alias", |sent| {
        metric(&sent.read().metrics, vocabulary::REBIRTH).is_none_or(|it| it.alias.is_none())
    })
}

fn births_are_whole(story: &Story) -> Complaints {
    let whole = |metric: &Metric| {
        let has_value = metric.content.is_some() != (metric.is_null == Some(true));
        let datatype = metric.datatype.and_then(DataType::of);
        let fits = match (&metric.content, datatype) {
            (Some(content), Some(datatype)) => datatype.read(content).is_ok(),
            (None, datatype) => datatype.is_some(),
            (Some(_), None) => false,
        };
        metric.name.is_some() && has_value && fits
    };
    each(story.published(MessageKind::NodeBirth), "a metric lacks name, type or value", |sent| {
        sent.read().metrics.iter().all(whole)
    })
}

/// The identifier of a metric: its alias, or else its name.
fn handle(metric: &Metric) -> (Option<u64>, Option<String>) {
    (metric.alias, metric.alias.is_none().then(|| metric.name.clone()).flatten())
}

fn data_is_born(story: &Story) -> Complaints {
    let mut wrong = Vec::new();
    for connection in &story.connections {
        let mut born = HashSet::new();
        for sent in connection.sent() {
            let metrics = sent.read().metrics;
            match sent.kind() {
                Some(MessageKind::NodeBirth) => born = metrics.iter().map(handle).collect(),
                Some(MessageKind::NodeData) => {
                    let known = metrics.iter().all(|metric| born.contains(&handle(metric)));
                    wrong.extend(unless(known, "NDATA has a metric that its birth lacks"));
                }
                _ => {}
            }
        }
    }
    wrong
}

fn aliases_are_unique(story: &Story) -> Complaints {
    each(story.published(MessageKind::NodeBirth), "an alias stands for two metrics", |sent| {
        let metrics = sent.read().metrics;
        let mut seen = HashSet::new();
        metrics.iter().filter_map(|metric| metric.alias).all(|alias| seen.insert(alias))
    })
}

/// With aliases, each metric of a birth has a name and an alias. The exceptions are the two metrics
/// of the specification.
fn births_have_names(story: &Story) -> Complaints {
    let own = [Some(vocabulary::BD_SEQ), Some(vocabulary::REBIRTH)];
    each(story.published(MessageKind::NodeBirth), "a metric lacks its name or its alias", |sent| {
        sent.read().metrics.iter().all(|metric| {
            let has_alias = metric.alias.is_some() || own.contains(&metric.name.as_deref());
            metric.name.is_some() && has_alias
        })
    })
}

fn data_is_short(story: &Story) -> Complaints {
    each(story.published(MessageKind::NodeData), "a metric with its name or type", |sent| {
        let short = |metric: &Metric| {
            metric.alias.is_some() && metric.name.is_none() && metric.datatype.is_none()
        };
        sent.read().metrics.iter().all(short)
    })
}

fn data_after_birth(story: &Story) -> Complaints {
    let mut wrong = Vec::new();
    for connection in &story.connections {
        let is = |kind: MessageKind| {
            move |step: &Step| step.sent().is_some_and(|sent| sent.kind() == Some(kind))
        };
        let (born, data) = (
            connection.place(is(MessageKind::NodeBirth)),
            connection.place(is(MessageKind::NodeData)),
        );
        let fits = data.is_none_or(|data| born.is_some_and(|born| born < data));
        wrong.extend(unless(fits, "NDATA before NBIRTH"));
    }
    wrong
}

/// Present values are in order of time within a message. Each metric's values are in order of time
/// across messages. (A node's metrics about its controller have the time at which the node
/// requested them.)
fn in_order(story: &Story) -> Complaints {
    let mut wrong = Vec::new();
    for connection in &story.connections {
        let mut newest = HashMap::new();
        for sent in connection.sent().filter(|it| it.kind() == Some(MessageKind::NodeData)) {
            let mut last = 0;
            for metric in sent.read().metrics.iter().filter(|it| it.is_historical != Some(true)) {
                let time = metric.timestamp.unwrap_or(0);
                let before = newest.insert(handle(metric), time).unwrap_or(0);
                let fits = time >= last && time >= before;
                wrong.extend(unless(fits, "a value is older than one before it"));
                last = time;
            }
        }
    }
    wrong
}

/// Each NDATA has metrics; the heartbeat is a metric that changes.
fn tells_changes(story: &Story) -> Complaints {
    each(story.published(MessageKind::NodeData), "tells nothing", |sent| {
        !sent.read().metrics.is_empty()
    })
}

fn names_differ(story: &Story) -> Complaints {
    each(story.published(MessageKind::NodeBirth), "two names differ in case alone", |sent| {
        let metrics = sent.read().metrics;
        let mut seen = HashSet::new();
        metrics
            .iter()
            .filter_map(|it| it.name.as_ref())
            .all(|name| seen.insert(name.to_lowercase()))
    })
}

fn properties_are_whole(story: &Story) -> Complaints {
    let fits = |metric: &Metric| {
        metric.properties.as_ref().is_none_or(|set| {
            let typed = set.values.iter().all(|value| {
                let datatype = value.datatype.and_then(DataType::of);
                matches!(
                    (datatype, &value.content),
                    (Some(DataType::String), Some(PropertyContent::Text(_)))
                        | (Some(DataType::Double), Some(PropertyContent::Double(_)))
                        | (Some(DataType::Boolean), Some(PropertyContent::Boolean(_)))
                        | (Some(DataType::Int32), Some(PropertyContent::Int(_)))
                )
            });
            set.keys.len() == set.values.len() && typed
        })
    };
    each(story.published(MessageKind::NodeBirth), "properties without values or types", |sent| {
        sent.read().metrics.iter().all(fits)
    })
}

/// All NDEATHs: the published ones and the wills.
fn deaths(story: &Story) -> Vec<&Published> {
    let wills = story.connections.iter().filter_map(|it| it.connect.will.as_ref());
    story.published(MessageKind::NodeDeath).into_iter().chain(wills).collect()
}

fn deaths_are_short(story: &Story) -> Complaints {
    each(deaths(story), "NDEATH has not bdSeq alone", |sent| {
        sent.read().metrics.len() == 1 && bd_seq(sent).is_some()
    })
}

fn deaths_have_no_seq(story: &Story) -> Complaints {
    each(deaths(story), "NDEATH has a seq", |sent| sent.read().seq.is_none())
}

/// The most messages that a node may send before it has received a request for a birth. On a busy
/// machine these are many.
const CROSSING_MAX: usize = 50;

/// A request for a birth is followed by a birth, at most [`CROSSING_MAX`] messages later.
fn answers_rebirth(story: &Story) -> Complaints {
    let asks = |step: &Step| match step {
        Step::Got(got) => {
            got.kind() == Some(MessageKind::NodeCommand)
                && metric(&got.read().metrics, vocabulary::REBIRTH)
                    .is_some_and(|it| it.content == Some(MetricContent::Boolean(true)))
        }
        Step::Sent(_) | Step::Subscribed(_) | Step::Disconnected(_) => false,
    };
    let mut wrong = Vec::new();
    for connection in &story.connections {
        for (at, _) in connection.steps.iter().enumerate().filter(|(_, step)| asks(step)) {
            let after = connection.steps[at..].iter().filter_map(Step::sent).take(CROSSING_MAX);
            let answered = after.into_iter().any(|it| it.kind() == Some(MessageKind::NodeBirth));
            wrong.extend(unless(answered, "no birth after a request for one"));
        }
    }
    wrong
}
