//! Users: their passwords, and the operands that they may write.

use std::fs::Permissions;
use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::fs::PermissionsExt as _;
use std::process::{Command, Stdio};

use serde_json::json;

use crate::web::client::{CONTROLLER, HttpAnswer, LADDER, Visitor, Web};
use rungd_test_support::folder::TestFolder;
use rungd_test_support::running::live::Live;

/// Sets a password as a script does.
pub fn passwd(file: &str, user: &str, password: &str) -> (i32, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.args(["web", "passwd", user, "--users-file", file]);
    let mut child =
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(format!("{password}\n").as_bytes()).unwrap();
    let said = child.wait_with_output().unwrap();
    (said.status.code().unwrap(), String::from_utf8(said.stderr).unwrap())
}

/// A controller and its pages, with the user anna signed in.
pub fn signed_in(ladder: &str, controller: &str) -> (Web, Visitor) {
    let live = Live::start(ladder, controller, &[]);
    let file = live.folder.join("users").display().to_string();
    passwd(&file, "anna", "correct horse");
    let web = Web::of(live, &["--users-file", &file]);
    let anna = web.visitor(web.sign_in("anna", "correct horse").cookie());
    (web, anna)
}

/// The exit code of the removal of a user.
fn removed(file: &str, user: &str) -> i32 {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.args(["web", "passwd", user, "--remove", "--users-file", file]).stdout(Stdio::null());
    command.status().unwrap().code().unwrap()
}

fn error(answer: &HttpAnswer) -> String {
    answer.json()["error"].as_str().unwrap_or_default().to_owned()
}

#[test]
fn a_user_can_write_only_listed_operands_and_the_log_names_the_user() {
    let listed = CONTROLLER.replace("\"start\"]", "\"start\", \"R0\"]");
    let live = Live::start(LADDER, &listed, &[]);
    let file = live.folder.join("users").display().to_string();
    assert_eq!(
        passwd(&file, "anna", "short"),
        (2, "rungd web: a password must have 8 to 1024 bytes\n".into())
    );
    assert_eq!(passwd(&file, "anna", "correct horse").0, 0);
    let web = Web::of(live, &["--users-file", &file]);
    assert!(web.link.is_none());
    let nobody = Visitor { cookie: String::new(), csrf: String::new() };
    assert_eq!(error(&web.get("/api/session", &nobody)), "sign in");
    for (user, password) in [("anna", "wrong horse"), ("ben", "correct horse"), ("", "")] {
        let refused = web.sign_in(user, password);
        assert_eq!((refused.status, refused.header("set-cookie")), (401, None));
    }
    let entered = web.sign_in("anna", "correct horse");
    assert_eq!(entered.status, 200, "{entered:?}");
    let set = entered.header("set-cookie").unwrap();
    assert!(set.contains("HttpOnly") && set.contains("SameSite=Strict"), "{set}");
    let anna = web.visitor(entered.cookie());
    let write = |operand: &str, value: serde_json::Value| {
        web.post("/api/write", &anna, &json!({ "operand": operand, "value": value }))
    };
    let change = write("level", json!(42));
    assert_eq!((change.status, &change.json()["now"]["value"]), (200, &json!(42)));
    let line = web.live.line("wrote 42");
    let who = line["who"].as_str().unwrap();
    assert!(who.starts_with("anna by ") && line["event"] == "operator-write", "{line}");
    // The moment from which scans show what the ladder has made of it.
    assert!(change.json()["at_ms"].as_u64().unwrap() > 1_600_000_000_000, "{change:?}");
    // The address names the same operand.
    assert_eq!(write("D0", json!("43")).status, 200);
    let refused = write("level", json!(1000));
    assert!(refused.status == 409 && error(&refused).contains("takes 0 to 100"), "{refused:?}");
    let refused = write("R0", json!("1,5"));
    assert!(refused.status == 409 && error(&refused).contains("write `1.5`"), "{refused:?}");
    let refused = write("lamp", json!(true));
    assert!(refused.status == 403 && error(&refused).contains("[web] write"), "{refused:?}");
    assert_eq!(write("nobody", json!(1)).status, 400);
    let stolen = Visitor { csrf: String::new(), ..anna.clone() };
    let change = json!({ "operand": "level", "value": 1 });
    assert_eq!(web.post("/api/write", &stolen, &change).status, 403);
    // A new password ends the sessions of the old one, and their open pages.
    let open = web.open("/events?element=Main&from=1&to=2", &anna);
    let mut lines = BufReader::new(open).lines().map(|line| line.expect("a line in time"));
    assert!(lines.any(|line| line.starts_with("data: {")));
    assert_eq!(passwd(&file, "anna", "another horse").0, 0);
    // About ten lines come per second.
    assert!(lines.take(600).count() < 600, "it ends");
    assert_eq!(web.get("/api/session", &anna).status, 401);
    assert_eq!(web.live.say("read level --json").json()["values"][0]["value"], 43);
}

#[test]
fn a_write_is_refused_at_once_after_a_reload_removes_its_operand_from_the_list() {
    let live = Live::start(LADDER, CONTROLLER, &[]);
    let file = live.folder.join("users").display().to_string();
    passwd(&file, "anna", "correct horse");
    let web = Web::of(live, &["--users-file", &file]);
    let anna = web.visitor(web.sign_in("anna", "correct horse").cookie());
    let write =
        |operand: &str| web.post("/api/write", &anna, &json!({"operand": operand, "value": 1}));
    assert_eq!(write("level").status, 200);
    let controller = web.live.folder.join("controller.toml");
    let text = std::fs::read_to_string(&controller).unwrap();
    let text = text.replace("write = [\"level\", \"start\"]", "write = [\"start\"]");
    std::fs::write(&controller, text).unwrap();
    web.live.ok("reload");
    let refused = write("level");
    assert!(refused.status == 403 && error(&refused).contains("[web] write"), "{refused:?}");
    assert_eq!(write("start").status, 200);
}

/// The wrong passwords wait for their turn at the same time, so each of them was admitted before
/// the first was found to be wrong.
#[test]
fn simultaneous_wrong_passwords_get_no_more_attempts_than_the_limit() {
    let live = Live::start(LADDER, CONTROLLER, &[]);
    let file = live.folder.join("users").display().to_string();
    passwd(&file, "anna", "correct horse");
    let web = Web::of(live, &["--users-file", &file]);
    let statuses = |count: usize, password: &str| -> Vec<u16> {
        let body = json!({ "user": "anna", "password": password }).to_string();
        let (host, length) = (&web.host, body.len());
        let request = format!(
            "POST /api/login HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nContent-Length: \
             {length}\r\nContent-Type: application/json\r\nConnection: close\r\n\r\n{body}"
        );
        let opened: Vec<_> = (0..count).map(|_| web.begin(request.as_bytes())).collect();
        opened.into_iter().map(|stream| HttpAnswer::read(stream).status).collect()
    };
    let wrong = statuses(250, "wrong horse");
    let tried = wrong.iter().filter(|status| **status == 401).count();
    assert_eq!(tried, 5, "{wrong:?}");
    assert_eq!(wrong.iter().filter(|status| **status == 429).count(), 245);
    assert_eq!(statuses(3, "correct horse"), [429; 3], "limited like any other");
}

/// A hash takes 19 MB, which the process must not keep for every password.
#[test]
fn sixty_sign_ins_use_the_memory_of_one_password_hash() {
    let live = Live::start(LADDER, CONTROLLER, &[]);
    let file = live.folder.join("users").display().to_string();
    for user in ["anna", "ben", "carl"] {
        passwd(&file, user, "correct horse");
    }
    let web = Web::of(live, &["--users-file", &file]);
    let sign_in = |user: &str| {
        let entered = web.sign_in(user, "correct horse");
        assert_eq!(entered.status, 200, "{entered:?}");
    };
    sign_in("anna");
    let before = web.memory();
    for _ in 0..20 {
        ["anna", "ben", "carl"].into_iter().for_each(sign_in);
    }
    assert!(web.memory() < before + (64 << 20), "{} after {before} bytes", web.memory());
}

/// Each of these makes its browser go away while `rungd web` stands still with the request.
#[test]
fn a_change_by_a_browser_that_left_is_not_executed() {
    let live = Live::start(LADDER, CONTROLLER, &[]);
    let file = live.folder.join("users").display().to_string();
    passwd(&file, "anna", "correct horse");
    let web = Web::of(live, &["--users-file", &file]);
    let anna = web.visitor(web.sign_in("anna", "correct horse").cookie());
    let clock =
        web.until("/events?element=Main&from=1&to=2", &anna, |event| event["clock"]["ms"].is_u64())
            ["clock"]
            .clone();
    let by = |later_ms: u64| {
        let ms = clock["ms"].as_u64().unwrap() + later_ms;
        json!({ "clock": clock["clock"], "ms": ms })
    };
    let request = |value: i32, deadline: Option<serde_json::Value>| {
        let mut change = json!({ "operand": "level", "value": value });
        if let Some(deadline) = deadline {
            change["deadline"] = deadline;
        }
        web.bytes_of("/api/write", &anna, &change)
    };
    web.signal("STOP");
    let late = web.begin(&request(11, Some(by(100))));
    let in_time = web.begin(&request(12, Some(by(100_000))));
    for half in [std::net::Shutdown::Both, std::net::Shutdown::Write] {
        web.begin(&request(13, None)).shutdown(half).unwrap();
    }
    std::thread::sleep(std::time::Duration::from_millis(500));
    web.signal("CONT");
    let refused = HttpAnswer::read(late);
    assert_eq!(refused.status, 409, "{refused:?}");
    assert!(error(&refused).contains("after the browser had stopped waiting"), "{refused:?}");
    assert_eq!(HttpAnswer::read(in_time).status, 200);
    web.line("the browser has left without waiting");
    web.line("the browser has left without waiting");
    assert_eq!(web.live.say("read level --json").json()["values"][0]["value"], 12);
    // What is written in time is written, and a deadline of a different clock is none.
    assert_eq!(web.send(&request(14, None)).status, 200);
    for odd in [json!({"clock": "0123456789abcdef", "ms": 1}), json!(5), json!({"ms": -1})] {
        assert_eq!(web.send(&request(15, Some(odd))).status, 400);
    }
    assert_eq!(web.live.say("read level --json").json()["values"][0]["value"], 14);
}

#[test]
fn simultaneously_set_users_are_all_kept() {
    let folder = TestFolder::new("users");
    let file = folder.path().join("users");
    let (named, text) = (folder.path().join("link"), || std::fs::read_to_string(&file).unwrap());
    assert_eq!(passwd(&file.display().to_string(), "first", "correct horse").0, 0);
    std::fs::set_permissions(&file, Permissions::from_mode(0o640)).unwrap();
    std::os::unix::fs::symlink("users", &named).unwrap();
    let named = named.display().to_string();
    let all = |change: &(dyn Fn(usize) -> i32 + Sync)| {
        std::thread::scope(|scope| {
            let changes: Vec<_> = (0..8).map(|n| scope.spawn(move || change(n))).collect();
            assert!(changes.into_iter().all(|change| change.join().unwrap() == 0));
        });
    };
    all(&|n| passwd(&named, &format!("user{n}"), "correct horse").0);
    assert_eq!(text().lines().count(), 9, "{}", text());
    // Some are removed while others get a new password.
    all(&|n| match n % 2 {
        0 => removed(&named, &format!("user{n}")),
        _ => passwd(&named, &format!("user{n}"), "another horse").0,
    });
    let names = text();
    let mut names: Vec<&str> = names.lines().filter_map(|line| line.split(':').next()).collect();
    names.sort_unstable();
    assert_eq!(names, ["first", "user1", "user3", "user5", "user7"]);
    assert!(std::fs::symlink_metadata(&named).unwrap().is_symlink(), "a link stays a link");
    assert_eq!(std::fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "nothing stays beside it");
}

#[test]
fn the_number_of_password_attempts_is_limited() {
    let live = Live::start(LADDER, CONTROLLER, &[]);
    let file = live.folder.join("users").display().to_string();
    passwd(&file, "anna", "correct horse");
    let web = Web::of(live, &["--users-file", &file]);
    let tries: Vec<u16> = (0..7).map(|_| web.sign_in("anna", "wrong horse").status).collect();
    assert_eq!(tries[..5], [401; 5]);
    assert_eq!(tries[6], 429);
    assert_eq!(web.sign_in("anna", "correct horse").status, 429, "for a minute");
}
