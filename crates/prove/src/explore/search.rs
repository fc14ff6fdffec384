//! The search itself: level by level, on several threads.
//!
//! Called by `explore`. A level has the states that a number of scans reaches and no smaller number
//! does, in the order in which they are found: by the number of the state before, then by the
//! order of its branches. The threads take parts of a level, and what they find is
//! put together in the order of the parts; so the answer does not depend on them.

use std::collections::HashSet;
use std::ops::Range;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use rungd_engine::{Engine, EngineCall, EngineState};
use rustc_hash::FxBuildHasher;

use super::branches::{Branches, InputSet, Inputs, Packed};
use super::form::StateForm;
use super::keys::key;
use super::limits::{ExploreLimits, Explored, StopCause};
use super::trace::{Needs, ScanTrace};
use crate::events::{Happening, ScanEvent};
use crate::model::{Path, ProofModel, Run, ScanPlace, Target};

/// A set of keys.
type Keys = HashSet<u128, FxBuildHasher>;

/// The number of scans of a level for which threads are not worth their start.
const ALONE_MAX: u64 = 2_000;

/// The number of scans between two looks at the clock.
const SCANS_PER_LOOK: u32 = 512;

/// The memory of a visited state besides its own bytes, at most: its key in a set of keys while
/// that grows, and what leads to it.
const STATE_EXTRA: usize = 60;

/// A search for a target.
pub(super) struct StateSearch<'m> {
    model: &'m ProofModel,
    target: Target,
    inputs: Inputs,
    /// For cones with many inputs.
    needs: Option<Needs>,
    form: StateForm,
    /// The state before the first scan.
    start: EngineState,
    /// The period, ns.
    period_ns: u64,
}

/// The last scan of a way to a state: the number of the state before, and the inputs.
#[derive(Clone, Copy, Debug)]
#[repr(Rust, packed(4))]
pub(super) struct Step {
    pub from: u32,
    pub inputs: Packed,
}

/// The number of the state before the first scan.
const START: u32 = u32::MAX;

/// States of one level.
#[derive(Debug, Default)]
struct StateLevel {
    /// Their bytes.
    bytes: Vec<u8>,
    /// The number of the first one.
    first: u32,
    count: usize,
}

/// What a part of a level leads to.
#[derive(Debug, Default)]
struct Part {
    keys: Vec<u128>,
    bytes: Vec<u8>,
    steps: Vec<Step>,
    /// The first step that meets the target: nothing behind it was executed.
    met: Option<Step>,
    stopped: Option<StopCause>,
}

/// All states that were found.
#[derive(Debug, Default)]
struct Visited {
    keys: Keys,
    steps: Vec<Step>,
}

impl<'m> StateSearch<'m> {
    /// A search in the model of a cone. If `traces`, its program has batches of one operation each,
    /// and the inputs that matter are found by traces of scans.
    pub fn new(
        model: &'m ProofModel,
        target: Target,
        inputs: Inputs,
        traces: bool,
    ) -> StateSearch<'m> {
        let start = Run::new(model).engine;
        let form = StateForm::new(model, target, &start);
        let asked = model.assumed.iter().chain([&target.bit]).map(|bit| bit.0);
        let at_end = form.cells(model.code.bit_count).chain(asked).collect();
        StateSearch {
            needs: traces.then(|| Needs::new(model, at_end)),
            form,
            start: EngineState::of(&start),
            period_ns: model.period_ns(),
            model,
            target,
            inputs,
        }
    }

    /// The length of a state, bytes.
    pub fn state_size(&self) -> usize {
        self.form.size
    }

    /// The values of inputs.
    pub fn unpack(&self, inputs: Packed) -> Vec<i32> {
        self.inputs.unpack(inputs)
    }

    /// Visits all states, or up to the limits.
    pub fn run(&self, limits: &ExploreLimits) -> Explored {
        let mut scanners: Vec<StateScanner> =
            (0..limits.threads.max(1)).map(|_| StateScanner::new(self)).collect();
        let mut visited = Visited::default();
        let mut level = StateLevel { bytes: Vec::new(), first: START, count: 1 };
        let mut depth = 0;
        loop {
            let states = visited.steps.len() as u64;
            let memory = limits.memory.saturating_sub(visited.memory() + level.bytes.len());
            let (taken, visited_keys) = (AtomicUsize::new(0), &visited.keys);
            let here = LevelLimits { all: limits, memory, taken: &taken, visited: visited_keys };
            let parts = self.parts(&level, &mut scanners, here);
            if let Some(step) = parts.iter().find_map(|part| part.met) {
                return Explored::Found(self.path(&visited, step));
            }
            if let Some(cause) = parts.iter().find_map(|part| part.stopped) {
                return Explored::Stopped { states, depth, cause };
            }
            level = visited.add(parts, self.form.size);
            if level.count == 0 {
                return Explored::All { states, depth };
            }
            if visited.is_full() {
                let cause = StopCause::Memory;
                return Explored::Stopped { states: states + level.count as u64, depth, cause };
            }
            depth += 1;
            let found = states + level.count as u64;
            if limits.states.is_some_and(|most| found > most)
                || limits.depth.is_some_and(|most| depth >= most)
            {
                let cause = StopCause::Limit;
                return Explored::Stopped { states: found, depth, cause };
            }
        }
    }

    /// What the parts of a level lead to, in the order of the parts.
    fn parts(
        &self,
        level: &StateLevel,
        scanners: &mut [StateScanner],
        limits: LevelLimits,
    ) -> Vec<Part> {
        let scans = (level.count as u64).saturating_mul(self.inputs.usual());
        if scanners.len() == 1 || scans <= ALONE_MAX {
            return vec![scanners[0].visit(level, 0..level.count, limits)];
        }
        let length = level.count.div_ceil(scanners.len() * 8);
        let shares = LevelShares {
            next: AtomicUsize::new(0),
            end: AtomicUsize::new(level.count.div_ceil(length)),
            length,
        };
        let mut parts: Vec<(usize, Part)> = std::thread::scope(|scope| {
            let threads: Vec<_> = scanners
                .iter_mut()
                .map(|scanner| scope.spawn(|| scanner.visit_shares(level, &shares, limits)))
                .collect();
            let joined = threads.into_iter().map(|thread| thread.join());
            joined.flat_map(|found| found.unwrap_or_else(|panic| resume_unwind(panic))).collect()
        });
        parts.sort_by_key(|(part, _)| *part);
        parts.into_iter().map(|(_, part)| part).collect()
    }

    /// The path whose last step is given.
    fn path(&self, visited: &Visited, last: Step) -> Path {
        let mut scans = Vec::new();
        let mut step = last;
        loop {
            scans.push(self.inputs.unpack(step.inputs));
            if step.from == START {
                scans.reverse();
                return Path { scans };
            }
            step = visited.steps[step.from as usize];
        }
    }
}

/// The parts of a level, as threads take them.
struct LevelShares {
    next: AtomicUsize,
    /// No part from this one on is taken.
    end: AtomicUsize,
    /// The number of states of a part.
    length: usize,
}

/// The limits of a level.
#[derive(Clone, Copy)]
struct LevelLimits<'l> {
    all: &'l ExploreLimits<'l>,
    /// The memory that its new states may take.
    memory: usize,
    /// The memory that they take.
    taken: &'l AtomicUsize,
    /// The states of all levels so far.
    visited: &'l Keys,
}

impl LevelLimits<'_> {
    /// The cause to stop, if there is one: looks at the clock.
    fn reached(&self) -> Option<StopCause> {
        if self.all.deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            return Some(StopCause::Time);
        }
        (self.all.stop)().then_some(StopCause::Asked)
    }

    /// Takes memory.
    fn take(&self, bytes: usize) -> Option<StopCause> {
        let taken = self.taken.fetch_add(bytes, Ordering::Relaxed) + bytes;
        (taken > self.memory).then_some(StopCause::Memory)
    }
}

impl Visited {
    /// The memory that the states take, but for those of the newest level.
    fn memory(&self) -> usize {
        self.steps.len() * STATE_EXTRA
    }

    /// Whether a further state can have a number.
    fn is_full(&self) -> bool {
        self.steps.len() >= START as usize
    }

    /// Adds what the parts of a level have found; returns the next level.
    fn add(&mut self, parts: Vec<Part>, size: usize) -> StateLevel {
        let mut level = StateLevel { first: self.steps.len() as u32, ..StateLevel::default() };
        for Part { keys, bytes, steps, .. } in parts {
            for ((key, step), state) in keys.iter().zip(steps).zip(bytes.chunks_exact(size)) {
                if !self.is_full() && self.keys.insert(*key) {
                    self.steps.push(step);
                    level.bytes.extend_from_slice(state);
                    level.count += 1;
                }
            }
        }
        level
    }
}

/// A thread's engine and working memory.
pub(super) struct StateScanner<'s> {
    search: &'s StateSearch<'s>,
    /// Whether no scan follows the one that has ended.
    pub was_last: bool,
    /// The inputs that mattered in that scan.
    mattered: InputSet,
    /// Whether something measured the time before that scan.
    measures_time: bool,
    /// Whether that scan was the first one.
    is_first: bool,
    engine: Engine,
    branches: Branches<'s>,
    trace: Option<ScanTrace<'s>>,
    /// The memory of a process that finds nothing, if processes may end.
    fresh: Option<Box<EngineState>>,
    /// The keys of the states that its part has found.
    keys: Keys,
    scans: u32,
}

/// How a scan ended.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ScanResult {
    /// Its inputs were not allowed: there is no such scan.
    Refused,
    /// It meets the target.
    Met,
    /// It was the last one.
    Last,
    /// Further scans follow.
    Followed,
}

impl<'s> StateScanner<'s> {
    pub fn new(search: &'s StateSearch<'s>) -> StateScanner<'s> {
        let engine = Run::new(search.model).engine;
        let branches = Branches::new(&search.inputs);
        let trace = search.needs.as_ref().map(ScanTrace::new);
        let happens = !search.model.events.kinds.is_empty();
        let fresh = happens.then(|| Box::new(search.model.fresh()));
        StateScanner {
            search,
            was_last: false,
            mattered: 0,
            measures_time: false,
            is_first: true,
            engine,
            branches,
            trace,
            fresh,
            keys: Keys::default(),
            scans: 0,
        }
    }

    /// Visits parts of a level until none is left, or one ends the search.
    fn visit_shares(
        &mut self,
        level: &StateLevel,
        shares: &LevelShares,
        limits: LevelLimits,
    ) -> Vec<(usize, Part)> {
        let mut parts = Vec::new();
        loop {
            let part = shares.next.fetch_add(1, Ordering::Relaxed);
            if part >= shares.end.load(Ordering::Relaxed) {
                return parts;
            }
            let (first, length) = (part * shares.length, shares.length);
            let found = self.visit(level, first..level.count.min(first + length), limits);
            if found.met.is_some() || found.stopped.is_some() {
                shares.end.fetch_min(part, Ordering::Relaxed);
            }
            parts.push((part, found));
        }
    }

    /// Visits states of a level, each with all combinations of inputs that it needs.
    fn visit(&mut self, level: &StateLevel, states: Range<usize>, limits: LevelLimits) -> Part {
        let mut part = Part::default();
        self.keys.clear();
        for at in states {
            let state = level.state(at, self.search.form.size);
            let mut combinations = limits.all.combinations;
            loop {
                let step = self.step(level.first.wrapping_add(at as u32));
                let ended = self.scan(state);
                match ended {
                    ScanResult::Refused | ScanResult::Last => {}
                    ScanResult::Met => part.met = Some(step),
                    ScanResult::Followed => part.stopped = self.add(step, &mut part, limits),
                }
                self.scans += 1;
                if limits.all.scans.is_some_and(|most| u64::from(self.scans) >= most) {
                    part.stopped = part.stopped.or(Some(StopCause::Scans));
                }
                if self.scans.is_multiple_of(SCANS_PER_LOOK) {
                    part.stopped = part.stopped.or_else(|| limits.reached());
                }
                if part.met.is_some() || part.stopped.is_some() {
                    return part;
                }
                if !self.advance() {
                    break;
                }
                combinations -= 1;
                if combinations == 0 {
                    part.stopped = Some(StopCause::Combinations);
                    return part;
                }
            }
        }
        part
    }

    /// The next scan from a state.
    pub fn step(&self, from: u32) -> Step {
        Step { from, inputs: self.branches.packed() }
    }

    /// Goes on to the next combination of inputs that a state needs; returns false after the last.
    pub fn advance(&mut self) -> bool {
        self.branches.advance(self.mattered)
    }

    /// Appends the state after the scan, and after what happened behind it.
    pub fn save(&self, to: &mut Vec<u8>) {
        self.search.form.save(&self.engine, to);
    }

    /// Executes a scan from a state; `None`: from the start.
    pub fn scan(&mut self, state: Option<&[u8]>) -> ScanResult {
        let StateSearch { model, form, .. } = self.search;
        let now_ns = match state {
            Some(state) => {
                self.is_first = false;
                let before_ns = form.load(&mut self.engine, state);
                self.measures_time = form.measures_time(&self.engine);
                // A start of RUN is in time.
                let periods = match self.engine.scans() {
                    0 => 1,
                    _ => u64::from(model.periods(&self.branches.values)),
                };
                before_ns + periods * self.search.period_ns
            }
            None => {
                self.is_first = true;
                let resumes = self.engine.resume(&self.search.start);
                debug_assert!(resumes, "a state of the same program");
                self.measures_time = false;
                model.first_ns()
            }
        };
        let event = model.event(&self.branches.values);
        let is_last = self.engine.stops() || event.is_some_and(ScanEvent::ends_run);
        self.was_last = is_last && !event.is_some_and(ScanEvent::continues);
        let place = ScanPlace { now_ns, is_first: self.is_first };
        model.begin_scan(&mut self.engine, place, &self.branches.values);
        match &mut self.trace {
            Some(trace) => {
                trace.clear();
                self.engine.apply_seen(EngineCall::Execute, trace);
            }
            None => {
                self.engine.execute();
            }
        }
        let image = self.engine.image();
        let ended = match () {
            () if !model.allows(image) => ScanResult::Refused,
            () if self.search.target.is_met(image) => ScanResult::Met,
            () if self.was_last => ScanResult::Last,
            () => ScanResult::Followed,
        };
        self.mattered = self.that_mattered(ended);
        if let Some(fresh) = self.fresh.as_deref().filter(|_| !self.was_last) {
            let next_ns = now_ns + self.search.period_ns;
            let what = Happening { event, is_first: self.is_first, is_last, next_ns };
            model.events.happen(&mut self.engine, fresh, what);
        }
        ended
    }

    /// The inputs that can have mattered in the scan that has ended.
    fn that_mattered(&mut self, ended: ScanResult) -> InputSet {
        let inputs = &self.search.inputs;
        let late = if self.measures_time { inputs.late } else { 0 };
        let read = match &mut self.trace {
            Some(trace) => trace.that_mattered(self.engine.image()),
            None => inputs.that_mattered(&self.engine, ended != ScanResult::Refused),
        };
        // Behind the first scan, all values before it are part of the state.
        let before = if self.is_first { inputs.at_start } else { 0 };
        let event = self.search.model.event(&self.branches.values);
        let down = if event.is_some_and(ScanEvent::begins_process) { inputs.down } else { 0 };
        late | before | inputs.event | down | read & !inputs.at_start
    }

    /// Whether the scan that has ended was as scans should be: in time, and nothing happened.
    pub fn was_ordinary(&self) -> bool {
        let model = self.search.model;
        model.periods(&self.branches.values) == 1 && model.event(&self.branches.values).is_none()
    }

    /// Adds the state that a step has reached to its part, if it is new.
    fn add(&mut self, step: Step, part: &mut Part, limits: LevelLimits) -> Option<StopCause> {
        let before = part.bytes.len();
        self.search.form.save(&self.engine, &mut part.bytes);
        let key = key(&part.bytes[before..]);
        if limits.visited.contains(&key) || !self.keys.insert(key) {
            part.bytes.truncate(before);
            return None;
        }
        part.keys.push(key);
        part.steps.push(step);
        limits.take(STATE_EXTRA + self.search.form.size)
    }
}

impl StateLevel {
    /// The bytes of a state; `None`: it is the start.
    fn state(&self, at: usize, size: usize) -> Option<&[u8]> {
        (self.first != START).then(|| &self.bytes[at * size..(at + 1) * size])
    }
}
