//! Random tests: many runs of random changes, judged by `always`.
//!
//! The generator is SplitMix64. The seed of run n is the n-th number of a generator that starts
//! with the `seed` of the test, so every run can be repeated alone. A run is a list of
//! [`RandomEvent`]s; `shrink` makes a failing list short. A replay of such a list draws nothing,
//! but moves each operand by the rule of the test: every run that is replayed is one that the
//! generator could have made.

use super::change_schedule::ChangeSchedule;
use super::judge::Judge;
use super::lowered_suite::LoweredSuite;
use super::random_world::{RandomDraw, RandomWorld};
use super::suite::{Incident, RandomMotion, RandomSource, RandomTest, TestOperand};
use super::unmoved::UnmovedCells;
use crate::rig::{Rig, RigProgram, TapeListener};
use rungd_base::random::SplitMix64;
use rungd_engine::Cell;
use rungd_engine::isa::Real;

/// One incident or change, before a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RandomEvent {
    /// The scan, from 0.
    pub scan: u64,
    /// The number of the incident or change in the test: incidents come first.
    pub source: usize,
    /// What the generator chose.
    pub draw: RandomDraw,
    /// The new content of the cell of a change, which follows from it and from the content before;
    /// [`STARTED`](super::random_world::STARTED) for a new process that waited in STOP.
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

/// A run that has ended.
pub(super) struct EndedRun {
    /// The number of its scans.
    pub scans: u64,
    /// The failure; `None`: no line of `always` broke.
    pub broken: Option<BrokenRun>,
}

/// Makes one run of a test. Runs count from 0. Takes what moves from `unmoved`.
pub(super) fn run(
    stage: LoweredSuite,
    test: &RandomTest,
    run: u32,
    unmoved: Option<&mut UnmovedCells>,
) -> EndedRun {
    drawn_run(stage, test, run, RandomListeners { unmoved, tape: None })
}

/// Makes one run of a test for a listener, which receives the tape.
pub(super) fn heard(
    stage: LoweredSuite,
    test: &RandomTest,
    run: u32,
    listener: Box<dyn TapeListener>,
) {
    drawn_run(stage, test, run, RandomListeners { unmoved: None, tape: Some(listener) });
}

/// Who hears of a run.
#[derive(Default)]
struct RandomListeners<'a> {
    /// Notes what moves.
    unmoved: Option<&'a mut UnmovedCells>,
    /// Receives the tape.
    tape: Option<Box<dyn TapeListener>>,
}

fn drawn_run(
    stage: LoweredSuite,
    test: &RandomTest,
    run: u32,
    listeners: RandomListeners,
) -> EndedRun {
    let program = &stage.programs[0];
    let mut random = generator(test.seed, run);
    let mut schedule = ChangeSchedule::new(test.chances(), &mut random);
    let mut events = Vec::new();
    let drive = RandomDrive { stage, test, scans: test.scans, listeners };
    let broken = drive.execute(|scan, world| {
        while let Some(source) = schedule.due(scan, &mut random) {
            let draw = drawn(program, test, DrawnSource { source, world }, &mut random);
            let value = moved(program, test.source(source), &world.rig, draw);
            let value = world.happens(source, draw, value).unwrap_or(value);
            events.push(RandomEvent { scan, source, draw, value });
        }
    });
    let scans = broken.map_or(test.scans, |broken_run| broken_run.scan + 1);
    let broken = broken.map(|BrokenLine { scan, always }| BrokenRun { events, scan, always });
    EndedRun { scans, broken }
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
    let program = &stage.programs[0];
    let (mut next, mut played) = (0, Vec::new());
    let drive = RandomDrive { stage, test, scans, listeners: RandomListeners::default() };
    let broken = drive.execute(|scan, world| {
        while let Some(event) = events.get(next).filter(|event| event.scan == scan) {
            next += 1;
            let value = moved(program, test.source(event.source), &world.rig, event.draw);
            if let Some(value) = world.happens(event.source, event.draw, value) {
                played.push(RandomEvent { value, ..*event });
            }
        }
    });
    broken.map(|BrokenLine { scan, always }| BrokenRun { events: played, scan, always })
}

/// Whether the generator can make these events: each source once in a scan at most, and in every
/// scan if it is certain.
fn is_possible(test: &RandomTest, events: &[RandomEvent], scans: u64) -> bool {
    let place = |event: &RandomEvent| (event.scan, event.source);
    let once = events.windows(2).all(|two| place(&two[0]) < place(&two[1]));
    let count = |at: usize| events.iter().filter(|event| event.source == at).count() as u64;
    let mut certain = test.chances().enumerate().filter(|(_, chance)| chance.is_certain());
    once && certain.all(|(at, _)| count(at) == scans)
}

/// A run to execute.
struct RandomDrive<'a> {
    stage: LoweredSuite<'a>,
    test: &'a RandomTest,
    /// The maximum number of scans.
    scans: u64,
    listeners: RandomListeners<'a>,
}

impl RandomDrive<'_> {
    /// Executes scans until a line of `always` breaks. `happen`: makes the incidents and changes
    /// before a scan, from its number.
    fn execute(self, mut happen: impl FnMut(u64, &mut RandomWorld)) -> Option<BrokenLine> {
        let RandomDrive { stage, test, scans, listeners: RandomListeners { mut unmoved, tape } } =
            self;
        let mut world = RandomWorld::new(&stage.programs[0], test, tape);
        if let Some(unmoved) = &mut unmoved {
            unmoved.begin(world.rig.image());
        }
        let mut judge = Judge::new(stage.suite, &world.rig);
        for scan in 0..scans {
            if stage.is_given_up() || !world.continues() {
                // If the ladder has stopped the controller, no line can break any more.
                return None;
            }
            happen(scan, &mut world);
            if world.begins_run() {
                judge.begins_run(&world.rig);
            }
            let is_last = world.rig.scan();
            judge.scanned(&world.rig);
            if let Some(at) = judge.broken_line(&world.rig) {
                return Some(BrokenLine { scan, always: at });
            }
            if let Some(unmoved) = &mut unmoved {
                unmoved.scanned(world.rig.image());
            }
            world.rig.end_scan(is_last);
        }
        None
    }
}

/// An incident or change that happens, and the controller to which it happens.
struct DrawnSource<'a, 't> {
    source: usize,
    world: &'a RandomWorld<'t>,
}

/// The choice of the generator for an incident or change that happens.
fn drawn(
    program: &RigProgram,
    test: &RandomTest,
    DrawnSource { source, world }: DrawnSource,
    random: &mut SplitMix64,
) -> RandomDraw {
    let change = match test.source(source) {
        RandomSource::Change(change) => change,
        RandomSource::Incident(Incident::Device { id, .. }) => {
            return RandomDraw::Lose(!world.is_lost(*id));
        }
        RandomSource::Incident(Incident::PowerCut | Incident::Restart | Incident::Stop) => {
            return RandomDraw::Happens;
        }
    };
    let is_real = is_real(program, &change.operand);
    match change.motion {
        RandomMotion::Toggle => RandomDraw::Toggle(change.operand.value(&world.rig) == 0),
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

/// The content of the operand of a change, by the choice of the generator; 0 for an incident.
fn moved(program: &RigProgram, source: RandomSource, rig: &Rig, draw: RandomDraw) -> i32 {
    let RandomSource::Change(change) = source else { return 0 };
    let now = change.operand.value(rig);
    match (draw, change.motion) {
        (RandomDraw::Jump(to), _) => to,
        // A bit that changes in every scan always toggles.
        (RandomDraw::Toggle(_), _) if change.is_certain() => i32::from(now == 0),
        (RandomDraw::Toggle(on), _) => i32::from(on),
        (RandomDraw::Walk(up), RandomMotion::Walk { low, high, step }) => {
            let step = if up { step } else { -step };
            match is_real(program, &change.operand) {
                true => {
                    let now = f64::from(Real::of_cell(now).number());
                    Real::stored((now + step).clamp(low, high)).real.cell()
                }
                false => (f64::from(now) + step).clamp(low, high) as i32,
            }
        }
        (RandomDraw::Walk(_), RandomMotion::Toggle | RandomMotion::Jump { .. })
        | (RandomDraw::Lose(_) | RandomDraw::Happens, _) => now,
    }
}

fn is_real(program: &RigProgram, operand: &TestOperand) -> bool {
    let layout = program.layout_of(operand.device);
    matches!(operand.cell, Cell::Word(word) if layout.is_real(word))
}
