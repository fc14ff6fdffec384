//! MOVE, ADD and SUB as operations: of words, of integers and reals, and of elements of arrays.
//!
//! Called by `instructions`.

use super::assembler::Assembler;
use crate::resolve::formula::{Binary, Formula, FormulaPart, NumberType};
use crate::resolve::instruction::{Value, WordPlace};
use crate::resolve::program::ConstantForm;
pub use rungd_engine::ops::{
    Add, AddMixed, AnyTarget, LegPowers, MathReports, Move, Op, Sub, SubMixed, WordTarget,
    WordWritten,
};

/// The number that MOVE, ADD and SUB store.
#[derive(Clone, Copy)]
pub(super) enum Source {
    Value(Value),
    Sum(Value, Value),
    Difference(Value, Value),
}

impl Source {
    /// Its numbers: one for MOVE, two for ADD and SUB.
    fn values(self) -> impl Iterator<Item = Value> {
        let (a, b) = match self {
            Source::Value(a) => (a, None),
            Source::Sum(a, b) | Source::Difference(a, b) => (a, Some(b)),
        };
        std::iter::once(a).chain(b)
    }
}

impl Assembler<'_> {
    /// Lowers a MOVE, an ADD or a SUB.
    pub fn store(&mut self, source: Source, to: WordPlace, leg: LegPowers) -> Op {
        let is_element = |value: Value| matches!(value, Value::Element(_));
        let to = match to {
            WordPlace::Word(word) if !source.values().any(is_element) => word,
            WordPlace::Word(_) | WordPlace::Element(_) => {
                return self.store_elements(source, to, leg);
            }
        };
        let (min, max) = self.limits(to);
        let real = to.is_real();
        let to = WordTarget { word: WordWritten(self.layout.word(to).0), min, max };
        // A MOVE from a real to a real copies the cell; a sum of reals is never a sum of cells.
        let mixed = match source {
            Source::Value(a) => a.is_real() != real,
            Source::Sum(..) | Source::Difference(..) => {
                real || source.values().any(|value| value.is_real())
            }
        };
        if mixed {
            return self.store_mixed(source, AnyTarget { target: to, real }, leg);
        }
        let mut cell = |value: Value| self.value(value);
        match source {
            Source::Value(a) => Op::Move(Move { leg, a: cell(a), to }),
            Source::Sum(a, b) => Op::Add(Add { leg, a: cell(a), b: cell(b), to }),
            Source::Difference(a, b) => Op::Sub(Sub { leg, a: cell(a), b: cell(b), to }),
        }
    }

    /// MOVE, ADD and SUB with integers and reals.
    fn store_mixed(&mut self, source: Source, to: AnyTarget, leg: LegPowers) -> Op {
        const NONE: Value = Value::Const(0, ConstantForm::Integer);
        let mut any = |value: Value| self.any(value);
        match source {
            Source::Value(a) => Op::AddMixed(AddMixed { leg, a: any(a), b: self.any(NONE), to }),
            Source::Sum(a, b) => Op::AddMixed(AddMixed { leg, a: any(a), b: any(b), to }),
            Source::Difference(a, b) => Op::SubMixed(SubMixed { leg, a: any(a), b: any(b), to }),
        }
    }

    /// MOVE, ADD and SUB with an element among their operands or as their target.
    fn store_elements(&mut self, source: Source, to: WordPlace, leg: LegPowers) -> Op {
        let mut parts = Vec::new();
        let mut number_type = NumberType::Integer;
        for value in source.values() {
            let real = value.is_real();
            number_type =
                number_type.with(if real { NumberType::Real } else { NumberType::Integer });
            parts.extend(value.formula().parts);
        }
        match source {
            Source::Value(_) => {}
            Source::Sum(..) => parts.push(FormulaPart::Binary(Binary::Add, number_type)),
            Source::Difference(..) => {
                parts.push(FormulaPart::Binary(Binary::Subtract, number_type))
            }
        }
        let put = match to {
            WordPlace::Word(word) => self.put_in_word(word),
            WordPlace::Element(element) => {
                let index = self.layout.word(element.index).0;
                self.put_at(element.array, index)
            }
        };
        Op::Math(self.formula_into(put, &Formula { parts }, leg, MathReports::IndexError))
    }
}
