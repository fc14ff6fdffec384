//! Contacts, coils and arithmetic: the operations without a structure.
//!
//! Behaviour: `docs/semantics.md`, section 4 (edge contacts, rungs) and the instruction pages.

use super::memory::View;
use super::ops::{Leg, Operation, Powers, Touches};
use super::reach::Reach;

/// `cell = a & b`.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct And2 {
    pub cell: u32,
    pub of: Powers<2>,
}

/// `cell = a & b & c`.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct And3 {
    pub cell: u32,
    pub of: Powers<3>,
}

/// `cell = a & b & c & d`.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct And4 {
    pub cell: u32,
    pub of: Powers<4>,
}

macro_rules! and {
    ($($and:ident)*) => {$(
        impl Operation for $and {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut View<R>) {
                view.put_own(self.cell, view.all(&self.of));
            }

            fn touches(&self, t: &mut Touches) {
                t.cells(&self.of.cells).writes_bits(&[self.cell]);
            }
        }
    )*};
}

and! { And2 And3 And4 }

macro_rules! edges {
    ($($(#[$doc:meta])* $edge:ident |$now:ident, $before:ident| $found:expr;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        #[allow(missing_docs)]
        pub struct $edge {
            pub cell: u32,
            pub bit: u32,
            pub history: u32,
        }

        impl Operation for $edge {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut View<R>) {
                let ($now, $before) = (view.bit(self.bit), view.bit(self.history));
                view.put_own(self.history, $now);
                view.put_own(self.cell, $found);
            }

            fn touches(&self, t: &mut Touches) {
                t.cells(&[self.bit]).writes_bits(&[self.cell, self.history]);
            }
        }
    )*};
}

edges! {
    /// `cell` = the bit was OFF at the last evaluation and is ON.
    Rise |now, before| now & (before ^ 1);
    /// `cell` = the bit was ON at the last evaluation and is OFF.
    Fall |now, before| (now ^ 1) & before;
}

macro_rules! compares {
    ($($(#[$doc:meta])* $compare:ident $operator:tt;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        #[allow(missing_docs)]
        pub struct $compare {
            pub cell: u32,
            pub a: u32,
            pub b: u32,
        }

        impl Operation for $compare {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut View<R>) {
                view.put_own(self.cell, u8::from(view.word(self.a) $operator view.word(self.b)));
            }

            fn touches(&self, t: &mut Touches) {
                t.reads(&[self.a, self.b]).writes_bits(&[self.cell]);
            }
        }
    )*};
}

compares! {
    /// `cell = a == b`. `!=` reads its opposite.
    Equal ==;
    /// `cell = a < b`. `>` swaps, `>=` and `<=` read the opposites.
    Less <;
}

macro_rules! coils {
    ($($(#[$doc:meta])* $coil:ident $of:ty, |$leg:ident, $bit:ident| $value:expr;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        #[allow(missing_docs)]
        pub struct $coil {
            pub leg: $of,
            pub bit: u32,
        }

        impl Operation for $coil {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut View<R>) {
                let ($leg, $bit) = (view.all(&self.leg), view.bit(self.bit));
                view.put_bit(self.bit, $value);
            }

            fn touches(&self, t: &mut Touches) {
                t.cells(&self.leg.cells).writes_bits(&[self.bit]);
            }
        }
    )*};
}

coils! {
    /// Writes the power, ON and OFF.
    Out Leg, |leg, _bit| leg;
    /// The same, of a leg that comes down to one power.
    OutOne Powers<1>, |leg, _bit| leg;
    /// ON while the rung is ON.
    Set Leg, |leg, bit| leg | bit;
    /// OFF while the rung is ON.
    Rst Leg, |leg, bit| bit & (leg ^ 1);
}

macro_rules! edge_coils {
    ($($(#[$doc:meta])* $coil:ident |$now:ident, $before:ident, $bit:ident| $value:expr;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        #[allow(missing_docs)]
        pub struct $coil {
            pub leg: Leg,
            pub bit: u32,
            pub history: u32,
        }

        impl Operation for $coil {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut View<R>) {
                let ($now, $before) = (view.leg(&self.leg), view.bit(self.history));
                let $bit = view.bit(self.bit);
                view.put_own(self.history, $now);
                view.put_bit(self.bit, $value);
            }

            fn touches(&self, t: &mut Touches) {
                t.legs(&[self.leg]).writes_bits(&[self.bit, self.history]);
            }
        }
    )*};
}

edge_coils! {
    /// ON at the execution that sees the rung come ON, written OFF at every other.
    Pd |now, before, _bit| now & (before ^ 1);
    /// ON at the execution that sees the rung go OFF, written OFF at every other.
    Nd |now, before, _bit| (now ^ 1) & before;
    /// Toggles at the rung's rising edge.
    Ponoff |now, before, bit| bit ^ (now & (before ^ 1));
}

/// The word that MOVE, ADD and SUB write, and what it may hold.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Its cell.
    pub word: u32,
    /// Its range, or its tag's `min` and `max`: what is written saturates there.
    pub min: i32,
    /// The upper bound.
    pub max: i32,
}

impl Target {
    #[inline(always)]
    fn put<R: Reach>(&self, view: &mut View<R>, leg: u8, value: i64) {
        let before = view.word(self.word);
        let bounded = value.clamp(i64::from(self.min), i64::from(self.max)) as i32;
        view.put_word(self.word, if leg != 0 { bounded } else { before });
    }
}

/// Copies a word while the rung is ON.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Move {
    pub leg: Leg,
    pub a: u32,
    pub to: Target,
}

impl Operation for Move {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut View<R>) {
        let (leg, value) = (view.leg(&self.leg), i64::from(view.word(self.a)));
        self.to.put(view, leg, value);
    }

    fn touches(&self, t: &mut Touches) {
        t.legs(&[self.leg]).reads(&[self.a]).writes_words(&[self.to.word]);
    }
}

macro_rules! arithmetic {
    ($($(#[$doc:meta])* $op:ident $operator:tt;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        #[allow(missing_docs)]
        pub struct $op {
            pub leg: Leg,
            pub a: u32,
            pub b: u32,
            pub to: Target,
        }

        impl Operation for $op {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut View<R>) {
                let (a, b) = (i64::from(view.word(self.a)), i64::from(view.word(self.b)));
                let leg = view.leg(&self.leg);
                self.to.put(view, leg, a $operator b);
            }

            fn touches(&self, t: &mut Touches) {
                t.legs(&[self.leg]).reads(&[self.a, self.b]).writes_words(&[self.to.word]);
            }
        }
    )*};
}

arithmetic! {
    /// Writes a + b while the rung is ON.
    Add +;
    /// Writes a - b while the rung is ON.
    Sub -;
}
