//! The numbers of an instruction, and the neighbours that an author might have written by mistake.

use crate::isa::{Mnemonic, OperandKind, Real, duration};
use crate::resolve::instruction::{Filling, Source};
use crate::resolve::program::{Action, Value, Written};
use crate::source::span::{Located, Span};

/// A number that an instruction reads.
#[derive(Debug)]
pub(super) struct ReadValue<'a> {
    /// Its operand's name in the instruction table.
    pub operand: &'static str,
    /// Its place.
    pub span: Span,
    /// The number.
    pub value: &'a mut Value,
}

/// The numbers that an instruction reads, as mutable references.
pub(super) fn values_mut(action: &mut Action) -> Vec<ReadValue<'_>> {
    match action {
        Action::Counter { preset, counts: _, ct: _ }
        | Action::DelayTimer { preset, delay: _, t: _, output: _ }
        | Action::Timer { preset, timer: _, t: _ } => vec![read("preset", preset)],
        Action::Sensaphone { preset, counts: _, n: _ } => any("preset", preset).collect(),
        Action::UpDownCounter { up_preset, dn_preset, has_reset_leg: _, ct: _ } => {
            any("up-preset", up_preset).chain(any("dn-preset", dn_preset)).collect()
        }
        Action::Store { source, to: _ } => match source {
            Source::Value(a) => vec![read("a", a)],
            Source::Sum(a, b) | Source::Difference(a, b) => vec![read("a", a), read("b", b)],
        },
        Action::Fill { value: Located { value, span }, to: _ } => match value {
            Filling::Value(value) => vec![ReadValue { operand: "value", span: *span, value }],
            Filling::Bit(_) | Filling::Element(_) => Vec::new(),
        },
        Action::Entask { every, block: _ } => any("every", every).collect(),
        Action::Coil { .. }
        | Action::SetElement { .. }
        | Action::Reset { .. }
        | Action::Math { .. }
        | Action::Copy { .. }
        | Action::Shift { .. }
        | Action::Run { .. }
        | Action::Restart { .. }
        | Action::Halt { .. }
        | Action::Exit
        | Action::Jump { .. }
        | Action::StageOn { .. }
        | Action::StageOff { .. }
        | Action::Converge { .. }
        | Action::Stop => Vec::new(),
    }
}

fn read<'a>(operand: &'static str, of: &'a mut Located<Value>) -> ReadValue<'a> {
    ReadValue { operand, span: of.span, value: &mut of.value }
}

fn any<'a>(
    operand: &'static str,
    of: &'a mut Option<Located<Value>>,
) -> impl Iterator<Item = ReadValue<'a>> {
    of.iter_mut().map(move |of| read(operand, of))
}

/// The step from a constant to its neighbours, and the range of the neighbours.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConstantStep {
    /// The step; for a number of ms, the scan period.
    pub step: i32,
    /// The minimum constant at this place.
    pub least: i32,
    /// The maximum constant at this place.
    pub most: i32,
    /// Whether it is a number of ms.
    pub is_time: bool,
}

impl ConstantStep {
    /// The step for a count.
    pub fn count(least: i32, most: i32) -> ConstantStep {
        ConstantStep { step: 1, least, most, is_time: false }
    }

    /// The step for a duration.
    pub fn time(period_ms: u32, least: i32) -> ConstantStep {
        let step = i32::try_from(period_ms).unwrap_or(i32::MAX).max(1);
        ConstantStep { step, least, most: i32::MAX, is_time: true }
    }

    /// The step for an operand of an instruction. `to_bits`: FILL writes bits.
    pub fn of(
        (mnemonic, operand): (Mnemonic, &str),
        written: Option<Written>,
        period_ms: u32,
        to_bits: bool,
    ) -> Option<ConstantStep> {
        let time = |least| Some(ConstantStep::time(period_ms, least));
        match mnemonic.spec().operand(operand)?.kind {
            OperandKind::Value(least, most) => Some(ConstantStep::count(least, most)),
            OperandKind::Duration => time(0),
            // 0 and less mean every scan, as does every interval up to the period.
            OperandKind::Interval => time(1),
            OperandKind::Filling if to_bits => Some(ConstantStep::count(0, 1)),
            OperandKind::Number | OperandKind::Filling => match written {
                Some(Written::Duration) => time(0),
                Some(Written::Integer) | None => Some(ConstantStep::count(i32::MIN, i32::MAX)),
            },
            OperandKind::WritableBit
            | OperandKind::WritableWord
            | OperandKind::Target
            | OperandKind::Array
            | OperandKind::WritableArray
            | OperandKind::Shifted
            | OperandKind::Counter
            | OperandKind::Timer
            | OperandKind::Sensaphone
            | OperandKind::Program
            | OperandKind::Block
            | OperandKind::Task
            | OperandKind::Stage
            | OperandKind::Stages => None,
        }
    }

    /// The neighbours of a constant: the greater one, then the smaller one.
    pub fn neighbours(self, value: Value) -> Vec<(Direction, Value)> {
        match value {
            Value::Const(n, written) => {
                let both = [
                    (Direction::More, n.checked_add(self.step)),
                    (Direction::Less, n.checked_sub(self.step)),
                ];
                let fits = |n: &i32| (self.least..=self.most).contains(n);
                let both = both.into_iter().filter_map(|(to, n)| Some((to, n.filter(fits)?)));
                both.map(|(to, n)| (to, Value::Const(n, written))).collect()
            }
            Value::Real(real) => {
                near(real).into_iter().map(|(to, real)| (to, Value::Real(real))).collect()
            }
            Value::Word(_) | Value::Element(_) => Vec::new(),
        }
    }

    /// A constant as a text.
    pub fn text(self, value: Value) -> String {
        match value {
            Value::Const(n, _) if self.is_time && n >= 0 => duration::print(n),
            Value::Const(n, _) => n.to_string(),
            Value::Real(real) => real.to_string(),
            Value::Word(word) => word.to_string(),
            Value::Element(element) => element.to_string(),
        }
    }
}

/// The side of a constant on which its neighbour lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Direction {
    /// The neighbour is greater.
    More,
    /// The neighbour is smaller.
    Less,
}

/// The neighbours of a real: they differ by 1 % of it; for 0, they differ by 1.
pub(super) fn near(real: Real) -> Vec<(Direction, Real)> {
    let number = f64::from(real);
    let step = if number == 0.0 { 1.0 } else { number.abs() / 100.0 };
    let both = [(Direction::More, number + step), (Direction::Less, number - step)];
    let both = both.into_iter().map(|(to, number)| (to, Real::stored(number).real));
    both.filter(|(_, near)| *near != real).collect()
}
