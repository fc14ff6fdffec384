//! The solver's ways against all states of small systems, one by one.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use super::induction::{Induced, induce};
use super::reach::{Reachability, reach};
use super::solver::Patience;
use super::system::{Gate, KeptBit, ScanSystem, on};
use super::transition::Cube;
use super::unroll::leads;
use super::{Deduced, deduce};
use crate::aig::Literal;
use rungd_base::random::SplitMix64;

fn patience() -> Patience {
    let deadline = Instant::now() + Duration::from_secs(3_600);
    Patience { deadline, flags: [(); 2].map(|()| Arc::new(AtomicBool::new(false))), effort: None }
}

/// A system of a few bits with random gates.
fn random_system(seed: u64) -> ScanSystem {
    let mut random = SplitMix64(seed);
    let mut below = |limit: u64| random.next() % limit;
    let (inputs, kept_count) = (1 + below(3), 2 + below(5));
    let first_gate = 1 + inputs + kept_count;
    let gates = 6 + below(24);
    let mut draw = |bits: u64| Literal(below(2 * bits) as u32);
    let mut gates: Vec<Gate> = (0..gates)
        .map(|at| first_gate + at)
        .map(|bit| Gate { bit: bit as u32, reads: [draw(bit), draw(bit)] })
        .collect();
    let bits = first_gate + gates.len() as u64;
    let kept = (1 + inputs..first_gate).map(|bit| KeptBit {
        bit: bit as u32,
        next: draw(bits),
        init: Some(draw(2).is_inverted()),
    });
    let kept = kept.collect();
    let allowed = if draw(8).node() == 0 { Literal::TRUE } else { !last_and(&gates, draw(bits)) };
    // Some bits of memory at once: what is rare, and takes many scans.
    let mut found = Literal::TRUE;
    for kept in 0..kept_count.min(4) {
        let bit = bits as u32 + kept as u32;
        let reads = [found, Literal(((1 + inputs + kept) as u32) << 1 | draw(2).0 & 1)];
        gates.push(Gate { bit, reads });
        found = Literal(bit << 1);
    }
    if draw(2).is_inverted() {
        found = last_and(&gates, draw(bits));
    }
    let bits = bits as usize + 4;
    ScanSystem { bits, inputs: (1..=inputs as u32).collect(), kept, found, allowed, gates }
}

/// The last gate that is no constant, or another literal.
fn last_and(gates: &[Gate], other: Literal) -> Literal {
    let last = gates.iter().rev().find(|gate| gate.reads.iter().all(|read| read.node() != 0));
    match other.0 % 3 {
        0 => last.map_or(other, |gate| Literal(gate.bit << 1)),
        _ => other,
    }
}

/// The fewest scans after which it is found, by visiting all states.
fn fewest(system: &ScanSystem) -> Option<usize> {
    let init: Vec<bool> = system.kept.iter().map(|kept| kept.init == Some(true)).collect();
    let mut depth = HashMap::from([(init.clone(), 0)]);
    let mut open = VecDeque::from([init]);
    while let Some(state) = open.pop_front() {
        let scans = depth[&state];
        for inputs in 0..1 << system.inputs.len() {
            let mut values = vec![false; system.bits];
            for (at, input) in system.inputs.iter().enumerate() {
                values[*input as usize] = inputs >> at & 1 == 1;
            }
            for (kept, value) in system.kept.iter().zip(&state) {
                values[kept.bit as usize] = *value;
            }
            system.evaluate(&mut values);
            if !on(&values, system.allowed) {
                continue;
            }
            if on(&values, system.found) {
                return Some(scans + 1);
            }
            let next: Vec<bool> = system.kept.iter().map(|kept| on(&values, kept.next)).collect();
            if !depth.contains_key(&next) {
                depth.insert(next.clone(), scans + 1);
                open.push_back(next);
            }
        }
    }
    None
}

/// Whether an invariant holds at the start, is kept, and excludes what is looked for.
fn is_invariant(system: &ScanSystem, cubes: &[Cube]) -> bool {
    let count = system.kept.len();
    let all = (0..1u32 << count).map(|state| (0..count).map(|at| state >> at & 1 == 1).collect());
    let holds = |state: &[bool]| {
        let mut values = vec![false; system.bits];
        let kept = system.kept.iter().zip(state);
        kept.for_each(|(kept, value)| values[kept.bit as usize] = *value);
        cubes.iter().all(|cube| cube.iter().any(|bit| !on(&values, *bit)))
    };
    let init: Vec<bool> = system.kept.iter().map(|kept| kept.init == Some(true)).collect();
    let states: Vec<Vec<bool>> = all.filter(|state: &Vec<bool>| holds(state)).collect();
    holds(&init)
        && states.iter().all(|state| {
            (0..1 << system.inputs.len()).all(|inputs: u32| {
                let mut values = vec![false; system.bits];
                for (at, input) in system.inputs.iter().enumerate() {
                    values[*input as usize] = inputs >> at & 1 == 1;
                }
                for (kept, value) in system.kept.iter().zip(state) {
                    values[kept.bit as usize] = *value;
                }
                system.evaluate(&mut values);
                let next: Vec<bool> =
                    system.kept.iter().map(|kept| on(&values, kept.next)).collect();
                !on(&values, system.allowed) || !on(&values, system.found) && holds(&next)
            })
        })
}

#[test]
fn each_way_agrees_with_visiting_all_states() {
    let (mut never, mut found, mut deep) = (0, 0, 0);
    for seed in 0..3_000 {
        let system = random_system(seed);
        let expected = fewest(&system);
        match (reach(&system, &patience()), expected) {
            (Reachability::Never(invariant), None) => {
                assert!(is_invariant(&system, &invariant), "seed {seed}: {invariant:?}");
                never += 1;
            }
            (Reachability::Found(inputs), Some(scans)) => {
                assert!(inputs.len() >= scans && leads(&system, &inputs), "seed {seed}");
                (found, deep) = (found + 1, deep + usize::from(scans > 3));
            }
            other => panic!("seed {seed}: {other:?}"),
        }
        match (induce(&system, true, 200, &patience()), expected) {
            (Induced::Never(_), None) => {}
            (Induced::Found(inputs), Some(scans)) => assert_eq!(inputs.len(), scans),
            other => panic!("seed {seed}: {other:?}"),
        }
        match (deduce(&system, &patience()), expected) {
            (Deduced::Never(_), None) => {}
            (Deduced::Found(inputs), Some(scans)) => assert_eq!(inputs.len(), scans),
            other => panic!("seed {seed}: {other:?}"),
        }
    }
    assert!(never > 200 && found > 200 && deep > 20, "{never} never, {found} found, {deep} deep");
}
