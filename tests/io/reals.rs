//! Reals over Modbus, with the real program at both ends: R words in the server's map as f32 in
//! both word orders, and a field device's registers that are scaled into R words and out of them.

use std::path::Path;

use rungd_config::load;
use rungd_engine::isa::Real;
use rungd_test_support::bench::Plant;
use rungd_test_support::modbus::Client;
use rungd_test_support::running::live::Live;

const REMOTE: &str = r#"
[tags]
level = { at = "R1", min = -5.5, max = 99.5 }
[[program]]
name = "Main"
rung = [ { when = ["$On"], do = ["MOVE R0 to=R2", "MOVE level to=R3", "MOVE MHR1 to=MIR1"] } ]
"#;

const MAPS: &str = r#"
[modbus-server]
listen = "127.0.0.1:0"
writable = ["R0..R1", "MHR1"]
[[modbus-server.map]]
operand = "R0"
table   = "holding"
address = 4000
[[modbus-server.map]]
operand    = "level"
table      = "holding"
address    = 4002
word-order = "low-first"
[[modbus-server.map]]
operand = "R2"
table   = "input"
address = 4000
type    = "f32"
[[modbus-server.map]]
operand    = "R3"
table      = "input"
address    = 4002
word-order = "low-first"
"#;

/// A controller with R words in its map, and the address of its server.
fn remote() -> (Live, String) {
    let live = Live::start(REMOTE, MAPS, &[]);
    let status = live.say("status --json").json();
    let address = status["devices"]["modbus"]["address"].as_str().expect("a server").to_owned();
    (live, address)
}

/// Function 16 for two registers.
fn write(at: u16, registers: [u16; 2]) -> Vec<u8> {
    let [first, second] = registers.map(u16::to_be_bytes);
    [&[16], &at.to_be_bytes()[..], &[0, 2, 4], &first, &second].concat()
}

fn high_first(number: f32) -> [u16; 2] {
    [(number.to_bits() >> 16) as u16, number.to_bits() as u16]
}

fn low_first(number: f32) -> [u16; 2] {
    let [high, low] = high_first(number);
    [low, high]
}

/// The two registers at an address, by function 3.
fn read(client: &mut Client, at: u16) -> [u16; 2] {
    let [high, low] = at.to_be_bytes();
    let reply = client.ask(1, &[3, high, low, 0, 2]);
    assert_eq!(reply[..2], [3, 4], "{reply:?}");
    [u16::from_be_bytes([reply[2], reply[3]]), u16::from_be_bytes([reply[4], reply[5]])]
}

#[test]
fn a_server_reads_and_writes_reals_as_f32_in_both_word_orders() {
    let (live, address) = remote();
    let mut client = Client::connect(&address);
    for (number, text) in
        [(12.5, "12.5"), (-0.1, "-0.1"), (1e-45, "1e-45"), (f32::MAX, "3.4028235e38"), (0.0, "0.0")]
    {
        assert_eq!(client.ask(1, &write(4000, high_first(number))), [16, 0x0f, 0xa0, 0, 2]);
        assert_eq!(live.ok("read R0"), format!("R0  R0  {text}\n"));
        assert_eq!(read(&mut client, 4000), high_first(number), "{number}");
    }
    assert_eq!(high_first(12.5), [0x4148, 0], "the control");
    assert_eq!(client.ask(1, &write(4002, low_first(98.25)))[0], 16);
    assert_eq!(live.ok("read level"), "level  R1  98.25\n");
    assert_eq!(read(&mut client, 4002), [0x8000, 0x42c4]);
    live.await_values("R3", "98.25");
    assert_eq!(client.ask(1, &[4, 0x0f, 0xa2, 0, 2]), [4, 4, 0x80, 0, 0x42, 0xc4]);
}

#[test]
fn a_server_refuses_numbers_that_no_real_holds_with_a_reason() {
    let (live, address) = remote();
    let mut client = Client::connect(&address);
    assert_eq!(client.ask(1, &write(4000, high_first(2.5)))[0], 16);
    for (number, words) in
        [(f32::NAN, "not NaN"), (f32::INFINITY, "not inf"), (f32::NEG_INFINITY, "not -inf")]
    {
        assert_eq!(client.ask(1, &write(4000, high_first(number))), [0x90, 3], "{number}");
        let line = live.line("refused");
        assert!(line["message"].as_str().unwrap().contains(words), "{line}");
    }
    for number in [99.6, -5.6] {
        assert_eq!(client.ask(1, &write(4002, low_first(number))), [0x90, 3], "{number}");
    }
    assert_eq!(client.ask(1, &[6, 0x0f, 0xa0, 0x41, 0x48]), [0x86, 2], "half of a real");
    assert_eq!(client.ask(1, &[3, 0x0f, 0xa0, 0, 1])[0], 3, "which can be read");
    assert_eq!(live.ok("read R0 level"), "R0     R0  2.5\nlevel  R1  0.0\n");
    assert_eq!(client.ask(1, &write(4000, high_first(-0.0)))[0], 16);
    assert_eq!(read(&mut client, 4000), [0, 0], "-0 becomes 0");
}

const LADDER: &str = r#"
[ladder]
devices = ["line1"]
[[program]]
name = "Main"
rung = [ { when = ["$On"], do = ["MOVE 12.5 to=R10", "MOVE 40.25 to=R11", "MOVE -3.5 to=R12"] } ]
"#;

const MAP: &str = r#"
map = [
  { from = "R10", to = "holding 4000..4001", type = "f32" },
  { from = "R11", to = "holding 4002..4003", type = "f32", word-order = "low-first", divide = 2, offset = -5 },
  { from = "R12", to = "holding 0", type = "i16", divide = 100 },
  { from = "input 4000..4001", to = "R0", type = "f32" },
  { from = "input 4002..4003", to = "R1", type = "f32", word-order = "low-first" },
  { from = "input 4002..4003", to = "R2", type = "f32", word-order = "low-first", divide = 2, offset = -5 },
  { from = "input 0", to = "R3", type = "i16", divide = 100 },
  { from = "input 0", to = "D3", type = "i16" },
]
"#;

#[test]
fn the_map_of_a_device_scales_into_reals_and_back() {
    let (far, address) = remote();
    let device = format!(
        "[[device]]\nname = \"line1\"\ndriver = \"modbus-tcp\"\naddress = \"{address}\"\n{MAP}"
    );
    let live = Live::start(LADDER, &device, &[]);
    // Outgoing, (40.25 + 5) * 2 is 90.5, and -3.5 * 100 is -350; incoming values are scaled in
    // reverse.
    far.await_values("R0 level MHR1", "12.5 90.5 65186");
    live.await_values("R0 R1 R2 R3 D3", "12.5 90.5 40.25 -3.5 -350");
    live.ok("force R10 -0.1");
    live.await_values("R0", "-0.1");
    live.ok("force R12 3e38");
    live.await_values("R3 D3", "327.67 32767");
}

const PLANT: &str = r#"
[[device]]
name   = "line1"
driver = "simulated"
poll   = "5ms"
map = [
  { from = "R10", to = "tank.fill", divide = 10 },
  { from = "tank.level", to = "R0", divide = 10, offset = -1 },
  { from = "tank.level", to = "R1" },
  { from = "tank.level", to = "D0", multiply = 2, offset = 5 },
  { from = "scale.value", to = "R3", multiply = -1, divide = 4 },
]
[[device.part]]
name      = "tank"
kind      = "tank"
capacity  = 55
fill-rate = 1000
[[device.part]]
name  = "scale"
kind  = "sensor"
of    = "tank.level"
range = [0, 55]
raw   = [6400, 32000]
"#;

#[test]
fn the_map_of_a_simulated_plant_scales_like_that_of_a_device() {
    let ladder = LADDER.replace("MOVE 12.5 to=R10", "MOVE 100 to=R10");
    let live = Live::start(&ladder, PLANT, &[]);
    live.await_values("R0 R1 D0 R3", "4.5 55.0 115 -8000.0");
}

/// The plant of a ladder and a controller file, in virtual time.
fn in_virtual_time(name: &str, ladder: &str, controller: &str) -> Plant {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("io-reals").join(name);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("ladder.toml"), ladder).unwrap();
    let text = format!("ladder = [\"ladder.toml\"]\n{controller}");
    std::fs::write(folder.join("controller.toml"), text).unwrap();
    Plant::of(load::controller_file(&folder.join("controller.toml")).unwrap())
}

#[test]
fn a_command_of_a_simulated_plant_is_rounded_to_the_nearest_step() {
    // Openings in percent: 0.04 % rounds to no thousandth; 0.05 % and 0.06 % round to one, which
    // fills 10 in 10 s.
    for (percent, filled) in [("0.04", 0), ("0.05", 10), ("0.06", 10), ("1", 100), ("-0.04", 0)] {
        let ladder = LADDER.replace("MOVE 12.5 to=R10", &format!("MOVE {percent} to=R10"));
        let large = PLANT.replace("capacity  = 55", "capacity  = 100000");
        let mut plant = in_virtual_time(percent, &ladder, &large);
        plant.until(10_020, |_| {});
        let level = (plant.value("D0") - 5) / 2;
        assert!((filled - 1..=filled + 1).contains(&level), "{percent} %: {level}");
        let real = Real::of_cell(plant.value("R0")).number();
        assert_eq!(real, (f64::from(level) / 10.0 - 1.0) as f32, "{percent} %");
    }
}
