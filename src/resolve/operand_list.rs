//! Operands of any type, and lists of them by their names in the instruction table.
//!
//! The resolver makes a list of what it has checked, and `instruction` makes an action of it, and a
//! list of an action again, for questions that apply to every action.

use super::array::{Array, Element, Run};
pub(crate) use super::value::{Filling, Value};
use crate::isa::{Bit, BlockId, StageId, Structure, Word};
use crate::source::span::Located;

/// The word or bit that MATH stores in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// A word.
    Word(Word),
    /// A bit.
    Bit(Bit),
    /// An element of this array; the MATH has an index.
    Array(Array),
}

impl Target {
    /// Whether it holds a real.
    pub fn is_real(self) -> bool {
        match self {
            Target::Word(word) => word.is_real(),
            Target::Bit(_) => false,
            Target::Array(array) => array.is_real(),
        }
    }

    /// Whether it is a bit.
    pub fn is_bit(self) -> bool {
        match self {
            Target::Word(_) => false,
            Target::Bit(_) => true,
            Target::Array(array) => array.is_bits(),
        }
    }
}

/// The word that MOVE, ADD and SUB store in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub(crate) enum Place {
    Word(Word),
    Element(Element),
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
    /// An element that a word selects, of bits or words.
    Element(Element),
    /// A whole array.
    Array(Array),
    /// The bits that SR shifts.
    Run(Run),
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
            OperandValue::Array(array) => Some(Target::Array(array)),
            OperandValue::Value(_)
            | OperandValue::Structure(_)
            | OperandValue::Block(_)
            | OperandValue::Stage(_)
            | OperandValue::Element(_)
            | OperandValue::Run(_) => None,
        }
    }

    fn operand(self) -> OperandValue {
        match self {
            Target::Bit(bit) => OperandValue::Bit(bit),
            Target::Word(word) => OperandValue::Word(word),
            Target::Array(array) => OperandValue::Array(array),
        }
    }
}

impl OperandType for Place {
    fn of(operand: OperandValue) -> Option<Place> {
        match operand {
            OperandValue::Word(word) => Some(Place::Word(word)),
            OperandValue::Element(element) => Some(Place::Element(element)),
            OperandValue::Bit(_)
            | OperandValue::Value(_)
            | OperandValue::Structure(_)
            | OperandValue::Block(_)
            | OperandValue::Stage(_)
            | OperandValue::Array(_)
            | OperandValue::Run(_) => None,
        }
    }

    fn operand(self) -> OperandValue {
        match self {
            Place::Word(word) => OperandValue::Word(word),
            Place::Element(element) => OperandValue::Element(element),
        }
    }
}

impl OperandType for Filling {
    fn of(operand: OperandValue) -> Option<Filling> {
        match operand {
            OperandValue::Value(value) => Some(Filling::Value(value)),
            OperandValue::Bit(bit) => Some(Filling::Bit(bit)),
            OperandValue::Element(element) => Some(Filling::Element(element)),
            OperandValue::Word(_)
            | OperandValue::Structure(_)
            | OperandValue::Block(_)
            | OperandValue::Stage(_)
            | OperandValue::Array(_)
            | OperandValue::Run(_) => None,
        }
    }

    fn operand(self) -> OperandValue {
        match self {
            Filling::Value(value) => OperandValue::Value(value),
            Filling::Bit(bit) => OperandValue::Bit(bit),
            Filling::Element(element) => OperandValue::Element(element),
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
    Element Element;
    Array Array;
    Run Run;
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
