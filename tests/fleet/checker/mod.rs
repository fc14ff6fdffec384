//! The wire checker: judges the packets of a Sparkplug 3.0 client by the specification's normative
//! statements.
//!
//! `recorder` is a small broker that keeps every packet; `story` contains the packets. Each rule
//! judges a story by some statements, which the specification calls `tck-id-…`. `table` reads the
//! list of all statements in `docs/sparkplug.md`. A statement that is `checked` there has a rule
//! here, and a spoiler: a story with one fault that the rule must notice. The rules share no code
//! with `crates/fleet/src/edge` and `crates/fleet/src/fleet` except the payload's messages.

mod edge_connect;
mod edge_payload;
mod good;
mod host_rules;
mod packets;
pub mod recorder;
mod rules;
mod spoil;
mod spoil_edge;
mod spoil_host;
pub mod story;
mod table;

use std::collections::BTreeSet;

use rules::Rule;
use spoil::Spoiler;
use story::Story;

/// The rules for edge nodes.
pub fn edge_rules() -> Vec<&'static Rule> {
    edge_connect::RULES.iter().chain(edge_payload::RULES).collect()
}

/// The rules for host applications.
pub fn host_rules() -> Vec<&'static Rule> {
    host_rules::RULES.iter().collect()
}

/// The complaints about a story, with their statements.
pub fn judge(rules: &[&Rule], story: &Story) -> Vec<String> {
    let told = rules.iter().flat_map(|(ids, judge)| {
        let complaints: BTreeSet<String> = judge(story).into_iter().collect();
        complaints.into_iter().map(move |wrong| format!("{}: {wrong}", ids.join(", ")))
    });
    told.collect()
}

fn notices(rules: &[&Rule], story: &Story, id: &str) -> bool {
    let own = rules.iter().filter(|(ids, _)| ids.contains(&id));
    own.into_iter().any(|(_, judge)| !judge(story).is_empty())
}

/// Checks that each statement that a spoiler names notices its change, and that each statement has
/// a spoiler.
fn hold(rules: &[&'static Rule], spoilers: &[&Spoiler], good: &Story) {
    assert_eq!(judge(rules, good), Vec::<String>::new(), "a good story has no complaint");
    let mut left: BTreeSet<&str> = rules.iter().flat_map(|(ids, _)| ids.iter().copied()).collect();
    for (ids, spoil) in spoilers {
        let mut story = good.clone();
        spoil(&mut story);
        for id in *ids {
            assert!(notices(rules, &story, id), "{id} does not notice what is wrong");
            left.remove(id);
        }
    }
    assert!(left.is_empty(), "nothing shows that these can fail: {left:#?}");
}

#[test]
fn each_rule_for_edge_nodes_can_fail() {
    let spoilers = spoil_edge::OF_CONNECTIONS.iter().chain(spoil_edge::OF_PAYLOADS);
    hold(&edge_rules(), &spoilers.collect::<Vec<_>>(), &good::edge());
}

#[test]
fn each_rule_for_hosts_can_fail() {
    hold(&host_rules(), &spoil_host::OF_HOSTS.iter().collect::<Vec<_>>(), &good::host());
}
