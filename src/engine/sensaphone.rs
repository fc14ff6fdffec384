//! The Sensaphone SCADA 3000 counters: CTU, CTD, RES.
//!
//! Behaviour: `docs/semantics.md`, section 5 (seed S3). One CTU and one CTD may share a counter.
//! ACC wraps as 16 bits do; OV and UN tell which way.

use super::memory::sensaphone_state::{DOWN, UP};
use super::memory::{RECORD, View};
use super::ops::{Leg, Operation, Touches};
use super::reach::Reach;

/// A Sensaphone counter's places.
#[derive(Clone, Copy, Debug)]
pub struct Sensaphone {
    /// Its record of flags (CU, CD, DN, OV, UN) and edge histories, and the cell of ACC.
    pub at: u32,
    /// The cell of PRE.
    pub pre: u32,
    /// The word that an instruction with a preset from a location copies to PRE.
    pub preset: Option<u32>,
}

const CU: u32 = 0;
const CD: u32 = 1;
const DN: u32 = 2;
const OV: u32 = 3;
const UN: u32 = 4;
const FLAGS: u32 = 5;

impl Sensaphone {
    /// The cell of a flag.
    fn flag(&self, flag: u32) -> u32 {
        self.at * RECORD as u32 + flag
    }

    /// The pass over CTU: the rung is false there.
    pub(super) fn terminate_up<R: Reach>(&self, view: &mut View<R>) {
        view.record(self.at)[UP] = 0;
        view.put_bit(self.flag(CU), 0);
    }

    /// The pass over CTD.
    pub(super) fn terminate_down<R: Reach>(&self, view: &mut View<R>) {
        view.record(self.at)[DOWN] = 0;
        view.put_bit(self.flag(CD), 0);
    }

    /// One step up or down, if it counts; and what follows from ACC and PRE.
    #[inline(always)]
    fn step<R: Reach>(&self, view: &mut View<R>, counts: u8, by: i16) {
        if let Some(preset) = self.preset {
            let preset = view.word(preset).clamp(i32::from(i16::MIN), i32::from(i16::MAX));
            view.put_word(self.pre, preset);
        }
        let before = view.word(self.at);
        if counts != 0 {
            let (after, wraps) = (before as i16).overflowing_add(by);
            view.put_word(self.at, i32::from(after));
            if wraps {
                self.wrap(view, by);
            }
        }
        let done = view.word(self.at) >= view.word(self.pre);
        view.put_bit(self.flag(DN), u8::from(done));
    }

    /// A step that wraps sets its flag, or clears the other's if that one wrapped before it.
    fn wrap<R: Reach>(&self, view: &mut View<R>, by: i16) {
        let (own, other) = if by > 0 { (OV, UN) } else { (UN, OV) };
        if view.bit(self.flag(other)) != 0 {
            view.put_bit(self.flag(other), 0);
        } else {
            view.put_bit(self.flag(own), 1);
        }
    }

    fn touches(&self, t: &mut Touches) {
        if let Some(preset) = self.preset {
            t.reads(&[preset]);
        }
        t.reads(&[self.at, self.pre]).writes_words(&[self.at, self.pre]);
        for flag in 0..FLAGS {
            t.writes_bits(&[self.flag(flag)]);
        }
    }
}

/// CTU.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Ctu {
    pub leg: Leg,
    pub counter: Sensaphone,
}

/// CTD.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Ctd {
    pub leg: Leg,
    pub counter: Sensaphone,
}

macro_rules! steps {
    ($($op:ident $history:ident $enabled:ident $by:literal;)*) => {$(
        impl Operation for $op {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut View<R>) {
                let leg = view.leg(&self.leg);
                let history = &mut view.record(self.counter.at)[$history];
                let counts = leg & (*history ^ 1);
                *history = leg;
                view.put_bit(self.counter.flag($enabled), leg);
                self.counter.step(view, counts, $by);
            }

            fn touches(&self, t: &mut Touches) {
                self.counter.touches(t.legs(&[self.leg]));
            }
        }
    )*};
}

steps! {
    Ctu UP CU 1;
    Ctd DOWN CD -1;
}

/// RES.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Res {
    pub leg: Leg,
    pub counter: Sensaphone,
}

impl Operation for Res {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut View<R>) {
        if view.leg(&self.leg) == 0 {
            return;
        }
        view.put_word(self.counter.at, 0);
        for flag in 0..FLAGS {
            view.put_bit(self.counter.flag(flag), 0);
        }
    }

    fn touches(&self, t: &mut Touches) {
        self.counter.touches(t.legs(&[self.leg]));
    }
}
