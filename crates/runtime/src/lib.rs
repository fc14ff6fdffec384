//! The scan thread, the monitor thread, and the exchange of data with other threads.
//!
//! [`prepare`] puts the scan thread and the monitor thread together and requests the real-time
//! posture from the machine; [`PreparedThreads::start`] lets the first scan begin. Drivers hold a
//! [`exchange::Port`]; the log is an [`Observer`]. Deliberately absent: tokio, files and names.
//! [`say!`](say::say) writes the lines of [`events`]; the scan thread never calls it.
//!
//! The idea: only one thread owns the engine. Its data leave through rings and arrive through rings
//! and atomics, so no other thread can make it wait.

mod alarm_delays;
mod beat;
pub mod command;
mod earlier;
pub mod events;
pub mod exchange;
pub mod field;
mod forces;
mod gate;
mod histogram;
mod hold;
pub mod hold_step;
mod image;
pub mod inputs;
mod latest;
mod link;
#[cfg(test)]
mod link_tests;
pub mod local;
mod machine;
mod mode;
mod monitor;
mod obey;
mod origin;
pub mod pacing;
mod posture;
mod publication;
mod record;
pub mod say;
mod scan_loop;
mod scanner;
#[cfg(test)]
mod scanner_tests;
mod statistics;
mod swap;
mod sys;
mod tape;
mod tape_reader;
mod tape_section;
mod unwired;
mod waiting;
pub mod wall;
pub mod wiring;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

pub use alarm_delays::{AlarmChange, AlarmDelay, AlarmDelays, ScanTime};
pub use histogram::HistogramBucket;
pub use image::SafeState;
pub use link::{ExchangeShape, ScanFacts, link};
pub use link::{ScanSide, WorldSide};
pub use machine::{ImageCells, ScanStart, ScannedMachine};
pub use monitor::{Monitor, Observer};
pub use origin::Origin;
pub use posture::NotGranted;
pub use posture::{Grant, HeldResources};
pub use posture::{Policy, Posture};
pub use record::{CarriedWatches, DeviceEdge, RecordEvent, ScanRecord, WatchedCells};
pub use scanner::Report;
pub use scanner::{Scanner, ScannerSettings};
pub use statistics::Statistics;
pub use statistics::{MeterReading, RunMeter, Spread};
pub use swap::{Generations, Swapped};
pub use swap::{Package, PackageParts, Reloader};
pub use sys::boottime_ns;
pub use sys::monotonic_ns;
pub use sys::return_freed_memory;
pub use tape::{TapeEntry, Taped};
pub use tape_reader::{TapeReader, tape, tape_of};
pub use tape_section::{SectionStart, TapeSection, TapeStep, runs_behind, tape_steps};
pub use unwired::UnwiredInputs;

use beat::{Beat, Life};
use exchange::Port;
use field::DeviceEnds;
use pacing::{Clock, MachineClock};
use rungd_engine::Layout;
use rungd_engine::isa::status::st;
use rungd_engine::isa::{Bit, BitSpace};
use wiring::Wiring;

/// The settings of the two threads at the start.
#[derive(Clone, Debug)]
pub struct ThreadSettings {
    /// Period, watchdog, number of scans, reports.
    pub pace: ScannerSettings,
    /// Sizes of memory, and the safe values.
    pub memory: PublicMemory,
    /// The cells whose changes the log reports.
    pub watched: WatchedCells,
    /// The requested posture.
    pub posture: Posture,
    /// The field devices, by number.
    pub field: Vec<Wiring>,
}

/// The public part of memory, and the places of inputs and outputs in it.
#[derive(Clone, Debug)]
pub struct PublicMemory {
    /// The number of X.
    pub inputs: u32,
    /// Public bits; they come first in the image.
    pub bits: usize,
    /// Public words; they come first in the image as well.
    pub words: usize,
    /// The cell of Y0; Y1 and so on follow it.
    pub first_output: usize,
    /// The cell of `$ForcesActive`.
    pub forces_active: usize,
    /// The safe state of each Y, outside RUN.
    pub safe: Vec<SafeState>,
}

impl PublicMemory {
    /// The memory of a program with this layout.
    pub fn new(layout: &Layout, safe: Vec<SafeState>) -> PublicMemory {
        PublicMemory {
            inputs: layout.sizes().x,
            bits: layout.bit_count() as usize,
            words: layout.word_count() as usize,
            first_output: layout.bit(Bit::Space(BitSpace::Y, 0)).0 as usize,
            forces_active: layout.bit(Bit::Space(BitSpace::St, st::FORCES_ACTIVE)).0 as usize,
            safe,
        }
    }
}

/// The scan thread and the monitor, ready to start; the scan thread waits and has its posture.
pub struct PreparedThreads {
    grants: Vec<Grant>,
    go: Sender<()>,
    scan: JoinHandle<Report>,
    monitor: Box<dyn FnOnce() -> io::Result<JoinHandle<()>>>,
    port: Port,
    beat: Arc<Beat>,
    gauge: ThreadGauge,
    held: HeldResources,
    lines: Vec<DeviceEnds>,
}

/// The state of the two threads for observers, beside the images. Cheap to clone.
#[derive(Clone, Debug)]
pub struct ThreadGauge {
    /// The statistics since the start of RUN.
    pub meter: RunMeter,
    records_dropped: Arc<AtomicU64>,
}

impl ThreadGauge {
    /// The records that were dropped since the process started.
    pub fn records_dropped(&self) -> u64 {
        self.records_dropped.load(Ordering::Relaxed)
    }
}

/// The state of the two threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ThreadState {
    /// Both live; or the scan thread is lost, and the monitor has reported a fault.
    Running,
    /// The scan thread has ended as it should, and all its messages were handed on.
    Over,
    /// The monitor has ended (a bug): images do not change any more.
    Blind,
}

/// The running controller.
pub struct Runtime {
    port: Port,
    beat: Arc<Beat>,
    scan: JoinHandle<Report>,
    monitor: JoinHandle<()>,
    _held: HeldResources,
}

/// Puts a scanner, a monitor and a port together on a clock, without threads: for tests.
pub fn assemble<M: ScannedMachine, C: Clock, O: Observer>(
    machine: M,
    clock: C,
    settings: &ThreadSettings,
    observer: O,
) -> (Scanner<M, C>, Monitor<O>, Port) {
    let whole = assemble_whole(machine, clock, settings, observer);
    (whole.scanner, whole.monitor, whole.port)
}

/// Does the same as [`assemble`]; returns a [`Reloader`] too, to swap programs.
pub fn assemble_reloadable<M: ScannedMachine, C: Clock, O: Observer>(
    machine: M,
    clock: C,
    settings: &ThreadSettings,
    observer: O,
) -> (Scanner<M, C>, Monitor<O>, Port, Reloader<M>) {
    let whole = assemble_whole(machine, clock, settings, observer);
    (whole.scanner, whole.monitor, whole.port, whole.reloader)
}

/// The parts that [`assemble_whole`] puts together.
pub struct RuntimeParts<M, C, O> {
    /// The scan thread's.
    pub scanner: Scanner<M, C>,
    /// The monitor thread's.
    pub monitor: Monitor<O>,
    /// For drivers.
    pub port: Port,
    /// To swap programs.
    pub reloader: Reloader<M>,
    /// The field devices' ends, by number.
    pub lines: Vec<DeviceEnds>,
}

/// Does the same as [`assemble`]; returns a [`Reloader`] and the ends of the field devices too.
pub fn assemble_whole<M: ScannedMachine, C: Clock, O: Observer>(
    machine: M,
    clock: C,
    settings: &ThreadSettings,
    observer: O,
) -> RuntimeParts<M, C, O> {
    let memory = &settings.memory;
    let ImageCells { bits, words } = machine.image();
    let (port, side, world) = link(ExchangeShape {
        inputs: memory.inputs,
        bits: bits[..memory.bits].to_vec(),
        words: words[..memory.words].to_vec(),
        first_output: memory.first_output,
        forces_active: memory.forces_active,
        safe: memory.safe.clone(),
    });
    port.set_tempo(settings.pace.tempo);
    let (journal, reader) = record::journal();
    let beat = Arc::new(Beat::default());
    let now_ns = clock.now_ns();
    let (field, lines) =
        field::field(&settings.field, memory.safe.clone(), memory.first_output, now_ns);
    let rescues = lines.iter().filter_map(|ends| Some(ends.local.as_ref()?.rescue())).collect();
    let monitor = Monitor {
        world,
        journal: reader,
        beat: Arc::clone(&beat),
        port: port.clone(),
        observer,
        dropped: 0,
        lost: false,
        looked_ns: 0,
        grace: monitor::Grace::default(),
        rescues,
    };
    let (pace, watched) = (settings.pace.clone(), settings.watched.clone());
    let (reloader, swaps) = swap::swaps(port.clone());
    let parts =
        scanner::ScannerParts { machine, clock, side, journal, beat, pace, watched, swaps, field };
    RuntimeParts { scanner: Scanner::new(parts), monitor, port, reloader, lines }
}

/// Starts the scan thread up to the point at which its first scan could begin. Returns a
/// [`Reloader`] too, to swap programs.
///
/// # Errors
/// The machine cannot start a thread.
pub fn prepare<M, O>(
    machine: M,
    clock: MachineClock,
    settings: &ThreadSettings,
    observer: O,
) -> io::Result<(PreparedThreads, Reloader<M>)>
where
    M: ScannedMachine + Send + 'static,
    O: Observer + 'static,
{
    let (held, mut grants) = settings.posture.apply_to_process();
    let whole = assemble_whole(machine, clock, settings, observer);
    let RuntimeParts { scanner, monitor, port, reloader, lines } = whole;
    let beat = Arc::clone(&monitor.beat);
    let records_dropped = Arc::clone(&monitor.journal.dropped);
    let gauge = ThreadGauge { meter: scanner.meter(), records_dropped };
    let (go, gone) = channel();
    let (tell, told) = channel();
    let posture = settings.posture.clone();
    let life = Arc::clone(&beat);
    let scan = thread::Builder::new().name("rungd-scan".into()).spawn(move || {
        let _ = tell.send(posture.apply_to_scan_thread());
        run_scanner(scanner, &gone, &life)
    })?;
    grants.extend(told.recv().unwrap_or_default());
    let monitor = Box::new(move || {
        let named = thread::Builder::new().name("rungd-monitor".into());
        named.spawn(move || run_monitor(monitor))
    });
    Ok((PreparedThreads { grants, go, scan, monitor, port, beat, gauge, held, lines }, reloader))
}

impl PreparedThreads {
    /// The requested posture, and the machine's answers.
    pub fn grants(&self) -> &[Grant] {
        &self.grants
    }

    /// The state for observers.
    pub fn gauge(&self) -> ThreadGauge {
        self.gauge.clone()
    }

    /// The port, for drivers; nothing is scanned yet.
    pub fn port(&self) -> Port {
        self.port.clone()
    }

    /// The field devices' ends, by number; handed out once.
    pub fn lines(&mut self) -> Vec<DeviceEnds> {
        std::mem::take(&mut self.lines)
    }

    /// Lets the first scan begin. (A `PreparedThreads` that is dropped instead ends its thread.)
    ///
    /// # Errors
    /// The machine cannot start a thread.
    pub fn start(self) -> io::Result<Runtime> {
        let PreparedThreads { go, scan, monitor, port, beat, held, .. } = self;
        let monitor = monitor()?;
        let _ = go.send(());
        Ok(Runtime { port, beat, scan, monitor, _held: held })
    }
}

impl Runtime {
    /// The port, for drivers.
    pub fn port(&self) -> Port {
        self.port.clone()
    }

    /// Requests the orderly stop; returns at once.
    pub fn request_stop(&self) {
        self.beat.request_stop();
    }

    /// Complete scans, and ticks in STOP and FAULT, so far: it grows while the thread is alive.
    pub fn pulses(&self) -> u64 {
        self.beat.pulses()
    }

    /// Whether both threads still work.
    pub fn state(&self) -> ThreadState {
        match (self.monitor.is_finished(), self.beat.life()) {
            (false, _) => ThreadState::Running,
            (true, Life::Ended) => ThreadState::Over,
            (true, _) => ThreadState::Blind,
        }
    }

    /// The scan thread's report, after [`ThreadState::Over`].
    pub fn join(self) -> Option<Report> {
        let _ = self.monitor.join();
        self.scan.join().ok()
    }
}

/// Reports the scan thread's end, also after a panic.
struct EndReport<'a>(&'a Beat);

impl Drop for EndReport<'_> {
    fn drop(&mut self) {
        self.0.set_life(if thread::panicking() { Life::Lost } else { Life::Ended });
    }
}

fn run_scanner<M: ScannedMachine, C: Clock>(
    mut scanner: Scanner<M, C>,
    go: &Receiver<()>,
    beat: &Beat,
) -> Report {
    let _ending = EndReport(beat);
    if go.recv().is_ok() {
        scanner.start();
        while scanner.step() {}
    }
    scanner.report()
}

fn run_monitor<O: Observer>(mut monitor: Monitor<O>) {
    while monitor.turn(monotonic_ns()) {
        thread::sleep(monitor.rest(monotonic_ns()));
    }
}
