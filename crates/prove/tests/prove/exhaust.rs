//! An exhaustive search, written apart from those of the crate.
//!
//! It keeps whole engines' states and knows nothing of canonical states: two states are one only if
//! all their parts are equal, the time included. Called by the tests that compare ways.

use rungd_engine::{Engine, EngineState};
use rungd_prove::model::{Choice, ProofModel, Run, Target};
use std::collections::BTreeMap;

/// All combinations of values.
pub fn combinations(choices: &[Choice]) -> Vec<Vec<i32>> {
    choices.iter().fold(vec![Vec::new()], |all, input| {
        let longer = |values: Vec<i32>| {
            (input.low..=input.high).map(move |value| [values.clone(), vec![value]].concat())
        };
        all.into_iter().flat_map(longer).collect()
    })
}

/// What the other search has seen: the least number of scans that meets the target, among the
/// paths of at most `depth` scans.
pub struct Exhausted {
    pub found: Option<usize>,
    pub depth: usize,
    /// Whether no state is left from which a scan follows.
    pub is_all: bool,
}

/// Executes all combinations from all states, depth by depth, until about `most` scans are done.
pub fn exhaust(model: &ProofModel, target: Target, most: usize) -> Exhausted {
    let (combinations, mut scans) = (combinations(&model.choices()), 0);
    let mut run = Run::new(model);
    let mut level = vec![EngineState::of(&run.engine)];
    for depth in 0.. {
        if level.is_empty() || scans > most {
            return Exhausted { found: None, depth, is_all: level.is_empty() };
        }
        let mut next = States::new();
        for state in level {
            for inputs in &combinations {
                run.resume(&state, depth as u64);
                let outcome = run.scan(inputs);
                scans += 1;
                if !outcome.is_allowed {
                    continue;
                }
                if target.is_met(run.engine.image()) {
                    return Exhausted { found: Some(depth + 1), depth, is_all: false };
                }
                if !outcome.is_last {
                    run.settle();
                    insert(&mut next, &run.engine);
                }
            }
        }
        level = next.into_values().flatten().collect();
    }
    unreachable!("depths have no end")
}

/// States by their bits. A debug build compares bytes far faster than it hashes them.
type States = BTreeMap<Vec<u8>, Vec<EngineState>>;

fn insert(states: &mut States, engine: &Engine) {
    let alike = states.entry(engine.image().bits().to_vec()).or_default();
    let state = EngineState::of(engine);
    if !alike.contains(&state) {
        alike.push(state);
    }
}
