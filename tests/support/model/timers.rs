//! ONDTMR, OFFDTMR, TMR, TMRDOWN, TMRA, TMRADOWN, TMRAG and RSTT.

use super::exec::Sim;
use super::place::{Area, Loc, Member};
use super::program::TimerKind;

#[derive(Clone, Default)]
pub struct TimerState {
    /// Whether an RSTT waits for the owner's next execution.
    pending: bool,
    /// Whether the owner has executed or had a pass, for TMRADOWN.
    loaded: bool,
    /// Whether the leg was ON at the last execution, for OFFDTMR.
    leg_was_on: bool,
    /// The timestamp from which the next execution takes its elapsed time.
    since: Option<i64>,
}

struct Flags {
    done: bool,
    reset: bool,
    timing: bool,
}

const RESET: Flags = Flags { done: false, reset: true, timing: false };

impl Sim<'_> {
    fn timer_kind(&self, t: usize) -> TimerKind {
        self.program.timers.get(&t).map_or(TimerKind::Tmr, |def| def.kind)
    }

    /// The preset; a negative preset counts as 0.
    fn timer_preset(&self, t: usize) -> i64 {
        let preset = self.program.timers.get(&t).map(|def| self.value(def.preset));
        preset.unwrap_or(0).max(0)
    }

    fn timer_reset_value(&mut self, t: usize) -> i64 {
        match self.timer_kind(t) {
            TimerKind::Tmrdown | TimerKind::Tmradown => {
                self.note_preset(t);
                self.timer_preset(t)
            }
            _ => 0,
        }
    }

    fn timer_acc(&self, t: usize) -> i64 {
        self.memory.get(Loc::of(Area::T, t, Member::Acc))
    }

    fn timer_put(&mut self, t: usize, acc: i64, flags: Flags) {
        self.memory.put(Loc::of(Area::T, t, Member::Acc), acc);
        self.memory.put_bit(Loc::of(Area::T, t, Member::Zero), acc == 0);
        self.memory.put_bit(Loc::of(Area::T, t, Member::Done), flags.done);
        self.memory.put_bit(Loc::of(Area::T, t, Member::Reset), flags.reset);
        self.memory.put_bit(Loc::of(Area::T, t, Member::Timing), flags.timing);
    }

    fn timer_output(&mut self, t: usize, on: bool) {
        if let Some(output) = self.program.timers.get(&t).and_then(|def| def.output) {
            self.memory.put_bit(output, on);
        }
    }

    /// Reads the preset, and notes a wrong index if it is an element outside of its array.
    fn note_preset(&mut self, t: usize) {
        if let Some(preset) = self.program.timers.get(&t).map(|def| def.preset) {
            self.read(preset);
        }
    }

    pub fn timer_run(&mut self, t: usize, legs: &[bool]) {
        self.note_preset(t);
        let leg = legs.first().copied().unwrap_or(false);
        let rst = legs.get(1).copied().unwrap_or(false);
        let mut state = self.timers.get(&t).cloned().unwrap_or_default();
        let pending = state.pending;
        state.pending = false;
        match self.timer_kind(t) {
            TimerKind::Ondtmr | TimerKind::Tmr => {
                self.delay_on(t, &mut state, leg && !pending);
            }
            TimerKind::Tmrdown => self.delay_down(t, &mut state, leg && !pending),
            TimerKind::Offdtmr => self.delay_off(t, &mut state, leg, pending),
            TimerKind::Tmra | TimerKind::Tmrag => {
                self.accumulate(t, &mut state, leg, rst || pending);
            }
            TimerKind::Tmradown => {
                self.accumulate_down(t, &mut state, leg, rst || pending);
            }
        }
        self.timers.insert(t, state);
    }

    fn delay_on(&mut self, t: usize, state: &mut TimerState, on: bool) {
        if !on {
            state.since = None;
            self.timer_put(t, 0, RESET);
            self.timer_output(t, false);
            return;
        }
        let acc = match state.since {
            None => 0,
            Some(then) => saturated(self.timer_acc(t) + (self.now - then)),
        };
        state.since = Some(self.now);
        let done = acc >= self.timer_preset(t);
        self.timer_put(t, acc, Flags { done, reset: false, timing: true });
        self.timer_output(t, done);
    }

    fn delay_down(&mut self, t: usize, state: &mut TimerState, on: bool) {
        if !on {
            state.since = None;
            self.timer_put(t, self.timer_preset(t), RESET);
            return;
        }
        let acc = match state.since {
            None => self.timer_preset(t),
            Some(then) => (self.timer_acc(t) - (self.now - then)).max(0),
        };
        state.since = Some(self.now);
        let flags = Flags { done: acc <= 0, reset: false, timing: acc != 0 };
        self.timer_put(t, acc, flags);
    }

    fn delay_off(&mut self, t: usize, state: &mut TimerState, leg: bool, pending: bool) {
        let was_on = std::mem::replace(&mut state.leg_was_on, leg);
        let since = state.since.take();
        if leg {
            self.timer_put(t, self.timer_preset(t), RESET);
            self.timer_output(t, true);
            return;
        }
        if pending {
            self.timer_put(t, 0, RESET);
            self.timer_output(t, false);
            return;
        }
        let remaining = match since {
            _ if was_on => self.timer_preset(t),
            Some(then) => self.timer_acc(t) - (self.now - then),
            None => 0,
        };
        let runs = remaining > 0;
        if runs {
            state.since = Some(self.now);
        }
        let flags = Flags { done: !runs, reset: false, timing: runs };
        self.timer_put(t, remaining.max(0), flags);
        self.timer_output(t, runs);
    }

    fn accumulate(&mut self, t: usize, state: &mut TimerState, enabled: bool, reset: bool) {
        let since = state.since.take();
        if reset {
            self.timer_put(t, 0, RESET);
            return;
        }
        let mut acc = self.timer_acc(t);
        if enabled {
            acc = saturated(acc + since.map_or(0, |then| self.now - then));
            state.since = Some(self.now);
        }
        let done = acc >= self.timer_preset(t);
        self.timer_put(t, acc, Flags { done, reset: false, timing: enabled });
    }

    fn accumulate_down(&mut self, t: usize, state: &mut TimerState, enabled: bool, reset: bool) {
        let since = state.since.take();
        let first = !std::mem::replace(&mut state.loaded, true);
        if reset {
            self.timer_put(t, self.timer_preset(t), RESET);
            return;
        }
        let mut acc = if first { self.timer_preset(t) } else { self.timer_acc(t) };
        if enabled {
            if let Some(then) = since {
                acc = (acc - (self.now - then)).max(0);
            }
            state.since = Some(self.now);
        }
        let timing = enabled && acc != 0;
        self.timer_put(t, acc, Flags { done: acc <= 0, reset: false, timing });
    }

    pub fn timer_end(&mut self, t: usize) {
        if self.timer_kind(t) == TimerKind::Tmrag {
            self.timers.entry(t).or_default().since = None;
            return;
        }
        let state = TimerState { loaded: true, ..TimerState::default() };
        self.timers.insert(t, state);
        let acc = self.timer_reset_value(t);
        self.timer_put(t, acc, RESET);
        self.timer_output(t, false);
    }

    pub fn rstt(&mut self, t: usize) {
        let acc = self.timer_reset_value(t);
        self.timer_put(t, acc, RESET);
        self.timers.entry(t).or_default().pending = true;
    }
}

fn saturated(acc: i64) -> i64 {
    acc.clamp(i64::from(i32::MIN), i64::from(i32::MAX))
}
