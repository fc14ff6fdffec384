//! The Do-more timers, and RSTT.
//!
//! Behaviour: `docs/semantics.md`, section 3 (seed S0 for ONDTMR and OFFDTMR, vendor help for the
//! rest). A timer adds the whole milliseconds between its executions' timestamps, so that nothing
//! drifts; they are its element's executions, so the element counts them for all of its timers. A
//! preset `<= 0` is treated as 0.

use super::memory::timer_state::{LEG, LOADED, PENDING, RUNNING};
use super::memory::{OnlyIf, RECORD, View};
use super::reach::Reach;
use super::ops::{Leg, Operation, Touches};

/// A timer structure's places.
#[derive(Clone, Copy, Debug)]
pub struct Timer {
    /// Its record of flags (Done, Reset, Zero, Timing) and state.
    pub record: u32,
    /// The cell of `.Acc`.
    pub acc: u32,
    /// The word of the preset.
    pub preset: u32,
}

/// What a reset puts in `.Acc`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimerRule {
    /// 0: TMR, TMRA, TMRAG, ONDTMR, OFFDTMR.
    Zero,
    /// The preset: TMRDOWN, TMRADOWN.
    Preset,
}

impl Timer {
    #[inline(always)]
    fn preset<R: Reach>(&self, view: &View<R>) -> i32 {
        view.word(self.preset).max(0)
    }

    #[inline(always)]
    fn record<'a, R: Reach>(&self, view: &'a mut View<R>) -> &'a mut [u8; RECORD] {
        view.record(self.record)
    }

    #[inline(always)]
    fn acc<R: Reach>(&self, view: &View<R>) -> i32 {
        view.word(self.acc)
    }

    /// Writes `.Acc`; gives what it then holds.
    #[inline(always)]
    fn put_acc<R: Reach>(&self, view: &mut View<R>, acc: i32) -> i32 {
        view.put_word(self.acc, acc)
    }

    #[inline(always)]
    fn put_flags<R: Reach>(&self, view: &mut View<R>, acc: i32, flags: Flags) {
        let zero = u8::from(acc == 0);
        view.put_flags(self.record, [flags.done, flags.reset, zero, flags.timing]);
    }

    /// The reset state: the reset value, `.Reset` ON, `.Done` and `.Timing` OFF.
    #[inline(always)]
    pub(super) fn reset<R: Reach>(&self, view: &mut View<R>, rule: TimerRule) {
        let value = if rule == TimerRule::Preset { self.preset(view) } else { 0 };
        let acc = self.put_acc(view, value);
        self.put_flags(view, acc, Flags { done: 0, reset: 1, timing: 0 });
    }

    /// The pass: the reset state, nothing running, a pending reset gone.
    pub(super) fn terminate<R: Reach>(&self, view: &mut View<R>, rule: TimerRule) {
        let record = self.record(view);
        for state in [RUNNING, LEG, PENDING] {
            record[state] = 0;
        }
        record[LOADED] = 1;
        self.reset(view, rule);
    }

    /// The pass over TMRAG: the time until its next execution does not count.
    pub(super) fn hold<R: Reach>(&self, view: &mut View<R>) {
        self.record(view)[RUNNING] = 0;
    }

    fn touches(&self, t: &mut Touches) {
        t.reads(&[self.acc, self.preset]).writes_words(&[self.acc]).writes_flags(self.record);
    }
}

#[derive(Clone, Copy)]
struct Flags {
    done: u8,
    reset: u8,
    timing: u8,
}

/// One execution of an enabled ONDTMR or TMR, or of a reset one; gives `.Done`.
///
/// Branch-free: which of reset, first and further executions it is, is mixed up between
/// neighbours and scans, and a mispredicted branch costs more than all of this.
#[inline(always)]
fn run_up<R: Reach>(timer: &Timer, view: &mut View<R>, leg: u8) -> u8 {
    let preset = timer.preset(view);
    let record = timer.record(view);
    let on = leg & (record[PENDING] ^ 1);
    let adds = on & record[RUNNING];
    record[PENDING] = 0;
    record[RUNNING] = on;
    let acc = up(timer.acc(view), view.elapsed_ms).only_if(adds);
    let acc = timer.put_acc(view, acc);
    let done = on & u8::from(acc >= preset);
    timer.put_flags(view, acc, Flags { done, reset: on ^ 1, timing: on });
    done
}

/// Time added, saturating: what wrapped is less than before.
#[inline(always)]
fn up(acc: i32, elapsed_ms: i32) -> i32 {
    let sum = acc.wrapping_add(elapsed_ms);
    if sum < acc { i32::MAX } else { sum }
}

/// Time taken away, down to 0 and no further.
#[inline(always)]
fn down(acc: i32, elapsed_ms: i32) -> i32 {
    if acc > elapsed_ms { acc.wrapping_sub(elapsed_ms) } else { 0 }
}

macro_rules! one_leg {
    ($($(#[$doc:meta])* $op:ident { $($output:ident)? } |$timer:ident, $view:ident, $leg:ident|
       $run:expr;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        #[allow(missing_docs)]
        pub struct $op {
            pub leg: Leg,
            pub timer: Timer,
            $(pub $output: u32,)?
        }

        impl Operation for $op {
            #[inline(always)]
            fn run<R: Reach>(&self, $view: &mut View<R>) {
                let ($timer, $leg) = (&self.timer, $view.leg(&self.leg));
                let done = $run;
                $($view.put_bit(self.$output, done);)?
                let _ = done;
            }

            fn touches(&self, t: &mut Touches) {
                $(t.writes_bits(&[self.$output]);)?
                self.timer.touches(t.legs(&[self.leg]));
            }
        }
    )*};
}

one_leg! {
    /// ONDTMR.
    Ondtmr { output } |timer, view, leg| run_up(timer, view, leg);
    /// TMR.
    Tmr { } |timer, view, leg| run_up(timer, view, leg);
    /// OFFDTMR.
    Offdtmr { output } |timer, view, leg| run_off_delay(timer, view, leg);
    /// TMRDOWN.
    Tmrdown { } |timer, view, leg| run_down(timer, view, leg);
}

/// One execution of OFFDTMR: the rows of its table; gives the output.
///
/// Branch-free, for the reason given at `run_up`. The leg ON, and the first execution with the leg
/// OFF after it, load the preset; while timing down time is taken away; else `.Acc` is 0.
#[inline(always)]
fn run_off_delay<R: Reach>(timer: &Timer, view: &mut View<R>, leg: u8) -> u8 {
    let preset = timer.preset(view);
    let record = timer.record(view);
    let off = leg ^ 1;
    let reset_pending = off & record[PENDING];
    let falls = off & record[LEG] & (reset_pending ^ 1);
    let times = off & (record[LEG] ^ 1) & record[RUNNING] & (reset_pending ^ 1);
    record[PENDING] = 0;
    record[LEG] = leg;
    let remaining = down(timer.acc(view), view.elapsed_ms);
    let acc = preset.only_if(leg | falls) | remaining.only_if(times);
    let acc = timer.put_acc(view, acc);
    let timing = (falls | times) & u8::from(acc > 0);
    timer.record(view)[RUNNING] = timing;
    let done = off & (reset_pending ^ 1) & u8::from(acc <= 0);
    timer.put_flags(view, acc, Flags { done, reset: leg | reset_pending, timing });
    leg | timing
}

/// One execution of TMRDOWN; gives `.Done`.
#[inline(always)]
fn run_down<R: Reach>(timer: &Timer, view: &mut View<R>, leg: u8) -> u8 {
    let record = timer.record(view);
    let on = leg & (record[PENDING] ^ 1);
    let advances = on & record[RUNNING] != 0;
    record[PENDING] = 0;
    record[RUNNING] = on;
    let remaining = down(timer.acc(view), view.elapsed_ms);
    let acc = if advances { remaining } else { timer.preset(view) };
    let acc = timer.put_acc(view, acc);
    let done = on & u8::from(acc <= 0);
    let timing = on & u8::from(acc != 0);
    timer.put_flags(view, acc, Flags { done, reset: on ^ 1, timing });
    done
}

/// TMRA; and TMRAG, whose RST leg is `$Off` here and which a pass only holds.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Tmra {
    pub en: Leg,
    pub rst: Leg,
    pub timer: Timer,
}

impl Operation for Tmra {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut View<R>) {
        let (en, rst) = (view.leg(&self.en), view.leg(&self.rst));
        let timer = &self.timer;
        let record = timer.record(view);
        let reset = rst | record[PENDING];
        let advances = en & record[RUNNING] & (reset ^ 1) != 0;
        record[PENDING] = 0;
        record[RUNNING] = en & (reset ^ 1);
        if reset != 0 {
            return timer.reset(view, TimerRule::Zero);
        }
        let preset = timer.preset(view);
        let acc = timer.acc(view);
        let acc = if advances { up(acc, view.elapsed_ms) } else { acc };
        let acc = timer.put_acc(view, acc);
        let done = u8::from(acc >= preset);
        timer.put_flags(view, acc, Flags { done, reset: 0, timing: en });
    }

    fn touches(&self, t: &mut Touches) {
        self.timer.touches(t.legs(&[self.en, self.rst]));
    }
}

/// TMRADOWN.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Tmradown {
    pub en: Leg,
    pub rst: Leg,
    pub timer: Timer,
}

impl Operation for Tmradown {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut View<R>) {
        let (en, rst) = (view.leg(&self.en), view.leg(&self.rst));
        let timer = &self.timer;
        let record = timer.record(view);
        let reset = rst | record[PENDING];
        let advances = en & record[RUNNING] & (reset ^ 1) != 0;
        let loads = record[LOADED] == 0;
        record[PENDING] = 0;
        record[RUNNING] = en & (reset ^ 1);
        record[LOADED] = 1;
        if reset != 0 {
            return timer.reset(view, TimerRule::Preset);
        }
        let from = if loads { timer.preset(view) } else { timer.acc(view) };
        let acc = if advances { down(from, view.elapsed_ms) } else { from };
        let acc = timer.put_acc(view, acc);
        let done = u8::from(acc <= 0);
        let timing = en & u8::from(acc != 0);
        timer.put_flags(view, acc, Flags { done, reset: 0, timing });
    }

    fn touches(&self, t: &mut Touches) {
        self.timer.touches(t.legs(&[self.en, self.rst]));
    }
}

/// RSTT of a timer, which acts by its owner's rule.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Rstt {
    pub leg: Leg,
    pub timer: Timer,
    pub rule: TimerRule,
}

impl Operation for Rstt {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut View<R>) {
        if view.leg(&self.leg) != 0 {
            self.timer.record(view)[PENDING] = 1;
            self.timer.reset(view, self.rule);
        }
    }

    fn touches(&self, t: &mut Touches) {
        self.timer.touches(t.legs(&[self.leg]));
    }
}
