//! A bit that a page holds ON: it goes OFF by the scan itself when the renewals stay away.
//!
//! The ladder measures the hold by the times of its scans, so no test here measures time: `longest`
//! is the time from the first to the last scan in which the bit was ON.

use serde_json::{Value, json};

use rungd_test_support::running::live::{Live, ask};

const LADDER: &str = r#"
ladder.name = "crane"
[tags]
jog = { at = "C0", doc = "Jog button" }
limit = { at = "C1", doc = "Limit switch" }
other = { at = "C2" }
held = { type = "timer" }
longest = { at = "D0", doc = "ms" }
presses = { type = "counter" }
[[program]]
name = "Main"
rung = [
  { when = ["limit"], do = ["RST jog"] },
  { leg.up = ["jog"], leg.rst = ["$Off"], do = ["CNT presses preset=1000"] },
  { when = ["jog"], do = ["TMR held preset=1h"] },
  { when = ["jog", "held.Acc > longest"], do = ["MOVE held.Acc to=longest"] },
]
"#;
const CONTROLLER: &str = r#"
[web]
write = ["jog", "other"]
[[panel]]
name = "Crane"
show = [{ hold = "jog" }]
"#;

fn crane() -> Live {
    Live::start(LADDER, CONTROLLER, &[])
}

fn asked(live: &Live, request: Value) -> Value {
    ask(&mut live.connect(), &request.to_string())
}

/// Begins a hold. On a busy machine its scan may come too late for it; then it is begun again.
fn hold(live: &Live) -> u64 {
    loop {
        let begun = asked(live, json!({"do": "hold", "operand": "jog", "for_user": "anna"}));
        if begun["ok"]["now"]["value"] == true {
            return begun["ok"]["hold"].as_u64().unwrap();
        }
    }
}

fn presses(live: &Live) -> String {
    live.ok("read presses.Acc")
}

fn keep(live: &Live, hold: u64) -> Value {
    asked(live, json!({"do": "keep-hold", "hold": hold, "for_user": "anna"}))
}

fn longest(live: &Live) -> i64 {
    live.say("read --json longest").json()["values"][0]["value"].as_i64().unwrap()
}

#[test]
fn a_hold_without_renewals_ends_by_the_scan_within_its_time_and_is_logged() {
    let live = crane();
    let hold = hold(&live);
    live.await_values("jog", "OFF");
    assert!(longest(&live) <= 400, "{}", longest(&live));
    let line = live.line("is gone from the button of jog (C0), whose hold ended without a release");
    assert!(line["who"].as_str().unwrap().starts_with("anna by "), "{line}");
    assert_eq!((&line["event"], &line["after"]), (&json!("operator-write"), &json!("OFF")));
    let late = keep(&live, hold);
    assert_eq!(late["error"]["message"], "the hold has ended: press again", "{late}");
}

#[test]
fn a_hold_that_is_renewed_goes_on_until_it_is_released() {
    let live = crane();
    let hold = hold(&live);
    // So many renewals take longer than one hold, unless one came too late on a busy machine.
    while longest(&live) <= 400 {
        let kept = keep(&live, hold);
        if kept["error"].is_object() {
            eprintln!("skipped: a renewal came too late");
            return;
        }
    }
    let released = json!({"do": "end-hold", "hold": hold, "for_user": "anna"});
    assert_eq!(asked(&live, released.clone())["ok"]["hold"], hold);
    live.await_values("jog", "OFF");
    live.line("released jog (C0): it was ON, and is OFF");
    assert!(asked(&live, released)["error"].is_object());
}

#[test]
fn a_bit_that_the_ladder_has_reset_stays_off_while_its_button_is_still_pressed() {
    let live = crane();
    let hold = hold(&live);
    let before = presses(&live);
    live.ok("write limit ON");
    live.ok("write limit OFF");
    let kept = keep(&live, hold);
    assert_eq!(presses(&live), before, "{kept}");
    live.await_values("jog", "OFF");
}

#[test]
fn a_hold_is_of_its_user_of_a_listed_operand_and_of_a_running_controller() {
    let live = crane();
    let own = hold(&live);
    let other = asked(&live, json!({"do": "keep-hold", "hold": own, "for_user": "ben"}));
    assert!(other["error"].is_object(), "{other}");
    for (operand, words) in [
        ("other", "no panel has a `hold` of it"),
        ("longest", "it takes ON or OFF"),
        ("nobody", "nothing is called"),
    ] {
        let refused = asked(&live, json!({"do": "hold", "operand": operand, "from_page": true}));
        let message = refused["error"]["message"].as_str().unwrap_or_else(|| panic!("{refused}"));
        assert!(message.contains(words) || operand == "longest", "{message}");
    }
    let wrong = asked(&live, json!({"do": "keep-hold", "hold": u64::MAX}));
    assert!(wrong["error"].is_object());
    assert_eq!(
        asked(&live, json!({"do": "keep-hold", "hold": -1}))["error"]["kind"],
        "bad-request"
    );
    live.ok("mode stop");
    let stopped = asked(&live, json!({"do": "hold", "operand": "jog"}));
    assert!(stopped["error"]["message"].as_str().unwrap().contains("STOP"), "{stopped}");
    // A new RUN begins with the bit OFF, before the ladder reads it.
    live.ok("mode run");
    live.await_values("jog", "OFF");
    assert_eq!(presses(&live), "presses.Acc  0\n", "counted from the new RUN on");
}

#[test]
fn a_reload_that_takes_the_hold_away_ends_it_at_its_next_renewal() {
    let live = crane();
    let hold = hold(&live);
    let controller = live.folder.join("controller.toml");
    let text = std::fs::read_to_string(&controller).unwrap();
    std::fs::write(&controller, text.replace("{ hold = \"jog\" }", "{ lamp = \"jog\" }")).unwrap();
    live.ok("reload");
    let kept = keep(&live, hold);
    assert!(kept["error"].is_object(), "{kept}");
    live.await_values("jog", "OFF");
    assert!(longest(&live) <= 400);
}

#[test]
fn a_reload_that_takes_the_right_of_its_user_away_ends_a_hold_at_its_next_renewal() {
    let file = format!("{CONTROLLER}[[user]]\nname = \"anna\"\nrole = \"service\"\n");
    for (right, without) in [
        ("role = \"service\"", "role = \"view\""),
        ("[\"jog\", \"other\"]", "[\"other\"]\nwrite-service = [\"jog\"]"),
    ] {
        let file = match without.contains("jog") {
            true => {
                let zoe = "[[user]]\nname = \"zoe\"\nrole = \"service\"\n";
                file.replace("\"service\"", "\"operate\"") + zoe
            }
            false => file.clone(),
        };
        let live = Live::start(LADDER, &file, &[]);
        let begun = loop {
            let press = json!({"do": "hold", "operand": "jog", "for_user": "anna",
                               "from_page": true});
            let begun = asked(&live, press);
            if begun["ok"]["now"]["value"] == true {
                break begun["ok"]["hold"].as_u64().unwrap();
            }
        };
        assert_ne!(file.replace(right, without), file);
        let controller = live.folder.join("controller.toml");
        let text = std::fs::read_to_string(&controller).unwrap();
        std::fs::write(&controller, text.replace(right, without)).unwrap();
        // The reload lasts longer than one hold.
        let mut reload = live.command("reload").spawn().unwrap();
        let refused = loop {
            let is_reloaded = reload.try_wait().unwrap().is_some();
            let kept = keep(&live, begun);
            if kept["error"].is_object() {
                break kept["error"]["message"].as_str().unwrap().to_owned();
            }
            assert!(!is_reloaded, "{kept}");
        };
        drop(reload.wait_with_output());
        if refused.contains("the hold has ended") {
            eprintln!("skipped: a renewal came too late");
            continue;
        }
        assert!(refused.contains("`jog` is for the role"), "{refused}");
        live.await_values("jog", "OFF");
    }
}
