//! Resolves the consecutive bits or words that a map or a list of writes names.
//!
//! The forms are `X0..X15`, `CT0.Acc..CT7.Acc`, an array, or a single bit or word of any kind,
//! including a Stage. A [`range`](super::range), in contrast, contains whole structures and no
//! members. Used by `modbus_server` and `device`.

use super::mistake::{bit_of_block, bits_of_device};
use super::range::{Range, is_slice, look_up, other_range, placed_in};
use super::record::RecordIndex;
use super::scope::{NamedThing, Scope};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, Help, advise, possible};
use crate::source::reader::Text;
use crate::source::span::Span;
use rungd_engine::isa::{Address, Bit, NumberRange, Space, Word, WordBit};

/// Bits or words of one kind with consecutive numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Operands {
    /// The first bit or word; never a whole structure.
    pub first: Address,
    /// Their number; at least 1.
    pub count: u32,
    /// The text as written, which is the only name of a Stage or a block.
    pub text: String,
    /// Whether it belongs to a tag with a `type`.
    pub is_placed: bool,
    /// Its place.
    pub span: Span,
}

impl Operands {
    /// All addresses, in order.
    pub fn addresses(&self) -> impl Iterator<Item = Address> + '_ {
        let number = number(self.first).unwrap_or(0);
        (0..self.count).map(move |at| numbered(self.first, number + at))
    }

    /// Whether an address is among them.
    pub fn hold(&self, address: Address) -> bool {
        let (Some(first), Some(n)) = (number(self.first), number(address)) else {
            return self.first == address;
        };
        let alike = numbered(self.first, 0) == numbered(address, 0);
        alike && (first..first + self.count).contains(&n)
    }
}

impl std::fmt::Display for Operands {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (number(self.first), self.count) {
            _ if self.is_placed => f.write_str(&self.text),
            (None, _) => f.write_str(&self.text),
            (Some(_), 1) => self.first.fmt(f),
            (Some(n), count) => {
                write!(f, "{}..{}", self.first, numbered(self.first, n + count - 1))
            }
        }
    }
}

/// Resolves `A..B`, an array, or a single bit or word.
///
/// # Errors
/// A finding: an end is not a bit or word, the ends are of different kinds, or they are in the
/// wrong order.
pub fn resolve_operands(scope: &Scope, text: &Text) -> Result<Operands, Finding> {
    if let Some(finding) = other_range(scope, text) {
        return Err(finding);
    }
    let written = text.text.trim();
    let finding = |message: String| Finding::new(Code::Controller, text.span, message);
    let range = written.split_once("..").filter(|_| !is_slice(written));
    let Some((low, high)) = range else {
        let whole = look_up(scope, written, text.span)?;
        if let NamedThing::Array(array) = whole
            && !array.is_structures()
        {
            let (first, count) = (array.element(0), array.count);
            let (text, span) = (written.to_owned(), text.span);
            let is_placed = scope.places().at(first).is_some();
            return Ok(Operands { first, count, text, is_placed, span });
        }
        let first = element(scope, written, text.span)?;
        let (text, span) = (written.to_owned(), text.span);
        let is_placed = scope.places().at(first).is_some();
        return Ok(Operands { first, count: 1, text, is_placed, span });
    };
    let (low, high) = (low.trim(), high.trim());
    let (first, last) = (element(scope, low, text.span)?, element(scope, high, text.span)?);
    let (Some(from), Some(to)) = (number(first), number(last)) else {
        let message = format!("`{written}`: Stages and blocks stand alone, not in a range");
        return Err(finding(message));
    };
    if let Some(word) = [first, last].into_iter().find(|end| end.without_bit() != *end) {
        let message = format!("`{word}` is a bit of a word: it stands alone, not in a range");
        return Err(finding(message));
    }
    if numbered(first, 0) != numbered(last, 0) {
        let message = format!("a range is of one kind, not of `{first}` and `{last}`");
        return Err(finding(message));
    }
    if let Some((space, _)) = Space::with_members(first) {
        let (first, last) = (from.min(to), from.max(to));
        let range = Range { space, first, last, span: text.span, of_tag: false, of_record: false };
        if let Some(finding) = placed_in(scope, &range, low) {
            return Err(finding);
        }
    }
    if to < from {
        let finding = finding("a range goes from low to high".to_owned());
        return Err(finding.write(format!("{high}..{low}")));
    }
    let (count, span, text) = (to - from + 1, text.span, written.to_owned());
    Ok(Operands { first, count, text, is_placed: false, span })
}

fn element(scope: &Scope, name: &str, span: Span) -> Result<Address, Finding> {
    let wrong =
        |message: String, help: Help| Err(Finding::new(Code::Controller, span, message).help(help));
    let constant = |value: String| {
        wrong(
            format!("`{name}` is a constant, {value}: no memory holds it"),
            Help::from("name a bit or word").with(possible(FixEdit::Omit)),
        )
    };
    match look_up(scope, name, span)? {
        NamedThing::Address(Address::Structure(structure)) => wrong(
            format!("`{name}` is a whole structure, not a bit or word"),
            Help::from(format!("name a member: `.{}`", structure.members().join("`, `.")))
                .with_all(
                    structure.members().iter().map(|member| possible(format!("{name}.{member}"))),
                ),
        ),
        NamedThing::Address(address) => Ok(address),
        NamedThing::Constant(value, _) => constant(value.to_string()),
        NamedThing::Real(real) => constant(real.to_string()),
        NamedThing::Array(array) => wrong(
            format!("`{name}` is an array, not a bit or word"),
            advise(
                &format!("name an element, `{{}}`, or the array alone: {array}"),
                [possible(format!("{name}[0]"))],
            ),
        ),
        NamedThing::Record(place) => wrong(
            format!("`{name}` is {}, not a bit or word", place.words()),
            match place.at {
                RecordIndex::All => scope.name_a_column(name, place),
                RecordIndex::Only | RecordIndex::Constant(_) | RecordIndex::Word(_) => {
                    scope.name_a_field(name, place)
                }
            },
        ),
        NamedThing::Element(_) => wrong(
            format!("the index of `{name}` is a word"),
            "an element has a constant index here".into(),
        ),
        NamedThing::Device(_) => wrong(
            format!("`{name}` is a device"),
            advise("its bits are `{}`, `{}`", bits_of_device(name)),
        ),
        NamedThing::Block(_) => wrong(format!("`{name}` is a block"), bit_of_block(name)),
    }
}

/// The numbers of `count` addresses from `first` on, with their kind: the address with number 0. An
/// address without a number is a kind of its own, with number 0.
pub fn numbers(first: Address, count: u32) -> NumberRange<Address> {
    match number(first) {
        Some(n) => NumberRange { kind: numbered(first, 0), first: n, last: n + count - 1 },
        None => NumberRange::one(first, 0),
    }
}

/// The number of an address; `None` if it has none.
fn number(address: Address) -> Option<u32> {
    match address {
        Address::Bit(Bit::Space(_, n)) | Address::Word(Word::Space(_, n) | Word::Pre(n)) => Some(n),
        Address::Bit(Bit::Flag(structure, _)) | Address::Word(Word::Acc(structure)) => {
            Some(structure.number())
        }
        Address::Bit(Bit::InWord(bit)) => number(Address::Word(bit.word)),
        Address::Bit(Bit::Stage(_) | Bit::Running(_) | Bit::Done(_) | Bit::Device(..))
        | Address::Structure(_) => None,
    }
}

/// The address of the same kind with number `n`.
pub(crate) fn numbered(address: Address, n: u32) -> Address {
    match address {
        Address::Bit(Bit::Space(space, _)) => Address::Bit(Bit::Space(space, n)),
        Address::Bit(Bit::Flag(structure, flag)) => {
            Address::Bit(Bit::Flag(structure.numbered(n), flag))
        }
        Address::Word(Word::Space(space, _)) => Address::Word(Word::Space(space, n)),
        Address::Word(Word::Acc(of)) => Address::Word(Word::Acc(of.numbered(n))),
        Address::Word(Word::Pre(_)) => Address::Word(Word::Pre(n)),
        Address::Bit(Bit::InWord(bit)) => match numbered(Address::Word(bit.word), n) {
            Address::Word(word) => Address::Bit(Bit::InWord(WordBit { word, ..bit })),
            other @ (Address::Bit(_) | Address::Structure(_)) => other,
        },
        Address::Bit(Bit::Stage(_) | Bit::Running(_) | Bit::Done(_) | Bit::Device(..))
        | Address::Structure(_) => address,
    }
}
