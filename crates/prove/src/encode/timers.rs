//! The timers of Do-more, as in the engine's `timers`; the time since an element's last execution.
//!
//! A timer adds that time while it is timing, which it is only if its element has executed since
//! its last pass. Programs, Stages, and Tasks that run once have then executed in the scan before:
//! their time is one period. Recurrent Tasks and subroutines count the scans.

use super::acc_forms::{AccForm, keeps_time, timer_of};
use super::encoder::Encoder;
use super::held::{Elapsed, OwnNumber};
use super::number::Number;
use crate::aig::Literal;
use rungd_engine::isa::ElementId;
use rungd_engine::ops::{Offdtmr, Ondtmr, Rstt, Timer, TimerRule, Tmr, Tmra, Tmradown, Tmrdown};
use rungd_engine::record::FLAGS;
use rungd_engine::record::timer_state::{LEG, LOADED, PENDING, RUNNING};
use rungd_engine::{BlockRole, ElementCode};

impl Encoder<'_> {
    /// The greatest number of periods of which an element's operations make a difference; `None` if
    /// they do not ask for the time.
    fn age_max(&self, code: &ElementCode) -> Option<i128> {
        let period_ms = i128::from(self.model.period_ms().max(1));
        let all = i128::from(i32::MAX) / period_ms + 1;
        let tables = &self.code.tables;
        let batches = code.batches.clone().map(|at| tables.batches[at as usize]);
        let ages = batches.flat_map(|batch| tables.ops_of(batch)).filter_map(|op| {
            if keeps_time(&op) {
                return Some(all);
            }
            let (timer, _) = timer_of(&op)?;
            Some(match self.acc_forms.get(&timer.at) {
                Some(AccForm::Scans { high }) => i128::from(*high),
                Some(AccForm::Limited { high, .. }) => i128::from(*high) / period_ms + 1,
                None => all,
            })
        });
        ages.max().map(|age| age.max(1))
    }

    /// The time since an element's last execution, at its next one; `None` if nothing asks for it.
    pub(super) fn time_of(&mut self, element: ElementId, code: &ElementCode) -> Option<Elapsed> {
        let mut max = self.age_max(code)?;
        let role = self.code.blocks[element.block.0 as usize].role;
        // The time of the observer goes on while RUN begins again.
        let skips = role == BlockRole::Subroutine
            || self.written.recurrent.contains_key(&element.block)
            || self.model.events.observer == Some(element.block);
        // In a given state, a timer that times has executed in the scan before.
        if !skips && self.start.is_given {
            return Some(Elapsed::Scans(Number::constant(1)));
        }
        if !skips && !self.start.has_running_timer {
            return Some(Elapsed::Scans(self.since()));
        }
        // A timer is timing only if its Task was executed one interval before.
        if let Some(interval) = self.written.interval(element.block)
            && !self.start.has_running_timer
        {
            let periods = i128::from(interval) / i128::from(self.model.period_ms().max(1));
            max = max.min(periods + i128::from(self.model.late_max));
        }
        let age = OwnNumber::Age(element.into());
        let is_first_read = !self.own_numbers.contains_key(&age);
        let mut scans = self.own_number(age, max);
        if is_first_read && self.late.is_some() {
            let since = self.since();
            scans = scans.add(&mut self.graph, &since).clamp(&mut self.graph, 0, max);
            self.own_numbers.insert(age, scans.clone());
        }
        self.put_own_number(age, &Number::constant(0), max);
        self.ages.insert(age, max);
        Some(Elapsed::Scans(scans))
    }

    /// The number of periods since the scan before; 0 in the first scan.
    pub(super) fn since(&mut self) -> Number {
        let first = self.first_scan();
        match self.late.clone() {
            None => Number::of_bit(!first),
            Some(late) => self.choose(first, &Number::constant(0), &late),
        }
    }

    /// Every age at the start of the next scan. If that may come late, its age is known only there.
    pub(super) fn end_ages(&mut self) {
        if self.late.is_some() {
            return;
        }
        for (age, max) in self.ages.clone() {
            let later = self.own_number(age, max).add(&mut self.graph, &Number::constant(1));
            let limited = later.clamp(&mut self.graph, 0, max);
            self.own_numbers.insert(age, limited);
        }
    }

    /// The time, ms.
    pub(super) fn elapsed_ms(&mut self) -> Number {
        match self.elapsed.clone().expect("an element with a timer asks for the time") {
            Elapsed::Ms(elapsed) => elapsed,
            Elapsed::Scans(scans) => {
                let period = Number::constant(self.model.period_ms().into());
                let elapsed = scans.mul(&mut self.graph, &period);
                elapsed.clamp(&mut self.graph, 0, i32::MAX)
            }
        }
    }

    /// The time in the unit of a timer.
    fn elapsed(&mut self, timer: Timer) -> Number {
        match (self.acc_forms.get(&timer.at), &self.elapsed) {
            (Some(AccForm::Scans { .. }), Some(Elapsed::Scans(scans))) => scans.clone(),
            _ => self.elapsed_ms(),
        }
    }

    /// The preset in the unit of the timer.
    fn preset(&mut self, timer: Timer) -> Number {
        let preset = self.word(timer.preset.0);
        let preset = preset.clamp(&mut self.graph, 0, i32::MAX);
        match (self.acc_forms.get(&timer.at), preset.as_constant()) {
            (Some(AccForm::Scans { .. }), Some(ms)) => {
                let period = i128::from(self.model.period_ms().max(1));
                Number::constant((ms + period - 1) / period)
            }
            _ => preset,
        }
    }

    /// `.Acc` with the time added, saturating.
    fn up(&mut self, timer: Timer, acc: &Number) -> Number {
        let elapsed = self.elapsed(timer);
        let sum = acc.add(&mut self.graph, &elapsed);
        let high = self.acc_forms.get(&timer.at).map_or(i32::MAX, |form| form.range().high);
        sum.clamp(&mut self.graph, i32::MIN, high)
    }

    /// `.Acc` with the time subtracted, down to 0.
    fn down(&mut self, timer: Timer, acc: &Number) -> Number {
        let elapsed = self.elapsed(timer);
        let less = acc.sub(&mut self.graph, &elapsed);
        less.clamp(&mut self.graph, 0, i32::MAX)
    }

    fn put_timer(&mut self, timer: Timer, acc: Number, flags: TimerLiterals) {
        let zero = acc.is_zero(&mut self.graph);
        self.put_word(timer.at, acc);
        self.put_flags(timer.at, [flags.done, flags.reset, zero, flags.timing]);
    }

    /// Writes the reset state.
    fn reset_timer(&mut self, timer: Timer, rule: TimerRule) {
        let value = match rule {
            TimerRule::Preset => self.preset(timer),
            TimerRule::Zero => Number::constant(0),
        };
        let (done, timing) = (Literal::FALSE, Literal::FALSE);
        self.put_timer(timer, value, TimerLiterals { done, reset: Literal::TRUE, timing });
    }

    /// The termination pass over a timer.
    pub(super) fn terminate_timer(&mut self, timer: Timer, rule: TimerRule) {
        self.put_state(timer.at, &[(LOADED, Literal::TRUE)]);
        self.reset_timer(timer, rule);
    }

    /// The termination pass over TMRAG.
    pub(super) fn hold_timer(&mut self, timer: Timer) {
        self.put_record_bit(timer.at, FLAGS as u32 + RUNNING, Literal::FALSE);
    }

    /// One execution of ONDTMR or TMR; returns `.Done`.
    fn run_up(&mut self, timer: Timer, leg: Literal) -> Literal {
        let preset = self.preset(timer);
        let (pending, running) = (self.state(timer.at, PENDING), self.state(timer.at, RUNNING));
        let on = self.graph.and(leg, !pending);
        let adds = self.graph.and(on, running);
        self.put_state(timer.at, &[(RUNNING, on)]);
        let acc = self.word(timer.at);
        let later = self.up(timer, &acc);
        let acc = self.choose(adds, &later, &Number::constant(0));
        let reached = !acc.less(&mut self.graph, &preset);
        let done = self.graph.and(on, reached);
        self.put_timer(timer, acc, TimerLiterals { done, reset: !on, timing: on });
        done
    }

    pub(super) fn ondtmr(&mut self, op: &Ondtmr) {
        let leg = self.leg(&op.leg);
        let done = self.run_up(op.timer, leg);
        self.put_bit(op.output.0, done);
    }

    pub(super) fn tmr(&mut self, op: &Tmr) {
        let leg = self.leg(&op.leg);
        self.run_up(op.timer, leg);
    }

    pub(super) fn offdtmr(&mut self, op: &Offdtmr) {
        let (timer, leg) = (op.timer, self.leg(&op.leg));
        let preset = self.preset(timer);
        let (was_on, was_timing) = (self.state(timer.at, LEG), self.state(timer.at, RUNNING));
        let pending = self.state(timer.at, PENDING);
        let live = self.graph.and(!leg, !pending);
        let was = self.graph.or(was_on, was_timing);
        let counts = self.graph.and(live, was);
        let loads = self.graph.or(leg, was_on);
        let acc = self.word(timer.at);
        let remaining = self.down(timer, &acc);
        let acc = self.choose(loads, &preset, &remaining);
        let lasts = self.graph.or(leg, counts);
        let acc = self.choose(lasts, &acc, &Number::constant(0));
        let positive = Number::constant(0).less(&mut self.graph, &acc);
        let timing = self.graph.and(counts, positive);
        self.put_state(timer.at, &[(RUNNING, timing), (LEG, leg)]);
        let done = self.graph.and(live, !positive);
        let reset = self.graph.or(leg, pending);
        self.put_timer(timer, acc, TimerLiterals { done, reset, timing });
        let output = self.graph.or(leg, timing);
        self.put_bit(op.output.0, output);
    }

    pub(super) fn tmrdown(&mut self, op: &Tmrdown) {
        let (timer, leg) = (op.timer, self.leg(&op.leg));
        let (pending, running) = (self.state(timer.at, PENDING), self.state(timer.at, RUNNING));
        let on = self.graph.and(leg, !pending);
        let advances = self.graph.and(on, running);
        self.put_state(timer.at, &[(RUNNING, on)]);
        let acc = self.word(timer.at);
        let (remaining, preset) = (self.down(timer, &acc), self.preset(timer));
        let acc = self.choose(advances, &remaining, &preset);
        let positive = Number::constant(0).less(&mut self.graph, &acc);
        let zero = acc.is_zero(&mut self.graph);
        let (done, timing) = (self.graph.and(on, !positive), self.graph.and(on, !zero));
        self.put_timer(timer, acc, TimerLiterals { done, reset: !on, timing });
    }

    /// An execution of a timer with the legs `en` and `rst`.
    fn accumulating(&mut self, timer: Timer, en: Literal, rst: Literal) -> AddedTime {
        let (pending, running) = (self.state(timer.at, PENDING), self.state(timer.at, RUNNING));
        let reset = self.graph.or(rst, pending);
        let times = self.graph.and(en, !reset);
        AddedTime { reset, times, adds: self.graph.and(times, running) }
    }

    pub(super) fn tmra(&mut self, op: &Tmra) {
        let (timer, en, rst) = (op.timer, self.leg(&op.en), self.leg(&op.rst));
        let AddedTime { reset, times, adds } = self.accumulating(timer, en, rst);
        self.put_state(timer.at, &[(RUNNING, times)]);
        let (preset, acc) = (self.preset(timer), self.word(timer.at));
        let later = self.up(timer, &acc);
        let acc = self.choose(adds, &later, &acc);
        let acc = self.choose(reset, &Number::constant(0), &acc);
        let reached = !acc.less(&mut self.graph, &preset);
        let done = self.graph.and(reached, !reset);
        self.put_timer(timer, acc, TimerLiterals { done, reset, timing: times });
    }

    pub(super) fn tmradown(&mut self, op: &Tmradown) {
        let (timer, en, rst) = (op.timer, self.leg(&op.en), self.leg(&op.rst));
        let AddedTime { reset, times, adds } = self.accumulating(timer, en, rst);
        let loaded = self.state(timer.at, LOADED);
        let loads = self.graph.or(reset, !loaded);
        self.put_state(timer.at, &[(RUNNING, times), (LOADED, Literal::TRUE)]);
        let (preset, acc) = (self.preset(timer), self.word(timer.at));
        let from = self.choose(loads, &preset, &acc);
        let remaining = self.down(timer, &from);
        let acc = self.choose(adds, &remaining, &from);
        let positive = Number::constant(0).less(&mut self.graph, &acc);
        let zero = acc.is_zero(&mut self.graph);
        let (done, timing) = (self.graph.and(!positive, !reset), self.graph.and(times, !zero));
        self.put_timer(timer, acc, TimerLiterals { done, reset, timing });
    }

    pub(super) fn rstt(&mut self, op: &Rstt) {
        let leg = self.leg(&op.leg);
        self.under(leg, |scan| {
            scan.put_record_bit(op.timer.at, FLAGS as u32 + PENDING, Literal::TRUE);
            scan.reset_timer(op.timer, op.rule);
        });
    }
}

struct TimerLiterals {
    done: Literal,
    reset: Literal,
    timing: Literal,
}

struct AddedTime {
    reset: Literal,
    times: Literal,
    adds: Literal,
}
