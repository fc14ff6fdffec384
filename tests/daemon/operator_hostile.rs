//! Hostile clients of the operator's socket: garbage, half lines, huge lines, a thousand
//! connections, answers that are never read. No scan is missed, and the next client is served.

use rungd_test_support::running::live;
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use rungd_test_support::metronome::Stopwatch;
use rungd_test_support::running::live::{Live, PATIENCE, ask};
use rungd_test_support::running::process::processor_time;
use serde_json::Value;

const PERIOD_MS: f64 = 10.0;
const LADDER: &str = r#"
[tags]
size = { at = "D1", initial = 12 }
[[program]]
name = "Main"
rung = [ { when = ["$On"], do = ["ADD D0 1 to=D0"] } ]
"#;

/// Ends the controller, and checks that every grid point was scanned or counted as skipped.
fn assert_no_scan_lost(live: &mut Live) {
    assert_eq!(live.served("read size"), "size  D1  12\n", "the next one is served");
    let statistics = live.end();
    let number = |name: &str| statistics[name].as_f64().unwrap();
    // The last scan's grid point. Its lateness is excluded, since no later scan counts the skips.
    let over_us = number("over_us") - number("late_us_last");
    let points = (over_us / 1000.0 / PERIOD_MS).round() + 1.0;
    let counted = number("scans") + number("skipped");
    assert!((points - counted).abs() <= 1.0, "{counted} of {points}: {statistics}");
}

/// All bytes until the other end closes.
fn rest(mut stream: UnixStream) -> String {
    let mut text = Vec::new();
    let _ = stream.read_to_end(&mut text);
    String::from_utf8_lossy(&text).into_owned()
}

/// The number of descriptors that the controller has open.
fn descriptors(live: &Live) -> usize {
    std::fs::read_dir(format!("/proc/{}/fd", live.child.id())).unwrap().count()
}

/// Waits until the controller has finished its work on the requests, however slow the machine is.
fn at_rest(live: &Live) {
    let begun = Instant::now();
    let mut used = processor_time(live.child.id());
    loop {
        std::thread::sleep(Duration::from_millis(500));
        let now = processor_time(live.child.id());
        if now - std::mem::replace(&mut used, now) < 0.1 {
            return;
        }
        assert!(begun.elapsed() < PATIENCE, "it is still at work");
    }
}

fn live() -> Live {
    Live::start(LADDER, "", &[])
}

#[test]
fn a_client_that_sends_garbage_is_disconnected_after_several_answers() {
    let mut live = live();
    let mut stream = live.connect();
    for line in ["GET / HTTP/1.1", "{}", "[[[[", "\u{0}\u{1}", "null", "{\"do\":3}"] {
        assert_eq!(ask(&mut stream, line)["error"]["kind"], "bad-request", "{line}");
    }
    let _ = stream.write_all(&b"garbage\n".repeat(100));
    let answers = rest(stream);
    assert_eq!(answers.lines().count(), 2, "{answers}");
    let mut stream = live.connect();
    let mut bytes: Vec<u8> = (0..30_000_u32).map(|n| ((n * 7919) >> 3) as u8).collect();
    bytes.push(b'\n');
    let _ = stream.write_all(&bytes);
    let long =
        format!("{{\"do\":\"write\",\"operand\":\"a\\n{}\",\"value\":1}}", "x".repeat(20_000));
    assert_eq!(ask(&mut live.connect(), &long)["error"]["kind"], "bad-operand");
    let refused = live.line("operator's command refused");
    assert!(refused.to_string().len() < 1200, "{refused}");
    let deep = "[".repeat(20_000) + "\n";
    assert_eq!(ask(&mut live.connect(), deep.trim_end())["error"]["kind"], "bad-request");
    drop(stream);
    assert_no_scan_lost(&mut live);
}

#[test]
fn a_client_that_sends_an_endless_line_is_disconnected() {
    let mut live = live();
    let mut stream = live.connect();
    let _ = stream.write_all(&vec![b' '; 600_000]);
    let answer: Value = serde_json::from_str(rest(stream).trim_end()).unwrap();
    assert!(answer["error"]["message"].as_str().unwrap().contains("524288 bytes"), "{answer}");
    let mut half = live.connect();
    half.write_all(b"{\"do\":\"sta").unwrap();
    let watch = Stopwatch::start(live.child.id());
    assert_eq!(rest(half), "");
    assert!(watch.elapsed() < Duration::from_secs(20), "closed in time");
    assert_no_scan_lost(&mut live);
}

#[test]
fn a_client_that_never_reads_is_disconnected_and_does_not_delay_others() {
    let mut live = live();
    let before = descriptors(&live);
    let mut deaf: Vec<UnixStream> = (0..20).map(|_| live.connect()).collect();
    for stream in &mut deaf {
        stream.set_nonblocking(true).unwrap();
        let _ = stream.write(&b"{\"do\":\"status\"}\n".repeat(4000));
    }
    let mut worst = Duration::ZERO;
    for _ in 0..20 {
        let watch = Stopwatch::start(live.child.id());
        live.served("read size");
        worst = worst.max(watch.elapsed());
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(worst < Duration::from_secs(5), "{worst:?}");
    // Unread answers fill the socket; then the server closes it, so reading comes to an end.
    let begun = Instant::now();
    while descriptors(&live) > before {
        assert!(begun.elapsed() < PATIENCE, "it is still being served");
        std::thread::sleep(Duration::from_millis(100));
    }
    let deadline = Instant::now() + PATIENCE;
    for mut stream in deaf {
        stream.set_nonblocking(false).unwrap();
        let mut part = [0; 65_536];
        while stream.read(&mut part).is_ok_and(|count| count > 0) {
            assert!(Instant::now() < deadline, "it is still being served");
        }
    }
    assert_no_scan_lost(&mut live);
}

/// A client with unread answers has no work in progress, so it makes room as an idle client does.
#[test]
fn clients_that_never_read_do_not_block_new_ones() {
    let mut live = live();
    let all: Vec<String> = (0..250).map(|number| format!("\"V{number}\"")).collect();
    let read = format!("{{\"do\":\"read\",\"operands\":[{}]}}\n", all.join(","));
    let deaf: Vec<UnixStream> = (0..64).map(|_| live.connect()).collect();
    for mut stream in &deaf {
        stream.set_nonblocking(true).unwrap();
        let _ = stream.write(read.repeat(60).as_bytes());
    }
    at_rest(&live);
    for _ in 0..5 {
        live.served("read size");
    }
    drop(deaf);
    assert_no_scan_lost(&mut live);
}

#[test]
fn a_thousand_connections_do_not_block_a_new_client() {
    let mut live = live();
    let mut crowd = Vec::new();
    for number in 0..1000 {
        let mut stream = live.connect();
        match number % 3 {
            0 => {}
            1 => drop(stream.write_all(b"{\"do\":")),
            _ => drop(stream.write_all(b"{\"do\":\"status\"}\n")),
        }
        crowd.push(stream);
        if number % 250 == 249 {
            live.served("read size");
        }
    }
    // Seats of closed connections become free while the next clients connect.
    let begun = Instant::now();
    while descriptors(&live) >= 64 + 40 {
        assert!(begun.elapsed() < PATIENCE, "{} descriptors are open", descriptors(&live));
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_no_scan_lost(&mut live);
}

#[test]
fn idle_clients_are_closed_when_descriptors_run_out() {
    let folder = live::folder(LADDER, "");
    let mut command = std::process::Command::new("sh");
    let rungd = live::run(&folder, &[]);
    command.args(["-c", "ulimit -n 32; exec \"$0\" \"$@\""]).arg(rungd.get_program());
    command.args(rungd.get_args()).env_remove("NOTIFY_SOCKET").stderr(std::process::Stdio::piped());
    let mut live = Live::of(folder, command);
    let crowd: Vec<UnixStream> = (0..60).map(|_| live.connect()).collect();
    live.line("the operator's socket accepts no client");
    live.ok("status");
    drop(crowd);
    assert_no_scan_lost(&mut live);
}

#[test]
fn a_flood_of_commands_is_executed_and_delays_no_scan() {
    let mut live = live();
    let socket = &live.socket;
    std::thread::scope(|scope| {
        for client in 0..8 {
            scope.spawn(move || {
                let mut stream = UnixStream::connect(socket).unwrap();
                for turn in 0..60 {
                    let line = match (client + turn) % 4 {
                        0 => r#"{"do":"force","operand":"C5","value":true}"#,
                        1 => r#"{"do":"unforce","operand":"C5"}"#,
                        2 => r#"{"do":"write","operand":"D7","value":3}"#,
                        _ => r#"{"do":"status"}"#,
                    };
                    let answer = ask(&mut stream, line);
                    // A write may meet a force in the queue; it must not become an error.
                    assert!(answer["ok"].is_object(), "{answer}");
                }
            });
        }
    });
    live.ok("unforce --all");
    assert_no_scan_lost(&mut live);
}
