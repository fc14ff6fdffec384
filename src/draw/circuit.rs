//! A rung as a circuit: contacts in series and in parallel, and the instructions that their power
//! reaches. No places on paper: `grid` gives them.
//!
//! `!` of a series or of branches becomes a circuit of the opposite contacts, which has power
//! exactly when the other has none.

use super::wording::{OperandLabel, Wording};
use crate::isa::{Address, LegName};
use crate::resolve::instruction::Coil;
use crate::resolve::program::{Action, Contact, Edge, Instruction, Rung};

/// Contacts between two points.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Circuit {
    /// One contact.
    Contact(ContactSymbol),
    /// One after the other.
    Series(Vec<Circuit>),
    /// Beside each other.
    Parallel(Vec<Circuit>),
}

/// A contact as it is drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ContactSymbol {
    /// Its form.
    pub form: ContactForm,
    /// The bit; of a compare and of an edge of several contacts: its text.
    pub label: OperandLabel,
}

/// The form of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ContactForm {
    /// Conducts while the bit is ON.
    Open,
    /// Conducts while it is OFF.
    Closed,
    /// Conducts in the scan in which the bit goes ON.
    Rising,
    /// Conducts in the scan in which it goes OFF.
    Falling,
    /// Conducts but in that scan.
    NotRising,
    /// Conducts but in that scan.
    NotFalling,
    /// Conducts while what its label says is true.
    Boxed,
    /// Conducts while it is not.
    NotBoxed,
}

/// An instruction as it is drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InstructionSymbol {
    /// Its mnemonic.
    pub mnemonic: &'static str,
    /// The letter in a coil; `None`: it is a box.
    pub coil: Option<&'static str>,
    /// Of a coil: its bit.
    pub label: OperandLabel,
    /// Of a box: its operands, as they are written.
    pub operands: Vec<String>,
}

/// What the power behind the contacts of a rung, or of a branch, reaches.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outlet {
    /// An instruction.
    Instruction(InstructionSymbol),
    /// Further contacts, with what is behind them.
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
        let series = |contacts: &[Contact]| series(contacts.iter().map(|of| circuit(of, wording)));
        let symbol = |of: &Instruction| symbol(of, wording);
        if let ([instruction], [leg, ..], []) = (&*rung.body, &*rung.legs, &*rung.branches)
            && leg.name != LegName::When
        {
            let legs = rung.legs.iter().map(|leg| (leg.name.key(), series(&leg.contacts)));
            return RungCircuit::Legs(legs.collect(), symbol(instruction));
        }
        let contacts =
            rung.legs.first().map_or(Circuit::Series(Vec::new()), |leg| series(&leg.contacts));
        let own = rung.body.iter().map(|of| Outlet::Instruction(symbol(of)));
        let branches = rung.branches.iter().map(|branch| {
            let body = branch.body.iter().map(symbol).collect();
            Outlet::Branch(series(&branch.contacts), body)
        });
        RungCircuit::Plain(contacts, own.chain(branches).collect())
    }
}

fn series(parts: impl Iterator<Item = Circuit>) -> Circuit {
    let flat = parts.flat_map(|part| match part {
        Circuit::Series(parts) => parts,
        Circuit::Contact(_) | Circuit::Parallel(_) => vec![part],
    });
    Circuit::Series(flat.collect())
}

fn parallel(parts: impl Iterator<Item = Circuit>) -> Circuit {
    let flat = parts.flat_map(|part| match part {
        Circuit::Parallel(parts) => parts,
        Circuit::Contact(_) | Circuit::Series(_) => vec![part],
    });
    Circuit::Parallel(flat.collect())
}

fn circuit(contact: &Contact, wording: &Wording) -> Circuit {
    match contact {
        Contact::All(parts, _) => series(parts.iter().map(|of| circuit(of, wording))),
        Contact::Any(parts, _) => parallel(parts.iter().map(|of| circuit(of, wording))),
        Contact::Not(inner, _) => opposite(inner, wording),
        Contact::Bit(..) | Contact::Element(..) | Contact::Edge(..) | Contact::Compare(..) => {
            leaf(contact, true, wording)
        }
    }
}

/// A circuit that has power while a contact has none.
fn opposite(contact: &Contact, wording: &Wording) -> Circuit {
    match contact {
        Contact::All(parts, _) => parallel(parts.iter().map(|of| opposite(of, wording))),
        Contact::Any(parts, _) => series(parts.iter().map(|of| opposite(of, wording))),
        Contact::Not(inner, _) => circuit(inner, wording),
        Contact::Bit(..) | Contact::Element(..) | Contact::Edge(..) | Contact::Compare(..) => {
            leaf(contact, false, wording)
        }
    }
}

/// A contact that is drawn as one; with `is_plain` = false its opposite.
fn leaf(contact: &Contact, is_plain: bool, wording: &Wording) -> Circuit {
    let text = || OperandLabel { name: wording.contact(contact), ..OperandLabel::default() };
    let either = |plain, opposite| if is_plain { plain } else { opposite };
    let (form, label) = match contact {
        Contact::Bit(bit, _) => {
            (either(ContactForm::Open, ContactForm::Closed), wording.label(Address::Bit(*bit)))
        }
        Contact::Element(..) => (either(ContactForm::Open, ContactForm::Closed), text()),
        Contact::Edge(edge, inner, _) => match (&**inner, edge) {
            (Contact::Bit(bit, _), Edge::Rise) => {
                let form = either(ContactForm::Rising, ContactForm::NotRising);
                (form, wording.label(Address::Bit(*bit)))
            }
            (Contact::Bit(bit, _), Edge::Fall) => {
                let form = either(ContactForm::Falling, ContactForm::NotFalling);
                (form, wording.label(Address::Bit(*bit)))
            }
            (_, Edge::Rise | Edge::Fall) => {
                (either(ContactForm::Boxed, ContactForm::NotBoxed), text())
            }
        },
        Contact::Compare(..) => (either(ContactForm::Boxed, ContactForm::NotBoxed), text()),
        // These are circuits.
        Contact::Not(..) | Contact::All(..) | Contact::Any(..) => (ContactForm::Boxed, text()),
    };
    Circuit::Contact(ContactSymbol { form, label })
}

fn symbol(instruction: &Instruction, wording: &Wording) -> InstructionSymbol {
    let (mnemonic, operands) = wording.instruction(instruction);
    let (coil, label) = match &instruction.action {
        Action::Coil { coil, bit } => {
            let letter = match coil {
                Coil::Out => Some(""),
                Coil::Set => Some("S"),
                Coil::Rst => Some("R"),
                Coil::Pd => Some("P"),
                Coil::Nd => Some("N"),
                Coil::Ponoff => None,
            };
            (letter, wording.label(Address::Bit(bit.value)))
        }
        Action::SetElement { .. }
        | Action::Counter { .. }
        | Action::UpDownCounter { .. }
        | Action::DelayTimer { .. }
        | Action::Timer { .. }
        | Action::Sensaphone { .. }
        | Action::Reset { .. }
        | Action::Store { .. }
        | Action::Math { .. }
        | Action::Copy { .. }
        | Action::Fill { .. }
        | Action::Shift { .. }
        | Action::Run { .. }
        | Action::Restart { .. }
        | Action::Halt { .. }
        | Action::Exit
        | Action::Entask { .. }
        | Action::Jump { .. }
        | Action::StageOn { .. }
        | Action::StageOff { .. }
        | Action::Converge { .. }
        | Action::Stop => (None, OperandLabel::default()),
    };
    InstructionSymbol { mnemonic, coil, label, operands }
}
