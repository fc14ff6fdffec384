//! Numbers of 64 bits between a real controller and a Modbus device, in all orders of words and
//! bytes: into an integer of 32 bits, a real, and two words; and the same out. One controller and
//! one device exchange all combinations at once. The expected bytes are made here, from the letters
//! of manuals; the expected limits are also compared with MATH.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Instant;

use crate::io::habit_peer::HabitPeer;
use rungd_test_support::page;
use rungd_test_support::patience::PATIENCE;
use rungd_test_support::running::live::Live;

/// An order of the bytes of a number in four registers.
#[derive(Clone, Copy)]
struct RegisterOrder<'k> {
    /// The keys of a row that say it.
    keys: &'k str,
    /// The bytes, the most significant of the number as `A`.
    letters: &'k [u8; 8],
}

/// The orders: the keys of a row, and the letters of the manual; A is the highest byte.
const ORDERS: [RegisterOrder; 4] = [
    RegisterOrder { keys: "", letters: b"ABCDEFGH" },
    RegisterOrder { keys: ", word-order = \"low-first\"", letters: b"GHEFCDAB" },
    RegisterOrder { keys: ", byte-order = \"low-first\"", letters: b"BADCFEHG" },
    RegisterOrder {
        keys: ", word-order = \"low-first\", byte-order = \"low-first\"",
        letters: b"HGFEDCBA",
    },
];

/// The registers of these bits in an order.
fn registers(bits: u64, letters: &[u8; 8]) -> [u16; 4] {
    let highest_first = bits.to_be_bytes();
    let byte = |at: usize| u16::from(highest_first[usize::from(letters[at] - b'A')]);
    [0, 2, 4, 6].map(|at| byte(at) << 8 | byte(at + 1))
}

/// A number that the device has, and what memory makes of it.
struct Given {
    kind: &'static str,
    bits: u64,
    /// In a D, in an R.
    integer: i32,
    real: f32,
    /// Whether MATH has the same number in 64 bits with a sign.
    is_in_math: bool,
}

fn given() -> Vec<Given> {
    let unsigned = |value: u64, integer| Given {
        kind: "u64",
        bits: value,
        integer,
        real: value as f32,
        is_in_math: i64::try_from(value).is_ok(),
    };
    let signed = |value: i64, integer| Given {
        kind: "i64",
        bits: value.cast_unsigned(),
        integer,
        real: value as f32,
        is_in_math: true,
    };
    let binary64 = |value: f64, integer, real| Given {
        kind: "f64",
        bits: value.to_bits(),
        integer,
        real,
        is_in_math: false,
    };
    vec![
        unsigned(0x0102_0304_0506_0708, i32::MAX),
        unsigned(1_234_567_890, 1_234_567_890),
        unsigned(u64::MAX, i32::MAX),
        signed(-5_000_000_000, i32::MIN),
        signed(-2, -2),
        signed(i64::MAX, i32::MAX),
        binary64(-2.5, -3, -2.5),
        binary64(1e300, i32::MAX, f32::MAX),
        binary64(0.1, 0, 0.1),
    ]
}

/// A value of memory that goes out, and the bits that the device gets for each type.
struct Sent {
    /// The tag with the value.
    tag: &'static str,
    from: &'static str,
    bits: [(&'static str, u64); 3],
}

fn sent() -> [Sent; 4] {
    let bits = |unsigned: u64, signed: i64, real: f64| {
        [("u64", unsigned), ("i64", signed.cast_unsigned()), ("f64", real.to_bits())]
    };
    let least = f64::from(-1e30_f32);
    [
        Sent {
            tag: "d = { at = \"D1000\", initial = -70000 }",
            from: "D1000",
            bits: bits(0, -70_000, -70_000.0),
        },
        Sent {
            tag: "e = { at = \"D1001\", initial = 2147483647 }",
            from: "D1001",
            bits: bits(2_147_483_647, 2_147_483_647, 2_147_483_647.0),
        },
        Sent { tag: "r = { at = \"R100\", initial = 2.5 }", from: "R100", bits: bits(3, 3, 2.5) },
        Sent {
            tag: "s = { at = \"R101\", initial = -1e30 }",
            from: "R101",
            bits: bits(0, i64::MIN, least),
        },
    ]
}

/// Two words with the halves of a number.
const HALVES: (i32, i32) = (-2, 0x1234_5678);

/// The first register that is written.
const WRITTEN: u16 = 2000;

/// The page's expression that joins the halves of a number, in D0 and D1.
fn joined() -> String {
    let page = page::text("modbus-devices.md");
    let (_, behind) = page.split_once("`MATH kwh = (").expect("the expression");
    behind.split_once(") / 1000`").expect("its end").0.to_owned()
}

/// The files of the controller, and what is expected of them.
#[derive(Default)]
struct Plan {
    map: String,
    rungs: String,
    held: BTreeMap<u16, u16>,
    written: BTreeMap<u16, u16>,
    /// The operands to read, each with its value.
    operands: Vec<String>,
    expected: Vec<String>,
}

impl Plan {
    fn expect(&mut self, operand: String, value: impl ToString) {
        self.operands.push(operand);
        self.expected.push(value.to_string());
    }

    fn read(&mut self, number: usize, one: &Given, order: RegisterOrder) {
        let RegisterOrder { keys, letters } = order;
        let Given { kind, bits, integer, real, is_in_math } = *one;
        let first = number * 4;
        let from = format!("from = \"input {first}..{}\", type = \"{kind}\"{keys}", first + 3);
        for (at, register) in (first as u16..).zip(registers(bits, letters)) {
            self.held.insert(at, register);
        }
        let (high, low) = (300 + 2 * number, 301 + 2 * number);
        writeln!(self.map, "{{ {from}, to = \"D{number}\" }},").unwrap();
        writeln!(self.map, "{{ {from}, to = \"R{number}\" }},").unwrap();
        self.expect(format!("D{number}"), integer);
        self.expect(format!("R{number}"), format!("{real:?}"));
        if kind == "f64" {
            return;
        }
        writeln!(self.map, "{{ {from}, to = \"D{high}..D{low}\", split = true }},").unwrap();
        self.expect(format!("D{high}"), (bits >> 32) as i32);
        self.expect(format!("D{low}"), bits as i32);
        if is_in_math {
            let joined = joined().replace("D0", &format!("D{high}"));
            let joined = joined.replace("D1 ", &format!("D{low} "));
            let rung =
                format!("{{ when = [\"$On\"], do = [\"MATH D{} = {joined}\"] }},", 600 + number);
            writeln!(self.rungs, "{rung}").unwrap();
            self.expect(format!("D{}", 600 + number), integer);
        }
    }

    fn write(&mut self, from: &str, kind: &str, bits: u64, order: RegisterOrder) {
        let RegisterOrder { keys, letters } = order;
        let first = WRITTEN + self.written.len() as u16;
        let row = format!("from = \"{from}\", to = \"holding {first}..{}\"", first + 3);
        writeln!(self.map, "{{ {row}, type = \"{kind}\"{keys}, hold = true }},").unwrap();
        self.written.extend((first..).zip(registers(bits, letters)));
    }

    fn new() -> Plan {
        let mut plan = Plan::default();
        for order in ORDERS {
            for one in given() {
                plan.read(plan.held.len() / 4, &one, order);
            }
            for Sent { from, bits, .. } in sent() {
                bits.into_iter().for_each(|(kind, bits)| plan.write(from, kind, bits, order));
            }
            let (high, low) = (u64::from(HALVES.0 as u32), u64::from(HALVES.1 as u32));
            let keys = format!(", split = true{}", order.keys);
            let split = RegisterOrder { keys: &keys, ..order };
            for kind in ["u64", "i64"] {
                plan.write("D1002..D1003", kind, high << 32 | low, split);
            }
        }
        plan
    }
}

#[test]
fn numbers_of_64_bits_are_read_and_written_in_all_word_orders() {
    let plan = Plan::new();
    let (address, seen) = HabitPeer::default().start();
    seen.lock().unwrap().registers.clone_from(&plan.held);
    let tags: Vec<&str> = sent().iter().map(|sent| sent.tag).collect();
    let (high, low) = HALVES;
    let ladder = format!(
        "[ladder]\ndevices = [\"meter\"]\n[tags]\n{}\n\
         high = {{ at = \"D1002\", initial = {high} }}\nlow = {{ at = \"D1003\", initial = {low} }}\n\
         [[program]]\nname = \"Main\"\nrung = [\n{}]\n",
        tags.join("\n"),
        plan.rungs
    );
    let device = format!(
        "[[device]]\nname = \"meter\"\ndriver = \"modbus-tcp\"\n\
         address = \"{address}\"\ntimeout = \"5s\"\nloss-after = \"60s\"\nmap = [\n{}]\n",
        plan.map
    );
    let live = Live::start(&ladder, &device, &[]);
    live.await_values("meter.Ok", "ON");
    let deadline = Instant::now() + PATIENCE;
    // MATH has its result with the scan behind the inputs'.
    loop {
        let read = live.ok(&format!("read {}", plan.operands.join(" ")));
        let values: Vec<&str> =
            read.lines().map(|line| line.split_whitespace().nth(2).unwrap_or_default()).collect();
        let all = plan.operands.iter().zip(values.into_iter().zip(&plan.expected));
        let wrong: Vec<_> = all.filter(|(_, (value, expected))| value != expected).collect();
        if read.lines().count() == plan.expected.len() && wrong.is_empty() {
            break;
        }
        assert!(Instant::now() < deadline, "{wrong:#?}");
    }
    loop {
        let written = seen.lock().unwrap().registers.clone();
        let written: BTreeMap<u16, u16> =
            written.into_iter().filter(|of| of.0 >= WRITTEN).collect();
        if written == plan.written {
            break;
        }
        assert!(Instant::now() < deadline, "{written:#?}, not {:#?}", plan.written);
    }
}
