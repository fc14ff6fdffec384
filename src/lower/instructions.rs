//! Turns instructions into operations and the steps of termination passes.
//!
//! Called by `lower_rung`. Every [`Action`] is matched: a new instruction does not compile until it
//! is lowered here. The instruction table, not this file, determines the effect of a pass;
//! `terminate` picks the matching step.

use super::assembler::Assembler;
use super::identity::Interval;
use super::legs::Legs;
use super::sites::Sites;
use crate::engine::ops::{
    Add, AddMixed, AnyTarget, BitOwn, BitWritten, Cnt, Cntdn, Control, ControlKind, Counter,
    CounterRule, Ctd, Ctu, LegPowers, Move, Nd, Offdtmr, Ondtmr, Op, Out, OutOne, Pd, Ponoff,
    Power, Powers, Res, RestartState, Rst, Rstct, Rstt, Sensaphone, Set, StageList, Sub, SubMixed,
    Target, Timer, TimerRule, Tmr, Tmra, Tmradown, Tmrdown, Udc, UdcPresets, WordRead, WordWritten,
};
use crate::engine::{PassStep, WordCell};
use crate::isa::instruction::Termination;
use crate::isa::status::st;
use crate::isa::{Bit, BitSpace, BlockId, LegName, StageId, Structure, Word};
use crate::resolve::instruction::{Coil, CountDirection, Delay, Source, TimerKind, WordPlace};
use crate::resolve::program::{Action, Instruction, Value, Written};
use crate::source::span::Located;

/// An instruction as an operation, and the parts of it that a termination pass may act on.
struct Lowered {
    op: Op,
    /// The bit that it drives, or writes as an output.
    bit: Option<BitWritten>,
    /// The reset of its structure.
    reset: Option<PassStep>,
    /// The step of its pass, if its termination is `Held`, `EnableOff` or `RungOff`.
    rung_off: Option<PassStep>,
}

impl From<Op> for Lowered {
    fn from(op: Op) -> Lowered {
        Lowered { op, bit: None, reset: None, rung_off: None }
    }
}

impl Assembler<'_> {
    /// Lowers one instruction.
    pub fn instruction(&mut self, instruction: &Instruction, legs: Legs) {
        self.note(Sites::begin_instruction);
        self.identity.instruction(instruction, self.site.element);
        // An operation that reads an element may turn `$IndexError` ON, and a leg may read this
        // bit.
        let kept: Vec<(LegName, LegPowers)>;
        let legs = if instruction.action.has_elements() {
            kept = legs.0.iter().map(|(name, leg)| (*name, self.keep(*leg))).collect();
            Legs(&kept)
        } else {
            legs
        };
        if let Some(lowered) = self.lowered(instruction, legs) {
            self.terminate(instruction.mnemonic.spec().termination, &lowered);
            self.op(lowered.op);
        }
        self.note(Sites::end_instruction);
    }

    /// Adds the steps of the termination pass that the instruction table names.
    fn terminate(&mut self, pass: Termination, lowered: &Lowered) {
        let bit = lowered.bit.map(|BitWritten(cell)| PassStep::BitOff(cell));
        let parts = match pass {
            Termination::Off => [bit, None],
            Termination::Reset => [lowered.reset.clone(), bit],
            Termination::Held | Termination::EnableOff | Termination::RungOff => {
                [lowered.rung_off.clone(), None]
            }
            Termination::Kept | Termination::Untouched => [None, None],
        };
        parts.into_iter().flatten().for_each(|part| self.terminates(part));
    }

    /// `None` for a reset of a structure without an owner; `check` refuses that.
    fn lowered(&mut self, instruction: &Instruction, legs: Legs) -> Option<Lowered> {
        let history = |assembler: &mut Self| assembler.edge_history(instruction);
        let kind = match &instruction.action {
            Action::Coil { coil, bit } => {
                let bit = BitWritten(self.layout.bit(bit.value).0);
                let op = self.coil(*coil, (legs.when(), bit), instruction);
                return Some(Lowered { bit: Some(bit), ..op.into() });
            }
            Action::Counter { counts, ct, preset } => {
                let rule = counter_rule(*counts, *preset, |preset| self.owner_preset(preset, true));
                return Some(self.counter(ct.value, rule, legs, legs.leg(LegName::Rst)));
            }
            Action::UpDownCounter { has_reset_leg, ct, up_preset, dn_preset } => {
                let presets = (*up_preset, *dn_preset);
                let rule =
                    up_down_rule(presets, |preset| self.owner_preset(preset, *has_reset_leg));
                let rst = if *has_reset_leg { legs.leg(LegName::Rst) } else { self.off() };
                return Some(self.counter(ct.value, rule, legs, rst));
            }
            Action::DelayTimer { delay, t, preset, output } => {
                let timer = self.timer_of(t.value, *preset, TimerRule::Zero);
                let output = BitWritten(self.layout.bit(output.value).0);
                return Some(delay_timer(*delay, legs.when(), timer, output));
            }
            Action::Timer { timer, t, preset } => {
                let at = self.timer_of(t.value, *preset, timer_rule(*timer));
                return Some(self.timer(*timer, at, legs));
            }
            Action::Sensaphone { counts, n, preset } => {
                let counter = self.sensaphone(n.value, *preset);
                return Some(sensaphone(*counts, counter, legs.when()));
            }
            Action::Reset { structure } => {
                return self.reset(structure.value, legs.when()).map(Lowered::from);
            }
            Action::Store { source, to } => {
                return Some(self.store(*source, to.value, legs.when()).into());
            }
            Action::Math { target, index, formula } => {
                let math = self.math(target.value, index.as_deref(), formula, legs.when());
                return Some(math.into());
            }
            Action::SetElement { .. }
            | Action::Copy { .. }
            | Action::Fill { .. }
            | Action::Shift { .. } => return Some(self.array_action(instruction, legs).into()),
            Action::Run { block } => ControlKind::Run(block.value),
            Action::Restart { block } => {
                let history = history(self);
                ControlKind::Restart(RestartState { program: block.value, history: history.0 })
            }
            Action::Halt { block } => ControlKind::Halt(block.value),
            Action::Exit => ControlKind::Exit,
            Action::Entask { block, every: None } => {
                ControlKind::EnableOnce { task: block.value, history: history(self).0 }
            }
            Action::Entask { block, every: Some(every) } => {
                return Some(self.enable_every(block.value, every.value, legs.when()));
            }
            Action::Jump { stages } => ControlKind::Jump(self.stages(stages)),
            Action::StageOn { stage } => ControlKind::StageOn(stage.value),
            Action::StageOff { stage } => ControlKind::StageOff(stage.value),
            Action::Converge { stages, to } => {
                ControlKind::Converge { from: self.stages(stages), to: to.value }
            }
            Action::Stop => ControlKind::Stop,
        };
        Some(self.control(kind, legs.when()).into())
    }

    /// The edge history of an instruction.
    fn edge_history(&mut self, instruction: &Instruction) -> BitOwn {
        let text = self.identity.edge_instruction(instruction);
        self.history(text)
    }

    fn coil(
        &mut self,
        coil: Coil,
        (leg, bit): (LegPowers, BitWritten),
        instruction: &Instruction,
    ) -> Op {
        match coil {
            Coil::Out => match leg.each() {
                [a, b] if a == b => Op::OutOne(OutOne { leg: Powers::new([a]), bit }),
                _ => Op::Out(Out { leg, bit }),
            },
            Coil::Set => Op::Set(Set { leg, bit }),
            Coil::Rst => Op::Rst(Rst { leg, bit }),
            Coil::Pd => Op::Pd(Pd { leg, bit, history: self.edge_history(instruction) }),
            Coil::Nd => Op::Nd(Nd { leg, bit, history: self.edge_history(instruction) }),
            Coil::Ponoff => {
                Op::Ponoff(Ponoff { leg, bit, history: self.edge_history(instruction) })
            }
        }
    }

    fn counter(&self, ct: Structure, rule: CounterRule, legs: Legs, rst: LegPowers) -> Lowered {
        let counter = Counter { at: self.layout.record(ct) };
        let op = match rule {
            CounterRule::Up(preset) => {
                Op::Cnt(Cnt { up: legs.leg(LegName::Up), rst, counter, preset })
            }
            CounterRule::Down(preset) => {
                Op::Cntdn(Cntdn { dn: legs.leg(LegName::Dn), rst, counter, preset })
            }
            CounterRule::UpDown(presets) => {
                let (up, dn) = (legs.leg(LegName::Up), legs.leg(LegName::Dn));
                Op::Udc(Udc { up, dn, rst, counter, presets })
            }
        };
        Lowered { reset: Some(PassStep::Counter(counter, rule)), ..op.into() }
    }

    /// The leg that is `$Off`.
    fn off(&self) -> LegPowers {
        LegPowers::of(Power::of(self.layout.bit(Bit::Space(BitSpace::St, st::OFF)).0))
    }

    fn timer_of(&mut self, t: Structure, preset: Located<Value>, rule: TimerRule) -> Timer {
        let preset = self.owner_preset(preset.value, rule == TimerRule::Preset);
        Timer { at: self.layout.record(t), preset }
    }

    fn timer(&self, kind: TimerKind, timer: Timer, legs: Legs) -> Lowered {
        let (when, en, rst) = (|| legs.when(), || legs.leg(LegName::En), || legs.leg(LegName::Rst));
        let op = match kind {
            TimerKind::Up => Op::Tmr(Tmr { leg: when(), timer }),
            TimerKind::Down => Op::Tmrdown(Tmrdown { leg: when(), timer }),
            TimerKind::AccumulatingUp => Op::Tmra(Tmra { en: en(), rst: rst(), timer }),
            TimerKind::AccumulatingDown => Op::Tmradown(Tmradown { en: en(), rst: rst(), timer }),
            TimerKind::Global => Op::Tmra(Tmra { en: when(), rst: self.off(), timer }),
        };
        let reset = Some(PassStep::Timer(timer, timer_rule(kind)));
        Lowered { reset, rung_off: Some(PassStep::HoldTimer(timer)), ..op.into() }
    }

    /// A Sensaphone counter, with the preset of one of its instructions.
    fn sensaphone(&mut self, n: Structure, preset: Option<Located<Value>>) -> Sensaphone {
        let preset = match preset.map(|preset| preset.value) {
            Some(preset @ (Value::Word(_) | Value::Element(_))) => {
                Some(self.owner_preset(preset, false))
            }
            Some(Value::Const(..) | Value::Real(_)) | None => None,
        };
        let pre = WordWritten(self.layout.word(Word::Pre(n.number())).0);
        Sensaphone { at: self.layout.record(n), pre, preset }
    }

    /// RSTCT and RSTT, by the rule of the structure's owner.
    fn reset(&mut self, structure: Structure, leg: LegPowers) -> Option<Op> {
        if let Structure::Sensaphone(_) = structure {
            return Some(Op::Res(Res { leg, counter: self.sensaphone(structure, None) }));
        }
        let at = self.layout.record(structure);
        let rstct = |rule| Op::Rstct(Rstct { leg, counter: Counter { at }, rule });
        let rstt = |preset, rule| Op::Rstt(Rstt { leg, timer: Timer { at, preset }, rule });
        Some(match self.owners.get(&structure).copied()? {
            Action::Counter { counts, preset, ct: _ } => {
                rstct(counter_rule(*counts, *preset, |preset| self.value_while(preset, leg)))
            }
            Action::UpDownCounter { up_preset, dn_preset, .. } => {
                let presets = (*up_preset, *dn_preset);
                rstct(up_down_rule(presets, |preset| self.value_while(preset, leg)))
            }
            Action::DelayTimer { .. } => rstt(WordRead(self.constant(0)), TimerRule::Zero),
            Action::Timer { timer, preset, t: _ } => match timer_rule(*timer) {
                TimerRule::Zero => rstt(WordRead(self.constant(0)), TimerRule::Zero),
                TimerRule::Preset => rstt(self.value_while(preset.value, leg), TimerRule::Preset),
            },
            Action::Coil { .. }
            | Action::SetElement { .. }
            | Action::Sensaphone { .. }
            | Action::Reset { .. }
            | Action::Store { .. }
            | Action::Math { .. }
            | Action::Copy { .. }
            | Action::Fill { .. }
            | Action::Shift { .. }
            | Action::Run { .. }
            | Action::Restart { .. }
            | Action::Halt { .. }
            | Action::Exit
            | Action::Entask { .. }
            | Action::Jump { .. }
            | Action::StageOn { .. }
            | Action::StageOff { .. }
            | Action::Converge { .. }
            | Action::Stop => return None,
        })
    }

    fn store(&mut self, source: Source, to: WordPlace, leg: LegPowers) -> Op {
        let is_element = |value: Located<Value>| matches!(value.value, Value::Element(_));
        let to = match to {
            WordPlace::Word(word) if !source.values().any(is_element) => word,
            WordPlace::Word(_) | WordPlace::Element(_) => {
                return self.store_elements(source, to, leg);
            }
        };
        let (min, max) = self.limits(to);
        let real = to.is_real();
        let to = Target { word: WordWritten(self.layout.word(to).0), min, max };
        // A MOVE from a real to a real copies the cell; a sum of reals is never a sum of cells.
        let mixed = match source {
            Source::Value(a) => a.value.is_real() != real,
            Source::Sum(..) | Source::Difference(..) => {
                real || source.values().any(|value| value.value.is_real())
            }
        };
        if mixed {
            return self.store_mixed(source, AnyTarget { target: to, real }, leg);
        }
        let mut cell = |value: Located<Value>| self.value(value.value);
        match source {
            Source::Value(a) => Op::Move(Move { leg, a: cell(a), to }),
            Source::Sum(a, b) => Op::Add(Add { leg, a: cell(a), b: cell(b), to }),
            Source::Difference(a, b) => Op::Sub(Sub { leg, a: cell(a), b: cell(b), to }),
        }
    }

    /// MOVE, ADD and SUB with integers and reals.
    fn store_mixed(&mut self, source: Source, to: AnyTarget, leg: LegPowers) -> Op {
        const NONE: Value = Value::Const(0, Written::Integer);
        let mut any = |value: Located<Value>| self.any(value.value);
        match source {
            Source::Value(a) => Op::AddMixed(AddMixed { leg, a: any(a), b: self.any(NONE), to }),
            Source::Sum(a, b) => Op::AddMixed(AddMixed { leg, a: any(a), b: any(b), to }),
            Source::Difference(a, b) => Op::SubMixed(SubMixed { leg, a: any(a), b: any(b), to }),
        }
    }

    fn stages(&mut self, stages: &[Located<StageId>]) -> StageList {
        self.stage_list(stages.iter().map(|stage| stage.value))
    }

    fn control(&mut self, kind: ControlKind, leg: LegPowers) -> Op {
        let leg = self.one_power(leg);
        Op::Control(Control { leg, kind })
    }

    fn enable_every(&mut self, task: BlockId, every: Value, leg: LegPowers) -> Lowered {
        let (WordRead(word), pick) = self.interval(every);
        self.identity.intervals.push(Interval { task, every, word: WordCell(word) });
        let op = self.control(ControlKind::EnableEvery { task, every: word, pick }, leg);
        Lowered { rung_off: Some(PassStep::DisableTask(task)), ..op.into() }
    }
}

fn delay_timer(delay: Delay, leg: LegPowers, timer: Timer, output: BitWritten) -> Lowered {
    let op = match delay {
        Delay::On => Op::Ondtmr(Ondtmr { leg, timer, output }),
        Delay::Off => Op::Offdtmr(Offdtmr { leg, timer, output }),
    };
    let reset = Some(PassStep::Timer(timer, TimerRule::Zero));
    Lowered { bit: Some(output), reset, ..op.into() }
}

fn counter_rule(
    counts: CountDirection,
    preset: Located<Value>,
    read: impl FnOnce(Value) -> WordRead,
) -> CounterRule {
    let preset = read(preset.value);
    match counts {
        CountDirection::Up => CounterRule::Up(preset),
        CountDirection::Down => CounterRule::Down(preset),
    }
}

fn up_down_rule(
    (up, dn): (Option<Located<Value>>, Option<Located<Value>>),
    mut read: impl FnMut(Value) -> WordRead,
) -> CounterRule {
    let up = up.map(|preset| read(preset.value));
    let dn = dn.map(|preset| read(preset.value));
    CounterRule::UpDown(UdcPresets { up, dn })
}

fn timer_rule(kind: TimerKind) -> TimerRule {
    match kind {
        TimerKind::Up | TimerKind::AccumulatingUp | TimerKind::Global => TimerRule::Zero,
        TimerKind::Down | TimerKind::AccumulatingDown => TimerRule::Preset,
    }
}

fn sensaphone(counts: CountDirection, counter: Sensaphone, leg: LegPowers) -> Lowered {
    let (op, pass) = match counts {
        CountDirection::Up => (Op::Ctu(Ctu { leg, counter }), PassStep::CountUp(counter)),
        CountDirection::Down => (Op::Ctd(Ctd { leg, counter }), PassStep::CountDown(counter)),
    };
    Lowered { rung_off: Some(pass), ..op.into() }
}
