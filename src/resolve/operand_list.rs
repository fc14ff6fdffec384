//! Operands of any type, and lists of them by their names in the instruction table.
//!
//! The resolver makes a list of what it has checked, and `instruction` makes an action of it, and a
//! list of an action again, for questions that apply to every action.

pub(crate) use super::value::Value;
use crate::isa::{Bit, BlockId, StageId, Structure, Word};
use crate::source::span::Located;

/// The word or bit that MATH stores in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub(crate) enum Target {
    Word(Word),
    Bit(Bit),
}

/// An operand of any type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub(crate) enum OperandValue {
    Bit(Bit),
    Word(Word),
    Value(Value),
    Structure(Structure),
    Block(BlockId),
    Stage(StageId),
}

/// A type of operand.
pub(crate) trait OperandType: Copy {
    /// The operand, if it is of this type.
    fn of(operand: OperandValue) -> Option<Self>;
    /// As an operand of any type.
    fn operand(self) -> OperandValue;
}

macro_rules! operand_types {
    ($($variant:ident $type:ty;)*) => {$(
        impl OperandType for $type {
            fn of(operand: OperandValue) -> Option<Self> {
                if let OperandValue::$variant(of) = operand { Some(of) } else { None }
            }

            fn operand(self) -> OperandValue {
                OperandValue::$variant(self)
            }
        }
    )*};
}

impl OperandType for Target {
    fn of(operand: OperandValue) -> Option<Target> {
        match operand {
            OperandValue::Bit(bit) => Some(Target::Bit(bit)),
            OperandValue::Word(word) => Some(Target::Word(word)),
            OperandValue::Value(_)
            | OperandValue::Structure(_)
            | OperandValue::Block(_)
            | OperandValue::Stage(_) => None,
        }
    }

    fn operand(self) -> OperandValue {
        match self {
            Target::Bit(bit) => OperandValue::Bit(bit),
            Target::Word(word) => OperandValue::Word(word),
        }
    }
}

operand_types! {
    Bit Bit;
    Word Word;
    Value Value;
    Structure Structure;
    Block BlockId;
    Stage StageId;
}

/// Operands with their names in the instruction table.
#[derive(Clone, Debug, Default)]
pub(crate) struct OperandList(pub(super) Vec<(&'static str, Located<OperandValue>)>);

impl OperandList {
    pub(super) fn with<T: OperandType>(
        mut self,
        name: &'static str,
        operand: Located<T>,
    ) -> OperandList {
        self.0.push((name, Located { value: operand.value.operand(), span: operand.span }));
        self
    }

    pub(super) fn with_any<T: OperandType>(
        self,
        name: &'static str,
        operands: impl IntoIterator<Item = Located<T>>,
    ) -> OperandList {
        operands.into_iter().fold(self, |all, operand| all.with(name, operand))
    }

    /// All operands.
    pub fn each(&self) -> impl Iterator<Item = (&'static str, OperandValue)> {
        self.0.iter().map(|(name, operand)| (*name, operand.value))
    }

    /// The operands of one type.
    pub fn of<T: OperandType>(&self) -> impl Iterator<Item = (&'static str, Located<T>)> {
        self.0.iter().filter_map(|(name, operand)| {
            Some((*name, Located { value: T::of(operand.value)?, span: operand.span }))
        })
    }

    pub(super) fn named<T: OperandType>(&self, name: &str) -> impl Iterator<Item = Located<T>> {
        self.of().filter(move |(of, _)| *of == name).map(|(_, operand)| operand)
    }

    pub(super) fn get<T: OperandType>(&self, name: &str) -> Option<Located<T>> {
        self.named(name).next()
    }
}
