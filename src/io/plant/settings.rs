//! A plant as it is asked for: its parts, what drives each command, its faults. A driver's
//! settings, as `controller` makes them of a controller file.

use crate::isa::Bit;
use crate::source::span::Span;

/// A point of a plant, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PointId(pub u32);

/// A valve or drive that is fully open: 1000 thousandths.
pub mod opening {
    /// Fully open.
    pub const FULL: i32 = 1000;
}

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
    pub kind: PartSettings,
}

/// What a part is, with its measures. Positions and levels are in order of their points.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum PartSettings {
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

/// A rule by which one input moves.
#[derive(Clone, Debug)]
pub struct Rule {
    /// The number of the X bit.
    pub input: u32,
    /// How it moves.
    pub motion: Motion,
    /// It only moves while this bit is ON; else it is OFF.
    pub while_on: Option<Bit>,
    /// The input is ON where the rule says OFF.
    pub invert: bool,
    /// The place of the rule.
    pub span: Span,
}

/// How a simulated input moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// ON for `width_ms` in every `every_ms`, from `offset_ms` on.
    Pulse {
        /// How long it is ON; less than `every_ms`.
        width_ms: u32,
        /// How often.
        every_ms: u32,
        /// When the first one begins.
        offset_ms: u32,
    },
    /// As another bit, later.
    Follow {
        /// The bit.
        bit: Bit,
        /// How long the bit is ON before the input is.
        after_ms: u32,
        /// How long the bit is OFF before the input is.
        release_ms: u32,
    },
}
