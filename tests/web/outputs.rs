//! What a page gets of an output and of the mode: what is driven, not what memory holds.

use serde_json::{Value, json};

use crate::web::client::Web;
use rungd_test_support::running::live::Live;

const LADDER: &str = r#"
ladder.name = "oven"
[tags]
heat = { at = "C0", log = "change" }
level = { at = "D0", log = "change" }
temperature = { at = "R0", log = "change" }
heater = { at = "Y0", log = "change" }
fan = { at = "Y1" }
valve = { at = "Y2" }
[[program]]
name = "Main"
rung = [{ when = ["heat"], do = ["SET heater", "SET valve"] }]
"#;
const CONTROLLER: &str = "[outputs]\non = [\"Y1\"]\nhold = [\"Y2\"]\n";
const WINDOW: &str = "/events?element=Main&from=1&to=1&tags=heater,fan,valve,level";

#[test]
fn a_page_gets_the_driven_outputs_outside_run() {
    let web = Web::of(Live::start(LADDER, CONTROLLER, &[]), &[]);
    let visitor = web.visit();
    web.live.ok("write heat ON");
    let seen = web.until(WINDOW, &visitor, |event| event["values"]["heater"] == true);
    assert_eq!(seen["now"], json!({ "mode": "RUN", "reason": null }));
    let rungs = web.get("/api/rungs?element=Main&from=1&to=1", &visitor).json();
    assert_eq!(rungs["rungs"][0]["outputs"], json!(["heater", "valve"]));
    let held = web.get("/api/hold", &visitor).json();
    web.live.ok("mode stop");
    let stopped = |event: &Value| event["now"]["mode"] == "STOP";
    let seen = web.until(WINDOW, &visitor, stopped);
    let values = &seen["values"];
    assert_eq!(values["heater"], json!({ "on": false, "memory": true }));
    assert_eq!(values["fan"], json!({ "on": true, "memory": false }));
    assert_eq!(values["valve"], json!({ "on": true, "memory": true }));
    assert_eq!((&values["level"], &seen["running"]), (&json!(0), &json!([])));
    assert_eq!(seen["executes"], false);
    let why = web.get("/api/why?operand=heater", &visitor).json();
    let head = "heater (Y0) is ON in memory; its output is OFF, the safe value in STOP\n";
    assert!(why["text"].as_str().unwrap().starts_with(head), "{why}");
    assert_eq!(why["answer"]["output"], json!({ "known": true, "on": false }));
    let trend = web.get("/api/trend?operand=heater", &visitor).json();
    let points = trend["points"].as_array().unwrap();
    assert_eq!(points.iter().map(|point| &point[2]).collect::<Vec<_>>(), [false, true, false]);
    // A scan that was held shows what was driven in it; the present mode stands beside it.
    let (hold, last) = (&held["hold"], &held["scans"][1]);
    let scan = format!("/api/scan?element=Main&from=1&to=1&tags=heater&hold={hold}&scan={last}");
    assert_eq!(web.get(&scan, &visitor).json()["values"]["heater"], true);
    // `rungd web` asks for the status once a second: one of before the stop may be there still.
    let status = loop {
        let status = web.get("/api/status", &visitor).json();
        assert_eq!((&status["now"]["mode"], &status["error"]), (&json!("STOP"), &json!(null)));
        if status["status"]["mode"] == "STOP" {
            break status;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    };
    assert_eq!(status["status"]["blocks"][0]["running"], false);
    web.live.ok("mode run");
    web.until(WINDOW, &visitor, |event| event["values"]["heater"] == true);
}

#[test]
fn values_of_number_events_are_json_numbers() {
    let web = Web::of(Live::start(LADDER, CONTROLLER, &[]), &[]);
    let visitor = web.visit();
    for write in ["level 1", "temperature 1.5", "heat ON"] {
        web.live.ok(&format!("write {write}"));
    }
    let window = "/events?tags=heater";
    web.until(window, &visitor, |event| event["values"]["heater"] == true);
    let happened = web.get("/api/events", &visitor).json();
    let all = happened["events"].as_array().unwrap();
    let has = |text: &str| all.iter().any(|of| of["text"].as_str().unwrap().ends_with(text));
    for text in ["level is 1, was 0", "temperature is 1.5, was 0.0", "heater is ON"] {
        assert!(has(text), "{text}: {happened}");
    }
    for text in ["wrote 1 to level", "wrote 1.5 to temperature", "wrote ON to heat"] {
        assert!(has(text), "{text}: {happened}");
    }
}
