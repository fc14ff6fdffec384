//! The counters of Sensaphone, as in the engine's `sensaphone`.

use super::encoder::Encoder;
use super::number::Number;
use crate::aig::Literal;
use rungd_engine::ops::{Ctd, Ctu, Res, Sensaphone};
use rungd_engine::record::SENSAPHONE_FLAGS;
use rungd_engine::record::sensaphone_flags::{CD, CU, DN, OV, UN};
use rungd_engine::record::sensaphone_state::{DOWN, UP};

/// A direction of counting: its places in the record.
struct CountDirection {
    history: u32,
    enabled: u32,
    /// The flag of a wrap in this direction, and in the other.
    own: u32,
    other: u32,
    by: i128,
}

const UPWARDS: CountDirection =
    CountDirection { history: UP as u32, enabled: CU, own: OV, other: UN, by: 1 };
const DOWNWARDS: CountDirection =
    CountDirection { history: DOWN as u32, enabled: CD, own: UN, other: OV, by: -1 };

impl Encoder<'_> {
    pub(super) fn ctu(&mut self, op: &Ctu) {
        let leg = self.leg(&op.leg);
        self.count(&op.counter, leg, &UPWARDS);
    }

    pub(super) fn ctd(&mut self, op: &Ctd) {
        let leg = self.leg(&op.leg);
        self.count(&op.counter, leg, &DOWNWARDS);
    }

    fn count(&mut self, counter: &Sensaphone, leg: Literal, direction: &CountDirection) {
        let before = self.record_bit(counter.at, direction.history);
        let counts = self.graph.and(leg, !before);
        self.put_record_bit(counter.at, direction.history, leg);
        self.put_record_bit(counter.at, direction.enabled, leg);
        if let Some(preset) = counter.preset {
            let preset = self.word(preset.0).clamp(&mut self.graph, i16::MIN, i16::MAX);
            self.put_word(counter.pre.0, preset);
        }
        self.under(counts, |scan| scan.step(counter, direction));
        let (acc, pre) = (self.word(counter.at), self.word(counter.pre.0));
        let done = !acc.less(&mut self.graph, &pre);
        self.put_record_bit(counter.at, DN, done);
    }

    /// Counts one step; ACC wraps at 16 bits.
    fn step(&mut self, counter: &Sensaphone, direction: &CountDirection) {
        let acc = Number::of_bits(self.word(counter.at).lowest(16));
        let counted = acc.add(&mut self.graph, &Number::constant(direction.by));
        let wraps = counted.is_outside(&mut self.graph, i16::MIN, i16::MAX);
        self.put_word(counter.at, Number::of_bits(counted.lowest(16)));
        let other = self.record_bit(counter.at, direction.other);
        let own = self.record_bit(counter.at, direction.own);
        // A wrap clears the flag of the other direction if that flag is ON, else it sets its own.
        let (other_after, sets) = (self.graph.and(other, !wraps), self.graph.and(wraps, !other));
        let own_after = self.graph.or(own, sets);
        self.put_record_bit(counter.at, direction.other, other_after);
        self.put_record_bit(counter.at, direction.own, own_after);
    }

    pub(super) fn res(&mut self, op: &Res) {
        let leg = self.leg(&op.leg);
        self.under(leg, |scan| {
            scan.put_word(op.counter.at, Number::constant(0));
            for flag in 0..SENSAPHONE_FLAGS {
                scan.put_record_bit(op.counter.at, flag, Literal::FALSE);
            }
        });
    }

    /// The termination pass over CTU.
    pub(super) fn terminate_up(&mut self, counter: &Sensaphone) {
        self.put_record_bit(counter.at, UPWARDS.history, Literal::FALSE);
        self.put_record_bit(counter.at, UPWARDS.enabled, Literal::FALSE);
    }

    /// The termination pass over CTD.
    pub(super) fn terminate_down(&mut self, counter: &Sensaphone) {
        self.put_record_bit(counter.at, DOWNWARDS.history, Literal::FALSE);
        self.put_record_bit(counter.at, DOWNWARDS.enabled, Literal::FALSE);
    }
}
