//! The Modbus client over a serial line with a peer that lies, that answers late, or whose line is
//! unplugged. A pseudo-terminal serves as the line.

use std::sync::Arc;
use std::thread::spawn;

use crate::io::liars::{
    self, Answer, Lie, PATIENT, TIMEOUT, client, exchange, honest, lie, recovers, rtu_client,
    rtu_frame, serial, serve_rtu, with,
};
use crate::io::line::{await_over_a_line, pty};
use rungd_io::device::Driver;
use rungd_io::modbus_client::settings::{ClientSettings, LinkSettings, PeerHabits};
use rungd_io::modbus_client::{ModbusClient, RtuLines};
use tokio::time::timeout;

/// A part of the client's reason, and the peer's reaction to a read. With an empty text, the client
/// finds the right answer nevertheless.
const RTU_LIES: [(&str, Answer); 17] = [
    ("exception 2 (illegal data address)", |_, _| Lie::Say(rtu_frame(1, &[0x84, 2]))),
    ("exception 10 (gateway path unavailable)", |_, _| Lie::Say(rtu_frame(1, &[0x84, 10]))),
    ("2 bytes of data instead of 4", |_, _| Lie::Say(rtu_frame(1, &[4, 2, 0, 1]))),
    ("6 bytes of data instead of 4", |_, _| Lie::Say(rtu_frame(1, &[4, 6, 0, 1, 2, 3, 4, 5]))),
    ("no whole, correct answer", |_, right| Lie::Say(with(right, 8, right[8] ^ 1))),
    ("no whole, correct answer", |_, right| Lie::Say(with(right, 0, 2))),
    ("unit 2's, not unit 1's", |_, _| Lie::Say(rtu_frame(2, &[4, 4, 0, 1, 2, 3]))),
    ("no whole, correct answer", |_, _| Lie::Say(rtu_frame(1, &[3, 4, 0, 1, 2, 3]))),
    ("no whole, correct answer", |_, right| Lie::Say(right[..8].to_vec())),
    ("no whole, correct answer", |_, _| Lie::Trickle(vec![1; 30])),
    ("no answer in 400 ms", |_, _| Lie::Silence),
    ("no answer in 400 ms", |_, _| Lie::After(TIMEOUT * 3 / 2)),
    ("endless noise", |_, _| Lie::Say(vec![0x55; 2000])),
    ("", |_, right| Lie::Say([&[0xff, 0, 1, 4, 4], right].concat())),
    ("", |_, right| Lie::Say([right, &[0xff, 0, 1, 4]].concat())),
    ("set `echo = true`", |request, right| Lie::Say([request, right].concat())),
    ("", |_, right| Lie::Say([&rtu_frame(2, &[4, 4, 0, 1, 2, 3]), right].concat())),
];

#[test]
fn every_wrong_answer_over_a_serial_line_is_a_passing_error() {
    await_over_a_line(async || {
        let script = honest();
        let mut client = rtu_client(Arc::clone(&script), false, TIMEOUT, |_| ()).await;
        let again = "no answer in 400 ms";
        recovers(&mut client, again).await;
        for (words, answer) in RTU_LIES {
            // On a busy machine a lie may come after the timeout: then the peer repeats it. The
            // client sends nothing to a resting unit. A request that timed out may be answered
            // late, with the lie that was meant for the next request.
            let told = async {
                let mut late = false;
                loop {
                    if script.lock().unwrap().is_empty() {
                        lie(&script, answer);
                    }
                    match exchange(&mut client).await {
                        Err(trouble)
                            if !words.contains(again) && trouble.reason.ends_with(again) =>
                        {
                            late = true;
                        }
                        Ok([1000, 1001]) if late && !words.is_empty() => late = false,
                        told => return told,
                    }
                    tokio::task::yield_now().await;
                }
            };
            match timeout(liars::BOUND, told).await.unwrap() {
                Ok(inputs) => assert!(words.is_empty() && inputs == [1000, 1001], "{words}"),
                Err(trouble) => {
                    assert!(
                        !words.is_empty() && trouble.reason.contains(words),
                        "{words}: {trouble}"
                    );
                    assert!(!trouble.is_disconnected, "{words}");
                }
            }
            script.lock().unwrap().clear();
            // A late answer may still be under way, or a silent unit may be resting, even
            // repeatedly on a busy machine.
            let again = async {
                while exchange(&mut client).await != Ok([1000, 1001]) {
                    tokio::task::yield_now().await;
                }
            };
            let recovered = timeout(3 * liars::BOUND, again).await;
            recovered.unwrap_or_else(|_| panic!("{words}: no recovery"));
        }
    });
}

/// RTU has no transactions: a late answer looks like the answer to the next request.
#[test]
fn a_late_answer_over_a_serial_line_is_never_used_for_another_request() {
    await_over_a_line(async || {
        let script = honest();
        let second_elsewhere = |settings: &mut ClientSettings| {
            settings.inputs[1].at = 10;
            settings.outputs.clear();
        };
        let mut client = rtu_client(Arc::clone(&script), false, TIMEOUT, second_elsewhere).await;
        while exchange(&mut client).await != Ok([1000, 1010]) {
            tokio::task::yield_now().await;
        }
        // The first answer comes while the client repeats the request. The answer to the repetition
        // comes while the client requests the second register.
        lie(&script, |_, _| Lie::After(TIMEOUT * 3 / 2));
        lie(&script, |_, _| Lie::After(TIMEOUT / 5));
        assert!(exchange(&mut client).await.is_err());
        let mut wells = 0;
        while wells < 5 {
            if let Ok(inputs) = exchange(&mut client).await {
                assert_eq!(inputs, [1000, 1010]);
                wells += 1;
            }
            tokio::task::yield_now().await;
        }
    });
}

#[test]
fn a_lost_serial_line_is_reopened_when_it_returns() {
    await_over_a_line(async || {
        let (master, port) = pty();
        let script = honest();
        let told = Arc::clone(&script);
        let peer = spawn(move || serve_rtu(master, &told));
        let path = std::env::temp_dir().join(format!("rungd-line-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        std::os::unix::fs::symlink(&port, &path).unwrap();
        let serial = serial(path.to_str().unwrap().to_owned(), false);
        let settings = client(LinkSettings::Rtu(serial.clone()));
        let link = RtuLines::default().link(&serial, PeerHabits::default(), PATIENT);
        let mut client = ModbusClient::new(&settings, link);
        client.connect().await.unwrap();
        assert_eq!(exchange(&mut client).await, Ok([1000, 1001]));
        // The adapter is unplugged. Its name is removed first, because another test may receive its
        // number at once.
        let unplugged = path.clone();
        lie(&script, move |_, _| {
            std::fs::remove_file(&unplugged).unwrap();
            Lie::Leave(Vec::new())
        });
        let mut trouble = exchange(&mut client).await.unwrap_err();
        peer.join().unwrap();
        while !trouble.is_disconnected {
            trouble = exchange(&mut client).await.unwrap_err();
        }
        let trouble = client.connect().await.unwrap_err();
        assert!(trouble.reason.starts_with("cannot open it: No such file"), "{trouble}");
        let (master, port) = pty();
        spawn(move || serve_rtu(master, &script));
        std::os::unix::fs::symlink(&port, &path).unwrap();
        client.connect().await.unwrap();
        assert_eq!(exchange(&mut client).await, Ok([1000, 1001]));
        std::fs::remove_file(&path).unwrap();
    });
}
