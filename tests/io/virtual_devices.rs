//! Devices in virtual time against a foreign peer: the driver exchanges random maps with pymodbus
//! over TCP, and in a rig with a ladder that has the same registers. Inputs, outputs and failures
//! are the same. `RUNGD_VIRTUAL_MAPS` is the number of maps.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use rungd_base::random::SplitMix64;
use rungd_base::scan_period::ScanPeriod;
use rungd_config::controller::Controller;
use rungd_config::controller::device::DriverSettings;
use rungd_config::load::{self, OpenTexts};
use rungd_engine::Cell;
use rungd_engine::isa::{
    Address, Bit, BitSpace, DeviceBit, DeviceId, MemorySizes, Word, WordSpace, address_text,
};
use rungd_io::device::{Driver, Exchange, ExchangeReason};
use rungd_io::modbus_client::settings::{ClientSettings, LinkSettings, TcpLink};
use rungd_io::modbus_client::{ModbusClient, TcpConnection};
use rungd_lab::rig::{DeviceProgram, Rig, RigProgram, RigSetup, SimulatedDevice};
use rungd_language::resolve::program::Program;
use rungd_test_support::needs::{usable, works};

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/modbus_peers/remote_io.py");
/// The elements of each of the peer's tables. The controller writes the upper half.
const COUNT: u32 = 100;
const HALF: u32 = 50;
/// The input register that shows that the peer has obeyed.
const OBEYED: u32 = 98;

/// A register or coil of the device, and its value.
struct DeviceValue {
    table: &'static str,
    at: u32,
    value: u32,
}

/// A random map: its rows, what the device has, and what the controller has.
#[derive(Default)]
struct RandomMap {
    rows: Vec<String>,
    inputs: Vec<String>,
    device: Vec<DeviceValue>,
    outputs: Vec<(String, i32)>,
    settings: String,
}

fn one_of<'t>(random: &mut SplitMix64, all: &[&'t str]) -> &'t str {
    all[(random.next() % all.len() as u64) as usize]
}

fn below(random: &mut SplitMix64, count: u32) -> u32 {
    (random.next() % u64::from(count)) as u32
}

impl RandomMap {
    fn draw(random: &mut SplitMix64) -> RandomMap {
        let mut map = RandomMap::default();
        let writes = one_of(random, &["single", "multiple", "fitting"]);
        let (gap, most) = (below(random, 20), 2 + below(random, 40));
        map.settings = format!("writes = \"{writes}\"\ngap = {gap}\nmax-registers = {most}\n");
        for number in 0..1 + below(random, 8) {
            map.input(number, random);
        }
        let mut at = HALF;
        for number in 0..below(random, 8) {
            at = map.output(number, at + below(random, 3), random);
        }
        map
    }

    fn have(&mut self, table: &'static str, at: u32, value: u32) {
        self.device.push(DeviceValue { table, at, value });
    }

    fn input(&mut self, number: u32, random: &mut SplitMix64) {
        // Now and then an element that the device does not have.
        let at = if below(random, 20) == 0 { COUNT + 20 } else { below(random, HALF - 1) };
        let words = one_of(random, &["holding", "input"]);
        let (mut any, is_there) = (|| (random.next() >> 40) as u32 & 0xffff, at < COUNT);
        let (first, second) = (any(), any());
        let (row, target) = match below(random, 6) {
            0 => {
                let bits = one_of(random, &["discrete", "coil"]);
                self.device.extend(is_there.then_some(DeviceValue {
                    table: bits,
                    at,
                    value: first & 1,
                }));
                (format!("from = \"{bits} {at}\""), format!("C{number}"))
            }
            1 => (format!("from = \"{words} {at}.{}\"", first % 16), format!("C{number}")),
            2 | 3 => {
                let kind = one_of(random, &["u16", "i16"]);
                let scale = one_of(
                    random,
                    &["", ", multiply = 10, divide = 4, offset = 5", ", divide = 10"],
                );
                (format!("from = \"{words} {at}\", type = \"{kind}\"{scale}"), format!("D{number}"))
            }
            4 => {
                let kind = one_of(random, &["u32", "i32"]);
                let order = one_of(random, &["high-first", "low-first"]);
                let row = format!(
                    "from = \"{words} {at}..{}\", type = \"{kind}\", word-order = \"{order}\"",
                    at + 1
                );
                (row, format!("D{number}"))
            }
            _ => {
                let order = one_of(random, &["high-first", "low-first"]);
                let row = format!(
                    "from = \"{words} {at}..{}\", type = \"f32\", word-order = \"{order}\"",
                    at + 1
                );
                (row, format!("R{number}"))
            }
        };
        if !row.contains("discrete") && !row.contains("coil") && is_there {
            self.have(words, at, first);
            self.have(words, at + 1, second);
        }
        self.rows.push(format!("{{ {row}, to = \"{target}\" }}"));
        self.inputs.push(target);
    }

    /// Adds an output from `at` on; returns the first free element.
    fn output(&mut self, number: u32, at: u32, random: &mut SplitMix64) -> u32 {
        if at + 2 > COUNT {
            return at;
        }
        let value = (random.next() >> 33) as i32;
        // A number in two registers is not written by two requests.
        let kinds = if self.settings.contains("single") { 3 } else { 4 };
        let (source, to, width, value) = match below(random, kinds) {
            0 => (format!("C{}", 100 + number), format!("\"coil {at}\""), 1, value & 1),
            1 => (format!("D{}", 100 + number), format!("\"holding {at}\""), 1, value & 0xffff),
            2 => {
                let scale = ", type = \"i16\", multiply = 10, divide = 4, offset = 5";
                (format!("D{}", 100 + number), format!("\"holding {at}\"{scale}"), 1, value % 1000)
            }
            _ => {
                let order = one_of(random, &["high-first", "low-first"]);
                let to = format!(
                    "\"holding {at}..{}\", type = \"i32\", word-order = \"{order}\"",
                    at + 1
                );
                (format!("D{}", 100 + number), to, 2, value)
            }
        };
        self.rows.push(format!("{{ from = \"{source}\", to = {to} }}"));
        self.outputs.push((source, value));
        at + width
    }

    fn controller(&self, port: &str) -> String {
        controller(port, &self.settings, &self.rows.join(",\n"))
    }
}

fn controller(port: &str, settings: &str, rows: &str) -> String {
    format!(
        "ladder = [\"main.toml\"]\n[[device]]\nname = \"peer\"\ndriver = \"modbus-tcp\"\n\
         address = \"127.0.0.1:{port}\"\nunit = 1\npoll = \"10ms\"\ntimeout = \"5s\"\n{settings}\
         map = [\n{rows}\n]\n"
    )
}

const LADDER: &str = "[ladder]\ndevices = [\"peer\"]\nallow = [\"never-written\"]\n[[program]]\n\
     name = \"Main\"\nrung = [{ when = [\"$Off\"], do = [\"OUT C900\"] }]\n";

fn loaded(controller: &str) -> (Program, Arc<Controller>) {
    let path = PathBuf::from("/virtual/controller.toml");
    let texts = [(path.clone(), controller), (PathBuf::from("/virtual/main.toml"), LADDER)];
    let texts = OpenTexts::new(texts.map(|(path, text)| (path, Arc::from(text))));
    let loaded = load::controller_among(&path, &texts).expect("readable");
    let findings = format!("{:#?}\n{controller}", loaded.findings);
    (loaded.program.expect(&findings), Arc::new(loaded.controller.expect(&findings)))
}

fn client(controller: &Controller) -> &ClientSettings {
    match &controller.devices[0].driver {
        DriverSettings::Modbus(settings) => settings,
        _ => unreachable!("it is on Modbus"),
    }
}

fn over_tcp(settings: &ClientSettings) -> ModbusClient<TcpConnection> {
    let LinkSettings::Tcp(link @ TcpLink { .. }) = settings.link else { unreachable!("by TCP") };
    let timeout = Duration::from_millis(settings.timeout_ms.into());
    ModbusClient::new(settings, TcpConnection::new(link, settings.habits, timeout))
}

/// The peer, in a process of its own.
struct Peer {
    child: Child,
    reader: ModbusClient<TcpConnection>,
    settings: ClientSettings,
    obeyed: u32,
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Peer {
    async fn start(port: &str) -> Peer {
        let mut command = Command::new("python3");
        command.args([SCRIPT, "tcp", port, "1"]);
        let command = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        let rows = format!(
            "{{ from = \"holding {HALF}..{}\", to = \"D0..D{}\", type = \"u16\" }},\n\
             {{ from = \"coil {HALF}..{}\", to = \"C0..C{}\" }},\n\
             {{ from = \"input {OBEYED}\", to = \"D200\", type = \"u16\" }}",
            COUNT - 1,
            HALF - 1,
            COUNT - 1,
            HALF - 1,
        );
        let (_, controller) = loaded(&controller(port, "", &rows));
        let settings = client(&controller).clone();
        let (child, reader) = (command.spawn().expect("python3"), over_tcp(&settings));
        let mut peer = Peer { child, reader, settings, obeyed: 0 };
        while peer.reader.connect().await.is_err() {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        peer
    }

    /// Sets the values of the device, and 0 in all that a controller may write.
    async fn set(&mut self, values: &[DeviceValue]) {
        let mut text = String::new();
        for at in HALF..COUNT {
            text += &format!("1 holding {at} 0\n1 coil {at} 0\n");
        }
        for DeviceValue { table, at, value } in values {
            text += &format!("1 {table} {at} {value}\n");
        }
        self.obeyed = self.obeyed % 60_000 + 1;
        text += &format!("1 input {OBEYED} {}\n", self.obeyed);
        let stdin = self.child.stdin.as_mut().expect("a pipe");
        stdin.write_all(text.as_bytes()).expect("the peer reads");
        while self.written().await.last() != Some(&Some(self.obeyed as i32)) {}
    }

    /// The upper halves of its holding registers and coils; behind them the register `OBEYED`.
    async fn written(&mut self) -> Vec<Option<i32>> {
        let mut inputs = vec![None; self.settings.inputs.len()];
        let (occasion, is_urgent) = (ExchangeReason::First, &|| false);
        let exchange = Exchange { occasion, outputs: &[], inputs: &mut inputs, is_urgent };
        self.reader.exchange(exchange).await.expect("the peer answers");
        inputs
    }
}

/// What an exchange of everything has brought.
#[derive(Debug, PartialEq)]
struct Brought {
    is_well: bool,
    inputs: Vec<i32>,
    written: Vec<i32>,
}

async fn by_tcp(map: &RandomMap, controller: &Controller, peer: &mut Peer) -> Brought {
    let settings = client(controller);
    let mut client = over_tcp(settings);
    client.connect().await.expect("a connection");
    let mut inputs = vec![None; settings.inputs.len()];
    let outputs: Vec<i32> = map.outputs.iter().map(|(_, value)| *value).collect();
    let mut is_well = true;
    for occasion in [ExchangeReason::First, ExchangeReason::Poll] {
        let (inputs, is_urgent) = (&mut inputs, &|| false);
        let exchange = Exchange { occasion, outputs: &outputs, inputs, is_urgent };
        is_well = client.exchange(exchange).await.is_ok();
    }
    client.disconnect();
    let mut written = peer.written().await;
    written.pop();
    let numbers = |all: Vec<Option<i32>>| all.into_iter().map(Option::unwrap_or_default).collect();
    Brought { is_well, inputs: numbers(inputs), written: numbers(written) }
}

/// A ladder without rungs, whose memory has the peer's size.
fn device_ladder() -> Arc<DeviceProgram> {
    let path = Path::new("/virtual/device.toml").to_owned();
    let text = "[[program]]\nname = \"Main\"\n";
    let texts = OpenTexts::new([(path.clone(), Arc::from(text))]);
    let mut program =
        load::ladders_among(&[path], &texts).expect("readable").program.expect("a program");
    let (mc, mi, mhr, mir) = (COUNT, COUNT, COUNT, COUNT);
    program.sizes = MemorySizes { mc, mi, mhr, mir, ..program.sizes };
    Arc::new(DeviceProgram::new(&program, ScanPeriod::DEFAULT))
}

fn register(table: &str, at: u32) -> Address {
    match table {
        "coil" => Address::Bit(Bit::Space(BitSpace::Mc, at + 1)),
        "discrete" => Address::Bit(Bit::Space(BitSpace::Mi, at + 1)),
        "holding" => Address::Word(Word::Space(WordSpace::Mhr, at + 1)),
        _ => Address::Word(Word::Space(WordSpace::Mir, at + 1)),
    }
}

fn in_virtual_time(map: &RandomMap, ladder: &Arc<DeviceProgram>, port: &str) -> Brought {
    let (program, controller) = loaded(&map.controller(port));
    let id = DeviceId(0);
    let devices = [SimulatedDevice { id, program: Arc::clone(ladder) }];
    let lowered = Arc::new(RigProgram::new(&program, &controller).with_devices(&devices));
    let layout = &lowered.symbols.layout;
    let cell = |name: &str| {
        let address = address_text::parse(name, layout.sizes()).expect("an address");
        layout.cell(address).expect("a cell")
    };
    let own = |table: &str, at: u32| -> Cell {
        ladder.ladder.symbols.layout.cell(register(table, at)).expect("a cell")
    };
    let values = map.device.iter();
    let setup = RigSetup {
        devices: values.map(|one| (id, own(one.table, one.at), one.value as i32)).collect(),
        set: map.outputs.iter().map(|(name, value)| (cell(name), *value)).collect(),
        ..RigSetup::default()
    };
    let mut rig = Rig::new(&lowered, &setup);
    for _ in 0..4 {
        rig.scan();
        rig.end_scan(false);
    }
    let ok = layout.bit(Bit::Device(id, DeviceBit::Ok));
    let written = (HALF..COUNT).map(|at| rig.device_value(id, own("holding", at)));
    let coils = (HALF..COUNT).map(|at| rig.device_value(id, own("coil", at)));
    Brought {
        is_well: rig.image().bit(ok),
        inputs: map.inputs.iter().map(|name| rig.image().value(cell(name))).collect(),
        written: written.chain(coils).collect(),
    }
}

#[test]
fn a_device_in_virtual_time_is_as_a_pymodbus_server_with_its_registers() {
    let mut probe = Command::new("python3");
    if !usable(works("pymodbus (tcp)", probe.args([SCRIPT, "probe", "tcp"]))) {
        return;
    }
    let maps = std::env::var("RUNGD_VIRTUAL_MAPS").ok().and_then(|text| text.parse().ok());
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port().to_string();
    drop(listener);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let ladder = device_ladder();
    runtime.block_on(async {
        let mut peer = Peer::start(&port).await;
        let mut random = SplitMix64(20);
        let (mut failed, mut outputs) = (0, 0);
        for number in 0..maps.unwrap_or(40) {
            let map = RandomMap::draw(&mut random);
            let text = map.controller(&port);
            peer.set(&map.device).await;
            let (_, controller) = loaded(&text);
            let by_tcp = by_tcp(&map, &controller, &mut peer).await;
            let here = in_virtual_time(&map, &ladder, &port);
            assert_eq!(here, by_tcp, "map {number}:\n{text}");
            failed += u32::from(!here.is_well);
            outputs += here.written.iter().filter(|value| **value != 0).count();
        }
        assert!(failed >= 3 && outputs >= 20, "{failed} maps fail, {outputs} outputs");
    });
}
