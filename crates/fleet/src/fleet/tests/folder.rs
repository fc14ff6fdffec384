//! The ladders of a folder, compared with the running ladders.

use std::fs;
use std::path::PathBuf;

use super::{Fleet, birth};
use crate::fleet::{ExpectedLadders, LadderVerdict};
use rungd_net::sparkplug::{DataType, MetricValue, vocabulary};

const LADDER: &str = r#"
ladder.name = "press"
[tags]
lamp = { at = "Y0" }
[[program]]
name = "Main"
[[program.rung]]
when = ["X0"]
do = ["OUT lamp"]
"#;

/// A temporary folder, which is removed when the value is dropped.
struct Checkout(PathBuf);

impl Checkout {
    fn new(name: &str) -> Checkout {
        let path = std::env::temp_dir().join(format!("rungd-fleet-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        Checkout(path)
    }

    fn with(self, node: &str, ladder: &str) -> Checkout {
        let folder = self.0.join(node);
        fs::create_dir_all(&folder).expect("a folder");
        fs::write(folder.join("controller.toml"), "ladder = [\"main.toml\"]\n").expect("a file");
        fs::write(folder.join("main.toml"), ladder).expect("a file");
        self
    }

    fn expected(&self) -> ExpectedLadders {
        ExpectedLadders::of(&self.0).expect("a folder")
    }
}

impl Drop for Checkout {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A fleet with a node `plant/NAME` for each pair of a name and its ladder.
fn fleet(nodes: &[(&str, &str)]) -> Fleet {
    let mut fleet = Fleet::new();
    for (name, ladder) in nodes {
        let sha256 = rungd_config::load::sha256_of([*ladder].into_iter());
        let sha256 = (vocabulary::LADDER_SHA256, 1, DataType::String, MetricValue::Text(sha256));
        let scan = (vocabulary::SCAN, 2, DataType::Int64, MetricValue::Signed(1));
        let payload = birth(0, &[sha256, scan], 5).bytes();
        fleet.hear(&format!("spBv1.0/plant/NBIRTH/{name}"), &payload);
    }
    fleet
}

#[test]
fn each_node_is_compared_with_its_folder() {
    let other = LADDER.replace("X0", "X1");
    let checkout = Checkout::new("each")
        .with("plant/a", LADDER)
        .with("b", LADDER)
        .with("plant/c", &other)
        .with("c", LADDER)
        .with("broken", "ladder.name = 7");
    let fleet = fleet(&[("a", LADDER), ("b", LADDER), ("c", LADDER), ("broken", ""), ("new", "")]);
    let mut report = fleet.report();
    report.compare(&mut checkout.expected());
    let verdict = |at: usize| report.nodes[at].ladder_verdict.clone().expect("a verdict");
    assert!(verdict(0).is_same() && verdict(1).is_same(), "{:?}", verdict(0));
    assert!(matches!(verdict(2), LadderVerdict::Unreadable { why, .. } if why.contains("error")));
    assert!(matches!(verdict(3), LadderVerdict::Differs { .. }), "the group's folder is first");
    assert_eq!(verdict(4), LadderVerdict::Unlisted);
    assert!(!report.is_as_expected());
    let missing: Vec<&str> = report.missing.iter().map(|node| node.node.as_str()).collect();
    assert_eq!(missing, ["c"], "that file is for another group");
}

#[test]
fn a_fleet_that_matches_its_folder_is_as_expected() {
    let checkout = Checkout::new("all").with("plant/a", LADDER).with(".git/hooks", LADDER);
    let mut report = fleet(&[("a", LADDER)]).report();
    report.compare(&mut checkout.expected());
    assert!(report.is_as_expected(), "{:?}", report.missing);
}

#[test]
fn a_node_that_never_published_is_reported_as_missing() {
    let checkout = Checkout::new("missing").with("plant/a", LADDER).with("plant/b", LADDER);
    let mut report = fleet(&[("a", LADDER)]).report();
    report.compare(&mut checkout.expected());
    assert_eq!(report.missing.len(), 1);
    assert_eq!(report.missing[0].group.as_deref(), Some("plant"));
    assert!(!report.is_as_expected());
}

#[test]
fn a_node_name_cannot_lead_out_of_the_folder() {
    let checkout = Checkout::new("names").with("inner/a", LADDER).with("outer", LADDER);
    let mut expected = ExpectedLadders::of(&checkout.0.join("inner")).expect("a folder");
    let name = |group: &str, node: &str| crate::fleet::NodeName {
        group: group.to_owned(),
        node: node.to_owned(),
    };
    for node in [name("..", "outer"), name("plant", ".."), name("plant", "."), name(".", "..")] {
        assert_eq!(expected.judge(&node, None), LadderVerdict::Unlisted, "{node}");
    }
}

/// An empty folder has nothing to compare with.
#[test]
fn a_folder_without_controller_files_is_refused() {
    let checkout = Checkout::new("empty").with("plant/a/deeper", LADDER);
    let refusal = |path: &PathBuf| format!("{:#}", ExpectedLadders::of(path).expect_err("none"));
    let said = refusal(&checkout.0);
    assert!(said.contains("has no file of a node") && said.contains("NODE/controller.toml"));
    let said = refusal(&checkout.0.join("nothing"));
    assert!(said.contains("nothing cannot be listed: name a folder"), "{said}");
}
