//! The events that `[prove]` of a test file asks for, as those of its model.
//!
//! `question` calls it. What a new process restores is what the plan of retentive memory restores,
//! asked about the program of the model itself.

use crate::events::{KeptLimits, ModelEvents, RememberedCell, RetainedCell, ScanEvent};
use crate::explore::effects::{EffectCells, Effects};
use rungd_engine::isa::{Address, Bit, BlockId};
use rungd_engine::{BitCell, Cell, EngineProgram, KeptCells, Transfer, WordCell};
use rungd_lab::testing::{ProofEvent, Suite};
use rungd_language::lower::judged::JudgeBlocks;
use rungd_language::lower::lower;
use rungd_language::resolve::program::Program;
use rungd_state::retain::RetainPlan;
use rungd_state::retain::plan::{MemoryCount, RestoredCell};

/// What the events of a test file are about.
pub(crate) struct EventQuestion<'a> {
    pub suite: &'a Suite,
    /// The program of the model, without its judges.
    pub program: &'a Program,
    pub judges: JudgeBlocks,
    /// The places of `was(x)`, each with that of its value at the end of the scan before.
    pub remembered: &'a [(Address, Address)],
}

impl EventQuestion<'_> {
    /// The events of a model. `code`: its program; it gets the cells of an image that is older than
    /// the last scan.
    pub fn events(&self, code: &mut EngineProgram) -> ModelEvents {
        let kinds = self.kinds();
        if kinds.is_empty() {
            return ModelEvents::default();
        }
        let keeps_images = kinds.contains(&ScanEvent::KeepImage);
        let observer = self.suite.programs[0].view.as_ref();
        let observer = observer.and_then(|view| view.observed().observer);
        let cell = |address: &Address| code.layout.cell(*address);
        let remembered = self.remembered.iter().filter_map(|(place, kept)| {
            let is_of_device = matches!(place, Address::Bit(Bit::Device(..)));
            Some(RememberedCell { place: cell(place)?, kept: cell(kept)?, is_of_device })
        });
        let remembered = remembered.collect();
        let observed = observer.map_or(Vec::new(), |block| written_by(code, block));
        let (has_image, retained) = self.retained(code, keeps_images);
        ModelEvents {
            kinds,
            has_image,
            retained,
            image_is_final: keeps_images.then(|| fresh_bit(code)),
            observer,
            observed,
            remembered,
        }
    }

    /// The events among which each scan chooses.
    fn kinds(&self) -> Vec<ScanEvent> {
        let asked = |event| self.suite.proof.events.contains(&event);
        let mut kinds = Vec::new();
        if asked(ProofEvent::PowerCut) {
            kinds.push(ScanEvent::PowerCut);
            if has_older_images(self.suite) {
                kinds.extend([ScanEvent::KeepImage, ScanEvent::PowerCutBeforeImage]);
            }
        }
        kinds.extend(asked(ProofEvent::Restart).then_some(ScanEvent::Restart));
        kinds.extend(asked(ProofEvent::Stop).then_some(ScanEvent::Stop));
        kinds
    }

    /// Whether anything is retained, and the cells of an image.
    fn retained(&self, code: &mut EngineProgram, keeps_images: bool) -> (bool, Vec<RetainedCell>) {
        let restored = self.restored(code);
        let mut all: Vec<RetainedCell> = Vec::new();
        for RestoredCell { cell, limits } in restored.iter().flatten().copied() {
            if all.iter().any(|known| known.cell == cell) {
                continue;
            }
            let image = keeps_images.then(|| match cell {
                Cell::Word(_) => Cell::Word(fresh_word(code)),
                Cell::Bit(_) | Cell::WordBit(_) => Cell::Bit(fresh_bit(code)),
            });
            let limits = limits.map(|[low, high]| KeptLimits { low, high });
            all.push(RetainedCell { cell, limits, image });
        }
        (restored.is_some(), all)
    }

    /// The cells of the model that a new process restores; `None`: nothing is retained.
    pub fn restored(&self, code: &EngineProgram) -> Option<Vec<RestoredCell>> {
        let (plain, symbols) = lower(self.program);
        let controller = &self.suite.programs[0].controller;
        let plan = RetainPlan::new(&controller.retain, self.program, &symbols);
        if plan.is_empty() {
            return None;
        }
        let sizes =
            MemoryCount { bits: plain.bit_count as usize, words: plain.word_count as usize };
        let transfer = self.judges.transfer(&plain, code);
        let restored = plan.restored_cells(sizes).into_iter();
        let in_model = |one: RestoredCell| RestoredCell { cell: moved(one.cell, &transfer), ..one };
        Some(restored.map(in_model).collect())
    }
}

/// Whether a power cut may find an image that is older than the last scan.
pub(crate) fn has_older_images(suite: &Suite) -> bool {
    let controller = &suite.programs[0].controller;
    let retains = !controller.retain.is_empty() || !controller.retained_stages.is_empty();
    retains && u64::from(controller.retention.interval_ms) * 1000 > controller.period.us()
}

/// The cell of a program with judges for a cell of the same one without them.
fn moved(cell: Cell, transfer: &Transfer) -> Cell {
    let place = |at: u32, all: &[KeptCells]| {
        let kept = all.iter().find(|kept| (kept.from..kept.from + kept.count).contains(&at));
        kept.map_or(at, |kept| at - kept.from + kept.to)
    };
    match cell {
        Cell::Bit(BitCell(bit)) => Cell::Bit(BitCell(place(bit, &transfer.bits))),
        Cell::Word(WordCell(word)) => Cell::Word(WordCell(place(word, &transfer.words))),
        Cell::WordBit(_) => unreachable!("what is retained is whole"),
    }
}

fn fresh_bit(code: &mut EngineProgram) -> BitCell {
    code.bit_count += 1;
    BitCell(code.bit_count - 1)
}

fn fresh_word(code: &mut EngineProgram) -> WordCell {
    code.word_count += 1;
    WordCell(code.word_count - 1)
}

/// The cells that the own rungs of a block write.
fn written_by(code: &EngineProgram, block: BlockId) -> Vec<Cell> {
    let (effects, numbers) = (Effects::new(code), EffectCells { bits: code.bit_count });
    let batches = code.blocks[block.0 as usize].own.batches.clone();
    let batches = batches.map(|at| code.tables.batches[at as usize]);
    let written = batches.flat_map(|batch| code.tables.ops_of(batch));
    let mut all: Vec<u32> = written.flat_map(|op| effects.of(&op).writes).collect();
    all.sort_unstable();
    all.dedup();
    let cell = |number: u32| match number.checked_sub(numbers.bits) {
        Some(word) => Cell::Word(WordCell(word)),
        None => Cell::Bit(BitCell(number)),
    };
    all.into_iter().map(cell).collect()
}
