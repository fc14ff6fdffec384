//! MATH: evaluates its formula while its leg is ON, and stores the result in its target.
//!
//! Behaviour: `docs/semantics.md`, section 8. `steps` evaluates a formula.

use super::array_places::{PutAt, Stored};
use super::integer;
use super::memory::View;
use super::mishap::{Mishap, Mishaps};
use super::places::Target;
use super::power::LegPowers;
use super::reach::Reach;
use super::role::{BitOwn, BitWritten, Role, Touches, WordWritten};
use super::steps::{End, Evaluator, Step};
use crate::isa::Real;

/// A MATH: the formula that it evaluates while its leg is ON, and its target.
#[derive(Clone, Copy, Debug)]
pub struct Math {
    /// Its leg.
    pub leg: LegPowers,
    /// Its first step.
    pub first: u32,
    /// Its number in the program, for the log.
    pub number: u32,
    /// Its target.
    pub put: Put,
    /// The cell of the first status bit, ST0.
    pub status: u32,
    /// Whether it is another instruction with an element of an array: of the status bits it
    /// touches that of an index alone.
    pub quiet: bool,
}

/// The target of a MATH.
#[derive(Clone, Copy, Debug)]
pub enum Put {
    /// A word of integers: first limited to the range of its memory, then to its tag's limits.
    Word {
        /// The word, with its tag's limits.
        to: Target,
        /// The lower end of the range.
        low: i32,
        /// The upper end of the range.
        high: i32,
    },
    /// A word that holds a real, with the limits of its cell.
    Real(Target),
    /// A bit.
    Bit(BitWritten),
    /// An element of an array.
    At(PutAt),
    /// The private word that holds the index of the next MATH's target.
    Index(WordWritten),
}

/// The state of the formulas of a program between two scans, and in one.
#[derive(Debug)]
pub(super) struct Calculator {
    slots: Box<[u64]>,
}

impl Calculator {
    /// With slots for the formula that needs the most.
    pub fn new(slots: u32) -> Calculator {
        Calculator { slots: vec![0; slots as usize].into() }
    }

    /// Executes MATHs; `report` gets the number of each that had a mishap.
    pub fn run<R: Reach>(
        &mut self,
        (maths, steps): (&[Math], &[Step]),
        view: View<R>,
        mut report: impl FnMut(u32, Mishaps),
    ) {
        let mut run = Evaluator::new(view, &mut self.slots);
        for math in maths {
            if run.view.leg(&math.leg) == 0 {
                continue;
            }
            let mut noted = Mishaps::default();
            match run.evaluate(steps, math.first, &mut noted) {
                End::Integer => put(&mut run.view, &math.put, run.integer, &mut noted),
                End::Real => put_real(&mut run.view, &math.put, run.real, &mut noted),
            }
            if math.quiet {
                noted = noted.of_index();
            }
            if !noted.is_empty() {
                for mishap in noted.each() {
                    run.view.put_own(BitOwn(math.status + mishap.status()), 1);
                }
                report(math.number, noted);
            }
        }
    }
}

/// Stores an integer.
#[inline(always)]
fn put<R: Reach>(view: &mut View<R>, put: &Put, value: i64, noted: &mut Mishaps) {
    match put {
        Put::Word { to, low, high } => {
            let limited = integer::within(value, *low, *high, noted);
            view.put_word(to.word, limited.max(to.min).min(to.max));
        }
        Put::Real(_) => put_real(view, put, value as f64, noted),
        Put::Bit(bit) => view.put_bit(*bit, u8::from(value != 0)),
        Put::At(at) => at.put(view, Stored::Integer(value), noted),
        Put::Index(word) => {
            let index = value.clamp(i32::MIN.into(), i32::MAX.into()) as i32;
            view.put_word(*word, index);
        }
    }
}

/// Stores a real.
#[inline(always)]
fn put_real<R: Reach>(view: &mut View<R>, put: &Put, value: f64, noted: &mut Mishaps) {
    match put {
        // Stays at the limits of 64 bits, which are beyond those of every word.
        Put::Word { to, low, high } => {
            let limited = integer::within(value as i64, *low, *high, noted);
            view.put_word(to.word, limited.max(to.min).min(to.max));
        }
        Put::Real(to) => {
            let (nearest, beyond) = Real::stored(value);
            if beyond {
                noted.note(Mishap::Overflow);
            }
            view.put_word(to.word, nearest.cell().max(to.min).min(to.max));
        }
        Put::Bit(bit) => view.put_bit(*bit, u8::from(value != 0.0)),
        Put::At(at) => at.put(view, Stored::Real(value), noted),
        Put::Index(_) => unreachable!("an index is an integer"),
    }
}

/// The cells of its leg, of its formula and its target, and the status bits.
impl Role for Math {
    fn touches(&self, t: &mut Touches) {
        self.leg.touches(t);
        let reads = &t.formulas[self.number as usize];
        t.bits_read.extend(&reads.bits);
        t.words_read.extend(&reads.words);
        t.bit_arrays_read.extend(&reads.bit_arrays);
        t.word_arrays_read.extend(&reads.word_arrays);
        match self.put {
            Put::Word { to, .. } | Put::Real(to) => to.touches(t),
            Put::Bit(bit) => bit.touches(t),
            Put::At(at) => at.touches(t),
            Put::Index(word) => word.touches(t),
        }
        for mishap in Mishap::ALL {
            BitOwn(self.status + mishap.status()).touches(t);
        }
    }
}
