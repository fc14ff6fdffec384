//! The scan's side of field devices: images of their inputs, and the age of each input.
//!
//! Every device has an image of its inputs. A driver's task fills it outside the scan
//! ([`InputEnd`]), or the scan fills it itself (`local`, for lines that answer at once). An image
//! is handed over as a whole (`latest`), so a scan sees the inputs of one exchange. At the input
//! step `FieldDevices` takes the newest image, computes the age of the last good exchange and of
//! each input by the scan's own clock, and writes the inputs to memory. So a device with a hanging
//! task goes stale like a device with a cut cable. Outputs leave through the published image
//! (`wiring`); the outputs of a local device leave at the output step.
//!
//! The scan's side does not lock, allocate or free: failed local devices go back through a ring.

use std::sync::Arc;

use super::image::SafeState;
use super::inputs::{ExchangePulse, InputEnd};
use super::latest::{InputReader, LatestInput, latest};
use super::local::{LocalEnd, LocalSide};
use super::machine::{ImageCells, ScannedMachine};
use super::origin::Origin;
use super::record::{DeviceEdge, RecordEvent};
use super::wiring::{Wiring, WiringTarget};

/// The ends of a device's exchange that are used outside the scan thread.
pub struct DeviceEnds {
    /// The end that takes inputs.
    pub inputs: InputEnd,
    /// For a local device, the end that takes the device itself.
    pub local: Option<LocalEnd>,
}

/// The scan's side: all devices.
pub struct FieldDevices {
    devices: Vec<WiredDevice>,
    /// The safe state of each Y, outside RUN.
    safe: Vec<SafeState>,
    /// The cell of Y0.
    first_output: usize,
    /// Marks the inputs that devices have read at least once, 64 to a word; from then on only the
    /// devices write them.
    moved: Box<[u64]>,
}

struct WiredDevice {
    wiring: Wiring,
    pulse: Arc<ExchangePulse>,
    images: InputReader,
    local: Option<LocalSide>,
    /// The time from which the device waits for its first exchange.
    start_ns: u64,
    /// Whether there was a good exchange.
    has_exchanged: bool,
    state: Presence,
}

/// The state of a device, with the time at which it began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Presence {
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

/// Makes both sides for these devices. `safe`: the safe state of each Y; `first_output`: the cell
/// of Y0.
pub fn field(
    wirings: &[Wiring],
    safe: Vec<SafeState>,
    first_output: usize,
    now_ns: u64,
) -> (FieldDevices, Vec<DeviceEnds>) {
    let (devices, ends) = wirings.iter().map(|wiring| device(wiring, now_ns)).unzip();
    let inputs = wirings.iter().flat_map(|wiring| &wiring.inputs).filter_map(WiringTarget::input);
    let words = inputs.max().map_or(0, |last| last / 64 + 1) as usize;
    let moved = vec![0; words].into();
    (FieldDevices { devices, safe, first_output, moved }, ends)
}

fn device(wiring: &Wiring, now_ns: u64) -> (WiredDevice, DeviceEnds) {
    let (image_in, images) = latest(wiring.inputs.len());
    let pulse = Arc::new(ExchangePulse::default());
    let local = wiring.local_budget_ns.map(|budget_ns| super::local::local(wiring, budget_ns));
    let (local, local_end) = local.unzip();
    let device = WiredDevice {
        wiring: wiring.clone(),
        pulse: Arc::clone(&pulse),
        images,
        local,
        start_ns: now_ns,
        has_exchanged: false,
        state: Presence::Awaited { since_ns: now_ns, told: false },
    };
    let inputs = InputEnd::new(pulse, image_in, wiring.inputs.clone());
    (device, DeviceEnds { inputs, local: local_end })
}

/// The time of an input step.
#[derive(Clone, Copy)]
pub struct InputStep {
    /// The number of complete scans before it.
    pub scan: u64,
    /// The time of its scan, monotonic.
    pub now_ns: u64,
}

impl FieldDevices {
    /// The input step: writes the inputs of every device, from its newest image or by `on-loss`.
    pub fn bring_in<M: ScannedMachine>(
        &mut self,
        machine: &mut M,
        InputStep { scan, now_ns }: InputStep,
        mut tell: impl FnMut(RecordEvent),
    ) {
        let FieldDevices { devices, moved, .. } = self;
        for (at, device) in devices.iter_mut().enumerate() {
            let Freshness { stale, troubled } = device.take(now_ns);
            let ok = device.has_exchanged && !stale && !troubled;
            machine.comes_from(Origin::Device(at as u32));
            machine.write_bit(device.wiring.ok, ok);
            machine.write_bit(device.wiring.stale, stale);
            let exchanged = device.has_exchanged;
            if let Some(edge) = device.state.step(DeviceSighting { exchanged, stale, now_ns, scan })
            {
                tell(RecordEvent::Device { device: at as u32, edge });
            }
            device.move_inputs(machine, now_ns, moved);
        }
    }

    /// The inputs that devices write at every scan, 64 to a word; all other inputs have no device.
    pub fn moved(&self) -> &[u64] {
        &self.moved
    }

    /// Whether there is a local device.
    pub fn has_local(&self) -> bool {
        self.devices.iter().any(|device| device.local.is_some())
    }

    /// The output step after a complete scan: writes the outputs of local devices.
    pub fn bring_out<M: ScannedMachine>(&mut self, machine: &M) {
        let (image, first_output) = (machine.image(), self.first_output);
        for device in &mut self.devices {
            if let Some(local) = &mut device.local
                && !local.write_image(image, first_output)
            {
                device.pulse.trouble();
            }
        }
    }

    /// Called after RUN: sets local outputs to their safe values. A held output takes its value
    /// from `image`; without an image it stays as it is.
    pub fn make_safe(&mut self, image: Option<ImageCells<'_>>) {
        let FieldDevices { devices, safe, first_output, .. } = self;
        for device in devices {
            if let Some(local) = &mut device.local
                && !local.write_safe(safe, image, *first_output)
            {
                device.pulse.trouble();
            }
        }
    }

    /// A tick outside RUN: no inputs are written; a local device that was handed in is made safe.
    pub fn tick(&mut self, image: Option<ImageCells<'_>>) {
        let FieldDevices { devices, safe, first_output, .. } = self;
        for device in devices {
            if let Some(local) = &mut device.local
                && local.arrive()
                && !local.write_safe(safe, image, *first_output)
            {
                device.pulse.trouble();
            }
        }
    }

    /// Exchanges the safe states of all Y. `safe_now`: the controller is not in RUN, so changed
    /// safe values are written at once; a held output stays as it is.
    pub fn exchange_safe(&mut self, safe: &mut Vec<SafeState>, safe_now: bool) {
        std::mem::swap(&mut self.safe, safe);
        if safe_now && self.safe != *safe {
            self.make_safe(None);
        }
    }
}

/// The state of a device in this scan.
struct Freshness {
    stale: bool,
    troubled: bool,
}

impl WiredDevice {
    /// Takes the newest image, if there is one.
    fn take(&mut self, now_ns: u64) -> Freshness {
        // The pulse is read before the image, so the image is at least as new: if the last exchange
        // was good, the image contains all its inputs. Trouble is read again after the image,
        // because a task reports trouble before it hands in a partial image.
        let was_troubled = self.pulse.is_troubled();
        let mut good_ns = self.pulse.good_ns();
        self.images.refresh();
        let mut troubled = was_troubled || self.pulse.is_troubled();
        if let Some(local) = &mut self.local {
            troubled = !local.read();
            if troubled {
                self.pulse.trouble();
            } else {
                good_ns = now_ns;
                self.pulse.well(now_ns);
            }
        }
        self.has_exchanged |= good_ns > 0;
        Freshness { stale: self.is_lost(good_ns.max(self.start_ns), now_ns), troubled }
    }

    /// Whether an image that was read at this time is older than `loss-after`.
    fn is_lost(&self, read_ns: u64, now_ns: u64) -> bool {
        now_ns.saturating_sub(read_ns) > self.wiring.loss_after_ns
    }

    /// Writes every input that was read at least once, depending on its own age. Other inputs keep
    /// the `initial` of their tags.
    fn move_inputs<M: ScannedMachine>(&self, machine: &mut M, now_ns: u64, moved: &mut [u64]) {
        let mut receive = |target: &WiringTarget, value: i32| {
            target.receive(machine, value);
            if let Some(x) = target.input() {
                moved[x as usize / 64] |= 1 << (x % 64);
            }
        };
        let targets = self.wiring.inputs.iter();
        let is_zero = |read_ns| self.wiring.zero_on_loss && self.is_lost(read_ns, now_ns);
        if let Some(local) = &self.local {
            let read_ns = self.pulse.good_ns();
            let is_zero = is_zero(read_ns);
            let inputs = local.inputs().iter().filter(|_| read_ns > 0);
            for (target, value) in targets.zip(inputs) {
                receive(target, if is_zero { target.held(0) } else { *value });
            }
            return;
        }
        for (target, LatestInput { value, read_ns }) in targets.zip(self.images.inputs()) {
            match read_ns {
                0 => {}
                _ if is_zero(read_ns) => receive(target, target.held(0)),
                _ => receive(target, value),
            }
        }
    }
}

/// A device as a scan sees it.
struct DeviceSighting {
    exchanged: bool,
    stale: bool,
    now_ns: u64,
    scan: u64,
}

impl Presence {
    /// The change of state in this scan, if there is one.
    fn step(&mut self, seen: DeviceSighting) -> Option<DeviceEdge> {
        let DeviceSighting { exchanged, stale, now_ns, scan } = seen;
        let (next, edge) = match *self {
            Presence::Awaited { told: false, .. } if exchanged => {
                (Presence::Well, DeviceEdge::Present)
            }
            Presence::Awaited { since_ns, told: true } if exchanged => {
                let lost_ns = now_ns.saturating_sub(since_ns);
                (Presence::Well, DeviceEdge::Back { lost_ns, scans: scan })
            }
            Presence::Awaited { since_ns, told: false } if stale => {
                (Presence::Awaited { since_ns, told: true }, DeviceEdge::Absent)
            }
            Presence::Well if stale => {
                (Presence::Lost { since_ns: now_ns, scans: scan }, DeviceEdge::Lost)
            }
            Presence::Lost { since_ns, scans } if !stale => {
                let lost_ns = now_ns.saturating_sub(since_ns);
                let scans = scan.saturating_sub(scans);
                (Presence::Well, DeviceEdge::Back { lost_ns, scans })
            }
            Presence::Awaited { .. } | Presence::Well | Presence::Lost { .. } => return None,
        };
        *self = next;
        Some(edge)
    }
}
