//! Lowers a program with conditions that judge it, for proofs.
//!
//! Called by `rungd-prove`. Two blocks are added that no author can name: one has its turn before
//! all others, the other behind all others. Each condition becomes operations like those of a rung,
//! and stores its value in a private bit. So a proof about such a bit is one about the operations
//! that the engine executes, and nothing judges a condition in a second way.

use super::assembler::Assembler;
use super::identity::LoweringSite;
use super::{NOT_ENDED, lower_blocks, schedule, series, turns};
use crate::resolve::program::{Block, BlockKind, Contact, Program};
use crate::source::span::Span;
use rungd_base::progress::UNASKED;
use rungd_engine::isa::status::st;
pub use rungd_engine::isa::{Address, Bit, BitSpace, BlockId, ElementId, StageId};
pub use rungd_engine::ops::{
    BitWritten, LegPowers, Move, Op, Out, Power, WordRead, WordTarget, WordWritten,
};
pub use rungd_engine::{self as engine, BitCell, Cell, KeptCells, Transfer};

/// What judges a program.
#[derive(Clone, Copy, Debug, Default)]
pub struct Judges<'a> {
    /// The conditions that are evaluated at the start of each scan, behind its inputs. What the
    /// ladder writes has the value of the end of the scan before there.
    pub before: &'a [Contact],
    /// The conditions that are evaluated at the end of each scan, before the passes of a last one.
    pub behind: &'a [Contact],
    /// Bits that are turned OFF at the start of each scan.
    pub cleared: &'a [Bit],
    /// Conditions that are stored in bits at the end of each scan, one after the other, before
    /// those of `behind`.
    pub stored: &'a [StoredCondition],
    /// The places whose values are copied behind these conditions, each with that of its copy.
    pub remembered: &'a [(Address, Address)],
}

/// A condition that is stored in a bit, which a later one and the next scan can read.
#[derive(Clone, Debug)]
pub struct StoredCondition {
    /// The condition.
    pub contact: Contact,
    /// The bit.
    pub bit: Bit,
}

/// A program that judges itself.
#[derive(Clone, Debug)]
pub struct JudgedProgram {
    /// The program and its judges.
    pub code: engine::EngineProgram,
    /// The bits of [`Judges::before`], in the same order.
    pub before: Vec<BitCell>,
    /// The bits of [`Judges::behind`], in the same order.
    pub behind: Vec<BitCell>,
    /// The blocks of the judges.
    pub judges: JudgeBlocks,
}

/// The blocks that judge a program.
#[derive(Clone, Copy, Debug)]
pub struct JudgeBlocks {
    /// It evaluates [`Judges::before`].
    pub first: BlockId,
    /// It evaluates [`Judges::behind`].
    pub last: BlockId,
}

impl JudgeBlocks {
    /// The transfer from a program without judges, as [`lower`](super::lower) makes it, to the same
    /// one that judges itself: everything is kept, the private cells too. Judged programs have the
    /// operations of the ladder first, so its private cells are in the same order; only the bits of
    /// blocks are more.
    pub fn transfer(
        self,
        plain: &engine::EngineProgram,
        judged: &engine::EngineProgram,
    ) -> Transfer {
        let blocks = (0..plain.blocks.len() as u32).map(BlockId);
        let stages = (0..plain.stages.len() as u32).map(StageId);
        let subroutines = 0..plain.subroutines.len() as u32;
        let done = |code: &engine::EngineProgram| code.layout.bit(Bit::Done(BlockId(0))).0;
        let (from, to) = (done(plain), done(judged));
        let count = plain.blocks.len() as u32;
        let judges = judged.blocks.len() as u32 - count;
        let bits = [
            KeptCells { from: 0, to: 0, count: from },
            KeptCells { from, to, count },
            KeptCells {
                from: from + count,
                to: to + count + judges,
                count: plain.bit_count - from - count,
            },
        ];
        Transfer {
            bits: bits.into(),
            words: vec![KeptCells { from: 0, to: 0, count: plain.word_count }],
            blocks: blocks.map(|id| (id, id)).collect(),
            stages: stages.map(|id| (id, id)).collect(),
            subroutines: subroutines.map(|at| (at, at)).collect(),
            starting: vec![self.first, self.last],
            ..Transfer::default()
        }
    }
}

/// Lowers a program and its judges.
pub fn lower_judged(program: &Program, judges: Judges) -> JudgedProgram {
    let mut whole = program.clone();
    let first = added_block(&mut whole, BlockKind::TopOfScan);
    let last = added_block(&mut whole, BlockKind::BottomOfScan);
    let mut assembler = Assembler::new(&whole, schedule::WINDOW, &UNASKED);
    let (mut blocks, stages) = lower_blocks(&mut assembler, &whole.blocks).expect(NOT_ENDED);
    assembler.judges_in(first);
    let before = judges.before.iter().map(|contact| assembler.judge(contact)).collect();
    judges.cleared.iter().for_each(|bit| assembler.clear(*bit));
    blocks[first.0 as usize].own = assembler.close_element(true);
    assembler.judges_in(last);
    judges.stored.iter().for_each(|stored| assembler.store_condition(stored));
    let behind = judges.behind.iter().map(|contact| assembler.judge(contact)).collect();
    judges.remembered.iter().for_each(|(place, kept)| assembler.remember(*place, *kept));
    blocks[last.0 as usize].own = assembler.close_element(true);
    let order = [first].into_iter().chain(turns(program)).chain([last]).collect();
    let kept = std::mem::take(&mut assembler.identity).kept;
    let subroutines = program.subroutines().map(|block| block.id).collect();
    let code = assembler.finish(blocks, stages, order, subroutines);
    JudgedProgram {
        code: engine::EngineProgram { kept, ..code },
        before,
        behind,
        judges: JudgeBlocks { first, last },
    }
}

/// Adds a block that runs in every scan.
fn added_block(program: &mut Program, kind: BlockKind) -> BlockId {
    let id = BlockId(program.blocks.len() as u32);
    program.blocks.push(Block {
        id,
        name: String::new(),
        doc: None,
        span: Span::default(),
        kind,
        autostart: false,
        retains_stages: false,
        rungs: Vec::new(),
        stages: Vec::new(),
    });
    id
}

impl Assembler<'_> {
    /// The next operations are those of a judge.
    fn judges_in(&mut self, block: BlockId) {
        let element = ElementId { block, stage: None };
        self.site = LoweringSite { element, ..LoweringSite::default() };
    }

    /// Evaluates a condition into a private bit.
    fn judge(&mut self, contact: &Contact) -> BitCell {
        let leg = series(self, std::slice::from_ref(contact), None);
        let bit = self.private_bit();
        self.op(Op::Out(Out { leg, bit: BitWritten(bit) }));
        BitCell(bit)
    }

    /// Turns a bit OFF.
    fn clear(&mut self, bit: Bit) {
        let off = Bit::Space(BitSpace::St, st::OFF);
        let leg = LegPowers::of(Power::of(self.bit_cell(off)));
        let to = self.bit_cell(bit);
        self.op(Op::Out(Out { leg, bit: BitWritten(to) }));
    }

    /// Evaluates a condition into a bit of the memory.
    fn store_condition(&mut self, stored: &StoredCondition) {
        let leg = series(self, std::slice::from_ref(&stored.contact), None);
        let to = self.bit_cell(stored.bit);
        self.op(Op::Out(Out { leg, bit: BitWritten(to) }));
    }

    /// Copies a bit or a word.
    fn remember(&mut self, place: Address, kept: Address) {
        match (place, self.layout.cell(kept)) {
            (Address::Bit(bit), Some(Cell::Bit(BitCell(to)))) => {
                let leg = LegPowers::of(Power::of(self.bit_cell(bit)));
                self.op(Op::Out(Out { leg, bit: BitWritten(to) }));
            }
            (Address::Word(word), Some(Cell::Word(to))) => {
                let (a, leg) = (WordRead(self.layout.word(word).0), self.on());
                let to = WordTarget { word: WordWritten(to.0), min: i32::MIN, max: i32::MAX };
                self.op(Op::Move(Move { leg, a, to }));
            }
            _ => unreachable!("a copy has the type of its place"),
        }
    }
}
