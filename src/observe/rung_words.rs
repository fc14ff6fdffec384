//! The words of a rung, which its compares and instructions read or count. A picture of a running
//! ladder shows their values, because power alone does not show the state of a counter.

use super::leaves::own_contacts;
use super::logic::Leaves;
use super::subject::Subject;
use crate::engine::Cell;
use crate::isa::Address;
use crate::resolve::operand_list::OperandValue;
use crate::resolve::program::{Action, Contact};
use crate::resolve::reads::ReadOperand;

impl Subject {
    /// The words of a rung's part, in the order of its contacts and instructions; `part`: its
    /// number among those of [`Subject::contacts`].
    pub fn words(&self, part: u32) -> Vec<Cell> {
        let mut leaves = Leaves::default();
        own_contacts(self, part).into_iter().for_each(|contact| drop(leaves.add(contact)));
        let contacts = leaves.contacts.into_iter().flat_map(Contact::reads).filter_map(address);
        let body = self.body(part).iter().flat_map(|of| of_action(&of.action));
        let words = contacts.chain(body).filter(|of| matches!(of, Address::Word(_)));
        let mut cells = Vec::new();
        for cell in words.filter_map(|word| self.symbols.layout.cell(word)) {
            if !cells.contains(&cell) {
                cells.push(cell);
            }
        }
        cells
    }
}

fn address(of: ReadOperand) -> Option<Address> {
    match of {
        ReadOperand::Address(address) => Some(address),
        ReadOperand::Array(_) => None,
    }
}

/// The addresses that an instruction names; for a structure, its members.
fn of_action(action: &Action) -> Vec<Address> {
    let mut all = Vec::new();
    action.operands().each().for_each(|(_, operand)| match operand {
        OperandValue::Word(word) => all.push(Address::Word(word)),
        OperandValue::Structure(structure) => all.extend(structure.member_addresses()),
        OperandValue::Bit(_)
        | OperandValue::Value(_)
        | OperandValue::Block(_)
        | OperandValue::Stage(_)
        | OperandValue::Element(_)
        | OperandValue::Array(_)
        | OperandValue::Run(_) => {}
    });
    all.extend(action.reads().into_iter().filter_map(address));
    all
}
