//! Requests whose client has given up: nothing is done, and the log says so.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::process::Stdio;
use std::thread::sleep;
use std::time::Duration;

use serde_json::{Value, json};

use super::operator_commands::{LADDER, live};
use rungd_test_support::running::live::{Live, PATIENCE, ask};

/// A deadline as `rungd write` sends it, with its moment in ms moved by `later_ms` from now.
fn deadline(live: &Live, later_ms: i64) -> Value {
    let place = live.folder.join("own");
    let _ = std::fs::remove_file(&place);
    let listener = UnixListener::bind(&place).unwrap();
    let mut command = live.command("write size 1");
    let mut child = command
        .env("RUNGD_SOCKET", &place)
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(listener.accept().unwrap().0).read_line(&mut line).unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
    let sent: Value = serde_json::from_str(&line).unwrap();
    let mut deadline = sent["deadline"].clone();
    // A change waits 150 s for its answer, and its deadline is 2 s before that.
    let now_ms = deadline["ms"].as_i64().unwrap_or_else(|| panic!("{line}")) - 148_000;
    deadline["ms"] = json!(now_ms + later_ms);
    deadline
}

fn with(mut request: Value, deadline: &Value) -> String {
    request["deadline"] = deadline.clone();
    request.to_string()
}

/// Sends a line, and returns the connection, on which the answer comes.
fn send(live: &Live, line: &str) -> UnixStream {
    let mut stream = live.connect();
    stream.write_all(format!("{line}\n").as_bytes()).unwrap();
    stream
}

fn answer(stream: &UnixStream) -> Value {
    let mut line = String::new();
    BufReader::new(stream).read_line(&mut line).unwrap();
    serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: `{line}`"))
}

/// The time that a held process lets pass, and a deadline within it.
const HELD: Duration = Duration::from_millis(600);
const WITHIN_MS: i64 = 200;

#[test]
fn a_write_that_expired_while_the_process_was_suspended_is_not_executed() {
    let live = live();
    let (soon, far) = (deadline(&live, WITHIN_MS), deadline(&live, 100_000));
    let write = |value: i32| json!({"do": "write", "operand": "size", "value": value});
    let other = json!({"clock": "0123456789abcdef", "ms": 1});
    live.signal("STOP");
    let late = send(&live, &with(write(77), &soon));
    let in_time = send(&live, &with(json!({"do": "write", "operand": "D5", "value": 5}), &far));
    let foreign = send(&live, &with(json!({"do": "write", "operand": "D6", "value": 6}), &other));
    let without = send(&live, r#"{"do":"write","operand":"D7","value":7}"#);
    sleep(HELD);
    live.signal("CONT");
    let refused = answer(&late);
    assert_eq!(refused["error"]["kind"], "too-late", "{refused}");
    for done in [in_time, foreign, without] {
        assert!(answer(&done)["ok"].is_object());
    }
    assert_eq!(
        live.ok("read size D5 D6 D7").split_whitespace().filter(|word| *word == "77").count(),
        0
    );
    live.await_values("D5 D6 D7", "5 6 7");
    let line = live.line("operator's command refused: nothing is done: the request came");
    assert_eq!(line["event"], "operator-refused", "{line}");
}

#[test]
fn a_command_interrupted_while_the_process_was_suspended_is_not_executed() {
    let live = live();
    live.signal("STOP");
    let mut command =
        live.command("write size 77").stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    // It says after 2 s that it waits; then it has sent its request.
    let mut told = String::new();
    BufReader::new(command.stderr.take().unwrap()).read_line(&mut told).unwrap();
    assert!(told.contains("has not answered for 2 s"), "{told}");
    command.kill().unwrap();
    command.wait().unwrap();
    live.signal("CONT");
    live.line("nothing is done: its client has left");
    assert_eq!(live.ok("read size"), "size  D1  12\n");
}

#[test]
fn no_changing_request_is_executed_after_its_deadline() {
    let live = live();
    let over = deadline(&live, -1000);
    let mut stream = live.connect();
    for change in [
        json!({"do": "write", "operand": "size", "value": 5}),
        json!({"do": "force", "operand": "lamp", "value": true}),
        json!({"do": "unforce", "operand": "lamp"}),
        json!({"do": "unforce-all"}),
        json!({"do": "mode", "to": "stop"}),
        json!({"do": "ack", "alarms": ["jam"]}),
        json!({"do": "ack-all"}),
        json!({"do": "reload"}),
        json!({"do": "rollback"}),
        json!({"do": "log-level", "level": "warn"}),
        json!({"do": "retain-save"}),
    ] {
        let refused = ask(&mut stream, &with(change.clone(), &over));
        assert_eq!(refused["error"]["kind"], "too-late", "{change}: {refused}");
        let what = change["do"].as_str().unwrap();
        let line = live.line("nothing is done: the request came");
        assert!(line["what"].as_str().unwrap().contains(what), "{line}");
    }
    // A look moves nothing.
    let read = json!({"do": "read", "operands": ["size"]});
    assert!(ask(&mut stream, &with(read, &over))["ok"].is_object());
    let odd = json!({"do": "write", "operand": "size", "value": 5, "deadline": 5});
    assert_eq!(ask(&mut stream, &odd.to_string())["error"]["kind"], "bad-request");
    assert_eq!(live.ok("read size"), "size  D1  12\n");
}

/// The list was checked when the write came in, but the scan takes the write under another list.
#[test]
fn a_pending_write_of_a_web_page_is_not_executed_after_a_reload() {
    let controller = "scan.period = \"60s\"\nscan.watchdog = \"20s\"\n[web]\nwrite = [\"size\"]\n";
    let live = Live::start(LADDER, controller, &[]);
    live.await_values("C7", "ON");
    let page = json!({"do": "write", "operand": "size", "value": 77, "from_page": true});
    let own = json!({"do": "write", "operand": "D5", "value": 5});
    for waits in [send(&live, &page.to_string()), send(&live, &own.to_string())] {
        let answer = answer(&waits);
        let note = answer["ok"]["note"].as_str().unwrap_or_else(|| panic!("{answer}"));
        assert!(note.contains("with the next scan"), "{note}");
    }
    let file = live.folder.join("controller.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("[\"size\"]", "[\"lamp\"]")).unwrap();
    live.ok("reload");
    // The last scan before the stop comes at once.
    live.ok("mode stop");
    assert_eq!(live.ok("read size D5"), "size  D1  12\nD5    D5  5\n");
    let line = live.line("`size` is not written: the program was reloaded");
    assert_eq!(line["event"], "operator-refused", "{line}");
}

/// The service has handed in the change in time, but the scan thread hangs.
#[test]
fn a_change_that_expired_during_a_hanging_scan_is_not_executed() {
    let live = Live::start_to_stall(LADDER, "scan.watchdog = \"50s\"\n", &[]);
    live.await_values("C7", "ON");
    let soon = deadline(&live, 3 * WITHIN_MS);
    live.hang();
    let write = send(&live, &with(json!({"do": "write", "operand": "size", "value": 77}), &soon));
    let force = send(&live, &with(json!({"do": "force", "operand": "lamp", "value": true}), &soon));
    sleep(2 * HELD);
    live.go_on();
    for late in [write, force] {
        late.set_read_timeout(Some(PATIENCE)).unwrap();
        let refused = answer(&late);
        assert_eq!(refused["error"]["kind"], "too-late", "{refused}");
    }
    assert_eq!(live.ok("read size lamp"), "size  D1  12\nlamp  Y0  OFF\n");
}
