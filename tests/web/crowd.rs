//! Many clients, slow clients, and a frozen browser: the controller continues to scan, and the
//! pages answer.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::Duration;

use crate::web::client::Web;

#[test]
fn silent_clients_exhaust_neither_memory_nor_the_controller() {
    let web = Web::start(&[]);
    let visitor = web.visit();
    web.until("/events?element=Main&from=1&to=2", &visitor, |event| event["scan"].is_u64());
    let before = web.live.say("status --json").json()["scans"].as_u64().unwrap();
    let crowd: Vec<TcpStream> = (0..400)
        .filter_map(|n| {
            let mut stream = TcpStream::connect(&web.host).ok()?;
            // Half of them send the beginning of a request, the others nothing.
            let _ = stream.write_all(if n % 2 == 0 { b"GET / HTT" } else { b"" });
            Some(stream)
        })
        .collect();
    assert!(crowd.len() > 300, "the system lets them in");
    assert_eq!(web.get("/api/ladder", &visitor).status, 200, "one that asks is answered");
    let open = crowd.into_iter().filter(|stream| {
        stream.set_nonblocking(true).expect("it can be asked without waiting");
        let read = (&mut &*stream).read(&mut [0; 1]);
        read.is_err_and(|error| error.kind() == std::io::ErrorKind::WouldBlock)
    });
    assert!(open.count() < 256, "the idle have given their places");
    let after = web.live.say("status --json").json()["scans"].as_u64().unwrap();
    assert!(after > before, "it scans on");
    assert!(web.memory() < 300 << 20, "{} bytes", web.memory());
}

#[test]
fn viewers_that_read_nothing_do_not_delay_others() {
    let web = Web::start(&[]);
    let visitor = web.visit();
    let path = "/events?element=Main&from=1&to=2";
    let frozen: Vec<TcpStream> = (0..20).map(|_| web.open(path, &visitor)).collect();
    std::thread::sleep(Duration::from_secs(1));
    let memory = web.memory();
    web.live.ok("write level 50");
    web.live.ok("write start ON");
    let path = "/events?element=Main&from=1&to=2&tags=lamp";
    web.until(path, &visitor, |event| event["values"]["lamp"] == true);
    assert!(web.memory() < memory + (64 << 20), "nothing is heaped up for those who do not read");
    drop(frozen);
}

/// An open page has no request under way, but receives events: it is not idle.
#[test]
fn an_open_page_stays_connected_among_many_clients() {
    let web = Web::start(&[]);
    let visitor = web.visit();
    let mut page = web.open("/events?element=Main&from=1&to=2", &visitor);
    page.read_exact(&mut [0; 1]).expect("the answer has begun");
    let _crowd: Vec<TcpStream> =
        (0..400).filter_map(|_| TcpStream::connect(&web.host).ok()).collect();
    assert_eq!(web.get("/api/ladder", &visitor).status, 200);
    let mut events = Vec::new();
    while !String::from_utf8_lossy(&events).contains("\"scan\":") {
        let mut part = [0; 4096];
        let count = page.read(&mut part).expect("it is open");
        assert!(count > 0, "the page has lost its connection");
        events.extend_from_slice(&part[..count]);
    }
}
