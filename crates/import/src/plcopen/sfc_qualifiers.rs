//! When an action goes ON and OFF by a step, for each qualifier; used by `sfc_actions`.

use crate::condition::RungCondition;

/// A step at which an action acts.
pub(super) struct AtStep<'q> {
    pub(super) active: RungCondition,
    pub(super) was: RungCondition,
    pub(super) qualifier: &'q str,
    /// Of L and D: whether the time of the step is one in which the action acts.
    pub(super) in_time: Option<RungCondition>,
}

/// When an action goes ON and OFF by a step.
pub(super) struct ActionTurns {
    pub(super) on: RungCondition,
    pub(super) off: RungCondition,
}

impl AtStep<'_> {
    /// The step begins to be active.
    pub(super) fn begins(&self) -> RungCondition {
        RungCondition::all([self.active.clone(), self.was.clone().opposite()])
    }

    /// The step is active no more.
    pub(super) fn ends(&self) -> RungCondition {
        RungCondition::all([self.was.clone(), self.active.clone().opposite()])
    }

    pub(super) fn turns(&self) -> ActionTurns {
        let in_time = self.in_time.clone().unwrap_or(RungCondition::Constant(true));
        let in_step = RungCondition::all([self.active.clone(), in_time.clone()]);
        match self.qualifier {
            "P" | "P1" => ActionTurns { on: self.begins(), off: not(&self.active, &self.was) },
            "P0" => ActionTurns { on: self.ends(), off: not(&self.was, &self.active) },
            "L" => {
                let late = RungCondition::all([self.active.clone(), in_time.opposite()]);
                ActionTurns { on: in_step, off: RungCondition::any([late, self.ends()]) }
            }
            _ => ActionTurns { on: in_step, off: self.ends() },
        }
    }
}

/// The opposite of one bit without another.
fn not(one: &RungCondition, other: &RungCondition) -> RungCondition {
    RungCondition::any([one.clone().opposite(), other.clone()])
}
