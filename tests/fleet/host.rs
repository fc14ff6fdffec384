//! `rungd fleet` at real brokers, with real controllers and their edge nodes: its lists, its
//! comparisons, its alarms and the changes that it prints.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::fleet::broker::PATIENCE;
use crate::fleet::certificates::Certificates;
use crate::fleet::edge_rig::{CONTROLLER, Edge, LADDER};
use crate::fleet::fleet_process::FleetProcess;
use crate::fleet::mosquitto::{Mosquitto, MosquittoOptions};
use crate::fleet::nats::NatsCluster;
use rungd_test_support::folder::TestFolder;
use rungd_test_support::running::live::Live;

/// The ladder of the second controller.
const OTHER: &str = r#"
ladder.name = "saw"
[tags]
low = { at = "C0", alarm = "Oil is low" }
[[program]]
name = "Main"
rung = [ { when = ["low"], do = ["OUT Y0"] } ]
"#;

/// Two controllers with their edge nodes: `plant/press` and `plant/saw`.
struct TwoPlants {
    press: Live,
    saw: Live,
    _press: Edge,
    edge_of_saw: Edge,
}

impl TwoPlants {
    /// `broker`: additional keys of `[broker]`.
    fn start(url: &str, broker: &str) -> TwoPlants {
        let press = Live::start(LADDER, CONTROLLER, &[]);
        let saw = Live::start(OTHER, CONTROLLER, &[]);
        let (of_press, of_saw) =
            (Edge::start(&press, url, broker), Edge::named("saw", &saw, url, broker));
        TwoPlants { press, saw, _press: of_press, edge_of_saw: of_saw }
    }
}

/// Runs `rungd fleet COMMAND` with `--rebirth` and `--json`, for two seconds unless `more` has
/// `--wait`.
fn asked(command: &str, broker: &[&str], more: &[&str]) -> (i32, Value) {
    let time: &[&str] = if more.contains(&"--wait") { &[] } else { &["--wait", "2s"] };
    let arguments = [&[command, "--rebirth", "--json"], time, broker, more].concat();
    let (code, out, errors) = FleetProcess::start(&arguments).end();
    // A cluster without a leader refuses clients or their subscriptions.
    let json = if [69, 77].contains(&code) && out.is_empty() {
        Ok(Value::Null)
    } else {
        serde_json::from_str(&out)
    };
    (code, json.unwrap_or_else(|error| panic!("{code} {error}: {out}{errors}")))
}

/// Repeats the command until the answer fits: on a busy machine, births take long.
fn until(
    command: &str,
    broker: &[&str],
    more: &[&str],
    fits: impl Fn(i32, &Value) -> bool,
) -> Value {
    let begun = Instant::now();
    loop {
        let (code, answer) = asked(command, broker, more);
        if fits(code, &answer) {
            return answer;
        }
        assert!(begun.elapsed() < PATIENCE, "{command} {more:?}: {code} {answer:#}");
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// Name, state and mode of the nodes.
fn modes(report: &Value) -> Vec<[&str; 3]> {
    let nodes = report["nodes"].as_array().into_iter().flatten();
    nodes
        .map(|node| ["node", "state", "mode"].map(|key| node[key].as_str().unwrap_or("-")))
        .collect()
}

const BOTH_RUN: [[&str; 3]; 2] = [["press", "online", "RUN"], ["saw", "online", "RUN"]];

/// Copies the files of a controller into a checkout.
fn check_in(live: &Live, folder: &Path) {
    fs::create_dir_all(folder).unwrap();
    for file in ["controller.toml", "ladder.toml"] {
        fs::copy(live.folder.join(file), folder.join(file)).unwrap();
    }
}

/// A broker that requires certificates, and the arguments with its address and our certificates.
fn secured() -> Option<(Mosquitto, Vec<String>)> {
    let broker = Mosquitto::start(&MosquittoOptions { tls: true, ..MosquittoOptions::default() })?;
    let Certificates { ca, client, client_key, .. } = broker.certificates.as_ref().unwrap();
    let path = |path: &Path| path.display().to_string();
    let words = ["--broker", &broker.url(), "--ca", &path(ca), "--cert", &path(client)];
    let words = words.into_iter().chain(["--key", &path(client_key)]).map(str::to_owned).collect();
    Some((broker, words))
}

fn words(words: &[String]) -> Vec<&str> {
    words.iter().map(String::as_str).collect()
}

#[test]
fn two_controllers_behind_certificates_are_compared_with_a_checkout() {
    let Some((broker, shown)) = secured() else { return };
    let shown = words(&shown);
    // Without a client certificate.
    let stranger = [&["status", "--wait", "2s"], &shown[..4]].concat();
    let (code, out, errors) = FleetProcess::start(&stranger).end();
    assert_eq!((code, out.as_str()), (69, ""), "{errors}");
    assert!(errors.contains("TLS failed"), "{errors}");

    let keys = format!(
        "ca = {:?}\ncertificate = {:?}\nkey = {:?}\n",
        Path::new(shown[3]),
        Path::new(shown[5]),
        Path::new(shown[7])
    );
    let plants = TwoPlants::start(&broker.url(), &keys);
    until("status", &shown, &["--require-run"], |code, report| {
        code == 0 && modes(report) == BOTH_RUN
    });
    let folder = TestFolder::new("checkout");
    check_in(&plants.press, &folder.path().join("plant/press"));
    check_in(&plants.press, &folder.path().join("saw"));
    check_in(&plants.press, &folder.path().join("plant/gone"));
    let expected = folder.path().display().to_string();
    let report = until("status", &shown, &["--expect", &expected], |code, report| {
        code == 1 && modes(report) == BOTH_RUN
    });
    let verdict = |at: usize| report["nodes"][at]["ladder_verdict"]["verdict"].clone();
    assert_eq!([verdict(0), verdict(1)], ["same", "differs"], "{report:#}");
    assert_eq!(report["missing"][0]["node"], "gone", "{report:#}");
    check_in(&plants.saw, &folder.path().join("saw"));
    fs::remove_dir_all(folder.path().join("plant/gone")).unwrap();
    until("status", &shown, &["--expect", &expected], |code, _| code == 0);

    plants.saw.ok("mode stop");
    let report = until("status", &shown, &["--require-run"], |code, report| {
        code == 1 && modes(report)[1] == ["saw", "online", "STOP"]
    });
    assert_eq!(report["nodes"][0]["mode"], "RUN", "{report:#}");
}

#[test]
fn the_fleet_watch_reports_alarms_and_deaths() {
    let Some(broker) = Mosquitto::start(&MosquittoOptions::default()) else { return };
    let mut plants = TwoPlants::start(&broker.url(), "");
    let url = broker.url();
    let at = ["--broker", url.as_str()];
    let mut watch = FleetProcess::start(&["watch", "--rebirth", "--json", at[0], at[1], "low"]);
    let lines = watch.lines();
    let first = lines.until("a first value", |line| line["name"] == "low");
    let told = ["group", "node", "what"].map(|key| first[key].as_str().unwrap());
    assert_eq!((told, &first["first"]), (["plant", "saw", "value"], &true.into()), "{first}");
    assert_eq!(first["value"], false);
    plants.saw.ok("write low ON");
    let rise = lines.until("a change", |line| line["name"] == "low" && line["value"] == true);
    assert!(rise["first"].is_null() && rise["historical"].is_null(), "{rise}");

    let list = until("alarms", &at, &[], |_, list| list["alarms"][0]["alarm"]["tag"] == "low");
    let alarm = &list["alarms"][0];
    assert_eq!((&alarm["node"], &alarm["alarm"]["text"]), (&"saw".into(), &"Oil is low".into()));
    assert_eq!((&alarm["state"], &list["unknown"]), (&"online".into(), &Value::Array(Vec::new())));

    plants.edge_of_saw.end();
    lines.until("a death", |line| line["node"] == "saw" && line["what"] == "died");
    let (code, _, errors) = watch.stop();
    assert_eq!(code, 0, "{errors}");
}

/// A cluster whose first address is dead: the controllers are found at the next address.
///
/// If the dead server led a NATS server's consumers, a subscription takes ten seconds.
#[test]
#[ignore = "two minutes"]
fn a_cluster_without_one_node_still_serves_the_controllers() {
    let Some(mut cluster) = NatsCluster::start() else { return };
    let urls = cluster.urls();
    let plants = TwoPlants::start(&urls[1..].join("\", \""), "");
    let all = urls.join(",");
    let at = ["--broker", all.as_str()];
    // In a cluster without a leader, a client waits.
    let patient = ["--require-run", "--wait", "12s"];
    until("status", &at, &patient, |code, report| code == 0 && modes(report) == BOTH_RUN);
    cluster.kill(0);
    until("status", &at, &patient, |code, report| code == 0 && modes(report) == BOTH_RUN);
    let mut watch = FleetProcess::start(&["watch", "--rebirth", "--json", at[0], at[1], "n"]);
    let lines = watch.lines();
    let value = |line: &Value| line["value"].as_i64().filter(|_| line["historical"].is_null());
    let first = value(&lines.until("a value", |line| value(line).is_some())).unwrap();
    lines.until("a change", |line| value(line).is_some_and(|value| value > first));
    let (code, _, errors) = watch.stop();
    assert_eq!(code, 0, "{errors}");
    drop(plants);
}
