//! The events that `[prove]` of a test file or `--events` asks for, as those of a model.
//!
//! `question` and `equal` call it. What a new process restores is what the plan of retentive memory
//! restores, asked about the program of the model itself.

use crate::events::{DownTime, KeptLimits, ModelEvents, RememberedCell, RetainedCell, ScanEvent};
use crate::explore::effects::{EffectCells, Effects};
use rungd_engine::isa::{Address, Bit, BlockId, Word, WordSpace, status};
use rungd_engine::{BitCell, Cell, EngineProgram, KeptCells, Transfer, WordCell};
use rungd_lab::testing::{ProofEvent, Suite};
use rungd_language::lower::judged::JudgeBlocks;
use rungd_language::lower::lower;
use rungd_language::resolve::program::Program;
use rungd_language::resolve::range::Range;
use rungd_state::retain::RetainPlan;
use rungd_state::retain::plan::{MemoryCount, RestoredCell};

/// `$DownSeconds`.
pub(crate) const DOWN_SECONDS: Address =
    Address::Word(Word::Space(WordSpace::Dst, status::dst::DOWN_SECONDS));

/// What the events are about.
pub(crate) struct EventQuestion<'a> {
    pub asked: &'a [ProofEvent],
    /// What is retained, besides Stages.
    pub retain: &'a [Range],
    /// Whether a power cut may find an image that is older than the last scan.
    pub has_older_images: bool,
    /// Whether something reads `$DownSeconds`.
    pub reads_down_seconds: bool,
    /// The block that is no part of the controller.
    pub observer: Option<BlockId>,
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
        let cell = |address: &Address| code.layout.cell(*address);
        let remembered = self.remembered.iter().filter_map(|(place, kept)| {
            let is_of_device = matches!(place, Address::Bit(Bit::Device(..)));
            Some(RememberedCell { place: cell(place)?, kept: cell(kept)?, is_of_device })
        });
        let remembered = remembered.collect();
        let observed = self.observer.map_or(Vec::new(), |block| written_by(code, block));
        let (has_image, retained) = self.retained(code, keeps_images);
        let has_age = has_image && kinds.iter().any(|event| event.begins_process());
        let down = (self.reads_down_seconds && has_age).then(|| {
            let word = code.layout.word(Word::Space(WordSpace::Dst, status::dst::DOWN_SECONDS));
            DownTime { word, next: fresh_word(code) }
        });
        ModelEvents {
            kinds,
            has_image,
            retained,
            image_is_final: keeps_images.then(|| fresh_bit(code)),
            observer: self.observer,
            observed,
            remembered,
            down,
        }
    }

    /// The events among which each scan chooses.
    fn kinds(&self) -> Vec<ScanEvent> {
        let asked = |event| self.asked.contains(&event);
        let mut kinds = Vec::new();
        if asked(ProofEvent::PowerCut) {
            kinds.push(ScanEvent::PowerCut);
            if self.has_older_images {
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
        let plan = RetainPlan::new(self.retain, self.program, &symbols);
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
    let interval_us = u64::from(controller.retention.interval_ms) * 1000;
    retains(suite) && interval_us > controller.period.us()
}

/// Whether a controller retains anything.
pub(crate) fn retains(suite: &Suite) -> bool {
    let controller = &suite.programs[0].controller;
    !controller.retain.is_empty() || !controller.retained_stages.is_empty()
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
    let mut all: Vec<u32> = written.flat_map(|op| effects.effect(&op).writes).collect();
    all.sort_unstable();
    all.dedup();
    let cell = |number: u32| match number.checked_sub(numbers.bits) {
        Some(word) => Cell::Word(WordCell(word)),
        None => Cell::Bit(BitCell(number)),
    };
    all.into_iter().map(cell).collect()
}
