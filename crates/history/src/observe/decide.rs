//! Whether the execution of an instruction decides the value of the cell that it writes.
//!
//! An execution that changes the value always decides it. These rules are for executions that do
//! not change the value.

use rungd_engine::isa::{Address, Bit, Flag, Mnemonic, OperandRole, Structure, Word};
use rungd_language::resolve::program::{Instruction, Value};

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
pub(super) fn decides(instruction: &Instruction, written: Option<Address>) -> Decides {
    if let Some(Address::Bit(Bit::Space(rungd_engine::isa::BitSpace::St, _))) = written {
        // The status bit of an error.
        return Decides::ByChange;
    }
    match instruction.acting_role() {
        Some(OperandRole::Owns) if instruction.owned_sensaphone().is_some() => {
            sensaphone(instruction, written)
        }
        Some(OperandRole::Drives | OperandRole::Owns) => Decides::Always,
        // RES does not touch PRE.
        Some(OperandRole::Resets) if is_preset(written) => Decides::LeavesAlone,
        Some(
            OperandRole::TurnsOn
            | OperandRole::TurnsOff
            | OperandRole::Stores
            | OperandRole::Resets,
        ) => Decides::WhileOn,
        Some(
            OperandRole::Reads
            | OperandRole::Changes
            | OperandRole::Starts
            | OperandRole::Enables
            | OperandRole::Calls
            | OperandRole::Stops
            | OperandRole::Enters
            | OperandRole::Awaits,
        )
        | None => Decides::ByChange,
    }
}

/// CTU and CTD share a counter. Both write `DN`; each writes its own enable bit, a preset that is a
/// word to `PRE`, and the count and the flags of a wrap when it counts.
fn sensaphone(instruction: &Instruction, written: Option<Address>) -> Decides {
    let flag = match written {
        Some(Address::Bit(Bit::Flag(Structure::Sensaphone(_), flag))) => flag,
        Some(Address::Word(Word::Pre(_))) => {
            let is_word = instruction.preset().is_some_and(|preset| match preset.value {
                Value::Const(..) | Value::Real(_) => false,
                Value::Word(_) | Value::Element(_) => true,
            });
            return if is_word { Decides::Always } else { Decides::LeavesAlone };
        }
        Some(Address::Bit(_) | Address::Word(_) | Address::Structure(_)) | None => {
            return Decides::ByChange;
        }
    };
    let own = if instruction.mnemonic == Mnemonic::Ctd { Flag::Cd } else { Flag::Cu };
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
