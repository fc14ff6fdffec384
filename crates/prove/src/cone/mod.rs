//! The cone of a question: the part of a model on which the judged and the assumed bits depend.
//!
//! `rungd prove` makes it once for a question, and both ways decide the question about it. What an
//! operation reads and writes, and which control instructions decide whether it executes, is said
//! by the engine's slice (`EngineProgram::slice`). In every scan the bits of the question have
//! the same values in the cone and in the whole model, for all inputs; all other cells of the cone
//! are meaningless. The cone has the cells of its model, with the same numbers.
//!
//! Within an element no operation changes its place. A batch of a slice is kept whole, so the
//! program is first split into batches of one operation each (`program`); what remains is joined
//! again. So the program of a cone has no MATHs in columns.

mod program;

pub(crate) use program::split;

use std::sync::OnceLock;

use crate::encode::encode;
use crate::gates::Gates;
use crate::model::{Path, ProofModel};
use rungd_engine::isa::Bit;
use rungd_engine::{BitCell, Cell, ResumeBits};

/// The cone of some bits of a model.
#[derive(Clone, Debug)]
pub struct Cone {
    /// The model with the operations and inputs on which its bits depend.
    pub model: ProofModel,
    /// The number of its operations, and of those of the whole model.
    pub operations: Share,
    /// The number of its inputs, and of those of the whole model.
    pub inputs: Share,
    /// For each input of the whole model: its place in the cone's.
    places: Vec<Option<usize>>,
    /// The values of the inputs that it does not have.
    resting: Vec<i32>,
    /// Its gates, once they were asked for.
    gates: OnceLock<Gates>,
}

/// The size of a part, and of the whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Share {
    pub kept: usize,
    pub all: usize,
}

impl Cone {
    /// The gates of its scan. They are made once: the hash of the question and its solver need
    /// them.
    pub(crate) fn gates(&self) -> &Gates {
        self.gates.get_or_init(|| encode(&self.model))
    }

    /// Whether an input of the whole model is one of the cone's.
    pub(crate) fn has_input(&self, at: usize) -> bool {
        self.places[at].is_some()
    }

    /// The path of the whole model for a path of the cone: inputs outside of the cone rest
    /// ([`ProofModel::resting`]).
    pub fn widened(&self, path: &Path) -> Path {
        let widened = |scan: &Vec<i32>| {
            let value = |(place, resting): (&Option<usize>, &i32)| match place {
                Some(place) => scan[*place],
                None => *resting,
            };
            let inputs = self.places.iter().zip(&self.resting).map(value);
            inputs.chain(scan[self.model.inputs.len()..].iter().copied()).collect()
        };
        Path { scans: path.scans.iter().map(widened).collect() }
    }
}

/// The cone of some judged bits. The assumed bits are in every cone, because they restrict the
/// inputs; so is STOP, because it ends all paths.
pub fn cone(model: &ProofModel, bits: &[BitCell]) -> Cone {
    let split = split(&model.code);
    let asked = bits.iter().chain(&model.assumed).map(|bit| Cell::Bit(*bit));
    let slice = split.slice(&asked.collect::<Vec<_>>());
    let (mut inputs, mut places) = (Vec::new(), Vec::new());
    for input in &model.inputs {
        let down = model.events.down.filter(|down| input.cell == Cell::Word(down.next));
        let known_by = |bit| model.stage_starts.iter().find_map(|one| one.known_by(&split, bit));
        let is_kept = slice.knows(match (down, input.cell) {
            (Some(down), _) => Cell::Word(down.word),
            (None, Cell::Bit(bit)) => known_by(bit).unwrap_or(input.cell),
            (None, Cell::Word(_) | Cell::WordBit(_)) => input.cell,
        });
        places.push(is_kept.then_some(inputs.len()));
        inputs.extend(is_kept.then_some(*input));
    }
    let runs = |first: u32| {
        let kept = split
            .kept
            .iter()
            .find(|kept| (kept.first..kept.first + ResumeBits::bits(kept.stages)).contains(&first));
        kept.map(|kept| Cell::Bit(split.layout.bit(Bit::Running(kept.program))))
    };
    // What is kept of a Program's Stages is known with the Program.
    let knows = |cell: Cell| {
        let of_stages = if let Cell::Bit(BitCell(bit)) = cell { runs(bit) } else { None };
        slice.knows(of_stages.unwrap_or(cell))
    };
    let events = model.events.of_part(knows);
    let runs = |program| slice.knows(Cell::Bit(split.layout.bit(Bit::Running(program))));
    let stage_starts = model.stage_starts.iter().copied();
    let stage_starts = stage_starts.filter(|start| runs(start.chosen.program)).collect();
    Cone {
        operations: Share { kept: slice.places.len(), all: split.tables.batches.len() },
        inputs: Share { kept: inputs.len(), all: places.len() },
        places,
        resting: model.resting(),
        gates: OnceLock::new(),
        model: ProofModel {
            code: program::joined(slice),
            inputs,
            judged: bits.to_vec(),
            period: model.period,
            late_max: model.late_max,
            start: model.start.clone(),
            assumed: model.assumed.clone(),
            events,
            stage_starts,
        },
    }
}
