//! The Do-more timers, and RSTT.
//!
//! Behaviour: `docs/semantics.md`, section 3 (seed S0 for ONDTMR and OFFDTMR, vendor help for the
//! rest). A timer adds the whole milliseconds between the timestamps of its executions, so that it
//! does not drift. All timers of an element execute together, so the element computes this time
//! once. A preset `<= 0` is treated as 0.

use super::memory::{MemoryView, select};
use super::ops::{Offdtmr, Ondtmr, Operation, Rstt, Tmr, Tmra, Tmradown, Tmrdown};
use super::places::{Timer, TimerRule};
use super::reach::Reach;
use super::record::OwnerState;
use super::record::timer_state::{LEG, LOADED, PENDING, RUNNING};
use super::role::WordWritten;

impl Timer {
    #[inline(always)]
    fn preset<R: Reach>(&self, view: &MemoryView<R>) -> i32 {
        view.word(self.preset).max(0)
    }

    #[inline(always)]
    fn acc<R: Reach>(&self, view: &MemoryView<R>) -> i32 {
        view.word(WordWritten(self.at))
    }

    /// Writes `.Acc`; returns its value afterwards.
    #[inline(always)]
    fn put_acc<R: Reach>(&self, view: &mut MemoryView<R>, acc: i32) -> i32 {
        view.put_word(WordWritten(self.at), acc)
    }

    #[inline(always)]
    fn put_flags<R: Reach>(&self, view: &mut MemoryView<R>, acc: i32, flags: TimerFlags) {
        let zero = u8::from(acc == 0);
        view.put_flags(self.at, [flags.done, flags.reset, zero, flags.timing]);
    }

    /// Writes the reset state: the reset value, `.Reset` ON, `.Done` and `.Timing` OFF.
    #[inline(always)]
    pub(super) fn reset<R: Reach>(&self, view: &mut MemoryView<R>, rule: TimerRule) {
        let value = if rule == TimerRule::Preset { self.preset(view) } else { 0 };
        let acc = self.put_acc(view, value);
        self.put_flags(view, acc, TimerFlags { done: 0, reset: 1, timing: 0 });
    }

    /// The termination pass: writes the reset state, stops timing, and clears a pending reset.
    pub(super) fn terminate<R: Reach>(&self, view: &mut MemoryView<R>, rule: TimerRule) {
        view.put_state(self.at, OwnerState::of([(LOADED, 1)]));
        self.reset(view, rule);
    }

    /// The termination pass over TMRAG: the time until its next execution does not count.
    pub(super) fn hold<R: Reach>(&self, view: &mut MemoryView<R>) {
        let state = view.state(self.at);
        view.put_state(self.at, state.without(RUNNING));
    }
}

#[derive(Clone, Copy)]
struct TimerFlags {
    done: u8,
    reset: u8,
    timing: u8,
}

/// One execution of ONDTMR or TMR, enabled or reset; returns `.Done`.
///
/// Branch-free: reset, first and further executions are mixed between neighbouring operations and
/// scans, and a mispredicted branch costs more than this whole function.
#[inline(always)]
fn run_up<R: Reach>(timer: &Timer, view: &mut MemoryView<R>, leg: u8) -> u8 {
    let preset = timer.preset(view);
    let state = view.state(timer.at);
    let on = leg & (state.bit(PENDING) ^ 1);
    let adds = on & state.bit(RUNNING);
    view.put_state(timer.at, OwnerState::of([(RUNNING, on)]));
    let acc = select(adds, up(timer.acc(view), view.elapsed_ms), 0);
    let acc = timer.put_acc(view, acc);
    let done = on & u8::from(acc >= preset);
    timer.put_flags(view, acc, TimerFlags { done, reset: on ^ 1, timing: on });
    done
}

/// Adds time, saturating: a sum that is less than before has wrapped.
#[inline(always)]
fn up(acc: i32, elapsed_ms: i32) -> i32 {
    let sum = acc.wrapping_add(elapsed_ms);
    if sum < acc { i32::MAX } else { sum }
}

/// Subtracts time, down to 0.
#[inline(always)]
fn down(acc: i32, elapsed_ms: i32) -> i32 {
    if acc > elapsed_ms { acc.wrapping_sub(elapsed_ms) } else { 0 }
}

macro_rules! one_leg {
    ($($op:ident { $($output:ident)? } |$timer:ident, $view:ident, $leg:ident|
       $run:expr;)*) => {$(
        impl Operation for $op {
            #[inline(always)]
            fn run<R: Reach>(&self, $view: &mut MemoryView<R>) {
                let ($timer, $leg) = (&self.timer, $view.leg(&self.leg));
                let done = $run;
                $($view.put_bit(self.$output, done);)?
                let _ = done;
            }
        }
    )*};
}

one_leg! {
    Ondtmr { output } |timer, view, leg| run_up(timer, view, leg);
    Tmr { } |timer, view, leg| run_up(timer, view, leg);
    Offdtmr { output } |timer, view, leg| run_off_delay(timer, view, leg);
    Tmrdown { } |timer, view, leg| run_down(timer, view, leg);
}

/// One execution of OFFDTMR, by its table in `docs/semantics.md`; returns the output.
///
/// Branch-free, for the reason given at `run_up`. An execution with the leg ON, and the first one
/// with the leg OFF after it, load the preset. While timing down, time is subtracted; otherwise
/// `.Acc` is 0.
#[inline(always)]
fn run_off_delay<R: Reach>(timer: &Timer, view: &mut MemoryView<R>, leg: u8) -> u8 {
    let preset = timer.preset(view);
    let state = view.state(timer.at);
    let (was_on, was_timing, pending) = (state.bit(LEG), state.bit(RUNNING), state.bit(PENDING));
    let live = (leg | pending) ^ 1;
    let counts = live & (was_on | was_timing);
    let loads = leg | was_on;
    let remaining = down(timer.acc(view), view.elapsed_ms);
    let acc = select(loads, preset, remaining);
    let acc = timer.put_acc(view, select(leg | counts, acc, 0));
    let positive = u8::from(acc > 0);
    let timing = counts & positive;
    view.put_state(timer.at, OwnerState::of([(RUNNING, timing), (LEG, leg)]));
    let done = live & (positive ^ 1);
    timer.put_flags(view, acc, TimerFlags { done, reset: leg | pending, timing });
    leg | timing
}

/// One execution of TMRDOWN; returns `.Done`.
#[inline(always)]
fn run_down<R: Reach>(timer: &Timer, view: &mut MemoryView<R>, leg: u8) -> u8 {
    let state = view.state(timer.at);
    let on = leg & (state.bit(PENDING) ^ 1);
    let advances = on & state.bit(RUNNING);
    view.put_state(timer.at, OwnerState::of([(RUNNING, on)]));
    let remaining = down(timer.acc(view), view.elapsed_ms);
    let acc = select(advances, remaining, timer.preset(view));
    let acc = timer.put_acc(view, acc);
    let done = on & u8::from(acc <= 0);
    let timing = on & u8::from(acc != 0);
    timer.put_flags(view, acc, TimerFlags { done, reset: on ^ 1, timing });
    done
}

/// An execution of a timer with the legs `en` and `rst`; each value is 0 or 1.
#[derive(Clone, Copy)]
struct Accumulating {
    reset: u8,
    /// Whether the timer times.
    times: u8,
    /// Whether the time since its last execution counts.
    adds: u8,
}

impl Accumulating {
    #[inline(always)]
    fn of(state: OwnerState, en: u8, rst: u8) -> Accumulating {
        let reset = rst | state.bit(PENDING);
        let times = en & (reset ^ 1);
        Accumulating { reset, times, adds: times & state.bit(RUNNING) }
    }
}

impl Operation for Tmra {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        let (en, rst) = (view.leg(&self.en), view.leg(&self.rst));
        let timer = &self.timer;
        let Accumulating { reset, times, adds } = Accumulating::of(view.state(timer.at), en, rst);
        view.put_state(timer.at, OwnerState::of([(RUNNING, times)]));
        let preset = timer.preset(view);
        let acc = up(timer.acc(view), select(adds, view.elapsed_ms, 0));
        let acc = timer.put_acc(view, select(reset, 0, acc));
        let done = u8::from(acc >= preset) & (reset ^ 1);
        timer.put_flags(view, acc, TimerFlags { done, reset, timing: times });
    }
}

impl Operation for Tmradown {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        let (en, rst) = (view.leg(&self.en), view.leg(&self.rst));
        let timer = &self.timer;
        let state = view.state(timer.at);
        let Accumulating { reset, times, adds: takes } = Accumulating::of(state, en, rst);
        let loads = reset | (state.bit(LOADED) ^ 1);
        view.put_state(timer.at, OwnerState::of([(RUNNING, times), (LOADED, 1)]));
        let preset = timer.preset(view);
        let from = select(loads, preset, timer.acc(view));
        let acc = select(takes, down(from, view.elapsed_ms), from);
        let acc = timer.put_acc(view, acc);
        let done = u8::from(acc <= 0) & (reset ^ 1);
        let timing = times & u8::from(acc != 0);
        timer.put_flags(view, acc, TimerFlags { done, reset, timing });
    }
}

impl Operation for Rstt {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        if view.leg(&self.leg) != 0 {
            let state = view.state(self.timer.at);
            view.put_state(self.timer.at, state.with(PENDING));
            self.timer.reset(view, self.rule);
        }
    }
}
