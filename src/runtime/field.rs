//! How a scan and its field devices meet: whole images, and how old they are.
//!
//! Every device has an image of its inputs, filled beside the scan ([`Line`], held by a driver's
//! task) or within it ([`Local`], for lines that answer at once). Images pass
//! whole (`latest`), so that a scan sees all of one exchange or nothing of it. At the scan's input
//! step `Field` takes the newest, judges by the scan's own clock how old the last good exchange is,
//! and moves the inputs; a device whose task hangs or is gone goes stale just as one whose cable
//! is cut. Outputs leave by the published image ([`outgoing`]); those of a local device at the
//! output step.
//!
//! Nothing on the scan's side locks, allocates or frees: local devices that failed go back by a
//! ring.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::Memory;
use super::exchange::{Mode, Snapshot};
use super::image::Safe;
use super::latest::{Input, Reader, Writer, latest};
use super::local::LocalSide;
pub use super::local::{Exchanged, Local, LocalFailure, LocalLine};
use super::machine::Machine;
use super::record::{DeviceEdge, What};
use crate::engine::{BitCell, Cell, WordCell};

/// What moves when an input image comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// An input, by its number.
    Input(u32),
    /// A bit.
    Bit(BitCell),
    /// A word, and what it can hold.
    Word {
        /// Which.
        cell: WordCell,
        /// The least value; what is below becomes this.
        min: i32,
        /// The greatest.
        max: i32,
    },
}

/// What goes out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// An output, as driven: by its number.
    Output(u32),
    /// Anything else, with what it is outside RUN; `None`: as it is.
    Cell(Cell, Option<i32>),
}

/// A device, as the scan has to know it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wiring {
    /// One a point that comes in.
    pub inputs: Vec<Target>,
    /// One a point that goes out.
    pub outputs: Vec<Source>,
    /// The cell of its `.Ok`.
    pub ok: BitCell,
    /// The cell of its `.Stale`.
    pub stale: BitCell,
    /// A last good exchange that is older than this makes it stale.
    pub loss_after_ns: u64,
    /// Stale inputs are OFF and 0, instead of as read last.
    pub zero_on_loss: bool,
    /// Exchanged by the scan thread itself; so long may one exchange take. Later ones, several
    /// times running, are a failure.
    pub local_budget_ns: Option<u64>,
}

/// What both ends know of a device's exchanges.
#[derive(Default)]
pub(super) struct Pulse {
    /// When the last good one ended (CLOCK_MONOTONIC); 0: there was none.
    good_ns: AtomicU64,
    /// The last one failed.
    troubled: AtomicBool,
}

/// The world's end of a device: held by its driver's task.
pub struct Line {
    pulse: Arc<Pulse>,
    images: Writer,
    targets: Vec<Target>,
    /// As read last.
    known: Box<[Input]>,
}

/// Both ends of a device's exchange that the world holds.
pub struct Ends {
    /// To hand inputs in.
    pub line: Line,
    /// Of a local device: to hand the device itself in.
    pub local: Option<LocalLine>,
}

/// The scan's side: all devices.
pub(super) struct Field {
    devices: Vec<Device>,
    /// What each Y does outside RUN.
    safe: Vec<Safe>,
    /// The cell of Y0.
    first_output: usize,
}

struct Device {
    wiring: Wiring,
    pulse: Arc<Pulse>,
    images: Reader,
    local: Option<LocalSide>,
    /// When the field was made, from which a first exchange is awaited.
    start_ns: u64,
    /// There was a good exchange.
    has_exchanged: bool,
    state: State,
}

/// Since when a device is lost, if it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// No good exchange since the start.
    Awaited {
        since_ns: u64,
        told: bool,
    },
    Well,
    Lost {
        since_ns: u64,
        scans: u64,
    },
}

impl fmt::Debug for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Line of {} inputs", self.targets.len())
    }
}

/// Makes both sides for so many devices.
pub(super) fn field(wirings: &[Wiring], memory: &Memory, now_ns: u64) -> (Field, Vec<Ends>) {
    let (devices, ends) = wirings.iter().map(|wiring| device(wiring, now_ns)).unzip();
    let (safe, first_output) = (memory.safe.clone(), memory.first_output);
    (Field { devices, safe, first_output }, ends)
}

fn device(wiring: &Wiring, now_ns: u64) -> (Device, Ends) {
    let (image_in, images) = latest(wiring.inputs.len());
    let pulse = Arc::new(Pulse::default());
    let local = wiring.local_budget_ns.map(|budget_ns| super::local::local(wiring, budget_ns));
    let (local, local_line) = local.unzip();
    let device = Device {
        wiring: wiring.clone(),
        pulse: Arc::clone(&pulse),
        images,
        local,
        start_ns: now_ns,
        has_exchanged: false,
        state: State::Awaited { since_ns: now_ns, told: false },
    };
    let targets = wiring.inputs.clone();
    let known = vec![Input::default(); targets.len()].into();
    let line = Line { pulse, images: image_in, targets, known };
    (device, Ends { line, local: local_line })
}

impl Line {
    /// Hands on the inputs that an exchange has read, one a point; `None`: not read. These stay
    /// as they are and grow older.
    pub fn deliver(&mut self, inputs: &[Option<i32>], now_ns: u64) {
        let mut any = false;
        for ((known, target), read) in self.known.iter_mut().zip(&self.targets).zip(inputs) {
            if let Some(value) = read {
                // Never beyond what its cell holds.
                *known = Input { value: target.held(*value), read_ns: now_ns.max(1) };
                any = true;
            }
        }
        if any {
            self.images.write(&self.known);
        }
    }

    /// An exchange has succeeded in all; its inputs have been delivered.
    pub fn well(&mut self, now_ns: u64) {
        self.pulse.good_ns.store(now_ns.max(1), Ordering::Release);
        self.pulse.troubled.store(false, Ordering::Release);
    }

    /// An exchange has failed. Told before those of its inputs are delivered that it has read all
    /// the same, so that no scan takes a part for the whole.
    pub fn trouble(&self) {
        self.pulse.troubled.store(true, Ordering::Release);
    }
}

impl Target {
    fn receive<M: Machine>(&self, machine: &mut M, value: i32) {
        match *self {
            Target::Input(x) => machine.set_input(x, value != 0),
            Target::Bit(cell) => machine.write_bit(cell, value != 0),
            Target::Word { cell, .. } => machine.write_word(cell, value),
        }
    }

    fn held(&self, value: i32) -> i32 {
        match *self {
            Target::Input(_) | Target::Bit(_) => i32::from(value != 0),
            Target::Word { min, max, .. } => value.clamp(min, max),
        }
    }
}

/// What goes out now: in RUN the last complete scan's values, else the safe ones.
pub fn outgoing(sources: &[Source], image: &Snapshot, values: &mut [i32]) {
    let safe = image.mode != Mode::Run;
    for (value, source) in values.iter_mut().zip(sources) {
        *value = match *source {
            Source::Output(y) => i32::from(image.outputs[y as usize]),
            Source::Cell(_, Some(fixed)) if safe => fixed,
            Source::Cell(cell, _) => image.value(cell),
        };
    }
}

/// What goes out at the end of the process, whatever the mode still says.
pub fn last_words(sources: &[Source], image: &Snapshot, values: &mut [i32]) {
    outgoing(sources, image, values);
    for (value, source) in values.iter_mut().zip(sources) {
        match *source {
            Source::Output(y) => match image.safe[y as usize] {
                Safe::Off => *value = 0,
                Safe::On => *value = 1,
                Safe::Hold => {}
            },
            Source::Cell(_, Some(fixed)) => *value = fixed,
            Source::Cell(_, None) => {}
        }
    }
}

impl Field {
    /// The input step: every device's newest image, or what its loss makes of it.
    pub fn bring_in<M: Machine>(
        &mut self,
        machine: &mut M,
        (now_ns, scan): (u64, u64),
        mut tell: impl FnMut(What),
    ) {
        for (at, device) in self.devices.iter_mut().enumerate() {
            let Taken { stale, troubled } = device.take(now_ns);
            let ok = device.has_exchanged && !stale && !troubled;
            machine.write_bit(device.wiring.ok, ok);
            machine.write_bit(device.wiring.stale, stale);
            let exchanged = device.has_exchanged;
            if let Some(edge) = device.state.step(Seen { exchanged, stale, now_ns, scan }) {
                tell(What::Device { device: at as u32, edge });
            }
            device.move_inputs(machine, now_ns);
        }
    }

    /// Whether the scan itself exchanges with any device.
    pub fn has_local(&self) -> bool {
        self.devices.iter().any(|device| device.local.is_some())
    }

    /// The output step behind a complete scan: local devices.
    pub fn bring_out<M: Machine>(&mut self, machine: &M) {
        let (image, first_output) = (machine.image(), self.first_output);
        for device in &mut self.devices {
            if let Some(local) = &mut device.local {
                let done = local.write_image(image, first_output);
                device.pulse.note_failure(done);
            }
        }
    }

    /// RUN is over: local outputs go to their safe values. `image`: what those that hold are from
    /// now on; else they stay as they are.
    pub fn make_safe(&mut self, image: Option<(&[u8], &[i32])>) {
        let Field { devices, safe, first_output } = self;
        for device in devices {
            if let Some(local) = &mut device.local {
                let done = local.write_safe(safe, image, *first_output);
                device.pulse.note_failure(done);
            }
        }
    }

    /// Outside RUN nothing is moved; a local device that comes is made safe.
    pub fn tick(&mut self, image: Option<(&[u8], &[i32])>) {
        let Field { devices, safe, first_output } = self;
        for device in devices {
            if let Some(local) = &mut device.local
                && local.arrive()
            {
                let done = local.write_safe(safe, image, *first_output);
                device.pulse.note_failure(done);
            }
        }
    }

    /// What each Y does outside RUN is another from now on; `safe_now`: at once. What is to be
    /// held stays as it is.
    pub fn exchange_safe(&mut self, safe: &mut Vec<Safe>, safe_now: bool) {
        std::mem::swap(&mut self.safe, safe);
        if safe_now && self.safe != *safe {
            self.make_safe(None);
        }
    }
}

impl Pulse {
    fn is_troubled(&self) -> bool {
        self.troubled.load(Ordering::Acquire)
    }

    fn note_failure(&self, done: bool) {
        if !done {
            self.troubled.store(true, Ordering::Release);
        }
    }
}

/// How a device is, by what a scan has taken of it.
struct Taken {
    stale: bool,
    troubled: bool,
}

impl Device {
    /// Takes what is there.
    fn take(&mut self, now_ns: u64) -> Taken {
        // Read before the image, so that this is at least as new: a device that is well by this has
        // all of its last exchange there. Trouble is read behind it, too: an image of a part comes
        // behind the word of its trouble.
        let was_troubled = self.pulse.is_troubled();
        let mut good_ns = self.pulse.good_ns.load(Ordering::Acquire);
        self.images.refresh();
        let mut troubled = was_troubled || self.pulse.is_troubled();
        if let Some(local) = &mut self.local {
            let is_good = local.read();
            troubled = !is_good;
            self.pulse.troubled.store(troubled, Ordering::Release);
            if is_good {
                good_ns = now_ns;
                self.pulse.good_ns.store(now_ns, Ordering::Release);
            }
        }
        self.has_exchanged |= good_ns > 0;
        Taken { stale: self.is_lost(good_ns.max(self.start_ns), now_ns), troubled }
    }

    /// Whether what was read then is too old to count.
    fn is_lost(&self, read_ns: u64, now_ns: u64) -> bool {
        now_ns.saturating_sub(read_ns) > self.wiring.loss_after_ns
    }

    /// Moves every input that was ever read, as its own age wants it; the others are what their
    /// tags' `initial` says.
    fn move_inputs<M: Machine>(&self, machine: &mut M, now_ns: u64) {
        let targets = self.wiring.inputs.iter();
        let is_zero = |read_ns| self.wiring.zero_on_loss && self.is_lost(read_ns, now_ns);
        if let Some(local) = &self.local {
            let read_ns = self.pulse.good_ns.load(Ordering::Relaxed);
            let is_zero = is_zero(read_ns);
            let inputs = local.inputs().iter().filter(|_| read_ns > 0);
            for (target, value) in targets.zip(inputs) {
                target.receive(machine, if is_zero { target.held(0) } else { *value });
            }
            return;
        }
        for (target, Input { value, read_ns }) in targets.zip(self.images.inputs()) {
            match read_ns {
                0 => {}
                _ if is_zero(read_ns) => target.receive(machine, target.held(0)),
                _ => target.receive(machine, value),
            }
        }
    }
}

/// What a scan sees of a device.
struct Seen {
    exchanged: bool,
    stale: bool,
    now_ns: u64,
    scan: u64,
}

impl State {
    /// What is to be told of this scan.
    fn step(&mut self, seen: Seen) -> Option<DeviceEdge> {
        let Seen { exchanged, stale, now_ns, scan } = seen;
        let (next, edge) = match *self {
            State::Awaited { told: false, .. } if exchanged => (State::Well, DeviceEdge::Present),
            State::Awaited { since_ns, told: true } if exchanged => {
                let lost_ns = now_ns.saturating_sub(since_ns);
                (State::Well, DeviceEdge::Back { lost_ns, scans: scan })
            }
            State::Awaited { since_ns, told: false } if stale => {
                (State::Awaited { since_ns, told: true }, DeviceEdge::Absent)
            }
            State::Well if stale => {
                (State::Lost { since_ns: now_ns, scans: scan }, DeviceEdge::Lost)
            }
            State::Lost { since_ns, scans } if !stale => {
                let lost_ns = now_ns.saturating_sub(since_ns);
                let scans = scan.saturating_sub(scans);
                (State::Well, DeviceEdge::Back { lost_ns, scans })
            }
            _ => return None,
        };
        *self = next;
        Some(edge)
    }
}
