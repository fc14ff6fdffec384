//! Operands of any type, and lists of them with their rows in the instruction table.
//!
//! The resolver makes the list of the checked operands; an instruction keeps it.

use super::array::{Array, ArrayElement, ShiftBits};
pub use super::value::{Filling, Value};
use crate::source::span::{Located, Span};
pub use rungd_engine::isa::{Bit, BlockId, OperandSpec, StageId, Structure, Word};

/// The word or bit that MATH stores in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FormulaTarget {
    /// A word.
    Word(Word),
    /// A bit.
    Bit(Bit),
    /// An element of this array; the MATH has an index.
    Array(Array),
}

impl FormulaTarget {
    /// Whether it contains a real.
    pub fn is_real(self) -> bool {
        match self {
            FormulaTarget::Word(word) => word.is_real(),
            FormulaTarget::Bit(_) => false,
            FormulaTarget::Array(array) => array.is_real(),
        }
    }

    /// Whether it is a bit.
    pub fn is_bit(self) -> bool {
        match self {
            FormulaTarget::Word(_) => false,
            FormulaTarget::Bit(_) => true,
            FormulaTarget::Array(array) => array.is_bits(),
        }
    }
}

/// The word that MOVE, ADD and SUB store in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum WordPlace {
    Word(Word),
    Element(ArrayElement),
}

/// The bit or word that a COPY of a record stores a field in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum CopiedPlace {
    Bit(Bit),
    Word(Word),
    Element(ArrayElement),
}

impl CopiedPlace {
    /// The same place as an operand that is read.
    pub(crate) fn read(self) -> Filling {
        match self {
            CopiedPlace::Bit(bit) => Filling::Bit(bit),
            CopiedPlace::Word(word) => Filling::Value(Value::Word(word)),
            CopiedPlace::Element(element) if element.array.is_bits() => Filling::Element(element),
            CopiedPlace::Element(element) => Filling::Value(Value::Element(element)),
        }
    }

    /// The element that a word selects, if it is one.
    pub(crate) fn element(self) -> Option<ArrayElement> {
        match self {
            CopiedPlace::Element(element) => Some(element),
            CopiedPlace::Bit(_) | CopiedPlace::Word(_) => None,
        }
    }
}

/// A field that a COPY of a record copies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldCopy {
    /// What is read.
    pub from: Filling,
    /// Where it is stored.
    pub to: CopiedPlace,
}

/// An operand of any type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum OperandValue {
    Bit(Bit),
    Word(Word),
    Value(Value),
    Structure(Structure),
    Block(BlockId),
    Stage(StageId),
    /// A bit or word of an array, selected by a word.
    Element(ArrayElement),
    /// A whole array.
    Array(Array),
    /// The bits that SR shifts.
    Run(ShiftBits),
}

/// A type of operand.
pub trait OperandType: Copy {
    /// The operand, if it is of this type.
    fn of(operand: OperandValue) -> Option<Self>;
    /// Converts it to an operand of any type.
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

/// For enums of several kinds of operand. Their variants have the same names as in `OperandValue`.
macro_rules! choices_of_operands {
    ($($choice:ident: $($variant:ident)*;)*) => {$(
        impl OperandType for $choice {
            fn of(operand: OperandValue) -> Option<Self> {
                $(if let OperandValue::$variant(of) = operand {
                    return Some($choice::$variant(of));
                })*
                None
            }

            fn operand(self) -> OperandValue {
                match self {
                    $($choice::$variant(of) => OperandValue::$variant(of),)*
                }
            }
        }
    )*};
}

choices_of_operands! {
    FormulaTarget: Bit Word Array;
    WordPlace: Word Element;
    CopiedPlace: Bit Word Element;
    Filling: Value Bit Element;
}

operand_types! {
    Bit Bit;
    Word Word;
    Value Value;
    Structure Structure;
    Block BlockId;
    Stage StageId;
    Element ArrayElement;
    Array Array;
    Run ShiftBits;
}

/// An operand of an instruction.
#[derive(Clone, Copy, Debug)]
pub struct ResolvedOperand {
    /// Its row in the instruction table.
    pub row: &'static OperandSpec,
    /// The operand.
    pub value: OperandValue,
    /// Its place.
    pub span: Span,
}

impl ResolvedOperand {
    /// The operand, if it is of this type.
    pub fn located<T: OperandType>(&self) -> Option<Located<T>> {
        Some(Located { value: T::of(self.value)?, span: self.span })
    }
}

/// The operands of an instruction.
#[derive(Clone, Debug, Default)]
pub struct OperandList(pub Vec<ResolvedOperand>);

impl OperandList {
    /// All operands with their names in the table.
    pub fn each(&self) -> impl Iterator<Item = (&'static str, OperandValue)> {
        self.0.iter().map(|operand| (operand.row.name, operand.value))
    }

    /// The operands of one type.
    pub fn of<T: OperandType>(&self) -> impl Iterator<Item = (&'static str, Located<T>)> {
        self.0.iter().filter_map(|operand| Some((operand.row.name, operand.located()?)))
    }

    /// The operand with a name, if it is of this type.
    pub fn get<T: OperandType>(&self, name: &str) -> Option<Located<T>> {
        self.of().find(|(key, _)| *key == name).map(|(_, operand)| operand)
    }

    /// The value of an operand that the table requires.
    pub fn required<T: OperandType>(&self, name: &str) -> T {
        self.get(name).expect("the resolver gives every operand that the table requires").value
    }
}
