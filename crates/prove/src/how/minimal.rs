//! Takes the changes away that a path does not need, so that an answer names no input without
//! need.
//!
//! Called by `how`. A search gives every input a value in every scan. Here a change is taken away
//! if the path leads to the target without it, the last one first. The number of scans stays.

use std::time::Instant;

use crate::model::{Path, ProofModel, Run, Target};
use rungd_engine::Cell;

/// The number of scans that are executed for one path, at most.
const SCANS_MAX: usize = 500_000;

/// What is written before each scan; `None`: the input keeps its content.
type Changes = Vec<Vec<Option<i32>>>;

/// The path with fewer changes; it still leads to the target. `end`: the end of the time.
pub(super) fn minimal(model: &ProofModel, target: Target, path: Path, end: Instant) -> Path {
    let whole = path.scans.iter().map(|scan| scan.iter().copied().map(Some).collect());
    let Some(mut best) = played(model, target, whole.collect()) else { return path };
    let mut left = SCANS_MAX / path.scans.len().max(1);
    loop {
        let before = best.count;
        for scan in (0..path.scans.len()).rev() {
            for input in 0..model.inputs.len() {
                if best.changes[scan][input].is_none() {
                    continue;
                }
                if left == 0 || Instant::now() >= end {
                    return best.path;
                }
                left -= 1;
                let mut fewer = best.changes.clone();
                fewer[scan][input] = None;
                if let Some(fewer) =
                    played(model, target, fewer).filter(|one| one.count < best.count)
                {
                    best = fewer;
                }
            }
        }
        if best.count == before {
            return best.path;
        }
    }
}

/// A path that was executed.
struct PlayedPath {
    path: Path,
    /// Its changes, without those that change nothing.
    changes: Changes,
    count: usize,
}

/// Executes a path; `None`: it does not lead to the target.
fn played(model: &ProofModel, target: Target, mut changes: Changes) -> Option<PlayedPath> {
    let (mut run, mut path, mut count) = (Run::new(model), Path::default(), 0);
    let last = changes.len();
    for (at, scan) in (1..).zip(&mut changes) {
        let mut values = Vec::with_capacity(scan.len());
        for (input, change) in model.inputs.iter().zip(scan.iter_mut()) {
            let content = content(&run, input.cell).clamp(input.low, input.high);
            *change = change.filter(|value| *value != content);
            count += usize::from(change.is_some());
            values.push(change.unwrap_or(content));
        }
        let outcome = run.scan(&values);
        path.scans.push(values);
        if !outcome.is_allowed || outcome.is_last && at != last {
            return None;
        }
    }
    target.is_met(run.engine.image()).then_some(PlayedPath { path, changes, count })
}

fn content(run: &Run, cell: Cell) -> i32 {
    run.engine.image().value(cell)
}
