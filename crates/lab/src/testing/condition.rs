//! A condition of a test: contacts as in a ladder, with arithmetic in compares.
//!
//! `reading` makes it from a resolved condition. `runner` evaluates it on the image at the end of a
//! scan; the evaluation allocates nothing and looks up no name. `docs/testing.md` describes its
//! form.

use rungd_engine::isa::NumberSet;
use rungd_engine::{Cell, Image, Layout, WordCell};
use rungd_language::lower::formula_value::{ArrayCells, CellFormula};
use rungd_language::resolve::array::ArrayElement;
use rungd_language::resolve::condition::ResolvedCondition;
use rungd_language::resolve::program::{ComputedContact, Contact};
use rungd_language::source::contact::Edge;
use rungd_language::source::indexed::IndexedName;

/// A condition with its operands.
#[derive(Clone, Debug)]
pub struct Condition {
    /// The text of the condition.
    pub text: String,
    /// Its operands, each once, in the order in which they are written: name and cell. The operand
    /// of `recipe[step]` is `step`; [`Condition::elements`] returns the element.
    pub operands: Vec<(String, Cell)>,
    /// The number of its edges: `rise(…)`, `fall(…)`.
    pub edges: usize,
    /// The condition as contacts of the program as its conditions see it, for a proof.
    pub contact: Contact,
    /// The elements that words select, with their names as they are written.
    selected: Vec<(String, ElementCells)>,
    whole: ConditionPart,
}

/// A boolean expression over cells.
#[derive(Clone, Debug)]
enum ConditionPart {
    Bit(Cell),
    Element(ElementCells),
    Not(Box<ConditionPart>),
    All(Box<[ConditionPart]>),
    Any(Box<[ConditionPart]>),
    /// An edge: its number, and the expression inside.
    Edge(Edge, usize, Box<ConditionPart>),
    /// A compare or a bit whose index computes: ON unless the number is 0.
    Computed(CellFormula),
}

/// An element of an array that a word selects.
#[derive(Clone, Copy, Debug)]
struct ElementCells {
    array: ArrayCells,
    /// The word that contains the number of the element.
    index: WordCell,
}

impl ElementCells {
    fn new(element: ArrayElement, layout: &Layout) -> ElementCells {
        let array = ArrayCells::new(element.array, layout);
        ElementCells { array, index: layout.word(element.index) }
    }

    /// The cell of the currently selected element; `None`: the index is outside of the array.
    fn cell(&self, image: &Image) -> Option<Cell> {
        self.array.cell(image.word(self.index).into())
    }
}

impl Condition {
    /// A condition over the cells of a program.
    pub(super) fn new(text: &str, resolved: ResolvedCondition, layout: &Layout) -> Condition {
        let mut seen = NumberSet::default();
        let reads = resolved.reads.into_iter().filter(|operand| seen.insert(operand.address));
        let operands = reads.filter_map(|operand| {
            let cell = layout.cell(operand.address)?;
            Some((operand.name().into_owned(), cell))
        });
        let selected = resolved.elements.into_iter();
        let mut edges = 0;
        let whole = ConditionPart::of(&resolved.contact, layout, &mut edges);
        Condition {
            text: text.trim().to_owned(),
            operands: operands.collect(),
            edges,
            contact: resolved.contact,
            selected: selected
                .map(|(name, cells)| (name, ElementCells::new(cells, layout)))
                .collect(),
            whole,
        }
    }

    /// Whether it is true on an image. `edges`: the value inside each edge at the end of the scan
    /// before (OFF before the first scan after a start). The call replaces them by the values of
    /// this image.
    pub fn is_true(&self, image: &Image, edges: &mut [bool]) -> bool {
        self.whole.is_true(image, edges)
    }

    /// The operands that decide its current value: for a false `&`, those of its false parts; for a
    /// true `|`, those of its true parts. Each once, in the order of `operands`.
    pub(super) fn deciding(&self, image: &Image) -> Vec<Cell> {
        let mut cells = Vec::new();
        self.whole.deciding(image, &mut cells);
        let operands = self.operands.iter().map(|(_, cell)| *cell);
        operands.filter(|cell| cells.contains(cell)).collect()
    }

    /// The elements that words select, as they are written: `recipe[step]`.
    pub(super) fn selected(&self) -> impl Iterator<Item = &str> {
        self.selected.iter().map(|(written, _)| written.as_str())
    }

    /// The elements that words select on an image, as `recipe[3]`. An index outside of its array
    /// has no element.
    pub fn elements(&self, image: &Image) -> Vec<(String, Cell)> {
        let element = |(written, cells): &(String, ElementCells)| {
            let IndexedName { base, behind, .. } = IndexedName::of(written)?;
            let at = image.word(cells.index);
            Some((format!("{base}[{at}]{behind}"), cells.cell(image)?))
        };
        self.selected.iter().filter_map(element).collect()
    }
}

impl ConditionPart {
    fn of(resolved: &Contact, layout: &Layout, edges: &mut usize) -> ConditionPart {
        let mut all = |items: &[Contact]| -> Box<[ConditionPart]> {
            items.iter().map(|item| ConditionPart::of(item, layout, edges)).collect()
        };
        match resolved {
            Contact::Bit(bit, _) => ConditionPart::Bit(layout.bit_in(*bit)),
            Contact::Element(element, _) => {
                ConditionPart::Element(ElementCells::new(*element, layout))
            }
            Contact::Not(inner, _) => {
                ConditionPart::Not(Box::new(ConditionPart::of(inner, layout, edges)))
            }
            Contact::All(items, _) => ConditionPart::All(all(items)),
            Contact::Any(items, _) => ConditionPart::Any(all(items)),
            Contact::Edge(edge, inner, _) => {
                let number = *edges;
                *edges += 1;
                ConditionPart::Edge(
                    *edge,
                    number,
                    Box::new(ConditionPart::of(inner, layout, edges)),
                )
            }
            Contact::Compare(a, comparison, b, _) => {
                let whole = ComputedContact::of_values(*a, *comparison, *b).condition();
                ConditionPart::Computed(CellFormula::new(&whole, layout))
            }
            Contact::Computed(computed, _) => {
                ConditionPart::Computed(CellFormula::new(&computed.condition(), layout))
            }
        }
    }

    /// Its value; `None` if the value depends on an edge.
    fn known(&self, image: &Image) -> Option<bool> {
        match self {
            ConditionPart::Edge(..) => None,
            ConditionPart::Not(inner) => inner.known(image).map(|value| !value),
            ConditionPart::All(items) => series(items, image, false),
            ConditionPart::Any(items) => series(items, image, true),
            ConditionPart::Bit(_) | ConditionPart::Element(_) | ConditionPart::Computed(_) => {
                Some(self.is_true(image, &mut []))
            }
        }
    }

    fn deciding(&self, image: &Image, into: &mut Vec<Cell>) {
        match self {
            ConditionPart::Bit(cell) => into.push(*cell),
            ConditionPart::Element(element) => into.push(Cell::Word(element.index)),
            ConditionPart::Not(inner) | ConditionPart::Edge(_, _, inner) => {
                inner.deciding(image, into)
            }
            ConditionPart::All(items) | ConditionPart::Any(items) => {
                let value = self.known(image);
                let decides = |item: &&ConditionPart| {
                    item.known(image).is_none_or(|known| Some(known) == value)
                };
                let all = value.is_none() || value == Some(matches!(self, ConditionPart::All(_)));
                let items = items.iter().filter(|item| all || decides(item));
                items.for_each(|item| item.deciding(image, into));
            }
            ConditionPart::Computed(formula) => into.extend(formula.cells()),
        }
    }

    /// Evaluates every part, even if the result is already known: edges need the value of each
    /// scan.
    fn is_true(&self, image: &Image, edges: &mut [bool]) -> bool {
        match self {
            ConditionPart::Bit(cell) => image.value(*cell) != 0,
            ConditionPart::Element(element) => match element.cell(image) {
                Some(cell @ (Cell::Bit(_) | Cell::WordBit(_))) => image.value(cell) != 0,
                Some(Cell::Word(_)) | None => false,
            },
            ConditionPart::Not(inner) => !inner.is_true(image, edges),
            ConditionPart::All(items) => {
                items.iter().fold(true, |all, item| item.is_true(image, edges) & all)
            }
            ConditionPart::Any(items) => {
                items.iter().fold(false, |any, item| item.is_true(image, edges) | any)
            }
            ConditionPart::Edge(edge, number, inner) => {
                let now = inner.is_true(image, edges);
                let before =
                    edges.get_mut(*number).map_or(now, |seen| std::mem::replace(seen, now));
                match edge {
                    Edge::Rise => now && !before,
                    Edge::Fall => !now && before,
                }
            }
            ConditionPart::Computed(formula) => {
                let value = formula.value(image);
                value.number.is_true() && !value.is_outside
            }
        }
    }
}

/// The value of a series in which a single part with the value `decides` decides the result.
fn series(items: &[ConditionPart], image: &Image, decides: bool) -> Option<bool> {
    let mut known = Some(!decides);
    for item in items {
        match item.known(image) {
            Some(value) if value == decides => return Some(decides),
            Some(_) => {}
            None => known = None,
        }
    }
    known
}
