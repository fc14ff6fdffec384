//! Operands that are elements of arrays.
//!
//! Called by `operand`. An element with a constant index is a plain bit or word; one that a word
//! selects is a target of SET, RST, MOVE, ADD and SUB.

use super::Resolver;
use super::array::Element;
use super::instruction::OperandValue;
use super::scope::Thing;
use crate::isa::{Mnemonic, Spec};
use crate::source::atom::{Atom, AtomKind};
use crate::source::finding::{Code, Finding};

impl Resolver<'_> {
    /// A target that a word selects; `None` for any other operand.
    pub(super) fn selected(
        &mut self,
        atom: &Atom,
        bits: bool,
        spec: &Spec,
    ) -> Option<Option<OperandValue>> {
        let name = atom.name().filter(|name| name.contains('['))?;
        let element = match self.scope.look_up(name).map(|found| found.thing) {
            Ok(Thing::Element(element)) if element.array.is_bits() == bits => element,
            Ok(_) | Err(_) => return None,
        };
        // Marks its tag as used, and notes the index.
        self.look_up(name, atom.span);
        Some(self.element_target(atom, element, spec))
    }

    fn element_target(
        &mut self,
        atom: &Atom,
        element: Element,
        spec: &Spec,
    ) -> Option<OperandValue> {
        let base = atom.name()?.split('[').next()?;
        if !element.array.is_writable() {
            // Gives the finding of any of its elements.
            let first = Atom { kind: AtomKind::Name(format!("{base}[0]")), span: atom.span };
            match element.array.is_bits() {
                true => drop(self.writable_bit(&first, spec)),
                false => drop(self.writable_word(&first, spec)),
            }
            return None;
        }
        if !element.array.is_bits() || matches!(spec.mnemonic, Mnemonic::Set | Mnemonic::Rst) {
            return Some(OperandValue::Element(element));
        }
        let name = spec.name;
        let message = format!("the bit of `{name}` has a constant index");
        let finding = Finding::new(Code::OperandType, atom.span, message);
        self.find(finding.label("a moving index would leave bits behind").help(format!(
            "write `{name} {base}[0]`, or SET and RST `{atom}`; MATH stores a bit too: `MATH \
             {atom} = …`"
        )));
        None
    }
}
