//! Random tests: many runs of random changes, judged by `always`.
//!
//! The generator is SplitMix64. The seed of run n is the n-th number of a generator that starts
//! with the `seed` of the test, so every run can be repeated alone. A run is a list of
//! [`RandomEvent`]s; `shrink` makes a failing list short.

use super::player::LoweredSuite;
use super::suite::{RandomChange, RandomMotion, RandomTest, TestOperand};
use crate::calendar::LocalTime;
use crate::engine::{Cell, Image, Layout};
use crate::isa::Real;
use crate::random::SplitMix64;
use crate::rig::{Rig, RigMode, RigSetup};
use crate::runtime::exchange::Ticket;

/// One change, before a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RandomEvent {
    /// The scan, from 0.
    pub scan: u64,
    /// The index of the change in the test.
    pub change: usize,
    /// The new content of the cell.
    pub value: i32,
}

/// A run that has broken a line of `always`.
#[derive(Clone, Debug)]
pub(super) struct BrokenRun {
    pub events: Vec<RandomEvent>,
    /// The scan in which the line broke, from 0.
    pub scan: u64,
    /// The index of the line.
    pub always: usize,
}

/// A line of `always` that broke.
#[derive(Clone, Copy, Debug)]
pub(super) struct BrokenLine {
    /// The scan in which it broke, from 0.
    pub scan: u64,
    /// The index of the line.
    pub always: usize,
}

/// The generator of a run. Runs count from 0.
fn generator(seed: u64, run: u32) -> SplitMix64 {
    let mut seeds =
        SplitMix64(seed.wrapping_add(u64::from(run).wrapping_mul(0x632b_e59b_d9b4_e019)));
    SplitMix64(seeds.next())
}

/// Makes one run of a test. Runs count from 0. Also returns the number of its scans.
pub(super) fn run(stage: LoweredSuite, test: &RandomTest, run: u32) -> (u64, Option<BrokenRun>) {
    let layout = &stage.programs[0].symbols.layout;
    let mut random = generator(test.seed, run);
    let mut events = Vec::new();
    let broken = drive(stage, test, test.scans, |scan, image, changes| {
        for (at, change) in test.changes.iter().enumerate() {
            if random.next() % 1_000_000 >= u64::from(change.chance.0) {
                continue;
            }
            let value = moved(layout, change, (image, &mut random));
            events.push(RandomEvent { scan, change: at, value });
            changes.push((at, value));
        }
    });
    let scans = broken.map_or(test.scans, |of| of.scan + 1);
    (scans, broken.map(|BrokenLine { scan, always }| BrokenRun { events, scan, always }))
}

/// Plays events. Returns the first line of `always` that breaks.
pub(super) fn replay(
    stage: LoweredSuite,
    test: &RandomTest,
    (events, scans): (&[RandomEvent], u64),
) -> Option<BrokenLine> {
    let mut next = 0;
    drive(stage, test, scans, |scan, _, changes| {
        while let Some(event) = events.get(next).filter(|event| event.scan <= scan) {
            changes.push((event.change, event.value));
            next += 1;
        }
    })
}

/// Executes scans until a line of `always` breaks. `changes`: adds the changes before a scan, from
/// the number of the scan and the image of the scan before.
fn drive(
    stage: LoweredSuite,
    test: &RandomTest,
    scans: u64,
    mut changes: impl FnMut(u64, &Image, &mut Vec<(usize, i32)>),
) -> Option<BrokenLine> {
    let inputs = test.set.iter().filter_map(|(of, value)| Some((of.input?, *value != 0)));
    let others = test.set.iter().filter(|(of, _)| of.input.is_none());
    let setup = RigSetup {
        set: others.map(|(operand, value)| (operand.cell, *value)).collect(),
        inputs: inputs.collect(),
        clock_s: LocalTime::SIMULATED_S,
        ..RigSetup::default()
    };
    let mut rig = Rig::new(&stage.programs[0], &setup);
    let always = &stage.suite.always[0];
    let mut edges: Vec<Vec<bool>> = always.iter().map(|of| vec![false; of.edges]).collect();
    let mut now = Vec::new();
    for scan in 0..scans {
        if rig.mode() == RigMode::Stop {
            // The ladder has stopped the controller, so no line can break any more.
            return None;
        }
        now.clear();
        changes(scan, rig.image(), &mut now);
        for (change, value) in &now {
            give(&mut rig, &test.changes[*change].operand, *value);
        }
        let is_last = rig.scan();
        for (at, (condition, edges)) in always.iter().zip(&mut edges).enumerate() {
            if !condition.is_true(rig.image(), edges) {
                return Some(BrokenLine { scan, always: at });
            }
        }
        rig.end_scan(is_last);
    }
    None
}

fn give(rig: &mut Rig, operand: &TestOperand, value: i32) {
    match operand.input {
        Some(x) => rig.set_input(x, value != 0),
        None => rig.write(operand.cell, value, Ticket(0)),
    }
}

/// The next value of an operand.
fn moved(
    layout: &Layout,
    change: &RandomChange,
    (image, random): (&Image, &mut SplitMix64),
) -> i32 {
    let word = match change.operand.cell {
        Cell::Bit(bit) => return i32::from(!image.bit(bit)),
        Cell::Word(word) => word,
    };
    let is_real = layout.is_real(word);
    let content = image.word(word);
    let now = if is_real { f64::from(Real::of_cell(content).number()) } else { f64::from(content) };
    let next = match change.motion {
        RandomMotion::Toggle => now,
        RandomMotion::Walk { low, high, step } => {
            let up = random.next() >> 63 == 1;
            (if up { now + step } else { now - step }).clamp(low, high)
        }
        RandomMotion::Jump { low, high } if is_real => {
            // 53 random bits: the precision of a binary64 between 0 and 1.
            low + (high - low) * ((random.next() >> 11) as f64 / (1_u64 << 53) as f64)
        }
        RandomMotion::Jump { low, high } => {
            let count = (high - low) as u64 + 1;
            low + (random.next() % count) as f64
        }
    };
    match is_real {
        true => Real::stored(next).real.cell(),
        false => next as i32,
    }
}
