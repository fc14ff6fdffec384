//! What operations act on beside single cells: structures with their presets, and limited words.
//!
//! Data and roles alone; what is done with them is in `counters`, `timers`, `sensaphone` and
//! `logic`. A structure's place is the number of its record, which is the cell of its `.Acc` among
//! the words too.

use super::record::{FLAGS, RECORD, SENSAPHONE_FLAGS};
use super::role::{BitWritten, Role, Touches, WordRead, WordWritten};

/// A counter structure's places.
#[derive(Clone, Copy, Debug)]
pub struct Counter {
    /// Its record of flags and state, and the cell of `.Acc`.
    pub at: u32,
}

/// The presets of UDC and UDCG: words, and whether each was given.
#[derive(Clone, Copy, Debug)]
pub struct UdcPresets {
    /// The word of `up-preset`.
    pub up: Option<WordRead>,
    /// The word of `dn-preset`.
    pub dn: Option<WordRead>,
}

/// What a counter's owner makes of `.Acc`.
#[derive(Clone, Copy, Debug)]
pub enum CounterRule {
    /// CNT: the word of the preset.
    Up(WordRead),
    /// CNTDN: the word of the preset.
    Down(WordRead),
    /// UDC, UDCG.
    UpDown(UdcPresets),
}

/// A timer structure's places.
#[derive(Clone, Copy, Debug)]
pub struct Timer {
    /// Its record of flags (Done, Reset, Zero, Timing) and state, and the cell of `.Acc`.
    pub at: u32,
    /// The word of the preset.
    pub preset: WordRead,
}

/// What a reset puts in `.Acc`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimerRule {
    /// 0: TMR, TMRA, TMRAG, ONDTMR, OFFDTMR.
    Zero,
    /// The preset: TMRDOWN, TMRADOWN.
    Preset,
}

/// A Sensaphone counter's places.
#[derive(Clone, Copy, Debug)]
pub struct Sensaphone {
    /// Its record of flags (CU, CD, DN, OV, UN) and edge histories, and the cell of ACC.
    pub at: u32,
    /// The cell of PRE.
    pub pre: WordWritten,
    /// The word that an instruction with a preset from a location copies to PRE.
    pub preset: Option<WordRead>,
}

/// The word that MOVE, ADD and SUB write, and what it may hold.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Its cell.
    pub word: WordWritten,
    /// Its range, or its tag's `min` and `max`: what is written saturates there.
    pub min: i32,
    /// The upper bound.
    pub max: i32,
}

/// Adds a structure's `.Acc`, and the first flags of its record.
fn touches_structure(t: &mut Touches, at: u32, flags: u32) {
    WordWritten(at).touches(t);
    let first = at * RECORD as u32;
    (first..first + flags).for_each(|flag| BitWritten(flag).touches(t));
}

impl Role for Counter {
    fn touches(&self, t: &mut Touches) {
        touches_structure(t, self.at, FLAGS as u32);
    }
}

impl Role for UdcPresets {
    fn touches(&self, t: &mut Touches) {
        self.up.touches(t);
        self.dn.touches(t);
    }
}

impl Role for CounterRule {
    fn touches(&self, t: &mut Touches) {
        match self {
            CounterRule::Up(preset) | CounterRule::Down(preset) => preset.touches(t),
            CounterRule::UpDown(presets) => presets.touches(t),
        }
    }
}

impl Role for Timer {
    fn touches(&self, t: &mut Touches) {
        touches_structure(t, self.at, FLAGS as u32);
        self.preset.touches(t);
    }
}

/// The preset that a rule may load is the timer's.
impl Role for TimerRule {
    fn touches(&self, _: &mut Touches) {}
}

impl Role for Sensaphone {
    fn touches(&self, t: &mut Touches) {
        touches_structure(t, self.at, SENSAPHONE_FLAGS);
        self.pre.touches(t);
        self.preset.touches(t);
    }
}

impl Role for Target {
    fn touches(&self, t: &mut Touches) {
        self.word.touches(t);
    }
}
