//! Requests that do not come from a page of this host, and bytes that are not a request.

use serde_json::json;

use crate::web::client::{Visitor, Web};
use rungd_test_support::running::live::said;

fn status(web: &Web, first: &str, lines: &[&str]) -> u16 {
    let lines: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
    web.ask(first, &lines, "").status
}

#[test]
fn requests_from_other_hosts_or_pages_or_without_a_session_are_refused() {
    let web = Web::start(&[]);
    let visitor = web.visit();
    let (own, cookie) = (format!("Host: {}", web.host), format!("Cookie: {}", visitor.cookie));
    let (own, cookie) = (own.as_str(), cookie.as_str());
    assert_eq!(status(&web, "GET /api/ladder", &[own, cookie]), 200);
    assert_eq!(status(&web, "GET /api/ladder", &[own]), 401);
    assert_eq!(status(&web, "GET /api/ladder", &[own, "Cookie: rungd_session=x"]), 401);
    assert_eq!(status(&web, "GET /events?element=Main", &[own]), 401);
    assert_eq!(status(&web, "GET /api/ladder", &["Host: evil.example", cookie]), 403);
    assert_eq!(status(&web, "GET /", &["Host: evil.example"]), 403);
    let foreign = "Origin: http://evil.example";
    assert_eq!(status(&web, "GET /api/ladder", &[own, cookie, foreign]), 403);
    assert_eq!(status(&web, "GET /events?element=Main", &[own, cookie, foreign]), 403);
    assert_eq!(status(&web, "POST /api/write", &[own, cookie]), 403, "a form of another site");
    let page = format!("Origin: http://{}", web.host);
    assert_eq!(status(&web, "POST /api/write", &[own, cookie, &page]), 403, "without the token");
    assert_eq!(status(&web, "DELETE /", &[own, &page]), 405);
    // The link is accepted only once.
    let link = web.link.clone().unwrap();
    assert_eq!(status(&web, &format!("GET {link}"), &[own]), 403);
    // Its user may open it again; anybody else gets a page that says what to do.
    assert_eq!(status(&web, &format!("GET {link}"), &[own, cookie]), 303);
    let used = web.ask(&format!("GET {link}"), &[own.to_owned()], "");
    assert_eq!(used.header("content-type"), Some("text/html; charset=utf-8"), "{used:?}");
    assert!(used.body.contains("open the newest link"), "{used:?}");
    // A visitor by the link may read, but change nothing.
    let change = json!({ "operand": "level", "value": 7 });
    let refused = web.post("/api/write", &visitor, &change);
    assert_eq!(refused.status, 403);
    assert!(refused.body.contains("signed in"), "{refused:?}");
    assert_eq!(web.live.say("read level --json").json()["values"][0]["value"], 0);
    let bad = Visitor { csrf: "x".repeat(43), ..visitor };
    assert_eq!(web.post("/api/logout", &bad, &json!({})).status, 403);
}

#[test]
fn an_invalid_request_is_refused_and_the_next_one_is_answered() {
    let web = Web::start(&[]);
    let visitor = web.visit();
    let long = format!("GET /{} HTTP/1.1\r\n\r\n", "a".repeat(40_000));
    let many = format!("GET / HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(200));
    let host = format!("Host: {}\r\n", web.host);
    for bytes in [
        &b"\0\xff\xfe garbage\r\n\r\n"[..],
        b"\r\n\r\n\r\n\r\n",
        b"GET\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
        long.as_bytes(),
        many.as_bytes(),
        format!("POST /api/login HTTP/1.1\r\n{host}Content-Length: -1\r\n\r\n").as_bytes(),
        format!("POST /x HTTP/1.1\r\n{host}Transfer-Encoding: chunked\r\n\r\nzz\r\n").as_bytes(),
    ] {
        let answer = web.send(bytes);
        let is_refused = answer.status == 0 || (400..=505).contains(&answer.status);
        assert!(is_refused, "{answer:?} to {:?}", String::from_utf8_lossy(bytes));
        assert_eq!(web.get("/api/ladder", &visitor).status, 200);
    }
}

#[test]
fn insecure_settings_are_refused_with_a_remedy() {
    let refused = |arguments: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_rungd"));
        let said = command.arg("web").args(arguments).output().unwrap();
        (said.status.code().unwrap(), String::from_utf8(said.stderr).unwrap())
    };
    let (code, said) = refused(&["--listen", "0.0.0.0:0"]);
    assert!(code == 2 && said.contains("--tls-cert") && said.contains("--behind-proxy"), "{said}");
    let (code, said) = refused(&["--listen", "127.0.0.1:0", "--behind-proxy"]);
    assert!(code == 2 && said.contains("rungd web passwd"), "{said}");
    let (code, said) = refused(&["--listen", "127.0.0.1:0", "--users-file", "/nonexistent/users"]);
    assert!(code != 0 && said.contains("/nonexistent/users"), "{said}");
}

/// A second `rungd web`: the tip is followed, and works.
#[test]
fn an_address_in_use_is_reported_with_an_alternative() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let at = taken.local_addr().unwrap();
    let web = |listen: &str| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_rungd"));
        command.args(["web", "--socket", "/nonexistent/socket", "--listen", listen]);
        said(&mut command)
    };
    let told = web(&at.to_string());
    let words = format!("{at}: another process listens there (`ss -ltnp sport = :{}` ", at.port());
    assert!(told.code == 74 && told.err.contains(&words), "{told:?}");
    let next = at.port().checked_add(1).unwrap_or(8080);
    assert!(told.err.contains(&format!("`--listen {}:{next}`", at.ip())), "{told:?}");
}
