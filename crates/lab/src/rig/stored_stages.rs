//! Retained Stages that a scenario sets before its first scan: what a process finds of them.
//!
//! `rig` calls it for a new rig. A process that follows another finds its own image (`retained`).

use rungd_engine::{BitCell, Cell, Engine, EngineProgram, ResumeBits};

/// Whether a cell says what is kept of a Program's Stages.
pub(super) fn is_of_stages(code: &EngineProgram, cell: Cell) -> bool {
    let Cell::Bit(bit) = cell else { return false };
    code.kept.iter().any(|kept| is_of(*kept, bit))
}

fn is_of(kept: ResumeBits, BitCell(bit): BitCell) -> bool {
    (kept.first..kept.first + ResumeBits::bits(kept.stages)).contains(&bit)
}

/// Puts what a process finds of retained Stages in memory before its start; `set`: the cells that
/// are set, with their values.
pub(super) fn store_stages(engine: &mut Engine, set: &[(Cell, i32)]) {
    for kept in engine.program().kept.clone() {
        let value = |bit: BitCell| {
            let found = set.iter().find(|(cell, _)| *cell == Cell::Bit(bit));
            found.map(|(_, value)| *value != 0)
        };
        let stages: Vec<Option<bool>> = (0..kept.stages).map(|n| value(kept.stage(n))).collect();
        let has_stages = stages.iter().any(Option::is_some);
        let runs = value(kept.running());
        if runs.is_none() && !has_stages {
            continue;
        }
        let runs = runs.unwrap_or(true);
        let mut put = |bit: BitCell, on: bool| engine.restore(Cell::Bit(bit), i32::from(on));
        put(kept.holds(), true);
        put(kept.running(), runs);
        put(kept.begins(), runs && !has_stages);
        for (n, on) in (0..).zip(stages) {
            put(kept.stage(n), on == Some(true));
        }
    }
}
