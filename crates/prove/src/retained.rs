//! `from = "retained"`: what retentive memory may hold before the first scan.
//!
//! `question` calls it. A retained bit or word that something reads has any value within its limits
//! there; a bit that OUT drives is OFF, because the pass before the first scan turns it OFF. A
//! scenario sets the values by `set`.

use std::collections::HashSet;

use crate::any::readers;
use crate::explore::effects::EffectCells;
use crate::model::FreeInput;
use rungd_engine::isa::Address;
use rungd_engine::{Cell, Engine, EngineProgram, PassStep};
use rungd_lab::rig::RigProgram;
use rungd_lab::testing::{Suite, TestOperand};

/// The retained memory of a test file.
#[derive(Default)]
pub(crate) struct RetainedStart {
    /// What is free before the first scan.
    pub free: Vec<(FreeInput, TestOperand)>,
    /// What is retained, and no proof can vary yet.
    pub unknown: Option<String>,
}

/// What is free before the first scan. `remembered`: the places of `was(x)`.
pub(crate) fn retained(
    suite: &Suite,
    rig: &RigProgram,
    code: &EngineProgram,
    remembered: &[Address],
) -> RetainedStart {
    let mut start = RetainedStart::default();
    if !suite.proof.from_retained {
        return start;
    }
    let controller = &suite.programs[0].controller;
    if !controller.retained_stages.is_empty() {
        start.unknown = Some("`from`: retained Stages are not varied yet".to_owned());
    }
    let (engine, numbers) = (Engine::new(code.clone()), EffectCells { bits: code.bit_count });
    let readers = readers(code);
    let driven: HashSet<Cell> =
        code.tables.terminations.iter().filter_map(PassStep::bit_off).collect();
    let mut seen = HashSet::new();
    for address in controller.retain.iter().flat_map(|range| range.addresses()) {
        let limits = match address {
            Address::Bit(_) => (0, 1),
            Address::Word(word) => rig.symbols.limits(word),
            Address::Structure(_) => {
                let name = rig.symbols.names.name(address);
                start.unknown = Some(format!("`from`: the retained {name} is not varied yet"));
                continue;
            }
        };
        let (Some(cell), Some(own)) = (code.layout.cell(address), rig.symbols.layout.cell(address))
        else {
            continue;
        };
        let is_read = readers.contains_key(&numbers.of(cell));
        if !is_read || driven.contains(&cell) || !seen.insert(cell) {
            continue;
        }
        let name = rig.symbols.names.name(address);
        if remembered.contains(&address) {
            start.unknown = Some(format!("`from`: `was({name})` of a retained value"));
        }
        let (low, high) = limits;
        let cold = engine.image().value(cell);
        let (low, high) = (low.min(cold), high.max(cold));
        let operand = TestOperand { name, cell: own, input: None, device: None };
        start.free.push((FreeInput { cell, low, high, cold: Some(cold) }, operand));
    }
    start
}
