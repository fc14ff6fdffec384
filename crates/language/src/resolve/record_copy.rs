//! COPY of a record: an operand that is read and one that is written for each of its fields.
//!
//! Called by `operand`. Fields are tags with names of their own, so each is looked up as if the
//! ladder named it. Fields that are structures are left alone.

use super::Resolver;
use super::instruction::{CopiedPlace, Instruction, OperandList, OperandType, ResolvedOperand};
use super::record::{RecordIndex, RecordPlace};
use super::scope::{MisplacedName, NamedThing};
use super::tag::TagMeaning;
use crate::source::atom::Atom;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Help, advise, possible};
use crate::source::instruction::{OperandText, WrittenInstruction};
pub use rungd_engine::isa::{Address, Mnemonic, Spec};

/// An operand of a COPY that names a record.
#[derive(Clone, Copy)]
struct NamedRecord<'t> {
    name: &'t str,
    atom: &'t Atom,
    place: RecordPlace,
}

impl Resolver<'_> {
    /// Resolves a COPY with a record among its operands. `None` for any other instruction;
    /// `Some(None)` if it has a mistake.
    pub(super) fn record_copy(
        &mut self,
        text: &WrittenInstruction,
        spec: &'static Spec,
    ) -> Option<Option<Instruction>> {
        let is_to =
            |operand: &OperandText| operand.key.as_ref().is_some_and(|key| key.value == "to");
        let (from, to) = match &text.operands[..] {
            [from, to] if spec.mnemonic == Mnemonic::Copy && is_to(to) => (from, to),
            [to, from] if spec.mnemonic == Mnemonic::Copy && is_to(to) => (from, to),
            _ => return None,
        };
        let atoms = [&from.value, &to.value];
        if from.key.is_some() || !atoms.iter().any(|atom| self.is_record(atom)) {
            return None;
        }
        let [from, to] = atoms.map(|atom| self.record_operand(atom));
        let (Some(from), Some(to)) = (from, to) else { return Some(None) };
        Some(self.copy_of_fields(text, spec, RecordCopy { from, to }))
    }

    fn is_record(&self, atom: &Atom) -> bool {
        let found = atom.name().map(|name| self.scope.look_up(name).map(|found| found.thing));
        matches!(found, Some(Ok(NamedThing::Record(_))))
    }

    /// The record that an operand names; anything else becomes a finding.
    fn record_operand<'t>(&mut self, atom: &'t Atom) -> Option<NamedRecord<'t>> {
        let wanted = "a record";
        let name = self.name_of(atom, wanted)?;
        let thing = self.look_up(name, atom.span)?;
        let NamedThing::Record(place) = thing else {
            let help = Help::from("COPY copies a record to a record of the same type");
            self.wrong_kind(MisplacedName { name, span: atom.span, thing }, wanted, help);
            return None;
        };
        if place.at != RecordIndex::All {
            return Some(NamedRecord { name, atom, place });
        }
        let message = format!("`{name}` is {}: COPY copies one record", place.words());
        let finding = Finding::new(Code::OperandType, atom.span, message);
        let field = self.scope.field(name, RecordPlace { at: RecordIndex::Only, ..place });
        let one = [possible(format!("{name}[0]"))];
        let words = format!("name one of them, `{{}}`; or copy each column: `COPY {field} to=…`");
        self.find(finding.help(advise(&words, one)));
        None
    }

    fn copy_of_fields(
        &mut self,
        text: &WrittenInstruction,
        spec: &'static Spec,
        RecordCopy { from, to }: RecordCopy,
    ) -> Option<Instruction> {
        let record = |one: NamedRecord| &self.scope.records()[one.place.tag];
        if record(from).record != record(to).record {
            self.two_types(RecordCopy { from, to });
            return None;
        }
        let fields: Vec<String> = self.plain_fields(from.place);
        if fields.is_empty() {
            let message = format!("`{}` has no bit or word to copy", from.name);
            let finding = Finding::new(Code::OperandType, from.atom.span, message);
            self.find(finding.help("structures are not copied: copy their members one by one"));
            return None;
        }
        let [from_row, to_row] = ["from", "to"].map(|name| {
            let row = spec.operands.iter().find(|row| row.name == name);
            row.expect("COPY has both operands")
        });
        let mut operands = OperandList::default();
        for field in &fields {
            let value = self.field_of(from, field)?.read().operand();
            operands.0.push(ResolvedOperand { row: from_row, value, span: from.atom.span });
            let value = self.field_of(to, field)?.operand();
            operands.0.push(ResolvedOperand { row: to_row, value, span: to.atom.span });
        }
        let mnemonic = spec.mnemonic;
        Some(Instruction { mnemonic, span: text.span, operands, calculation: None })
    }

    /// The names of the fields of a record that are bits or words, in its order.
    fn plain_fields(&self, place: RecordPlace) -> Vec<String> {
        let record = &self.scope.records()[place.tag];
        let is_plain = |field: &&str| match self.scope.tag(&format!("{}.{field}", record.name)) {
            Some((_, Some(TagMeaning::Address(Address::Structure(_))))) => false,
            Some((_, Some(TagMeaning::Array(array)))) => !array.is_structures(),
            Some((_, Some(_))) => true,
            // A field with a mistake, which has a finding.
            Some((_, None)) | None => false,
        };
        let names = record.fields.iter().map(|field| field.name.as_str());
        names.filter(is_plain).map(str::to_owned).collect()
    }

    /// Looks up a field of a record.
    fn field_of(&mut self, record: NamedRecord, field: &str) -> Option<CopiedPlace> {
        let name = format!("{}.{field}", record.name);
        let thing = self.look_up(&name, record.atom.span)?;
        if let NamedThing::Address(address) = thing {
            self.note(&name, record.atom.span, address);
        }
        match thing {
            NamedThing::Address(Address::Bit(bit)) => Some(CopiedPlace::Bit(bit)),
            NamedThing::Address(Address::Word(word)) => Some(CopiedPlace::Word(word)),
            NamedThing::Element(element) => Some(CopiedPlace::Element(element)),
            NamedThing::Address(Address::Structure(_))
            | NamedThing::Constant(..)
            | NamedThing::Real(_)
            | NamedThing::Block(_)
            | NamedThing::Device(_)
            | NamedThing::Array(_)
            | NamedThing::Record(_) => None,
        }
    }

    fn two_types(&mut self, RecordCopy { from, to }: RecordCopy) {
        let record = |one: NamedRecord| &self.scope.records()[one.place.tag];
        let (source, target) = (record(from), record(to));
        let message = format!("`COPY` of a `{}` to a `{}`", source.record, target.record);
        let alike = self.scope.records().iter().filter(|other| other.record == source.record);
        let names = alike.map(|other| other.record_name(other.count.map(|_| 0)));
        let others = names.filter(|name| name != from.name).map(possible);
        let words = format!("COPY copies to a record of the same type, `{}`", source.record);
        let finding = Finding::new(Code::OperandType, to.atom.span, message);
        let finding = finding.label(format!("a `{}`", target.record));
        let finding = finding.related(from.atom.span, format!("a `{}`", source.record));
        let help = Help::from(words).with_all(others.take(3));
        self.find(finding.help(help));
    }
}

/// The operands of a COPY of a record.
#[derive(Clone, Copy)]
struct RecordCopy<'t> {
    from: NamedRecord<'t>,
    to: NamedRecord<'t>,
}
