//! Storms on the operator's socket: clients by the thousand, clients that stay silent and never
//! leave, and a socket that is removed. Well-behaved clients are served meanwhile.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rungd_test_support::metronome::Stopwatch;
use rungd_test_support::running::live::{Live, PATIENCE, ask};

const LADDER: &str = r#"
[[program]]
name = "Main"
rung = [ { when = ["$On"], do = ["ADD D0 1 to=D0"] } ]
"#;

/// The highest plausible rate of accepted clients or answered requests, per second; a higher rate
/// shows that the limit fails. `WAITING_MAX` allows for the queue of the socket.
const RATE_MAX: u64 = 1500;
const WAITING_MAX: u64 = 500;
/// The same for lists of names: the limit is fifty per second, after sixteen at once.
const NAMES_RATE_MAX: u64 = 100;
const NAMES_AT_ONCE: u64 = 16;

fn live() -> Live {
    Live::start(LADDER, "", &[])
}

/// Ends the clients of a storm, even if the test fails.
struct Over<'a>(&'a AtomicBool);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Relaxed);
    }
}

/// The greatest count of a storm: so many per second, and so many besides.
struct Most {
    per_second: u64,
    besides: u64,
}

/// Of accepted clients or answered requests.
const MOST: Most = Most { per_second: RATE_MAX, besides: WAITING_MAX };
/// Of lists of names.
const MOST_NAMES: Most = Most { per_second: NAMES_RATE_MAX, besides: NAMES_AT_ONCE };

/// Repeats `client` in many threads; returns the count, and the longest wait of a good client.
fn storm(
    live: &Live,
    clients: usize,
    most: Most,
    client: impl Fn(&AtomicBool, &AtomicU64) + Sync,
) -> (u64, Duration) {
    let (goes_on, count) = (AtomicBool::new(true), AtomicU64::new(0));
    let begin = Instant::now();
    let mut worst = Duration::ZERO;
    std::thread::scope(|scope| {
        let _over = Over(&goes_on);
        for _ in 0..clients {
            scope.spawn(|| client(&goes_on, &count));
        }
        while begin.elapsed() < Duration::from_secs(3) {
            let watch = Stopwatch::start(live.child.id());
            let answer = ask(&mut live.connect(), r#"{"do":"read","operands":["$On"]}"#);
            worst = worst.max(watch.elapsed());
            assert!(answer["ok"].is_object(), "{answer}");
            std::thread::sleep(Duration::from_millis(100));
        }
    });
    let count = count.into_inner();
    let most = most.per_second * begin.elapsed().as_millis() as u64 / 1000 + most.besides;
    assert!(count <= most, "{count} in {:?}", begin.elapsed());
    (count, worst)
}

#[test]
fn clients_that_reconnect_and_never_read_do_not_delay_others() {
    let mut live = live();
    let socket = live.socket.clone();
    let (count, worst) = storm(&live, 64, MOST, |goes_on, count| {
        while goes_on.load(Ordering::Relaxed) {
            let Ok(mut stream) = UnixStream::connect(&socket) else { continue };
            let _ = stream.write_all(&b"{\"do\":\"status\"}\n".repeat(50));
            count.fetch_add(1, Ordering::Relaxed);
        }
    });
    println!("{count} connections, a good client waited {worst:?} at worst");
    assert!(worst < Duration::from_secs(3), "{worst:?}");
    live.end();
}

#[test]
fn the_rate_of_answers_to_all_clients_is_limited() {
    let mut live = live();
    let socket = live.socket.clone();
    let (count, worst) = storm(&live, 50, MOST, |goes_on, count| {
        while goes_on.load(Ordering::Relaxed) {
            let mut stream = UnixStream::connect(&socket).unwrap();
            while goes_on.load(Ordering::Relaxed)
                && ask(&mut stream, r#"{"do":"read","operands":["$On"]}"#)["ok"].is_object()
            {
                count.fetch_add(1, Ordering::Relaxed);
            }
        }
    });
    println!("{count} requests, a good client waited {worst:?} at worst");
    assert!(worst < Duration::from_secs(3), "{worst:?}");
    live.end();
}

/// More clients than seats request lists of names; the limit is fifty lists per second.
#[test]
fn clients_that_repeat_name_requests_do_not_block_others() {
    let mut live = live();
    let socket = live.socket.clone();
    let (count, worst) = storm(&live, 80, MOST_NAMES, |goes_on, count| {
        while goes_on.load(Ordering::Relaxed) {
            let Ok(stream) = UnixStream::connect(&socket) else { continue };
            let mut lines = BufReader::new(&stream);
            let mut asks = || {
                let mut line = String::new();
                (&stream).write_all(b"{\"do\":\"names\",\"prefix\":\"\"}\n").is_ok()
                    && lines.read_line(&mut line).is_ok_and(|length| length > 0)
                    && line.starts_with("{\"ok\"")
            };
            while goes_on.load(Ordering::Relaxed) && asks() {
                count.fetch_add(1, Ordering::Relaxed);
            }
        }
    });
    println!("{count} lists of names, a good client waited {worst:?} at worst");
    assert!(worst < Duration::from_secs(3), "{worst:?}");
    live.end();
}

/// Recordings have many bytes here: they contain a long comment of the ladder.
#[test]
fn clients_that_repeat_recording_requests_do_not_block_others() {
    let live = live();
    let ladder = live.folder.join("ladder.toml");
    let text = std::fs::read_to_string(&ladder).unwrap();
    let mut state = 1_u64;
    let comment = (0..100_000).map(|_| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        format!("{state:016x}")
    });
    let comment = comment.collect::<Vec<_>>().join("\n# ");
    std::fs::write(&ladder, format!("{text}\n# {comment}\n")).unwrap();
    live.ok("reload");
    let (bytes, socket) = (AtomicU64::new(0), live.socket.clone());
    let (count, worst) = storm(&live, 50, MOST, |goes_on, count| {
        while goes_on.load(Ordering::Relaxed) {
            let Ok(stream) = UnixStream::connect(&socket) else { continue };
            let mut lines = BufReader::new(&stream);
            let mut line = String::new();
            let asked = (&stream).write_all(b"{\"do\":\"recording\"}\n").is_ok();
            if asked && lines.read_line(&mut line).is_ok() && line.starts_with("{\"ok\"") {
                count.fetch_add(1, Ordering::Relaxed);
                bytes.fetch_max(line.len() as u64, Ordering::Relaxed);
            }
        }
    });
    println!("{count} recordings, a good client waited {worst:?} at worst");
    assert!(worst < Duration::from_secs(3), "{worst:?}");
    let bytes = bytes.into_inner();
    assert!(count > 0 && bytes > 500_000, "{count} of {bytes} bytes");
}

#[test]
fn blank_lines_do_not_reset_the_idle_time_of_a_client() {
    let live = live();
    let mut blank = live.connect();
    let read = r#"{"do":"read","operands":["$On"]}"#;
    assert!(ask(&mut blank, read)["ok"].is_object());
    let mut others: Vec<UnixStream> = (1..56).map(|_| live.connect()).collect();
    for other in &mut others {
        assert!(ask(other, read)["ok"].is_object());
    }
    for _ in 0..20 {
        blank.write_all(b"\n \n").unwrap();
        std::thread::sleep(Duration::from_millis(5));
    }
    // All seats of one user are taken: the client that was idle longest is disconnected.
    assert!(ask(&mut live.connect(), read)["ok"].is_object());
    assert!(others.iter_mut().all(|other| ask(other, read)["ok"].is_object()), "they stay");
    blank.set_read_timeout(Some(PATIENCE)).unwrap();
    assert_eq!(std::io::Read::read(&mut blank, &mut [0; 16]).unwrap_or(0), 0, "it is gone");
}

#[test]
#[ignore = "a minute"]
fn blank_lines_do_not_keep_a_connection_beyond_the_idle_time() {
    let live = live();
    let mut blank = live.connect();
    let begin = Instant::now();
    while blank.write_all(b"\n").is_ok() {
        assert!(begin.elapsed() < Duration::from_secs(70), "it is held by blank lines");
        std::thread::sleep(Duration::from_millis(100));
    }
    assert!(begin.elapsed() > Duration::from_secs(55), "{:?}", begin.elapsed());
}

/// Waits until a command is answered.
fn await_answer(live: &Live) {
    let deadline = Instant::now() + PATIENCE;
    while live.say("read $On").code != 0 {
        assert!(Instant::now() < deadline, "the socket does not come back");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn a_removed_socket_is_recreated_and_reported_once() {
    let mut live = live();
    for _ in 0..2 {
        fs::remove_file(&live.socket).unwrap();
        let told = live.line("is gone");
        assert_eq!(
            (&told["event"], &told["level"]),
            (&"operator-socket-lost".into(), &"WARN".into())
        );
        live.line("the operator's socket is open");
        await_answer(&live);
    }
    let mode =
        std::os::unix::fs::PermissionsExt::mode(&fs::metadata(&live.socket).unwrap().permissions());
    assert_eq!(mode & 0o777, 0o660);
    // An unwritable folder is reported once, and the socket is tried again.
    let aside = live.folder.with_extension("aside");
    fs::rename(&live.folder, &aside).unwrap();
    std::thread::sleep(Duration::from_secs(5));
    fs::rename(&aside, &live.folder).unwrap();
    let mut told: Vec<String> = Vec::new();
    while !told.iter().any(|event| event == "operator-listens") {
        let line = live.line("");
        let of_operator = line["socket"] == *live.socket.display().to_string();
        told.extend(line["event"].as_str().filter(|_| of_operator).map(str::to_owned));
    }
    assert_eq!(told, ["operator-socket-lost", "operator-listens"]);
    await_answer(&live);
    // If a different file has taken the socket's place, the controller reports that and leaves the
    // file alone.
    fs::remove_file(&live.socket).unwrap();
    fs::write(&live.socket, "mine").unwrap();
    live.line("is gone");
    std::thread::sleep(Duration::from_secs(3));
    assert_eq!(fs::read(&live.socket).unwrap(), b"mine");
    fs::remove_file(&live.socket).unwrap();
    await_answer(&live);
    let socket = live.socket.clone();
    live.end();
    assert!(!socket.exists());
}
