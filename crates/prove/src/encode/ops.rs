//! The operations, by kind.

use super::encoder::Encoder;
use rungd_engine::Batch;
use rungd_engine::ops::Op;

impl Encoder<'_> {
    /// An operation other than MATH and control.
    pub(super) fn op(&mut self, op: &Op) {
        match op {
            Op::And2(op) => self.and(op.cell, &op.of),
            Op::And3(op) => self.and(op.cell, &op.of),
            Op::And4(op) => self.and(op.cell, &op.of),
            Op::PickBit(op) => self.pick_bit(op),
            Op::PickWord(op) => self.pick_word(op),
            Op::LoadWordBit(op) => self.load_word_bit(op),
            Op::Rise(op) => self.rise(op),
            Op::Fall(op) => self.fall(op),
            Op::Equal(op) => self.equal(op),
            Op::Less(op) => self.less(op),
            Op::EqualMixed(op) => self.equal_mixed(op),
            Op::LessMixed(op) => self.less_mixed(op),
            Op::Out(op) => self.out(&op.leg, op.bit),
            Op::OutOne(op) => self.out(&op.leg, op.bit),
            Op::Set(op) => self.set(op),
            Op::Rst(op) => self.rst(op),
            Op::OutWordBit(op) => self.out_word_bit(op),
            Op::SetWordBit(op) => self.set_word_bit(op),
            Op::RstWordBit(op) => self.rst_word_bit(op),
            Op::Pd(op) => self.pd(op),
            Op::Nd(op) => self.nd(op),
            Op::Ponoff(op) => self.ponoff(op),
            Op::Cnt(op) => self.cnt(op),
            Op::Cntdn(op) => self.cntdn(op),
            Op::Udc(op) => self.udc(op),
            Op::Rstct(op) => self.rstct(op),
            Op::Ondtmr(op) => self.ondtmr(op),
            Op::Offdtmr(op) => self.offdtmr(op),
            Op::Tmr(op) => self.tmr(op),
            Op::Tmrdown(op) => self.tmrdown(op),
            Op::Tmra(op) => self.tmra(op),
            Op::Tmradown(op) => self.tmradown(op),
            Op::Rstt(op) => self.rstt(op),
            Op::Ctu(op) => self.ctu(op),
            Op::Ctd(op) => self.ctd(op),
            Op::Res(op) => self.res(op),
            Op::Move(op) => self.mov(op),
            Op::Add(op) => self.add(op),
            Op::Sub(op) => self.sub(op),
            Op::AddMixed(op) => self.add_mixed(op),
            Op::SubMixed(op) => self.sub_mixed(op),
            Op::CopyBits(op) => self.copy_bits(op),
            Op::CopyWords(op) => self.copy_words(op),
            Op::FillBits(op) => self.fill_bits(op),
            Op::FillWords(op) => self.fill_words(op),
            Op::PackBits(op) => self.pack_bits(op),
            Op::UnpackBits(op) => self.unpack_bits(op),
            Op::Sr(op) => self.sr(op),
            Op::Math(_) | Op::Control(_) => unreachable!("`blocks` encodes MATH and control"),
        }
    }

    /// A batch of MATHs, in rows or in columns.
    pub(super) fn maths(&mut self, batch: Batch) {
        for (nth, op) in (0..).zip(self.code.tables.ops_of(batch)) {
            let Op::Math(math) = op else { unreachable!("a batch of MATHs") };
            let steps = self.code.tables.formula(batch, nth);
            self.math(&math, &steps);
        }
    }
}
