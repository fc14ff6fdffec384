//! The words of a rung, which its compares and instructions read or count, and its outputs.
//! A picture of a running ladder shows their values, because power alone does not show the state
//! of a counter, nor what an output is driven to.

use super::leaves::own_contacts;
use super::logic::Leaves;
use super::subject::Subject;
use rungd_engine::Cell;
use rungd_engine::isa::{Address, Bit, BitSpace};
pub use rungd_language::resolve::operand_list::OperandValue;
use rungd_language::resolve::program::{Contact, Instruction};
pub use rungd_language::resolve::reads::ReadOperand;

impl Subject {
    /// The words of a rung's part and the bits of words, in the order of its contacts and
    /// instructions; `part`: its number among those of [`Subject::contacts`].
    pub fn words(&self, part: u32) -> Vec<Cell> {
        let is_of_word =
            |address: &Address| matches!(address, Address::Word(_) | Address::Bit(Bit::InWord(_)));
        self.named(part, is_of_word)
    }

    /// The outputs that the contacts and instructions of a rung's part name.
    pub fn outputs(&self, part: u32) -> Vec<Cell> {
        self.named(part, |address| matches!(address, Address::Bit(Bit::Space(BitSpace::Y, _))))
    }

    fn named(&self, part: u32, is_wanted: fn(&Address) -> bool) -> Vec<Cell> {
        let mut leaves = Leaves::default();
        own_contacts(self, part).into_iter().for_each(|contact| drop(leaves.add(contact)));
        let contacts = leaves.contacts.into_iter().flat_map(Contact::reads).filter_map(address);
        let body = self.body(part).iter().flat_map(named_by);
        let wanted = contacts.chain(body).filter(is_wanted);
        let mut cells = Vec::new();
        for cell in wanted.filter_map(|address| self.symbols.layout.cell(address)) {
            if !cells.contains(&cell) {
                cells.push(cell);
            }
        }
        cells
    }
}

fn address(operand: ReadOperand) -> Option<Address> {
    match operand {
        ReadOperand::Address(address) => Some(address),
        ReadOperand::Array(_) => None,
    }
}

/// The addresses that an instruction names; for a structure, its members.
fn named_by(instruction: &Instruction) -> Vec<Address> {
    let mut all = Vec::new();
    instruction.operands.each().for_each(|(_, operand)| match operand {
        OperandValue::Word(word) => all.push(Address::Word(word)),
        OperandValue::Structure(structure) => all.extend(structure.member_addresses()),
        OperandValue::Bit(bit) => all.push(Address::Bit(bit)),
        OperandValue::Value(_)
        | OperandValue::Block(_)
        | OperandValue::Stage(_)
        | OperandValue::Element(_)
        | OperandValue::Array(_)
        | OperandValue::Run(_) => {}
    });
    all.extend(instruction.reads().into_iter().filter_map(address));
    all
}
