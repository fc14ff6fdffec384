//! A side of a compare in a condition: a constant, a bit, a word, an element, or a sum of these.
//!
//! The arithmetic is that of MATH (`docs/semantics.md`, section 8): integers of 64 bits that stay
//! at their limits, reals in binary64; one real operand makes an operator real. No status bit is
//! written.

use rungd_engine::isa::{Bit, Real, Word};
pub use rungd_engine::{BitCell, Cell, Image, Layout, Mishaps, WordCell, integer, real};
use rungd_language::resolve::array::ArrayElement;
pub use rungd_language::resolve::condition::SumTerm;
use rungd_language::resolve::program::Value;
pub use rungd_language::source::contact::Comparison;
pub use rungd_language::source::contact_sum::SumSign;

/// The maximum number of operands that wait in a sum: three for each of 32 parentheses, and three
/// outside of them.
const WAITING_MAX: usize = 104;

/// A number of a compare.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SumNumber {
    Integer(i64),
    Real(f64),
}

/// A number that is read from an image.
#[derive(Clone, Debug)]
pub(super) enum Quantity {
    Constant(SumNumber),
    Word(WordCell),
    RealWord(WordCell),
    Bit(BitCell),
    Element(ElementCells),
    /// A sum: its steps in postfix order.
    Sum(Box<[SumStep]>),
}

/// A step of a sum.
#[derive(Clone, Debug)]
pub(super) enum SumStep {
    /// Reads an operand, which is never a sum.
    Read(Quantity),
    /// Computes a result from the last two operands.
    Compute(SumSign),
}

/// An element of an array that a word selects.
#[derive(Clone, Copy, Debug)]
pub(super) struct ElementCells {
    /// The cell of element 0.
    first: Cell,
    is_real: bool,
    count: u32,
    /// The word that contains the number of the element.
    pub index: WordCell,
}

impl ElementCells {
    pub fn of(element: ArrayElement, layout: &Layout) -> ElementCells {
        let first = layout.cell(element.array.element(0)).expect("an array is of bits or words");
        let (is_real, count) = (element.array.is_real(), element.array.count);
        ElementCells { first, is_real, count, index: layout.word(element.index) }
    }

    /// The cell of the currently selected element; `None`: the index is outside of the array.
    pub fn cell(&self, image: &Image) -> Option<Cell> {
        let at = u32::try_from(image.word(self.index)).ok().filter(|at| *at < self.count)?;
        Some(match self.first {
            Cell::Bit(BitCell(first)) => Cell::Bit(BitCell(first + at)),
            Cell::Word(WordCell(first)) => Cell::Word(WordCell(first + at)),
        })
    }
}

impl Quantity {
    /// The quantity of a sum in postfix order.
    pub fn of(terms: &[SumTerm], layout: &Layout) -> Quantity {
        match terms {
            [SumTerm::Value(value)] => Quantity::of_value(*value, layout),
            _ => Quantity::Sum(terms.iter().map(|term| SumStep::of(*term, layout)).collect()),
        }
    }

    fn of_value(value: Value, layout: &Layout) -> Quantity {
        match value {
            Value::Const(number, _) => Quantity::Constant(SumNumber::Integer(number.into())),
            Value::Real(real) => Quantity::Constant(SumNumber::Real(real.into())),
            Value::Word(word) => Quantity::of_word(word, layout),
            Value::Element(element) => Quantity::Element(ElementCells::of(element, layout)),
        }
    }

    fn of_word(word: Word, layout: &Layout) -> Quantity {
        let cell = layout.word(word);
        if word.is_real() { Quantity::RealWord(cell) } else { Quantity::Word(cell) }
    }

    fn of_bit(bit: Bit, layout: &Layout) -> Quantity {
        Quantity::Bit(layout.bit(bit))
    }

    /// The cells that it reads; for an element, the cell of its index.
    pub fn cells(&self, into: &mut Vec<Cell>) {
        match self {
            Quantity::Constant(_) => {}
            Quantity::Word(cell) | Quantity::RealWord(cell) => into.push(Cell::Word(*cell)),
            Quantity::Bit(cell) => into.push(Cell::Bit(*cell)),
            Quantity::Element(element) => into.push(Cell::Word(element.index)),
            Quantity::Sum(steps) => steps.iter().for_each(|step| match step {
                SumStep::Read(of) => of.cells(into),
                SumStep::Compute(_) => {}
            }),
        }
    }

    /// Its number on an image; `None` if it reads an element outside of an array.
    pub fn number(&self, image: &Image) -> Option<SumNumber> {
        Some(match self {
            Quantity::Constant(number) => *number,
            Quantity::Word(cell) => SumNumber::Integer(image.word(*cell).into()),
            Quantity::RealWord(cell) => SumNumber::Real(Real::of_cell(image.word(*cell)).into()),
            Quantity::Bit(cell) => SumNumber::Integer(image.bit(*cell).into()),
            Quantity::Element(element) => match element.cell(image)? {
                Cell::Bit(cell) => SumNumber::Integer(image.bit(cell).into()),
                Cell::Word(cell) if element.is_real => {
                    SumNumber::Real(Real::of_cell(image.word(cell)).into())
                }
                Cell::Word(cell) => SumNumber::Integer(image.word(cell).into()),
            },
            Quantity::Sum(steps) => return sum(steps, image),
        })
    }
}

impl SumStep {
    fn of(term: SumTerm, layout: &Layout) -> SumStep {
        match term {
            SumTerm::Value(value) => SumStep::Read(Quantity::of_value(value, layout)),
            SumTerm::Bit(bit) => SumStep::Read(Quantity::of_bit(bit, layout)),
            SumTerm::BitElement(element) => {
                SumStep::Read(Quantity::Element(ElementCells::of(element, layout)))
            }
            SumTerm::Sign(sign) => SumStep::Compute(sign),
        }
    }
}

/// The result of a sum.
fn sum(steps: &[SumStep], image: &Image) -> Option<SumNumber> {
    let mut waiting = [SumNumber::Integer(0); WAITING_MAX];
    let mut count = 0;
    for step in steps {
        match step {
            SumStep::Read(quantity) => {
                waiting[count] = quantity.number(image)?;
                count += 1;
            }
            SumStep::Compute(sign) => {
                count -= 1;
                waiting[count - 1] = waiting[count - 1].with(*sign, waiting[count]);
            }
        }
    }
    Some(waiting[0])
}

/// The result of an operator that reals do not have.
fn nothing(_: f64, _: f64, _: &mut Mishaps) -> f64 {
    0.0
}

impl SumNumber {
    fn real(self) -> f64 {
        match self {
            SumNumber::Integer(number) => number as f64,
            SumNumber::Real(number) => number,
        }
    }

    /// The result of an operator.
    fn with(self, sign: SumSign, other: SumNumber) -> SumNumber {
        let mut unused = Mishaps::default();
        let of_integers = match sign {
            SumSign::Add => integer::add,
            SumSign::Subtract => integer::sub,
            SumSign::Multiply => integer::mul,
            SumSign::Divide => integer::div,
            SumSign::Remainder => integer::rem,
            SumSign::And => integer::and,
        };
        let of_reals = match sign {
            SumSign::Add => real::add,
            SumSign::Subtract => real::sub,
            SumSign::Multiply => real::mul,
            SumSign::Divide => real::div,
            SumSign::Remainder => real::rem,
            // `resolve` refuses it.
            SumSign::And => nothing,
        };
        match (self, other) {
            (SumNumber::Integer(a), SumNumber::Integer(b)) => {
                SumNumber::Integer(of_integers(a, b, &mut unused))
            }
            (SumNumber::Integer(_) | SumNumber::Real(_), _) => {
                SumNumber::Real(of_reals(self.real(), other.real(), &mut unused))
            }
        }
    }

    /// Whether a compare is true.
    pub fn compare(self, comparison: Comparison, other: SumNumber) -> bool {
        let order = match (self, other) {
            (SumNumber::Integer(a), SumNumber::Integer(b)) => Some(a.cmp(&b)),
            (SumNumber::Integer(_) | SumNumber::Real(_), _) => {
                self.real().partial_cmp(&other.real())
            }
        };
        let Some(order) = order else { return false };
        match comparison {
            Comparison::Eq => order.is_eq(),
            Comparison::Ne => order.is_ne(),
            Comparison::Lt => order.is_lt(),
            Comparison::Le => order.is_le(),
            Comparison::Gt => order.is_gt(),
            Comparison::Ge => order.is_ge(),
        }
    }
}
