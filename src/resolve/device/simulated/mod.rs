//! A simulated plant, resolved: its parts, the points they have, and what drives each command.
//!
//! Called by [`super`] with the rows of the map; `io::plant` makes a model of it. Points are
//! numbered through the plant: a part's commands first, then what it tells, in the order of
//! `points`; behind those of the parts, one for each fault.
//!
//! ```toml
//! # passes: what stands at a motor's contactor, and its answer
//! [[device]]
//! name = "plant"
//! driver = "simulated"
//! part = [{ name = "pump", kind = "motor", after = "60ms" }]
//! map = [{ from = "Y0", to = "pump.run" }, { from = "pump.running", to = "X0" }]
//! # fails without the first row: nothing drives `pump.run`
//! ```

mod parts;
mod points;
mod wires;

use super::Row;
use crate::source::device as written;
use crate::source::device::simulated::FaultKind;
use crate::source::finding::{Code, Finding};

pub use points::{PointId, opening};

/// A point as written, for a help.
pub(super) const EXAMPLE: &str = "belt.eye";

/// A plant takes a step at least so often.
const POLL_MS_MAX: i32 = 1000;

/// A simulated plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// What is random is so by this.
    pub seed: u64,
    /// Its parts, in file order.
    pub parts: Vec<Part>,
    /// Its faults, in file order.
    pub faults: Vec<Fault>,
    /// What drives each command, also those of faults; in the order of their points.
    pub commands: Vec<Command>,
    /// How many points there are.
    pub points: usize,
    /// Which point comes in: one a point of the device.
    pub inputs: Vec<PointId>,
    /// How many points go out; [`Feed::Output`] numbers them.
    pub outputs: usize,
}

/// A command's value: a feed's, so many times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Command {
    /// The command.
    pub point: PointId,
    /// What drives it.
    pub feed: Feed,
    /// 1, or what an opened valve is where a bit opens it.
    pub gain: i32,
}

/// What drives a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feed {
    /// What goes out to the device, by its number.
    Output(usize),
    /// A point of the plant.
    Point(PointId),
    /// Nothing: this, always.
    Fixed(i32),
}

/// A part.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its first point.
    pub first: PointId,
    /// What it is.
    pub kind: Kind,
}

/// What a part is, with its measures. Positions and levels are in order of their points.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Kind {
    Delay { delays: Delays, invert: bool },
    Motor { delays: Delays },
    Conveyor { length_mm: u32, speed_mm_s: u32, every_ms: u32, part_mm: u32, eyes_mm: Vec<u32> },
    Tank { capacity: u32, fill_rate: u32, drain_rate: u32, initial: u32, switches: Vec<u32> },
    Sensor { on_at: i32, off_at: i32, delays: Delays, invert: bool, scale: Option<Scale> },
    Pulse { width_ms: u32, every_ms: u32, offset_ms: u32 },
}

/// How long a bit must be ON, and OFF, before it is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Delays {
    /// ON, ms.
    pub after_ms: u32,
    /// OFF, ms.
    pub release_ms: u32,
}

/// A straight line: what is measured, and what is told of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    /// Two values.
    pub range: [i32; 2],
    /// What is told of each.
    pub raw: [i32; 2],
}

/// A fault on demand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The point that brings it about.
    pub when: PointId,
    /// What it does.
    pub effect: Effect,
}

/// What a fault does while it is brought about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Effect {
    /// The point is this.
    Fixed { point: PointId, value: i32 },
    /// The point is as it was when the fault came.
    Stuck { point: PointId },
    /// A bit is ON or OFF by chance; every so often anew.
    Bouncing { point: PointId, every_ms: u32 },
    /// A word is off by up to so much; every so often anew.
    Noisy { point: PointId, every_ms: u32, amplitude: u32 },
    /// The point is as it was so long ago.
    Late { point: PointId, by_ms: u32 },
    /// The device exchanges nothing.
    Lost,
}

/// Whether a text reads as a point of a plant: two names with a dot between, the second one small.
pub(super) fn is_point(_device: &written::Device, text: &str) -> bool {
    text.split_once('.').is_some_and(|(part, point)| {
        points::is_name(part) && points::is_name(point) && point.starts_with(char::is_lowercase)
    })
}

pub(super) fn resolve(
    device: &written::Device,
    rows: &[Row<'_>],
    findings: &mut Vec<Finding>,
) -> Option<Plant> {
    let (keys, before) = (&device.simulated, findings.len());
    if keys.parts.is_empty() {
        let finding = Finding::new(Code::Controller, device.span, "a plant without parts");
        let help = "add one: `part = [{ name = \"pump\", kind = \"motor\" }]`";
        findings.push(finding.help(help));
    }
    if let Some(poll) = device.poll_ms.as_ref().filter(|poll| poll.value > POLL_MS_MAX) {
        let message = "a plant takes a step at least every second";
        let finding = Finding::new(Code::OutOfRange, poll.span, message);
        findings.push(finding.help("write `poll = \"20ms\"`"));
    }
    let kinds: Vec<Option<Kind>> =
        keys.parts.iter().map(|part| parts::resolve(part, findings)).collect();
    let points = points::Points::new(keys, findings);
    let commands = wires::commands(keys, rows, &points, findings);
    let inputs = wires::inputs(rows, &points, findings);
    let faults: Vec<Option<Fault>> =
        keys.faults.iter().map(|fault| wires::fault(fault, &points, findings)).collect();
    if findings.len() > before {
        return None;
    }
    let parts = kinds.into_iter().zip(&points.firsts);
    Some(Plant {
        seed: keys.seed.as_ref().map_or(1, |seed| seed.value.unsigned_abs()),
        parts: parts
            .map(|(kind, first)| Some(Part { first: *first, kind: kind? }))
            .collect::<Option<Vec<_>>>()?,
        faults: faults.into_iter().collect::<Option<Vec<_>>>()?,
        commands,
        points: points.all.len(),
        inputs: inputs?,
        outputs: wires::outgoing(rows).count(),
    })
}
