//! A circuit on a grid of columns and rows, with symbols in cells, and wires between them.
//!
//! `text` and `svg` draw the same grid. A wire is on the middle line of a row, or on the boundary
//! between two columns. Points that are joined by wires are one node, and no two nodes touch.

use super::circuit::{Circuit, ContactSymbol, InstructionSymbol, Outlet, RungCircuit};

/// A rung with the positions of its parts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RungGrid {
    /// The number of columns of contacts. The instructions are in one more column.
    pub columns: usize,
    /// The number of rows.
    pub rows: usize,
    /// The contacts.
    pub contacts: Vec<PlacedContact>,
    /// The instructions.
    pub instructions: Vec<PlacedInstruction>,
    /// Wires along rows: `line` is the row, the ends are boundaries.
    pub along: Vec<GridWire>,
    /// Wires down: `line` is the boundary, the ends are rows.
    pub down: Vec<GridWire>,
}

/// A straight wire, longer than 0. The number of a boundary is the number of the column after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridWire {
    /// The row or boundary on which the wire is.
    pub line: usize,
    /// The boundary or row at its start.
    pub from: usize,
    /// The boundary or row at its end.
    pub to: usize,
}

/// A place of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GridPlace {
    /// The column, or the boundary before it.
    pub column: usize,
    /// The row.
    pub row: usize,
}

/// A contact in a cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlacedContact {
    /// Its row.
    pub row: usize,
    /// Its column.
    pub column: usize,
    /// The contact.
    pub symbol: ContactSymbol,
}

/// An instruction at the end of one or several rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlacedInstruction {
    /// Its first row.
    pub row: usize,
    /// The names and rows of several legs; empty for one leg.
    pub legs: Vec<(&'static str, usize)>,
    /// The instruction.
    pub symbol: InstructionSymbol,
}

impl RungGrid {
    /// Places a rung.
    pub fn of(rung: &RungCircuit) -> RungGrid {
        let mut grid = RungGrid::default();
        match rung {
            RungCircuit::Plain(contacts, outlets) => grid.plain(contacts, outlets),
            RungCircuit::Legs(legs, symbol) => grid.legs(legs, symbol),
        }
        grid
    }

    fn plain(&mut self, contacts: &Circuit, outlets: &[Outlet]) {
        let (width, height) = self.place(contacts, GridPlace { column: 0, row: 0 });
        let wide = outlets.iter().map(|outlet| match outlet {
            Outlet::Instruction(_) => 0,
            Outlet::Branch(circuit, _) => size(circuit).0,
        });
        self.columns = width + wide.max().unwrap_or(0);
        let (mut row, mut last) = (0, 0);
        for outlet in outlets {
            last = row;
            let at = GridPlace { column: width, row };
            row = match outlet {
                Outlet::Instruction(symbol) => {
                    self.end(symbol, at);
                    row + 1
                }
                Outlet::Branch(circuit, body) => self.branch(circuit, body, at),
            };
        }
        self.wire_down(GridWire { line: width, from: 0, to: last });
        self.rows = row.max(height);
    }

    /// Places the contacts of a branch, with their instructions. Returns the row after the branch.
    fn branch(&mut self, circuit: &Circuit, body: &[InstructionSymbol], at: GridPlace) -> usize {
        let (width, height) = self.place(circuit, at);
        let (row, end, count) = (at.row, at.column + width, body.len());
        for (n, symbol) in body.iter().enumerate() {
            self.end(symbol, GridPlace { column: end, row: row + n });
        }
        self.wire_down(GridWire { line: end, from: row, to: row + count.saturating_sub(1) });
        row + height.max(count).max(1)
    }

    fn legs(&mut self, legs: &[(&'static str, Circuit)], symbol: &InstructionSymbol) {
        self.columns = legs.iter().map(|(_, circuit)| size(circuit).0).max().unwrap_or(0);
        let (mut row, mut rows) = (0, Vec::new());
        for (name, circuit) in legs {
            let (width, height) = self.place(circuit, GridPlace { column: 0, row });
            self.wire_along(GridWire { line: row, from: width, to: self.columns });
            rows.push((*name, row));
            row += height;
        }
        self.rows = row;
        self.instructions.push(PlacedInstruction { row: 0, legs: rows, symbol: symbol.clone() });
    }

    /// Places an instruction at the end of a row, with the wire that leads to it.
    fn end(&mut self, symbol: &InstructionSymbol, GridPlace { column, row }: GridPlace) {
        self.wire_along(GridWire { line: row, from: column, to: self.columns });
        let symbol = symbol.clone();
        self.instructions.push(PlacedInstruction { row, legs: Vec::new(), symbol });
    }

    /// Places a circuit at a column and row. Returns its width and height.
    fn place(&mut self, circuit: &Circuit, at: GridPlace) -> (usize, usize) {
        let GridPlace { column, row } = at;
        match circuit {
            Circuit::Contact(symbol) => {
                self.contacts.push(PlacedContact { row, column, symbol: symbol.clone() });
                (1, 1)
            }
            Circuit::Series(parts) => {
                let (mut width, mut height) = (0, 1);
                for part in parts {
                    let placed_size = self.place(part, GridPlace { column: column + width, row });
                    (width, height) = (width + placed_size.0, height.max(placed_size.1));
                }
                (width, height)
            }
            Circuit::Parallel(parts) => {
                let width = size(circuit).0;
                let (mut height, mut last) = (0, row);
                for part in parts {
                    last = row + height;
                    let placed_size = self.place(part, GridPlace { column, row: last });
                    let (from, to) = (column + placed_size.0, column + width);
                    self.wire_along(GridWire { line: last, from, to });
                    height += placed_size.1;
                }
                for line in [column, column + width] {
                    self.wire_down(GridWire { line, from: row, to: last });
                }
                (width, height)
            }
        }
    }

    /// Adds a wire along a row, unless its length is 0.
    fn wire_along(&mut self, wire: GridWire) {
        if wire.from < wire.to {
            self.along.push(wire);
        }
    }

    /// Adds a wire down a boundary, unless its length is 0.
    fn wire_down(&mut self, wire: GridWire) {
        if wire.from < wire.to {
            self.down.push(wire);
        }
    }
}

/// The width and height of a circuit.
fn size(circuit: &Circuit) -> (usize, usize) {
    match circuit {
        Circuit::Contact(_) => (1, 1),
        Circuit::Series(parts) => parts
            .iter()
            .map(size)
            .fold((0, 1), |all, part_size| (all.0 + part_size.0, all.1.max(part_size.1))),
        Circuit::Parallel(parts) => parts
            .iter()
            .map(size)
            .fold((0, 0), |all, part_size| (all.0.max(part_size.0), all.1 + part_size.1)),
    }
}
