//! The counters of Do-more, as in the engine's `counters`.

use super::encoder::Encoder;
use super::number::Number;
use super::written::WordRange;
use crate::aig::Literal;
use rungd_engine::ops::{Cnt, Cntdn, Counter, CounterRule, Rstct, Udc};
use rungd_engine::record::FLAGS;
use rungd_engine::record::counter_state::{DN, LOADED, PENDING, UP};

/// A rule with the values of its presets.
enum PresetNumbers {
    Up(Number),
    Down(Number),
    UpDown(Option<Number>, Option<Number>),
}

impl Encoder<'_> {
    fn read_rule(&mut self, rule: &CounterRule) -> PresetNumbers {
        match rule {
            CounterRule::Up(preset) => PresetNumbers::Up(self.word(preset.0)),
            CounterRule::Down(preset) => PresetNumbers::Down(self.word(preset.0)),
            CounterRule::UpDown(presets) => {
                let up = presets.up.map(|preset| self.word(preset.0));
                PresetNumbers::UpDown(up, presets.dn.map(|preset| self.word(preset.0)))
            }
        }
    }

    /// A bit of the private state in the record of a counter or timer.
    pub(super) fn state(&mut self, at: u32, place: u32) -> Literal {
        self.record_bit(at, FLAGS as u32 + place)
    }

    /// Writes the private state: these bits, all others OFF.
    pub(super) fn put_state(&mut self, at: u32, bits: &[(u32, Literal)]) {
        for place in 0..FLAGS as u32 {
            let value = bits.iter().find(|(named, _)| *named == place);
            let value = value.map_or(Literal::FALSE, |(_, value)| *value);
            self.put_record_bit(at, FLAGS as u32 + place, value);
        }
    }

    /// Writes the four flags, in the order of the layout.
    pub(super) fn put_flags(&mut self, at: u32, flags: [Literal; FLAGS]) {
        for (place, flag) in (0..).zip(flags) {
            self.put_record_bit(at, place, flag);
        }
    }

    /// Writes `.Acc` and the flags that follow from it.
    fn put_counter(&mut self, counter: Counter, rule: &PresetNumbers, acc: Number, reset: Literal) {
        let graph = &mut self.graph;
        let (done, dn_done) = match rule {
            PresetNumbers::Up(preset) => (!acc.less(graph, preset), Literal::FALSE),
            PresetNumbers::Down(_) => (!Number::constant(0).less(graph, &acc), Literal::FALSE),
            PresetNumbers::UpDown(up, dn) => {
                let up = up.as_ref().map(|preset| !acc.less(graph, preset));
                let dn = dn.as_ref().map(|preset| !preset.less(graph, &acc));
                (up.unwrap_or(Literal::FALSE), dn.unwrap_or(Literal::FALSE))
            }
        };
        let zero = acc.is_zero(graph);
        self.put_word(counter.at, acc);
        self.put_flags(counter.at, [done, reset, zero, dn_done]);
    }

    /// Resets the counter: `.Acc` becomes the reset value, `.Reset` goes ON.
    fn reset_counter(&mut self, counter: Counter, rule: &CounterRule) {
        let rule = self.read_rule(rule);
        let value = match &rule {
            PresetNumbers::Down(preset) => preset.clone(),
            PresetNumbers::Up(_) | PresetNumbers::UpDown(..) => Number::constant(0),
        };
        self.put_counter(counter, &rule, value, Literal::TRUE);
    }

    /// The termination pass over a counter.
    pub(super) fn terminate_counter(&mut self, counter: Counter, rule: &CounterRule) {
        self.put_state(counter.at, &[(LOADED, Literal::TRUE)]);
        self.reset_counter(counter, rule);
    }

    /// Whether a leg comes ON, by its history in the state.
    fn comes_on(&mut self, at: u32, place: u32, leg: Literal) -> Literal {
        let before = self.state(at, place);
        self.graph.and(leg, !before)
    }

    /// A count, limited to what matters of it.
    fn limited_acc(&mut self, at: u32, acc: &Number) -> Number {
        let range = self.acc_forms.get(&at).map_or(WordRange::ALL, |form| form.range());
        acc.clamp(&mut self.graph, range.low, range.high)
    }

    pub(super) fn cnt(&mut self, op: &Cnt) {
        let (leg, rst) = (self.leg(&op.up), self.leg(&op.rst));
        let at = op.counter.at;
        let rule = PresetNumbers::Up(self.word(op.preset.0));
        let pending = self.state(at, PENDING);
        let reset = self.graph.or(rst, pending);
        let counts = self.comes_on(at, UP, leg);
        self.put_state(at, &[(UP, leg)]);
        let acc = self.word(at);
        let counted = acc.add(&mut self.graph, &Number::of_bit(counts));
        let counted = self.limited_acc(at, &counted);
        let acc = self.choose(reset, &Number::constant(0), &counted);
        self.put_counter(op.counter, &rule, acc, reset);
    }

    pub(super) fn cntdn(&mut self, op: &Cntdn) {
        let (leg, rst) = (self.leg(&op.dn), self.leg(&op.rst));
        let at = op.counter.at;
        let preset = self.word(op.preset.0);
        let (pending, loaded) = (self.state(at, PENDING), self.state(at, LOADED));
        let reset = self.graph.or(rst, pending);
        let counts = self.comes_on(at, DN, leg);
        let loads = self.graph.or(reset, !loaded);
        self.put_state(at, &[(DN, leg), (LOADED, Literal::TRUE)]);
        let acc = self.word(at);
        let from = self.choose(loads, &preset, &acc);
        let takes = self.graph.and(counts, !reset);
        let acc = from.sub(&mut self.graph, &Number::of_bit(takes));
        let acc = self.limited_acc(at, &acc);
        self.put_counter(op.counter, &PresetNumbers::Down(preset), acc, reset);
    }

    pub(super) fn udc(&mut self, op: &Udc) {
        let (up, dn, rst) = (self.leg(&op.up), self.leg(&op.dn), self.leg(&op.rst));
        let at = op.counter.at;
        let rule = self.read_rule(&CounterRule::UpDown(op.presets));
        let pending = self.state(at, PENDING);
        let reset = self.graph.or(rst, pending);
        let (adds, takes) = (self.comes_on(at, UP, up), self.comes_on(at, DN, dn));
        self.put_state(at, &[(UP, up), (DN, dn)]);
        let step = Number::of_bit(adds).sub(&mut self.graph, &Number::of_bit(takes));
        let acc = self.word(at).add(&mut self.graph, &step);
        let acc = self.limited_acc(at, &acc);
        let acc = self.choose(reset, &Number::constant(0), &acc);
        self.put_counter(op.counter, &rule, acc, reset);
    }

    pub(super) fn rstct(&mut self, op: &Rstct) {
        let leg = self.leg(&op.leg);
        self.under(leg, |scan| {
            scan.put_record_bit(op.counter.at, FLAGS as u32 + PENDING, Literal::TRUE);
            scan.reset_counter(op.counter, &op.rule);
        });
    }
}
