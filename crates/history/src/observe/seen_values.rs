//! The values that contacts and instructions read, in an image.
//!
//! Called by `leaves` and `operands`.

use super::subject::Subject;
use rungd_engine::isa::Word;
use rungd_engine::{Cell, Image};
use rungd_language::resolve::array::ArrayElement;
use rungd_language::resolve::program::Value;

/// A value in a contact or an instruction.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeenValue {
    /// The content of its cell, or the constant.
    pub value: i32,
    /// Its cell; `None` for a constant, and for an element outside of its array.
    pub cell: Option<Cell>,
    /// Whether it is a real.
    pub real: bool,
    /// Whether it is a 0 that a sum or an OR adds.
    pub adds_nothing: bool,
}

impl SeenValue {
    /// A constant.
    pub fn constant(value: i32, real: bool) -> SeenValue {
        SeenValue { value, cell: None, real, adds_nothing: false }
    }

    /// The content of a cell.
    pub fn of(cell: Cell, value: i32, real: bool) -> SeenValue {
        SeenValue { value, cell: Some(cell), real, adds_nothing: false }
    }
}

/// A value in an image.
pub(super) fn side(subject: &Subject, value: Value, image: &Image) -> SeenValue {
    let real = value.is_real();
    match value {
        Value::Const(value, _) => SeenValue::constant(value, real),
        Value::Real(value) => SeenValue::constant(value.cell(), real),
        Value::Word(at) => word(subject, at, image),
        Value::Element(element) => {
            let cell = select(subject, element, image).1;
            let value = cell.map_or(0, |cell| image.value(cell));
            SeenValue { cell, ..SeenValue::constant(value, real) }
        }
    }
}

/// A word in an image.
pub(super) fn word(subject: &Subject, word: Word, image: &Image) -> SeenValue {
    let cell = Cell::Word(subject.symbols.layout.word(word));
    SeenValue::of(cell, image.value(cell), word.is_real())
}

/// The word that selects an element, and the selected cell.
pub(super) fn select(
    subject: &Subject,
    element: ArrayElement,
    image: &Image,
) -> (SeenValue, Option<Cell>) {
    let index = word(subject, element.index, image);
    let at = u32::try_from(index.value).ok().filter(|at| *at < element.array.count);
    let cell = at.and_then(|at| subject.symbols.layout.cell(element.array.element(at)));
    (index, cell)
}
