//! Random reloads of the real binary under load; four in ten have files that cannot be run. No scan
//! is missed or mixes two programs. Memory continues, also in the uses of an edited template. A bad
//! reload changes no bit.
//!
//! Makes `RUNGD_RELOADS` (150) reloads from the seed `RUNGD_RELOAD_SEED` (1). The long run:
//! `RUNGD_RELOADS=10000 cargo test --release --test controller reload::random:: -- --nocapture`

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use rungd_test_support::numbers::Numbers;
use rungd_test_support::running::live::Live;
use rungd_test_support::running::operator::Operator;
use rungd_test_support::setting::setting;
use serde_json::json;

const CONTROLLER: &str = r#"
[scan]
period = "2ms"
watchdog = "2s"
[reload]
probation = "50ms"
[modbus-server]
listen = "127.0.0.1:0"
writable = ["MC1..MC32", "MHR1..MHR32"]
"#;

/// A program with a number. It writes the number first and last in the scan, counts every scan, and
/// has a counter that all these programs have.
fn good(version: u64, numbers: &mut Numbers) -> String {
    let mut rungs = String::new();
    for n in 0..numbers.below(30) {
        rungs += &match numbers.below(6) {
            0 => format!("{{ when = [\"rise(MC{})\"], do = [\"PONOFF C{n}\"] }},\n", n % 32 + 1),
            1 => format!(
                "{{ when = [\"MC1\"], do = [\"ONDTMR T{n} preset=50ms output=C{}\"] }},\n",
                100 + n
            ),
            2 => format!(
                "{{ leg.up = [\"MC2\"], leg.rst = [\"MC3\"], do = [\"CNT CT{} preset=9\"] }},\n",
                10 + n
            ),
            3 => format!("{{ when = [\"MC{}\"], do = [\"RUN Side\"] }},\n", n % 32 + 1),
            4 => format!("{{ when = [\"$On\"], do = [\"ENTASK Work every={}ms\"] }},\n", 2 + n),
            _ => format!("{{ when = [\"MC{}\"], do = [\"OUT Y{n}\"] }},\n", n % 32 + 1),
        };
        if rungs.matches("ENTASK").count() > 1 {
            let at = rungs.rfind("{ when = [\"$On\"], do = [\"ENTASK").unwrap();
            rungs.truncate(at);
        }
    }
    format!(
        r#"
[[program]]
name = "Main"
rung = [
{{ when = ["$On"], do = ["MOVE {version} to=MIR1", "MOVE {version} to=D0", "ADD D2 1 to=D2"] }},
{{ leg.up = ["$ScanToggle"], leg.rst = ["$Off"], do = ["CNT CT0 preset={version}"] }},
{rungs}{{ when = ["$On"], do = ["MOVE {version} to=MIR2", "MOVE {version} to=D1", "MOVE MHR1 to=MIR3", "MOVE MHR2 to=MIR4"] }},
]
[[program]]
name = "Side"
[[program.stage]]
name = "S{stage}"
rung = [ {{ when = ["MC9"], do = ["EXIT"] }}, {{ when = ["$On"], do = ["OUT Y99"] }} ]
[[task]]
name = "Work"
rung = [ {{ when = ["$On"], do = ["ADD D3 1 to=D3"] }} ]
"#,
        stage = numbers.below(2)
    )
}

/// The uses between the first and the last one, which only some versions have.
const BETWEEN: [&str; 3] = ["m0", "m1", "m2"];

/// A version with tags that have a `type`, and with uses of a template.
struct Version {
    ladder: String,
    /// Which of the uses [`BETWEEN`] it has.
    has: [bool; 3],
}

/// A template whose rungs and tags are edited from version to version. Each use counts every scan,
/// and counts every second scan; only an operator writes its `own`.
fn meter(numbers: &mut Numbers) -> String {
    let (mut tags, mut rungs) = (String::new(), String::new());
    for n in 0..numbers.below(4) {
        let kind = ["int", "real"][numbers.below(2) as usize];
        tags += &format!("tags.a{n} = {{ type = \"{kind}\" }}\n");
        rungs += &format!(
            "{{ name = \"a{n}\", when = [\"rise(MC{})\"], do = [\"ADD a{n} 1 to=a{n}\"] }},\n",
            n + 1
        );
    }
    format!(
        "[[template]]\nname = \"Meter\"\n{tags}tags.runs = {{ type = \"int\" }}\n\
         tags.halves = {{ type = \"counter\" }}\ntags.own = {{ type = \"int\", spare = true }}\n\
         rung = [\n{rungs}{{ when = [\"$On\"], do = [\"ADD runs 1 to=runs\"] }},\n\
         {{ leg.up = [\"$ScanToggle\"], leg.rst = [\"$Off\"], do = [\"CNT halves preset=9\"] }},\n]\n"
    )
}

/// Same as [`typed`], with uses of the template: `first` and some of [`BETWEEN`] before the other
/// rungs, `last` before the last rung.
fn version(number: u64, numbers: &mut Numbers) -> Version {
    let use_of = |name: &str| format!("{{ use = \"Meter\", name = \"{name}\" }},\n");
    let has = BETWEEN.map(|_| numbers.below(2) == 1);
    let between = BETWEEN.iter().zip(has).filter(|(_, has)| *has);
    let between: String = between.map(|(name, _)| use_of(name)).collect();
    let head = format!("{}[[program]]\n", meter(numbers));
    let begin = format!("rung = [\n{}{between}", use_of("first"));
    let end = format!("{{ when = [\"$On\"], do = [\"MOVE {number} to=MIR2\"");
    let ladder = typed(number, numbers).replacen("[[program]]\n", &head, 1);
    let (before, main) = ladder.split_once("[[program]]\nname = \"Main\"").unwrap();
    let main = main.replacen("rung = [\n", &begin, 1);
    let main = main.replacen(&end, &format!("{}{end}", use_of("last")), 1);
    Version { ladder: format!("{before}[[program]]\nname = \"Main\"{main}"), has }
}

/// Same as [`good`], with tags that have a `type`: `scans` counts every scan, `parts` every second
/// scan, and only an operator writes `own`. A random number of additional tags moves their places.
fn typed(version: u64, numbers: &mut Numbers) -> String {
    let mut tags = "[tags]\nscans = { type = \"int\" }\nparts = { type = \"counter\" }\n\
                    own = { type = \"int\", spare = true }\n"
        .to_owned();
    for n in 0..numbers.below(5) {
        for kind in ["int", "counter"].iter().take(1 + numbers.below(2) as usize) {
            tags += &format!("a{n}_{kind} = {{ type = \"{kind}\", spare = true }}\n");
        }
    }
    let rungs = "{ when = [\"$On\"], do = [\"ADD scans 1 to=scans\"] },\n\
                 { leg.up = [\"$ScanToggle\"], leg.rst = [\"$Off\"], do = [\"CNT parts preset=9\"] },\n";
    let ladder = good(version, numbers);
    format!("{tags}{}", ladder.replacen("rung = [\n", &format!("rung = [\n{rungs}"), 1))
}

/// Files that cannot be run: ladder and controller.
fn bad(version: u64, numbers: &mut Numbers) -> (Vec<u8>, Option<String>) {
    let text = good(version, numbers);
    let controller = |text: &str| Some(text.to_owned());
    match numbers.below(8) {
        0 => (text.replace("name = \"Main\"", "name = Main").into(), None),
        1 => (text.replace("MOVE MHR1", "MOVE nothing").into(), None),
        2 => (text.replace("\"OUT Y99\"", "\"CNT CT0 preset=1\"").into(), None),
        3 => (text[..text.len() / 2].into(), None),
        4 => (vec![0xff, 0xfe, 0], None),
        5 => (text.into(), controller("ladder = [\"missing.toml\"]\n")),
        6 => (text.into(), controller("ladder = [\"ladder.toml\"]\nmemory.D = 5000\n")),
        _ => (text.into(), controller("ladder = [\"ladder.toml\"]\nscan = 5\n")),
    }
}

/// A Modbus client that writes two registers and reads the program's copies of them until `stop`.
/// The program's number must be the same first and last in the scan, and no write may be lost.
fn modbus_load(port: u16, stop: &AtomicBool, requests: &AtomicU64) {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.set_nodelay(true).unwrap();
    let mut ask = |pdu: &[u8]| -> Vec<u8> {
        let mut frame = vec![0, 1, 0, 0, 0, pdu.len() as u8 + 1, 1];
        frame.extend_from_slice(pdu);
        stream.write_all(&frame).unwrap();
        let mut head = [0; 7];
        stream.read_exact(&mut head).unwrap();
        let mut body = vec![0; usize::from(head[5]) - 1];
        stream.read_exact(&mut body).unwrap();
        requests.fetch_add(1, Ordering::Relaxed);
        body
    };
    let mut n: u16 = 0;
    while !stop.load(Ordering::Relaxed) {
        n = n.wrapping_add(1);
        let [high, low] = n.to_be_bytes();
        let done = ask(&[16, 0, 0, 0, 2, 4, high, low, high, low]);
        assert_eq!(done, [16, 0, 0, 0, 2], "a write is refused");
        let read = ask(&[4, 0, 0, 0, 4]);
        assert_eq!(read[..2], [4, 8], "a read is refused");
        let words: Vec<u16> =
            read[2..].chunks(2).map(|two| u16::from_be_bytes([two[0], two[1]])).collect();
        assert_eq!(words[0], words[1], "two programs in one image");
        assert_eq!((words[2], words[3]), (n, n), "a write was lost or torn");
        let coils: Vec<u8> = (0..4).map(|at| (n >> at) as u8).collect();
        let done = ask(&[&[15, 0, 0, 0, 32, 4][..], &coils].concat());
        assert_eq!(done, [15, 0, 0, 0, 32], "a write of coils is refused");
    }
}

#[test]
fn reloads_miss_or_mix_no_scan_and_bad_reloads_change_nothing() {
    let (count, seed) = (setting("RUNGD_RELOADS", 150), setting("RUNGD_RELOAD_SEED", 1));
    let mut numbers = Numbers(seed);
    let mut uses = Uses { has: [false; 3], late: [0; 3] };
    let first = version(1, &mut numbers);
    uses.has = first.has;
    let live = Live::start(&first.ladder, CONTROLLER, &[]);
    let controller = std::fs::read_to_string(live.folder.join("controller.toml")).unwrap();
    let mut operator = Operator::new(&live);
    while operator.read(&["D2"]).0 < 5 {
        thread::sleep(Duration::from_millis(5));
    }
    let status = operator.ask(&json!({"do": "status"}));
    let address = status["ok"]["devices"]["modbus"]["address"].as_str().unwrap().to_owned();
    let port: u16 = address.rsplit(':').next().unwrap().parse().unwrap();
    let (stop, requests) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
    let clients = clients(&live, port, &stop, &requests);
    let begin = Instant::now();
    let (mut running, mut bad_ones, mut swap_us_max) = (1, 0, 0.0_f64);
    let (mut sha256, mut last_acc) = (status["ok"]["ladder"]["sha256"].clone(), 0);
    for turn in 0..count {
        let is_bad = numbers.below(10) < 4;
        let next = turn % 60_000 + 2;
        let before = uses.has;
        let (ladder, other) = if is_bad {
            bad(next, &mut numbers)
        } else {
            let Version { ladder, has } = version(next, &mut numbers);
            uses.has = has;
            (ladder.into(), None)
        };
        std::fs::write(live.folder.join("ladder.toml"), ladder).unwrap();
        let other = other.map(|text| format!("operator.socket = \"s\"\n{text}"));
        std::fs::write(live.folder.join("controller.toml"), other.as_ref().unwrap_or(&controller))
            .unwrap();
        let answer = operator.ask(&json!({"do": "reload"}));
        if is_bad {
            bad_ones += 1;
            assert_eq!(answer["error"]["kind"], "bad-files", "turn {turn}: {answer}");
        } else {
            let us = answer["ok"]["swap_us"].as_f64().unwrap_or_else(|| panic!("{turn}: {answer}"));
            swap_us_max = swap_us_max.max(us);
            running = next;
            sha256 = answer["ok"]["sha256"].clone();
            // The image of the new program's first scan is published before the answer.
        }
        last_acc = count_of_one_image(&mut operator, running as i64, last_acc, turn);
        uses.go_on(&mut operator, before, turn);
        let status = operator.ask(&json!({"do": "status"}));
        assert_eq!(status["ok"]["ladder"]["sha256"], sha256, "turn {turn}");
        assert_eq!(status["ok"]["mode"], "RUN", "turn {turn}");
    }
    stop.store(true, Ordering::Relaxed);
    for client in clients {
        client.join().expect("a client met what it should not");
    }
    println!(
        "{count} reloads ({bad_ones} bad) in {:?} beside {} Modbus requests; longest swap {swap_us_max} us",
        begin.elapsed(),
        requests.load(Ordering::Relaxed)
    );
}

/// A Modbus client that reads and writes, and a client of the operator's socket that watches. Only
/// one client writes registers: two writers would read each other's numbers.
fn clients(
    live: &Live,
    port: u16,
    stop: &Arc<AtomicBool>,
    requests: &Arc<AtomicU64>,
) -> [thread::JoinHandle<()>; 2] {
    let (ended, requests) = (Arc::clone(stop), Arc::clone(requests));
    let modbus = thread::spawn(move || modbus_load(port, &ended, &requests));
    let (ended, socket) = (Arc::clone(stop), live.socket.clone());
    [modbus, thread::spawn(move || watch(&socket, &ended))]
}

/// Reads the memory of one scan, and compares its operands with each other, with the number of the
/// running program, and with the count of an earlier scan. The result is the count.
fn count_of_one_image(operator: &mut Operator, running: i64, before: i64, turn: u64) -> i64 {
    let (scans, held) = operator.read(&["D0", "D1", "D2", "CT0.Acc", "scans", "parts.Acc"]);
    assert_eq!((held[0], held[1]), (running, running), "turn {turn}");
    assert_eq!(held[2], scans, "turn {turn}: a scan was missed, or made twice");
    assert!(held[3] >= before, "turn {turn}: the count went back");
    assert!((held[3] - scans / 2).abs() <= 1, "turn {turn}: {} of {scans}", held[3]);
    assert_eq!((held[4], held[5]), (held[2], held[3]), "turn {turn}: what has a name");
    held[3]
}

/// The uses of the template in the running program.
struct Uses {
    has: [bool; 3],
    /// For each of these uses that is there: the number of scans before it began.
    late: [i64; 3],
}

impl Uses {
    /// Checks that old uses have continued to count after a reload, and that new uses began at 0.
    fn go_on(&mut self, operator: &mut Operator, before: [bool; 3], turn: u64) {
        let of = |name: &str| [format!("{name}.runs"), format!("{name}.halves.Acc")];
        let there = BETWEEN.iter().zip(self.has).filter(|(_, has)| *has).map(|(name, _)| *name);
        let names: Vec<String> = ["first", "last"].into_iter().chain(there).flat_map(of).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let (scans, held) = operator.read(&names);
        assert_eq!([held[0], held[2]], [scans; 2], "turn {turn}: the first use and the last");
        assert_eq!(held[1], held[3], "turn {turn}: the first use and the last");
        assert!((held[1] - scans / 2).abs() <= 1, "turn {turn}: {} of {scans}", held[1]);
        let mut between = held[4..].chunks(2);
        for at in (0..BETWEEN.len()).filter(|at| self.has[*at]) {
            let [runs, halves] = between.next().unwrap() else { unreachable!() };
            let late = scans - runs;
            if before[at] {
                assert_eq!(late, self.late[at], "turn {turn}: {} began anew", BETWEEN[at]);
            } else {
                assert!(*runs > 0 && late > 0, "turn {turn}: {} of {scans}", BETWEEN[at]);
            }
            assert!((halves - runs / 2).abs() <= 1, "turn {turn}: {halves} of {runs}");
            self.late[at] = late;
        }
    }
}

/// Reads values that must come from one program in each scan, also a block's `Running`.
fn watch(socket: &Path, stop: &AtomicBool) {
    let mut operator = Operator::at(socket);
    for number in 0.. {
        if stop.load(Ordering::Relaxed) {
            return;
        }
        let names = ["D0", "D1", "D2", "Main.Running", "$On", "$FirstScan"];
        let (scans, held) = operator.read(&names);
        assert_eq!(held[0], held[1], "two programs in one image");
        assert_eq!(held[2], scans, "a scan was missed, or made twice");
        assert_eq!(held[3..], [1, 1, 0], "an image by another program's layout");
        if number % 8 == 0 {
            let answer = operator.ask(&json!({"do": "write", "operand": "own", "value": number}));
            assert_eq!(answer["ok"]["now"]["value"], number, "{answer}");
            let write = json!({"do": "write", "operand": "last.own", "value": number});
            assert_eq!(operator.ask(&write)["ok"]["now"]["value"], number);
        }
        let own = operator.read(&["own", "last.own"]).1;
        assert_eq!(own, [number - number % 8; 2], "a write has gone astray");
    }
}

#[test]
fn a_refused_reload_changes_no_bit_of_memory() {
    let mut numbers = Numbers(99);
    let live = Live::start(&good(1, &mut numbers), CONTROLLER, &[]);
    let mut operator = Operator::new(&live);
    while operator.read(&["D2"]).0 < 50 {
        thread::sleep(Duration::from_millis(5));
    }
    operator.ask(&json!({"do": "force", "operand": "Y7", "value": true}));
    operator.ask(&json!({"do": "mode", "to": "stop"}));
    let before = memory(&mut operator);
    let controller = std::fs::read_to_string(live.folder.join("controller.toml")).unwrap();
    for version in 2..=40 {
        let (ladder, other) = bad(version, &mut numbers);
        std::fs::write(live.folder.join("ladder.toml"), ladder).unwrap();
        let other = other.map(|text| format!("operator.socket = \"s\"\n{text}"));
        std::fs::write(live.folder.join("controller.toml"), other.as_ref().unwrap_or(&controller))
            .unwrap();
        let answer = operator.ask(&json!({"do": "reload"}));
        assert_eq!(answer["error"]["kind"], "bad-files", "{answer}");
        // In STOP nothing would change a bit back, so one look in eight is enough: all of memory
        // has 20,000 names.
        if version % 8 == 0 {
            assert!(before == memory(&mut operator), "version {version}");
        }
    }
}

/// All memory that an operator can read, in requests of a limited size.
fn memory(operator: &mut Operator) -> Vec<i64> {
    let mut names: Vec<String> = Vec::new();
    for (space, count) in [("X", 2048), ("Y", 2048), ("C", 2048), ("V", 4096), ("D", 4096)] {
        names.extend((0..count).map(|n| format!("{space}{n}")));
    }
    for (space, count) in [("MC", 1024), ("MI", 1024), ("MHR", 2048), ("MIR", 2048)] {
        names.extend((1..=count).map(|n| format!("{space}{n}")));
    }
    for space in ["CT", "T"] {
        names.extend(
            (0..256)
                .flat_map(|n| ["Acc", "Done", "Reset", "Zero"].map(|m| format!("{space}{n}.{m}"))),
        );
    }
    names.extend(["Main.Running", "Side.Running"].map(str::to_owned));
    let mut held = Vec::new();
    for part in names.chunks(256) {
        let part: Vec<&str> = part.iter().map(String::as_str).collect();
        held.extend(operator.read(&part).1);
    }
    held
}
