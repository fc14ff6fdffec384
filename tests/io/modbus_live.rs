//! The oracle against the real program over a socket: requests near every edge, then all of memory.
//!
//! `modbus_sweep.rs` checks the answers to all requests. This test shows that the program gives the
//! same answers through its connection, its scans and its engine.

use crate::io::oracle::requests::{Random, at_address};
use crate::io::oracle::{Client, Oracle};
use rungd_test_support::modbus::Client as Socket;
use rungd_test_support::running::process::{Plant, Running};

const EDGES: [u16; 22] = [
    0, 9, 19, 31, 99, 103, 109, 999, 1023, 2015, 2023, 2039, 2047, 2057, 4000, 4008, 4028, 4038,
    4045, 5015, 5040, 9001,
];

/// The longest PDU of a frame; a longer one closes the connection.
const PDU_BYTES_MAX: usize = 253;

/// Addresses of status words, which change by themselves.
const STATUS: std::ops::Range<u16> = 29_000..30_008;

struct Live {
    socket: Socket,
    oracle: Oracle,
    requests: u32,
}

impl Live {
    fn ask(&mut self, unit: u8, pdu: &[u8]) {
        if pdu.len() > PDU_BYTES_MAX {
            return;
        }
        let (expected, changes) = self.oracle.answer(unit, Client::Loopback, pdu);
        assert_eq!(self.socket.ask(unit, pdu), expected, "unit {unit} {pdu:?}");
        for (cell, value) in changes {
            self.oracle.cells[cell].value = value;
        }
        self.requests += 1;
    }
}

#[test]
fn the_server_answers_as_an_independent_implementation() {
    let controller =
        include_str!("oracle/controller.toml").replace("ladder = [\"ladder.toml\"]", "");
    let plant = Plant::new(
        include_str!("oracle/ladder.toml"),
        &format!("scan.period = \"1ms\"\n{controller}"),
    );
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    let line = running.line("Modbus server listens");
    let socket = Socket::connect(line["address"].as_str().unwrap());
    running.line("RUN: scanning");
    let mut live = Live { socket, oracle: Oracle::new(), requests: 0 };
    for cell in &mut live.oracle.cells {
        // The values after a cold start, with the ladder's `initial`.
        cell.value = if cell.name == "MHR15" { 5 } else { 0 };
    }
    let mut random = Random(7);
    for edge in EDGES {
        for at in [edge.wrapping_sub(1), edge, edge + 1] {
            for unit in [1, 2] {
                at_address(at, &mut random, |pdu| live.ask(unit, pdu));
            }
            live.ask(3, &[3, 0, 0, 0, 1]);
        }
    }
    at_address(65_534, &mut random, |pdu| live.ask(1, pdu));
    at_address(65_535, &mut random, |pdu| live.ask(2, pdu));
    // Between the edges, a debug build requests only every fifth address.
    let stride = if cfg!(debug_assertions) { 5 } else { 1 };
    let addresses = (0..12_000).step_by(stride).chain(65_500..=65_535);
    for at in addresses.filter(|at| !STATUS.contains(at)) {
        for function in 1..=4 {
            let [high, low] = u16::to_be_bytes(at);
            live.ask(1, &[function, high, low, 0, 1]);
        }
    }
    println!("{} requests", live.requests);
    running.stop();
}

#[test]
fn a_reload_applies_its_map_units_and_lists() {
    let server = "[modbus-server]\nlisten = \"127.0.0.1:0\"\n";
    let entry = |operand: &str, table: &str, address: u16| {
        format!(
            "[[modbus-server.map]]\noperand = \"{operand}\"\ntable = \"{table}\"\n\
             address = {address}\n"
        )
    };
    let ladder = |stages: &str| {
        format!(
            "[[program]]\nname = \"Main\"\n[[program.rung]]\nwhen = [\"$On\"]\ndo = [\"OUT Y0\"]\n\
             [[program]]\nname = \"Side\"\nautostart = true\n{stages}\
             [[program.stage]]\nname = \"Fill\"\n\
             [[program.stage.rung]]\nwhen = [\"$On\"]\ndo = [\"OUT Y1\"]\n"
        )
    };
    let before = format!("{server}writable = [\"D0\"]\n{}", entry("D0", "holding", 4000));
    let plant = Plant::new(&ladder(""), &(before + &entry("Side.Fill", "discrete", 2000)));
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    let line = running.line("Modbus server listens");
    let mut socket = Socket::connect(line["address"].as_str().unwrap());
    running.line("RUN: scanning");
    let write = |at: u16| [&[16][..], &at.to_be_bytes(), &[0, 2, 4, 0, 1, 0, 2]].concat();
    assert_eq!(socket.ask(1, &write(4000))[0], 16);
    assert_eq!(socket.ask(1, &[2, 7, 0xd0, 0, 1]), [2, 1, 1], "the Stage");
    // The new files insert a Stage before `Fill`, move D0 to a new address, list D0 for other
    // clients, and remove unit 1.
    let lists = "[[modbus-server.write]]\nranges = [\"D0\"]\nclients = [\"10.0.0.0/8\"]\n";
    let after = format!("ladder = [\"ladder.toml\"]\n{server}units = [2]\n{lists}");
    let after = after + &entry("D0", "holding", 5000) + &entry("Side.Fill", "discrete", 2000);
    std::fs::write(plant.0.join("controller.toml"), after).unwrap();
    let first = "[[program.stage]]\nname = \"Wait\"\n[[program.stage.rung]]\nwhen = [\"C0\"]\n\
                 do = [\"JMP Fill\"]\n";
    std::fs::write(plant.0.join("ladder.toml"), ladder(first)).unwrap();
    running.signal("HUP");
    running.line("reloaded");
    assert_eq!(socket.ask(1, &[3, 0x13, 0x88, 0, 2]), [0x83, 11]);
    assert_eq!(socket.ask(2, &[3, 0x0f, 0xa0, 0, 2]), [0x83, 2]);
    assert_eq!(socket.ask(2, &[3, 0x13, 0x88, 0, 2]), [3, 4, 0, 1, 0, 2], "D0 was kept");
    assert_eq!(socket.ask(2, &write(5000)), [0x90, 2]);
    assert_eq!(socket.ask(2, &[2, 7, 0xd0, 0, 1]), [2, 1, 1], "the same Stage, elsewhere");
    running.stop();
}
