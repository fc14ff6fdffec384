//! What may happen to a controller between two scans: a stop, a new process, a power cut.
//!
//! `model` and `explore` let it happen on an engine, by `ModelEvents::happen`; `encode` has gates
//! for it. A new process begins as the daemon does: the retained values of an image, then the
//! passes if the image was taken without them, then the start of RUN. An event is chosen with the
//! scan before it: a stop and a restart make that scan the last one. A controller that waits in
//! STOP has no scan, so that time is left out. What the observer of a test file has is no part of
//! the controller, and goes on.

use rungd_engine::isa::{BlockId, StageId};
use rungd_engine::{BitCell, BlockState, Cell, Engine, EngineState, StageState, WordCell};

/// Something that happens behind a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScanEvent {
    /// The scan is the last one; then RUN begins again.
    Stop,
    /// The scan is the last one; a new process finds the memory that it has left.
    Restart,
    /// A new process after a crash finds the image of the scan.
    PowerCut,
    /// The image of the scan is the newest one that a new process can find.
    KeepImage,
    /// A new process after a crash finds the image that was kept last.
    PowerCutBeforeImage,
}

impl ScanEvent {
    /// Whether it makes the scan the last one.
    pub fn ends_run(self) -> bool {
        matches!(self, ScanEvent::Stop | ScanEvent::Restart)
    }

    /// Whether RUN begins again behind it, also if the scan was the last one.
    pub fn continues(self) -> bool {
        self != ScanEvent::KeepImage
    }

    /// Whether a new process follows.
    pub fn begins_process(self) -> bool {
        !matches!(self, ScanEvent::Stop | ScanEvent::KeepImage)
    }
}

/// What may happen to the controller of a model.
#[derive(Clone, Debug, Default)]
pub struct ModelEvents {
    /// The events among which each scan chooses.
    pub kinds: Vec<ScanEvent>,
    /// Whether anything is retained: then an image exists, and is restored.
    pub has_image: bool,
    /// What an image has.
    pub retained: Vec<RetainedCell>,
    /// Whether the image that was kept last has the passes of a stop; if images may be older than
    /// the last scan.
    pub image_is_final: Option<BitCell>,
    /// The block that is no part of the controller, and what it writes.
    pub observer: Option<BlockId>,
    /// Its cells.
    pub observed: Vec<Cell>,
    /// The cells of `was(x)`, each behind that of x: they begin with memory as started.
    pub remembered: Vec<RememberedCell>,
    /// The time without a process; if something reads it, and an image has the time of its scan.
    pub down: Option<DownTime>,
}

/// `$DownSeconds`: a new process gets the value that was chosen with the scan before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DownTime {
    /// Its word.
    pub word: WordCell,
    /// The word of the chosen value: an input of every scan, which no operation reads.
    pub next: WordCell,
}

impl DownTime {
    /// The greatest value that a process finds, s. A step of a test cannot say it: its times end
    /// at `u32::MAX` ms, so a run that needs a longer one is not confirmed.
    pub(crate) const MAX: i32 = i32::MAX;
}

/// A cell that an image has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RetainedCell {
    /// The cell.
    pub cell: Cell,
    /// The limits outside of which it keeps its value of a cold start.
    pub limits: Option<KeptLimits>,
    /// Its value in the image that was kept last; if images may be older than the last scan.
    pub image: Option<Cell>,
}

/// The limits of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptLimits {
    /// The smallest content.
    pub low: i32,
    /// The largest content.
    pub high: i32,
}

/// A place of `was(x)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RememberedCell {
    /// The cell of x.
    pub place: Cell,
    /// The cell of its value at the end of the scan before.
    pub kept: Cell,
    /// Whether x is a device's: it is OFF when a process starts, and the device connects then.
    pub is_of_device: bool,
}

/// What happens behind a scan of a path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Happening {
    /// The event.
    pub event: Option<ScanEvent>,
    /// Whether it was the first scan of the path, whose image is always kept.
    pub is_first: bool,
    /// Whether it was the last one.
    pub is_last: bool,
    /// The time of the next scan, if RUN begins again with it, ns.
    pub next_ns: u64,
}

impl ModelEvents {
    /// The same for a part of a program; `knows`: whether a cell is in it.
    pub(crate) fn of_part(&self, knows: impl Fn(Cell) -> bool) -> ModelEvents {
        let retained = self.retained.iter().filter(|one| knows(one.cell));
        let remembered = self.remembered.iter().filter(|one| knows(one.kept));
        ModelEvents {
            retained: retained.copied().collect(),
            observed: self.observed.iter().copied().filter(|cell| knows(*cell)).collect(),
            remembered: remembered.copied().collect(),
            down: self.down.filter(|down| knows(Cell::Word(down.word))),
            ..self.clone()
        }
    }
}

/// A cell with its value.
#[derive(Clone, Copy)]
struct CellValue {
    cell: Cell,
    value: i32,
}

/// What goes on over everything that happens to the controller.
struct Untouched {
    cells: Vec<CellValue>,
    block: Option<BlockState>,
}

impl Untouched {
    fn of(engine: &Engine, events: &ModelEvents) -> Untouched {
        let value = |cell: &Cell| CellValue { cell: *cell, value: engine.image().value(*cell) };
        Untouched {
            cells: events.observed.iter().map(value).collect(),
            block: events.observer.map(|block| engine.block_state(block)),
        }
    }

    fn put_back(self, engine: &mut Engine, events: &ModelEvents) {
        self.cells.iter().for_each(|one| engine.restore(one.cell, one.value));
        if let (Some(id), Some(state)) = (events.observer, self.block) {
            engine.put_block_state(id, state);
        }
    }
}

/// The memory and the time with which a process begins.
#[derive(Clone, Copy)]
struct ProcessBegin<'f> {
    fresh: &'f EngineState,
    next_ns: u64,
}

impl ModelEvents {
    /// Lets something happen behind a scan. `fresh`: the memory of a process that finds nothing,
    /// before its start.
    pub(crate) fn happen(&self, engine: &mut Engine, fresh: &EngineState, what: Happening) {
        let (events, Happening { is_last: is_final, next_ns, .. }) = (self, what);
        let event = match what.event {
            Some(event) => event,
            None if what.is_first => ScanEvent::KeepImage,
            None => return,
        };
        if !event.continues() {
            return keep_image(engine, events, is_final);
        }
        let untouched = Untouched::of(engine, events);
        if is_final {
            engine.terminate();
        }
        let keeps = event != ScanEvent::PowerCutBeforeImage || is_final || what.is_first;
        if keeps {
            keep_image(engine, events, is_final);
        }
        match event {
            ScanEvent::Stop | ScanEvent::KeepImage => {}
            ScanEvent::Restart | ScanEvent::PowerCut | ScanEvent::PowerCutBeforeImage => {
                let found = match keeps {
                    true => FoundMemoryValues::present(engine, events, is_final),
                    false => FoundMemoryValues::kept(engine, events),
                };
                self.begin_process(engine, ProcessBegin { fresh, next_ns }, &found);
            }
        }
        engine.start(next_ns);
        untouched.put_back(engine, events);
        for RememberedCell { place, kept, is_of_device } in &events.remembered {
            let is_off = *is_of_device && event.begins_process();
            engine.restore(*kept, if is_off { 0 } else { engine.image().value(*place) });
        }
    }

    /// The memory of a new process, before its start.
    fn begin_process(
        &self,
        engine: &mut Engine,
        ProcessBegin { fresh, next_ns }: ProcessBegin,
        found: &FoundMemoryValues,
    ) {
        let events = self;
        let images = events.retained.iter().filter_map(|one| one.image);
        let images = images.chain(events.image_is_final.map(Cell::Bit));
        let value = |cell: Cell| CellValue { cell, value: engine.image().value(cell) };
        let images: Vec<CellValue> = images.map(value).collect();
        let down = events.down.map(|down| value(Cell::Word(down.next)).value);
        // Nothing is forced: the whole memory is in the cells.
        let (cells, bits, words) = (engine.cells_mut(), fresh.bits(), fresh.words());
        cells.bits[..bits.len()].copy_from_slice(bits);
        cells.words[..words.len()].copy_from_slice(words);
        engine.resume_after(0, false);
        forget_executions(engine, next_ns / 1_000_000);
        images.iter().for_each(|one| engine.restore(one.cell, one.value));
        for (CellValue { cell, value }, retained) in found.cells.iter().zip(&events.retained) {
            let within = |limits: KeptLimits| (limits.low..=limits.high).contains(value);
            if retained.limits.is_none_or(within) {
                engine.restore(*cell, *value);
            }
        }
        if events.has_image && !found.is_final {
            engine.terminate_all();
        }
        if let Some(seconds) = down {
            engine.put_down_seconds(seconds);
        }
    }
}

/// No block has executed: their times begin with the next scan, at this time.
fn forget_executions(engine: &mut Engine, executed_ms: u64) {
    let code = engine.program();
    let (blocks, stages) = (code.blocks.len() as u32, code.stages.len() as u32);
    let subroutines = code.subroutines.len();
    for id in (0..blocks).map(BlockId) {
        engine.put_block_state(id, BlockState { executed_ms, ..BlockState::default() });
    }
    for id in (0..stages).map(StageId) {
        engine.put_stage_state(id, StageState { executed_ms, ..StageState::default() });
    }
    (0..subroutines).for_each(|at| engine.put_caller(at, None));
}

/// The image that a new process finds.
struct FoundMemoryValues {
    /// In the order of [`ModelEvents::retained`].
    cells: Vec<CellValue>,
    /// Whether it has the passes of a stop.
    is_final: bool,
}

impl FoundMemoryValues {
    fn present(engine: &Engine, events: &ModelEvents, is_final: bool) -> FoundMemoryValues {
        let value = |one: &RetainedCell| engine.image().value(one.cell);
        FoundMemoryValues::of(events, value, is_final)
    }

    fn kept(engine: &Engine, events: &ModelEvents) -> FoundMemoryValues {
        let value = |one: &RetainedCell| engine.image().value(one.image.unwrap_or(one.cell));
        let is_final = events.image_is_final.is_some_and(|bit| engine.image().bit(bit));
        FoundMemoryValues::of(events, value, is_final)
    }

    fn of(
        events: &ModelEvents,
        value: impl Fn(&RetainedCell) -> i32,
        is_final: bool,
    ) -> FoundMemoryValues {
        let cells = events.retained.iter();
        let cells = cells.map(|one| CellValue { cell: one.cell, value: value(one) });
        FoundMemoryValues { cells: cells.collect(), is_final }
    }
}

/// The present image is the newest one that a new process can find.
fn keep_image(engine: &mut Engine, events: &ModelEvents, is_final: bool) {
    let Some(flag) = events.image_is_final else { return };
    for one in &events.retained {
        if let Some(image) = one.image {
            engine.restore(image, engine.image().value(one.cell));
        }
    }
    engine.restore(Cell::Bit(flag), i32::from(is_final));
}
