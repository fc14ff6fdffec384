//! A rung as lines of text: for a terminal, and for a review of changes.
//!
//! Each row has three lines: names, wires with their symbols, addresses. A row without addresses
//! has two. If the power is drawn, wires with power are heavy, symbols with power are marked, and
//! the positions of the symbols are returned.

use std::ops::{Range, RangeInclusive};

use super::face::{Face, MARK, boxed, plain};
use super::grid::{PlacedInstruction, RungGrid};
use super::power::FlowOfPower;

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
/// The wire has power.
const HEAVY: u8 = 16;

/// A space within a symbol, which hides the wire under it.
const BLANK: char = '\0';

/// The length of the wire before an instruction.
const LEAD: usize = 2;

/// Characters, and the wires under them.
struct Canvas {
    chars: Vec<Vec<char>>,
    wires: Vec<Vec<u8>>,
    /// The weight of the wires that are drawn next: `HEAVY` or 0.
    weight: u8,
}

/// A rung with its power.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PoweredRung {
    /// Its lines, without trailing spaces.
    pub lines: Vec<String>,
    /// The positions of its contacts, then of its instructions, in the order of the grid.
    pub symbols: Vec<SymbolPlace>,
}

/// The position of a symbol in the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SymbolPlace {
    /// Its line, from 0.
    pub line: usize,
    /// The column of its first character, and the column after its last.
    pub columns: Range<usize>,
    /// The operand of the symbol, or the first operand in its text; "" if there is none.
    pub operand: String,
}

/// The positions of the columns and rows of a grid on a canvas.
struct GridPlan {
    /// The column of characters of each boundary. The instructions begin at the last one.
    boundaries: Vec<usize>,
    /// The line of wires of each row.
    lines: Vec<usize>,
    width: usize,
    height: usize,
}

/// The lines of a rung, without trailing spaces.
pub fn lines(grid: &RungGrid, style: WireStyle) -> Vec<String> {
    let lay = GridPlan::of(grid, false);
    let mut canvas = Canvas::new(lay.width, lay.height);
    canvas.draw(grid, &lay, None);
    canvas.lines(style)
}

/// A rung with its power; `None`: the rung is not executed.
pub fn powered(grid: &RungGrid, flow: Option<&FlowOfPower>) -> PoweredRung {
    let lay = GridPlan::of(grid, true);
    let mut canvas = Canvas::new(lay.width, lay.height);
    let symbols = canvas.draw(grid, &lay, Some(flow));
    PoweredRung { lines: canvas.lines(WireStyle::Lines), symbols }
}

/// The power to draw: `None`: without power; `Some(None)`: the rung is not executed; otherwise the
/// flow.
type ShownPower<'f> = Option<Option<&'f FlowOfPower>>;

/// The first operand in the text of a box.
fn first_operand(text: &str) -> String {
    let of_name = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | '$' | '[' | ']');
    let mut words = text.split(|c| !of_name(c)).filter(|word| !word.is_empty());
    let is_name = |word: &&str| word.starts_with(|c: char| c.is_alphabetic() || c == '$');
    words.find(is_name).unwrap_or_default().to_owned()
}

/// The first operand of an instruction that is not a constant; for `to=D1`, the part after `=`.
fn operand_of_box(operands: &[String]) -> String {
    let value = |operand: &String| {
        first_operand(operand.split_once('=').map_or(operand, |(_, value)| value))
    };
    operands.iter().map(value).find(|value| !value.is_empty()).unwrap_or_default()
}

impl GridPlan {
    /// `marks`: whether each symbol has room for a mark.
    fn of(grid: &RungGrid, marks: bool) -> GridPlan {
        let marked = |face: Face| if marks { face.marked(false) } else { face };
        let mut widths = vec![1; grid.columns];
        let mut has_address = vec![false; grid.rows.max(1)];
        for contact in &grid.contacts {
            let face = marked(Face::of_contact(&contact.symbol));
            let width = &mut widths[contact.column];
            *width = (*width).max(face.width() + 2);
            has_address[contact.row] |= !face.below.is_empty();
        }
        let mut last = 0;
        for placed in &grid.instructions {
            let face = marked(Face::of_instruction(&placed.symbol));
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
        GridPlan { boundaries, lines, width, height: next - 1 }
    }
}

impl Canvas {
    fn new(width: usize, height: usize) -> Canvas {
        let (chars, wires) = (vec![vec![' '; width]; height], vec![vec![0; width]; height]);
        Canvas { chars, wires, weight: 0 }
    }

    /// Draws a rung. Returns the positions of its symbols.
    fn draw(&mut self, grid: &RungGrid, lay: &GridPlan, shown: ShownPower) -> Vec<SymbolPlace> {
        let flow = shown.flatten();
        let heavy = |on: Option<bool>| if on == Some(true) { HEAVY } else { 0 };
        for (at, wire) in grid.along.iter().enumerate() {
            self.weight = heavy(flow.map(|flow| flow.along[at]));
            let columns = lay.boundaries[wire.from]..=lay.boundaries[wire.to];
            self.along(lay.lines[wire.line], columns);
        }
        for (at, wire) in grid.down.iter().enumerate() {
            self.weight = heavy(flow.map(|flow| flow.down[at]));
            self.down(lay.boundaries[wire.line], lay.lines[wire.from]..=lay.lines[wire.to]);
        }
        let mut symbols = Vec::new();
        for (at, contact) in grid.contacts.iter().enumerate() {
            let power = flow.map(|flow| flow.contacts[at]);
            let line = lay.lines[contact.row];
            let (from, to) = (lay.boundaries[contact.column], lay.boundaries[contact.column + 1]);
            let middle = usize::midpoint(from, to);
            self.weight = heavy(power.map(|power| power.before));
            self.along(line, from..=middle);
            self.weight = heavy(power.map(|power| power.behind));
            self.along(line, middle..=to);
            let mut face = Face::of_contact(&contact.symbol);
            if shown.is_some() {
                face = face.marked(power.is_some_and(|power| power.conducts));
            }
            symbols.push(self.put_face(&face, line, from + 1..to));
        }
        for (at, instruction) in grid.instructions.iter().enumerate() {
            let powers = flow.map_or(&[][..], |flow| &flow.outlets[at]);
            symbols.push(self.instruction(instruction, lay, shown.map(|_| powers)));
        }
        self.weight = heavy(Some(flow.is_some()));
        self.rail();
        symbols
    }

    /// Draws a wire along a line.
    fn along(&mut self, line: usize, columns: RangeInclusive<usize>) {
        let (from, to) = columns.into_inner();
        for at in from..=to {
            self.wires[line][at] |= if at > from { LEFT } else { 0 };
            self.wires[line][at] |= if at < to { RIGHT } else { 0 };
            self.wires[line][at] |= self.weight;
        }
    }

    /// Draws a wire down a column of characters.
    fn down(&mut self, at: usize, lines: RangeInclusive<usize>) {
        let (from, to) = lines.into_inner();
        for line in from..=to {
            self.wires[line][at] |= if line > from { UP } else { 0 };
            self.wires[line][at] |= if line < to { DOWN } else { 0 };
            self.wires[line][at] |= self.weight;
        }
    }

    /// Draws the rail on the left, along all lines.
    fn rail(&mut self) {
        self.down(0, 0..=self.wires.len().saturating_sub(1));
        self.wires.iter_mut().for_each(|line| line[0] |= UP | DOWN);
    }

    /// Puts a text into a line, from the column `at` on.
    fn put(&mut self, line: usize, at: usize, text: &str) {
        let Some(row) = self.chars.get_mut(line) else { return };
        for (cell, c) in row.iter_mut().skip(at).zip(text.chars()) {
            *cell = if c == ' ' { BLANK } else { c };
        }
    }

    /// Puts a symbol in the middle of its cell. Returns its position.
    fn put_face(&mut self, face: &Face, line: usize, cell: Range<usize>) -> SymbolPlace {
        let (from, width) = (cell.start, cell.end - cell.start);
        let middle = |text: &str| from + width.saturating_sub(text.chars().count()) / 2;
        self.put(line - 1, middle(&face.above), &face.above);
        self.put(line, middle(&face.symbol), &face.symbol);
        if !face.below.is_empty() {
            self.put(line + 1, middle(&face.below), &face.below);
        }
        let at = middle(&face.symbol);
        let operand = match face.above.is_empty() {
            true => first_operand(face.symbol.trim_start_matches(['[', MARK])),
            false => face.above.clone(),
        };
        SymbolPlace { line, columns: at..at + face.symbol.chars().count(), operand }
    }

    /// Draws an instruction. `powers`: the power of each leg, or of the instruction; `None`:
    /// without room for marks.
    fn instruction(
        &mut self,
        placed: &PlacedInstruction,
        lay: &GridPlan,
        powers: Option<&[bool]>,
    ) -> SymbolPlace {
        let at = lay.boundaries.last().copied().unwrap_or(0);
        let power = |leg: usize| powers.and_then(|power| power.get(leg)).copied().unwrap_or(false);
        let heavy = |on: bool| if on { HEAVY } else { 0 };
        let mut face = Face::of_instruction(&placed.symbol);
        let line = lay.lines[placed.row];
        self.weight = heavy(power(0));
        if placed.legs.is_empty() {
            if powers.is_some() {
                face = face.marked(power(0));
            }
            let symbol = face.width().saturating_sub(face.symbol.chars().count()) / 2;
            self.along(line, at..=at + LEAD + symbol);
            let to = at + LEAD + face.width();
            let mut place = self.put_face(&face, line, at + LEAD..to);
            if placed.symbol.coil.is_none() {
                place.operand = operand_of_box(&placed.symbol.operands);
            }
            return place;
        }
        let name = placed.legs.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        let text = plain(&boxed(&placed.symbol));
        let width = text.chars().count() + name + 1;
        let last = lay.lines[placed.legs.last().map_or(placed.row, |(_, row)| *row)];
        for line in line..=last {
            self.put(line, at + LEAD, &format!("[{:width$}]", ""));
        }
        for (number, (leg, row)) in placed.legs.iter().enumerate() {
            self.weight = heavy(power(number));
            self.along(lay.lines[*row], at..=at + LEAD);
            self.put(lay.lines[*row], at + LEAD + 1, leg);
            if power(number) {
                self.put(lay.lines[*row], at + LEAD + 1 + leg.len(), &MARK.to_string());
            }
        }
        let from = at + LEAD + 2 + name;
        self.put(line, from, &text);
        let columns = from..from + text.chars().count();
        SymbolPlace { line, columns, operand: operand_of_box(&placed.symbol.operands) }
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

/// The character of a wire with these directions.
fn wire_char(wire: u8, style: WireStyle) -> char {
    if style == WireStyle::Ascii {
        return match wire & !HEAVY {
            0 => ' ',
            w if w & (UP | DOWN) == 0 => '-',
            w if w & (LEFT | RIGHT) == 0 => '|',
            _ => '+',
        };
    }
    const CHARS: [char; 16] =
        [' ', '─', '─', '─', '│', '┘', '└', '┴', '│', '┐', '┌', '┬', '│', '┤', '├', '┼'];
    const HEAVY_CHARS: [char; 16] =
        [' ', '━', '━', '━', '┃', '┛', '┗', '┻', '┃', '┓', '┏', '┳', '┃', '┫', '┣', '╋'];
    let chars = if wire & HEAVY == 0 { CHARS } else { HEAVY_CHARS };
    chars[usize::from(wire & 15)]
}
