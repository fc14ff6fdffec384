//! The operands of operations besides single cells: structures with their presets, and limited
//! words.
//!
//! Data and roles only; `counters`, `timers`, `sensaphone` and `logic` use them. A structure's
//! place is the number of its record, which is also the cell number of its `.Acc`.

use super::record::{FLAGS, RECORD, SENSAPHONE_FLAGS};
use super::role::{BitWritten, FieldRole, TouchedCells, WordRead, WordWritten};

/// The place of a counter structure.
#[derive(Clone, Copy, Debug)]
pub struct Counter {
    /// The number of its record (flags and state), and of the cell of `.Acc`.
    pub at: u32,
}

/// The presets of UDC and UDCG; `None` for a preset that is not given.
#[derive(Clone, Copy, Debug)]
pub struct UdcPresets {
    /// The word of `up-preset`.
    pub up: Option<WordRead>,
    /// The word of `dn-preset`.
    pub dn: Option<WordRead>,
}

/// The rule of a counter's owner: its reset value, and the conditions of `.Done` and `.DnDone`.
#[derive(Clone, Copy, Debug)]
pub enum CounterRule {
    /// CNT: the word of the preset.
    Up(WordRead),
    /// CNTDN: the word of the preset.
    Down(WordRead),
    /// UDC, UDCG.
    UpDown(UdcPresets),
}

/// The places of a timer structure.
#[derive(Clone, Copy, Debug)]
pub struct Timer {
    /// The number of its record (Done, Reset, Zero, Timing, and state), and of the cell of `.Acc`.
    pub at: u32,
    /// The word of the preset.
    pub preset: WordRead,
}

/// The value of `.Acc` after a reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimerRule {
    /// 0: TMR, TMRA, TMRAG, ONDTMR, OFFDTMR.
    Zero,
    /// The preset: TMRDOWN, TMRADOWN.
    Preset,
}

/// The places of a Sensaphone counter.
#[derive(Clone, Copy, Debug)]
pub struct Sensaphone {
    /// The number of its record (CU, CD, DN, OV, UN, and edge histories), and of the cell of ACC.
    pub at: u32,
    /// The cell of PRE.
    pub pre: WordWritten,
    /// The word that is copied to PRE, if the instruction's preset is a location.
    pub preset: Option<WordRead>,
}

/// The word that MOVE, ADD and SUB write, with its limits.
#[derive(Clone, Copy, Debug)]
pub struct WordTarget {
    /// Its cell.
    pub word: WordWritten,
    /// The lower bound: of the word's range, or its tag's `min`. Results saturate at the bounds.
    pub min: i32,
    /// The upper bound: of the word's range, or its tag's `max`.
    pub max: i32,
}

/// A word that is read as a binary64, which holds every integer and real of a word exactly.
#[derive(Clone, Copy, Debug)]
pub struct AnyWord {
    /// Its cell.
    pub word: WordRead,
    /// Whether the cell holds a real.
    pub real: bool,
}

/// The word that an instruction writes a binary64 to, with its limits.
#[derive(Clone, Copy, Debug)]
pub struct AnyTarget {
    /// The cell, and the bounds of its content.
    pub target: WordTarget,
    /// Whether the cell holds a real.
    pub real: bool,
}

/// Adds a structure's `.Acc`, and the first flags of its record.
fn touches_structure(t: &mut TouchedCells, at: u32, flags: u32) {
    WordWritten(at).touches(t);
    let first = at * RECORD as u32;
    (first..first + flags).for_each(|flag| BitWritten(flag).touches(t));
}

impl FieldRole for Counter {
    fn touches(&self, t: &mut TouchedCells) {
        touches_structure(t, self.at, FLAGS as u32);
    }
}

impl FieldRole for UdcPresets {
    fn touches(&self, t: &mut TouchedCells) {
        self.up.touches(t);
        self.dn.touches(t);
    }
}

impl FieldRole for CounterRule {
    fn touches(&self, t: &mut TouchedCells) {
        match self {
            CounterRule::Up(preset) | CounterRule::Down(preset) => preset.touches(t),
            CounterRule::UpDown(presets) => presets.touches(t),
        }
    }
}

impl FieldRole for Timer {
    fn touches(&self, t: &mut TouchedCells) {
        touches_structure(t, self.at, FLAGS as u32);
        self.preset.touches(t);
    }
}

/// A rule adds no cells: the preset that it loads is among the cells of the timer.
impl FieldRole for TimerRule {
    fn touches(&self, _: &mut TouchedCells) {}
}

impl FieldRole for Sensaphone {
    fn touches(&self, t: &mut TouchedCells) {
        touches_structure(t, self.at, SENSAPHONE_FLAGS);
        self.pre.touches(t);
        self.preset.touches(t);
    }
}

impl FieldRole for WordTarget {
    fn touches(&self, t: &mut TouchedCells) {
        self.word.touches(t);
    }
}

impl FieldRole for AnyWord {
    fn touches(&self, t: &mut TouchedCells) {
        self.word.touches(t);
    }
}

impl FieldRole for AnyTarget {
    fn touches(&self, t: &mut TouchedCells) {
        self.target.touches(t);
    }
}
