//! The swap of one program for a new one between two scans: the new cell for each old cell.
//!
//! `reload` has the names and makes a [`Transfer`] beforehand; this module uses only numbers. The
//! new engine is ready, with memory as after a cold start. [`Engine::adopt`] runs the termination
//! passes of removed parts in the old engine, and copies the kept state to the new one. It
//! allocates nothing.
//!
//! Behaviour: `docs/semantics.md`, section 4, *Reload*.

use super::events::Element;
use super::eye::NoObserver;
use super::image::{BitCell, WordCell};
use super::layout::{Cell, EARLIER_DST, Layout};
use super::program::{ElementCode, PassStep};
use super::reach::ForcedReach;
use super::record::RECORD;
use super::scan::Engine;
use crate::isa::space::SENSAPHONE_COUNT;
use crate::isa::status::{DST_COUNT, ST_COUNT};
use crate::isa::{
    Bit, BitSpace, BlockId, DeviceBit, DeviceId, StageId, Structure, Word, WordSpace,
};

/// Consecutive cells that keep their values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptCells {
    /// The first cell in the old program.
    pub from: u32,
    /// The first cell in the new program.
    pub to: u32,
    /// Their number.
    pub count: u32,
}

/// A Program that may need its initial Stage ON after the swap.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StageRestart {
    /// The Program's number in the new program.
    pub program: BlockId,
    /// Its initial Stage.
    pub initial: StageId,
    /// The Stages that it loses, by their numbers in the old program.
    pub lost: Vec<StageId>,
    /// Whether it had no Stages before.
    pub had_none: bool,
}

/// The state that a new engine takes over from the old one.
#[derive(Clone, Debug, Default)]
pub struct Transfer {
    /// Bits to copy: public bits by address, then histories, block and Stage bits.
    pub bits: Vec<KeptCells>,
    /// Words to copy: public words by address.
    pub words: Vec<KeptCells>,
    /// Records of structures with a new owner: the record and `.Acc` become as after a cold start.
    pub fresh: Vec<u32>,
    /// Bits set to a new value, after the copies.
    pub new_bits: Vec<(BitCell, bool)>,
    /// Words set to a new value, after the copies.
    pub new_words: Vec<(WordCell, i32)>,
    /// Blocks in both programs: old and new number.
    pub blocks: Vec<(BlockId, BlockId)>,
    /// Stages in both programs: old and new number.
    pub stages: Vec<(StageId, StageId)>,
    /// Subroutines in both programs: their indices in the old and the new list of subroutines.
    pub subroutines: Vec<(u32, u32)>,
    /// New blocks that run from the start.
    pub starting: Vec<BlockId>,
    /// Tasks with a changed interval: the Task's new number, and the new word of the interval.
    pub intervals: Vec<(BlockId, u32)>,
    /// Removed blocks.
    pub gone_blocks: Vec<BlockId>,
    /// Removed instructions: their element, and the index of their termination.
    pub gone: Vec<(Element, u32)>,
    /// Instructions with a state that moved to a different element of their block: old and new
    /// element.
    pub moved: Vec<(Element, Element)>,
    /// Programs that may need their initial Stage.
    pub restages: Vec<StageRestart>,
    /// The public cells that do not keep their number.
    pub renumbered: Renumbered,
}

/// A cell of the old program, and its cell in the new one; `None`: there is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs)]
pub struct RenumberedCell {
    pub from: Cell,
    pub to: Option<Cell>,
}

/// The public cells that do not keep their number, in order.
#[derive(Clone, Debug, Default)]
pub struct Renumbered(Vec<RenumberedCell>);

impl Renumbered {
    /// Makes the list from cells in any order; each cell occurs once.
    pub fn new(mut cells: Vec<RenumberedCell>) -> Renumbered {
        cells.retain(|cell| Some(cell.from) != cell.to);
        cells.sort_unstable();
        Renumbered(cells)
    }

    /// The new cell of a listed cell.
    fn find(&self, cell: Cell) -> Option<Option<Cell>> {
        let at = self.0.binary_search_by_key(&cell, |renumbered| renumbered.from).ok()?;
        Some(self.0[at].to)
    }

    /// The new cell of a cell whose space has the same size in both programs.
    pub fn cell(&self, cell: Cell) -> Option<Cell> {
        match cell {
            Cell::Bit(_) | Cell::Word(_) => self.find(cell).unwrap_or(Some(cell)),
            Cell::WordBit(_) => unreachable!("handled above"),
        }
    }
}

impl Transfer {
    /// The transfer of the public memory that two layouts share, address by address. Stage and
    /// block bits are not in it, because they have names instead of addresses.
    pub fn memory(old: &Layout, new: &Layout) -> Transfer {
        let (bits, words) = (old.shared_bits(new), old.shared_words(new));
        Transfer { bits, words, ..Transfer::default() }
    }

    /// The new element for an element of the old program.
    fn element(&self, old: Element) -> Option<Element> {
        match old {
            Element::Block(id) => {
                let kept = self.blocks.iter().find(|(from, _)| *from == id);
                kept.map(|(_, to)| Element::Block(*to))
            }
            Element::Stage(id) => {
                let kept = self.stages.iter().find(|(from, _)| *from == id);
                kept.map(|(_, to)| Element::Stage(*to))
            }
        }
    }

    /// The new cell of a public cell of the old program.
    pub fn cell(&self, cell: Cell) -> Option<Cell> {
        if let Cell::WordBit(bit) = cell {
            return self.cell(Cell::Word(bit.word)).and_then(|word| bit.with_word(word));
        }
        if let Some(renumbered) = self.renumbered.find(cell) {
            return renumbered;
        }
        let find = |stretches: &[KeptCells], at: u32| {
            let holds = |s: &&KeptCells| (s.from..s.from + s.count).contains(&at);
            stretches.iter().find(holds).map(|s| s.to + (at - s.from))
        };
        match cell {
            Cell::Bit(BitCell(at)) => find(&self.bits, at).map(|at| Cell::Bit(BitCell(at))),
            Cell::Word(WordCell(at)) => find(&self.words, at).map(|at| Cell::Word(WordCell(at))),
            Cell::WordBit(_) => unreachable!("handled above"),
        }
    }
}

impl Layout {
    /// The bits that the old and the new layout share, by space.
    fn shared_bits(&self, new: &Layout) -> Vec<KeptCells> {
        let first =
            |layout: &Layout, space: BitSpace| layout.bit(Bit::Space(space, space.first())).0;
        let mut shared = Vec::new();
        for space in BitSpace::SIZED {
            let count = space.count(self.sizes()).min(space.count(new.sizes()));
            shared.push(KeptCells { from: first(self, space), to: first(new, space), count });
        }
        let (from, to) = (first(self, BitSpace::St), first(new, BitSpace::St));
        shared.push(KeptCells { from, to, count: ST_COUNT });
        let devices = |layout: &Layout| {
            let first = layout.bit(Bit::Device(DeviceId(0), DeviceBit::Ok)).0;
            (first, layout.sizes().devices * DeviceBit::ALL.len() as u32)
        };
        let ((from, old_count), (to, new_count)) = (devices(self), devices(new));
        shared.push(KeptCells { from, to, count: old_count.min(new_count) });
        for (structure, count) in self.structures(new) {
            let record = |layout: &Layout| layout.record(structure) * RECORD as u32;
            let count = count * RECORD as u32;
            shared.push(KeptCells { from: record(self), to: record(new), count });
        }
        shared
    }

    /// The words that the old and the new layout share, by space.
    fn shared_words(&self, new: &Layout) -> Vec<KeptCells> {
        let first =
            |layout: &Layout, space: WordSpace| layout.word(Word::Space(space, space.first())).0;
        let mut shared = Vec::new();
        for space in WordSpace::SIZED {
            let count = space.count(self.sizes()).min(space.count(new.sizes()));
            shared.push(KeptCells { from: first(self, space), to: first(new, space), count });
        }
        // The status words of rungd 0.2 and the later ones are apart.
        for (first, count) in [(0, EARLIER_DST), (EARLIER_DST, DST_COUNT - EARLIER_DST)] {
            let word = Word::Space(WordSpace::Dst, first);
            shared.push(KeptCells { from: self.word(word).0, to: new.word(word).0, count });
        }
        let (from, to) = (self.word(Word::Pre(0)).0, new.word(Word::Pre(0)).0);
        shared.push(KeptCells { from, to, count: SENSAPHONE_COUNT });
        for (structure, count) in self.structures(new) {
            let acc = |layout: &Layout| layout.word(Word::Acc(structure)).0;
            shared.push(KeptCells { from: acc(self), to: acc(new), count });
        }
        shared
    }

    /// For each kind of structure: the first one, and the number that both programs have.
    fn structures(&self, new: &Layout) -> [(Structure, u32); 3] {
        let (old, new) = (self.sizes(), new.sizes());
        [
            (Structure::Counter(0), old.ct.min(new.ct)),
            (Structure::Timer(0), old.t.min(new.t)),
            (Structure::Sensaphone(0), SENSAPHONE_COUNT),
        ]
    }
}

impl Engine {
    /// Takes over the state of `old`, by a transfer made for these two programs: passes run over
    /// removed parts in the old engine, kept state is copied, `forces` (cells of the old program)
    /// stay forced. `running`: whether scans continue. Allocates nothing.
    pub fn adopt(&mut self, old: &mut Engine, transfer: &Transfer, running: bool, forces: &[Cell]) {
        old.terminate_gone(transfer);
        self.copy_memory(old, transfer);
        self.copy_blocks(old, transfer);
        self.move_elements(old, transfer);
        if running {
            for block in &transfer.starting {
                self.machine.mark_started(*block);
            }
        }
        self.restage(old, transfer);
        self.machine.events.clear();
        for cell in forces {
            match (transfer.cell(*cell), *cell) {
                (Some(Cell::Bit(to)), Cell::Bit(from)) => {
                    self.force_bit(to, old.image().bit(from));
                }
                (Some(Cell::Word(to)), Cell::Word(from)) => {
                    self.force_word(to, old.image().word(from));
                }
                _ => {}
            }
        }
        self.show_forces();
    }

    /// Runs the passes of the parts that are not in the new program.
    fn terminate_gone(&mut self, transfer: &Transfer) {
        for block in &transfer.gone_blocks {
            self.machine.pass_block::<ForcedReach>(*block, &mut NoObserver);
        }
        for (at, _) in &transfer.subroutines {
            let caller = self.machine.callers[*at as usize];
            if caller.is_some_and(|caller| transfer.element(caller).is_none()) {
                self.machine.pass_subroutine::<ForcedReach>(*at as usize, &mut NoObserver);
            }
        }
        for (element, at) in &transfer.gone {
            let executed = match element {
                Element::Block(id) => self.machine.blocks[id.0 as usize].executed,
                Element::Stage(id) => self.machine.stages[id.0 as usize].executed,
            };
            if executed {
                let one = *at..*at + 1;
                let code = ElementCode { batches: 0..0, terminations: one, has_rungs: true };
                self.machine.pass::<ForcedReach>(&code, &mut NoObserver);
            }
        }
    }

    fn copy_memory(&mut self, old: &Engine, transfer: &Transfer) {
        let (image, from) = (&mut self.machine.memory.image, &old.machine.memory.image);
        for KeptCells { from: first, to, count } in &transfer.bits {
            let (first, to, count) = (*first as usize, *to as usize, *count as usize);
            image.bits[to..to + count].copy_from_slice(&from.bits[first..first + count]);
        }
        for KeptCells { from: first, to, count } in &transfer.words {
            let (first, to, count) = (*first as usize, *to as usize, *count as usize);
            image.words[to..to + count].copy_from_slice(&from.words[first..first + count]);
        }
        for record in &transfer.fresh {
            let first = *record as usize * RECORD;
            image.bits[first..first + RECORD].fill(0);
            image.words[*record as usize] = 0;
        }
        for (cell, on) in &transfer.new_bits {
            image.bits[cell.0 as usize] = u8::from(*on);
        }
        for (cell, value) in &transfer.new_words {
            image.words[cell.0 as usize] = *value;
        }
    }

    fn copy_blocks(&mut self, old: &Engine, transfer: &Transfer) {
        (self.start_ns, self.scans, self.last) = (old.start_ns, old.scans, old.last);
        let (new, old) = (&mut self.machine, &old.machine);
        (new.now_ns, new.stop_requested) = (old.now_ns, old.stop_requested);
        let now_ms = old.now_ns / 1_000_000;
        // Elements without a state count their time from now, in case they receive one later.
        new.blocks.iter_mut().for_each(|block| block.count_from(now_ms));
        new.stages.iter_mut().for_each(|stage| stage.count_from(now_ms));
        for (from, to) in &transfer.blocks {
            new.blocks[to.0 as usize] = old.blocks[from.0 as usize];
            new.blocks[to.0 as usize].count_from(now_ms);
        }
        for (from, to) in &transfer.stages {
            new.stages[to.0 as usize] = old.stages[from.0 as usize];
            new.stages[to.0 as usize].count_from(now_ms);
        }
        for (from, to) in &transfer.subroutines {
            let caller = old.callers[*from as usize];
            new.callers[*to as usize] = caller.and_then(|caller| transfer.element(caller));
        }
        for (task, word) in &transfer.intervals {
            let every_ms = new.memory.image.words[*word as usize];
            new.blocks[task.0 as usize].change_interval(every_ms, old.now_ns);
        }
    }

    /// Marks elements that receive the state of an element that executed: their pass is still to
    /// come. If such an element does not run, its pass is at its next turn.
    fn move_elements(&mut self, old: &Engine, transfer: &Transfer) {
        for (from, to) in &transfer.moved {
            let executed = match from {
                Element::Block(id) => old.machine.blocks[id.0 as usize].executed,
                Element::Stage(id) => old.machine.stages[id.0 as usize].executed,
            };
            match to {
                Element::Block(id) => self.machine.blocks[id.0 as usize].executed |= executed,
                Element::Stage(id) => {
                    let is_on = self.machine.bit_of(Bit::Stage(*id));
                    let stage = &mut self.machine.stages[id.0 as usize];
                    stage.executed |= executed;
                    stage.pass_due |= executed && !is_on;
                }
            }
        }
    }

    /// Turns the initial Stage ON for a running Program that has no Stage ON after the swap,
    /// because it lost its Stages or had none.
    fn restage(&mut self, old: &Engine, transfer: &Transfer) {
        for StageRestart { program, initial, lost, had_none } in &transfer.restages {
            let machine = &mut self.machine;
            let waits = machine.blocks[program.0 as usize].first_turn;
            let loses = *had_none || lost.iter().any(|id| old.machine.bit_of(Bit::Stage(*id)));
            let mut stages = machine.program.stages_of(*program);
            let none_on = !stages.any(|id| machine.bit_of(Bit::Stage(id)));
            if machine.is_running(*program) && !waits && loses && none_on {
                machine.switch_stage(*initial, true);
            }
            machine.restage_kept(*program, &old.machine, lost);
        }
    }

    /// Touches all memory, so that the scan thread has no page faults.
    pub fn touch(&mut self) {
        let image = &mut self.machine.memory.image;
        for bit in &mut image.bits {
            *bit = std::hint::black_box(*bit);
        }
        for word in &mut image.words {
            *word = std::hint::black_box(*word);
        }
        image.forced_bits.fill(std::hint::black_box(false));
        image.forced_words.fill(std::hint::black_box(false));
    }
}

impl PassStep {
    /// The record of the structure that the step acts on.
    pub fn record(&self) -> Option<u32> {
        match self {
            PassStep::Counter(counter, _) => Some(counter.at),
            PassStep::Timer(timer, _) | PassStep::HoldTimer(timer) => Some(timer.at),
            PassStep::CountUp(counter) | PassStep::CountDown(counter) => Some(counter.at),
            PassStep::BitOff(_)
            | PassStep::WordBitOff(_)
            | PassStep::HistoryOff(_)
            | PassStep::DisableTask(_)
            | PassStep::Pick(_) => None,
        }
    }
}
