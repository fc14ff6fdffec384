//! A rung as lines of text: for a terminal, and for a review of changes.
//!
//! Each row has three lines: names, wires with their symbols, addresses. A row without addresses
//! has two. Contacts begin at the left rail; coils and boxes stand at the right rail, which all
//! rungs have in one column, except those that are wider. If the power is drawn, wires with power
//! are heavy, symbols with power are marked, and the positions of the symbols are returned.

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

/// The least length of the wire before an instruction.
const LEAD: usize = 2;
/// The least length of the wire between an instruction and the right rail.
const TAIL: usize = 1;
/// The least room of a coil's name: coils with shorter names stand in one column.
const COIL: usize = 12;
/// The width of a drawing whose rung has room in it: a difference shows it in 80 columns.
const PAPER: usize = 78;

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
    /// The column of characters of each boundary. The wires to the instructions begin at the last
    /// one.
    boundaries: Vec<usize>,
    /// The column of the right rail.
    rail: usize,
    /// The line of wires of each row.
    lines: Vec<usize>,
    height: usize,
}

/// The lines of a rung, without trailing spaces.
pub fn lines(grid: &RungGrid, style: WireStyle) -> Vec<String> {
    let lay = GridPlan::of(grid, false, PAPER);
    let mut canvas = Canvas::new(lay.rail + 1, lay.height);
    canvas.draw(grid, &lay, None);
    canvas.lines(style)
}

/// A rung with its power; `None`: the rung is not executed. `room`: the columns of the page, whose
/// last one gets the right rail, unless the rung is wider.
pub fn powered(grid: &RungGrid, flow: Option<&FlowOfPower>, room: usize) -> PoweredRung {
    let lay = GridPlan::of(grid, true, room);
    let mut canvas = Canvas::new(lay.rail + 1, lay.height);
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

/// The texts of a box with several legs.
struct LegsText {
    /// The text of the box.
    text: String,
    /// The width of the names of the legs.
    names: usize,
}

impl LegsText {
    fn of(placed: &PlacedInstruction) -> LegsText {
        let names = placed.legs.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        LegsText { text: plain(&boxed(&placed.symbol)), names }
    }

    /// The width of the box: two edges, two blanks, the names and the text with a blank between.
    fn width(&self) -> usize {
        self.names + self.text.chars().count() + 5
    }
}

/// The width of an instruction. `marks`: whether its symbol has room for a mark.
fn width(placed: &PlacedInstruction, marks: bool) -> usize {
    if !placed.legs.is_empty() {
        return LegsText::of(placed).width();
    }
    let face = Face::of_instruction(&placed.symbol);
    let face = if marks { face.marked(false) } else { face };
    let least = if placed.symbol.coil.is_some() { COIL } else { 0 };
    face.width().max(least)
}

impl GridPlan {
    /// `marks`: whether each symbol has room for a mark. `room`: the width, unless the rung is
    /// wider.
    fn of(grid: &RungGrid, marks: bool, room: usize) -> GridPlan {
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
            last = last.max(width(placed, marks));
            has_address[placed.row] |= !Face::of_instruction(&placed.symbol).below.is_empty();
            // The lower edge of a box with legs.
            if let Some((_, row)) = placed.legs.last() {
                has_address[*row] |= row + 1 == grid.rows;
            }
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
        let needed = boundaries.last().unwrap_or(&0) + LEAD + last + TAIL;
        let rail = needed.max(room.saturating_sub(1));
        GridPlan { boundaries, rail, lines, height: next - 1 }
    }

    /// The column at which the contacts end.
    fn contacts_end(&self) -> usize {
        self.boundaries.last().copied().unwrap_or(0)
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
        self.rail(0);
        self.weight = 0;
        self.rail(lay.rail);
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

    /// Draws a rail in a column, along all lines.
    fn rail(&mut self, at: usize) {
        self.down(at, 0..=self.wires.len().saturating_sub(1));
        self.wires.iter_mut().for_each(|line| line[at] |= UP | DOWN);
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

    /// Draws an instruction, with the wires to it and to the right rail. `powers`: the power of
    /// each leg, or of the instruction; `None`: without room for marks.
    fn instruction(
        &mut self,
        placed: &PlacedInstruction,
        lay: &GridPlan,
        powers: Option<&[bool]>,
    ) -> SymbolPlace {
        if !placed.legs.is_empty() {
            return self.legs(placed, lay, powers.unwrap_or_default());
        }
        let has_power = powers.and_then(|powers| powers.first()) == Some(&true);
        let mut face = Face::of_instruction(&placed.symbol);
        if powers.is_some() {
            face = face.marked(has_power);
        }
        let (line, end) = (lay.lines[placed.row], lay.rail - TAIL);
        let from = end - width(placed, powers.is_some());
        let mut place = self.put_face(&face, line, from..end);
        self.weight = if has_power { HEAVY } else { 0 };
        self.along(line, lay.contacts_end()..=place.columns.start);
        self.weight = 0;
        self.along(line, place.columns.end - 1..=lay.rail);
        if placed.symbol.coil.is_none() {
            place.operand = operand_of_box(&placed.symbol.operands);
        }
        place
    }

    /// Draws a box with several legs: a frame, into which each leg leads. `powers`: their power.
    fn legs(&mut self, placed: &PlacedInstruction, lay: &GridPlan, powers: &[bool]) -> SymbolPlace {
        let texts = LegsText::of(placed);
        let (right, line) = (lay.rail - TAIL - 1, lay.lines[placed.row]);
        let left = right + 1 - texts.width();
        let last = lay.lines[placed.legs.last().map_or(placed.row, |(_, row)| *row)];
        self.weight = 0;
        for edge in [line - 1, last + 1] {
            self.along(edge, left..=right);
        }
        for edge in [left, right] {
            self.down(edge, line - 1..=last + 1);
        }
        self.along(line, right..=lay.rail);
        for (number, (leg, row)) in placed.legs.iter().enumerate() {
            let (line, has_power) = (lay.lines[*row], powers.get(number) == Some(&true));
            self.weight = if has_power { HEAVY } else { 0 };
            self.along(line, lay.contacts_end()..=left);
            self.put(line, left + 2, leg);
            if has_power {
                self.put(line, left + 1, &MARK.to_string());
            }
        }
        let from = left + 2 + texts.names + 1;
        self.put(line, from, &texts.text);
        let columns = from..from + texts.text.chars().count();
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
