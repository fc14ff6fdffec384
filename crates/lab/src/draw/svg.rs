//! A rung as SVG, for a page or a separate picture.
//!
//! Contacts begin at the left rail; coils and boxes stand at the right rail, which all rungs of a
//! drawing have in one line, except those that are wider.
//!
//! Contacts, coils and boxes are groups with the class of their form, and with their name in
//! `data-name`; `style.css` colours them. A mark at a contact describes in words what tests have
//! not covered, since not everyone can distinguish colours.

use std::fmt::Write as _;
use std::ops::Range;

use super::circuit::{ContactForm, ContactSymbol};
use super::face::boxed;
use super::grid::{GridWire, PlacedContact, PlacedInstruction, RungGrid};
use super::wording::OperandLabel;
use crate::svg::{SvgArea, SvgWriter, escaped};

/// The width of a character, in pixels.
const CHAR: usize = 8;
/// The height of a row.
const ROW: usize = 58;
/// The distance from the upper edge of a row to its wire.
const WIRE: usize = 30;
/// The distance from the left edge to the left rail, and from the right rail to the right edge.
const MARGIN: usize = 12;
/// The least length of the wire before an instruction.
const LEAD: usize = CHAR * 2;
/// The length of the wire between a box and the right rail.
const TAIL: usize = 8;
/// The least distance from the middle of a coil to the right rail: coils with short names stand in
/// one column.
const COIL: usize = 60;
/// The width of a drawing whose rung has room in it.
const PAPER: usize = 720;
/// Half of the gap in a contact, and half of its height.
const GAP: usize = 6;
const HALF: usize = 10;

/// Additions to a drawing.
pub(super) trait Decoration {
    /// The target of a name's link; `None`: no link.
    fn link(&self, name: &str) -> Option<String>;
    /// Whether each wire is drawn separately, so that a script can light it (`draw::live_svg`).
    fn is_live(&self) -> bool {
        false
    }
    /// The width of the drawing, unless the rung is wider.
    fn room(&self) -> usize {
        PAPER
    }
    /// The class and the text of a contact's mark.
    fn mark(&self, contact: &ContactSymbol) -> Option<(&'static str, &'static str)>;
}

/// The width and height of a drawing, and its elements.
pub(super) struct Drawing {
    pub size: [usize; 2],
    pub body: String,
}

/// The elements of a rung.
pub(super) fn rung(grid: &RungGrid, with: &dyn Decoration) -> Drawing {
    let mut pen = Pen::new(grid, with);
    pen.wires(grid);
    grid.contacts.iter().for_each(|contact| pen.contact(contact));
    grid.instructions.iter().for_each(|instruction| pen.instruction(instruction));
    let height = grid.rows.max(1) * ROW;
    Drawing { size: [pen.rail + MARGIN, height], body: pen.svg.text }
}

struct Pen<'a> {
    with: &'a dyn Decoration,
    /// The position of each boundary between columns.
    boundaries: Vec<usize>,
    /// The position of the right rail.
    rail: usize,
    svg: SvgWriter,
}

/// A text at a symbol, with its position and class.
struct Label<'t> {
    text: &'t str,
    at: [usize; 2],
    class: &'static str,
}

impl<'a> Pen<'a> {
    fn new(grid: &RungGrid, with: &'a dyn Decoration) -> Pen<'a> {
        let mut widths = vec![3; grid.columns];
        for contact in &grid.contacts {
            let width = &mut widths[contact.column];
            *width = (*width).max(chars(&contact.symbol) + 2);
        }
        let mut boundaries = vec![MARGIN];
        for width in widths {
            boundaries.push(boundaries.last().unwrap_or(&0) + width * CHAR);
        }
        let extents = grid.instructions.iter().map(extent).max().unwrap_or(0);
        let needed = boundaries.last().unwrap_or(&MARGIN) + extents;
        let rail = needed.max(with.room().saturating_sub(MARGIN));
        Pen { with, boundaries, rail, svg: SvgWriter::default() }
    }

    fn x(&self, boundary: usize) -> usize {
        self.boundaries.get(boundary).copied().unwrap_or(MARGIN)
    }

    fn wires(&mut self, grid: &RungGrid) {
        let along = grid.along.iter();
        let along = along.map(|GridWire { line, from, to }| {
            format!("M{} {}H{}", self.x(*from), wire(*line), self.x(*to))
        });
        let down = grid.down.iter();
        let down = down.map(|GridWire { line, from, to }| {
            format!("M{} {}V{}", self.x(*line), wire(*from), wire(*to))
        });
        let wires: Vec<String> = along.chain(down).collect();
        let height = grid.rows.max(1) * ROW;
        self.svg.path("rail", format_args!("M{MARGIN} 0V{height}"));
        self.svg.path("rail right", format_args!("M{} 0V{height}", self.rail));
        self.svg.end_line();
        if self.with.is_live() {
            wires.iter().for_each(|path| self.wire(path));
        } else if !wires.is_empty() {
            self.wire(&wires.concat());
        }
    }

    /// Draws a wire. In a live drawing it can be lit.
    fn wire(&mut self, path: &str) {
        let lit = self.lit();
        let _ = writeln!(self.svg.text, "<path class=\"wire\"{lit} d=\"{path}\"/>");
    }

    /// The attribute of the elements that a script lights.
    fn lit(&self) -> &'static str {
        if self.with.is_live() { " data-p=\"\"" } else { "" }
    }

    fn contact(&mut self, placed: &PlacedContact) {
        let PlacedContact { row, column, symbol } = placed;
        let (left, right, y) = (self.x(*column), self.x(*column + 1), wire(*row));
        let middle = usize::midpoint(left, right);
        let mark = self.with.mark(symbol);
        let class = mark.map(|(class, _)| format!(" {class}")).unwrap_or_default();
        let name = escaped(&symbol.label.name);
        let form = form(symbol.form);
        let (branch, leaf) = (symbol.branch.unwrap_or(0), symbol.leaf);
        let _ = write!(
            self.svg.text,
            "<g class=\"contact {form}{class}\" data-name=\"{name}\" \
             data-leaf=\"{branch}.{leaf}\"{}>",
            self.lit()
        );
        self.title(symbol.label.doc.as_deref(), mark.map(|(_, said)| said));
        self.touch(left..right, y);
        match symbol.form {
            ContactForm::Boxed | ContactForm::NotBoxed => {
                let (from, width) = (left + CHAR / 2, right - left - CHAR);
                self.wire(&format!("M{left} {y}H{from}"));
                self.wire(&format!("M{} {y}H{right}", from + width));
                self.boxed([from, y], width, &said(symbol));
            }
            ContactForm::Open
            | ContactForm::Closed
            | ContactForm::Rising
            | ContactForm::Falling
            | ContactForm::NotRising
            | ContactForm::NotFalling => {
                let (from, to) = (middle - GAP, middle + GAP);
                let (top, bottom) = (y - HALF, y + HALF);
                self.wire(&format!("M{left} {y}H{from}"));
                self.wire(&format!("M{to} {y}H{right}"));
                self.svg.path("symbol", format_args!("M{from} {top}V{bottom}M{to} {top}V{bottom}"));
                self.inside(symbol.form, [middle, y]);
                let text = symbol.label.name.as_str();
                self.label(&Label { text, at: [middle, y - HALF - 6], class: "name" });
            }
        }
        let below = [middle, y + HALF + 13];
        let address = symbol.label.address.as_deref().unwrap_or_default();
        match mark {
            Some((_, said)) => {
                let text = format!("{address} {said}");
                self.label(&Label { text: text.trim_start(), at: below, class: "mark" });
            }
            None if !address.is_empty() => {
                self.label(&Label { text: address, at: below, class: "address" });
            }
            None => {}
        }
        self.svg.text.push_str("</g>\n");
    }

    /// Draws the sign in the gap of a contact.
    fn inside(&mut self, form: ContactForm, [x, y]: [usize; 2]) {
        let (slash, letter) = match form {
            ContactForm::Open | ContactForm::Boxed | ContactForm::NotBoxed => (false, ""),
            ContactForm::Closed => (true, ""),
            ContactForm::Rising => (false, "P"),
            ContactForm::Falling => (false, "N"),
            ContactForm::NotRising => (true, "P"),
            ContactForm::NotFalling => (true, "N"),
        };
        if slash {
            let (from, to) = (x - GAP - 2, x + GAP + 2);
            let (top, bottom) = (y - HALF + 1, y + HALF - 1);
            self.svg.path("symbol", format_args!("M{from} {bottom}L{to} {top}"));
        }
        if !letter.is_empty() {
            self.label(&Label { text: letter, at: [x, y + 4], class: "letter" });
        }
    }

    fn instruction(&mut self, placed: &PlacedInstruction) {
        let symbol = &placed.symbol;
        let x = self.x(self.boundaries.len() - 1);
        let y = wire(placed.row);
        let name = match symbol.coil {
            Some(_) => &symbol.label.name,
            None => &boxed(symbol),
        };
        let class = if symbol.coil.is_some() { "coil" } else { "box" };
        let (mnemonic, name) = (symbol.mnemonic, escaped(name));
        let _ = write!(
            self.svg.text,
            "<g class=\"{class}\" data-mnemonic=\"{mnemonic}\" data-name=\"{name}\"{}>",
            self.lit()
        );
        self.title(symbol.label.doc.as_deref(), None);
        match symbol.coil {
            Some(letter) => self.coil(placed, letter, [x, y]),
            None => self.legs(placed, [x, y]),
        }
        self.touch(x..self.rail, y);
        self.svg.text.push_str("</g>\n");
    }

    /// In a live drawing, draws the area of a symbol that reacts to a press, including the space
    /// between its lines. `columns`: its left and right edge.
    fn touch(&mut self, columns: Range<usize>, y: usize) {
        if self.with.is_live() {
            let width = columns.end - columns.start;
            let area = SvgArea { x: columns.start, y: y - WIRE, width, height: ROW };
            self.svg.rect("touch", area);
        }
    }

    /// Draws a coil, with the wires to it and to the right rail.
    fn coil(&mut self, placed: &PlacedInstruction, letter: &str, [x, y]: [usize; 2]) {
        let label = &placed.symbol.label;
        let middle = self.rail - behind_coil(half_coil(label));
        let (from, to) = (middle - HALF, middle + HALF);
        let (top, bottom) = (y - HALF, y + HALF);
        self.wire(&format!("M{x} {y}H{from}"));
        // Two arcs: the x of their ends, and the x of their control point.
        for (end, pull) in [(from + 5, from - 5), (to - 5, to + 5)] {
            self.svg.path("symbol", format_args!("M{end} {top}Q{pull} {y} {end} {bottom}"));
        }
        if !letter.is_empty() {
            self.label(&Label { text: letter, at: [middle, y + 4], class: "letter" });
        }
        self.label(&Label { text: &label.name, at: [middle, y - HALF - 6], class: "name" });
        if let Some(address) = &label.address {
            self.label(&Label { text: address, at: [middle, y + HALF + 13], class: "address" });
        }
        self.tail(to, y);
    }

    /// Draws the wire from an instruction to the right rail. It is never lit.
    fn tail(&mut self, from: usize, y: usize) {
        self.svg.path("tail", format_args!("M{from} {y}H{}", self.rail));
    }

    /// Draws a box with its legs, and the wires to it and to the right rail.
    fn legs(&mut self, placed: &PlacedInstruction, [x, y]: [usize; 2]) {
        let BoxText { text, names, width } = BoxText::of(placed);
        let from = self.rail - TAIL - width;
        let last = placed.legs.last().map_or(placed.row, |(_, row)| *row);
        let (top, height) = (y - HALF - 2, (last - placed.row) * ROW + 2 * HALF + 4);
        self.svg.rect("symbol", SvgArea { x: from, y: top, width, height });
        let rows: Vec<usize> = match placed.legs.is_empty() {
            true => vec![placed.row],
            false => placed.legs.iter().map(|(_, row)| *row).collect(),
        };
        for row in rows {
            self.wire(&format!("M{x} {}H{from}", wire(row)));
        }
        for (name, row) in &placed.legs {
            let at = [from + CHAR, wire(*row) + 4];
            self.label(&Label { text: name, at, class: "leg" });
        }
        let at = [from + CHAR + names * CHAR, y + 4];
        self.label(&Label { text: &text, at, class: "text" });
        self.tail(from + width, y);
    }

    /// Draws a box with a text. `x`: its left edge; `y`: its middle.
    fn boxed(&mut self, [x, y]: [usize; 2], width: usize, text: &str) {
        let area = SvgArea { x, y: y - HALF - 2, width, height: 2 * HALF + 4 };
        self.svg.rect("symbol", area);
        self.label(&Label { text, at: [x + width / 2, y + 4], class: "inner" });
    }

    fn title(&mut self, doc: Option<&str>, mark: Option<&str>) {
        let texts: Vec<&str> = doc.into_iter().chain(mark).collect();
        if !texts.is_empty() {
            self.svg.title(&texts.join("; "));
        }
    }

    fn label(&mut self, Label { text, at, class }: &Label) {
        let link = self.with.link(text).filter(|_| *class == "name");
        if let Some(link) = &link {
            let _ = write!(self.svg.text, "<a href=\"{}\">", escaped(link));
        }
        self.svg.label(class, *at, text);
        if link.is_some() {
            self.svg.text.push_str("</a>");
        }
    }
}

/// The texts of a box, and its width.
struct BoxText {
    text: String,
    /// The width of the names of its legs, in characters.
    names: usize,
    width: usize,
}

impl BoxText {
    fn of(placed: &PlacedInstruction) -> BoxText {
        let text = boxed(&placed.symbol);
        let names = placed.legs.iter().map(|(name, _)| name.len() + 1).max().unwrap_or(0);
        let width = (text.chars().count() + names + 2) * CHAR;
        BoxText { text, names, width }
    }
}

/// Half of the width of a coil with its name and address.
fn half_coil(label: &OperandLabel) -> usize {
    let wide = label.name.chars().count().max(label.address.as_deref().map_or(0, str::len));
    (wide * CHAR / 2).max(HALF)
}

/// The distance from the middle of a coil to the right rail. `half`: half of its width.
fn behind_coil(half: usize) -> usize {
    (half + CHAR).max(COIL)
}

/// The least distance from the contacts to the right rail with an instruction between.
fn extent(placed: &PlacedInstruction) -> usize {
    if placed.symbol.coil.is_some() {
        let half = half_coil(&placed.symbol.label);
        return LEAD + half + behind_coil(half);
    }
    LEAD + BoxText::of(placed).width + TAIL
}

fn wire(row: usize) -> usize {
    row * ROW + WIRE
}

/// The text of a contact in a box.
fn said(symbol: &ContactSymbol) -> String {
    match symbol.form {
        ContactForm::NotBoxed => format!("!({})", symbol.label.name),
        ContactForm::Boxed
        | ContactForm::Open
        | ContactForm::Closed
        | ContactForm::Rising
        | ContactForm::Falling
        | ContactForm::NotRising
        | ContactForm::NotFalling => symbol.label.name.clone(),
    }
}

/// The width of a contact, in characters.
fn chars(symbol: &ContactSymbol) -> usize {
    let address = symbol.label.address.as_deref().map_or(0, str::len);
    said(symbol).chars().count().max(address) + 1
}

fn form(form: ContactForm) -> &'static str {
    match form {
        ContactForm::Open => "open",
        ContactForm::Closed => "closed",
        ContactForm::Rising => "rising",
        ContactForm::Falling => "falling",
        ContactForm::NotRising => "not-rising",
        ContactForm::NotFalling => "not-falling",
        ContactForm::Boxed => "boxed",
        ContactForm::NotBoxed => "not-boxed",
    }
}
