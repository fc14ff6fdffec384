//! Rights: every path by every role, operands by role, reasons, signing out by itself, PINs.

use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};

use crate::web::client::{HttpAnswer, LADDER, Visitor, Web};
use crate::web::users::passwd;
use rungd_config::controller::user::WebRole;
use rungd_test_support::running::live::{Live, PATIENCE};
use rungd_web::{PageChange, PageQuestion};

const RIGHTS: &str = r#"
[web]
write = ["level", "start"]
write-service = ["D1", "C1"]
[[user]]
name = "anna"
role = "service"
[[user]]
name = "ben"
role = "operate"
[[user]]
name = "carl"
role = "view"
[[panel]]
name = "Line"
show = [
  { hold = "start" },
  { hold = "C1" },
  { value = "level", reason = true },
  { value = "D1" },
]
"#;

const PASSWORD: &str = "correct horse";

/// A controller, its pages, and users with these names.
fn web(controller: &str, users: &[&str]) -> Web {
    let live = Live::start(LADDER, controller, &[]);
    let file = live.folder.join("users").display().to_string();
    users.iter().for_each(|user| assert_eq!(passwd(&file, user, PASSWORD).0, 0));
    Web::of(live, &["--users-file", &file])
}

fn signed_in(web: &Web, user: &str) -> Visitor {
    web.visitor(web.sign_in(user, PASSWORD).cookie())
}

fn error(answer: &HttpAnswer) -> String {
    answer.json()["error"].as_str().unwrap_or_default().to_owned()
}

/// The status of the answer to a question.
fn status(web: &Web, question: PageQuestion, visitor: &Visitor) -> u16 {
    match question {
        PageQuestion::Stream => {
            let mut head = String::new();
            BufReader::new(web.open("/events?element=Main&from=1&to=1", visitor))
                .read_line(&mut head)
                .unwrap();
            head.split(' ').nth(1).unwrap().parse().unwrap()
        }
        PageQuestion::Status
        | PageQuestion::Session
        | PageQuestion::Hold
        | PageQuestion::Ladder
        | PageQuestion::Mimic
        | PageQuestion::Panels
        | PageQuestion::Recipe
        | PageQuestion::Tags
        | PageQuestion::Events
        | PageQuestion::Rungs
        | PageQuestion::Scan
        | PageQuestion::Why
        | PageQuestion::How
        | PageQuestion::Trend
        | PageQuestion::Deploys => web.get(question.path(), visitor).status,
    }
}

/// The users of [`RIGHTS`], and one that the file does not list.
const ROLES: [(&str, WebRole); 4] = [
    ("anna", WebRole::Service),
    ("ben", WebRole::Operate),
    ("carl", WebRole::View),
    ("dora", WebRole::View),
];

#[test]
fn every_path_is_open_for_the_roles_that_the_table_names_and_for_no_other() {
    let web = web(RIGHTS, &ROLES.map(|(name, _)| name));
    let nobody = Visitor { cookie: String::new(), csrf: String::new() };
    for question in PageQuestion::ALL {
        assert_eq!(status(&web, question, &nobody), 401, "{question:?}");
    }
    for change in PageChange::ALL {
        assert_eq!(web.post(change.path(), &nobody, &json!({})).status, 401, "{change:?}");
    }
    for (user, role) in ROLES {
        let visitor = signed_in(&web, user);
        let session = web.get("/api/session", &visitor).json();
        assert_eq!(session["role"], role.word(), "{user}");
        for question in PageQuestion::ALL {
            let found = status(&web, question, &visitor);
            let is_open = ![401, 403].contains(&found);
            assert_eq!(is_open, role >= question.needs(), "{user} {question:?}: {found}");
        }
        let no_token = Visitor { csrf: String::new(), ..visitor.clone() };
        // The last of the table ends the session.
        for change in PageChange::ALL {
            assert_eq!(web.post(change.path(), &no_token, &json!({})).status, 403, "{change:?}");
            let found = web.post(change.path(), &visitor, &json!({}));
            let is_open = ![401, 403].contains(&found.status);
            assert_eq!(is_open, role >= change.needs(), "{user} {change:?}: {found:?}");
            assert_ne!(web.get(change.path(), &visitor).status, 500, "{change:?}");
        }
        assert_eq!(web.get("/api/session", &visitor).status, 401, "{user} has signed out");
    }
    for (path, found) in [("/api/none", 404), ("/api/write/none", 404)] {
        let ben = signed_in(&web, "ben");
        assert_eq!(
            (web.get(path, &ben).status, web.post(path, &ben, &json!({})).status),
            (found, found)
        );
    }
}

/// The controller's own answer to a write of a page.
fn of_controller(web: &Web, user: Option<&str>, operand: &str) -> Value {
    let mut stream = web.live.connect();
    let request = json!({ "do": "write", "operand": operand, "value": 1, "for_user": user,
                          "from_page": true, "reason": "Test" });
    stream.write_all(format!("{request}\n").as_bytes()).unwrap();
    let mut line = String::new();
    BufReader::new(stream).read_line(&mut line).unwrap();
    serde_json::from_str(&line).unwrap()
}

#[test]
fn an_operand_is_written_by_its_role_and_the_controller_judges_it_again() {
    let web = web(RIGHTS, &["anna", "ben", "carl"]);
    let [anna, ben] = ["anna", "ben"].map(|user| signed_in(&web, user));
    let write = |visitor: &Visitor, path: &str, operand: &str| {
        web.post(path, visitor, &json!({ "operand": operand, "value": 1, "reason": "Test" }))
    };
    for (visitor, operand, wanted) in [
        (&anna, "level", 200),
        (&anna, "D1", 200),
        (&ben, "level", 200),
        (&ben, "D1", 403),
        (&ben, "Y1", 403),
    ] {
        let answer = write(visitor, "/api/write", operand);
        assert_eq!(answer.status, wanted, "{operand}: {answer:?}");
    }
    let refused = error(&write(&ben, "/api/write", "D1"));
    assert!(refused.contains("needs the role `service`, and ben has `operate`"), "{refused}");
    assert_eq!(write(&ben, "/api/press", "C1").status, 403);
    assert_eq!(write(&ben, "/api/press", "start").status, 200);
    let of_session = |visitor: &Visitor| web.get("/api/session", visitor).json();
    assert_eq!(of_session(&ben)["write"], json!(["level", "start"]));
    assert_eq!(of_session(&anna)["write"], json!(["level", "start", "D1", "C1"]));
    assert_eq!(of_session(&anna)["reasons"], json!(["level"]));
    for (user, operand, wanted) in [
        (Some("anna"), "D1", None),
        (Some("ben"), "level", None),
        (Some("ben"), "D1", Some("is for the role `service`, and ben has `operate`")),
        (Some("carl"), "level", Some("is for the role `operate`, and carl has `view`")),
        (Some("nobody"), "level", Some("is for the role `operate`")),
        (None, "level", Some("is for the role `operate`")),
        (Some("anna"), "Y1", Some("`[web] write` does not list it")),
    ] {
        let answer = of_controller(&web, user, operand);
        let refusal = answer["error"]["message"].as_str();
        assert_eq!(refusal.is_some(), wanted.is_some(), "{user:?} {operand}: {answer}");
        assert!(refusal.unwrap_or_default().contains(wanted.unwrap_or_default()), "{answer}");
    }
    // A reload changes roles: for the controller at once, for pages with their next look.
    let file = web.live.folder.join("controller.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("role = \"operate\"", "role = \"service\"")).unwrap();
    let report = web.live.ok("reload");
    assert!(report.contains("the role of user ben: operate → service"), "{report}");
    assert_eq!(of_controller(&web, Some("ben"), "D1").get("error"), None);
    let watch = std::time::Instant::now();
    while write(&ben, "/api/write", "D1").status != 200 {
        assert!(watch.elapsed() < PATIENCE, "its page does not see the new role");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_part_with_reason_is_written_with_a_reason_that_the_log_has() {
    let web = web(RIGHTS, &["ben"]);
    let ben = signed_in(&web, "ben");
    let write = |reason: Value| {
        let change = json!({ "operand": "level", "value": 42, "reason": reason });
        web.post("/api/write", &ben, &change)
    };
    let refused = write(Value::Null);
    assert!(refused.status == 409 && error(&refused).contains("a reason alone"), "{refused:?}");
    for wrong in ["", "  ", "two\nlines", &"x".repeat(201)] {
        let refused = write(wrong.into());
        assert!(refused.status == 409 && error(&refused).contains("one line"), "{refused:?}");
    }
    assert_eq!(write("Foam in the tank".into()).status, 200);
    let line = web.live.line("wrote 42 to level");
    assert_eq!(line["reason"], "Foam in the tank");
    assert!(line["message"].as_str().unwrap().ends_with("; reason: Foam in the tank"), "{line}");
    let start = json!({ "operand": "start", "value": true });
    assert_eq!(web.post("/api/write", &ben, &start).status, 200, "no part of it wants a reason");
    // The command line takes one, too.
    let mut command = web.live.command("write level 43");
    assert!(
        command.args(["--why", "Calibration"]).stdout(Stdio::null()).status().unwrap().success()
    );
    assert_eq!(web.live.line("wrote 43 to level")["reason"], "Calibration");
}

#[test]
fn who_does_nothing_is_signed_out_sees_on_and_signs_in_again() {
    let web = web(&RIGHTS.replace("[web]\n", "[web]\nsign-out = \"1ms\"\n"), &["anna", "ben"]);
    let ben = signed_in(&web, "ben");
    std::thread::sleep(Duration::from_millis(20));
    let session = web.get("/api/session", &ben).json();
    assert_eq!((&session["signed_out"], &session["role"]), (&true.into(), &"view".into()));
    assert_eq!((&session["write"], &session["user"]), (&json!([]), &"ben".into()));
    assert_eq!(web.get("/api/ladder", &ben).status, 200);
    let refused = web.post("/api/write", &ben, &json!({ "operand": "start", "value": true }));
    assert!(refused.status == 403 && error(&refused).contains("sign in again"), "{refused:?}");
    // Only a sign-in ends it, and its session takes the place of the old one.
    assert_eq!(web.post("/api/stay", &ben, &json!({})).status, 200);
    assert_eq!(web.get("/api/session", &ben).json()["signed_out"], true);
    // A reload that takes `sign-out` away does not end it, either.
    let file = web.live.folder.join("controller.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("sign-out = \"1ms\"\n", "")).unwrap();
    web.live.ok("reload");
    let watch = std::time::Instant::now();
    while !web.get("/api/session", &ben).json()["sign_out_ms"].is_null() {
        assert!(watch.elapsed() < PATIENCE, "its page does not see the reload");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(web.post("/api/stay", &ben, &json!({})).status, 200);
    assert_eq!(web.get("/api/session", &ben).json()["signed_out"], true);
    let entered = web.post("/api/login", &ben, &json!({ "user": "anna", "password": PASSWORD }));
    assert_eq!(entered.status, 200, "{entered:?}");
    assert_eq!(web.get("/api/session", &ben).status, 401);
}

#[test]
fn a_pin_signs_in_like_a_password() {
    let live = Live::start(LADDER, RIGHTS, &[]);
    let file = live.folder.join("users").display().to_string();
    let pin = |pin: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
        command.args(["web", "passwd", "ben", "--pin", "--users-file", &file]);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(format!("{pin}\n").as_bytes()).unwrap();
        child.wait().unwrap().code().unwrap()
    };
    assert_eq!([pin("4711"), pin("47110x"), pin("004711")], [2, 2, 0]);
    let web = Web::of(live, &["--users-file", &file]);
    assert_eq!(
        (web.sign_in("ben", "4711").status, web.sign_in("ben", "004711").status),
        (401, 200)
    );
}
