//! Step 1 of a scan: status bits and words. Times of scans and the local time are those of the
//! first scan, unless they are inputs.

use super::encoder::Encoder;
use super::held::{EventLiteral, Next};
use super::number::Number;
use crate::aig::Literal;
use crate::events::ScanEvent;
use crate::gates::Held;
use rungd_engine::isa::status::{dst, st};
use rungd_engine::isa::{Bit, BitSpace, Word, WordSpace};
use rungd_engine::{BitCell, WordCell};

impl Encoder<'_> {
    /// The cell of status bit 0.
    pub(super) fn status(&self) -> u32 {
        self.code.layout.bit(Bit::Space(BitSpace::St, 0)).0
    }

    /// Whether it is the first scan.
    pub(super) fn first_scan(&mut self) -> Literal {
        let status = self.status() + st::FIRST_SCAN;
        self.scan_latch(self.start.image.bit(BitCell(status)), Held::FirstScan)
    }

    /// Whether an event of some kind happens.
    pub(super) fn any_event(&mut self, is: impl Fn(ScanEvent) -> bool) -> Literal {
        let mut any = Literal::FALSE;
        for at in 0..self.happens.len() {
            let EventLiteral { event, happens } = self.happens[at];
            if is(event) {
                any = self.graph.or(any, happens);
            }
        }
        any
    }

    /// Whether it is the first scan of a path: RUN may begin again in it.
    pub(super) fn beginning(&mut self) -> Literal {
        match self.happens.is_empty() {
            true => self.first_scan(),
            false => self.scan_latch(true, Held::Beginning),
        }
    }

    /// Whether it is the last scan.
    pub(super) fn last_scan(&mut self) -> Literal {
        let asked = self.any_event(ScanEvent::ends_run);
        if !self.written.stops {
            return asked;
        }
        let stopped = self.scan_latch(false, Held::LastScan);
        self.graph.or(asked, stopped)
    }

    /// The value of a status bit behind step 1.
    pub(super) fn status_bit(&mut self, bit: u32) -> Option<Literal> {
        let number = bit.checked_sub(self.status()).filter(|n| (*n as usize) < st::COUNT)?;
        Some(match number {
            st::FIRST_SCAN => self.first_scan(),
            st::ON => Literal::TRUE,
            st::ONE_MINUTE => self.clock(bit, 60_000),
            st::ONE_SECOND => self.clock(bit, 1_000),
            st::HUNDRED_MS => self.clock(bit, 100),
            st::FIFTY_MS => self.clock(bit, 50),
            st::SCAN_TOGGLE => {
                let initial = self.start.image.bit(BitCell(bit));
                let latch = self.fixed_latch(initial, Held::Bit(BitCell(bit)));
                self.set_next(latch, !latch);
                latch
            }
            st::LAST_SCAN => self.last_scan(),
            _ => Literal::constant(self.start.image.bit(BitCell(bit))),
        })
    }

    /// A clock bit: ON for the first half of its period.
    fn clock(&mut self, bit: u32, clock_ms: u32) -> Literal {
        let step = Number::constant(i128::from(self.model.period_ms() % clock_ms));
        let clock = Number::constant(clock_ms.into());
        let latches = self.latches.len();
        let initial = self.start.since_start_ms % u64::from(clock_ms);
        let mut time = Number::made(0, i128::from(clock_ms) - 1, |at| {
            self.fixed_latch(initial >> at & 1 == 1, Held::Clock(BitCell(bit), at as u8))
        });
        let next = match self.late {
            None => {
                let later = time.add(&mut self.graph, &step);
                self.modulo(&later, &clock, 1)
            }
            // The time of a scan is that of the scan before and what has passed since.
            Some(_) => {
                let passed = self.since().mul(&mut self.graph, &step);
                let now = time.add(&mut self.graph, &passed);
                time = self.modulo(&now, &clock, self.model.late_max);
                time.clone()
            }
        };
        for (at, latch) in (latches..self.latches.len()).enumerate() {
            self.latches[latch].next = Next::Fixed(next.bit(at));
        }
        time.less(&mut self.graph, &Number::constant(i128::from(clock_ms) / 2))
    }

    /// `number % divisor`, for a number below `(most + 1) * divisor`.
    pub(super) fn modulo(&mut self, number: &Number, divisor: &Number, most: u32) -> Number {
        let mut rest = number.clone();
        for shift in (0..=most.ilog2()).rev() {
            let times = divisor.mul(&mut self.graph, &Number::constant(1 << shift));
            let less = rest.sub(&mut self.graph, &times);
            let is_below = rest.less(&mut self.graph, &times);
            rest = Number::mux(&mut self.graph, is_below, &rest, &less);
        }
        rest.within(0, divisor.high - 1)
    }

    /// The value of a status word behind step 1; `None` for a word that step 1 does not write.
    pub(super) fn status_word(&mut self, word: u32) -> Option<Number> {
        let cell = |n| self.code.layout.word(Word::Space(WordSpace::Dst, n)).0;
        let number = (0..dst::COUNT as u32).find(|n| cell(*n) == word)?;
        match number {
            dst::SCAN_COUNTER => Some(self.scan_counter(word)),
            dst::DOWN_SECONDS => None,
            _ => Some(Number::constant(self.start.image.word(WordCell(word)).into())),
        }
    }

    fn scan_counter(&mut self, word: u32) -> Number {
        let latches = self.latches.len();
        let initial = self.start.image.word(WordCell(word));
        let count = Number::made(0, i32::MAX.into(), |at| {
            self.fixed_latch(initial >> at & 1 == 1, Held::WordBit(WordCell(word), at as u8))
        });
        let next = count.add(&mut self.graph, &Number::constant(1));
        for (at, latch) in (latches..self.latches.len()).enumerate() {
            self.latches[latch].next = Next::Fixed(next.bit(at));
        }
        count
    }
}
