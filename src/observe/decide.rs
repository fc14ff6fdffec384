//! Whether the execution of an instruction decides the value of the cell that it writes.
//!
//! An execution that changes the value always decides it. These rules are for executions that do
//! not change the value.

use crate::isa::{Address, Bit, Flag, Structure, Word};
use crate::resolve::instruction::{Coil, CountDirection};
use crate::resolve::program::{Action, Value};
use crate::source::span::Located;

/// When an execution decides a value that it does not change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Decides {
    /// Never: it leaves this member of its structure alone.
    LeavesAlone,
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
        Action::Sensaphone { counts, n: _, preset } => sensaphone(*counts, *preset, written),
        // RES does not touch PRE.
        Action::Reset { .. } if is_preset(written) => Decides::LeavesAlone,
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

/// CTU and CTD share a counter. Both write `DN`; each writes its own enable bit, a preset that is a
/// word to `PRE`, and the count and the flags of a wrap when it counts.
fn sensaphone(
    counts: CountDirection,
    preset: Option<Located<Value>>,
    written: Option<Address>,
) -> Decides {
    let flag = match written {
        Some(Address::Bit(Bit::Flag(Structure::Sensaphone(_), flag))) => flag,
        Some(Address::Word(Word::Pre(_))) => {
            let is_word = preset.is_some_and(|preset| match preset.value {
                Value::Const(..) | Value::Real(_) => false,
                Value::Word(_) | Value::Element(_) => true,
            });
            return if is_word { Decides::Always } else { Decides::LeavesAlone };
        }
        Some(Address::Bit(_) | Address::Word(_) | Address::Structure(_)) | None => {
            return Decides::ByChange;
        }
    };
    let own = match counts {
        CountDirection::Up => Flag::Cu,
        CountDirection::Down => Flag::Cd,
    };
    match flag {
        Flag::Dn => Decides::Always,
        Flag::Cu | Flag::Cd if flag == own => Decides::Always,
        Flag::Cu | Flag::Cd => Decides::LeavesAlone,
        Flag::Done
        | Flag::Reset
        | Flag::Zero
        | Flag::DnDone
        | Flag::Timing
        | Flag::Ov
        | Flag::Un => Decides::ByChange,
    }
}

fn is_preset(written: Option<Address>) -> bool {
    matches!(written, Some(Address::Word(Word::Pre(_))))
}
