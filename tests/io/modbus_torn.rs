//! Torn writes: self-checking patterns are written and read, and nobody ever reads half a pattern.
//!
//! Many clients write their own patterns to the same registers, across the end of the standard map
//! and into the explicit map. The ladder checks the registers in every scan, and the clients check
//! their reads. The ladder also writes its own pattern, which the clients read. Clients that each
//! change one bit of the same register (function 22) must not lose each other's changes.
//!
//! CI makes some thousand exchanges. This command makes a million in some minutes, and prints
//! figures: `cargo test --release --test controller io::modbus_torn -- --ignored --nocapture`.

use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use rungd_test_support::modbus::Client;
use rungd_test_support::running::process::{Plant, Running};

const CONTROLLER: &str = r#"
[scan]
period = "1ms"

[modbus-server]
listen      = "127.0.0.1:0"
connections = 100
writable    = ["MHR2047..MHR2048", "V0..V2", "D0", "MHR100"]

[[modbus-server.map]]                 # behind MHR2048, at 2048
operand = "V0..V2"
table   = "holding"
address = 2048

[[modbus-server.map]]
operand = "D0"
table   = "holding"
address = 2051
"#;

/// The clients' pattern: MHR2047 = MHR2048 = V0 = n, V1 = 65535 - n, V2 = n + 1 (n below 65535), D0
/// = n * 65537. The ladder counts in D3 (MIR1) the scans that find a different pattern in these
/// registers except D0, and writes its own pattern to MIR2..MIR5.
const LADDER: &str = r#"
[[program]]
name = "Main"

[[program.rung]]
when = ["V1 > 0"]
do   = [
    "ADD MHR2047 V1 to=D1", "ADD MHR2047 1 to=D2",
    "ADD D4 1 to=D4", "MOVE D4 to=MIR2", "MOVE D4 to=MIR3", "SUB 65535 D4 to=D5", "MOVE D5 to=MIR4",
    "MOVE D4 to=MIR5",
]

[[program.rung]]
when = ["D4 >= 65535"]
do   = ["MOVE 0 to=D4"]

[[program.rung]]
when = ["V1 > 0", "MHR2047 != MHR2048 | MHR2047 != V0 | D1 != 65535 | D2 != V2"]
do   = ["ADD D3 1 to=D3"]

[[program.rung]]
when = ["$On"]
do   = ["MOVE D3 to=MIR1"]
"#;

/// 2046: the first register of the pattern.
const FIRST: [u8; 2] = [7, 0xfe];
const REGISTERS: u8 = 7;

/// The pattern of a number below 32,767.
fn pattern(n: u16) -> Vec<u8> {
    let words = [n, n, n, 65_535 - n, n + 1, n, n];
    words.into_iter().flat_map(u16::to_be_bytes).collect()
}

fn is_whole(bytes: &[u8]) -> bool {
    let first = u16::from_be_bytes([bytes[0], bytes[1]]);
    bytes.iter().all(|byte| *byte == 0) || (first < 32_767 && bytes == pattern(first))
}

/// The clients' shared data.
struct Plan {
    address: String,
    /// The number of exchanges (writes and reads) that are left.
    left: AtomicU64,
    writes: AtomicU64,
    torn: AtomicU64,
}

impl Plan {
    /// Takes one of the exchanges that are left; false if there is none.
    fn next(&self) -> bool {
        self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1)).is_ok()
    }

    fn judge(&self, whole: bool, what: &[u8]) {
        if !whole {
            eprintln!("torn: {what:?}");
            self.torn.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Writes patterns, alternately with function 16 and with function 23, which also reads.
    fn write(&self, who: u16) {
        let mut client = Client::connect(&self.address);
        let place = [&FIRST[..], &[0, REGISTERS]].concat();
        for round in 0.. {
            if !self.next() {
                return;
            }
            let values = pattern((who * 617 + round * 31) % 32_767);
            let write = [&place[..], &[REGISTERS * 2], &values].concat();
            if round % 2 == 0 {
                let reply = client.ask(1, &[&[16][..], &write].concat());
                assert_eq!(reply, [&[16][..], &place].concat());
            } else {
                let reply = client.ask(1, &[&[23][..], &place, &write].concat());
                self.judge(is_whole(&reply[2..]), &reply);
            }
            self.writes.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Reads the clients' pattern and the ladder's pattern.
    fn read(&self) {
        let mut client = Client::connect(&self.address);
        while self.next() {
            let reply = client.ask(1, &[3, FIRST[0], FIRST[1], 0, REGISTERS]);
            self.judge(is_whole(&reply[2..]), &reply);
            let reply = client.ask(1, &[4, 0, 1, 0, 4]);
            let [a, b, c, d] =
                [2, 4, 6, 8].map(|at| u16::from_be_bytes([reply[at], reply[at + 1]]));
            let whole = (a == b && a == d && c == 65_535 - a) || [a, b, c, d] == [0; 4];
            self.judge(whole, &reply);
        }
    }

    /// Changes its own bit of MHR100, and checks it.
    fn mask(&self, bit: u32) {
        let mut client = Client::connect(&self.address);
        let mask = 1_u16 << bit;
        for round in 0_u16.. {
            if !self.next() {
                return;
            }
            let on = if round % 2 == 0 { mask } else { 0 };
            let pdu = [&[22, 0, 99][..], &(!mask).to_be_bytes(), &on.to_be_bytes()].concat();
            assert_eq!(client.ask(1, &pdu), pdu);
            let reply = client.ask(1, &[3, 0, 99, 0, 1]);
            let kept = u16::from_be_bytes([reply[2], reply[3]]) & mask == on;
            self.judge(kept, &reply);
            self.writes.fetch_add(1, Ordering::Relaxed);
        }
    }
}

fn start() -> (Plant, Running, String) {
    let plant = Plant::new(LADDER, CONTROLLER);
    let running = Running::new(&mut plant.command(&[] as &[&str]));
    let line = running.line("Modbus server listens");
    let address = line["address"].as_str().unwrap().to_owned();
    running.line("RUN: scanning");
    (plant, running, address)
}

fn exchanges(count: u64, writers: u16) {
    let (_plant, mut running, address) = start();
    let (left, zero) = (AtomicU64::new(count), || AtomicU64::new(0));
    let plan = Plan { address: address.clone(), left, writes: zero(), torn: zero() };
    let began = Instant::now();
    thread::scope(|scope| {
        let plan = &plan;
        for who in 0..writers {
            scope.spawn(move || plan.write(who));
        }
        for bit in 0..8 {
            scope.spawn(move || plan.mask(bit));
        }
        for _ in 0..2 {
            scope.spawn(|| {
                while plan.left.load(Ordering::Relaxed) > 0 {
                    plan.read();
                    thread::sleep(Duration::from_millis(1));
                }
            });
        }
    });
    let mut client = Client::connect(&address);
    let by_ladder = client.ask(1, &[4, 0, 0, 0, 1]);
    let (writes, torn) = (plan.writes.into_inner(), plan.torn.into_inner());
    let seconds = began.elapsed().as_secs_f64();
    println!("{count} exchanges, {writes} of them writes, in {seconds:.0} s; torn: {torn}");
    println!("torn in the ladder: {by_ladder:?}");
    assert_eq!((torn, by_ladder), (0, vec![4, 2, 0, 0]));
    assert!(writes > count / 100);
    running.stop();
}

#[test]
fn the_test_detects_a_torn_pattern() {
    let (_plant, _running, address) = start();
    let mut client = Client::connect(&address);
    let place = [&FIRST[..], &[0, REGISTERS, REGISTERS * 2]].concat();
    for at in 0..REGISTERS {
        let mut values = pattern(1000);
        assert!(is_whole(&values));
        values[usize::from(at) * 2 + 1] ^= 1;
        assert!(!is_whole(&values));
        client.ask(1, &[&[16][..], &place, &values].concat());
        // Only readers notice a wrong D0.
        let seen = client.ask(1, &[4, 0, 0, 0, 1]);
        assert!(at >= 5 || seen != [4, 2, 0, 0], "{at}");
    }
}

#[test]
fn no_modbus_exchange_is_torn() {
    exchanges(20_000, 16);
}

#[test]
#[ignore = "minutes; run with --release"]
fn none_of_a_million_modbus_exchanges_is_torn() {
    exchanges(1_000_000, 64);
}
