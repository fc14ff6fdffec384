//! CNT, CNTDN, UDC, UDCG, RSTCT; the Sensaphone counters CTU, CTD, RES.

use super::exec::Sim;
use super::place::{Area, Loc, Member};
use super::program::{CounterKind, Instr, Value};

#[derive(Clone, Default)]
pub struct CounterState {
    /// Whether an RSTCT waits for the owner's next execution.
    pending: bool,
    /// Whether the owner has executed or had a pass. Then CNTDN no longer loads its preset.
    loaded: bool,
}

struct Presets {
    up: Option<i64>,
    down: Option<i64>,
}

impl Sim<'_> {
    fn counter_presets(&mut self, ct: usize) -> (CounterKind, Presets) {
        let Some(def) = self.program.counters.get(&ct) else {
            return (CounterKind::Cnt, Presets { up: None, down: None });
        };
        let (kind, up, down) = (def.kind, def.up, def.down);
        let up = up.map(|value| self.read(value));
        (kind, Presets { up, down: down.map(|value| self.read(value)) })
    }

    /// The value of a counter in reset.
    fn counter_reset_value(kind: CounterKind, presets: &Presets) -> i64 {
        match kind {
            CounterKind::Cntdn => presets.up.unwrap_or(0),
            _ => 0,
        }
    }

    /// Writes the accumulator and the flags that follow from it.
    fn counter_put(
        &mut self,
        ct: usize,
        acc: i64,
        reset: bool,
        kind: CounterKind,
        presets: &Presets,
    ) {
        let acc = acc.clamp(i64::from(i32::MIN), i64::from(i32::MAX));
        let done = match kind {
            CounterKind::Cntdn => acc <= 0,
            _ => presets.up.is_some_and(|preset| acc >= preset),
        };
        let down_done = presets.down.is_some_and(|preset| acc <= preset);
        self.memory.put(Loc::of(Area::Ct, ct, Member::Acc), acc);
        self.memory.put_bit(Loc::of(Area::Ct, ct, Member::Done), done);
        self.memory.put_bit(Loc::of(Area::Ct, ct, Member::DnDone), down_done);
        self.memory.put_bit(Loc::of(Area::Ct, ct, Member::Zero), acc == 0);
        self.memory.put_bit(Loc::of(Area::Ct, ct, Member::Reset), reset);
    }

    pub fn counter_run(&mut self, ct: usize, instr: &Instr, legs: &[bool]) {
        let (kind, presets) = self.counter_presets(ct);
        let leg = |n: usize| legs.get(n).copied().unwrap_or(false);
        let (up, down, rst) = match kind {
            CounterKind::Cnt => (leg(0), false, leg(1)),
            CounterKind::Cntdn => (false, leg(0), leg(1)),
            CounterKind::Udc => (leg(0), leg(1), leg(2)),
            CounterKind::Udcg => (leg(0), leg(1), false),
        };
        let up = self.edge(instr.history[0], up);
        let down = self.edge(instr.history[1], down);
        let mut acc = self.memory.get(Loc::of(Area::Ct, ct, Member::Acc));
        let state = self.counters.entry(ct).or_default();
        let reset = rst || state.pending;
        state.pending = false;
        if kind == CounterKind::Cntdn && !state.loaded {
            acc = Self::counter_reset_value(kind, &presets);
        }
        state.loaded = true;
        if reset {
            acc = Self::counter_reset_value(kind, &presets);
        } else {
            acc += i64::from(up) - i64::from(down);
        }
        self.counter_put(ct, acc, reset, kind, &presets);
    }

    pub fn counter_end(&mut self, ct: usize, instr: &Instr) {
        if self.program.counters.get(&ct).is_some_and(|def| def.kind == CounterKind::Udcg) {
            return;
        }
        let (kind, presets) = self.counter_presets(ct);
        self.forget(instr);
        self.counters.insert(ct, CounterState { pending: false, loaded: true });
        let acc = Self::counter_reset_value(kind, &presets);
        self.counter_put(ct, acc, true, kind, &presets);
    }

    pub fn rstct(&mut self, ct: usize) {
        let (kind, presets) = self.counter_presets(ct);
        let acc = Self::counter_reset_value(kind, &presets);
        self.counter_put(ct, acc, true, kind, &presets);
        self.counters.entry(ct).or_default().pending = true;
    }

    /// Executes CTU or CTD.
    pub fn sensaphone_run(
        &mut self,
        n: usize,
        up: bool,
        preset: Option<Value>,
        instr: &Instr,
        power: bool,
    ) {
        let at = |member| Loc::of(Area::N, n, member);
        if let Some(preset @ (Value::Real(_) | Value::At(_) | Value::Element(..))) = preset {
            let preset = self.read(preset);
            self.memory.put(at(Member::Pre), preset);
        }
        let (enabled, mine, other, last, next) = match up {
            true => (Member::Cu, Member::Ov, Member::Un, i16::MAX, i16::MIN),
            false => (Member::Cd, Member::Un, Member::Ov, i16::MIN, i16::MAX),
        };
        self.memory.put_bit(at(enabled), power);
        if self.edge(instr.history[0], power) {
            let acc = self.memory.get(at(Member::Acc));
            if acc == i64::from(last) {
                self.memory.put(at(Member::Acc), i64::from(next));
                let back = self.memory.bit(at(other));
                self.memory.put_bit(if back { at(other) } else { at(mine) }, !back);
            } else {
                self.memory.put(at(Member::Acc), if up { acc + 1 } else { acc - 1 });
            }
        }
        let done = self.memory.get(at(Member::Acc)) >= self.memory.get(at(Member::Pre));
        self.memory.put_bit(at(Member::Dn), done);
    }

    pub fn sensaphone_end(&mut self, n: usize, up: bool, instr: &Instr) {
        self.forget(instr);
        let enabled = if up { Member::Cu } else { Member::Cd };
        self.memory.put_bit(Loc::of(Area::N, n, enabled), false);
    }

    pub fn res(&mut self, n: usize) {
        let cleared = [Member::Acc, Member::Cu, Member::Cd, Member::Dn, Member::Ov, Member::Un];
        for member in cleared {
            self.memory.put(Loc::of(Area::N, n, member), 0);
        }
    }
}
