//! The contents of a scrape: a controller's values, modes and alarms, a reload, and its end.

use crate::metrics::rig::{CONTROLLER, LADDER, Served, has_prometheus, promtool};
use rungd_test_support::running::live::Live;

const OPEN: &str = "application/openmetrics-text; version=1.0.0";

/// The value of the sample whose line begins with `sample`.
fn value(text: &str, sample: &str) -> f64 {
    let line = text.lines().find_map(|line| line.strip_prefix(&format!("{sample} ")));
    let line = line.unwrap_or_else(|| panic!("no {sample} in:\n{text}"));
    line.parse().unwrap_or_else(|_| panic!("{sample} {line}"))
}

/// This machine's clock, s since 1970.
fn unix_s() -> f64 {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    now.expect("after 1970").as_secs_f64()
}

#[test]
fn a_scrape_contains_the_values_of_status_and_read() {
    let before_s = unix_s();
    let served = Served::start();
    // The device is up after some exchanges, and the scan log once its folder is open.
    served.await_line("rungd_device_up{device=\"plant\",driver=\"simulated\"} 1");
    let text = served.await_line("rungd_record_failing 0");
    for line in [
        "rungd_up 1",
        "rungd_mode{mode=\"RUN\"} 1",
        "rungd_mode{mode=\"STOP\"} 0",
        "rungd_period_seconds 0.01",
        "rungd_forces 0",
        "rungd_tag{tag=\"level\",unit=\"mm\"} 1234",
        "rungd_tag{tag=\"ratio\",unit=\"%\"} 0.1",
        "rungd_tag{tag=\"pump\",unit=\"\"} 1",
        "rungd_tag{tag=\"parts.Acc\",unit=\"\"} 0",
        "rungd_tag{tag=\"shift[1]\",unit=\"\"} 0",
        "rungd_retain_failing 0",
        "rungd_alarms{priority=\"critical\",state=\"unacknowledged\"} 0",
    ] {
        assert!(text.lines().any(|of| of == line), "no `{line}` in:\n{text}");
    }
    assert!(!text.contains("\"plain\""), "a unit alone makes no metric:\n{text}");
    assert!(text.contains("ladder=\"tank \\\"7\\\"\""), "{text}");
    assert!(value(&text, "rungd_scans_total") > 0.0);
    let count = value(&text, "rungd_scan_lateness_seconds_count");
    assert_eq!(value(&text, "rungd_scan_lateness_seconds_bucket{le=\"+Inf\"}"), count);
    assert!(value(&text, "rungd_scan_execution_seconds_sum") > 0.0);
    let started_s = value(&text, "rungd_start_time_seconds");
    // With room for a time that is rounded to a second.
    assert!((before_s - 1.0..=unix_s() + 1.0).contains(&started_s), "{started_s}");
}

#[test]
fn both_metric_formats_pass_their_validator() {
    if !has_prometheus() {
        return;
    }
    let served = Served::start();
    served.live.ok("write asked ON");
    served.await_line("rungd_alarms{priority=\"critical\",state=\"unacknowledged\"} 1");
    promtool(&["check", "metrics"], &served.text());
    promtool(&["check", "metrics"], include_str!("../../crates/fleet/src/metrics/expected.prom"));
    promtool(&["check", "metrics"], &served.live.ok("metrics"));
    let older = served.ask("GET /metrics", "text/plain");
    assert!(older.head.contains("content-type: text/plain; version=0.0.4"), "{older:?}");
    let open = served.ask("GET /metrics", OPEN);
    assert!(open.head.contains("content-type: application/openmetrics-text; version=1.0.0"));
    assert!(open.body.ends_with("\n# EOF\n") && !older.body.contains("# EOF"), "{open:?}");
    assert!(open.body.contains("# UNIT rungd_scan_lateness_seconds seconds\n"), "{open:?}");
}

#[test]
fn metrics_follow_modes_alarms_forces_and_reloads() {
    let served = Served::start();
    served.live.ok("write asked ON");
    served.live.ok("force X3 ON");
    let text = served.await_line("rungd_alarms{priority=\"critical\",state=\"unacknowledged\"} 1");
    let alarm = "rungd_alarm{alarm=\"stuck\",priority=\"critical\",state=\"unacknowledged\",\
                 text=\"The pump does not \u{fffd}[31manswer\"} 1";
    assert!(text.lines().any(|line| line == alarm), "{text}");
    served.await_line("rungd_forces 1");
    served.live.ok("ack stuck");
    served.await_line("rungd_alarms{priority=\"critical\",state=\"acknowledged\"} 1");
    // A changed ladder has different tags.
    let ladder = LADDER.replace("level = {", "height = {").replace("to=level", "to=height");
    std::fs::write(served.live.folder.join("ladder.toml"), ladder).unwrap();
    served.live.ok("reload");
    let text = served.await_line("rungd_tag{tag=\"height\",unit=\"mm\"} 1234");
    assert!(!text.contains("\"level\""), "{text}");
    served.live.ok("mode stop");
    served.await_line("rungd_mode{mode=\"STOP\"} 1");
}

#[test]
fn metrics_show_the_end_and_the_return_of_a_controller() {
    let mut served = Served::start();
    served.await_line("rungd_up 1");
    served.live.end();
    let text = served.await_line("rungd_up 0");
    assert_eq!(text.lines().count(), 3, "nothing old is shown: {text}");
    let run = rungd_test_support::running::live::run(&served.live.folder, &[]);
    let folder = served.live.folder.clone();
    let _again = Live::of(folder, run);
    served.await_line("rungd_up 1");
}

#[test]
fn a_controller_without_metric_tags_has_the_metrics_of_rungd() {
    let plain = "[[program]]\nname = \"Main\"\nrung = []\n";
    let live = Live::start(plain, "", &[]);
    let text = live.ok("metrics");
    assert!(text.contains("\nrungd_up 1\n") && !text.contains("rungd_tag{"), "{text}");
    assert!(!text.contains("rungd_retain") && !text.contains("rungd_device_up"), "{text}");
    assert!(CONTROLLER.contains("[retain]"), "the other one has it");
}
