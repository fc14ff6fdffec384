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
                | NamedThing::Record(_)
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
                let help = format!(
                    "outputs are `Y{n}` and the like, internal bits `C{n}`; to try inputs out, \
                     use a stimulus or a simulated device"
                );
                let others = [format!("C{n}"), format!("Y{n}")].map(possible);
                self.find(finding.help(help).fixes(others));
                return None;
            }
            Bit::Stage(_) => "SGSET, SGRST and JMP turn stages ON and OFF",
            Bit::Running(_) | Bit::Done(_) => "RUN, HALT and ENTASK start and stop blocks",
            Bit::Device(..) => "it shows the state of the device; nothing writes it",
            Bit::Flag(..) => "the owning instruction writes it; RSTCT, RSTT and RES reset it",
            Bit::Space(..) => "status bits are the controller's; use a C bit",
            Bit::InWord(_) => "status words are the controller's; use a bit of a D or V word",
        };
        let message = format!("`{name}` is read-only");
        let finding = Finding::new(Code::ReadOnly, atom.span, message).help(help);
        let (owner, member) = name.rsplit_once('.').unwrap_or((name, ""));
        let is_set = spec.mnemonic == Mnemonic::Set;
        let switches = is_set || spec.mnemonic == Mnemonic::Rst;
        let instead = match bit {
            Bit::Space(_, n) => Some(format!("C{n}")),
            Bit::Stage(_) if is_set => Some(format!("SGSET {member}")),
            Bit::Stage(_) => switches.then(|| format!("SGRST {member}")),
            Bit::Running(_) if is_set => Some(format!("RUN {owner}")),
            Bit::Running(_) => switches.then(|| format!("HALT {owner}")),
            Bit::Flag(structure, _) if switches && !is_set => {
                Some(format!("{} {owner}", reset_of(structure)))
            }
            Bit::InWord(bit) => Some(format!("D0.{}", bit.number)),
            Bit::Done(_) | Bit::Device(..) | Bit::Flag(..) => None,
        };
        self.find(finding.fixes(instead.map(possible)));
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
                | NamedThing::Record(_)
                | NamedThing::Element(_)
                    if spec.mnemonic == Mnemonic::Math =>
                {
                    Help::from("its target is a word or a bit: `MATH D0 = …`").with(possible("D0"))
                }
                NamedThing::Address(Address::Bit(_) | Address::Word(_))
                | NamedThing::Constant(..)
                | NamedThing::Real(_)
                | NamedThing::Block(_)
                | NamedThing::Device(_)
                | NamedThing::Record(_)
                | NamedThing::Element(_) => {
                    let help = Help::from(format!("`{}` writes to a word: `to=D0`", spec.name));
                    help.with(possible("D0"))
                }
            };
            self.wrong_kind(MisplacedName { name, span: atom.span, thing }, "a word", help);
            return None;
        };
        if !word.writable() {
            let message = format!("`{name}` is read-only");
            let finding = Finding::new(Code::ReadOnly, atom.span, message);
            let help = "status words are the controller's; use a D or V word";
            self.find(finding.help(help).fix(possible("D0")));
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
