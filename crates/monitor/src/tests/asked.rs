//! Tests of `asker`, with a fake controller behind a socket.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixListener;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use crossbeam_channel::Receiver;
use serde_json::{Value, json};

use super::status;
use crate::asker;
use crate::message::{ControllerLook, MonitorNews, ThreadOrder};
use rungd_client::operator::protocol::Request;

/// A time limit, far longer than any answer takes.
const PATIENCE: Duration = Duration::from_secs(60);

/// A fake controller. It has the operands of its list, and records the requests.
struct FakeController {
    socket: PathBuf,
    known: Arc<Mutex<Vec<&'static str>>>,
    asked: Arc<Mutex<Vec<Value>>>,
}

impl FakeController {
    fn start(name: &str, known: Vec<&'static str>) -> FakeController {
        let socket = std::env::temp_dir().join(format!("rungd-{name}-{}", std::process::id()));
        let _ = std::fs::remove_file(&socket);
        let listener = UnixListener::bind(&socket).expect("a socket");
        let known = Arc::new(Mutex::new(known));
        let asked: Arc<Mutex<Vec<Value>>> = Arc::default();
        let fake = FakeController { socket, known, asked };
        let (known, asked) = (Arc::clone(&fake.known), Arc::clone(&fake.asked));
        thread::spawn(move || {
            for stream in listener.incoming() {
                let mut stream = stream.expect("a client");
                let mut line = String::new();
                BufReader::new(&stream).read_line(&mut line).expect("a line");
                let request: Value = serde_json::from_str(&line).expect("a request");
                let answer = answer(&request, &known.lock().expect("no panic"));
                asked.lock().expect("no panic").push(request);
                let _ = writeln!(stream, "{answer}");
            }
        });
        fake
    }

    /// The requests of a kind that were received so far.
    fn asked(&self, of: &str) -> Vec<Value> {
        let asked = self.asked.lock().expect("no panic");
        asked.iter().filter(|request| request["do"] == of).cloned().collect()
    }
}

impl Drop for FakeController {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.socket);
    }
}

fn answer(request: &Value, known: &[&str]) -> Value {
    match request["do"].as_str() {
        Some("status") => json!({ "ok": status() }),
        Some("names") => json!({ "ok": { "names": [] } }),
        Some("force") => {
            let now = json!({"operand": "D0", "tag": null, "address": "D0", "value": 7,
                             "forced": true});
            json!({ "ok": {"before": 5, "was_forced": false, "now": now} })
        }
        Some("read") => {
            let operands = request["operands"].as_array().expect("operands");
            let operands: Vec<&str> = operands.iter().filter_map(Value::as_str).collect();
            let is_known = |operand: &&str| known.contains(operand);
            let (operands, bad): (Vec<_>, Vec<_>) = operands.into_iter().partition(is_known);
            let message = |bad: &str| format!("`{bad}` names nothing");
            let refusal = |bad: &str| json!({"kind": "bad-operand", "message": message(bad)});
            if let (Some(bad), false) = (bad.first(), request["each"] == true) {
                return json!({ "error": refusal(bad) });
            }
            let refused = bad
                .iter()
                .map(|bad| json!({"operand": bad, "kind": "bad-operand", "message": message(bad)}));
            let refused: Vec<Value> = refused.collect();
            let value = |of: &&str| {
                json!({"operand": of, "tag": null, "address": of, "value": 5,
                                           "forced": false})
            };
            let values: Vec<Value> = operands.iter().map(value).collect();
            json!({ "ok": {"mode": "RUN", "scans": 9, "values": values, "refused": refused} })
        }
        _ => json!({ "error": {"kind": "refused", "message": "not today"} }),
    }
}

/// The next news for which `wanted` returns a value.
fn next<T>(news: &Receiver<MonitorNews>, wanted: impl Fn(MonitorNews) -> Option<T>) -> T {
    loop {
        let news = news.recv_timeout(PATIENCE).expect("news");
        if let Some(found) = wanted(news) {
            return found;
        }
    }
}

fn look_of(news: MonitorNews) -> Option<Box<ControllerLook>> {
    if let MonitorNews::Look(look) = news { Some(look) } else { None }
}

#[test]
fn an_unknown_operand_does_not_hide_other_operands() {
    let fake = FakeController::start("unknown", vec!["D0", "D1"]);
    let (orders, news) = asker::start(fake.socket.clone()).expect("a thread");
    let operands = ["D0", "gone", "D1"].map(str::to_owned).to_vec();
    orders.send(ThreadOrder::Read(operands)).expect("a thread");
    let wanted = |news| look_of(news).filter(|look| !look.unknown.is_empty());
    let look = next(&news, wanted);
    let values: Vec<&str> = look.values.iter().map(|of| of.operand.as_str()).collect();
    assert_eq!((values, look.unknown), (vec!["D0", "D1"], vec!["gone".to_owned()]));
    let asked = fake.asked("read");
    let asked_all = |read: &Value| read["operands"] == json!(["D0", "gone", "D1"]);
    assert!(asked.iter().all(asked_all), "one request for each look: {asked:?}");
}

#[test]
fn answers_and_refusals_are_reported() {
    let fake = FakeController::start("answers", vec!["D0"]);
    let (orders, news) = asker::start(fake.socket.clone()).expect("a thread");
    let told = |order| {
        orders.send(order).expect("a thread");
        next(&news, |news| match news {
            MonitorNews::Look(_) | MonitorNews::Silent(_) | MonitorNews::Power(_) => None,
            MonitorNews::Found(found) => Some(found.map(|of| of[0].operand.clone())),
            MonitorNews::Changed(said) | MonitorNews::Why(_, said) => Some(said),
            MonitorNews::Ladder(_, found) => Some(found.map(|_| "a ladder".to_owned())),
            MonitorNews::Names(prefix, _) => Some(Ok(prefix)),
        })
    };
    let force = serde_json::from_value(json!({"do": "force", "operand": "D0", "value": "7"}));
    let force: Request = force.expect("a request");
    assert_eq!(told(ThreadOrder::Find("D0".into())), Ok("D0".to_owned()));
    let refused = Err("`D9` names nothing".to_owned());
    assert_eq!(told(ThreadOrder::Find("D9".into())), refused);
    assert_eq!(told(ThreadOrder::Change(force)), Ok("D0: 7, forced, was 5".to_owned()));
    assert_eq!(told(ThreadOrder::Why("D0".into())), Err("not today".to_owned()));
    assert_eq!(told(ThreadOrder::Ladder), Err("not today".to_owned()));
    assert_eq!(told(ThreadOrder::Names("m".into())), Ok("m".to_owned()));
    assert!(fake.asked("write").is_empty() && fake.asked("force").len() == 1);
}

#[test]
fn a_missing_controller_is_reported_and_polled_again() {
    let socket = std::env::temp_dir().join(format!("rungd-none-{}", std::process::id()));
    let (_orders, news) = asker::start(socket).expect("a thread");
    let silent = |news| if let MonitorNews::Silent(why) = news { Some(why) } else { None };
    assert!(next(&news, silent).contains("no rungd answers at"));
    assert!(next(&news, silent).contains("no rungd answers at"), "it asks again");
}
