//! What operations work on: the image, and in it the state that instructions keep.
//!
//! A batch borrows all of it as one [`View`] of slices, so that its loop holds the pointers in
//! registers. The loops are compiled twice: without forces (`F = false`) a write is a plain store.

use super::image::Image;
use super::ops::{Leg, Powers};
use super::reach::{Cells, Reach, Records};

/// Bits of one structure, side by side: the flags that a program sees (four; of a Sensaphone
/// counter five), then what the owning instruction remembers between its executions. One look-up
/// finds them all, in one cache line. The number of a record is that of the structure's `.Acc`
/// among the words too.
pub(super) const RECORD: usize = 8;

/// How many bits of a record the program sees of a counter or timer; the rest is [`State`].
const FLAGS: usize = 4;

/// What the owner of a counter or timer remembers: four bits, a byte each.
///
/// Read and written in one go: such loops wait for loads and stores more than for arithmetic.
#[derive(Clone, Copy, Default)]
pub(super) struct State(u32);

impl State {
    /// The state in which these bits (0 or 1) are as given, all others OFF.
    #[inline(always)]
    pub fn of<const N: usize>(bits: [(u32, u8); N]) -> State {
        State(bits.iter().fold(0, |all, (place, bit)| all | u32::from(*bit) << (8 * place)))
    }

    /// One of its bits.
    #[inline(always)]
    pub fn bit(self, place: u32) -> u8 {
        (self.0 >> (8 * place)) as u8
    }

    /// The same with one bit ON.
    pub fn with(self, place: u32) -> State {
        State(self.0 | 1 << (8 * place))
    }

    /// The same with one bit OFF.
    pub fn without(self, place: u32) -> State {
        State(self.0 & !(1 << (8 * place)))
    }
}

/// The bits of a counter's state.
pub(super) mod counter_state {
    /// Edge history of UP.
    pub const UP: u32 = 0;
    /// Edge history of DN.
    pub const DN: u32 = 1;
    /// A RSTCT reset is pending.
    pub const PENDING: u32 = 2;
    /// CNTDN: the preset was loaded once, or a pass came first.
    pub const LOADED: u32 = 3;
}

/// The bits of a timer's state.
pub(super) mod timer_state {
    /// Time was running at the last execution: the next one adds what has passed since.
    /// OFFDTMR: it is timing down.
    pub const RUNNING: u32 = 0;
    /// OFFDTMR: the leg was ON at the last execution.
    pub const LEG: u32 = 1;
    /// A RSTT reset is pending.
    pub const PENDING: u32 = 2;
    /// TMRADOWN: the preset was loaded once, or a pass came first.
    pub const LOADED: u32 = 3;
}

/// Where in a Sensaphone counter's record the edge histories lie.
pub(super) mod sensaphone_state {
    /// Of CTU.
    pub const UP: usize = 5;
    /// Of CTD.
    pub const DOWN: usize = 6;
}

/// The image, with the state of instructions in it, and how much time passed.
#[derive(Debug)]
pub(super) struct Memory {
    pub image: Image,
    /// Whole ms between the last execution of the element that executes and this one. All of an
    /// element's timers share it: where an execution was cut short, a pass comes before the next.
    pub elapsed_ms: i32,
}

/// Choosing without a branch: what is chosen differs between neighbours and from scan to scan,
/// and a mispredicted branch costs more than a whole operation.
pub(super) trait OnlyIf {
    /// Itself if the bit (0 or 1) is ON, else 0.
    fn only_if(self, bit: u8) -> Self;
    /// Itself if the bit (0 or 1) is OFF, else 0.
    fn unless(self, bit: u8) -> Self;
}

impl OnlyIf for i32 {
    #[inline(always)]
    fn only_if(self, bit: u8) -> i32 {
        self & 0i32.wrapping_sub(i32::from(bit))
    }

    #[inline(always)]
    fn unless(self, bit: u8) -> i32 {
        self & (i32::from(bit) - 1)
    }
}

/// [`Memory`] for one batch.
pub(super) struct View<'a, R: Reach> {
    bits: &'a mut R::Bits,
    words: &'a mut R::Words,
    forced_bits: &'a [bool],
    forced_words: &'a [bool],
    pub elapsed_ms: i32,
}

impl Memory {
    #[inline(always)]
    pub fn view<R: Reach>(&mut self) -> View<'_, R> {
        View {
            bits: R::bits(&mut self.image.bits),
            words: R::words(&mut self.image.words),
            forced_bits: &self.image.forced_bits,
            forced_words: &self.image.forced_words,
            elapsed_ms: self.elapsed_ms,
        }
    }
}

impl<R: Reach> View<'_, R> {
    /// Reads a leg.
    #[inline(always)]
    pub fn leg(&self, leg: &Leg) -> u8 {
        self.all(leg)
    }

    /// Whether all of these powers are ON.
    #[inline(always)]
    pub fn all<const N: usize>(&self, powers: &Powers<N>) -> u8 {
        let power = |at: usize| self.bit(powers.cells[at]) ^ powers.opposites[at];
        (1..N).fold(power(0), |all, at| all & power(at))
    }

    #[inline(always)]
    pub fn bit(&self, cell: u32) -> u8 {
        *self.bits.cell(cell)
    }

    #[inline(always)]
    pub fn word(&self, cell: u32) -> i32 {
        *self.words.cell(cell)
    }

    /// Writes a bit, unless it is forced.
    #[inline(always)]
    pub fn put_bit(&mut self, cell: u32, value: u8) {
        if !R::FORCED || !self.forced_bits[cell as usize] {
            *self.bits.cell_mut(cell) = value;
        }
    }

    /// Writes a bit that is the program's own, and so never forced.
    #[inline(always)]
    pub fn put_own(&mut self, cell: u32, value: u8) {
        *self.bits.cell_mut(cell) = value;
    }

    /// Writes a word, unless it is forced; gives what it then holds.
    #[inline(always)]
    pub fn put_word(&mut self, cell: u32, value: i32) -> i32 {
        let word = self.words.cell_mut(cell);
        if !R::FORCED || !self.forced_words[cell as usize] {
            *word = value;
        }
        *word
    }

    /// A structure's record.
    #[inline(always)]
    pub fn record(&mut self, at: u32) -> &mut [u8; RECORD] {
        self.bits.record(at)
    }

    /// What the owner of a counter or timer remembers.
    #[inline(always)]
    pub fn state(&mut self, record: u32) -> State {
        let [_, _, _, _, state @ ..] = *self.record(record);
        State(u32::from_le_bytes(state))
    }

    /// Has it remembered.
    #[inline(always)]
    pub fn put_state(&mut self, record: u32, state: State) {
        self.record(record)[FLAGS..].copy_from_slice(&state.0.to_le_bytes());
    }

    /// Writes the four flags of a counter or timer, in the order of the layout.
    #[inline(always)]
    pub fn put_flags(&mut self, record: u32, flags: [u8; 4]) {
        if R::FORCED {
            let first = record * RECORD as u32;
            for (cell, flag) in (first..).zip(flags) {
                self.put_bit(cell, flag);
            }
            return;
        }
        // A store a flag: packing them into one store takes twice the instructions.
        let [done, reset, zero, fourth, ..] = self.record(record);
        (*done, *reset, *zero, *fourth) = flags.into();
    }
}
