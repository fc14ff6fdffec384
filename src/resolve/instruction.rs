//! The resolved instruction, with typed operands: later steps need no look-up.
//!
//! The resolver checks each operand against the instruction table and passes all of them to
//! `Action::new`, which matches every mnemonic. The checks and `lower` match every [`Action`].
//! Properties of every action (its operands, the structure that it owns, the bit that it writes)
//! are determined once, here.

use super::array::{Array, Element, ShiftBits};
use super::formula::Formula;
pub(crate) use super::operand_list::{
    Filling, OperandList, OperandValue, Target, Value, WordPlace,
};
use crate::isa::{Bit, BlockId, Mnemonic, StageId, Structure};
use crate::source::span::{Located, Span};

/// One instruction with its operands.
#[derive(Clone, Debug)]
pub(crate) struct Instruction {
    /// Its row in the instruction table.
    pub mnemonic: Mnemonic,
    /// The place of its whole text.
    pub span: Span,
    /// Its action, with its operands.
    pub action: Action,
}

/// The action of an instruction with its operands; one variant for each shape of operands.
#[derive(Clone, Debug)]
pub(crate) enum Action {
    /// OUT, SET, RST, PD, ND, PONOFF.
    Coil {
        /// How the bit follows the rung.
        coil: Coil,
        /// The bit.
        bit: Located<Bit>,
    },
    /// SET, RST of the bit of an array that a word selects.
    SetElement {
        /// SET.
        on: bool,
        /// The bit.
        bit: Located<Element>,
    },
    /// CNT, CNTDN.
    Counter {
        /// Up for CNT, down for CNTDN.
        counts: CountDirection,
        /// The counter.
        ct: Located<Structure>,
        /// The preset.
        preset: Located<Value>,
    },
    /// UDC, UDCG.
    UpDownCounter {
        /// `true` for UDC, `false` for UDCG.
        has_reset_leg: bool,
        /// The counter.
        ct: Located<Structure>,
        /// The preset of `.Done`.
        up_preset: Option<Located<Value>>,
        /// The preset of `.DnDone`.
        dn_preset: Option<Located<Value>>,
    },
    /// ONDTMR, OFFDTMR.
    DelayTimer {
        /// Which edge of the leg is delayed.
        delay: Delay,
        /// The timer.
        t: Located<Structure>,
        /// The preset.
        preset: Located<Value>,
        /// The delayed bit.
        output: Located<Bit>,
    },
    /// TMR, TMRDOWN, TMRA, TMRADOWN, TMRAG.
    Timer {
        /// The kind, which determines the effects of the leg OFF and of the reset leg.
        timer: TimerKind,
        /// The timer.
        t: Located<Structure>,
        /// The preset.
        preset: Located<Value>,
    },
    /// CTU, CTD.
    Sensaphone {
        /// Up for CTU, down for CTD.
        counts: CountDirection,
        /// The Sensaphone counter.
        n: Located<Structure>,
        /// The preset. If a CTU and a CTD share a counter, one of them may omit it.
        preset: Option<Located<Value>>,
    },
    /// RSTCT, RSTT, RES.
    Reset {
        /// A counter, a timer, a Sensaphone counter.
        structure: Located<Structure>,
    },
    /// MOVE, ADD, SUB.
    Store {
        /// The number to be stored.
        source: Source,
        /// The word that it is stored in.
        to: Located<WordPlace>,
    },
    /// MATH.
    Math {
        /// The word or bit that the result is stored in.
        target: Located<Target>,
        /// The index of the target, if that is an array.
        index: Option<Box<Formula>>,
        /// The expression.
        formula: Box<Formula>,
    },
    /// COPY.
    Copy {
        /// The array that is read.
        from: Located<Array>,
        /// The array that is written, of the same kind and length.
        to: Located<Array>,
    },
    /// FILL.
    Fill {
        /// The value.
        value: Located<Filling>,
        /// The array.
        to: Located<Array>,
    },
    /// SR.
    Shift {
        /// The bits.
        bits: Located<ShiftBits>,
    },
    /// RUN.
    Run {
        /// The Program.
        block: Located<BlockId>,
    },
    /// RESTART.
    Restart {
        /// The Program.
        block: Located<BlockId>,
    },
    /// HALT.
    Halt {
        /// The Program or Task.
        block: Located<BlockId>,
    },
    /// EXIT.
    Exit,
    /// ENTASK.
    Entask {
        /// The Task.
        block: Located<BlockId>,
        /// The interval; `None`: the Task runs once.
        every: Option<Located<Value>>,
    },
    /// JMP (one Stage), SGDIVRG (one or several).
    Jump {
        /// The targets.
        stages: Vec<Located<StageId>>,
    },
    /// SGSET.
    StageOn {
        /// The Stage.
        stage: Located<StageId>,
    },
    /// SGRST.
    StageOff {
        /// The Stage.
        stage: Located<StageId>,
    },
    /// SGCONVRG.
    Converge {
        /// The Stages that must be ON.
        stages: Vec<Located<StageId>>,
        /// The target.
        to: Located<StageId>,
    },
    /// STOP.
    Stop,
}

/// How a bit follows the rung.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub(crate) enum Coil {
    Out,
    Set,
    Rst,
    Pd,
    Nd,
    Ponoff,
}

/// The direction in which a counter counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub(crate) enum CountDirection {
    Up,
    Down,
}

/// The edge of its leg that a delay timer delays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub(crate) enum Delay {
    On,
    Off,
}

/// A timer without an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TimerKind {
    /// TMR: the leg OFF resets it.
    Up,
    /// TMRDOWN: the leg OFF reloads it.
    Down,
    /// TMRA: the leg OFF holds it, RST zeroes it.
    AccumulatingUp,
    /// TMRADOWN: the leg OFF holds it, RST reloads it.
    AccumulatingDown,
    /// TMRAG: as TMRA, without a reset leg.
    Global,
}

/// The number that MOVE, ADD and SUB store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Source {
    Value(Located<Value>),
    Sum(Located<Value>, Located<Value>),
    Difference(Located<Value>, Located<Value>),
}

impl Source {
    /// Its numbers: one for MOVE, two for ADD and SUB.
    pub(crate) fn values(self) -> impl Iterator<Item = Located<Value>> {
        let (a, b) = match self {
            Source::Value(a) => (a, None),
            Source::Sum(a, b) | Source::Difference(a, b) => (a, Some(b)),
        };
        std::iter::once(a).chain(b)
    }
}

impl Action {
    /// The action of a mnemonic with these operands. `None` if the action needs an absent operand
    /// that the table does not require.
    pub(super) fn new(mnemonic: Mnemonic, given: &OperandList) -> Option<Action> {
        use Mnemonic as M;
        let block = || given.get("block");
        Some(match mnemonic {
            M::Out => Action::coil(Coil::Out, given)?,
            M::Set => Action::set(true, given)?,
            M::Rst => Action::set(false, given)?,
            M::Pd => Action::coil(Coil::Pd, given)?,
            M::Nd => Action::coil(Coil::Nd, given)?,
            M::Ponoff => Action::coil(Coil::Ponoff, given)?,
            M::Cnt => Action::counter(CountDirection::Up, given)?,
            M::Cntdn => Action::counter(CountDirection::Down, given)?,
            M::Udc => Action::up_down_counter(true, given)?,
            M::Udcg => Action::up_down_counter(false, given)?,
            M::Rstct => Action::Reset { structure: given.get("ct")? },
            M::Rstt => Action::Reset { structure: given.get("t")? },
            // The resolver adds the expression.
            M::Math => {
                let target = given.get("target")?;
                Action::Math { target, index: None, formula: Box::default() }
            }
            M::Res => Action::Reset { structure: given.get("n")? },
            M::Ondtmr => Action::delay_timer(Delay::On, given)?,
            M::Offdtmr => Action::delay_timer(Delay::Off, given)?,
            M::Tmr => Action::timer(TimerKind::Up, given)?,
            M::Tmrdown => Action::timer(TimerKind::Down, given)?,
            M::Tmra => Action::timer(TimerKind::AccumulatingUp, given)?,
            M::Tmradown => Action::timer(TimerKind::AccumulatingDown, given)?,
            M::Tmrag => Action::timer(TimerKind::Global, given)?,
            M::Ctu => Action::sensaphone(CountDirection::Up, given)?,
            M::Ctd => Action::sensaphone(CountDirection::Down, given)?,
            M::Move => Action::store(Source::Value(given.get("a")?), given)?,
            M::Add => Action::store(Source::Sum(given.get("a")?, given.get("b")?), given)?,
            M::Sub => Action::store(Source::Difference(given.get("a")?, given.get("b")?), given)?,
            M::Copy => Action::Copy { from: given.get("from")?, to: given.get("to")? },
            M::Fill => Action::Fill { value: given.get("value")?, to: given.get("to")? },
            M::Sr => Action::Shift { bits: given.get("bits")? },
            M::Run => Action::Run { block: block()? },
            M::Restart => Action::Restart { block: block()? },
            M::Halt => Action::Halt { block: block()? },
            M::Exit => Action::Exit,
            M::Entask => Action::Entask { block: block()?, every: given.get("every") },
            M::Jmp | M::Sgdivrg => Action::Jump { stages: given.named("stage").collect() },
            M::Sgset => Action::StageOn { stage: given.get("stage")? },
            M::Sgrst => Action::StageOff { stage: given.get("stage")? },
            M::Sgconvrg => {
                Action::Converge { stages: given.named("stage").collect(), to: given.get("to")? }
            }
            M::Stop => Action::Stop,
        })
    }

    fn coil(coil: Coil, given: &OperandList) -> Option<Action> {
        Some(Action::Coil { coil, bit: given.get("bit")? })
    }

    fn set(on: bool, given: &OperandList) -> Option<Action> {
        match given.get("bit") {
            Some(bit) => Some(Action::SetElement { on, bit }),
            None => Action::coil(if on { Coil::Set } else { Coil::Rst }, given),
        }
    }

    fn counter(counts: CountDirection, given: &OperandList) -> Option<Action> {
        let (ct, preset) = (given.get("ct")?, given.get("preset")?);
        Some(Action::Counter { counts, ct, preset })
    }

    fn up_down_counter(has_reset_leg: bool, given: &OperandList) -> Option<Action> {
        let ct = given.get("ct")?;
        let (up_preset, dn_preset) = (given.get("up-preset"), given.get("dn-preset"));
        Some(Action::UpDownCounter { has_reset_leg, ct, up_preset, dn_preset })
    }

    fn delay_timer(delay: Delay, given: &OperandList) -> Option<Action> {
        let (t, preset) = (given.get("t")?, given.get("preset")?);
        Some(Action::DelayTimer { delay, t, preset, output: given.get("output")? })
    }

    fn timer(timer: TimerKind, given: &OperandList) -> Option<Action> {
        Some(Action::Timer { timer, t: given.get("t")?, preset: given.get("preset")? })
    }

    fn sensaphone(counts: CountDirection, given: &OperandList) -> Option<Action> {
        Some(Action::Sensaphone { counts, n: given.get("n")?, preset: given.get("preset") })
    }

    fn store(source: Source, given: &OperandList) -> Option<Action> {
        Some(Action::Store { source, to: given.get("to")? })
    }

    /// Its operands, in the table's order, without omitted ones. Several Stages have the same name.
    pub fn operands(&self) -> OperandList {
        let none = OperandList::default();
        match self {
            Action::Coil { coil: _, bit } => none.with("bit", *bit),
            Action::SetElement { on: _, bit } => none.with("bit", *bit),
            Action::Counter { counts: _, ct, preset } => {
                none.with("ct", *ct).with("preset", *preset)
            }
            Action::UpDownCounter { has_reset_leg: _, ct, up_preset, dn_preset } => none
                .with("ct", *ct)
                .with_any("up-preset", *up_preset)
                .with_any("dn-preset", *dn_preset),
            Action::DelayTimer { delay: _, t, preset, output } => {
                none.with("t", *t).with("preset", *preset).with("output", *output)
            }
            Action::Timer { timer: _, t, preset } => none.with("t", *t).with("preset", *preset),
            Action::Sensaphone { counts: _, n, preset } => {
                none.with("n", *n).with_any("preset", *preset)
            }
            Action::Reset { structure } => match structure.value {
                Structure::Counter(_) => none.with("ct", *structure),
                Structure::Timer(_) => none.with("t", *structure),
                Structure::Sensaphone(_) => none.with("n", *structure),
            },
            Action::Store { source, to } => ["a", "b"]
                .into_iter()
                .zip(source.values())
                .fold(none, |all, (name, value)| all.with(name, value))
                .with("to", *to),
            Action::Math { target, index: _, formula: _ } => none.with("target", *target),
            Action::Copy { from, to } => none.with("from", *from).with("to", *to),
            Action::Fill { value, to } => none.with("value", *value).with("to", *to),
            Action::Shift { bits } => none.with("bits", *bits),
            Action::Run { block } | Action::Restart { block } | Action::Halt { block } => {
                none.with("block", *block)
            }
            Action::Entask { block, every } => none.with("block", *block).with_any("every", *every),
            Action::Jump { stages } => none.with_any("stage", stages.iter().copied()),
            Action::StageOn { stage } | Action::StageOff { stage } => none.with("stage", *stage),
            Action::Converge { stages, to } => {
                none.with_any("stage", stages.iter().copied()).with("to", *to)
            }
            Action::Exit | Action::Stop => none,
        }
    }

    /// Whether the instruction is an ENTASK with an interval.
    pub fn is_recurrent(&self) -> bool {
        matches!(self, Action::Entask { every: Some(_), .. })
    }
}

impl Instruction {
    /// The structure that it owns: a structure has one owner in a program.
    pub fn owned(&self) -> Option<Structure> {
        self.action.structure().filter(|_| self.mnemonic.owns_structure())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::instruction::{self, OperandKind, Spec};
    use crate::isa::{BitSpace, Space, Word};

    const ARRAY: Array = Array { space: Space::Bit(BitSpace::C), first: 0, count: 2 };

    /// Operands as the resolver would find them.
    fn given(spec: &Spec) -> OperandList {
        let operand = |kind| match kind {
            OperandKind::WritableBit => OperandValue::Bit(Bit::Stage(StageId(0))),
            OperandKind::WritableWord | OperandKind::Target => OperandValue::Word(Word::Pre(0)),
            OperandKind::Array | OperandKind::WritableArray => OperandValue::Array(ARRAY),
            OperandKind::Shifted => OperandValue::Run(ShiftBits { array: ARRAY, down: false }),
            OperandKind::Filling => OperandValue::Bit(Bit::Stage(StageId(0))),
            OperandKind::Counter => OperandValue::Structure(Structure::Counter(0)),
            OperandKind::Timer => OperandValue::Structure(Structure::Timer(0)),
            OperandKind::Sensaphone => OperandValue::Structure(Structure::Sensaphone(0)),
            OperandKind::Number
            | OperandKind::Value(..)
            | OperandKind::Duration
            | OperandKind::Interval => OperandValue::Value(Value::Word(Word::Pre(1))),
            OperandKind::Program | OperandKind::Block | OperandKind::Task => {
                OperandValue::Block(BlockId(0))
            }
            OperandKind::Stage | OperandKind::Stages => OperandValue::Stage(StageId(0)),
        };
        let located = |value| Located { value, span: Span::default() };
        OperandList(spec.operands.iter().map(|o| (o.name, located(operand(o.kind)))).collect())
    }

    #[test]
    fn every_row_of_the_table_makes_an_action_that_has_all_its_operands() {
        for spec in instruction::TABLE {
            let given = given(spec);
            let action = Action::new(spec.mnemonic, &given);
            let action = action.unwrap_or_else(|| panic!("{}: an operand is missing", spec.name));
            assert_eq!(action.operands().0, given.0, "{}", spec.name);
        }
    }
}
