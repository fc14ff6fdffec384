//! A rung as a circuit: contacts in series and in parallel, and the instructions that their power
//! reaches. A circuit has no positions: `grid` adds them.
//!
//! `!` before a series or before parallel contacts becomes a circuit of the opposite contacts. It
//! has power exactly when the original circuit has none.

use super::wording::{OperandLabel, Wording};
use rungd_engine::isa::{Address, Bit, LegName, Mnemonic};
use rungd_language::resolve::program::{Contact, Edge, Instruction, Rung};

/// Contacts between two points.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Circuit {
    /// One contact.
    Contact(ContactSymbol),
    /// Contacts in series.
    Series(Vec<Circuit>),
    /// Contacts in parallel.
    Parallel(Vec<Circuit>),
}

/// A drawn contact.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ContactSymbol {
    /// Its form.
    pub form: ContactForm,
    /// The label of the bit. For a compare, and for an edge of several contacts, its text.
    pub label: OperandLabel,
    /// The branch of the contact, from 1; `None`: it is in the rung's own legs.
    pub branch: Option<u32>,
    /// Its number among the contacts of its rung or branch, as `observe` counts them.
    pub leaf: usize,
}

/// The form of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ContactForm {
    /// Conducts while the bit is ON.
    Open,
    /// Conducts while the bit is OFF.
    Closed,
    /// Conducts in the scan in which the bit goes ON.
    Rising,
    /// Conducts in the scan in which the bit goes OFF.
    Falling,
    /// Conducts except in the scan in which the bit goes ON.
    NotRising,
    /// Conducts except in the scan in which the bit goes OFF.
    NotFalling,
    /// Conducts while the condition in its label is true.
    Boxed,
    /// Conducts while the condition in its label is false.
    NotBoxed,
}

impl ContactForm {
    /// Whether the drawn contact conducts. `on`: the state of the contact as `observe` counts it.
    pub fn conducts(self, on: bool) -> bool {
        match self {
            ContactForm::Open | ContactForm::Rising | ContactForm::Falling | ContactForm::Boxed => {
                on
            }
            ContactForm::Closed
            | ContactForm::NotRising
            | ContactForm::NotFalling
            | ContactForm::NotBoxed => !on,
        }
    }
}

/// A drawn instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InstructionSymbol {
    /// Its mnemonic.
    pub mnemonic: &'static str,
    /// The letter in a coil; `None`: the instruction is a box.
    pub coil: Option<&'static str>,
    /// The label of the bit of a coil. Of a box, `doc` has the values of its named constants.
    pub label: OperandLabel,
    /// The operands of a box, as they are written.
    pub operands: Vec<String>,
}

/// A destination of the power after the contacts of a rung.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outlet {
    /// An instruction.
    Instruction(InstructionSymbol),
    /// A branch: further contacts, with their instructions.
    Branch(Circuit, Vec<InstructionSymbol>),
}

/// A rung.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RungCircuit {
    /// A rung with one leg.
    Plain(Circuit, Vec<Outlet>),
    /// An instruction with several legs, each with its contacts.
    Legs(Vec<(&'static str, Circuit)>, InstructionSymbol),
}

impl RungCircuit {
    /// The circuit of a rung.
    pub(super) fn of(rung: &Rung, wording: &Wording) -> RungCircuit {
        let mut legs = CircuitMaker { wording, branch: None, leaf: 0 };
        let symbol = |instruction: &Instruction| symbol(instruction, wording);
        if let ([instruction], [leg, ..], []) = (&*rung.body, &*rung.legs, &*rung.branches)
            && leg.name != LegName::When
        {
            let legs = rung.legs.iter().map(|leg| (leg.name.key(), legs.series(&leg.contacts)));
            return RungCircuit::Legs(legs.collect(), symbol(instruction));
        }
        let contacts = rung.legs.first();
        let contacts = contacts.map_or(series(Vec::new()), |leg| legs.series(&leg.contacts));
        let body = rung.body.iter().map(|instruction| Outlet::Instruction(symbol(instruction)));
        let branches = (1..).zip(&rung.branches).map(|(number, branch)| {
            let body = branch.body.iter().map(symbol).collect();
            let mut maker = CircuitMaker { wording, branch: Some(number), leaf: 0 };
            Outlet::Branch(maker.series(&branch.contacts), body)
        });
        RungCircuit::Plain(contacts, body.chain(branches).collect())
    }
}

fn series(parts: Vec<Circuit>) -> Circuit {
    let flat = parts.into_iter().flat_map(|part| match part {
        Circuit::Series(parts) => parts,
        Circuit::Contact(_) | Circuit::Parallel(_) => vec![part],
    });
    Circuit::Series(flat.collect())
}

fn parallel(parts: Vec<Circuit>) -> Circuit {
    let flat = parts.into_iter().flat_map(|part| match part {
        Circuit::Parallel(parts) => parts,
        Circuit::Contact(_) | Circuit::Series(_) => vec![part],
    });
    Circuit::Parallel(flat.collect())
}

struct CircuitMaker<'w, 'p> {
    wording: &'w Wording<'p>,
    branch: Option<u32>,
    /// The number of the next contact.
    leaf: usize,
}

impl CircuitMaker<'_, '_> {
    fn series(&mut self, contacts: &[Contact]) -> Circuit {
        series(contacts.iter().map(|contact| self.circuit(contact, true)).collect())
    }

    /// The circuit of a contact; with `is_plain` = false the opposite circuit, which has power
    /// while the contact is OFF.
    fn circuit(&mut self, contact: &Contact, is_plain: bool) -> Circuit {
        let mut all = |parts: &[Contact]| -> Vec<Circuit> {
            parts.iter().map(|part| self.circuit(part, is_plain)).collect()
        };
        match contact {
            Contact::All(parts, _) if is_plain => series(all(parts)),
            Contact::All(parts, _) => parallel(all(parts)),
            Contact::Any(parts, _) if is_plain => parallel(all(parts)),
            Contact::Any(parts, _) => series(all(parts)),
            Contact::Not(inner, _) => self.circuit(inner, !is_plain),
            Contact::Edge(_, inner, _) => {
                // The contacts within an edge are numbered too.
                let _ = self.circuit(inner, true);
                self.leaf(contact, is_plain)
            }
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => self.leaf(contact, is_plain),
        }
    }

    /// One drawn contact; with `is_plain` = false its opposite.
    fn leaf(&mut self, contact: &Contact, is_plain: bool) -> Circuit {
        let wording = self.wording;
        let text = || OperandLabel {
            name: wording.contact(contact),
            address: None,
            doc: wording.constants(contact.span()),
        };
        let bit = |bit: &Bit| wording.label(Address::Bit(*bit));
        let either = |plain, opposite| if is_plain { plain } else { opposite };
        let (form, label) = match contact {
            Contact::Bit(address, _) => {
                (either(ContactForm::Open, ContactForm::Closed), bit(address))
            }
            Contact::Element(..) => (either(ContactForm::Open, ContactForm::Closed), text()),
            Contact::Computed(computed, _) if computed.compare.is_none() => {
                (either(ContactForm::Open, ContactForm::Closed), text())
            }
            Contact::Edge(edge, inner, _) => match (&**inner, edge) {
                (Contact::Bit(address, _), Edge::Rise) => {
                    (either(ContactForm::Rising, ContactForm::NotRising), bit(address))
                }
                (Contact::Bit(address, _), Edge::Fall) => {
                    (either(ContactForm::Falling, ContactForm::NotFalling), bit(address))
                }
                (_, Edge::Rise | Edge::Fall) => {
                    (either(ContactForm::Boxed, ContactForm::NotBoxed), text())
                }
            },
            Contact::Compare(..)
            | Contact::Computed(..)
            | Contact::Not(..)
            | Contact::All(..)
            | Contact::Any(..) => (either(ContactForm::Boxed, ContactForm::NotBoxed), text()),
        };
        let leaf = self.leaf;
        self.leaf += 1;
        Circuit::Contact(ContactSymbol { form, label, branch: self.branch, leaf })
    }
}

/// The symbol of an instruction: a coil, or otherwise a box.
fn symbol(instruction: &Instruction, wording: &Wording) -> InstructionSymbol {
    let (mnemonic, operands) = wording.instruction(instruction);
    let (mut coil, mut label) = (None, OperandLabel::default());
    if let Some(bit) = instruction.operands.get("bit") {
        coil = LETTERS
            .iter()
            .find(|(coil_mnemonic, _)| *coil_mnemonic == instruction.mnemonic)
            .map(|(_, text)| *text);
        label = wording.label(Address::Bit(bit.value));
    }
    if coil.is_none() {
        label.doc = wording.constants(instruction.span);
    }
    InstructionSymbol { mnemonic, coil, label, operands }
}

/// The letters in coils. All other instructions are drawn as boxes.
const LETTERS: [(Mnemonic, &str); 5] = [
    (Mnemonic::Out, ""),
    (Mnemonic::Set, "S"),
    (Mnemonic::Rst, "R"),
    (Mnemonic::Pd, "P"),
    (Mnemonic::Nd, "N"),
];
