//! The contacts of a part of a rung, with their states when the rung was executed.

use super::logic::{Leaves, Logic};
use super::operands;
use super::seen_values::{SeenValue, select, side};
use super::subject::Subject;
use rungd_engine::isa::status::st;
use rungd_engine::isa::{Address, Bit, BitSpace, LegName, Word, WordSpace};
use rungd_engine::ops::Power;
use rungd_engine::{Cell, Image};
use rungd_language::lower::formula_value::{CellFormula, FormulaNumber};
use rungd_language::resolve::formula::Formula;
use rungd_language::resolve::program::Contact;

/// The state of a contact.
#[derive(Clone, Debug)]
pub(super) struct LeafSeen {
    /// The number of the step right after its evaluation.
    pub step: u32,
    /// Its power.
    pub power: Power,
    /// Whether it was ON.
    pub on: bool,
    /// For a compare, left and right; for an element, the index; for a contact that computes, the
    /// bits and words that it reads.
    pub sides: Vec<SeenValue>,
    /// The bit of an element; `None` if the index is outside of the array.
    pub selected: Option<Cell>,
    /// For a compare that computes, the values of its sides.
    pub computed: Vec<FormulaNumber>,
    /// Whether these values are times.
    pub is_time: bool,
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

/// The powers of a part's own contacts, in the order of its leaves.
pub(super) fn powers(subject: &Subject, part: u32) -> &[Power] {
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
        let computed = computed(subject, contact, image);
        let is_time = matches!(contact, Contact::Computed(computed, _)
            if computed.formulas().any(Formula::is_time));
        LeafSeen { step, power: *power, on, sides, selected, computed, is_time }
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
        Contact::Computed(computed, _) => {
            let read = computed.formulas().flat_map(|each| operands::formula(subject, each, image));
            let mut sides: Vec<SeenValue> = Vec::new();
            for side in read {
                if !sides.iter().any(|other| other.cell == side.cell) {
                    sides.push(side);
                }
            }
            (sides, None)
        }
        Contact::Bit(..)
        | Contact::Not(..)
        | Contact::All(..)
        | Contact::Any(..)
        | Contact::Edge(..) => (Vec::new(), None),
    }
}

/// The values of the sides of a compare that computes.
fn computed(subject: &Subject, contact: &Contact, image: &Image) -> Vec<FormulaNumber> {
    let Contact::Computed(computed, _) = contact else { return Vec::new() };
    if computed.compare.is_none() {
        return Vec::new();
    }
    let layout = &subject.symbols.layout;
    let value = |formula| CellFormula::new(formula, layout).value(image).number;
    computed.formulas().map(value).collect()
}

/// Whether the start of a scan writes an address.
pub(super) fn is_status(address: Option<Address>) -> bool {
    match address {
        Some(Address::Bit(Bit::Space(BitSpace::St, n))) => n < st::COUNT as u32,
        Some(Address::Word(Word::Space(WordSpace::Dst, _))) => true,
        Some(Address::Bit(_) | Address::Word(_) | Address::Structure(_)) | None => false,
    }
}
