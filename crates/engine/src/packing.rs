//! PACK and UNPACK: bits of an array into a word, and a word into bits.
//!
//! Behaviour: `docs/semantics.md`, section 11. A forced bit or word keeps its value.

use super::memory::MemoryView;
use super::ops::{Operation, PackBits, UnpackBits};
use super::reach::Reach;
use super::role::{BitRead, BitWritten};

impl Operation for PackBits {
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        if view.leg(&self.leg) == 0 {
            return;
        }
        let from = self.from.0;
        let last = from.count - 1;
        let mut word = if view.bit(BitRead(from.first + last)) == 0 { 0 } else { self.last.0 };
        for at in 0..last {
            word |= i32::from(view.bit(BitRead(from.first + at))) << at;
        }
        view.put_word(self.to.word, word.clamp(self.to.min, self.to.max));
    }
}

impl Operation for UnpackBits {
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        if view.leg(&self.leg) == 0 {
            return;
        }
        let (word, to) = (view.word(self.word), self.to.0);
        for at in 0..to.count {
            view.put_bit(BitWritten(to.first + at), u8::from(word >> at & 1 != 0));
        }
    }
}
