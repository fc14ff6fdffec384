//! The effects of an instruction on the Stages of its Program. Used by the checks, which follow the
//! transitions between Stages, and by the drawing of these transitions.

use super::instruction::Action;
use crate::isa::StageId;
use crate::source::span::Located;

/// The effects of an instruction on the Stages of its Program.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StageMove<'a> {
    /// The Stages that must be ON.
    pub waits_for: &'a [Located<StageId>],
    /// The Stages that it turns ON.
    pub on: &'a [Located<StageId>],
    /// The Stages that it turns OFF besides its own Stage.
    pub off: &'a [Located<StageId>],
}

impl Action {
    /// Its effects on Stages; most instructions have none.
    pub fn stage_move(&self) -> StageMove<'_> {
        let one = std::slice::from_ref;
        let none = StageMove::default();
        match self {
            Action::Jump { stages } => StageMove { on: stages, ..none },
            Action::StageOn { stage } => StageMove { on: one(stage), ..none },
            Action::StageOff { stage } => StageMove { off: one(stage), ..none },
            Action::Converge { stages, to } => {
                StageMove { waits_for: stages, on: one(to), off: &[] }
            }
            Action::Coil { .. }
            | Action::SetElement { .. }
            | Action::Counter { .. }
            | Action::UpDownCounter { .. }
            | Action::DelayTimer { .. }
            | Action::Timer { .. }
            | Action::Sensaphone { .. }
            | Action::Reset { .. }
            | Action::Store { .. }
            | Action::Math { .. }
            | Action::Copy { .. }
            | Action::Fill { .. }
            | Action::Shift { .. }
            | Action::Run { .. }
            | Action::Restart { .. }
            | Action::Halt { .. }
            | Action::Exit
            | Action::Entask { .. }
            | Action::Stop => none,
        }
    }
}
