//! Operands that are arrays, or elements of arrays.
//!
//! Called by `operand`. An element with a constant index is a plain bit or word. An element that a
//! word selects can be the target of SET, RST, MOVE, ADD and SUB.

use super::Resolver;
use super::array::{Array, ArrayElement, ShiftBits};
use super::instruction::{Filling, OperandList, OperandValue, Value};
use super::scope::{MisplacedName, NamedThing};
use crate::source::atom::{Atom, AtomKind};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Help, advise, possible, propose, text};
use crate::source::indexed::first_of;
use crate::source::span::{Located, Span};
use rungd_engine::isa::address_text::{self, AddressError};
pub use rungd_engine::isa::{Address, Mnemonic, Space, Spec};

/// Ranges as the helps show them.
const RANGES: [&str; 2] = ["C0..C7", "D0..D9"];

impl Resolver<'_> {
    /// Resolves a target that a word selects. `None` for any other operand; `Some(None)` if the
    /// target has a mistake.
    pub(super) fn selected(
        &mut self,
        atom: &Atom,
        bits: bool,
        spec: &Spec,
    ) -> Option<Option<OperandValue>> {
        let name = atom.name().filter(|name| name.contains('['))?;
        let element = match self.scope.look_up(name).map(|found| found.thing) {
            Ok(NamedThing::Element(element)) if element.array.is_bits() == bits => element,
            Ok(_) | Err(_) => return None,
        };
        // Marks its tag as used, and records the index.
        self.look_up(name, atom.span);
        Some(self.element_target(atom, element, spec))
    }

    fn element_target(
        &mut self,
        atom: &Atom,
        element: ArrayElement,
        spec: &Spec,
    ) -> Option<OperandValue> {
        let first_name = first_of(atom.name()?);
        if element.array.member.is_some() {
            self.moving_member(atom.name()?, atom.span);
            return None;
        }
        if !element.array.is_writable() {
            // Adds the finding that any of its elements would have.
            let first = Atom { kind: AtomKind::Name(first_name), span: atom.span };
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
        self.find(finding.label("a moving index would leave bits behind").help(
            propose(first_name).and(&format!(
                ", or SET and RST `{atom}`; MATH stores a bit too: `MATH {atom} = …`"
            )),
        ));
        None
    }

    /// Reports a write to a member of a structure that an index selects.
    pub(super) fn moving_member(&mut self, name: &str, span: Span) {
        let message = format!("`{name}` is written with a moving index");
        let finding = Finding::new(Code::OperandType, span, message);
        let help = advise(
            "a member of a structure is written with a constant index, `{}`; a moving one reads",
            [possible(first_of(name))],
        );
        self.find(finding.help(help));
    }

    /// Resolves a whole array, a slice, or a range of addresses. If `up`, a range must run up.
    pub(super) fn run(&mut self, atom: &Atom, spec: &Spec, up: bool) -> Option<ShiftBits> {
        let Some(name) = atom.name() else {
            self.no_array(atom, spec, "a constant");
            return None;
        };
        let range = name.split_once("..").filter(|_| !name.contains('['));
        let Some((low, high)) = range else {
            return match self.look_up(name, atom.span)? {
                NamedThing::Array(array) if array.is_structures() => {
                    self.no_array(atom, spec, "an array of structures");
                    None
                }
                NamedThing::Array(array) => Some(ShiftBits { array, down: false }),
                // A COPY with two records is none of arrays; any other one has a finding already.
                NamedThing::Record(_) if spec.mnemonic == Mnemonic::Copy => None,
                NamedThing::Record(place) => {
                    let help = self.scope.name_a_field(name, place);
                    let thing = NamedThing::Record(place);
                    let misplaced = MisplacedName { name, span: atom.span, thing };
                    self.wrong_kind(misplaced, "an array", help);
                    None
                }
                thing @ (NamedThing::Address(_)
                | NamedThing::Constant(..)
                | NamedThing::Real(_)
                | NamedThing::Block(_)
                | NamedThing::Device(_)
                | NamedThing::Element(_)) => {
                    let what = self.kind_words(thing);
                    self.no_array(atom, spec, what);
                    None
                }
            };
        };
        let (first, last) = (self.end(low, atom.span)?, self.end(high, atom.span)?);
        if first.0 != last.0 {
            let message = format!("the ends of `{name}` lie in two memory blocks");
            self.find(Finding::new(Code::OperandType, atom.span, message));
            return None;
        }
        let down = first.1 > last.1;
        if down && up {
            let message = format!("`{name}` goes from high to low");
            let finding = Finding::new(Code::OutOfRange, atom.span, message);
            self.find(finding.write(format!("{high}..{low}")));
            return None;
        }
        let (from, to) = (first.1.min(last.1), first.1.max(last.1));
        let array =
            Array { space: first.0, first: from, count: to - from + 1, member: None, bit: None };
        self.note_array(name, atom.span, array, None);
        Some(ShiftBits { array, down })
    }

    /// Resolves an end of a range.
    fn end(&mut self, name: &str, span: Span) -> Option<(Space, u32)> {
        let plain = |address: &Address| match address {
            Address::Bit(_) | Address::Word(_) => true,
            Address::Structure(_) => false,
        };
        if let Err(AddressError::NotAnAddress) = address_text::parse(name, &self.options.sizes) {
            let message = format!("a range ends at addresses, not at `{name}`");
            let finding = Finding::new(Code::OperandType, span, message);
            let help = "write `C0..C7`, or declare an array: a tag with `count`";
            self.find(finding.help(help).fixes(RANGES.map(possible)));
            return None;
        }
        let thing = self.look_up(name, span)?;
        let address = match thing {
            NamedThing::Address(address) => Some(address).filter(plain),
            NamedThing::Constant(..)
            | NamedThing::Real(_)
            | NamedThing::Block(_)
            | NamedThing::Device(_)
            | NamedThing::Array(_)
            | NamedThing::Record(_)
            | NamedThing::Element(_) => None,
        };
        let end = address.and_then(Space::of);
        if end.is_none() {
            let what = if is_of_word(thing) { "a bit of a word" } else { self.kind_words(thing) };
            let message = format!("a range ends at bits or words, not at `{name}`, {what}");
            let finding = Finding::new(Code::OperandType, span, message);
            self.find(finding.help("write `C0..C7` or `D0..D9`").fixes(RANGES.map(possible)));
        }
        end
    }

    fn no_array(&mut self, atom: &Atom, spec: &Spec, what: &str) {
        let message = format!("`{atom}` is {what}, not an array");
        let finding = Finding::new(Code::OperandType, atom.span, message);
        let of_bits = matches!(spec.mnemonic, Mnemonic::Sr | Mnemonic::Pack | Mnemonic::Unpack);
        let range = if of_bits { "C0..C7" } else { "D0..D9" };
        self.find(finding.label("an array belongs here").help(advise(
            &format!(
                "`{}` works on an array, a slice `recipe[0..6]`, or a range: `{{}}`",
                spec.name
            ),
            [possible(range)],
        )));
    }

    /// The run, if a program may write it; otherwise adds the finding of its first element.
    pub(super) fn writable_run(
        &mut self,
        run: ShiftBits,
        atom: &Atom,
        spec: &Spec,
    ) -> Option<ShiftBits> {
        if run.array.is_writable() {
            return Some(run);
        }
        let first = run.array.element(0).to_string();
        let first = Atom { kind: AtomKind::Name(first), span: atom.span };
        match run.array.is_bits() {
            true => drop(self.writable_bit(&first, spec)),
            false => drop(self.writable_word(&first, spec)),
        }
        None
    }

    pub(super) fn shifted(&mut self, run: ShiftBits, atom: &Atom) -> Option<OperandValue> {
        if run.array.is_bits() {
            return Some(OperandValue::Run(run));
        }
        let message = format!("`{atom}` is of words: a shift register is of bits");
        let finding = Finding::new(Code::OperandType, atom.span, message);
        let help = "write `SR C0..C7`, or name an array of bits";
        self.find(finding.help(help).fix(possible("C0..C7")));
        None
    }

    /// Resolves the operand that FILL writes: a bit, or a value.
    pub(super) fn filling(&mut self, atom: &Atom) -> Option<OperandValue> {
        let thing = atom.name().map(|name| self.scope.look_up(name).map(|found| found.thing));
        match (thing, atom.name()) {
            (Some(Ok(thing)), Some(name)) if is_of_word(thing) => {
                self.look_up(name, atom.span);
                let message = format!("`FILL` takes no bit of a word, as `{name}`");
                let finding = Finding::new(Code::OperandType, atom.span, message);
                let help = "fill with a bit that has a place of its own: `OUT C0` from it above";
                self.find(finding.help(help).fix(possible("C0")));
                None
            }
            (Some(Ok(NamedThing::Address(address @ Address::Bit(bit)))), Some(name)) => {
                self.look_up(name, atom.span);
                self.note(name, atom.span, address);
                Some(OperandValue::Bit(bit))
            }
            (Some(Ok(NamedThing::Element(element))), Some(name)) if element.array.is_bits() => {
                self.look_up(name, atom.span);
                Some(OperandValue::Element(element))
            }
            _ => self.value(atom).map(OperandValue::Value),
        }
    }

    /// Whether the operands of COPY and FILL fit each other; if not, adds a finding.
    pub(super) fn arrays_fit(&mut self, operands: &OperandList, spec: &Spec) -> bool {
        let Some(to) = operands.get::<Array>("to") else { return true };
        if let Some(from) = operands.get::<Array>("from") {
            return self.copy_fits(from, to);
        }
        let Some(value) = operands.get::<Filling>("value") else { return true };
        let fits = match value.value {
            Filling::Bit(_) | Filling::Element(_) => to.value.is_bits(),
            Filling::Value(Value::Const(0 | 1, _)) => true,
            Filling::Value(_) => !to.value.is_bits(),
        };
        if !fits {
            let (what, help) = match to.value.is_bits() {
                true => ("bits", "bits take `0`, `1` or a bit"),
                false => ("words", "words take a constant or a word"),
            };
            let message = format!("`{}` of {what} takes no such value", spec.name);
            let finding = Finding::new(Code::OperandType, value.span, message).help(help);
            self.find(finding.fixes(["1", "0"].map(possible)));
        }
        fits
    }

    fn copy_fits(&mut self, from: Located<Array>, to: Located<Array>) -> bool {
        let kind = |array: Array| if array.is_bits() { "bits" } else { "words" };
        let (a, b) = (from.value, to.value);
        let (message, help) = if a.is_bits() != b.is_bits() {
            let message = format!("`COPY` of {} to {}", kind(a), kind(b));
            let [source, target] = [a, b].map(|array| self.scope.places().say(array.element(0)));
            let one = if a.is_bits() { source } else { format!("{source} != 0") };
            let help = "COPY copies bits to bits and words to words; one element at a time:";
            let math = format!("MATH {target} = {one}");
            (message, Help::from(format!("{help} `{math}`")).with(possible(math)))
        } else if a.count != b.count {
            let message = format!("`COPY` of {} elements to {}", a.count, b.count);
            let (longer, count) = if a.count > b.count { (from, b.count) } else { (to, a.count) };
            (message, self.first_of(longer, count, "both have the same number of elements"))
        } else {
            return true;
        };
        let finding = Finding::new(Code::OperandType, to.span, message);
        self.find(finding.related(from.span, "from here").help(help));
        false
    }

    /// The help to name only the first elements of an array; `words` say why.
    pub(super) fn first_of(&self, array: Located<Array>, count: u32, words: &str) -> Help {
        let last = count - 1;
        let ends = [0, last].map(|at| self.scope.places().say(array.value.element(at)));
        let name = self.text(array.span);
        let is_whole = self.scope.tag_index(name).is_some();
        let [first, end] = ends;
        match is_whole && !name.contains('[') {
            true => advise(
                &format!("name a part of `{name}`, as `{{}}`"),
                [text(format!("{name}[0..{last}]")).at(array.span).possible()],
            ),
            false => Help::from(format!("{words}: `{first}` to `{end}` are {count}"))
                .with(possible(format!("{first}..{end}")).at(array.span)),
        }
    }
}

/// Whether a thing is a bit of a word.
fn is_of_word(thing: NamedThing) -> bool {
    match thing {
        NamedThing::Address(address) => address.without_bit() != address,
        NamedThing::Element(element) => element.array.bit.is_some(),
        NamedThing::Constant(..)
        | NamedThing::Real(_)
        | NamedThing::Block(_)
        | NamedThing::Device(_)
        | NamedThing::Record(_)
        | NamedThing::Array(_) => false,
    }
}
