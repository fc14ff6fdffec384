//! The contacts of a part of a rung, with their states when the rung was executed.

use super::logic::{Leaves, Logic};
use super::subject::Subject;
use rungd_engine::isa::status::st;
use rungd_engine::isa::{Address, Bit, BitSpace, LegName, Word, WordSpace};
use rungd_engine::ops::Power;
use rungd_engine::{Cell, Image};
use rungd_language::resolve::array::ArrayElement;
use rungd_language::resolve::program::{Contact, Value};

/// The state of a contact.
#[derive(Clone, Debug)]
pub(super) struct LeafSeen {
    /// The number of the step right after its evaluation.
    pub step: u32,
    /// Its power.
    pub power: Power,
    /// Whether it was ON.
    pub on: bool,
    /// For a compare, left and right; for an element, the index.
    pub sides: Vec<SeenValue>,
    /// The bit of an element; `None` if the index is outside of the array.
    pub selected: Option<Cell>,
}

/// A value in a contact or an instruction.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeenValue {
    /// The content of its cell, or the constant.
    pub value: i32,
    /// Its cell; `None` for a constant, and for an element outside of its array.
    pub cell: Option<Cell>,
    /// Whether it is a real.
    pub real: bool,
    /// Whether it is a 0 that a sum or an OR adds.
    pub adds_nothing: bool,
}

impl SeenValue {
    /// A constant.
    pub fn constant(value: i32, real: bool) -> SeenValue {
        SeenValue { value, cell: None, real, adds_nothing: false }
    }

    /// The content of a cell.
    pub fn of(cell: Cell, value: i32, real: bool) -> SeenValue {
        SeenValue { value, cell: Some(cell), real, adds_nothing: false }
    }
}

/// A leg: its contacts as one boolean expression over the leaves of its part.
#[derive(Debug)]
pub(super) struct LegLogic<'p> {
    pub name: LegName,
    pub logic: Logic,
    /// Its contacts, in series.
    pub series: Vec<&'p Contact>,
}

/// The legs of a part; the contacts of a branch come after those of its rung.
pub(super) fn legs<'p>(subject: &'p Subject, part: u32) -> (Vec<LegLogic<'p>>, Leaves<'p>) {
    let mut leaves = Leaves::default();
    let mut legs = Vec::new();
    let branch = subject.branch(part).map_or(&[][..], |branch| &branch.contacts);
    for leg in &subject.rung(part).legs {
        let series: Vec<&Contact> = leg.contacts.iter().chain(branch).collect();
        let logic = Logic::All(series.iter().map(|contact| leaves.add(contact)).collect());
        legs.push(LegLogic { name: leg.name, logic, series });
    }
    (legs, leaves)
}

/// The contacts of a part; for a branch, without the contacts of its rung.
pub(super) fn own_contacts(subject: &Subject, part: u32) -> Vec<&Contact> {
    match subject.branch(part) {
        Some(branch) => branch.contacts.iter().collect(),
        None => subject.rung(part).legs.iter().flat_map(|leg| &leg.contacts).collect(),
    }
}

/// The states of a part's own contacts, in the order of its leaves, right after their evaluation.
pub(super) fn states(subject: &Subject, part: u32, image: &Image) -> Vec<bool> {
    powers(subject, part).iter().map(|power| image.power(*power)).collect()
}

fn powers(subject: &Subject, part: u32) -> &[Power] {
    let leaves = &subject.part(part).leaves;
    subject.sites.leaves.get(leaves.start as usize..leaves.end as usize).unwrap_or_default()
}

/// The same states, with all values that the contacts read.
pub(super) fn look(subject: &Subject, part: u32, step: u32, image: &Image) -> Vec<LeafSeen> {
    let mut leaves = Leaves::default();
    own_contacts(subject, part).into_iter().for_each(|contact| {
        leaves.add(contact);
    });
    let on = states(subject, part, image);
    let all = leaves.contacts.iter().zip(powers(subject, part)).zip(on);
    all.map(|((contact, power), on)| {
        let (sides, selected) = values(subject, contact, image);
        LeafSeen { step, power: *power, on, sides, selected }
    })
    .collect()
}

fn values(subject: &Subject, contact: &Contact, image: &Image) -> (Vec<SeenValue>, Option<Cell>) {
    match contact {
        Contact::Compare(a, _, b, _) => {
            (vec![side(subject, *a, image), side(subject, *b, image)], None)
        }
        Contact::Element(element, _) => {
            let (index, bit) = select(subject, *element, image);
            (vec![index], bit)
        }
        Contact::Bit(..)
        | Contact::Not(..)
        | Contact::All(..)
        | Contact::Any(..)
        | Contact::Edge(..) => (Vec::new(), None),
    }
}

/// A value in an image.
pub(super) fn side(subject: &Subject, value: Value, image: &Image) -> SeenValue {
    let real = value.is_real();
    match value {
        Value::Const(value, _) => SeenValue::constant(value, real),
        Value::Real(value) => SeenValue::constant(value.cell(), real),
        Value::Word(at) => word(subject, at, image),
        Value::Element(element) => {
            let cell = select(subject, element, image).1;
            let value = cell.map_or(0, |cell| image.value(cell));
            SeenValue { cell, ..SeenValue::constant(value, real) }
        }
    }
}

/// A word in an image.
pub(super) fn word(subject: &Subject, word: Word, image: &Image) -> SeenValue {
    let cell = Cell::Word(subject.symbols.layout.word(word));
    SeenValue::of(cell, image.value(cell), word.is_real())
}

/// The word that selects an element, and the selected cell.
pub(super) fn select(
    subject: &Subject,
    element: ArrayElement,
    image: &Image,
) -> (SeenValue, Option<Cell>) {
    let index = word(subject, element.index, image);
    let at = u32::try_from(index.value).ok().filter(|at| *at < element.array.count);
    let cell = at.and_then(|at| subject.symbols.layout.cell(element.array.element(at)));
    (index, cell)
}

/// Whether the start of a scan writes an address.
pub(super) fn is_status(address: Option<Address>) -> bool {
    match address {
        Some(Address::Bit(Bit::Space(BitSpace::St, n))) => n < st::COUNT as u32,
        Some(Address::Word(Word::Space(WordSpace::Dst, _))) => true,
        Some(Address::Bit(_) | Address::Word(_) | Address::Structure(_)) | None => false,
    }
}
