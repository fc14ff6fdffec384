//! The own side of a field device: a ladder whose memory is the device's registers and coils.
//!
//! Made for `field`, for a device that a test describes. Its holding register 0 is MHR1 of the
//! ladder, its input register 0 MIR1, its coil 0 MC1, its discrete input 0 MI1: the standard map of
//! the Modbus server, which answers here without a socket. The ladder scans in virtual time, at its
//! own period, whether or not it is reached; what is written is in memory at once.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;

use rungd_base::scan_period::ScanPeriod;
use rungd_config::controller::simulated_side::SimulatedSide;
use rungd_engine::isa::{Address, Bit, BitSpace, DeviceId, MemorySizes, Word, WordSpace};
use rungd_io::ladder::{LadderMachine, LadderProgram};
use rungd_io::modbus::ModbusMap;
use rungd_io::modbus::answer::{AnsweredRequest, RequestDecision, answer, refused, written};
use rungd_io::modbus::map::RequestSource;
use rungd_io::modbus::settings::{ModbusServerSettings, WriteList};
use rungd_io::modbus_client::RegisterPeer;
use rungd_language::resolve::operands::Operands;
use rungd_language::resolve::program::Program;
use rungd_language::source::span::Span;
use rungd_runtime::ScannedMachine;
use rungd_runtime::exchange::{Mode, Snapshot};

/// A ladder that is a device's own side, lowered once.
#[derive(Debug)]
pub struct DeviceProgram {
    /// The ladder.
    pub ladder: Arc<LadderProgram>,
    map: ModbusMap,
}

impl DeviceProgram {
    /// Lowers a ladder that has no errors; `period`: its scan period.
    pub fn new(program: &Program, period: ScanPeriod) -> DeviceProgram {
        let ladder = LadderProgram::new(program, period);
        let settings = server(&program.sizes);
        let symbols = &ladder.symbols;
        let map = ModbusMap::new(&settings, &symbols.layout, |word| symbols.limits(word));
        DeviceProgram { ladder: Arc::new(ladder), map }
    }
}

/// A field device whose own side is a ladder.
#[derive(Clone, Debug)]
pub struct SimulatedDevice {
    /// The device.
    pub id: DeviceId,
    /// Its ladder.
    pub program: Arc<DeviceProgram>,
}

impl SimulatedDevice {
    /// The own side of a device of a controller file, lowered.
    pub fn of(side: &SimulatedSide) -> SimulatedDevice {
        let program = DeviceProgram::new(&side.program, side.period);
        SimulatedDevice { id: side.device, program: Arc::new(program) }
    }
}

/// A server with the standard map, in which all coils and holding registers can be written.
fn server(sizes: &MemorySizes) -> ModbusServerSettings {
    let all = |first, count, name: &str| Operands {
        first,
        count,
        text: name.to_owned(),
        is_placed: false,
        span: Span::default(),
    };
    let coils = all(Address::Bit(Bit::Space(BitSpace::Mc, 1)), sizes.mc, "MC");
    let registers = all(Address::Word(Word::Space(WordSpace::Mhr, 1)), sizes.mhr, "MHR");
    let ranges = [coils, registers].into_iter().filter(|range| range.count > 0).collect();
    ModbusServerSettings {
        listen: SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 0),
        units: None,
        standard_map: true,
        entries: Vec::new(),
        lists: vec![WriteList { ranges, clients: None }],
        inputs: None,
        outputs: None,
        connections: 1,
        frame_timeout_ms: 0,
        idle_timeout_ms: 0,
    }
}

/// The own side of a device, in virtual time.
pub(super) struct DeviceLadder {
    program: Arc<DeviceProgram>,
    machine: LadderMachine,
    /// Memory as the server shows it.
    shown: Snapshot,
}

impl DeviceLadder {
    /// A device that is switched on at virtual time 0.
    pub fn new(program: &Arc<DeviceProgram>) -> DeviceLadder {
        let machine = LadderMachine::new(&program.ladder);
        let image = machine.image();
        let shown = Snapshot {
            generation: 0,
            scans: 0,
            now_ns: 0,
            mode: Mode::Run,
            since_ns: 0,
            ending: false,
            bits: image.bits().into(),
            words: image.words().into(),
            outputs: Box::default(),
            tickets_done: 0,
            forces: Default::default(),
            safe: Arc::new([]),
        };
        DeviceLadder { program: Arc::clone(program), machine, shown }
    }

    /// Its ladder.
    pub fn machine(&mut self) -> &mut LadderMachine {
        &mut self.machine
    }

    /// Its ladder, to be read.
    pub fn machine_now(&self) -> &LadderMachine {
        &self.machine
    }

    fn show(&mut self) {
        let image = self.machine.image();
        self.shown.bits.copy_from_slice(image.bits());
        self.shown.words.copy_from_slice(image.words());
    }
}

impl RegisterPeer for DeviceLadder {
    fn answer(&mut self, now_ns: u64, request: &[u8], reply: &mut Vec<u8>) {
        self.machine.scan_up_to(now_ns, |_| {});
        self.show();
        let (program, unit) = (Arc::clone(&self.program), 1);
        let asker = RequestSource { unit, client: IpAddr::V4(Ipv4Addr::LOCALHOST) };
        *reply = match answer(&program.map, asker, request, &self.shown) {
            RequestDecision::Reply(reply) => reply,
            RequestDecision::Refused(_, refusal) => refused(request, refusal),
            RequestDecision::Write(asked, batch) => {
                let engine = self.machine.engine();
                batch.iter().for_each(|write| engine.write_operand(write));
                self.show();
                let answered = AnsweredRequest { pdu: request, request: &asked };
                written(&program.map, unit, answered, &self.shown)
                    .unwrap_or_else(|refusal| refused(request, refusal))
            }
        };
    }
}
