//! Random tests: many runs of random changes, judged by `always`.
//!
//! The generator is SplitMix64. The seed of run n is the n-th number of a generator that starts
//! with the `seed` of the test, so every run can be repeated alone. A run is a list of
//! [`RandomEvent`]s; `shrink` makes a failing list short. A replay of such a list draws nothing,
//! but moves each operand by the rule of the test: every run that is replayed is one that the
//! generator could have made.

use super::change_schedule::ChangeSchedule;
use super::lowered_suite::LoweredSuite;
use super::suite::{RandomChange, RandomMotion, RandomTest, TestOperand};
use crate::rig::{Rig, RigMode, RigSetup, TapeListener};
use rungd_base::calendar::LocalTime;
use rungd_base::random::SplitMix64;
use rungd_engine::isa::Real;
use rungd_engine::{Cell, Image, Layout};
use rungd_runtime::exchange::Ticket;

/// One change, before a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RandomEvent {
    /// The scan, from 0.
    pub scan: u64,
    /// The index of the change in the test.
    pub change: usize,
    /// What the generator chose.
    pub draw: RandomDraw,
    /// The new content of the cell, which follows from it and from the content before.
    pub value: i32,
}

/// A choice of the generator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RandomDraw {
    /// A bit goes ON, or OFF.
    Toggle(bool),
    /// A step up, or down.
    Walk(bool),
    /// The content to jump to.
    Jump(i32),
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
    drawn_run(stage, test, run, None)
}

/// Makes one run of a test for a listener, which receives the tape.
pub(super) fn heard(
    stage: LoweredSuite,
    test: &RandomTest,
    run: u32,
    listener: Box<dyn TapeListener>,
) {
    drawn_run(stage, test, run, Some(listener));
}

fn drawn_run(
    stage: LoweredSuite,
    test: &RandomTest,
    run: u32,
    listener: Option<Box<dyn TapeListener>>,
) -> (u64, Option<BrokenRun>) {
    let layout = &stage.programs[0].symbols.layout;
    let mut random = generator(test.seed, run);
    let chances = test.changes.iter().map(|change| change.chance);
    let mut schedule = ChangeSchedule::new(chances, &mut random);
    let mut events = Vec::new();
    let drive = RandomDrive { stage, test, scans: test.scans, listener };
    let broken = drive.execute(|scan, image, changes| {
        while let Some(at) = schedule.due(scan, &mut random) {
            let change = &test.changes[at];
            let draw = drawn(layout, change, image, &mut random);
            let value = moved(layout, change, image, draw);
            events.push(RandomEvent { scan, change: at, draw, value });
            changes.push((at, value));
        }
    });
    let scans = broken.map_or(test.scans, |broken_run| broken_run.scan + 1);
    (scans, broken.map(|BrokenLine { scan, always }| BrokenRun { events, scan, always }))
}

/// Plays events again, in order of their scans and changes. The values follow anew from the
/// choices, and an event that would change nothing is left out, unless the change happens in every
/// scan. Returns the first line of `always` that breaks, with the events up to it. `None`: none
/// breaks, or the generator cannot make these events.
pub(super) fn replay(
    stage: LoweredSuite,
    test: &RandomTest,
    events: &[RandomEvent],
    scans: u64,
) -> Option<BrokenRun> {
    if !is_possible(test, events, scans) {
        return None;
    }
    let layout = &stage.programs[0].symbols.layout;
    let (mut next, mut played) = (0, Vec::new());
    let drive = RandomDrive { stage, test, scans, listener: None };
    let broken = drive.execute(|scan, image, changes| {
        while let Some(event) = events.get(next).filter(|event| event.scan == scan) {
            next += 1;
            let change = &test.changes[event.change];
            let value = moved(layout, change, image, event.draw);
            if value != image.value(change.operand.cell) || change.is_certain() {
                played.push(RandomEvent { value, ..*event });
                changes.push((event.change, value));
            }
        }
    });
    broken.map(|BrokenLine { scan, always }| BrokenRun { events: played, scan, always })
}

/// Whether the generator can make these events: each change once in a scan at most, and in every
/// scan if it is certain.
fn is_possible(test: &RandomTest, events: &[RandomEvent], scans: u64) -> bool {
    let place = |event: &RandomEvent| (event.scan, event.change);
    let once = events.windows(2).all(|two| place(&two[0]) < place(&two[1]));
    let count = |at: usize| events.iter().filter(|event| event.change == at).count() as u64;
    let mut certain = test.changes.iter().enumerate().filter(|(_, change)| change.is_certain());
    once && certain.all(|(at, _)| count(at) == scans)
}

/// A run to execute.
struct RandomDrive<'a> {
    stage: LoweredSuite<'a>,
    test: &'a RandomTest,
    /// The maximum number of scans.
    scans: u64,
    /// Receives the tape.
    listener: Option<Box<dyn TapeListener>>,
}

impl RandomDrive<'_> {
    /// Executes scans until a line of `always` breaks. `changes`: adds the changes before a scan,
    /// from the number of the scan and the image of the scan before.
    fn execute(
        self,
        mut changes: impl FnMut(u64, &Image, &mut Vec<(usize, i32)>),
    ) -> Option<BrokenLine> {
        let RandomDrive { stage, test, scans, listener } = self;
        let inputs =
            test.set.iter().filter_map(|(operand, value)| Some((operand.input?, *value != 0)));
        let others = test.set.iter().filter(|(operand, _)| operand.input.is_none());
        let setup = RigSetup {
            set: others.map(|(operand, value)| (operand.cell, *value)).collect(),
            inputs: inputs.collect(),
            clock_s: LocalTime::SIMULATED_S,
            is_taped: listener.is_some(),
            ..RigSetup::default()
        };
        let mut rig = Rig::new(&stage.programs[0], &setup);
        if let Some(listener) = listener {
            rig.listen(listener);
        }
        let always = &stage.suite.always[0];
        let mut edges: Vec<Vec<bool>> =
            always.iter().map(|condition| vec![false; condition.edges]).collect();
        let mut now = Vec::new();
        for scan in 0..scans {
            if rig.mode() == RigMode::Stop || stage.is_given_up() {
                // If the ladder has stopped the controller, no line can break any more.
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
}

fn give(rig: &mut Rig, operand: &TestOperand, value: i32) {
    match operand.input {
        Some(x) => rig.set_input(x, value != 0),
        None => rig.write(operand.cell, value, Ticket(0)),
    }
}

/// The choice of the generator for a change that happens.
fn drawn(
    layout: &Layout,
    change: &RandomChange,
    image: &Image,
    random: &mut SplitMix64,
) -> RandomDraw {
    let is_real = is_real(layout, change.operand.cell);
    match change.motion {
        RandomMotion::Toggle => RandomDraw::Toggle(image.value(change.operand.cell) == 0),
        RandomMotion::Walk { .. } => RandomDraw::Walk(random.next() >> 63 == 1),
        RandomMotion::Jump { low, high } if is_real => {
            // 53 random bits: the precision of a binary64 between 0 and 1.
            let to = low + (high - low) * ((random.next() >> 11) as f64 / (1_u64 << 53) as f64);
            RandomDraw::Jump(Real::stored(to).real.cell())
        }
        RandomMotion::Jump { low, high } => {
            let count = (high - low) as u64 + 1;
            RandomDraw::Jump((low + (random.next() % count) as f64) as i32)
        }
    }
}

/// The content of an operand after a change, by the choice of the generator.
fn moved(layout: &Layout, change: &RandomChange, image: &Image, draw: RandomDraw) -> i32 {
    let now = image.value(change.operand.cell);
    match (draw, change.motion) {
        (RandomDraw::Jump(to), _) => to,
        // A bit that changes in every scan always toggles.
        (RandomDraw::Toggle(_), _) if change.is_certain() => i32::from(now == 0),
        (RandomDraw::Toggle(on), _) => i32::from(on),
        (RandomDraw::Walk(up), RandomMotion::Walk { low, high, step }) => {
            let step = if up { step } else { -step };
            match is_real(layout, change.operand.cell) {
                true => {
                    let now = f64::from(Real::of_cell(now).number());
                    Real::stored((now + step).clamp(low, high)).real.cell()
                }
                false => (f64::from(now) + step).clamp(low, high) as i32,
            }
        }
        (RandomDraw::Walk(_), RandomMotion::Toggle | RandomMotion::Jump { .. }) => now,
    }
}

fn is_real(layout: &Layout, cell: Cell) -> bool {
    matches!(cell, Cell::Word(word) if layout.is_real(word))
}
