//! `rungd metrics` once, into a file, and repeatedly; and a controller that does not answer.

use std::os::unix::fs::PermissionsExt as _;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::metrics::rig::{CONTROLLER, LADDER};
use rungd_test_support::running::live::{Live, PATIENCE, said};

#[test]
fn a_metrics_file_is_written_whole_and_readable_for_everybody() {
    let live = Live::start(LADDER, CONTROLLER, &[]);
    let file = live.folder.join("rungd.prom");
    let said = said(live.command("metrics --textfile").arg(&file));
    assert_eq!((said.code, &*said.out, &*said.err), (0, "", ""), "{said:?}");
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains("\nrungd_up 1\n") && text.contains("rungd_tag{tag=\"level\""), "{text}");
    assert_eq!(std::fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o644);
    let left = std::fs::read_dir(&live.folder).unwrap();
    let names = left.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned());
    assert_eq!(names.filter(|name| name.contains("rungd.prom")).count(), 1);
}

#[test]
fn a_metrics_file_is_rewritten_at_its_interval_and_shows_the_end() {
    let mut live = Live::start(LADDER, CONTROLLER, &[]);
    let file = live.folder.join("rungd.prom");
    let mut command = live.command("metrics --every 1s --textfile");
    let mut writer = command.arg(&file).stderr(Stdio::null()).spawn().unwrap();
    let until = |words: &str| {
        let deadline = Instant::now() + PATIENCE;
        while !std::fs::read_to_string(&file).unwrap_or_default().contains(words) {
            assert!(Instant::now() < deadline, "no {words}");
            std::thread::sleep(Duration::from_millis(50));
        }
    };
    until("\nrungd_up 1\n");
    live.end();
    until("\nrungd_up 0\n");
    assert!(writer.try_wait().unwrap().is_none(), "it goes on");
    writer.kill().unwrap();
    writer.wait().unwrap();
}

fn nobody(words: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.arg("metrics").args(words.split_whitespace());
    command.env("RUNGD_SOCKET", "/nonexistent/socket");
    command
}

#[test]
fn a_missing_controller_is_shown_in_the_metrics_and_the_exit_code() {
    let once = said(&mut nobody(""));
    assert_eq!(once.code, 69, "{once:?}");
    assert!(once.out.ends_with("\nrungd_up 0\n"), "{once:?}");
    assert!(once.err.contains("no rungd answers at /nonexistent/socket"), "{once:?}");
    let file = std::env::temp_dir().join(format!("rungd-nobody-{}.prom", std::process::id()));
    let written = said(nobody("--textfile").arg(&file));
    assert_eq!(written.code, 69, "{written:?}");
    assert!(std::fs::read_to_string(&file).unwrap().ends_with("\nrungd_up 0\n"));
    std::fs::remove_file(&file).unwrap();
    let nowhere = said(&mut nobody("--textfile /nonexistent/rungd.prom"));
    assert_eq!(nowhere.code, 74, "{nowhere:?}");
}

#[test]
fn incompatible_options_are_refused() {
    for wrong in [
        "--listen 9464",
        "--listen plant:9464",
        "--listen 127.0.0.1:0 --textfile x",
        "--every 15s",
        "--every 15s --listen 127.0.0.1:0",
        "--textfile x --every 10ms",
        "--textfile x --every often",
    ] {
        let said = said(&mut nobody(wrong));
        assert_eq!(said.code, 2, "{wrong}: {said:?}");
    }
}

#[test]
fn an_address_in_use_is_reported_with_a_remedy() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let at = taken.local_addr().unwrap();
    let said = said(&mut nobody(&format!("--listen {at}")));
    let words = format!("{at}: another process listens there (`ss -ltnp sport = :{}` ", at.port());
    assert!(said.code == 74 && said.err.contains(&words), "{said:?}");
    assert!(said.err.contains("or name another address after `--listen`"), "{said:?}");
}
