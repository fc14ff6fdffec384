//! The ways between the Stages of a Program: which instruction leads from where to where.

use crate::isa::StageId;
use crate::resolve::program::{Action, Block, Program};
use crate::source::span::Located;

/// A way from one Stage to another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StageJump {
    /// The Stage that it leaves; `None`: the Program's own rungs, or another block's.
    pub from: Option<String>,
    /// The Stages that it waits for, of a SGCONVRG.
    pub waits_for: Vec<String>,
    /// The Stages that it turns ON; of SGRST the Stage that it turns OFF; of EXIT none.
    pub to: Vec<String>,
    /// The mnemonic.
    pub by: &'static str,
    /// The rung: its name, or its number.
    pub rung: String,
}

/// The ways between the Stages of a block, in file order.
pub(super) fn jumps(program: &Program, block: &Block) -> Vec<StageJump> {
    let mut all = Vec::new();
    if block.stages.is_empty() {
        return all;
    }
    let names = |stages: &[Located<StageId>]| -> Vec<String> {
        stages.iter().map(|stage| program.stage(stage.value).name.clone()).collect()
    };
    for part in program.parts().filter(|part| part.block.id == block.id) {
        let from = part.stage.map(|stage| stage.name.clone());
        for (number, rung) in (1..).zip(part.rungs) {
            for (_, instruction) in rung.instructions() {
                let (waits_for, to) = match &instruction.action {
                    Action::Jump { stages } => (Vec::new(), names(stages)),
                    Action::StageOn { stage } | Action::StageOff { stage } => {
                        (Vec::new(), names(&[*stage]))
                    }
                    Action::Converge { stages, to } => (names(stages), names(&[*to])),
                    Action::Exit => (Vec::new(), Vec::new()),
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
                    | Action::Entask { .. }
                    | Action::Stop => continue,
                };
                let by = instruction.mnemonic.spec().name;
                let rung = rung.name.clone().unwrap_or_else(|| number.to_string());
                all.push(StageJump { from: from.clone(), waits_for, to, by, rung });
            }
        }
    }
    all
}
