//! Every address with every function and its edge quantities, compared with the oracle.
//!
//! The sweep runs in the test's process, with the map of `tests/io/oracle/controller.toml`. Each
//! request is handled as in a connection, and its batch is applied to an image. The reply and all
//! of memory must match the oracle. `modbus_live.rs` sends a part of the requests to the real
//! program.
//!
//! CI tests all addresses near an edge and some of the others. This command tests all of them and
//! prints figures: `cargo test --release --test controller io::modbus_sweep -- --ignored --nocapture`.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::path::Path;
use std::time::Instant;

use crate::io::oracle::requests::{Random, at_address};
use crate::io::oracle::{Client, Oracle};
use rungd_config::load;
use rungd_engine::isa::{Bit, BitSpace};
use rungd_engine::{Cell, Layout};
use rungd_io::modbus::ModbusMap;
use rungd_io::modbus::answer::{AnsweredRequest, RequestDecision, answer, refused, written};
use rungd_io::modbus::map::RequestSource;
use rungd_language::lower::lower;
use rungd_runtime::command::Forces;
use rungd_runtime::exchange::{Mode, OperandWrite, Snapshot};

/// The addresses at which a table begins, ends, or changes its contents.
const EDGES: [u32; 24] = [
    0, 9, 19, 32, 40, 99, 114, 1000, 1023, 2000, 2024, 2047, 2058, 4000, 4027, 4046, 5000, 5046,
    9000, 9002, 30_000, 30_012, 32_768, 65_535,
];

/// The distance from an edge within which CI tests every address.
const NEAR: u32 = 12;

struct Sweep {
    map: ModbusMap,
    layout: Layout,
    oracle: Oracle,
    /// The engine's cells, in the order of the oracle's cells.
    cells: Vec<Cell>,
    image: Snapshot,
    /// The expected contents of all of memory.
    bits: Box<[u8]>,
    words: Box<[i32]>,
    /// The count of each outcome (0 or the exception) of each function.
    seen: BTreeMap<(u8, u8), u64>,
    random: u64,
}

impl Sweep {
    fn new() -> Sweep {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/io/oracle/controller.toml");
        let loaded = load::controller_file(&file).unwrap();
        assert!(loaded.findings.is_empty(), "{:#?}", loaded.findings);
        let (program, settings) = (loaded.program.unwrap(), loaded.controller.unwrap());
        let symbols = lower(&program).1;
        let layout = symbols.layout.clone();
        let map = ModbusMap::new(&settings.modbus.unwrap(), &layout, |word| symbols.limits(word));
        let mut oracle = Oracle::new();
        let cell = |name: &str| layout.cell(program.scope().address(name).unwrap()).unwrap();
        let cells: Vec<Cell> = oracle.cells.iter().map(|of| cell(&of.name)).collect();
        let mut image = empty(&layout);
        // Cells have different values, so that a wrong cell is noticed.
        for (at, (of, cell)) in oracle.cells.iter_mut().zip(&cells).enumerate() {
            let span = of.max - of.min + 1;
            of.value = of.min + (at as i64 * 7919 + at as i64 / 3).rem_euclid(span);
            set(&mut image, *cell, of.value);
        }
        let first = layout.bit(Bit::Space(BitSpace::Y, 0)).0 as usize;
        let outputs = image.outputs.len();
        image.outputs.copy_from_slice(&image.bits[first..first + outputs]);
        let (bits, words) = (image.bits.clone(), image.words.clone());
        let seen = BTreeMap::new();
        Sweep { map, layout, oracle, cells, image, bits, words, seen, random: 1 }
    }

    /// Sends a request to the map and to the oracle, and compares the results.
    fn ask(&mut self, unit: u8, client: Client, pdu: &[u8]) {
        let (expected, changes) = self.oracle.answer(unit, client, pdu);
        let address = match client {
            Client::Loopback => IpAddr::from([127, 0, 0, 1]),
            Client::Ten => IpAddr::from([10, 1, 2, 3]),
            Client::TenNine => "::ffff:10.9.2.3".parse().unwrap(),
        };
        let asker = RequestSource { unit, client: address };
        let reply = match answer(&self.map, asker, pdu, &self.image) {
            RequestDecision::Reply(reply) => reply,
            RequestDecision::Refused(_, refusal) => refused(pdu, refusal),
            RequestDecision::Write(request, batch) => {
                self.apply(&batch);
                for (cell, value) in &changes {
                    self.oracle.cells[*cell].value = *value;
                    match self.cells[*cell] {
                        Cell::Bit(bit) => self.bits[bit.0 as usize] = *value as u8,
                        Cell::Word(word) => self.words[word.0 as usize] = *value as i32,
                        Cell::WordBit(bit) => {
                            let held = &mut self.words[bit.word.0 as usize];
                            *held = bit.put(*held, *value != 0);
                        }
                    }
                }
                let same = self.image.bits == self.bits && self.image.words == self.words;
                assert!(same, "unit {unit} {client:?} {pdu:?}: another cell changed: {batch:?}");
                let request = AnsweredRequest { pdu, request: &request };
                written(&self.map, unit, request, &self.image).unwrap()
            }
        };
        assert_eq!(reply, expected, "unit {unit} {client:?} {pdu:?}");
        let outcome = if reply[0] & 0x80 == 0 { 0 } else { reply[1] };
        *self.seen.entry((pdu[0], outcome)).or_default() += 1;
    }

    /// Applies a batch as the scan does.
    fn apply(&mut self, batch: &[OperandWrite]) {
        for write in batch {
            match *write {
                OperandWrite::Bit(cell, on) => set(&mut self.image, Cell::Bit(cell), on.into()),
                OperandWrite::Word(cell, value) => {
                    set(&mut self.image, Cell::Word(cell), value.into())
                }
                OperandWrite::WordBit(bit, on) => {
                    set(&mut self.image, Cell::WordBit(bit), on.into())
                }
                OperandWrite::Masked { cell, mask, signed } => {
                    let value = mask.apply(self.image.word(cell), signed);
                    set(&mut self.image, Cell::Word(cell), value.into());
                }
                OperandWrite::Input(x, on) => {
                    let cell = Cell::Bit(self.layout.bit(Bit::Space(BitSpace::X, x)));
                    set(&mut self.image, cell, on.into());
                }
            }
        }
    }

    /// Sends every function at an address, with its edge quantities.
    fn address(&mut self, at: u16, unit: u8, client: Client) {
        let mut random = Random(self.random);
        at_address(at, &mut random, |pdu| self.ask(unit, client, pdu));
        self.random = random.0;
    }

    fn report(&self, began: Instant) {
        let total: u64 = self.seen.values().sum();
        println!("{total} requests in {:.1} s", began.elapsed().as_secs_f64());
        println!("function  done  exception 1  2  3  11");
        for function in [1, 2, 3, 4, 5, 6, 15, 16, 22, 23, 7] {
            let count = |outcome| self.seen.get(&(function, outcome)).copied().unwrap_or(0);
            println!("{function:8} {:?}", [0, 1, 2, 3, 11].map(count));
        }
    }
}

fn empty(layout: &Layout) -> Snapshot {
    Snapshot {
        generation: 0,
        scans: 1,
        now_ns: 0,
        mode: Mode::Run,
        since_ns: 0,
        ending: false,
        bits: vec![0; layout.bit_count() as usize].into(),
        words: vec![0; layout.word_count() as usize].into(),
        outputs: vec![0; layout.sizes().y as usize].into(),
        tickets_done: 0,
        forces: Forces::default(),
        safe: [].into(),
    }
}

fn set(image: &mut Snapshot, cell: Cell, value: i64) {
    match cell {
        Cell::Bit(bit) => image.bits[bit.0 as usize] = value as u8,
        Cell::Word(word) => image.words[word.0 as usize] = value as i32,
        Cell::WordBit(bit) => {
            let held = &mut image.words[bit.word.0 as usize];
            *held = bit.put(*held, value != 0);
        }
    }
}

const ASKERS: [(u8, Client); 5] = [
    (1, Client::Loopback),
    (2, Client::Loopback),
    (1, Client::Ten),
    (2, Client::TenNine),
    (3, Client::Loopback),
];

/// Sends unknown functions, and requests of every length.
fn forms(sweep: &mut Sweep) {
    for function in (0..=255).filter(|f| ![1, 2, 3, 4, 5, 6, 15, 16, 22, 23].contains(f)) {
        sweep.ask(1, Client::Loopback, &[function]);
        sweep.ask(1, Client::Loopback, &[function, 0, 0, 0, 1]);
    }
    for function in [1, 2, 3, 4, 5, 6, 15, 16, 22, 23] {
        for length in 1..=253 {
            let mut pdu = vec![0; length];
            pdu[0] = function;
            sweep.ask(1, Client::Loopback, &pdu);
            pdu.iter_mut().skip(2).step_by(2).for_each(|byte| *byte = 1);
            sweep.ask(1, Client::Loopback, &pdu);
        }
    }
}

#[test]
fn every_reply_near_the_limits_matches_an_independent_implementation() {
    let (mut sweep, began) = (Sweep::new(), Instant::now());
    forms(&mut sweep);
    for at in 0..=u16::MAX {
        let near = EDGES.iter().any(|edge| edge.abs_diff(at.into()) <= NEAR);
        if near || at % 509 == 0 {
            for (unit, client) in ASKERS {
                sweep.address(at, unit, client);
            }
        }
    }
    sweep.report(began);
    for function in [1, 2, 3, 4, 5, 6, 15, 16, 22, 23] {
        for outcome in [0, 2, 3, 11] {
            assert!(sweep.seen.contains_key(&(function, outcome)), "{function}: {outcome}");
        }
    }
}

#[test]
#[ignore = "minutes; run with --release"]
fn every_reply_to_every_address_matches_an_independent_implementation() {
    let (mut sweep, began) = (Sweep::new(), Instant::now());
    forms(&mut sweep);
    for (unit, client) in ASKERS {
        for at in 0..=u16::MAX {
            sweep.address(at, unit, client);
        }
    }
    sweep.report(began);
}
