//! Checks the arguments of uses: each name must fit the type of its parameter.
//!
//! Runs once all names are declared.

use super::given::Given;
use super::kind::{ParameterKind, WantedOperand};
use super::parameter::{record_words, tag_type, type_words};
use super::pending::Argument;
use crate::resolve::Resolver;
use crate::resolve::array::ArrayElement;
use crate::resolve::mistake::LISTED_MAX;
use crate::resolve::range::is_range;
use crate::resolve::record::{RecordIndex, RecordPlace};
use crate::resolve::scope::NamedThing;
use crate::source::atom::{Atom, AtomKind};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, Help, advise, possible, proposed};
use crate::source::indexed::first_of;
pub use rungd_engine::isa::{Address, Mnemonic, Structure as Of};

impl Resolver<'_> {
    /// Checks all arguments. The places of a wrong argument get no further findings.
    pub(in crate::resolve) fn check_arguments(&mut self) {
        // Only names in rungs are operands of the ladder: those of arguments are removed again.
        let (named, constants) = (self.named.len(), self.constants.len());
        for argument in std::mem::take(&mut self.arguments) {
            match &argument.given {
                Given::Contacts(contact, _) => {
                    self.contacts(std::slice::from_ref(contact));
                }
                Given::Atom(atom) => {
                    if !self.is_right(&argument, atom) {
                        self.layers.mark_wrong(atom.span);
                    }
                }
            }
        }
        self.named.truncate(named);
        self.constants.truncate(constants);
    }

    fn is_right(&mut self, argument: &Argument, atom: &Atom) -> bool {
        let AtomKind::Name(name) = &atom.kind else { return true };
        if argument.kind == ParameterKind::Array && is_range(name) && !name.contains('[') {
            self.range_given(argument, atom);
            return false;
        }
        let kind = tag_type(argument.kind, &argument.type_name);
        let Some(thing) = self.look_up_as(name, atom.span, kind.as_slice()) else { return false };
        let spec = Mnemonic::Out.spec();
        match (argument.kind.wanted(), thing) {
            (WantedOperand::Bit, NamedThing::Address(Address::Bit(_)))
            | (WantedOperand::Whole, NamedThing::Constant(..))
            | (WantedOperand::Real, NamedThing::Real(_))
            | (WantedOperand::Timer, NamedThing::Address(Address::Structure(Of::Timer(_))))
            | (WantedOperand::Counter, NamedThing::Address(Address::Structure(Of::Counter(_))))
            | (
                WantedOperand::Sensaphone,
                NamedThing::Address(Address::Structure(Of::Sensaphone(_))),
            ) => true,
            (WantedOperand::Record, NamedThing::Record(place)) => {
                let finding = self.misfit_of_record(argument, atom, place);
                let is_right = finding.is_none();
                self.findings.extend(finding);
                is_right
            }
            (WantedOperand::WrittenBit, NamedThing::Address(Address::Bit(_))) => {
                self.writable_bit(atom, spec).is_some()
            }
            (WantedOperand::Array, NamedThing::Array(array)) if !array.is_structures() => true,
            (WantedOperand::Bit, NamedThing::Element(element)) if element.array.is_bits() => true,
            (WantedOperand::Whole, NamedThing::Element(ArrayElement { array, .. }))
                if !array.is_bits() && !array.is_real() =>
            {
                true
            }
            (WantedOperand::Real, NamedThing::Element(element)) if element.array.is_real() => true,
            (
                WantedOperand::WrittenWhole | WantedOperand::WrittenReal,
                NamedThing::Element(ArrayElement { array, .. }),
            ) if !array.is_bits()
                && array.is_real() == (argument.kind.wanted() == WantedOperand::WrittenReal) =>
            {
                self.selected(atom, false, Mnemonic::Move.spec()).flatten().is_some()
            }
            (WantedOperand::Whole, NamedThing::Address(Address::Word(word))) if !word.is_real() => {
                true
            }
            (WantedOperand::Real, NamedThing::Address(Address::Word(word))) if word.is_real() => {
                true
            }
            (WantedOperand::WrittenWhole, NamedThing::Address(Address::Word(word)))
                if !word.is_real() =>
            {
                self.writable_word(atom, Mnemonic::Move.spec()).is_some()
            }
            (WantedOperand::WrittenReal, NamedThing::Address(Address::Word(word)))
                if word.is_real() =>
            {
                self.writable_word(atom, Mnemonic::Move.spec()).is_some()
            }
            (_, thing) => {
                self.wrong_argument(argument, atom, thing);
                false
            }
        }
    }

    /// The finding about a record or an array of records that is not what a parameter's type says.
    fn misfit_of_record(
        &self,
        argument: &Argument,
        atom: &Atom,
        place: RecordPlace,
    ) -> Option<Finding> {
        let record = &self.scope.records()[place.tag].record;
        let name = atom.name().unwrap_or_default();
        let is_right = *record == argument.type_name;
        let (is, help) = match place.at {
            RecordIndex::Only | RecordIndex::Constant(_) if is_right => return None,
            RecordIndex::All if is_right => {
                let one = possible(format!("{name}[0]"));
                (place.words().to_owned(), advise("give one of its records: `{}`", [one]))
            }
            RecordIndex::Word(_) if is_right => {
                let one = possible(first_of(name));
                let help = "a template owns timers and outputs of its record: give one with a \
                            constant index, `{}`";
                (format!("{} with a moving index", place.words()), advise(help, [one]))
            }
            RecordIndex::All => {
                let is = format!("{} `{record}`", place.words());
                (is, self.records_of(&argument.type_name))
            }
            RecordIndex::Only | RecordIndex::Constant(_) | RecordIndex::Word(_) => {
                (record_words(record), self.records_of(&argument.type_name))
            }
        };
        Some(misfit(argument, atom, &is).help(help))
    }

    /// The help to give a record of a type.
    fn records_of(&self, record: &str) -> Help {
        let tags = self.scope.records().iter().filter(|tag| tag.record == record);
        let names = tags.map(|tag| tag.record_name(tag.count.map(|_| 0)));
        // The tags of a template's trial are not in a file.
        let names = names.filter(|name| !name.starts_with('?'));
        let names: Vec<String> = names.take(LISTED_MAX).collect();
        if names.is_empty() {
            return format!("declare one under [tags]: `step = {{ type = \"{record}\" }}`").into();
        }
        let words = format!("give a record of this type: `{}`", names.join("`, `"));
        Help::from(words).with_all(names.into_iter().map(possible))
    }

    fn range_given(&mut self, argument: &Argument, atom: &Atom) {
        let (parameter, template) = (&argument.parameter, &argument.template);
        let message = format!("`{parameter}` of `{template}` is an array, and `{atom}` is a range");
        let finding = Finding::new(Code::TemplateArgument, atom.span, message);
        self.find(finding.label("an array belongs here").help(
            "declare a tag for these addresses, `at` the first and with `count`, and give its name",
        ));
    }

    fn wrong_argument(&mut self, argument: &Argument, atom: &Atom, thing: NamedThing) {
        let example = argument.kind.example();
        let what = match thing {
            NamedThing::Address(Address::Word(word)) if word.is_real() => "a real",
            NamedThing::Element(element) if element.array.is_real() => "a real",
            NamedThing::Element(element) if element.array.is_bits() => "a bit",
            NamedThing::Address(Address::Word(_)) | NamedThing::Element(_) => "an integer word",
            NamedThing::Address(_)
            | NamedThing::Constant(..)
            | NamedThing::Real(_)
            | NamedThing::Block(_)
            | NamedThing::Device(_)
            | NamedThing::Record(_)
            | NamedThing::Array(_) => self.kind_words(thing),
        };
        let help = match (argument.kind, thing) {
            (ParameterKind::Record, _) => self.records_of(&argument.type_name),
            (ParameterKind::Real, NamedThing::Element(element)) if !element.array.is_bits() => {
                moved_to_real(atom)
            }
            (ParameterKind::Real, NamedThing::Address(Address::Word(_))) => moved_to_real(atom),
            (ParameterKind::Real, NamedThing::Constant(value, _)) => {
                format!("write the constant as a real: `value = {value}.0`").into()
            }
            (ParameterKind::Output, NamedThing::Element(element)) if element.array.is_bits() => {
                let element = proposed(first_of(atom.name().unwrap_or_default()));
                advise("a moving index would leave bits behind: give `{}`", [element])
            }
            (_, NamedThing::Array(_)) => {
                let base = atom.name().and_then(|name| name.split('[').next()).unwrap_or_default();
                advise("give one element: `{}`", [possible(format!("{base}[0]"))])
            }
            (_, NamedThing::Address(Address::Structure(structure))) => {
                let members = structure.members().join("`, `.");
                let each = structure.members().iter();
                Help::from(format!("give a member of it: `.{members}`"))
                    .with_all(each.map(|member| possible(format!("{atom}.{member}"))))
            }
            _ => {
                let example = format!("\"{example}\"");
                Help::from(format!("for example `{example}`")).with(possible(example))
            }
        };
        self.find(misfit(argument, atom, what).help(help));
    }
}

/// The finding about an argument that is something else than its parameter requires.
fn misfit(argument: &Argument, atom: &Atom, is: &str) -> Finding {
    let wanted = type_words(argument.kind, &argument.type_name);
    let (parameter, template) = (&argument.parameter, &argument.template);
    let message = format!("`{parameter}` of `{template}` is {wanted}, and `{atom}` is {is}");
    let finding = Finding::new(Code::TemplateArgument, atom.span, message);
    finding.label(format!("{wanted} belongs here"))
}

/// The help for a word of whole numbers in the place of a real.
fn moved_to_real(atom: &Atom) -> Help {
    let instruction = format!("MOVE {atom} to=R0");
    Help::from(format!("`{instruction}` in a rung above, and give the R word"))
        .with(possible("R0").after(FixEdit::Before(instruction)))
}
