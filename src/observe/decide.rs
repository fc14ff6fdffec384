//! Whether the execution of an instruction decides the value of the cell that it writes.
//!
//! An execution that changes the value always decides it. These rules are for executions that do
//! not change the value.

use crate::isa::{Address, Bit, Flag, Structure};
use crate::resolve::instruction::Coil;
use crate::resolve::program::Action;

/// When an execution decides a value that it does not change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Decides {
    /// At every execution.
    Always,
    /// While its leg is ON.
    WhileOn,
    /// Never.
    ByChange,
}

/// The rule of an instruction for a bit or word that it writes.
pub(super) fn decides(action: &Action, written: Option<Address>) -> Decides {
    if let Some(Address::Bit(Bit::Space(crate::isa::BitSpace::St, _))) = written {
        // The status bit of an error.
        return Decides::ByChange;
    }
    match action {
        Action::Coil { coil, bit: _ } => match coil {
            Coil::Out | Coil::Pd | Coil::Nd => Decides::Always,
            Coil::Set | Coil::Rst => Decides::WhileOn,
            Coil::Ponoff => Decides::ByChange,
        },
        Action::Counter { .. }
        | Action::UpDownCounter { .. }
        | Action::DelayTimer { .. }
        | Action::Timer { .. } => Decides::Always,
        Action::Sensaphone { .. } => sensaphone(written),
        Action::SetElement { .. }
        | Action::Reset { .. }
        | Action::Store { .. }
        | Action::Math { .. }
        | Action::Copy { .. }
        | Action::Fill { .. } => Decides::WhileOn,
        Action::Shift { .. }
        | Action::Run { .. }
        | Action::Restart { .. }
        | Action::Halt { .. }
        | Action::Exit
        | Action::Entask { .. }
        | Action::Jump { .. }
        | Action::StageOn { .. }
        | Action::StageOff { .. }
        | Action::Converge { .. }
        | Action::Stop => Decides::ByChange,
    }
}

/// CTU and CTD share a counter. Both write `DN`; each writes its own enable bit, and the count when
/// it counts.
fn sensaphone(written: Option<Address>) -> Decides {
    match written {
        Some(Address::Bit(Bit::Flag(Structure::Sensaphone(_), Flag::Dn))) => Decides::Always,
        Some(Address::Bit(_) | Address::Word(_) | Address::Structure(_)) | None => {
            Decides::ByChange
        }
    }
}
