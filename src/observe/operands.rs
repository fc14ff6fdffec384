//! The words and bits that an instruction reads in addition to its contacts, to compute the value
//! of a cell.

use super::leaves::{Side, content, select, side, word};
use super::subject::Subject;
use crate::engine::{Cell, Image};
use crate::isa::function::Function;
use crate::isa::{Bit, Structure};
use crate::resolve::array::{Array, Element};
use crate::resolve::formula::{Binary, Formula, Part};
use crate::resolve::instruction::{Filling, WordPlace};
use crate::resolve::program::{Action, Value};
use crate::source::span::Located;

/// The operands that an instruction reads, right before it executes.
pub(super) fn operands(subject: &Subject, action: &Action, to: Cell, image: &Image) -> Vec<Side> {
    let values = |all: &[Located<Value>]| -> Vec<Side> {
        let sides = |value: &Located<Value>| {
            let index = match value.value {
                Value::Element(element) => Some(word(subject, element.index, image)),
                Value::Const(..) | Value::Real(_) | Value::Word(_) => None,
            };
            [Some(side(subject, value.value, image)), index].into_iter().flatten()
        };
        all.iter().flat_map(sides).collect()
    };
    match action {
        Action::Coil { .. }
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
        Action::SetElement { on: _, bit } => vec![select(subject, bit.value, image).0],
        Action::Counter { preset, .. }
        | Action::DelayTimer { preset, .. }
        | Action::Timer { preset, .. } => values(&[*preset]),
        Action::UpDownCounter { up_preset, dn_preset, .. } => {
            values(&[*up_preset, *dn_preset].into_iter().flatten().collect::<Vec<_>>())
        }
        Action::Sensaphone { preset, .. } => values(&preset.iter().copied().collect::<Vec<_>>()),
        Action::Reset { structure: _ } => Vec::new(),
        Action::Entask { block: _, every } => values(&every.iter().copied().collect::<Vec<_>>()),
        Action::Store { source, to } => {
            let mut read = values(&source.values().collect::<Vec<_>>());
            if let WordPlace::Element(element) = to.value {
                read.push(word(subject, element.index, image));
            }
            read
        }
        Action::Math { target: _, index, formula: of } => {
            let index = index.iter().flat_map(|index| formula(subject, index, image));
            index.chain(formula(subject, of, image)).collect()
        }
        Action::Copy { from, to: target } => {
            copied(subject, (from.value, target.value), to, image).into_iter().collect()
        }
        Action::Fill { value, to: _ } => vec![filling(subject, value.value, image)],
    }
}

/// The words and bits of an expression, each once.
fn formula(subject: &Subject, of: &Formula, image: &Image) -> Vec<Side> {
    let mut read: Vec<Side> = Vec::new();
    let layout = &subject.symbols.layout;
    let added = added(of);
    for (at, part) in of.parts.iter().enumerate() {
        let mut side = match part {
            Part::Word(at) => word(subject, *at, image),
            Part::Bit(of) => bit(Cell::Bit(layout.bit(*of)), image),
            // A word that is an index comes right before its element.
            Part::Element(array) => match at.checked_sub(1).map(|before| &of.parts[before]) {
                Some(Part::Word(index)) => {
                    let element = Element { array: *array, index: *index };
                    let Some(cell) = select(subject, element, image).1 else { continue };
                    any(subject, cell, image)
                }
                Some(_) | None => continue,
            },
            Part::Integer(_)
            | Part::Real(_)
            | Part::Unary(..)
            | Part::Binary(..)
            | Part::Call(..) => continue,
        };
        side.adds_nothing = side.value == 0 && added.get(at).copied().unwrap_or_default();
        match read.iter_mut().find(|other| other.cell == side.cell) {
            Some(other) => other.adds_nothing &= side.adds_nothing,
            None => read.push(side),
        }
    }
    read
}

/// For each part, whether it is an operand of `+`, `|`, `||` or an argument of `sum`: if it is 0,
/// it adds nothing to the result.
fn added(of: &Formula) -> Vec<bool> {
    let mut added = vec![false; of.parts.len()];
    // The parts whose results are not used yet.
    let mut open: Vec<usize> = Vec::new();
    for (at, part) in of.parts.iter().enumerate() {
        let (count, adds) = match part {
            Part::Integer(_) | Part::Real(_) | Part::Word(_) | Part::Bit(_) => (0, false),
            Part::Element(_) | Part::Unary(..) => (1, false),
            Part::Binary(operator, _) => {
                (2, matches!(operator, Binary::Add | Binary::Or | Binary::OrElse))
            }
            Part::Call(function, count, _) => (*count as usize, *function == Function::Sum),
        };
        for used in open.split_off(open.len().saturating_sub(count)) {
            added[used] = adds;
        }
        open.push(at);
    }
    added
}

/// The element that COPY reads for an element that it writes.
fn copied(
    subject: &Subject,
    (from, to): (Array, Array),
    cell: Cell,
    image: &Image,
) -> Option<Side> {
    let layout = &subject.symbols.layout;
    let at = to.addresses().position(|address| layout.cell(address) == Some(cell))?;
    let from = layout.cell(from.element(at as u32))?;
    Some(any(subject, from, image))
}

fn filling(subject: &Subject, value: Filling, image: &Image) -> Side {
    match value {
        Filling::Value(value) => side(subject, value, image),
        Filling::Bit(of) => bit(Cell::Bit(subject.symbols.layout.bit(of)), image),
        Filling::Element(element) => {
            let cell = select(subject, element, image).1;
            Side { cell, ..Side::constant(cell.map_or(0, |cell| content(image, cell)), false) }
        }
    }
}

fn bit(cell: Cell, image: &Image) -> Side {
    Side::of(cell, content(image, cell), false)
}

fn any(subject: &Subject, cell: Cell, image: &Image) -> Side {
    let real = matches!(cell, Cell::Word(word) if subject.symbols.layout.is_real(word));
    Side::of(cell, content(image, cell), real)
}

/// The structure of which a bit or word is a member.
pub(super) fn structure(address: Option<crate::isa::Address>) -> Option<Structure> {
    use crate::isa::{Address, Word};
    match address? {
        Address::Bit(Bit::Flag(structure, _)) | Address::Word(Word::Acc(structure)) => {
            Some(structure)
        }
        Address::Word(Word::Pre(number)) => Some(Structure::Sensaphone(number)),
        Address::Bit(
            Bit::Space(..) | Bit::Stage(_) | Bit::Running(_) | Bit::Done(_) | Bit::Device(..),
        )
        | Address::Word(Word::Space(..))
        | Address::Structure(_) => None,
    }
}
