//! The Sensaphone SCADA 3000 counters: CTU, CTD, RES.
//!
//! Behaviour: `docs/semantics.md`, section 5 (seed S3). One CTU and one CTD may share a counter.
//! ACC wraps at 16 bits. A wrap upwards sets OV (or clears UN), a wrap downwards sets UN (or clears
//! OV).

use super::image::BitCell;
use super::memory::MemoryView;
use super::ops::{Ctd, Ctu, Operation, Res};
use super::places::Sensaphone;
use super::reach::Reach;
use super::record::sensaphone_flags::{CD, CU, DN, OV, UN};
use super::record::sensaphone_state::{DOWN, UP};
use super::record::{RECORD, SENSAPHONE_FLAGS};
use super::role::{BitWritten, WordWritten};

impl Sensaphone {
    /// The cell of a flag.
    #[inline(always)]
    fn flag(&self, flag: u32) -> BitWritten {
        BitWritten(self.at * RECORD as u32 + flag)
    }

    /// The enable bits of CTU and CTD.
    pub(super) fn enable_bits(&self) -> (BitCell, BitCell) {
        (BitCell(self.flag(CU).0), BitCell(self.flag(CD).0))
    }

    #[inline(always)]
    fn acc(&self) -> WordWritten {
        WordWritten(self.at)
    }

    /// The termination pass over CTU: the same as an execution with its rung OFF.
    pub(super) fn terminate_up<R: Reach>(&self, view: &mut MemoryView<R>) {
        view.record(self.at)[UP] = 0;
        view.put_bit(self.flag(CU), 0);
    }

    /// The termination pass over CTD.
    pub(super) fn terminate_down<R: Reach>(&self, view: &mut MemoryView<R>) {
        view.record(self.at)[DOWN] = 0;
        view.put_bit(self.flag(CD), 0);
    }

    /// Counts one step up or down at an edge; then updates the flags from ACC and PRE.
    #[inline(always)]
    fn step<R: Reach>(&self, view: &mut MemoryView<R>, counts: u8, by: i16) {
        if let Some(preset) = self.preset {
            let preset = view.word(preset).clamp(i32::from(i16::MIN), i32::from(i16::MAX));
            view.put_word(self.pre, preset);
        }
        let before = view.word(self.acc());
        if counts != 0 {
            let (after, wraps) = (before as i16).overflowing_add(by);
            view.put_word(self.acc(), i32::from(after));
            if wraps {
                self.wrap(view, by);
            }
        }
        let done = view.word(self.acc()) >= view.word(self.pre);
        view.put_bit(self.flag(DN), u8::from(done));
    }

    /// Handles a step that wraps: it clears the flag of the opposite direction if that flag is ON,
    /// else it sets its own flag.
    fn wrap<R: Reach>(&self, view: &mut MemoryView<R>, by: i16) {
        let (own, other) = if by > 0 { (OV, UN) } else { (UN, OV) };
        if view.bit(self.flag(other)) != 0 {
            view.put_bit(self.flag(other), 0);
        } else {
            view.put_bit(self.flag(own), 1);
        }
    }
}

macro_rules! steps {
    ($($op:ident $history:ident $enabled:ident $by:literal;)*) => {$(
        impl Operation for $op {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
                let leg = view.leg(&self.leg);
                let history = &mut view.record(self.counter.at)[$history];
                let counts = leg & (*history ^ 1);
                *history = leg;
                view.put_bit(self.counter.flag($enabled), leg);
                self.counter.step(view, counts, $by);
            }
        }
    )*};
}

steps! {
    Ctu UP CU 1;
    Ctd DOWN CD -1;
}

impl Operation for Res {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        if view.leg(&self.leg) == 0 {
            return;
        }
        view.put_word(self.counter.acc(), 0);
        for flag in 0..SENSAPHONE_FLAGS {
            view.put_bit(self.counter.flag(flag), 0);
        }
    }
}
