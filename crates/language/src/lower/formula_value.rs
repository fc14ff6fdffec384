//! The value of an expression on an image, computed part by part.
//!
//! For the conditions of tests, and for the sides of a compare that are shown to people; a scan
//! executes the steps that `formula` makes. Both compute with the engine's operators. No status bit
//! is written, and memory is not changed.

use crate::resolve::array::Array;
use crate::resolve::formula::{Binary, Formula, FormulaPart, NumberType, Unary};
use rungd_engine::isa::{Function, Real, Word};
pub use rungd_engine::{BitCell, Cell, Image, Layout, Mishaps, WordBitCell, WordCell};
pub use rungd_engine::{integer, real};

/// An expression over cells.
#[derive(Clone, Debug)]
pub struct CellFormula {
    parts: Box<[CellPart]>,
    /// The greatest number of operands that wait at once.
    depth: usize,
}

/// A part of an expression over cells.
#[derive(Clone, Copy, Debug)]
enum CellPart {
    Constant(FormulaNumber),
    Word(WordCell),
    RealWord(WordCell),
    Bit(Cell),
    /// The element of an array that the last operand selects.
    Element(ArrayCells),
    Unary(Unary),
    Binary(Binary, NumberType),
    Call(Function, u32, NumberType),
}

/// The cells of an array.
#[derive(Clone, Copy, Debug)]
pub struct ArrayCells {
    /// The cell of element 0.
    first: Cell,
    is_real: bool,
    count: u32,
    /// The distance from one element to the next.
    stride: u32,
}

/// A number of an expression.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FormulaNumber {
    /// 64 bits with sign.
    Integer(i64),
    /// Binary64.
    Real(f64),
}

/// The value of an expression.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FormulaValue {
    /// The number.
    pub number: FormulaNumber,
    /// Whether it was computed from an element outside of its array, which reads 0.
    pub is_outside: bool,
}

/// The number of operands for which an evaluation allocates nothing.
const DEPTH_FIXED: usize = 32;

impl ArrayCells {
    /// The cells of an array of bits or words.
    pub fn new(array: Array, layout: &Layout) -> ArrayCells {
        let first = layout.cell(array.element(0)).expect("an array is of bits or words");
        let stride = layout.stride(array.element(0));
        ArrayCells { first, is_real: array.is_real(), count: array.count, stride }
    }

    /// The cell of an element; `None`: the index is outside of the array.
    pub fn cell(&self, index: i64) -> Option<Cell> {
        let at = u32::try_from(index).ok().filter(|at| *at < self.count)?;
        Some(match self.first {
            Cell::Bit(BitCell(first)) => Cell::Bit(BitCell(first + at * self.stride)),
            Cell::Word(WordCell(first)) => Cell::Word(WordCell(first + at * self.stride)),
            Cell::WordBit(bit) => {
                Cell::WordBit(WordBitCell { word: WordCell(bit.word.0 + at), ..bit })
            }
        })
    }

    fn value(&self, index: FormulaValue, image: &Image) -> FormulaValue {
        let number = match self.cell(index.number.integer()) {
            Some(cell @ (Cell::Bit(_) | Cell::WordBit(_))) => {
                FormulaNumber::Integer(image.value(cell).into())
            }
            Some(Cell::Word(cell)) if self.is_real => real_word(image, cell),
            Some(Cell::Word(cell)) => FormulaNumber::Integer(image.word(cell).into()),
            None if self.is_real => FormulaNumber::Real(0.0),
            None => FormulaNumber::Integer(0),
        };
        let is_outside = index.is_outside || self.cell(index.number.integer()).is_none();
        FormulaValue { number, is_outside }
    }
}

fn real_word(image: &Image, cell: WordCell) -> FormulaNumber {
    FormulaNumber::Real(Real::of_cell(image.word(cell)).into())
}

impl FormulaNumber {
    /// As an integer: a real is truncated towards zero.
    pub fn integer(self) -> i64 {
        match self {
            FormulaNumber::Integer(number) => number,
            FormulaNumber::Real(number) => number as i64,
        }
    }

    fn real(self) -> f64 {
        match self {
            FormulaNumber::Integer(number) => number as f64,
            FormulaNumber::Real(number) => number,
        }
    }

    /// Whether it is not 0.
    pub fn is_true(self) -> bool {
        match self {
            FormulaNumber::Integer(number) => number != 0,
            FormulaNumber::Real(number) => number != 0.0,
        }
    }
}

impl std::fmt::Display for FormulaNumber {
    /// As decimal digits; a real with the fewest digits that name the same binary64.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            FormulaNumber::Integer(number) => write!(f, "{number}"),
            FormulaNumber::Real(number) => write!(f, "{number:?}"),
        }
    }
}

impl FormulaValue {
    fn new(number: FormulaNumber) -> FormulaValue {
        FormulaValue { number, is_outside: false }
    }
}

impl CellFormula {
    /// An expression with the cells of its names.
    pub fn new(formula: &Formula, layout: &Layout) -> CellFormula {
        let word = |word: Word| match word.is_real() {
            true => CellPart::RealWord(layout.word(word)),
            false => CellPart::Word(layout.word(word)),
        };
        let parts = formula.parts.iter().map(|part| match *part {
            FormulaPart::Integer(n) => CellPart::Constant(FormulaNumber::Integer(n.number)),
            FormulaPart::Real(real) => CellPart::Constant(FormulaNumber::Real(real.into())),
            FormulaPart::Word(place) => word(place),
            FormulaPart::Bit(bit) => CellPart::Bit(layout.bit_in(bit)),
            FormulaPart::Element(array) => CellPart::Element(ArrayCells::new(array, layout)),
            FormulaPart::Unary(operator, _) => CellPart::Unary(operator),
            FormulaPart::Binary(operator, number_type) => CellPart::Binary(operator, number_type),
            FormulaPart::Call(function, count, number_type) => {
                CellPart::Call(function, count, number_type)
            }
        });
        let parts: Box<[CellPart]> = parts.collect();
        let (mut waiting, mut depth) = (0, 0);
        for part in &parts {
            waiting += 1;
            waiting -= part.operand_count();
            depth = depth.max(waiting);
        }
        CellFormula { parts, depth }
    }

    /// The cells that it reads; of an element, those of its index.
    pub fn cells(&self) -> impl Iterator<Item = Cell> {
        self.parts.iter().filter_map(|part| match part {
            CellPart::Word(cell) | CellPart::RealWord(cell) => Some(Cell::Word(*cell)),
            CellPart::Bit(cell) => Some(*cell),
            CellPart::Constant(_)
            | CellPart::Element(_)
            | CellPart::Unary(_)
            | CellPart::Binary(..)
            | CellPart::Call(..) => None,
        })
    }

    /// Whether it reads an element of an array.
    pub fn has_elements(&self) -> bool {
        self.parts.iter().any(|part| matches!(part, CellPart::Element(_)))
    }

    /// Its value on an image. Allocates nothing unless more than 32 operands wait at once.
    pub fn value(&self, image: &Image) -> FormulaValue {
        let none = FormulaValue::new(FormulaNumber::Integer(0));
        let mut fixed = [none; DEPTH_FIXED];
        let mut large;
        let stack: &mut [FormulaValue] = if self.depth <= DEPTH_FIXED {
            &mut fixed
        } else {
            large = vec![none; self.depth];
            &mut large
        };
        let mut count = 0;
        for part in &self.parts {
            let first = count - part.operand_count();
            let value = part.value(&stack[first..count], image);
            stack[first] = value;
            count = first + 1;
        }
        stack[0]
    }
}

impl CellPart {
    /// The number of operands that it takes.
    fn operand_count(&self) -> usize {
        match self {
            CellPart::Constant(_)
            | CellPart::Word(_)
            | CellPart::RealWord(_)
            | CellPart::Bit(_) => 0,
            CellPart::Element(_) | CellPart::Unary(_) => 1,
            CellPart::Binary(..) => 2,
            CellPart::Call(_, count, _) => *count as usize,
        }
    }

    fn value(&self, operands: &[FormulaValue], image: &Image) -> FormulaValue {
        let number = match *self {
            CellPart::Constant(number) => number,
            CellPart::Word(cell) => FormulaNumber::Integer(image.word(cell).into()),
            CellPart::RealWord(cell) => real_word(image, cell),
            CellPart::Bit(cell) => FormulaNumber::Integer(image.value(cell).into()),
            CellPart::Element(array) => return array.value(operands[0], image),
            CellPart::Unary(operator) => unary(operator, operands[0].number),
            CellPart::Binary(operator, number_type) => {
                binary(operator, number_type, operands[0].number, operands[1].number)
            }
            CellPart::Call(Function::If, _, number_type) => {
                let taken = if operands[0].number.is_true() { operands[1] } else { operands[2] };
                let number = typed(taken.number, number_type);
                let is_outside = operands[0].is_outside || taken.is_outside;
                return FormulaValue { number, is_outside };
            }
            CellPart::Call(function, _, number_type) => called(function, number_type, operands),
        };
        FormulaValue { number, is_outside: operands.iter().any(|operand| operand.is_outside) }
    }
}

/// A number in the type of an operator.
fn typed(number: FormulaNumber, number_type: NumberType) -> FormulaNumber {
    match number_type {
        NumberType::Integer => FormulaNumber::Integer(number.integer()),
        NumberType::Real => FormulaNumber::Real(number.real()),
    }
}

fn unary(operator: Unary, number: FormulaNumber) -> FormulaNumber {
    let mut unused = Mishaps::default();
    match (operator, number) {
        (Unary::Minus, FormulaNumber::Integer(n)) => {
            FormulaNumber::Integer(integer::neg(n, &mut unused))
        }
        (Unary::Minus, FormulaNumber::Real(n)) => FormulaNumber::Real(real::neg(n, &mut unused)),
        (Unary::Complement, _) => {
            FormulaNumber::Integer(integer::complement(number.integer(), &mut unused))
        }
        (Unary::Not, _) => FormulaNumber::Integer(i64::from(!number.is_true())),
    }
}

/// The operator of integers, or of reals, with this sign.
fn binary(
    operator: Binary,
    number_type: NumberType,
    a: FormulaNumber,
    b: FormulaNumber,
) -> FormulaNumber {
    let mut unused = Mishaps::default();
    let is_swapped = matches!(operator, Binary::Greater | Binary::AtLeast);
    let (a, b) = if is_swapped { (b, a) } else { (a, b) };
    if number_type == NumberType::Real {
        let (a, b) = (a.real(), b.real());
        let compare = match operator {
            Binary::Power => return FormulaNumber::Real(real::pow(a, b, &mut unused)),
            Binary::Multiply => return FormulaNumber::Real(real::mul(a, b, &mut unused)),
            Binary::Divide => return FormulaNumber::Real(real::div(a, b, &mut unused)),
            Binary::Remainder => return FormulaNumber::Real(real::rem(a, b, &mut unused)),
            Binary::Add => return FormulaNumber::Real(real::add(a, b, &mut unused)),
            Binary::Subtract => return FormulaNumber::Real(real::sub(a, b, &mut unused)),
            Binary::Less | Binary::Greater => a < b,
            Binary::AtMost | Binary::AtLeast => a <= b,
            Binary::Equal => a == b,
            Binary::NotEqual => a != b,
            Binary::AndAlso => a != 0.0 && b != 0.0,
            Binary::OrElse => a != 0.0 || b != 0.0,
            Binary::ShiftLeft
            | Binary::ShiftRightZeros
            | Binary::ShiftRight
            | Binary::And
            | Binary::Xor
            | Binary::Or => unreachable!("the resolver refuses reals here"),
        };
        return FormulaNumber::Integer(i64::from(compare));
    }
    let (a, b) = match matches!(operator, Binary::AndAlso | Binary::OrElse) {
        // Their operands keep their own types.
        true => (i64::from(a.is_true()), i64::from(b.is_true())),
        false => (a.integer(), b.integer()),
    };
    FormulaNumber::Integer(match operator {
        Binary::Power => integer::pow(a, b, &mut unused),
        Binary::Multiply => integer::mul(a, b, &mut unused),
        Binary::Divide => integer::div(a, b, &mut unused),
        Binary::Remainder => integer::rem(a, b, &mut unused),
        Binary::Add => integer::add(a, b, &mut unused),
        Binary::Subtract => integer::sub(a, b, &mut unused),
        Binary::ShiftLeft => integer::shift_left(a, b, &mut unused),
        Binary::ShiftRight => integer::shift_right(a, b, &mut unused),
        Binary::ShiftRightZeros => integer::shift_right_zeros(a, b, &mut unused),
        Binary::And => integer::and(a, b, &mut unused),
        Binary::Xor => integer::xor(a, b, &mut unused),
        Binary::Or => integer::or(a, b, &mut unused),
        Binary::Less | Binary::Greater => i64::from(a < b),
        Binary::AtMost | Binary::AtLeast => i64::from(a <= b),
        Binary::Equal => i64::from(a == b),
        Binary::NotEqual => i64::from(a != b),
        Binary::AndAlso => a & b,
        Binary::OrElse => a | b,
    })
}

/// The result of a function other than `if`.
fn called(
    function: Function,
    number_type: NumberType,
    arguments: &[FormulaValue],
) -> FormulaNumber {
    let mut unused = Mishaps::default();
    let argument = |at: usize| typed(arguments[at].number, number_type);
    let first = argument(0);
    let fold = |integers: fn(i64, i64, &mut Mishaps) -> i64,
                reals: fn(f64, f64, &mut Mishaps) -> f64| {
        (1..arguments.len()).fold(first, |a, at| two(a, argument(at), integers, reals))
    };
    let whole = |round: fn(f64, &mut Mishaps) -> i64| {
        let mut unused = Mishaps::default();
        match number_type {
            NumberType::Integer => first,
            NumberType::Real => FormulaNumber::Integer(round(first.real(), &mut unused)),
        }
    };
    let x = first.real();
    match function {
        Function::Abs => match first {
            FormulaNumber::Integer(n) => FormulaNumber::Integer(integer::abs(n, &mut unused)),
            FormulaNumber::Real(n) => FormulaNumber::Real(real::abs(n, &mut unused)),
        },
        Function::Min => fold(integer::min, real::min),
        Function::Max => fold(integer::max, real::max),
        Function::Sum => fold(integer::add, real::add),
        Function::Clamp => {
            let below = two(first, argument(2), integer::min, real::min);
            two(below, argument(1), integer::max, real::max)
        }
        Function::Round => whole(real::round),
        Function::Floor => whole(real::floor),
        Function::Ceil => whole(real::ceil),
        Function::Trunc => whole(real::trunc),
        Function::Toreal => FormulaNumber::Real(x),
        Function::Sqrt => FormulaNumber::Real(real::sqrt(x, &mut unused)),
        Function::Exp => FormulaNumber::Real(real::exp(x, &mut unused)),
        Function::Ln => FormulaNumber::Real(real::log(x, &mut unused)),
        Function::Log10 => FormulaNumber::Real(real::log10(x, &mut unused)),
        Function::Sin => FormulaNumber::Real(real::sin(x, &mut unused)),
        Function::Cos => FormulaNumber::Real(real::cos(x, &mut unused)),
        Function::Tan => FormulaNumber::Real(real::tan(x, &mut unused)),
        Function::Asin => FormulaNumber::Real(real::asin(x, &mut unused)),
        Function::Acos => FormulaNumber::Real(real::acos(x, &mut unused)),
        Function::Atan => FormulaNumber::Real(real::atan(x, &mut unused)),
        Function::Atan2 => FormulaNumber::Real(real::atan2(x, argument(1).real(), &mut unused)),
        Function::Scale => FormulaNumber::Real(scale(arguments)),
        Function::If => unreachable!("its caller evaluates it"),
    }
}

/// An operation on two numbers of one type.
fn two(
    a: FormulaNumber,
    b: FormulaNumber,
    integers: fn(i64, i64, &mut Mishaps) -> i64,
    reals: fn(f64, f64, &mut Mishaps) -> f64,
) -> FormulaNumber {
    let mut unused = Mishaps::default();
    match (a, b) {
        (FormulaNumber::Integer(a), FormulaNumber::Integer(b)) => {
            FormulaNumber::Integer(integers(a, b, &mut unused))
        }
        (FormulaNumber::Integer(_) | FormulaNumber::Real(_), _) => {
            FormulaNumber::Real(reals(a.real(), b.real(), &mut unused))
        }
    }
}

/// `out_lo + (x - in_lo) * (out_hi - out_lo) / (in_hi - in_lo)`, by the steps of the operators.
fn scale(arguments: &[FormulaValue]) -> f64 {
    let mut unused = Mishaps::default();
    let [x, in_lo, in_hi, out_lo, out_hi] = [0, 1, 2, 3, 4].map(|at| arguments[at].number.real());
    let above = real::sub(x, in_lo, &mut unused);
    let product = real::mul(above, real::sub(out_hi, out_lo, &mut unused), &mut unused);
    let quotient = real::div(product, real::sub(in_hi, in_lo, &mut unused), &mut unused);
    real::add(out_lo, quotient, &mut unused)
}
