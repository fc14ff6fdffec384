//! A rung as lines of text: for a terminal, and for a review of what has changed.
//!
//! Three lines a row: names, wires with their symbols, addresses. Rows without addresses have two.

use super::circuit::{ContactForm, ContactSymbol, InstructionSymbol};
use super::grid::{PlacedInstruction, RungGrid};

/// The characters of wires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WireStyle {
    /// Box drawing characters.
    Lines,
    /// `-`, `|` and `+`.
    Ascii,
}

/// The directions in which a wire leaves a character.
const LEFT: u8 = 1;
const RIGHT: u8 = 2;
const UP: u8 = 4;
const DOWN: u8 = 8;

/// A space that hides the wire under it: within a contact.
const BLANK: char = '\0';

/// The wire before an instruction.
const LEAD: usize = 2;

/// Characters, and the wires under them.
struct Canvas {
    chars: Vec<Vec<char>>,
    wires: Vec<Vec<u8>>,
}

/// Where columns and rows of a grid lie on a canvas.
struct Lay {
    /// By boundary: its column of characters. The last one is where the instructions begin.
    boundaries: Vec<usize>,
    /// By row: its line of wires.
    lines: Vec<usize>,
    width: usize,
    height: usize,
}

/// The lines of a rung, without spaces at their ends.
pub fn lines(grid: &RungGrid, style: WireStyle) -> Vec<String> {
    let lay = Lay::of(grid);
    let mut canvas = Canvas::new(lay.width, lay.height);
    for (row, from, to) in &grid.along {
        canvas.along(lay.lines[*row], (lay.boundaries[*from], lay.boundaries[*to]));
    }
    for (column, from, to) in &grid.down {
        canvas.down(lay.boundaries[*column], (lay.lines[*from], lay.lines[*to]));
    }
    for contact in &grid.contacts {
        let line = lay.lines[contact.row];
        let (from, to) = (lay.boundaries[contact.column], lay.boundaries[contact.column + 1]);
        canvas.along(line, (from, to));
        let face = Face::of_contact(&contact.symbol);
        canvas.put_face(&face, (line, from + 1, to));
    }
    let at = lay.boundaries[grid.columns];
    for instruction in &grid.instructions {
        canvas.instruction(instruction, (&lay, at));
    }
    canvas.rail();
    canvas.lines(style)
}

/// What is written at a contact or coil.
struct Face {
    above: String,
    symbol: String,
    below: String,
}

impl Face {
    fn of_contact(symbol: &ContactSymbol) -> Face {
        let name = plain(&symbol.label.name);
        let below = symbol.label.address.clone().unwrap_or_default();
        let plain = |symbol: &str| Face { above: name.clone(), symbol: symbol.to_owned(), below };
        match symbol.form {
            ContactForm::Open => plain("] ["),
            ContactForm::Closed => plain("]/["),
            ContactForm::Rising => plain("]P["),
            ContactForm::Falling => plain("]N["),
            ContactForm::NotRising => plain("]/P["),
            ContactForm::NotFalling => plain("]/N["),
            ContactForm::Boxed => {
                Face { above: String::new(), symbol: format!("[{name}]"), below: String::new() }
            }
            ContactForm::NotBoxed => {
                Face { above: String::new(), symbol: format!("[!({name})]"), below: String::new() }
            }
        }
    }

    fn of_instruction(symbol: &InstructionSymbol) -> Face {
        match symbol.coil {
            Some(letter) => Face {
                above: plain(&symbol.label.name),
                symbol: format!("({})", if letter.is_empty() { " " } else { letter }),
                below: symbol.label.address.clone().unwrap_or_default(),
            },
            None => Face {
                above: String::new(),
                symbol: format!("[{}]", plain(&boxed(symbol))),
                below: String::new(),
            },
        }
    }

    fn width(&self) -> usize {
        let widths = [&self.above, &self.symbol, &self.below].map(|of| of.chars().count());
        widths.into_iter().max().unwrap_or(0)
    }
}

/// A name without characters that a terminal obeys.
fn plain(name: &str) -> String {
    name.replace(char::is_control, "?")
}

/// The text of a box: the mnemonic with its operands.
pub(super) fn boxed(symbol: &InstructionSymbol) -> String {
    let operands = symbol.operands.iter().map(String::as_str);
    std::iter::once(symbol.mnemonic).chain(operands).collect::<Vec<_>>().join(" ")
}

impl Lay {
    fn of(grid: &RungGrid) -> Lay {
        let mut widths = vec![1; grid.columns];
        let mut has_address = vec![false; grid.rows.max(1)];
        for contact in &grid.contacts {
            let face = Face::of_contact(&contact.symbol);
            let width = &mut widths[contact.column];
            *width = (*width).max(face.width() + 2);
            has_address[contact.row] |= !face.below.is_empty();
        }
        let mut last = 0;
        for placed in &grid.instructions {
            let face = Face::of_instruction(&placed.symbol);
            let legs = placed.legs.iter().map(|(name, _)| name.len() + 1).max().unwrap_or(0);
            last = last.max(face.width() + legs);
            has_address[placed.row] |= !face.below.is_empty();
        }
        let mut boundaries = vec![0];
        for width in widths {
            boundaries.push(boundaries.last().unwrap_or(&0) + width + 1);
        }
        let mut lines = Vec::new();
        let mut next = 1;
        for has_address in has_address {
            lines.push(next);
            next += 2 + usize::from(has_address);
        }
        let width = boundaries.last().unwrap_or(&0) + LEAD + last + 3;
        Lay { boundaries, lines, width, height: next - 1 }
    }
}

impl Canvas {
    fn new(width: usize, height: usize) -> Canvas {
        Canvas { chars: vec![vec![' '; width]; height], wires: vec![vec![0; width]; height] }
    }

    fn along(&mut self, line: usize, (from, to): (usize, usize)) {
        for at in from..=to {
            self.wires[line][at] |= if at > from { LEFT } else { 0 };
            self.wires[line][at] |= if at < to { RIGHT } else { 0 };
        }
    }

    fn down(&mut self, at: usize, (from, to): (usize, usize)) {
        for line in from..=to {
            self.wires[line][at] |= if line > from { UP } else { 0 };
            self.wires[line][at] |= if line < to { DOWN } else { 0 };
        }
    }

    /// The rail on the left, beside all lines.
    fn rail(&mut self) {
        self.down(0, (0, self.wires.len().saturating_sub(1)));
        self.wires.iter_mut().for_each(|line| line[0] |= UP | DOWN);
    }

    fn put(&mut self, (line, at): (usize, usize), text: &str) {
        let Some(row) = self.chars.get_mut(line) else { return };
        for (cell, c) in row.iter_mut().skip(at).zip(text.chars()) {
            *cell = if c == ' ' { BLANK } else { c };
        }
    }

    /// A contact in the middle of its cell.
    fn put_face(&mut self, face: &Face, (line, from, to): (usize, usize, usize)) {
        let middle = |text: &str| from + (to - from).saturating_sub(text.chars().count()) / 2;
        self.put((line - 1, middle(&face.above)), &face.above);
        self.put((line, middle(&face.symbol)), &face.symbol);
        if !face.below.is_empty() {
            self.put((line + 1, middle(&face.below)), &face.below);
        }
    }

    fn instruction(&mut self, placed: &PlacedInstruction, (lay, at): (&Lay, usize)) {
        let face = Face::of_instruction(&placed.symbol);
        let line = lay.lines[placed.row];
        if placed.legs.is_empty() {
            let symbol = face.width().saturating_sub(face.symbol.chars().count()) / 2;
            self.along(line, (at, at + LEAD + symbol));
            let to = at + LEAD + face.width();
            return self.put_face(&face, (line, at + LEAD, to));
        }
        let name = placed.legs.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        let text = plain(&boxed(&placed.symbol));
        let width = text.chars().count() + name + 1;
        let last = lay.lines[placed.legs.last().map_or(placed.row, |(_, row)| *row)];
        for line in line..=last {
            self.put((line, at + LEAD), &format!("[{:width$}]", ""));
        }
        for (leg, row) in &placed.legs {
            self.along(lay.lines[*row], (at, at + LEAD));
            self.put((lay.lines[*row], at + LEAD + 1), leg);
        }
        self.put((line, at + LEAD + 2 + name), &text);
    }

    fn lines(&self, style: WireStyle) -> Vec<String> {
        let cell = |(c, wire): (&char, &u8)| match *c {
            ' ' => wire_char(*wire, style),
            BLANK => ' ',
            other => other,
        };
        let line = |(chars, wires): (&Vec<char>, &Vec<u8>)| {
            let text: String = chars.iter().zip(wires).map(cell).collect();
            text.trim_end().to_owned()
        };
        self.chars.iter().zip(&self.wires).map(line).collect()
    }
}

/// The character of a wire that leaves in these directions.
fn wire_char(wire: u8, style: WireStyle) -> char {
    if style == WireStyle::Ascii {
        return match wire {
            0 => ' ',
            w if w & (UP | DOWN) == 0 => '-',
            w if w & (LEFT | RIGHT) == 0 => '|',
            _ => '+',
        };
    }
    const CHARS: [char; 16] =
        [' ', '─', '─', '─', '│', '┘', '└', '┴', '│', '┐', '┌', '┬', '│', '┤', '├', '┼'];
    CHARS[usize::from(wire & 15)]
}
