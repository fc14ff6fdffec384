//! The values that a word can have in any state.
//!
//! For `caps`. A word that nothing writes keeps its value. Of a word that only instructions with
//! limits write, the limits are known: those of its tag, or the constant that a MOVE writes. Of all
//! others nothing is known: of `.Acc`s, of words with a bit that is written, of elements at moving
//! indexes, and of status words, which the start of every scan writes.

use rungd_engine::isa::status::dst;
use rungd_engine::isa::{NumberMap, Word, WordSpace};
use rungd_engine::ops::{Math, MathTarget, Op, WordTarget};
use rungd_engine::{Image, PassStep, WordCell};

use super::effects::{EffectCells, Effects};
use super::live::all_operations;
use crate::model::ProofModel;
use std::ops::RangeInclusive;

/// The words of a cone.
pub(super) struct WordRanges<'i> {
    /// The memory before the first scan.
    start: &'i Image,
    /// The words that something writes; `None`: nothing is known of the word.
    written: NumberMap<u32, Option<RangeInclusive<i32>>>,
}

impl<'i> WordRanges<'i> {
    /// Those of a cone, and its memory before the first scan.
    pub fn new(model: &ProofModel, start: &'i Image) -> WordRanges<'i> {
        let mut ranges = WordRanges { start, written: NumberMap::default() };
        ranges.add_unknown(model);
        let numbers = EffectCells { bits: model.code.bit_count };
        for input in &model.inputs {
            if let Some(word) = numbers.number(input.cell).checked_sub(numbers.bits) {
                ranges.widen(word, Some(input.low..=input.high));
            }
        }
        let effects = Effects::new(&model.code);
        // First the words that are written at all, then what is written in them.
        for knows in [false, true] {
            for op in all_operations(&model.code) {
                let writes = effects.effect(&op).writes.into_iter();
                for word in writes.filter_map(|cell| cell.checked_sub(numbers.bits)) {
                    let range =
                        if knows { ranges.stored_by(&op) } else { Some(ranges.at_start(word)) };
                    ranges.widen(word, range);
                }
            }
        }
        ranges
    }

    /// The least and the greatest value of a word, if they are known.
    pub fn range(&self, word: u32) -> Option<RangeInclusive<i32>> {
        self.written.get(&word).cloned().unwrap_or_else(|| Some(self.at_start(word)))
    }

    fn at_start(&self, word: u32) -> RangeInclusive<i32> {
        let value = self.start.word(WordCell(word));
        value..=value
    }

    /// Structures, status words, and the words of passes and picks.
    fn add_unknown(&mut self, model: &ProofModel) {
        let (code, numbers) = (&model.code, EffectCells { bits: model.code.bit_count });
        let effects = Effects::new(code);
        let structures = 0..code.layout.structure_count();
        let status = 0..dst::COUNT as u32;
        let status = status.map(|n| code.layout.word(Word::Space(WordSpace::Dst, n)).0);
        let picks =
            code.tables.picks.iter().flat_map(|pick| effects.effect(&Op::Math(*pick)).writes);
        let picks = picks.filter_map(|cell| cell.checked_sub(numbers.bits));
        let passes = code.tables.terminations.iter().filter_map(|step| match step {
            PassStep::WordBitOff(bit) => Some(bit.0.word.0),
            PassStep::BitOff(_)
            | PassStep::HistoryOff(_)
            | PassStep::Counter(..)
            | PassStep::Timer(..)
            | PassStep::HoldTimer(_)
            | PassStep::CountUp(_)
            | PassStep::CountDown(_)
            | PassStep::DisableTask(_)
            | PassStep::Pick(_) => None,
        });
        let words = structures.chain(status).chain(picks).chain(passes);
        self.written.extend(words.map(|word| (word, None)));
    }

    fn widen(&mut self, word: u32, by: Option<RangeInclusive<i32>>) {
        let before = self.range(word);
        let joined = |(a, b): (RangeInclusive<i32>, RangeInclusive<i32>)| {
            *a.start().min(b.start())..=*a.end().max(b.end())
        };
        self.written.insert(word, before.zip(by).map(joined));
    }

    /// What an operation stores in the words that it writes.
    fn stored_by(&self, op: &Op) -> Option<RangeInclusive<i32>> {
        let limits = |to: WordTarget| Some(to.min..=to.max);
        if let Op::Move(copy) = op {
            let constant = (!self.written.contains_key(&copy.a.0)).then(|| self.range(copy.a.0));
            let (low, high) = (copy.to.min, copy.to.max);
            return match constant.flatten() {
                Some(value) if low <= high => {
                    Some((*value.start()).clamp(low, high)..=(*value.end()).clamp(low, high))
                }
                _ => limits(copy.to),
            };
        }
        if let Op::Add(sum) = op {
            return limits(sum.to);
        }
        if let Op::Sub(difference) = op {
            return limits(difference.to);
        }
        let Op::Math(Math { put: MathTarget::Word { to, .. }, .. }) = op else { return None };
        limits(*to)
    }
}
