//! Many clients, slow clients, and a frozen browser: the controller continues to scan, and the
//! pages answer.

use std::io::Write as _;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use crate::running::live::PATIENCE;
use crate::web::client::Web;

#[test]
fn silent_clients_do_not_exhaust_memory_or_controller() {
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
    drop(crowd);
    let deadline = Instant::now() + PATIENCE;
    while web.get("/api/ladder", &visitor).status != 200 {
        assert!(Instant::now() < deadline, "the pages are back");
    }
    let after = web.live.say("status --json").json()["scans"].as_u64().unwrap();
    assert!(after > before, "it scans on");
    assert!(web.memory() < 300 << 20, "{} bytes", web.memory());
}

#[test]
fn viewers_that_read_nothing_delay_no_other() {
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
