//! The words and bits that an instruction reads in addition to its contacts, to compute the value
//! of a cell.

use super::seen_values::{SeenValue, select, side, word};
use super::subject::Subject;
use rungd_engine::isa::function::Function;
use rungd_engine::isa::{OperandKind, OperandRole};
use rungd_engine::{Cell, Image};
use rungd_language::lower::formula_value::{ArrayCells, CellFormula};
use rungd_language::resolve::array::{Array, ArrayElement};
pub use rungd_language::resolve::formula::{Binary, Formula, FormulaPart};
use rungd_language::resolve::instruction::OperandValue;
use rungd_language::resolve::program::{Instruction, Value};
use rungd_language::resolve::writes::WrittenOperand;

/// The operands that an instruction reads, right before it executes.
pub(super) fn operands(
    subject: &Subject,
    instruction: &Instruction,
    to: Cell,
    image: &Image,
) -> Vec<SeenValue> {
    let mut sides = Vec::new();
    let layout = &subject.symbols.layout;
    let writes_it = |written| match written {
        WrittenOperand::Bit(bit) => layout.bit_in(bit) == to,
        WrittenOperand::Word(word) => Cell::Word(layout.word(word)) == to,
        WrittenOperand::Array(array) => place(subject, array, to).is_some(),
    };
    for operand in instruction.operands_for(writes_it) {
        let is_read = operand.row.role == OperandRole::Reads;
        match operand.value {
            OperandValue::Value(value) => {
                sides.push(side(subject, value, image));
                // A FILL tells the value only.
                if let Value::Element(element) = value
                    && operand.row.kind != OperandKind::Filling
                {
                    sides.push(word(subject, element.index, image));
                }
            }
            OperandValue::Element(element) if !is_read => {
                sides.push(word(subject, element.index, image));
            }
            OperandValue::Element(element) => sides.push(selected(subject, element, image)),
            OperandValue::Bit(of) if is_read => {
                sides.push(bit(subject.symbols.layout.bit_in(of), image));
            }
            OperandValue::Array(from) if operand.row.kind == OperandKind::Bits => {
                sides.extend(packed(subject, from, to, image));
            }
            OperandValue::Array(from) if is_read => {
                let at = instruction.written_array().and_then(|target| place(subject, target, to));
                sides.extend(at.and_then(|at| element(subject, from, at, image)));
            }
            OperandValue::Bit(_)
            | OperandValue::Array(_)
            | OperandValue::Word(_)
            | OperandValue::Structure(_)
            | OperandValue::Block(_)
            | OperandValue::Stage(_)
            | OperandValue::Run(_) => {}
        }
    }
    sides.extend(instruction.formulas().flat_map(|each| formula(subject, each, image)));
    sides
}

/// The words and bits of an expression, each once.
pub(super) fn formula(subject: &Subject, formula: &Formula, image: &Image) -> Vec<SeenValue> {
    let mut read: Vec<SeenValue> = Vec::new();
    let layout = &subject.symbols.layout;
    let added = added(formula);
    let begins = FormulaPart::starts(&formula.parts);
    for (at, part) in formula.parts.iter().enumerate() {
        let mut side = match part {
            FormulaPart::Word(at) => word(subject, *at, image),
            FormulaPart::Bit(of) => bit(layout.bit_in(*of), image),
            FormulaPart::Element(array) => {
                let index = &formula.parts[begins[at]..at];
                let Some(cell) = computed_element(subject, *array, index, image) else { continue };
                any(subject, cell, image)
            }
            FormulaPart::Integer(_)
            | FormulaPart::Real(_)
            | FormulaPart::Unary(..)
            | FormulaPart::Binary(..)
            | FormulaPart::Call(..) => continue,
        };
        side.adds_nothing = side.value == 0 && added.get(at).copied().unwrap_or_default();
        match read.iter_mut().find(|other| other.cell == side.cell) {
            Some(other) => other.adds_nothing &= side.adds_nothing,
            None => read.push(side),
        }
    }
    read
}

/// The element of an array that an index selects; `None`: the index is outside of the array.
fn computed_element(
    subject: &Subject,
    array: Array,
    index: &[FormulaPart],
    image: &Image,
) -> Option<Cell> {
    let layout = &subject.symbols.layout;
    let index = CellFormula::new(&Formula { parts: index.to_vec() }, layout).value(image);
    ArrayCells::new(array, layout).cell(index.number.integer())
}

/// For each part, whether it is an operand of `+`, `|`, `||` or an argument of `sum`: if it is 0,
/// it adds nothing to the result.
fn added(formula: &Formula) -> Vec<bool> {
    let mut added = vec![false; formula.parts.len()];
    // The parts whose results are not used yet.
    let mut open: Vec<usize> = Vec::new();
    for (at, part) in formula.parts.iter().enumerate() {
        let adds = match part {
            FormulaPart::Binary(operator, _) => {
                matches!(operator, Binary::Add | Binary::Or | Binary::OrElse)
            }
            FormulaPart::Call(function, ..) => *function == Function::Sum,
            FormulaPart::Integer(_)
            | FormulaPart::Real(_)
            | FormulaPart::Word(_)
            | FormulaPart::Bit(_)
            | FormulaPart::Element(_)
            | FormulaPart::Unary(..) => false,
        };
        let count = part.operand_count();
        for used in open.split_off(open.len().saturating_sub(count)) {
            added[used] = adds;
        }
        open.push(at);
    }
    added
}

/// The number of the element of an array that has a cell.
fn place(subject: &Subject, array: Array, cell: Cell) -> Option<u32> {
    let layout = &subject.symbols.layout;
    let at = array.addresses().position(|address| layout.cell(address) == Some(cell))?;
    Some(at as u32)
}

/// The bits of an array that PACK writes into a cell: all of them into a word, one into a bit of
/// it. Of many, those that are OFF may be left out.
fn packed(subject: &Subject, from: Array, to: Cell, image: &Image) -> Vec<SeenValue> {
    let elements = match to {
        Cell::WordBit(bit) => {
            let at = bit.mask.trailing_zeros();
            at..(at + 1).min(from.count)
        }
        Cell::Word(_) | Cell::Bit(_) => 0..from.count,
    };
    let sides = elements.filter_map(|at| element(subject, from, at, image));
    sides.map(|side| SeenValue { adds_nothing: side.value == 0, ..side }).collect()
}

/// An element of an array. COPY reads the element with the number of the one that it writes.
fn element(subject: &Subject, array: Array, at: u32, image: &Image) -> Option<SeenValue> {
    let cell = subject.symbols.layout.cell(array.element(at))?;
    Some(any(subject, cell, image))
}

fn selected(subject: &Subject, element: ArrayElement, image: &Image) -> SeenValue {
    let cell = select(subject, element, image).1;
    SeenValue { cell, ..SeenValue::constant(cell.map_or(0, |cell| image.value(cell)), false) }
}

fn bit(cell: Cell, image: &Image) -> SeenValue {
    SeenValue::of(cell, image.value(cell), false)
}

fn any(subject: &Subject, cell: Cell, image: &Image) -> SeenValue {
    let real = matches!(cell, Cell::Word(word) if subject.symbols.layout.is_real(word));
    SeenValue::of(cell, image.value(cell), real)
}
