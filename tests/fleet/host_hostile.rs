//! `rungd fleet` at a hostile broker, and with readers that leave or pause: no panic, no end of the
//! session for a message that is only too large, and a report of each omission.

use rungd_net::sparkplug::{DataType, HostState, MetricValue, Payload, vocabulary};

use crate::fleet::checker::recorder::{Recorder, now_ms};
use crate::fleet::checker::story::{Connection, Step, Story};
use crate::fleet::checker::{host_rules, judge};
use crate::fleet::fleet_process::FleetProcess;
use crate::fleet::host_wire::{BIRTH, DATA, birth, data, is_over, metric, sent, subscribed};

/// A recorder, and a `rungd fleet` that has subscribed to it.
fn listener(command: &[&str]) -> (Recorder, FleetProcess) {
    let recorder = Recorder::start();
    let arguments = [command, &["--broker", &recorder.url]].concat();
    let fleet = FleetProcess::start(&arguments);
    recorder.until("its subscriptions", subscribed);
    (recorder, fleet)
}

/// A birth with one text.
fn telling(name: &str, text: String) -> Vec<u8> {
    let text = metric(name, 1, DataType::String).born(Some(&MetricValue::Text(text)), now_ms());
    Payload { timestamp: Some(now_ms()), metrics: vec![text], seq: Some(0) }.bytes()
}

/// A list of 100 alarms with long texts.
fn long_list() -> String {
    let one = format!(r#"{{"tag":"jam","text":"{}"}}"#, "x".repeat(1_000));
    format!("[{}]", vec![one; 100].join(","))
}

/// A column is not wider than the largest width that a formatter can pad to.
#[test]
fn an_oversized_text_of_a_node_does_not_end_the_command() {
    let (recorder, fleet) = listener(&["status", "--wait", "1h"]);
    recorder.deliver("spBv1.0/plant/NBIRTH/giant", telling(vocabulary::MODE, "X".repeat(200_000)));
    recorder.deliver(BIRTH, birth().bytes());
    let (code, out, errors) = fleet.stop();
    assert_eq!((code, errors.as_str()), (0, ""));
    assert!(out.len() < 3_000 && out.contains("plant/press  online  RUN "), "{out}");
}

/// A message that is too long is counted. The session continues, and the known nodes stay.
#[test]
fn an_oversized_message_does_not_end_the_session() {
    let (recorder, fleet) = listener(&["status", "--json", "--wait", "1h"]);
    recorder.deliver(BIRTH, birth().bytes());
    recorder.deliver("spBv1.0/plant/NDATA/giant", vec![0; 5 << 20]);
    // As long as a birth with many metrics, and therefore accepted.
    recorder.deliver("spBv1.0/plant/NBIRTH/large", telling("text", "x".repeat(2 << 20)));
    let (code, out, errors) = fleet.stop();
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, &report["counts"]["too_large"]), (0, &1.into()), "{out}{errors}");
    let states = report["nodes"].as_array().unwrap().iter();
    assert!(states.map(|node| &node["state"]).all(|state| state == "online"), "{out}");
    assert_eq!(recorder.connections().len(), 1);
}

#[test]
fn ignored_messages_are_reported() {
    let (recorder, fleet) = listener(&["watch"]);
    recorder.deliver("shop/orders", b"7".to_vec());
    recorder.deliver(DATA, vec![0xff; 40]);
    recorder.deliver(DATA, vec![0xff; 40]);
    let (code, out, errors) = fleet.stop();
    assert_eq!((code, out.as_str()), (0, ""));
    let begun = "leaves out messages without a payload of Sparkplug (of at most 50,000 metrics); \
                 their number is printed at the end";
    assert_eq!(errors.matches(begun).count(), 1, "{errors}");
    assert!(errors.contains("left out: 2 messages without a payload of Sparkplug"), "{errors}");

    let (recorder, fleet) = listener(&["alarms", "--wait", "1h"]);
    recorder.deliver(DATA, vec![0xff; 40]);
    let list = r#"[7, {"tag":"jam","text":"Belt jammed\u001b[2J"}]"#.to_owned();
    recorder.deliver(BIRTH, telling(vocabulary::ALARM_LIST, list));
    let deep = telling(vocabulary::ALARM_LIST, "[".repeat(10_000));
    recorder.deliver("spBv1.0/plant/NBIRTH/deep", deep);
    let (code, out, errors) = fleet.stop();
    assert_eq!((code, errors.as_str()), (0, ""));
    for told in [
        "1 active alarm; the alarms of 1 node are not known\nplant/press (online)\n  jam: Belt \
         jammed\\u{1b}[2J\n",
        "plant/deep: its alarms are not known: its alarm list cannot be read\n",
        "plant/press: left out: 1 of its alarms",
        "left out: 1 message without a payload of Sparkplug",
    ] {
        assert!(out.contains(told), "no `{told}`: {out}");
    }
}

/// The last death of this host that a foreign client publishes is answered, even in a fast series.
#[test]
fn the_last_of_many_forged_deaths_is_answered() {
    let (recorder, fleet) = listener(&["watch", "--host-id", "room"]);
    let topic = "spBv1.0/STATE/room";
    recorder.until("its state", |it| sent(it, topic) == 1);
    for _ in 0..10 {
        recorder.deliver(topic, HostState { online: false, timestamp: 5 }.bytes());
    }
    let answered = |all: &[Connection]| {
        let is_death = |step: &Step| matches!(step, Step::Got(got) if got.topic == topic);
        let last = all[0].steps.iter().rposition(is_death);
        all[0].steps[last.unwrap_or(0)..].iter().any(|step| step.sent().is_some())
    };
    recorder.until("an answer to the last", answered);
    assert_eq!(fleet.stop().0, 0);
}

/// Also if there is nothing to print: a line may be the last one for hours, and may still find a
/// reader (a process that another thread just starts has the pipe until it executes its program).
#[test]
fn the_command_ends_when_the_reader_of_its_output_closes() {
    let (recorder, mut fleet) = listener(&["watch"]);
    drop(fleet.stdout());
    assert_eq!(fleet.code(), 0, "as every command at the end of its reader");
    recorder.until("its end", is_over);

    // A host publishes its death.
    let (recorder, mut fleet) = listener(&["watch", "--host-id", "room"]);
    drop(fleet.stdout());
    assert_eq!(fleet.code(), 0);
    recorder.until("its end", is_over);
    let host = Some("room".to_owned());
    let story = Story { host, connections: recorder.connections(), ..Story::default() };
    assert_eq!(judge(&host_rules(), &story), Vec::<String>::new(), "{story:#?}");

    let (_recorder, mut fleet) = listener(&["status", "--json", "--wait", "1h"]);
    drop(fleet.stdout());
    assert_eq!(fleet.code(), 0);

    // Without a broker there is no session.
    let mut fleet = FleetProcess::start(&["watch", "--broker", "mqtt://127.0.0.1:1"]);
    drop(fleet.stdout());
    assert_eq!(fleet.code(), 0);

    let (recorder, mut fleet) = listener(&["status", "--json", "--wait", "1h"]);
    recorder.deliver(BIRTH, birth().bytes());
    drop(fleet.stdout());
    fleet.terminate();
    assert_eq!(fleet.code(), 0);
}

/// A pager that shows its first page reads nothing. The first Ctrl-C ends listening, the second one
/// ends the process.
#[test]
fn a_second_signal_ends_the_command_while_its_reader_pauses() {
    let (recorder, mut fleet) = listener(&["alarms", "--json", "--wait", "1h"]);
    for node in 0..5 {
        let topic = format!("spBv1.0/plant/NBIRTH/{node}");
        recorder.deliver(&topic, telling(vocabulary::ALARM_LIST, long_list()));
    }
    let unread = fleet.stdout();
    fleet.terminate();
    recorder.until("its end", is_over);
    fleet.terminate();
    assert_eq!(fleet.code(), 128 + 15);
    drop(unread);
}

/// An error that a new attempt cannot mend ends the command at once.
#[test]
fn a_permanent_error_ends_the_command_without_a_retry() {
    let at = ["watch", "--broker", "mqtts://127.0.0.1:1", "--ca", "/nonexistent/ca.pem"];
    let (code, _, errors) = FleetProcess::start(&at).end();
    assert!(code == 74 && errors.contains("/nonexistent/ca.pem"), "{code} {errors}");
    let at = ["watch", "--broker", "mqtt://127.0.0.1:1", "--ca", "/nonexistent/ca.pem"];
    let (code, _, errors) = FleetProcess::start(&at).end();
    assert!(code == 2 && errors.contains("`mqtts://`"), "{code} {errors}");
    let at = ["status", "--broker", "mqtt://127.0.0.1:1", "--expect", "/nonexistent"];
    let (code, _, errors) = FleetProcess::start(&at).end();
    assert!(code == 74 && errors.contains("name a folder, a checkout of git"), "{code} {errors}");
}

/// With several addresses, a dead address causes no wait.
#[test]
fn a_dead_broker_address_is_skipped_without_waiting() {
    let recorder = Recorder::start();
    let dead = "mqtt://127.0.0.1:1";
    let at = ["status", "--json", "--wait", "1h", "--broker", dead, "--broker", &recorder.url];
    let fleet = FleetProcess::start(&at);
    recorder.until("its subscriptions", subscribed);
    recorder.deliver(BIRTH, birth().bytes());
    recorder.deliver(DATA, data(1, true).bytes());
    let (code, out, errors) = fleet.stop();
    assert_eq!(code, 0, "{errors}");
    assert!(out.contains(r#""state":"online""#), "{out}");
}
