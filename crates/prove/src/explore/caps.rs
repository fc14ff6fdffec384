//! The value behind which no instruction sees a difference in a counter's or timer's `.Acc`.
//!
//! For `form`, which stores every value behind it as this one, so that a timer that runs on past
//! its preset is one state. Why the future is the same: the bound is greater than every value
//! of all that `.Acc` is compared with (the preset of its owner, 0 of `.Zero`, the other sides of
//! compares), so all these compares have one result at the bound and behind it. The owner of such
//! an `.Acc` never moves it back across the bound: CNT counts up, the timers that time up add time,
//! both saturate at the greatest i32 and not before the bound; a reset, a pass, and every write of
//! another instruction put a value that does not depend on `.Acc`. So two states that differ only
//! in such values behind the bound differ only so after every scan. CNTDN is the same downwards.
//!
//! Where anything else reads `.Acc`, or nothing is known of a preset (`ranges`), there is no bound.
//! UDC moves `.Acc` both ways, and CTU and CTD wrap: they have none.

use rungd_engine::isa::NumberMap;
use rungd_engine::ops::{
    Control, ControlKind, CounterRule, ElementType, Equal, Less, Math, MathTarget, Op, WordRead,
};
use rungd_engine::{EngineProgram, PassStep};

use super::effects::{Effects, Owned};
use super::live::all_operations;
use super::ranges::WordRanges;
use std::ops::RangeInclusive;

/// The bound of an `.Acc`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cap {
    /// All values from this one on are alike.
    AtLeast(i32),
    /// All values down from this one are alike.
    AtMost(i32),
}

impl Cap {
    /// The value that stands for a value.
    pub fn capped(self, value: i32) -> i32 {
        match self {
            Cap::AtLeast(cap) => value.min(cap),
            Cap::AtMost(cap) => value.max(cap),
        }
    }
}

/// The instructions that read an `.Acc`.
#[derive(Clone, Copy, Debug, Default)]
struct Readers {
    owner: Option<CapOwner>,
    /// The least and the greatest value of all that it is compared with.
    low: i32,
    high: i32,
    /// Whether anything else reads it, or writes a part of it.
    others: bool,
}

#[derive(Clone, Copy, Debug)]
enum CapOwner {
    Up,
    Down,
}

/// The bounds of the words of a cone's program that have one.
pub(super) fn caps(program: &EngineProgram, ranges: &WordRanges) -> NumberMap<u32, Cap> {
    let effects = Effects::new(program);
    let mut search = CapSearch { effects, ranges, readers: NumberMap::default() };
    all_operations(program).for_each(|op| search.visit(&op));
    program.tables.terminations.iter().for_each(|step| search.visit_pass(step));
    let picks = program.tables.picks.iter();
    picks.for_each(|pick| search.visit(&Op::Math(*pick)));
    let caps =
        search.readers.into_iter().filter_map(|(word, readers)| Some((word, readers.cap()?)));
    caps.collect()
}

impl Readers {
    /// It is compared with a word of some range.
    fn compare(&mut self, range: Option<RangeInclusive<i32>>) {
        match range {
            Some(range) => {
                self.low = self.low.min(*range.start());
                self.high = self.high.max(*range.end());
            }
            None => self.others = true,
        }
    }

    fn cap(self) -> Option<Cap> {
        match self.owner.filter(|_| !self.others)? {
            CapOwner::Up => self.high.checked_add(1).map(Cap::AtLeast),
            CapOwner::Down => self.low.checked_sub(1).map(Cap::AtMost),
        }
    }
}

struct CapSearch<'p> {
    effects: Effects<'p>,
    ranges: &'p WordRanges<'p>,
    readers: NumberMap<u32, Readers>,
}

impl CapSearch<'_> {
    fn readers(&mut self, word: u32) -> &mut Readers {
        self.readers.entry(word).or_default()
    }

    fn visit(&mut self, op: &Op) {
        if let Op::Equal(Equal { a, b, .. }) | Op::Less(Less { a, b, .. }) = op {
            return self.visit_compare(*a, *b);
        }
        if let Some(owned) = self.effects.effect(op).owns {
            self.visit_owner(owned);
        }
        self.visit_touched(op);
        if let Op::Math(Math { put: MathTarget::At(at), .. }) = op
            && at.kind == ElementType::WordBits
        {
            let words = at.first..at.first + u32::from(at.count);
            words.for_each(|word| self.readers(word).others = true);
        }
        if let Op::Control(Control { kind: ControlKind::EnableEvery { every, .. }, .. }) = op {
            self.readers(*every).others = true;
        }
    }

    fn visit_owner(&mut self, owned: Owned) {
        match owned {
            Owned::UpTimer(timer) => self.visit_up(timer.at, timer.preset),
            Owned::UpCounter(acc, preset) => self.visit_up(acc, preset),
            Owned::DownCounter(acc) => self.readers(acc).owner = Some(CapOwner::Down),
            Owned::DownTimer(_) | Owned::UpDownCounter(_) => {}
        }
    }

    fn visit_up(&mut self, acc: u32, preset: WordRead) {
        let preset = self.ranges.range(preset.0);
        let readers = self.readers(acc);
        readers.owner = Some(CapOwner::Up);
        readers.compare(preset);
    }

    fn visit_compare(&mut self, a: WordRead, b: WordRead) {
        let (range_a, range_b) = (self.ranges.range(a.0), self.ranges.range(b.0));
        self.readers(a.0).compare(range_b);
        self.readers(b.0).compare(range_a);
    }

    /// Marks the words that are read, or written in part.
    fn visit_touched(&mut self, op: &Op) {
        let touches = self.effects.touched(op);
        let arrays = touches.word_arrays_read.iter();
        let elements = arrays.flat_map(|array| array.first..array.first + array.count);
        let bits = touches.word_bits_written.iter().map(|bit| bit.word.0);
        let words: Vec<u32> =
            touches.words_read.iter().copied().chain(elements).chain(bits).collect();
        words.into_iter().for_each(|word| self.readers(word).others = true);
    }

    fn visit_pass(&mut self, step: &PassStep) {
        match step {
            PassStep::Counter(_, CounterRule::Up(preset) | CounterRule::Down(preset)) => {
                self.readers(preset.0).others = true;
            }
            PassStep::Counter(_, CounterRule::UpDown(presets)) => {
                let presets = [presets.up, presets.dn];
                presets.iter().flatten().for_each(|word| self.readers(word.0).others = true);
            }
            PassStep::Timer(timer, _) => self.readers(timer.preset.0).others = true,
            PassStep::WordBitOff(bit) => self.readers(bit.0.word.0).others = true,
            PassStep::BitOff(_)
            | PassStep::HistoryOff(_)
            | PassStep::HoldTimer(_)
            | PassStep::CountUp(_)
            | PassStep::CountDown(_)
            | PassStep::DisableTask(_)
            | PassStep::Pick(_) => {}
        }
    }
}
