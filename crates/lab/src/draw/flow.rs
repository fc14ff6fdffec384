//! The ways between the Stages of a Program: the instructions that lead from one Stage to another.

use rungd_engine::isa::{Mnemonic, OperandRole, StageId};
use rungd_language::resolve::program::{Block, Program};

/// A way between Stages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StageJump {
    /// The Stage at its start; `None`: it starts in the Program's own rungs.
    pub from: Option<String>,
    /// For a SGCONVRG, the Stages that it waits for.
    pub waits_for: Vec<String>,
    /// The Stages that it turns ON.
    pub to: Vec<String>,
    /// For a SGRST, the Stages that it turns OFF. If `to` and `off` are both empty, the instruction
    /// is an EXIT.
    pub off: Vec<String>,
    /// The mnemonic of the instruction.
    pub by: &'static str,
    /// The name of the rung, or its number.
    pub rung: String,
}

/// The ways between the Stages of a block, in file order.
pub(super) fn jumps(program: &Program, block: &Block) -> Vec<StageJump> {
    let mut all = Vec::new();
    if block.stages.is_empty() {
        return all;
    }
    let name = |stage: StageId| program.stage(stage).name.clone();
    for part in program.parts().filter(|part| part.block.id == block.id) {
        let from = part.stage.map(|stage| stage.name.clone());
        for (number, rung) in (1..).zip(part.rungs) {
            for (_, instruction) in rung.instructions() {
                let names =
                    |role| instruction.operands_with(role).map(|stage| name(stage.value)).collect();
                let (waits_for, off): (_, Vec<String>) =
                    (names(OperandRole::Awaits), names(OperandRole::Stops));
                let to: Vec<String> = instruction.stages_entered().map(name).collect();
                if to.is_empty() && off.is_empty() && instruction.mnemonic != Mnemonic::Exit {
                    continue;
                }
                let by = instruction.mnemonic.spec().name;
                let rung = rung.name.clone().unwrap_or_else(|| number.to_string());
                all.push(StageJump { from: from.clone(), waits_for, to, off, by, rung });
            }
        }
    }
    all
}

impl StageJump {
    /// `Open -> Close: JMP, rung 1`.
    pub(super) fn text(&self) -> String {
        let from = match (&self.from, self.waits_for.is_empty()) {
            (_, false) => self.waits_for.join(" & "),
            (Some(from), true) => from.clone(),
            (None, true) => "the Program's rungs".to_owned(),
        };
        let (by, rung) = (self.by, &self.rung);
        match (self.to.is_empty(), self.off.is_empty()) {
            (false, _) => format!("{from} -> {}: {by}, rung {rung}", self.to.join(" & ")),
            (true, false) => {
                format!("{from} turns {} OFF: {by}, rung {rung}", self.off.join(" & "))
            }
            (true, true) => format!("{from} -> the end: {by}, rung {rung}"),
        }
    }
}
