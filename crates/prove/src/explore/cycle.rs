//! Whether a bit changes in every scan for ever while the inputs stand still.
//!
//! A survey asks it behind a path that leads to some such scans. With still inputs each state has
//! one next state, so a state that comes again is a cycle.

use std::collections::HashSet;

use super::form::StateForm;
use crate::model::{Path, ProofModel, Run, Target};

/// The maximum number of scans that are executed.
const SCANS: usize = 20_000;

/// Executes a path, then scans with its last inputs, until a state comes again: whether the
/// target's bit has changed in each of them.
pub(crate) fn changes_for_ever(model: &ProofModel, target: Target, path: &Path) -> bool {
    let form = StateForm::new(model, target, &model.begun());
    let mut run = Run::new(model);
    for inputs in &path.scans {
        let outcome = run.scan(inputs);
        if !outcome.is_allowed || outcome.is_last {
            return false;
        }
    }
    let Some(inputs) = path.scans.last() else { return false };
    let mut is_on = run.engine.image().bit(target.bit);
    let mut seen = HashSet::new();
    for _ in 0..SCANS {
        let outcome = run.scan(inputs);
        let now = run.engine.image().bit(target.bit);
        if !outcome.is_allowed || outcome.is_last || now == is_on {
            return false;
        }
        is_on = now;
        let mut state = Vec::new();
        form.save(&run.engine, &mut state);
        if !seen.insert(state) {
            return true;
        }
    }
    false
}
