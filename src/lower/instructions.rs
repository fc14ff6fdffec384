//! Instructions → operations, and what a termination pass does to each.

use super::assembler::{Assembler, loads_preset};
use super::identity::Interval;
use crate::engine::ops::{
    Add, Cnt, Cntdn, Control, ControlKind, Counter, CounterRule, Ctd, Ctu, Leg, Move, Nd, Offdtmr,
    Ondtmr, Op, Out, OutOne, Pd, Ponoff, Power, Powers, Res, RestartState, Rst, Rstct, Rstt,
    Sensaphone, Set, Sub, Target, Timer, TimerRule, Tmr, Tmra, Tmradown, Tmrdown, Udc, UdcPresets,
};
use crate::engine::{Termination, WordCell};
use crate::isa::status::st;
use crate::isa::{Bit, BitSpace, BlockId, LegName, Mnemonic, StageId, Structure, Word};
use crate::resolve::program::{ArgValue, Instruction, Value};

/// An instruction being lowered, with the powers of its legs.
struct Site<'a> {
    instruction: &'a Instruction,
    legs: &'a [(LegName, Leg)],
}

impl Site<'_> {
    fn leg(&self, name: LegName) -> Leg {
        let leg = self.legs.iter().find(|(n, _)| *n == name);
        leg.expect("the resolver gives every leg").1
    }

    fn when(&self) -> Leg {
        self.leg(LegName::When)
    }

    fn value(&self, name: &str) -> Option<Value> {
        match self.instruction.arg(name)?.value {
            ArgValue::Value(value) => Some(value),
            _ => None,
        }
    }

    fn bit(&self, name: &str) -> Bit {
        match self.instruction.arg(name).map(|a| a.value) {
            Some(ArgValue::Bit(bit)) => bit,
            other => unreachable!("the resolver gives a bit for {name}, not {other:?}"),
        }
    }

    fn word(&self, name: &str) -> Word {
        match self.instruction.arg(name).map(|a| a.value) {
            Some(ArgValue::Word(word)) => word,
            other => unreachable!("the resolver gives a word for {name}, not {other:?}"),
        }
    }

    fn structure(&self) -> Structure {
        match self.instruction.args.first().map(|a| a.value) {
            Some(ArgValue::Structure(structure)) => structure,
            other => unreachable!("the resolver gives a structure, not {other:?}"),
        }
    }

    fn block(&self) -> BlockId {
        match self.instruction.arg("block").map(|a| a.value) {
            Some(ArgValue::Block(block)) => block,
            other => unreachable!("the resolver gives a block, not {other:?}"),
        }
    }

    fn stages<'a>(&'a self, name: &'a str) -> impl Iterator<Item = StageId> + 'a {
        self.instruction.args_of(name).filter_map(|arg| match arg.value {
            ArgValue::Stage(stage) => Some(stage),
            _ => None,
        })
    }

    fn stage(&self, name: &str) -> StageId {
        self.stages(name).next().expect("the resolver gives a stage")
    }
}

impl Assembler<'_> {
    /// Lowers one instruction with the powers of its legs.
    pub fn instruction(&mut self, instruction: &Instruction, legs: &[(LegName, Leg)]) {
        let site = Site { instruction, legs };
        self.identity.instruction(instruction, self.site.standing);
        use Mnemonic as M;
        match instruction.mnemonic {
            M::Out | M::Set | M::Rst | M::Pd | M::Nd | M::Ponoff => self.coil(&site),
            M::Cnt | M::Cntdn | M::Udc | M::Udcg | M::Rstct => self.counter(&site),
            M::Ondtmr
            | M::Offdtmr
            | M::Tmr
            | M::Tmrdown
            | M::Tmra
            | M::Tmradown
            | M::Tmrag
            | M::Rstt => self.timer(&site),
            M::Ctu | M::Ctd | M::Res => self.sensaphone(&site),
            M::Move | M::Add | M::Sub => self.arithmetic(&site),
            _ => self.control(&site),
        }
    }

    /// The edge history of an instruction.
    fn edge_history(&mut self, site: &Site) -> u32 {
        let text = self.identity.edge_instruction(site.instruction);
        self.history(text)
    }

    fn coil(&mut self, site: &Site) {
        let (leg, bit) = (site.when(), self.layout.bit(site.bit("bit")).0);
        let op = match site.instruction.mnemonic {
            Mnemonic::Out => match leg.each() {
                [a, b] if a == b => Op::OutOne(OutOne { leg: Powers::new([a]), bit }),
                _ => Op::Out(Out { leg, bit }),
            },
            Mnemonic::Set => Op::Set(Set { leg, bit }),
            Mnemonic::Rst => Op::Rst(Rst { leg, bit }),
            Mnemonic::Pd => Op::Pd(Pd { leg, bit, history: self.edge_history(site) }),
            Mnemonic::Nd => Op::Nd(Nd { leg, bit, history: self.edge_history(site) }),
            _ => Op::Ponoff(Ponoff { leg, bit, history: self.edge_history(site) }),
        };
        if matches!(op, Op::Out(_) | Op::OutOne(_) | Op::Pd(_) | Op::Nd(_)) {
            self.terminates(Termination::BitOff(bit));
        }
        self.op(op);
    }

    fn counter_of(&self, structure: Structure) -> Counter {
        Counter { at: self.layout.record(structure) }
    }

    /// What the owner of a counter makes of its `.Acc`.
    fn counter_rule(&mut self, owner: &Instruction) -> CounterRule {
        let mut preset = |name: &str| match owner.arg(name)?.value {
            ArgValue::Value(value) => Some(self.value(value)),
            _ => None,
        };
        match owner.mnemonic {
            Mnemonic::Cnt => CounterRule::Up(preset("preset").expect("CNT has a preset")),
            Mnemonic::Cntdn => CounterRule::Down(preset("preset").expect("CNTDN has a preset")),
            _ => {
                CounterRule::UpDown(UdcPresets { up: preset("up-preset"), dn: preset("dn-preset") })
            }
        }
    }

    fn counter(&mut self, site: &Site) {
        let structure = site.structure();
        let counter = self.counter_of(structure);
        if site.instruction.mnemonic == Mnemonic::Rstct {
            let Some(owner) = self.owners.get(&structure).copied() else { return };
            let rule = self.counter_rule(owner);
            return self.op(Op::Rstct(Rstct { leg: site.when(), counter, rule }));
        }
        let rule = self.counter_rule(site.instruction);
        if site.instruction.mnemonic != Mnemonic::Udcg {
            self.terminates(Termination::Counter(counter, rule));
        }
        let leg = |name| site.leg(name);
        let op = match rule {
            CounterRule::Up(preset) => {
                Op::Cnt(Cnt { up: leg(LegName::Up), rst: leg(LegName::Rst), counter, preset })
            }
            CounterRule::Down(preset) => {
                Op::Cntdn(Cntdn { dn: leg(LegName::Dn), rst: leg(LegName::Rst), counter, preset })
            }
            CounterRule::UpDown(presets) => {
                let global = site.instruction.mnemonic == Mnemonic::Udcg;
                let rst = if global { self.off() } else { leg(LegName::Rst) };
                let (up, dn) = (leg(LegName::Up), leg(LegName::Dn));
                Op::Udc(Udc { up, dn, rst, counter, presets })
            }
        };
        self.op(op);
    }

    /// The leg that is `$Off`.
    fn off(&self) -> Leg {
        Leg::of(Power::of(self.layout.bit(Bit::Space(BitSpace::St, st::OFF)).0))
    }

    fn timer(&mut self, site: &Site) {
        let structure = site.structure();
        let mnemonic = site.instruction.mnemonic;
        let owner = match mnemonic {
            Mnemonic::Rstt => match self.owners.get(&structure).copied() {
                Some(owner) => owner,
                None => return,
            },
            _ => site.instruction,
        };
        let preset = match owner.arg("preset").map(|a| a.value) {
            Some(ArgValue::Value(value)) => self.value(value),
            other => unreachable!("the resolver gives a timer's preset, not {other:?}"),
        };
        let timer = Timer { at: self.layout.record(structure), preset };
        let rule = if loads_preset(owner.mnemonic) { TimerRule::Preset } else { TimerRule::Zero };
        match mnemonic {
            Mnemonic::Rstt => {}
            Mnemonic::Tmrag => self.terminates(Termination::HoldTimer(timer)),
            _ => self.terminates(Termination::Timer(timer, rule)),
        }
        let op = self.timer_op(site, timer, rule);
        self.op(op);
    }

    fn timer_op(&mut self, site: &Site, timer: Timer, rule: TimerRule) -> Op {
        let mut output = || {
            let output = self.layout.bit(site.bit("output")).0;
            self.terminates(Termination::BitOff(output));
            output
        };
        match site.instruction.mnemonic {
            Mnemonic::Rstt => Op::Rstt(Rstt { leg: site.when(), timer, rule }),
            Mnemonic::Ondtmr => Op::Ondtmr(Ondtmr { leg: site.when(), timer, output: output() }),
            Mnemonic::Offdtmr => Op::Offdtmr(Offdtmr { leg: site.when(), timer, output: output() }),
            Mnemonic::Tmr => Op::Tmr(Tmr { leg: site.when(), timer }),
            Mnemonic::Tmrdown => Op::Tmrdown(Tmrdown { leg: site.when(), timer }),
            Mnemonic::Tmrag => Op::Tmra(Tmra { en: site.when(), rst: self.off(), timer }),
            Mnemonic::Tmra => {
                Op::Tmra(Tmra { en: site.leg(LegName::En), rst: site.leg(LegName::Rst), timer })
            }
            _ => {
                let (en, rst) = (site.leg(LegName::En), site.leg(LegName::Rst));
                Op::Tmradown(Tmradown { en, rst, timer })
            }
        }
    }

    fn sensaphone(&mut self, site: &Site) {
        let structure = site.structure();
        let preset = match site.value("preset") {
            Some(Value::Word(word)) => Some(self.layout.word(word).0),
            _ => None,
        };
        let counter = Sensaphone {
            at: self.layout.record(structure),
            pre: self.layout.word(Word::Pre(structure.number())).0,
            preset,
        };
        let leg = site.when();
        match site.instruction.mnemonic {
            Mnemonic::Ctu => {
                self.terminates(Termination::CountUp(counter));
                self.op(Op::Ctu(Ctu { leg, counter }));
            }
            Mnemonic::Ctd => {
                self.terminates(Termination::CountDown(counter));
                self.op(Op::Ctd(Ctd { leg, counter }));
            }
            _ => self.op(Op::Res(Res { leg, counter })),
        }
    }

    fn arithmetic(&mut self, site: &Site) {
        let leg = site.when();
        let target = site.word("to");
        let (min, max) = self.limits(target);
        let to = Target { word: self.layout.word(target).0, min, max };
        let mut value = |name| {
            let value = site.value(name).expect("the resolver gives every operand");
            self.value(value)
        };
        let op = match site.instruction.mnemonic {
            Mnemonic::Move => Op::Move(Move { leg, a: value("a"), to }),
            Mnemonic::Add => Op::Add(Add { leg, a: value("a"), b: value("b"), to }),
            _ => Op::Sub(Sub { leg, a: value("a"), b: value("b"), to }),
        };
        self.op(op);
    }

    fn control(&mut self, site: &Site) {
        let kind = match site.instruction.mnemonic {
            Mnemonic::Run => ControlKind::Run(site.block()),
            Mnemonic::Restart => ControlKind::Restart(RestartState {
                program: site.block(),
                history: self.edge_history(site),
            }),
            Mnemonic::Halt => ControlKind::Halt(site.block()),
            Mnemonic::Exit => ControlKind::Exit,
            Mnemonic::Entask => self.entask(site),
            Mnemonic::Jmp | Mnemonic::Sgdivrg => {
                ControlKind::Jump(self.stage_list(site.stages("stage")))
            }
            Mnemonic::Sgset => ControlKind::StageOn(site.stage("stage")),
            Mnemonic::Sgrst => ControlKind::StageOff(site.stage("stage")),
            Mnemonic::Sgconvrg => ControlKind::Converge {
                from: self.stage_list(site.stages("stage")),
                to: site.stage("to"),
            },
            _ => ControlKind::Stop,
        };
        let leg = self.one_power(site.when());
        self.op(Op::Control(Control { leg, kind }));
    }

    fn entask(&mut self, site: &Site) -> ControlKind {
        let task = site.block();
        match site.value("every") {
            None => ControlKind::EnableOnce { task, history: self.edge_history(site) },
            Some(every) => {
                self.terminates(Termination::DisableTask(task));
                let word = self.value(every);
                self.identity.intervals.push(Interval { task, every, word: WordCell(word) });
                ControlKind::EnableEvery { task, every: word }
            }
        }
    }
}
