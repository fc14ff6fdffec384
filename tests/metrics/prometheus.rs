//! A real Prometheus scrapes a controller; the alert rules are loaded into it, and every query of
//! the dashboard is sent to it.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::metrics::rig::{Served, answer_of, has_prometheus, promtool, said_after};
use rungd_test_support::running::live::PATIENCE;

const RULES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/packaging/prometheus/rungd.rules.yml");
const DASHBOARD: &str = include_str!("../../packaging/grafana/rungd.json");

/// A Prometheus with a separate folder.
struct Prometheus {
    child: Child,
    host: String,
    folder: PathBuf,
}

impl Prometheus {
    fn start(served: &Served) -> Prometheus {
        let folder = served.live.folder.join("prometheus");
        std::fs::create_dir_all(&folder).unwrap();
        let config = format!(
            "global: {{ scrape_interval: 2s, evaluation_interval: 1s }}\n\
             rule_files: [ {RULES} ]\n\
             scrape_configs:\n- job_name: rungd\n  static_configs:\n  - targets: [ \"{}\" ]\n",
            served.host
        );
        let file = folder.join("prometheus.yml");
        std::fs::write(&file, config).unwrap();
        let mut command = Command::new("prometheus");
        command.arg(arg("config.file", &file)).arg(arg("storage.tsdb.path", &folder.join("data")));
        command.args(["--web.listen-address=127.0.0.1:0", "--log.format=logfmt"]);
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let said = said_after(&mut child, "msg=\"Listening on\" address=");
        let host = said.split_whitespace().next().unwrap().to_owned();
        let prometheus = Prometheus { child, host, folder };
        let deadline = Instant::now() + PATIENCE;
        // Prometheus listens before it has read its rules.
        let ready = b"GET /-/ready HTTP/1.0\r\n\r\n";
        while answer_of(&prometheus.host, ready).status != 200 {
            assert!(Instant::now() < deadline, "it is not ready");
            std::thread::sleep(Duration::from_millis(50));
        }
        prometheus
    }

    /// The `data` of an answer of Prometheus's API.
    fn get(&self, path: &str) -> Value {
        let request = format!("GET /api/v1/{path} HTTP/1.0\r\nHost: {}\r\n\r\n", self.host);
        let answer = answer_of(&self.host, request.as_bytes());
        let body: Value = serde_json::from_str(&answer.body)
            .unwrap_or_else(|error| panic!("{error}: {path}: {answer:?}"));
        assert_eq!((answer.status, &body["status"]), (200, &"success".into()), "{path}: {body}");
        body["data"].clone()
    }

    /// The present series of a query.
    fn query(&self, query: &str) -> Vec<Value> {
        let encoded: String = query.bytes().map(|byte| format!("%{byte:02X}")).collect();
        let data = self.get(&format!("query?query={encoded}"));
        data["result"].as_array().unwrap_or_else(|| panic!("{query}: {data}")).clone()
    }

    /// Waits until a query has data.
    fn await_data(&self, query: &str) -> Vec<Value> {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let series = self.query(query);
            if !series.is_empty() {
                return series;
            }
            assert!(Instant::now() < deadline, "no data: {query}");
            std::thread::sleep(Duration::from_millis(200));
        }
    }
}

fn arg(name: &str, path: &Path) -> String {
    format!("--{name}={}", path.display())
}

impl Drop for Prometheus {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// The queries of the dashboard, as Grafana sends them with `All` chosen.
fn queries() -> Vec<String> {
    let dashboard: Value = serde_json::from_str(DASHBOARD).expect("JSON");
    let panels = dashboard["panels"].as_array().expect("panels").iter();
    let targets = panels.flat_map(|panel| panel["targets"].as_array().expect("targets"));
    let queries = targets.map(|target| target["expr"].as_str().expect("a query"));
    let chosen = |query: &str| {
        let query = query.replace("$job", ".*").replace("$instance", ".*").replace("$tag", ".*");
        let query = query.replace("$__rate_interval", "1m");
        assert!(!query.contains('$'), "{query}");
        query
    };
    queries.map(chosen).collect()
}

#[test]
fn prometheus_scrapes_the_metrics_and_the_dashboard_shows_them() {
    if !has_prometheus() {
        return;
    }
    let served = Served::start();
    served.live.ok("write asked ON");
    let prometheus = Prometheus::start(&served);
    prometheus.await_data("rungd_up == 1");
    let level = prometheus.await_data("rungd_tag{tag=\"level\"}");
    assert_eq!(
        (&level[0]["metric"]["unit"], &level[0]["value"][1]),
        (&"mm".into(), &"1234".into())
    );
    let queries = queries();
    assert!(queries.len() > 20, "{queries:?}");
    queries.iter().for_each(|query| {
        prometheus.await_data(query);
    });
    // A metric that the text format omits would be missing here, for example the histogram.
    let p99 = "histogram_quantile(0.99, rate(rungd_scan_lateness_seconds_bucket[1m])) >= 0";
    prometheus.await_data(p99);
    prometheus.await_data("up{job=\"rungd\"} == 1");
}

#[test]
fn prometheus_accepts_and_evaluates_the_alert_rules() {
    if !has_prometheus() {
        return;
    }
    promtool(&["check", "rules", RULES], "");
    let mut served = Served::start();
    let prometheus = Prometheus::start(&served);
    prometheus.await_data("rungd_up == 1");
    let rules = || prometheus.get("rules")["groups"][0]["rules"].as_array().cloned();
    let deadline = Instant::now() + PATIENCE;
    // Prometheus evaluates every rule.
    loop {
        let rules = rules().unwrap_or_default();
        assert!(rules.iter().all(|rule| rule["health"] != "err"), "{rules:?}");
        if rules.len() > 10 && rules.iter().all(|rule| rule["health"] == "ok") {
            break;
        }
        assert!(Instant::now() < deadline, "{rules:?}");
        std::thread::sleep(Duration::from_millis(200));
    }
    let begun = |name: &str| {
        let rule = rules().unwrap_or_default().into_iter().find(|rule| rule["name"] == name);
        rule.unwrap_or_else(|| panic!("no {name}"))["state"] != "inactive"
    };
    let until = |name: &str| {
        let deadline = Instant::now() + PATIENCE;
        while !begun(name) {
            assert!(Instant::now() < deadline, "{name} does not come");
            std::thread::sleep(Duration::from_millis(200));
        }
    };
    assert!(!begun("RungdFault") && !begun("RungdDeviceDown") && !begun("RungdForcesActive"));
    served.live.ok("write asked ON");
    served.live.ok("force X3 ON");
    until("RungdAlarmUnacknowledged");
    until("RungdForcesActive");
    served.live.ok("mode stop");
    until("RungdStopped");
    served.live.end();
    until("RungdDown");
    let _ = served.child.kill();
    until("RungdMetricsDown");
}
