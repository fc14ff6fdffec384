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
    let Some(part) = InputsOfCone::of(model, target, traced_min) else {
        let cause = StopCause::Combinations;
        return Explored::Stopped { states: 0, depth: 0, cause };
    };
    let InputsOfCone { cone, inputs, traces } = part;
    match StateSearch::new(&cone.model, target, inputs, traces).run(limits) {
        Explored::Found(path) => Explored::Found(cone.widened(&path)),
        ended @ (Explored::All { .. } | Explored::Stopped { .. }) => ended,
    }
}

/// Whether from every state that can be reached some inputs lead to the target.
pub fn explore_can(model: &ProofModel, target: Target, limits: &ExploreLimits) -> Attained {
    let Some(part) = InputsOfCone::of(model, target, TRACED_MIN) else {
        return Attained::Stopped { states: 0, cause: StopCause::Combinations };
    };
    let InputsOfCone { cone, inputs, traces } = part;
    match can::attain(&StateSearch::new(&cone.model, target, inputs, traces), limits) {
        Attained::NotFrom(path) => Attained::NotFrom(cone.widened(&path)),
        answer @ (Attained::Everywhere(_) | Attained::Stopped { .. }) => answer,
    }
}

/// The cone of a question, with its inputs; `None`: they have too many combinations.
struct InputsOfCone {
    cone: Cone,
    inputs: Inputs,
    traces: bool,
}

impl InputsOfCone {
    fn of(model: &ProofModel, target: Target, traced_min: u64) -> Option<InputsOfCone> {
        let mut cone = cone(model, &[target.bit]);
        let inputs = Inputs::new(&cone.model, target)?;
        let traces = inputs.usual() >= traced_min;
        if traces {
            cone.model.code = split(&cone.model.code);
        }
        Some(InputsOfCone { cone, inputs, traces })
    }
}
