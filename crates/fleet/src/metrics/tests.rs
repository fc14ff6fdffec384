//! The families of a given look, as text: every name that `docs/metrics.md` lists.

use expect_test::expect_file;
use serde_json::json;

use super::scraped::Scraped;
use super::text::{Exposition, text};
use super::{controller, parts};

/// A look at a controller that has all parts.
fn scraped() -> Scraped {
    let bars = json!([
        {"up_to_us": 0.5, "count": 1}, {"up_to_us": 8.2, "count": 90},
        {"up_to_us": 16.4, "count": 8}, {"up_to_us": 2147483.6, "count": 1}
    ]);
    let spread = json!({
        "last_us": 12.5, "min_us": 0.4, "sum_us": 2_001_234.5, "mean_us": 12.0, "p50_us": 12.0,
        "p99_us": 31.0, "p999_us": 40.0, "max_us": 44.0, "histogram": bars
    });
    let status = json!({
        "protocol": 1, "version": "0.2.0", "pid": 7, "uptime_ms": 61_000,
        "controller": "c.toml", "mode": "RUN", "reason": null, "mode_ms": 60_500, "scans": 6000,
        "period_us": 10_000, "watchdog_us": 200_000,
        "posture": [{"asked": "memory locked", "granted": false, "why": "no permission"}],
        "ladder": {"name": "belt", "files": "a.toml", "sha256": "abc", "blocks": 2, "rungs": 3},
        "scan": {"over_ms": 60_000, "scans": 6000, "overruns": 2, "skipped": 1,
                 "execution": spread, "lateness": spread},
        "blocks": [],
        "forces": [{"operand": "X1", "tag": null, "address": "X1", "value": true, "forced": true}],
        "devices": {"modbus": {"address": "127.0.0.1:1502", "clients": 1, "connections_max": 16},
            "simulated_rules": null,
            "field": [device("io", true), device("drive", false)]},
        "retain": {"file": "memory", "interval_ms": 1000, "restored": "", "image": 3, "scan": 40,
            "age_ms": 1500, "flush_us": 800, "flush_max_us": 12_000, "writes": 3, "bytes": 4096,
            "bytes_per_day": null, "budget_per_day": 1, "failing": null},
        "record": {"memory_ms": 61_000, "memory_bytes": 16, "lost": 4, "disk":
            {"dir": "record", "bytes": 1000, "size": 256_000_000, "failing": "disk full"}},
        "log": {"level": "info", "lines_dropped": 5, "records_dropped": 6}
    });
    let alarms = json!([
        {"tag": "jam", "text": "The belt is \"jammed\"", "priority": "high",
         "state": "unacknowledged"},
        {"tag": "p1.failed", "text": "x".repeat(200), "priority": "critical", "state": "returned"}
    ]);
    let values = json!([
        value("level", json!(0.1), Some("m")),
        value("shift", json!(-12), None),
        value("pump", json!(true), None)
    ]);
    Scraped {
        status: serde_json::from_value(status).expect("a status"),
        alarms: serde_json::from_value(alarms).expect("alarms"),
        values: serde_json::from_value(values).expect("values"),
        left_out: 0,
        start_s: 1_790_000_000.25,
    }
}

fn device(name: &str, ok: bool) -> serde_json::Value {
    json!({"name": name, "driver": "modbus-tcp", "peer": "10.0.0.9:502", "ok": ok, "stale": !ok,
           "exchanges": 9, "failures": 3, "took_us": 800, "took_max_us": 900, "trouble": null})
}

fn value(tag: &str, value: serde_json::Value, unit: Option<&str>) -> serde_json::Value {
    json!({"operand": tag, "tag": tag, "address": tag, "value": value, "unit": unit,
           "forced": false})
}

#[test]
fn every_metric_family_is_printed_in_both_formats() {
    let seen = scraped();
    let mut families = vec![controller::up(true)];
    families.extend(controller::families(&seen));
    families.extend(parts::families(&seen));
    let older = text(&families, Exposition::Prometheus);
    expect_file!["expected.prom"].assert_eq(&older);
    expect_file!["expected.om"].assert_eq(&text(&families, Exposition::OpenMetrics));
    let silent = text(&[controller::up(false)], Exposition::Prometheus);
    assert!(silent.ends_with("\nrungd_up 0\n") && silent.lines().count() == 3, "{silent}");
}

/// A graph shows what the machine has: outside RUN the safe value of an output, and nothing while
/// the device of an output is lost.
#[test]
fn the_metric_of_an_output_shows_the_driven_value() {
    let mut seen = scraped();
    let mut stopped = value("stopped", json!(true), None);
    stopped["driven"] = json!(false);
    let mut lost = value("lost", json!(true), None);
    lost["unknown"] = json!({ "device": "io", "last": true });
    let values = json!([stopped, lost, value("runs", json!(true), None)]);
    seen.values = serde_json::from_value(values).expect("values");
    let told = text(&parts::families(&seen), Exposition::Prometheus);
    let tags: Vec<&str> = told.lines().filter(|line| line.starts_with("rungd_tag{")).collect();
    let expected =
        ["rungd_tag{tag=\"stopped\",unit=\"\"} 0", "rungd_tag{tag=\"runs\",unit=\"\"} 1"];
    assert_eq!(tags, expected);
}

#[test]
fn the_page_lists_every_metric_name() {
    let page = include_str!("../../../../docs/metrics.md");
    let text = include_str!("expected.prom");
    for line in text.lines().filter_map(|line| line.strip_prefix("# TYPE ")) {
        let name = line.split(' ').next().unwrap_or_default();
        assert!(page.contains(&format!("`{name}`")), "{name}");
    }
}
