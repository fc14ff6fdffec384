//! The Do-more timers, and RSTT.
//!
//! Behaviour: `docs/semantics.md`, section 3 (seed S0 for ONDTMR and OFFDTMR, vendor help for the
//! rest). A timer adds the whole milliseconds between its executions' timestamps, so that nothing
//! drifts. A preset `<= 0` is treated as 0.

use super::memory::{TimerState, View};
use super::ops::{Operation, Power, Touches};

/// A timer structure's places.
#[derive(Clone, Copy, Debug)]
pub struct Timer {
    /// Its number, for its state.
    pub t: u32,
    /// The cell of `.Acc`.
    pub acc: u32,
    /// The first of its four flag cells: Done, Reset, Zero, Timing.
    pub flags: u32,
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
    fn preset(&self, view: &View) -> i32 {
        view.word(self.preset).max(0)
    }

    #[inline(always)]
    fn state<'a>(&self, view: &'a mut View) -> &'a mut TimerState {
        &mut view.timers[self.t as usize]
    }

    /// Milliseconds since the state's timestamp, which becomes now.
    #[inline(always)]
    fn elapsed_ms(&self, view: &mut View) -> u32 {
        let now_ms = view.now_ms;
        let state = self.state(view);
        now_ms.wrapping_sub(std::mem::replace(&mut state.then_ms, now_ms))
    }

    /// Writes `.Acc`; gives what it then holds.
    #[inline(always)]
    fn put_acc<const F: bool>(&self, view: &mut View, acc: i32) -> i32 {
        view.put_word::<F>(self.acc, acc)
    }

    #[inline(always)]
    fn put_flags<const F: bool>(&self, view: &mut View, acc: i32, flags: Flags) {
        let zero = u8::from(acc == 0);
        view.put_flags::<F>(self.flags, [flags.done, flags.reset, zero, flags.timing]);
    }

    /// The reset state: the reset value, `.Reset` ON, `.Done` and `.Timing` OFF.
    #[inline(always)]
    pub(super) fn reset<const F: bool>(&self, view: &mut View, rule: TimerRule) {
        let value = if rule == TimerRule::Preset { self.preset(view) } else { 0 };
        let acc = self.put_acc::<F>(view, value);
        self.put_flags::<F>(view, acc, Flags { done: 0, reset: 1, timing: 0 });
    }

    /// The pass: the reset state, nothing running, a pending reset gone.
    pub(super) fn terminate<const F: bool>(&self, view: &mut View, rule: TimerRule) {
        *self.state(view) =
            TimerState { then_ms: view.now_ms, running: 0, leg: 0, pending: 0, loaded: 1 };
        self.reset::<F>(view, rule);
    }

    /// The pass over TMRAG: the time until its next execution does not count.
    pub(super) fn hold(&self, view: &mut View) {
        self.state(view).running = 0;
    }

    fn touches(&self, t: &mut Touches) {
        t.reads(&[self.acc, self.preset]).writes_words(&[self.acc]).writes_flags(self.flags);
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
fn run_up<const F: bool>(timer: &Timer, view: &mut View, leg: u8) -> u8 {
    let elapsed = timer.elapsed_ms(view);
    let preset = timer.preset(view);
    let state = timer.state(view);
    let on = leg & (state.pending ^ 1);
    let adds = on & state.running;
    state.pending = 0;
    state.running = on;
    // `adds` is 0 or 1: all bits or none.
    let keep = 0i32.wrapping_sub(i32::from(adds));
    let acc = view.word(timer.acc).saturating_add_unsigned(elapsed) & keep;
    let acc = timer.put_acc::<F>(view, acc);
    let done = on & u8::from(acc >= preset);
    timer.put_flags::<F>(view, acc, Flags { done, reset: on ^ 1, timing: on });
    done
}

/// One execution of a down timer that is enabled and not in reset; `advances`: time counts.
#[inline(always)]
fn down(acc: i32, elapsed: u32, advances: bool) -> i32 {
    if advances { acc.saturating_sub_unsigned(elapsed).max(0) } else { acc }
}

macro_rules! one_leg {
    ($($(#[$doc:meta])* $op:ident { $($output:ident)? } |$timer:ident, $view:ident, $leg:ident|
       $run:expr;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        #[allow(missing_docs)]
        pub struct $op {
            pub leg: Power,
            pub timer: Timer,
            $(pub $output: u32,)?
        }

        impl Operation for $op {
            #[inline(always)]
            fn run<const F: bool>(&self, $view: &mut View) {
                let ($timer, $leg) = (&self.timer, $view.power(self.leg));
                let done = $run;
                $($view.put_bit::<F>(self.$output, done);)?
                let _ = done;
            }

            fn touches(&self, t: &mut Touches) {
                $(t.writes_bits(&[self.$output]);)?
                self.timer.touches(t.powers(&[self.leg]));
            }
        }
    )*};
}

one_leg! {
    /// ONDTMR.
    Ondtmr { output } |timer, view, leg| run_up::<F>(timer, view, leg);
    /// TMR.
    Tmr { } |timer, view, leg| run_up::<F>(timer, view, leg);
    /// OFFDTMR.
    Offdtmr { output } |timer, view, leg| run_off_delay::<F>(timer, view, leg);
    /// TMRDOWN.
    Tmrdown { } |timer, view, leg| run_down::<F>(timer, view, leg);
}

/// One execution of OFFDTMR: the rows of its table; gives the output.
///
/// Branch-free, for the reason given at `run_up`. The leg ON, and the first execution with the leg
/// OFF after it, load the preset; while timing down time is taken away; else `.Acc` is 0.
#[inline(always)]
fn run_off_delay<const F: bool>(timer: &Timer, view: &mut View, leg: u8) -> u8 {
    let elapsed = timer.elapsed_ms(view);
    let preset = timer.preset(view);
    let state = timer.state(view);
    let off = leg ^ 1;
    let reset_pending = off & state.pending;
    let falls = off & state.leg & (reset_pending ^ 1);
    let times = off & (state.leg ^ 1) & state.running & (reset_pending ^ 1);
    state.pending = 0;
    state.leg = leg;
    let remaining = view.word(timer.acc).saturating_sub_unsigned(elapsed).max(0);
    let mask = |bit: u8| 0i32.wrapping_sub(i32::from(bit));
    let acc = (preset & mask(leg | falls)) | (remaining & mask(times));
    let acc = timer.put_acc::<F>(view, acc);
    let timing = (falls | times) & u8::from(acc > 0);
    timer.state(view).running = timing;
    let done = off & (reset_pending ^ 1) & u8::from(acc <= 0);
    timer.put_flags::<F>(view, acc, Flags { done, reset: leg | reset_pending, timing });
    leg | timing
}

/// One execution of TMRDOWN; gives `.Done`.
#[inline(always)]
fn run_down<const F: bool>(timer: &Timer, view: &mut View, leg: u8) -> u8 {
    let elapsed = timer.elapsed_ms(view);
    let state = timer.state(view);
    let on = leg & (state.pending ^ 1);
    let advances = on & state.running != 0;
    state.pending = 0;
    state.running = on;
    let from = if advances { view.word(timer.acc) } else { timer.preset(view) };
    let acc = timer.put_acc::<F>(view, down(from, elapsed, advances));
    let done = on & u8::from(acc <= 0);
    let timing = on & u8::from(acc != 0);
    timer.put_flags::<F>(view, acc, Flags { done, reset: on ^ 1, timing });
    done
}

/// TMRA; and TMRAG, whose RST leg is `$Off` here and which a pass only holds.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Tmra {
    pub en: Power,
    pub rst: Power,
    pub timer: Timer,
}

impl Operation for Tmra {
    #[inline(always)]
    fn run<const F: bool>(&self, view: &mut View) {
        let (en, rst) = (view.power(self.en), view.power(self.rst));
        let timer = &self.timer;
        let elapsed = timer.elapsed_ms(view);
        let state = timer.state(view);
        let reset = rst | state.pending;
        let advances = en & state.running & (reset ^ 1) != 0;
        state.pending = 0;
        state.running = en & (reset ^ 1);
        if reset != 0 {
            return timer.reset::<F>(view, TimerRule::Zero);
        }
        let preset = timer.preset(view);
        let acc = view.word(timer.acc);
        let acc = if advances { acc.saturating_add_unsigned(elapsed) } else { acc };
        let acc = timer.put_acc::<F>(view, acc);
        let done = u8::from(acc >= preset);
        timer.put_flags::<F>(view, acc, Flags { done, reset: 0, timing: en });
    }

    fn touches(&self, t: &mut Touches) {
        self.timer.touches(t.powers(&[self.en, self.rst]));
    }
}

/// TMRADOWN.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Tmradown {
    pub en: Power,
    pub rst: Power,
    pub timer: Timer,
}

impl Operation for Tmradown {
    #[inline(always)]
    fn run<const F: bool>(&self, view: &mut View) {
        let (en, rst) = (view.power(self.en), view.power(self.rst));
        let timer = &self.timer;
        let elapsed = timer.elapsed_ms(view);
        let state = timer.state(view);
        let reset = rst | state.pending;
        let advances = en & state.running & (reset ^ 1) != 0;
        let loads = state.loaded == 0;
        state.pending = 0;
        state.running = en & (reset ^ 1);
        state.loaded = 1;
        if reset != 0 {
            return timer.reset::<F>(view, TimerRule::Preset);
        }
        let from = if loads { timer.preset(view) } else { view.word(timer.acc) };
        let acc = timer.put_acc::<F>(view, down(from, elapsed, advances));
        let done = u8::from(acc <= 0);
        let timing = en & u8::from(acc != 0);
        timer.put_flags::<F>(view, acc, Flags { done, reset: 0, timing });
    }

    fn touches(&self, t: &mut Touches) {
        self.timer.touches(t.powers(&[self.en, self.rst]));
    }
}

/// RSTT of a timer, which acts by its owner's rule.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Rstt {
    pub leg: Power,
    pub timer: Timer,
    pub rule: TimerRule,
}

impl Operation for Rstt {
    #[inline(always)]
    fn run<const F: bool>(&self, view: &mut View) {
        if view.power(self.leg) != 0 {
            self.timer.state(view).pending = 1;
            self.timer.reset::<F>(view, self.rule);
        }
    }

    fn touches(&self, t: &mut Touches) {
        self.timer.touches(t.powers(&[self.leg]));
    }
}
