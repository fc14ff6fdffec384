//! Clients that send nothing, too much or garbage, or do not wait for an answer: the next scrape is
//! answered, and the controller receives no more requests than usual.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;

use crate::metrics::rig::{Served, answer_of};

#[test]
fn only_a_get_or_head_of_metrics_is_answered() {
    let served = Served::start();
    let head = served.ask("HEAD /metrics", "*/*");
    assert_eq!((head.status, head.body.as_str()), (200, ""), "{head:?}");
    for (first, status) in [
        ("GET /", 404),
        ("GET /metrics/", 404),
        ("GET /api/status", 404),
        ("GET //metrics", 404),
        ("GET /metrics?x=1", 200),
        ("POST /metrics", 405),
        ("PUT /metrics", 405),
        ("DELETE /metrics", 405),
        ("OPTIONS /metrics", 405),
        ("POST /", 404),
    ] {
        let answer = served.ask(first, "*/*");
        assert_eq!(answer.status, status, "{first}: {answer:?}");
    }
    let post =
        b"POST /metrics HTTP/1.1\r\nHost: localhost\r\nContent-Length: 40\r\nConnection: close\r\n\r\n\
                 {\"do\":\"write\",\"operand\":\"D1\",\"value\":7}";
    assert_eq!(served.send(post).status, 405);
    assert!(served.live.ok("read D1").contains(" 0 bar"), "nothing is written");
}

/// A page of a foreign name, which its owner points to this machine, reads nothing.
#[test]
fn a_foreign_host_name_gets_no_metrics() {
    let served = Served::start();
    let status = |hosts: &str| {
        let request = format!("GET /metrics HTTP/1.1\r\n{hosts}Connection: close\r\n\r\n");
        served.send(request.as_bytes()).status
    };
    for known in ["localhost", "127.0.0.1:9464", "[::1]:80", "10.1.2.3"] {
        assert_eq!(status(&format!("Host: {known}\r\n")), 200, "{known}");
    }
    for foreign in ["evil.example", "127.0.0.1.evil.example", "localhost.evil.example:9464"] {
        assert_eq!(status(&format!("Host: {foreign}\r\n")), 403, "{foreign}");
    }
    assert_eq!((status(""), status("Host: localhost\r\nHost: localhost\r\n")), (403, 403));
}

#[test]
fn an_invalid_request_is_refused_and_the_next_one_is_answered() {
    let served = Served::start();
    let long = format!("GET /{} HTTP/1.1\r\n\r\n", "a".repeat(40_000));
    let many = format!("GET /metrics HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(200));
    for bytes in [
        &b"\0\xff\xfe garbage\r\n\r\n"[..],
        b"GET\r\n\r\n",
        b"GET /metrics HTTP/9.9\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
        b"GET /metrics HTTP/1.1\r\nAccept: \xff\xfe\r\nTransfer-Encoding: lies\r\n\r\n",
        long.as_bytes(),
        many.as_bytes(),
    ] {
        let answer = served.send(bytes);
        assert_ne!(answer.status, 200, "{:?}: {answer:?}", String::from_utf8_lossy(bytes));
        assert!(served.text().contains("\nrungd_up 1\n"));
    }
}

/// A connection may be silent for 5 s, and there are 32 places. If silent clients kept their
/// places, the last of 400 would wait for a minute.
#[test]
fn silent_clients_do_not_delay_others() {
    let served = Served::start();
    let crowd: Vec<TcpStream> = (0..400)
        .filter_map(|n| {
            let mut stream = TcpStream::connect(&served.host).ok()?;
            // Half of them send the beginning of a request, the others nothing.
            let _ = stream.write_all(if n % 2 == 0 { b"GET /met" } else { b"" });
            Some(stream)
        })
        .collect();
    assert!(crowd.len() > 300, "{}", crowd.len());
    assert!(served.text().contains("rungd_up 1"), "one that asks is answered");
    let open = crowd.into_iter().filter(|stream| {
        stream.set_nonblocking(true).expect("it can be asked without waiting");
        let read = (&mut &*stream).read(&mut [0; 1]);
        read.is_err_and(|error| error.kind() == std::io::ErrorKind::WouldBlock)
    });
    assert!(open.count() <= 32, "each of the others has given its place");
}

#[test]
fn simultaneous_scrapes_share_one_request_and_leave_none_behind() {
    let served = Served::start();
    let scans = |text: &str| {
        let line = text.lines().find(|line| line.starts_with("rungd_scans_total "));
        line.expect("scans").to_owned()
    };
    // Clients that send a request and do not wait for the answer.
    let request = b"GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n";
    for _ in 0..200 {
        let mut stream = TcpStream::connect(&served.host).unwrap();
        stream.write_all(request).unwrap();
    }
    served.await_line("rungd_up 1");
    // Many requests at once over one connection: they share one look at the controller, or two that
    // are a second apart.
    let mut stream = TcpStream::connect(&served.host).unwrap();
    let close = b"GET /metrics HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    stream.write_all(&[&request.repeat(20)[..], close].concat()).unwrap();
    let mut all = String::new();
    stream.read_to_string(&mut all).unwrap();
    let mut looks: Vec<String> = all.split("HTTP/1.1 200").skip(1).map(scans).collect();
    assert_eq!(looks.len(), 21);
    looks.dedup();
    assert!(looks.len() < 21, "each was a look of its own: {looks:?}");
}

#[test]
fn a_hung_controller_is_reported_in_bounded_time() {
    let served = Served::start();
    served.await_line("rungd_up 1");
    served.live.signal("STOP");
    let text = served.await_line("rungd_up 0");
    served.live.signal("CONT");
    assert_eq!(text.lines().count(), 3, "{text}");
    served.await_line("rungd_up 1");
    assert_eq!(answer_of(&served.host, b"GET / HTTP/1.0\r\nHost: localhost\r\n\r\n").status, 404);
}
