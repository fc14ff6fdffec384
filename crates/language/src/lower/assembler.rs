//! The state of lowering: allotted cells, operations, constants. Used by the other files of
//! `lower`.

use std::collections::HashMap;

use super::alike;
use super::identity::{Identity, LoweringSite, MissedTime, ShiftRegister};
use super::loaded_bits::LoadedBits;
use super::schedule;
use super::sites::Sites;
use super::word_limits::WordLimits;
use crate::resolve::array::{Array, ShiftBits};
use crate::resolve::layers::Layers;
use crate::resolve::program::{Instruction, Program, TagMeaning, Value};
use rungd_base::progress::Progress;
pub use rungd_engine::isa::{
    Address, Bit, BitSpace, BlockId, Mnemonic, NumberMap, StageId, Structure, Word,
};
pub use rungd_engine::ops::{
    ArrayLimits, BitOwn, CellRange, FormulaReads, FormulaStep, Formulas, Math, Op, OpKind,
    StageList, reads,
};
pub use rungd_engine::{
    self as engine, Batch, BitCell, BlockCode, Cell, ElementCode, Layout, PassStep, ResumeBits,
    Tables, WordCell,
};

/// The first status bit, ST0.
const STATUS: Bit = Bit::Space(BitSpace::St, 0);

pub(super) struct Assembler<'p> {
    pub layout: Layout,
    /// The owning instructions of structures; for a Sensaphone counter, its CTU or CTD.
    pub owners: NumberMap<Structure, &'p Instruction>,
    /// The limits of words, from `min` and `max` of all their tags.
    limits: WordLimits,
    /// The current element's operations, in file order.
    ops: Vec<Op>,
    /// The bits of words that need not be loaded again.
    pub loaded: LoadedBits,
    /// The numbers of the subroutines, in file order.
    pub subroutines: NumberMap<BlockId, u32>,
    /// Whether a subroutine may end the execution of the block in whose turn it is.
    pub subroutines_end_blocks: bool,
    window: usize,
    tables: Tables,
    /// The steps of the current element's formulas.
    steps: Vec<FormulaStep>,
    /// The cells that the formulas of MATHs read, by the MATH's number.
    formulas: Vec<FormulaReads>,
    /// The rung of each MATH, by its number, for the log.
    pub maths: Vec<String>,
    bits: u32,
    words: u32,
    constants: NumberMap<i32, u32>,
    initial_bits: Vec<(BitCell, bool)>,
    initial_words: Vec<(WordCell, i32)>,
    /// The names of parts with a state, and the current place in the program.
    pub identity: Identity,
    pub site: LoweringSite,
    /// The index of the current element's first termination.
    terminations_from: u32,
    /// The words with the limits of arrays, by element 0 and the number of elements.
    array_limits: HashMap<(Address, u32), ArrayLimits>,
    /// The origins of operations, if the program is lowered for observation.
    pub sites: Option<Sites>,
    /// The progress of the load.
    pub progress: &'p Progress,
    /// The places of expanded templates.
    pub layers: &'p Layers,
}

impl<'p> Assembler<'p> {
    pub fn new(program: &'p Program, window: usize, progress: &'p Progress) -> Assembler<'p> {
        let (blocks, stages) = (program.blocks.len() as u32, program.stages.len() as u32);
        let is_shift = |(_, one): &(_, &Instruction)| one.mnemonic == Mnemonic::Sr;
        let shifts = program.instructions().filter(is_shift).count() as u32;
        let layout = Layout::new(&program.sizes, blocks, stages).with_shifts(shifts);
        let (kept, layout) = kept_programs(program, layout);
        let mut assembler = Assembler {
            bits: layout.bit_count(),
            words: layout.word_count(),
            layout,
            owners: NumberMap::default(),
            limits: WordLimits::of(program),
            ops: Vec::new(),
            loaded: LoadedBits::default(),
            subroutines: subroutine_numbers(program),
            subroutines_end_blocks: program.subroutines_end_blocks(),
            window,
            tables: Tables::default(),
            steps: Vec::new(),
            formulas: Vec::new(),
            maths: Vec::new(),
            constants: NumberMap::default(),
            initial_bits: Vec::new(),
            initial_words: Vec::new(),
            identity: Identity { kept, ..Identity::new(program) },
            site: LoweringSite::default(),
            terminations_from: 0,
            array_limits: HashMap::new(),
            sites: None,
            progress,
            layers: &program.layers,
        };
        for (_, instruction) in program.instructions() {
            assembler.note_owner(instruction);
        }
        assembler.note_initial_values(program);
        assembler
    }

    /// Records an owner, and the constant preset of a Sensaphone counter for the cold start.
    fn note_owner(&mut self, instruction: &'p Instruction) {
        let Some(structure) = instruction.owned() else { return };
        self.owners.entry(structure).or_insert(instruction);
        if let Structure::Sensaphone(number) = structure
            && let Some(preset) = instruction.preset()
            && let Value::Const(preset, _) = preset.value
        {
            let pre = self.layout.word(Word::Pre(number));
            self.initial_words.push((pre, preset));
        }
    }

    fn note_initial_values(&mut self, program: &Program) {
        for tag in &program.tags {
            let (TagMeaning::Address(address), Some((value, _))) = (tag.meaning, tag.initial)
            else {
                continue;
            };
            match address {
                // A bit of a word has no initial value of its own.
                Address::Bit(Bit::InWord(_)) => {}
                Address::Bit(bit) => self.initial_bits.push((self.layout.bit(bit), value != 0)),
                Address::Word(word) => self.initial_words.push((self.layout.word(word), value)),
                Address::Structure(_) => {}
            }
        }
    }

    /// Allots a private bit.
    pub fn private_bit(&mut self) -> u32 {
        self.bits += 1;
        self.bits - 1
    }

    /// Allots the private bit of an edge history. The termination pass turns it OFF.
    pub fn history(&mut self, text: String) -> BitOwn {
        let cell = self.private_bit();
        self.identity.history(BitCell(cell), &self.site, text);
        self.terminates(PassStep::HistoryOff(cell));
        BitOwn(cell)
    }

    /// Allots the history of an SR's CLK: the termination pass does not change it, and retentive
    /// memory keeps it.
    pub fn shift_history(&mut self, bits: ShiftBits, text: String) -> BitOwn {
        let cell = self.layout.shift_history(self.identity.shifts.len() as u32);
        let block = self.site.element.block;
        self.identity.shifts.push(ShiftRegister { bits, cell, block });
        self.identity.history(cell, &self.site, text);
        BitOwn(cell.0)
    }

    /// Allots the word of the time that timers behind an instruction have missed, if it ends its
    /// subroutine's execution.
    pub fn missed_time(&mut self) -> u32 {
        let cell = self.private_word();
        let block = self.site.element.block;
        self.identity.missed_times.push(MissedTime { cell: WordCell(cell), block });
        cell
    }

    /// The word that holds a constant.
    pub fn constant(&mut self, value: i32) -> u32 {
        if let Some(cell) = self.constants.get(&value) {
            return *cell;
        }
        let cell = self.fixed_word(value);
        self.constants.insert(value, cell);
        cell
    }

    /// Allots a private word with a constant value. A private word that operations write begins
    /// with 0, so only constants have an initial value.
    fn fixed_word(&mut self, value: i32) -> u32 {
        let cell = self.private_word();
        self.initial_words.push((WordCell(cell), value));
        cell
    }

    /// Allots a private word, 0 at the start.
    pub fn private_word(&mut self) -> u32 {
        let cell = self.words;
        self.words += 1;
        cell
    }

    /// The cells of an array; of flags, from the first to the last one.
    pub fn cells(&self, array: Array) -> CellRange {
        let first = match self.layout.cell(array.element(0)) {
            Some(Cell::Bit(BitCell(cell)) | Cell::Word(WordCell(cell))) => cell,
            Some(Cell::WordBit(bit)) => bit.word.0,
            None => unreachable!("arrays are of bits or words"),
        };
        let stride = self.layout.stride(array.element(0));
        CellRange { first, count: (array.count - 1) * stride + 1 }
    }

    /// The limits of the elements of an array of words.
    pub fn array_limits(&mut self, array: Array) -> ArrayLimits {
        let key = (array.element(0), array.count);
        if let Some(limits) = self.array_limits.get(&key) {
            return *limits;
        }
        let words = array.addresses().filter_map(|address| match address {
            Address::Word(word) => Some(self.limits(word)),
            Address::Bit(_) | Address::Structure(_) => None,
        });
        let mut all: Vec<(i32, i32)> = words.collect();
        let each = all.iter().any(|limits| *limits != all[0]);
        all.truncate(if each { all.len() } else { 1 });
        let first = self.words;
        for (low, high) in all {
            self.fixed_word(low);
            self.fixed_word(high);
        }
        let limits = ArrayLimits { first, each };
        self.array_limits.insert(key, limits);
        limits
    }

    /// Stores a MATH for a pass or an ENTASK; returns its index.
    pub fn pick(&mut self, mut math: Math) -> u32 {
        self.lay_rows(std::slice::from_mut(&mut math));
        self.tables.picks.push(math);
        self.tables.picks.len() as u32 - 1
    }

    /// The limits of a word's cell: its range, or the `min` and `max` of its tags.
    pub fn limits(&self, word: Word) -> (i32, i32) {
        self.limits.get(word)
    }

    pub fn op(&mut self, op: Op) {
        let reads = Formulas { reads: &self.formulas, status: self.layout.bit(STATUS).0 };
        self.loaded.follow(&op, reads);
        self.ops.push(op);
        self.note(Sites::operation);
    }

    pub fn terminates(&mut self, termination: PassStep) {
        self.tables.terminations.push(termination);
        self.note(Sites::pass_step);
    }

    /// Records the origin of an operation, if the program is lowered for observation.
    pub fn note(&mut self, note: impl FnOnce(&mut Sites)) {
        if let Some(sites) = &mut self.sites {
            note(sites);
        }
    }

    /// Keeps the steps of a MATH's formula until its element ends, and the number of slots that
    /// it needs; returns the first step and the MATH's number.
    pub fn formula(&mut self, steps: &[FormulaStep], slots: u32) -> (u32, u32) {
        let first = self.steps.len() as u32;
        self.steps.extend(steps);
        self.tables.slots = self.tables.slots.max(slots);
        self.formulas.push(reads(steps));
        self.maths.push(self.site.place.to_string());
        (first, self.formulas.len() as u32 - 1)
    }

    /// Stores the steps of formulas, one formula after the other.
    fn lay_rows(&mut self, maths: &mut [Math]) {
        for math in maths {
            let first = self.tables.steps.len() as u32;
            let steps = &self.steps[math.first as usize..][..math.count as usize];
            self.tables.steps.extend(steps);
            math.first = first;
        }
    }

    /// Stores the steps of formulas with equal numbers of steps: first step 1 of all formulas, then
    /// step 2 of all formulas, and so on.
    fn lay_columns(&mut self, maths: &mut [Math]) {
        let first = self.tables.steps.len() as u32;
        for step in 0..maths[0].count {
            let column = maths.iter().map(|math| self.steps[(math.first + step) as usize]);
            self.tables.steps.extend(column);
        }
        maths.iter_mut().for_each(|math| math.first = first);
    }

    /// Stores the Stages that one instruction lists.
    pub fn stage_list(&mut self, stages: impl Iterator<Item = StageId>) -> StageList {
        let first = self.tables.stage_lists.len() as u32;
        self.tables.stage_lists.extend(stages);
        StageList { first, count: self.tables.stage_lists.len() as u32 - first }
    }

    /// Schedules the current element's operations and ends the element.
    pub fn close_element(&mut self, has_rungs: bool) -> ElementCode {
        self.loaded.clear();
        let first_batch = self.tables.batches.len() as u32;
        let ops = std::mem::take(&mut self.ops);
        let formulas = std::mem::take(&mut self.formulas);
        let all = Formulas { reads: &formulas, status: self.layout.bit(STATUS).0 };
        for batch in schedule::schedule(ops, all, self.window) {
            let kind = batch[0].kind();
            if kind == OpKind::Math {
                self.maths_of(batch, all);
            } else {
                self.batch(kind, batch);
            }
        }
        self.formulas = formulas;
        self.steps.clear();
        let first_termination = self.terminations_from;
        self.terminations_from = self.tables.terminations.len() as u32;
        ElementCode {
            batches: first_batch..self.tables.batches.len() as u32,
            terminations: first_termination..self.terminations_from,
            has_rungs,
        }
    }

    /// Stores a batch of MATHs.
    fn maths_of(&mut self, batch: Vec<Op>, formulas: Formulas) {
        let math = |op| if let Op::Math(math) = op { Some(math) } else { None };
        let maths = batch.into_iter().filter_map(math).collect();
        for mut group in alike::groups(maths, &self.steps, formulas) {
            let kind = if group.in_columns {
                self.lay_columns(&mut group.maths);
                OpKind::Columns
            } else {
                self.lay_rows(&mut group.maths);
                OpKind::Math
            };
            self.batch(kind, group.maths.into_iter().map(Op::Math).collect());
        }
    }

    /// Stores a batch of operations of one kind.
    fn batch(&mut self, kind: OpKind, ops: Vec<Op>) {
        let count = ops.len() as u32;
        let mut first = 0;
        for (at, op) in ops.into_iter().enumerate() {
            let place = self.tables.ops.push(op);
            first = if at == 0 { place } else { first };
        }
        self.tables.batches.push(Batch { kind, first, count });
    }

    pub fn finish(
        self,
        blocks: Vec<BlockCode>,
        stages: Vec<ElementCode>,
        order: Vec<BlockId>,
        subroutines: Vec<BlockId>,
    ) -> engine::EngineProgram {
        engine::EngineProgram {
            layout: self.layout,
            bit_count: self.bits,
            word_count: self.words,
            initial_bits: self.initial_bits,
            initial_words: self.initial_words,
            tables: self.tables,
            blocks,
            stages,
            order,
            subroutines,
            kept: Vec::new(),
        }
    }
}

/// The subroutines, numbered in file order.
fn subroutine_numbers(program: &Program) -> NumberMap<BlockId, u32> {
    program.subroutines().map(|block| block.id).zip(0..).collect()
}

/// The Programs whose Stages are retained, and the layout with their bits.
fn kept_programs(program: &Program, layout: Layout) -> (Vec<ResumeBits>, Layout) {
    let (mut kept, mut count) = (Vec::new(), 0);
    for block in program.blocks.iter().filter(|block| block.retains_stages) {
        let stages = block.stages.len() as u32;
        kept.push(ResumeBits { program: block.id, first: layout.bit_count() + count, stages });
        count += ResumeBits::bits(stages);
    }
    (kept, layout.with_kept(count))
}
