//! The settings of a simulated plant: its parts, the driver of each command, its faults. Made by
//! `controller` from a controller file.

use crate::scaling::Scaling;
use rungd_engine::isa::Bit;
use rungd_language::source::span::Span;

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
pub struct PlantSettings {
    /// The seed of the noise.
    pub seed: u64,
    /// Its parts, in file order.
    pub parts: Vec<PlantPart>,
    /// Its faults, in file order.
    pub faults: Vec<FaultSettings>,
    /// The drivers of each command, including the commands of faults, in the order of their points.
    pub commands: Vec<PlantCommand>,
    /// The number of points.
    pub points: usize,
    /// The point of each input of the device.
    pub inputs: Vec<PointId>,
    /// The number of outputs of the device; [`Feed::Output`] numbers them.
    pub outputs: usize,
    /// The scaling from the plant's integers to memory, for each input.
    pub input_scaling: Vec<Scaling>,
    /// The same for each output.
    pub output_scaling: Vec<Scaling>,
}

/// A command and its drivers; its value is the mean of their values. Each of several pumps has an
/// equal share, for example.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlantCommand {
    /// The command.
    pub point: PointId,
    /// The drivers: at least one; several only for an opening.
    pub drives: Vec<CommandShare>,
}

/// A share of a command's value: the feed's value times the gain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommandShare {
    /// The driver.
    pub feed: Feed,
    /// 1, or the value of a fully open valve if a bit opens it.
    pub gain: i32,
}

/// The driver of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feed {
    /// An output to the device, by its number.
    Output(usize),
    /// A point of the plant.
    Point(PointId),
    /// A constant value, for a command that nothing drives.
    Fixed(i32),
}

/// A part.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantPart {
    /// Its first point.
    pub first: PointId,
    /// Its kind, with its measures.
    pub kind: PartSettings,
}

/// The kind of a part, with its measures. Positions and levels are in the order of their points.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum PartSettings {
    Delay { delays: Delays, invert: bool },
    Motor { delays: Delays },
    Conveyor { length_mm: u32, speed_mm_s: u32, every_ms: u32, part_mm: u32, eyes_mm: Vec<u32> },
    Tank { capacity: u32, fill_rate: u32, drain_rate: u32, initial: u32, switches: Vec<u32> },
    Sensor { on_at: i32, off_at: i32, delays: Delays, invert: bool, scale: Option<Scale> },
    Pulse { width_ms: u32, every_ms: u32, offset_ms: u32, invert: bool },
    Lag { gain: i32, ambient: i32, initial: i32, time_ms: u32 },
}

/// The times for which a bit must be ON or OFF before it is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Delays {
    /// For ON, in ms.
    pub after_ms: u32,
    /// For OFF, in ms.
    pub release_ms: u32,
}

/// A straight line from the measured value to the sensor's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    /// Two measured values.
    pub range: [i32; 2],
    /// The sensor's value for each.
    pub raw: [i32; 2],
}

/// A fault on demand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaultSettings {
    /// The point that turns it on.
    pub when: PointId,
    /// Its effect.
    pub effect: FaultEffect,
}

/// The effect of a fault while it is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum FaultEffect {
    /// The point has this value.
    Fixed { point: PointId, value: i32 },
    /// The point keeps the value that it had before the fault was turned on.
    Stuck { point: PointId },
    /// A bit is ON or OFF at random; a new value is drawn every `every_ms`.
    Bouncing { point: PointId, every_ms: u32 },
    /// A word deviates by up to `amplitude` at random; a new deviation is drawn every `every_ms`.
    Noisy { point: PointId, every_ms: u32, amplitude: u32 },
    /// The point has its value of `by_ms` ago.
    Late { point: PointId, by_ms: u32 },
    /// The device exchanges nothing.
    Lost,
}

/// A part of its own that moves one input: a rule of `[[simulated-device]]`.
#[derive(Clone, Debug)]
pub struct InputRule {
    /// The number of the X bit.
    pub input: u32,
    /// The part; its last point moves the input.
    pub part: PartSettings,
    /// The drivers of the part's commands, in the order of their points; a command without one is
    /// ON.
    pub commands: Vec<Option<RuleCommand>>,
    /// The place of the rule.
    pub span: Span,
}

/// A bit that drives a command of a rule's part.
#[derive(Clone, Copy, Debug)]
pub struct RuleCommand {
    /// The bit.
    pub bit: Bit,
    /// Its place in the file.
    pub span: Span,
}

impl InputRule {
    /// Whether an input moves as by another rule, wherever both stand.
    pub fn is_like(&self, other: &InputRule) -> bool {
        let bits = |rule: &InputRule| -> Vec<_> {
            rule.commands.iter().map(|command| command.map(|command| command.bit)).collect()
        };
        (self.input, &self.part) == (other.input, &other.part) && bits(self) == bits(other)
    }

    /// The bits that it reads, each with its place.
    pub fn reads(&self) -> impl Iterator<Item = RuleCommand> {
        self.commands.iter().copied().flatten()
    }
}
