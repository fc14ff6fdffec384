//! The operands that an instruction writes: bits and words that a ladder may write.
//!
//! Called by `operand`, `operand_array`, `math` and `template`.

use super::Resolver;
use super::resolver::of_array;
use super::scope::{MisplacedName, NamedThing};
use crate::source::atom::Atom;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Help, advise, possible, proposed, write};
pub use rungd_engine::isa::{Address, Bit, BitSpace, Mnemonic, Spec, Structure, Word};

impl Resolver<'_> {
    /// The bit that an instruction writes. Adds a finding if the ladder may not write it.
    pub(super) fn writable_bit(&mut self, atom: &Atom, spec: &Spec) -> Option<Bit> {
        let (name, thing) = self.thing(atom, "a bit", &["bit"])?;
        let NamedThing::Address(address @ Address::Bit(bit)) = thing else {
            let help = match thing {
                NamedThing::Array(array) => of_array(name, array),
                NamedThing::Address(Address::Structure(structure))
                    if spec.mnemonic == Mnemonic::Rst =>
                {
                    write(format!("{} {name}", reset_of(structure)))
                }
                NamedThing::Address(_)
                | NamedThing::Constant(..)
                | NamedThing::Real(_)
                | NamedThing::Block(_)
                | NamedThing::Device(_)
                | NamedThing::Element(_) => {
                    let words =
                        format!("`{}` writes a bit: `{{}}`, `{{}}`, or a tag of one", spec.name);
                    advise(&words, ["Y0", "C0"].map(possible))
                }
            };
            self.wrong_kind(MisplacedName { name, span: atom.span, thing }, "a bit", help);
            return None;
        };
        if bit.writable_by_ladder() {
            self.note(name, atom.span, address);
            return Some(bit);
        }
        let help = match bit {
            Bit::Space(BitSpace::X, n) => {
                let message = format!("`{name}` is an input: no instruction writes it");
                let finding = Finding::new(Code::WriteToInput, atom.span, message);
                self.find(finding.help(format!(
                    "outputs are `Y{n}` and the like, internal bits `C{n}`; to try inputs out, \
                     use a stimulus or a simulated device"
                )));
                return None;
            }
            Bit::Stage(_) => "SGSET, SGRST and JMP turn stages ON and OFF",
            Bit::Running(_) | Bit::Done(_) => "RUN, HALT and ENTASK start and stop blocks",
            Bit::Device(..) => "it shows the state of the device; nothing writes it",
            Bit::Flag(..) => "the owning instruction writes it; RSTCT, RSTT and RES reset it",
            Bit::Space(..) => "status bits are the controller's; use a C bit",
        };
        let message = format!("`{name}` is read-only");
        self.find(Finding::new(Code::ReadOnly, atom.span, message).help(help));
        None
    }

    /// The word that an instruction writes. Adds a finding if the ladder may not write it.
    pub(super) fn writable_word(&mut self, atom: &Atom, spec: &Spec) -> Option<Word> {
        let (name, thing) = self.thing(atom, "a word", &["int", "real", "word"])?;
        let NamedThing::Address(address @ Address::Word(word)) = thing else {
            let help = match thing {
                NamedThing::Address(Address::Structure(Structure::Sensaphone(_))) => {
                    let words = [format!("{name}.ACC"), format!("{name}.PRE")].map(possible);
                    advise("its words are `{}` and `{}`", words)
                }
                NamedThing::Address(Address::Structure(_)) => {
                    advise("its word is `{}`", [proposed(format!("{name}.Acc"))])
                }
                NamedThing::Array(array) => of_array(name, array),
                NamedThing::Address(Address::Bit(_) | Address::Word(_))
                | NamedThing::Constant(..)
                | NamedThing::Real(_)
                | NamedThing::Block(_)
                | NamedThing::Device(_)
                | NamedThing::Element(_)
                    if spec.mnemonic == Mnemonic::Math =>
                {
                    "its target is a word or a bit: `MATH D0 = …`".into()
                }
                NamedThing::Address(Address::Bit(_) | Address::Word(_))
                | NamedThing::Constant(..)
                | NamedThing::Real(_)
                | NamedThing::Block(_)
                | NamedThing::Device(_)
                | NamedThing::Element(_) => {
                    Help::from(format!("`{}` writes to a word: `to=D0`", spec.name))
                }
            };
            self.wrong_kind(MisplacedName { name, span: atom.span, thing }, "a word", help);
            return None;
        };
        if !word.writable() {
            let message = format!("`{name}` is read-only");
            let finding = Finding::new(Code::ReadOnly, atom.span, message);
            self.find(finding.help("status words are the controller's; use a D or V word"));
            return None;
        }
        self.note(name, atom.span, address);
        Some(word)
    }
}

/// The instruction that resets a structure.
pub(super) fn reset_of(structure: Structure) -> &'static str {
    match structure {
        Structure::Counter(_) => "RSTCT",
        Structure::Timer(_) => "RSTT",
        Structure::Sensaphone(_) => "RES",
    }
}
