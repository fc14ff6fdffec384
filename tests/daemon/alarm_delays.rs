//! `delay`, `off-delay` and `group` of alarms, with the real binary. No test waits for a time: a
//! delay is either an hour, or some milliseconds after which the log tells.

use serde_json::Value;

use rungd_test_support::running::live::Live;

const LADDER: &str = r#"
[tags]
soon   = { at = "C0", alarm = "Soon", delay = "20ms", group = "Pumps" }
late   = { at = "C1", alarm = "Late", delay = "1h", group = "Pumps" }
stays  = { at = "C2", alarm = "Stays", off-delay = "1h" }
leaves = { at = "C3", alarm = "Leaves", off-delay = "20ms" }
plain  = { at = "C4", alarm = "Plain" }
# A bit of a word: the scan thread's numbers have it behind the others.
deep   = { at = "MHR1.3", alarm = "Deep" }
[[program]]
name = "Main"
rung = [
  { when = ["soon", "late", "stays", "leaves", "plain", "deep"], do = ["OUT Y0"] },
  { when = ["$On"], do = ["OUT C7"] },
]
"#;

/// The tags of the alarms in an answer.
fn tags(answer: &Value) -> Vec<String> {
    let alarms = answer["alarms"].as_array().expect("a list");
    alarms.iter().map(|alarm| alarm["tag"].as_str().expect("a tag").to_owned()).collect()
}

#[test]
fn an_alarm_rises_and_goes_after_its_delays_in_the_log_the_list_and_the_status() {
    let live = Live::scanning(LADDER);
    for tag in ["late", "soon", "stays", "leaves"] {
        live.ok(&format!("write {tag} on"));
    }
    live.line("alarm ON: Soon");
    let list = live.say("alarms --json").json();
    let mut risen = tags(&list);
    risen.sort();
    assert_eq!(risen, ["leaves", "soon", "stays"], "`late` waits for an hour");
    assert_eq!(tags(&live.say("status --json").json()).len(), 3);
    let is_soon = |alarm: &&Value| alarm["tag"] == "soon";
    let soon = list["alarms"].as_array().expect("a list").iter().find(is_soon).expect("it rose");
    assert_eq!(soon["group"], "Pumps");
    for tag in ["late", "soon", "stays", "leaves"] {
        live.ok(&format!("write {tag} off"));
    }
    live.line("alarm OFF after");
    live.line("alarm OFF after");
    let list = live.say("alarms --json").json();
    let states = list["alarms"].as_array().expect("a list").iter().map(|alarm| &alarm["state"]);
    assert_eq!(states.collect::<Vec<_>>(), ["unacknowledged", "returned", "returned"]);
    assert_eq!(tags(&list)[0], "stays", "its bit has been OFF for less than an hour");
    let group = live.say("alarms --json --group Pumps").json();
    assert_eq!(tags(&group), ["soon"]);
    assert!(live.ok("alarms").contains("\n     medium, Pumps, NOT ACKNOWLEDGED, from "));
}

#[test]
fn an_alarm_of_a_bit_of_a_word_is_named_in_the_list() {
    let live = Live::scanning(LADDER);
    live.ok("write MHR1 8");
    assert_eq!(live.line("alarm ON")["tag"], "deep");
    assert_eq!(tags(&live.say("alarms --json").json()), ["deep"]);
    live.ok("write plain on");
    assert_eq!(tags(&live.say("alarms --json").json()), ["deep", "plain"]);
}

#[test]
fn a_waiting_alarm_waits_on_over_a_reload_and_takes_the_new_delay() {
    let live = Live::scanning(LADDER);
    live.ok("write late on");
    let ladder = LADDER.replace("delay = \"1h\", group", "delay = \"1ms\", group");
    std::fs::write(live.folder.join("ladder.toml"), ladder).expect("written");
    live.ok("reload");
    assert_eq!(live.line("alarm ON")["tag"], "late");
    assert_eq!(tags(&live.say("alarms --json").json()), ["late"]);
}
