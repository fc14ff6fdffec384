//! The compares of a ladder, with the values of their sides when their rung was executed.
//!
//! Called by `power` for each scan that is shown, and by `live` for the text of a compare. The
//! values are those of `lower::formula_value`, which computes whatever is explained or tested.

use super::leaves::own_contacts;
use super::logic::Leaves;
use super::subject::Subject;
use rungd_engine::isa::duration;
use rungd_engine::{Cell, Image};
use rungd_language::lower::formula_value::CellFormula;
pub use rungd_language::lower::formula_value::FormulaNumber;
use rungd_language::resolve::formula::Formula;
use rungd_language::resolve::program::{ComputedContact, Contact};
use rungd_language::source::contact::Comparison;

/// A compare of a ladder.
#[derive(Debug)]
pub struct LadderCompare {
    /// Its number among the contacts of the program.
    pub contact: u32,
    /// How it compares, and how its values are shown.
    pub text: CompareText,
    sides: [CellFormula; 2],
}

/// The form in which the values of a compare are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CompareText {
    comparison: Comparison,
    /// Whether a side is the time of a timer, so that both are.
    is_time: bool,
}

impl CompareText {
    /// The form of a compare; `is_time`: whether a side is the time of a timer.
    pub fn new(comparison: Comparison, is_time: bool) -> CompareText {
        CompareText { comparison, is_time }
    }

    /// The values of the sides with the sign between them: `40 >= 50`, `1s500ms < 3s`.
    pub fn with(self, [left, right]: [FormulaNumber; 2]) -> String {
        let side = |value: FormulaNumber| match value {
            // Reals have the digits of a real: a page has room for no more.
            FormulaNumber::Real(real) => (real as f32).to_string(),
            FormulaNumber::Integer(_) => side_text(value, self.is_time),
        };
        format!("{} {} {}", side(left), self.comparison.sign(), side(right))
    }
}

/// The value of a side; `is_time`: whether it is a time: `40`, `1s500ms`.
pub(super) fn side_text(value: FormulaNumber, is_time: bool) -> String {
    let ms = match value {
        FormulaNumber::Integer(number) if is_time => i32::try_from(number).ok(),
        FormulaNumber::Integer(_) | FormulaNumber::Real(_) => None,
    };
    match ms {
        Some(ms @ i32::MIN..0) => format!("-{}", duration::print(ms.saturating_neg())),
        Some(ms) => duration::print(ms),
        None => value.to_string(),
    }
}

impl LadderCompare {
    fn of(subject: &Subject, contact: u32, computed: &ComputedContact) -> Option<LadderCompare> {
        let compare = computed.compare.as_ref()?;
        let layout = &subject.symbols.layout;
        let side = |formula| CellFormula::new(formula, layout);
        let is_time = computed.formulas().any(Formula::is_time);
        let text = CompareText { comparison: compare.comparison, is_time };
        let sides = [side(&computed.left), side(&compare.right)];
        Some(LadderCompare { contact, text, sides })
    }

    /// The cells that it reads; of an element, those of its index.
    pub(super) fn cells(&self) -> impl Iterator<Item = Cell> {
        self.sides.iter().flat_map(CellFormula::cells)
    }

    /// Whether it reads elements of arrays.
    pub(super) fn has_elements(&self) -> bool {
        self.sides.iter().any(CellFormula::has_elements)
    }

    /// The values of its sides in an image.
    pub(super) fn values(&self, image: &Image) -> [FormulaNumber; 2] {
        self.sides.each_ref().map(|side| side.value(image).number)
    }
}

impl Subject {
    /// All compares of the program, in the order of its contacts.
    pub fn compares(&self) -> Vec<LadderCompare> {
        let mut all = Vec::new();
        for (part, place) in (0..).zip(&self.sites.parts) {
            let mut leaves = Leaves::default();
            own_contacts(self, part).into_iter().for_each(|contact| drop(leaves.add(contact)));
            let numbered = (place.leaves.start..).zip(leaves.contacts);
            all.extend(numbered.filter_map(|(number, contact)| match contact {
                Contact::Compare(a, comparison, b, _) => {
                    let computed = ComputedContact::of_values(*a, *comparison, *b);
                    LadderCompare::of(self, number, &computed)
                }
                Contact::Computed(computed, _) => LadderCompare::of(self, number, computed),
                Contact::Bit(..)
                | Contact::Element(..)
                | Contact::Not(..)
                | Contact::All(..)
                | Contact::Any(..)
                | Contact::Edge(..) => None,
            }));
        }
        all
    }
}
