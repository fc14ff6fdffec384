//! Turns instructions into operations and the steps of termination passes.
//!
//! Called by `lower_rung`. Every mnemonic is matched: a new instruction does not compile until it
//! is lowered here. The instruction table, not this file, determines the effect of a pass;
//! `terminate` picks the matching step.

use super::assembler::Assembler;
use super::identity::Interval;
use super::legs::Legs;
use super::sites::Sites;
use super::stores::Source;
use crate::resolve::program::{Instruction, Value};
use crate::source::span::Located;
use rungd_engine::isa::instruction::Termination;
use rungd_engine::isa::status::st;
pub use rungd_engine::isa::{
    Bit, BitSpace, BlockId, LegName, Mnemonic, OperandRole, Structure, Word,
};
pub use rungd_engine::ops::{
    BitOwn, BitWritten, Cnt, Cntdn, Control, ControlKind, Counter, CounterRule, Ctd, Ctu,
    LegPowers, Nd, Offdtmr, Ondtmr, Op, Out, OutOne, OutWordBit, Pd, Ponoff, Power, Powers, Res,
    RestartState, Rst, RstWordBit, Rstct, Rstt, Sensaphone, Set, SetWordBit, Timer, TimerRule, Tmr,
    Tmra, Tmradown, Tmrdown, Udc, UdcPresets, WordBitWritten, WordRead, WordWritten,
};
pub use rungd_engine::{Cell, PassStep, WordCell};

/// An instruction as an operation, and the parts of it that a termination pass may act on.
struct LoweredInstruction {
    op: Op,
    /// The step that turns the bit OFF that it drives, or writes as an output.
    off: Option<PassStep>,
    /// The reset of its structure.
    reset: Option<PassStep>,
    /// The step of its pass, if its termination is `Held`, `EnableOff` or `RungOff`.
    rung_off: Option<PassStep>,
}

impl From<Op> for LoweredInstruction {
    fn from(op: Op) -> LoweredInstruction {
        LoweredInstruction { op, off: None, reset: None, rung_off: None }
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
        let legs = if instruction.has_elements() {
            kept = legs.0.iter().map(|(name, leg)| (*name, self.keep(*leg))).collect();
            Legs(&kept)
        } else {
            legs
        };
        if let Some(lowered) = self.lowered(instruction, legs) {
            self.terminate(instruction.mnemonic.spec().termination, &lowered);
            if let Op::Control(control) = lowered.op
                && self.may_end_subroutine(control.kind)
            {
                self.keep_time_over(control);
            } else {
                self.op(lowered.op);
            }
        }
        self.note(Sites::end_instruction);
    }

    /// Whether a control instruction stands in a subroutine and may end its execution.
    fn may_end_subroutine(&self, kind: ControlKind) -> bool {
        let ends =
            matches!(kind, ControlKind::Return | ControlKind::Halt(_) | ControlKind::Restart(_));
        let callee_ends = self.subroutines_end_blocks && matches!(kind, ControlKind::Call(_));
        (ends || callee_ends) && self.subroutines.contains_key(&self.site.element.block)
    }

    /// Puts a control instruction between the operations that keep the time of the timers behind.
    fn keep_time_over(&mut self, control: Control) {
        let (leg, missed_ms) = (control.leg, self.missed_time());
        self.op(Op::Control(Control { leg, kind: ControlKind::KeepTime { missed_ms } }));
        self.op(Op::Control(control));
        self.op(Op::Control(Control { leg, kind: ControlKind::GiveTime { missed_ms } }));
    }

    /// Adds the steps of the termination pass that the instruction table names.
    fn terminate(&mut self, pass: Termination, lowered: &LoweredInstruction) {
        let bit = lowered.off.clone();
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
    fn lowered(&mut self, instruction: &Instruction, legs: Legs) -> Option<LoweredInstruction> {
        use Mnemonic as M;
        let leg = |name| legs.leg(name);
        let when = || legs.when();
        let value = |name| instruction.operands.required::<Value>(name);
        let to = || instruction.operands.required("to");
        let block = || instruction.operands.required("block");
        Some(match instruction.mnemonic {
            M::Out => self.drive(instruction, when()),
            M::Set => self.set(instruction, true, when()),
            M::Rst => self.set(instruction, false, when()),
            M::Pd => {
                self.edge_coil(instruction, |bit, history| Op::Pd(Pd { leg: when(), bit, history }))
            }
            M::Nd => {
                self.edge_coil(instruction, |bit, history| Op::Nd(Nd { leg: when(), bit, history }))
            }
            M::Ponoff => self.edge_coil(instruction, |bit, history| {
                Op::Ponoff(Ponoff { leg: when(), bit, history })
            }),
            M::Cnt | M::Cntdn | M::Udc | M::Udcg => self.counter(instruction, legs),
            M::Rstct | M::Rstt | M::Res => {
                return self.reset(instruction, when()).map(LoweredInstruction::from);
            }
            M::Ondtmr => self.delay_timer(instruction, |timer, output| {
                Op::Ondtmr(Ondtmr { leg: when(), timer, output })
            }),
            M::Offdtmr => self.delay_timer(instruction, |timer, output| {
                Op::Offdtmr(Offdtmr { leg: when(), timer, output })
            }),
            M::Tmr => self.timer(instruction, |timer| Op::Tmr(Tmr { leg: when(), timer })),
            M::Tmrdown => {
                self.timer(instruction, |timer| Op::Tmrdown(Tmrdown { leg: when(), timer }))
            }
            M::Tmra => self.timer(instruction, |timer| {
                Op::Tmra(Tmra { en: leg(LegName::En), rst: leg(LegName::Rst), timer })
            }),
            M::Tmradown => self.timer(instruction, |timer| {
                Op::Tmradown(Tmradown { en: leg(LegName::En), rst: leg(LegName::Rst), timer })
            }),
            M::Tmrag => {
                let rst = self.off();
                self.timer(instruction, |timer| Op::Tmra(Tmra { en: when(), rst, timer }))
            }
            M::Ctu => self.sensaphone(instruction, |counter| {
                (Op::Ctu(Ctu { leg: when(), counter }), PassStep::CountUp(counter))
            }),
            M::Ctd => self.sensaphone(instruction, |counter| {
                (Op::Ctd(Ctd { leg: when(), counter }), PassStep::CountDown(counter))
            }),
            M::Move => self.store(Source::Value(value("a")), to(), when()).into(),
            M::Add => self.store(Source::Sum(value("a"), value("b")), to(), when()).into(),
            M::Sub => self.store(Source::Difference(value("a"), value("b")), to(), when()).into(),
            M::Math => self.math(instruction, when()).into(),
            M::Copy => self.copy(instruction, when()).into(),
            M::Fill => self.fill(instruction, when()).into(),
            M::Pack | M::Unpack => self.pack_or_unpack(instruction, when()).into(),
            M::Sr => self.shift(instruction, legs).into(),
            M::Run => self.control(ControlKind::Run(block()), when()),
            M::Restart => self.restart(instruction, block(), when()),
            M::Halt => self.control(ControlKind::Halt(block()), when()),
            M::Exit => self.control(ControlKind::Exit, when()),
            M::Entask => self.enable(instruction, block(), when()),
            M::Call | M::Return => self.call_or_return(instruction, when()),
            M::Jmp | M::Sgdivrg => self.jump(instruction, when()),
            M::Sgset | M::Sgrst => self.switch_stage(instruction, when()),
            M::Sgconvrg => self.converge(instruction, when()),
            M::Stop => self.control(ControlKind::Stop, when()),
        })
    }

    /// The edge history of an instruction.
    fn edge_history(&mut self, instruction: &Instruction) -> BitOwn {
        let text = self.identity.edge_instruction(instruction);
        self.history(text)
    }

    fn drive(&mut self, instruction: &Instruction, leg: LegPowers) -> LoweredInstruction {
        let in_word = |bit| Op::OutWordBit(OutWordBit { leg, bit });
        self.plain_coil(instruction, |bit| out(leg, bit), in_word)
    }

    fn coil(
        &mut self,
        instruction: &Instruction,
        op: impl FnOnce(BitWritten) -> Op,
    ) -> LoweredInstruction {
        let bit = instruction.operands.required("bit");
        self.written(bit, op)
    }

    /// OUT, SET and RST: `in_word` is the operation for a bit of a word.
    fn plain_coil(
        &mut self,
        instruction: &Instruction,
        op: impl FnOnce(BitWritten) -> Op,
        in_word: impl FnOnce(WordBitWritten) -> Op,
    ) -> LoweredInstruction {
        match self.layout.bit_in(instruction.operands.required("bit")) {
            Cell::WordBit(bit) => {
                let bit = WordBitWritten(bit);
                LoweredInstruction { off: Some(PassStep::WordBitOff(bit)), ..in_word(bit).into() }
            }
            Cell::Bit(_) | Cell::Word(_) => self.coil(instruction, op),
        }
    }

    /// An instruction that writes a bit. For a bit of a word, `op` writes a copy of it, which is
    /// then stored in the word.
    fn written(&mut self, bit: Bit, op: impl FnOnce(BitWritten) -> Op) -> LoweredInstruction {
        let Cell::WordBit(in_word) = self.layout.bit_in(bit) else {
            let bit = BitWritten(self.layout.bit(bit).0);
            return LoweredInstruction { off: Some(PassStep::BitOff(bit.0)), ..op(bit).into() };
        };
        let copy = self.bit_cell(bit);
        self.op(op(BitWritten(copy)));
        let (leg, bit) = (LegPowers::of(Power::of(copy)), WordBitWritten(in_word));
        let store = Op::OutWordBit(OutWordBit { leg, bit });
        LoweredInstruction { off: Some(PassStep::WordBitOff(bit)), ..store.into() }
    }

    fn edge_coil(
        &mut self,
        instruction: &Instruction,
        op: impl FnOnce(BitWritten, BitOwn) -> Op,
    ) -> LoweredInstruction {
        let history = self.edge_history(instruction);
        self.coil(instruction, |bit| op(bit, history))
    }

    /// SET and RST, also of a bit that a word selects.
    fn set(&mut self, instruction: &Instruction, on: bool, leg: LegPowers) -> LoweredInstruction {
        match instruction.operands.get("bit") {
            Some(element) => self.set_element(on, element.value, leg).into(),
            None if on => self.plain_coil(
                instruction,
                |bit| Op::Set(Set { leg, bit }),
                |bit| Op::SetWordBit(SetWordBit { leg, bit }),
            ),
            None => self.plain_coil(
                instruction,
                |bit| Op::Rst(Rst { leg, bit }),
                |bit| Op::RstWordBit(RstWordBit { leg, bit }),
            ),
        }
    }

    fn counter(&mut self, instruction: &Instruction, legs: Legs) -> LoweredInstruction {
        let has_reset_leg = instruction.mnemonic != Mnemonic::Udcg;
        let rule = counter_rule(instruction, |preset| self.owner_preset(preset, has_reset_leg));
        let rst = if has_reset_leg { legs.leg(LegName::Rst) } else { self.off() };
        let counter = Counter { at: self.layout.record(instruction.operands.required("ct")) };
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
        LoweredInstruction { reset: Some(PassStep::Counter(counter, rule)), ..op.into() }
    }

    /// The leg that is `$Off`.
    fn off(&self) -> LegPowers {
        LegPowers::of(Power::of(self.layout.bit(Bit::Space(BitSpace::St, st::OFF)).0))
    }

    fn timer_of(&mut self, instruction: &Instruction, rule: TimerRule) -> Timer {
        let preset =
            self.owner_preset(instruction.operands.required("preset"), rule == TimerRule::Preset);
        Timer { at: self.layout.record(instruction.operands.required("t")), preset }
    }

    fn timer(
        &mut self,
        instruction: &Instruction,
        op: impl FnOnce(Timer) -> Op,
    ) -> LoweredInstruction {
        let rule = timer_rule(instruction.mnemonic);
        let timer = self.timer_of(instruction, rule);
        let reset = Some(PassStep::Timer(timer, rule));
        LoweredInstruction { reset, rung_off: Some(PassStep::HoldTimer(timer)), ..op(timer).into() }
    }

    fn delay_timer(
        &mut self,
        instruction: &Instruction,
        op: impl FnOnce(Timer, BitWritten) -> Op,
    ) -> LoweredInstruction {
        let timer = self.timer_of(instruction, TimerRule::Zero);
        let reset = Some(PassStep::Timer(timer, TimerRule::Zero));
        let output = instruction.operands.required("output");
        LoweredInstruction { reset, ..self.written(output, |output| op(timer, output)) }
    }

    /// CTU and CTD.
    fn sensaphone(
        &mut self,
        instruction: &Instruction,
        op: impl FnOnce(Sensaphone) -> (Op, PassStep),
    ) -> LoweredInstruction {
        let counter = self.sensaphone_of(instruction.operands.required("n"), instruction.preset());
        let (op, pass) = op(counter);
        LoweredInstruction { rung_off: Some(pass), ..op.into() }
    }

    /// A Sensaphone counter, with the preset of one of its instructions.
    fn sensaphone_of(&mut self, n: Structure, preset: Option<Located<Value>>) -> Sensaphone {
        let preset = match preset.map(|preset| preset.value) {
            Some(preset @ (Value::Word(_) | Value::Element(_))) => {
                Some(self.owner_preset(preset, false))
            }
            Some(Value::Const(..) | Value::Real(_)) | None => None,
        };
        let pre = WordWritten(self.layout.word(Word::Pre(n.number())).0);
        Sensaphone { at: self.layout.record(n), pre, preset }
    }

    /// RSTCT and RSTT, by the rule of the structure's owner, and RES.
    fn reset(&mut self, instruction: &Instruction, leg: LegPowers) -> Option<Op> {
        let structure = instruction.structure()?;
        if let Structure::Sensaphone(_) = structure {
            return Some(Op::Res(Res { leg, counter: self.sensaphone_of(structure, None) }));
        }
        let (at, owner) = (self.layout.record(structure), *self.owners.get(&structure)?);
        if let Structure::Counter(_) = structure {
            let rule = counter_rule(owner, |preset| self.value_while(preset, leg));
            return Some(Op::Rstct(Rstct { leg, counter: Counter { at }, rule }));
        }
        let rule = timer_rule(owner.mnemonic);
        let preset = match rule {
            TimerRule::Zero => WordRead(self.constant(0)),
            TimerRule::Preset => self.value_while(owner.operands.required("preset"), leg),
        };
        Some(Op::Rstt(Rstt { leg, timer: Timer { at, preset }, rule }))
    }

    fn control(&mut self, kind: ControlKind, leg: LegPowers) -> LoweredInstruction {
        let leg = self.one_power(leg);
        Op::Control(Control { leg, kind }).into()
    }

    /// RESTART.
    fn restart(
        &mut self,
        instruction: &Instruction,
        program: BlockId,
        leg: LegPowers,
    ) -> LoweredInstruction {
        let BitOwn(history) = self.edge_history(instruction);
        self.control(ControlKind::Restart(RestartState { program, history }), leg)
    }

    /// ENTASK.
    fn enable(
        &mut self,
        instruction: &Instruction,
        task: BlockId,
        leg: LegPowers,
    ) -> LoweredInstruction {
        let Some(every) = instruction.operands.get("every") else {
            let BitOwn(history) = self.edge_history(instruction);
            return self.control(ControlKind::EnableOnce { task, history }, leg);
        };
        let (every, (WordRead(word), pick)) = (every.value, self.interval(every.value));
        self.identity.intervals.push(Interval { task, every, word: WordCell(word) });
        let lowered = self.control(ControlKind::EnableEvery { task, every: word, pick }, leg);
        LoweredInstruction { rung_off: Some(PassStep::DisableTask(task)), ..lowered }
    }

    /// CALL and RETURN.
    fn call_or_return(&mut self, instruction: &Instruction, leg: LegPowers) -> LoweredInstruction {
        let kind = match instruction.called() {
            Some(subroutine) => ControlKind::Call(self.subroutines[&subroutine]),
            None => ControlKind::Return,
        };
        self.control(kind, leg)
    }

    /// SGSET and SGRST.
    fn switch_stage(&mut self, instruction: &Instruction, leg: LegPowers) -> LoweredInstruction {
        let stage = instruction.operands.required("stage");
        let is_set = instruction.mnemonic == Mnemonic::Sgset;
        let kind = if is_set { ControlKind::StageOn } else { ControlKind::StageOff };
        self.control(kind(stage), leg)
    }

    /// JMP and SGDIVRG.
    fn jump(&mut self, instruction: &Instruction, leg: LegPowers) -> LoweredInstruction {
        let to = self.stage_list(instruction.stages_entered());
        self.control(ControlKind::Jump(to), leg)
    }

    /// SGCONVRG.
    fn converge(&mut self, instruction: &Instruction, leg: LegPowers) -> LoweredInstruction {
        let from = self
            .stage_list(instruction.operands_with(OperandRole::Awaits).map(|stage| stage.value));
        let to = instruction.operands.required("to");
        self.control(ControlKind::Converge { from, to }, leg)
    }
}

fn out(leg: LegPowers, bit: BitWritten) -> Op {
    match leg.each() {
        [a, b] if a == b => Op::OutOne(OutOne { leg: Powers::new([a]), bit }),
        _ => Op::Out(Out { leg, bit }),
    }
}

/// The rule of a counter's owner.
fn counter_rule(owner: &Instruction, mut read: impl FnMut(Value) -> WordRead) -> CounterRule {
    let mut preset = |name| owner.operands.get(name).map(|preset| read(preset.value));
    if owner.mnemonic == Mnemonic::Cnt {
        return CounterRule::Up(preset("preset").expect("CNT has a preset"));
    }
    if owner.mnemonic == Mnemonic::Cntdn {
        return CounterRule::Down(preset("preset").expect("CNTDN has a preset"));
    }
    CounterRule::UpDown(UdcPresets { up: preset("up-preset"), dn: preset("dn-preset") })
}

/// The value that a reset gives a timer.
fn timer_rule(owner: Mnemonic) -> TimerRule {
    let counts_down = matches!(owner, Mnemonic::Tmrdown | Mnemonic::Tmradown);
    if counts_down { TimerRule::Preset } else { TimerRule::Zero }
}
