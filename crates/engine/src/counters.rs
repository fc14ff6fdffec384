//! The Do-more counters CNT, CNTDN, UDC, UDCG, and RSTCT.
//!
//! Behaviour: `docs/semantics.md`, section 2 (seeds S0, S1, S2). The counters differ in the reset
//! value, and in the conditions of `.Done` and `.DnDone`. [`CounterRule`] holds these differences;
//! RSTCT and the termination pass use it too. In a loop over operations of one kind, the rule is a
//! constant.

use super::memory::{MemoryView, select};
use super::ops::{Cnt, Cntdn, Operation, Rstct, Udc};
use super::places::{Counter, CounterRule};
use super::reach::Reach;
use super::record::OwnerState;
use super::record::counter_state::{DN, LOADED, PENDING, UP};
use super::role::{WordRead, WordWritten};

/// A rule with the values of its presets. They are read once, at the start of an execution, because
/// a preset may be the counter's own `.Acc`.
#[derive(Clone, Copy)]
enum ReadRule {
    Up(i32),
    Down(i32),
    UpDown(Option<i32>, Option<i32>),
}

/// The presets that `.Acc` has reached.
#[derive(Clone, Copy)]
struct Reached {
    /// The value of `.Done`.
    done: bool,
    /// The value of `.DnDone`.
    dn_done: bool,
}

impl ReadRule {
    /// The value of `.Acc` after a reset.
    #[inline(always)]
    fn reset_value(self) -> i32 {
        match self {
            ReadRule::Down(preset) => preset,
            ReadRule::Up(_) | ReadRule::UpDown(..) => 0,
        }
    }

    /// The values of `.Done` and `.DnDone`.
    #[inline(always)]
    fn reached(self, acc: i32) -> Reached {
        match self {
            ReadRule::Up(preset) => Reached { done: acc >= preset, dn_done: false },
            ReadRule::Down(_) => Reached { done: acc <= 0, dn_done: false },
            ReadRule::UpDown(up, dn) => Reached {
                done: up.is_some_and(|p| acc >= p),
                dn_done: dn.is_some_and(|p| acc <= p),
            },
        }
    }
}

impl CounterRule {
    #[inline(always)]
    fn read<R: Reach>(&self, view: &MemoryView<R>) -> ReadRule {
        match self {
            CounterRule::Up(preset) => ReadRule::Up(view.word(*preset)),
            CounterRule::Down(preset) => ReadRule::Down(view.word(*preset)),
            CounterRule::UpDown(presets) => {
                let read = |preset: Option<WordRead>| preset.map(|p| view.word(p));
                ReadRule::UpDown(read(presets.up), read(presets.dn))
            }
        }
    }
}

impl Counter {
    #[inline(always)]
    fn acc(self) -> WordWritten {
        WordWritten(self.at)
    }

    /// Writes `.Acc` and the flags that follow from it.
    #[inline(always)]
    fn put<R: Reach>(&self, view: &mut MemoryView<R>, rule: ReadRule, acc: i32, reset: u8) {
        let acc = view.put_word(self.acc(), acc);
        let Reached { done, dn_done } = rule.reached(acc);
        let flags = [u8::from(done), reset, u8::from(acc == 0), u8::from(dn_done)];
        view.put_flags(self.at, flags);
    }

    /// Resets the counter (RSTCT, termination pass): `.Acc` becomes the reset value at once,
    /// `.Reset` goes ON.
    pub(super) fn reset<R: Reach>(&self, view: &mut MemoryView<R>, rule: &CounterRule) {
        let rule = rule.read(view);
        self.put(view, rule, rule.reset_value(), 1);
    }

    /// The termination pass: resets the counter, turns histories and a pending reset OFF. A CNTDN
    /// then counts as loaded.
    pub(super) fn terminate<R: Reach>(&self, view: &mut MemoryView<R>, rule: &CounterRule) {
        view.put_state(self.at, OwnerState::of([(LOADED, 1)]));
        self.reset(view, rule);
    }
}

impl Operation for Cnt {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        let (leg, rst) = (view.leg(&self.up), view.leg(&self.rst));
        let preset = view.word(self.preset);
        let state = view.state(self.counter.at);
        let reset = rst | state.bit(PENDING);
        let counts = leg & (state.bit(UP) ^ 1);
        view.put_state(self.counter.at, OwnerState::of([(UP, leg)]));
        let before = view.word(self.counter.acc());
        let counted = before.wrapping_add(i32::from(counts));
        // A sum that is less than before has wrapped: then `.Acc` stays at the limit.
        let acc = select(reset, 0, counted.wrapping_sub(i32::from(counted < before)));
        self.counter.put(view, ReadRule::Up(preset), acc, reset);
    }
}

impl Operation for Cntdn {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        let (leg, rst) = (view.leg(&self.dn), view.leg(&self.rst));
        let preset = view.word(self.preset);
        let state = view.state(self.counter.at);
        let reset = rst | state.bit(PENDING);
        let counts = leg & (state.bit(DN) ^ 1);
        let loads = reset | (state.bit(LOADED) ^ 1);
        view.put_state(self.counter.at, OwnerState::of([(DN, leg), (LOADED, 1)]));
        let acc = view.word(self.counter.acc());
        let from = select(loads, preset, acc);
        let acc = from.saturating_sub(i32::from(counts & (reset ^ 1)));
        self.counter.put(view, ReadRule::Down(preset), acc, reset);
    }
}

impl Operation for Udc {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        let (up, dn, rst) = (view.leg(&self.up), view.leg(&self.dn), view.leg(&self.rst));
        let rule = CounterRule::UpDown(self.presets).read(view);
        let state = view.state(self.counter.at);
        let reset = rst | state.bit(PENDING);
        let (adds, takes) = (up & (state.bit(UP) ^ 1), dn & (state.bit(DN) ^ 1));
        view.put_state(self.counter.at, OwnerState::of([(UP, up), (DN, dn)]));
        let step = i32::from(adds) - i32::from(takes);
        let acc = view.word(self.counter.acc()).saturating_add(step);
        let acc = select(reset, 0, acc);
        self.counter.put(view, rule, acc, reset);
    }
}

impl Operation for Rstct {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        if view.leg(&self.leg) != 0 {
            let state = view.state(self.counter.at);
            view.put_state(self.counter.at, state.with(PENDING));
            self.counter.reset(view, &self.rule);
        }
    }
}
