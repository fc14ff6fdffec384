//! The parts of a plant with their state, and the effect of one tick of a millisecond on each.
//!
//! A part receives a slice of points that begins with its own points, in the order that
//! `controller` defines. It keeps its state in its own fields, never in a point: a fault may have
//! falsified the point.

use std::collections::VecDeque;

use super::follower::BitFollower;
use super::lag::Lag;
use super::settings::{Delays, PartSettings, Scale, opening};

/// The number of nanometres in a millimetre, and of millionths in a tank's unit.
const MILLION: u64 = 1_000_000;

/// A part with its state.
#[derive(Clone, Debug)]
pub(super) enum PartState {
    Delay { delays: Delays, invert: bool, follower: BitFollower },
    Motor { delays: Delays, follower: BitFollower, tripped: bool },
    Conveyor(Belt),
    Tank(Tank),
    Sensor(Sensor),
    Pulse(PulsePart),
    Lag(Lag),
}

/// A belt with parts on it. Lengths are in nanometres: a belt with a speed of 1 mm/s that runs at a
/// thousandth of that speed moves 1 nm in a tick.
#[derive(Clone, Debug)]
pub(super) struct Belt {
    length: u64,
    /// The movement in a tick at a thousandth of its speed.
    speed: u64,
    every_ms: u64,
    part: u64,
    eyes: Vec<u64>,
    /// The distance that it has moved.
    moved: u64,
    /// The number of ticks in which it has moved.
    moved_ms: u64,
    /// For each part, the distance at which it was put on the belt; the foremost part is first.
    laid: VecDeque<u64>,
    /// The previous value of the bit that puts parts on the belt.
    fed: bool,
}

/// A tank; amounts in millionths of its unit.
#[derive(Clone, Debug)]
pub(super) struct Tank {
    capacity: u64,
    fill_rate: u64,
    drain_rate: u64,
    switches: Vec<u64>,
    level: u64,
}

/// Pulses; `since_ms` is the time at which they were turned on.
#[derive(Clone, Debug)]
pub(super) struct PulsePart {
    width_ms: u64,
    every_ms: u64,
    offset_ms: u64,
    invert: bool,
    since_ms: Option<u64>,
}

#[derive(Clone, Debug)]
pub(super) struct Sensor {
    on_at: i32,
    off_at: i32,
    delays: Delays,
    invert: bool,
    scale: Option<Scale>,
    is_above: bool,
    follower: BitFollower,
}

impl PartState {
    /// A part at rest.
    pub fn new(kind: &PartSettings) -> PartState {
        let follower = BitFollower::default();
        match kind {
            PartSettings::Delay { delays, invert } => {
                PartState::Delay { delays: *delays, invert: *invert, follower }
            }
            PartSettings::Motor { delays } => {
                PartState::Motor { delays: *delays, follower, tripped: false }
            }
            PartSettings::Conveyor { length_mm, speed_mm_s, every_ms, part_mm, eyes_mm } => {
                let nm = |mm: &u32| u64::from(*mm) * MILLION;
                PartState::Conveyor(Belt {
                    length: nm(length_mm),
                    speed: u64::from(*speed_mm_s),
                    every_ms: u64::from(*every_ms),
                    part: nm(part_mm),
                    eyes: eyes_mm.iter().map(nm).collect(),
                    moved: 0,
                    moved_ms: 0,
                    laid: VecDeque::new(),
                    fed: false,
                })
            }
            PartSettings::Tank { capacity, fill_rate, drain_rate, initial, switches } => {
                let millionths = |units: &u32| u64::from(*units) * MILLION;
                PartState::Tank(Tank {
                    capacity: millionths(capacity),
                    fill_rate: u64::from(*fill_rate),
                    drain_rate: u64::from(*drain_rate),
                    switches: switches.iter().map(millionths).collect(),
                    level: millionths(initial),
                })
            }
            &PartSettings::Sensor { on_at, off_at, delays, invert, scale } => {
                let is_above = false;
                PartState::Sensor(Sensor {
                    on_at,
                    off_at,
                    delays,
                    invert,
                    scale,
                    is_above,
                    follower,
                })
            }
            &PartSettings::Pulse { width_ms, every_ms, offset_ms, invert } => {
                PartState::Pulse(PulsePart {
                    width_ms: width_ms.into(),
                    every_ms: every_ms.max(1).into(),
                    offset_ms: offset_ms.into(),
                    invert,
                    since_ms: None,
                })
            }
            &PartSettings::Lag { gain, ambient, initial, time_ms } => {
                PartState::Lag(Lag::new([gain, ambient, initial], time_ms))
            }
        }
    }

    /// Sets its outputs before the first tick, so that this tick finds their first values.
    pub fn begin(&self, points: &mut [i32]) {
        match self {
            PartState::Delay { invert, .. } => points[2] = i32::from(*invert),
            PartState::Sensor(Sensor { invert, .. })
            | PartState::Pulse(PulsePart { invert, .. }) => {
                points[1] = i32::from(*invert);
            }
            PartState::Tank(tank) => tank.tell(points),
            PartState::Lag(lag) => points[1] = lag.value(),
            PartState::Motor { .. } | PartState::Conveyor(_) => {}
        }
    }

    /// Moves the part by one millisecond. `points` begins with the part's own points.
    pub fn tick(&mut self, now_ms: u64, points: &mut [i32]) {
        match self {
            PartState::Delay { delays, invert, follower } => {
                let (input, enable) = (points[0] != 0, points[1] != 0);
                if !enable {
                    *follower = BitFollower::default();
                }
                let on = enable && followed(follower, now_ms, input, *delays);
                points[2] = i32::from(on != *invert);
            }
            PartState::Motor { delays, follower, tripped } => {
                let (run, trip, reset) = (points[0] != 0, points[1] != 0, points[2] != 0);
                *tripped = trip || (*tripped && !reset);
                let running = followed(follower, now_ms, run && !*tripped, *delays);
                points[3..5].copy_from_slice(&[running.into(), (*tripped).into()]);
            }
            PartState::Conveyor(belt) => belt.tick(points),
            PartState::Tank(tank) => tank.tick(points),
            PartState::Sensor(sensor) => sensor.tick(now_ms, points),
            PartState::Lag(lag) => {
                lag.tick(opened(points[0]));
                points[1] = lag.value();
            }
            PartState::Pulse(pulse) => points[1] = pulse.tick(now_ms, points[0] != 0).into(),
        }
    }
}

impl PulsePart {
    fn tick(&mut self, now_ms: u64, run: bool) -> bool {
        if !run {
            self.since_ms = None;
            return self.invert;
        }
        let since_ms = *self.since_ms.get_or_insert(now_ms);
        let since_first = (now_ms - since_ms).checked_sub(self.offset_ms);
        since_first.is_some_and(|ms| ms % self.every_ms < self.width_ms) != self.invert
    }
}

fn followed(follower: &mut BitFollower, now_ms: u64, bit: bool, delays: Delays) -> bool {
    follower.step(now_ms, bit, delays.after_ms, delays.release_ms)
}

/// The opening of a valve or the speed of a drive, in thousandths.
fn opened(point: i32) -> u64 {
    point.clamp(0, opening::FULL).unsigned_abs().into()
}

impl Belt {
    fn tick(&mut self, points: &mut [i32]) {
        let (speed, feed, jam) = (opened(points[0]), points[1] != 0, points[2] != 0);
        let mut is_due = feed && !self.fed;
        self.fed = feed;
        if speed > 0 && !jam {
            self.moved += self.speed * speed;
            is_due |= self.every_ms > 0 && self.moved_ms.is_multiple_of(self.every_ms);
            self.moved_ms += 1;
        }
        let many = self.laid.len();
        while self.laid.front().is_some_and(|at| self.moved - at >= self.length) {
            self.laid.pop_front();
        }
        points[4] = i32::from(self.laid.len() < many);
        // A part is not laid on top of the previous one.
        if is_due && self.laid.back().is_none_or(|at| self.moved - at >= self.part) {
            self.laid.push_back(self.moved);
        }
        points[3] = self.laid.len() as i32;
        for (eye, point) in self.eyes.iter().zip(&mut points[5..]) {
            let covers = |at: &u64| (*eye..*eye + self.part).contains(&(self.moved - at));
            *point = self.laid.iter().any(covers).into();
        }
    }
}

impl Tank {
    fn tick(&mut self, points: &mut [i32]) {
        let (fill, drain) = (opened(points[0]), opened(points[1]));
        let filled = self.level + fill * self.fill_rate;
        let outflow = if filled > 0 && self.drain_rate > 0 { drain } else { 0 };
        let left = filled.saturating_sub(drain * self.drain_rate);
        self.level = left.min(self.capacity);
        points[3] = i32::from(left > self.capacity);
        points[5] = outflow as i32;
        self.tell(points);
    }

    fn tell(&self, points: &mut [i32]) {
        points[2] = (self.level / MILLION) as i32;
        points[4] = i32::from(self.level == 0);
        for (switch, point) in self.switches.iter().zip(&mut points[6..]) {
            *point = i32::from(self.level >= *switch);
        }
    }
}

impl Sensor {
    fn tick(&mut self, now_ms: u64, points: &mut [i32]) {
        let measured = points[0];
        self.is_above = measured >= if self.is_above { self.off_at } else { self.on_at };
        let on = followed(&mut self.follower, now_ms, self.is_above, self.delays);
        points[1] = i32::from(on != self.invert);
        points[2] = self.scale.map_or(measured, |scale| scaled(measured, scale));
    }
}

/// The transmitter's value; beyond its range, the value at the range's end.
fn scaled(measured: i32, Scale { range, raw }: Scale) -> i32 {
    let measured = measured.clamp(range[0].min(range[1]), range[0].max(range[1]));
    let [from, to, low, high, measured] =
        [range[0], range[1], raw[0], raw[1], measured].map(i128::from);
    let told = low + (measured - from) * (high - low) / (to - from);
    told as i32
}
