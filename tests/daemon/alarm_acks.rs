//! `ack` of an alarm with the real binary: an acknowledgement turns a bit ON, the ladder sees it and
//! turns it OFF.

use serde_json::Value;

use rungd_test_support::running::live::Live;

/// The horn sounds until somebody acknowledges; `seen` counts acknowledgements.
const LADDER: &str = r#"
[tags]
low    = { at = "C0", alarm = "Oil is low", ack = "quit" }
hot    = { at = "C1", alarm = "Oil is hot", ack = "quit" }
stuck  = { at = "C2", alarm = "Gate is stuck", ack = "stuck_seen" }
plain  = { at = "C3", alarm = "Plain" }
quit   = { type = "bit" }
stuck_seen = { type = "bit" }
horn   = { at = "Y0" }
drive  = { type = "Drive" }
seen   = { at = "D0" }
[[record]]
name = "Drive"
[record.fields]
failed = { type = "bit", alarm = "Failed", ack = "reset" }
reset  = { type = "bit" }
[[template]]
name = "Pump"
rung = [
  { when = ["answer"], do = ["SET failed"] },
  { when = ["known"], do = ["RST failed", "RST known"] },
]
[template.parameters]
answer = { type = "contact" }
passed = { type = "bit" }
[template.tags]
failed = { type = "bit", alarm = "{name}: no answer", ack = "known", group = "Pump {name}" }
late   = { type = "bit", alarm = "{name}: late", ack = "passed" }
known  = { type = "bit" }
[[program]]
name = "Main"
rung = [
  { use = "Pump", name = "p1", with = { answer = "X1", passed = "drive.reset" } },
  { when = ["rise(low) | rise(hot)"], do = ["SET horn"] },
  { when = ["quit"], do = ["RST horn", "RST quit", "ADD seen 1 to=seen"] },
  { when = ["stuck | plain | drive.failed"], do = ["OUT Y1"] },
  { when = ["X2"], do = ["OUT p1.late", "RST stuck_seen"] },
  { when = ["$On"], do = ["OUT C7"] },
]
"#;

/// Waits until operands have these values, as JSON has them.
fn await_values(live: &Live, operands: &str, expected: &[Value]) {
    loop {
        let values = live.say(&format!("read {operands} --json")).json();
        let held = values["values"].as_array().expect("a list").iter().map(|one| &one["value"]);
        if held.eq(expected) {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
}

/// What `ack` answered about the first alarm.
fn acked(live: &Live, words: &str) -> Value {
    live.say(&format!("{words} --json")).json()["alarms"][0].clone()
}

#[test]
fn the_ladder_sees_an_acknowledgement_by_its_bit_and_turns_the_bit_off() {
    let live = Live::scanning(LADDER);
    live.ok("write low on");
    await_values(&live, "horn", &[true.into()]);
    let said = live.ok("ack low");
    assert_eq!(said, "low (Oil is low): acknowledged; it stands; quit is written ON\n");
    await_values(&live, "horn quit seen", &[false.into(), false.into(), 1.into()]);
    let [ack, write] = live.lines(["acknowledged alarm low", "wrote ON to quit"]);
    assert_eq!((&ack["after"], &write["what"]), (&"acknowledged".into(), &"quit".into()));
    assert_eq!(ack["who"], write["who"]);
    live.ok("write hot on");
    await_values(&live, "horn", &[true.into()]);
    live.ok("ack --all");
    await_values(&live, "horn seen", &[false.into(), 2.into()]);
    live.ok("write plain on");
    assert_eq!(live.ok("ack plain"), "plain (Plain): acknowledged; it stands\n");
}

#[test]
fn alarms_with_one_bit_write_it_once_and_one_that_is_acknowledged_writes_it_again() {
    let live = Live::scanning(LADDER);
    live.ok("write low on");
    live.ok("write hot on");
    live.ok("ack low hot");
    await_values(&live, "seen", &[1.into()]);
    assert!(live.ok("ack hot").contains("acknowledged already; it stands; quit is written ON"));
    await_values(&live, "seen", &[2.into()]);
    live.ok("write low off");
    live.ok("ack low");
    await_values(&live, "seen", &[2.into()]);
}

#[test]
fn a_bit_that_cannot_be_written_is_told_and_keeps_no_other_from_being_written() {
    let live = Live::scanning(LADDER);
    live.ok("force stuck_seen off");
    live.ok("write stuck on");
    live.ok("write low on");
    let said = live.say("ack stuck low");
    assert_eq!(said.code, 1, "{}", said.out);
    let lines: Vec<&str> = said.out.lines().collect();
    let told = "the ladder does NOT see it, stuck_seen is not written: `stuck_seen` is forced to";
    assert!(lines[0].contains(told), "{}", said.out);
    assert!(lines[1].ends_with("quit is written ON"), "{}", said.out);
    await_values(&live, "seen stuck_seen", &[1.into(), false.into()]);
    assert_eq!(live.line("operator's command refused")["what"], "stuck_seen");
    let states = live.say("alarms --json").json();
    assert!(
        states["alarms"]
            .as_array()
            .expect("a list")
            .iter()
            .all(|alarm| { alarm["state"] == "acknowledged" })
    );
}

#[test]
fn in_stop_an_acknowledgement_is_entered_and_its_bit_is_refused() {
    let live = Live::scanning(LADDER);
    live.ok("write low on");
    live.ok("mode stop");
    let acked = acked(&live, "ack low");
    assert_eq!(acked["after"], "acknowledged");
    assert_eq!(acked["bit"], "quit");
    let why = acked["bit_refused"].as_str().expect("a reason");
    assert!(why.contains("the controller is in STOP"), "{why}");
    live.ok("mode run");
    live.ok("ack low");
    await_values(&live, "seen", &[1.into()]);
}

#[test]
fn ack_names_own_tags_of_a_use_its_arguments_and_fields_of_the_same_record() {
    let live = Live::scanning(LADDER);
    live.ok("write X1 on");
    await_values(&live, "p1.failed", &[true.into()]);
    live.ok("write X1 off");
    let list = live.say("alarms --json").json();
    assert_eq!(list["alarms"][0]["group"], "Pump p1");
    assert_eq!(acked(&live, "ack p1.failed")["bit"], "p1.known");
    await_values(&live, "p1.failed p1.known", &[false.into(), false.into()]);
    live.ok("write drive.failed on");
    assert_eq!(acked(&live, "ack drive.failed")["bit"], "drive.reset");
    await_values(&live, "drive.reset", &[true.into()]);
    live.ok("write X2 on");
    await_values(&live, "p1.late", &[true.into()]);
    assert_eq!(acked(&live, "ack p1.late")["bit"], "drive.reset");
}
