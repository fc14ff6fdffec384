//! The field devices of a rig, in virtual time.
//!
//! The side of the scan is `runtime::field`, as in the daemon. This module is the other side: it
//! exchanges with a device at each multiple of `poll` and when an output has changed, as
//! `io::device` does. A simulated plant answers, of parts or a ladder. Every other device reports
//! the values that the test gives its inputs: 0 and OFF at first.

use super::device_ladder::DeviceLadder;
use super::mode::{MS_NS, RigMode};
use super::program::{RigProgram, UnwiredBits};
use rungd_config::controller::device::{Device, DriverSettings};
use rungd_engine::isa::{Bit, BitSpace, DeviceId};
use rungd_engine::{BitCell, Cell, Image};
use rungd_io::device::ExchangeReason;
use rungd_io::ladder::{LadderMachine, LadderPlant, STOPPED, Stopped};
use rungd_io::modbus_client::VirtualDevice;
use rungd_io::plant::Model;
use rungd_runtime::field::{FieldDevices, InputStep, field};
use rungd_runtime::inputs::InputEnd;
use rungd_runtime::wiring::{OutputSource, Wiring, WiringTarget};
use rungd_runtime::{Origin, SafeState, ScannedMachine, Taped};

/// All field devices of a rig.
pub(super) struct RigField {
    field: FieldDevices,
    devices: Vec<RigDevice>,
    unwired: Vec<UnwiredDevice>,
}

/// A device that the ladder names, without a controller file. Its `.Ok` is ON until a test loses
/// it.
struct UnwiredDevice {
    bits: UnwiredBits,
    is_there: bool,
    /// Whether its bits must be written in the next scan.
    is_due: bool,
}

struct RigDevice {
    end: InputEnd,
    inputs: Vec<WiringTarget>,
    outputs: Vec<OutputSource>,
    poll_ns: u64,
    next_ns: u64,
    /// The outputs that were last passed to it.
    offered: Vec<i32>,
    /// The outputs of the exchange in progress, and the last inputs.
    given: Vec<i32>,
    read: Vec<Option<i32>>,
    peer: Peer,
    /// Whether it can be reached.
    is_there: bool,
    /// Why the last exchange of its driver failed.
    trouble: Option<String>,
}

/// The peer of a device.
enum Peer {
    /// A simulated plant, with the inputs that it last returned.
    Plant(Box<Model>, Vec<i32>),
    /// A plant that is a ladder.
    LadderPlant(Box<LadderPlant>),
    /// A ladder, which the device's own driver exchanges with.
    Ladder(Box<VirtualDevice<DeviceLadder>>),
    /// No plant: a test sets the inputs.
    Test,
}

/// The outputs to write: in RUN the image of the last scan, otherwise the safe values.
#[derive(Clone, Copy)]
pub(super) struct Driven<'a> {
    pub image: &'a Image,
    safe: &'a [SafeState],
    first_output: u32,
    /// In RUN, after the first complete scan.
    runs: bool,
    /// Whether a scan is complete: until then nothing is written.
    has_begun: bool,
}

impl<'a> Driven<'a> {
    /// `scans`: the number of scans of the process.
    pub fn of(
        machine: &'a Taped,
        program: &'a RigProgram,
        mode: RigMode,
        scans: u64,
    ) -> Driven<'a> {
        let first = program.symbols.layout.bit(Bit::Space(BitSpace::Y, 0));
        let image = machine.engine().image();
        let has_begun = scans > 0 || mode == RigMode::Stop;
        let runs = mode == RigMode::Run && has_begun;
        Driven { image, safe: &program.safe, first_output: first.0, runs, has_begun }
    }

    /// The state of an output that is written to devices.
    pub fn output(&self, y: u32) -> bool {
        let in_memory = self.image.bit(BitCell(self.first_output + y));
        let safe = self.safe.get(y as usize).copied().unwrap_or_default();
        if self.runs { in_memory } else { safe.driven(in_memory) }
    }

    fn value(&self, source: OutputSource) -> i32 {
        match source {
            OutputSource::Output(y) => self.output(y).into(),
            OutputSource::Cell(_, Some(fixed)) if !self.runs => fixed,
            OutputSource::Cell(cell, _) => self.image.value(cell),
        }
    }
}

impl RigField {
    /// The devices at the start of the first process: all can be reached.
    pub fn new(program: &RigProgram) -> RigField {
        let (field, ends) = scan_side(program, 0);
        let settings = &program.controller.devices;
        let devices = settings.iter().zip(&program.wirings).zip(ends);
        let device = |((settings, wiring), end): ((&Device, &Wiring), InputEnd)| {
            let count = wiring.inputs.len();
            let (peer, read) = match &settings.driver {
                DriverSettings::Simulated(plant) => {
                    (Peer::Plant(Box::new(Model::new(plant)), vec![0; count]), None)
                }
                DriverSettings::Ladder(plant) => match program.plant(settings.id) {
                    Some(ladder) => {
                        (Peer::LadderPlant(Box::new(LadderPlant::new(plant, ladder))), None)
                    }
                    None => (Peer::Test, Some(0)),
                },
                DriverSettings::Modbus(client) => match program.device_ladder(settings.id) {
                    Some(ladder) => {
                        let device = VirtualDevice::new(client, DeviceLadder::new(ladder));
                        (Peer::Ladder(Box::new(device)), None)
                    }
                    None => (Peer::Test, Some(0)),
                },
                DriverSettings::Gpio(_) => (Peer::Test, Some(0)),
            };
            RigDevice {
                end,
                inputs: wiring.inputs.clone(),
                outputs: wiring.outputs.clone(),
                poll_ns: u64::from(settings.poll_ms.max(1)) * MS_NS,
                next_ns: 0,
                offered: vec![0; wiring.outputs.len()],
                given: vec![0; wiring.outputs.len()],
                read: vec![read; count],
                is_there: true,
                trouble: None,
                peer,
            }
        };
        let unwired = program.unwired.iter();
        let unwired =
            unwired.map(|bits| UnwiredDevice { bits: *bits, is_there: true, is_due: true });
        RigField { field, devices: devices.map(device).collect(), unwired: unwired.collect() }
    }

    /// Begins a new process: the side of the scan starts again, the peers continue.
    pub fn begin_process(&mut self, program: &RigProgram, now_ns: u64) {
        let (field, ends) = scan_side(program, now_ns);
        self.field = field;
        for (device, end) in self.devices.iter_mut().zip(ends) {
            device.end = end;
            device.next_ns = now_ns;
            device.offered.fill(0);
            if let Peer::Ladder(ladder) = &mut device.peer {
                ladder.connect(now_ns);
            }
        }
        self.unwired.iter_mut().for_each(|device| device.is_due = true);
    }

    /// Takes the cells of a reloaded program. The devices stay the same.
    pub fn adopt(&mut self, program: &RigProgram) {
        for (device, wiring) in self.devices.iter_mut().zip(&program.wirings) {
            device.outputs.clone_from(&wiring.outputs);
            device.inputs.clone_from(&wiring.inputs);
        }
    }

    /// The X that devices write in every scan, 64 to a word.
    pub fn moved(&self) -> &[u64] {
        self.field.moved()
    }

    /// The input step of a scan.
    pub fn bring_in(&mut self, machine: &mut Taped, step: InputStep) {
        self.field.bring_in(machine, step, |_| {});
        for device in self.unwired.iter_mut().filter(|device| device.is_due) {
            machine.comes_from(Origin::Inputs);
            machine.write_bit(device.bits.ok, device.is_there);
            machine.write_bit(device.bits.stale, !device.is_there);
            device.is_due = false;
        }
    }

    /// Exchanges with every device whose `poll` is due, up to the time of a scan.
    pub fn poll(&mut self, now_ns: u64, driven: Driven) {
        for device in &mut self.devices {
            while device.next_ns <= now_ns {
                let at_ns = device.next_ns;
                device.exchange(at_ns, driven);
                device.next_ns += device.poll_ns;
            }
        }
    }

    /// Passes changed outputs to the devices, after a scan.
    pub fn drive(&mut self, now_ns: u64, driven: Driven) {
        self.devices.iter_mut().for_each(|device| device.drive(now_ns, driven));
    }

    /// Sets the input of a device that a test answers for.
    pub fn set(&mut self, x: u32, value: i32, now_ns: u64) {
        self.set_target(value, now_ns, |target| *target == WiringTarget::Input(x));
    }

    /// Sets the input of a device that a test answers for; returns true if the cell is one.
    pub fn set_cell(&mut self, cell: Cell, value: i32, now_ns: u64) -> bool {
        self.set_target(value, now_ns, |target| match (*target, cell) {
            (WiringTarget::Bit(of), Cell::Bit(bit)) => of == bit,
            (WiringTarget::Word { cell: of, .. }, Cell::Word(word)) => of == word,
            (WiringTarget::Input(_) | WiringTarget::Bit(_) | WiringTarget::Word { .. }, _) => false,
        })
    }

    fn set_target(
        &mut self,
        value: i32,
        now_ns: u64,
        is_it: impl Fn(&WiringTarget) -> bool,
    ) -> bool {
        for device in self.devices.iter_mut().filter(|device| matches!(device.peer, Peer::Test)) {
            if let Some(at) = device.inputs.iter().position(&is_it) {
                device.read[at] = Some(value);
                if device.is_there {
                    device.next_ns = device.next_ns.min(now_ns);
                }
                return true;
            }
        }
        false
    }

    /// Writes memory of a device's ladder, before its scan at a time or before its first scan.
    pub fn write_device(&mut self, device: DeviceId, cell: Cell, value: i32, now_ns: Option<u64>) {
        if let Some(machine) = self.machine(device, now_ns) {
            machine.write(cell, value);
        }
    }

    /// The ladder of a device, after its scans before a time.
    pub fn machine(
        &mut self,
        DeviceId(at): DeviceId,
        now_ns: Option<u64>,
    ) -> Option<&mut LadderMachine> {
        let before_ns = now_ns.and_then(|now_ns| now_ns.checked_sub(1));
        match &mut self.devices.get_mut(at as usize)?.peer {
            Peer::Ladder(ladder) => {
                let machine = ladder.peer().machine();
                if let Some(before_ns) = before_ns {
                    machine.scan_up_to(before_ns, |_| {});
                }
                Some(machine)
            }
            Peer::LadderPlant(plant) => {
                if let Some(before_ns) = before_ns {
                    plant.scan_up_to(before_ns);
                }
                Some(plant.machine())
            }
            Peer::Plant(..) | Peer::Test => None,
        }
    }

    /// A value of the memory of a device's ladder.
    pub fn device_value(&self, DeviceId(at): DeviceId, cell: Cell) -> i32 {
        let machine = match self.devices.get(at as usize).map(|device| &device.peer) {
            Some(Peer::Ladder(ladder)) => ladder.peer_now().machine_now(),
            Some(Peer::LadderPlant(plant)) => plant.machine_now(),
            Some(Peer::Plant(..) | Peer::Test) | None => return 0,
        };
        machine.image().value(cell)
    }

    /// Why the last exchange of each device failed, by the indices of the devices.
    pub fn troubles(&self) -> impl Iterator<Item = (usize, &str)> {
        let troubles = self.devices.iter().map(|device| device.trouble.as_deref());
        troubles.enumerate().filter_map(|(at, trouble)| Some((at, trouble?)))
    }

    /// From now on a device cannot be reached.
    pub fn lose(&mut self, DeviceId(at): DeviceId) {
        if let Some(device) = self.devices.get_mut(at as usize) {
            device.is_there = false;
            device.trouble = None;
            device.end.trouble();
        } else if let Some(device) = self.unwired.get_mut(at as usize) {
            (device.is_there, device.is_due) = (false, true);
        }
    }

    /// From now on a device can be reached. It exchanges before the next scan.
    pub fn restore(&mut self, DeviceId(at): DeviceId, now_ns: u64) {
        if let Some(device) = self.devices.get_mut(at as usize) {
            device.is_there = true;
            if let Peer::Ladder(ladder) = &mut device.peer {
                ladder.connect(now_ns);
            }
            device.next_ns = device.next_ns.min(now_ns);
        } else if let Some(device) = self.unwired.get_mut(at as usize) {
            (device.is_there, device.is_due) = (true, true);
        }
    }
}

/// The side of the scan of all devices. On the rig, every device exchanges outside of the scan.
fn scan_side(program: &RigProgram, now_ns: u64) -> (FieldDevices, Vec<InputEnd>) {
    let beside = |wiring: &Wiring| Wiring { local_budget_ns: None, ..wiring.clone() };
    let wirings: Vec<Wiring> = program.wirings.iter().map(beside).collect();
    let first = program.symbols.layout.bit(Bit::Space(BitSpace::Y, 0));
    let (field, ends) = field(&wirings, program.safe.clone(), first.0 as usize, now_ns);
    (field, ends.into_iter().map(|ends| ends.inputs).collect())
}

impl RigDevice {
    fn take_outputs(&mut self, driven: Driven) {
        for (value, source) in self.given.iter_mut().zip(&self.outputs) {
            *value = driven.value(*source);
        }
    }

    /// An exchange at `poll`.
    fn exchange(&mut self, now_ns: u64, driven: Driven) {
        if !self.is_there {
            // The plant continues with its last outputs.
            match &mut self.peer {
                Peer::Plant(model, inputs) => {
                    let _ = model.step(now_ns / MS_NS, &self.given, inputs);
                }
                Peer::LadderPlant(plant) => plant.scan_up_to(now_ns),
                Peer::Ladder(_) | Peer::Test => {}
            }
            self.end.trouble();
            return;
        }
        self.take_outputs(driven);
        if driven.has_begun {
            self.offered.copy_from_slice(&self.given);
        }
        match &mut self.peer {
            Peer::Plant(model, inputs) => {
                if model.step(now_ns / MS_NS, &self.given, inputs).is_err() {
                    self.end.trouble();
                    return;
                }
                for (read, input) in self.read.iter_mut().zip(inputs) {
                    *read = Some(*input);
                }
            }
            Peer::LadderPlant(plant) => {
                let done = plant.step(now_ns, &self.given, &mut self.read);
                self.trouble = done.err().map(|Stopped| STOPPED.to_owned());
                if self.trouble.is_some() {
                    self.end.trouble();
                    self.end.deliver(&self.read, now_ns);
                    return;
                }
            }
            Peer::Ladder(ladder) => {
                let occasion = match driven.has_begun {
                    true => ExchangeReason::Poll,
                    false => ExchangeReason::First,
                };
                let done = ladder.exchange(now_ns, occasion, &self.given, &mut self.read);
                self.trouble = done.as_ref().err().map(|failure| failure.reason.clone());
                if let Err(failure) = done {
                    self.end.trouble();
                    if !failure.is_disconnected {
                        self.end.deliver(&self.read, now_ns);
                    }
                    return;
                }
            }
            Peer::Test => {}
        }
        self.end.deliver(&self.read, now_ns);
        self.end.well(now_ns);
    }

    /// An exchange because an output has changed: inputs are not read.
    fn drive(&mut self, now_ns: u64, driven: Driven) {
        if !self.is_there || self.outputs.is_empty() {
            return;
        }
        self.take_outputs(driven);
        if self.given == self.offered {
            return;
        }
        self.offered.copy_from_slice(&self.given);
        match &mut self.peer {
            Peer::Plant(model, inputs) => {
                let _ = model.step(now_ns / MS_NS, &self.offered, inputs);
            }
            Peer::LadderPlant(plant) => {
                let _ = plant.step(now_ns, &self.offered, &mut self.read);
            }
            Peer::Ladder(ladder) => {
                let change = ExchangeReason::Change;
                let done = ladder.exchange(now_ns, change, &self.offered, &mut self.read);
                if let Err(failure) = done {
                    self.trouble = Some(failure.reason);
                    self.end.trouble();
                }
            }
            Peer::Test => {}
        }
    }
}
