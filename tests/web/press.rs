//! Buttons that are held: a press of a page, and what ends it.

use serde_json::{Value, json};

use super::users::signed_in;
use crate::web::client::{HttpAnswer, Visitor, Web};

/// `longest` is the time from the first to the last scan in which the bit was ON, in ms.
const LADDER: &str = r#"
ladder.name = "crane"
[tags]
jog = { at = "C0" }
start = { at = "C1" }
held = { type = "timer" }
longest = { at = "D0" }
[[program]]
name = "Main"
rung = [
  { when = ["jog"], do = ["TMR held preset=1h"] },
  { when = ["jog", "held.Acc > longest"], do = ["MOVE held.Acc to=longest"] },
]
"#;
const CONTROLLER: &str = r#"
[web]
write = ["jog", "start"]
[[panel]]
name = "Crane"
show = [{ hold = "jog" }]
"#;

fn crane() -> (Web, Visitor) {
    signed_in(LADDER, CONTROLLER)
}

/// Presses until a scan has seen it: on a busy machine it may come too late.
fn press(web: &Web, anna: &Visitor) -> u64 {
    loop {
        let pressed = web.post("/api/press", anna, &json!({ "operand": "jog" }));
        if pressed.status == 200 && pressed.json()["now"]["value"] == true {
            return pressed.json()["hold"].as_u64().unwrap();
        }
    }
}

fn longest(web: &Web) -> i64 {
    web.live.say("read --json longest").json()["values"][0]["value"].as_i64().unwrap()
}

#[test]
fn a_press_ends_if_the_server_is_killed_or_stands_still() {
    for signal in ["KILL", "STOP"] {
        let (web, anna) = crane();
        press(&web, &anna);
        web.signal(signal);
        web.live.await_values("jog", "OFF");
        assert!(longest(&web) <= 400, "{}", longest(&web));
        let line = web.live.line("whose hold ended without a release");
        assert!(line["who"].as_str().unwrap().starts_with("anna by "), "{line}");
    }
}

#[test]
fn a_press_is_released_by_its_page_and_refused_if_it_is_late_or_wrong() {
    let (web, anna) = crane();
    let post = |said: Value| web.post("/api/press", &anna, &said);
    let hold = press(&web, &anna);
    let released = post(json!({ "hold": hold, "end": true }));
    // On a busy machine it had ended by itself.
    assert!([200, 409].contains(&released.status), "{released:?}");
    web.live.await_values("jog", "OFF");
    assert_eq!(post(json!({ "hold": hold })).status, 409, "a renewal that comes late");
    let error = |answer: &HttpAnswer| answer.json()["error"].to_string();
    let not_held = post(json!({ "operand": "start" }));
    assert!(not_held.status == 403 && error(&not_held).contains("`hold`"), "{not_held:?}");
    assert_eq!(post(json!({ "operand": "longest" })).status, 403);
    for wrong in
        [json!({}), json!({ "operand": "nobody" }), json!({ "hold": "1" }), json!({ "hold": -1 })]
    {
        assert_eq!(post(wrong.clone()).status, 400, "{wrong}");
    }
    assert_eq!(post(json!({ "hold": u64::MAX })).status, 409);
    let stolen = Visitor { csrf: String::new(), ..anna.clone() };
    assert_eq!(web.post("/api/press", &stolen, &json!({ "operand": "jog" })).status, 403);
    // A page that says when it will give up is never too late for the machine.
    let clock = json!({ "clock": "0123456789abcdef", "ms": 1 });
    let foreign = post(json!({ "operand": "jog", "deadline": clock }));
    assert_eq!(foreign.status, 400, "{foreign:?}");
    web.live.await_values("jog", "OFF");
}
