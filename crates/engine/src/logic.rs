//! Contacts, coils and arithmetic: the operations without a structure.
//!
//! Behaviour: `docs/semantics.md`, section 4 (edge contacts, rungs) and the instruction pages.

use super::memory::MemoryView;
use super::ops::{
    Add, AddMixed, And2, And3, And4, Equal, EqualMixed, Fall, Less, LessMixed, Move, Nd, Operation,
    Out, OutOne, Pd, Ponoff, Rise, Rst, Set, Sub, SubMixed,
};
use super::places::{AnyTarget, AnyWord, WordTarget};
use super::reach::Reach;
use crate::isa::Real;

macro_rules! and {
    ($($and:ident)*) => {$(
        impl Operation for $and {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
                view.put_own(self.cell, view.all(&self.of));
            }
        }
    )*};
}

and! { And2 And3 And4 }

macro_rules! edges {
    ($($edge:ident |$now:ident, $before:ident| $found:expr;)*) => {$(
        impl Operation for $edge {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
                let ($now, $before) = (view.bit(self.bit), view.bit(self.history));
                view.put_own(self.history, $now);
                view.put_own(self.cell, $found);
            }
        }
    )*};
}

edges! {
    Rise |now, before| now & (before ^ 1);
    Fall |now, before| (now ^ 1) & before;
}

macro_rules! compares {
    ($($compare:ident $operator:tt;)*) => {$(
        impl Operation for $compare {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
                view.put_own(self.cell, u8::from(view.word(self.a) $operator view.word(self.b)));
            }
        }
    )*};
}

compares! {
    Equal ==;
    Less <;
}

impl AnyWord {
    /// The value of the word.
    #[inline(always)]
    pub(super) fn value<R: Reach>(&self, view: &MemoryView<R>) -> f64 {
        let cell = view.word(self.word);
        if self.real { Real::of_cell(cell).into() } else { f64::from(cell) }
    }
}

macro_rules! mixed_compares {
    ($($compare:ident $operator:tt;)*) => {$(
        impl Operation for $compare {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
                let on = self.a.value(view) $operator self.b.value(view);
                view.put_own(self.cell, u8::from(on));
            }
        }
    )*};
}

mixed_compares! {
    EqualMixed ==;
    LessMixed <;
}

macro_rules! coils {
    ($($coil:ident |$leg:ident, $bit:ident| $value:expr;)*) => {$(
        impl Operation for $coil {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
                let ($leg, $bit) = (view.all(&self.leg), view.bit(self.bit));
                view.put_bit(self.bit, $value);
            }
        }
    )*};
}

coils! {
    Out |leg, _bit| leg;
    OutOne |leg, _bit| leg;
    Set |leg, bit| leg | bit;
    Rst |leg, bit| bit & (leg ^ 1);
}

macro_rules! edge_coils {
    ($($coil:ident |$now:ident, $before:ident, $bit:ident| $value:expr;)*) => {$(
        impl Operation for $coil {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
                let ($now, $before) = (view.leg(&self.leg), view.bit(self.history));
                let $bit = view.bit(self.bit);
                view.put_own(self.history, $now);
                view.put_bit(self.bit, $value);
            }
        }
    )*};
}

edge_coils! {
    Pd |now, before, _bit| now & (before ^ 1);
    Nd |now, before, _bit| (now ^ 1) & before;
    Ponoff |now, before, bit| bit ^ (now & (before ^ 1));
}

impl WordTarget {
    #[inline(always)]
    fn put<R: Reach>(&self, view: &mut MemoryView<R>, leg: u8, value: i64) {
        let before = view.word(self.word);
        let bounded = value.clamp(i64::from(self.min), i64::from(self.max)) as i32;
        view.put_word(self.word, if leg != 0 { bounded } else { before });
    }
}

impl Operation for Move {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        let (leg, value) = (view.leg(&self.leg), i64::from(view.word(self.a)));
        self.to.put(view, leg, value);
    }
}

macro_rules! arithmetic {
    ($($op:ident $operator:tt;)*) => {$(
        impl Operation for $op {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
                let (a, b) = (i64::from(view.word(self.a)), i64::from(view.word(self.b)));
                let leg = view.leg(&self.leg);
                self.to.put(view, leg, a $operator b);
            }
        }
    )*};
}

arithmetic! {
    Add +;
    Sub -;
}

impl AnyTarget {
    /// Stores a number within the limits: truncated towards zero in an integer, rounded to the
    /// nearest in a real.
    #[inline(always)]
    fn put<R: Reach>(&self, view: &mut MemoryView<R>, leg: u8, value: f64) {
        let cell = if self.real { Real::stored(value).real.cell().into() } else { value as i64 };
        self.target.put(view, leg, cell);
    }
}

macro_rules! mixed_arithmetic {
    ($($op:ident $operator:tt;)*) => {$(
        impl Operation for $op {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
                let (a, b) = (self.a.value(view), self.b.value(view));
                let leg = view.leg(&self.leg);
                self.to.put(view, leg, a $operator b);
            }
        }
    )*};
}

mixed_arithmetic! {
    AddMixed +;
    SubMixed -;
}
