//! What operations work on: the image, and the state that instructions keep beside it.
//!
//! A batch borrows all of it as one [`View`] of slices, so that its loop holds the pointers in
//! registers. The loops are compiled twice: without forces (`F = false`) a write is a plain store.

use super::image::Image;
use super::ops::{Leg, Power, Powers};

/// What a counter instruction remembers between its executions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CounterState {
    /// Edge history of UP.
    pub up: u8,
    /// Edge history of DN.
    pub dn: u8,
    /// A RSTCT reset is pending.
    pub pending: u8,
    /// CNTDN: the preset was loaded once, or a pass came first.
    pub loaded: u8,
}

/// What a timer instruction remembers between its executions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TimerState {
    /// Timestamp (ms, wrapping) of the last execution that counts time from it.
    pub then_ms: u32,
    /// Time was running at the last execution: the next one adds what has passed since.
    /// OFFDTMR: it is timing down.
    pub running: u8,
    /// OFFDTMR: the leg was ON at the last execution.
    pub leg: u8,
    /// A RSTT reset is pending.
    pub pending: u8,
    /// TMRADOWN: the preset was loaded once, or a pass came first.
    pub loaded: u8,
}

/// What CTU and CTD of one counter remember.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SensaphoneState {
    /// Edge history of CTU.
    pub up: u8,
    /// Edge history of CTD.
    pub down: u8,
}

/// The image and all state of instructions.
#[derive(Debug)]
pub(super) struct Memory {
    pub image: Image,
    pub counters: Box<[CounterState]>,
    pub timers: Box<[TimerState]>,
    pub sensaphones: Box<[SensaphoneState]>,
    /// The scan's timestamp in whole ms, wrapping.
    pub now_ms: u32,
}

/// Choosing without a branch: what is chosen differs between neighbours and from scan to scan,
/// and a mispredicted branch costs more than a whole operation.
pub(super) trait OnlyIf {
    /// Itself if the bit (0 or 1) is ON, else 0.
    fn only_if(self, bit: u8) -> Self;
}

impl OnlyIf for i32 {
    #[inline(always)]
    fn only_if(self, bit: u8) -> i32 {
        self & 0i32.wrapping_sub(i32::from(bit))
    }
}

/// [`Memory`] as slices, for one batch.
pub(super) struct View<'a> {
    pub bits: &'a mut [u8],
    pub words: &'a mut [i32],
    forced_bits: &'a [bool],
    forced_words: &'a [bool],
    pub counters: &'a mut [CounterState],
    pub timers: &'a mut [TimerState],
    pub sensaphones: &'a mut [SensaphoneState],
    pub now_ms: u32,
}

impl Memory {
    pub fn view(&mut self) -> View<'_> {
        View {
            bits: &mut self.image.bits,
            words: &mut self.image.words,
            forced_bits: &self.image.forced_bits,
            forced_words: &self.image.forced_words,
            counters: &mut self.counters,
            timers: &mut self.timers,
            sensaphones: &mut self.sensaphones,
            now_ms: self.now_ms,
        }
    }
}

impl View<'_> {
    /// Reads a power: a bit, or its opposite.
    #[inline(always)]
    pub fn power(&self, power: Power) -> u8 {
        self.bits[(power.0 >> 1) as usize] ^ (power.0 & 1) as u8
    }

    /// Reads a leg.
    #[inline(always)]
    pub fn leg(&self, leg: &Leg) -> u8 {
        self.all(leg)
    }

    /// Whether all of these powers are ON.
    #[inline(always)]
    pub fn all<const N: usize>(&self, powers: &Powers<N>) -> u8 {
        let each = powers.cells.iter().zip(powers.opposites);
        each.fold(1, |all, (cell, opposite)| all & (self.bits[*cell as usize] ^ opposite))
    }

    #[inline(always)]
    pub fn bit(&self, cell: u32) -> u8 {
        self.bits[cell as usize]
    }

    #[inline(always)]
    pub fn word(&self, cell: u32) -> i32 {
        self.words[cell as usize]
    }

    /// Writes a bit, unless it is forced.
    #[inline(always)]
    pub fn put_bit<const F: bool>(&mut self, cell: u32, value: u8) {
        if !F || !self.forced_bits[cell as usize] {
            self.bits[cell as usize] = value;
        }
    }

    /// Writes a word, unless it is forced; gives what it then holds.
    #[inline(always)]
    pub fn put_word<const F: bool>(&mut self, cell: u32, value: i32) -> i32 {
        let word = &mut self.words[cell as usize];
        if !F || !self.forced_words[cell as usize] {
            *word = value;
        }
        *word
    }

    /// Writes the four flags of a counter or timer, in the order of the layout.
    #[inline(always)]
    pub fn put_flags<const F: bool>(&mut self, first: u32, flags: [u8; 4]) {
        if !F {
            let at = first as usize;
            self.bits[at..at + 4].copy_from_slice(&flags);
            return;
        }
        for (cell, flag) in (first..).zip(flags) {
            self.put_bit::<F>(cell, flag);
        }
    }
}
