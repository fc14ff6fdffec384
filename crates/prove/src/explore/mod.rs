//! Exploring: visits every state that a model can reach, breadth first, on the engine itself.
//!
//! `rungd prove` calls [`explore`] for each line. It makes the line's cone, and from each state of
//! a depth executes one scan with each combination of the inputs that matter there (`branches`).
//! So the first scan that meets the target is at the end of a shortest path; and where no new state
//! is found, every state was seen.
//! What counts as one state is said in `form`, and there and in its parts stands why states that
//! count as one have the same future.

mod branches;
mod bytes;
mod can;
mod caps;
mod cycle;
pub(crate) mod effects;
mod elements;
mod form;
mod keys;
mod limits;
mod live;
mod ranges;
mod search;
mod trace;

use crate::cone::{Cone, cone, split};
use crate::model::{ProofModel, Target};
use branches::Inputs;
pub use can::Attained;
pub(crate) use cycle::changes_for_ever;
pub use limits::{ExploreLimits, Explored, StopCause};
use search::StateSearch;

/// The number of combinations from which on the inputs that matter are found by tracing scans: a
/// traced scan takes several times as long, and saves others.
const TRACED_MIN: u64 = 16;

/// Looks for a scan that meets the target. The path is one of `model`.
pub fn explore(model: &ProofModel, target: Target, limits: &ExploreLimits) -> Explored {
    explore_traced(model, target, limits, TRACED_MIN)
}

/// Does the same; traces scans from a number of combinations on.
pub fn explore_traced(
    model: &ProofModel,
    target: Target,
    limits: &ExploreLimits,
    traced_min: u64,
) -> Explored {
    let cone = cone(model, &[target.bit]);
    match searched(&cone, target, traced_min, |search| search.run(limits)) {
        Err(cause) => not_begun(cause),
        Ok(Explored::Found(path)) => Explored::Found(cone.widened(&path)),
        Ok(ended @ (Explored::All { .. } | Explored::Stopped { .. })) => ended,
    }
}

/// As [`explore`], for the cone of the target. The path is one of the cone.
pub(crate) fn explore_cone(cone: &Cone, target: Target, limits: &ExploreLimits) -> Explored {
    searched(cone, target, TRACED_MIN, |search| search.run(limits)).unwrap_or_else(not_begun)
}

/// Whether from every state that can be reached some inputs lead to the target. The path is one of
/// the cone of the target.
pub fn explore_can(cone: &Cone, target: Target, limits: &ExploreLimits) -> Attained {
    let attained = searched(cone, target, TRACED_MIN, |search| can::attain(search, limits));
    attained.unwrap_or_else(|cause| Attained::Stopped { states: 0, cause })
}

fn not_begun(cause: StopCause) -> Explored {
    Explored::Stopped { states: 0, depth: 0, cause }
}

/// Searches the states of a cone, or says why it does not begin: its inputs have too many
/// combinations, or the times between its scans differ in whole milliseconds.
fn searched<T>(
    cone: &Cone,
    target: Target,
    traced_min: u64,
    search: impl FnOnce(&StateSearch) -> T,
) -> Result<T, StopCause> {
    if cone.model.period.whole_ms().is_none() {
        return Err(StopCause::Period);
    }
    let inputs = Inputs::new(&cone.model, target).ok_or(StopCause::Combinations)?;
    let traces = inputs.usual() >= traced_min;
    let mut model = cone.model.clone();
    if traces {
        model.code = split(&model.code);
    }
    Ok(search(&StateSearch::new(&model, target, inputs, traces)))
}
