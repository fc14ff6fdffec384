//! `[[watch]]` on a running controller, with the real binary at both ends of the socket.

use serde_json::Value;

use rungd_test_support::running::live::Live;

const LADDER: &str = r#"
[tags]
left   = { at = "X0" }
right  = { at = "X1" }
press  = { at = "Y0" }
bottle = { at = "X2" }
level  = { type = "int" }
jam    = { at = "C0", alarm = "Jam" }
[[program]]
name = "Main"
rung = [
  { when = ["left", "right"], do = ["SET press"] },
  { when = ["!left", "!right"], do = ["RST press"] },
  { when = ["$On"], do = ["OUT C7"] },
]
"#;

const WATCHES: &str = r#"
[[watch]]
name = "one-hand"
always = "!press | (left & right)"
text = "The press runs without both hands"
priority = "critical"
[[watch]]
name = "falls"
always = "level >= was(level)"
[[watch]]
name = "no-bottle"
always = "!rise(bottle)"
"#;

fn live() -> Live {
    let live = Live::start(LADDER, WATCHES, &[]);
    live.await_values("C7", "ON");
    live
}

/// What this finds in the list of alarms, as soon as it finds something.
fn awaited<T>(live: &Live, find: impl Fn(&[Value]) -> Option<T>) -> T {
    for _ in 0..1500 {
        let list = live.say("alarms --json").json();
        if let Some(found) = find(list["alarms"].as_array().expect("a list")) {
            return found;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    panic!("{}", live.ok("alarms"));
}

/// The entry of an alarm, as soon as this is true of it.
fn alarm(live: &Live, name: &str, is_it: impl Fn(&Value) -> bool) -> Value {
    awaited(live, |list| {
        list.iter().find(|alarm| alarm["tag"] == name).filter(|alarm| is_it(alarm)).cloned()
    })
}

fn await_end(live: &Live, name: &str) {
    awaited(live, |list| list.iter().all(|alarm| alarm["tag"] != name).then_some(()));
}

fn texts(alarm: &Value) -> Vec<String> {
    let lines = alarm["why"].as_array().map_or(&[][..], Vec::as_slice).iter();
    lines.map(|line| line.as_str().expect("a text").to_owned()).collect()
}

fn is(state: &'static str) -> impl Fn(&Value) -> bool {
    move |alarm| alarm["state"] == state
}

fn is_explained(alarm: &Value) -> bool {
    !texts(alarm).is_empty()
}

#[test]
fn a_line_that_does_not_hold_is_an_alarm_with_its_reasons() {
    let live = live();
    live.ok("write left=ON right=ON");
    live.ok("write left OFF");
    let seen = alarm(&live, "one-hand", is("unacknowledged"));
    assert_eq!(seen["watch"], "!press | (left & right)");
    assert_eq!((&seen["priority"], &seen["order"]), (&"critical".into(), &1.into()));
    let line = live.line("alarm ON: The press runs without both hands (press is ON, left is OFF)");
    assert_eq!((&line["event"], &line["tag"]), (&"alarm-on".into(), &"one-hand".into()));
    assert_eq!(line["scan"], seen["since"]["scan"]);
    let why = texts(&alarm(&live, "one-hand", is_explained));
    assert!(why[0] == "press (Y0) is ON" && why[1].contains("SET press turned it ON"), "{why:?}");
    assert!(why.iter().any(|line| line == "left (X0) is OFF"), "{why:?}");
    let text = live.ok("alarms");
    let words = "     it does not hold: !press | (left & right)\n       press (Y0) is ON\n";
    assert!(text.contains(words), "{text}");
    assert!(live.ok("status").contains("one-hand: The press runs without both hands (critical"));
    live.ok("ack one-hand");
    live.ok("write right OFF");
    await_end(&live, "one-hand");
    let line = live.line("alarm OFF after ");
    assert_eq!((&line["event"], &line["tag"]), (&"alarm-off".into(), &"one-hand".into()));
}

#[test]
fn a_line_that_is_broken_for_one_scan_is_explained_after_it_holds_again() {
    let live = live();
    live.ok("write level 5");
    live.ok("write level 3");
    let fell = alarm(&live, "falls", |alarm| is("returned")(alarm) && is_explained(alarm));
    let scan = |key: &str| fell[key]["scan"].as_u64().expect("a scan");
    assert_eq!(scan("ended") - scan("since"), 1);
    let why = texts(&fell);
    assert_eq!(why[0], "level is 3");
    assert!(why.iter().any(|line| line == "was(level) is 5"), "{why:?}");
    live.line("it does not hold: level >= was(level) (level is 3, was(level) is 5)");
    live.ok("write bottle ON");
    alarm(&live, "no-bottle", is("returned"));
}

#[test]
fn a_reload_brings_other_lines_and_keeps_the_alarm_of_a_name() {
    let live = live();
    live.ok("write left=ON right=ON");
    live.ok("write left OFF");
    alarm(&live, "one-hand", is("unacknowledged"));
    let before = live.say("alarms --json").json()["alarms"][0]["since"].clone();
    let file = live.folder.join("controller.toml");
    let text = std::fs::read_to_string(&file).expect("the controller file");
    let text = text.replace("\"falls\"", "\"sinks\"")
        + "[[watch]]\nname = \"jammed\"\nalways = \"!jam\"\n";
    std::fs::write(&file, text).expect("the controller file");
    let report = live.ok("reload");
    assert!(report.contains("the lines of `[[watch]]`: changed"), "{report}");
    live.ok("write jam ON");
    let jammed = alarm(&live, "jammed", is("unacknowledged"));
    assert_eq!(jammed["text"], "it does not hold: !jam");
    let kept = alarm(&live, "one-hand", is("unacknowledged"));
    assert_eq!(kept["since"], before, "it goes on");
    live.ok("write level 3");
    live.ok("write level 2");
    alarm(&live, "sinks", is("returned"));
    live.ok("write right OFF");
    alarm(&live, "one-hand", is("returned"));
}

#[test]
fn a_line_about_a_tag_that_a_reload_removes_refuses_the_reload() {
    let live = live();
    let ladder = LADDER.replace("bottle = { at = \"X2\" }\n", "");
    std::fs::write(live.folder.join("ladder.toml"), ladder).expect("the ladder");
    let said = live.say("reload");
    assert!(said.code != 0 && said.err.contains("nothing is called `bottle`"), "{said:?}");
}

/// A line with a delay of half a second and an acknowledgement that the ladder sees.
const DELAYED: &str = r#"
[[watch]]
name = "slow"
always = "!jam"
delay = "500ms"
off-delay = "300ms"
group = "Press"
ack = "quit"
"#;

#[test]
fn a_line_with_a_delay_is_an_alarm_once_it_has_not_held_for_this_time() {
    let ladder = LADDER.replace("jam    = ", "quit   = { at = \"C1\" }\njam    = ");
    let live = Live::start(&ladder, DELAYED, &[]);
    live.await_values("C7", "ON");
    live.ok("write jam ON");
    let broken = |list: &[Value]| list.iter().find(|alarm| alarm["tag"] == "jam").cloned();
    let jam = awaited(&live, broken);
    let seen = alarm(&live, "slow", is("unacknowledged"));
    assert_eq!(seen["group"], "Press");
    let [began, rose] = [&jam, &seen].map(|alarm| alarm["since"]["unix_ns"].as_i64().unwrap());
    assert_eq!(seen["since"]["scan"], jam["since"]["scan"], "the scan that broke it");
    let waited_ms = (rose - began) / 1_000_000;
    assert!((499..=501).contains(&waited_ms), "{waited_ms} ms: by the times of scans");
    let why = texts(&alarm(&live, "slow", is_explained));
    assert_eq!(why[0], "jam (C0) is ON");
    live.ok("ack slow");
    live.await_values("quit", "ON");
    live.ok("write jam OFF");
    await_end(&live, "slow");
    let line = live.line("alarm OFF after ");
    assert!(line["tag"] == "slow" || line["tag"] == "jam", "{line}");
}
