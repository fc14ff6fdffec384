//! What an operation reads, and which cells it overwrites whenever it executes.
//!
//! For `live`. The engine's list of touched cells says what is read and what is written, always or
//! sometimes. Here stands which of the written cells are surely overwritten, and which are also
//! read: without this knowledge a cell counts as read and not as overwritten, which is never wrong.

use rungd_engine::isa::status::st;
use rungd_engine::isa::{Bit, BitSpace};
use rungd_engine::ops::{
    AndedPowers, BitOwn, Control, CounterRule, FormulaReads, Formulas, LegPowers, Math, MathTarget,
    Op, Power, Sensaphone, Timer, TouchedCells, WordRead, WordTarget,
};
use rungd_engine::record::sensaphone_flags::{CD, CU, DN, OV, UN};
use rungd_engine::record::{FLAGS, RECORD, sensaphone_state};
use rungd_engine::{Cell, EngineProgram, PassStep};

/// The numbers of cells: bits first, then words.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EffectCells {
    /// The number of bits.
    pub bits: u32,
}

impl EffectCells {
    pub fn word(self, word: u32) -> u32 {
        self.bits + word
    }

    /// The number of a cell; of a bit of a word, that of its word.
    pub fn number(self, cell: Cell) -> u32 {
        match cell.whole() {
            Cell::Bit(bit) => bit.0,
            Cell::Word(word) => self.word(word.0),
            Cell::WordBit(_) => unreachable!("no whole cell"),
        }
    }
}

/// The bits of a Sensaphone counter that CTU or CTD has for itself, by their places in its record.
#[derive(Clone, Copy)]
struct OwnBits {
    enable: u32,
    history: usize,
}

const OF_CTU: OwnBits = OwnBits { enable: CU, history: sensaphone_state::UP };
const OF_CTD: OwnBits = OwnBits { enable: CD, history: sensaphone_state::DOWN };

/// The cells of an operation.
#[derive(Clone, Debug, Default)]
pub(crate) struct Effect {
    /// The powers of its legs, or those that it ANDs.
    pub legs: Vec<AndedPowers>,
    /// The other cells whose content before the operation can matter.
    pub reads: Vec<u32>,
    /// The cells that it can write.
    pub writes: Vec<u32>,
    /// The cells whose content after the operation does not depend on theirs before, unless they
    /// are among `reads`.
    pub overwrites: Vec<u32>,
    /// The structure that it owns.
    pub owns: Option<Owned>,
    /// It has one leg, and does nothing while the leg is OFF.
    pub rests_while_off: bool,
}

/// A structure of an operation that is its owner.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Owned {
    /// A timer that times up, to its preset and beyond.
    UpTimer(Timer),
    /// A timer that times down, to 0.
    DownTimer(Timer),
    /// CNT: its `.Acc`, and its preset.
    UpCounter(u32, WordRead),
    /// CNTDN: its `.Acc`.
    DownCounter(u32),
    /// UDC, UDCG: its `.Acc`.
    UpDownCounter(u32),
}

impl Effect {
    /// All cells whose content before the operation can matter.
    pub fn all_reads(&self) -> impl Iterator<Item = u32> {
        let powers = self.legs.iter().flat_map(|leg| leg.each());
        powers.map(|power| power.cell()).chain(self.reads.iter().copied())
    }

    fn overwrite(&mut self, cell: u32) -> &mut Effect {
        self.overwrites.push(cell);
        self
    }

    fn rest_while_off(&mut self) -> &mut Effect {
        self.rests_while_off = true;
        self
    }

    /// A cell is read and overwritten.
    fn keep(&mut self, BitOwn(cell): BitOwn) -> &mut Effect {
        self.reads.push(cell);
        self.overwrite(cell)
    }
}

impl Owned {
    /// The number of the structure's record, and of the word of its `.Acc`.
    fn at(self) -> u32 {
        match self {
            Owned::UpTimer(timer) | Owned::DownTimer(timer) => timer.at,
            Owned::UpCounter(at, _) | Owned::DownCounter(at) | Owned::UpDownCounter(at) => at,
        }
    }

    /// The structure, if it is a timer.
    pub fn timer(self) -> Option<Timer> {
        match self {
            Owned::UpTimer(timer) | Owned::DownTimer(timer) => Some(timer),
            Owned::UpCounter(..) | Owned::DownCounter(_) | Owned::UpDownCounter(_) => None,
        }
    }
}

/// Makes the effects of the operations of a program.
pub(crate) struct Effects<'p> {
    pub program: &'p EngineProgram,
    formulas: Vec<FormulaReads>,
    /// ST0.
    status: u32,
    /// `$On`.
    on: u32,
}

impl<'p> Effects<'p> {
    /// The effects of a cone's program.
    pub fn new(program: &'p EngineProgram) -> Effects<'p> {
        let status = |n| program.layout.bit(Bit::Space(BitSpace::St, n)).0;
        Effects { program, formulas: program.formulas(), status: status(0), on: status(st::ON) }
    }

    fn numbers(&self) -> EffectCells {
        EffectCells { bits: self.program.bit_count }
    }

    /// The cells of an operation as the engine lists them.
    pub fn touched(&self, op: &Op) -> TouchedCells<'_> {
        let formulas = Formulas { reads: &self.formulas, status: self.status };
        let mut touches = TouchedCells { formulas, ..TouchedCells::default() };
        op.touches(&mut touches);
        touches
    }

    /// The effect of an operation.
    pub fn effect(&self, op: &Op) -> Effect {
        let touches = self.touched(op);
        let mut effect = Effect {
            legs: touches.anded.clone(),
            reads: self.read(&touches),
            writes: self.written(&touches),
            ..Effect::default()
        };
        self.add_own(op, &mut effect);
        effect.writes.extend(&effect.overwrites);
        effect
    }

    /// Adds what the engine's lists do not say.
    fn add_own(&self, op: &Op, effect: &mut Effect) {
        let numbers = self.numbers();
        match op {
            Op::And2(and) => effect.overwrite(and.cell.0),
            Op::And3(and) => effect.overwrite(and.cell.0),
            Op::And4(and) => effect.overwrite(and.cell.0),
            Op::PickBit(pick) => effect.overwrite(pick.cell.0),
            Op::PickWord(pick) => effect.overwrite(numbers.word(pick.cell.0)),
            Op::LoadWordBit(load) => effect.overwrite(load.cell.0),
            Op::Equal(compare) => effect.overwrite(compare.cell.0),
            Op::Less(compare) => effect.overwrite(compare.cell.0),
            Op::EqualMixed(compare) => effect.overwrite(compare.cell.0),
            Op::LessMixed(compare) => effect.overwrite(compare.cell.0),
            Op::Out(out) => effect.overwrite(out.bit.0),
            Op::OutOne(out) => effect.overwrite(out.bit.0),
            Op::Rise(edge) => effect.overwrite(edge.cell.0).keep(edge.history),
            Op::Fall(edge) => effect.overwrite(edge.cell.0).keep(edge.history),
            Op::Pd(coil) => effect.overwrite(coil.bit.0).keep(coil.history),
            Op::Nd(coil) => effect.overwrite(coil.bit.0).keep(coil.history),
            Op::Ponoff(coil) => effect.keep(BitOwn(coil.bit.0)).keep(coil.history),
            Op::Sr(shift) => {
                let bits = shift.bits.0;
                effect.reads.extend(bits.first..bits.first + bits.count);
                effect.keep(shift.shift.history)
            }
            Op::Cnt(owner) => self.own(effect, Owned::UpCounter(owner.counter.at, owner.preset)),
            Op::Cntdn(owner) => self.own(effect, Owned::DownCounter(owner.counter.at)),
            Op::Udc(owner) => self.own(effect, Owned::UpDownCounter(owner.counter.at)),
            Op::Ondtmr(owner) => {
                self.own(effect, Owned::UpTimer(owner.timer)).overwrite(owner.output.0)
            }
            Op::Offdtmr(owner) => {
                self.own(effect, Owned::DownTimer(owner.timer)).overwrite(owner.output.0)
            }
            Op::Tmr(owner) => self.own(effect, Owned::UpTimer(owner.timer)),
            Op::Tmra(owner) => self.own(effect, Owned::UpTimer(owner.timer)),
            Op::Tmrdown(owner) => self.own(effect, Owned::DownTimer(owner.timer)),
            Op::Tmradown(owner) => self.own(effect, Owned::DownTimer(owner.timer)),
            Op::Ctu(owner) => self.count(effect, owner.counter, OF_CTU),
            Op::Ctd(owner) => self.count(effect, owner.counter, OF_CTD),
            Op::Move(copy) => self.overwrite_word(effect, &copy.leg, copy.to),
            Op::Add(sum) => self.overwrite_word(effect, &sum.leg, sum.to),
            Op::Sub(sum) => self.overwrite_word(effect, &sum.leg, sum.to),
            Op::Math(math) => self.compute(effect, math),
            Op::Control(control) => self.control(effect, control),
            Op::OutWordBit(_) => effect,
            // These write only while their leg is ON.
            Op::Set(_)
            | Op::Rst(_)
            | Op::SetWordBit(_)
            | Op::RstWordBit(_)
            | Op::Rstct(_)
            | Op::Rstt(_)
            | Op::Res(_)
            | Op::AddMixed(_)
            | Op::SubMixed(_)
            | Op::CopyBits(_)
            | Op::CopyWords(_)
            | Op::FillBits(_)
            | Op::FillWords(_)
            | Op::PackBits(_)
            | Op::UnpackBits(_) => effect.rest_while_off(),
        };
    }

    /// The cells that are written, by the lists of touched cells; of a structure, its whole record.
    fn written(&self, touches: &TouchedCells) -> Vec<u32> {
        let (numbers, record) = (self.numbers(), RECORD as u32);
        let structures = self.program.layout.structure_count() * RECORD as u32;
        let bits = touches.bits_written.iter().flat_map(|bit| match *bit < structures {
            true => bit / record * record..bit / record * record + record,
            false => *bit..bit + 1,
        });
        let arrays = touches.bit_arrays_written.iter().map(|array| (array, 0));
        let words = touches.word_arrays_written.iter().map(|array| (array, numbers.word(0)));
        let elements = arrays.chain(words).flat_map(|(array, from)| {
            (array.first..array.first + array.count).map(move |at| from + at)
        });
        let words = touches.words_written.iter().map(|word| numbers.word(*word));
        bits.chain(words).chain(elements).collect()
    }

    /// The cells that are read besides powers, by the lists of touched cells.
    fn read(&self, touches: &TouchedCells) -> Vec<u32> {
        let numbers = self.numbers();
        let arrays = touches.bit_arrays_read.iter().map(|array| (array, 0));
        let words = touches.word_arrays_read.iter().map(|array| (array, numbers.word(0)));
        let elements = arrays.chain(words);
        let elements = elements.flat_map(|(array, from)| {
            (array.first..array.first + array.count).map(move |at| from + at)
        });
        let mut bits = touches.bits_read.clone();
        for power in touches.anded.iter().flat_map(|leg| leg.each()) {
            let at = bits.iter().position(|bit| *bit == power.cell());
            at.map(|at| bits.swap_remove(at));
        }
        let words = touches.words_read.iter().map(|word| numbers.word(*word));
        bits.into_iter().chain(words).chain(elements).collect()
    }

    /// An owner of a counter or timer reads `.Acc` and its private state, and writes both and all
    /// flags.
    fn own<'e>(&self, effect: &'e mut Effect, owned: Owned) -> &'e mut Effect {
        let (first, acc) = (owned.at() * RECORD as u32, self.numbers().word(owned.at()));
        effect.reads.extend(first + FLAGS as u32..first + RECORD as u32);
        effect.reads.push(acc);
        effect.overwrites.extend(first..first + RECORD as u32);
        effect.owns = Some(owned);
        effect.overwrite(acc)
    }

    /// CTU and CTD: each has its own enable bit and history. A wrap reads both flags of wraps.
    fn count<'e>(
        &self,
        effect: &'e mut Effect,
        counter: Sensaphone,
        own: OwnBits,
    ) -> &'e mut Effect {
        let (first, numbers) = (counter.at * RECORD as u32, self.numbers());
        effect.reads.extend([first + OV, first + UN, numbers.word(counter.at)]);
        effect.overwrites.extend([first + own.enable, first + DN]);
        match counter.preset {
            Some(_) => effect.overwrites.push(numbers.word(counter.pre.0)),
            None => effect.reads.push(numbers.word(counter.pre.0)),
        }
        effect.keep(BitOwn(first + own.history as u32))
    }

    /// An instruction that writes a word while its leg is ON.
    fn overwrite_word<'e>(
        &self,
        effect: &'e mut Effect,
        leg: &LegPowers,
        to: WordTarget,
    ) -> &'e mut Effect {
        let word = self.numbers().word(to.word.0);
        if self.is_on(leg) { effect.overwrite(word) } else { effect.rest_while_off() }
    }

    /// A MATH writes while its leg is ON; that of a contact that computes always is.
    fn compute<'e>(&self, effect: &'e mut Effect, math: &Math) -> &'e mut Effect {
        let numbers = self.numbers();
        match math.put {
            _ if !self.is_on(&math.leg) => effect.rest_while_off(),
            MathTarget::Word { to, .. } | MathTarget::Real(to) => {
                effect.overwrite(numbers.word(to.word.0))
            }
            MathTarget::Bit(bit) => effect.overwrite(bit.0),
            MathTarget::Index(word) => effect.overwrite(numbers.word(word.0)),
            MathTarget::At(_) => effect,
        }
    }

    /// Control instructions: the bits of blocks and Stages are always live. What else they write,
    /// histories and withheld times, they also read.
    fn control<'e>(&self, effect: &'e mut Effect, control: &Control) -> &'e mut Effect {
        let formulas = Formulas { reads: &self.formulas, status: self.status };
        let mut touches = TouchedCells { formulas, ..TouchedCells::default() };
        self.program.touched_by_control(control, &mut touches);
        effect.legs.extend(&touches.anded);
        effect.reads.extend(self.read(&touches));
        effect.writes.extend(self.written(&touches));
        effect.reads.extend(&effect.writes);
        effect
    }

    /// What a step of a pass reads.
    pub fn read_by_pass(&self, step: &PassStep) -> Vec<u32> {
        match step {
            PassStep::Counter(_, rule) => {
                let presets = match rule {
                    CounterRule::Up(preset) | CounterRule::Down(preset) => [Some(*preset), None],
                    CounterRule::UpDown(presets) => [presets.up, presets.dn],
                };
                presets.into_iter().flatten().map(|word| self.numbers().word(word.0)).collect()
            }
            PassStep::Timer(timer, _) => vec![self.numbers().word(timer.preset.0)],
            PassStep::Pick(pick) => self.pick(*pick),
            PassStep::BitOff(_)
            | PassStep::WordBitOff(_)
            | PassStep::HistoryOff(_)
            | PassStep::HoldTimer(_)
            | PassStep::CountUp(_)
            | PassStep::CountDown(_)
            | PassStep::DisableTask(_) => Vec::new(),
        }
    }

    fn pick(&self, pick: u32) -> Vec<u32> {
        let pick = Op::Math(self.program.tables.picks[pick as usize]);
        self.effect(&pick).all_reads().collect()
    }

    /// Whether a leg is always ON.
    fn is_on(&self, leg: &LegPowers) -> bool {
        leg.each() == [Power::of(self.on); 2]
    }
}
