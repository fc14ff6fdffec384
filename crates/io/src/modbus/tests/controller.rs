//! The test bench: a controller with a small scan of its own, a server on it, and a raw TCP client.

use std::io::{ErrorKind, Read, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::super::{BoundModbusServer, ModbusMap};
use super::{any_client, loopback, range};
use crate::modbus::settings::ModbusServerSettings;
use rungd_engine::Layout;
use rungd_engine::isa::{Bit, BitSpace, MemorySizes, Space, Word, WordSpace};
use rungd_runtime::command::Forces;
use rungd_runtime::exchange::{FaultReason, Mode, OperandWrite, Port, StopReason};
use rungd_runtime::{
    ExchangeShape, ImageCells, SafeState, ScanFacts, ScanSide, UnwiredInputs, WorldSide, link,
};

/// An order of a test to the scan thread.
#[derive(Clone, Copy)]
pub enum Do {
    Run,
    Stop,
    Fault,
    /// The mode is RUN, but no scan begins.
    Freeze,
}

/// The controller: its scan thread and the server's thread.
///
/// A scan writes the low word of its number to every MIR. It copies X0 to Y0 and MC1 to MI1, and
/// switches Y1 ON. `torn` counts the scans that saw different values in MHR1..MHR100, or X0..X3
/// different from MC101..MC104.
pub struct Controller {
    pub port: Port,
    pub address: SocketAddr,
    pub layout: Layout,
    pub torn: Arc<AtomicU64>,
    log: LogBuffer,
    commands: Sender<Do>,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

/// The write list has MC1..MC32 and MHR1..MHR123. A tag limits MHR110 to 1..=100. MC101..MC104 are
/// copied to X0..X3, and Y0..Y3 to MI11..MI14.
pub fn settings() -> ModbusServerSettings {
    let [mc, x, y, mi] = [BitSpace::Mc, BitSpace::X, BitSpace::Y, BitSpace::Mi].map(Space::Bit);
    ModbusServerSettings {
        lists: vec![any_client(&["MC1..MC32", "MHR1..MHR123"])],
        inputs: Some((range(mc, 101, 104), range(x, 0, 3))),
        outputs: Some((range(y, 0, 3), range(mi, 11, 14))),
        ..loopback()
    }
}

impl Controller {
    pub fn start(settings: ModbusServerSettings, period: Duration) -> Controller {
        let layout = Layout::new(&MemorySizes::default(), 0, 0);
        let mut safe = vec![SafeState::Off; layout.sizes().y as usize];
        safe[2] = SafeState::On;
        let (port, scan, world) = link(ExchangeShape {
            inputs: layout.sizes().x,
            bits: vec![0; layout.bit_count() as usize],
            words: vec![0; layout.word_count() as usize],
            first_output: layout.bit(Bit::Space(BitSpace::Y, 0)).0 as usize,
            forces_active: layout.bit(Bit::Space(BitSpace::St, 9)).0 as usize,
            safe,
        });
        let stop = Arc::new(AtomicBool::new(false));
        let torn = Arc::new(AtomicU64::new(0));
        let (commands, orders) = channel();
        let log = LogBuffer::default();
        let server = LoggedServer { settings, log: log.clone() };
        let (address, serving) = server.serve(&layout, &port, &stop);
        let scanner = Scanner {
            scan,
            world,
            layout: layout.clone(),
            period,
            orders,
            stop: Arc::clone(&stop),
            torn: Arc::clone(&torn),
        };
        let threads = vec![serving, thread::spawn(move || scanner.scan())];
        let controller = Controller { port, address, layout, torn, log, commands, stop, threads };
        controller.order(Do::Run);
        controller
    }

    /// Sends the order to the scan thread, and waits until it has taken effect.
    pub fn order(&self, order: Do) {
        let before = self.port.latest().scans;
        self.commands.send(order).unwrap();
        let there = || match (order, self.port.latest().mode) {
            (Do::Run, Mode::Run) => self.port.latest().scans > before,
            (Do::Freeze, mode) => mode == Mode::Run,
            (Do::Stop, mode) => matches!(mode, Mode::Stop(_)),
            (Do::Fault, mode) => matches!(mode, Mode::Fault(_)),
            (Do::Run, _) => false,
        };
        while !there() {
            thread::sleep(Duration::from_millis(1));
        }
        if let Do::Freeze = order {
            // The current scan still ends; after it, the number of scans does not change.
            let mut scans = u64::MAX;
            while std::mem::replace(&mut scans, self.port.latest().scans) != scans {
                thread::sleep(Duration::from_millis(50));
            }
        }
    }

    pub fn client(&self) -> RawClient {
        RawClient::connect(self.address)
    }

    /// All log lines of the server so far.
    pub fn logged(&self) -> String {
        String::from_utf8_lossy(&self.log.0.lock().unwrap()).into_owned()
    }

    pub fn bit(&self, space: BitSpace, n: u32) -> bool {
        self.port.latest().bit(self.layout.bit(Bit::Space(space, n)))
    }

    pub fn register(&self, n: u32) -> i32 {
        self.port.latest().word(self.layout.word(Word::Space(WordSpace::Mhr, n)))
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            if let Err(panic) = thread.join()
                && !thread::panicking()
            {
                std::panic::resume_unwind(panic);
            }
        }
    }
}

/// The buffer that receives the server's log.
#[derive(Clone, Default)]
struct LogBuffer(Arc<Mutex<Vec<u8>>>);

impl std::io::Write for LogBuffer {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// A server to start, whose log is kept.
struct LoggedServer {
    settings: ModbusServerSettings,
    log: LogBuffer,
}

impl LoggedServer {
    /// Serves on a thread of its own, until `stop` is set.
    fn serve(
        self,
        layout: &Layout,
        port: &Port,
        stop: &Arc<AtomicBool>,
    ) -> (SocketAddr, JoinHandle<()>) {
        let LoggedServer { settings, log } = self;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let limits = |word: Word| {
            if word == Word::Space(WordSpace::Mhr, 110) { (1, 100) } else { word.range() }
        };
        let map = ModbusMap::new(&settings, layout, limits);
        let bound = BoundModbusServer::bind(
            settings,
            rungd_runtime::Generations::new(map),
            port.clone(),
            Duration::ZERO,
        );
        let server = runtime.block_on(bound).unwrap();
        let address = server.address().unwrap();
        let stop = Arc::clone(stop);
        let stopped = async move {
            while !stop.load(Ordering::Relaxed) {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        let writer = move || log.clone();
        let logger = tracing_subscriber::fmt().with_ansi(false).with_writer(writer).finish();
        let serving = thread::spawn(move || {
            let _logging = tracing::subscriber::set_default(logger);
            // As in the daemon, the server is one task among others.
            runtime.block_on(async { tokio::spawn(server.run(stopped)).await.unwrap() });
        });
        (address, serving)
    }
}

struct Scanner {
    scan: ScanSide,
    world: WorldSide,
    layout: Layout,
    period: Duration,
    orders: Receiver<Do>,
    stop: Arc<AtomicBool>,
    torn: Arc<AtomicU64>,
}

impl Scanner {
    fn scan(mut self) {
        let mut bits = vec![0; self.layout.bit_count() as usize];
        let mut words = vec![0; self.layout.word_count() as usize];
        let mut mode = Mode::Stop(StopReason::NotStarted);
        let (mut frozen, mut number) = (false, 0);
        while !self.stop.load(Ordering::Relaxed) {
            if let Ok(order) = self.orders.try_recv() {
                frozen = matches!(order, Do::Freeze);
                mode = match order {
                    Do::Run | Do::Freeze => Mode::Run,
                    Do::Stop => Mode::Stop(StopReason::Instruction),
                    Do::Fault => Mode::Fault(FaultReason::EnginePanic),
                };
                self.scan.set_running(mode == Mode::Run);
                if mode != Mode::Run {
                    self.scan.refuse_waiting();
                    self.publish(number, mode, ImageCells { bits: &bits, words: &words });
                }
            }
            if mode == Mode::Run && !frozen {
                number += 1;
                self.one_scan(number, &mut bits, &mut words);
            }
            self.world.pump();
            thread::sleep(self.period);
        }
    }

    fn one_scan(&mut self, number: u64, bits: &mut [u8], words: &mut [i32]) {
        let layout = self.layout.clone();
        let input = |x| layout.bit(Bit::Space(BitSpace::X, x)).0 as usize;
        for (x, on) in self.scan.inputs(&[]).flat_map(UnwiredInputs::each) {
            bits[input(x)] = u8::from(on);
        }
        while let Some((_, writes)) = self.scan.next_batch(usize::MAX) {
            for write in writes {
                match *write {
                    OperandWrite::Bit(cell, on) => bits[cell.0 as usize] = u8::from(on),
                    OperandWrite::Word(cell, value) => words[cell.0 as usize] = value,
                    OperandWrite::WordBit(bit, on) => {
                        let word = &mut words[bit.word.0 as usize];
                        *word = bit.put(*word, on);
                    }
                    OperandWrite::Masked { cell, mask, signed } => {
                        let word = &mut words[cell.0 as usize];
                        *word = mask.apply(*word, signed);
                    }
                    OperandWrite::Input(x, on) => bits[input(x)] = u8::from(on),
                }
            }
        }
        self.program(number, bits, words);
        self.scan.answer(true);
        self.publish(number, Mode::Run, ImageCells { bits, words });
    }

    fn publish(&mut self, scans: u64, mode: Mode, image: ImageCells<'_>) {
        let forces = &Forces::default();
        self.scan.publish(
            ScanFacts { scans, now_ns: scans, mode, since_ns: 0, ending: false, forces },
            image,
        );
    }

    fn program(&self, number: u64, bits: &mut [u8], words: &mut [i32]) {
        let bit = |space, n| self.layout.bit(Bit::Space(space, n)).0 as usize;
        let word = |space, n| self.layout.word(Word::Space(space, n)).0 as usize;
        for n in 1..=self.layout.sizes().mir {
            words[word(WordSpace::Mir, n)] = i32::from(number as u16);
        }
        let inputs = bit(BitSpace::X, 0);
        bits[bit(BitSpace::Y, 0)] = bits[inputs];
        bits[bit(BitSpace::Y, 1)] = 1;
        bits[bit(BitSpace::Mi, 1)] = bits[bit(BitSpace::Mc, 1)];
        let written = word(WordSpace::Mhr, 1);
        let alike = words[written..written + 100].iter().all(|value| *value == words[written]);
        let coils = bit(BitSpace::Mc, 101);
        let same = bits[inputs..inputs + 4] == bits[coils..coils + 4];
        self.torn.fetch_add(u64::from(!alike || !same), Ordering::Relaxed);
    }
}

/// A raw TCP client.
pub struct RawClient {
    pub stream: TcpStream,
    pub unit: u8,
    transaction: u16,
}

impl RawClient {
    pub fn connect(address: SocketAddr) -> RawClient {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        stream.set_nodelay(true).unwrap();
        RawClient { stream, unit: 17, transaction: 0 }
    }

    /// A frame around a PDU, with a new transaction number.
    pub fn frame(&mut self, pdu: &[u8]) -> Vec<u8> {
        self.transaction = self.transaction.wrapping_add(1);
        let [high, low] = self.transaction.to_be_bytes();
        let length = (pdu.len() + 1) as u16;
        let [length_high, length_low] = length.to_be_bytes();
        [&[high, low, 0, 0, length_high, length_low, self.unit], pdu].concat()
    }

    /// Sends a PDU and returns its reply; the header must match.
    pub fn ask(&mut self, pdu: &[u8]) -> Vec<u8> {
        let frame = self.frame(pdu);
        self.stream.write_all(&frame).unwrap();
        let (transaction, reply) = self.next_reply().expect("a reply");
        assert_eq!(transaction, self.transaction);
        reply
    }

    /// Transaction and PDU of the next reply; `None` if the server closed the connection.
    pub fn next_reply(&mut self) -> Option<(u16, Vec<u8>)> {
        let mut header = [0; 7];
        self.stream.read_exact(&mut header).ok()?;
        let [high, low, 0, 0, length_high, length_low, unit] = header else {
            panic!("no header: {header:?}")
        };
        assert_eq!(unit, self.unit);
        let length = usize::from(u16::from_be_bytes([length_high, length_low]));
        let mut pdu = vec![0; length - 1];
        self.stream.read_exact(&mut pdu).ok()?;
        Some((u16::from_be_bytes([high, low]), pdu))
    }

    /// Waits until the server closes the connection, and discards all bytes that arrive before.
    pub fn is_closed(&mut self) -> bool {
        let mut bytes = [0; 1024];
        loop {
            match self.stream.read(&mut bytes) {
                Ok(0) => return true,
                Ok(_) => {}
                Err(error) => return error.kind() == ErrorKind::ConnectionReset,
            }
        }
    }
}
